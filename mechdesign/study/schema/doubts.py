"""Likely mistakes in a study that can be computed: slips of units, places and sizes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import TYPE_CHECKING, Any

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.wheels import carrier_of
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.poses import MotionSection, PoseSection
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import text_of

if TYPE_CHECKING:
    from mechdesign.questions.reliability.schema.section import ReliabilitySection

# Likely angles in turns, and the relative accuracy of radians written with few digits, such as 6.28.
TURNS = (0.25, 0.5, 1.0, 2.0)
DIGITS = 6e-4
# An angle above so many turns, in radians, is likely meant in degrees if it is a multiple of the step.
MOST_TURNS = 4
STEP = 5
# Gravity on the earth, how far from it that of a place may be, as a part of it, and units in which it is known.
EARTH, ON_EARTH = "9.80665 m/s^2", 0.01
ACCELERATIONS = ("m/s^2", "mm/s^2", "cm/s^2", "in/s^2", "ft/s^2")
# Pitch radii of a wheel that differ by this part or less are one; by more than the second no profile shift makes both.
ONE_CIRCLE, SHIFTED = 1e-3, 0.05
# A number of teeth that is so near a whole one is whole, as sizes are written with few digits.
WHOLE_TEETH = 1e-2
# Ratio of the largest link to the smallest from which their units likely differ.
APART = 1000


def note(checker: Checker, parts: Mapping[str, Any], mechanism: Mechanism) -> None:
    """Warn of likely mistakes in the parts of a valid study."""
    for part in parts.values():
        if isinstance(part, PoseSection):
            _angles(checker, part)
    if (dynamics := parts.get("dynamics")) is not None:
        _gravity(checker, dynamics.gravity)
    _lengths(checker, mechanism)
    _pivots(checker, mechanism)
    _wheels(checker, mechanism)
    _planets(checker, mechanism)
    _teeth(checker, mechanism)
    data = checker.reporter.document.data
    if data.get("requirements", ()) is None:
        checker.doubt(("requirements",), "lists nothing, so that no result is judged", at_key=True)
    reliability = parts.get("reliability")
    if reliability is not None:
        _tolerances(checker, reliability)
    for name in checker.mechanism.drives:
        if name.casefold() == GROUND:
            checker.doubt(
                ("mechanism", "drives", name),
                f"{name!r} is the name of a drive, and the ground never moves; name what it moves",
            )


def _angles(checker: Checker, section: PoseSection) -> None:
    """Warn of angles without a unit that are round in the other unit, degrees or radians."""
    factor = checker.units.angle_factor
    for path, sizes in _given(section):
        if checker.mechanism.coordinates.get(str(path[-1])) != "angle":
            continue
        if factor == 1.0:
            slips = [size for size in sizes if size > MOST_TURNS * 2 * math.pi and size % STEP == 0]
            other = "deg"
        else:
            slips = [size for size in sizes for turn in TURNS if abs(size / (turn * 2 * math.pi) - 1) < DIGITS]
            other = "rad"
        if slips and other != checker.units.angle:
            unit = checker.units.label("angle")
            checker.doubt(path, f"{slips[0]:g} is in {unit} here; if {other} is meant, say so: {slips[0]:g} {other}")


def _gravity(checker: Checker, gravity: tuple[float, float]) -> None:
    """Warn of a gravity without a unit that is that of the earth in another one, as 9.81 in a study in mm."""
    units, size = checker.units, math.hypot(*gravity)
    if units.length == "dimensionless" or any(map(text_of, gravity)):
        return
    earth = units.convert(EARTH)
    if size and abs(size / earth - 1) > ON_EARTH:
        for other in ACCELERATIONS:
            if abs(size * units.convert(f"1 {other}") / earth - 1) < ON_EARTH:
                unit = units.label("acceleration")
                message = f"{size:g} is in {unit} here; if {other} is meant, say so: {size:g} {other}"
                checker.doubt(("dynamics", "gravity"), message)


def _given(section: PoseSection) -> Iterator[tuple[KeyPath, list[float]]]:
    """Sizes of the values without a unit of each coordinate, and of the ranges of sweeps and moves."""
    for name, sweep in (section.sweep or {}).items():
        if not text_of(sweep.from_) and not text_of(sweep.to):
            sizes = [abs(sweep.to - sweep.from_), abs(sweep.from_), abs(sweep.to)]
            yield (section.command, "sweep", name), sizes
    for index, pose in enumerate(section.poses or ()):
        for name, value in pose.items():
            if not text_of(value):
                yield (section.command, "poses", index, name), [abs(value)]
    for name, course in (section.motion or {}).items() if isinstance(section, MotionSection) else ():
        ends = [end for segment in course.segments or () for end in (segment.from_, segment.to) if end is not None]
        yield (section.command, "motion", name), [abs(end) for end in ends if not text_of(end)]


def _lengths(checker: Checker, mechanism: Mechanism) -> None:
    """Warn of links whose sizes are so different that their units likely differ."""
    sizes = {
        name: max((abs(a - b) for a, b in combinations(_points(name, mechanism).values(), 2)), default=0.0)
        for name, link in mechanism.description.links.items() if not link.telescopic
    }  # fmt: skip
    positive = {name: size for name, size in sizes.items() if size > 0}
    if not positive:
        return
    least, most = min(positive, key=positive.__getitem__), max(positive, key=positive.__getitem__)
    if positive[most] >= APART * positive[least] * (1 - 1e-9):
        unit = checker.units.label("length")
        sentence = " and ".join(f"{name} is {f'{positive[name]:.6g} {unit}'.strip()} long" for name in (least, most))
        checker.doubt(("mechanism", "links", least), f"{sentence}, a thousand times apart; are both in one unit?")


def _pivots(checker: Checker, mechanism: Mechanism) -> None:
    """Warn of two pins of the ground at the same place."""
    pins = {name: at for name, at in _points(GROUND, mechanism).items() if len(checker.mechanism.owners[name]) > 1}
    for one, other in combinations(pins, 2):
        if abs(pins[one] - pins[other]) <= 1e-9 * max(map(abs, pins.values())):
            checker.doubt(
                ("mechanism", "links", GROUND),
                f"{one!r} and {other!r} are at one place; is it one pivot, or two? Of one, use one name",
            )


def _teeth(checker: Checker, mechanism: Mechanism) -> None:
    """Warn of wheels that have no whole number of teeth of their module."""
    for mesh in mechanism.meshes:
        module = mechanism.description.couplings[mesh.coupling].module
        if module is None:
            continue
        size = float(mechanism.geometry.term(module, {}))
        for radius in map(float, mesh.radii(mechanism.sketch_configuration)):
            teeth = 2 * radius / size
            if abs(teeth - round(teeth)) > WHOLE_TEETH:
                message = f"a wheel of {2 * radius:.6g} pitch diameter has {teeth:.6g} teeth of the module {size:g}"
                checker.doubt(("mechanism", "couplings", mesh.coupling, "module"), message)


def _wheels(checker: Checker, mechanism: Mechanism) -> None:
    """Warn of wheels that are described, and that cannot make what their coupling says."""
    for coupling in mechanism.couplings:
        given = checker.mechanism.couplings[coupling.name]
        described = [key for key in ("wheels", "radius", "pressure_angle", "module") if key in given.model_fields_set]
        made = {mesh.coupling for mesh in mechanism.meshes}
        if not described or given.wheels == "none" or given.cam is not None or coupling.name in made:
            continue
        followed = [part.body for part in coupling.function.parts if part.kind == "angle"]
        wheels = (coupling.follower.body, *followed)
        carrier = None
        if given.ratio is not None and len(wheels) == 2 and all(wheels):
            carrier = carrier_of(mechanism.description, mechanism.graph, wheels)
        reason = (
            "wheels turn about pins of one link and make a ratio of two angles, or of a slide to an angle; write "
            "wheels: none if something else makes it"
        )
        if carrier is not None and given.ratio is not None:
            phase = "phase" if given.phase is None else f"{given.phase:g}"
            reason = (
                f"the ratio is that of angles from the world's x axis, and link {carrier!r}, which carries their axes, "
                f"turns too; write {{to: {given.ratio:g}*{wheels[1]} + {1 - given.ratio:g}*{carrier} + {phase}}}"
            )
        noun = "pulleys" if given.wheels == "belt" else "wheels"
        message = f"no {noun} can make coupling {coupling.name!r}, and their forces are left out: {reason}"
        checker.doubt(("mechanism", "couplings", coupling.name, described[0]), message)


def _planets(checker: Checker, mechanism: Mechanism) -> None:
    """Refuse wheels between coaxial ones that need two pitch circles far apart, and warn of those a little apart."""
    drawn = mechanism.sketch_configuration
    circles: dict[tuple[str, frozenset[int]], tuple[str, float]] = {}
    for mesh in (mesh for mesh in mechanism.meshes if mesh.slide < 0 and not mesh.belt):
        for link, radius in zip(mesh.links, map(float, mesh.radii(drawn)), strict=True):
            coupling, other = circles.setdefault((link, frozenset(mesh.axes)), (mesh.coupling, radius))
            if not abs(radius - other) > ONE_CIRCLE * other:
                continue
            unit, (one, two) = checker.units.label("length"), (mechanism.graph.nodes[axis] for axis in mesh.axes)
            apart = abs(complex(drawn.point(one) - drawn.point(two)))
            message = (
                f"wheel {link!r} needs a pitch radius of {other:.6g} {unit} for {coupling!r} and of {radius:.6g} "
                f"{unit} here, on axes {apart:.6g} {unit} apart; mend a ratio (a ring has the teeth of its sun and "
                "twice those of a planet), clamp two links for a planet of two wheels, or write wheels: none"
            )
            say = checker.report if abs(radius - other) > SHIFTED * other else checker.doubt
            say(("mechanism", "couplings", mesh.coupling), message)


def _points(link: str, mechanism: Mechanism) -> dict[str, complex]:
    """Points of a link in its frame."""
    points = mechanism.description.links[link].points
    return {name: complex(mechanism.geometry.place(link, name, {})) for name in points}


def _tolerances(checker: Checker, section: ReliabilitySection) -> None:
    """Warn of lengths of links that are smaller than their tolerance or standard deviation."""
    parameters, links = checker.parameters, checker.mechanism.links
    lengths = {f"{name}.length" for name in links} & checker.places.keys()
    for name, dimension in section.dimensions.items():
        low, high = map(float, dimension.ends(checker.size(name)))
        width = max(-low, high, dimension.sigma or 0.0)
        slopes = parameters.derivatives(name) if name in parameters.names() else {}
        for place in lengths & slopes.keys():
            size = checker.places[place].nominal
            if width * abs(float(slopes[place])) > size:
                sentence = f"a tolerance of {width:g} is larger than {place} itself, {size:g}"
                checker.doubt(("reliability", "dimensions", name), f"{sentence}; is it in another unit?")
                break
