"""Pictures of a stiffness: equivalent springs [S4, Fig. 6], directions, curves or maps, deflections, free motion."""
