"""Elements of a mechanism, each one class: what a study says of it, key by key, and what it does."""
