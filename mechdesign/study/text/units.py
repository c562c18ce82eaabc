"""The study's units, and quantities such as ``"40 mm"`` converted to them.

A *kind* of quantity is a product of powers of length, angle, time and force. Pint is imported only where a string with
a unit occurs; its registry here knows the units of mechanics alone and keeps the angle as a dimension of its own, so
that ``rad/s`` is never taken for a frequency.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Self

from numpy.typing import ArrayLike

from mechdesign.errors import nearest
from mechdesign.expressions import Expression, Number

HELP_PAGE = "reference/expressions"

Powers = tuple[int, ...]
"""Exponents of length, angle, time and force."""

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

_FACTOR = r"\(?(?![eE]\d)[A-Za-zµμ°]+(?:\d|\s*(?:\^|\*\*)\s*-?\d)?\)?"
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

_DEFINITIONS = """
kilo- = 1000 = k-
mega- = 1e6 = M-
giga- = 1e9 = G-
deci- = 0.1 = d-
centi- = 0.01 = c-
milli- = 1e-3 = m-
micro- = 1e-6 = µ- = μ- = u-
nano- = 1e-9 = n-
meter = [length] = m = metre
second = [time] = s = sec
gram = [mass] = g
tonne = 1e6 * gram = t
radian = [angle] = rad
degree = 0.017453292519943295 * radian = deg = ° = degrees
arcminute = degree / 60 = arcmin
arcsecond = arcminute / 60 = arcsec
grade = 0.015707963267948967 * radian = gon
revolution = 6.283185307179586 * radian = rev = turn = turns = revolutions
minute = 60 * second = min
hour = 60 * minute = h
rpm = revolution / minute
inch = 0.0254 * meter = in = inches
foot = 12 * inch = ft = feet
yard = 3 * foot = yd
thou = 0.001 * inch = mil
newton = kilogram * meter / second ** 2 = N
pound = 0.45359237 * kilogram = lb
pound_force = 4.4482216152605 * newton = lbf
kilopond = 9.80665 * newton = kgf = kp
dyne = 1e-5 * newton = dyn
pascal = newton / meter ** 2 = Pa
bar = 1e5 * pascal
psi = pound_force / inch ** 2
ksi = 1000 * psi
joule = newton * meter = J
watt = joule / second = W
"""


# Units as other languages and programs write them.
_SYNONYMS = {"u/min": "rpm", "upm": "rpm", "tr/min": "rpm", "rev/min": "rpm", "grad": "deg", "sek": "s", "zoll": "in"}


def listed() -> dict[str, tuple[str, tuple[str, ...]]]:
    """Units and prefixes (``kilo-``) by name: what each is, and the other ways to write it."""
    lines = [[part.strip() for part in line.split(" = ")] for line in _DEFINITIONS.strip().splitlines()]
    return {name: (meaning.replace(" ** ", "^"), tuple(others)) for name, meaning, *others in lines}


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
    return text_of(value) or f"{value:.12g}"


def kind_of(value: object) -> str | None:
    """Name in `KINDS` of the quantity as which a number was written; None for a bare number and any other quantity."""
    text = text_of(value)
    powers = measure(text)[1] if text else None
    return next((name for name, exponents in KINDS.items() if exponents == powers), None)


# Common units with their kind and SI value, read without pint's registry, which takes long to build.
_COMMON = {
    "mm": ("length", 1e-3),
    "cm": ("length", 1e-2),
    "m": ("length", 1.0),
    "in": ("length", 0.0254),
    "deg": ("angle", math.pi / 180.0),
    "rad": ("angle", 1.0),
    "s": ("time", 1.0),
    "min": ("time", 60.0),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "lbf": ("force", 4.4482216152605),
    "kg": ("mass", 1.0),
    "g": ("mass", 1e-3),
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
    examples = ", ".join(unit for unit, (unit_kind, _) in _COMMON.items() if unit_kind == kind)
    raise QuantityError(f"{name!r} is not a unit of {kind}; for example {examples}")


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
    powers, factor = _common(unit) or _unit(unit)
    if max(map(abs, powers)) > MAX_POWER:
        raise QuantityError(f"{unit!r} is no unit: it is {_describe(powers)}, and no power is beyond {MAX_POWER}")
    if kind is not None:
        _check_kind(text, powers, KINDS[kind])
    return float(match["number"]), powers, factor


def _check_kind(text: str, powers: Powers, expected: Powers) -> None:
    radian_left_out = expected == KINDS["rotational_stiffness"] and powers == KINDS["moment"]
    if powers != expected and not radian_left_out:
        raise QuantityError(f"{text.strip()!r} is {_describe(powers)}, where {_describe(expected)} is expected")


def _common(unit: str) -> tuple[Powers, float] | None:
    """A common unit or a quotient of two, such as ``rad/s``."""
    names = [name.strip() for name in unit.split("/")]
    if len(names) > 2 or any(name not in _COMMON for name in names):
        return None
    kind, factor = _COMMON[names[0]]
    powers = KINDS[kind]
    if len(names) == 2:
        kind, divisor = _COMMON[names[1]]
        powers, factor = tuple(a - b for a, b in zip(powers, KINDS[kind], strict=True)), factor / divisor
    return powers, factor


@cache
def _unit(unit: str) -> tuple[Powers, float]:
    registry = _registry()
    try:
        power = re.sub(r"([^\W\d_])(\d)", r"\1**\2", unit)  # m/s2
        parsed = registry.parse_units(power.replace("^", "**").replace("·", "*"))
        base = registry.Quantity(1.0, parsed).to_base_units()
    except Exception:  # pint raises errors of many classes
        defined = (line.partition("=")[0].strip() for line in _DEFINITIONS.split("\n"))
        near = _SYNONYMS.get(unit.replace(" ", "").casefold()) or nearest(unit, (*_COMMON, *defined))
        raise QuantityError(f"unknown unit {unit!r}" + f"; did you mean {near!r}?" * (near is not None)) from None
    dimensions = {str(name): power for name, power in base.dimensionality.items()}
    mass, length = dimensions.get("[mass]", 0), dimensions.get("[length]", 0)
    angle, time = dimensions.get("[angle]", 0), dimensions.get("[time]", 0)
    exponents = (length - mass, angle, time + 2 * mass, mass)
    if any(exponent != int(exponent) for exponent in exponents):
        raise QuantityError(f"the unit {unit!r} has a broken power; powers are whole, as in mm^2")
    # The registry's base of mass is the gram.
    return tuple(map(int, exponents)), float(base.magnitude) * 1e-3**mass


@cache
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(None, on_redefinition="ignore")
    registry.load_definitions(_DEFINITIONS.strip().splitlines())
    return registry


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
