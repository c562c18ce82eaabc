"""What a user meets: command line, Python, reports, files for other tools."""
