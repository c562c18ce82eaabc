"""Which linkages do it? From positions of a body, a function or a path to the linkages, each a study."""
