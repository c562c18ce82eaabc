"""Outputs over a sweep or along a path as curves, a panel a kind of number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mechdesign.mechanism.plates import CLEARANCE
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.overlay import DASHES, name_both
from mechdesign.report.figures.panels import (
    Along,
    abscissa,
    clear_of_ticks,
    fitting,
    moving_names,
    tick_abscissa,
    times,
)
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import ranks
from mechdesign.results import Column, Table
from mechdesign.study import Poses, Study, Units

MAX_CURVES = 7  # in one panel; more cannot be told apart
MAX_PANELS = 12
_MAX_TALL_PANELS = 7  # more panels are lower
_COLORS = (*style.PALETTE[:6], style.INK)  # yellow is lost on white
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_MARKS = 8  # along a curve, about
_LIMIT_COLORS = (style.VERMILION, style.PURPLE, style.BLUE, style.INK)
_SHADE = "#EFEFEF"  # of poses that are not valid
# Kinds of panels in their order; a name has the same colour in all of its own.
_ORDERS = ("velocity", "acceleration", "error", "effort", "pressure_angle", "curvature_radius")
_RANKS = ("position", *_ORDERS, "clearance", "det_J", "inverse_condition")
_OF_ONE_COLOR = ("position", "velocity", "acceleration", "error")
_STILL = 1e-9  # part of its size by which a column changes that does not change
_FLAT = 0.05  # part of the range of a panel below which a curve that moves has another panel
_HIDDEN = 0.015  # part of its range by which a curve differs from one that covers it
_TAIL_PERCENT = 4  # of the poses, left out at both ends to find peaks
_PEAK_RATIO = 6  # of the whole range to that of the other poses
_LEGEND_LETTERS = 26  # of the longest name in a legend
# Inches.
_LEFT = 1.0
_BOTTOM = 0.5
# Height of a panel: of few, of many, and on a page that holds no more.
_TALL, _LOW, _LOWEST = 1.57, 1.23, 0.7
_LEGEND_ROW = 0.19


class _Curve(NamedTuple):
    """A column, what it is of, and what kind of number it holds."""

    column: Column
    of: str
    order: str
    same: tuple[str, ...] = ()  # other names of the same curve

    @property
    def color_key(self) -> tuple[str, str]:
        """What curves of one colour share."""
        return self.of, "" if self.order in _OF_ONE_COLOR else self.order

    @property
    def label(self) -> str:
        """Its name in a legend."""
        name = ", ".join((self.of, *self.same))
        return name if len(name) <= _LEGEND_LETTERS else f"{name[: _LEGEND_LETTERS - 1]}\N{HORIZONTAL ELLIPSIS}"


class _Panel(NamedTuple):
    """Curves of one kind and unit, how many of them other panels have, and how many none has."""

    curves: list[_Curve]
    before: int
    left_out: int

    @property
    def columns(self) -> int:
        """Columns of its legend where that stands above it."""
        return fitting([curve.label for curve in self.curves], style.width() - _LEFT - 0.3)

    @property
    def rows(self) -> int:
        """Rows of that legend."""
        return -(-len(self.curves) // self.columns) + bool(self.left_out)


@picture(MotionView, "motion", order=20)
def motion_figure(view: MotionView) -> Figure | None:
    """Every output of a motion."""
    poses = view.sweep.poses
    return curves_figure(view.study, view.result.tables, poses, view.before) if poses.motion else None


def curves_figure(
    study: Study, tables: Mapping[str, Table], poses: Poses, before: Before | None = None
) -> Figure | None:
    """Every output over the swept coordinate, or along the path; None where nothing changes."""
    table = tables["motion"]
    if not moving_names(poses):
        return None
    over = abscissa(study, poses, _speed(study))
    swept, x = over.name, over.values
    panels = _panels(study, table, swept, x)
    if not panels:
        return None
    marks = _marks(study, tables.get("limits"), poses, over)
    invalid = _runs(table["valid"] == 0, x, np.array([value for value, _ in marks]))
    # A narrow page has no room for legends beside its panels: they stand above them.
    above = style.narrow()
    room = 0.1 + _LEGEND_ROW * max(panel.rows for panel in panels)
    longest = max(len(curve.label) for panel in panels for curve in panel.curves)
    top, down = (0.4 if marks else 0.15) + room * above, room if above else 0.2
    # What a page has no room for, the table has.
    left_out = max(len(panels) - int(min((style.tallest() - top - _BOTTOM + down) / (_LOWEST + down), MAX_PANELS)), 0)
    panels = panels[: len(panels) - left_out]
    tall = _TALL if len(panels) <= _MAX_TALL_PANELS else _LOW
    tall = min(tall, (style.tallest() - top - _BOTTOM + down) / len(panels) - down)
    figure, axes = style.page(
        len(panels), 1, tall, left=_LEFT, right=0.15 if above else 0.6 + 0.08 * longest, top=top, bottom=_BOTTOM,
        down=down, sharex=True,
    )  # fmt: skip
    colors: dict[tuple[str, str], str] = {}
    for axis, panel in zip(axes, panels, strict=True):
        for begin, end in invalid:
            axis.axvspan(begin, end, color=_SHADE, linewidth=0, zorder=0)
        _draw(axis, panel, x, study.units, colors)
        if before is not None:
            _draw_before(axis, panel, before, colors)
    _draw_limits(figure, axes, marks, bool(invalid))
    axes[-1].set_xlim(*(x[[0, -1]] if x[0] < x[-1] else x[[-1, 0]]))
    axes[-1].margins(x=0.02)
    axes[-1].set_xlabel(over.label + f"; {left_out} more panels in motion.csv" * bool(left_out))
    tick_abscissa(axes[-1], over)
    clear_of_ticks(figure, axes)
    name_both(figure, before)
    return figure


def _speed(study: Study) -> float | None:
    """At which the path's point passes it, if the study says so."""
    return study.kinematics.speed if study.kinematics is not None else None


