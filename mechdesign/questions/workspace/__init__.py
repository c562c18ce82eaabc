"""Where can it work? Regions, their boundaries and what an index is worth in them."""
