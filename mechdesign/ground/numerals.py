"""Numbers and units as a person reads them: one notation on terminals and in pages, pictures, sheets and messages."""

from __future__ import annotations

import math
import re

from mechdesign.ground.unit_table import unit_value

# Significant digits of a number in a table or a message.
DIGITS = 6
# Numbers up to a largest one outside of this range are multiples of a power of ten.
_PLAIN = 5e-3, 2e4
_RAISED = str.maketrans("0123456789-", "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079\u207b")
_LOWERED = {raised: ord(digit) for digit, raised in zip("0123456789-", _RAISED.values(), strict=True)}
_TEN = re.compile(rf"(\N{{MIDDLE DOT}})?10([{''.join(map(chr, _LOWERED))}]+)")
# Of letters that an encoding lacks; raised digits follow.
_PLAIN_LETTERS = {
    "\N{EN DASH}": "-", "\N{MINUS SIGN}": "-", "\N{INFINITY}": "inf", "\N{MIDDLE DOT}": "*", "\N{MICRO SIGN}": "u",
    "\N{GREEK SMALL LETTER MU}": "u", "\N{DEGREE SIGN}": "deg", "\N{HORIZONTAL ELLIPSIS}": "...",
    "\N{NO-BREAK SPACE}": " ",
} | {chr(letter): f"^{chr(digit)}" for letter, digit in _LOWERED.items()}  # fmt: skip
_MICROMETRES = re.compile(r"\bum\b")
_PRINTED = {"^2": "\N{SUPERSCRIPT TWO}", "^3": "\N{SUPERSCRIPT THREE}", "*": "\N{MIDDLE DOT}"}
_PREFIXES = {"n": -9, "u": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
_PREFIX_OF = {power: prefix for prefix, power in _PREFIXES.items()} | {-6: "\N{MICRO SIGN}"}
# A unit that takes prefixes, with its own; and the powers of length, angle, time and force of a power.
_PREFIXED = re.compile(r"(n|u|m|k|M|G|)(N|m|W|J|Pa|s)")
_POWER = (1, 0, -1, 1)
_SMALL = "m", "s"  # never kilometres


def raised(power: int) -> str:
    """A whole number as an exponent."""
    return str(power).translate(_RAISED)


def plain_powers(text: str) -> str:
    """A text with powers of ten in letters that every encoding has: ``2.5*10^-6``."""
    return _TEN.sub(lambda power: f"{'*' * bool(power[1])}10^{power[2].translate(_LOWERED)}", text)


def plain_letters(error: UnicodeError) -> tuple[str, int]:
    """What stands for letters that an encoding lacks, of unknown ones ``?``: a handler of `codecs.register_error`."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_PLAIN_LETTERS.get(letter, "?") for letter in error.object[error.start : error.end]), error.end


def printed(unit: str) -> str:
    """A unit with powers, products and micrometres as they are set in print."""
    unit = _MICROMETRES.sub("\N{MICRO SIGN}m", unit)
    for plain, sign in _PRINTED.items():
        unit = unit.replace(plain, sign)
    return unit


def as_written(unit: str) -> str:
    """A unit in print as a table has it."""
    for plain, sign in _PRINTED.items():
        unit = unit.replace(sign, plain)
    return unit.replace("\N{MICRO SIGN}", "u")


def numeral(value: float, digits: int = DIGITS) -> str:
    """A number to so many significant digits, with a power of ten in place of ``e``, as `in_powers`."""
    # Adding zero turns -0.0 into 0.0: the sign of a zero is an accident of rounding.
    digit, mark, power = format(value + 0.0, f".{digits}g").partition("e")
    return _with_power(digit, int(power)) if mark else digit


def in_powers(value: float) -> str:
    """Three digits of a number with a power of ten: 2.00\N{MIDDLE DOT}10\N{SUPERSCRIPT SIX}."""
    digit, power = f"{value:.2e}".split("e")
    return _with_power(digit, int(power))


def _with_power(digit: str, power: int) -> str:
    factor = {"1": "", "-1": "-"}.get(digit, f"{digit}\N{MIDDLE DOT}")
    return f"{factor}10{raised(power)}"


def power(largest: float) -> int:
    """Power of ten, a multiple of three, of which the numbers up to a largest one are written as multiples."""
    plain = _PLAIN[0] <= largest < _PLAIN[1] or largest == 0 or not math.isfinite(largest)
    return 0 if plain else 3 * math.floor(math.log10(largest) / 3)


def reading(largest: float, unit: str) -> tuple[int, str]:
    """The power of ten of which numbers up to a largest one are multiples, and the unit that these have, in print.

    >>> reading(2.5e4, "N"), reading(2.5e4, "N*mm"), reading(12.0, "N"), reading(4.5e7, "N*mm/s")
    ((3, 'kN'), (3, 'N·m'), (0, 'N'), (6, 'kW'))
    """
    watts = _watts(unit)
    if watts is not None:
        # What is infinite or missing has the unit itself.
        own = 3 * math.floor(math.log10(largest * 10.0**watts) / 3) if 0 < largest < math.inf else 0
        own = min(max(own, -9), 9)
        return own - watts, f"{_PREFIX_OF[own]}W"
    exponent = power(largest)
    if not exponent:
        return 0, printed(unit)
    return exponent, printed(_scaled(unit, exponent)) or f"10{raised(exponent)} {printed(unit)}".rstrip()


def in_watts(unit: str) -> float | None:
    """Watts in a unit of power that is written as a product, such as ``N*mm/s``; None of other units."""
    watts = _watts(unit)
    return None if watts is None or "W" in unit else 10.0**watts


def _watts(unit: str) -> int | None:
    """Power of ten of a watt that a unit of power is; None of other units."""
    powers, value = unit_value(unit) or ((), 0.0)
    exponent = round(math.log10(value)) if value > 0 else 0
    return exponent if powers == _POWER and math.isclose(value, 10.0**exponent) else None


def _scaled(unit: str, exponent: int) -> str:
    """The unit of so many powers of ten of a unit: ``N*m`` of a thousand N*mm; empty where it has no name."""
    above, slash, below = unit.partition("/")
    first, *rest = above.split("*")
    other = _PREFIXED.fullmatch(rest[0]) if len(rest) == 1 else None
    match = _PREFIXED.fullmatch(first)
    if match is None:
        return ""
    exponent += _PREFIXES[match[1]]
    if other is not None and other[2] == "m":
        # Of a moment the force has the prefix.
        exponent, rest = exponent + _PREFIXES[other[1]], ["m"]
    if exponent not in _PREFIX_OF or (exponent > 0 and match[2] in _SMALL):
        return ""
    return "*".join([f"{_PREFIX_OF[exponent]}{match[2]}", *rest]) + slash + below
