"""What the workspace section asks, made ready: the regions, the scan, the rule, the indices, the columns."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.ground.indices import INDEX_NAMES, REGIONAL, STATISTICS, USUAL, needed_section
from mechdesign.ground.numerics.arrays import Flags
from mechdesign.questions.workspace.index import Prepared, prepare
from mechdesign.questions.workspace.inscribed import INSCRIBED
from mechdesign.questions.workspace.strips import Integrand
from mechdesign.region.field import Places
from mechdesign.region.rays import Effort, Scanned
from mechdesign.region.regions import PlanarRegion, problem, regions
from mechdesign.study import Study
from mechdesign.study.text.fields import parts_of
from mechdesign.study.text.units import Amount

# Relative tolerance of the integrals where the study says none: of one region, and of each design of many.
TOLERANCE, GRID_TOLERANCE = 1e-5, 1e-4
COLUMNS = tuple(REGIONAL)
MEANS = {"GII": "inverse_condition", "GRI": "resistivity"}


@dataclass(frozen=True, eq=False)
class Question(PlanarRegion):
    """What the workspace section asks of a region.

    Parameters
    ----------
    counted : (float, float)
        Range of angle that the means are taken over (radians).
    indices : tuple of Prepared
        Local indices that the columns need.
    columns : tuple of str
        Columns of the answer.
    shown : tuple of Prepared
        Local indices of the table of nodes: those of `MEANS`, then the others.
    """

    counted: tuple[float, float]
    rule: str
    tolerance: float
    nodes: int | None
    indices: tuple[Prepared, ...]
    columns: tuple[str, ...]
    shown: tuple[Prepared, ...]

    def designs(self, places: Places, count: int, effort: Effort) -> Scanned:
        """`count` designs, whose changed places are arrays of shape (count,), and how rays meet their regions."""
        return Scanned(self.field, places, count, self.about, self.scan, effort)

    @cached_property
    def statistics(self) -> dict[str, tuple[str, str]]:
        """Local index and statistic of the columns that have them."""
        return {column: both for column in self.columns if any(both := split(column))}

    @property
    def where(self) -> str:
        """At which held values, for messages; nothing where none is held."""
        held = ", ".join(f"{name} = {value:g}" for name, value in self.held.items())
        return f" at {held}" if held else ""

    @property
    def integrands(self) -> list[Integrand]:
        """What the means and standard deviations need: the indices, and their squares."""
        statistics = self.statistics.values()
        return [
            Integrand(index, power)
            for power, kinds in ((1, ("mean", "std")), (2, ("std",)))
            for index in self.indices
            if any((index.name, kind) in statistics for kind in kinds)
        ]

    @property
    def extremes(self) -> Flags:
        """Whether the infimum, and the supremum of each index is needed, shape (2, indices)."""
        statistics = self.statistics.values()
        return np.array([[(index.name, kind) in statistics for index in self.indices] for kind in ("min", "max")])


def columns_of(indices: Iterable[str]) -> tuple[str, ...]:
    """Columns of a workspace with these local indices."""
    return (*COLUMNS, *(f"{name}_{kind}" for name in indices for kind in STATISTICS))


def split(column: str) -> tuple[str, str]:
    """Local index and statistic of a column, ``("", "")`` of the area and its like."""
    if column in MEANS:
        return MEANS[column], "mean"
    name, _, kind = column.rpartition("_")
    return (name, kind) if kind in STATISTICS and name in INDEX_NAMES else ("", "")


def shared(study: Study, questions: Sequence[Question], moved: Collection[str]) -> bool:
    """Whether designs that differ in these parameters share the questions, but for what their fields take as arrays."""
    field = questions[0].field
    of_field = ("workspace.characteristic_length", *(() if field.plan.iterative else ("workspace.at.",)))
    numbers = [part for key, part in parts_of(study.workspace, "workspace") if not key.startswith(of_field)]
    followed = {name for part in numbers if isinstance(part, Amount) and part.expression
                for name in part.expression.names}  # fmt: skip
    return followed.union(study.fixed).isdisjoint(moved)


def batched(column: str) -> bool:
    """Whether a column is evaluated for many designs at once: area, shapes, and what the Jacobian gives."""
    name = split(column)[0]
    return column in (*COLUMNS, *INSCRIBED) or bool(name and needed_section(name) is None)


def questions(study: Study, tolerance: float = TOLERANCE, columns: Sequence[str] | None = None) -> list[Question]:
    """One question a value of ``at``.

    Parameters
    ----------
    tolerance : float
        Of the integrals where the study says none.
    columns : sequence of str, optional
        Columns of the answer; left out, all of those indices that the study asks for.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed.
    """
    section = study.workspace
    if section is not None and columns is None:
        columns = columns_of(USUAL if section.indices is None else section.indices)
    all_regions = regions(study)
    assert section is not None
    assert columns is not None
    (start, stop), margin = all_regions[0].scan, section.margin * study.units.angle_factor
    if stop - start <= 2 * margin:
        raise problem(study, "margin", "the margin leaves nothing of the scan; give a smaller one")
    integrate_by = section.integrate
    if "tolerance" in integrate_by.model_fields_set:
        tolerance = integrate_by.tolerance
    names = [name for name in dict.fromkeys(split(column)[0] for column in columns) if name]
    ready = {index.name: index for index in prepare(study, list(dict.fromkeys([*MEANS.values(), *names])))}
    counted, indices = (start + margin, stop - margin), tuple(ready[name] for name in names)
    return [
        Question(**vars(region), counted=counted, rule=integrate_by.rule, tolerance=tolerance,
                 nodes=integrate_by.nodes, indices=indices, columns=tuple(columns), shown=tuple(ready.values()))
        for region in all_regions
    ]  # fmt: skip
