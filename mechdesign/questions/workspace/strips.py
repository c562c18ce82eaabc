"""Integrals along rays: each interval's radius is written as r = inner + (outer - inner) (1 - cos pi v)/2, 0 <= v <= 1.

The rule is Gauss-Legendre in v. Segments of neighbouring rays make up a strip. Its error is that of the sum of its rays
as a function of v: what errs one way on a ray and the other way on the next is no error of the integral. The worst
strips of a design are halved until their errors are small; a segment that crosses a forward singularity is divided
there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.workspace.index import Prepared
from mechdesign.questions.workspace.local import Local
from mechdesign.region.rays import Scanned
from mechdesign.region.rules import Rule, cosine, spread

RADII = Rule.of(11, 2, 2.0)
# Segments are not halved more often than this.
MOST_HALVINGS = 12
# Share of the allowed errors that strips may have while others are divided.
KEPT = 0.5
# Share of the root of the sum of squares of single rays' errors that counts as the strip's, too: beside a corner at
# which two legs are stretched a few rays err by themselves, which the sum of all hardly shows.
ALONE = 0.01
# Segments evaluated at once (11 nodes each).
BLOCK = 4096
# Nearer to the boundary than this fraction of the radius, rounding spoils an index that is infinite there.
NEAREST = 3e-14
# Step of the difference that finds a forward singularity, as a fraction of the segment.
STEP = 0.01

# Parts of intervals of rays: those of [inner, outer] for v in [start, stop]; the weight of the ray in its cell's sum;
# and whether an index may have a kink near `inner` (-1) or `outer` (1), from isotropic point to point, else 0.
SEGMENT = np.dtype([
    *((name, np.intp) for name in ("ray", "design", "cell", "slot", "strip", "kink")),
    *((name, float) for name in ("theta", "inner", "outer", "start", "stop", "weight")),
])  # fmt: skip
Parts = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Integrand:
    """An index, or its square (for the standard deviation)."""

    index: Prepared
    power: int = 1

    def values(self, local: Local) -> Floats:
        """Values at points; 0 where there is none: on the boundary itself rounding leaves an interval of no width."""
        integrand = np.broadcast_to(np.asarray(self.index.values(local), dtype=float), local.configuration.shape)
        integrand = integrand**self.power
        return np.where(np.isfinite(integrand), integrand, 0.0)


@dataclass(frozen=True, eq=False)
class Strips:
    """Segments in the order of their strips, and the integrals over them.

    Parameters
    ----------
    segments : ndarray of SEGMENT, shape (segments,)
    first : ndarray of int, shape (strips,)
        The first segment of each strip.
    value, doubt : ndarray, shape (integrands, segments)
        Integrals of indices times radius along each segment, and their own estimated errors in the cell's sum.
    error, noise : ndarray, shape (integrands, strips)
        Estimated error of each strip's integral, and what rounding leaves of it.
    crossing : ndarray, shape (segments,)
        v near which a forward singularity divides a segment; nan where none does.
    uneven, place : ndarray, shape (segments,)
        The smallest `_unevenness` along a segment, and the radius where it is.
    """

    segments: Parts
    first: Ints
    value: Floats
    doubt: Floats
    error: Floats
    noise: Floats
    crossing: Floats
    uneven: Floats
    place: Floats

    @property
    def heads(self) -> Parts:
        """The first segment of each strip."""
        return self.segments[self.first]

    def of_cells(self, keep: Flags) -> Strips:
        """Those of some cells only; `keep` is of shape (cells,)."""
        if keep.all():
            return self
        some, strips = keep[self.segments["cell"]], keep[self.heads["cell"]]
        count = np.diff(np.append(self.first, len(self.segments)))[strips]
        return replace(
            self, segments=self.segments[some], first=np.cumsum(count) - count, value=self.value[:, some],
            doubt=self.doubt[:, some], error=self.error[:, strips], noise=self.noise[:, strips],
            crossing=self.crossing[some], uneven=self.uneven[some], place=self.place[some],
        )  # fmt: skip


def divided(parts: Parts, at: Floats) -> Parts:
    """Every part as two, divided at `at`; all first parts come first."""
    lower, upper = parts.copy(), parts.copy()
    lower["stop"] = upper["start"] = at
    return np.concatenate([lower, upper])


def along(
    designs: Scanned, integrands: Sequence[Integrand], strips: Strips, allowed: Floats, rays: int, cells: int
) -> tuple[Floats, Floats]:  # fmt: skip
    """Integrals along rays, shape (integrands, rays), and the errors that they leave in cells (integrands, cells).

    Strips of a design are divided until their errors together are no more than `allowed`, (integrands, designs).
    """
    value, error = np.zeros((len(integrands), rays)), np.zeros((len(integrands), cells))
    for halvings in range(MOST_HALVINGS + 1):
        segments, heads = strips.segments, strips.heads
        split = _worst(heads["design"], strips.error, strips.noise, allowed) & (halvings < MOST_HALVINGS)
        of = np.repeat(split, np.diff(np.append(strips.first, len(segments))))
        kept, left = heads[~split], np.zeros_like(allowed)
        for k in range(len(integrands)):
            value[k] += np.bincount(segments["ray"][~of], strips.value[k, ~of], rays)
            error[k] += np.bincount(kept["cell"], strips.error[k, ~split], cells)
            left[k] = np.bincount(kept["design"], strips.error[k, ~split], allowed.shape[1])
        if not split.any():
            break
        allowed = np.maximum(allowed - left, 0.0)
        rough, crossing = segments[of], strips.crossing[of]
        at, crossed = 0.5 * (rough["start"] + rough["stop"]), np.isfinite(crossing)
        if crossed.any():
            at[crossed] = _crossing(designs, rough[crossed], crossing[crossed])
        # Rays that cross a singularity and such that do not are strips of their own.
        rough["strip"] = np.unique(2 * rough["strip"] + crossed, return_inverse=True)[1]
        parts = divided(rough, at)
        parts["strip"] *= 2
        parts["strip"][len(rough) :] += 1
        strips = evaluate(designs, integrands, parts)
    return value, error


def _worst(owner: Ints, error: Floats, noise: Floats, allowed: Floats) -> Flags:
    """Strips to be divided: of designs that exceed what is allowed all but those that together err by `KEPT` of it."""
    share = np.where(error > noise, np.minimum(error / allowed[:, owner], 2.0), 0.0).max(axis=0, initial=0.0)
    order = np.lexsort((share, owner))
    total = np.append(0.0, np.cumsum(share[order]))
    split = np.zeros(len(owner), dtype=bool)
    split[order] = total[1:] - total[np.searchsorted(owner[order], owner[order])] > KEPT
    return split & (np.bincount(owner, share, allowed.shape[1]) > 1)[owner]


def evaluate(designs: Scanned, integrands: Sequence[Integrand], segments: Parts) -> Strips:
    """Integrals over segments, and their errors strip by strip."""
    segments = segments[np.argsort(segments["strip"], kind="stable")]
    first = np.flatnonzero(np.diff(segments["strip"], prepend=-1))
    value, doubt = np.empty((2, len(integrands), len(segments)))
    crossing, uneven, place = np.full((3, len(segments)), np.nan)
    sums = np.zeros((len(integrands), len(RADII.nodes), len(first)))
    unseen = np.zeros(value.shape)
    for k in range(0, len(segments), BLOCK):
        at = slice(k, k + BLOCK)
        part = segments[at]
        inner, outer, start, stop = (part[name] for name in ("inner", "outer", "start", "stop"))
        if (start == start[0]).all() and (stop == stop[0]).all():
            # The map's sines are those of one segment.
            start, stop = start[:1], stop[:1]
        half = 0.5 * (stop - start)
        v = start + half * (1 + RADII.nodes[:, None])
        r, slope = spread(inner, outer, v, cosine)
        # In an interval so narrow, rounding leaves nothing of the closures: it only exists at a cusp.
        measure = r * slope
        measure *= np.where(outer - inner > 100 * NEAREST * outer, half, 0.0)
        gap = np.minimum(NEAREST * outer, 0.5 * (outer - inner))
        r = np.clip(r, inner + gap, outer - gap)
        local = Local.on_rays(designs, part["design"], part["theta"], r)
        if not designs.field.same_assembly:
            crossing[at] = _sign_change(np.broadcast_to(v, r.shape), _inverse_determinant(local, r.shape))
        if len(local.homogeneous) == 2:
            uneven[at], place[at] = _evenest(r, _unevenness(local))
        # The strip of the block's first segment may have begun before.
        begin, end = np.searchsorted(first, k, side="right") - 1, np.searchsorted(first, k + len(part))
        begins = np.maximum(first[begin:end] - k, 0)
        for j, integrand in enumerate(integrands):
            values = integrand.values(local)
            unseen[j, at] = _beyond_nodes(part, r, values)
            values = values * measure
            value[j, at], doubt[j, at] = RADII.apply(values)
            sums[j, :, begin:end] += np.add.reduceat(values * part["weight"], begins, axis=1)
    error = np.array([RADII.apply(row)[1] for row in sums]).reshape(len(integrands), len(first))
    # What an inverse square root has within `NEAREST` of the boundary.
    width = segments["outer"] - segments["inner"]
    noise = np.nan_to_num(np.sqrt(NEAREST * segments["outer"] / width) * np.abs(value)) * segments["weight"]
    doubt = np.maximum(doubt * segments["weight"] - noise, 0.0)
    if len(first):
        noise = np.add.reduceat(noise, first, axis=1)
        error += ALONE * np.sqrt(np.add.reduceat(doubt * doubt, first, axis=1))
        error += np.add.reduceat(unseen * segments["weight"], first, axis=1)
    return Strips(segments, first, value, doubt, error, noise, crossing, uneven, place)


def _beyond_nodes(segments: Parts, r: Floats, values: Floats) -> Floats:
    """What a kink between the end of a segment and its nearest node would change, of which no node tells."""
    change_by = np.zeros(len(segments))
    for side, end, name, at, node in ((-1, "inner", "start", 0.0, 0), (1, "outer", "stop", 1.0, -1)):
        some = np.flatnonzero((segments["kink"] == side) & (segments[name] == at))
        near, far = r[[node, node - side], some[:, None]].T
        change, way = np.abs(values[node - side, some] - values[node, some]), np.abs(far - near)
        change_by[some] = change / np.where(way > 0, way, np.inf) * (segments[end][some] - near) ** 2 * near
    return change_by


def _unevenness(local: Local) -> Floats:
    """The square of how far Jacobians of two rows are from isotropy: smooth, and 0 where the singular values are one.

    Every matrix is the sum of a turning and a reflection, each times a size; it is the square of the sizes' ratio.
    """
    condition = np.broadcast_to(local.inverse_condition, local.configuration.shape)
    return np.where(np.isnan(condition), 1.0, ((1 - condition) / (1 + condition)) ** 2)


def _evenest(r: Floats, uneven: Floats) -> tuple[Floats, Floats]:
    """Smallest values of samples (first axis), by the parabolas about the lowest, and the radius of that."""
    lane = np.arange(r.shape[1])
    lowest = uneven.argmin(axis=0)
    near = np.clip(lowest, 1, len(r) - 2) + np.arange(-1, 2)[:, None]
    before, here, after = uneven[near, lane]
    left, right = np.diff(r[near, lane], axis=0)
    fall, rise = (before - here) / left, (after - here) / right
    way = 0.5 * (fall * right - rise * left) / (fall + rise)
    least = here - (fall + rise) / (left + right) * way * way
    inside = (fall > 0) & (rise > 0)
    return np.where(inside, np.maximum(least, 0.0), uneven[lowest, lane]), np.where(
        inside, r[near[1], lane] + way, r[lowest, lane]
    )


def _inverse_determinant(local: Local, shape: tuple[int, ...]) -> Floats:
    """One by the determinant of the Jacobian, which changes its sign at a forward singularity."""
    return np.broadcast_to(1 / local.determinant, shape)


def _sign_change(x: Floats, values: Floats) -> Floats:
    """A root between two nodes (first axis), by a straight line; nan where there is none."""
    # Where rounding leaves nothing of a determinant, at a cusp, its sign tells no place.
    finite = np.isfinite(values).all(axis=0)
    change = (values[1:] > 0) != (values[:-1] > 0)
    first, lane = change.argmax(axis=0), np.arange(values.shape[1])
    a, b = values[first, lane], values[first + 1, lane]
    root = x[first, lane] + (x[first + 1, lane] - x[first, lane]) * a / (a - b)
    return np.where(finite & change.any(axis=0), root, np.nan)


def _crossing(designs: Scanned, segments: Parts, v: Floats) -> Floats:
    """Where a forward singularity divides segments, by a step of Newton's method from `v`."""
    step = STEP * (segments["stop"] - segments["start"])
    around = v + step * np.array([-1.0, 0.0, 1.0])[:, None]
    r = spread(segments["inner"], segments["outer"], around, cosine)[0]
    local = Local.on_rays(designs, segments["design"], segments["theta"], r)
    low, middle, high = _inverse_determinant(local, r.shape)
    shift = 2 * middle / (low - high)
    return np.asarray(v + step * np.where(np.abs(shift) < 1, shift, 0.0))
