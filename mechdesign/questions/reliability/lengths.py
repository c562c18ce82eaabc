"""Lengths of vectors among the channels: distances, sizes of forces, absolute values.

To the first order the components of a vector are normal; its length is nearly so where it is long beside their
deviations. About zero it has no derivative, and a law of its own [Rayleigh, 1880; Hoyt, 1947; Rice, 1945]: its moments
are integrals over the directions, and limits of it are circles about zero in the plane of the components.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy

from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.question import ReliabilityQuestion

# Length of a mean vector, in deviations of its components, up to which its length has a law of its own. Beyond it the
# vector turns by less than 2 degrees, and its length is linear to 1/60 of a deviation.
_LONG = 30.0
# Deviations within which a corner of an expression leaves no first order: 0.3 % of made mechanisms lie beyond.
_NEAR = 3.0
# Directions of the integral over a turn, and of the search for the longest vector.
_DIRECTIONS = 512


@dataclass(frozen=True, eq=False)
class WithLengths(FirstOrder):
    """A linear model with the vectors whose lengths some channels are.

    Parameters
    ----------
    outputs : tuple of int
        The channels.
    vectors : FirstOrder
        Model of their components, x and y of the first and so on: values, not errors.
    sizes : ndarray, shape (lengths, poses)
        Nominal lengths.
    """

    outputs: tuple[int, ...]
    vectors: FirstOrder
    sizes: Floats

    def take(self, poses: Sequence[int] | Ints) -> Self:
        return replace(super().take(poses), vectors=self.vectors.take(poses), sizes=self.sizes[:, poses])

    @cached_property
    def _vectors(self) -> FirstOrder:
        """The vectors, by the laws of the sources of this model."""
        return replace(self.vectors, sources=self.sources)

    @cached_property
    def short(self) -> Flags:
        """Where a length has a law of its own, shape (lengths, poses): short beside its deviation or its mean error."""
        mean, deviation = self._vectors.shift(), self._vectors.deviation()
        length, spread = (np.hypot(part[0::2], part[1::2]) for part in (mean, deviation))
        least = np.minimum(length, self.sizes)
        return np.asarray((least <= _LONG * spread) | (self.sizes < _LONG * np.abs(length - self.sizes)))

    @cached_property
    def whole(self) -> FirstOrder:
        components = self.components.copy()
        for output, short in zip(self.outputs, self.short, strict=True):
            components[output, :, short] = 0.0
        return FirstOrder(self.sources, components, self.offset).beside(self._vectors)

    def alike(self) -> list[slice | Ints]:
        patterns, rows = np.unique(self.short, axis=1, return_inverse=True)
        return [np.flatnonzero(rows.ravel() == k) for k in range(patterns.shape[1])]

    def limits(self, limits: Sequence[ErrorBound], poses: Any) -> list[ErrorBound]:
        places = {output: k for k, output in enumerate(self.outputs) if self.short[k, poses].any()}
        count, linear, rings = len(self.components), list[ErrorBound](), list[ErrorBound]()
        for limit in super().limits(limits, poses):
            k = None if limit.round else places.get(limit.output)
            if k is None:
                linear.append(limit)
                continue
            ends = self.sizes[k, poses] + limit.low, self.sizes[k, poses] + limit.high
            rings.append(ErrorBound((count + 2 * k, count + 2 * k + 1), *ends))
        return [*linear, *rings]

    def own(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        count = len(self.components)
        moments = mean[:count].copy(), covariance[:, :count, :count].copy()
        for k, (output, short) in enumerate(zip(self.outputs, self.short, strict=True)):
            rows, pair = np.flatnonzero(short), slice(count + 2 * k, count + 2 * k + 2)
            middle, spread = mean[pair, rows].T, covariance[rows, pair, pair]
            length, slope = length_moments(middle, spread)
            moments[0][output, rows] = length - self.sizes[k, rows]
            # Covariance with a normal error [Stein, 1981].
            cross = np.einsum("pca,pa->pc", covariance[rows, :count, pair], slope)
            for other, also in zip(self.outputs[:k], self.short[:k], strict=True):
                cross[also[rows], other] = np.nan
            moments[1][rows, output], moments[1][rows, :, output] = cross, cross
            square = (middle**2).sum(axis=1) + np.trace(spread, axis1=1, axis2=2)
            moments[1][rows, output, output] = np.maximum(square - length**2, 0.0)
        return moments

    @cached_property
    def _own(self) -> tuple[Floats, Floats]:
        return self.own(self.whole.shift(), self.whole.covariance())

    def covariance(self) -> Floats:
        return self._own[1]

    def deviation(self) -> Floats:
        return np.asarray(np.sqrt(np.maximum(np.diagonal(self._own[1], axis1=1, axis2=2).T, 0.0)))

    def shift(self) -> Floats:
        return self._own[0]

    @cached_property
    def _means(self) -> Floats:
        """Derivatives of the mean lengths by the vectors, shape (lengths, 2, poses); zero where they are long."""
        mean, covariance = self._vectors.shift(), self._vectors.covariance()
        slopes = np.zeros((len(self.outputs), 2, mean.shape[1]))
        for k, short in enumerate(self.short):
            rows, pair = np.flatnonzero(short), slice(2 * k, 2 * k + 2)
            slopes[k][:, rows] = length_moments(mean[pair, rows].T, covariance[rows, pair, pair])[1].T
        return slopes

    def _along(self, way: Floats) -> FirstOrder:
        """The parts of the vectors along a way, of shape (lengths, 2, poses) or (2, 1)."""
        x, y = way[..., 0, :], way[..., 1, :]
        components, offset = self._vectors.components, self._vectors.offset
        along = x[..., None, :] * components[0::2] + y[..., None, :] * components[1::2]
        return FirstOrder(self.sources, along, x * offset[0::2] + y * offset[1::2])

    @cached_property
    def parts(self) -> Floats:
        """As of the linear model; what the mean length does not say of a short one is shared as its mean square is."""
        along, square = self._along(self._means).parts, self._vectors.parts[0::2] + self._vectors.parts[1::2]
        rest = self.deviation()[list(self.outputs)] ** 2 - along.sum(axis=1)
        own = along + square * (np.maximum(rest, 0.0) / square.sum(axis=1))[:, None]
        return self._replaced(super().parts, np.nan_to_num(own))

    @cached_property
    def sensitivity(self) -> Floats:
        """As of the linear model; of a length about zero the size of the vector's derivative."""
        way, along = self._means, self._along(self._means).sensitivity
        size = np.hypot(self._vectors.sensitivity[0::2], self._vectors.sensitivity[1::2])
        turned = np.maximum(1.0 - (way**2).sum(axis=1), 0.0)[:, None] * size**2
        own = np.where(along < 0, -1.0, 1.0) * np.sqrt(along**2 + turned)
        return self._replaced(super().sensitivity, own)

    def worst_case(self) -> Floats:
        low, high = self._farthest
        return self._replaced(super().worst_case(), np.maximum(-low, high))

    def worst_ends(self) -> tuple[Floats, Floats]:
        low, high = super().worst_ends()
        return self._replaced(low, self._farthest[0]), self._replaced(high, self._farthest[1])

    @cached_property
    def _farthest(self) -> tuple[Floats, Floats]:
        """Lowest and highest error of lengths by all ends of tolerances, shape (lengths, poses)."""
        least, most = np.zeros((2, *self.sizes.shape))
        for angle in 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS if self.short.any() else ():
            low, high = self._along(np.array([[np.cos(angle)], [np.sin(angle)]])).worst_ends()
            least, most = np.maximum(least, low), np.maximum(most, high)
        return least - self.sizes, most - self.sizes

    def _replaced(self, linear: Floats, own: Floats) -> Floats:
        """Values of the linear model, those of lengths about zero by their own, along the axes channels ... poses."""
        values = linear.copy()
        for output, short, value in zip(self.outputs, self.short, own, strict=True):
            values[output][..., short] = value[..., short]
        return values


