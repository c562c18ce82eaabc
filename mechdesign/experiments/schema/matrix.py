"""The matrix of a study: entries that vary, and the cases of them that are answered."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, NamedTuple, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from mechdesign.ground.errors import StudyError, printable
from mechdesign.ground.expressions import Expression
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.conditions import WORDS as WORDS
from mechdesign.study.schema.conditions import Chosen, check_result, read_result
from mechdesign.study.schema.variable import LIST_FORM, plainly, read_values
from mechdesign.study.text import fields
from mechdesign.study.text.csv_files import read_cells
from mechdesign.study.text.document import KeyPath, read
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.reading import Context, failure, read_number, shown

# The column of a file of cases that names them.
LABEL = "label"
# Most cases of one study.
MAX_CASES = 10_000_000
GRID = "grid"
METHODS = {
    GRID: "every combination of the values",
    "latin_hypercube": "random; of as many equal parts of each range as there are samples, one sample lies in each",
    "sobol": "a scrambled Sobol' sequence, random and evenly spread; a power of two is most even",
}
# A range as written on the command line, and the keys of its parts.
RANGE = re.compile(r"[^:,\[\]{}]+(?::[^:,\[\]{}]+){1,2}")
_PARTS = ("from", "to", "step")
# A plain number. Most cells of a file of cases are such numbers, and reading each as YAML would be slow.
_DECIMAL = re.compile(r"-?(?:0|[1-9][0-9]{0,14})(\.[0-9]+)?")


def _listed(raw: Any, context: Context) -> tuple[Any, ...]:
    if not isinstance(raw, list) or not raw:
        raise failure(f"expected START:STOP:STEP, LOW:HIGH or a list of values, not {shown(raw)}")
    return read_values(raw, context)


class Values(fields.Model):
    """Values of an entry: a range, also written ``30:50:5`` (from, to, step) or ``30:50``, or a list."""

    bare = "values"
    short = ({"type": "string", "title": "START:STOP:STEP or LOW:HIGH"}, LIST_FORM)
    one_of = ("say the values as START:STOP:STEP, LOW:HIGH or a list", "from_", "values")
    from_: fields.Number | None = Field(None, alias="from")
    """Lowest value, in the study's units. Example: 30"""
    to: fields.Number | None = None
    """Highest value; of a grid it is taken where a step leads to it. Example: 50"""
    step: fields.PositiveNumber | None = None
    """Step of a grid, which needs this or ``number``. Example: 5"""
    number: Annotated[int, fields.whole(1, MAX_CASES)] | None = None
    """How many values of a grid, both ends included. Example: 11"""
    values: Annotated[tuple[Any, ...], fields.Read(_listed, LIST_FORM)] | None = None
    """Values one by one, also words: the list alone says the same. Example: [analytic, monte_carlo]"""

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, str) and RANGE.fullmatch(raw):
            return dict(zip(_PARTS, (part.strip() for part in raw.split(":")), strict=False))
        return raw if isinstance(raw, dict | Values) else {"values": raw}

    def faults(self) -> Iterator[str]:
        beside = self.given("to", "step", "number")
        if self.values is not None and beside:
            yield f"a list of values has no {beside[0]!r}"
        if self.from_ is not None and self.to is None:
            yield "a range needs 'to'"
        if self.from_ is not None and self.to is not None and not self.to > self.from_:
            yield f"a range goes upwards; {self.to:g} is not above {self.from_:g}"
        if self.step is not None and self.number is not None:
            yield "either 'step' or 'number', not both"

    @property
    def spaced(self) -> bool:
        """Whether the values on a grid are determined."""
        return self.values is not None or self.step is not None or self.number is not None

    @property
    def count(self) -> int:
        """Number of the values on a grid."""
        if self.values is not None:
            return len(self.values)
        if self.number is not None:
            return self.number
        assert self.step is not None
        low, high = self._ends
        return int(min((high - low) / self.step + 1e-9, 1e15)) + 1

    @property
    def _ends(self) -> tuple[float, float]:
        """Ends of the range."""
        assert self.from_ is not None
        assert self.to is not None
        return self.from_, self.to

    def on_grid(self) -> tuple[Any, ...]:
        """The values on a grid, both ends of a range included: ``from + k step <= to + 1e-9 step``."""
        if self.values is not None:
            return self.values
        low, high = self._ends
        step = self.step if self.step is not None else (high - low) / max(self.count - 1, 1)
        return tuple(plainly(low + k * step) for k in range(self.count))

    def at(self, share: float) -> Any:
        """The value at a share of the range, from 0 to 1, or the entry of the list there."""
        if self.values is not None:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        low, high = self._ends
        return plainly(low + share * (high - low))


def _named(raw: Any, context: Context) -> str:
    result = read_result(raw, context)
    if isinstance(result, Expression):
        raise failure(f"{shown(raw)} is of parameters alone; name the result of a command, as in kinematics.mu.min")
    return result


class Named(Chosen):
    """A result of every case, and the rows of it that count."""

    result: Annotated[str, fields.Read(_named, {**fields.NAME_FORM, "title": "result"})]
    """COMMAND.COLUMN, COMMAND.TABLE.COLUMN or a number of the workspace (GII); of several rows one of |WORDS|, along a
    motion also between the rows; or a sum of such numbers of one unit. Example: kinematics.mu.min Example:
    kinematics.extremes.C.x.range
    """


def _each_once(results: tuple[Named, ...]) -> tuple[Named, ...]:
    for k, named in enumerate(results):
        if named in results[:k]:
            raise failure(f"{shown(named.name)} is listed twice")
    return results


Results = Annotated[
    tuple[Named, ...], fields.BeforeValidator(fields.as_list), AfterValidator(_each_once), fields.OrShort()
]


