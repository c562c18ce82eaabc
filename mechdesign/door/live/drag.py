"""Which numbers of a study bring a point to where a hand wants it, at one pose of its drives."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations
from types import MappingProxyType
from typing import Any

import numpy as np

from mechdesign.door.live.altered import SKETCH, altered, is_entry
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Prismatic, Slot
from mechdesign.mechanism.graph import GROUND
from mechdesign.motion.solving import solve_rows
from mechdesign.study import Study

_MOST_STEPS = 30  # of Newton's method, halved ones among them
_LONGEST = 0.25  # step, as a part of the mechanism's size
_ALIKE = 0.02  # part of a way that may be missed where fewer numbers are changed for it
_BLIND = 1e-6  # derivative of a place by a length from which on the length moves it
_FULL = 0.05  # sine of the angle of two ways from which on they span the plane, and part of the longest that counts
_SAME = 1e-6  # of the mechanism's size: between first and last pose of a motion that goes round
_STEP = 1e-6  # part of a number by which a derivative is taken where it is known by solving alone
_BESIDE = 1e-3  # of a row of the motion, by which derivatives along it are taken
TURNED = ""  # stands for the place of the motion among the numbers that a drag changes


@dataclass(frozen=True)
class Drag:
    """A point that a hand holds: its name, where the hand is, and what it may change.

    `row` is the pose along the motion. `held` are numbers that it has changed since the hand took the point. Values are
    rounded to `resolution`, a length. Where the links of a point have one number for it, as those of a crank's pin,
    the drives go with the hand as well, and alone where that brings it nearer than `near`.
    """

    point: str
    target: complex
    row: float
    locked: Collection[str] = ()
    held: Collection[str] = ()
    resolution: float = 0.0
    near: float = 0.0


@dataclass(frozen=True)
class Dragged:
    """Numbers of a study after a drag, those that the hand changes, and why the point does not follow it, if so.

    `row` is the pose where the drives have gone with the hand; `across` is what changes further away from their way.
    """

    changes: Mapping[str, float]
    row: float
    names: tuple[str, ...] = ()
    why: str = ""
    across: str = ""


@dataclass(frozen=True)
class _Pose:
    """A design of a study, by what it changes of it, with its drives as the motion has them at one pose."""

    study: Study
    changes: Mapping[str, float]
    row: float
    configuration: Configuration
    values: Mapping[str, float] = field(default_factory=dict)  # of the drives, in radians and lengths

    @classmethod
    def of(cls, study: Study, row: float, changes: Mapping[str, float] = MappingProxyType({})) -> _Pose:
        """The pose at a place of the motion."""
        poses = replace(study.motions["kinematics"], picked=(np.zeros(1, dtype=np.intp), np.array([row])))
        configuration = solve_rows(study.motion(poses), np.zeros(1, dtype=np.intp))
        mechanism = study.mechanism
        drives = {
            name: float(np.ravel(configuration.value(mechanism.coordinate(name)))[0]) for name in mechanism.drives
        }
        return cls(study, changes, row, configuration, drives)

    def with_values(self, original: Study, changes: Mapping[str, float], row: float | None = None) -> _Pose:
        """Another design of the original at the same values of the drives, or at another pose of its motion.

        Where the motion gives other coordinates than the drives, such as a point, it is the same pose of that.
        """
        study = altered(original, changes)
        if row is not None or not _by_drives(original):
            return self.of(study, self.row if row is None else row, changes)
        given = [np.array([value]) for value in self.values.values()]
        return replace(self, study=study, changes=changes, configuration=study.mechanism.forward.solve(given, {}))

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


def _by_drives(study: Study) -> bool:
    """Whether the motion gives the values of the drives."""
    return study.motions["kinematics"].values.keys() == {*study.mechanism.drives}


@lru_cache(4)
def _goes_round(study: Study) -> bool:
    """Whether the motion ends where it begins."""
    poses = study.motions["kinematics"]
    if poses.closed:
        return True
    first, last = (_Pose.of(study, row).configuration.nodes for row in (0.0, float(poses.end)))
    gaps = [abs(np.ravel(a)[0] - np.ravel(b)[0]) for a, b in zip(first, last, strict=True)]
    return bool(max(gaps) <= _SAME * study.mechanism.size)


def _place(study: Study, row: float) -> float:
    """A place of the motion: round where it closes, else not beyond its ends."""
    end = float(study.motions["kinematics"].end)
    return row % end if _goes_round(study) else min(max(row, 0.0), end)


def free_numbers(study: Study) -> list[str]:
    """Parameters and dimensions that are numbers of their own: they follow from nothing else in the study."""
    parameters, places = study.parameters, study.mechanism.description.places
    return [
        name for name in parameters.names()
        if name not in parameters.formulas and name not in parameters.dependent
        and (name in parameters.nominal or places[name].path)
    ]  # fmt: skip


def value_of(study: Study, name: str) -> float:
    """A parameter, a dimension or a number of the sketch of a study, in its units."""
    if is_entry(name):
        point, _, axis = name.removeprefix(f"{SKETCH}.").rpartition(".")
        place = study.mechanism.description.sketch[point]
        return place.imag if axis == "1" else place.real
    return study.sizes[name] / study.parameters.factors.get(name, 1.0)


@np.errstate(all="ignore")
def dragged(original: Study, changes: Mapping[str, float], drag: Drag) -> Dragged:
    """Change as few free numbers as bring a point to the hand, or as near as they can.

    They are those of the links that have the point, and of the guides along which these slide: its own coordinates in
    one of them, or in the sketch from which these are measured, before lengths and parameters, these before places of
    other points. The drives stay, unless the numbers leave a direction to them. What cannot be assembled is not passed.

    Raises
    ------
    MechdesignError
        If the changes so far make no study.
    """
    pose = _Pose.of(altered(original, changes), drag.row, changes)
    if not pose.valid:
        return _pivoted(original, pose, drag)
    ways = {name: way for name, way in _ways(original, pose, drag) if abs(way).max() > _BLIND}
    names: tuple[str, ...] = ()
    if _driven(pose.study, drag.point) and not _spans(ways):
        far = max((abs(way[0]) for way in ways.values()), default=0.0)
        names = tuple(name for name, way in ways.items() if abs(way[0]) >= _FULL * far)[:1]
        ways |= _turning(original, pose, drag.point, drag.row)
        if TURNED in ways and not set(drag.held).difference([TURNED]):
            turned = _newton(original, changes, pose, {TURNED: drag.row}, drag)[0]
            if abs(turned.at(drag.point) - drag.target) <= drag.near:
                return Dragged(changes, turned.row, (TURNED,), across="".join(names))
        names += (TURNED,) if TURNED in ways else ()
    names = names or _fewest(ways, drag.target - pose.at(drag.point))
    if not names:
        locked = " that is not locked" if drag.locked else ""
        if f"{drag.point}.x" in original.motions["kinematics"].values:
            return Dragged(changes, drag.row, why=f"the motion of the study says where {drag.point} is")
        return Dragged(changes, drag.row, why=f"no number{locked} of its links moves {drag.point} at this pose")
    begin = {name: drag.row if name == TURNED else value_of(pose.study, name) for name in names}
    pose, values, why = _newton(original, changes, pose, begin, drag)
    values.pop(TURNED, None)
    rounded = {name: _rounded(original, name, value, drag.resolution) for name, value in values.items()}
    try:
        if not pose.with_values(original, {**changes, **rounded}).valid:
            rounded = values
    except MechdesignError:
        rounded = values
    return Dragged({**changes, **rounded}, pose.row, names, why)


def _pivoted(original: Study, pose: _Pose, drag: Drag) -> Dragged:
    """The pivot that a hand holds where it is wanted: it has a place, also where the pose cannot be assembled."""
    now, ways = pose.study.mechanism.nominal, dict[str, Complexes]()
    at = [f"{GROUND}.{drag.point}.{axis}" for axis in "xy"]
    for name in [*_drawn(original, drag.point), *free_numbers(original)] if now.keys() >= {*at} else ():
        slopes = _slopes(original, pose, name)
        if name not in drag.locked and not slopes.keys().isdisjoint(at):
            ways[name] = np.array([complex(*(float(slopes.get(place, 0.0)) for place in at))])
    missing = drag.target - complex(*(now[place] for place in at)) if ways else 0j
    names = tuple(ways)[:2]
    if not names:
        return Dragged(pose.changes, drag.row, why=f"the pose {pose.why}")
    matrix = np.column_stack([_parts(ways[name]) for name in names])
    step = np.linalg.lstsq(matrix, _parts(np.array([missing])), rcond=1e-6)[0]
    values = {
        name: _rounded(original, name, value_of(pose.study, name) + change, drag.resolution)
        for name, change in zip(names, step.tolist(), strict=True)
        if abs(ways[name][0] * change) > drag.resolution
    }
    changes = {**pose.changes, **values}
    there = _Pose.of(altered(original, changes), drag.row, changes)
    return Dragged(changes, drag.row, names, "" if there.valid else f"the pose {there.why}")


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
        ways = dict(_ways(original, pose, drag, [name for name in values if name != TURNED]))
        ways |= _turning(original, pose, drag.point, values[TURNED]) if TURNED in values else {}
        if ways.keys() != values.keys():
            break
        matrix = np.column_stack([_parts(ways[name]) for name in values])
        step = np.linalg.lstsq(matrix, _parts(np.array([missing])), rcond=1e-6)[0]
        gone = float(np.abs(matrix @ step).max())
        if gone <= tolerance:
            break
        step *= share * min(1.0, _LONGEST * size / gone)
        tried = {name: value + change for (name, value), change in zip(values.items(), step.tolist(), strict=True)}
        row = _place(original, tried[TURNED]) if TURNED in tried else None
        try:
            there = pose.with_values(original, {**changes, **{name: tried[name] for name in tried if name}}, row)
            why = "" if there.valid else there.why
        except MechdesignError as error:
            there, why = pose, str(error).splitlines()[0].rpartition(": ")[2]
        if why or abs(drag.target - there.at(drag.point)) >= abs(missing):
            share /= 2
            if share < 1e-3:
                break
            continue
        pose, values, share = there, tried, min(1.0, 2 * share)
        if row is not None:
            values[TURNED] = row
    return pose, values, why


def _ways(
    original: Study, pose: _Pose, drag: Drag, only: Collection[str] | None = None
) -> Iterator[tuple[str, Complexes]]:  # fmt: skip
    """Where a point goes by each number of its links and guides, per unit of the number; the preferred ones first."""
    study, mechanism = pose.study, pose.study.mechanism
    owners, guides = {*mechanism.graph.links_at(drag.point)}, dict[str, str | None]()
    for name, joint in mechanism.description.joints.items():
        if isinstance(joint, Prismatic | Slot) and owners & {joint.line.link, getattr(joint, "slider", "")}:
            guides[name] = f"{joint.line.link}.{joint.line.through}"

    def rank(name: str) -> int:
        """0 of a coordinate of the point itself, 1 of lengths, what has no place and a guide's point, else 2."""
        point, _, axis = name.rpartition(".")
        if axis in ("x", "y") and point not in guides.values():
            return 0 if point.rpartition(".")[2] == drag.point else 2
        return 2 if point in guides else 1

    places = [
        name for name, place in mechanism.description.places.items()
        if place.quantity in ("length", "angle") and (
            (place.path[:1] == ("links",) and place.path[1] in owners)
            or (place.path[:1] == ("joints",) and place.path[1] in guides)
            or name.rpartition(".")[0] in guides.values()
        )
    ]  # fmt: skip
    if not places:
        return
    node = mechanism.graph.node(drag.point)
    nodes = mechanism.linearize(pose.configuration).sensitivity(places).nodes[node]
    by_place = dict(zip(places, np.broadcast_to(nodes, (len(places), 1)), strict=True))
    exact = _by_drives(original)
    kept = [name for name in drag.held if name] if len(drag.held) == 2 else ()
    ways: list[tuple[int, str, Complexes]] = []
    drawn = _drawn(original, drag.point)
    for name in only if only is not None else kept or [*drawn, *free_numbers(original)]:
        if name in drag.locked or name in original.fixed or (name in study.parameters.measured and drawn):
            continue
        slopes = _slopes(original, pose, name)
        moved = [place for place in slopes if place in by_place]
        if moved or only is not None:
            if exact:
                way = sum((by_place[place] * slopes[place] for place in moved), start=np.zeros(1, dtype=complex))
            else:
                way = _way(original, pose, drag.point, name)
            ways.append(
                (-1 if name in drag.held else 0 if name in drawn else min(map(rank, moved), default=2), name, way)
            )
    yield from ((name, way) for _, name, way in (ways if only is not None else sorted(ways, key=lambda way: way[0])))


