"""Quantities in the study's units, and labels for tables."""

import math
import re

import pytest

import mechdesign
from mechdesign.ground.unit_table import listed
from mechdesign.study.text.units import QUANTITY, QuantityError, Units, measure

MM = Units("mm", "deg", "s", "N")
SI = Units("m", "rad", "s", "N")


@pytest.mark.parametrize(
    ("units", "text", "value"),
    [
        (MM, "4 cm", 40.0),
        (MM, "2 in", 50.8),
        (MM, "200 GPa", 200_000.0),
        (MM, "600 rpm", 3600.0),
        (MM, "-30 rad/s", -30 * 180 / math.pi),
        (MM, "30 arcmin", 0.5),
        (MM, "1e5 N*m/rad", 1e8),
        (MM, "1e5 N*m/deg", 1e8 * 180 / math.pi),
        (MM, "1 kN", 1000.0),
        (MM, "5e7 N/m", 5e4),
        (MM, "2 cm^4", 2e4),
        (MM, "9.81 m/s^2", 9810.0),
        (MM, "1 rad/s^2", 180 / math.pi),
        (SI, "90 deg", math.pi / 2),
        (SI, "1 rev", 2 * math.pi),
        (SI, "1 lbf", 4.4482216152605),
        (Units("in", "deg", "ms", "lbf"), "1 psi", 1.0),
        (Units("in", "deg", "ms", "lbf"), "1 in/s", 1e-3),
    ],
)
def test_quantities(units, text, value):
    assert units.convert(text) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("5 foo", "length", "unknown unit 'foo'"),
        ("5 deg", "length", "is an angle, where a length is expected"),
        ("5 Hz", "angular_velocity", "unknown unit"),
        ("5 1/s", "angular_velocity", "where an angular velocity is expected"),
        ("5 mm/s", "angular_velocity", "is a velocity"),
    ],
)
def test_wrong_units(text, kind, message):
    with pytest.raises(QuantityError, match=message):
        MM.convert(text, kind)


def test_dimensionless_lengths_take_no_quantity_with_a_length():
    units = Units("dimensionless", "rad", "s", "N")
    assert (units.label("length"), units.label("velocity"), units.label("moment")) == ("", "1/s", "N")
    with pytest.raises(QuantityError, match="dimensionless"):
        units.convert("40 mm")
    assert units.convert("180 deg") == pytest.approx(math.pi)


@pytest.mark.parametrize(
    ("kind", "label"),
    [
        ("length", "mm"),
        ("angular_velocity", "deg/s"),
        ("acceleration", "mm/s^2"),
        ("moment", "N*mm"),
        ("stress", "N/mm^2"),
        ("stiffness", "N/mm"),
        ("rotational_stiffness", "N*mm/rad"),
        ("compliance", "mm/N"),
        ("rotational_compliance", "rad/(N*mm)"),
        ("coupling_compliance", "rad/N"),
        ("none", ""),
    ],
)
def test_labels(kind, label):
    assert Units().label(kind) == label


@pytest.mark.parametrize(
    ("above", "below", "ratio"),
    [
        ("mm", "deg", "mm/deg"),
        ("mm/s", "N", "mm/(s*N)"),
        ("deg", "deg/s", "deg/(deg/s)"),
        ("", "mm/s", "1/(mm/s)"),
        ("mm/(s*N)", "deg", "mm/(s*N*deg)"),
        ("mm", "rad/(N*mm)", "mm/(rad/(N*mm))"),
        ("mm", "", "mm"),
    ],
)
def test_a_unit_over_another(above, below, ratio):
    assert Units.ratio(above, below) == ratio


# Each unit by its ways to write it: its value in SI units and radians, and its powers of m, rad, s and kg.
Powers = tuple[int, int, int, int]
BOOK: dict[str, tuple[float, Powers]] = {
    "meter metre m": (1.0, (1, 0, 0, 0)),
    "second sec s": (1.0, (0, 0, 1, 0)),
    "gram g": (1e-3, (0, 0, 0, 1)),
    "tonne t": (1e3, (0, 0, 0, 1)),
    "radian rad": (1.0, (0, 1, 0, 0)),
    "degree degrees deg °": (math.pi / 180, (0, 1, 0, 0)),
    "arcminute arcmin": (math.pi / 10_800, (0, 1, 0, 0)),
    "arcsecond arcsec": (math.pi / 648_000, (0, 1, 0, 0)),
    "grade gon": (math.pi / 200, (0, 1, 0, 0)),
    "revolution revolutions rev turn turns": (2 * math.pi, (0, 1, 0, 0)),
    "minute min": (60.0, (0, 0, 1, 0)),
    "hour h": (3600.0, (0, 0, 1, 0)),
    "rpm": (math.pi / 30, (0, 1, -1, 0)),
    "inch inches in": (0.0254, (1, 0, 0, 0)),
    "foot feet ft": (0.3048, (1, 0, 0, 0)),
    "yard yd": (0.9144, (1, 0, 0, 0)),
    "thou mil": (2.54e-5, (1, 0, 0, 0)),
    "newton N": (1.0, (1, 0, -2, 1)),
    "pound lb": (0.45359237, (0, 0, 0, 1)),
    "pound_force lbf": (4.4482216152605, (1, 0, -2, 1)),
    "kilopond kgf kp": (9.80665, (1, 0, -2, 1)),
    "dyne dyn": (1e-5, (1, 0, -2, 1)),
    "pascal Pa": (1.0, (-1, 0, -2, 1)),
    "bar": (1e5, (-1, 0, -2, 1)),
    "psi": (6894.757293168361, (-1, 0, -2, 1)),
    "ksi": (6894757.293168361, (-1, 0, -2, 1)),
    "joule J": (1.0, (2, 0, -2, 1)),
    "watt W": (1.0, (2, 0, -3, 1)),
}
SPELLINGS = {name: unit for names, unit in BOOK.items() for name in names.split()}
PREFIXES = {
    "kilo": 1e3,
    "mega": 1e6,
    "giga": 1e9,
    "deci": 0.1,
    "centi": 0.01,
    "milli": 1e-3,
    "micro": 1e-6,
    "nano": 1e-9,
}
PREFIXES |= {"k": 1e3, "M": 1e6, "G": 1e9, "d": 0.1, "c": 0.01, "m": 1e-3, "µ": 1e-6, "μ": 1e-6, "u": 1e-6, "n": 1e-9}
STUDY = "mechanism:\n  links: {ground: {O: [0, 0]}, arm: [O, P, 2]}\n  drives: [arm]\n  sketch: {P: [1, 1]}\n"