class Best(fields.Model):
    """What is best of the cases: the table has each case's rank, and marks the Pareto front of these results."""

    maximize: Results = ()
    """Results that are to be large, listed for every case as those of ``results`` are; one alone needs no list.
    Example: kinematics.mu.min
    """
    minimize: Results = ()
    """Results that are to be small, likewise. Example: [kinematics.rod.angle.peak, kinematics.C.x_velocity.peak]"""
    sort: bool = False
    """Whether the best case is the first row of the table; those without a rank come last, in their order."""

    def faults(self) -> Iterator[str]:
        if not self.maximize and not self.minimize:
            yield "say what to 'maximize' or 'minimize'"
        for named in self.minimize:
            if named in self.maximize:
                yield f"{shown(named.name)} cannot be both large and small"


class CaseTable(NamedTuple):
    """A file of cases: the entries that vary, a row of values for each case, and the labels, if it has any."""

    names: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]
    labels: tuple[str, ...] = ()


class MatrixSection(fields.Model):
    """Cases of the study, each answered whole: entries that vary, in a grid or at random, or a file of cases."""

    one_of = ("a matrix says what to 'vary', or names a file of 'cases'", "vary", "cases")
    vary: dict[str, Values] | None = None
    """Entries of the study, by the names that ``--set`` takes, and their values. Example: {mechanism.parameters.r:
    30:50:5, reliability.method: [analytic, form]}
    """
    method: Annotated[str, fields.choice(METHODS, "design of experiments")] = GRID
    """Which combinations of the values are cases."""
    samples: Annotated[int, fields.whole(1, MAX_CASES)] | None = None
    """Number of cases of ``latin_hypercube`` and ``sobol``, which the seed chooses; at most |MAX_CASES|. Example: 64"""
    cases: str | None = None
    """CSV file, beside the study, whose first line names entries; each line below is a case, which a column ``label``
    names. Example: cases.csv
    """
    results: Results = ()
    """Results of every case that are listed besides the requirements. Example: [kinematics.mu.min, GII]"""
    best: Best | None = None
    """Rank the cases that meet every requirement by one of their results, or by the equally weighted sum of several,
    each normalised by its range over these cases. Example: {maximize: kinematics.mu.min, minimize: GII}
    """

    def faults(self) -> Iterator[str]:
        if self.vary is None:
            if beside := [key for key in ("method", "samples") if key in self.model_fields_set]:
                yield f"the cases of a file are as they are; {beside[0]!r} is of 'vary'"
            return
        if not self.vary:
            yield "'vary' names nothing; name entries and their values, {mechanism.parameters.r: 30:50:5}"
        for name, values in self.vary.items():
            if self.method == GRID and not values.spaced:
                yield f"a grid needs a step: {name}: START:STOP:STEP; or choose a 'method' and 'samples'"
            if self.method != GRID and values.given("step", "number"):
                yield f"{self.method} takes a range without a step: {name}: LOW:HIGH"
        if self.method == GRID and self.samples is not None:
            yield "the cases of a grid follow from its values; 'samples' is of latin_hypercube and sobol"
        if self.method != GRID and self.samples is None:
            yield f"{self.method} needs 'samples', the number of cases"
        if self.method == GRID and (count := math.prod(values.count for values in self.vary.values())) > MAX_CASES:
            yield f"a grid of {count:,} cases, and at most {MAX_CASES:,} are answered; take longer steps"

    def checked(self, checker: Checker) -> Self:
        """Check the commands that results name; `experiments` checks that they have such a result."""
        named: dict[KeyPath, Results] = {("matrix", "results"): self.results}
        if self.best is not None:
            named |= {("matrix", "best", key): getattr(self.best, key) for key in ("maximize", "minimize")}
        for place, results in named.items():
            for k, result in enumerate(results):
                check_result(checker, result.result, (*place, k))
        return self

    def table(self, folder: Folder) -> CaseTable:
        """Names of entries, values and labels of the cases, as their file has them.

        Raises
        ------
        StudyError
            Where the file cannot be read or is no table of values.
        """
        assert self.cases is not None
        (_, head), *lines = read_cells(folder, self.cases)
        names = [name for name in head if name != LABEL]
        if len(set(head)) < len(head) or not all(head) or not names:
            raise StudyError(f"{self.cases}: the first line does not name each entry that varies, or names one twice")
        if not lines:
            raise StudyError(f"{self.cases} has no cases below its first line")
        if len(lines) > MAX_CASES:
            raise StudyError(
                f"{self.cases} has {len(lines):,} cases, and at most {MAX_CASES:,} are answered; divide the file"
            )
        for number, row in lines:
            if len(row) != len(head):
                raise StudyError(f"{self.cases}:{number}: {len(row)} values for {len(head)} names")
        labels = tuple(printable(row[head.index(LABEL)]) for _, row in lines) if LABEL in head else ()
        return CaseTable(tuple(names), tuple(self._row(number, head, row) for number, row in lines), labels)

    def _row(self, number: int, head: Sequence[str], row: Sequence[str]) -> tuple[Any, ...]:
        values: list[Any] = []
        for name, cell in zip(head, row, strict=True):
            if name == LABEL:
                continue
            if decimal := _DECIMAL.fullmatch(cell):
                values.append(plainly(float(cell)) if decimal[1] else int(cell))
                continue
            try:
                value = read(cell.encode(), "").data
                values.append(plainly(read_number(value, Context())) if isinstance(value, float) else value)
            except (StudyError, PydanticCustomError):
                raise StudyError(f"{self.cases}:{number}: {name}: expected a value, not {shown(cell)}") from None
        return tuple(values)
