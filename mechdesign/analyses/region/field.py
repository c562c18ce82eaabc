"""What is known of a mechanism at a point of the plane: margins, positive inside its region."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value, norm2
from mechdesign.mechanism.atlas import Atlas
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import determinants
from mechdesign.mechanism.margins import LIMIT, SINGULARITY, Cause, causes
from mechdesign.mechanism.mechanism import Variant, drawn
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Complexes, Flags, Floats

Places = Mapping[str, Value]
# Names, beside those of dimensions, of what may differ from design to design: values of the held coordinates, by their
# place among them, and the characteristic length. No name in a study has a colon.
HELD, LENGTH = "held:", "length:"
# Determinants below this part of the largest of those at some distances (of the mechanism's size) from the point's
# place in the sketch are rounding.
ROUNDING, SHARES = 1e-12, (0.03, 0.1, 0.3, 1.0)


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
        Whether the region ends where a forward determinant changes sign, that is where the assembly of the sketch
        meets another one.
    length : float or None
        Characteristic length by which angles count as lengths in the Jacobian.
    """

    mechanism: Mechanism
    plan: Plan
    held: tuple[float, ...] = ()
    same_assembly: bool = True
    length: float | None = None
    # Angles of rays at which the margins that bound the region change are wanted to this accuracy (radians).
    accuracy: ClassVar[float] = 1e-13

    @property
    def outputs(self) -> Sequence[Coordinate]:
        """Coordinates whose Jacobian is meant: the point's, then the held ones."""
        return self.plan.structure.given

    def configuration(self, z: Complexes, places: Places) -> Configuration:
        """The mechanism with its point at `z`; outside the region what can still be computed is given.

        Unlike `Plan.solve` this leaves finite what does not depend on a leg that cannot reach, so that margins keep
        their sign and smoothness there.
        """
        held = [places.get(f"{HELD}{k}", value) for k, value in enumerate(self.held)]
        given: list[Value] = [z.real, z.imag, *held]
        if self.plan.iterative:
            return self._poses(z, places)[0]
        vectors = self.mechanism.geometry.vectors(places)
        state = self.plan.run(given, vectors, None)
        graph = self.mechanism.graph
        return Configuration(
            graph, vectors, z.shape, state.nodes, state.rotations[: graph.classes], state.slides, state.closures,
            np.zeros((), dtype=np.int8), places,
            self.plan.near_sketch(given, places) | self._drawn(places),
        )  # fmt: skip

    def _drawn(self, places: Places) -> dict[str, Value]:
        """Angles in limited expressions as the sketch with other dimensions has them, which chooses their turns."""
        counting = angles_of(self.mechanism.counting) if places else {}
        free = {name: angle for name, angle in counting.items() if name not in self._known_turns}
        if not free:
            return {}
        sketch, nominal = drawn(self.mechanism, places), self.mechanism.sketch_configuration
        return {name: np.where(sketch.valid, sketch.value(angle), nominal.value(angle)) for name, angle in free.items()}

    @cached_property
    def _known_turns(self) -> Collection[str]:
        """Angles whose turns are given, or chosen by limits, or which the sketch has whatever the dimensions."""
        return {*self.plan.turns((), {}), *(each.name for each in self.outputs), *self.mechanism.drives}

    @property
    def rootless(self) -> bool:
        """Whether poses would have to grow from the sketch's place of the point, and cannot be had there."""
        return self.plan.iterative and self._atlas[0].empty

    @cached_property
    def _atlas(self) -> tuple[Atlas, Places]:
        """Poses to continue from, and dimensions in which the mechanism differs from theirs.

        A variant that is not assembled at the sketch's place of the point continues poses of its original.
        """
        found, mechanism = Atlas.of(self.plan, self.held), self.mechanism
        if not (found.empty and isinstance(mechanism, Variant)):
            return found, {}
        before = mechanism.original.nominal
        changed = {name: np.asarray(value) for name, value in mechanism.nominal.items() if value != before[name]}
        return Atlas.of(mechanism.original.plan(tuple(each.name for each in self.outputs)), self.held), changed

    def _poses(self, z: Complexes, places: Places, *, beyond: bool = False) -> tuple[Configuration, Floats]:
        atlas, changed = self._atlas
        return atlas.solve(z, {**changed, **places}, beyond=beyond)

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """All margins at points `z`, shape (margins, *z.shape), in the order of `labels`; nan where unknown.

        Those of the assembly come last and may be left out.
        """
        return self.look(z, places, assembly)[0]

    def sampled(self, z: Complexes, places: Places) -> tuple[Floats, Floats]:
        """All margins at samples `z` of rays, shape (samples, rays), and how far links turn between two of them.

        Of links that which turns most, in chords of the unit circle, shape (samples - 1, rays); nan where unknown.
        """
        margins, configuration = self.look(z, places, assembly=True)
        turned = np.zeros((len(z) - 1, *z.shape[1:]))
        with np.errstate(invalid="ignore"):
            for rotation in configuration.rotations:
                if np.ndim(rotation):
                    rotation = np.broadcast_to(rotation, z.shape)
                    turned = np.maximum(turned, norm2(rotation[1:] - rotation[:-1]))
        return margins, np.sqrt(turned)

    def look(self, z: Complexes, places: Places, assembly: bool) -> tuple[Floats, Configuration]:
        """Margins and what they are of."""
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            if self.plan.iterative:
                configuration, fold_distance = self._poses(z, places, beyond=True)
            else:
                configuration = self.configuration(z, places)
            found = [*configuration.closures]
            found += [configuration.slides[slide] for slide in self.mechanism.graph.telescopic]
            found += [margin for _, margin in self.mechanism.margins(configuration)]
            if self.plan.iterative:
                found.append(fold_distance)
            if self.same_assembly and assembly:
                signs = self._signs
                found += [s * d for s, d in zip(signs, self._determinants(configuration), strict=True)]
        if self.plan.iterative:
            # Where nothing is reached one margin says so, and the others have no end of their own there.
            lost = np.isnan(fold_distance)
            found = [
                margin if margin is fold_distance else np.where(lost & np.isnan(margin), 1.0, margin)
                for margin in found
            ]
        stacked = np.empty((len(found), *z.shape))
        for row, margin in zip(stacked, found, strict=True):
            row[...] = margin
        return stacked, configuration

    @cached_property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Of each margin ``limit`` or ``singularity``, and the name of its cause (`mechdesign.mechanism.margins`)."""
        found = [(LIMIT if cause.kind == LIMIT else SINGULARITY, cause.name) for cause in self._causes]
        if self.plan.iterative:
            found.append((SINGULARITY, "continuation"))
        if self.same_assembly:
            found += [(SINGULARITY, f"assembly {k}") for k in range(len(self._signs))]
        return tuple(found)

    @cached_property
    def _causes(self) -> list[Cause]:
        """Of the margins that do not depend on the assembly."""
        slides = self.mechanism.graph.slides
        found = causes(self.plan, self.mechanism, [slides[k] for k in self.mechanism.graph.telescopic])
        return [cause for cause in found if cause.role in ("closure", "leg", "limit")]

    @cached_property
    def singular(self) -> Flags:
        """Which margins end where a leg is stretched or folded, so that indices have square roots there."""
        closures = sum(cause.role == "closure" for cause in self._causes)
        return np.arange(len(self.labels)) < closures

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

    @cached_property
    def rounding(self) -> Floats:
        """Values of each margin that have no sign of their own: of determinants what rounding leaves, else 0.

        A determinant may touch zero along a whole curve (cranks that meet in one pin while the point goes round it);
        each place there would have another sign.
        """
        found = np.zeros(len(self.labels))
        if self.same_assembly:
            sizes = np.abs(Field.look(self, self.surroundings, {}, assembly=True)[0])[-len(self._signs) :]
            found[-len(self._signs) :] = ROUNDING * np.where(np.isfinite(sizes), sizes, 0.0).max(axis=1)
        return found

    def _determinants(self, configuration: Configuration) -> list[Value]:
        return determinants(self.mechanism.linearize(configuration))
