"""What a study says of errors: tolerances, clearances, limits, methods, allocation; and the checks of it."""
