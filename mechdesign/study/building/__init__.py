"""From the sections of a study to the mechanism that they describe."""
