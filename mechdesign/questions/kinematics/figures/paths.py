"""Paths of a mechanism's points along its motion, with ticks and crank angles, and the mechanism on its way."""

from __future__ import annotations

import cmath
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex

from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.labels import Label, paper
from mechdesign.drawing.marks import Late, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.overlay import both_named, sweep_marks
from mechdesign.drawing.panels import drawn_plane, moving_names
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.shapes import Color, darker, lighter, link_colors
from mechdesign.drawing.sweep import Sweep, ranks
from mechdesign.ground.numerics.arrays import Complexes, Ints
from mechdesign.ground.results import Table
from mechdesign.mechanism.four_bars import four_bars
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.study import Study
from mechdesign.study.schema.targets import Target

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
_MAX_COLUMNS = 4  # of assemblies


@picture(MotionView, "paths", order=10)
def paths_picture(view: MotionView) -> Picture | None:
    """The paths of a motion, with the class of few loops; None where no pose is valid."""
    if not view.sweep.poses.followed or not len(view.sweep.valid):
        return None
    kinds = _kinds(view.study, view.result.tables["loops"]) if "loops" in view.result.tables else []
    title = "Paths of the points" + " now and before" * (view.before is not None)
    return Picture(title, [paths_panel(view.sweep, before=view.before)], kinds)


def _kinds(study: Study, table: Table) -> list[str]:
    """Four-bars and slider-cranks by their joints, with their class; none where they are many."""
    loops = zip(four_bars(study.mechanism), table["kind"].tolist(), table["class"].tolist(), strict=True)
    words = [f"{kind} {' '.join(joint.name for joint in loop.joints)}: {of}" for loop, kind, of in loops]
    return words if len(words) <= _MOST_KINDS else []


def paths_panel(sweep: Sweep, more: Sequence[PanelMark] = (), before: Before | None = None) -> Panel:
    """The first valid pose with its names, ghosts of later ones, paths of all moving points, places to pass through.

    The boldest paths have ticks at equal steps of the swept coordinate, with its value beside some. A study before it
    lies under it in grey dashes.
    """
    dotted = {"marker": "o", "color": style.VERMILION, "linewidth": 1.2, "linestyle": (0, (1, 2.5)), "markersize": 3,
              "zorder": 3.7}  # fmt: skip
    marks: list[PanelMark] = []
    goals = goals_of(sweep.study)
    for target, places in goals.items():
        # Between the points of a curve nothing is asked.
        look = dotted if target.closed is None else dotted | {"linestyle": "none", "markersize": 4.5}
        marks.append(Trace(places.real, places.imag, look=look))
    count = len(sweep.mechanism.description.links) - 1
    _, ghosts = next(entry for entry in _GHOSTS if count <= entry[0])
    # A closed motion ends where it begins: its last ghost would hide the first.
    some = sweep.valid[np.linspace(0, len(sweep.valid) - 1, ghosts + 1).round().astype(int)]
    marks += [Posed(still, ghost=True) for still in sweep.scene.some(np.unique(some[1 : -1 if sweep.closed else None]))]
    marks += [*both_named(before), *path_marks(sweep)]
    shows, names = [sweep.extent, *goals.values()], _path_names(sweep)
    if before is not None:
        earlier = Sweep.of(DrawnMotion.of(before.result).shown)
        marks += sweep_marks(earlier)
        shows.append(earlier.extent)
    if steps := steps_of(sweep):
        tick = {"color": style.INK, "linewidth": 0.8, "marker": "|", "markersize": _TICK, "markeredgewidth": 1.2}
        marks += [Late(partial(_draw_steps, sweep, steps)), Trace([], [], label=f"ticks {steps.words}", look=tick)]
        names += _step_names(sweep, steps)
    marks += [*more, Posed(sweep.first, more=names)]
    return drawn_plane(marks, np.concatenate(shows), sweep.study, followed=True)


def goals_of(study: Study) -> dict[Target, Complexes]:
    """The places that points shall pass, by the targets and curves of a study."""
    targets = (*study.targets.values(), *study.curves.values())
    return {target: target.table[:, -2] + 1j * target.table[:, -1] for target in targets
            if target.table is not None and len(target.coordinates) == 2}  # fmt: skip


