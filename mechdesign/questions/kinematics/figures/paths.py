"""Paths of a mechanism's points along its motion, with ticks and crank angles, and the mechanism on its way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from mechdesign.mechanism.four_bars import four_bars
from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes, Ints
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism
from mechdesign.report.figures.framing import ABOVE, LEFT, RIGHT, TITLE, framed, tiled, windows
from mechdesign.report.figures.labels import Label, paper
from mechdesign.report.figures.layout import PLANE
from mechdesign.report.figures.overlay import draw_sweep, name_both
from mechdesign.report.figures.panels import moving_names
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep, ranks
from mechdesign.report.figures.shapes import Color, darker, lighter, link_colors
from mechdesign.results import Table
from mechdesign.study import Study

HEIGHT = 5.6  # inches, of a mechanism along its motion at most
_LEGEND_LINE = 0.19  # inches
_TICKS = 0.4  # inches, the word before those of ticks
_LEGEND_SYMBOL = 0.6  # inches, of a legend's lines beside their words
# Largest number of moving links, and for it the number of ghosts.
_GHOSTS = ((3, 7), (5, 6), (8, 4), (10**6, 2))
# Line width and share of colour of a path by the rank of its point.
_LOOKS = {2: (2.2, 1.0), 1: (1.1, 0.9), 0: (0.9, 0.55)}
# Colours of several bold paths of one link.
_SHADES: tuple[Callable[[str], Color], ...] = (
    str,
    lambda color: darker(color, 0.55),
    lambda color: lighter(color, 0.35),
)
_MOST_KINDS = 2  # loops whose class is written above the drawing
# Of ticks at equal steps.
_TICK = 9.0  # points, across a path
_MOST_TICKS = 24  # along a motion
_MOST_NUMBERS, _FEWEST_NUMBERS = 12, 3  # beside all paths, beside one
_NUMBER = 8.0  # points, the type of a number
_ROUND_ANGLES = (15, 30, 45, 60, 90, 120, 180)  # steps of numbers, degrees
_FEWEST_TICKS = 4
_UNEVEN = 2e-3  # greatest difference of steps of an even sweep, as a part of their mean
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
    if not view.sweep.poses.followed or not len(view.sweep.valid):
        return None
    tables = view.result.tables
    kinds = _kinds(view.study, tables["loops"]) if "loops" in tables else []
    return paths_figure(view.sweep, kinds=kinds, before=view.before)


def _kinds(study: Study, table: Table) -> list[str]:
    """Four-bars and slider-cranks by their joints, with their class; none where they are many."""
    loops = zip(four_bars(study.mechanism), table["kind"].tolist(), table["class"].tolist(), strict=True)
    words = [f"{kind} {' '.join(joint.name for joint in loop.joints)}: {of}" for loop, kind, of in loops]
    return words if len(words) <= _MOST_KINDS else []


def paths_figure(
    sweep: Sweep, *, above: float = ABOVE, kinds: Sequence[str] = (),
    before: Before | None = None,
) -> Figure:  # fmt: skip
    """The first valid pose with its names, ghosts of later ones, paths of all moving points, places to pass through.

    The boldest paths have ticks at equal steps of the swept coordinate, with its value beside some; `kinds` are words
    about its loops. A study before it lies under it in grey dashes. `above` it, inches are left for a title.
    """
    goals = [
        target.table[:, -2] + 1j * target.table[:, -1]
        for target in sweep.study.targets.values()
        if target.table is not None and len(target.coordinates) == 2
    ]
    earlier = Sweep.of(DrawnMotion.of(before.result).shown) if before is not None else None
    places = np.concatenate([sweep.extent, *goals, *([earlier.extent] if earlier is not None else [])])
    steps = steps_of(sweep)
    room = style.width() - LEFT - RIGHT - _LEGEND_SYMBOL
    kinds = [style.folded(kind, 9, room) for kind in kinds]
    if steps is not None:
        steps = steps._replace(words=style.folded(steps.words, 9, room - _TICKS))
    if rows := sum(label.count("\n") + 1 for label in (*kinds, *([steps.words] if steps is not None else []))):
        above = max(above, TITLE + _LEGEND_LINE * (rows - 1))
    figure, axes = framed(places, sweep.study.units.label("length"), height=HEIGHT, above=above)
    axes.set_label(PLANE)
    for kind in kinds:
        axes.plot([], [], " ", label=kind)
    numbers = _draw_steps(axes, sweep, steps) if steps is not None else []
    for path in goals:
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
    more = [*_path_names(sweep), *numbers]
    draw_mechanism(axes, sweep.mechanism, sweep.configuration, first, travel=sweep.travel, more=more)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, handlelength=2.6)
    name_both(figure, before)
    return figure


class Steps(NamedTuple):
    """Poses at equal steps of what is swept, the step in words, and the values that are written beside some."""

    rows: Ints
    words: str
    written: Mapping[int, str]


def steps_of(sweep: Sweep) -> Steps | None:
    """Steps of a sweep of one coordinate, with their time where it has a constant rate; None of other motions."""
    section, poses = sweep.study.kinematics, sweep.poses
    moving = moving_names(poses)
    if section is None or not poses.followed or len(moving) != 1:
        return None
    (name,) = moving
    values = poses.values[name][sweep.rows]
    steps = np.diff(values)
    if np.ptp(steps) > _UNEVEN * abs(steps.mean()) or len(steps) < _FEWEST_TICKS:
        return None
    least = -(-len(steps) // _MOST_TICKS)
    stride = next((k for k in range(least, 2 * least + 1) if len(steps) % k == 0), least)
    step, units = abs(float(steps.mean())) * stride, sweep.study.units
    unit = units.label(sweep.mechanism.quantity(name))
    words = f"{step:.4g} {unit}".rstrip() + f" of {name}"
    rates = {key: rate for key, rate in section.rates.items() if rate}
    if set(rates) == {name} and not any(section.accelerations.values()):
        words = f"{step / abs(rates[name]):.3g} {units.time}".rstrip() + f" ({words})"
    rows = np.arange(0, len(values) - sweep.closed, stride)
    bold = list(ranks(sweep.study).values())
    most = max(_MOST_NUMBERS // bold.count(max(bold)), _FEWEST_NUMBERS)
    spacing = -(-len(rows) // most)
    if unit == "deg":
        spacing = next((k for k in range(spacing, len(rows)) if round(k * step, 6) in _ROUND_ANGLES), spacing)
    degree = "\N{DEGREE SIGN}" * (unit == "deg")
    written = {k: f"{values[k]:.4g}{degree}" for k in rows[::spacing].tolist()}
    return Steps(rows, f"every {words}; numbers: {name}", written)


def _draw_steps(axes: Axes, sweep: Sweep, steps: Steps) -> list[Label]:
    """Short lines across the boldest paths, of a length on paper; returns the numbers to be written beside some."""
    ranked, looks = ranks(sweep.study), {look.point: look for look in path_looks(sweep)}
    shown = paper(axes, np.array([0.0, 1.0], dtype=complex))
    half, lines, numbers = _TICK / 2 / (shown[1, 0] - shown[0, 0]), [], []
    for point, path in sweep.places.items():
        if ranked[point] < max(ranked.values()):
            continue
        rows = steps.rows
        before, after = np.maximum(rows - 1, 0), np.minimum(rows + 1, len(path) - 1)
        with np.errstate(invalid="ignore"):
            along = np.where(np.isfinite(path[after]), path[after], path[rows])
            along = along - np.where(np.isfinite(path[before]), path[before], path[rows])
            across = 1j * half * along / np.abs(along)
        ends = np.stack([path[rows] - across, path[rows] + across], axis=1)
        lines += [np.column_stack([end.real, end.imag]) for end in ends if np.isfinite(end).all()]
        color = darker(looks[point].color)
        for row, toward in zip(rows.tolist(), across.tolist(), strict=True):
            if row in steps.written and np.isfinite(toward):
                numbers.append(Label(steps.written[row], (complex(path[row]),), color, _TICK / 2 + 1,
                                     float(np.angle(toward)), _NUMBER, optional=True))  # fmt: skip
    axes.add_collection(LineCollection(lines, colors=style.INK, linewidths=1.2, zorder=2.8), autolim=False)
    axes.plot([], [], color=style.INK, linewidth=0.8, marker="|", markersize=_TICK, markeredgewidth=1.2,
              label=f"ticks {steps.words}")  # fmt: skip
    return numbers


def draw_paths(axes: Axes, sweep: Sweep, width: float = 1.0) -> None:
    """Draw the path of every moving point, bold ones for outputs and coupler points, as `ranks` has them."""
    for look in path_looks(sweep):
        axes.plot(
            look.path.real, look.path.imag, color=look.color, linewidth=look.width * width, alpha=look.share,
            zorder=2.5 + 0.1 * look.rank, solid_joinstyle="round",
        )  # fmt: skip


class PathLook(NamedTuple):
    """How the path of a point is drawn: in a shade of its link's colour, the wider and stronger the higher its rank."""

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
        for point in link.all_points if name != GROUND else ():
            owners.setdefault(point, name)
    looks, shaded = [], Counter[str]()
    for point, path in sweep.traces.items():
        color, look = colors[owners[point]], _LOOKS[min(ranked[point] + lift, 2)]
        if look is _LOOKS[2]:
            shade = _SHADES[shaded[owners[point]] % len(_SHADES)]
            color = to_hex(shade(color))
            shaded[owners[point]] += 1
        looks.append(PathLook(point, path, color, *look, ranked[point]))
    return sorted(looks, key=lambda look: look.rank)


