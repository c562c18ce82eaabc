"""Where can it work? The reachable region of a point, its performance indices and its boundary."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.curves import Patch, patches
from mechdesign.analyses.indices import INDICES, prepare
from mechdesign.analyses.indices.index import determinant_power, power_of_length
from mechdesign.analyses.poses import in_study_units
from mechdesign.analyses.rays import Designs, Floats
from mechdesign.analyses.region import CLOSE, COLUMNS, RAYS, Answer, Question, answer, questions, split
from mechdesign.errors import AssemblyError
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study


def workspace(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Reachable region of a point: indices (GII, GRI, SUI), local indices on a grid, and the boundary.

    Parameters
    ----------
    study : Study
        With a workspace section.
    seed, jobs
        Not used: nothing is random, and one region takes a moment.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed.
    AssemblyError
        If no point of the scan can be reached, or the region has no end.
    """
    asked = questions(study)
    progress.start(len(asked), "regions")
    answers: list[Answer] = []
    local: list[list[Column]] = []
    boundary: list[list[Column]] = []
    warnings: list[str] = []
    for question in asked:
        given = answer(question, {}, 1, CLOSE)
        answers.append(given)
        warnings += _doubts(question, given)
        if given.panels.closes[0]:
            designs = Designs(question.field, {}, 1, question.about)
            found = list(patches(designs, given.panels, question.rays or RAYS, CLOSE.samples))
            local.append(_local(study, question, found))
            boundary.append(_boundary(study, question, found))
        progress.update(1)
    if not local:
        raise AssemblyError(_unreachable(study, asked[0]))
    tables = [
        Table("indices", tuple(_indices(study, asked, answers)), "performance indices over the region"),
        Table("local", _stack(local), "local indices on a grid that follows the boundary"),
        Table("boundary", _stack(boundary), "boundary of the region, curve by curve"),
    ]
    empty = sum(not given.panels.closes[0] for given in answers)
    return Result("workspace", {table.name: table for table in tables}, tuple(warnings),
                  {"regions": len(asked), "empty": empty})  # fmt: skip


def _unreachable(study: Study, question: Question) -> str:
    assert study.workspace is not None
    return (
        f"point {study.workspace.point} reaches nothing on the scan about ({question.about.real:g}, "
        f"{question.about.imag:g}): its links cannot close there in the sketch's assembly, or a limit forbids it"
    )


def _doubts(question: Question, given: Answer) -> Iterator[str]:
    where = ", ".join(f"{name} = {value:g}" for name, value in question.held.items())
    where = f" at {where}" if where else ""
    if not given.panels.closes[0]:
        yield f"nothing is reachable{where}"
        return
    for name in ("GII", "GRI"):
        error, value = given.errors[name][0], given.values[name][0]
        if question.rule == "gauss" and not error <= 2 * question.tolerance * abs(value):
            yield f"{name}{where} is only known to {error:.1g}, not to the tolerance asked for"


def _indices(study: Study, asked: Sequence[Question], answers: Sequence[Answer]) -> Iterator[Column]:
    for name in asked[0].held:
        label = study.units.label(study.mechanism.quantity(name))
        yield Column(name, np.array([question.held[name] for question in asked]), label, "held coordinate")
    meanings = index_meanings(study, asked[0])

    def column(name: str) -> Column:
        return Column(name, np.concatenate([given.values[name] for given in answers]), *meanings[name])

    def error(name: str) -> Column:
        values = np.concatenate([given.errors[name] for given in answers])
        return Column(f"{name}_error", values, meanings[name][0], f"estimated error of {name}")

    estimated = asked[0].rule == "gauss"
    statistics = [name for name in asked[0].wanted if name not in COLUMNS]
    yield from (column(name) for name in COLUMNS)
    yield from (error(name) for name in COLUMNS[:4] if estimated)
    yield from (column(name) for name in statistics)
    yield from (error(name) for name in statistics if estimated or not name.endswith(("_mean", "_std")))


