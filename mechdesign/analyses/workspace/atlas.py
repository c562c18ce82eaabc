"""Solved poses all over a region, from which others are continued where the inverse problem has no closed form.

From the sketch every pose would be a long way off, and what cannot be reached would be tried again and again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mechdesign.errors import AssemblyError
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration, Reason, hide
from mechdesign.mechanism.continuation import unknowns_of
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.state import Guess

# Distance of neighbouring poses, as a share of the mechanism's size.
SPACING = 0.08
# Poses beyond this many spacings from every solved one are not reached.
BEYOND = 1.6
MOST = 20_000
# Corrections of Newton's method: towards a fold, where two assemblies meet, each only halves the error.
STEPS = 30
Floats = NDArray[np.float64]
SIDES = np.array([1, 1j, -1, -1j])


@dataclass(frozen=True, eq=False)
class Atlas:
    """Solved poses of the nominal mechanism on a lattice, each found from a neighbour.

    Parameters
    ----------
    held : tuple of float
        Values of the plan's coordinates after the point's x and y.
    signs : sequence of float
        Sign of the determinant of each group without a closed form: others are other assemblies.
    tree : cKDTree
        Places of the poses.
    poses : Configuration, shape (poses,)
    reach : float
        What lies farther from all of them is not reached.
    """

    plan: Plan
    held: tuple[float, ...]
    signs: Sequence[float]
    tree: cKDTree
    poses: Configuration
    reach: float

    @staticmethod
    def of(plan: Plan, held: tuple[float, ...]) -> Atlas:
        """Grow from the sketch's place until nothing more is reached.

        Raises
        ------
        AssemblyError
            If the mechanism cannot be brought from its sketch to the held values.
        """
        sketch = plan.mechanism.sketch_configuration
        origin = complex(*(float(sketch.value(c)) for c in plan.structure.given[:2]))
        spacing = SPACING * plan.mechanism.size
        lattice = np.zeros(1, dtype=complex)
        seen = {0j}
        first = plan.solve([np.array([origin.real]), np.array([origin.imag]), *held], limits=False)
        if not first.valid[0]:
            raise AssemblyError(
                "the workspace grows from the sketch, where the inverse problem has no closed form, and with the held "
                "values the mechanism does not reach the point's place in the sketch; draw it nearer to them"
            )
        given = [np.array([origin.real]), np.array([origin.imag]), *map(np.asarray, held)]
        state = plan.run(given, first.vectors, _guess(plan, first, given))
        signs = [float(np.sign(np.ravel(d)[0])) for d in state.determinants]
        layers = [first]
        while layers[-1].valid.any() and len(seen) < MOST:
            good = np.flatnonzero(layers[-1].valid)
            fresh: dict[complex, int] = {}
            for k, step in zip(np.repeat(good, len(SIDES)), (lattice[good][:, None] + SIDES).ravel(), strict=True):
                if complex(step) not in seen:
                    fresh.setdefault(complex(step), int(k))
            if not fresh:
                break
            seen.update(fresh)
            lattice = np.array(list(fresh))
            start = layers[-1].take(np.array(list(fresh.values()), dtype=np.intp))
            layers.append(_from(plan, start, np.asarray(origin + spacing * lattice), held, {}, signs)[0])
        poses = _join([layer.take(np.flatnonzero(layer.valid)) for layer in layers])
        places = np.stack([np.asarray(poses.value(c)) for c in plan.structure.given[:2]], axis=-1)
        return Atlas(plan, held, signs, cKDTree(places), poses, BEYOND * spacing)

    def solve(self, z: NDArray[np.complex128], places: Mapping[str, Value]) -> tuple[Configuration, Floats]:
        """The mechanism with its point at `z`, and how far it is from where assemblies meet; nan where not reached.

        The second is the product of the squared determinants: zero at a fold, and linear in the distance to it.

        Parameters
        ----------
        places : mapping of str to array_like
            Dimensions that differ from the nominal ones; they broadcast against `z`.
        """
        shape = np.broadcast_shapes(z.shape, *(np.shape(value) for value in places.values()))
        flat = np.broadcast_to(z, shape).ravel()
        at = np.stack([flat.real, flat.imag], axis=-1)
        known: NDArray[np.bool_] = np.asarray(np.isfinite(at).all(axis=1))
        distance, index = map(np.asarray, self.tree.query(np.where(known[:, None], at, 0.0)))
        # What is too far is not tried.
        rows = np.flatnonzero(known & (distance <= self.reach))
        # One more, which no place is given: the pose that is not known.
        last = np.append(rows, 0)
        sizes = {name: np.broadcast_to(np.asarray(value), shape).ravel()[last] for name, value in places.items()}
        start = self.poses.take(np.asarray(np.append(index[rows], 0), dtype=np.intp))
        goal = np.append(flat[rows], complex(*self.tree.data[0]))
        found, grip = _from(self.plan, start, goal, self.held, sizes, self.signs)
        lost = np.append(~found.valid[:-1], True)
        flat_place = np.full(flat.size, len(rows))
        flat_place[rows] = np.arange(len(rows))
        place = flat_place.reshape(shape)
        return _hidden(found, lost).take(place), np.where(lost, np.nan, grip)[place]


def _guess(plan: Plan, at: Configuration, given: Sequence[Value]) -> Guess:
    return unknowns_of(plan.structure, plan.all_rotations(at, given), at.slides, at.nodes)


def _from(
    plan: Plan, start: Configuration, z: NDArray[np.complex128], held: Sequence[float], places: Mapping[str, Value],
    signs: Sequence[float],
) -> tuple[Configuration, Floats]:  # fmt: skip
    """Poses near solved ones, by Newton's method alone: a step is small, and what ends in another assembly is told."""
    given: list[Value] = [z.real, z.imag, *held]
    vectors = plan.mechanism.geometry.vectors(places)
    state = plan.run(given, vectors, _guess(plan, start, given), steps=STEPS)
    reached, grip = np.ones(z.shape, dtype=bool), np.ones(z.shape)
    for converged, determinant, sign in zip(state.converged, state.determinants, signs, strict=True):
        reached &= converged & (np.sign(determinant) == sign)
        grip = grip * determinant**2
    return plan.configuration(state, z.shape, places, vectors, reached, limits=False), grip


