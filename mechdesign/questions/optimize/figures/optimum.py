"""A chosen design: its mechanism, its targets, what it reaches, and the errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import Axis, Lines, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.mechanism import sketch_and_first_pose
from mechdesign.drawing.panels import MAX_PANELS, Along, abscissa, drawn_plane, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.results import Result, Table
from mechdesign.mechanism import Mechanism
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.kinematics.figures.paths import drawn_panel, paths_panel
from mechdesign.questions.optimize.analysis import DrawnDesign, drawn_design
from mechdesign.questions.optimize.figures.designs import listed
from mechdesign.questions.optimize.figures.front import chosen, described, marked
from mechdesign.questions.optimize.figures.view import DesignsView
from mechdesign.questions.poses import Shown
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.boundary import regions_picture, workspace_picture
from mechdesign.questions.workspace.figures.regions import regions
from mechdesign.study import Study

# Angles at which the outline of a contained shape is drawn.
_OUTLINE = np.linspace(0.0, 2 * np.pi, 1441)
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


class TargetedOutput(NamedTuple):
    """An output with a target over the poses: what it is, and by how much it misses."""

    output: str
    unit: str
    values: Floats | None
    error: Floats

    @property
    def worst(self) -> float:
        """The largest error."""
        return float(np.nanmax(np.abs(self.error)))


def reached(table: Table) -> list[TargetedOutput]:
    """Outputs with targets in a table of motion; the distance from a path only if there is no other error."""
    outputs = []
    for column in table.columns:
        output = column.name.removesuffix("_error")
        if output != column.name and np.isfinite(column.values).any():
            placed = output in table
            outputs.append(TargetedOutput(output, column.unit, table[output] if placed else None, column.values))
    return [curve for curve in outputs if curve.values is not None] or outputs


def design_picture(study: Study, motion: Result, words: str) -> Picture:
    """The mechanism in motion or at its listed poses, with target places; below, target curves and those reached."""
    drawn, table = DrawnMotion.of(motion), motion.tables["motion"]
    sweep, shown, curves = Sweep.of(drawn.shown), reached(table), drawn.finer
    targets = [*_target_marks(table, shown)]
    if sweep.poses.followed:
        panel = paths_panel(sweep, targets)
    else:
        worst = _worst(shown, sweep.valid)
        words += f", drawn at {'the worst pose, ' if shown else ''}{sweep.words(worst)}"
        panel = _posed(sweep, worst, _targets(table, shown), targets)
    over = reached(curves.rows_of(table, drawn))[: MAX_PANELS // 2]
    return Picture(words, [panel, *_over_poses(abscissa(study, curves.shown.poses), over)])


def designs_picture(parts: Sequence[tuple[str, Shown, Result | None]]) -> Picture:
    """Designs side by side on one scale: each in its poses, under its words, with its motion where that was judged."""
    panels = []
    for words, shown, motion in parts:
        table = motion.tables["motion"] if motion is not None else None
        targets = [] if table is None else [*_target_marks(table, reached(table))]
        panels.append(drawn_panel(Sweep.of(shown), words, targets, followed=True))
    return Picture("", panels, across=len(panels), share="xy")


def _worst(shown: Sequence[TargetedOutput], valid: Ints) -> int:
    """The valid pose with the largest error relative to the worst of its output; the first pose without targets."""
    if not shown:
        return int(valid[0])
    far = np.nanmax([np.abs(curve.error) / (curve.worst or 1.0) for curve in shown], axis=0)
    return int(valid[np.nanargmax(np.nan_to_num(far[valid], nan=-1.0))])


def _targets(table: Table, shown: Sequence[TargetedOutput]) -> dict[str, Complexes]:
    """Places where points should be at the poses, by point: what they reach less the error."""
    errors = {curve.output: curve.error for curve in shown}
    targets: dict[str, Complexes] = {}
    for point in dict.fromkeys(output.removesuffix(f".{axis}") for output in errors for axis in "xy"):
        names = [f"{point}.{axis}" for axis in "xy"]
        if all(name in table for name in names) and any(name in errors for name in names):
            x, y = (table[name] - errors.get(name, 0.0) for name in names)
            targets[point] = x + 1j * y
    return targets


def _target_marks(table: Table, shown: Sequence[TargetedOutput]) -> Iterator[Trace]:
    """Where points should be and where they are: crosses and dots at a few poses, lines along many."""
    for point, targets in _targets(table, shown).items():
        x, y = (table[f"{point}.{axis}"] for axis in "xy")
        few = len(targets) <= _MAX_DOTS
        wanted = {"color": style.VERMILION} | _LOOKS["wanted", few]
        yield Trace(targets.real, targets.imag, label=f"{point} wanted", look=wanted)
        yield Trace(x, y, label=f"{point} reached", look={"color": style.INK} | _LOOKS["reached", few])


def _posed(sweep: Sweep, index: int, targets: dict[str, Complexes], more: Sequence[PanelMark]) -> Panel:
    """The mechanism in one of its listed poses, pale in the others, and the curves of its points between them."""
    curves = {point: curve for point, curve in _between(sweep).items() if point in targets}
    look = {"color": style.BLUE, "linewidth": 1.6, "zorder": 3.6}
    marks: list[PanelMark] = [Trace(curve.real, curve.imag, label=f"path of {point}", look=look)
                              for point, curve in curves.items()]  # fmt: skip
    marks += [Posed(still, ghost=True) for still in sweep.scene.some(sweep.valid[sweep.valid != index])]
    places = np.concatenate([sweep.extent, *targets.values(), *curves.values()])
    return drawn_plane([*marks, *more, Posed(sweep.at(index))], places, sweep.study)


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


def _over_poses(over: Along, shown: Sequence[TargetedOutput]) -> Iterator[Panel]:
    """Scalar outputs as wanted and reached, and the error of every output, over the poses."""
    dots: dict[str, Any] = {"marker": "o", "markersize": 4.0} if len(over.values) <= _MAX_DOTS else {}
    blue = {"color": style.BLUE} | dots
    for curve in shown:
        if curve.values is not None and curve.output[-2:] not in (".x", ".y"):
            dashed = {"color": style.VERMILION, "linestyle": (0, (5, 2)), "linewidth": 2.4}
            marks = [Trace(over.values, curve.values - curve.error, label="wanted", look=dashed),
                     Trace(over.values, curve.values, label="reached", look=blue | {"linewidth": 1.2})]  # fmt: skip
            yield Panel(marks, over.wider, Axis(curve.output, curve.unit))
        worst = quantity(curve.worst, curve.unit).rstrip()
        words = f"{curve.output}: reached less wanted, at most {worst}"
        zero = Lines([0.0], look={"color": style.FAINT, "linewidth": 0.8})
        yield Panel([zero, Trace(over.values, curve.error, look=blue)], over.wider, Axis("error", curve.unit), words)


@picture(DesignsView, "optimum", order=80)
def optimum_picture(view: DesignsView) -> Picture:
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
        return design_picture(best.study, best.motion, words)
    return sketch_and_first_pose(best.study, best.shown, words)


def _contained(own: DrawnDesign) -> Iterator[PanelMark]:
    """Outline of what a workspace is to contain."""
    for shape, centre in own.contained:
        z = centre + shape.radius(_OUTLINE) * np.exp(1j * _OUTLINE)
        yield Trace(z.real, z.imag, look={"color": style.INK, "linestyle": ":", "linewidth": 1.6, "zorder": 5})
