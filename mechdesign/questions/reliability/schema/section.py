"""The reliability section of the study file, and its checks against the mechanism.

Where a pin has a clearance its links have that point in places of their own. The clearance moves the pin in one link;
the point's coordinates are those of the other links. An output or a limit may name its link, ``coupler.P.x``, and then
the pin moves in another one. Where the pin gives, by a bearing of the stiffness section, every link has an end of it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple, Self

from pydantic import BeforeValidator, Field

from mechdesign.commands import COMMANDS
from mechdesign.ground.expressions import Number
from mechdesign.mechanism.graph import GROUND, OF_LINKS, Graph
from mechdesign.questions.dynamics.schema import DynamicsSection, column_kinds
from mechdesign.questions.kinematics.schema import KinematicsSection
from mechdesign.questions.reliability.schema.allocation import Allocate, check_allocation
from mechdesign.questions.reliability.schema.clearances import Clearance, check_clearance
from mechdesign.questions.reliability.schema.limits import ErrorLimit, split_order
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.variation import LOADS, Dimension, ToleranceClass, check_dimensions
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.study.building.section import MechanismSection
from mechdesign.study.schema.checker import NO_MOMENT, ORDERS, Checker
from mechdesign.study.schema.poses import MotionSection, source_of
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import Context, failure, read_number, shown

# Names as those of columns of dynamics.
_LIKE_A_COLUMN = re.compile(r"_(effort|power|energy|force(_on_\w+)?)$|^shaking")

DEFAULT_METHODS = ("analytic", "monte_carlo")


class Precision(fields.Model):
    """How precise a probability of failure is wanted: one of ``relative`` and ``half_width``; a number alone is
    ``relative``.
    """

    bare, short = "relative", (fields.NUMBER_FORM,)
    one_of = (
        "give either 'relative', a coefficient of variation, or 'half_width', half the 99.7 % interval",
        "relative",
        "half_width",
    )
    relative: fields.Positive | None = None
    """Coefficient of variation: standard error over probability of failure. Example: 0.05"""
    half_width: fields.Positive | None = None
    """Half the width of the 99.7 % interval of the probability of failure. Example: 1e-4"""


class Correlated(NamedTuple):
    """Two dimensions and the correlation coefficient of their deviations."""

    one: str
    other: str
    coefficient: float


def _correlation(raw: Any, context: Context) -> Correlated:
    if not isinstance(raw, list) or len(raw) != 3 or not all(isinstance(name, str) for name in raw[:2]):
        raise failure(f"a correlation is [name, name, coefficient], for example [r1, r2, 0.5], not {shown(raw)}")
    coefficient = read_number(raw[2], context, "none")
    if abs(coefficient) >= 1.0:
        raise failure(f"a correlation lies between -1 and 1, not {coefficient:g}; what is the same is one parameter")
    if raw[0] == raw[1]:
        raise failure(f"{raw[0]!r} is correlated with itself; name two different ones")
    return Correlated(raw[0], raw[1], coefficient)


_CORRELATION = {
    "type": "array",
    "prefixItems": [fields.NAME_FORM, fields.NAME_FORM, fields.NUMBER_FORM],
    "minItems": 3,
    "maxItems": 3,
}


_Method = Annotated[str, fields.choice(METHODS, "method of reliability")]


class ReliabilitySection(MotionSection):
    """What varies when the mechanism is made, what its errors may be, and how they are computed."""

    command: ClassVar[str] = "reliability"
    dimensions: dict[str, Dimension] = Field(default_factory=dict)
    """What varies, by the name of a parameter, of one place (rod.length, ground.G.y, guide.direction, slider.B.x,
    crank.mass, return.stiffness; ``*.length`` for all such), of a drive (its positioning error) or of the load
    (load.fx, load.fy, load.mz).
    Example: {r1: {tolerance: 0.03, distribution: uniform}, '*.length': 0.02,
    theta: 0.01}
    """
    clearances: dict[str, Clearance] = Field(default_factory=dict)
    """Clearances of pins, by their point, and of slides, by their joint; backlash of couplings by their names.
    Example: {E: {radial: 0.03, tolerance: 0.01, pin: normal_in_disc}, gears: {backlash: 0.1 deg}}
    """
    correlation: tuple[Annotated[Correlated, fields.Read(_correlation, _CORRELATION)], ...] = ()
    """Pairs of names in ``dimensions`` and the correlation coefficient of their deviations, between -1 and 1. Left out:
    independent. Example: [[r1, r2, 0.5]]
    """
    limits: dict[fields.CoordinateName, ErrorLimit] = Field(default_factory=dict)
    """What errors may be in each pose, by coordinate, measure or point; of velocities and accelerations C.x_velocity
    and so on; of efforts and forces by the column of dynamics (theta_effort, shaking, A_force). The reliability is the
    chance that all are kept. Example: {P.x: 0.05, rocker.angle: [-0.2, 0.1]} Example: {P: {radius: 0.05}}
    """
    load: tuple[fields.Number, ...] | None = None
    """Mean load [fx, fy, mz] on the stiffness section's point, whose deflection is part of the errors; it varies by
    ``dimensions``. Left out: none. Example: [0, -60, 0]
    """
    methods: Annotated[tuple[_Method, ...], BeforeValidator(fields.as_list), fields.OrShort()] = DEFAULT_METHODS
    """How errors and reliability are computed; one alone needs no list. Example: [analytic, monte_carlo]"""
    samples: Annotated[int, fields.whole(2, 10**15)] = 40_000
    """Made mechanisms of each sampling method at each pose; of auto the most. Left out, auto takes at most 2,000,000.
    Example: 100000
    """
    precision: Precision | None = None
    """Precision at which auto ends. Left out: relative 0.05. Example: 0.01"""
    sobol: Annotated[int, fields.whole(0, 10**9)] | None = None
    """Sample size of the Sobol' indices, at every pose; 0: none. Left out: they are computed at the first listed poses,
    where a method samples. Example: 4096
    """
    allocate: Allocate | None = None
    """Asks for the cheapest tolerances that reach a reliability or a Cpk at every pose. Example: {reliability: 0.999,
    cost: {r1: 2}} Example: {cpk: 1.33, grades: true}
    """
    shown: Annotated[int, fields.whole(1, 10**9)] | None = None
    """The pose, by its number from 1, at which samples are shown; left out, the one that fails most. Example: 1"""

    def checked(self, checker: Checker) -> Self:
        """Check what varies and what is limited as well; wildcards and the clearances' links are filled in."""
        columns = _columns_of_dynamics(checker, self)
        named_links = _links_of_points(checker, self)
        dimensions = check_dimensions(checker, self.dimensions)
        clearances = {
            point: right
            for point, clearance in self.clearances.items()
            if (right := check_clearance(checker, point, clearance, named_links.get(point))) is not None
        }
        for name, limit in self.limits.items():
            _limit(checker, self, name, limit, columns)
        if sum(limit.timing == "free" for limit in self.limits.values()) > 1:
            checker.report(("reliability", "limits"), "one drive is free to follow one point")
        for index, correlated in enumerate(self.correlation):
            for place, name in enumerate((correlated.one, correlated.other)):
                checker.check_name(name, dimensions, "varying dimension", ("reliability", "correlation", index, place))
        pairs = [frozenset(pair[:2]) for pair in self.correlation]
        for index, pair in enumerate(pairs):
            if pair in pairs[:index]:
                checker.report(("reliability", "correlation", index), "this pair is given twice; leave one out")
        if not self.methods:
            checker.report(("reliability", "methods"), "name at least one method, as in [analytic, monte_carlo]")
        for index, method in enumerate(self.methods):
            if method in self.methods[:index]:
                checker.report(("reliability", "methods", index), f"{method!r} is given twice")
            ends = set(clearances).difference(checker.mechanism.owners)
            at_walls = sorted(name for name in ends if clearances[name].pin.monte_carlo == "contact")
            if at_walls and (METHODS[method].step or METHODS[method].precise):
                message = (
                    f"the play of {at_walls[0]!r} is at one end or at the other, and {method} needs errors that change "
                    "gradually; ask for monte_carlo or another pin model"
                )
                checker.report(("reliability", "methods", index), message)
        if self.shown is not None and not any(METHODS[method].sampled for method in self.methods):
            message = "no method draws samples that could be shown; ask for monte_carlo, say, or leave it out"
            checker.report(("reliability", "shown"), message, at_key=True)
        if self.allocate is not None:
            check_allocation(checker, self.allocate, dimensions, clearances, self.limits)
        load = _load(checker, self, dimensions)
        parts = {name: split_link(checker.mechanism, name) for name in (*(self.outputs or ()), *self.limits)}
        stiffness = checker.parts.get("stiffness")
        springs = set(stiffness.bearings if stiffness is not None else ()) - self.clearances.keys()
        if len({name if parts[name][2] in springs else parts[name][1] for name in self.limits}) < len(self.limits):
            checker.report(("reliability", "limits"), "the same error is limited twice; leave one out")
        # All names of a pin with a clearance mean the same link.
        names = {name: plain if point in self.clearances else name for name, (_, plain, point) in parts.items()}
        limits = {names[name]: limit for name, limit in self.limits.items()}
        outputs = None if self.outputs is None else tuple(names[name] for name in self.outputs)
        checker.outputs(outputs, ("reliability", "outputs"), columns)
        filled = {"dimensions": dimensions, "clearances": clearances, "load": load}
        return super().checked(checker).model_copy(update=filled | {"outputs": outputs, "limits": limits})


