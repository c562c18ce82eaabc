"""Functions with corners along a motion: values, first and second derivatives, where they bend, and what they come to.

Nothing of the package is used: an expression is evaluated by Python on `Jet`s, and every place at which a function of
it changes its branch is noted on the way, found by halving, and split at.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Course = Callable[[np.ndarray], Mapping[str, Any]]
# Of one evaluation: arguments that change their sign where a function bends or jumps.
_SWITCHES: list[np.ndarray] = []


@dataclass(frozen=True)
class Jet:
    """A value and its first and second derivatives along a motion, complex for a place."""

    value: Any
    first: Any = 0.0
    second: Any = 0.0

    def __add__(self, other: Any) -> Jet:
        other = jet(other)
        return Jet(self.value + other.value, self.first + other.first, self.second + other.second)

    def __mul__(self, other: Any) -> Jet:
        a, b = self, jet(other)
        return Jet(
            a.value * b.value,
            a.first * b.value + a.value * b.first,
            a.second * b.value + 2 * a.first * b.first + a.value * b.second,
        )

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.first, -self.second)

    def __sub__(self, other: Any) -> Jet:
        return self + -jet(other)

    def __rsub__(self, other: Any) -> Jet:
        return jet(other) + -self

    def __truediv__(self, other: Any) -> Jet:
        other = jet(other)
        noted(np.real(other.value))
        return self * other.through(1 / other.value, -1 / other.value**2, 2 / other.value**3)

    def __rtruediv__(self, other: Any) -> Jet:
        return jet(other) / self

    def __pow__(self, power: int) -> Jet:
        result = self
        for _ in range(power - 1):
            result = result * self
        return result

    __radd__, __rmul__ = __add__, __mul__

    def through(self, value: Any, slope: Any, bend: Any) -> Jet:
        """A function of it, by the function's value and derivatives."""
        return Jet(value, slope * self.first, bend * self.first**2 + slope * self.second)

    def along(self, other: Jet) -> Jet:
        """By another parameter: this jet is by what `other` is."""
        return Jet(self.value, self.first * other.first, self.second * other.first**2 + self.first * other.second)

    @property
    def real(self) -> Jet:
        return Jet(np.real(self.value), np.real(self.first), np.real(self.second))

    @property
    def imag(self) -> Jet:
        return Jet(np.imag(self.value), np.imag(self.first), np.imag(self.second))

    @property
    def conj(self) -> Jet:
        return Jet(np.conj(self.value), np.conj(self.first), np.conj(self.second))


def jet(number: Any) -> Jet:
    return number if isinstance(number, Jet) else Jet(number)


def noted(argument: Any) -> None:
    """Note an argument at whose change of sign a function is not smooth."""
    if np.ndim(argument):
        _SWITCHES.append(np.asarray(argument, dtype=float))


def chosen(first: Any, one: Jet, other: Jet) -> Jet:
    return Jet(*(np.where(first, a, b) for a, b in zip(parts(one), parts(other), strict=True)))


def parts(one: Jet) -> tuple[Any, Any, Any]:
    return one.value, one.first, one.second


def absolute(x: Any) -> Jet:
    x = jet(x)
    noted(x.value)
    return chosen(np.asarray(x.value) < 0, -x, x)


def largest(*numbers: Any) -> Jet:
    best, *others = map(jet, numbers)
    for other in others:
        difference = np.asarray(best.value - other.value)
        noted(difference)
        best = chosen(difference >= 0, best, other)
    return best


def smallest(*numbers: Any) -> Jet:
    return -largest(*(-jet(number) for number in numbers))


def root(x: Any) -> Jet:
    x = jet(x)
    noted(x.value)
    r = np.sqrt(x.value)
    # At an end of a root slopes are infinite; where the argument stays zero they are none.
    at = np.where(r > 0, r, np.inf)
    return x.through(r, 0.5 / at, -0.25 / at**3)


def turned(angle: Jet) -> Jet:
    """exp(i angle) of an angle in radians."""
    e = np.exp(1j * angle.value)
    return angle.through(e, 1j * e, -e)


def sine(x: Any) -> Jet:
    return turned(jet(x) * np.radians(1)).imag


def cosine(x: Any) -> Jet:
    return turned(jet(x) * np.radians(1)).real


