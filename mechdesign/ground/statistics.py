"""Statistics of a quantity, over the rows of a table or along a motion or a part of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from mechdesign.ground.errors import counted
from mechdesign.ground.numerics.arrays import Flags, Floats

# Values this little beyond an end of an interval, as a part of the end (or of a turn), count as inside.
AT_END = 1e-9


class Spread(Protocol):
    """Values of each design; every number is of shape (designs,), nan where there are no values."""

    def end(self, sign: int) -> Floats:
        """The largest value, or with the sign -1 the smallest."""

    def mean(self, power: int) -> Floats:
        """Mean of a power of the values."""

    def size(self) -> Floats:
        """Mean of the absolute values."""


class Statistic(NamedTuple):
    """A number that describes many values, such as their mean.

    Parameters
    ----------
    meaning : str
    of : callable
        The number of each design.
    pure : bool
        Whether it has no unit; else it has that of the values.
    integral : bool
        Whether it contains a mean, which is an integral along a motion.
    end : int
        1 where it is the largest value, -1 where it is the smallest, else 0.
    absolute : bool
        Whether the end is that of the absolute values.
    """

    meaning: str
    of: Callable[[Spread], Floats]
    pure: bool = False
    integral: bool = False
    end: int = 0
    absolute: bool = False


def _evenness(values: Spread) -> Floats:
    fluctuation = values.end(1) - values.end(-1)
    return np.where(np.isinf(fluctuation), -np.inf, 1.0 - fluctuation / values.size())


STATISTICS: Mapping[str, Statistic] = {
    "min": Statistic("smallest value", lambda values: values.end(-1), end=-1),
    "max": Statistic("largest value", lambda values: values.end(1), end=1),
    "mean": Statistic("mean value", lambda values: values.mean(1), integral=True),
    "range": Statistic("largest less smallest value", lambda values: values.end(1) - values.end(-1)),
    "rms": Statistic("root of the mean square", lambda values: np.sqrt(values.mean(2)), integral=True),
    "peak": Statistic(
        "largest absolute value", lambda values: np.maximum(values.end(1), -values.end(-1)), end=1, absolute=True
    ),
    "evenness": Statistic("1 less the range over the mean absolute value", _evenness, pure=True, integral=True),
}
"""Statistics by the word behind the name of a column.

The evenness is 1 less the coefficient of fluctuation, the range of a speed over its mean (Norton, Design of Machinery;
Shigley's Mechanical Engineering Design, both in the chapter on flywheels). The divisor is the mean of the absolute
values, as the mean of a quantity that changes its sign may be zero.
"""


@dataclass(frozen=True, eq=False)
class RowSpread:
    """Values of the rows of a table that count.

    Parameters
    ----------
    values : ndarray, shape (designs, rows)
    counts : bool array, of the same shape
    """

    values: Floats
    counts: Flags

    def end(self, sign: int) -> Floats:
        """The largest value, or with the sign -1 the smallest; nan where a row has none."""
        return worst(self.values, self.counts, largest=sign > 0)

    def mean(self, power: int) -> Floats:
        """Mean of a power of the values."""
        return self._mean(self.values**power)

    def size(self) -> Floats:
        """Mean of the absolute values."""
        return self._mean(np.abs(self.values))

    def _mean(self, values: Floats) -> Floats:
        number = self.counts.sum(axis=-1)
        total = np.where(self.counts, values, 0.0).sum(axis=-1)
        return np.asarray(np.where(number > 0, total / np.maximum(number, 1), np.nan))


@dataclass(frozen=True, eq=False)
class Several:
    """Values of several columns along motions, of as many values each, as those of one, and of the rows among them.

    Values up to `rounding` are rounding.
    """

    parts: Sequence[Spread]
    rows: RowSpread
    rounding: float

    def end(self, sign: int) -> Floats:
        """The largest value of all, or with the sign -1 the smallest: that of a row where it is farther out."""
        between = sign * np.max([sign * part.end(sign) for part in self.parts], axis=0)
        row = self.rows.end(sign)
        return np.where(sign * (row - between) > np.maximum(AT_END * np.abs(between), self.rounding), row, between)

    def mean(self, power: int) -> Floats:
        """Mean of a power of all values."""
        return np.asarray(np.mean([part.mean(power) for part in self.parts], axis=0))

    def size(self) -> Floats:
        """Mean of all absolute values."""
        return np.asarray(np.mean([part.size() for part in self.parts], axis=0))


def worst(values: Floats, counts: Flags, *, largest: bool) -> Floats:
    """The smallest or largest of the rows that count, along the last axis; nan if one is nan or none counts."""
    none = -np.inf if largest else np.inf
    inside = np.where(counts, values, none)
    value = inside.max(axis=-1, initial=none) if largest else inside.min(axis=-1, initial=none)
    return np.where(counts.any(axis=-1), value, np.nan)


class Interval(NamedTuple):
    """Values from `low` to `high` in the unit of a column; whole turns do not count for an angle with a `turn`."""

    low: float = -np.inf
    high: float = np.inf
    turn: float = 0.0

    def holds(self, values: Floats) -> Flags:
        """Which values lie in it, within rounding; nan does not."""
        if self.turn:
            slack = AT_END * self.turn
            return np.asarray((values - self.low + slack) % self.turn <= (self.high - self.low) % self.turn + 2 * slack)
        low, high = self.low - AT_END * abs(self.low), self.high + AT_END * abs(self.high)
        return np.asarray((values >= low) & (values <= high))

    def over(self, values: Floats) -> list[Floats]:
        """Functions of the values that cross zero where the values pass an end of the interval."""
        ends = [end for end in (self.low, self.high) if np.isfinite(end)]
        return [np.sin(np.pi * (values - end) / self.turn) if self.turn else values - end for end in ends]


@runtime_checkable
class ValueRange(Protocol):
    """Values from one to another, such as `mechdesign.study.schema.conditions.Span`."""

    def interval(self, unit: str) -> Interval:
        """The values in a unit of a table; raises ValueError if it is another kind of quantity."""


@runtime_checkable
class Measured(Protocol):
    """A number with a unit, such as `mechdesign.study.text.units.Amount`."""

    def within(self, unit: str) -> float:
        """The number in a unit of a table; raises ValueError if it is another kind of quantity."""


# A part of a motion: columns, and the interval in which each lies there.
Part = tuple[tuple[str, Interval], ...]


class Request(NamedTuple):
    """A column along a part of a motion, and whether its mean is needed (`integral`).

    `end` is 1 if only its largest value is needed, -1 if only its smallest, else 0.
    """

    column: str
    part: Part = ()
    integral: bool = False
    end: int = 0

    @property
    def columns(self) -> tuple[str, ...]:
        """The column, and the columns that bound the part."""
        return (self.column, *(name for name, _ in self.part))


def no_value(number: int, count: int, noun: str = "pose") -> str:
    """That some of the poses or rows that count have no value, in words."""
    return f"no value in {number} of {counted(count, noun)}"


def no_value_along(part: float) -> str:
    """That a part of a motion has no value, in words."""
    return f"no value on {100 * part:.3g} % of the motion"
