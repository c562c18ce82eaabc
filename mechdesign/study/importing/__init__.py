"""Studies from the files and addresses of other tools: a reader for each format, one sketch, one writer of studies."""