class SweepSteps(NamedTuple):
    """Poses at equal steps of what is swept, the step in words, and the values that are written beside some."""

    rows: Ints
    words: str
    written: Mapping[int, str]


def steps_of(sweep: Sweep) -> SweepSteps | None:
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
    return SweepSteps(rows, f"every {words}; numbers: {name}", written)


def _across(sweep: Sweep, steps: SweepSteps) -> Iterator[tuple[str, Complexes, Complexes]]:
    """Points of the boldest paths, their places at the steps, and the unit vectors across the path there."""
    ranked, rows = ranks(sweep.study), steps.rows
    for point, path in sweep.places.items():
        if ranked[point] == max(ranked.values()):
            before, after = np.maximum(rows - 1, 0), np.minimum(rows + 1, len(path) - 1)
            along = np.where(np.isfinite(path[after]), path[after], path[rows])
            along = along - np.where(np.isfinite(path[before]), path[before], path[rows])
            yield point, path[rows], 1j * along / np.abs(along)


def _draw_steps(sweep: Sweep, steps: SweepSteps, axes: Axes) -> None:
    """Short lines across the boldest paths, of a length on paper."""
    shown = paper(axes, np.array([0.0, 1.0], dtype=complex))
    half, lines = _TICK / 2 / (shown[1, 0] - shown[0, 0]), []
    for _, places, across in _across(sweep, steps):
        ends = np.stack([places - half * across, places + half * across], axis=1)
        lines += [np.column_stack([end.real, end.imag]) for end in ends if np.isfinite(end).all()]
    axes.add_collection(LineCollection(lines, colors=style.INK, linewidths=1.2, zorder=2.8), autolim=False)


def _step_names(sweep: Sweep, steps: SweepSteps) -> list[Label]:
    """The values that are written beside some steps."""
    looks = {look.point: look for look in path_looks(sweep)}
    return [
        Label(steps.written[row], (place,), darker(looks[point].color), _TICK / 2 + 1, cmath.phase(toward), _NUMBER,
              optional=True)
        for point, places, across in _across(sweep, steps)
        for row, place, toward in zip(steps.rows.tolist(), places.tolist(), across.tolist(), strict=True)
        if row in steps.written and cmath.isfinite(toward)
    ]  # fmt: skip


def path_marks(sweep: Sweep, width: float = 1.0) -> list[Trace]:
    """The path of every moving point, bold ones for outputs and coupler points, as `ranks` has them."""
    return [
        Trace(look.path.real, look.path.imag, look={
            "color": look.color, "linewidth": look.width * width, "alpha": look.share, "zorder": 2.5 + 0.1 * look.rank,
            "solid_joinstyle": "round"})
        for look in path_looks(sweep)
    ]  # fmt: skip


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
    ranked, colors = ranks(sweep.study), link_colors(sweep.mechanism.description)
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
def modes_picture(view: MotionView) -> Picture | None:
    """A panel an assembly that has a valid pose, as many of all as the record of the result has, on one scale."""
    if "modes" not in view.result.tables:
        return None
    table, count = view.result.tables["modes"], view.result.counts["modes"]
    shown = [(title, Sweep.of(motion)) for title, motion in view.drawn.modes.items()]
    moving = int((table["valid"].reshape(count, -1) > 0).any(axis=1).sum())
    notes = [f"{len(shown)} of {moving} assemblies"] * (moving > len(shown))
    notes += [f"{count - moving} of {count} assemblies have no valid pose"] * (count > moving)
    panels = [drawn_panel(sweep, title, names=True) for title, sweep in shown]
    return Picture("Assemblies", panels, ["; ".join(notes)], across=_MAX_COLUMNS, share="xy")


def drawn_panel(
    sweep: Sweep, title: str, more: Sequence[PanelMark] = (), *, names: bool = False, followed: bool = False
) -> Panel:
    """The first valid pose, and the paths of its points, if it moves, beside others on one scale."""
    paths = path_marks(sweep, 0.8) if sweep.poses.followed else ()
    posed = Posed(sweep.first, names=names, drives=False)
    return drawn_plane([*paths, *more, posed], sweep.extent, sweep.study, title, followed=followed)
