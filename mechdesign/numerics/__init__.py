"""Mathematics that knows no mechanism: types of arrays, roots, minima."""
