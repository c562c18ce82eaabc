"""Singularities of a region: what ends it, in words, and the curves inside it where its assembly meets another.

A `forward` (parallel) singularity is where the drives no longer hold the mechanism: the determinant of a group of the
drives' structure vanishes. An `inverse` (serial) one is where a leg is stretched, folded or at the end of its reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.numerics.zero_curves import joined, zero_curves
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.derivatives import determinants
from mechdesign.mechanism.structure import Group
from mechdesign.region.field import Field
from mechdesign.region.patches import GRID, Patch

FORWARD, INVERSE = "forward", "inverse"
# How the links of a group lie where its determinant vanishes.
FORMS = {"two angles": "in line", "angle and fixed slide": "at right angles", "two slides": "parallel"}
# Spacing of the grid on which curves are looked for, in rows and columns of a patch's grid; and the part of a ray's
# interval that it leaves out at both ends.
STEP = 0.25
INSET = 1e-6
# Points that a loop on whole rows and columns needs.
LOOP_POINTS = 8
# Distance at which ends of curves are one, as a part of the region's size.
END_DISTANCE = 1e-8
# Determinants below this part of the largest are rounding; on the first and the last row of a grid, which may lie a
# little beside the ends of their panel, below the second.
ROUNDING = 1e-13
ROUNDING_OF_ENDS = 1e-7
# Step of the differences of margins, as a part of the width of a ray's interval, and corrections onto the boundary.
DIFFERENCE = 1e-6
CORRECTIONS = 4
# Distances from the boundary (parts of the width) at which a curve is followed to its end; from there to the end in
# square roots of the distance it is half as far again.
BESIDE = np.array([1e-10, 4e-10])
# The end lies within this many rows; first step along the boundary, and accuracy, as parts of that; the most steps.
END_ROWS = 2.0
FIRST_STEP = 1e-3
ACCURACY = 1e-7
SECANTS = 10


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of ``forward`` or ``inverse`` singularities; the cause says which links, and what they do there."""

    kind: str
    cause: str
    points: Complexes


def causes(field: Field) -> list[tuple[str, str]]:
    """What ends the region where each margin of a field is zero: ``limit``, ``forward`` or ``inverse``, and which."""
    if len(field.members) > 1:
        first = field.members[0]
        return causes(first)[: len(first.labels)] * len(field.members)
    names = forward_names(field.mechanism)
    stated = {bound.limit.name: bound.coordinate.name for bound in field.mechanism.bounds}
    words = []
    for kind, label in field.labels:
        if kind == "limit":
            stem, _, side = label.rpartition(" ") if label not in stated else (label, "", "range")
            words.append((kind, f"{stated[stem]} {side}"))
        elif label.startswith("assembly "):
            words.append((FORWARD, names[int(label.removeprefix("assembly "))]))
        elif label == "continuation":
            words.append((INVERSE, "working mode ends"))
        else:
            leg = label.removesuffix(" length")
            words.append((INVERSE, label if leg == label else f"{leg} at zero length"))
    return words


def forward_names(mechanism: Mechanism) -> list[str]:
    """What the links of each group of the drives' structure do where its determinant vanishes."""
    return [_in_words(mechanism, group) for group in mechanism.forward.structure.groups if group.solved]


def _in_words(mechanism: Mechanism, group: Group) -> str:
    bodies = mechanism.graph.bodies
    frames = {frame for frame, tie in enumerate(mechanism.forward.structure.ties) if tie.root in group.angles}
    links = list(dict.fromkeys(b.removesuffix(":rod") for b, (frame, _) in bodies.items() if frame in frames))
    slides = [mechanism.graph.slides[slide] for slide in group.slides]
    named = "-".join(dict.fromkeys([*links, *slides]))
    return f"{named} {FORMS.get(group.form, 'not held')}"


def loci(field: Field, patches: Sequence[Patch], *, singular: bool) -> list[Locus]:
    """Singularities inside a region, unless it is `singular` everywhere, then those that bound it, as curves."""
    reasons = causes(field)
    edges = [(*reasons[edge.margin], edge.places) for patch in patches for edge in patch.edges]
    edges = sorted((edge for edge in edges if edge[0] != "limit"), key=lambda edge: edge[:2])
    groups = [(*key, [places for *_, places in group]) for key, group in groupby(edges, key=lambda edge: edge[:2])]
    if not field.same_assembly and not singular:
        groups = [*_inside(field, patches), *groups]
    near = END_DISTANCE * max(float(np.max(patch.outer)) for patch in patches)
    return [Locus(kind, cause, curve) for kind, cause, own in groups for curve in joined(own, near)]


