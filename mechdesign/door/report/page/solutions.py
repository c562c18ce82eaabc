"""The linkages of a synthesis moving side by side in a page; a click on one, or on what it trades, enlarges it."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, tostring

import numpy as np

from mechdesign.door.report.page.front import MOST_DESIGNS, chosen, fitting, moved, numbers_of, points
from mechdesign.door.report.page.linkage import Canvas, Sketcher, add
from mechdesign.door.report.page.tracks import MovingPicture, meanings
from mechdesign.door.report.page.vector import described, inline
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.pictures import View
from mechdesign.ground.numerics.arrays import Complexes, evenly
from mechdesign.ground.results import Result
from mechdesign.questions.poses import study_poses
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.questions.synthesize.figures.solutions import costs, trade
from mechdesign.questions.synthesize.schema import SynthesisSection
from mechdesign.questions.synthesize.words import linkage
from mechdesign.study import Study

# In units of a drawing: length of the line that shows the angle of a position, and how far a number is from it and from
# others; poses in which names keep off links.
_AXIS, _BESIDE, _NAMED_POSES = 24.0, 18.0, 4


def solutions(study: Study, result: Result, name: str) -> MovingPicture | None:
    """The best linkages of a synthesis, each moving through the task; use inside `style.context`.

    None where none of them moves. `name` begins the ids inside the picture of what they trade.
    """
    drawn, table = DrawnSolutions.of(result), result.tables["solutions"]
    studies = [drawn.linkage(row) for row in range(min(len(table), MOST_DESIGNS))]
    courses = ((row, moved(one, study_poses(one, "kinematics"))) for row, one in enumerate(studies))
    sweeps = [(row, sweep) for row, course in courses for sweep in course if len(sweep.valid) > 1]
    if not sweeps:
        return None
    section = study.synthesis
    assert section is not None
    placed = [(row, Canvas.around(np.concatenate([sweep.extent, drawn.places])), sweep) for row, sweep in sweeps]
    choices: list[dict[str, Any]] = []
    fits = fitting(placed)
    for row, sheet, sweep in placed[: len(fits)]:
        layer = Element("g")
        mark_task(layer, sheet, section, drawn.places, drawn.directions)
        sketcher = Sketcher(layer, sheet, sweep.scene.some(sweep.valid[:1].tolist())[0])
        sketcher.names(sweep.scene.some(sweep.valid[evenly(len(sweep.valid), _NAMED_POSES)].tolist()), links=False)
        sketcher.ruler(study.units.label("length"))
        label = "nearest" if result.failed else f"solution {row + 1}"
        kind, *words = linkage(table, row, float(drawn.errors[row]))
        choices.append(fits[row] | {
            "drawing": fits[row]["drawing"] + "".join(tostring(part, encoding="unicode") for part in layer),
            "view": f"0 0 {sheet.width:g} {sheet.height:.1f}", "title": f"{label}, {kind}",
            "number": row + 1, "mark": kind, "words": [f"{row + 1}: {kind}", *words],
        })  # fmt: skip
    rows = np.array([row for row, _, _ in placed[: len(choices)]])
    columns = [column for column in table.columns if column.numeric and column.name not in ("solution", "full_turn")]
    numbers, entries, fields = numbers_of(columns, rows, 0, study.size)
    figure = trade(View(study, result))
    data = {"poses": len(rows), "first": 0, "choices": choices, "given": fields, "keys": [fields],
            "numbers": numbers.tracks, "grid": True, "front": [],
            "pace": f"{len(rows)} of {len(table)} linkages are in this page: a click on one enlarges it."}  # fmt: skip
    beside = ""
    if figure is not None:
        page = draw(figure)
        beside = inline(page, name, described(page))
        data["front"] = points(page, [table["transmission_angle"][rows] + 1j * costs(result)[1][rows]])
    _, sheet, sweep = placed[0]
    root = sheet.root("a linkage that does the task")
    chosen(add(root, "g", **{"class": "moving-design"}), sheet, sweep)
    return MovingPicture(tostring(root, encoding="unicode"), beside, data, choices[0]["title"], ["value"], entries,
                         meanings(table), ["solutions", *(["trade"] if beside else [])])  # fmt: skip


def mark_task(layer: Element, sheet: Canvas, task: SynthesisSection, points: Complexes, directions: Complexes) -> None:
    """The places of a task's positions with their numbers, lines along the body there, and where no pivot may lie."""
    for box in task.keep_out:
        (west, east), (south, north) = sorted(box.x), sorted(box.y)
        corner, wide, high = sheet.at(complex(west, north)), (east - west) * sheet.scale, (north - south) * sheet.scale
        add(layer, "rect", x=corner.real, y=corner.imag, width=wide, height=high, fill=style.VERMILION,
            fill_opacity=0.08, stroke=style.VERMILION, stroke_opacity=0.5, stroke_dasharray="4 3")  # fmt: skip
    numbers: list[complex] = []
    middle = sheet.all(points).mean() if len(points) else 0j
    for k, place in enumerate(points.tolist()):
        at = sheet.at(place)
        if len(directions):
            end = at + _AXIS * complex(directions[k]).conjugate()
            add(layer, "line", x1=at.real, y1=at.imag, x2=end.real, y2=end.imag, stroke=style.VERMILION, stroke_width=2)
        add(layer, "circle", cx=at.real, cy=at.imag, r=4, fill=style.VERMILION)
        # Outside of the points, where there is room for it.
        number = at + _BESIDE * (at - middle) / (abs(at - middle) or 1.0)
        if all(abs(number - other) > _BESIDE for other in numbers):
            numbers.append(number)
            add(layer, "text", str(k + 1), x=number.real, y=number.imag + 3.5, text_anchor="middle", font_size=10,
                fill=style.VERMILION, stroke="white", stroke_width=2.6, paint_order="stroke")  # fmt: skip
