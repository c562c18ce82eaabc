"""Whether given coordinates determine a mechanism: its equations must not depend on each other.

A perfect matching of equations and unknowns is necessary, but not enough: in two dimensions a part may be joined
within itself too often while another floats, and every count still fits. So the rank of the equations is taken for
dimensions drawn at random.
"""

from __future__ import annotations

import numpy as np

from mechdesign.mechanism.rigidity import Equations, null_space
from mechdesign.mechanism.structure import Structure, Undetermined

# Draws of the dimensions of which one has to be regular: of a train of 200 four-bars one in three is.
DRAWS = 50


def check_independent(equations: Equations, structure: Structure) -> None:
    """Check a mechanism with groups without a closed form for equations that depend on each other.

    Chance, or a long train, can make a draw singular, but never singular equations regular: one regular draw tells.

    Raises
    ------
    Undetermined
        If there are any whatever the dimensions: a part that floats is joined within itself too often.
    """
    if not any(group.form == "newton" for group in structure.groups):
        return
    singular = False
    for seed in range(DRAWS):
        draw = equations.drawn(structure.given, seed)
        # A given expression may have no value at what is drawn, which says nothing.
        if np.isfinite(draw).all():
            singular = null_space(draw).shape[1] > 0
            if not singular:
                return
    if singular:
        raise Undetermined("the given coordinates fix one part of the mechanism twice and leave another free")
