"""The workspace of a point over a range of a held coordinate: where some value of it, or every one, is reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.workspace.bounding import bounding_box
from mechdesign.analyses.workspace.curves import Patch, patches
from mechdesign.analyses.workspace.field import Field, Places
from mechdesign.analyses.workspace.loci import causes
from mechdesign.analyses.workspace.panels import Effort, find_panels
from mechdesign.analyses.workspace.quadrature import integrate
from mechdesign.analyses.workspace.rays import Designs
from mechdesign.analyses.workspace.region import Question, questions
from mechdesign.analyses.workspace.tables import held_columns, stacked
from mechdesign.errors import AssemblyError
from mechdesign.progress import Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.workspace_models import Over

Floats = NDArray[np.float64]
# Values of the range that are looked at everywhere; levels of the search about a peak, each in these parts of the last.
VALUES, LEVELS = 25, 12
PARTS = np.linspace(0.0, 1.0, 9)[:, None]
# A peak may rise so many times as far above its sample as the samples beside it lie below.
ROOM = 1.5
EFFORT = Effort(48, 16)
# Rays of the table of the boundary, and the relative tolerance of the area.
RAYS, AREA = 181, 1e-3


@dataclass(frozen=True, eq=False)
class Ranged(Field):
    """A field whose one margin is the best (or, with `every`, the worst) over a range of a held coordinate.

    Parameters
    ----------
    which : int
        The held coordinate that ranges, from `low` to `high` (radians or length).
    every : bool
        Whether every value is to be reached, not only one.
    """

    which: int = 0
    low: float = 0.0
    high: float = 0.0
    every: bool = False

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """The one margin; what ends the region differs from place to place, see `best`."""
        return (("limit", "range"),)

    @property
    def singular(self) -> NDArray[np.bool_]:
        """No square roots are looked for."""
        return np.zeros(1, dtype=bool)

    def margins(self, z: NDArray[np.complex128], places: Places, *, assembly: bool = True) -> Floats:
        """The margin at points `z`, shape (1, *z.shape)."""
        flat = z.ravel()
        sizes = {name: np.broadcast_to(value, z.shape).ravel() for name, value in places.items()}
        return self.best(flat, sizes)[1].reshape(1, *z.shape)

    def best(self, z: NDArray[np.complex128], places: Places) -> tuple[Floats, Floats]:
        """The value of the range that decides at points `z`, shape (n,), and the margin there."""
        sign, n = -1.0 if self.every else 1.0, len(z)
        values = np.linspace(self.low, self.high, VALUES)

        def height(value: Floats, lane: NDArray[np.intp]) -> Floats:
            """At values (rows, lanes), all at once."""
            every = np.broadcast_to(lane, value.shape).ravel()
            found = self._smallest(value.ravel(), z[every], {name: v[every] for name, v in places.items()})
            return np.asarray(sign * found.reshape(value.shape))

        lane = np.arange(n)
        table = height(np.broadcast_to(values[:, None], (VALUES, n)), lane)
        place, found = values[np.argmax(table, axis=0)], table.max(axis=0)
        beside = np.pad(table, ((1, 1), (0, 0)), constant_values=-np.inf)
        with np.errstate(invalid="ignore"):
            rise = table - np.minimum(*(np.where(np.isfinite(v), v, table) for v in (beside[:-2], beside[2:])))
            # A peak is climbed where its slopes may lead above zero, and where the sample is not already far above.
            peak = (table >= beside[:-2]) & (table >= beside[2:]) & (table + ROOM * rise > 0)
            peak &= (found <= ROOM * rise) & np.isfinite(table)
        row, at = np.nonzero(peak)
        step = values[1] - values[0]
        a, b = np.maximum(values[row] - step, self.low), np.minimum(values[row] + step, self.high)
        for _ in range(LEVELS):
            if not len(at):
                break
            trial = a + (b - a) * PARTS
            tops = height(trial, at)
            best, k = np.argmax(tops, axis=0), np.arange(len(at))
            top = tops[best, k]
            np.maximum.at(found, at, top)
            first = top == found[at]
            place[at[first]] = trial[best[first], k[first]]
            a, b = trial[np.maximum(best - 1, 0), k], trial[np.minimum(best + 1, len(PARTS) - 1), k]
        return place, sign * found

    def _smallest(self, value: Floats, z: NDArray[np.complex128], places: Places) -> Floats:
        """The smallest of all margins with the coordinate at `value`; far below zero where one is unknown."""
        return np.asarray(self.each(value, z, places).min(axis=0))

    def each(self, value: Floats, z: NDArray[np.complex128], places: Places) -> Floats:
        """All margins with the coordinate at `value`, shape (margins, n)."""
        held: list[float | Floats] = list(self.held)
        held[self.which] = value
        field = Field(self.mechanism, self.plan, tuple(held), self.same_assembly, self.length)  # type: ignore[arg-type]
        found = field.margins(z, places)
        return np.asarray(np.where(np.isnan(found), -np.inf, found))


def reachable(study: Study, progress: Progress) -> Result:
    """Region of a point over a range of a held coordinate: area, the rectangle around it, and its boundary.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed.
    AssemblyError
        If nothing can be reached, or the region has no end.
    """
    section = study.workspace
    assert section is not None
    name, over = next((name, value) for name, value in section.at.items() if isinstance(value, Over))
    asked = list(_questions(study, name, over))
    progress.start(len(asked), "regions")
    rows: list[tuple[Question, float, float, float]] = []
    outlines: list[list[Column]] = []
    for question in asked:
        designs = Designs(question.field, {}, 1, question.about)
        panels = find_panels(designs, question.scan, EFFORT)
        area = error = box = 0.0
        if panels.closes[0]:
            integral = integrate(designs, panels, AREA, EFFORT.samples, question.scan, (), np.zeros((0, 1), dtype=bool))
            area, error = float(integral.area[0]), float(integral.area_error[0])
            box = float(bounding_box(designs, panels, integral.boundary, EFFORT.samples)[0])
            found = list(patches(designs, panels, question.rays or RAYS, EFFORT.samples))
            outlines.append(_outline(study, question, name, found))
        rows.append((question, area, error, box))
        progress.update(1)
    if not outlines:
        raise AssemblyError(f"point {section.point} reaches nothing over the range of {name}")
    square = study.units.label("area")
    with np.errstate(invalid="ignore"):
        use = np.array([area / box if box else np.nan for _, area, _, box in rows])
    indices = (
        *stacked([held_columns(study, question, 1) for question in asked]),
        Column("SUI", use, "", "area of the region over that of the rectangle around it"),
        Column("area", np.array([row[1] for row in rows]), square, "area of the region"),
        Column("box_area", np.array([row[3] for row in rows]), square, "area of the rectangle around the region"),
        Column("area_error", np.array([row[2] for row in rows]), square, "estimated error of area"),
    )
    tables = [
        Table("indices", indices, f"the region over the range of {name}"),
        Table("boundary", stacked(outlines), "boundary of the region, curve by curve"),
    ]
    empty = sum(row[1] == 0 for row in rows)
    return Result("workspace", {table.name: table for table in tables}, (), {"regions": len(asked), "empty": empty})


def _questions(study: Study, name: str, over: Over) -> Iterator[Question]:
    """One question a value of the other held coordinates."""
    assert study.workspace is not None
    # Only the area is asked, in which angles and lengths do not mix.
    update = {"at": {**study.workspace.at, name: (over.from_,)}, "indices": (),
              "characteristic_length": study.workspace.characteristic_length or 1.0}  # fmt: skip
    coordinate = study.mechanism.coordinate(name)
    low, high = (float(np.asarray(radians(study, coordinate, np.asarray(v)))) for v in (over.from_, over.to))
    for question in questions(replace(study, workspace=study.workspace.model_copy(update=update)), wanted=()):
        base = question.field
        field = Ranged(
            base.mechanism, base.plan, base.held, base.same_assembly, base.length,
            list(study.workspace.at).index(name), low, high, over.all,
        )  # fmt: skip
        yield replace(question, field=field, held={k: v for k, v in question.held.items() if k != name})


def _outline(study: Study, question: Question, name: str, found: Sequence[Patch]) -> list[Column]:
    """Points of the boundary, the value of the range at which each is reached, and what ends the region there."""
    field = question.field
    assert isinstance(field, Ranged)
    curves = [
        (question.about + radius * np.exp(1j * patch.theta), side)
        for side, names in (("inner", ("inner", "enters")), ("outer", ("outer", "leaves")))
        for patch in found
        for radius, margin in [(getattr(patch, names[0]), getattr(patch, names[1]))]
        if margin >= 0
    ]
    lengths = [len(z) for z, _ in curves]
    z = np.concatenate([z for z, _ in curves])
    value, _ = field.best(z, {})
    told = causes(Field(field.mechanism, field.plan, field.held, field.same_assembly, field.length))
    which = np.argmin(field.each(value, z, {}), axis=0)
    kinds = np.array(["limit" if kind == "limit" else "singularity" for kind, _ in told])
    length, coordinate = study.units.label("length"), study.mechanism.coordinate(name)
    shown = np.asarray(in_study_units(study, coordinate, value))
    return [
        *held_columns(study, question, len(z)),
        Column("x", z.real, length, "place of the point"),
        Column("y", z.imag, length, "place of the point"),
        Column("kind", kinds[which], "", "what ends the region: limit or singularity"),
        Column(name, shown, study.units.label(coordinate.quantity), "value of the range that decides there"),
        Column("at", np.array([cause for _, cause in told])[which], "", "which limit or singularity"),
        Column("side", np.repeat([side for _, side in curves], lengths), "", "which end of the ray's interval"),
        Column("curve", np.repeat(np.arange(len(curves)), lengths), "", "smooth piece of the boundary"),
    ]
