"""Paths of a mechanism's points along its motion, with ticks of time and centrodes, and the mechanism on its way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from mechdesign.mechanism.algebra import vector
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes, Flags, Ints
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism
from mechdesign.report.figures.framing import ABOVE, LEFT, PLANE, RIGHT, TITLE, extent, framed, tiled, windows
from mechdesign.report.figures.labels import paper
from mechdesign.report.figures.overlay import draw_sweep, name_both
from mechdesign.report.figures.panels import moving_names
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep, link_points, ranks
from mechdesign.report.figures.shapes import link_colors
from mechdesign.results import Table

HEIGHT = 5.6  # inches, of a mechanism along its motion at most
_LEGEND_LINE = 0.19  # inches
_LEGEND_SYMBOL = 0.6  # inches, of a legend's lines beside their words
# Largest number of moving links, and for it the number of ghosts.
_GHOSTS = ((3, 7), (5, 6), (8, 4), (10**6, 2))
# Line width and share of colour of a path by the rank of its point.
_LOOKS = {2: (2.2, 1.0), 1: (1.1, 0.9), 0: (0.9, 0.55)}
# Of ticks at equal steps of time.
_TICK = 9.0  # points, across a path
_MOST_TICKS = 24  # along a motion
_FEWEST_TICKS = 4
_UNEVEN = 2e-3  # greatest difference of steps of an even sweep, as a part of their mean
# Of centrodes.
_CENTRODES = ((0, (7, 2, 1.5, 2)), (0, (7, 2, 1.5, 2, 1.5, 2)), (0, (3, 2)))  # dashes
_NEAR = 0.75  # distance from the middle, in sizes of the mechanism, up to which a centrode widens the window
_STILL = 1e-9  # a centre that moves less than this part of the mechanism's size is fixed
# Of the panels of assemblies.
_MAX_COLUMNS = 4
_PADS = (0.4, 0.2)  # inches around what is drawn, in one column and in several
_PAGE = 8.0  # inches, of all panels together, about
_MIN_HEIGHT = 1.2  # inches, of a panel
_TITLE = 0.3  # inches above a panel
_NOTE = 0.3  # inches above all panels
_GAP = 0.12  # inches between panels
_SMALL_SYMBOLS = 0.6


@picture(MotionView, "paths", order=10)
def motion_paths_figure(view: MotionView) -> Figure | None:
    """The paths of a motion; None where no pose is valid."""
    if not view.sweep.poses.motion or not len(view.sweep.valid):
        return None
    return paths_figure(view.sweep, centres=view.result.tables.get("instant_centres"), before=view.before)


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
    earlier = Sweep.of(DrawnMotion.of(before.result).shown) if before is not None else None
    centrodes = _centrodes(sweep, centres)
    middle, *sides = extent(sweep.extent)
    near = [path[np.abs(path - middle) <= _NEAR * max(sides)] for path in centrodes.values()]
    places = np.concatenate([sweep.extent, *wanted, *near, *([earlier.extent] if earlier is not None else [])])
    ticks = equal_times(sweep)
    room = style.width() - LEFT - RIGHT - _LEGEND_SYMBOL
    words = [style.folded(f"fixed centrode of {link}: path of its instant centre with the ground", 9, room)
             for link in centrodes]  # fmt: skip
    if rows := sum(label.count("\n") + 1 for label in words) + (ticks is not None):
        above = max(above, TITLE + _LEGEND_LINE * (rows - 1))
    figure, axes = framed(places, sweep.study.units.label("length"), height=HEIGHT, above=above)
    axes.set_label(PLANE)
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
    name_both(figure, before)
    return figure


def _centrodes(sweep: Sweep, centres: Table | None) -> dict[str, Complexes]:
    """Paths of the instant centres that links have with the ground, by the links; a pin of the ground stays."""
    if centres is None:
        return {}
    centrodes = {}
    for name in centres.names:
        pair, _, column = name.rpartition(".")
        links = pair.split(".")
        if column == "x" and GROUND in links and len(links) == 2:
            path = vector(centres[name], centres[f"{pair}.y"])[sweep.rows]
            path[~np.isfinite(path)] = complex(np.nan, np.nan)
            known = path[np.isfinite(path)]
            if len(known) and np.abs(known - known[0]).max() > _STILL * sweep.mechanism.size:
                centrodes[next(link for link in links if link != GROUND)] = path
    return centrodes


def _leaps(path: Complexes, side: float) -> Flags:
    """Points after which a path passes through infinity; `path` is relative to the mechanism's middle."""
    far = np.abs(path) > side
    turned = (np.conj(path[:-1]) * path[1:]).real < 0
    return np.append(far[:-1] & far[1:] & turned, False)


