"""A chosen design: its mechanism, its targets, what it reaches, and the errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.mechanism import Mechanism
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.paths import draw_paths, paths_figure
from mechdesign.questions.optimize.analysis import DrawnDesign, drawn_design
from mechdesign.questions.optimize.figures.designs import listed
from mechdesign.questions.optimize.figures.front import chosen, described, marked
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.poses import Shown
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.boundary import regions_picture, workspace_picture
from mechdesign.questions.workspace.figures.regions import regions
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_ghost, draw_mechanism
from mechdesign.report.figures.framing import LEFT, RIGHT, extent, framed
from mechdesign.report.figures.layout import OVER
from mechdesign.report.figures.marks import Axis, Own, Panel, PanelMark, Picture, Trace
from mechdesign.report.figures.mechanism import sketch_and_first_pose
from mechdesign.report.figures.panels import MAX_PANELS, Along, abscissa
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep
from mechdesign.report.figures.ticks import tick
from mechdesign.results import Result, Table
from mechdesign.study import Study

# Angles at which the outline of a contained shape is drawn.
_OUTLINE = np.linspace(0.0, 2 * np.pi, 1441)
# Inches.
_HEIGHT = 5.0
_TITLE = 0.42
_TITLE_LINE = 0.18
_PANEL = 1.25
_PANEL_GAP = 0.42
_BELOW = 0.55
_LEGEND = 0.35
_BESIDE = 0.12
_SMALL_SYMBOLS = 0.7
_ROOM = 0.07  # of its size, about what is shown
_LETTERS_AN_INCH = 13.5
_CURVE_POSES = 240  # of the motion between listed poses
# Of more poses the values are joined by a line.
_MAX_DOTS = 15
# Looks of wanted and reached places, for few places and for many.
_LOOKS: dict[tuple[str, bool], dict[str, Any]] = {
    ("wanted", True): {"linestyle": "none", "marker": "x", "markersize": 6, "markeredgewidth": 1.5, "zorder": 4.6},
    ("reached", True): {"linestyle": "none", "marker": "o", "markersize": 2.6, "zorder": 4.5},
    ("wanted", False): {"linestyle": (0, (5, 2)), "linewidth": 3.0, "zorder": 3.7, "snap": False},
    ("reached", False): {"linewidth": 0.9, "zorder": 3.8, "snap": False},
}


class Reached(NamedTuple):
    """An output with a target over the poses: what it is, and by how much it misses."""

    output: str
    unit: str
    values: Floats | None
    error: Floats

    @property
    def worst(self) -> float:
        """The largest error."""
        return float(np.nanmax(np.abs(self.error)))


def reached(table: Table) -> list[Reached]:
    """Outputs with targets in a table of motion; the distance from a path only if there is no other error."""
    outputs = []
    for column in table.columns:
        output = column.name.removesuffix("_error")
        if output != column.name and np.isfinite(column.values).any():
            placed = output in table
            outputs.append(Reached(output, column.unit, table[output] if placed else None, column.values))
    return [curve for curve in outputs if curve.values is not None] or outputs


def design_figure(study: Study, motion: Result, words: str) -> Figure:
    """The mechanism in motion or at its listed poses, with target places; below, target curves and those reached."""
    sweep, table = Sweep.of(DrawnMotion.of(motion).shown), motion.tables["motion"]
    shown = reached(table)
    title = style.folded(words, 11.0, style.width() - LEFT)
    above = _TITLE + _TITLE_LINE * title.count("\n")
    if sweep.poses.followed:
        figure = paths_figure(sweep, above=above)
    else:
        worst = _worst(shown, sweep.valid)
        title += f", drawn at {'the worst pose, ' if shown else ''}{sweep.words(worst)}"
        title = style.folded(title.replace("\n", " "), 11.0, style.width() - LEFT)
        above = _TITLE + _TITLE_LINE * title.count("\n")
        figure = _posed(sweep, worst, _targets(table, shown), above)
    axes = figure.axes[0]
    axes.set_title(title, loc="left", fontsize=10.5)
    for mark in _target_marks(table, shown):
        mark.draw(axes).set_label(mark.label)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none").set_zorder(6)
    if shown:
        _panels(figure, abscissa(study, sweep.poses), shown[: MAX_PANELS // 2])
    return figure


def designs_picture(parts: Sequence[tuple[str, Shown, Result | None]]) -> Picture:
    """Designs side by side on one scale: each in its poses, under its words, with its motion where that was judged."""
    sweeps = [Sweep.of(shown) for _, shown, _ in parts]
    places, panels = np.concatenate([sweep.extent for sweep in sweeps]), []
    for (words, _, motion), sweep in zip(parts, sweeps, strict=True):
        table = motion.tables["motion"] if motion is not None else None
        targets = [] if table is None else [*_target_marks(table, reached(table))]
        panels.append((words, [*targets, Own(partial(_draw_design, sweep), late=True)]))
    middle, wide, tall = extent(places)
    half = np.array([wide, tall]) / 2 + _ROOM * max(wide, tall)
    unit = sweeps[0].study.units.label("length")
    x, y = (Axis(name, unit, ends=(at - side, at + side))
            for name, at, side in zip("xy", (middle.real, middle.imag), half.tolist(), strict=True))  # fmt: skip
    shown = [Panel(marks, x, y, words, equal=1.0, plane=True) for words, marks in panels]
    return Picture("", shown, across=1 if style.narrow() else len(shown), share="xy")


def _draw_design(sweep: Sweep, axes: Axes) -> None:
    """A design in its first valid pose, and the paths of its points."""
    if sweep.poses.followed:
        draw_paths(axes, sweep, width=0.8)
    draw_mechanism(
        axes, sweep.mechanism, sweep.configuration, int(sweep.valid[0]), labels=False, drives=False,
        travel=sweep.travel, size=_SMALL_SYMBOLS,
    )  # fmt: skip


def _worst(shown: Sequence[Reached], valid: Ints) -> int:
    """The valid pose with the largest error relative to the worst of its output; the first pose without targets."""
    if not shown:
        return int(valid[0])
    far = np.nanmax([np.abs(curve.error) / (curve.worst or 1.0) for curve in shown], axis=0)
    return int(valid[np.nanargmax(np.nan_to_num(far[valid], nan=-1.0))])


def _targets(table: Table, shown: Sequence[Reached]) -> dict[str, Complexes]:
    """Places where points should be at the poses, by point: what they reach less the error."""
    errors = {curve.output: curve.error for curve in shown}
    targets: dict[str, Complexes] = {}
    for point in dict.fromkeys(output.removesuffix(f".{axis}") for output in errors for axis in "xy"):
        names = [f"{point}.{axis}" for axis in "xy"]
        if all(name in table for name in names) and any(name in errors for name in names):
            x, y = (table[name] - errors.get(name, 0.0) for name in names)
            targets[point] = x + 1j * y
    return targets


def _target_marks(table: Table, shown: Sequence[Reached]) -> Iterator[Trace]:
    """Where points should be and where they are: crosses and dots at a few poses, lines along many."""
    for point, targets in _targets(table, shown).items():
        x, y = (table[f"{point}.{axis}"] for axis in "xy")
        few = len(targets) <= _MAX_DOTS
        wanted = {"color": style.VERMILION} | _LOOKS["wanted", few]
        yield Trace(targets.real, targets.imag, label=f"{point} wanted", look=wanted)
        yield Trace(x, y, label=f"{point} reached", look={"color": style.INK} | _LOOKS["reached", few])


def _posed(sweep: Sweep, index: int, targets: dict[str, Complexes], above: float) -> Figure:
    """The mechanism in one of its listed poses, pale in the others, and the curves of its points between them."""
    between = _between(sweep)
    curves = {point: between[point] for point in targets if point in between}
    places = np.concatenate([sweep.extent, *targets.values(), *curves.values()])
    figure, axes = framed(places, sweep.study.units.label("length"), height=_HEIGHT, above=above)
    for other in sweep.valid:
        if other != index:
            draw_ghost(axes, sweep.mechanism, sweep.configuration, int(other))
    for point, curve in curves.items():
        axes.plot(curve.real, curve.imag, color=style.BLUE, linewidth=1.6, zorder=3.6, label=f"path of {point}")
    draw_mechanism(axes, sweep.mechanism, sweep.configuration, index, travel=sweep.travel)
    return figure


def _between(sweep: Sweep) -> dict[str, Complexes]:
    """Paths of the points while a single drive runs through its listed values; none if they miss the listed poses."""
    mechanism: Mechanism = sweep.mechanism
    if len(mechanism.drives) != 1 or len(sweep.valid) < 2:
        return {}
    drive = mechanism.coordinate(*mechanism.drives)
    values = np.asarray(sweep.configuration.value(drive))[sweep.valid]
    moved = mechanism.forward.solve([np.linspace(values.min(), values.max(), _CURVE_POSES)], limits=False)
    at = mechanism.forward.solve([values], limits=False)
    paths = {}
    for point, path in sweep.places.items():
        same = np.abs(np.asarray(at.point(point)) - path[sweep.valid]) <= 1e-6 * mechanism.size
        if same.all():
            paths[point] = np.where(moved.valid, moved.point(point), complex(np.nan, np.nan))
    return paths


def _error_title(curve: Reached) -> str:
    """An output and its largest error."""
    words = f"{curve.output}: reached less wanted, in the poses at most {curve.worst:.3g} {curve.unit}".rstrip()
    return style.folded(words, 9.5, style.width() - LEFT)


def _panels(figure: Figure, over: Along, shown: Sequence[Reached]) -> None:
    """Below the drawing: scalar outputs as wanted and reached, and the error of every output, over the poses."""
    titles = {curve.output: _error_title(curve) for curve in shown}
    gap = _PANEL_GAP + style.line(9.5) * max(title.count("\n") for title in titles.values())
    rows = [(curve, part) for curve in shown for part in ("curve", "error")
            if part == "error" or (curve.values is not None and curve.output[-2:] not in (".x", ".y"))]  # fmt: skip
    room = len(rows) * (_PANEL + gap) + _BELOW
    style.grow(figure, below=room)
    height = figure.get_figheight()
    left, wide = LEFT / style.width(), 1 - (LEFT + RIGHT) / style.width()
    look: dict[str, Any] = {"marker": "o", "markersize": 4.0} if len(over.values) <= _MAX_DOTS else {}
    for k, (curve, part) in enumerate(rows):
        low = _BELOW + (len(rows) - 1 - k) * (_PANEL + gap)
        axes = figure.add_axes((left, low / height, wide, _PANEL / height))
        if part == "curve" and curve.values is not None:
            axes.plot(over.values, curve.values - curve.error, color=style.VERMILION, linestyle=(0, (5, 2)),
                      linewidth=2.4, label="wanted")  # fmt: skip
            axes.plot(over.values, curve.values, color=style.BLUE, linewidth=1.2, label="reached", **look)
            axes.legend(loc="best", ncols=2)
            axes.set_title(curve.output, loc="left", fontsize=9.5)
            axes.set_ylabel(style.axis_label("value", curve.unit))
        else:
            axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
            axes.plot(over.values, curve.error, color=style.BLUE, **look)
            axes.set_title(titles[curve.output], loc="left", fontsize=9.5)
            axes.set_ylabel(style.axis_label("error", curve.unit))
        axes.locator_params(axis="y", nbins=5)
        axes.set_label(f"{OVER}{over.label}")
        tick(axes.xaxis, over.axis, wide * style.width())
        axes.margins(x=0.02)
        if k == len(rows) - 1:
            axes.set_xlabel(over.label)
        else:
            axes.tick_params(labelbottom=False)


@picture(DesignsView, "optimum", order=80)
def optimum_figure(view: DesignsView) -> Figure | Picture:
    """The best design: in its workspace if that was judged, else in its motion.

    Of a front those that are marked in it, side by side.
    """
    drawn, designs, front = view.drawn, view.designs, view.front
    if front is not None:
        parts = [(described(designs, front, name, row), drawn_design(designs, chosen(designs, front, row)))
                 for name, row in marked(designs, front)]  # fmt: skip
        moving = [(words, own.shown, own.motion) for words, own in parts
                  if own.shown is not None and own.shown.configuration.valid.any()]  # fmt: skip
        if len(parts) > 1 and len(moving) == len(parts):
            return designs_picture(moving)
        judged = [(words, own.study, regions(own.study, own.region)[0], [*_contained(own)]) for words, own in parts
                  if own.region is not None]  # fmt: skip
        if len(parts) > 1 and len(judged) == len(parts):
            return regions_picture(judged, "some designs of the front where they are best conditioned")
    best, words = drawn.best, ", ".join(listed(designs, designs.design(designs.best)))
    if best.region is not None:
        region = regions(best.study, best.region)[0]
        there = f", at {region.title}" if region.title else ""
        dotted = "; dotted: what it contains" if best.contained else ""
        title, shown = f"the best design, {words}{there}{dotted}", DrawnRegion.of(best.region)
        return workspace_picture(best.study, shown, region, title, more=[*_contained(best)])
    words = f"The best design, {words}"
    if best.motion is not None:
        return design_figure(best.study, best.motion, words)
    return sketch_and_first_pose(best.study, best.shown, words)


def _contained(own: DrawnDesign) -> Iterator[PanelMark]:
    """Outline of what a workspace is to contain."""
    for shape, centre in own.contained:
        z = centre + shape.radius(_OUTLINE) * np.exp(1j * _OUTLINE)
        yield Trace(z.real, z.imag, look={"color": style.INK, "linestyle": ":", "linewidth": 1.6, "zorder": 5})
