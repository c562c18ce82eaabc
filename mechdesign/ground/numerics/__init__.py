"""Mathematics without mechanisms: array types, roots, minima, Chebyshev series, fronts, probabilities."""
