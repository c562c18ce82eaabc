"""Pictures of the cases of a matrix: what each entry does to each result, every two against another, and as maps."""
