"""Poses of the mechanism along the boundary of a region, which its picture shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from mechdesign.analyses.poses import radians
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Ints
from mechdesign.results import Table
from mechdesign.study import Study

# Poses along all curves of one side of the boundary.
POSES = {"inner": 2, "outer": 4}
# So far inside the boundary, as a part of the way to its middle: on it rounding may open the mechanism.
INSIDE = 1e-3


def curves(table: Table) -> Iterator[Ints]:
    """Rows of each curve of a boundary or of a locus."""
    for curve in np.unique(table["curve"]):
        yield np.flatnonzero(table["curve"] == curve)


def poses_along(study: Study, held: Mapping[str, float], boundary: Table) -> Configuration:
    """Poses at places a little inside the boundary, evenly along each of its sides, shape (places,).

    Parameters
    ----------
    held : mapping of str to float
        Values of the held coordinates, in the study's units, for which the boundary is meant.
    boundary : Table
        For all values; pieces that are left out do not count.
    """
    assert study.workspace is not None
    mechanism, point = study.mechanism, study.workspace.point
    own = np.ones(len(boundary), dtype=bool)
    for name, value in held.items():
        own &= boundary[name] == value
    if study.workspace.assembly == "same":
        own &= boundary["piece"] == 1
    places = _places(boundary.take(own)) if own.any() else np.zeros(0, dtype=complex)
    plan = mechanism.plan((f"{point}.x", f"{point}.y", *held))
    values = [radians(study, mechanism.coordinate(name), value) for name, value in held.items()]
    return plan.solve([places.real, places.imag, *values], limits=False)


def _places(boundary: Table) -> Complexes:
    found = []
    middle = complex(np.mean(boundary["x"]), np.mean(boundary["y"]))
    for side, number in POSES.items():
        own = [rows for rows in curves(boundary) if str(boundary["side"][rows[0]]) == side]
        if not own:
            continue
        pieces = [boundary["x"][rows] + 1j * boundary["y"][rows] for rows in own]
        z = np.concatenate(pieces)
        steps = np.concatenate([np.concatenate([[0.0], np.abs(np.diff(piece))]) for piece in pieces])
        along = np.cumsum(steps)
        for share in (np.arange(number) + 0.5) / number:
            k = int(np.searchsorted(along, share * along[-1]))
            found.append(z[k] + INSIDE * (middle - z[k]) * (1 if side == "outer" else -1))
    return np.array(found)
