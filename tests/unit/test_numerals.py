"""Numbers and units as people read them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mechdesign.door.report.page.headlines import _in_words
from mechdesign.drawing import style
from mechdesign.ground.columns import Column
from mechdesign.ground.numerals import numeral, plain_powers, reading
from mechdesign.ground.table_text import readable


@pytest.mark.parametrize(
    ("value", "text"),
    [(2e6, "2·10⁶"), (1e-9, "10⁻⁹"), (-3.55271e-12, "-3.55271·10⁻¹²"), (123456.4, "123456"), (-0.0, "0")],
)
def test_a_power_of_ten_stands_in_place_of_e(value: float, text: str) -> None:
    assert numeral(value) == text


@pytest.mark.parametrize(
    ("largest", "unit", "said"),
    [
        (2.5e4, "N", (3, "kN")),
        (2.5e4, "N*mm", (3, "N·m")),
        (3e7, "N*mm", (6, "kN·m")),
        (3e4, "mm/s", (3, "m/s")),
        (1e-3, "mm", (-3, "µm")),
        (3e7, "N/m", (6, "MN/m")),
        (15.0, "N*mm/s", (0, "mW")),
        (4.5e7, "N*mm/s", (6, "kW")),
        (760.0, "kN*mm/s", (0, "W")),
        (1e5, "deg/s", (3, "10³ deg/s")),
        (1e6, "mm/s^2", (6, "10⁶ mm/s²")),
        (12.0, "N", (0, "N")),
        (500.0, "lbf*in/s", (0, "lbf·in/s")),
    ],
)
def test_a_unit_fits_the_size_of_its_numbers(largest: float, unit: str, said: tuple[int, str]) -> None:
    power, words = reading(largest, unit)
    assert (power, words) == said


def test_what_turns_or_pulls_by_rounding_about_the_size_of_a_mechanism_is_zero() -> None:
    """Nothing turns: its angular velocity is rounding beside velocities; a moment is, beside forces."""
    columns = [
        Column("P.x_velocity", np.array([1.0, -2.0]), "mm/s"),
        Column("table.angle_velocity", np.array([3.7e-15, 0.0]), "deg/s"),
        Column("fx", np.array([20.0, 30.0]), "kN"),
        Column("moment", np.array([1.7e-13, -2e-13]), "kN*m"),
        Column("power", np.array([1500.0, 4e-12]), "N*mm/s"),
    ]
    cells = {column.name: (column.unit, column.cells) for column in readable(columns, columns, (300.0, "mm"))}
    assert cells["table.angle_velocity"] == ("deg/s", ["0", "0"])
    assert cells["moment"] == ("kN*m", ["0", "0"])
    assert cells["power"] == ("W", ["1.5", "0"])
    alone = readable(columns[1:2], columns[1:2], (300.0, "mm"))
    assert alone[0].cells == ["3.7·10⁻¹⁵", "0"], "nothing tells how large such a number usually is"


def test_rounding_of_rows_with_their_own_units_is_zero() -> None:
    columns = [
        Column("nominal", np.array([160.0, 3.4e-15]), "", "value, in `unit`"),
        Column("unit", np.array(["mm", "deg"])),
    ]
    assert readable(columns, columns, (160.0, "mm"))[0].cells == ["160", "0"]


@pytest.mark.parametrize("room", [0.6, 0.9, 1.2, 2.0, 3.0])
@pytest.mark.parametrize("space", [" ", "\N{NO-BREAK SPACE}"])
def test_a_number_is_not_broken_across_lines_of_a_picture(room: float, space: str) -> None:
    """``= 7`` above ``8.8`` reads as a fraction."""
    words = "kinematics.extremes.range (output P.x) = 78.8 deg".replace(" ", space)
    lines = style.folded(words, 10, room).split("\n")
    assert [line for line in lines if "= 78.8 deg" in line], lines
    assert "".join(lines).replace(" ", "") == words.replace(space, "")


def test_a_number_is_not_broken_across_lines_of_key_numbers() -> None:
    columns = [
        Column("kinematics.extremes.range (output P.x)", np.array([78.8]), "mm"),
        Column("r", np.array([20.0]), "mm"),
    ]
    words = _in_words(columns, 0)
    assert "=\N{NO-BREAK SPACE}78.8\N{NO-BREAK SPACE}mm" in words
    assert "r\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}20\N{NO-BREAK SPACE}mm" in words
    assert words.startswith("kinematics.extremes.range (output P.x) ")


def test_a_power_of_ten_is_not_lost_where_an_encoding_has_no_raised_digits() -> None:
    assert plain_powers("1.76·10⁻⁹ to 10¹²").encode("ascii") == b"1.76*10^-9 to 10^12"


def test_what_is_infinite_has_the_unit_itself():
    """A rigid direction has an infinite stiffness, and no power of ten."""
    assert reading(math.inf, "N/mm") == (0, "N/mm")
    assert reading(math.nan, "N") == (0, "N")
    assert reading(math.inf, "W") == (0, "W")
