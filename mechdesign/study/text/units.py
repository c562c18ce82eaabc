"""The study's units, and quantities such as ``"40 mm"`` converted to them.

A *kind* of quantity is a product of powers of length, angle, time and force.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Self

from numpy.typing import ArrayLike

from mechdesign.ground.errors import nearest
from mechdesign.ground.expressions import Expression, Number
from mechdesign.ground.numerals import numeral
from mechdesign.ground.unit_table import Powers, listed, unit_value

KINDS: dict[str, Powers] = {
    "none": (0, 0, 0, 0),
    "length": (1, 0, 0, 0),
    "angle": (0, 1, 0, 0),
    "time": (0, 0, 1, 0),
    "force": (0, 0, 0, 1),
    "velocity": (1, 0, -1, 0),
    "acceleration": (1, 0, -2, 0),
    "angular_velocity": (0, 1, -1, 0),
    "angular_acceleration": (0, 1, -2, 0),
    "moment": (1, 0, 0, 1),
    "area": (2, 0, 0, 0),
    "inertia": (4, 0, 0, 0),
    "mass": (-1, 0, 2, 1),
    "moment_of_inertia": (1, 0, 2, 1),
    "density": (-4, 0, 2, 1),
    "power": (1, 0, -1, 1),
    "stress": (-2, 0, 0, 1),
    "stiffness": (-1, 0, 0, 1),
    "rotational_stiffness": (1, -1, 0, 1),
    "coupling_stiffness": (0, -1, 0, 1),
    "compliance": (1, 0, 0, -1),
    "rotational_compliance": (-1, 1, 0, -1),
    "coupling_compliance": (0, 1, 0, -1),
    "damping": (-1, 0, 1, 1),
    "rotational_damping": (1, -1, 1, 1),
}
"""Kinds of quantity by name; stiffness, compliance and damping are per radian whatever the study's angle unit.

A mass is a force over an acceleration; what has mass in it is told in the study's unit of mass.
"""

_PER_RADIAN = frozenset(name for name in KINDS if name.endswith(("stiffness", "compliance", "damping")))

_FACTOR = r"\(?(?![eE]\d)[A-Za-zµμ°_]+(?:\d|\s*(?:\^|\*\*)\s*-?\d)?\)?"
QUANTITY = re.compile(
    r"\s*(?P<number>[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*"
    rf"(?P<unit>(?:1\s*/\s*)?{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*)\s*"
)
"""A number and a unit; digits occur in a unit only as powers, so that nothing large can be computed by it.

No text matches in two ways: what does not match is found out in time that grows with its length.
"""

# Longest text of a unit, in characters, and its highest power of length, angle, time or force.
MAX_UNIT = 60
MAX_POWER = 9

# Units as other languages and programs write them.
_TURNS = dict.fromkeys(("u/min", "upm", "tr/min", "rev/min"), "rpm")
_SYNONYMS = _TURNS | {"hz": "rev/s", "grad": "deg", "sek": "s", "zoll": "in"}


class QuantityError(ValueError):
    """A quantity that cannot be read or converted; the message says why."""


class Amount(float):
    """A number in the study's units, with the quantity that it was written as, and the expression that gives it.

    Without text it is a bare number; without an expression it is the same for every design.
    """

    text: str
    expression: Expression | None  # over parameters, in the study's units
    least: float | None = None  # least allowed value, which is excluded with `exclusive`
    exclusive: bool = False

    def __new__(cls, value: float, text: str = "", expression: Expression | None = None) -> Self:
        """Create it from a number, the quantity's text, and the expression."""
        amount = super().__new__(cls, value)
        amount.text, amount.expression = text, expression
        return amount

    @classmethod
    def of(cls, value: float) -> Self:
        """The number itself if it is an `Amount`, else as a bare one."""
        return value if isinstance(value, cls) else cls(value)

    @classmethod
    def by(cls, formula: str, **given: float) -> Self:
        """The value of a formula whose variables are `given`; it follows the parameters that they follow."""
        amounts = {name: cls.of(value) for name, value in given.items()}
        rule = Expression.parse(formula)
        value = float(rule.evaluate({name: float(amount) for name, amount in amounts.items()}))
        followed = {name: amount.expression or float(amount) for name, amount in amounts.items()}
        whole = rule.substituted(followed)
        return cls(value, "", whole if whole.names else None)

    def __str__(self) -> str:
        return self.text or repr(self)

    def within(self, unit: str) -> float:
        """The number in a unit of a table.

        Raises
        ------
        QuantityError
            Where the quantity is of another kind than the unit.
        """
        if not self.text:
            return float(self)
        number, powers, factor = measure(self.text)
        try:
            _, expected, divisor = measure(f"1 {unit}") if unit else (1.0, KINDS["none"], 1.0)
        except QuantityError:
            raise QuantityError(f"{self.text!r} has a unit, and {unit} is none: give a bare number") from None
        _check_kind(self.text, powers, expected)
        return number * factor / divisor


