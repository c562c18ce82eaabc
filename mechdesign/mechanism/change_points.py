"""Change points: where two assemblies of a group meet and the motion may go on in either.

A closure (see `mechdesign.mechanism.solve`) touches zero there without crossing it. Under ``branch: follow`` a motion
goes on smoothly, which means that the group's assembly mode changes its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.roots import dips
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.structure import Group

# A closure, a difference of squared lengths, touches zero where it is below this part of its largest value.
TOUCHING = 1e-10
# Number of values of the coordinate at which closures are sampled, in a turn or in a travel of the mechanism's size.
SAMPLES_PER_TURN = 720
# Most turns, or travels of the mechanism's size, that are searched.
MOST_TURNS = 1000


def _closing_groups(groups: Sequence[Group]) -> list[int]:
    """Index of the group of each closure of a configuration."""
    counts = {"two angles": 2, "angle and fixed slide": 1, "angle and turning slide": 1}
    return [index for index, group in enumerate(groups) for _ in range(counts.get(group.form, 0))]


class ChangePoints:
    """Assembly modes along one given coordinate: as drawn at the sketch, changed at every change point between.

    `sketch` is the coordinate's value there (radians or length), `period` a turn, or for a length the mechanism's size;
    `closures` gives those of the first groups at values of the coordinate, for the modes of these groups. A range of
    the coordinate is searched once.
    """

    def __init__(
        self,
        groups: Sequence[Group],
        modes: Sequence[int],
        sketch: float,
        period: float,
        closures: Callable[[Floats, Sequence[Value]], Sequence[Value]],
    ) -> None:
        self._groups, self._modes, self._all_closures = groups, modes, closures
        self.sketch, self._period = sketch, period
        self._range = (sketch, sketch)
        self._places: list[Floats] = [np.empty(0) for _ in modes]

    def modes(self, values: Value) -> list[Value]:
        """Mode of each group at values of the given coordinate (radians or lengths)."""
        self.cover(values)
        return self._parity(np.asarray(values, dtype=float), len(self._places))

    def cover(self, values: Value) -> None:
        """Search the range of these values unless that has been done.

        Raises
        ------
        MechanismError
            If it is too long.
        """
        finite = np.asarray(values, dtype=float)[np.isfinite(values)]
        low, high = (float(end(finite, initial=self.sketch)) for end in (np.min, np.max))
        begin, end = self._range
        if begin <= low and high <= end:
            return
        # A turn or more to each side at once, so that later calls rarely have to search.
        low = min(begin, low, self.sketch - self._period)
        high = max(end, high, self.sketch + self._period)
        if high - low > MOST_TURNS * self._period:
            raise MechanismError(
                f"with 'branch: follow' every turn since the sketch counts, {MOST_TURNS:,} at most; ask for fewer, or "
                "say 'branch: side'"
            )
        count = int(np.ceil((high - low) / self._period * SAMPLES_PER_TURN)) + 1
        samples = np.linspace(low, high, count)
        # The modes of a group decide where the groups after it have their change points.
        self._places = [np.empty(0) for _ in self._modes]
        for index, (group, mode) in enumerate(zip(self._groups, self._modes, strict=True)):
            if group.form == "newton":
                # Its assembly is followed by continuity; groups solved after it stay as drawn.
                break
            if mode:
                self._places[index] = self._search(index, samples)
        self._range = (low, high)

    def _parity(self, values: Floats, groups: int) -> list[Value]:
        """Modes of the first `groups` groups at values of the coordinate; those of the others are as drawn."""
        modes: list[Value] = list(self._modes)
        for index in range(groups):
            places = self._places[index]
            if len(places):
                passed = np.searchsorted(places, values) - np.searchsorted(places, self.sketch)
                modes[index] = modes[index] * np.where(passed % 2, -1, 1)
        return modes

    def _closures(self, index: int, values: Floats) -> Floats:
        modes = self._parity(values, index)[: index + 1]
        closing = _closing_groups(self._groups[: index + 1])
        own = [c for c, group in zip(self._all_closures(values, modes), closing, strict=True) if group == index]
        return np.stack([np.broadcast_to(c, values.shape) for c in own])

    def _search(self, index: int, samples: Floats) -> Floats:
        table = self._closures(index, samples)
        low = (table[:, 1:-1] <= table[:, :-2]) & (table[:, 1:-1] < table[:, 2:])
        which, row = np.nonzero(low)
        if not len(row):
            return np.empty(0)
        around = row + np.arange(3)[:, None]
        place, value = dips(
            lambda some, at: self._closures(index, at)[which[some], np.arange(len(some))],
            samples[around], table[which, around], np.full(len(row), -np.inf),
        )  # fmt: skip
        scale = np.nanmax(np.abs(table), axis=1)[which]
        return np.unique(place[np.abs(value) <= TOUCHING * scale])
