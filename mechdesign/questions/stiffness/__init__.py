"""How stiff is it? Legs, screws and compliance."""
