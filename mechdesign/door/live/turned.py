"""How a study moves in its live page: by its own kinematics, or by its first drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.door.report.page.headlines import shown
from mechdesign.ground.errors import StudyError
from mechdesign.ground.results import Result
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.look import ask
from mechdesign.study import Study
from mechdesign.study.variants import with_entries

_STROKE = 0.3  # of a drive that slides, as a part of the mechanism's size
_TURN = 73  # poses of a turn that the study does not give
_MOST_DEAD = 12  # dead centres that are listed


def motion_of(study: Study) -> Result | None:
    """The motion of a study's kinematics; None where its poses do not follow one another."""
    result = ask(study, "kinematics")
    return result if isinstance(result.drawn, DrawnMotion) and result.drawn.shown.poses.followed else None


def turning(study: Study) -> tuple[Study, dict[str, str]]:
    """A study whose first drive makes a turn or a stroke from the sketch, and the drives that stand still there.

    These are parameters, by whose names they come.
    """
    mechanism = study.mechanism
    values, stroke = dict[str, float](), _STROKE * mechanism.size
    for name in mechanism.drives:
        coordinate = mechanism.coordinate(name)
        value = in_study_units(study.units, coordinate, mechanism.sketch_configuration.value(coordinate))
        values[name] = round(float(np.ravel(value)[0]), 6)
    if not values:
        raise StudyError("nothing is driven, so that nothing moves")
    first, *others = values
    turns = mechanism.coordinate(first).quantity == "angle"
    way = np.linspace(0, 2 * np.pi / study.units.angle_factor, _TURN) if turns else np.linspace(-stroke, stroke, _TURN)
    held = {f"{name}_here{'_' * (f'{name}_here' in study.parameters.nominal)}": name for name in others}
    path = {first: (values[first] + way).tolist(), **{name: [own] * _TURN for own, name in held.items()}}
    numbers = {own: values[name] for own, name in held.items()}
    outputs = study.resolved.get("kinematics", {}).get("outputs")
    section = {"path": path} | ({"outputs": outputs} if outputs else {})
    return with_entries(study, [("kinematics", section), ("requirements", [])], numbers), held


def dead_centres(result: Result) -> list[dict[str, Any]]:
    """Poses of a motion at which it cannot go on, and where links come into line, in words and by what is given."""
    listed: list[dict[str, Any]] = []
    given = DrawnMotion.of(result).shown.poses.values if result.command == "kinematics" else {}
    words = {"limits": ("kind", "joint"), "toggles": ("links", "state", "effect")}
    for table in (result.tables[name] for name in words if name in result.tables):
        for row in range(min(len(table), _MOST_DEAD)):
            pose = {name: float(table[name][row]) for name in given if name in table}
            said = ", ".join(text for name in words[table.name] if (text := str(table[name][row])))
            at = ", ".join(
                f"{name} = {shown(value)} {table.column(name).unit}".rstrip() for name, value in pose.items()
            )
            if pose:
                listed.append({"words": said, "at": at, "pose": pose})
    return listed
