"""Two folders of results: what moved, what is missing and what is new."""
