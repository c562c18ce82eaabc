"""The designs of a Pareto front moving in a page: a click on the picture of the front shows the linkage of a design."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element, tostring

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.door.report.page.linkage import Canvas, Sketcher, add
from mechdesign.door.report.page.tracks import TIMES, Cell, MovingPicture, ShownNumbers, deltas, gaps, places
from mechdesign.door.report.page.vector import described, inline
from mechdesign.door.report.tables import json_text
from mechdesign.drawing.layout import draw
from mechdesign.drawing.sweep import Sweep
from mechdesign.family.stacked import grouped
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.numerics.arrays import Complexes, Ints, evenly
from mechdesign.ground.results import Table
from mechdesign.motion.corners import curve_of
from mechdesign.motion.finer import near_chords, ways_of
from mechdesign.motion.rows import Poses
from mechdesign.questions.kinematics.figures.paths import path_looks
from mechdesign.questions.optimize import pareto
from mechdesign.questions.optimize.figures.front import front_picture, marked, pairs
from mechdesign.questions.optimize.judge import DesignSet
from mechdesign.questions.optimize.variables import parted
from mechdesign.study import Study
from mechdesign.study import designs as study_designs

# Designs whose poses are solved, and bytes of the drawings and poses that a page has of them.
MOST_DESIGNS = 60
BUDGET = 160_000
MAX_POSES = 73  # of a design
_NAMED_POSES = 4  # in which names keep off the links
_CLOUD = 200  # more dots than this are drawn as an image

Entry = tuple[str, list[Cell | None]]


def front(drawn: DesignSet, table: Table, name: str) -> MovingPicture | None:
    """The designs of a front, each of which moves when it is chosen; use inside `style.context`.

    None where the study has no motion in which they can be drawn.

    Parameters
    ----------
    table : Table
        The front.
    name : str
        Begins the ids inside its picture.
    """
    if drawn.study.kinematics is not None and drawn.study.kinematics.at_nodes:
        return None
    marks = {row: mark for mark, row in marked(drawn, table)}
    order = _spread(drawn, table, [*marks])[:MOST_DESIGNS]
    sweeps = {row: sweep for row, sweep in _sweeps(drawn, table, order) if len(sweep.valid) > 1}
    if not sweeps:
        return None
    sheet = Canvas.around(np.concatenate([sweep.extent for sweep in sweeps.values()]))
    fits = fitting([(row, sheet, sweeps[row]) for row in order.tolist() if row in sweeps])
    # Along the first goal, as the front runs.
    rows = np.array(sorted(fits, key=lambda row: (table[drawn.goals[0].name][row], row)))
    choices = [fits[row] | _named(drawn, table, row, marks.get(row, "")) for row in rows.tolist()]
    knee = next((k for k, choice in enumerate(choices) if choice["mark"] == "knee"), 0)
    names = dict.fromkeys([*drawn.variables, *(goal.name for goal in drawn.goals)])
    columns = [table.column(name) for name in names if table.column(name).numeric]
    numbers, entries, fields = numbers_of(columns, rows, knee, drawn.study.size)
    figure = draw(front_picture(drawn, table))
    for line in figure.findobj(Line2D):
        assert isinstance(line, Line2D)
        line.set_rasterized(len(np.asarray(line.get_xdata())) > _CLOUD and line.get_linestyle() == "None")
    beside = inline(figure, name, described(figure))
    count = f"{len(rows)} of the {len(table)}" if len(rows) < len(table) else f"All {len(table)}"
    pace = f"{count} designs of the front are in this page: a click there shows the nearest, an arrow key the next."
    data = {"poses": len(rows), "first": knee, "choices": choices, "given": fields, "keys": [fields],
            "numbers": numbers.tracks, "front": points(figure, [
                np.asarray(table[drawn.goals[a].name], dtype=float)[rows]
                + 1j * np.asarray(table[drawn.goals[b].name], dtype=float)[rows] for a, b in pairs(drawn)
            ]), "pace": pace}  # fmt: skip
    drawing = _drawing(sheet, sweeps[int(rows[knee])])
    return MovingPicture(drawing, beside, data, choices[knee]["title"], ["value"], entries, {}, ["pareto"])


def fitting(sweeps: Sequence[tuple[int, Canvas, Sweep]]) -> dict[int, dict[str, Any]]:
    """The first designs, by their rows, as the script draws them: as many as fit into the budget, and always one."""
    choices: dict[int, dict[str, Any]] = {}
    size, alike = 0, None
    for row, sheet, sweep in sweeps:
        choice, alike = _choice(sheet, sweep, alike)
        size += len(json_text(choice))
        if choices and size > BUDGET:
            break
        choices[row] = choice
    return choices


def _named(drawn: DesignSet, table: Table, row: int, mark: str) -> dict[str, Any]:
    """What a design of a front is called, with those of its variables that are words."""
    words = [f"{name} = {table[name][row]}" for name in drawn.variables if not table.column(name).numeric]
    title = ", ".join([f"design {row + 1} of {len(table)} on the front", *([mark] if mark else []), *words])
    return {"title": title, "number": row + 1, "mark": mark}


def _drawing(sheet: Canvas, sweep: Sweep) -> str:
    """The drawing in which the script changes the design; the names of the points stay."""
    root = sheet.root("the mechanism of a design of the front")
    chosen(add(root, "g", **{"class": "moving-design"}), sheet, sweep)
    few = sweep.valid[evenly(len(sweep.valid), _NAMED_POSES)].tolist()
    scenes = sweep.scene.some(few)
    sketcher = Sketcher(root, sheet, scenes[0])
    sketcher.names(scenes, links=False)
    sketcher.ruler(sweep.study.units.label("length"))
    return tostring(root, encoding="unicode")


def _spread(drawn: DesignSet, table: Table, first: Sequence[int]) -> Ints:
    """Rows of a front: `first` these, then always the one that is farthest in the goals from those before."""
    values = np.stack([np.asarray(table[goal.name], dtype=float) for goal in drawn.goals], axis=1)
    share = pareto.normalised(values)
    rows, far = [*first], np.full(len(share), np.inf)
    for k in range(min(len(share), MOST_DESIGNS)):
        if k == len(rows):
            rows.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(share - share[rows[k]], axis=1))
    return np.array(rows)


def _sweeps(drawn: DesignSet, table: Table, rows: Ints) -> Iterator[tuple[int, Sweep]]:
    """Designs of a front in their motions, those of one mechanism solved in one batch; not those that have none."""
    numeric = drawn.study.parameters.names()
    numbers = {name: np.asarray(table[name], dtype=float) for name in drawn.variables if name in numeric}
    words = {name: table[name] for name in drawn.variables if name not in numeric}
    kinds: dict[tuple[Any, ...], list[int]] = {}
    for row in rows.tolist():
        kinds.setdefault(tuple(column[row].item() for column in words.values()), []).append(row)
    for kind, members in kinds.items():
        # A study without a motion has none to show, and neither has a design that makes no study.
        with suppress(MechdesignError):
            study, _ = parted(drawn.study, dict(zip(words, kind, strict=True)))
            own = np.array(members)
            designs = study_designs.Designs(study, {name: values[own] for name, values in numbers.items()})
            for some, made, poses in grouped(designs, "kinematics", np.arange(len(own)), _left_out):
                yield from zip(own[some].tolist(), moved(made, poses), strict=False)


def _left_out(rows: Ints, error: MechdesignError) -> None:
    """A design whose numbers make no study is not drawn."""


def moved(study: Study, poses: Poses) -> list[Sweep]:
    """Designs of one mechanism in their poses; along a motion these are near enough to draw its paths."""
    if not poses.followed:
        return []
    curve = curve_of(study.motion(poses))
    places = evenly(poses.line, MAX_POSES).astype(float)
    if not curve.spent.any():
        places, _ = near_chords(curve, ways_of(curve, study.mechanism.points), places, MAX_POSES)
    elif poses.closed:
        places = np.append(places, poses.end)
    configuration = curve.solve(*curve.grid(places), turning=False).configuration
    sweeps = []
    for k in range(curve.lines):
        own = configuration.take(np.arange(k * len(places), (k + 1) * len(places)))
        there = poses.along(np.full(len(places), k), places)
        sweeps.append(Sweep(study, there, np.arange(len(places)), own))
    return sweeps


def _choice(sheet: Canvas, sweep: Sweep, alike: ShownNumbers | None) -> tuple[dict[str, Any], ShownNumbers]:
    """A design as the script draws it, and the numbers that say its poses; those of all have as many decimals."""
    layer = Element("g")
    chosen(layer, sheet, sweep)
    study, poses = sweep.study, sweep.poses
    columns = [Column(name, np.asarray(values), study.units.label(study.mechanism.quantity(name)))
               for name, values in poses.values.items()]  # fmt: skip
    numbers = ShownNumbers(Table("poses", tuple(columns)), sweep.rows, int(sweep.valid[0]), study.size, alike)
    fields = [[column.name, numbers.cell(column).unit, numbers.add(column)] for column in columns]
    share = (poses.numbers - poses.numbers[0]) / (poses.numbers[-1] - poses.numbers[0])
    return {
        "drawing": "".join(tostring(part, encoding="unicode") for part in layer), "poses": len(sweep.rows),
        "first": int(sweep.valid[0]), "returns": sweep.returns, "gaps": gaps(sweep.configuration), "given": fields,
        "numbers": numbers.tracks, "times": deltas(share, TIMES),
    } | places(sheet, sweep.configuration, sweep.mechanism.description.links), numbers  # fmt: skip


def chosen(layer: Element, sheet: Canvas, sweep: Sweep) -> None:
    """A design in its first valid pose, and the paths of its points."""
    scene = sweep.first
    assert scene is not None
    Sketcher(layer, sheet, scene).draw(path_looks(sweep))


def numbers_of(
    columns: Iterable[Column], rows: Ints, begin: int, size: tuple[float, str]
) -> tuple[ShownNumbers, list[Entry], list[list[Any]]]:
    """Numbers of the designs of a page by some columns: their tracks, a row each, and how the script names them."""
    whole = tuple(replace(column, values=np.asarray(column.values, dtype=float)) for column in columns)
    numbers = ShownNumbers(Table("designs", whole), rows, begin, size)
    entries: list[Entry] = [(column.name, [numbers.cell(column)]) for column in whole]
    fields = [[name, numbers.units[name], which, power] for name, (which, _, power) in numbers.scaled.items()]
    return numbers, entries, fields


def points(figure: Figure, panels: Sequence[Complexes]) -> list[list[list[float]]]:
    """Where designs, x + i y, stand in each panel of a picture, x and y, in points from its upper left."""
    wide, tall = (72 * inches for inches in figure.get_size_inches())
    placed = []
    for axes, at in zip(figure.axes, panels, strict=True):
        share = axes.transData.transform(np.stack([at.real, at.imag], axis=1)) / figure.bbox.size
        placed.append([np.round(wide * share[:, 0], 1).tolist(), np.round(tall * (1 - share[:, 1]), 1).tolist()])
    return placed
