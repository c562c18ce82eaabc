"""Errors to the first order: sensitivities of position, velocity and acceleration, and what follows [S2, S3].

Var(output) = sum over sources of (d output / d source)^2 Var(source)          [S3, eqs. 12-14]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.reliability.deflection import Elastic
from mechdesign.analyses.reliability.error_limits import Channel
from mechdesign.analyses.reliability.sources import Source, Sources
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.outputs import Motion, acceleration_sensitivity, first, second, velocity_sensitivity
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.study.schema.reliability import LOADS

ORDERS = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Rates:
    """Rates and accelerations of the drives (radians and lengths per time): numbers, or arrays over poses."""

    velocity: tuple[Value, ...]
    acceleration: tuple[Value, ...]

    def take(self, index: Ints | int) -> Rates:
        """Those of some poses, or of one."""

        def part(values: tuple[Value, ...]) -> tuple[Value, ...]:
            return tuple(value if np.ndim(value) == 0 else value[index] for value in values)

        return Rates(part(self.velocity), part(self.acceleration))


@dataclass(frozen=True, eq=False)
class FirstOrder:
    """Linear error model at a batch of poses.

    Parameters
    ----------
    components : ndarray, shape (channels, components, poses)
        Derivative of each channel (radians, lengths) by each independent component of the sources.
    owner : ndarray of int, shape (components,)
        The source of each component.
    mean, variance : ndarray, shape (components,)
    correlation : ndarray, shape (components, components), or None
        Correlation coefficients of the components; None where they are independent.
    offset : ndarray, shape (channels, poses), or None
        Errors that nothing random causes: deflections.
    """

    sources: tuple[Source, ...]
    components: Floats
    owner: Ints
    mean: Floats
    variance: Floats
    correlation: Floats | None
    offset: Floats | None = None

    def take(self, poses: Sequence[int] | Ints) -> FirstOrder:
        """Some of the poses."""
        offset = None if self.offset is None else self.offset[:, poses]
        return replace(self, components=self.components[:, :, poses], offset=offset)

    def covariance(self) -> Floats:
        """Covariance of the channels, shape (poses, channels, channels) [S2, eq. 9]."""
        moved = np.moveaxis(self.components, 2, 0)
        return (
            np.asarray((moved * self.variance) @ np.swapaxes(moved, 1, 2))
            if self.correlation is None
            else (np.asarray(moved @ self._spread @ np.swapaxes(moved, 1, 2)))
        )

    @property
    def _spread(self) -> Floats:
        """Covariance of the components."""
        sigma = np.sqrt(self.variance)
        return np.diag(self.variance) if self.correlation is None else self.correlation * np.outer(sigma, sigma)

    def deviation(self) -> Floats:
        """Standard deviation of each channel, shape (channels, poses)."""
        if self.correlation is None:
            return np.asarray(np.sqrt(np.einsum("czp,z->cp", self.components**2, self.variance)))
        return np.asarray(np.sqrt(np.einsum("czp,zy,cyp->cp", self.components, self._spread, self.components)))

    def shift(self) -> Floats:
        """Mean error of each channel, shape (channels, poses): deflections, and tolerances that are not symmetric."""
        found = np.asarray(np.einsum("czp,z->cp", self.components, self.mean))
        return found if self.offset is None else found + self.offset

    def sensitivity(self) -> Floats:
        """Per source, shape (channels, sources, poses): the derivative, of a pin sqrt(s_x^2 + s_y^2)."""
        found = np.empty((self.components.shape[0], len(self.sources), self.components.shape[2]))
        for k in range(len(self.sources)):
            own = self.components[:, self.owner == k]
            found[:, k] = own[:, 0] if own.shape[1] == 1 else np.sqrt((own * own).sum(axis=1))
        return found

    def share(self) -> Floats:
        """Share of each source in the variance, shape (channels, sources, poses); nan where nothing varies.

        Of correlated sources each has its covariance with the error, which may be negative.
        """
        owned = np.zeros((len(self.sources), len(self.owner)))
        owned[self.owner, np.arange(len(self.owner))] = 1.0
        each = self.components * np.einsum("zy,cyp->czp", self._spread, self.components)
        parts = np.einsum("sz,czp->csp", owned, each)
        total = parts.sum(axis=1, keepdims=True)
        return np.asarray(np.divide(parts, total, out=np.full_like(parts, np.nan), where=total > 0))

    def worst_case(self, sensitivity: Floats) -> Floats:
        """Sum of |sensitivity| times the larger end of the tolerance, shape (channels, poses)."""
        reach = np.array([max(abs(end) for end in source.ends) for source in self.sources])
        return np.asarray(np.einsum("csp,s->cp", np.abs(sensitivity), reach))

    def worst_ends(self, sensitivity: Floats) -> tuple[Floats, Floats]:
        """Lowest and highest error with each source at the end of its tolerance that leads there, (channels, poses)."""
        low, high = (sensitivity * np.array(ends)[:, None]
                     for ends in zip(*(source.ends for source in self.sources), strict=True))  # fmt: skip
        offset = 0.0 if self.offset is None else self.offset
        return np.minimum(low, high).sum(axis=1) + offset, np.maximum(low, high).sum(axis=1) + offset


def nominal_values(
    mechanism: Mechanism, configuration: Configuration, channels: Sequence[Channel], rates: Rates
) -> list[Value]:
    """Values of the channels at solved configurations (radians, lengths)."""
    if all(channel.order == 0 for channel in channels):
        return [configuration.value(channel.coordinate) for channel in channels]
    linear = mechanism.linearize(configuration)
    velocity = linear.velocity(rates.velocity)
    bends = any(channel.order == 2 for channel in channels)
    acceleration = linear.acceleration(velocity, rates.acceleration) if bends else None
    values = []
    for channel in channels:
        if channel.order == 0:
            values.append(configuration.value(channel.coordinate))
        elif channel.order == 1:
            values.append(first(configuration, channel.coordinate, velocity))
        else:
            assert acceleration is not None
            values.append(second(configuration, channel.coordinate, velocity, acceleration))
    return values


def derivatives(
    mechanism: Mechanism,
    configuration: Configuration,
    channels: Sequence[Channel],
    names: Sequence[str],
    rates: Rates,
    elastic: Elastic | None = None,
) -> Floats:
    """Derivative of each channel by places, drives and loads, shape (channels, names, n).

    Parameters
    ----------
    configuration : Configuration
        A flat batch.
    elastic : Elastic, optional
        At these configurations, or at the single pose that all of them are about.

    Raises
    ------
    MechanismError
        For the acceleration of a measure that is an expression.
    """
    # Where loads alone vary, all mechanisms are the single nominal one.
    found = np.zeros((len(channels), len(names), *(configuration.shape or (1,))))
    for row, name in enumerate(names):
        if elastic is not None and name in LOADS:
            found[:, row] = elastic.by(name)
    rows = [row for row, name in enumerate(names) if name not in LOADS]
    if not rows:
        return found
    names = [names[row] for row in rows]
    linear = mechanism.linearize(configuration)
    position = linear.sensitivity(names)
    motion: Motion | None = None
    if any(channel.order for channel in channels):
        velocity = linear.velocity(rates.velocity)
        acceleration = linear.acceleration(velocity, rates.acceleration)
        velocity_z, acceleration_z = linear.rate_sensitivity(names, position, velocity, acceleration)
        assert acceleration_z is not None
        motion = Motion(velocity, acceleration, position, velocity_z, acceleration_z)
    for row, channel in zip(found, channels, strict=True):
        if motion is None or channel.order == 0:
            row[rows] = first(configuration, channel.coordinate, position)
        elif channel.order == 1:
            row[rows] = velocity_sensitivity(configuration, channel.coordinate, motion)
        else:
            row[rows] = acceleration_sensitivity(configuration, channel.coordinate, motion)
    return found


def linear_errors(
    mechanism: Mechanism,
    configuration: Configuration,
    channels: Sequence[Channel],
    sources: Sources,
    rates: Rates,
    elastic: Elastic | None = None,
) -> FirstOrder:
    """Linear error model at a flat batch of nominal configurations, the drives held, perhaps under a load.

    Raises
    ------
    MechanismError
        For the acceleration of a measure that is an expression.
    """
    linear_sources = sources.first_order
    directions = [(k, direction) for k, source in enumerate(linear_sources) for direction in source.directions]
    names = list(dict.fromkeys(name for _, direction in directions for name in direction))
    slopes = np.zeros((len(directions), len(names)))
    for row, (_, direction) in enumerate(directions):
        for name, slope in direction.items():
            slopes[row, names.index(name)] = slope
    return FirstOrder(
        linear_sources,
        np.einsum("zn,cnp->czp", slopes, derivatives(mechanism, configuration, channels, names, rates, elastic)),
        np.array([k for k, _ in directions], dtype=np.intp),
        np.array([linear_sources[k].mean for k, _ in directions]),
        np.array([linear_sources[k].variance for k, _ in directions]),
        sources.correlated(),
        None if elastic is None else elastic.offset,
    )