def read(quantities: dict[str, tuple[float, Powers]]) -> None:
    """Read each quantity of one unit as a parameter of a study in SI units, and compare its value and dimensions."""
    parameters = "".join(f"    p{row}: '{text}'\n" for row, text in enumerate(quantities))
    study = mechdesign.load(text=f"units: {{length: m, angle: rad}}\n{STUDY}  parameters:\n{parameters}")
    for row, (text, (value, powers)) in enumerate(quantities.items()):
        assert study.parameters.nominal[f"p{row}"] == pytest.approx(value, rel=1e-13), text
        length, angle, time, mass = powers
        # A mass is a force over an acceleration.
        assert measure(text)[1] == (length - mass, angle, time + 2 * mass, mass), text


@pytest.mark.slow
def test_every_unit_has_its_value_by_every_name_and_prefix():
    assert set(SPELLINGS) == {
        name for written, (_, others) in listed().items() if written[-1] != "-" for name in (written, *others)
    }
    quantities = {f"1 {name}": unit for name, unit in SPELLINGS.items()}
    for prefix, factor in PREFIXES.items():
        for name in ("meter", "s", "gram", "gon", "rpm", "in", "N", "Pa", "bar"):
            value, powers = SPELLINGS[name]
            quantities.setdefault(f"1 {prefix}{name}", (factor * value, powers))
    read(quantities)


@pytest.mark.slow
def test_every_unit_has_powers_and_quotients():
    quantities = {}
    for name, (value, powers) in SPELLINGS.items():
        for text, power in (("^2", 2), ("**2", 2), (" ^ 3", 3), ("3", 3), ("^-1", -1), ("**-2", -2), ("1", 1)):
            quantities[f"1 {name}{text}"] = value**power, tuple(power * exponent for exponent in powers)
        along, below, above = (
            tuple(exponent + change for exponent, change in zip(powers, changes, strict=True))
            for changes in ((1, 0, 0, 0), (-1, 0, -2, 0), (-1, 0, 2, 0))
        )
        for text in (f"{name}*mm", f"mm {name}", f"{name} · mm", f"({name} * mm)", f"mm/min*{name}*min"):
            quantities[f"1 {text}"] = value / 1e3, along
        for text in (f"{name}/(mm*min^2)", f"{name}/mm/min2", f"{name} / (mm min min)", f"1/(mm/{name}*min^2)"):
            quantities[f"1 {text}"] = value * 1e3 / 3600, below
        for text in (f"{name}/mm*min^2", f"1/mm {name} min min", f"{name}/(mm/min^2)"):
            quantities[f"1 {text}"] = value * 1e3 * 3600, above
    read(quantities)


@pytest.mark.parametrize(
    "unit",
    [
        "(mm", "mm)", "N/(mm", "N/mm)", "N)/(mm", "mm^0", "mm0", "kkm", "mkm", "k", "µ", "kilo", "MM", "ns N s x",
        "m per s", "square mm", "mm squared", "pounds_", "eV", "Hz",
    ],
)  # fmt: skip
def test_what_is_no_unit_is_refused(unit):
    with pytest.raises(mechdesign.StudyError, match=re.escape(f"unknown unit '{unit}'")):
        mechdesign.load(text=STUDY.replace("2]", f"'3 {unit}']"))


@pytest.mark.parametrize(
    ("unit", "near"), [("cn", "N"), ("U/min", "rpm"), ("grad", "deg"), ("zoll", "in"), ("metr", "meter")]
)
def test_an_unknown_unit_names_the_nearest(unit, near):
    with pytest.raises(mechdesign.StudyError, match=f"unknown unit '{unit}'; did you mean '{near}'?"):
        mechdesign.load(text=STUDY.replace("2]", f"'3 {unit}']"))


@pytest.mark.parametrize("unit", ["*".join(["km"] * 100), "/".join(["mm"] * 100), " ".join(["m"] * 110), "a" * 3000])
@pytest.mark.parametrize("number", ["3", "1e300", "0"])
def test_a_unit_of_a_hundred_factors(number, unit):
    with pytest.raises(QuantityError, match="is no unit: none is longer than 60 characters"):
        Units().convert(f"{number} {unit}")


@pytest.mark.parametrize("unit", ["km^9*km^9", "nm**-9 / nm", "1/ms^9/ms"])
@pytest.mark.parametrize("length", ["nm", "Gm"])
def test_a_power_that_no_quantity_has(length, unit):
    with pytest.raises(QuantityError, match="no power is beyond 9"):
        Units(length=length).convert(f"3 {unit}")


@pytest.mark.parametrize("text", ["3 m" + "  m" * 1000 + "!", "3" * 5000 + "!", "3 m" + " m ^" * 1000])
def test_what_is_no_quantity_is_found_out_at_once(text):
    assert QUANTITY.fullmatch(text) is None
