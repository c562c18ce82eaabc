"""The command line: commands, exit codes, tables on the terminal, files. No numerics."""
