"""The random sources that a study gives: its tolerances, clearances and random loads, as laws in the core's units."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import StudyError
from mechdesign.ground.expressions import Number
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.elements.couplings import MEASURED, play
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.mechanism.elements.joints import AnyJoint, Prismatic
from mechdesign.mechanism.geometry import offset_names, slide_offset
from mechdesign.motion.rows import NOWHERE, Poses
from mechdesign.questions.reliability.copula import Correlation
from mechdesign.questions.reliability.forces import FOLLOWED, followed
from mechdesign.questions.reliability.laws import Marginal, MeasuredLaw
from mechdesign.questions.reliability.schema.clearances import Clearance
from mechdesign.questions.reliability.schema.iso_tolerances import ToleranceClassError
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.schema.variation import LOADS, Dimension
from mechdesign.questions.reliability.sources import Pin, Scalar, Sources, geometric
from mechdesign.study import Study
from mechdesign.study.text.units import kind_of

# Largest deviation, in radians or in sizes of the mechanism.
MAX_DEVIATION = 1e6
# Largest deviation of a force, a mass or a spring's constant, in the study's units.
MAX_LOAD = 1e100


def find_sources(study: Study, poses: Poses = NOWHERE) -> tuple[Sources, list[Caution]]:
    """Sources of a study, and warnings about parameters that vary several places together.

    `poses` of designs give numbers that are arrays of poses, for the first order.

    Raises
    ------
    StudyError
        If nothing varies, the correlations contradict each other, or the numbers of a design give no tolerance.
    """
    section = study.reliability
    if section is None or not (section.dimensions or section.clearances):
        message = "asks what varies: give 'dimensions' or 'clearances'"
        raise StudyError((study.problem(message, "reliability"),))
    mechanism: Mechanism = study.mechanism
    section = poses.section(section)
    sizes: dict[str, Number] = {**study.sizes, **poses.places, **poses.parameters}
    scalars, warnings, together = list[Scalar](), list[Caution](), list[str]()
    counting = followed(study)
    for name, dimension in section.dimensions.items():
        kind = "load" if name in LOADS else "drive" if name in mechanism.drives else "place"
        slopes: dict[str, Number] = {name: 1.0}
        if name in study.parameters.nominal:
            kind = "parameter"
            slopes = geometric(study.parameters.derivatives(name, poses.parameters, poses.own.changed))
            slopes |= {f"{FOLLOWED}{name}": 1.0} if name in counting else {}
            moved = [place for place, slope in slopes.items() if np.any(slope)]
            dimensions = [place for place in moved if not place.startswith((MEASURED, FOLLOWED))]
            if not moved:
                warnings.append(Caution("ignored", f"parameter '{name}' changes no dimension of the mechanism"))
            elif len(dimensions) > 1:
                together.append(f"'{name}' {', '.join(dimensions)}")
        elif kind == "place":
            warnings += _twice(study, name, section.dimensions)
        moves = {place: (slope, _quantity(mechanism, place)) for place, slope in slopes.items()}
        factor = study.units.angle_factor if kind != "parameter" and moves[name][1] == "angle" else 1.0
        unit = study.units.label(LOADS[name]) if kind == "load" else study.unit_of(name)
        law = _law(study, name, dimension, sizes.get(name, 0.0), factor)
        scalars.append(Scalar(name, kind, law, moves, factor, unit))
    if together:
        parameters = "parameter that moves" if len(together) == 1 else "parameters that move"
        words = f"{parameters} several dimensions together: {'; '.join(together)}"
        warnings.append(Caution("assumed", words))
    scalars.sort(key=lambda scalar: ("parameter", "place", "drive", "load").index(scalar.kind))
    pins = tuple(_pin(study, name, clearance, poses) for name, clearance in section.clearances.items())
    sources = Sources(study, tuple(scalars), pins, _correlation(section, scalars))
    _check_sizes(sources)
    return sources, warnings


def _law(study: Study, name: str, dimension: Dimension, nominal: Number, factor: float) -> Marginal:
    """The law of a dimension, in the core's units."""
    if dimension.measured is not None:
        values, about = dimension.deviations(nominal / factor, study.folder)
        return MeasuredLaw.of(factor * values, factor * about, nominal)
    try:
        flaw = dimension.flaw(nominal)
        if not flaw:
            return dimension.law(nominal, factor)
    except ToleranceClassError as error:
        flaw = str(error)
    raise StudyError((study.problem(flaw, "reliability", "dimensions", name),))