def turn_in(unit: str) -> float:
    """A whole turn in a unit of angle; 0 for another unit."""
    with contextlib.suppress(QuantityError):
        _, powers, factor = measure(f"1 {unit}")
        return 2 * math.pi / factor if powers == KINDS["angle"] else 0.0
    return 0.0


@dataclass(frozen=True)
class Units:
    """Units of a study's bare numbers; length may be ``dimensionless``."""

    length: str = "mm"
    angle: str = "deg"
    time: str = "s"
    force: str = "N"
    mass: str = "kg"

    @cached_property
    def angle_factor(self) -> float:
        """Radians in one unit of angle."""
        return _scale(self.angle)

    @cached_property
    def inertia_factor(self) -> float:
        """Force that gives a unit of mass a unit of acceleration, in the study's unit of force."""
        return _scale(self.mass) * _scale(self.length) / _scale(self.time) ** 2 / _scale(self.force)

    @cached_property
    def time_factor(self) -> float:
        """Seconds in one unit of time."""
        return _scale(self.time)

    def label(self, kind: str) -> str:
        """Unit of a kind of quantity as tables show it (``mm/s``, ``N*mm/rad``); empty for pure numbers."""
        length, angle, time, force = KINDS[kind]
        masses = _masses(KINDS[kind])
        length, time, force = length + masses, time - 2 * masses, force - masses
        angle_name = "rad" if kind in _PER_RADIAN else self.angle
        length_name = "" if self.length == "dimensionless" else self.length
        factors = [
            (self.mass, masses),
            (self.force, force),
            (length_name, length),
            (angle_name, angle),
            (self.time, time),
        ]
        above = "*".join(_power(name, power) for name, power in factors if name and power > 0)
        below = [_power(name, -power) for name, power in factors if name and power < 0]
        if not below:
            return above
        return f"{above or '1'}/{below[0] if len(below) == 1 else '(' + '*'.join(below) + ')'}"

    @cached_property
    def labels(self) -> dict[str, str]:
        """Units of all kinds of quantity."""
        return {kind: self.label(kind) for kind in KINDS}

    @staticmethod
    def ratio(above: str, below: str) -> str:
        """Unit of a quantity over another, from their labels."""
        if not below:
            return above
        one, _, under = above.partition("/")
        parts = [part[1:-1] if part.startswith("(") else part for part in (under, below) if part]
        under = "*".join(parts)
        return f"{one or '1'}/{f'({under})' if {'*', '/'} & {*under} else under}"

    def as_written(self, value: float, like: str) -> str:
        """A number in the study's units as the text of a quantity, in the unit of another; empty where that is bare."""
        match = QUANTITY.fullmatch(like)
        return "" if match is None else f"{value / self.convert('1 ' + match['unit'])!r} {match['unit']}"

    def convert(self, text: str, kind: str | None = None) -> float:
        """Convert a quantity of a kind (a name of `KINDS`, or any) to the study's units.

        Raises
        ------
        QuantityError
            Where the unit is unknown or of another kind.
        """
        number, powers, factor = measure(text, kind)
        if powers[0] and self.length == "dimensionless":
            raise QuantityError(f"{text.strip()!r} has a length in it, and this study's lengths are dimensionless")
        scale = _scale(self.length) ** powers[0] * _scale(self.time) ** powers[2] * _scale(self.force) ** powers[3]
        scale *= self.inertia_factor ** _masses(powers)
        # Stiffness is per radian by the format, so an angle below the line is never in the study's unit.
        scale *= self.angle_factor ** max(powers[1], 0)
        return number * factor / scale


