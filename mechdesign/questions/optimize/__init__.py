"""Which dimensions are best? Designs, their goals and the ways to look for the best one."""
