"""The linkages of a synthesis with their paths and the task, and error or size against transmission angle."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import Axis, Dots, Panel, PanelMark, Picture, Trace, Words
from mechdesign.drawing.panels import number, quantity
from mechdesign.drawing.pictures import View, picture
from mechdesign.drawing.scene import Still, sketched
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.errors import MechdesignError, counted
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.numerics.fronts import front
from mechdesign.ground.results import Result
from mechdesign.questions.poses import solve_shown
from mechdesign.questions.synthesize.analysis import DrawnSolutions
from mechdesign.questions.synthesize.declared import in_words
from mechdesign.study import Study

# Linkages on the page, and beside each other.
_SHOWN, _ACROSS = 20, 5
# Length of the line that shows the angle of a position, as a part of the extent of what is drawn.
_AXIS = 0.08
# Points of a task that are drawn large, and least distance of numbers on the front as a part of an axis.
_APART, _CLEAR = 12, 0.05
_MU = "\N{GREEK SMALL LETTER MU}"


@picture(View, "solutions", order=10)
def solutions_picture(view: View) -> Picture:
    """The best linkages, each at the first position of the task, with the path of its point and the task."""
    drawn, table = DrawnSolutions.of(view.result), view.result.tables["solutions"]
    panels, angle = [], table.column("transmission_angle").unit
    size = 3.5 if len(drawn.places) <= _APART else 2.0
    for row in range(min(len(table), _SHOWN)):
        (still, path), places = _course(drawn.linkage(row), drawn.output), drawn.places
        marks: list[PanelMark] = [Posed(still, names=False, drives=False)]
        shows = np.concatenate([path[np.isfinite(path)], places, still.places])
        marks += [Trace(path.real, path.imag, label=f"path of {drawn.output}",
                        look={"color": style.BLUE, "linewidth": 1.2, "zorder": 5.5})] * bool(len(path))  # fmt: skip
        if len(drawn.directions):
            ends = places + _AXIS * max(np.ptp(shows.real), np.ptp(shows.imag)) * drawn.directions
            axes = np.stack([places, ends, np.full(len(places), np.nan)], axis=1).ravel()
            marks.append(Trace(axes.real, axes.imag, look={"color": style.VERMILION, "linewidth": 1.4, "zorder": 6}))
        if len(places):
            marks.append(Dots(places.real, places.imag, label="the task",
                              look={"color": style.VERMILION, "markersize": size, "zorder": 6}))  # fmt: skip
        error = quantity(float(drawn.errors[row]), table.column("error").unit)
        kind, defects = (str(table[name][row]) for name in ("kind", "defects"))
        words = [f"{row + 1}: {in_words(kind)}", f"error {error}",
                 f"{_MU} {quantity(float(table['transmission_angle'][row]), angle)}",
                 f"yield {number(float(table['yield'][row]))}" if "yield" in table else "",
                 f"defect: {defects}" if defects else "no defect"]  # fmt: skip
        lines = [*filter(None, words)]
        if style.narrow():
            lines = [", ".join(lines[k : k + 2]) for k in range(0, len(lines), 2)]
        panels.append(Panel(marks, title="\n".join(lines), equal=1.0, shows=shows, bare=True))
    count = counted(len(table), "linkage")
    title = f"The best {len(panels)} of {count}" if len(panels) < len(table) else count
    note = f"{_MU} is the smallest transmission angle" + "; each linkage has its own scale" * (len(panels) > 1)
    return Picture(f"{title} at the first position", panels, (note,), across=_ACROSS)


def _course(study: Study, point: str) -> tuple[Still, Complexes]:
    """A linkage at its first position, with the path of a point through the task; empty where there is none."""
    first, path = sketched(study.mechanism), np.empty(0, dtype=complex)
    with suppress(MechdesignError):
        sweep = Sweep.of(solve_shown(study))
        return sweep.scene.at(0) or first, sweep.traces.get(point, path)
    return first, path


def costs(result: Result) -> tuple[str, Floats]:
    """What a larger transmission angle costs, a column of the solutions, and its values: error, of exact ones size."""
    errors = DrawnSolutions.of(result).errors
    return ("error", errors) if errors.any() else ("size", np.asarray(result.tables["solutions"]["size"]))


def trade(view: View) -> Picture | None:
    """Error, or size, against the smallest transmission angle; the front is those that none surpasses in both."""
    table, (cost, values) = view.result.tables["solutions"], costs(view.result)
    angles, faulty = np.asarray(table["transmission_angle"]), np.asarray(table["defects"]) != ""
    if len(table) < 2:
        return None
    whole = np.flatnonzero(~faulty)
    best = whole[front(np.column_stack([values[whole], -angles[whole]]))]
    order = best[np.argsort(angles[best])]
    line = Trace(angles[order], values[order], label="front: no other without a defect is better in both",
                 look={"color": style.BLUE, "drawstyle": "steps-pre", "linewidth": 1.2})  # fmt: skip
    marks: list[PanelMark] = [
        *[line] * (len(order) > 1),
        Dots(angles[~faulty], values[~faulty], label="linkages", look={"color": style.VERMILION, "markersize": 5}),
    ]  # fmt: skip
    if faulty.any():
        hollow = {"color": style.VERMILION, "markersize": 5, "markerfacecolor": "white"}
        marks.append(Dots(angles[faulty], values[faulty], label="with a defect", look=hollow))
    marks += [Words(angles[k], values[k], f"{k + 1}", (4.0, 3.0)) for k in _spread(order, angles, values)]
    across = Axis("smallest transmission angle, more is better", table.column("transmission_angle").unit)
    up = Axis(f"{cost}, less is better", table.column(cost).unit)
    return Picture(f"What less {cost} costs in transmission", [Panel(marks, across, up)])


def _spread(rows: Ints, x: Floats, y: Floats) -> list[int]:
    """Rows from both ends whose places are far enough apart for their numbers."""
    kept: list[int] = []
    wide, tall = (float(np.ptp(values)) or 1.0 for values in (x, y))
    for row in [*rows[-1:].tolist(), *rows[:-1].tolist()]:
        if all(max(abs(x[row] - x[k]) / wide, abs(y[row] - y[k]) / tall) > _CLEAR for k in kept):
            kept.append(row)
    return kept


trade_picture = picture(View, "trade", order=20)(trade)
