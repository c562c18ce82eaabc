"""Arithmetic expressions of a study, such as ``"l_min + 2*R"`` or ``"B.x - A.x"``.

The text is parsed here, by a grammar of numbers, names, operators and a fixed list of functions; nothing of it is ever
executed as Python. An expression is kept as a postfix program, evaluated with NumPy on whole batches at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechdesign.ground.functions import (
    DECLARED,
    Dual,
    Function,
    OfOneNumber,
    Repeated,
    Rise,
    Share,
    Tabulated,
    arity,
    chained,
)
from mechdesign.ground.notation import Called, ExpressionError, Parser, Step, call_steps, constant_step
from mechdesign.ground.numerics.arrays import Floats

Number = float | Floats

# Powers up to this have no narrow peaks.
MILD_POWER = 4


# Functions whose value has a period, in turns.
_TURNS = {"atan2": 1.0, "atan": 0.5}
# Functions that are another one of their arguments, or its negative, on each side of a corner.
_HELD = frozenset(("min", "max", "abs"))


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
        return cls(text, Parser(text).parse(), angle_unit)

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

        program = self._run(constant_step, variable, call_steps)
        return Expression(self.text, program, next(iter(units), self.angle_unit))

    def turning(self, name: str) -> tuple[Expression, dict[str, tuple[Expression, float]]]:
        """The expression with variables in place of its arctangents, and these with their periods in turns.

        `atan2` jumps at half a turn and `atan` at a quarter; as a variable the angle can be followed without jumps.
        The names of the variables are `name:0`, `name:1` and so on.
        """
        arctangents: dict[str, tuple[Expression, float]] = {}

        def call(function: Called, inner: list[tuple[Step, ...]]) -> tuple[Step, ...]:
            program = call_steps(function, inner)
            if function not in _TURNS:
                return program
            variable = f"{name}:{len(arctangents)}"
            arctangents[variable] = replace(self, program=program), _TURNS[function]
            return (("name", variable),)

        program = self._run(constant_step, lambda variable: (("name", variable),), call)
        return replace(self, program=program), arctangents

    def outermost(self) -> tuple[Called, list[Expression]]:
        """The function that is called last, and its arguments; an empty name where none is called."""
        last: tuple[Called, list[tuple[Step, ...]]] = "", []

        def call(function: Called, inner: list[tuple[Step, ...]]) -> tuple[Step, ...]:
            nonlocal last
            last = function, inner
            return call_steps(function, inner)

        self._run(constant_step, lambda name: (("name", name),), call)
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
            return call_steps(function, inner)

        self._run(constant_step, lambda name: (("name", name),), call)
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
                return call_steps(function, plain), call_steps(function, kept)
            if function == "abs":
                return call_steps(function, plain), kept[0] if side > 0 else call_steps("negate", kept)
            return call_steps(function, plain), kept[(side > 0) != (function == "max")]

        _, program = self._run(lambda value: (constant_step(value),) * 2, lambda name: ((("name", name),),) * 2, call)
        return replace(self, program=program)

    def _run(
        self, constant: Callable[[float], Any], variable: Callable[[str], Any], call: Callable[[Any, list[Any]], Any]
    ) -> Any:
        """Result of the program, with the meanings of constants, variables and calls that are passed."""
        stack: list[Any] = []
        for kind, item in self.program:
            if isinstance(item, OfOneNumber):
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
                total[variable] = total.get(variable, 0.0) + chained(partial, seed) * inner * outer
        return function.value(*values) * outer, total

    def _angle_factors(self, function: Function | OfOneNumber) -> tuple[float, float]:
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
    elif isinstance(function, Rise):
        yield inner[0], function.places, 0.0, False
    elif isinstance(function, Share):
        yield inner[0], (0.0,) if function.period else (), function.period, False
    elif isinstance(function, Repeated):
        yield inner[0], (function.first,), function.period, False
    elif function in ("min", "max"):
        yield call_steps("-", inner), (0.0,), 0.0, False
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


def _function(called: Called) -> Function | OfOneNumber:
    return DECLARED[called] if isinstance(called, str) else called
