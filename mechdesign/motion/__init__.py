"""A motion as a curve: what lies between its poses, and functions along it."""