def _join(parts: Sequence[Configuration]) -> Configuration:
    """Batches of poses of the same mechanism as one."""

    def stack(values: Sequence[Sequence[Value]]) -> list[Value]:
        return [np.concatenate(column) for column in zip(*values, strict=True)]

    reason = np.concatenate([part.reason for part in parts])
    vectors = Vectors(
        stack([part.vectors.w for part in parts]), stack([part.vectors.d for part in parts]),
        {name: value if isinstance(value, float) else np.concatenate([part.vectors.offsets[name] for part in parts])
         for name, value in parts[0].vectors.offsets.items()},
    )  # fmt: skip
    return Configuration(
        parts[0].graph, vectors, reason.shape, stack([part.nodes for part in parts]),
        stack([part.rotations for part in parts]), stack([part.slides for part in parts]),
        stack([part.closures for part in parts]), reason,
        {name: np.concatenate([part.places[name] for part in parts]) for name in parts[0].places},
    )  # fmt: skip


def _hidden(found: Configuration, lost: NDArray[np.bool_]) -> Configuration:
    return replace(
        found, reason=np.where(lost, np.int8(Reason.NOT_CLOSED), found.reason).astype(np.int8),
        nodes=[hide(node, lost) for node in found.nodes], rotations=[hide(turn, lost) for turn in found.rotations],
        slides=[hide(slide, lost) for slide in found.slides],
        closures=[hide(closure, lost) for closure in found.closures],
    )  # fmt: skip
