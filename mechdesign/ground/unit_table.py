"""The units of mechanics, and the value of their products, quotients and powers in SI units.

The angle is a dimension of its own, so that ``rad/s`` is never taken for a frequency.
"""

from __future__ import annotations

import math
import re
from functools import cache

Powers = tuple[int, ...]
"""Exponents of length, angle, time and force."""

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
newton = kilogram * meter / second^2 = N
pound = 0.45359237 * kilogram = lb
pound_force = 4.4482216152605 * newton = lbf
kilopond = 9.80665 * newton = kgf = kp
dyne = 1e-5 * newton = dyn
pascal = newton / meter^2 = Pa
bar = 1e5 * pascal
psi = pound_force / inch^2
ksi = 1000 * psi
joule = newton * meter = J
watt = joule / second = W
"""

# Powers and SI value of what the definitions begin with; a mass is a force over an acceleration.
_BASES = {
    "[length]": ((1, 0, 0, 0), 1.0),
    "[angle]": ((0, 1, 0, 0), 1.0),
    "[time]": ((0, 0, 1, 0), 1.0),
    "[mass]": ((-1, 0, 2, 1), 1e-3),
}

_LETTERS = r"[A-Za-zµμ°_]+"
_PART = re.compile(rf"({_LETTERS})(?:\s*(?:\^|\*\*)\s*)?(-?\d)?|(\d[\d.]*(?:e-?\d+)?)|([/()])")


@cache
def listed() -> dict[str, tuple[str, tuple[str, ...]]]:
    """Units and prefixes (``kilo-``) by name: what each is, and the other ways to write it."""
    lines = [line.split(" = ") for line in _DEFINITIONS.strip().splitlines()]
    return {name: (meaning, tuple(others)) for name, meaning, *others in lines}


@cache
def unit_value(unit: str) -> tuple[Powers, float] | None:
    """Powers of a unit such as ``N*mm/rad^2``, and its value in SI units and radians; None of what is no unit.

    What stands after a ``/`` in parentheses is below the line as a whole.
    """
    if unit in _BASES:
        return _BASES[unit]
    powers: Powers = (0, 0, 0, 0)
    value, signs, sign = 1.0, [1], 1
    for name, exponent, number, mark in _PART.findall(unit):
        if mark == "/":
            sign = -signs[-1]
        elif mark == "(":
            signs.append(sign)
        elif mark == ")":
            del signs[-1]
            if not signs:
                return None
        else:
            factor = _named(name) if name else ((0, 0, 0, 0), float(number))
            power = sign * int(exponent or 1)
            if factor is None or not power:
                return None
            powers = tuple(one + power * other for one, other in zip(powers, factor[0], strict=True))
            value = value * factor[1] ** power if power > 0 else value / factor[1] ** -power
            sign = signs[-1]
    return (powers, value) if len(signs) == 1 and 0.0 < value < math.inf else None


@cache
def _meanings() -> dict[str, str]:
    """Definitions by every way to write a unit or a prefix, which may be none."""
    written = {name: meaning for name, (meaning, others) in listed().items() for name in (name, *others)}
    return {"-": "1", **written}


def _named(name: str) -> tuple[Powers, float] | None:
    """Powers and SI value of a unit with or without a prefix; names of two letters and more have a plural."""
    meanings = _meanings()
    for stem, shortest in ((name, 1), (name.removesuffix("s"), 2)):
        for start in range(len(stem) - shortest + 1):
            prefix, unit = meanings.get(f"{stem[:start]}-"), meanings.get(stem[start:])
            scale, base = prefix and unit_value(prefix), unit and unit_value(unit)
            if scale and base:
                return base[0], scale[1] * base[1]
    return None
