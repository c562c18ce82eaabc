"""First-order errors: sensitivities of position, velocity and acceleration, their moments and worst cases [S2, S3].

Var(output) = sum over sources of (d output / d source)^2 Var(source)          [S3, eqs. 12-14]
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.outputs import acceleration_sensitivity, first, second
from mechdesign.questions.kinematics.rates import DriveRates
from mechdesign.questions.reliability.deflection import Elastic
from mechdesign.questions.reliability.forces import ForceModel
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.question import Channel, columns_among
from mechdesign.questions.reliability.schema.variation import LOADS
from mechdesign.questions.reliability.sources import Pin, Sources


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """Linear error model at a batch of poses.

    Parameters
    ----------
    components : ndarray, shape (channels, components, poses)
        Derivative of each channel (radians, lengths) by each independent component of the sources.
    offset : ndarray, shape (channels, poses)
        Values where no source deviates: deflections under the mean load, or the nominal margins of assembly.
    """

    sources: Sources
    components: Floats
    offset: Floats

    @cached_property
    def owner(self) -> Ints:
        """Index of the source of each component, shape (components,)."""
        return np.repeat(np.arange(len(self.sources.all)), [len(source.directions) for source in self.sources.all])

    def take(self, poses: Sequence[int] | Ints) -> Self:
        """The model at these poses."""
        return replace(
            self, sources=self.sources.take(poses), components=self.components[:, :, poses],
            offset=self.offset[:, poses],
        )  # fmt: skip

    @cached_property
    def _spread(self) -> tuple[Floats, Floats]:
        """Mean and variance of each component, shape (components, poses); (components, 1) where poses do not differ."""
        spreads = [source.spread for source in self.sources.all]
        mean, variance = (_rows([spread[k] for spread in spreads])[self.owner] for k in (0, 1))
        return mean, variance

    @cached_property
    def _ends(self) -> tuple[Floats, Floats]:
        """Lowest and highest deviation of each source, shape (sources, poses) or (sources, 1)."""
        low, high = zip(*(source.ends for source in self.sources.all), strict=True)
        return _rows(low), _rows(high)

    @cached_property
    def _weighted(self) -> Floats:
        """Covariance of each component with the channels, in the shape of `components`."""
        variance, correlation = self._spread[1], self.sources.correlated()
        if correlation is None:
            return np.asarray(variance * self.components)
        sigma = np.sqrt(variance)
        if correlation.ndim == 2:
            return np.asarray(sigma * (correlation @ (sigma * self.components)))
        return np.asarray(sigma * np.einsum("pzy,cyp->czp", correlation, sigma * self.components))

    @property
    def whole(self) -> FirstOrder:
        """The model with all that limits are judged by; beside the channels the vectors of lengths, see `lengths`."""
        return self

    def alike(self) -> list[slice | Ints]:
        """Poses at which `limits` are those of the same channels of `whole`."""
        return [slice(None)]

    def limits(self, limits: Sequence[ErrorBound], poses: Any) -> list[ErrorBound]:
        """The limits of the channels, of errors, at some poses that are `alike`, as those of `whole`."""
        return [limit.at(poses) for limit in limits]

    def own(self, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance of the channels, from those of `whole`, in the shapes of `MethodResult.normal`."""
        return mean, covariance

    def beside(self, other: FirstOrder) -> FirstOrder:
        """A model with the channels of both."""
        return replace(
            self, components=np.concatenate([self.components, other.components]),
            offset=np.concatenate([self.offset, other.offset]),
        )  # fmt: skip

    def covariance(self) -> Floats:
        """Covariance of the channels, shape (poses, channels, channels) [S2, eq. 9]."""
        return np.asarray(np.moveaxis(self.components, 2, 0) @ np.moveaxis(self._weighted, 2, 0).swapaxes(1, 2))

    def deviation(self) -> Floats:
        """Standard deviation of each channel, shape (channels, poses)."""
        return np.asarray(np.sqrt(np.maximum(np.einsum("czp,czp->cp", self.components, self._weighted), 0.0)))

    def shift(self) -> Floats:
        """Mean error of each channel, shape (channels, poses): deflections, and tolerances that are not symmetric."""
        return np.asarray((self._spread[0] * self.components).sum(axis=1) + self.offset)

    def distance(self) -> Floats:
        """Mean of each channel in standard deviations, shape (channels, poses); infinite where it is nan."""
        return np.nan_to_num(self.shift() / self.deviation(), nan=np.inf, posinf=np.inf, neginf=-np.inf)

    @cached_property
    def sensitivity(self) -> Floats:
        """Derivative by each source, shape (channels, sources, poses); for a clearance sqrt(s_x^2 + s_y^2)."""
        parts = [self.components[:, self.owner == k] for k in range(len(self.sources.all))]
        return np.stack([part[:, 0] if part.shape[1] == 1 else np.linalg.norm(part, axis=1) for part in parts], axis=1)

    @cached_property
    def _steepest(self) -> Floats:
        """As `sensitivity`, but for a slider the sum over its two ends, which may both be at their worst."""
        steepest = self.sensitivity.copy()
        for k, source in enumerate(self.sources.all):
            if isinstance(source, Pin) and source.kind == "slide":
                steepest[:, k] = np.abs(self.components[:, self.owner == k]).sum(axis=1)
        return steepest

    @cached_property
    def parts(self) -> Floats:
        """What each source adds to the variance, shape (channels, sources, poses)."""
        products = self.components * self._weighted
        return np.stack([products[:, self.owner == k].sum(axis=1) for k in range(len(self.sources.all))], axis=1)

    def share(self) -> Floats:
        """Share of each source in the variance, shape (channels, sources, poses); nan where nothing varies.

        The share of a correlated source is its covariance with the error, which may be negative.
        """
        parts = self.parts
        total = parts.sum(axis=1, keepdims=True)
        return np.asarray(np.divide(parts, total, out=np.full_like(parts, np.nan), where=total > 0))

    def worst_case(self) -> Floats:
        """Sum of |sensitivity| times the larger end of the tolerance, shape (channels, poses)."""
        reach = np.maximum(*map(np.abs, self._ends))
        return np.asarray((np.abs(self._steepest) * reach).sum(axis=1))

    def worst_ends(self) -> tuple[Floats, Floats]:
        """Lowest and highest error with all sources at the worst ends of their tolerances, shape (channels, poses)."""
        low, high = (self._steepest * ends for ends in self._ends)
        return np.minimum(low, high).sum(axis=1) + self.offset, np.maximum(low, high).sum(axis=1) + self.offset


