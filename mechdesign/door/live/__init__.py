"""A study in the hand: a page on this machine in which dimensions are dragged, and the engine answers."""
