"""Arithmetic expressions of a study, such as ``"l_min + 2*R"`` or ``"B.x - A.x"``.

The text is parsed here, by a grammar of numbers, names, operators and a fixed list of functions; nothing of it is ever
executed as Python. An expression is kept as a postfix program, evaluated with NumPy on whole batches at once.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.errors import cut
from mechdesign.numerics.arrays import Floats

HELP_PAGE = "reference/expressions"

Number = float | Floats

# Powers up to this have no narrow peaks.
MILD_POWER = 4
# Beyond its ends a table holds for this part of its length, by which angles in degrees are rounded.
TABLE_ROUNDING = 1e-12
# Longest text accepted, in characters, and its deepest nesting of parentheses.
MAX_TEXT = 1000
MAX_NESTING = 50

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    r"|(?P<name>[^\W\d]\w*(?:\.\w+)*)"
    r"|(?P<operator>\*\*|[-+*/(),]))"
)


class ExpressionError(ValueError):
    """An expression that cannot be read or has no finite value; the message says why."""


@dataclass(frozen=True)
class _Function:
    """A function of the language: its meaning, its value and its partial derivatives, on floats and arrays."""

    meaning: str
    value: Callable[..., Any]
    partials: Callable[..., tuple[Any, ...]]
    angles: Literal["", "takes", "gives"] = ""


def _of_power(x: Any, y: Any) -> tuple[Any, Any]:
    """Partial derivatives of a power; one with the exponent 0 is constant, where its base is 0 as well."""
    constant = isinstance(y, float) and y == 0.0
    return 0.0 if constant else y * np.float_power(x, np.subtract(y, 1.0)), np.float_power(x, y) * np.log(x)


_FUNCTIONS: dict[str, _Function] = {
    "sqrt": _Function("square root", np.sqrt, lambda x: (0.5 / np.sqrt(x),)),
    "exp": _Function("exponential function", np.exp, lambda x: (np.exp(x),)),
    "log": _Function("natural logarithm", np.log, lambda x: (np.true_divide(1.0, x),)),
    "abs": _Function("absolute value", np.abs, lambda x: (np.sign(x),)),
    "sin": _Function("sine of an angle", np.sin, lambda x: (np.cos(x),), "takes"),
    "cos": _Function("cosine of an angle", np.cos, lambda x: (-np.sin(x),), "takes"),
    "tan": _Function("tangent of an angle", np.tan, lambda x: (1.0 + np.tan(x) ** 2,), "takes"),
    "asin": _Function(
        "angle whose sine it is, within a quarter turn of 0",
        np.arcsin,
        lambda x: (1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
        "gives",
    ),
    "acos": _Function(
        "angle whose cosine it is, from 0 to half a turn",
        np.arccos,
        lambda x: (-1.0 / np.sqrt((1.0 - x) * (1.0 + x)),),
        "gives",
    ),
    "atan": _Function(
        "angle whose tangent it is, within a quarter turn of 0",
        np.arctan,
        lambda x: (1.0 / (1.0 + np.square(x)),),
        "gives",
    ),
    "atan2": _Function(
        "angle from the x axis to the place (x, y)",
        np.arctan2,
        lambda y, x: (x / (np.square(x) + np.square(y)), -y / (np.square(x) + np.square(y))),
        "gives",
    ),
    "hypot": _Function(
        "square root of the sum of squares", np.hypot, lambda x, y: (x / np.hypot(x, y), y / np.hypot(x, y))
    ),
    "min": _Function(
        "the smallest of two numbers or more",
        np.minimum,
        lambda x, y: (np.heaviside(np.subtract(y, x), 1.0), 1.0 - np.heaviside(np.subtract(y, x), 1.0)),
    ),
    "max": _Function(
        "the largest of two numbers or more",
        np.maximum,
        lambda x, y: (np.heaviside(np.subtract(x, y), 1.0), 1.0 - np.heaviside(np.subtract(x, y), 1.0)),
    ),
    "+": _Function("sum", np.add, lambda x, y: (1.0, 1.0)),
    "-": _Function("difference", np.subtract, lambda x, y: (1.0, -1.0)),
    "*": _Function("product", np.multiply, lambda x, y: (y, x)),
    "/": _Function("quotient", np.true_divide, lambda x, y: (np.true_divide(1.0, y), -np.true_divide(x, np.square(y)))),
    "**": _Function(
        "power; groups to the right and binds more tightly than a sign",
        np.float_power,
        _of_power,
    ),
    "negate": _Function("negative", np.negative, lambda x: (-1.0,)),
}
_BINDING = {"+": 10, "-": 10, "*": 20, "/": 20, "**": 40}
# Functions whose value has a period, in turns.
_TURNS = {"atan2": 1.0, "atan": 0.5}
# Functions that are another one of their arguments, or its negative, on each side of a corner.
_HELD = frozenset(("min", "max", "abs"))
_OF_TWO = frozenset(("atan2", "hypot", "min", "max", *_BINDING))
_UNARY_BINDING = 30

FUNCTIONS = frozenset(name for name in _FUNCTIONS if name.isalnum() and name != "negate")
"""Names of the functions that an expression may call."""
CONSTANTS = {"pi": (math.pi, "circumference of a circle over its diameter")}
"""Values and meanings of the constants that an expression may name."""
RESERVED = FUNCTIONS | CONSTANTS.keys()
"""Names that no parameter can have."""


# Functions of NumPy in the partial derivatives above, with partial derivatives of their own.
_PARTIALS: dict[Callable[..., Any], Callable[..., tuple[Any, ...]]] = {
    **{function.value: function.partials for function in _FUNCTIONS.values()},
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
        if method != "__call__" or function not in _PARTIALS:
            return NotImplemented
        values = [argument.value if isinstance(argument, Dual) else argument for argument in arguments]
        slopes = [
            _chained(partial, argument.slope)
            for partial, argument in zip(_PARTIALS[function](*values), arguments, strict=True)
            if isinstance(argument, Dual)
        ]
        return Dual(function(*values), sum(slopes[1:], start=slopes[0]))


def _chained(partial: Any, slope: Any) -> Any:
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


@dataclass(frozen=True)
class Tabulated:
    """A function of one number by a table: a cubic spline through its rows, periodic if it ends as it begins.

    `rows` are the numbers, in rising order, and the function's value at each. Beyond the table it is not a number,
    unless it has the given `period`.
    """

    rows: tuple[tuple[float, float], ...]
    period: float = 0.0
    angles: Literal[""] = ""

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        places, values = np.transpose(self.rows)
        return CubicSpline(places, values, bc_type="periodic" if self.period else "not-a-knot", extrapolate=False)

    def _at(self, x: Any, order: int) -> Any:
        if isinstance(x, Dual):
            return Dual(self._at(x.value, order), self._at(x.value, order + 1) * x.slope)
        first, last = self.rows[0][0], self.rows[-1][0]
        if self.period:
            return self._spline(first + np.mod(np.subtract(x, first), self.period), order)
        # At an end of the table rounding of what is looked up must not lose its value.
        inside = np.clip(x, first, last)
        return self._spline(np.where(np.abs(inside - x) <= TABLE_ROUNDING * (last - first), inside, x), order)

    def value(self, x: Any) -> Any:
        """Value of the spline."""
        return self._at(x, 0)

    def partials(self, x: Any) -> tuple[Any]:
        """Its derivative."""
        return (self._at(x, 1),)


@dataclass(frozen=True)
class Repeated:
    """A number within a period from `first` on, whole periods aside: what follows from it repeats."""

    first: float
    period: float
    angles: Literal[""] = ""

    def value(self, x: Any) -> Any:
        """The number within the first period, both ends of which are kept."""
        if isinstance(x, Dual):
            return Dual(self.value(x.value), x.slope)
        away = np.subtract(x, self.first)
        return np.where((away >= 0) & (away <= self.period), x, self.first + np.mod(away, self.period))

    def partials(self, x: Any) -> tuple[Any]:
        """Its derivative."""
        return (1.0,)


# What an expression calls: a function by its name, a table, or what makes it repeat.
Called = str | Tabulated | Repeated
Step = tuple[Literal["constant", "name", "call"], float | str | Tabulated | Repeated]


@dataclass(frozen=True)
class Expression:
    """A parsed expression."""

    text: str
    program: tuple[Step, ...]  # postfix: push a constant or a variable's value, or apply a function to the topmost
    angle_unit: float = 1.0  # radians in one of the units that trigonometry takes and gives

    @classmethod
    def parse(cls, text: str, angle_unit: float = 1.0) -> Expression:
        """Parse a text.

        Raises
        ------
        ExpressionError
            If the text is no expression; the message says what is wrong.
        """
        return cls(text, _Parser(text).parse(), angle_unit)

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of the variables, dotted ones (``B.x``) included."""
        return frozenset(str(item) for kind, item in self.program if kind == "name")

    def evaluate(self, env: Mapping[str, ArrayLike]) -> Number:
        """Value with the variables of `env`, which broadcast against each other.

        Plain floats give a float and raise ExpressionError where there is no finite value; arrays give an array with
        nan or inf there.
        """
        result: Number = self._run(float, lambda name: self._variable(env, name), self._apply)
        # A variable that is nan has its own message already.
        if type(result) is float and not math.isfinite(result) and not any(np.isnan(env[n]).any() for n in self.names):
            raise ExpressionError(f"{self.text!r} has no finite value: a division by zero, or too large a power")
        return result

    def derivatives(self, env: Mapping[str, Any]) -> dict[str, Any]:
        """Exact partial derivative with respect to every variable, at the values of `env` (forward mode).

        Of variables that are a `Dual`, derivatives are one too, or a number where they do not change.
        """
        _, partials = self._run(
            lambda value: (value, {}), lambda name: (self._variable(env, name), {name: 1.0}), self._differentiate
        )
        return {
            name: value if isinstance(value, Dual) else np.asarray(value, dtype=float)[()]
            for name, value in partials.items()
        }

    @classmethod
    def of_table(cls, text: str, table: Tabulated, name: str, angle_unit: float) -> Expression:
        """The value of a table at a variable; `text` is for messages."""
        return cls(text, (("name", name), ("call", table)), angle_unit)

    @property
    def table(self) -> Tabulated | None:
        """The table that it calls; None where it calls none."""
        return next((step for _, step in self.program if isinstance(step, Tabulated)), None)

    def repeated(self, name: str, first: float, period: float) -> Expression:
        """The expression with its values in a period of a variable, from `first` on, again in every other period."""
        again: Step = ("call", Repeated(first, period))
        program = [part for step in self.program for part in ((step, again) if step == ("name", name) else (step,))]
        return replace(self, program=tuple(program))

    def is_linear(self) -> bool:
        """Whether the expression is linear in its variables, judged by its form."""

        def degree(function: Called, inner: list[int]) -> int:
            if function in ("+", "-", "negate"):
                return max(inner)
            if function == "*":
                return sum(inner)
            # A quotient by a constant is linear; all else of a variable counts as not.
            return inner[0] if function == "/" and not inner[1] else 2 * max(inner)

        highest: int = self._run(lambda value: 0, lambda name: 1, degree)
        return highest <= 1

    def is_angle(self, quantities: Mapping[str, str]) -> bool:
        """Whether the value is an angle, by the quantities of the variables: a sum of whole multiples of angles.

        Variables without a quantity are numbers. A number added to an angle is an angle in the same unit. Other
        multiples of an angle may be arcs, and do not count.
        """

        def kind(function: Called, inner: list[str]) -> str:
            """``angle``, ``whole`` for a whole number, ``number``, or ``other``, which cannot be added to an angle."""
            if _function(function).angles == "gives":
                return "angle"
            if "angle" not in inner:
                return (
                    "other" if "other" in inner else "whole" if {*inner} == {"whole"} and function != "/" else "number"
                )
            if function in ("+", "-", "negate", "abs", "min", "max"):
                return "other" if "other" in inner else "angle"
            return (
                "angle"
                if (function == "*" and "whole" in inner) or (function == "/" and inner[1] == "whole")
                else "other"
            )

        def variable(name: str) -> str:
            quantity = quantities.get(name, "number")
            return quantity if quantity in ("angle", "number") else "other"

        def constant(value: float) -> str:
            return "whole" if value.is_integer() else "number"

        return bool(self._run(constant, variable, kind) == "angle")

    def substituted(self, values: Mapping[str, Expression | float]) -> Expression:
        """The expression with expressions or numbers in place of its variables; it takes the angle unit of these."""
        units = [value.angle_unit for value in values.values() if isinstance(value, Expression)]

        def variable(name: str) -> tuple[Step, ...]:
            value = values[name]
            return value.program if isinstance(value, Expression) else (("constant", value),)

        program = self._run(_constant_step, variable, _call_steps)
        return Expression(self.text, program, next(iter(units), self.angle_unit))

    def turning(self, name: str) -> tuple[Expression, dict[str, tuple[Expression, float]]]:
        """The expression with variables in place of its arctangents, and these with their periods in turns.

        `atan2` jumps at half a turn and `atan` at a quarter; as a variable the angle can be followed without jumps.
        The names of the variables are `name:0`, `name:1` and so on.
        """
        arctangents: dict[str, tuple[Expression, float]] = {}

        def call(function: Called, inner: list[tuple[Step, ...]]) -> tuple[Step, ...]:
            program = _call_steps(function, inner)
            if function not in _TURNS:
                return program
            variable = f"{name}:{len(arctangents)}"
            arctangents[variable] = replace(self, program=program), _TURNS[function]
            return (("name", variable),)

        program = self._run(_constant_step, lambda variable: (("name", variable),), call)
        return replace(self, program=program), arctangents

    def outermost(self) -> tuple[Called, list[Expression]]:
        """The function that is called last, and its arguments; an empty name where none is called."""
        last: tuple[Called, list[tuple[Step, ...]]] = "", []

        def call(function: Called, inner: list[tuple[Step, ...]]) -> tuple[Step, ...]:
            nonlocal last
            last = function, inner
            return _call_steps(function, inner)

        self._run(_constant_step, lambda name: (("name", name),), call)
        return last[0], [replace(self, program=program) for program in last[1]]

    def corners(self) -> list[Corner]:
        """Where the expression is not smooth, the inner corners before the outer ones, which are smooth between them.

        Beside the corners it bends at stand the places where it jumps, is infinite, or has a value on one side alone.
        """
        corners: list[tuple[tuple[Step, ...], Corner]] = []

        def call(function: Called, inner: list[tuple[Step, ...]]) -> tuple[Step, ...]:
            for program, levels, period, turning in _corners(function, inner, self.angle_unit):
                if any(kind == "name" for kind, _ in program):
                    corners.append((program, Corner(replace(self, program=program), levels, period, turning)))
            return _call_steps(function, inner)

        self._run(_constant_step, lambda name: (("name", name),), call)
        return list({(program, corner.levels, corner.turning): corner for program, corner in corners}.values())

    def held(self, sides: Mapping[tuple[Step, ...], float]) -> Expression:
        """What the expression is on one side of each corner of `min`, `max` and `abs`, and beyond it.

        `sides` are the signs of the corners' arguments, by the programs of these.
        """

        def call(function: Called, inner: list[tuple[Any, Any]]) -> tuple[Any, Any]:
            plain, kept = ([part[k] for part in inner] for k in (0, 1))
            corner = next(_corners(function, plain, self.angle_unit), None) if function in _HELD else None
            side = sides.get(corner[0], 0.0) if corner is not None else 0.0
            if not side:
                return _call_steps(function, plain), _call_steps(function, kept)
            if function == "abs":
                return _call_steps(function, plain), kept[0] if side > 0 else _call_steps("negate", kept)
            return _call_steps(function, plain), kept[(side > 0) != (function == "max")]

        _, program = self._run(lambda value: (_constant_step(value),) * 2, lambda name: ((("name", name),),) * 2, call)
        return replace(self, program=program)

    def _run(
        self, constant: Callable[[float], Any], variable: Callable[[str], Any], call: Callable[[Any, list[Any]], Any]
    ) -> Any:
        """Result of the program, with the meanings of constants, variables and calls that are passed."""
        stack: list[Any] = []
        with np.errstate(all="ignore"):
            for kind, item in self.program:
                if isinstance(item, Tabulated | Repeated):
                    stack[-1:] = [call(item, stack[-1:])]
                elif kind == "call":
                    count = arity(str(item))
                    stack[-count:] = [call(item, stack[-count:])]
                else:
                    stack.append(constant(float(item)) if kind == "constant" else variable(str(item)))
        return stack[0]

    def _variable(self, env: Mapping[str, Any], name: str) -> Any:
        try:
            value = env[name]
        except KeyError:
            raise ExpressionError(f"unknown name {name!r}") from None
        if isinstance(value, Dual):
            return value
        return float(value) if type(value) in (float, int) else np.asarray(value, dtype=float)

    def _apply(self, name: Called, arguments: list[Any]) -> Number:
        function = _function(name)
        inner, outer = self._angle_factors(function)
        result: Number = function.value(*(argument * inner for argument in arguments)) * outer
        if not all(type(argument) is float for argument in arguments):
            return result
        if not np.isfinite(result) and not np.isnan(arguments).any():
            if name == "/" and arguments[1] == 0:
                raise ExpressionError(f"division by zero in {self.text!r}")
            if np.isposinf(result):
                raise ExpressionError(f"{self.text!r} is too large a number; choose a larger unit")
            if isinstance(name, Tabulated):
                raise ExpressionError(f"{arguments[0]:g} is not within {self.text}")
            shown = ", ".join(f"{argument:g}" for argument in arguments)
            raise ExpressionError(f"{name}({shown}) in {self.text!r} is not a number")
        return float(result)

    def _differentiate(self, name: Called, arguments: list[tuple[Any, dict[str, Any]]]) -> tuple[Any, dict[str, Any]]:
        function = _function(name)
        inner, outer = self._angle_factors(function)
        values = [np.multiply(value, inner) for value, _ in arguments]
        total: dict[str, Any] = {}
        for (_, seeds), partial in zip(arguments, function.partials(*values), strict=True):
            for variable, seed in seeds.items():
                total[variable] = total.get(variable, 0.0) + _chained(partial, seed) * inner * outer
        return function.value(*values) * outer, total

    def _angle_factors(self, function: _Function | Tabulated | Repeated) -> tuple[float, float]:
        inner = self.angle_unit if function.angles == "takes" else 1.0
        outer = 1.0 / self.angle_unit if function.angles == "gives" else 1.0
        return inner, outer