def split_link(mechanism: MechanismSection, name: str) -> tuple[str, str, str]:
    """The link named before a coordinate or point (empty if none), the name without it, and the point."""
    link, _, rest = name.partition(".")
    points = {part: point for point in mechanism.owners for part in (point, *mechanism.coordinates_of(point))}
    base, _ = split_order(rest, points.__contains__)
    if base in OF_LINKS or link not in mechanism.links or base not in points:
        return "", name, ""
    return link, rest, points[base]


def _links_of_points(checker: Checker, section: ReliabilitySection) -> dict[str, str]:
    """The link named for each point with a clearance; contradictions are reported."""
    chosen: dict[str, str] = {}
    named: list[tuple[KeyPath, str, bool]] = [
        *((("reliability", "outputs", k), name, False) for k, name in enumerate(section.outputs or ())),
        *((("reliability", "limits", name), name, True) for name in section.limits),
    ]
    if (workspace := checker.parts.get("workspace")) is not None:
        named.append((("workspace", "point"), workspace.point, False))
    for path, part, at_key in [(path, part, key) for path, name, key in named for part in _parts(checker, name)]:
        link, _, point = split_link(checker.mechanism, part)
        if not link:
            continue
        links, own = checker.mechanism.owners[point], section.clearances.get(point)
        if link not in links:
            message = f"link {link!r} has no point {point!r}; it belongs to {' and '.join(links)}"
            checker.report(path, message, at_key=at_key)
        elif own is not None and chosen.setdefault(point, link) != link:
            message = f"{point!r} is that of link {chosen[point]!r} elsewhere; all outputs and limits mean one of them"
            checker.report(path, message, at_key=at_key)
        if own is not None and link in links and (own.link == link or len(links) < 2):
            message = (
                f"the clearance of {point!r} moves its pin in link {link!r}, and the coordinates of {point!r} are "
                "those of what else it joins; give reliability.clearances another 'link', or none"
            )
            checker.report(path, message, at_key=at_key)
    return chosen


