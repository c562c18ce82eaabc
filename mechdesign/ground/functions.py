"""Functions of the expression language: meanings, values and partial derivatives, of numbers, arrays and duals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from mechdesign.ground.motion_laws import LAWS, PhaseTable

# Beyond its ends a table holds for this part of its length, by which angles in degrees are rounded.
TABLE_ROUNDING = 1e-12
# A law begins and ends, and what repeats begins again, before its place by this part of its way: by rounding.
SAME_PLACE = 1e-10


@dataclass(frozen=True)
class Function:
    """A function of the language: its meaning, its value and its partial derivatives, on floats and arrays."""

    meaning: str
    value: Callable[..., Any]
    partials: Callable[..., tuple[Any, ...]]
    angles: Literal["", "takes", "gives"] = ""


def _of_power(x: Any, y: Any) -> tuple[Any, Any]:
    """Partial derivatives of a power; one with the exponent 0 is constant, where its base is 0 as well."""
    constant = isinstance(y, float) and y == 0.0
    return 0.0 if constant else y * np.float_power(x, np.subtract(y, 1.0)), np.float_power(x, y) * np.log(x)


DECLARED: dict[str, Function] = {
    "sqrt": Function("square root", np.sqrt, lambda x: (0.5 / np.sqrt(x),)),
    "exp": Function("exponential function", np.exp, lambda x: (np.exp(x),)),
    "log": Function("natural logarithm", np.log, lambda x: (np.true_divide(1.0, x),)),
    "abs": Function("absolute value", np.abs, lambda x: (np.sign(x),)),
    "sin": Function("sine of an angle", np.sin, lambda x: (np.cos(x),), "takes"),
    "cos": Function("cosine of an angle", np.cos, lambda x: (-np.sin(x),), "takes"),
    "tan": Function("tangent of an angle", np.tan, lambda x: (1.0 + np.tan(x) ** 2,), "takes"),
    "asin": Function(
        "angle whose sine it is, within a quarter turn of 0",
        np.arcsin,
        lambda x: (1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
        "gives",
    ),
    "acos": Function(
        "angle whose cosine it is, from 0 to half a turn",
        np.arccos,
        lambda x: (-1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
        "gives",
    ),
    "atan": Function(
        "angle whose tangent it is, within a quarter turn of 0",
        np.arctan,
        lambda x: (1.0 / (1.0 + np.square(x)),),
        "gives",
    ),
    "atan2": Function(
        "angle from the x axis to the place (x, y)",
        np.arctan2,
        lambda y, x: (x / (np.square(x) + np.square(y)), -y / (np.square(x) + np.square(y))),
        "gives",
    ),
    "hypot": Function(
        "square root of the sum of squares", np.hypot, lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y))
    ),
    "min": Function(
        "the smallest of two numbers or more",
        np.minimum,
        lambda x, y: (np.heaviside(np.subtract(y, x), 1.0), 1.0 - np.heaviside(np.subtract(y, x), 1.0)),
    ),
    "max": Function(
        "the largest of two numbers or more",
        np.maximum,
        lambda x, y: (np.heaviside(np.subtract(x, y), 1.0), 1.0 - np.heaviside(np.subtract(x, y), 1.0)),
    ),
    "+": Function("sum", np.add, lambda x, y: (1.0, 1.0)),
    "-": Function("difference", np.subtract, lambda x, y: (1.0, -1.0)),
    "*": Function("product", np.multiply, lambda x, y: (y, x)),
    "/": Function("quotient", np.true_divide, lambda x, y: (np.true_divide(1.0, y), -np.true_divide(x, np.square(y)))),
    "**": Function(
        "power; groups to the right and binds more tightly than a sign",
        np.float_power,
        _of_power,
    ),
    "negate": Function("negative", np.negative, lambda x: (-1.0,)),
}
BINDING = {"+": 10, "-": 10, "*": 20, "/": 20, "**": 40}
_OF_TWO = frozenset(("atan2", "hypot", "min", "max", *BINDING))
FUNCTIONS = frozenset(name for name in DECLARED if name.isalnum() and name != "negate")
"""Names of the functions that an expression may call."""
CONSTANTS = {"pi": (math.pi, "circumference of a circle over its diameter")}
"""Values and meanings of the constants that an expression may name."""
RESERVED = FUNCTIONS | CONSTANTS.keys()
"""Names that no parameter can have."""
# Functions of NumPy in the partial derivatives above, with partial derivatives of their own.
PARTIALS: dict[Callable[..., Any], Callable[..., tuple[Any, ...]]] = {
    **{function.value: function.partials for function in DECLARED.values()},
    np.square: lambda x: (2.0 * x,),
    np.power: _of_power,
    np.sign: lambda x: (0.0,),
    np.heaviside: lambda x, y: (0.0, 0.0),
}


@dataclass(frozen=True, eq=False)
class Dual(np.lib.mixins.NDArrayOperatorsMixin):
    """A value and its slope along a line, each a number, an array or a dual again: functions of NumPy carry both."""

    value: Any
    slope: Any

    @staticmethod
    def parts(number: Any) -> tuple[Any, Any]:
        """Value and slope of a dual, or of a number that does not change along the line."""
        return (number.value, number.slope) if isinstance(number, Dual) else (number, 0.0)

    def __array_ufunc__(self, function: Any, method: str, *arguments: Any, **options: Any) -> Any:
        """The value of a function and its slope, by the chain rule."""
        if method != "__call__" or function not in PARTIALS:
            return NotImplemented
        values = [argument.value if isinstance(argument, Dual) else argument for argument in arguments]
        slopes = [
            chained(partial, argument.slope)
            for partial, argument in zip(PARTIALS[function](*values), arguments, strict=True)
            if isinstance(argument, Dual)
        ]
        return Dual(function(*values), sum(slopes[1:], start=slopes[0]))


def chained(partial: Any, slope: Any) -> Any:
    """A partial derivative times the slope of its argument: 0 where that rests, though the partial is infinite."""
    product = partial * slope
    return product if _finite(product) else _where(_rests(slope), product)


def _finite(number: Any) -> bool:
    return all(_finite(part) for part in Dual.parts(number)) if isinstance(number, Dual) else np.isfinite(number).all()


def _rests(slope: Any) -> Any:
    return _rests(slope.value) & _rests(slope.slope) if isinstance(slope, Dual) else np.equal(slope, 0.0)


def _where(zero: Any, number: Any) -> Any:
    """A number or dual that is 0 at some places."""
    if isinstance(number, Dual):
        return Dual(_where(zero, number.value), _where(zero, number.slope))
    return np.where(zero, 0.0, number)


class OfOneNumber:
    """A function of one number that has derivatives of every order; its argument is no angle of trigonometry."""

    angles: ClassVar[Literal[""]] = ""

    def value(self, x: Any) -> Any:
        """Its value."""
        return self._along(x, 0)

    def partials(self, x: Any) -> tuple[Any]:
        """Its derivative."""
        return (self._along(x, 1),)

    def _along(self, x: Any, order: int) -> Any:
        if isinstance(x, Dual):
            return Dual(self._along(x.value, order), self._along(x.value, order + 1) * x.slope)
        return self._at(x, order)

    def _at(self, x: Any, order: int) -> Any:
        raise NotImplementedError


@dataclass(frozen=True)
class Tabulated(OfOneNumber):
    """A function by a table: a cubic spline through its rows, periodic if it ends as it begins.

    `rows` are the numbers, in rising order, and the function's value at each. Beyond the table it is not a number,
    unless it has the given `period`.
    """

    rows: tuple[tuple[float, float], ...]
    period: float = 0.0

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        places, values = np.transpose(self.rows)
        return CubicSpline(places, values, bc_type="periodic" if self.period else "not-a-knot", extrapolate=False)

    def _at(self, x: Any, order: int) -> Any:
        first, last = self.rows[0][0], self.rows[-1][0]
        if self.period:
            return self._spline(first + np.mod(np.subtract(x, first), self.period), order)
        # At an end of the table rounding of what is looked up must not lose its value.
        inside = np.clip(x, first, last)
        return self._spline(np.where(np.abs(inside - x) <= TABLE_ROUNDING * (last - first), inside, x), order)


@dataclass(frozen=True)
class Share(OfOneNumber):
    """What has passed of a way of some `length` from its `begin` on, as a part of it; with a `period` again in each.

    By less than rounding it does not miss 0 or 1. At the end of a period counts the begin of the next.
    """

    begin: float = 0.0
    length: float = 1.0
    period: float = 0.0

    def _at(self, x: Any, order: int) -> Any:
        if order:
            return 1.0 / self.length if order == 1 else 0.0
        passed = x - self.period * np.floor(x / self.period + SAME_PLACE) if self.period else x
        share = (passed - self.begin) / self.length
        end = np.where(share > 0.5, 1.0, 0.0)
        return np.where(np.abs(share - end) <= SAME_PLACE, end, share)


@dataclass(frozen=True)
class Rise(OfOneNumber):
    """The rise of a motion law over its way from 0 to 1, of a move to a smaller value where it `falls`."""

    law: str
    falls: bool = False

    @cached_property
    def _phases(self) -> PhaseTable:
        return PhaseTable.of(LAWS[self.law].ways[self.falls])

    @cached_property
    def places(self) -> tuple[float, ...]:
        """Where its phases behind the first begin."""
        return tuple(phase.begin for phase in LAWS[self.law].phases[1:])

    def _at(self, x: Any, order: int) -> Any:
        row = np.searchsorted(self.places, np.add(x, SAME_PLACE), side="right") if self.places else 0
        return self._phases.take(row).rise(np.asarray(x), order)


@dataclass(frozen=True)
class Repeated(OfOneNumber):
    """A number within a period from `first` on, whole periods aside: what follows from it repeats."""

    first: float
    period: float

    def _at(self, x: Any, order: int) -> Any:
        """Both ends of the first period are kept."""
        if order:
            return float(order == 1)
        away = np.subtract(x, self.first)
        return np.where((away >= 0) & (away <= self.period), x, self.first + np.mod(away, self.period))


def meanings() -> dict[str, tuple[str, str]]:
    """Functions, operators and constants by name: how each is written, and its meaning."""
    entries = {name: (name, meaning) for name, (_, meaning) in CONSTANTS.items()}
    turn = {"takes": "; the angle is in the study's unit", "gives": ", in the study's unit", "": ""}
    for name, function in DECLARED.items():
        call = "(y, x)" if name == "atan2" else "(x, y)" if arity(name) == 2 else "(x)"
        written = f"{name}{call}" if name in FUNCTIONS else f"x {name} y"
        if name != "negate":
            entries[name] = (written, function.meaning + turn[function.angles])
    return entries


def arity(name: str) -> int:
    """Number of arguments that a function or operator takes."""
    return 2 if name in _OF_TWO else 1