def size(z: Jet) -> Jet:
    """Magnitude of a complex number that is nowhere zero."""
    square = (z * z.conj).real
    r = np.sqrt(square.value)
    return square.through(r, 0.5 / r, -0.25 / r**3)


def direction(z: Jet) -> Jet:
    """Angle (radians) of a complex number, within half a turn of 0."""
    rate = z.first / z.value
    return Jet(np.angle(z.value), np.imag(rate), np.imag(z.second / z.value - rate**2))


def arccosine(x: Jet) -> Jet:
    s = np.sqrt(1 - x.value**2)
    return x.through(np.arccos(x.value), -1 / s, -x.value / s**3)


FUNCTIONS = {"abs": absolute, "max": largest, "min": smallest, "sqrt": root, "sin": sine, "cos": cosine}


def value_of(text: str, names: Mapping[str, Any]) -> Jet:
    """An expression of a study, its names with dots, angles in degrees."""
    known = {name.replace(".", "__"): value for name, value in names.items()}
    code = re.sub(r"(?<=[a-zA-Z_\d])\.(?=[a-zA-Z_])", "__", text)
    return jet(eval(code, {"__builtins__": {}}, FUNCTIONS | known))


@dataclass(frozen=True)
class Found:
    """What a column comes to along a motion, in closed form but for the search."""

    low: float
    low_at: float
    high: float
    high_at: float
    mean: float
    rms: float

    @property
    def range(self) -> float:
        return self.high - self.low

    @property
    def peak(self) -> float:
        return max(self.high, -self.low)


# What a column comes to by the words behind its name.
STATISTICS: dict[str, Callable[[Found], float]] = {
    "min": lambda found: found.low,
    "max": lambda found: found.high,
    "mean": lambda found: found.mean,
    "rms": lambda found: found.rms,
    "range": lambda found: found.range,
    "peak": lambda found: found.peak,
}


def scanned(course: Course, low: float, high: float, poses: int, breaks: tuple[float, ...] = ()) -> dict[str, Found]:
    """Extremes, means and rms of every column of a motion by many poses, and fewer about what is largest of them.

    `breaks` are places at which the motion itself is not smooth; all others are found.
    """
    at = np.linspace(low, high, poses)
    _SWITCHES.clear()
    plain = {name: np.broadcast_to(values, at.shape) for name, values in course(at).items()}
    changes = np.unique([low, high, *breaks, *_changes(course, at, [*_SWITCHES])])
    split = _apart(changes, low, high)
    within = split[:-1, None] + np.diff(split)[:, None] * np.linspace(0, 1, 34)
    # One-sided values at the ends of what is smooth, and looks within it, however short it is.
    beside = np.concatenate([at, changes, changes - 1e-9 * (high - low), changes + 1e-9 * (high - low), within.ravel()])
    ends, lowest = _ends(course, np.unique(np.clip(beside, low, high)))
    # The size of a force that is nearly zero somewhere has nearly a corner there.
    edges = _cells(_apart(np.unique([*split, *lowest]), low, high), low, high)
    places, weights = _nodes(edges)
    inner, share = course(places.ravel()), (weights / (high - low)).ravel()
    found = {}
    for name, values in plain.items():
        inside = np.broadcast_to(inner[name], share.shape)
        mean, square = float(share @ inside), float(share @ inside**2)
        (least, least_at), (most, most_at) = ends[name]
        # The search itself is judged: a plain mean of the many poses is as good as their step.
        coarse, spread = float(np.mean((values[1:] + values[:-1]) / 2)), most - least
        assert abs(coarse - mean) <= 20 * (len(split) + 1) / poses * spread + 1e-9, (name, coarse, mean)
        found[name] = Found(least, least_at, most, most_at, mean, float(np.sqrt(square)))
    return found


def swing(course: Course, column: str, low: float, high: float, poses: int) -> tuple[float, float]:
    """Mean of a column along a motion, and by how much the integral of the column less this mean swings."""
    mean = scanned(course, low, high, poses)[column].mean

    def above(at: np.ndarray) -> dict[str, np.ndarray]:
        values = np.broadcast_to(course(at)[column], at.shape)
        noted(values - mean)
        return {column: values - mean}

    at = np.linspace(low, high, poses)
    _SWITCHES.clear()
    above(at)
    edges = _cells(_apart(np.unique([low, high, *_changes(above, at, [*_SWITCHES])]), low, high), low, high)
    places, weights = _nodes(edges)
    sums = np.cumsum((above(places.ravel())[column].reshape(places.shape) * weights).sum(axis=1))
    return mean, float(np.ptp(np.append(sums, 0.0)))


