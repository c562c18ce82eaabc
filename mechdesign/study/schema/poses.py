"""Poses and rates as the study file gives them: a list, a sweep, a path; or both as a motion over time."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, model_validator

from mechdesign.ground.errors import cut
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.motions import CourseText
from mechdesign.study.schema.paths import PathSection, Speed
from mechdesign.study.schema.section import Section
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import failure

# Default number of poses of a motion over time.
INSTANTS = 181


def _range(raw: list[Any] | str) -> str:
    """The keys of a range written as ``[0, 360, 5]``, ``0..360`` or ``0:5:360``; empty for anything else."""
    parts = raw if isinstance(raw, list) else re.split(r"\s*(?:\.\.+|:|\s+to\s+)\s*", raw)
    if isinstance(raw, str) and len(parts) == 3:
        parts = [parts[0], parts[2], parts[1]]
    if len(parts) == 2:
        return f"from: {parts[0]}, to: {parts[1]}, number: 73"
    return "from: {}, to: {}, step: {}".format(*parts) if len(parts) == 3 else ""


class SweepText(fields.Model):
    """Values of one coordinate, both ends included; a number alone is held."""

    short = (fields.NUMBER_FORM,)
    from_: fields.Number = Field(alias="from")
    """First value, in the coordinate's unit. Example: 0"""
    to: fields.Number
    """Last value; with a ``step`` that does not lead to it, the last one before it. Example: 360"""
    step: fields.Number | None = None
    """Distance of the values, negative where they fall. Give this or ``number``. Example: 5"""
    number: Annotated[int, fields.whole(1, 10_000_000)] | None = None
    """How many values, both ends included. Example: 73"""

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        if isinstance(raw, list | str) and (ends := _range(raw)):
            raise failure(f"a sweep is written {{{ends}}}, not {raw}")
        return {"from": raw, "to": raw, "number": 1} if isinstance(raw, int | float | str) else raw

    def faults(self) -> Iterator[str]:
        if (self.step is None) == (self.number is None):
            yield "a sweep needs either 'step' or 'number'"

    def misfits(self) -> Iterator[fields.Misfit]:
        if self.step is not None:
            astray = (self.step == 0) | (self.step * (self.to - self.from_) < 0)
            numbers = (self.step, self.from_, self.to)
            yield fields.Misfit(astray, "a step of {} never leads from {} to {}", numbers)


def _sweeps(raw: Any) -> Any:
    """Ranges by coordinate as they are; a range without its coordinate is a mistake."""
    if not isinstance(raw, dict) or len(raw) < 2 or any(isinstance(value, dict) for value in raw.values()):
        return raw
    given = {key: raw[key] for key in SweepText.fields_by_key() if key in raw}
    names = [value for key, value in raw.items() if key not in given and fields.NAME.fullmatch(str(value))]
    # A coordinate may have the name of a key, and be held: {theta: 30, step: 5}.
    if not given or not (names or given.keys() & {"from", "to"}):
        return raw
    spaced = given.keys() & {"step", "number"}
    example = {"from": 0, "to": 360} | ({} if spaced else {"step": 5}) | given
    missing = [f"'{key}'" for key in example if key not in given]
    form = ", ".join(f"{key}: {cut(str(value))}" for key, value in example.items())
    lack = f", and {' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing" if missing else ""
    raise failure(
        f"a range stands below the name of its coordinate{lack}: write {{{cut([*names, 'theta'][0])}: {{{form}}}}}"
    )


def _poses(raw: Any) -> Any:
    if raw == "workspace":
        return ()
    if isinstance(raw, list) and not raw:
        raise failure("an empty list of poses; give one or more, such as [{theta: 30}]")
    for pose in raw if isinstance(raw, list) else ():
        if isinstance(pose, int | float | str):
            raise failure(f"a pose names its coordinates, as in [{{theta: {cut(str(pose))}}}]")
    return raw


