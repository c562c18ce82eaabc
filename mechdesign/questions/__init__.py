"""The seven questions, a package each; an analysis is a pure function of the study and a seed."""