@dataclass(frozen=True)
class Corner:
    """Places at which an expression is not smooth: where its `argument` takes one of some levels.

    With a `period` (0 for none) these are repeated. With `turning` it may have a narrow peak where the argument turns
    back, as the exponential function has.
    """

    argument: Expression
    levels: tuple[float, ...] = (0.0,)
    period: float = 0.0
    turning: bool = False


def _corners(
    function: Called, inner: list[tuple[Step, ...]], angle_unit: float
) -> Iterator[tuple[tuple[Step, ...], tuple[float, ...], float, bool]]:
    """Programs, levels and periods of the corners of a call, and whether it has peaks; see `Corner`."""
    if isinstance(function, Tabulated):
        yield inner[0], tuple(place for place, _ in function.rows), function.period, False
    elif isinstance(function, Repeated):
        yield inner[0], (function.first,), function.period, False
    elif function in ("min", "max"):
        yield _call_steps("-", inner), (0.0,), 0.0, False
    elif function in ("abs", "sqrt", "log"):
        yield inner[0], (0.0,), 0.0, False
    elif function == "exp":
        yield inner[0], (), 0.0, True
    elif function in ("asin", "acos"):
        yield inner[0], (-1.0, 1.0), 0.0, False
    elif function == "tan":
        yield inner[0], (math.pi / 2 / angle_unit,), math.pi / angle_unit, False
    elif function == "atan2":
        # It jumps from half a turn to minus half a turn where y is zero, at the x below zero.
        yield inner[0], (0.0,), 0.0, False
    elif function == "hypot":
        # It bends where both are zero.
        yield from ((part, (0.0,), 0.0, False) for part in inner)
    elif function == "/":
        yield inner[1], (0.0,), 0.0, True
    elif function == "**":
        exponent = inner[1][0][1] if len(inner[1]) == 1 else None
        if not (isinstance(exponent, float) and exponent >= 0 and exponent.is_integer()):
            yield inner[0], (0.0,), 0.0, True
        elif exponent > MILD_POWER:
            yield inner[0], (), 0.0, True


