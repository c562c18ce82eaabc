"""What drives it, what does it bear? Efforts of the drives, forces in the joints, shaking forces and energies."""