def model_of(question: ReliabilityQuestion, linear: FirstOrder, nominal: Floats) -> FirstOrder:
    """The model of a question's channels from that of its `whole` channels, which have these nominal values.

    It is nan where a corner of an expression lies within the errors.
    """
    count = len(question.channels)
    components = linear.components.copy()
    lengths = dict(question.lengths)
    for output, near in near_corners(question, linear, nominal):
        for row in (output, *(place for place in lengths.get(output, ()) if place >= 0)):
            components[row][:, near] = np.nan
    channels = FirstOrder(linear.sources, components[:count], linear.offset[:count])
    if not lengths:
        return channels
    rows = question.rows[count:]
    # A vector of a single component has zero as the other one.
    slopes, values = (np.concatenate([part, np.zeros((1, *part.shape[1:]))])[rows]
                      for part in (components, linear.offset + nominal))  # fmt: skip
    vectors = FirstOrder(linear.sources, slopes, values)
    return WithLengths(
        linear.sources, channels.components, channels.offset, tuple(lengths), vectors, nominal[list(lengths)]
    )


def near_corners(question: ReliabilityQuestion, linear: FirstOrder, nominal: Floats) -> Iterator[tuple[int, Flags]]:
    """Channels with a corner within `_NEAR` deviations, and at which poses, shape (poses,)."""
    if not question.bends:
        return
    mean, deviation = nominal + linear.shift(), linear.deviation()
    for output, places, bend in question.bends:
        together = np.ones(nominal.shape[1:], dtype=bool)
        for place in places:
            away = mean[place] - np.reshape(bend.levels, (-1, 1))
            away = away - bend.period * np.round(away / bend.period) if bend.period else away
            # What is not a number is not smooth either.
            together &= ~(np.abs(away).min(axis=0) > _NEAR * deviation[place])
        yield output, together


def length_moments(mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Mean length of normal vectors, shape (n,), and its derivative by their mean, shape (n, 2).

    Parameters
    ----------
    mean, covariance : ndarray, shape (n, 2) and (n, 2, 2)

    Notes
    -----
    The length is a quarter of the integral over all directions of the absolute value of the part along each, which is
    that of a normal variable. By the trapezoidal rule, whose steps shrink towards the principal axes: across the longer
    one the part along a direction varies least.
    """
    squares, axes = np.linalg.eigh(covariance)
    steps = 2 * np.pi * (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    angle, weight = steps - 0.25 * np.sin(4 * steps), (1.0 - np.cos(4 * steps)) * np.pi / (2 * _DIRECTIONS)
    way = np.stack([np.cos(angle), np.sin(angle)])
    sigma = np.sqrt(np.maximum(squares, 0.0) @ way**2)
    along = np.einsum("pij,pi->pj", axes, mean) @ way
    ratio = np.where(sigma > 0, along / (sigma * np.sqrt(2.0)), np.where(along == 0, 0.0, np.sign(along) * np.inf))
    side = scipy.special.erf(ratio)
    length = (sigma * np.sqrt(2.0 / np.pi) * np.exp(-(ratio**2)) + along * side) @ weight
    return length, np.einsum("pij,pj->pi", axes, (side * weight) @ way.T)