def _parts(checker: Checker, name: str) -> list[str]:
    """A coordinate, and the names in it if it is a measure or the velocity or acceleration of one."""
    measures, names = checker.mechanism.measures, [name]
    for part in names:
        measure = measures.get(split_order(part, measures.__contains__)[0])
        if measure is not None:
            words = measure.distance or re.findall(r"[\w.]+", measure.expression or "")
            names += [word for word in words if word not in names]
    return names


def _load(checker: Checker, section: ReliabilitySection, dimensions: dict[str, Dimension]) -> tuple[float, ...] | None:
    """The load as fx, fy, mz."""
    path: KeyPath = ("reliability", "load")
    report, stiffness = checker.report, checker.parts.get("stiffness")
    random = [name for name in LOADS if name in dimensions]
    if checker.reporter.document.raw(("stiffness",)) is None:
        missing = "a load acts at the point of the stiffness section, and the study has none"
        if section.load is not None:
            report(path, missing)
        for name in random:
            report(("reliability", "dimensions", name), missing, at_key=True)
    on_pin = stiffness is not None and stiffness.link is None
    if on_pin and "load.mz" in random:
        report(("reliability", "dimensions", "load.mz"), NO_MOMENT, at_key=True)
    return None if section.load is None else checker.load(section.load, path, on_pin=on_pin)


