"""The region of a point over a range of a held coordinate: where some value of it serves, or where every one does.

A place is reached at every value of the range where the smallest of each margin over the range is positive, and at some
value where the largest over the range of the smallest margin is. Both are found from samples of the range. Between them
margins are parabolas, first through neighbouring samples, then through three values close to the extreme. After
C. M. Gosselin and M. Jean, Determination of the workspace of planar parallel manipulators with joint limits, Robotics
and Autonomous Systems 17 (1996).
"""

from __future__ import annotations

import copy
import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.numerics.roots import bracketed_roots
from mechdesign.region.crossings import sign_changes
from mechdesign.region.field import Field, Places
from mechdesign.region.intervals import Intervals, intervals_between
from mechdesign.region.rays import NARROWEST, Designs, trace

# Samples of the range: with half as many a stretch was missed, 2e-4 of the area of a 3-RPR's.
SAMPLES = 49
# Samples of the whole range that show where legs reach: distances are smooth in its values.
OF_LEGS = 17
# First and last sample of a stretch that a leg ends, as a part of it.
AT_END = 1e-9
# Samples are even steps of an angle, their values go with its sine. At the end of the range itself, where no leg is
# stretched, the angle is this (radians), so that the values are nearly even, too.
GENTLE = 0.5
# Places that are computed at once: their samples fit into the processor's cache.
BLOCK = 1024
# Distance of the values close to an extreme, as a part of the distance between samples.
CLOSE = 0.03
# An extreme farther from zero than so many times the difference to the neighbouring samples keeps its sign. Where every
# value is to be reached curves are followed from farther away.
FAR = (2.0, 100.0)
# So many margins at most can be the smallest near one extreme.
RIVALS = 4
# Places looked at between stretches of a ray that samples of the range reach, as parts of the distance.
BETWEEN = np.array([0.03, 0.3, 0.7, 0.97])
# In place of a margin that does not count.
HIGH = 1e30
# Accuracy of radii, as a part of the reach.
ROUNDING = 1e-11
# The name among the dimensions by which a value of the range is given.
VALUE = "value of the range"