def _quantity(mechanism: Mechanism, name: str) -> str:
    """Quantity of a place, a drive or a load, or of a parameter that forces follow."""
    places = mechanism.description.places
    if name.startswith(FOLLOWED):
        return "none"
    return LOADS[name] if name in LOADS else places[name].quantity if name in places else mechanism.quantity(name)


def _check_sizes(sources: Sources) -> None:
    """Raise a StudyError for deviations so large that their squares overflow."""
    study, size = sources.study, sources.study.mechanism.size
    most = {
        "angle": (MAX_DEVIATION, "a million radians"),
        "length": (MAX_DEVIATION * size, "a million times the size of the mechanism"),
    }
    for source in sources.all:
        for quantity, reach in source.reaches:
            allowed, words = most.get(quantity, (MAX_LOAD, "1e100"))
            if not np.max(reach) <= allowed:
                key, verb = ("clearances", "is") if isinstance(source, Pin) else ("dimensions", "varies by")
                message = f"{verb} more than {words}; look at its unit"
                raise StudyError((study.problem(message, "reliability", key, source.name),))


def _twice(study: Study, place: str, varying: Collection[str]) -> list[Caution]:
    """A warning for each varying parameter that also sets a place with a tolerance of its own."""
    both = [name for name in study.parameters.nominal
            if name in varying and study.parameters.derivatives(name).get(place)]  # fmt: skip
    words = (
        f"'{place}' varies by its own tolerance, and with parameter '{{}}': both count, as independent errors that add "
        "up; leave one of them out if they are the same error"
    )
    return [Caution("assumed", words.format(name)) for name in both]


def _correlation(section: ReliabilitySection, scalars: Sequence[Scalar]) -> Correlation | None:
    if not section.correlation:
        return None
    place = {scalar.name: k for k, scalar in enumerate(scalars)}
    pairs = {(place[pair.one], place[pair.other]): pair.coefficient for pair in section.correlation}
    return Correlation.of([scalar.law for scalar in scalars], pairs)


def _pin(study: Study, name: str, clearance: Clearance, poses: Poses) -> Pin:
    if flaw := clearance.flaw():
        raise StudyError((study.problem(flaw, "reliability", "clearances", name),))
    mechanism, joint = study.mechanism, study.mechanism.description.joints.get(name)
    kind = "slide" if joint is not None or clearance.backlash is not None else clearance.effect
    quantity: Quantity = "length"
    slope: Number
    directions: Sequence[Mapping[str, Number]]
    if clearance.backlash is not None:
        # Half of it lies to each side of the coupling's function.
        moved = mechanism.description.places[play(name)]
        quantity, slope = "angle" if moved.quantity == "angle" else "length", 1.0
        if quantity == "angle" and kind_of(ReliabilitySection.of(study).clearances[name].backlash) == "length":
            radius = mechanism.pitch_radius(name, poses.places)
            assert radius is not None
            quantity, slope = "length", np.asarray(1.0 / radius, dtype=float)
        directions = [{moved.name: slope}]
    elif joint is not None:
        directions = _slider(joint, clearance.length)
    elif clearance.link is None:
        raise StudyError(f"reliability.clearances.{name}: name the 'link' whose pin moves")
    else:
        length = (f"{clearance.link}.length",)
        directions = [{place: 1.0} for place in (length if kind == "length" else offset_names(clearance.link, name))]
    factor, pin = study.units.angle_factor if quantity == "angle" else 1.0, clearance.pin
    size, law = factor * clearance.radius, clearance.law(factor)
    return Pin(name, size, law, pin.analytic, pin.monte_carlo, kind, tuple(directions), quantity)


def _slider(joint: AnyJoint, length: Number | None) -> tuple[dict[str, Number], ...]:
    """Directions of the rear and front end of a slider: it shifts by their mean and tilts by their difference/length.

    A pin in a slot only shifts.
    """
    offset = slide_offset(joint.name)
    if length is None or not isinstance(joint, Prismatic):
        return ({offset: 1.0},)
    return tuple({offset: 0.5, str(joint.angle): slope} for slope in (-1.0 / length, 1.0 / length))