Pose = dict[fields.CoordinateName, fields.Number]


class PoseSection(Section):
    """Where a question is asked: listed poses, a sweep, a path, or the nodes of the workspace section.

    The list is empty where the study says ``poses: workspace``.
    """

    sources: ClassVar[tuple[str, ...]] = ("poses", "sweep", "path")  # keys of which one gives the poses
    poses: Annotated[tuple[Pose, ...], BeforeValidator(_poses), fields.OrShort({"const": "workspace"})] | None = None
    """Poses one by one, each with as many coordinates as the mobility: drives, others (C.x, platform.angle) or a mix.
    ``workspace``: the nodes of the workspace section. Left out, with no ``sweep``, ``path`` or ``motion``: those of
    kinematics, and there a turn of the drive or its limits. Example: [{theta1: 30, theta2: 60}, {C.x: 0.2, C.y: 1.1}]
    Example: workspace
    """
    sweep: Annotated[dict[fields.CoordinateName, SweepText], BeforeValidator(_sweeps)] | None = None
    """Ranges of coordinates; several make a grid, and a number alone is held. Example: {theta: {from: 0, to: 360, step:
    5}}
    """
    path: dict[fields.CoordinateName, PathSection] | None = None
    """What a point or coordinates pass: places one after the other, a CSV file, a circle, an arc or a line; a number
    alone is held. Example: {C: [[10, 20], [15, 20], [20, 25]]} Example: {C: {circle: {center: [0, 220], radius: 40}},
    platform.angle: 0}
    """

    @property
    def fallbacks(self) -> tuple[str, ...]:
        """Sections whose poses it takes without any of its own."""
        return ("kinematics",)

    @property
    def at_nodes(self) -> bool:
        """Whether the poses are the nodes of the workspace section."""
        return self.poses == ()

    @property
    def source(self) -> str | None:
        """The key that gives the poses; None if there is none."""
        return next(iter(self.given(*self.sources)), None)

    def faults(self) -> Iterator[str]:
        given = self.given(*self.sources)
        if len(given) > 1:
            yield f"{' and '.join(given)} are both given; poses come from one of them"

    def checked(self, checker: Checker) -> Self:
        """The section; names and units of the coordinates that poses give are checked against the mechanism."""
        if self.at_nodes and checker.reporter.document.raw(("workspace",)) is None:
            checker.report((self.command, "poses"), "needs the workspace section, whose nodes are meant")
        for index, pose in enumerate(self.poses or ()):
            checker.coordinates(pose, (self.command, "poses", index))
        checker.coordinates(self.sweep or (), (self.command, "sweep"))
        for name, path in (self.path or {}).items():
            if name in checker.mechanism.owners:
                continue
            place: KeyPath = (self.command, "path", name)
            if checker.coordinate(name, place, at_key=True) is not None and (path.spline or path.shape is not None):
                shape = "spline" if path.spline else f"{path.shape}"
                checker.report(place, f"{name!r} is no point: a {shape} is the path of a point", at_key=True)
        return self


_MEANS = {"time": "by the velocities of the poses"}


