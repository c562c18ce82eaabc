"""What a study file may say of each question, and the checks of it against the mechanism."""