def _inside(field: Field, patches: Sequence[Patch]) -> list[tuple[str, str, list[Complexes]]]:
    """Forward singularities inside a region, on the lines of a grid of its patches to rounding: kind, cause, curves."""
    names = forward_names(field.mechanism)
    if not names:
        return []

    def values(z: Complexes) -> Floats:
        sizes = determinants(field.mechanism.linearize(field.configuration(z, {})))
        return np.stack([np.broadcast_to(np.asarray(d, dtype=float), z.shape) for d in sizes])

    curves: list[list[Complexes]] = [[] for _ in names]
    for patch in patches:
        place = _places(patch)
        row, column = np.meshgrid(*(np.arange(0, n - 1 + STEP, STEP) for n in (len(patch.theta), GRID)), indexing="ij")
        for k, at_nodes in enumerate(values(place(row, column))):

            def determinant(z: Complexes, k: int = k) -> Floats:
                return np.asarray(values(z)[k])

            def on_grid(row: Floats, column: Floats, determinant=determinant, place=place) -> Floats:  # type: ignore[no-untyped-def]
                return np.asarray(determinant(place(STEP * row, STEP * column)))

            for line in zero_curves(_without_rounding(at_nodes), on_grid):
                line = _thinned(STEP * line)
                curves[k].append(_to_boundary(field, determinant, patch, place(*line), line))
    return [(FORWARD, name, own) for name, own in zip(names, curves, strict=True)]


def _places(patch: Patch) -> Callable[[Floats, Floats], Complexes]:
    """Points of the plane at fractional rows and columns of a patch's grid."""
    # In the number of the row, angles and radii are smooth also where a ray is tangent to the boundary.
    rays = scipy.interpolate.CubicSpline(np.arange(len(patch.theta)), [patch.theta, patch.inner, patch.outer], axis=1)

    def place(row: Floats, column: Floats) -> Complexes:
        theta, inner, outer = rays(row)
        fraction = np.clip(0.5 * (1 - np.cos(np.pi * column / (GRID - 1))), INSET, 1 - INSET)
        return np.asarray(patch.about + (inner + fraction * (outer - inner)) * np.exp(1j * theta))

    return place


def _thinned(line: Floats) -> Floats:
    """Points of a curve on whole rows and columns, and its ends; all points of a small loop."""
    kept = (line % 1 == 0).any(axis=0)
    kept[[0, -1]] = True
    loop = (line[:, 0] == line[:, -1]).all() and np.count_nonzero(kept) < LOOP_POINTS
    return line if loop else line[:, kept]


def _without_rounding(values: Floats) -> Floats:
    """Values of a grid, with zero for what is but rounding: a curve may run along a line of the grid."""
    size = np.abs(values)
    largest = np.nanmax(size, initial=0.0)
    small = size <= ROUNDING * largest
    for row in (0, -1):
        zero = size[row] <= ROUNDING_OF_ENDS * largest
        # A single node may be near a curve that crosses the row.
        small[row] |= zero & (np.count_nonzero(zero) > 2)
    return np.where(small, 0.0, values)


def _to_boundary(
    field: Field, determinant: Callable[[Complexes], Floats], patch: Patch, curve: Complexes, line: Floats
) -> Complexes:
    """A curve of a patch, with points added where it ends at the patch's inner or outer boundary.

    The outermost columns of a grid lie a little inside the boundary. Where a leg is stretched or folded there, the
    determinant grows as the square root of the distance to it: its zero curve is tangent to the boundary, and ends
    farther along it than the column is away.
    """
    row, column = line
    for end in (0, -1):
        outside = column[end] == GRID - 1
        margin = patch.leaves if outside else patch.enters
        if curve[0] == curve[-1] or not (outside or column[end] == 0) or margin < 0:
            continue
        inner, outer = (np.interp(row[end], np.arange(len(patch.theta)), side) for side in (patch.inner, patch.outer))
        reach = END_ROWS * float(np.max(np.diff(patch.theta)) * (outer if outside else inner))
        met = _end(
            lambda z, margin=margin: field.margins(z, {})[margin],  # type: ignore[misc]
            determinant, complex(curve[end]), reach, float(outer - inner),
        )  # fmt: skip
        if met is not None:
            curve = np.append(curve, met) if end else np.append(met, curve)
    return curve


def _end(
    margin: Callable[[Complexes], Floats], determinant: Callable[[Complexes], Floats], near: complex, reach: float,
    width: float,
) -> complex | None:  # fmt: skip
    """Where the zero curve of a determinant meets the boundary, at most `reach` from a place near both."""
    h = DIFFERENCE * width
    star = h * np.array([[0], [1], [-1], [1j], [-1j]])

    def on_boundary(z: Complexes) -> tuple[Complexes, Complexes]:
        """Places of the boundary near others, and the directions inwards there, by Newton's method."""
        for _ in range(CORRECTIONS):
            at = margin(z + star)
            slope = (at[1] - at[2] + 1j * (at[3] - at[4])) / (2 * h)
            z = z - at[0] / np.conj(slope)
        return z, slope / np.abs(slope)

    def determinants_at(along: Floats) -> Floats:
        place, inwards = on_boundary(foot + along * tangent)
        return determinant(place + BESIDE * width * inwards)

    foot, normal = on_boundary(np.array([near]))
    tangent = 1j * normal
    # The secant method along the boundary, at two distances from it at once.
    before, now = np.full(2, -FIRST_STEP * reach), np.zeros(2)
    value = determinants_at(before)
    for _ in range(SECANTS):
        last, value = value, determinants_at(now)
        change = np.where(value == 0, 0.0, -value * (now - before) / (value - last))
        before, now = now, now + change
        if not (np.abs(change) > ACCURACY * reach).any():
            break
    (met,), _ = on_boundary(foot + (2 * now[0] - now[1]) * tangent)
    good = (np.abs(change) <= ACCURACY * reach).all() and abs(met - near) <= reach
    return complex(met) if good else None
