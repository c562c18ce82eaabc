"""How precise is it once it is made? Sources of error, first-order errors and simulation."""
