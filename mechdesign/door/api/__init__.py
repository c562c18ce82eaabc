"""The Python interface: studies and results that show themselves in notebooks, and the questions as functions."""