def _apart(places: np.ndarray, low: float, high: float) -> np.ndarray:
    """Places that are no nearer to each other than rounding."""
    return places[np.concatenate([[True], np.diff(places) > 1e-12 * (high - low)])]


def _cells(split: np.ndarray, low: float, high: float) -> np.ndarray:
    """Ends of short parts of a motion between the places where it is split, shorter towards what may end as a root."""
    steps = (high - low) / 1000 * 0.25 ** np.arange(9)
    near = split[:, None] + np.concatenate([-steps, steps])
    return np.unique(np.clip(np.concatenate([split, near.ravel(), np.linspace(low, high, 1001)]), low, high))


def _nodes(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gauss' nodes and weights in each part."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = np.diff(edges)[:, None] / 2
    return (edges[1:] + edges[:-1])[:, None] / 2 + half * nodes, half * weights


def _changes(course: Course, at: np.ndarray, switches: list[np.ndarray]) -> np.ndarray:
    """Places where an argument that was noted changes its sign."""
    which, cell = [], []
    for k, argument in enumerate(switches):
        if argument.shape == at.shape:
            sign = argument >= 0
            first = np.flatnonzero(sign[1:] != sign[:-1])
            which += [k] * len(first)
            cell += first.tolist()
    if not cell:
        return np.array([])
    lane, rows = np.array(cell), np.arange(len(cell))
    a, b = at[lane], at[lane + 1]
    before = np.array([switches[k][c] >= 0 for k, c in zip(which, cell, strict=True)])
    for _ in range(60):
        middle = (a + b) / 2
        _SWITCHES.clear()
        course(middle)
        same = np.array([_SWITCHES[k] for k in which])[rows, rows] >= 0
        same = same == before
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    # Both sides of the change.
    return np.concatenate([a, b])


def _ends(course: Course, at: np.ndarray) -> tuple[dict[str, Any], np.ndarray]:
    """Smallest and largest value of every column, each with its place, by ever finer looks about the best poses.

    The places of some more that are smaller than what is about them come with these.
    """
    dense = {name: np.broadcast_to(values, at.shape) for name, values in course(at).items()}
    gaps = np.concatenate([[0.0], np.diff(at), [0.0]])
    gaps = np.maximum(gaps[1:], gaps[:-1])
    lanes, owner = [], []
    best: dict[tuple[str, int], tuple[float, float]] = {}
    for name, values in dense.items():
        for sign in (-1, 1):
            k = int(np.argmax(sign * values))
            best[name, sign] = sign * values[k], at[k]
            signed = np.concatenate([[-np.inf], sign * values, [-np.inf]])
            tops = np.flatnonzero((signed[1:-1] >= signed[2:]) & (signed[1:-1] >= signed[:-2]))
            # Lowest places are often sharp, as of the size of a force.
            tops = tops[np.argsort(-sign * values[tops], kind="stable")[: 8 if sign > 0 else 24]]
            lanes += tops.tolist()
            owner += [(name, sign)] * len(tops)
    centre, half = at[lanes], gaps[lanes]
    offsets = np.linspace(-1, 1, 33)
    for _ in range(9):
        looks = np.clip(centre[:, None] + half[:, None] * offsets, at[0], at[-1])
        values = course(looks.ravel())
        table = {name: np.broadcast_to(column, looks.size).reshape(looks.shape) for name, column in values.items()}
        for lane, (name, sign) in enumerate(owner):
            row = sign * table[name][lane]
            k = int(np.argmax(row))
            centre[lane] = looks[lane, k]
            best[name, sign] = max(best[name, sign], (row[k], looks[lane, k]))
        half = half / 8
    found = {
        name: [(float(sign * best[name, sign][0]), float(best[name, sign][1])) for sign in (-1, 1)] for name in dense
    }
    return found, np.array([place for place, (_, sign) in zip(centre, owner, strict=True) if sign < 0])