def index_meanings(study: Study, question: Question) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each column of the answer."""
    area = study.units.label("area")
    found = {
        "GII": ("", "mean of the inverse condition number over the region"),
        "GRI": (INDICES["resistivity"].unit(study, question.field), "mean of 1/abs(det J) over the region"),
        "SUI": ("", "area of the region over that of the rectangle around it"),
        "area": (area, "area of the region"),
        "box_area": (area, "area of the rectangle around the region"),
    }
    for name in (name for name in question.wanted if name not in COLUMNS):
        index, kind = INDICES[split(name)[0]], split(name)[1]
        found[name] = (index.unit(study, question.field), f"{_STATISTICS[kind]} over the region: {index.meaning}")
    return found


_STATISTICS = {"mean": "mean", "min": "infimum", "max": "supremum", "std": "standard deviation"}


def _stack(parts: Sequence[Sequence[Column]]) -> tuple[Column, ...]:
    return tuple(
        Column(columns[0].name, np.concatenate([column.values for column in columns]), columns[0].unit,
               columns[0].meaning)
        for columns in zip(*parts, strict=True)
    )  # fmt: skip


def _held(study: Study, question: Question, rows: int) -> list[Column]:
    return [
        Column(name, np.full(rows, value), study.units.label(study.mechanism.quantity(name)), "held coordinate")
        for name, value in question.held.items()
    ]


def _local(study: Study, question: Question, found: Sequence[Patch]) -> list[Column]:
    grids = [patch.grid(question.about) for patch in found]
    z = np.concatenate([grid.ravel() for grid in grids])
    local = question.field.local(z, {})
    names = dict.fromkeys(("inverse_condition", "resistivity", *(index.name for index in question.indices)))
    node = np.concatenate([np.tile(np.arange(grid.shape[1]), len(grid)) for grid in grids])
    ray = np.concatenate([np.repeat(np.arange(len(grid)), grid.shape[1]) for grid in grids])
    patch = np.repeat(np.arange(len(grids)), [grid.size for grid in grids])
    length, determinant = study.units.label("length"), power_of_length(study, determinant_power(question.field))
    with np.errstate(divide="ignore", invalid="ignore"):
        columns = [
            Column(index.name, np.broadcast_to(index.values(local), z.shape), index.index.unit(study, question.field),
                   index.index.meaning)
            for index in prepare(study, list(names))
        ]  # fmt: skip
    return [
        *_held(study, question, len(z)),
        Column("x", z.real, length, "place of the point"),
        Column("y", z.imag, length, "place of the point"),
        *columns[:2],
        Column(
            "det_J", np.broadcast_to(local.determinant, z.shape), determinant, "determinant of the Jacobian, per radian"
        ),
        *columns[2:],
        Column("patch", patch, "", "part of the region between two boundary curves"),
        Column("ray", ray, "", "ray of the patch's grid"),
        Column("node", node, "", "node along the ray, from the inner to the outer boundary"),
    ]


def _boundary(study: Study, question: Question, found: Sequence[Patch]) -> list[Column]:
    field = question.field
    curves = [
        (patch.theta, radius, margin, side)
        for side, names in (("inner", ("inner", "enters")), ("outer", ("outer", "leaves")))
        for patch in found
        for radius, margin in [(getattr(patch, names[0]), getattr(patch, names[1]))]
        if margin >= 0
    ]
    theta = np.concatenate([curve[0] for curve in curves])
    radius = np.concatenate([curve[1] for curve in curves])
    lengths = [len(curve[0]) for curve in curves]
    labels = [field.labels[curve[2]] for curve in curves]
    z = np.asarray(question.about + radius * np.exp(1j * theta))
    inside = np.concatenate([np.full(n, 1.0 if curve[3] == "inner" else -1.0)
                             for n, curve in zip(lengths, curves, strict=True)])  # fmt: skip
    within = np.asarray(question.about + radius * (1 + 1e-12 * inside) * np.exp(1j * theta))
    drives = _drives(question, z, within, np.flatnonzero(np.diff(inside)) + 1)
    length, angle = study.units.label("length"), study.units.label("angle")
    columns = [
        *_held(study, question, len(z)),
        Column("x", z.real, length, "place of the point"),
        Column("y", z.imag, length, "place of the point"),
        Column(
            "kind", np.repeat([kind for kind, _ in labels], lengths), "", "what ends the region: limit or singularity"
        ),
    ]
    for drive, value in zip(field.mechanism.forward.structure.given, drives, strict=True):
        shown = np.asarray(in_study_units(study, drive, value))
        columns.append(Column(drive.name, shown, study.units.label(drive.quantity), "drive's value there"))
    return [
        *columns,
        Column("at", np.repeat([name for _, name in labels], lengths), "", "which limit or singularity"),
        Column("theta", theta / study.units.angle_factor, angle, "angle of the ray about the centre of the scan"),
        Column("side", np.repeat([curve[3] for curve in curves], lengths), "", "which end of the ray's interval"),
        Column("curve", np.repeat(np.arange(len(curves)), lengths), "", "smooth piece of the boundary"),
    ]  # fmt: skip


def _drives(
    question: Question, z: NDArray[np.complex128], within: NDArray[np.complex128], sides: NDArray[np.intp]
) -> list[Floats]:
    """Drives on the boundary, or just inside where rounding opens the mechanism; angles continuous along each side.

    Of the turns of an angle that is shown which is nearest to the sketch.
    """
    exact, near = question.field.configuration(z, {}), question.field.configuration(within, {})
    found = []
    for drive in question.field.mechanism.forward.structure.given:
        here, beside = (np.broadcast_to(c.value(drive), z.shape) for c in (exact, near))
        values = np.where(np.isfinite(here), here, beside)
        if drive.quantity == "angle":
            drawn = float(question.field.mechanism.sketch_configuration.value(drive))
            parts = [np.unwrap(part) for part in np.split(values, sides)]
            turns = [2 * np.pi * np.round((np.mean(part) - drawn) / (2 * np.pi)) for part in parts]
            values = np.concatenate([part - turn for part, turn in zip(parts, turns, strict=True)])
        found.append(values)
    return found
