"""Corners of expressions along motions: there a curve is divided, so that on its pieces everything is smooth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.expressions import Corner
from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism.coordinates import Coordinate, corners_of, expressions_of
from mechdesign.motion.curve import Curve
from mechdesign.motion.functions import Functions
from mechdesign.motion.motion import Motion

# Halvings of the distance between two places, after which only rounding is left.
BISECTIONS = 60
# Values of variables of expressions at places of lines, by name.
Variables = Callable[[frozenset[str], Ints, Floats], Mapping[str, ArrayLike]]


def curve_of(motion: Motion, angles: Sequence[Coordinate] = (), *, turning: bool = True) -> Curve:
    """The motion of some poses, divided at the corners of couplings and of what limits bound; see `Curve`."""
    curve = Curve(motion, angles, turning=turning)
    mechanism = curve.mechanism
    bounded = [*(c.function for c in mechanism.couplings), *(bound.coordinate for bound in mechanism.bounds)]
    corners, expressions = corners_of(bounded), expressions_of(bounded)
    if not corners:
        return curve

    def variables(names: frozenset[str], line: Ints, s: Floats) -> Mapping[str, ArrayLike]:
        configuration = curve.solve(line, s, judged=False).configuration
        return {name: value for one in expressions.values() for name, value in configuration.user_values(one).items()}

    divided, line, place = divide(curve, corners, variables)
    if not len(line):
        return curve
    # Limits and dead centres are sought again, on pieces that hold no corner.
    whole = Curve(motion, angles, turning=turning, marks=(line, place))
    whole.corners = divided.corners
    return whole


def divide(curve: Curve, corners: Sequence[Corner], variables: Variables) -> tuple[Curve, Ints, Floats]:
    """The curve with pieces that end at corners, inner ones first, and these places: their lines and rows."""
    lines, places = [np.empty(0, dtype=np.intp)], [np.empty(0)]
    for corner in corners:
        if corner in curve.corners:
            continue
        curve, before = copy(curve), curve
        curve.corners = curve.corners | {corner}
        argument = Functions(
            before, ["argument"], partial(_argument, corner, variables), [0.0], everywhere=["argument"]
        )
        line, place = argument.crossings("argument", corner.levels, corner.period, turning=corner.turning)
        if len(line):
            piece = before.piece_at(line, place)
            curve.pieces = before.pieces.divided(piece, before.pieces.take(piece).within(place))
            lines.append(line)
            places.append(place)
    return curve, np.concatenate(lines), np.concatenate(places)


def switched(curve: Curve, label: Callable[[Ints, Floats], Ints]) -> Curve:
    """The curve with pieces that end where a label of places changes, such as the side of a path that is nearest."""
    table = curve.pieces.places(np.broadcast_to(chebyshev.PLACES, (len(curve.pieces.line), len(chebyshev.PLACES))))
    line = np.broadcast_to(curve.pieces.line[:, None], table.shape)
    labels = label(line.ravel(), table.ravel()).reshape(table.shape)
    piece, k = np.nonzero(labels[:, 1:] != labels[:, :-1])
    line, before, low, high = curve.pieces.line[piece], labels[piece, k], table[piece, k], table[piece, k + 1]
    for _ in range(BISECTIONS if len(line) else 0):
        middle = (low + high) / 2
        same = label(line, middle) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    curve, pieces = copy(curve), curve.pieces
    curve.pieces = pieces.divided(piece, pieces.take(piece).within(high))
    return curve


def _argument(corner: Corner, variables: Variables, line: Ints, s: Floats) -> tuple[Floats, Floats]:
    names = corner.argument.names
    given = variables(names, line, s)
    values = corner.argument.evaluate({name: np.asarray(given[name]) for name in names})
    return np.broadcast_to(np.asarray(values, dtype=float), (1, len(s))), np.ones(len(s))
