"""Pictures of cases and of sensitivities."""
