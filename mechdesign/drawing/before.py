"""A study before a change, for pictures that show it under the study after it."""

from __future__ import annotations

from typing import NamedTuple

from mechdesign.ground.errors import StudyError
from mechdesign.ground.results import Result
from mechdesign.study import Study

# Commands whose pictures can show it.
COMMANDS = ("kinematics", "workspace")


class Before(NamedTuple):
    """The study before, its result, and the names of the study now and of that before."""

    study: Study
    result: Result
    names: tuple[str, str]

    @classmethod
    def of(cls, study: Study, result: Result, before: Study, earlier: Result) -> Before:
        """A study before, with its earlier result, to be drawn under the result of the study now.

        Raises
        ------
        StudyError
            If one drawing cannot show both.
        """
        who = f"--before {before.label}"
        for kind in ("length", "angle", "time"):
            now, then = study.units.label(kind), before.units.label(kind)
            if now != then:
                now, then = now or "none", then or "none"
                raise StudyError(f"{who}: its unit of {kind} is {then}, here {now}; give both the same")
        if result.command == "kinematics":
            now, then = _runs_over(result), _runs_over(earlier)
            if not now or not then:
                raise StudyError(f"{who}: only a sweep or a path is drawn over another; one of the studies lists poses")
            if now != then:
                raise StudyError(f"{who}: it moves {then}, this study {now}; give both the same sweep or path")
        elif ("path" in result.tables) != ("path" in earlier.tables):
            raise StudyError(f"{who}: a path and a region are not drawn over each other")
        return cls(before, earlier.seen, _names(study, before))


def _runs_over(result: Result) -> str:
    """Names of the coordinates that are given along a motion; empty where there is none."""
    from mechdesign.questions.kinematics.drawn import DrawnMotion

    poses = DrawnMotion.of(result).shown.poses
    return ", ".join(sorted(poses.values)) if poses.followed else ""


def _names(study: Study, before: Study) -> tuple[str, str]:
    """Labels of both studies, with their overrides where the labels are the same."""
    names = study.label, before.label
    if names[0] != names[1]:
        return names
    return ", ".join((names[0], *study.overrides)), ", ".join((names[1], *before.overrides))