class MotionSection(PoseSection):
    """Poses, how the mechanism moves through them, and the coordinates that are asked for."""

    sources: ClassVar[tuple[str, ...]] = (*PoseSection.sources, "motion")
    outputs: fields.CoordinateNames | None = None
    """Coordinates, measures and points (their x and y) that are asked for; in reliability columns of dynamics as well
    (theta_effort, A_force). Left out: every moving point, link and slide; in reliability what is limited, if anything
    is. Example: [C, rod.angle, mu]
    """
    rates: dict[fields.CoordinateName, fields.Number] = Field(default_factory=dict)
    """Velocities of drives, or of all coordinates that the poses give; velocities and accelerations of the outputs (or
    their errors) follow. A bare number is in the coordinate's unit per unit of time. Example: {theta: 5 rad/s}
    """
    accelerations: dict[fields.CoordinateName, fields.Number] = Field(default_factory=dict)
    """Accelerations of what has ``rates``. Left out: 0. Example: {theta: 2 rad/s^2}"""
    speed: Speed | None = None
    """Constant speed of the path's point along it, instead of ``rates``; those of the drives follow from the path's
    direction and curvature. On a polyline each segment is passed without acceleration. Example: 100 mm/s
    """
    means: Annotated[str, fields.choice(_MEANS, "variable of means")] | None = None
    """What means, rms and evenness of the motion are over. Left out: what is swept, or the length of a path; in a
    ``motion`` time. Example: time
    """
    motion: dict[fields.CoordinateName, CourseText] | None = None
    """What drives or other coordinates do over time, as many as the mobility, in place of poses and rates: moves by a
    law and dwells, or a CSV file of times and values; a number alone is held. All end at the same time. Example:
    {theta: [{to: 90, time: 0.3, law: cycloidal}, {dwell: 0.1}, {to: 0, time: 0.4}]} Example: {C.x: {file:
    law.csv}, C.y: 120}
    """
    instants: Annotated[int, fields.whole(2, 10_000_000)] | None = None
    """How many poses of a ``motion`` are evenly spread in time; the ends of its segments are added to them. Left out:
    |INSTANTS|. Example: 361
    """

    @property
    def rated(self) -> bool:
        """Whether velocities and accelerations are asked for."""
        return bool(self.rates or self.accelerations or self.speed or self.motion)

    def faults(self) -> Iterator[str]:
        yield from super().faults()
        if self.motion is not None and not self.motion:
            yield "an empty motion; give coordinates, {theta: [{from: 0, to: 90, time: 0.3}]}"
        if self.motion is None and self.instants is not None:
            yield "'instants' are those of a 'motion', and the section has none"

    def checked(self, checker: Checker) -> Self:
        """Check rates, accelerations and the speed as well."""
        checker.coordinates(self.rates, (self.command, "rates"), 1)
        checker.coordinates(self.accelerations, (self.command, "accelerations"), 2)
        of_kinematics = checker.parts.get("kinematics")
        if self.means is not None and not (self.rated or (of_kinematics is not None and of_kinematics.rated)):
            message = "means over time need velocities: give 'rates', a 'speed' or a 'motion'"
            checker.report((self.command, "means"), message, at_key=True)
        if _motion(source_of(checker, self)):
            _check_motion(checker, self)
        elif self.speed is not None:
            _check_speed(checker, self)
        else:
            _check_rates(checker, self)
        return super().checked(checker)

    def clocked(self, name: str | None) -> bool:
        """Whether a coordinate, or the way along a path, changes evenly with time, and so do means over it."""
        even = name in self.rates and not self.accelerations.get(name)
        return even or self.speed is not None or self.motion is not None

    def inverse(self, drives: Collection[str]) -> bool:
        """Whether its rates are those of the coordinates that the poses give rather than of the drives."""
        return self.speed is not None or not {*self.rates, *self.accelerations, *(self.motion or ())} <= {*drives}


def _check_motion(checker: Checker, section: MotionSection) -> None:
    """Check what moves over time, and that nothing else gives rates."""
    for name, course in (section.motion or {}).items():
        course.checked(checker, name, (section.command, "motion", name))
    if section.motion and "time" in checker.mechanism.coordinates:
        message = "a coordinate is named 'time', as the column of times is: name it otherwise"
        checker.report((section.command, "motion"), message, at_key=True)
    for key in ("rates", "accelerations", "speed"):
        if not getattr(section, key):
            continue
        message = f"'motion' and {key!r} are both given; a motion over time has rates of its own"
        if section.motion is None:
            message = (
                f"the poses are those of the motion of kinematics, which has rates of its own: leave out {key!r}, and "
                "give 'motion' here too where velocities are asked for"
            )
        checker.report((section.command, key), message, at_key=True)