def _columns_of_dynamics(checker: Checker, section: ReliabilitySection) -> dict[str, str]:
    """Kinds of the columns of dynamics that outputs and limits may name; coordinates of the same name go before them.

    Reports what a study that names one lacks: the section dynamics, or rates. A kind that is not known is empty.
    """
    mechanism, compiled = checker.mechanism, checker.compiled
    if compiled is None:
        # The joints are not known where the mechanism itself has mistakes: what looks like such a column may be one.
        return {name: "" for name in (*(section.outputs or ()), *section.limits) if _LIKE_A_COLUMN.search(name)}
    places: dict[str, KeyPath] = {name: ("reliability", "outputs", k) for k, name in enumerate(section.outputs or ())}
    places |= {name: ("reliability", "limits", name) for name in section.limits}
    dynamics: DynamicsSection | None = checker.parts.get("dynamics")
    joints = (dynamics or DynamicsSection()).joints(compiled)
    pace = pace_of(section, dynamics, checker.parts.get("kinematics"))
    own = pace.motion is not None or pace.inverse(compiled.drives)
    elsewhere = own and source_of(checker, pace) is not source_of(checker, section)
    still = column_kinds(compiled, joints, moving=False)
    kinds = {
        name: kind for name, kind in column_kinds(compiled, joints, moving=True).items()
        if not (name in mechanism.coordinates or name in mechanism.owners or split_link(mechanism, name)[0])
    }  # fmt: skip
    for name, path in places.items():
        message = ""
        if name not in kinds:
            continue
        if dynamics is None and checker.reporter.document.raw(("dynamics",)) is None:
            example = "dynamics: {gravity: [0, -9.81 m/s^2]}"
            message = f"{name!r} is a column of dynamics, and the study has no such section; add one, such as {example}"
        elif name not in still and not pace.rated:
            message = f"{name!r} needs velocities: give 'rates' of the drives"
        elif elsewhere:
            message = (
                f"{name!r} follows the rates of {pace.command}, and these are of its own poses; give reliability "
                "'rates' of the drives"
            )
        if message:
            checker.report(path, message, at_key=path[1] == "limits")
    return kinds if dynamics is not None else {name: kinds[name] for name in places if name in kinds}


def pace_of(
    section: ReliabilitySection, dynamics: DynamicsSection | None, kinematics: KinematicsSection | None
) -> MotionSection:
    """The section whose rates the mechanism has: its own, else those that dynamics has or takes from kinematics."""
    if section.rated or dynamics is None:
        return section
    return dynamics if dynamics.moves or kinematics is None else kinematics


