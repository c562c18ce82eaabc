"""Local performance indices: a file each, whose name is the index's, with its declaration ``INDEX``."""
