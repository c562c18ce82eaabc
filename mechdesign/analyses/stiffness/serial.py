"""A body on serial-chain legs, by the reciprocal wrenches of each, with the springs that they amount to  [S4]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.analyses.stiffness.chains import chain_of, looked_at_from
from mechdesign.analyses.stiffness.compliance import Held, hold
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
    """Stiffness and springs in a batch of assembled poses of shape (n,).

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
    if not chains:
        return _restrict(hold([np.zeros((3, 0, n))], [np.zeros((0, 0, n))], length, body), condensed), []
    springs: list[Springs] = []
    parts: list[tuple[Ints, Held]] = []
    every = np.stack(ranks, axis=1)
    for signature, rows in _signatures(every):
        here = chains if len(rows) == n else [chain.take(rows) for chain in chains]
        wrenches = [
            reciprocal_wrenches(chain.passive, rank, length, len(rows))
            for chain, rank in zip(here, signature, strict=True)
        ]
        blocks = [constraint_compliance(w, chain) for w, chain in zip(wrenches, here, strict=True)]
        parts.append((rows, hold(wrenches, blocks, length, body)))
        for k, (w, chain) in enumerate(zip(wrenches, here, strict=True)):
            for spring in equivalent_springs(w, chain, length):
                springs.append(
                    Springs(rows, np.full(len(rows), k), spring.stiffness, spring.place + origin[rows], spring.angle)
                )
    return _restrict(_join(parts, n).seen_from(at - origin), condensed), springs


def _signatures(ranks: Ints) -> list[tuple[list[int], Ints]]:
    """Poses in which all legs have the same ranks together."""
    if (ranks == ranks[:1]).all():
        return [(ranks[0].tolist(), np.arange(len(ranks)))]
    kinds, which = np.unique(ranks, axis=0, return_inverse=True)
    return [(kind.tolist(), np.flatnonzero(which.reshape(-1) == k)) for k, kind in enumerate(kinds)]


def _join(parts: Sequence[tuple[Ints, Held]], n: int) -> Held:
    if len(parts) == 1:
        return parts[0][1]
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    names = ("stiffness", "compliance", "rank", "free", "margin")
    return Held(*(np.concatenate([getattr(held, name) for _, held in parts])[order] for name in names))


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
    rank = np.where(np.isfinite(determinant), 2, np.minimum(held.rank, 1))
    return Held(stiffness, compliance, rank, held.free[:, :2], held.margin)
