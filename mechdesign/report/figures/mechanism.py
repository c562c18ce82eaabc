"""The mechanism as the study means it: its sketch pose, its first pose, and how roughly the sketch is drawn."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.errors import MechdesignError
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Fixed
from mechdesign.motion.solving import solve_rows
from mechdesign.numerics.arrays import evenly
from mechdesign.questions.dynamics.free_bodies import mass_centers
from mechdesign.questions.kinematics.drawn import DrawnPoses
from mechdesign.questions.poses import Shown, solve_shown
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw, draw_mechanism
from mechdesign.report.figures.framing import LEFT, RIGHT, fit, framed, windows
from mechdesign.report.figures.labels import paper
from mechdesign.report.figures.scene import Scene, Sweep, pose, travels
from mechdesign.report.figures.shapes import Travel, center_shapes
from mechdesign.results import Result
from mechdesign.study import Study

Panel = tuple[str, Configuration, int]
SKETCH_POSE = "Sketch pose"
_POSES = 100  # poses from which the range of the motion is taken
_TITLE = 0.42  # inches
_TITLE_LINE = 0.18  # inches, a further line of a title
_MAX_HEIGHT = 4.2  # inches, of a panel
_MAX_STACKED_HEIGHT = 3.0  # inches, of a panel below another
_ALIKE = 0.02  # part of the mechanism's size by which the points of two poses differ that need not both be drawn
_ROUGH = 10.0  # points on paper: a place drawn nearer than this lies under the symbol of its joint
_MIN_BRACKET = 0.005  # part of the mechanism's size: nearer to a beam than this, a bracket is too short to be seen
_BEAM_ORDER = 3.3  # above links and slots, below pins and names


def mechanism_figure(study: Study, result: Result) -> Figure:
    """The sketch pose, and the first pose of the study's kinematics, on one scale.

    Of a reliability it is the pose that its samples follow. Use inside `style.context`.
    """
    worst = _worst(study, result)
    if worst is not None:
        sketch = study.mechanism.sketch_configuration
        scenes = [pose(study.mechanism, configuration) for configuration in (sketch, worst[1])]
        if scenes[1] is not None:
            return _compose(study, [(SKETCH_POSE, sketch, 0), (*worst, 0)], travels(scenes))
    if not isinstance(result.drawn, DrawnPoses):
        return sketch_and_first_pose(study, None)
    return sketch_and_first_pose(study, result.drawn.shown, masses=result.drawn.name == "dynamics")


def sketch_and_first_pose(
    study: Study, shown: Shown | None, title: str = SKETCH_POSE, *, masses: bool = False
) -> Figure:  # fmt: skip
    """The sketch pose under a title, and the first of some poses; without any, a few of the kinematics are solved.

    With `masses` the centres of mass are marked.
    """
    mechanism = study.mechanism
    sketch = mechanism.sketch_configuration
    panels: list[Panel] = [(title, sketch, 0)]
    scenes = [pose(mechanism, sketch)]
    try:
        sweep = Sweep.of(shown or solve_shown(study, _POSES))
    except MechdesignError:
        return _compose(study, panels, travels(scenes), masses)
    some = evenly(len(sweep.rows), _POSES).tolist()
    poses = {k: pose(mechanism, sweep.configuration, k) for k in some}
    first = next((k for k, scene in poses.items() if scene is not None), None)
    if first is not None:
        note = "First pose" + " that can be assembled" * (first > 0)
        if _same(scenes[0], poses[first]):
            panels = []
            note = f"{title.removesuffix(' pose')} and {note.lower()}"
        panels.append((f"{note}: {sweep.words(first)}", sweep.configuration, first))
        scenes += poses.values()
    return _compose(study, panels, travels(scenes), masses)


def _worst(study: Study, result: Result) -> tuple[str, Configuration] | None:
    """The pose at which errors leave their limits most often, in words and solved; None where nothing is limited."""
    table = result.tables.get("reliability")
    if result.command != "reliability" or table is None:
        return None
    from mechdesign.questions.reliability.tables import DrawnErrors
    from mechdesign.report.figures.looks import best_probability, followed_in_words

    drawn = DrawnErrors.of(result)
    poses, rows = drawn.poses, table.where(scope="pose", method=best_probability(table))
    failure = table["failure"][rows]
    if not np.isfinite(failure).any():
        return None
    row = int(np.nanargmax(failure)) if drawn.samples is None else drawn.samples.pose
    return f"Errors at {followed_in_words(study, poses, row)}", solve_rows(study.motion(poses), np.array([row]))


def sketch_figure(study: Study) -> Figure:
    """The sketch as it is assembled, with crosses where points are drawn elsewhere; use inside `style.context`."""
    mechanism = study.mechanism
    scene = pose(mechanism, mechanism.sketch_configuration)
    assert scene is not None
    drawn = mechanism.description.sketch
    figure, axes = framed([*scene.places({}), *drawn.values()], study.units.label("length"), height=5.4, above=_TITLE)
    ends = np.array([(place, scene.points[name]) for name, place in drawn.items()], dtype=complex).reshape(-1, 2)
    moves = paper(axes, ends[:, 0]) - paper(axes, ends[:, 1])
    rough = ends[np.hypot(*moves.T) > _ROUGH]
    for line in rough:
        axes.plot(line.real, line.imag, color=style.INK, linewidth=0.9, linestyle=":", alpha=0.5, zorder=4.4)
    crosses = rough[:, 0]
    axes.plot(
        crosses.real, crosses.imag, "x", color=style.INK, alpha=0.5, markersize=7, markeredgewidth=1.6, zorder=4.5
    )
    axes.set_title("The sketch, assembled" + ("; crosses: where it is drawn" if len(rough) else ""), loc="left")
    _draw_beams(axes, study, mechanism.sketch_configuration)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration)
    return figure


def _same(one: Scene | None, other: Scene | None) -> bool:
    if one is None or other is None:
        return False
    return all(abs(one.points[name] - other.points[name]) <= _ALIKE * one.span for name in one.points)


def _compose(study: Study, panels: list[Panel], travel: Travel, masses: bool = False) -> Figure:
    """Panels beside or above each other, whichever shows the mechanism larger."""
    mechanism = study.mechanism
    places: list[complex] = []
    for _, configuration, index in panels:
        scene = pose(mechanism, configuration, index)
        assert scene is not None
        places += scene.places(travel)
    count = len(panels)
    beside, stacked = fit(places, *_room(count, 1)), fit(places, *_room(1, count))
    columns, window = (count, beside) if beside.scale >= 0.55 * stacked.scale else (1, stacked)
    titles = [style.folded(title, 11.0, window.width) for title, _, _ in panels]
    above = _TITLE + _TITLE_LINE * max(title.count("\n") for title in titles)
    figure, grid = windows(window, study.units.label("length"), count, columns, above=above)
    for axes, title, (_, configuration, index) in zip(grid, titles, panels, strict=True):
        axes.set_title(title, loc="left")
        _draw_beams(axes, study, configuration, index)
        if masses:
            draw(axes, center_shapes(mass_centers(study, configuration, index).values()))
        draw_mechanism(axes, mechanism, configuration, index, travel=travel)
    return figure


def _room(columns: int, rows: int) -> tuple[float, float]:
    """Largest width and height of a panel, inches."""
    return (style.width() - RIGHT - LEFT * columns) / columns, _MAX_STACKED_HEIGHT if rows > 1 else _MAX_HEIGHT


def _draw_beams(axes: Axes, study: Study, configuration: Configuration, index: int = 0) -> None:
    """Draw the beams of the study's elastic links in one pose of a batch, where they are not plainly the link itself.

    Those are links with brackets, and links of more than two points without ends.
    """
    if study.stiffness is None:
        return
    looks = {"elastic beam": (1.3, (0, (6, 2))), "rigid bracket": (2.2, "-")}
    labelled = set()
    for name in study.stiffness.elastic:
        lines = list(_lines(study, name, configuration, index))
        if len(lines) == 1 and len(lines[0][1]) < 3:
            continue
        for kind, ends in lines:
            width, dashes = looks[kind]
            axes.plot(ends.real, ends.imag, color=style.INK, linewidth=width, linestyle=dashes, zorder=_BEAM_ORDER,
                      label=kind if kind not in labelled else None)  # fmt: skip
            labelled.add(kind)
    if labelled:
        axes.legend(loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def _lines(study: Study, name: str, configuration: Configuration, index: int) -> Iterator[tuple[str, np.ndarray]]:
    """The beams of a link, all in one line, and its brackets."""
    from mechdesign.questions.stiffness.elements import beam_line

    mechanism = study.mechanism
    link = mechanism.description.links[name]
    corners = link.corners
    yield "elastic beam", np.array([np.ravel(configuration.point(corner))[index] for corner in corners])
    if link.telescopic or len(corners) < 2:
        return
    course = beam_line(link, configuration)
    riding = [joint.point for joint in mechanism.description.joints.values()
              if not isinstance(joint, Fixed) and joint.line.link == name]  # fmt: skip
    for point in (*link.points, *riding):
        place = configuration.point(point)
        ends = np.array([np.ravel(end)[index] for end in (course.place(course.foot(point, place)), place)])
        if abs(ends[1] - ends[0]) > _MIN_BRACKET * mechanism.size:
            yield "rigid bracket", ends
