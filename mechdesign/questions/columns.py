"""Kinds of columns that tables of several questions have, and units of their numbers."""

from __future__ import annotations

from importlib import import_module

from mechdesign.commands import QUESTIONS
from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import KeyNumber, TableKind
from mechdesign.motion.motion import GIVEN as GIVEN
from mechdesign.motion.motion import TIMED as TIMED
from mechdesign.study import Units

DRIVE = ColumnKind("<drive>", "drive", "length or angle")
EFFICIENCY = (
    ColumnKind("friction_power", "power that friction takes, never positive", "power",
               "-sum of coefficient * radius * |joint force| * |relative rate|"),
    ColumnKind("efficiency", "power that comes out over power that goes in, of drives or of loads, weights, springs "
               "and inertia; 0 where friction takes all: self-locking"),
    ColumnKind("back_efficiency", "the same while the mechanism moves backwards under the same forces"),
)  # fmt: skip
VALID = ColumnKind("valid", "1 where the pose is assembled and within its limits")


def tables_of(command: str) -> list[TableKind]:
    """The tables of a question, as the `columns` of its folder declare them."""
    declared = vars(import_module(QUESTIONS[command].columns))
    return [table for table in declared.values() if isinstance(table, TableKind)]


def key_numbers(command: str) -> tuple[KeyNumber, ...]:
    """The numbers at the top of a question's report, as its `columns` declare them."""
    declared: tuple[KeyNumber, ...] = import_module(QUESTIONS[command].columns).KEY_NUMBERS
    return declared


def power_of_length(units: Units, power: int) -> str:
    """The study's unit of length to a power."""
    name = "" if units.length == "dimensionless" else units.length
    text = name if abs(power) == 1 else f"{name}^{abs(power)}"
    return "" if power == 0 or not name else text if power > 0 else f"1/{text}"
