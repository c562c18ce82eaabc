"""Smallest and largest transmission angles of the four-bars and slider-cranks of a mechanism over its motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.analyses.kinematics.boundaries import Boundary
from mechdesign.analyses.kinematics.lines import Leaf, Line
from mechdesign.analyses.kinematics.peaks import Curve, peaks
from mechdesign.analyses.poses import solve_poses
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.mechanism.rates import Rates
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# Angles within this of each other are one (radians).
BEYOND = 1e-12
# Angles this near to 0 or a right angle are that (radians): there is a corner, found to this.
SQUARE = 1e-10


def transmission_table(
    study: Study, poses: Poses, swept: str | None, whole: Flags
) -> tuple[Table, Flags] | None:  # fmt: skip
    """The part of table ``loops`` that a design's dimensions do not name otherwise; None without such loops.

    Parameters
    ----------
    swept : str or None
        The one coordinate that moves; the extremes between the poses of its sweep count too.
    whole : bool array, shape (designs,)
        Designs all of whose poses are valid; rows of the others are nan, as their limits of motion are not known here.

    Returns
    -------
    (Table, bool array of shape (designs,)) or None
        The table, with a row a design and loop, and the designs whose motion is torn between poses.
    """
    loops = four_bars(study.mechanism)
    if not loops:
        return None
    torn = np.zeros(poses.designs, dtype=bool)
    if swept is None:
        angle = np.empty((len(loops), poses.count))
        for solved in solve_poses(study, poses):
            angle[:, solved.rows] = _angles(loops, solved.configuration)
        each = angle.reshape(len(loops), poses.designs, -1)
        found = [each.min(axis=2), each.max(axis=2)]
    else:
        valid = np.repeat(whole, poses.count // poses.designs)
        both, torn = transmission_extremes(study, loops, poses, swept, valid)
        found = [value for value, _ in both]
    # Rows are designs by loops.
    rows = [np.where(whole, part, np.nan).T.ravel() for part in found]
    words = [np.tile(np.array(names), poses.designs) for names in (
        [loop.kind for loop in loops],
        *([loop.links[k] for loop in loops] for k in range(4)),
        [" ".join(joint.name for joint in loop.joints) for loop in loops],
    )]  # fmt: skip
    names = ("kind", "frame", "input", "coupler", "output", "joints")
    unit = study.units.label("angle")
    columns = [Column(name, column) for name, column in zip(names, words, strict=True)]
    for name, row in zip(("transmission_min", "transmission_max"), rows, strict=True):
        columns.append(Column(name, row / study.units.angle_factor, unit))
    return Table("loops", tuple(columns)), torn


@quiet
def _angles(loops: tuple[FourBar, ...], configuration: Configuration) -> Floats:
    angle = np.array([np.broadcast_to(loop.transmission(configuration), configuration.shape) for loop in loops])
    return np.where(configuration.valid, angle, np.nan)


def transmission_extremes(
    study: Study, loops: Sequence[FourBar], poses: Poses, swept: str, valid: Flags,
    ends: Sequence[Boundary] = (),
) -> tuple[list[tuple[Floats, Floats]], Flags]:  # fmt: skip
    """Smallest and largest transmission angles over the motion along a sweep, and the designs whose motion is torn.

    The square of its sine has the same extremes as the angle and is smooth where that is 0 or a right angle.

    Returns
    -------
    (list of (ndarray, ndarray), bool array of shape (designs,))
        Smallest and largest: angle (radians) and swept coordinate (core's units), shape (loops, designs).
    """
    leaves = [leaf for loop in loops for leaf in _leaves_of(loop)]
    squares = [_leaf(2 * k) for k in range(len(loops))]
    angles = [_leaf(2 * k + 1) for k in range(len(loops))]
    line = Line(study, poses, swept, valid, leaves, ends)
    both = []
    for peak, sign in zip(
        peaks(line, squares, np.full((len(loops), poses.designs), BEYOND), angles), (1, -1), strict=True
    ):
        value, place = sign * peak.value, peak.place
        for whole in (0.0, np.pi / 2):
            value = np.where(np.abs(value - whole) <= SQUARE, whole, value)
        both.append((value, place))
    return both, line.torn


def _leaves_of(loop: FourBar) -> list[Leaf]:
    """The square of the sine of the transmission angle, and the angle."""

    def square(configuration: Configuration) -> Value:
        return loop.squareness(configuration, 3)[0] ** 2

    def slope(configuration: Configuration, velocity: Rates) -> Value:
        sine, cosine = loop.squareness(configuration, 3)
        return 2 * sine * cosine * loop.turning(configuration, velocity)

    return [Leaf(square, slope), Leaf(loop.transmission, lambda configuration, velocity: np.nan)]


def _leaf(k: int) -> Curve:
    return lambda values, slopes: (values[k], slopes[k])
