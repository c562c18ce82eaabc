"""Which numbers of a study bring a point to where a hand wants it, at one pose of its drives."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.configuration import Configuration
from mechdesign.motion.solving import solve_rows
from mechdesign.study import Study
from mechdesign.study.designs import variant

_MOST_STEPS = 30  # of Newton's method, halved ones among them
_LONGEST = 0.25  # step, as a part of the mechanism's size
_ALIKE = 0.02  # part of a way that may be missed where fewer numbers are changed for it
_BLIND = 1e-6  # derivative of a place by a length from which on the length moves it


@dataclass(frozen=True)
class Drag:
    """A point that a hand holds: its name, where the hand is, and what it may change.

    `row` is the pose along the motion. `held` are numbers that it has changed since the hand took the point. Values are
    rounded to `resolution`, a length.
    """

    point: str
    target: complex
    row: float
    locked: Collection[str] = ()
    held: Collection[str] = ()
    resolution: float = 0.0


@dataclass(frozen=True)
class Dragged:
    """Numbers of a study after a drag, those that the hand changes, and why the point does not follow it, if so."""

    changes: Mapping[str, float]
    names: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True)
class _Pose:
    """A design of a study with its drives as the motion has them at one pose."""

    study: Study
    configuration: Configuration
    values: Mapping[str, float] = field(default_factory=dict)  # of the drives, in radians and lengths

    @classmethod
    def of(cls, study: Study, row: float) -> _Pose:
        """The pose at a place of the motion."""
        poses = replace(study.motions["kinematics"], picked=(np.zeros(1, dtype=np.intp), np.array([row])))
        configuration = solve_rows(study.motion(poses), np.zeros(1, dtype=np.intp))
        mechanism = study.mechanism
        drives = {
            name: float(np.ravel(configuration.value(mechanism.coordinate(name)))[0]) for name in mechanism.drives
        }
        return cls(study, configuration, drives)

    def with_values(self, original: Study, changes: Mapping[str, float]) -> _Pose:
        """Another design of the original at the same values of the drives."""
        study = variant(original, changes)
        given = [np.array([value]) for value in self.values.values()]
        return replace(self, study=study, configuration=study.mechanism.forward.solve(given, {}))

    @property
    def valid(self) -> bool:
        return bool(self.configuration.valid.all())

    @property
    def why(self) -> str:
        """Why it is not valid."""
        return self.study.mechanism.why(int(np.ravel(self.configuration.reason)[0])).partition(":")[0]

    def at(self, point: str) -> complex:
        """Where a point is."""
        return complex(self.configuration.point(point)[0])


def free_numbers(study: Study) -> list[str]:
    """Parameters and dimensions that are numbers of their own: they follow from nothing else in the study."""
    parameters, places = study.parameters, study.mechanism.description.places
    return [
        name for name in parameters.names()
        if name not in parameters.formulas and name not in parameters.dependent
        and (name in parameters.nominal or places[name].path)
    ]  # fmt: skip


def value_of(study: Study, name: str) -> float:
    """A parameter or dimension of a study, in its units."""
    return study.sizes[name] / study.parameters.factors.get(name, 1.0)


@np.errstate(all="ignore")
def dragged(original: Study, changes: Mapping[str, float], drag: Drag) -> Dragged:
    """Change as few free numbers as bring a point to the hand, or as near as they can.

    They are those of the links that have the point: its own coordinates in one of them before lengths and parameters,
    these before places of other points. The drives stay. What cannot be assembled is not passed.

    Raises
    ------
    MechdesignError
        If the changes so far make no study.
    """
    study = variant(original, changes)
    pose = _Pose.of(study, drag.row)
    if not pose.valid:
        return Dragged(changes, why=f"the pose {pose.why}")
    ways = {name: way for name, way in _ways(original, pose, changes, drag) if abs(way).max() > _BLIND}
    names = _fewest(ways, drag.target - pose.at(drag.point))
    if not names:
        locked = " that is not locked" if drag.locked else ""
        return Dragged(changes, why=f"no number{locked} of its links moves {drag.point} at this pose")
    values = {name: value_of(study, name) for name in names}
    pose, values, why = _newton(original, changes, pose, values, drag)
    rounded = {name: _rounded(original, name, value, drag.resolution) for name, value in values.items()}
    try:
        if not pose.with_values(original, {**changes, **rounded}).valid:
            rounded = values
    except MechdesignError:
        rounded = values
    return Dragged({**changes, **rounded}, names, why)


def _newton(
    original: Study, changes: Mapping[str, float], pose: _Pose, values: dict[str, float], drag: Drag
) -> tuple[_Pose, dict[str, float], str]:
    """Newton's method from a pose; steps into what cannot be assembled, or away from the hand, are halved."""
    size, why, share = original.mechanism.size, "", 1.0
    tolerance = max(0.1 * drag.resolution, 1e-12 * size)
    for _ in range(_MOST_STEPS):
        missing = drag.target - pose.at(drag.point)
        if abs(missing) <= tolerance:
            return pose, values, ""
        matrix = np.column_stack([_parts(way) for _, way in _ways(original, pose, changes, drag, values)])
        step = np.linalg.lstsq(matrix, _parts(np.array([missing])), rcond=1e-6)[0]
        gone = float(np.abs(matrix @ step).max())
        if gone <= tolerance:
            break
        step *= share * min(1.0, _LONGEST * size / gone)
        tried = {name: value + change for (name, value), change in zip(values.items(), step.tolist(), strict=True)}
        try:
            there = pose.with_values(original, {**changes, **tried})
            why = "" if there.valid else there.why
        except MechdesignError as error:
            there, why = pose, str(error).splitlines()[0].rpartition(": ")[2]
        if why or abs(drag.target - there.at(drag.point)) >= abs(missing):
            share /= 2
            if share < 1e-3:
                break
            continue
        pose, values, share = there, tried, min(1.0, 2 * share)
    return pose, values, why


