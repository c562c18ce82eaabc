"""Regions in any assembly: where the point can be with some way of putting the legs together, both elbows of an arm.

Each assembly mode has a region of its own, and a place belongs to the first mode, the sketch's before others, that
reaches it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.configuration import Configuration, Reason
from mechdesign.mechanism.plan import Plan
from mechdesign.region.field import Field, Places


def in_any_assembly(field: Field) -> Field:
    """The field without margins of the assembly, in every mode in which limits are met elsewhere.

    Poses that are continued, as the inverse problem has no closed form, stay in the mode of the sketch.
    """
    drawn, choosing = replace(field, same_assembly=False), _choosing(field.plan)
    if not choosing:
        return drawn
    given = tuple(output.name for output in drawn.outputs)
    every = [mode.mechanism.plan(given) for mode in assemblies(drawn.mechanism, given, choosing) if not mode.drawn]
    modes = (drawn, *(replace(drawn, plan=plan) for plan in every))
    return AnyMode(drawn.mechanism, drawn.plan, drawn.held, False, drawn.length, modes)


def _choosing(plan: Plan) -> list[int]:
    """Groups of a plan whose mode decides on a limit, or on whether groups that are solved later close."""
    if plan.iterative:
        return []
    core, structure = plan.core, plan.structure
    behind = frozenset[int]().union(*(structure.behind(bound.coordinate, core.graph) for bound in core.bounds))
    later = frozenset[int]().union(*(chain - {index} for index, chain in enumerate(structure.chains)))
    # A telescopic leg has no length in its other mode.
    legs = {index for index, group in enumerate(structure.groups)
            if group.form == "angle and turning slide" and core.graph.telescopic.issuperset(group.slides)}  # fmt: skip
    return [index for index, mode in enumerate(plan.modes) if mode and index in (behind | later) - legs]


@dataclass(frozen=True, eq=False)
class AnyMode(Field):
    """A field in any of several assembly modes, each a field of its own, the sketch's first.

    Its margins are those of all modes, one mode after the other; those of one mode are positive inside the region.
    """

    modes: tuple[Field, ...] = ()

    @property
    def members(self) -> tuple[Field, ...]:
        """The field of each mode."""
        return self.modes

    @cached_property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Kind and cause of the margins."""
        return self.modes[0].labels * len(self.modes)

    @property
    def singular(self) -> Flags:
        """Which margins vanish where a leg is stretched or folded."""
        return np.tile(self.modes[0].singular, len(self.modes))

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """As `Field.margins`, of all modes."""
        return np.concatenate([mode.margins(z, places, assembly=assembly) for mode in self.modes])

    def sampled(self, z: Complexes, places: Places, *, assembly: bool = True) -> tuple[Floats, Floats, Complexes]:
        """As `Field.sampled`, of all modes."""
        modes = zip(*(mode.sampled(z, places, assembly=assembly) for mode in self.modes), strict=True)
        margins, away, rotations = (np.concatenate(tables) for tables in modes)
        return margins, away, rotations

    def poses(self, z: Complexes) -> Configuration:
        """As `Field.poses`, each place in the mode of `configuration`."""
        pose = self.configuration(z, {})
        closed = np.logical_and.reduce([np.isfinite(np.broadcast_to(node, z.shape)) for node in pose.nodes])
        return replace(pose, reason=np.where(closed, Reason.OK, Reason.NOT_CLOSED).astype(np.int8))

    def configuration(self, z: Complexes, places: Places, modes: Sequence[Value] | None = None) -> Configuration:
        """As `Field.configuration`, each place in the first mode that reaches it, or that comes nearest to."""
        least = np.stack([mode.margins(z, places).min(axis=0, initial=np.inf) for mode in self.modes])
        least = np.where(np.isnan(least), -np.inf, least)
        first = np.where((least > 0).any(axis=0), (least > 0).argmax(axis=0), least.argmax(axis=0))
        return self._in_modes(z, places, first)

    def on_boundary(self, z: Complexes, margin: Ints) -> Configuration:
        """As `Field.on_boundary`, in the mode that has the margin."""
        return self._in_modes(z, {}, margin // len(self.modes[0].labels))

    def _in_modes(self, z: Complexes, places: Places, chosen: Ints) -> Configuration:
        """Each place in the mode of the number `chosen`."""
        signs = np.array([mode.plan.modes for mode in self.modes])
        pose = super().configuration(z, places, [*np.moveaxis(signs[chosen], -1, 0)])
        nears = [mode.near(z, places) for mode in self.modes]
        every = range(len(nears))
        near = {name: np.select([chosen == k for k in every], [nears[k][name] for k in every]) for name in nears[0]}
        return replace(pose, near=near)
