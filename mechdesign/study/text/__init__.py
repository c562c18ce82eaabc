"""The text of a study: YAML with the place of each value, numbers with units, and mistakes with their place."""