def _way(original: Study, pose: _Pose, point: str, name: str) -> Complexes:
    """Where a point goes by a number at a pose whose motion does not give the drives; by a difference."""
    value = value_of(pose.study, name)
    step = _STEP * (abs(value) or pose.study.mechanism.size)
    try:
        there = pose.with_values(original, {**pose.changes, name: value + step})
    except MechdesignError:
        return np.full(1, np.nan + 0j)
    return np.array([(there.at(point) - pose.at(point)) / step])


def _drawn(study: Study, point: str) -> list[str]:
    """The numbers of a point in the sketch, where dimensions are measured from it."""
    owners = study.mechanism.graph.links_at(point)
    measured = any(place.partition(".")[0] in owners for place in study.parameters.measured)
    written = study.resolved["mechanism"].get("sketch") or {}
    return [f"{SKETCH}.{point}.{axis}" for axis in (0, 1)] if measured and point in written else []


def _slopes(original: Study, pose: _Pose, name: str) -> Mapping[str, Number]:
    """Derivative of every place that follows a number; of one of the sketch by reading the study beside."""
    study = pose.study
    if not is_entry(name):
        return study.parameters.derivatives(name)
    value, beside = value_of(study, name), _STEP * study.mechanism.size
    now, there = study.mechanism.nominal, altered(original, {**pose.changes, name: value + beside}).mechanism.nominal
    return {place: (there[place] - here) / beside for place, here in now.items() if there[place] != here}


