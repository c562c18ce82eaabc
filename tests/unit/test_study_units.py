"""Quantities in the study's units, and labels for tables."""

import math
import subprocess
import sys

import pytest

from mechdesign.study.text import units as unit_rules
from mechdesign.study.text.units import QuantityError, Units

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


@pytest.mark.slow
def test_pint_is_imported_only_for_an_uncommon_unit(tmp_path):
    study = tmp_path / "study.yaml"
    study.write_text("mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 2]}, drives: [arm], sketch: {P: [1, 1]}}\n")
    code = f"import sys, mechdesign; mechdesign.load({str(study)!r}); print('pint' in sys.modules)"
    code += f"; mechdesign.load({str(study)!r}, ['mechanism.links.arm.length=2 ft']); print('pint' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.split() == ["False", "True"]


@pytest.mark.parametrize("text", ["3 mm", "2 rad/s", "2 deg / s", "5 cm/min", "4 N", "4 kN/m", "1 in/s"])
def test_common_units_are_those_of_the_registry(text: str) -> None:
    number, powers, factor = unit_rules.measure(text)
    unit = text.split(" ", 1)[1]
    assert (number, powers) == (float(text.split()[0]), unit_rules._unit(unit)[0])
    assert factor == pytest.approx(unit_rules._unit(unit)[1], rel=1e-14)
    assert unit_rules._common(unit) is not None


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
    assert unit_rules.QUANTITY.fullmatch(text) is None
