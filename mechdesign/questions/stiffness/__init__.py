"""How stiff is it? Legs, screws and compliance."""

HELP_PAGE = "theory/stiffness"