def _check_rates(checker: Checker, section: MotionSection) -> None:
    """Check that rates and accelerations are those of drives, or of all coordinates that the poses give.

    Along a motion that other coordinates give, drives have no rates of their own: they follow from the motion.
    """
    drives = checker.mechanism.driven_kinds
    source = source_of(checker, section)
    given = _sets(checker, source)
    one = given[0] if len(given) == 1 else set()
    parts = (("rates", section.rates), ("accelerations", section.accelerations))
    inverse = any(name in one and name not in drives for _, values in parts for name in values)
    for key, values in parts:
        for name in values:
            if name not in checker.mechanism.coordinates or name in (one if inverse else drives):
                continue
            message = f"{name!r} is not a drive: {key} are those of {', '.join(drives)}"
            if inverse:
                message = f"{name!r} is not among what the poses give: {key} are those of {', '.join(sorted(one))}"
            elif one and not one <= set(drives):
                message += f", or of all coordinates that the poses give, {', '.join(sorted(one))}"
            elif len(given) > 1:
                message += " where poses give different coordinates"
            checker.report((section.command, key, name), message, at_key=True)
        missing = sorted(one - set(values)) if inverse and values else []
        if missing:
            message = f"{', '.join(missing)} missing: {key} are those of all coordinates that the poses give"
            checker.report((section.command, key), message, at_key=True)
        if values and not inverse and len(drives) > 1 and one and not one <= set(drives) and _moves(source):
            others = ", ".join(sorted(one))
            message = (
                f"rates of drives that do not change are not those of this motion, which {others} give: say 'speed', "
                f"of a point along its path, or the {key} of {others}; those of the drives follow from them"
            )
            checker.report((section.command, key), message, at_key=True)


def _check_speed(checker: Checker, section: MotionSection) -> None:
    for key in ("rates", "accelerations"):
        if getattr(section, key):
            message = f"'speed' and {key!r} are both given; a path is passed at one of them"
            checker.report((section.command, key), message, at_key=True)
    path = source_of(checker, section).path
    if path is None:
        message = "a speed is that of a point along its 'path', and the poses are none; give 'rates' of coordinates"
        checker.report((section.command, "speed"), message, at_key=True)
        return
    points = [name for name in path if name in checker.mechanism.owners]
    points += [n[:-2] for n in path if n.endswith(".x") and f"{n[:-2]}.y" in path and n[:-2] not in points]
    if len(points) != 1:
        which = " and ".join(points) or "no point"
        message = f"a speed is that of one point along its path, and this path is that of {which}; give 'rates' instead"
        checker.report((section.command, "speed"), message, at_key=True)


def source_of(checker: Checker, section: PoseSection) -> PoseSection:
    """The section that gives the poses of another: itself, or kinematics."""
    return section if section.source is not None else checker.parts.get("kinematics") or section


def _motion(section: PoseSection) -> dict[str, CourseText]:
    """What a section prescribes over time."""
    return (section.motion or {}) if isinstance(section, MotionSection) else {}


def _moves(section: PoseSection) -> bool:
    """Whether the poses follow one another: a path, or a sweep of one coordinate."""
    moving = [s for s in (section.sweep or {}).values() if s.number != 1 and s.from_ != s.to]
    return section.path is not None or len(moving) == 1


def _sets(checker: Checker, section: PoseSection) -> list[set[str]]:
    """The different sets of coordinates that the poses of a section give."""
    given: list[Iterable[str]] = [names for names in (section.sweep, section.path) if names]
    if section.at_nodes and (region := checker.parts.get("workspace")) is not None:
        given = [(region.point, *region.at)]
    if section.poses:
        given = list(dict.fromkeys(frozenset(pose) for pose in section.poses))
    return [{part for name in names for part in checker.mechanism.coordinates_of(name)} for names in given]
