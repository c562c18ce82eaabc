"""What a study says of its cases and of its sensitivities, and the checks of it."""
