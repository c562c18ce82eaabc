"""Pictures of dynamics: efforts, joint forces, bearings, free bodies, shaking force, energies."""
