"""Pictures of a motion: curves over the sweep, the mechanism in several poses, its other assemblies, an animation."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from PIL import Image

from mechdesign.mechanism.algebra import vector
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes, Flags, Floats, Ints
from mechdesign.report.before import Before, known
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism, link_colors
from mechdesign.report.figures.framing import ABOVE, LEFT, RIGHT, TITLE, extent, fit, framed, windows
from mechdesign.report.figures.labels import paper
from mechdesign.report.figures.overlay import DASHES, draw_sweep, name_both
from mechdesign.report.figures.panels import abscissa, clear_of_ticks, fitting, moving_names, tick_abscissa
from mechdesign.report.figures.poses import poses_figure
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.scene import Sweep, link_points, ranks
from mechdesign.report.figures.transmission import transmission_figure
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study, Units

# More curves than this in one panel cannot be told apart.
MAX_CURVES = 7
MAX_CURVE_PANELS = 12
_COLORS = (*style.PALETTE[:6], style.INK)  # yellow is lost on white
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_MARKS = 8  # along a curve, about
_ORDERS = ("velocity", "acceleration", "error", "effort")
_RANKS = ("position", *_ORDERS, "det_J", "inverse_condition")
_MAX_TALL_PANELS = 7  # more panels are lower
_LEGEND_LETTERS = 26  # of the longest name in a legend
_STILL = 1e-9  # part of its size by which a column changes that does not change
_HIDDEN = 0.015  # part of its range by which a curve differs from one that covers it
_TICK = 9.0  # points, a tick of equal time across a path
_LEGEND_LINE = 0.19  # inches
_LEGEND_SYMBOL = 0.6  # inches, of a legend's lines beside their words
_MOST_TICKS = 24  # along a motion
_FEWEST_TICKS = 4
_UNEVEN = 2e-3  # part of the mean step by which those of a sweep may differ
_CENTRODES = ((0, (7, 2, 1.5, 2)), (0, (7, 2, 1.5, 2, 1.5, 2)), (0, (3, 2)))  # dashes
_NEAR = 0.75  # larger sides of the mechanism from its middle up to which a centrode widens the window
_TAIL_PERCENT = 4  # of the poses, left out at both ends to find peaks
_PEAK_RATIO = 6  # of the whole range to that of the other poses
_LIMIT_COLORS = (style.VERMILION, style.PURPLE, style.BLUE, style.INK)
_SHADE = "#EFEFEF"
_LEFT = 1.0  # inches beside panels of curves
_LEGEND_ROW = 0.19
# Largest number of moving links, and for it the number of ghosts.
_GHOSTS = ((3, 7), (5, 6), (8, 4), (10**6, 2))
# Line width and share of colour of a path by the rank of its point.
PATH_LOOKS = {2: (2.2, 1.0), 1: (1.1, 0.9), 0: (0.9, 0.55)}
HEIGHT = 5.6  # inches, of a mechanism along its motion at most
# Of the panels of assemblies: their number side by side, inches, and the size of symbols in small ones.
_MAX_COLUMNS = 4
_MAX_HEIGHT = 4.0
_MIN_HEIGHT = 1.2
_PANEL_TITLE = 0.3
_NOTE = 0.3
_GAP = 0.12
_SMALL_SYMBOLS = 0.6
# Of the animation: frames at most, colours, milliseconds, and pixels across.
FRAMES = 36
_GIF_COLORS = 32
_WHITE = 244  # brightness of 255 from which on a colour is white
_CYCLE = 3600  # of the whole
_MIN_FRAME = 50
_MAX_FRAME = 160
_GIF_WIDTH = 480


def figures(study: Study, result: Result) -> Gallery:
    """``motion``, ``paths``, ``poses``, ``transmission`` and ``modes``.

    They are curves of a sweep or path, poses and point paths, limits or listed poses one by one, how force is passed
    on, and every assembly. Lists of poses have neither curves nor paths, grids have no pictures but their assemblies.
    """
    found = Gallery()
    if result.drawn["poses"].motion:
        found.add("motion", curves_figure, study, result)
        sweep = Sweep.of(result.drawn["motion"])
        if len(sweep.valid):
            centres = result.tables.get("instant_centres")
            found.add("paths", paths_figure, sweep, centres=centres, before=known(result.drawn))
    found.add("poses", poses_figure, study, result)
    if result.drawn["poses"].motion:
        found.add("transmission", transmission_figure, study, result)
    if "modes" in result.tables:
        found.add("modes", modes_figure, study, result)
    return found


class _Curve(NamedTuple):
    """A column, what it is of, and what kind of number it holds."""

    column: Column
    of: str
    order: str


def curves_figure(study: Study, result: Result) -> Figure | None:
    """Every output over the swept coordinate, or along the path; None where nothing changes."""
    table = result.tables["motion"]
    if not moving_names(result.drawn["poses"]):
        return None
    over = abscissa(study, result.drawn["poses"])
    swept, x = over.name, over.values
    panels = _panels(study, [column for column in table.columns if column.name != "valid"], swept, x)
    if not panels:
        return None
    before = known(result.drawn)
    limits, marks = result.tables.get("limits"), []
    if limits is not None and swept in limits:
        marks = list(zip(limits[swept].tolist(), limits["kind"].tolist(), strict=True))
    invalid = _runs(table["valid"] == 0, x, np.array([value for value, _ in marks]))
    # A narrow page has no room for legends beside its panels: they stand above them.
    above = style.narrow()
    rows = max(-(-len(panel[:MAX_CURVES]) // _columns(panel)) + (len(panel) > MAX_CURVES) for panel in panels)
    room = 0.1 + _LEGEND_ROW * rows
    longest = min(max(len(curve.of) for panel in panels for curve in panel[:MAX_CURVES]), _LEGEND_LETTERS)
    figure, axes = style.page(
        len(panels), 1, 1.57 if len(panels) <= _MAX_TALL_PANELS else 1.23, left=_LEFT,
        right=0.15 if above else 0.6 + 0.08 * longest, top=(0.4 if marks else 0.15) + room * above, bottom=0.5,
        down=room if above else 0.2, sharex=True,
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
    axes[-1].set_xlabel(over.label)
    tick_abscissa(axes[-1], over)
    clear_of_ticks(figure, axes)
    if before is not None:
        name_both(figure, before)
    return figure


def _draw_before(axis: Axes, panel: list[_Curve], before: Before, colors: dict[tuple[str, str], str]) -> None:
    """The curves of the study before, dashed, each in the colour of its name."""
    table, x = before.result.tables["motion"], abscissa(before.study, before.result.drawn["poses"]).values
    low, high = axis.get_ylim()
    for curve in panel[:MAX_CURVES]:
        if curve.column.name in table:
            color = colors[curve.of, "" if curve.order in _RANKS[:4] else curve.order]
            values = table[curve.column.name]
            axis.plot(x, values, color=color, linestyle=DASHES, linewidth=1.1, zorder=1.9)
            if curve.order == "position" and np.isfinite(values).any():
                low, high = min(low, float(np.nanmin(values))), max(high, float(np.nanmax(values)))
    # Near a dead centre rates grow without bound: their axis stays that of the study now.
    if (low, high) != axis.get_ylim():
        margin = 0.04 * (high - low)
        axis.set_ylim(low - margin, high + margin)


def _panels(study: Study, columns: list[Column], swept: str, x: Floats) -> list[list[_Curve]]:
    """Columns by kind and unit, in the order of `_RANKS`, the most informative first."""
    section = study.kinematics
    asked = section is not None and section.outputs
    values = {column.name: column.values for column in columns}
    unit_of = {column.name: column.unit for column in columns}
    units = study.units
    sizes = {units.label("angle"): 2 * np.pi / units.angle_factor, units.label("length"): study.mechanism.size}
    rank = ranks(study)
    # The condition of a single number is 1, that of each pose is for its table.
    left_out = {"conditioning"} | ({"inverse_condition"} if len(study.mechanism.drives) == 1 else set())
    panels: dict[tuple[str, str], list[_Curve]] = {}
    for column in columns:
        if column.values.dtype.kind != "f" or column.name in left_out or not np.isfinite(column.values).any():
            continue
        if column.name.endswith("_advantage"):
            continue  # has a picture with the transmission angles
        order = next((order for order in _ORDERS if column.name.endswith(f"_{order}")), "position")
        of = column.name.removesuffix(f"_{order}")
        if column.name in _RANKS:
            order = of = column.name
        position = values.get(of, column.values)
        if order in _RANKS[:3] and swept and _still(position - x, float(np.ptp(x))):
            continue  # the sweep over itself
        # Of what stands still only the position is drawn, and only where it is an output.
        told = order in ("error", "effort") or (order == "position" and asked and of not in study.mechanism.drives)
        if not told and _still(position, sizes.get(unit_of.get(of, ""), 1.0)):
            continue
        curve = _Curve(column, of, order)
        panels.setdefault((order, column.unit), []).append(curve)
    found = sorted(panels.values(), key=lambda panel: _RANKS.index(panel[0].order))[:MAX_CURVE_PANELS]
    for panel in found:
        if len(panel) > MAX_CURVES:
            panel.sort(key=lambda curve: -rank.get(curve.of.rpartition(".")[0], 1))
    return found


def _still(values: Floats, size: float) -> bool:
    known = values[np.isfinite(values)]
    return not len(known) or float(np.ptp(known)) <= _STILL * max(float(np.abs(known).max()), size)


def _coincide(one: Floats, other: Floats) -> bool:
    known = np.isfinite(one) & np.isfinite(other)
    span = max(float(np.ptp(one[known])), float(np.ptp(other[known]))) if known.any() else 0.0
    return bool(np.all(np.abs(one[known] - other[known]) <= _HIDDEN * span))


def _runs(invalid: Flags, x: Floats, limits: Floats) -> list[tuple[float, float]]:
    """Ranges of x that are not valid, up to the limit of motion where one lies beside them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], invalid, [False]]).astype(int)))
    found = []
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        ends = []
        for inner, outer in ((first, max(first - 1, 0)), (last, min(last + 1, len(x) - 1))):
            low, high = sorted((x[inner], x[outer]))
            between = limits[(limits >= low) & (limits <= high)] if len(limits) else limits
            ends.append(float(between[0]) if len(between) else float(x[inner] + x[outer]) / 2)
        found.append((ends[0], ends[1]))
    return found


