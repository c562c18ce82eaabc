"""Margins of a mechanism at places of one of its points: all of them are positive inside the region of that point."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.atlas import Atlas
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.core import Bound
from mechdesign.mechanism.derivatives import determinants, regularity
from mechdesign.mechanism.margins import LIMIT, SINGULARITY, Cause, causes
from mechdesign.mechanism.mechanism import Variant, drawn
from mechdesign.mechanism.plan import Plan

Places = Mapping[str, Value]
# Names, beside those of dimensions, of numbers that may differ between designs: the values of the held coordinates
# (followed by the coordinate's index) and the characteristic length. No name in a study has a colon.
HELD, LENGTH = "held:", "length:"
# Determinants below this fraction of the largest one around the point's place in the sketch are rounding.
ROUNDING = 1e-12
# Poses no more regular than this (0 at a singularity, at most 1) are singular but for rounding.
REGULAR = 1e-10
# Distances from that place at which determinants are compared, as fractions of the mechanism's size.
SHARES = (0.03, 0.1, 0.3, 1.0)


@dataclass(frozen=True, eq=False)
class Field:
    """A mechanism seen from the place of one of its points, the other degrees of freedom held.

    Parameters
    ----------
    plan : Plan
        Solves for the point's x and y, then the held coordinates.
    held : sequence of float
        Values of the held coordinates, angles in radians.
    same_assembly : bool
        Whether the region ends where a forward determinant changes sign: there the sketch's assembly mode meets
        another one.
    length : float or None
        Characteristic length by which angles count as lengths in the Jacobian.
    """

    mechanism: Mechanism
    plan: Plan
    held: tuple[float, ...] = ()
    same_assembly: bool = True
    length: float | None = None
    # Accuracy of the ray angles at which the region's bounding margins change (radians).
    accuracy: ClassVar[float] = 1e-13

    @property
    def outputs(self) -> Sequence[Coordinate]:
        """The point's x and y, then the held coordinates: the rows of the Jacobian."""
        return self.plan.structure.given

    @property
    def members(self) -> tuple[Field, ...]:
        """The fields of which any may hold a place of the region."""
        return (self,)

    def configuration(self, z: Complexes, places: Places, modes: Sequence[Value] | None = None) -> Configuration:
        """The mechanism with its point at `z`, inside the region or outside; `modes` as in `Plan.run`.

        Unlike `Plan.solve` this keeps finite whatever does not depend on a leg that cannot reach `z`, so that margins
        are smooth and have a sign outside the region as well.
        """
        if self.plan.iterative:
            return self._poses(z, places)[0]
        vectors = self.mechanism.geometry.vectors(places)
        state = self.plan.run(self._given(z, places), vectors, None, modes)
        graph = self.mechanism.graph
        return Configuration(
            graph, vectors, z.shape, state.nodes, state.rotations[: graph.classes], state.slides, state.closures,
            np.zeros((), dtype=np.int8), places, self.near(z, places),
        )  # fmt: skip

    def on_boundary(self, z: Complexes, margin: Ints) -> Configuration:
        """The mechanism with its point at places `z` of the boundary, where each `margin` is zero."""
        return self.configuration(z, {})

    def poses(self, z: Complexes) -> Configuration:
        """Poses with the point at `z`, not judged by the limits."""
        return self.plan.solve(self._given(z, {}), limits=False)

    def _given(self, z: Complexes, places: Places) -> list[Value]:
        held = [places.get(f"{HELD}{k}", value) for k, value in enumerate(self.held)]
        return [z.real, z.imag, *held]

    def near(self, z: Complexes, places: Places) -> dict[str, Value]:
        """Values near to which angles are read: these fix their turns."""
        return self.plan.near_sketch(self._given(z, places), places) | self._drawn(places)

    def _drawn(self, places: Places) -> dict[str, Value]:
        """Angles in limited expressions as in the sketch redrawn with the dimensions `places`: these fix the turns."""
        counting = angles_of(self.mechanism.counting) if places else {}
        limited = {name: angle for name, angle in counting.items() if name not in self._known_turns}
        if not limited:
            return {}
        sketch, nominal = drawn(self.mechanism, places), self.plan.core.sketch_configuration
        if self.plan.core is not self.mechanism:
            # Another assembly mode at the same place.
            sketch = self.plan.solve([sketch.value(output) for output in self.outputs], places, limits=False)
        return {
            name: np.where(sketch.valid, sketch.value(angle), nominal.value(angle)) for name, angle in limited.items()
        }

    @cached_property
    def _known_turns(self) -> Collection[str]:
        """Angles whose number of turns is given, follows from limits, or is the sketch's for all dimensions."""
        return {*self.plan.turns((), {}), *(output.name for output in self.outputs), *self.mechanism.drives}

    @property
    def rootless(self) -> bool:
        """Whether poses are continued from the sketch's place of the point, but none can be assembled there."""
        return self.plan.iterative and self._atlas[0].empty

    @cached_property
    def _atlas(self) -> tuple[Atlas, Places]:
        """Poses to continue from, and the dimensions in which this mechanism differs from theirs.

        A variant that cannot be assembled at the sketch's place of the point continues the poses of its original.
        """
        atlas, mechanism = Atlas.of(self.plan, self.held), self.mechanism
        if not (atlas.empty and isinstance(mechanism, Variant)):
            return atlas, {}
        nominal = mechanism.original.nominal
        changed = {name: np.asarray(value) for name, value in mechanism.nominal.items() if value != nominal[name]}
        return Atlas.of(mechanism.original.plan(tuple(output.name for output in self.outputs)), self.held), changed

    def _poses(self, z: Complexes, places: Places, *, beyond: bool = False) -> tuple[Configuration, Floats]:
        """Configurations continued from the poses of the atlas, and their distances from a fold."""
        atlas, changed = self._atlas
        return atlas.solve(z, {**changed, **places}, beyond=beyond)

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """All margins at points `z`, shape (margins, *z.shape), in the order of `labels`; nan where unknown.

        The margins of the assembly come last; without `assembly` they are left out.
        """
        return self.look(z, places, assembly)[0]

    def sampled(self, z: Complexes, places: Places, *, assembly: bool = True) -> tuple[Floats, Floats, Complexes]:
        """Margins at points `z`, as `margins`, with `away`, and the rotations of the links, shape (links, *z.shape)."""
        margins, configuration = self.look(z, places, assembly)
        # Those that do not turn too: Newton's method has them at each point on some calls and once on others.
        rotations = [np.broadcast_to(rotation, z.shape) for rotation in configuration.rotations]
        turned = np.array(rotations, dtype=complex).reshape(len(rotations), *z.shape)
        return margins, self.away(configuration, margins), turned

    def away(self, configuration: Configuration, margins: Floats) -> Floats:
        """Of margins of angles between two limits how far these are from their middle (radians), else 0."""
        away, places = np.zeros(margins.shape), {**self.mechanism.nominal, **configuration.places}
        for row, bound in self._two_sided:
            away[row] = bound.away(configuration, places)
        return away

    @cached_property
    def _two_sided(self) -> list[tuple[int, Bound]]:
        """Margins of angles between two limits, and these."""
        bounds, causes = self.mechanism.bounds, [cause.role for cause in self._causes]
        number = [1 if bound.of_angle else sum(end is not None for end in (bound.limit.min, bound.limit.max))
                  for bound in bounds]  # fmt: skip
        rows = np.cumsum([causes.index("limit"), *number]).tolist() if bounds else []
        return [(row, bound) for row, bound in zip(rows, bounds, strict=False) if bound.of_angle]

    def look(self, z: Complexes, places: Places, assembly: bool) -> tuple[Floats, Configuration]:
        """Margins at points `z`, as `margins`, and the configuration to which they belong."""
        if self.plan.iterative:
            configuration, fold_distance = self._poses(z, places, beyond=True)
        else:
            configuration = self.configuration(z, places)
        margins = [*configuration.closures]
        margins += [configuration.slides[slide] for slide in self.mechanism.graph.telescopic]
        margins += [margin for _, margin in self.mechanism.margins(configuration, smooth=True)]
        if self.plan.iterative:
            margins.append(fold_distance)
        if self.same_assembly and assembly:
            signs = self._signs
            margins += [s * d for s, d in zip(signs, self._determinants(configuration), strict=True)]
        if self.plan.iterative:
            # Where continuation reaches no pose, the fold distance alone is nan: the other margins do not end there.
            unreached = np.isnan(fold_distance)
            margins = [
                margin if margin is fold_distance else np.where(unreached & np.isnan(margin), 1.0, margin)
                for margin in margins
            ]
        stacked = np.empty((len(margins), *z.shape))
        for row, margin in zip(stacked, margins, strict=True):
            row[...] = margin
        return stacked, configuration

    @cached_property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Kind (``limit`` or ``singularity``) and cause of each margin, named as in `mechdesign.mechanism.margins`."""
        labels = [(LIMIT if cause.kind == LIMIT else SINGULARITY, cause.name) for cause in self._causes]
        if self.plan.iterative:
            labels.append((SINGULARITY, "continuation"))
        if self.same_assembly:
            labels += [(SINGULARITY, f"assembly {k}") for k in range(len(self._signs))]
        return tuple(labels)

    @cached_property
    def _causes(self) -> list[Cause]:
        """Causes of the margins that do not depend on the assembly."""
        slides = self.mechanism.graph.slides
        all_causes = causes(self.plan, self.mechanism, [slides[k] for k in self.mechanism.graph.telescopic])
        return [cause for cause in all_causes if cause.role in ("closure", "leg", "limit")]

    @cached_property
    def singular(self) -> Flags:
        """Which margins vanish where a leg is stretched or folded: indices behave as square roots there."""
        closures = sum(cause.role == "closure" for cause in self._causes)
        return np.arange(len(self.labels)) < closures

    @cached_property
    def tiers(self) -> list[Ints]:
        """Margins in the order in which they are solved: those of each leg, then all others.

        Where a leg is stretched or folded, links that are placed after it turn as square roots do.
        """
        groups = [cause.group for cause in self._causes if cause.role == "closure"]
        legs = np.split(np.flatnonzero(self.singular), np.flatnonzero(np.diff(groups)) + 1)
        return [rows for rows in (*legs, np.flatnonzero(~self.singular)) if rows.size]

    @cached_property
    def _signs(self) -> list[float]:
        sketch = self.mechanism.sketch_configuration
        return [float(np.sign(d)) for d in self._determinants(sketch)]

    @cached_property
    def surroundings(self) -> Complexes:
        """The point's place in the sketch, and places at some distances from it."""
        turn, share = np.meshgrid(np.exp(1j * np.linspace(0, 2 * np.pi, 24, endpoint=False)), SHARES)
        sketch = self.mechanism.sketch_configuration
        at = complex(*(float(sketch.value(c)) for c in self.outputs[:2]))
        return np.append(at, at + self.mechanism.size * (turn * share).ravel())

    @property
    def singular_everywhere(self) -> bool:
        """Whether every pose is a forward singularity, so that determinants are nothing but rounding."""
        margins = self.margins(self.surroundings, {}, assembly=False)
        closures = [kind != LIMIT for kind, _ in self.labels[: len(margins)]]
        z = self.surroundings[(margins[closures] > 0).all(axis=0)]
        regular = np.asarray(regularity(self.mechanism.linearize(self.configuration(z, {}))))
        return len(z) > 0 and bool((regular <= REGULAR).all())

    @cached_property
    def rounding(self) -> Floats:
        """Size below which a margin has no reliable sign: the rounding of determinants, 0 for all other margins.

        A determinant may touch zero along a whole curve (cranks that meet in one pin while the point goes round it);
        its sign there is rounding's.
        """
        noise = np.zeros(len(self.labels))
        if self.same_assembly:
            sizes = np.abs(Field.look(self, self.surroundings, {}, assembly=True)[0])[-len(self._signs) :]
            noise[-len(self._signs) :] = ROUNDING * np.where(np.isfinite(sizes), sizes, 0.0).max(axis=1)
        return noise

    def _determinants(self, configuration: Configuration) -> list[Value]:
        return determinants(self.mechanism.linearize(configuration))