def _driven(study: Study, point: str) -> bool:
    """Whether a point belongs to a link that a drive turns or pushes."""
    mechanism, bodies = study.mechanism, set[str]()
    for coordinate in map(mechanism.coordinate, mechanism.drives):
        bodies |= {coordinate.body} if coordinate.slide < 0 else {*mechanism.graph.guides[coordinate.slide]}
    links = {body.removesuffix(":rod") for body in bodies} - {GROUND}
    return not links.isdisjoint(mechanism.graph.links_at(point))


def _turning(original: Study, pose: _Pose, point: str, row: float) -> dict[str, Complexes]:
    """Where a point goes along the motion, per row of it; nothing where that ends or stands still."""
    ends = [_place(original, row + way * _BESIDE) for way in (-1, 1)]
    low, high = (pose.of(pose.study, end) for end in ends)
    # Round the end of a closed motion a row is as long as elsewhere.
    span = 2 * _BESIDE if _goes_round(original) else ends[1] - ends[0]
    way = (high.at(point) - low.at(point)) / span
    return {TURNED: np.array([way])} if np.isfinite(way) and abs(way) > _BLIND else {}


def _spans(ways: Mapping[str, Complexes]) -> bool:
    """Whether two of the ways lead anywhere in the plane."""
    directions = [complex(way[0]) / abs(way[0]) for way in ways.values()]
    return any(abs((one.conjugate() * other).imag) > _FULL for one, other in combinations(directions, 2))


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