def _shortened(name: str) -> str:
    return name if len(name) <= _LEGEND_LETTERS else f"{name[: _LEGEND_LETTERS - 1]}\N{HORIZONTAL ELLIPSIS}"


def _columns(panel: list[_Curve]) -> int:
    """Columns of a legend above a panel."""
    return fitting([_shortened(curve.of) for curve in panel[:MAX_CURVES]], style.width() - _LEFT - 0.3)


def _draw(axis: Axes, panel: list[_Curve], x: Floats, units: Units, colors: dict[tuple[str, str], str]) -> None:
    shown: list[Floats] = []
    for curve in panel[:MAX_CURVES]:
        values = curve.column.values
        # A name keeps its colour from its position to its acceleration.
        color = colors.setdefault((curve.of, "" if curve.order in _RANKS[:4] else curve.order), _COLORS[len(shown)])
        hidden = any(_coincide(values, other) for other in shown)
        # In grey the markers tell what the colours tell.
        which, every = _COLORS.index(color), max(len(x) // _MARKS, 1)
        marker = _MARKERS[which] if len(panel) > 1 else ""
        axis.plot(x, values, color=color, linestyle=(0, (3, 3)) if hidden else "-", label=_shortened(curve.of),
                  marker=marker, markersize=4, markevery=(which * every // len(_COLORS), every))  # fmt: skip
        shown.append(values)
    first = panel[0]
    title = first.order.replace("_", " ")
    if title == "position":
        kinds = {units.label("angle"): "angle", units.label("length"): "position"}
        title = kinds.get(first.column.unit, "value")
    title = title.replace("inverse ", "inverse\n")
    axis.set_ylabel(style.axis_label(title, first.column.unit).replace(" [", "\n["))
    axis.ticklabel_format(axis="y", scilimits=(-4, 4))
    known = np.concatenate([values[np.isfinite(values)] for values in shown])
    if np.ptp(known) <= _STILL * max(float(np.abs(known).max()), 1.0):
        # What stands still is drawn straight, not by its rounding.
        middle = float(known.mean())
        axis.set_ylim(middle - max(0.1 * abs(middle), 0.1), middle + max(0.1 * abs(middle), 0.1))
    elif first.order != "position":
        low, high = np.percentile(known, (_TAIL_PERCENT, 100 - _TAIL_PERCENT))
        if np.ptp(known) > _PEAK_RATIO * (high - low) > 0:
            # Near a dead centre rates grow without bound: what they are elsewhere stays legible.
            axis.set_ylim(low - 0.5 * (high - low), high + 0.5 * (high - low))
    if len(panel) > 1 or first.of != first.order:
        left_out = len(panel) - len(shown)
        note = f"and {left_out} more" if left_out else None
        place: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
        if style.narrow():
            place = {"loc": "lower left", "bbox_to_anchor": (-0.02, 0.97), "ncols": _columns(panel), "borderaxespad": 0}
        axis.legend(title=note, title_fontsize=9, alignment="left", **place)


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


def paths_figure(
    sweep: Sweep, *, above: float = ABOVE, centres: Table | None = None, before: Before | None = None
) -> Figure:
    """The first valid pose with its names, ghosts of later ones, paths of all moving points, places to pass through.

    The boldest paths have ticks at equal steps of time where the swept drive has a rate; `centres` are the instant
    centres, of which those against the ground have a path, too. A study before it lies under it in grey dashes.
    `above` it, inches are left for a title.
    """
    wanted = [
        target.table[:, -2] + 1j * target.table[:, -1]
        for target in sweep.study.targets.values()
        if target.table is not None and len(target.coordinates) == 2
    ]
    earlier = Sweep.of(before.result.drawn["motion"]) if before is not None else None
    centrodes = _centrodes(sweep, centres)
    middle, *sides = extent(sweep.extent)
    near = [path[np.abs(path - middle) <= _NEAR * max(sides)] for path in centrodes.values()]
    places = np.concatenate([sweep.extent, *wanted, *near, *([earlier.extent] if earlier is not None else [])])
    ticks = equal_times(sweep)
    room = style.width() - LEFT - RIGHT - _LEGEND_SYMBOL
    words = [style.folded(f"fixed centrode of {link}: path of its instant centre with the ground", 9, room)
             for link in centrodes]  # fmt: skip
    if told := sum(label.count("\n") + 1 for label in words) + (ticks is not None):
        above = max(above, TITLE + _LEGEND_LINE * (told - 1))
    figure, axes = framed(places, sweep.study.units.label("length"), height=HEIGHT, above=above)
    for path, label, dashes in zip(centrodes.values(), words, _CENTRODES * len(centrodes), strict=False):
        path = np.where(_leaps(path - middle, max(sides)), complex(np.nan, np.nan), path)
        axes.plot(path.real, path.imag, color=style.INK, linewidth=1.3, linestyle=dashes, zorder=2.75,
                  label=label)  # fmt: skip
    if ticks is not None:
        _draw_ticks(axes, sweep, *ticks)
    for path in wanted:
        axes.plot(
            path.real, path.imag, "o", color=style.VERMILION, linewidth=1.2, linestyle=(0, (1, 2.5)), markersize=3,
            zorder=3.7,
        )  # fmt: skip
    count = len(sweep.mechanism.description.links) - 1
    _, ghosts = next(entry for entry in _GHOSTS if count <= entry[0])
    # A closed motion ends where it begins: its last ghost would hide the first.
    some = sweep.valid[np.linspace(0, len(sweep.valid) - 1, ghosts + 1).round().astype(int)]
    for index in np.unique(some[1 : -1 if sweep.closed else None]):
        draw_ghost(axes, sweep.mechanism, sweep.configuration, int(index))
    if earlier is not None:
        draw_sweep(axes, earlier)
    draw_paths(axes, sweep)
    first = int(sweep.valid[0])
    draw_mechanism(axes, sweep.mechanism, sweep.configuration, first, travel=sweep.travel)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, handlelength=2.6)
    if before is not None:
        name_both(figure, before)
    return figure


def _centrodes(sweep: Sweep, centres: Table | None) -> dict[str, Complexes]:
    """Paths of the instant centres that links have with the ground, by the links; a pin of the ground stays."""
    found = {}
    for name in centres.names if centres is not None else ():
        pair, _, column = name.rpartition(".")
        links = pair.split(".")
        if column == "x" and GROUND in links and len(links) == 2 and centres is not None:
            path = vector(centres[name], centres[f"{pair}.y"])[sweep.rows]
            path[~np.isfinite(path)] = complex(np.nan, np.nan)
            known = path[np.isfinite(path)]
            if len(known) and np.abs(known - known[0]).max() > _STILL * sweep.mechanism.size:
                found[next(link for link in links if link != GROUND)] = path
    return found


def _leaps(path: Complexes, side: float) -> Flags:
    """Points from which a path leaps through infinity, by its places about the mechanism's middle."""
    far = np.abs(path) > side
    turned = (np.conj(path[:-1]) * path[1:]).real < 0
    return np.append(far[:-1] & far[1:] & turned, False)


def equal_times(sweep: Sweep) -> tuple[Ints, str] | None:
    """Poses at equal steps of time, and how long these are in words; None where the swept drive has no one rate."""
    section, poses = sweep.study.kinematics, sweep.poses
    moving = moving_names(poses)
    if section is None or not poses.motion or len(moving) != 1 or any(section.accelerations.values()):
        return None
    (name,) = moving
    rates = {key: rate for key, rate in section.rates.items() if rate}
    values = poses.values[name][sweep.rows]
    steps = np.diff(values)
    if set(rates) != {name} or np.ptp(steps) > _UNEVEN * abs(steps.mean()) or len(steps) < _FEWEST_TICKS:
        return None
    least = -(-len(steps) // _MOST_TICKS)
    stride = next((k for k in range(least, 2 * least + 1) if len(steps) % k == 0), least)
    step, units = abs(float(steps.mean())) * stride, sweep.study.units
    unit = units.label(sweep.mechanism.quantity(name))
    words = f"ticks every {step / abs(rates[name]):.3g} {units.time} ({step:.4g} {unit}".rstrip() + f" of {name})"
    return np.arange(0, len(values) - sweep.closed, stride), words


def _draw_ticks(axes: Axes, sweep: Sweep, rows: Ints, words: str) -> None:
    """Short lines across the boldest paths, of a length on paper."""
    ranked = ranks(sweep.study)
    shown = paper(axes, np.array([0.0, 1.0], dtype=complex))
    half, lines = _TICK / 2 / (shown[1, 0] - shown[0, 0]), []
    for point, path in sweep.places.items():
        if ranked[point] < max(ranked.values()):
            continue
        before, after = np.maximum(rows - 1, 0), np.minimum(rows + 1, len(path) - 1)
        with np.errstate(invalid="ignore"):
            along = np.where(np.isfinite(path[after]), path[after], path[rows])
            along = along - np.where(np.isfinite(path[before]), path[before], path[rows])
            across = 1j * half * along / np.abs(along)
        ends = np.stack([path[rows] - across, path[rows] + across], axis=1)
        lines += [np.column_stack([end.real, end.imag]) for end in ends if np.isfinite(end).all()]
    axes.add_collection(LineCollection(lines, colors=style.INK, linewidths=1.2, zorder=2.8), autolim=False)
    axes.plot([], [], color=style.INK, linewidth=0.8, marker="|", markersize=_TICK, markeredgewidth=1.2, label=words)


def draw_paths(axes: Axes, sweep: Sweep, width: float = 1.0) -> None:
    """Draw the path of every moving point, bold ones for outputs and coupler points, as `ranks` has them."""
    ranked = ranks(sweep.study)
    # Where all points are of a low rank, none is thin.
    lift = 2 - max(ranked.values(), default=2)
    colors = link_colors(sweep.mechanism)
    owners: dict[str, str] = {}
    for name, link in sweep.mechanism.description.links.items():
        if name != GROUND:
            for point in link_points(link):
                owners.setdefault(point, name)
    for point, path in sweep.traces.items():
        line, share = PATH_LOOKS[min(ranked[point] + lift, 2)]
        axes.plot(
            path.real, path.imag, color=colors[owners[point]], linewidth=line * width, alpha=share,
            zorder=2.5 + 0.1 * ranked[point], solid_joinstyle="round",
        )  # fmt: skip


def modes_figure(study: Study, result: Result) -> Figure:
    """A panel an assembly that has a valid pose, as many as the result carries, on one scale."""
    shown = [(title, Sweep.of(each)) for title, each in result.drawn["modes"].items()]
    found = result.counts["modes"]
    moving = int((result.tables["modes"]["valid"].reshape(found, -1) > 0).any(axis=1).sum())
    notes = []
    if moving > len(shown):
        notes.append(f"{len(shown)} of {moving} assemblies")
    if found > moving:
        notes.append(f"{found - moving} of {found} assemblies have no valid pose")
    places = np.concatenate([sweep.extent for _, sweep in shown])
    fitted = {
        columns: fit(places, *_room(columns, math.ceil(len(shown) / columns)), 0.4 if columns == 1 else 0.2)
        for columns in range(1, min(len(shown), _MAX_COLUMNS) + 1)
    }
    columns, window = max(fitted.items(), key=lambda item: item[1].scale)
    unit, top = study.units.label("length"), _NOTE if notes else 0.0
    figure, grid = windows(window, unit, len(shown), columns, gap=_GAP, above=_PANEL_TITLE, top=top)
    for axes, (title, sweep) in zip(grid, shown, strict=True):
        axes.set_title(title, loc="left", fontsize=10)
        draw_paths(axes, sweep, width=0.8)
        draw_mechanism(
            axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]), labels=columns == 1, drives=False,
            travel=sweep.travel, size=_SMALL_SYMBOLS if columns > 1 else 1.0,
        )  # fmt: skip
    figure.text(LEFT / style.width(), 1 - 0.22 / figure.get_figheight(), "; ".join(notes), fontsize=10)
    return figure


def _room(columns: int, rows: int) -> tuple[float, float]:
    """Largest width and height of a panel, inches: all of them on about one screen."""
    width = (style.width() - LEFT - RIGHT - _GAP * (columns - 1)) / columns
    return width, min(max(8.0 / rows, _MIN_HEIGHT), _MAX_HEIGHT)


def animation(result: Result) -> bytes:
    """The GIF of a study's sweep or path; no bytes for lists and grids of poses, which are no motion."""
    sweep = Sweep.of(result.drawn["motion"])
    return gif(sweep) if sweep.poses.motion and len(sweep.valid) else b""


def gif(sweep: Sweep) -> bytes:
    """The valid poses of a motion as an endless GIF; back again where it does not end where it began.

    At most `FRAMES` frames. Poses that are not valid have none; the title says how many.

    Matplotlib draws what stands still once and what moves in every frame; Pillow gives all frames one small palette, so
    that a frame stores only what changed: a tenth of the time and the bytes of `matplotlib.animation.PillowWriter`.
    """
    valid, closed = in_order(sweep), sweep.closed
    # A closed motion begins again with its last pose; another shows its inner poses twice.
    most = FRAMES + 1 if closed else FRAMES // 2 + 1
    some = valid[np.unique(np.linspace(0, len(valid) - 1, most).round().astype(int))]
    figure, axes = framed(sweep.extent, sweep.study.units.label("length"), height=HEIGHT, above=TITLE)
    figure.set_dpi(_GIF_WIDTH / style.width())
    draw_paths(axes, sweep)
    pictures = _frames(figure, axes, sweep, some[:-1] if closed and len(some) > 1 else some)
    pictures = pictures if closed else pictures + pictures[-2:0:-1]
    palette = _palette(pictures)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    pause = min(max(_CYCLE // len(frames), _MIN_FRAME), _MAX_FRAME) // 10 * 10
    stream = io.BytesIO()
    frames[0].save(stream, format="GIF", save_all=True, append_images=frames[1:], duration=pause, loop=0)
    return stream.getvalue()


def in_order(sweep: Sweep) -> np.ndarray:
    """Valid poses; a turn that does not close everywhere begins behind the gap, so that its motion is in one piece."""
    valid = sweep.valid
    gaps = np.flatnonzero(np.diff(valid) > 1)
    if sweep.returns and len(gaps):
        valid = np.roll(valid[1:], -gaps[0])
    return valid


def _frames(figure: Figure, axes: Axes, sweep: Sweep, indices: np.ndarray) -> list[Image.Image]:
    canvas: Any = figure.canvas  # the Agg canvas; its own methods have no types
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    failed = len(sweep.rows) - len(sweep.valid)
    note = f"   ({failed} of {len(sweep.rows)} poses not valid)" if failed else ""
    standing = set(axes.get_children())
    pictures = []
    for index in indices.tolist():
        draw_mechanism(
            axes, sweep.mechanism, sweep.configuration, index, labels=False, drives=False, travel=sweep.travel
        )
        axes.text(0.0, 1.02, sweep.words(index) + note, transform=axes.transAxes, fontsize=10.5, color=style.INK)
        moving = [artist for artist in axes.get_children() if artist not in standing]
        canvas.restore_region(still)
        for artist in sorted(moving, key=lambda artist: artist.get_zorder()):
            axes.draw_artist(artist)
            artist.remove()
        pictures.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    return pictures


def _palette(pictures: list[Image.Image]) -> Image.Image:
    """Colours that do for all frames, from some of them."""
    some = pictures[:: max(1, len(pictures) // 4)]
    width, height = some[0].size
    sheet = Image.new("RGB", (width, height * len(some)))
    for k, picture in enumerate(some):
        sheet.paste(picture, (0, k * height))
    found = sheet.quantize(colors=_GIF_COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    colors = np.array(found.getpalette()).reshape(-1, 3)
    # Means of the lightest colours are not quite the white of the page.
    colors[colors.min(axis=1) >= _WHITE] = 255
    palette = Image.new("P", (1, 1))
    palette.putpalette(colors.ravel().tolist())
    return palette
