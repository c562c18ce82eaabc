"""Which numbers of a study bring a point to where a hand wants it, at one pose of its drives."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations
from types import MappingProxyType

import numpy as np

from mechdesign.door.live.altered import SKETCH, altered, free_numbers, is_entry, value_of
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.elements.joints import Sliding
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.mechanism import Mechanism
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

    @property
    def hint(self) -> str:
        """What else the hand may do, in words."""
        name = self.across.removeprefix("mechanism.")
        return f"along its way it is driven; pull further across it for {name}" if name else ""


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
    ways = _preferred(original, pose, drag)
    names: tuple[str, ...] = ()
    if _driven(pose.study, drag.point) and not _spans(ways):
        far = max((abs(way) for way in ways.values()), default=0.0)
        names = tuple(name for name, way in ways.items() if abs(way) >= _FULL * far)[:1]
        ways |= _turning(original, pose, drag.point)
        if TURNED in ways and not set(drag.held).difference([TURNED]):
            turned, _, _ = _newton(original, pose, (TURNED,), drag)
            if abs(turned.at(drag.point) - drag.target) <= drag.near:
                return Dragged(changes, turned.row, (TURNED,), across="".join(names))
        names += (TURNED,) if TURNED in ways else ()
    names = names or _fewest(ways, drag.target - pose.at(drag.point))
    if not names:
        locked = " that is not locked" if drag.locked else ""
        if f"{drag.point}.x" in original.motions["kinematics"].values:
            return Dragged(changes, drag.row, why=f"the motion of the study says where {drag.point} is")
        return Dragged(changes, drag.row, why=f"no number{locked} of its links moves {drag.point} at this pose")
    pose, values, why = _newton(original, pose, names, drag)
    rounded = {name: _rounded(original, name, value, drag.resolution) for name, value in values.items()}
    try:
        if not pose.with_values(original, {**changes, **rounded}).valid:
            rounded = values
    except MechdesignError:
        rounded = values
    return Dragged({**changes, **rounded}, pose.row, names, why)


def _pivoted(original: Study, pose: _Pose, drag: Drag) -> Dragged:
    """The pivot that a hand holds where it is wanted: it has a place, also where the pose cannot be assembled."""
    now, ways = pose.study.mechanism.nominal, dict[str, complex]()
    at = [f"{GROUND}.{drag.point}.{axis}" for axis in "xy"]
    for name in [*_drawn(original, drag.point), *free_numbers(original)] if now.keys() >= {*at} else ():
        slopes = _slopes(original, pose, name)
        if name not in drag.locked and not slopes.keys().isdisjoint(at):
            ways[name] = complex(*(float(slopes.get(place, 0.0)) for place in at))
    names = tuple(ways)[:2]
    if not names:
        return Dragged(pose.changes, drag.row, why=f"the pose {pose.why}")
    step, _ = _nearest(ways, names, drag.target - complex(*(now[place] for place in at)))
    values = {
        name: _rounded(original, name, value_of(pose.study, name) + change, drag.resolution)
        for name, change in step.items()
        if abs(ways[name] * change) > drag.resolution
    }
    changes = {**pose.changes, **values}
    there = _Pose.of(altered(original, changes), drag.row, changes)
    return Dragged(changes, drag.row, names, "" if there.valid else f"the pose {there.why}")


def _newton(
    original: Study, pose: _Pose, names: Sequence[str], drag: Drag
) -> tuple[_Pose, dict[str, float], str]:  # fmt: skip
    """Newton's method from a pose by numbers, and with `TURNED` along the motion: the pose, the numbers, what stops it.

    Steps into what cannot be assembled, or away from the hand, are halved.
    """
    size, why, share = original.mechanism.size, "", 1.0
    tolerance = max(0.1 * drag.resolution, 1e-12 * size)
    values = {name: value_of(pose.study, name) for name in names if name != TURNED}
    for _ in range(_MOST_STEPS):
        missing = drag.target - pose.at(drag.point)
        if abs(missing) <= tolerance:
            return pose, values, ""
        ways = {name: way for name, way, _ in _ways(original, pose, drag.point, values)}
        ways |= _turning(original, pose, drag.point) if TURNED in names else {}
        if ways.keys() != {*names}:
            break
        step, gone = _nearest(ways, names, missing)
        if gone <= tolerance:
            break
        part = share * min(1.0, _LONGEST * size / gone)
        tried = {name: value + part * step[name] for name, value in values.items()}
        row = _place(original, pose.row + part * step[TURNED]) if TURNED in names else None
        try:
            there = pose.with_values(original, {**pose.changes, **tried}, row)
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


def _preferred(original: Study, pose: _Pose, drag: Drag) -> dict[str, complex]:
    """Where a point goes by each number that a drag may change, the preferred ones first."""
    drawn = _drawn(original, drag.point)
    kept = [name for name in drag.held if name] if len(drag.held) == 2 else []
    barred = {*drag.locked, *original.fixed, *(pose.study.parameters.measured if drawn else ())}
    names = [name for name in kept or [*drawn, *free_numbers(original)] if name not in barred]

    def rank(name: str, of_places: int) -> int:
        return -1 if name in drag.held else 0 if name in drawn else of_places

    ways = sorted(_ways(original, pose, drag.point, names), key=lambda way: rank(way[0], way[2]))
    return {name: way for name, way, _ in ways if abs(way) > _BLIND}


def _ways(
    original: Study, pose: _Pose, point: str, names: Collection[str]
) -> Iterator[tuple[str, complex, int]]:  # fmt: skip
    """Where a point goes by each number that its links and guides follow, per unit of it; with the rank of these."""
    mechanism = pose.study.mechanism
    ranks = _ranks(mechanism, point)
    if not ranks or not names:
        return
    nodes = mechanism.linearize(pose.configuration).sensitivity([*ranks]).nodes[mechanism.graph.node(point)]
    moves = dict(zip(ranks, np.broadcast_to(nodes, (len(ranks), 1))[:, 0], strict=True))
    exact = _by_drives(original)
    for name in names:
        slopes = _slopes(original, pose, name)
        if moved := [place for place in slopes if place in ranks]:
            way = sum(moves[place] * slopes[place] for place in moved) if exact else _way(original, pose, point, name)
            yield name, complex(way), min(ranks[place] for place in moved)


def _ranks(mechanism: Mechanism, point: str) -> dict[str, int]:
    """Dimensions of a point's links, and of the guides along which these slide, by how soon a drag changes them.

    0 of a coordinate of the point itself, 1 of lengths and of the point of a guide, 2 of what else a guide has and of
    places of other points.
    """
    links, through = {*mechanism.graph.links_at(point)}, dict[str, str]()
    for name, joint in mechanism.description.joints.items():
        if isinstance(joint, Sliding) and links & {*joint.links}:
            through[name] = f"{joint.line.link}.{joint.line.through}"
    owners = {*(("links", link) for link in links), *(("joints", guide) for guide in through)}
    ranks = dict[str, int]()
    for name, place in mechanism.description.places.items():
        owner, _, axis = name.rpartition(".")
        guides = owner in through.values()
        if place.quantity not in ("length", "angle") or not (place.path[:2] in owners or guides):
            continue
        if axis in ("x", "y") and not guides:
            ranks[name] = 0 if owner.rpartition(".")[2] == point else 2
        else:
            ranks[name] = 2 if owner in through else 1
    return ranks


def _way(original: Study, pose: _Pose, point: str, name: str) -> complex:
    """Where a point goes by a number at a pose whose motion does not give the drives; by a difference."""
    value = value_of(pose.study, name)
    step = _STEP * (abs(value) or pose.study.mechanism.size)
    try:
        there = pose.with_values(original, {**pose.changes, name: value + step})
    except MechdesignError:
        return complex(np.nan)
    return (there.at(point) - pose.at(point)) / step


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


def _turning(original: Study, pose: _Pose, point: str) -> dict[str, complex]:
    """Where a point goes along the motion, per row of it; nothing where that ends or stands still."""
    ends = [_place(original, pose.row + way * _BESIDE) for way in (-1, 1)]
    low, high = (pose.of(pose.study, end) for end in ends)
    # Round the end of a closed motion a row is as long as elsewhere.
    span = 2 * _BESIDE if _goes_round(original) else ends[1] - ends[0]
    way = (high.at(point) - low.at(point)) / span
    return {TURNED: way} if np.isfinite(way) and abs(way) > _BLIND else {}


def _spans(ways: Mapping[str, complex]) -> bool:
    """Whether two of the ways lead anywhere in the plane."""
    directions = [way / abs(way) for way in ways.values()]
    return any(abs((one.conjugate() * other).imag) > _FULL for one, other in combinations(directions, 2))


def _fewest(ways: Mapping[str, complex], missing: complex) -> tuple[str, ...]:
    """The first number, else the first pair, that brings a point all the way; else what brings it nearest."""
    best: tuple[str, ...] = ()
    least = math.inf
    for count in (1, 2):
        for names in combinations(ways, count):
            step, _ = _nearest(ways, names, missing)
            far = abs(missing - sum(ways[name] * step[name] for name in names)) / (abs(missing) or 1.0)
            if far <= _ALIKE:
                return names
            if far < least - _ALIKE:
                best, least = names, far
    return best


def _nearest(ways: Mapping[str, complex], names: Sequence[str], missing: complex) -> tuple[dict[str, float], float]:
    """Changes of numbers that bring a point as near as they can to where it is missing, and how far it goes by them."""
    matrix = np.array([[ways[name].real for name in names], [ways[name].imag for name in names]])
    step: Floats = np.linalg.lstsq(matrix, [missing.real, missing.imag], rcond=1e-6)[0]
    return dict(zip(names, step.tolist(), strict=True)), float(np.abs(matrix @ step).max())


def _rounded(study: Study, name: str, value: float, resolution: float) -> float:
    """A value without digits that nobody sees: an angle is rounded as far as it turns the mechanism's size."""
    place = study.mechanism.description.places.get(name)
    if place is not None and place.quantity == "angle":
        resolution /= study.mechanism.size * study.parameters.factors[name]
    if resolution <= 0 or not math.isfinite(value):
        return value
    return round(value, -math.floor(math.log10(resolution)))
