"""Pictures of a motion: curves, paths, single poses, how force is passed on, and other assemblies of the same links."""