def _ways(
    original: Study, pose: _Pose, changes: Mapping[str, float], drag: Drag, only: Collection[str] = ()
) -> Iterator[tuple[str, Complexes]]:  # fmt: skip
    """Where a point goes by each number of its links, per unit of the number; the preferred ones first."""
    study, mechanism = pose.study, pose.study.mechanism
    owners = mechanism.graph.links_at(drag.point)
    places = [
        name for name, place in mechanism.description.places.items()
        if place.path[:1] == ("links",) and place.path[1] in owners and place.quantity in ("length", "angle")
    ]  # fmt: skip
    if not places:
        return
    node = mechanism.graph.node(drag.point)
    nodes = mechanism.linearize(pose.configuration).sensitivity(places).nodes[node]
    by_place = dict(zip(places, np.broadcast_to(nodes, (len(places), 1)), strict=True))

    def rank(name: str) -> int:
        """0 of a coordinate of the point itself, 1 of lengths and of what has no place, 2 of other coordinates."""
        axes = name.rpartition(".")
        return 1 if axes[2] not in ("x", "y") else 0 if axes[0].rpartition(".")[2] == drag.point else 2

    kept = drag.held if len(drag.held) == 2 else ()
    found: list[tuple[int, str, Complexes]] = []
    for name in only or kept or free_numbers(original):
        if name in drag.locked or name in original.fixed:
            continue
        slopes = study.parameters.derivatives(name)
        moved = [place for place in slopes if place in by_place]
        if moved or only:
            way = sum((by_place[place] * slopes[place] for place in moved), start=np.zeros(1, dtype=complex))
            found.append((-1 if name in drag.held else min(map(rank, moved), default=2), name, way))
    yield from ((name, way) for _, name, way in (found if only else sorted(found, key=lambda entry: entry[0])))


def _fewest(ways: Mapping[str, Complexes], missing: complex) -> tuple[str, ...]:
    """The first number, else the first pair, that brings a point all the way; else what brings it nearest."""
    best: tuple[str, ...] = ()
    want, least = _parts(np.array([missing])), math.inf
    for count in (1, 2):
        for names in combinations(ways, count):
            matrix = np.column_stack([_parts(ways[name]) for name in names])
            left = want - matrix @ np.linalg.lstsq(matrix, want, rcond=1e-6)[0]
            far = float(np.hypot(*left)) / (abs(missing) or 1.0)
            if far <= _ALIKE:
                return names
            if far < least - _ALIKE:
                best, least = names, far
    return best


def _parts(way: Any) -> Floats:
    """Parts of a place along x and y."""
    return np.array([way[0].real, way[0].imag])


def _rounded(study: Study, name: str, value: float, resolution: float) -> float:
    """A value without digits that nobody sees: an angle is rounded as far as it turns the mechanism's size."""
    place = study.mechanism.description.places.get(name)
    if place is not None and place.quantity == "angle":
        resolution /= study.mechanism.size * study.parameters.factors[name]
    if resolution <= 0 or not math.isfinite(value):
        return value
    return round(value, -math.floor(math.log10(resolution)))