def _marks(study: Study, limits: Table | None, poses: Poses, over: Along) -> list[tuple[float, str]]:
    """Where on the axis the motion ends or is singular, and what it is there."""
    speed = _speed(study)
    if limits is None or (speed is None and over.name not in limits):
        return []
    if speed is None:
        places = limits[over.name]
    else:
        rows = limits["row"] if poses.swept is None else _rows(poses, poses.swept, limits[poses.swept])
        places = times(poses, rows, speed)
    return list(zip(places.tolist(), limits["kind"].tolist(), strict=True))


def _rows(poses: Poses, swept: str, values: Floats) -> Floats:
    """Places of a motion, in rows, by the values of the coordinate that is swept."""
    order = np.argsort(poses.values[swept])
    return np.interp(values, poses.values[swept][order], poses.numbers[order])


def _panels(study: Study, table: Table, swept: str, x: Floats) -> list[_Panel]:
    """Columns by kind and unit, in the order of `_RANKS`, the most informative first."""
    section, mechanism, units = study.kinematics, study.mechanism, study.units
    outputs = section is not None and section.outputs
    sizes = {units.label("angle"): 2 * np.pi / units.angle_factor, units.label("length"): mechanism.size}
    # The condition of a single number is 1, that of each pose is for its table.
    # The smallest clearance is that of one of the pairs.
    left_out = {"conditioning", CLEARANCE} | ({"inverse_condition"} if len(mechanism.drives) == 1 else set())
    groups: dict[tuple[str, str], list[_Curve]] = {}
    for column in table.columns:
        if column.values.dtype.kind != "f" or column.name in left_out or not np.isfinite(column.values).any():
            continue
        if column.name.endswith("_advantage"):
            continue  # has a picture with the transmission angles
        order = next((order for order in _ORDERS if column.name.endswith(f"_{order}")), "position")
        of = column.name.removesuffix(f"_{order}")
        if column.name in _RANKS:
            order = of = column.name
        elif column.name.endswith(f".{CLEARANCE}"):
            order, of = "clearance", column.name.removesuffix(f".{CLEARANCE}")
        position = table.column(of) if of in table else None
        values = column.values if position is None else position.values
        if order in ("position", "velocity", "acceleration") and swept and _still(values - x, float(np.ptp(x))):
            continue  # the sweep over itself
        # Of what stands still only the position is drawn, and only where it is an output.
        always = order in ("error", "effort") or (order == "position" and outputs and of not in mechanism.drives)
        if not always and _still(values, sizes.get(position.unit if position is not None else "", 1.0)):
            continue
        groups.setdefault((order, column.unit), []).append(_Curve(column, of, order))
    rank = ranks(study)
    kinds = sorted(groups.values(), key=lambda curves: _RANKS.index(curves[0].order))[:MAX_PANELS]
    parts = []
    for curves in map(_distinct, kinds):
        if len(curves) > MAX_CURVES:
            curves.sort(key=lambda curve: -rank.get(curve.of.rpartition(".")[0], 1))
        parts.append(_legible(curves))
    # Each kind has a panel before another has its second.
    turns = sorted((turn, kind) for kind, own in enumerate(parts) for turn in range(len(own)))
    shown = [sum(kind == other for _, other in turns[:MAX_PANELS]) for kind in range(len(parts))]
    panels = []
    for own, count in zip(parts, shown, strict=True):
        for k, curves in enumerate(own[:count]):
            more = sum(map(len, own[count:])) if k == count - 1 else 0
            panels.append(_Panel(curves, sum(map(len, own[:k])), more))
    return panels


