"""Pictures of a synthesis: the linkages with the task, and what they trade."""
