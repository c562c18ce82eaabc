"""What pictures of a region need besides its tables."""

from __future__ import annotations

from dataclasses import dataclass

from mechdesign.ground.results import Drawn
from mechdesign.mechanism import Configuration
from mechdesign.questions.workspace.ellipses import Ellipses


@dataclass(frozen=True, eq=False)
class DrawnRegion(Drawn):
    """The mechanism in the first region.

    Parameters
    ----------
    along : Configuration, shape (places,)
        Poses with the point a little inside the boundary, evenly along each of its sides.
    ellipses : Ellipses or None
        Jacobians over the region; None where more is given than the place of the point.
    """

    along: Configuration
    ellipses: Ellipses | None