def _function(called: Called) -> _Function | Tabulated | Repeated:
    return _FUNCTIONS[called] if isinstance(called, str) else called


def _constant_step(value: float) -> tuple[Step, ...]:
    return (("constant", value),)


def _call_steps(function: Called, arguments: list[tuple[Step, ...]]) -> tuple[Step, ...]:
    """The program of a call from those of its arguments."""
    return (*chain.from_iterable(arguments), ("call", function))


def meanings() -> dict[str, tuple[str, str]]:
    """Functions, operators and constants by name: how each is written, and its meaning."""
    entries = {name: (name, meaning) for name, (_, meaning) in CONSTANTS.items()}
    turn = {"takes": "; the angle is in the study's unit", "gives": ", in the study's unit", "": ""}
    for name, function in _FUNCTIONS.items():
        call = "(y, x)" if name == "atan2" else "(x, y)" if arity(name) == 2 else "(x)"
        written = f"{name}{call}" if name in FUNCTIONS else f"x {name} y"
        if name != "negate":
            entries[name] = (written, function.meaning + turn[function.angles])
    return entries


def arity(name: str) -> int:
    """Number of arguments that a function or operator takes."""
    return 2 if name in _OF_TWO else 1


class _Parser:
    """Precedence climbing over the tokens of one text; `**` binds more tightly than a sign, as in Python."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.program: list[Step] = []
        self.depth = 0
        self.tokens = self._tokenize(text)
        self.position = 0

    def parse(self) -> tuple[Step, ...]:
        if len(self.tokens) == 1:
            raise ExpressionError("an empty text where a number is expected")
        self._operand_chain(0)
        if self._peek()[0] != "end":
            raise self._unexpected()
        return tuple(self.program)

    @staticmethod
    def _tokenize(text: str) -> list[tuple[str, str]]:
        if len(text) > MAX_TEXT:
            raise ExpressionError(f"an expression longer than {MAX_TEXT} characters")
        tokens: list[tuple[str, str]] = []
        position, end = 0, len(text.rstrip())
        while position < end:
            match = _TOKEN.match(text, position)
            if match is None:
                rest = text[position:].lstrip()
                hint = "; powers are written **" if rest.startswith("^") else ""
                raise ExpressionError(f"{rest[0]!r} has no meaning in the expression {cut(text)!r}{hint}")
            tokens.append((str(match.lastgroup), match.group(str(match.lastgroup))))
            position = match.end()
        return [*tokens, ("end", "")]

    def _peek(self) -> tuple[str, str]:
        return self.tokens[self.position]

    def _take(self, operator: str) -> bool:
        if self._peek() == ("operator", operator):
            self.position += 1
            return True
        return False

    def _unexpected(self) -> ExpressionError:
        kind, token = self._peek()
        if kind == "end":
            return ExpressionError(f"the expression {cut(self.text)!r} ends too early")
        return ExpressionError(f"unexpected {token!r} in the expression {cut(self.text)!r}")

    def _operand_chain(self, binding: int) -> None:
        self.depth += 1
        if self.depth > MAX_NESTING:
            raise ExpressionError(
                f"an expression nested deeper than {MAX_NESTING} levels; name its parts as parameters"
            )
        self._operand()
        while True:
            kind, token = self._peek()
            power = _BINDING.get(token, -1) if kind == "operator" else -1
            if power <= binding:
                break
            self.position += 1
            # ** groups to the right: 2**3**2 is 2**9.
            self._operand_chain(power - 1 if token == "**" else power)
            self.program.append(("call", token))
        self.depth -= 1

    def _operand(self) -> None:
        kind, token = self._peek()
        if kind == "end" or token in (")", ",", "*", "/", "**"):
            raise self._unexpected()
        self.position += 1
        if token == "-":
            self._operand_chain(_UNARY_BINDING)
            self.program.append(("call", "negate"))
        elif token == "+":
            self._operand_chain(_UNARY_BINDING)
        elif token == "(":
            self._operand_chain(0)
            self._close()
        elif kind == "number":
            self.program.append(("constant", float(token)))
        elif self._take("("):
            self._call(token)
        elif token in CONSTANTS:
            self.program.append(("constant", CONSTANTS[token][0]))
        elif token in FUNCTIONS:
            raise ExpressionError(f"the function {token!r} needs its argument in parentheses")
        else:
            self.program.append(("name", token))

    def _call(self, name: str) -> None:
        if name not in FUNCTIONS:
            names = ", ".join(sorted(FUNCTIONS))
            raise ExpressionError(f"unknown function {name!r}; the functions are {names}")
        self._operand_chain(0)
        count = 1
        while self._take(","):
            self._operand_chain(0)
            count += 1
            if name in ("min", "max"):
                self.program.append(("call", name))
        self._close()
        if name in ("min", "max"):
            if count == 1:
                raise ExpressionError(f"{name} compares two numbers or more")
            return
        arguments = arity(name)
        if count != arguments:
            raise ExpressionError(f"{name} takes {arguments} number{'s' * (arguments > 1)}, not {count}")
        self.program.append(("call", name))

    def _close(self) -> None:
        if not self._take(")"):
            if self._peek()[0] == "end":
                raise ExpressionError(f"a parenthesis is not closed in the expression {cut(self.text)!r}")
            raise self._unexpected()
