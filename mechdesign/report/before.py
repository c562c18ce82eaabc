"""A study before a change, for pictures that show it under the study after it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

from mechdesign.errors import StudyError
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.study.poses import Poses

HELP_PAGE = "howto/report"

# Commands whose pictures can show it.
COMMANDS = ("kinematics", "workspace")
KEY = "before"  # of what pictures show


class Before(NamedTuple):
    """The study before, its result, and the names of the study now and of that before."""

    study: Study
    result: Result
    names: tuple[str, str]


def laid_under(study: Study, result: Result, before: Study, earlier: Result) -> Result:
    """A result whose pictures show an earlier one as well.

    Raises
    ------
    StudyError
        If one drawing cannot show both.
    """
    who = f"--before {before.label}"
    for kind in ("length", "angle", "time"):
        now, then = study.units.label(kind), before.units.label(kind)
        if now != then:
            raise StudyError(f"{who}: its unit of {kind} is {then or 'none'}, here {now or 'none'}; give both the same")
    if result.command == "kinematics":
        now, then = _runs_over(result.drawn["poses"]), _runs_over(earlier.drawn["poses"])
        if not now or not then:
            raise StudyError(f"{who}: only a sweep or a path is drawn over another; one of the studies lists poses")
        if now != then:
            raise StudyError(f"{who}: it moves {then}, this study {now}; give both the same sweep or path")
    else:
        shapes = [next((name for name in ("path", "local", "boundary") if name in each.tables), "")
                  for each in (result, earlier)]  # fmt: skip
        if shapes[0] != shapes[1]:
            raise StudyError(f"{who}: a path, a region and a region over a range are not drawn over each other")
    drawn = {**result.drawn, KEY: Before(before, earlier.seen, _names(study, before))}
    pictured = result.pictured and dataclasses.replace(result.pictured, drawn=drawn)
    return dataclasses.replace(result, drawn=drawn, pictured=pictured)


def _runs_over(poses: Poses) -> str:
    """Names of the coordinates that are given along a motion; empty where there is none."""
    return ", ".join(sorted(poses.values)) if poses.motion else ""


def _names(study: Study, before: Study) -> tuple[str, str]:
    """Files, with overrides where both have the name of one."""
    names = study.label, before.label
    if names[0] != names[1]:
        return names
    return ", ".join((names[0], *study.overrides)), ", ".join((names[1], *before.overrides))


def known(drawn: Mapping[str, Any]) -> Before | None:
    """The study before of what a result's pictures show, if there is one."""
    return drawn.get(KEY)
