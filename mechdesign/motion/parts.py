"""Parts of motions in which columns lie in intervals, from the exact places at which they pass the ends of these."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.statistics import Interval
from mechdesign.motion.curve import Curve
from mechdesign.motion.functions import Functions
from mechdesign.motion.series import Evaluate


def within(curve: Curve, intervals: Sequence[Interval], evaluate: Evaluate) -> Curve:
    """The parts of motions on which each function lies in its interval, as a curve of its own.

    Parameters
    ----------
    evaluate : callable
        Values of as many functions as there are intervals.
    """

    def passing(line: Ints, s: Floats) -> tuple[Floats, Floats]:
        values, conditioning = evaluate(line, s)
        rows = [row for interval, column in zip(intervals, values, strict=True) for row in interval.over(column)]
        return np.array(rows).reshape(len(rows), len(s)), conditioning

    names = [f"{k}" for k in range(len(passing(curve.pieces.line[:1], curve.pieces.nodes[:1, 0])[0]))]
    ends = Functions(curve, names, passing, [0.0] * len(names), zeros=names).zeros(names, 0.0)
    piece = curve.piece_at(ends.line, ends.place)
    pieces = curve.pieces.divided(piece, curve.pieces.take(piece).within(ends.place))
    values = evaluate(pieces.line, pieces.places(np.zeros(len(pieces.line))))[0]
    inside = [interval.holds(column) for interval, column in zip(intervals, values, strict=True)]
    part = copy(curve)
    part.pieces = pieces.take(np.all(inside, axis=0))
    return part
