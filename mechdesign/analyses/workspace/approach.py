"""Poses without a closed form, near solved ones: found by Newton's method, or seen to lie beyond a fold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.continuation import MAX_CHANGE
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.state import Guess, State
from mechdesign.numerics.arrays import Complexes, Flags, Floats

# Corrections of Newton's method: most poses need few.
FEW, STEPS = 5, 30
# A correction that leaves less of the determinant than this is towards a fold (at the fold itself: a half).
NEAR_FOLD = 0.8


@dataclass(frozen=True, eq=False)
class Approach:
    """The groups without a closed form, of a plan for a point's x and y and held coordinates.

    Parameters
    ----------
    held : tuple of float
        Values of the plan's coordinates after the point's x and y.
    signs : sequence of float
        Sign of the determinant of each such group: others are other assemblies.
    """

    plan: Plan
    held: tuple[float, ...]
    signs: Sequence[float]

    def state(self, z: Complexes, sizes: Mapping[str, Floats], table: Floats) -> State:
        """The whole mechanism with its unknowns as they are."""
        return self.plan.run(self._given(z), self._vectors(sizes), self._guess(table), steps=0)

    def step(self, z: Complexes, sizes: Mapping[str, Floats], table: Floats, steps: int) -> State:
        """Newton's corrections; what comes after the last group that needs them is left unsolved."""
        forms = [group.form for group in self.plan.structure.groups]
        modes = self.plan.modes[: len(forms) - forms[::-1].index("newton")]
        return self.plan.run(self._given(z), self._vectors(sizes), self._guess(table), modes, steps)

    def corrected(
        self, z: Complexes, sizes: Mapping[str, Floats], table: Floats, ahead: Value, patient: Flags
    ) -> tuple[Floats, Floats]:
        """Unknowns of poses near guesses, by Newton's method alone, and their grip (see `solve`).

        Parameters
        ----------
        table, ahead : ndarray, shape (unknowns, poses)
            Of a solved pose nearby, and what the unknowns are expected to change.
        patient : ndarray of bool
            Poses that are given many corrections.
        """
        state = self.step(z, sizes, table + ahead, FEW)
        solved = np.ones(z.shape, dtype=bool)
        for converged in state.converged:
            solved &= converged
        determinants = _determinants(state, z.shape)
        solved &= (np.sign(determinants) == np.asarray(self.signs)[:, None]).all(axis=0)
        grip = np.where(solved, np.prod(determinants**2, axis=0), np.nan)
        rows, found = np.flatnonzero(~solved & patient), unknowns(state, z.shape)
        if len(rows):
            own = {name: value[rows] for name, value in sizes.items()}
            ahead = np.broadcast_to(ahead, table.shape)[:, rows]
            found[:, rows], grip[rows] = self._watched(z[rows], own, table[:, rows], ahead)
        return found, grip

    def _watched(
        self, z: Complexes, sizes: Mapping[str, Floats], table: Floats, ahead: Floats
    ) -> tuple[Floats, Floats]:
        """Poses by single corrections, each pose until it is found or seen to lie beyond a fold; and their grip.

        Towards a fold the equations are those of a parabola: from one side of it corrections never pass to the other,
        where the determinant has the other sign, unless there is no solution. The squared determinant of the solution
        is g = D0 (2 D1 - D0), with D0 and D1 before and after a correction, also where it is negative: so far beyond.
        Corrections alone would only halve D each time; a longer one ends at the root of g, or beside the fold.
        """
        signs = np.asarray(self.signs)[:, None]
        grip, left = np.full(z.shape, np.nan), np.arange(len(z))
        # What is expected must not lie on the other side of the fold.
        begun = _determinants(self.step(z, sizes, table + ahead, 1), z.shape)
        guess = table + np.where((np.sign(begun) == signs).all(axis=0), ahead, 0.0)
        table = guess.copy()
        # The last place, determinants there, and whether a correction led from there.
        last, before, led = guess, np.full((len(signs), len(z)), np.nan), np.zeros(len(z), dtype=bool)
        for _ in range(STEPS):
            own = {name: value[left] for name, value in sizes.items()}
            state = self.step(z[left], own, guess, 1)
            now = _determinants(state, left.shape)
            new = unknowns(state, left.shape)
            squares = before * (2 * now - before)
            crossed = np.sign(now) != signs
            beyond = crossed.any(axis=0)
            value = np.where(led, np.where(crossed, squares, now**2), now**2)
            grip[left[beyond]] = -np.abs(np.prod(value, axis=0))[beyond]
            # Of what lies beyond, the pose at the fold is told.
            share = np.where(crossed & led, before / (before - now), 1.0).min(axis=0)
            table[:, left[beyond]] = (last + share * (guess - last))[:, beyond]
            solved = ~beyond
            for converged in state.converged:
                solved = solved & converged
            table[:, left[solved]], grip[left[solved]] = new[:, solved], np.prod(now**2, axis=0)[solved]
            # The group that is nearest to its fold says how much longer the correction should have been.
            nearest = np.argmin(np.where(led, now / before, 1.0), axis=0)[None]
            d0, d1, g = (np.take_along_axis(v, nearest, axis=0)[0] for v in (before, now, squares))
            goal = np.copysign(np.where(g > 0, 1.0, 0.5) * np.sqrt(np.abs(g)), d0)
            jump = led & (d1 / d0 < NEAR_FOLD)
            target = np.where(jump, last + (d0 - goal) / (d0 - d1) * (guess - last), new)
            moving = ~solved & ~beyond & np.isfinite(target).all(axis=0)
            left, last, guess, before, led = (
                left[moving],
                guess[:, moving],
                target[:, moving],
                now[:, moving],
                ~jump[moving],
            )
            if not len(left):
                break
        return table, grip

    def _given(self, z: Complexes) -> list[Value]:
        return [z.real, z.imag, *self.held]

    def _vectors(self, sizes: Mapping[str, Floats]) -> Vectors:
        return self.plan.core.geometry.vectors(sizes)

    def _guess(self, table: Floats) -> Guess:
        """Rows of a table as angles and slides by group."""
        found, row = {}, 0
        for index, group in enumerate(self.plan.structure.groups):
            if group.form == "newton":
                middle = row + len(group.angles)
                end = middle + len(group.slides) + 2 * len(group.bases)
                found[index] = (list(table[row:middle]), list(table[middle:end]))
                row = end
        return found

    def expected(self, table: Floats, slopes: Floats, way: Complexes) -> Floats:
        """What unknowns are expected to change some way from a pose."""
        change = slopes[0] * way.real + slopes[1] * way.imag
        # Beside a fold the unknowns change too fast for their slopes to tell.
        return np.where((np.abs(change) <= MAX_CHANGE * self._scale(table)).all(axis=0), change, 0.0)

    def _scale(self, table: Floats) -> Floats:
        """What changes of the unknowns are measured by: radians, and the mechanism's size or a length beyond it."""
        size = self.plan.core.size
        rows = [
            angle
            for group in self.plan.structure.groups if group.form == "newton"
            for angle in [True] * len(group.angles) + [False] * (len(group.slides) + 2 * len(group.bases))
        ]  # fmt: skip
        return np.where(np.array(rows)[:, None], 1.0, np.maximum(size, np.abs(table)))


def unknowns(state: State, shape: tuple[int, ...]) -> Floats:
    """Unknowns of a state's groups, one a row."""
    rows = [value for angles, slides in state.unknowns.values() for value in (*angles, *slides)]
    return np.stack([np.broadcast_to(value, shape) for value in rows])


def _determinants(state: State, shape: tuple[int, ...]) -> Floats:
    """Determinants of a state's groups, one a row."""
    return np.stack([np.broadcast_to(determinant, shape) for determinant in state.determinants])
