"""Outputs over a sweep or along a path as curves, a panel a kind of number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.layout import fitting_rows
from mechdesign.drawing.legends import fitting, legend_names
from mechdesign.drawing.marks import Axis, Lines, Panel, PanelMark, Picture, Trace, Zone
from mechdesign.drawing.overlay import DASHES, both_named
from mechdesign.drawing.panels import Along, abscissa, moving_names, quantile, times
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.sweep import ranks
from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Table
from mechdesign.mechanism.plates import CLEARANCE
from mechdesign.motion.rows import Poses
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.study import Study

MAX_CURVES = 7  # in one panel; more cannot be told apart
MAX_PANELS = 12
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
_AROUND = 0.05  # part of the range beyond it
_HIDDEN = 0.015  # part of its range by which a curve differs from one that covers it
_TAIL_PERCENT = 4  # of the motion, left out at both ends to find peaks
_PEAK_RATIO = 6  # of the whole range to that of the other poses


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
        return ", ".join((self.of, *self.same))


class _Group(NamedTuple):
    """Curves of one kind and unit, how many of them other panels have, and how many none has."""

    curves: list[_Curve]
    before: int
    left_out: int

    @property
    def rows(self) -> int:
        """Rows of its legend where that stands above it, on a narrow page."""
        names = legend_names([curve.label for curve in self.curves])
        return -(-len(names) // fitting(names)) + bool(self.left_out) if style.narrow() else 0


@picture(MotionView, "motion", order=20)
def motion_picture(view: MotionView) -> Picture | None:
    """Every output of a motion."""
    if not view.sweep.poses.followed:
        return None
    tables = {**view.result.tables, "motion": view.table("motion")}
    return motion_curves(view.study, tables, view.curves.shown.poses, view.before)


def motion_curves(
    study: Study, tables: Mapping[str, Table], poses: Poses, before: Before | None = None
) -> Picture | None:
    """Every output over the swept coordinate, or along the path; None where nothing changes."""
    table = tables["motion"]
    over = abscissa(study, poses, _speed(study)) if moving_names(poses) else None
    groups = _panels(study, table, over.name, over.values) if over is not None else []
    if over is None or not groups:
        return None
    # What a page has no room for, the table has.
    shown = groups[: fitting_rows(max(group.rows for group in groups), MAX_PANELS)]
    left_out = len(groups) - len(shown)
    axis = replace(over.axis, name=over.label + f"; {left_out} more panels in motion.csv" * bool(left_out))
    marks, x = _marks(study, tables.get("limits"), poses, over), over.values
    invalid = _runs(table["valid"] == 0, x, np.array([value for value, _ in marks]))
    common: list[PanelMark] = [
        Zone(*ends, "x", label="not valid", look={"color": _SHADE, "zorder": 0}) for ends in invalid
    ]
    for k, kind in enumerate(dict.fromkeys(kind for _, kind in marks)):
        look = {"color": _LIMIT_COLORS[k % len(_LIMIT_COLORS)], "linestyle": (0, (6, 2 + k)), "linewidth": 1.1}
        common.append(
            Lines([value for value, own in marks if own == kind], "x", label=kind, look=look | {"zorder": 1.5})
        )
    common += both_named(before)
    colors: dict[tuple[str, str], str] = {}
    panels = [_panel(group, axis, over, study, colors, before, common) for group in shown]
    return Picture("", panels, share="x")


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


def _panels(study: Study, table: Table, swept: str, x: Floats) -> list[_Group]:
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
            panels.append(_Group(curves, sum(map(len, own[:k])), more))
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


def _panel(
    group: _Group, axis: Axis, over: Along, study: Study, colors: dict[tuple[str, str], str], before: Before | None,
    common: Sequence[PanelMark],
) -> Panel:  # fmt: skip
    """The curves of a group and those of the study before; notes the colour of each."""
    marks, shown, used = [*common], list[Floats](), list[str]()
    first, named = group.curves[0], len(group.curves) > 1 or group.curves[0].of != group.curves[0].order
    for curve in group.curves:
        values = curve.column.values
        color = colors.get(curve.color_key, _COLORS[(group.before + len(shown)) % len(_COLORS)])
        if color in used:
            color = next(other for other in _COLORS if other not in used)
        used.append(color)
        colors[curve.color_key] = color
        hidden = any(_coincide(values, other) for other in shown)
        # In grey the markers tell what the colours tell.
        which = _COLORS.index(color)
        marker = _MARKERS[which] if len(group.curves) > 1 else ""
        look = {"color": color, "linestyle": (0, (3, 3)) if hidden else "-", "marker": marker, "markersize": 4,
                "markevery": over.spread(_MARKS, which / len(_COLORS))}  # fmt: skip
        marks.append(Trace(over.values, values, label=curve.label if named else "", look=look))
        shown.append(values)
    # What a value takes of the axis, for places lie closer where curves are bent.
    parts = np.abs(np.diff(over.values, prepend=over.values[:1]) + np.diff(over.values, append=over.values[-1:]))
    values, finite = np.concatenate(shown), np.isfinite(np.concatenate(shown))
    ends = _ends(group, values[finite], np.tile(parts, len(shown))[finite])
    if before is not None:
        if first.order != "position" and ends == (None, None):
            # Of the study before rates may grow without bound: their axis stays that of the study now.
            low, high = (float(end(np.concatenate(shown))) for end in (np.nanmin, np.nanmax))
            ends = low - _AROUND * (high - low), high + _AROUND * (high - low)
        was = DrawnMotion.of(before.result)
        earlier, own = was.finer.rows_of(before.result.tables["motion"], was), was.finer.shown.poses
        places = abscissa(before.study, own, _speed(before.study)).values
        for curve, color in zip(group.curves, used, strict=True):
            if curve.column.name in earlier:
                earlier_look = {"color": color, "linestyle": DASHES, "linewidth": 1.1, "zorder": 1.9}
                marks.append(Trace(places, earlier[curve.column.name], look=earlier_look))
    more = f"and {group.left_out} more" if group.left_out else ""
    return Panel(marks, axis, Axis(_title(group, study), first.column.unit, ends=ends), legend="beside", heading=more)


def _title(group: _Group, study: Study) -> str:
    """What a panel shows: a kind of quantity, and measures by their names."""
    first, names = group.curves[0], [curve.of for curve in group.curves]
    measures = [name for name in names if name in study.mechanism.description.measures]
    if first.order == "position":
        kinds = {study.units.label("angle"): "angle", study.units.label("length"): "position"}
        return ", ".join([kinds.get(first.column.unit, "value")] * (len(measures) < len(names)) + measures)
    kind = first.order.replace("_", " ")
    return kind if len(measures) < len(names) else f"{kind} of {', '.join(measures)}"


def _ends(group: _Group, values: Floats, parts: Floats) -> tuple[float | None, float | None]:
    """What stands still is not drawn by its rounding; near a dead centre rates grow without bound, elsewhere they stay
    legible.
    """
    if _still(values, 1.0):
        middle = float(values.mean())
        return middle - max(0.1 * abs(middle), 0.1), middle + max(0.1 * abs(middle), 0.1)
    low, high = (quantile(values, parts, percent / 100) for percent in (_TAIL_PERCENT, 100 - _TAIL_PERCENT))
    if group.curves[0].order == "position" or not np.ptp(values) > _PEAK_RATIO * (high - low) > 0:
        return None, None
    return low - 0.5 * (high - low), high + 0.5 * (high - low)
