"""Singularities of a region: what ends it, in words, and the curves inside it where its assembly meets another.

A `forward` (parallel) singularity is where the drives no longer hold the mechanism: the determinant of a group of the
drives' structure vanishes. An `inverse` (serial) one is where a leg is stretched, folded or at the end of its reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from mechdesign.analyses.region.curves import Patch
from mechdesign.analyses.region.field import Field
from mechdesign.analyses.workspace.chains import joined
from mechdesign.analyses.workspace.contours import zero_curves
from mechdesign.analyses.workspace.degenerate import singular
from mechdesign.analyses.workspace.ends import Ends
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.derivatives import determinants
from mechdesign.mechanism.structure import Group
from mechdesign.numerics.arrays import Complexes, Floats

FORWARD, INVERSE = "forward", "inverse"
# Ends of curves this near to each other, as a part of the region, are one.
SAME = 1e-8
# Values this small, as a part of the largest, are zero but for rounding; what then stands for them. The first and the
# last row of a grid may lie a little beside the ends of its panel.
ZERO, TINY = 1e-13, 1e-300
BESIDE = 1e-7


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of singularities.

    Parameters
    ----------
    kind : str
        ``forward`` or ``inverse``.
    cause : str
        Which links, and what they do there.
    points : ndarray of complex
    """

    kind: str
    cause: str
    points: Complexes


def causes(field: Field) -> list[tuple[str, str]]:
    """What ends the region where each margin of a field is zero: ``limit``, ``forward`` or ``inverse``, and which."""
    names = forward_names(field.mechanism)
    stated = {bound.label: bound.coordinate.name for bound in field.mechanism.bounds}
    found = []
    for kind, label in field.labels:
        if kind == "limit":
            stem, _, side = label.rpartition(" ") if label not in stated else (label, "", "range")
            found.append((kind, f"{stated[stem]} {side}"))
        elif label.startswith("assembly "):
            found.append((FORWARD, names[int(label.removeprefix("assembly "))]))
        elif label == "continuation":
            found.append((INVERSE, "working mode ends"))
        else:
            leg = label.removesuffix(" length")
            found.append((INVERSE, label if leg == label else f"{leg} at zero length"))
    return found


def forward_names(mechanism: Mechanism) -> list[str]:
    """What the links of each group of the drives' structure do where its determinant vanishes."""
    return [_in_words(mechanism, group) for group in mechanism.forward.structure.groups if group.form != "place"]


def _in_words(mechanism: Mechanism, group: Group) -> str:
    bodies = mechanism.graph.bodies
    frames = {frame for frame, tie in enumerate(mechanism.forward.structure.ties) if tie.root in group.angles}
    links = list(dict.fromkeys(b.removesuffix(":rod") for b, (frame, _) in bodies.items() if frame in frames))
    slides = [mechanism.graph.slides[slide] for slide in group.slides]
    named = "-".join(dict.fromkeys([*links, *slides]))
    if group.form == "two angles":
        return f"{named} in line"
    if group.form == "angle and fixed slide":
        return f"{named} at right angles"
    if group.form == "two slides":
        return f"{named} parallel"
    return f"{named} not held"


def inside(field: Field, about: complex, patches: Sequence[Patch]) -> list[Locus]:
    """Forward singularities inside a region, found on a grid of its patches to rounding and ordered into curves."""
    names = forward_names(field.mechanism)
    if field.same_assembly or not names or all(singular(field, patch.grid(about)) for patch in patches):
        return []

    def values(z: Complexes) -> Floats:
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            found = determinants(field.mechanism.linearize(field.configuration(z, {})))
        return np.stack([np.broadcast_to(np.asarray(d, dtype=float), z.shape) for d in found])

    curves: list[list[Complexes]] = [[] for _ in names]
    for patch in patches:
        grid, place = patch.grid(about), _places(patch, about)
        for k, at_nodes in enumerate(values(grid)):

            def determinant(z: Complexes, k: int = k) -> Floats:
                return np.asarray(values(z)[k])

            seams = _seams(at_nodes)
            curves[k] += [grid[row, first:last] for row, first, last in seams]
            found = zero_curves(at_nodes, lambda row, column, d=determinant, p=place: d(p(row, column)))  # type: ignore[misc]
            ends = Ends(field, about, patch, determinant)
            curves[k] += [ends.extended(place(*lines), *lines) for lines in found]
    size = max(float(np.max(patch.outer)) for patch in patches)
    return [
        Locus(FORWARD, name, curve)
        for name, own in zip(names, curves, strict=True)
        for curve in joined(_once(own, SAME * size), SAME * size)
    ]


def _places(patch: Patch, about: complex) -> Callable[[Floats, Floats], Complexes]:
    """Points of the plane at fractional rows and columns of a patch's grid."""
    from scipy.interpolate import CubicSpline

    rows, fractions = np.arange(len(patch.theta)), patch.fractions()
    columns = np.arange(len(fractions))
    inner, outer = CubicSpline(patch.theta, patch.inner), CubicSpline(patch.theta, patch.outer)

    def place(row: Floats, column: Floats) -> Complexes:
        theta, fraction = np.interp(row, rows, patch.theta), np.interp(column, columns, fractions)
        low = inner(theta)
        return np.asarray(about + (low + fraction * (outer(theta) - low)) * np.exp(1j * theta))

    return place


def _seams(values: Floats) -> list[tuple[int, int, int]]:
    """Stretches of a grid's first and last row that are zero themselves; nodes of rounding alone are given a sign.

    Returns
    -------
    list of (row, first column, last column + 1)
    """
    part = np.full((len(values), 1), ZERO)
    part[[0, -1]] = BESIDE
    small = np.abs(values) <= part * np.nanmax(np.abs(values), initial=0.0)
    found = []
    for row, beside in ((0, 1), (len(values) - 1, len(values) - 2)):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], small[row].astype(int), [0]])))
        found += [(row, int(a), int(b)) for a, b in ends.reshape(-1, 2) if b - a > 2]
        values[row, small[row]] = np.copysign(TINY, values[beside, small[row]])
    values[1:-1][small[1:-1]] = TINY
    return found


def _once(curves: Sequence[Complexes], exact: float) -> list[Complexes]:
    """Curves without those that repeat another (the seam of two patches)."""
    kept: list[Complexes] = []
    for curve in curves:
        ends = {0: (curve[0], curve[-1]), 1: (curve[-1], curve[0])}
        if not any(
            len(other) == len(curve) and max(abs(a - other[0]), abs(b - other[-1])) <= exact
            for other in kept
            for a, b in ends.values()
        ):
            kept.append(curve)
    return kept


def around(field: Field, about: complex, patches: Sequence[Patch]) -> list[Locus]:
    """Singularities that bound a region, as curves."""
    told = causes(field)
    pieces: list[tuple[str, str, Complexes]] = []
    for patch in patches:
        for radius, margin in ((patch.inner, patch.enters), (patch.outer, patch.leaves)):
            if margin >= 0 and told[margin][0] != "limit":
                pieces.append((*told[margin], about + radius * np.exp(1j * patch.theta)))
    pieces.sort(key=lambda piece: piece[:2])
    size = max((float(np.max(patch.outer)) for patch in patches), default=1.0)
    found = []
    for (kind, cause), group in groupby(pieces, key=lambda piece: piece[:2]):
        found += [Locus(kind, cause, curve) for curve in joined([piece[2] for piece in group], SAME * size)]
    return found
