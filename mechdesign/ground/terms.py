"""Results by name, and sums of them, which requirements and goals judge."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.commands import COMMANDS
from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import ExpressionError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Result
from mechdesign.ground.rows import ChosenRows, UnknownColumnError, amount_in, choose, named

# The path of one column.
_PATH = re.compile(r"[\w.]+")
# A command, in front of the path of a column.
_COMMAND = re.compile(rf"(?<![\w.])({'|'.join(COMMANDS)})\.")


@dataclass(frozen=True, eq=False)
class Sum:
    """A sum of multiples of numbers of a result, all of one unit."""

    expression: Expression
    terms: Mapping[str, ChosenRows]  # by the names in the expression

    @property
    def unit(self) -> str:
        """Unit of the terms."""
        return next(iter(self.terms.values())).unit

    def bound(self, value: float) -> float:
        """A bound in the unit of the terms; see `ChosenRows.bound`."""
        return amount_in(value, self.expression.text, self.unit)

    @property
    def parts(self) -> tuple[ChosenRows, ...]:
        """The columns that it is made from, one for each term."""
        return (*self.terms.values(),)

    @property
    def missing(self) -> str:
        """Why a term never has rows; empty where all may have."""
        return next(filter(None, (term.missing for term in self.parts)), "")

    def numbers(self, designs: int = 1, *, assembled: bool = False) -> Floats:
        """The sum of each design, shape (designs,); see `ChosenRows.numbers`."""
        numbers = {name: term.numbers(designs, assembled=assembled) for name, term in self.terms.items()}
        return np.asarray(self.expression.evaluate(numbers), dtype=float)


def command_of(text: str) -> str:
    """The command of a result, or of a sum of results; empty where it names none."""
    named = _COMMAND.search(text)
    return named.group(1) if named else ""


def path_of(text: str) -> str:
    """A result, or a sum of results, without the name of the command."""
    return _COMMAND.sub("", text)


def sum_of(text: str) -> Expression | None:
    """A sum of numbers of results; None where the text is the name of one.

    Columns of an optimisation may be expressions themselves.

    Raises
    ------
    ExpressionError
        If it is no sum of multiples of numbers.
    """
    if _PATH.fullmatch(text) or text.startswith("optimize."):
        return None
    expression = Expression.parse(text)
    if not expression.is_linear():
        raise ExpressionError(f"{text!r} is no sum: results of one unit are added, each times a number")
    return expression


def terms_of(result: Result, path: str, where: Mapping[str, Any]) -> ChosenRows | Sum:
    """The column that a path names, or the sum of numbers of several columns.

    Raises
    ------
    UnknownColumnError
        As `choose` does; if the terms of a sum are in different units, or one of them is not one number.
    """
    if (expression := _sum(result, path)) is None:
        return choose(result, path, where)
    terms = {name: choose(result, name, where) for name in sorted(expression.names)}
    units = {name: term.unit for name, term in terms.items()}
    if len({*units.values()}) > 1:
        listed = ", ".join(f"{name} ({unit or 'no unit'})" for name, unit in units.items())
        raise UnknownColumnError(f"what is added has one unit, and here are several: {listed}")
    return Sum(expression, terms)


def is_plain(result: Result, path: str) -> bool:
    """Whether a path names a column alone: no sum, and no statistic."""
    return _sum(result, path) is None and not named(result, path)[1]


def _sum(result: Result, path: str) -> Expression | None:
    # A column of an optimisation may be an expression itself.
    if any(path in table for table in result.tables.values()):
        return None
    with suppress(ExpressionError):
        return sum_of(path)
    return None