@dataclass(frozen=True, eq=False)
class Ranged(Field):
    """A field over the range of the held coordinate `which`, from `low` to `high` (radians or length)."""

    which: int = 0
    low: float = 0.0
    high: float = 0.0
    # A kink so little inside a panel costs no more than its square; nearer to where labels change, rounding chooses.
    accuracy: ClassVar[float] = 1e-6

    @property
    def values(self) -> Floats:
        """Samples of the range."""
        return np.linspace(self.low, self.high, SAMPLES)

    @cached_property
    def sliced(self) -> Sliced:
        """The field at single values of the range."""
        common = self.mechanism, self.plan, self.held, self.same_assembly, self.length
        return Sliced(*common, self.which)

    @property
    def single(self) -> tuple[tuple[str, str], ...]:
        """Kind and name of the margins at single values."""
        return self.sliced.labels

    @property
    def singular(self) -> Flags:
        """No square roots are looked for."""
        return np.zeros(len(self.labels), dtype=bool)

    @property
    def rounding(self) -> Floats:
        """Nothing touches zero along a curve at all values of the range."""
        return np.zeros(len(self.labels))

    def at(self, z: Complexes, value: Value, assembly: bool = True) -> Floats:
        """Margins at single values of the range, shape (margins, *z.shape)."""
        return self.sliced.margins(z, {VALUE: value}, assembly=assembly)

    def sampled(self, z: Complexes, places: Places, *, assembly: bool = True) -> tuple[Floats, Complexes]:
        """As `Field.sampled`; of links that turn over all values of the range none is known."""
        return self.margins(z, places), np.zeros((0, *z.shape), dtype=complex)

    def extreme(self, label: int) -> int:
        """Which of the extremes over the range is zero where a label ends the region."""
        return label % len(self.single) if isinstance(self, Every) else 0

    def deciding(self, z: Complexes) -> tuple[Floats, Floats, Ints]:
        """Extremes over the range, the value that decides on each, and the two margins that do (or one, twice).

        Of shapes (extremes, *z.shape) and (2, extremes, *z.shape). Where every value is to be reached there is an
        extreme of each margin; else one.
        """
        blocks = np.array_split(z.ravel(), max(1, -(-z.size // BLOCK)))
        extreme, value, pair = (
            np.concatenate(part, axis=-1) for part in zip(*map(self._extremes, blocks), strict=True)
        )
        shape = (len(extreme), *z.shape)
        return extreme.reshape(shape), value.reshape(shape), pair.reshape(2, *shape)

    def _stretches(self, z: Complexes) -> tuple[Ints, Floats, Floats, Flags]:
        """Place, both ends, and whether a leg is stretched or folded at either, of stretches of the range to sample.

        Each place has one at least.
        """
        return np.arange(len(z)), np.full(len(z), self.low), np.full(len(z), self.high), np.zeros((2, len(z)), bool)

    def _extremes(self, z: Complexes) -> tuple[Floats, Floats, Ints]:
        every, (lane, low, high, singular) = isinstance(self, Every), self._stretches(z)
        samples, places, z = _Samples.of(low, high, singular), np.arange(len(z)), z[lane]
        margins = self.at(np.broadcast_to(z, (SAMPLES, len(z))), samples.value(np.arange(SAMPLES)[:, None]))
        height = _without_nan(-margins) if every else _smallest(margins)[None]
        node = height.argmax(axis=1)
        extreme, value = height.max(axis=1), samples.value(node)
        lowest = np.where(np.isnan(margins), np.inf, margins)[:, node[0], np.arange(len(z))].argmin(axis=0)
        pair = np.array(np.broadcast_to(lowest, (2, *extreme.shape)))
        row, which, top, at, names = self._refined(z, samples, margins, height)
        better = np.flatnonzero(top > extreme[row, which])
        better = better[np.argsort(top[better], kind="stable")]
        # Of several extremes of one stretch the last assigned is the highest, and of several stretches the last.
        where = row[better], which[better]
        extreme[where], value[where] = top[better], at[better]
        pair[:, where[0], where[1]] = names[:, better]
        order = np.lexsort((extreme[0], lane))
        best = order[np.searchsorted(lane[order], places, side="right") - 1]
        extreme, value, pair = extreme[:, best], value[:, best], pair[..., best]
        return np.where(np.isinf(extreme), np.nan, -extreme if every else extreme), value, pair

    def _refined(
        self, z: Complexes, samples: _Samples, margins: Floats, height: Floats
    ) -> tuple[Ints, Ints, Floats, Floats, Ints]:
        """Row, stretch, height, value of the range, and margins of the extremes near the highest samples."""
        every = isinstance(self, Every)
        row, node, lane = _peaks(height, FAR[every])
        peak, own = np.arange(len(row)), samples.only(lane)

        def highest(near: Floats, low: Floats | float, high: Floats | float) -> tuple[Floats, Floats, Ints]:
            return _highest(-near[row, :, peak].T[None] if every else near, low, high)

        middle = np.clip(node, 1, SAMPLES - 2)
        place = highest(np.stack([margins[:, middle + k, lane] for k in (-1, 0, 1)], axis=1), -1.0, 1.0)[0]
        centre = np.clip(middle + place, CLOSE, SAMPLES - 1 - CLOSE)
        near = self.at(np.broadcast_to(z[lane], (3, len(lane))), own.value(centre + CLOSE * np.array([[-1], [0], [1]])))
        first, last = -centre / CLOSE, (SAMPLES - 1 - centre) / CLOSE
        place, _, names = highest(near, np.maximum(first, -2), np.minimum(last, 2))
        at = own.value(np.where(place <= first, 0, np.where(place >= last, SAMPLES - 1, centre + CLOSE * place)))
        there = self.at(z[lane], at)
        top = _without_nan(-there[row, peak]) if every else _smallest(there)
        return row, lane, top, at, names


@dataclass(frozen=True, eq=False)
class _Samples:
    """Samples of stretches of a range: their ends, and the sines of which angles they are, shape (2, stretches)."""

    ends: Floats
    angles: Floats

    @staticmethod
    def of(low: Floats, high: Floats, singular: Flags) -> _Samples:
        """Samples of stretches; at ends that are `singular` the values of the range have no slope."""
        return _Samples(np.stack([low, high]), np.where(singular, 0.5 * np.pi, GENTLE) * np.array([[-1], [1]]))

    def only(self, some: Ints) -> _Samples:
        """Those of some of the stretches."""
        return _Samples(self.ends[:, some], self.angles[:, some])

    def value(self, sample: Floats | Ints) -> Floats:
        """Value of the range at the number of a sample of each stretch, or between two of them."""
        (low, high), (begin, end), part = self.ends, self.angles, sample / (SAMPLES - 1)
        share = (np.sin(begin + part * (end - begin)) - np.sin(begin)) / (np.sin(end) - np.sin(begin))
        return np.asarray(np.where(part == 1, high, low + share * (high - low)))


class Every(Ranged):
    """A field where every value of the range is to be reached.

    Its margins are those at both ends of the range, and the smallest of each over the range.
    """

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Kind and name of the margins."""
        return self.single * 3

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """As `Field.margins`; the same for all designs, as `places` is empty."""
        return np.concatenate([self.at(z, self.low), self.at(z, self.high), self.deciding(z)[0]])


class Some(Ranged):
    """A field where some value of the range is to be reached.

    A label is of a margin, inside the range or at its low or high end, or of two that leave no value between them.
    """

    @cached_property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Kind and name of what ends the region: of a pair, a limit only where both are."""
        pairs = [
            ("limit" if one[0] == other[0] == "limit" else "singularity", f"{one[1]} and {other[1]}")
            for one in self.single
            for other in self.single
        ]
        return (*self.single * 3, *pairs)

    def margins(self, z: Complexes, places: Places, *, assembly: bool = True) -> Floats:
        """Unknown, shape (labels, *z.shape): nothing but rays tells where labels change."""
        return np.full((len(self.labels), *z.shape), np.nan)

    def _stretches(self, z: Complexes) -> tuple[Ints, Floats, Floats, Flags]:
        """Those over which all legs reach, or the whole range."""
        whole, count, width = super()._stretches(z), int(self.sliced.singular.sum()), self.high - self.low
        if not count:
            return whole

        def legs(lane: Ints, part: Floats) -> tuple[Floats, Complexes]:
            margins = self.at(np.broadcast_to(z[lane], part.shape), self.low + part * width, assembly=False)
            return margins[:count], np.zeros((0, *part.shape), dtype=complex)

        accuracy, no = np.full(len(z), ROUNDING), np.zeros(count)
        margin, lane, turn, part, start, _ = sign_changes(legs, len(z), OF_LEGS, accuracy, accuracy, no, no > 0)
        reached = intervals_between(margin, lane, turn, part, start, np.ones(len(z)), 0.0)
        reached = reached.kept(reached.outer - reached.inner > NARROWEST)
        if not len(reached.ray):
            return whole
        ended = np.stack([reached.enters, reached.leaves]) >= 0
        inset = AT_END * (reached.outer - reached.inner)
        low, high = np.stack([reached.inner, reached.outer]) + ended * inset * [[1], [-1]]
        left = np.flatnonzero(reached.counts == 0)
        return (
            np.append(reached.ray, whole[0][left]),
            np.append(np.where(ended[0], self.low + low * width, self.low), whole[1][left]),
            np.append(np.where(ended[1], self.low + high * width, self.high), whole[2][left]),
            np.concatenate([ended, whole[3][:, left]], axis=1),
        )


@dataclass(frozen=True, eq=False)
class Sliced(Field):
    """A field whose value of the held coordinate `which` is given among the places."""

    which: int = 0

    def look(self, z: Complexes, places: Places, assembly: bool) -> tuple[Floats, Configuration]:
        """As `Field.look`."""
        sizes, held = dict(places), list[Value](self.held)
        held[self.which] = sizes.pop(VALUE)
        assert self.labels is not None
        # What is known of the sketch is copied, too.
        field = copy.copy(self)
        object.__setattr__(field, "held", tuple(held))
        return Field.look(field, z, sizes, assembly)


def _without_nan(values: Floats) -> Floats:
    """Values, and -inf where they are unknown."""
    return np.where(np.isnan(values), -np.inf, values)


def _smallest(margins: Floats) -> Floats:
    """The smallest margin, never positive where one is unknown."""
    least: Floats = np.fmin.reduce(margins)
    return _without_nan(np.where(np.isnan(margins).any(axis=0), np.minimum(least, 0.0), least))


def _peaks(height: Floats, far: float) -> tuple[Ints, Ints, Ints]:
    """Row, sample and lane of the local maxima of (rows, samples, lanes) not so far from zero for their slopes."""
    with np.errstate(invalid="ignore"):
        rise = np.nan_to_num(np.diff(height, axis=1), nan=0.0, posinf=HIGH, neginf=-HIGH)
    steep = np.abs(rise)
    # At an end of the range the rise to the peak is not seen: the next one tells.
    steep = np.maximum(np.insert(steep, 0, steep[:, 1], axis=1), np.append(steep, steep[:, -2:-1], axis=1))
    peak = (np.insert(rise, 0, 0.0, axis=1) >= 0) & (np.append(rise, 0 * rise[:, :1], axis=1) <= 0)
    peak &= (np.abs(height) <= far * steep) & np.isfinite(height)
    row, node, lane = np.nonzero(peak)
    return row, node, lane


def _highest(y: Floats, low: Floats | float, high: Floats | float) -> tuple[Floats, Floats, Ints]:
    """Where the smallest of parabolas is largest between `low` and `high`, and the two that meet there (or one, twice).

    Parameters
    ----------
    y : ndarray, shape (parabolas, 3, n)
        The parabolas at -1, 0 and 1; one that is unknown there does not count.
    """
    finite = np.isfinite(y).all(axis=1)
    before, a, after = (np.where(finite, y[:, k], HIGH) for k in range(3))
    b, c = 0.5 * (after - before), 0.5 * (after + before) - a
    least = np.minimum(np.minimum(before, a), after)
    rival = np.argsort(least, axis=0)[:RIVALS]
    first, second, bend = (np.take_along_axis(v, rival, axis=0) for v in (a, b, c))
    meets = list(itertools.combinations(range(len(rival)), 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        places = [*(-0.5 * second / bend), np.broadcast_to(low, y.shape[2:]), np.broadcast_to(high, y.shape[2:])]
        for i, j in meets:
            d, e, f = first[i] - first[j], second[i] - second[j], bend[i] - bend[j]
            half = -0.5 * (e + np.copysign(np.sqrt(e * e - 4 * d * f), e))
            places += [half / f, d / half]
        place = np.stack(places)
        place = np.clip(np.where(np.isfinite(place), place, 0.0), low, high)
        value = (a[:, None] + place * (b[:, None] + place * c[:, None])).min(axis=0)
    best, lane = value.argmax(axis=0), np.arange(y.shape[2])
    place, top = place[best, lane], value[best, lane]
    lowest = np.argsort(a + place * (b + place * c), axis=0)
    pair = np.where(best >= len(rival) + 2, np.sort(lowest[:2], axis=0), lowest[0])
    return place, top, pair


@dataclass(frozen=True, eq=False)
class SomeDesigns(Designs):
    """Rays through a region where some value of a range serves; `field` is of `Some`."""

    @property
    def _over(self) -> Some:
        assert isinstance(self.field, Some)
        return self.field

    def look(self, z: Complexes, design: Ints, *, assembly: bool = False) -> tuple[Flags, Floats]:
        """As `Designs.look`."""
        height = self._over.deciding(z)[0]
        return np.asarray(height[0] > 0), height

    def traced(self, design: Ints, theta: Floats, reach: Floats, slack: float) -> Intervals:
        """As `Designs.traced`: between places of each ray of which some samples of the range tell that they matter."""
        over, rays = self._over, np.arange(len(theta))
        start, direction = self.starts(design), np.exp(1j * theta)

        def height(ray: Ints, radius: Floats) -> Floats:
            height_at: Floats = over.deciding(start[ray] + radius * direction[ray])[0][0]
            return height_at

        x = self._places(start, theta, reach)
        values = height(np.broadcast_to(rays, x.shape), x)
        positive = values > 0
        cell, ray = np.nonzero(positive[1:] != positive[:-1])
        (a, b), (fa, fb), none = x[[cell, cell + 1], ray], values[[cell, cell + 1], ray], np.full(len(ray), np.nan)
        radius = bracketed_roots(
            lambda which, radius: height(ray[which], radius), a, fa, b, fb, none, none, ROUNDING * reach[ray]
        )
        turn = np.where(fb > 0, 1, -1)
        _, value, pair = over.deciding(start[ray] + radius * direction[ray])
        (one, other), count = pair[:, 0], len(over.single)
        # Beside where a leg is stretched or folded it is for rounding to say whether that decides, too.
        one = np.where(over.sliced.singular[one], np.where(over.sliced.singular[other], one, other), one)
        end = (value[0] <= over.low) + 2 * (value[0] >= over.high)
        label = np.where(one == other, one + count * end, (3 + one) * count + other)
        intervals = intervals_between(label, ray, turn, radius, (~positive[0]).astype(np.intp), reach, slack)
        wide = intervals.outer - intervals.inner > NARROWEST * reach[intervals.ray]
        return intervals if slack else intervals.kept(wide)

    def _places(self, start: Complexes, theta: Floats, reach: Floats) -> Floats:
        """Radii of each ray, ascending, shape (places, rays), of which two neighbours hold at most one end."""
        over, rays = self._over, len(theta)
        lanes = np.arange(rays * SAMPLES)
        values = {VALUE: np.tile(over.values, rays)}
        slices = Designs(over.sliced, values, len(lanes), self.about, self.scan, self.effort, np.repeat(start, SAMPLES))
        intervals = trace(slices, lanes, np.repeat(theta, SAMPLES), np.repeat(reach, SAMPLES))
        # Stretches that some sample of the range reaches, by how many do.
        ray, radius = np.tile(intervals.ray // SAMPLES, 2), np.concatenate([intervals.inner, intervals.outer])
        turn = np.repeat([1, -1], len(intervals.ray))
        order = np.lexsort((-turn, radius, ray))
        ray, radius, turn = ray[order], radius[order], turn[order]
        cover = np.cumsum(turn)
        begins, ends = (turn > 0) & (cover == 1), cover == 0
        owner, inner, outer = ray[begins], radius[begins], radius[ends]
        every = np.arange(rays)
        # Gaps before, between and behind them.
        low_of, low = np.concatenate([every, owner]), np.concatenate([np.zeros(rays), outer])
        high_of, high = np.concatenate([owner, every]), np.concatenate([inner, reach])
        one, two = np.lexsort((low, low_of)), np.lexsort((high, high_of))
        between = low[one] + BETWEEN[:, None] * (high[two] - low[one])
        ray = np.concatenate([every, every, owner, owner, owner, *[low_of[one]] * len(BETWEEN)])
        radius = np.concatenate([0 * reach, reach, inner, 0.5 * (inner + outer), outer, between.ravel()])
        order = np.lexsort((radius, ray))
        ray, radius = ray[order], radius[order]
        slot = np.arange(len(ray)) - np.searchsorted(ray, ray)
        x = np.tile(reach, (int(slot.max()) + 1, 1))
        x[slot, ray] = radius
        return x
