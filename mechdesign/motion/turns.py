"""Whole turns of drives whose angles follow from a motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import TURN, Value


def drive_turns(
    mechanism: Mechanism, drive: str, begin: Floats, least: Floats, most: Floats, sizes: Mapping[str, Value]
) -> Floats:
    """Whole turns to add to a drive's angle, so that its motion is within its limits, or begins near the sketch.

    Parameters
    ----------
    begin, least, most : ndarray, shape (n,)
        The drive's angle where each motion begins, and its extremes (radians).
    sizes : mapping
        Places that differ from the nominal ones, of shape (n,).
    """
    drawn = float(mechanism.sketch_configuration.value(mechanism.coordinate(drive)))
    turns = np.round((drawn - begin) / TURN)
    for bound in mechanism.bounds:
        low, high = bound.ends({**mechanism.nominal, **sizes})
        own = bound.drive and bound.of_angle and bound.coordinate.name == drive
        if own and low is not None and high is not None:
            # The whole motion where it fits within the limits, or else its begin.
            for smallest, largest in ((begin, begin), (least, most)):
                fewest, greatest = np.ceil((low - smallest) / TURN), np.floor((high - largest) / TURN)
                turns = np.where(fewest <= greatest, np.clip(turns, fewest, greatest), turns)
    return np.asarray(turns)
