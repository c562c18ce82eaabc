"""Coordinates as functions along a line of poses: of themselves, and expressions of others."""

from __future__ import annotations

from collections.abc import Sequence

from mechdesign.analyses.kinematics.lines import leaf_of
from mechdesign.analyses.kinematics.peaks import Curve
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Floats


class Curves:
    """Values and slopes of coordinates from those of their leaves, the coordinates that are no expressions.

    Values are in the study's units, so that an expression takes its angles as its text means them, on the branch of
    the line.

    Attributes
    ----------
    names : list of str
        Of the leaves.
    curves : list of callable
        One for each coordinate; see `peaks.Curve`.
    """

    def __init__(self, coordinates: Sequence[Coordinate], angle_unit: float) -> None:
        leaves: dict[str, Coordinate] = {}
        for coordinate in coordinates:
            leaves |= {leaf.name: leaf for leaf in _leaves(coordinate)}
        self.names = list(leaves)
        self.leaves = [leaf_of(coordinate) for coordinate in leaves.values()]
        self.curves = [self._curve(coordinate, angle_unit) for coordinate in coordinates]

    def _curve(self, coordinate: Coordinate, angle_unit: float) -> Curve:
        if coordinate.expression is None:
            k, unit = self.names.index(coordinate.name), angle_unit if coordinate.quantity == "angle" else 1.0
            return lambda values, slopes: (values[k] / unit, slopes[k] / unit)
        expression = coordinate.expression
        parts = [(part.name, self._curve(part, angle_unit)) for part in coordinate.parts]

        @quiet
        def composed(values: Floats, slopes: Floats) -> tuple[Value, Value]:
            found = {name: curve(values, slopes) for name, curve in parts}
            at = {name: value for name, (value, _) in found.items()}
            partials = expression.derivatives(at)
            slope = sum((partials[name] * found[name][1] for name in partials if name in found), 0.0 * values[0])
            return expression.evaluate(at) + 0.0 * values[0], slope

        return composed


def _leaves(coordinate: Coordinate) -> list[Coordinate]:
    """The coordinates behind an expression; itself where it is none."""
    if coordinate.expression is None:
        return [coordinate]
    return [leaf for part in coordinate.parts for leaf in _leaves(part)]
