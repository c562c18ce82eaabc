"""How does it move? Positions, rates, limits of motion and loops."""
