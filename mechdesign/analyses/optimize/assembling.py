"""How far the poses of designs are from assembling, so that a search is led where they do."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mechdesign.analyses.poses import SolvedPoses
from mechdesign.mechanism import Mechanism, Reason
from mechdesign.mechanism.algebra import Value
from mechdesign.numerics.arrays import Floats
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def assembly_margins(study: Study, poses: Poses, solved: Iterable[SolvedPoses]) -> Floats:
    """Margins of every pose in parts of the mechanism's size, shape (designs, margins): negative where one is missed.

    Squares of lengths and angles in radians, smooth in the dimensions; nan where what comes before does not assemble.

    Parameters
    ----------
    solved : iterable of SolvedPoses
        As `mechdesign.analyses.poses.solve_poses` gives them for `poses`.
    """
    return np.concatenate([_of(study.mechanism, each).reshape(poses.designs, -1) for each in solved], axis=1)


def shortfall(margins: Floats) -> Floats:
    """By how much designs miss their margins together, shape (designs,): each counts from 0 to 1, nan as 1."""
    missed = np.maximum(-margins, 0.0)
    return np.asarray(np.where(np.isnan(missed), 1.0, missed / (1.0 + missed)).sum(axis=1))


def _of(mechanism: Mechanism, solved: SolvedPoses) -> Floats:
    """Margins of some poses, shape (poses, margins)."""
    configuration, size = solved.configuration, mechanism.size
    found: list[Value] = [closure / size**2 for closure in configuration.closures]
    if mechanism.plan(solved.given).iterative:
        assembled = (configuration.reason == Reason.OK) | (configuration.reason == Reason.LIMIT)
        found.append(np.where(assembled, 1.0, -1.0))
    found += [configuration.slides[slide] / size for slide in sorted(mechanism.graph.telescopic)]
    places = {**mechanism.nominal, **configuration.places}
    with np.errstate(all="ignore"):
        found += [
            margin / bound.scale(size)
            for bound in mechanism.bounds
            for _, margin in bound.margins(configuration, places)
        ]
    columns = [np.broadcast_to(np.asarray(each, dtype=float), configuration.shape) for each in found]
    return np.stack(columns, axis=1) if columns else np.empty((*configuration.shape, 0))
