"""Pictures of errors: over a sweep or a map, densities, histograms, convergence, contributions, and the reliability."""