def _distinct(curves: Sequence[_Curve]) -> list[_Curve]:
    """Each curve once, under all of its names."""
    distinct: list[_Curve] = []
    for curve in curves:
        values = curve.column.values
        size = _STILL * float(np.nanmax(np.abs(values)))
        for k, other in enumerate(distinct):
            if np.allclose(values, other.column.values, rtol=0.0, atol=size, equal_nan=True):
                distinct[k] = other._replace(same=(*other.same, curve.of))
                break
        else:
            distinct.append(curve)
    return distinct


def _legible(curves: Sequence[_Curve]) -> list[list[_Curve]]:
    """Curves in panels of at most `MAX_CURVES`, so that none that moves is flat beside the others of its panel."""
    panels: list[list[_Curve]] = []
    for curve in curves:
        for panel in panels:
            if len(panel) < MAX_CURVES and not _flattened([*panel, curve]):
                panel.append(curve)
                break
        else:
            panels.append([curve])
    return panels


def _flattened(curves: Sequence[_Curve]) -> bool:
    """Whether a curve that moves would be a flat line on one axis with the others; rare peaks are left aside."""
    ends = np.array([np.nanpercentile(curve.column.values, (_TAIL_PERCENT, 100 - _TAIL_PERCENT)) for curve in curves])
    spans = ends[:, 1] - ends[:, 0]
    moving = spans > _STILL * np.abs(ends).max()
    return bool((spans[moving] < _FLAT * (ends[:, 1].max() - ends[:, 0].min())).any())


def _still(values: Floats, size: float) -> bool:
    finite = values[np.isfinite(values)]
    return not len(finite) or float(np.ptp(finite)) <= _STILL * max(float(np.abs(finite).max()), size)


def _coincide(one: Floats, other: Floats) -> bool:
    finite = np.isfinite(one) & np.isfinite(other)
    span = max(float(np.ptp(one[finite])), float(np.ptp(other[finite]))) if finite.any() else 0.0
    return bool(np.all(np.abs(one[finite] - other[finite]) <= _HIDDEN * span))