def _path_names(sweep: Sweep) -> list[Label]:
    """Names of bold paths of which a link has several, each where it is far from the place of the point itself."""
    looks = [look for look in path_looks(sweep) if look.width == _LOOKS[2][0]]
    links = [link for name, link in sweep.mechanism.description.links.items() if name != GROUND]
    several = {point for link in links if sum(look.point in link.all_points for look in looks) > 1
               for point in link.all_points}  # fmt: skip
    labels = []
    for look in looks:
        far = np.nan_to_num(np.abs(look.path - look.path[np.isfinite(look.path)][0]))
        anchors = look.path[np.argsort(-far)[: len(far) // 3 : max(len(far) // 12, 1)]].tolist()
        if look.point in several and anchors:
            labels.append(Label(f"path of {look.point}", anchors, darker(look.color), 6.0, size=9.0, optional=True))
    return labels


@picture(MotionView, "modes", order=50)
def modes_figure(view: MotionView) -> Figure | None:
    """A panel an assembly that has a valid pose, as many of all as the record of the result has, on one scale."""
    if "modes" not in view.result.tables:
        return None
    study, table, count = view.study, view.result.tables["modes"], view.result.counts["modes"]
    shown = [(title, Sweep.of(motion)) for title, motion in view.drawn.modes.items()]
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
