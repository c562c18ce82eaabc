"""The mechanism as the study means it: its sketch pose, its first pose, and how roughly the sketch is drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed, draw
from mechdesign.drawing.marks import Dots, Late, Picture, Trace
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.scene import Scene, Still, sketched
from mechdesign.drawing.shapes import center_shapes
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.results import Result
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Sliding
from mechdesign.motion.solving import solve_rows
from mechdesign.questions.dynamics.free_bodies import mass_centers
from mechdesign.questions.kinematics.drawn import DrawnPoses
from mechdesign.questions.poses import Shown, solve_shown
from mechdesign.study import Study

SKETCH_POSE = "Sketch pose"
_POSES = 100  # of a motion that no question has solved
_ALIKE = 0.02  # part of the mechanism's size by which the points of two poses differ that need not both be drawn
_ROUGH = 0.03  # part of the mechanism's size: a place drawn nearer than this lies under the symbol of its joint
_MIN_BRACKET = 0.005  # part of the mechanism's size: nearer to a beam than this, a bracket is too short to be seen
_BEAM_ORDER = 3.3  # above links and slots, below pins and names


def mechanism_picture(study: Study, result: Result) -> Picture:
    """The sketch pose, and the first pose of the study's kinematics, on one scale.

    Of a reliability it is the pose that its samples follow. Use inside `style.context`.
    """
    worst = _worst(study, result)
    if worst is not None:
        words, configuration = worst
        return _picture(study, [(SKETCH_POSE, Scene(study.mechanism, study.mechanism.sketch_configuration), 0),
                                (words, Scene(study.mechanism, configuration), 0)])  # fmt: skip
    if not isinstance(result.drawn, DrawnPoses):
        return sketch_and_first_pose(study, None)
    return sketch_and_first_pose(study, result.drawn.shown, masses=result.drawn.name == "dynamics")


def sketch_and_first_pose(
    study: Study, shown: Shown | None, title: str = SKETCH_POSE, *, masses: bool = False
) -> Picture:  # fmt: skip
    """The sketch pose under a title, and the first of some poses; without any, a few of the kinematics are solved.

    With `masses` the centres of mass are marked.
    """
    sketch = Scene(study.mechanism, study.mechanism.sketch_configuration)
    panels = [(title, sketch, 0)]
    try:
        sweep = Sweep.of(shown or solve_shown(study, _POSES))
    except MechdesignError:
        return _picture(study, panels, masses=masses)
    first = next((k for k in range(len(sweep.rows)) if sweep.at(k) is not None), None)
    if first is not None:
        note = "First pose" + " that can be assembled" * (first > 0)
        if _same(sketch.at(0), sweep.at(first)):
            panels = []
            note = f"{title.removesuffix(' pose')} and {note.lower()}"
        panels.append((f"{note}: {sweep.words(first)}", sweep.scene, first))
    return _picture(study, panels, masses=masses)


def _worst(study: Study, result: Result) -> tuple[str, Configuration] | None:
    """The pose at which errors leave their limits most often, in words and solved; None where nothing is limited."""
    table = result.tables.get("reliability")
    if result.command != "reliability" or table is None:
        return None
    from mechdesign.drawing.looks import best_probability, followed_in_words
    from mechdesign.questions.reliability.drawn import DrawnErrors

    drawn = DrawnErrors.of(result)
    poses, rows = drawn.poses, table.where(scope="pose", method=best_probability(table))
    failure = table["failure"][rows]
    if not np.isfinite(failure).any():
        return None
    row = int(np.nanargmax(failure)) if drawn.samples is None else drawn.samples.pose
    return f"Errors at {followed_in_words(study, poses, row)}", solve_rows(study.motion(poses), np.array([row]))


def sketch_picture(study: Study) -> Picture:
    """The sketch as it is assembled, with crosses where points are drawn elsewhere; use inside `style.context`."""
    scene, drawn = sketched(study.mechanism), study.mechanism.description.sketch
    rough = [np.array([place, scene.points[name]]) for name, place in drawn.items()
             if abs(place - scene.points[name]) > _ROUGH * scene.span]  # fmt: skip
    pale: dict[str, Any] = {"color": style.INK, "alpha": 0.5}
    marks = [Trace(line.real, line.imag, look=pale | {"linewidth": 0.9, "linestyle": ":", "zorder": 4.4})
             for line in rough]  # fmt: skip
    crosses = pale | {"marker": "x", "markersize": 7, "markeredgewidth": 1.6, "zorder": 4.5}
    marks += [Dots([line[0].real], [line[0].imag], look=crosses) for line in rough]
    title = "The sketch, assembled" + ("; crosses: where it is drawn" if len(rough) else "")
    beams = _beams(study, study.mechanism.sketch_configuration)
    shows = np.array([*scene.places, *drawn.values()])
    return Picture(title, [drawn_plane([*marks, *beams, Posed(scene)], shows, study)])


def _same(one: Still | None, other: Still | None) -> bool:
    if one is None or other is None:
        return False
    return all(abs(one.points[name] - other.points[name]) <= _ALIKE * one.span for name in one.points)


def _picture(study: Study, panels: Sequence[tuple[str, Scene, int]], *, masses: bool = False) -> Picture:
    """Some poses beside or above each other, whichever shows the mechanism larger; their guides are alike."""
    drawn, travel = [], panels[-1][1].travel
    for title, scene, index in panels:
        still = Scene(scene.mechanism, scene.configuration, travel).at(index)
        assert still is not None
        centers = mass_centers(study, scene.configuration, index).values() if masses else ()
        marks = [*_beams(study, scene.configuration, index), Late(partial(draw, drawn=center_shapes(centers)))]
        drawn.append(drawn_plane([*marks, Posed(still)], still.places, study, title))
    return Picture("", drawn, across=2, share="xy")


def _beams(study: Study, configuration: Configuration, index: int = 0) -> Iterator[Trace]:
    """The beams of the study's elastic links in one pose of a batch, where they are not plainly the link itself.

    Those are links with brackets, and links of more than two points without ends.
    """
    looks = {"elastic beam": (1.3, (0, (6, 2))), "rigid bracket": (2.2, "-")}
    for name in study.stiffness.elastic if study.stiffness is not None else ():
        lines = list(_lines(study, name, configuration, index))
        if len(lines) == 1 and len(lines[0][1]) < 3:
            continue
        for kind, ends in lines:
            width, dashes = looks[kind]
            look = {"color": style.INK, "linewidth": width, "linestyle": dashes, "zorder": _BEAM_ORDER}
            yield Trace(ends.real, ends.imag, label=kind, look=look)


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
              if isinstance(joint, Sliding) and joint.line.link == name]  # fmt: skip
    for point in (*link.points, *riding):
        place = configuration.point(point)
        ends = np.array([np.ravel(end)[index] for end in (course.place(course.foot(point, place)), place)])
        if abs(ends[1] - ends[0]) > _MIN_BRACKET * mechanism.size:
            yield "rigid bracket", ends
