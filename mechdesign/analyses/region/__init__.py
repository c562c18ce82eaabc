"""Where a point can be: its region of the plane, by rays about a centre. Knows none of the questions."""