def correlation(covariance: Floats) -> Floats:
    """Correlation of two errors from their covariance, (..., 2, 2); nan if one is constant [inverse of S2, eq. 11]."""
    product = np.sqrt(covariance[..., 0, 0] * covariance[..., 1, 1])
    return np.asarray(np.where(product > 0, covariance[..., 0, 1] / product, np.nan))


def nominal_values(
    mechanism: Mechanism,
    configuration: Configuration,
    channels: Sequence[Channel],
    rates: DriveRates,
    forces: ForceModel | None = None,
) -> list[Value]:
    """Values of the channels at solved configurations (radians, lengths, forces in the study's units)."""
    linear, columns = mechanism.linearize(configuration), columns_among(channels)
    borne: Iterator[Value] = iter(())
    if columns:
        assert forces is not None
        borne = iter(forces.values(columns, linear, rates))
    highest = max((channel.order for channel in channels if channel.coordinate is not None), default=0)
    velocity = linear.velocity(rates.velocities) if highest else None
    acceleration = linear.acceleration(velocity, rates.accelerations) if velocity and highest > 1 else None

    def value(channel: Channel) -> Value:
        coordinate = channel.coordinate
        if coordinate is None:
            return next(borne)
        if velocity is None or channel.order == 0:
            return configuration.value(coordinate)
        if acceleration is None or channel.order == 1:
            return first(configuration, coordinate, velocity)
        return second(configuration, coordinate, velocity, velocity, acceleration)

    return [value(channel) for channel in channels]


def derivatives(
    mechanism: Mechanism,
    configuration: Configuration,
    channels: Sequence[Channel],
    names: Sequence[str],
    rates: DriveRates,
    elastic: Elastic | None = None,
    forces: ForceModel | None = None,
) -> Floats:
    """Derivative of each channel by places, drives and loads, shape (channels, names, n), at a flat batch.

    `elastic` has these configurations, or the single nominal pose of all of them. `forces` are those of the
    configurations, and the derivatives of these are difference quotients.
    """
    # If only loads vary, the batch is the single nominal mechanism.
    slopes = np.zeros((len(channels), len(names), *(configuration.shape or (1,))))
    for row, name in enumerate(names):
        if elastic is not None and name in LOADS:
            slopes[:, row] = elastic.flexibility[:, list(LOADS).index(name)]
    rows = [row for row, name in enumerate(names) if name not in LOADS]
    if not rows:
        return slopes
    names = [names[row] for row in rows]
    columns = columns_among(channels)
    moved = [(row, c.coordinate, c.order) for row, c in zip(slopes, channels, strict=True) if c.coordinate is not None]
    linear = mechanism.linearize(configuration)
    position = linear.sensitivity(names)
    if any(order for *_, order in moved):
        velocity = linear.velocity(rates.velocities)
        acceleration = linear.acceleration(velocity, rates.accelerations)
        velocity_z, acceleration_z = linear.rate_sensitivity(names, position, velocity, acceleration)
    for row, coordinate, order in moved:
        if order == 0:
            row[rows] = first(configuration, coordinate, position)
        elif order == 1:
            row[rows] = second(configuration, coordinate, velocity, position, velocity_z)
        else:
            row[rows] = acceleration_sensitivity(
                configuration, coordinate, (velocity, acceleration), (position, velocity_z, acceleration_z)
            )
    if columns:
        assert forces is not None
        own = np.flatnonzero([channel.coordinate is None for channel in channels])
        slopes[np.ix_(own, np.array(rows))] = forces.slopes(columns, mechanism, configuration, position, names, rates)
    return slopes


def _rows(values: Sequence[Number]) -> Floats:
    """Numbers as rows of an array, shape (numbers, poses), or (numbers, 1) where poses do not differ."""
    return np.stack(np.broadcast_arrays(*map(np.atleast_1d, values)))