def text_of(value: object) -> str:
    """The text of a quantity; empty for a bare number."""
    if isinstance(value, Amount):
        return value.text
    return value if isinstance(value, str) and QUANTITY.fullmatch(value) else ""


def at(value: float, parameters: Mapping[str, ArrayLike]) -> Number:
    """A number of the study at these values of the parameters."""
    expression = value.expression if isinstance(value, Amount) else None
    return float(value) if expression is None else expression.evaluate(parameters)


def written(value: float) -> str:
    """A number for a message: the quantity as written, or 12 digits."""
    return text_of(value) or numeral(value, 12)


def kind_of(value: object) -> str | None:
    """Name in `KINDS` of the quantity as which a number was written; None for a bare number and any other quantity."""
    text = text_of(value)
    powers = measure(text)[1] if text else None
    return next((name for name, exponents in KINDS.items() if exponents == powers), None)


# Units that messages name, by kind.
_EXAMPLES = {
    "length": ("mm", "cm", "m", "in"),
    "angle": ("deg", "rad"),
    "time": ("s", "min"),
    "force": ("N", "kN", "lbf"),
    "mass": ("kg", "g"),
}


def check_unit(kind: str, name: str) -> None:
    """Check a unit of length, angle, time, force or mass; a length may be ``dimensionless``.

    Raises
    ------
    QuantityError
        Where it is none, with examples.
    """
    with contextlib.suppress(QuantityError):
        if (kind, name) == ("length", "dimensionless") or measure(f"1 {name}")[1] == KINDS[kind]:
            return
    raise QuantityError(f"{name!r} is not a unit of {kind}; for example {', '.join(_EXAMPLES[kind])}")


def _masses(powers: Powers) -> int:
    """Power of mass in a quantity, which is a force times the square of a time; 0 of one without mass."""
    return powers[3] if powers[2] == 2 * powers[3] else 0


def _scale(name: str) -> float:
    """SI value of one unit."""
    return 1.0 if name == "dimensionless" else measure(f"1 {name}")[2]


def measure(text: str, kind: str | None = None) -> tuple[float, Powers, float]:
    """Read a quantity: its number, the powers of its unit, and the unit's value in SI units and radians.

    A rotational stiffness may leave its radian out.

    Raises
    ------
    QuantityError
        Where the unit is unknown, not of the expected kind, or no product of powers of length, angle, time and force.
    """
    match = QUANTITY.fullmatch(text)
    if match is None:
        raise QuantityError(f"{text!r} is not a number with a unit, such as '40 mm'")
    unit = match["unit"]
    if len(unit) > MAX_UNIT:
        raise QuantityError(f"{unit[:MAX_UNIT]!r}... is no unit: none is longer than {MAX_UNIT} characters")
    value = unit_value(unit)
    if value is None:
        names = (*chain(*_EXAMPLES.values()), *listed())
        near = _SYNONYMS.get(unit.replace(" ", "").casefold()) or nearest(unit, names)
        raise QuantityError(f"unknown unit {unit!r}" + f"; did you mean {near!r}?" * (near is not None))
    powers, factor = value
    if max(map(abs, powers)) > MAX_POWER:
        raise QuantityError(f"{unit!r} is no unit: it is {_describe(powers)}, and no power is beyond {MAX_POWER}")
    if kind is not None:
        _check_kind(text, powers, KINDS[kind])
    return float(match["number"]), powers, factor


def _check_kind(text: str, powers: Powers, expected: Powers) -> None:
    radian_left_out = expected == KINDS["rotational_stiffness"] and powers == KINDS["moment"]
    if powers != expected and not radian_left_out:
        raise QuantityError(f"{text.strip()!r} is {_describe(powers)}, where {_describe(expected)} is expected")


def _describe(powers: Powers) -> str:
    """Name a kind of quantity for a message."""
    for name, exponents in KINDS.items():
        if exponents == powers:
            article = "an" if name[0] in "aeiou" else "a"
            return "a pure number" if name == "none" else f"{article} {name.replace('_', ' ')}"
    names = ("length", "angle", "time", "force")
    return "a quantity of " + " ".join(_power(name, power) for name, power in zip(names, powers, strict=True) if power)


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"