def _runs(invalid: Flags, x: Floats, limits: Floats) -> list[tuple[float, float]]:
    """Ranges of x that are not valid, up to the limit of motion where one lies beside them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], invalid, [False]]).astype(int)))
    ranges = []
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        ends = []
        for inner, outer in ((first, max(first - 1, 0)), (last, min(last + 1, len(x) - 1))):
            low, high = sorted((x[inner], x[outer]))
            between = limits[(limits >= low) & (limits <= high)] if len(limits) else limits
            ends.append(float(between[0]) if len(between) else float(x[inner] + x[outer]) / 2)
        ranges.append((ends[0], ends[1]))
    return ranges


def _draw(axis: Axes, panel: _Panel, x: Floats, units: Units, colors: dict[tuple[str, str], str]) -> None:
    """Draw the curves of a panel, and note the colour of each."""
    shown: list[Floats] = []
    used: list[str] = []
    for curve in panel.curves:
        values = curve.column.values
        color = colors.get(curve.color_key, _COLORS[(panel.before + len(shown)) % len(_COLORS)])
        if color in used:
            color = next(other for other in _COLORS if other not in used)
        used.append(color)
        colors[curve.color_key] = color
        hidden = any(_coincide(values, other) for other in shown)
        # In grey the markers tell what the colours tell.
        which, every = _COLORS.index(color), max(len(x) // _MARKS, 1)
        marker = _MARKERS[which] if len(panel.curves) > 1 else ""
        axis.plot(x, values, color=color, linestyle=(0, (3, 3)) if hidden else "-", label=curve.label,
                  marker=marker, markersize=4, markevery=(which * every // len(_COLORS), every))  # fmt: skip
        shown.append(values)
    first = panel.curves[0]
    title = first.order.replace("_", " ")
    if title == "position":
        kinds = {units.label("angle"): "angle", units.label("length"): "position"}
        title = kinds.get(first.column.unit, "value")
    title = title.replace("inverse ", "inverse\n")
    axis.set_ylabel(style.axis_label(title, first.column.unit).replace(" [", "\n["))
    finite = np.concatenate([values[np.isfinite(values)] for values in shown])
    if _still(finite, 1.0):
        # What stands still is drawn straight, not by its rounding.
        middle = float(finite.mean())
        axis.set_ylim(middle - max(0.1 * abs(middle), 0.1), middle + max(0.1 * abs(middle), 0.1))
    elif first.order != "position":
        low, high = np.percentile(finite, (_TAIL_PERCENT, 100 - _TAIL_PERCENT))
        if np.ptp(finite) > _PEAK_RATIO * (high - low) > 0:
            # Near a dead centre rates grow without bound: what they are elsewhere stays legible.
            axis.set_ylim(low - 0.5 * (high - low), high + 0.5 * (high - low))
    if len(panel.curves) > 1 or first.of != first.order:
        place: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
        if style.narrow():
            place = {"loc": "lower left", "bbox_to_anchor": (-0.02, 0.97), "ncols": panel.columns, "borderaxespad": 0}
        more = f"and {panel.left_out} more" if panel.left_out else None
        axis.legend(title=more, title_fontsize=9, alignment="left", **place)


def _draw_before(axis: Axes, panel: _Panel, before: Before, colors: dict[tuple[str, str], str]) -> None:
    """The curves of the study before, dashed, each in the colour of its name."""
    table, poses = before.result.tables["motion"], DrawnMotion.of(before.result).shown.poses
    x = abscissa(before.study, poses, _speed(before.study)).values
    low, high = axis.get_ylim()
    for curve in panel.curves:
        if curve.column.name in table:
            values = table[curve.column.name]
            axis.plot(x, values, color=colors[curve.color_key], linestyle=DASHES, linewidth=1.1, zorder=1.9)
            if curve.order == "position" and np.isfinite(values).any():
                low, high = min(low, float(np.nanmin(values))), max(high, float(np.nanmax(values)))
    # Near a dead centre rates grow without bound: their axis stays that of the study now.
    if (low, high) != axis.get_ylim():
        margin = 0.04 * (high - low)
        axis.set_ylim(low - margin, high + margin)


def _draw_limits(figure: Figure, axes: Sequence[Axes], marks: list[tuple[float, str]], shaded: bool) -> None:
    kinds = list(dict.fromkeys(kind for _, kind in marks))
    looks: dict[str, dict[str, Any]] = {
        kind: {"color": _LIMIT_COLORS[k % len(_LIMIT_COLORS)], "linestyle": (0, (6, 2 + k))}
        for k, kind in enumerate(kinds)
    }
    for axis in axes:
        for value, kind in marks:
            axis.axvline(value, linewidth=1.1, zorder=1.5, **looks[kind])
    handles: list[Line2D | Patch] = [Line2D([], [], linewidth=1.1, label=kind, **looks[kind]) for kind in kinds]
    if shaded:
        handles.append(Patch(color=_SHADE, label="not valid"))
    if handles:
        height = figure.get_figheight()
        figure.legend(
            handles=handles, loc="lower left", ncols=len(handles), borderaxespad=0.0,
            bbox_to_anchor=(axes[0].get_position().x0, 1 - 0.34 / height),
        )  # fmt: skip
