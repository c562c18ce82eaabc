"""Many designs of a study: compiled once, evaluated together, judged by one rule."""
