"""Poses whose loops need not close: all angles and slides are numbers of their own, and the loops have gaps.

No pose of them is a dead centre, and they belong to no assembly: where Newton's method closes the loops it may pass
from one to another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value, Vector, plus, times
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.loops import gap_of, unknowns_of
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.structure import Group, Structure


class OpenLoops(Linearization):
    """The equations of such poses: where a node is, by which vector each loop misses its end, what conditions miss.

    Parameters
    ----------
    plan : Plan
        That of the drives.
    node : int
        Number of the node.
    given : sequence of Value
        Values of the drives (radians, lengths).
    unknowns : ndarray, shape (unknowns, *batch)
        Angles (radians) and slides of all groups, as `closed` tells them.
    places : mapping of str to Value
        Dimensions that differ from the nominal ones.

    Attributes
    ----------
    values : ndarray, shape (*batch, equations)
        x and y of the node, then x and y of the gap of each loop and what each condition misses.
    """

    def __init__(
        self, plan: Plan, node: int, given: Sequence[Value], unknowns: Floats, places: Mapping[str, Value]
    ) -> None:
        state, rest = plan.begin(given, plan.core.geometry.vectors(places)), iter(unknowns)
        for group in plan.structure.groups:
            if group.form == "coupled":
                state.couple(group)
            state.put(group, [*islice(rest, group.unknowns)])
            state.place(group)
        shape = unknowns.shape[1:]
        poses = replace(state.pose(), shape=shape, reason=np.zeros(shape, dtype=np.int8), places=dict(places))
        super().__init__(plan.structure, plan.core.geometry, poses)
        self.node, gaps = node, list[Value]()
        self._rates: list[Value] = [0.0] * len(unknowns)
        self._moved: list[Value] = []
        for group in plan.structure.groups:
            for loop in group.loops:
                gap = plus(gap_of(loop, self.nodes), 1, self.columns(group, loop.edges)[0])
                gaps += [gap.real, gap.imag]
            gaps += state.gaps(group) if group.solved else []
        self.values = self._stacked(self.nodes, gaps)

    @staticmethod
    def closed(structure: Structure, poses: Configuration) -> Floats:
        """The unknowns of solved poses, shape (unknowns, *batch)."""
        values = [value for group in structure.groups
                  for value in unknowns_of(group, poses.nodes, poses.rotations, poses.slides)]  # fmt: skip
        return np.array([np.broadcast_to(value, poses.shape) for value in values])

    def by_unknowns(self) -> Floats:
        """Derivatives of the values by each unknown, shape (*batch, equations, unknowns)."""
        count, axes = len(self._rates), (1,) * len(self.configuration.shape)
        self._rates, self._moved = [*np.eye(count).reshape(count, count, *axes)], []
        rates, self._rates = self.velocity([0.0] * len(self.structure.given)), [0.0] * count
        return self._stacked(rates.nodes, self._moved, count)

    def by_places(self, places: Sequence[str]) -> Floats:
        """The same by dimensions and drives."""
        self._moved = []
        return self._stacked(self.sensitivity(places).nodes, self._moved, len(places))

    def _stacked(self, nodes: Sequence[Vector], gaps: Sequence[Value], *axes: int) -> Floats:
        place = nodes[self.node]
        values = np.stack([np.broadcast_to(value, (*axes, *self.configuration.shape))
                           for value in (place.real, place.imag, *gaps)], axis=-1)  # fmt: skip
        return np.moveaxis(values, 0, -1) if axes else values

    def _solve_group(self, index: int, group: Group, right: list[Vector], gaps: list[Value]) -> list[Value]:
        """The rates that its unknowns are said to have; `_moved` has what the gaps change by then."""
        begin = sum(own.unknowns for own in self.structure.groups[:index])
        rates = self._rates[begin : begin + group.unknowns]
        moved = [*(part for vector in right for part in (vector.real, vector.imag)), *gaps]
        for total, row in zip(moved, self.rows(index, group), strict=True):
            for rate, entry in zip(rates, row, strict=True):
                total = plus(total, 1, times(rate, entry))
            self._moved.append(total)
        return rates
