"""The region of the plane that a point can reach, by rays about a centre. Imports none of the questions."""
