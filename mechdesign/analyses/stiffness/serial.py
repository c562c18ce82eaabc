"""A body on serial-chain legs, by the reciprocal wrenches of each, with the springs that they amount to  [S4]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.analyses.stiffness.chains import chain_of, looked_at_from
from mechdesign.analyses.stiffness.compliance import Held, by_wrenches
from mechdesign.analyses.stiffness.legs import Leg
from mechdesign.analyses.stiffness.screws import (
    RIGID,
    constraint_compliance,
    equivalent_springs,
    joint_rank,
    reciprocal_wrenches,
)
from mechdesign.analyses.stiffness.tables import Springs
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Ints
from mechdesign.study.schema.stiffness import StiffnessSection


def hold_by_legs(
    legs: Sequence[Leg], section: StiffnessSection, configuration: Configuration, length: float, size: int,
    condensed: bool,
) -> tuple[Held, list[Springs]]:  # fmt: skip
    """Springs in a batch of assembled poses of shape (n,), and how they hold the body: rank 0 where not in closed form.

    Parameters
    ----------
    length : float
        What turns rotations into lengths where sizes are compared.
    size : int
        3 for a body's twist, 2 for the displacement of a pin.
    condensed : bool
        The pin is a point of one link only: the link turns freely under forces at it.
    """
    n, body = configuration.shape[0], 3 if condensed else size
    at = configuration.point(section.at)
    ends = [point for leg in legs for point in (leg.base, leg.tip)]
    origin = at if body == 2 else looked_at_from(ends, at, configuration, length)
    chains = [chain_of(leg, section, configuration, origin) for leg in legs]
    ranks = [np.broadcast_to(joint_rank(chain.passive, length), (n,)) for chain in chains]
    springs: list[Springs] = []
    held = Held.unknown(n, body)
    for signature, rows in _signatures(np.stack(ranks, axis=1)):
        here = chains if len(rows) == n else [chain.take(rows) for chain in chains]
        wrenches = [
            reciprocal_wrenches(chain.passive, rank, length, len(rows))
            for chain, rank in zip(here, signature, strict=True)
        ]
        if sum(w.shape[1] for w in wrenches) == body:
            blocks = [constraint_compliance(w, chain) for w, chain in zip(wrenches, here, strict=True)]
            held.stiffness[rows], held.compliance[rows], regular = by_wrenches(wrenches, blocks, length, body)
            held.rank[rows] = body * regular
        for k, (w, chain) in enumerate(zip(wrenches, here, strict=True)):
            for spring in equivalent_springs(w, chain, length):
                springs.append(
                    Springs(rows, np.full(len(rows), k), spring.stiffness, spring.place + origin[rows], spring.angle)
                )
    return _restrict(held.seen_from(at - origin), condensed), springs


def _signatures(ranks: Ints) -> list[tuple[list[int], Ints]]:
    """Poses in which all legs have the same ranks together."""
    if (ranks == ranks[:1]).all():
        return [(ranks[0].tolist(), np.arange(len(ranks)))]
    kinds, which = np.unique(ranks, axis=0, return_inverse=True)
    return [(kind.tolist(), np.flatnonzero(which.reshape(-1) == k)) for k, kind in enumerate(kinds)]


def _restrict(held: Held, condensed: bool) -> Held:
    """Only displacements of the point, the link free to turn: the compliance is a part, its inverse the stiffness."""
    if not condensed:
        return held
    compliance = held.compliance[:, :2, :2]
    stiffness = np.full(compliance.shape, np.nan)
    determinant = np.linalg.det(compliance)
    with np.errstate(invalid="ignore"):
        good = determinant > RIGID * compliance[:, 0, 0] * compliance[:, 1, 1]
    stiffness[good] = np.linalg.inv(compliance[good])
    return Held(stiffness, compliance, np.minimum(held.rank, 2), held.free[:, :2], held.margin)
