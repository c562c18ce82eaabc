"""The boundary of a region, curve by curve: places, what ends the region there, drives; and poses along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.region.field import Field
from mechdesign.region.patches import Patch

# Where rounding leaves a drive without a value on the boundary it is read so far inside (as a part of the radius).
BESIDE = 1e-12
# Poses along all curves of one side of the boundary.
POSES = {"inner": 2, "outer": 4}
# So far inside the boundary, as a part of the way to its middle: on it rounding may open the mechanism.
INSIDE = 1e-3


@dataclass(frozen=True, eq=False)
class Boundary:
    """Points of the curves that bound a region, first those where rays enter it; all of shape (points,).

    Parameters
    ----------
    z : ndarray of complex
    theta : ndarray
        Angles of the rays (radians).
    kind, at : ndarray of str
        Whether a limit or a singularity ends the region there, and which.
    side : ndarray of str
        ``inner`` or ``outer``: which end of the ray's interval.
    curve, piece : ndarray of int
        Numbers of the curve and of the region's piece.
    drives : sequence of (Coordinate, ndarray)
        Values of the drives (radians or lengths).
    """

    z: Complexes
    theta: Floats
    kind: np.ndarray
    at: np.ndarray
    side: np.ndarray
    curve: Ints
    piece: Ints
    drives: Sequence[tuple[Coordinate, Floats]]


def boundary_of(field: Field, patches: Sequence[Patch], reasons: Sequence[tuple[str, str]]) -> Boundary:
    """The boundary of a region; `reasons` are the `causes` of its field."""
    curves = [
        (patch, edge) for side in ("inner", "outer") for patch in patches for edge in patch.edges if edge.side == side
    ]
    lengths = [len(patch.theta) for patch, _ in curves]
    theta, radius = np.concatenate([p.theta for p, _ in curves]), np.concatenate([e.radius for _, e in curves])
    margin, side, piece = (
        np.repeat(values, lengths)
        for values in ([e.margin for _, e in curves], [e.side for _, e in curves], [p.piece for p, _ in curves])
    )
    about, turn = patches[0].about, np.exp(1j * theta)
    inwards, z = np.where(side == "inner", 1.0, -1.0), np.asarray(about + radius * turn)
    within = np.asarray(about + radius * (1 + BESIDE * inwards) * turn)
    drives = _drives(field, field.on_boundary(z, margin), field.on_boundary(within, margin), inwards)
    kind, at = (np.array(words)[margin] for words in ([kind for kind, _ in field.labels], [at for _, at in reasons]))
    curve = np.repeat(np.arange(len(curves)), lengths)
    return Boundary(z, theta, kind, at, side, curve, piece, drives)


def _drives(
    field: Field, exact: Configuration, within: Configuration, inwards: Floats
) -> list[tuple[Coordinate, Floats]]:  # fmt: skip
    """Drives on the boundary, or `within` the region where rounding opens the mechanism on it.

    Angles lie within the drive's limits; where it has none they are continuous along each side, in the turn that is
    nearest to the sketch.
    """
    mechanism, sides = field.mechanism, np.flatnonzero(np.diff(inwards)) + 1
    drives = []
    for drive in mechanism.forward.structure.given:
        here, beside = (np.broadcast_to(pose.value(drive), inwards.shape) for pose in (exact, within))
        values = np.where(np.isfinite(here), here, beside)
        if drive.quantity == "angle" and drive.name not in mechanism.turns({}):
            drawn = float(mechanism.sketch_configuration.value(drive))
            parts = [np.unwrap(part) for part in np.split(values, sides)]
            turns = [2 * np.pi * np.round((np.mean(part) - drawn) / (2 * np.pi)) for part in parts]
            values = np.concatenate([part - turn for part, turn in zip(parts, turns, strict=True)])
        drives.append((drive, values))
    return drives


def poses_along(field: Field, boundary: Boundary) -> Configuration:
    """Poses at places a little inside the boundary, evenly along each of its sides, shape (places,).

    Pieces that are left out do not count.
    """
    own = boundary.piece == 1 if field.same_assembly else np.ones(len(boundary.z), dtype=bool)
    return field.poses(_places(boundary.z[own], boundary.side[own], boundary.curve[own]))


def _places(z: Complexes, side: np.ndarray, curve: Ints) -> Complexes:
    places = []
    middle = complex(np.mean(z.real), np.mean(z.imag)) if len(z) else 0j
    for end, number in POSES.items():
        own, of = z[side == end], curve[side == end]
        if not len(own):
            continue
        steps = np.where(np.diff(of, prepend=-1) == 0, np.abs(np.diff(own, prepend=own[:1])), 0.0)
        along = np.cumsum(steps)
        for share in (np.arange(number) + 0.5) / number:
            k = int(np.searchsorted(along, share * along[-1]))
            places.append(own[k] + INSIDE * (middle - own[k]) * (1 if end == "outer" else -1))
    return np.array(places, dtype=complex)
