"""Files for other tools: parts to cut, drawings, the layers of a stack; each is declared where it is made."""
