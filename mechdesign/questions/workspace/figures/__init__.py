"""Pictures of a workspace: maps of indices, the boundary with the mechanism in several poses, ranges of the drives."""
