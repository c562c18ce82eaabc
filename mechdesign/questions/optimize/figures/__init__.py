"""Pictures of an optimisation, whatever its method: score, goals, designs, front, convergence, and the optimum."""
