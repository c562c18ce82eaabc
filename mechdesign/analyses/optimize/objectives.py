"""Results by which designs are compared, by name: an index of the workspace, or the worst row of any column."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.workspace.question import COLUMNS, batched, split
from mechdesign.commands import COMMANDS
from mechdesign.numerics.arrays import Floats
from mechdesign.results import Result
from mechdesign.rows import choose, worst
from mechdesign.study.schema.optimize import Condition, OptimizeSection


@dataclass(frozen=True)
class Goal:
    """A result that is maximised, minimised or bounded: an index of the workspace, or the worst row of a column.

    Parameters
    ----------
    name : str
        As the study gives it; of a condition with its bound.
    command, column : str
        Where it is found; the column as `mechdesign.rows.choose` understands it.
    smallest : bool
        Whether the largest row is the worst one.
    absolute : bool
        Judge absolute values.
    where : tuple of (str, object)
        Only rows whose columns have these values count.
    """

    name: str
    command: str
    column: str
    smallest: bool = False
    absolute: bool = False
    where: tuple[tuple[str, object], ...] = ()

    @property
    def regional(self) -> bool:
        """Whether it is a number of the whole workspace."""
        found = self.column in COLUMNS or bool(split(self.column)[0])
        return self.command == "workspace" and found and not self.where

    @property
    def index(self) -> bool:
        """Whether it is an index of the workspace that is evaluated for many designs at once."""
        return self.regional and batched(self.column)

    def worst(self, result: Result, designs: int = 1) -> Floats:
        """The value of each design's worst row; nan where none counts or one has no value.

        Parameters
        ----------
        result : Result
            Of several designs, as many rows of each, one design after the other.

        Raises
        ------
        UnknownColumnError
            If the result has no such column.
        """
        return self.judged(result, designs)[0]

    def judged(self, result: Result, designs: int = 1) -> tuple[Floats, Floats | None]:
        """As `worst`, and the rows themselves, signed, that it is the worst of.

        Returns
        -------
        worst : ndarray, shape (designs,)
        rows : ndarray, shape (designs, rows), or None
            The rows that count; None where these are not as many in each design.
        """
        chosen = choose(result, self.column, dict(self.where))
        shape = designs, len(chosen.values) // designs
        values, counts = chosen.values.reshape(shape), chosen.counts.reshape(shape)
        found = worst(np.abs(values) if self.absolute else values, counts, largest=self.smallest)
        alike = designs > 0 and np.ptp(counts.sum(axis=1)) == 0
        return found, values[counts].reshape(designs, -1) if alike else None

    def residuals(self, result: Result, designs: int = 1) -> Floats | None:
        """Errors whose squares have this goal's square as their sum, shape (designs, rows); None where it has none.

        Parameters
        ----------
        result : Result
            With the tables of targets and of the motion.
        """
        chosen = choose(result, self.column, dict(self.where))
        outputs = (
            {str(name) for name in chosen.table["output"][chosen.counts]} if chosen.table.name == "targets" else ()
        )
        if chosen.column != "rms" or len(outputs) != 1 or "motion" not in result.tables:
            return None
        (output,), motion = outputs, result.tables["motion"]
        parts = [f"{output}_error"] if f"{output}.x_error" not in motion else [f"{output}.{k}_error" for k in "xy"]
        errors = np.stack([motion[name].reshape(designs, -1) for name in parts], axis=1)
        known = np.isfinite(errors)
        number = np.maximum(known[:, 0].sum(axis=1), 1)
        found = np.where(known, errors, 0.0) / np.sqrt(number)[:, None, None]
        return np.asarray(found.reshape(designs, -1))


def goal(name: str, *, smallest: bool = False, where: Mapping[str, object] | None = None) -> Goal:
    """Read a result's name, such as ``GII``, ``stiffness.k_min``, ``kinematics.extremes.C.x.range``.

    Of an error the absolute value counts.
    """
    command, column = _parts(name)
    rows = tuple((where or {}).items())
    told = f"{name} ({', '.join(f'{key} {value}' for key, value in rows)})" if rows else name
    return Goal(told, command, column, smallest, column.endswith("_error"), rows)


def goals_of(section: OptimizeSection) -> tuple[Goal, ...]:
    """What a section maximises, then what it minimises."""
    return (
        *(goal(each.result, where=each.where) for each in section.maximize),
        *(goal(each.result, smallest=True, where=each.where) for each in section.minimize),
    )


def bounds_of(condition: Condition) -> Iterator[tuple[Goal, float, bool]]:
    """The worst rows that a condition judges, with the bound and whether it is an upper one."""
    command, column = _parts(condition.result)
    for bound, upper in ((condition.at_least, False), (condition.at_most, True)):
        if bound is not None:
            name = f"{condition.name} {'at most' if upper else 'at least'} {bound:g}"
            yield Goal(name, command, column, upper, condition.abs, tuple(condition.where.items())), bound, upper


def _parts(name: str) -> tuple[str, str]:
    command, _, column = name.partition(".")
    return (command, column) if command in COMMANDS else ("workspace", name)
