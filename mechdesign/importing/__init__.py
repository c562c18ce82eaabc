"""Studies from the files and addresses of other tools: a reader for each format, one sketch, one writer of studies."""

HELP_PAGE = "howto/import"