def equal_times(sweep: Sweep) -> tuple[Ints, str] | None:
    """Poses at equal steps of time, and the step in words; None where the swept drive has no constant rate."""
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
    for look in path_looks(sweep):
        axes.plot(
            look.path.real, look.path.imag, color=look.color, linewidth=look.width * width, alpha=look.share,
            zorder=2.5 + 0.1 * look.rank, solid_joinstyle="round",
        )  # fmt: skip


class PathLook(NamedTuple):
    """How the path of a point is drawn: in the colour of its link, and the wider and stronger the higher its rank."""

    point: str
    path: Complexes
    color: str
    width: float
    share: float  # of its colour
    rank: int


def path_looks(sweep: Sweep) -> list[PathLook]:
    """The path of every moving point, those of a low rank first."""
    ranked, colors = ranks(sweep.study), link_colors(sweep.mechanism)
    # Where all points are of a low rank, none is thin.
    lift = 2 - max(ranked.values(), default=2)
    owners: dict[str, str] = {}
    for name, link in sweep.mechanism.description.links.items():
        for point in link_points(link) if name != GROUND else ():
            owners.setdefault(point, name)
    looks = [PathLook(point, path, colors[owners[point]], *_LOOKS[min(ranked[point] + lift, 2)], ranked[point])
             for point, path in sweep.traces.items()]  # fmt: skip
    return sorted(looks, key=lambda look: look.rank)


@picture(MotionView, "modes", order=50)
def modes_figure(view: MotionView) -> Figure | None:
    """A panel an assembly that has a valid pose, as many of all as the record of the result has, on one scale."""
    if "modes" not in view.result.tables:
        return None
    study, table, count = view.study, view.result.tables["modes"], view.result.counts["modes"]
    shown = [(title, Sweep.of(each)) for title, each in view.drawn.modes.items()]
    moving = int((table["valid"].reshape(count, -1) > 0).any(axis=1).sum())
    notes = []
    if moving > len(shown):
        notes.append(f"{len(shown)} of {moving} assemblies")
    if count > moving:
        notes.append(f"{count - moving} of {count} assemblies have no valid pose")
    places = np.concatenate([sweep.extent for _, sweep in shown])
    columns, window = tiled(places, len(shown), _MAX_COLUMNS, gap=_GAP, pads=_PADS, page=_PAGE, least=_MIN_HEIGHT)
    unit, top = study.units.label("length"), _NOTE if notes else 0.0
    figure, grid = windows(window, unit, len(shown), columns, gap=_GAP, above=_TITLE, top=top)
    for axes, (title, sweep) in zip(grid, shown, strict=True):
        axes.set_title(title, loc="left", fontsize=10)
        draw_paths(axes, sweep, width=0.8)
        draw_mechanism(
            axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]), labels=columns == 1, drives=False,
            travel=sweep.travel, size=_SMALL_SYMBOLS if columns > 1 else 1.0,
        )  # fmt: skip
    figure.text(LEFT / style.width(), 1 - 0.22 / figure.get_figheight(), "; ".join(notes), fontsize=10)
    return figure