def _limit(
    checker: Checker, section: ReliabilitySection, name: str, limit: ErrorLimit, columns: Mapping[str, str]
) -> None:
    path: KeyPath = ("reliability", "limits", name)
    mechanism, report = checker.mechanism, checker.report
    if name in columns:
        if limit.radius is not None:
            report(path, f"a radius is that of a point; limit {name!r} by two numbers, or by 'usl'", at_key=True)
        if columns[name]:
            checker.kind(path, columns[name])
        return
    names = mechanism.owners if limit.radius is not None else {**mechanism.coordinates, **mechanism.owners}
    name = split_link(mechanism, name)[1]
    base, order = split_order(name, names.__contains__)
    if order and not section.rated:
        report(path, "a limit of a velocity or an acceleration needs 'rates', a 'speed' or a 'motion'", at_key=True)
    if limit.timing == "free" and (order or len(mechanism.drives) != 1 or checker.parts.get("stiffness") is not None):
        report((*path, "timing"), "the time is free of the places of a rigid mechanism of one drive")
    if limit.radius is not None:
        if checker.check_name(base, mechanism.owners, "point", path, at_key=True):
            checker.kind(path, ORDERS["length"][order])
    elif base in mechanism.owners:
        report(path, f"{name!r} is a point: limit {name}.x and {name}.y, or {{radius: r}}", at_key=True)
    elif base not in names and base.partition(".")[0] in COMMANDS:
        message = (
            "a limit is of the error of a coordinate in one pose, not of a result; of a swing or a stroke draw the "
            "linkage twice, at both ends, and limit a measure between, e.g. mechanism.measures: {swing: {angle: "
            "[rocker_1, rocker_2]}} and reliability.limits: {swing: 0.2}"
        )
        report(path, message, at_key=True)
    else:
        checker.coordinate(base, path, at_key=True, others=columns, also="column of dynamics", order=order)


def others(section: ReliabilitySection | None, graph: Graph) -> Mapping[str, tuple[str, list[str]]]:
    """Of each point with a clearance the link that its pin moves in, and those whose point its coordinates are."""
    joined: dict[str, tuple[str, list[str]]] = {}
    for point, clearance in (section.clearances if section is not None else {}).items():
        if point in graph.slides or clearance.backlash is not None:
            continue
        joined[point] = clearance.link or "", [link for link in graph.links_at(point) if link != clearance.link]
    return joined


def links_meant(
    section: ReliabilitySection | None, stiffness: StiffnessSection | None, graph: Graph
) -> dict[str, list[str]]:
    """Of each pin that has a clearance or gives, the links whose ends of it its plain name means.

    Of a pin that gives these are all, and it lies midway; but where the ground has it, or the stiffness section asks it
    of a link, that one.
    """
    linked: dict[str, list[str]] = {}
    if stiffness is not None:
        bodies = {stiffness.at: [stiffness.link]} if stiffness.link is not None else {}
        pins = {point: links for point in stiffness.bearings if (links := graph.links_at(point))}
        linked = {point: [GROUND] if GROUND in links else bodies.get(point, links) for point, links in pins.items()}
    return linked | {point: rest for point, (_, rest) in others(section, graph).items()}


def in_words(section: ReliabilitySection | None, graph: Graph, sizes: Mapping[str, float]) -> list[str]:
    """A line for each clearance, and for each fit and tolerance class with its size in the study's units.

    `sizes` are the nominal values of parameters and places.
    """
    if section is None:
        return []
    lines = [
        f"clearance: the pin {point} moves in {link}; {point}.x and {point}.y are those of "
        f"{' and '.join(rest) or 'the joint'}"
        for point, (link, rest) in others(section, graph).items()
    ]
    for name, clearance in section.clearances.items():
        if name in graph.slides:
            tilts = ", and tilts as its ends do" if clearance.length is not None else ""
            lines.append(f"clearance: the slider of {name} shifts across its line{tilts}")
        if clearance.backlash is not None:
            lines.append(f"clearance: the coupling {name} plays from one flank to the other by its backlash")
        if clearance.fit is not None:
            half = 0.5 * (clearance.fit.hole + clearance.fit.shaft)
            lines.append(
                f"fit: {name}, {clearance.fit.text}: radial clearance {clearance.radius - half:.6g} to "
                f"{clearance.radius + half:.6g}"
            )
    classes: dict[tuple[str, tuple[Number, Number]], list[str]] = {}
    for name, dimension in section.dimensions.items():
        if isinstance(tolerance := dimension.tolerance, ToleranceClass):
            classes.setdefault((tolerance.text, dimension.ends(sizes[name])), []).append(name)
    lines += [
        f"tolerance: {text} of {', '.join(names)}: {low:+.6g} to {high:+.6g}"
        for (text, (low, high)), names in classes.items()
    ]
    return lines
