"""Drives on the boundary of a region, and poses along it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.region.field import Field
from mechdesign.region.patches import Patch

# Where rounding leaves a drive without a value on the boundary it is read so far inside (as a part of the radius).
BESIDE = 1e-12
# Poses along all curves of one side of the boundary.
POSES = {"inner": 2, "outer": 4}
# So far inside the boundary, as a part of the way to its middle: on it rounding may open the mechanism.
INSIDE = 1e-3


def drives_on(
    field: Field, margin: Ints, about: complex, theta: Floats, radius: Floats, side: np.ndarray
) -> list[tuple[Coordinate, Floats]]:  # fmt: skip
    """Drives at places of the boundary, where a `margin` is zero; a little inside where rounding opens the mechanism.

    The places are ends of rays from `about`, those of each `side` together. Angles of drives lie within limits; where a
    drive has none they are continuous along each side, in the turn that is nearest to the sketch.
    """
    mechanism, inwards = field.mechanism, np.where(side == "inner", 1.0, -1.0)
    places = (np.asarray(about + end * np.exp(1j * theta)) for end in (radius, radius * (1 + BESIDE * inwards)))
    exact, within = (field.on_boundary(z, margin) for z in places)
    sides, drives = np.flatnonzero(np.diff(inwards)) + 1, []
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


def poses_along(field: Field, patches: Sequence[Patch]) -> Configuration:
    """Poses at places a little inside the boundary, evenly along each of its sides, shape (places,).

    Pieces that are left out do not count.
    """
    edges = [edge for patch in patches if patch.piece == 1 or not field.same_assembly for edge in patch.edges]
    every = np.concatenate([edge.places for edge in edges])
    middle, places = complex(np.mean(every)), list[complex]()
    for end, number in POSES.items():
        own = [edge.places for edge in edges if edge.side == end]
        if not own:
            continue
        z = np.concatenate(own)
        along = np.cumsum(np.concatenate([np.abs(np.diff(part, prepend=part[:1])) for part in own]))
        for share in (np.arange(number) + 0.5) / number:
            at = z[np.searchsorted(along, share * along[-1])]
            places.append(at + INSIDE * (middle - at) * (1 if end == "outer" else -1))
    return field.poses(np.array(places, dtype=complex))
