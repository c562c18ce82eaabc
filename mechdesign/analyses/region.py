"""The question of the workspace section, made ready: the field, the scan, the rule; and its answer for any designs."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.analyses.bounding import bounding_box
from mechdesign.analyses.field import Field, Places
from mechdesign.analyses.jacobians import mixes
from mechdesign.analyses.panels import Effort, Panels, find_panels
from mechdesign.analyses.quadrature import Integral, integrate, simple_means
from mechdesign.analyses.rays import Designs, Floats
from mechdesign.errors import MechanismError, Problem, StudyError
from mechdesign.memory import keep_freed_memory
from mechdesign.study import Study
from mechdesign.study.workspace_models import WorkspaceSection

# One design is looked at closely; of thousands each a little less, refined where the error estimate asks for it.
CLOSE, BRISK = Effort(128, 48), Effort(16, 6)
SECTOR_RAYS, MIDPOINT_RAYS = 101, 300
RADIAL_NODES = {"sector_mean": 49, "midpoint": 200}
# The area that the rules of comparison divide is integrated to this relative tolerance.
AREA_TOLERANCE = 1e-6
# Relative tolerance of the integrals where the study says none: of one region, and of each design of many.
TOLERANCE, GRID_TOLERANCE = 1e-5, 1e-4
INDICES = ("GII", "GRI", "SUI", "area", "box_area")


@dataclass(frozen=True, eq=False)
class Question:
    """What the workspace section asks, in radians.

    Parameters
    ----------
    held : mapping of str to float
        Values of the coordinates of ``at``, in the study's units.
    scan : (float, float)
        First and last angle of the rays.
    counted : (float, float)
        Range of angle that the means are taken over.
    rays : int or None
        As the study asks.
    """

    field: Field
    held: dict[str, float]
    about: complex
    scan: tuple[float, float]
    counted: tuple[float, float]
    rays: int | None
    rule: str
    tolerance: float
    nodes: int | None


@dataclass(frozen=True, eq=False)
class Answer:
    """Indices of each design and their estimated errors (0 where the rule has none), by the names of `INDICES`."""

    values: dict[str, Floats]
    errors: dict[str, Floats]
    panels: Panels


def questions(study: Study, tolerance: float = TOLERANCE) -> list[Question]:
    """One question a value of ``at``; `tolerance` is that of the integrals where the study says none.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed.
    """
    section = study.workspace
    if section is None or section.point is None:
        raise _problem(study, "workspace.point", "the point whose workspace is asked for is needed, e.g. {point: C}")
    mechanism, unit = study.mechanism, study.units.angle_factor
    outputs = (f"{section.point}.x", f"{section.point}.y")
    if mechanism.mobility < 2:
        raise _problem(
            study, "workspace.point",
            f"the mobility is {mechanism.mobility}: point {section.point} moves on a curve, not in a region; "
            "use kinematics",
        )  # fmt: skip
    if len(section.at) != mechanism.mobility - 2:
        raise _problem(
            study, "workspace.at",
            f"the mobility is {mechanism.mobility}: beside {section.point}.x and {section.point}.y "
            f"{mechanism.mobility - 2 or 'no'} coordinates are held, not {len(section.at)}",
        )  # fmt: skip
    try:
        plan = mechanism.plan((*outputs, *section.at))
    except MechanismError as error:
        raise _problem(study, "workspace.point", str(error)) from None
    field = Field(mechanism, plan, (), section.assembly == "same", section.characteristic_length)
    if section.characteristic_length is None and mixes(plan.structure.given, mechanism.forward.structure.given):
        raise _problem(
            study, "workspace.characteristic_length",
            "the Jacobian mixes lengths and angles: name the length by which a radian counts, e.g. "
            "{characteristic_length: 0.1}",
        )  # fmt: skip
    sketch = mechanism.sketch_configuration
    at_sketch = complex(*(float(sketch.value(c)) for c in plan.structure.given[:2]))
    about = at_sketch if section.scan.about is None else complex(*section.scan.about)
    start, stop = _scan(section, unit)
    margin = section.margin * unit
    if stop - start <= 2 * margin:
        raise _problem(study, "workspace.margin", "the margin leaves nothing of the scan")
    factors = [unit if c.quantity == "angle" else 1.0 for c in plan.structure.given[2:]]
    integrate_by = section.integrate
    return [
        Question(
            replace(field, held=tuple(v * f for v, f in zip(values, factors, strict=True))),
            dict(zip(section.at, values, strict=True)), about, (start, stop), (start + margin, stop - margin),
            section.scan.rays, integrate_by.rule,
            integrate_by.tolerance if "tolerance" in integrate_by.model_fields_set else tolerance, integrate_by.nodes,
        )
        for values in itertools.product(*section.at.values())
    ]  # fmt: skip


def _scan(section: WorkspaceSection, unit: float) -> tuple[float, float]:
    if section.scan.from_ is None or section.scan.to is None:
        return 0.0, 2 * np.pi
    start, stop = section.scan.from_ * unit, section.scan.to * unit
    return min(start, stop), max(start, stop)


def _problem(study: Study, key: str, message: str) -> StudyError:
    return StudyError((Problem(message, key, str(study.path or "")),))


def answer(question: Question, places: Places, count: int, effort: Effort) -> Answer:
    """Indices of `count` designs, whose changed places are arrays of shape (count,).

    Raises
    ------
    AssemblyError
        If a region has no end.
    """
    keep_freed_memory()
    designs = Designs(question.field, places, count, question.about)
    cuts = tuple(sorted(set(question.counted) - set(question.scan)))
    panels = find_panels(designs, question.scan, effort, cuts)
    if not panels.closes.any():
        nothing = {name: np.full(count, np.nan if name in ("GII", "GRI", "SUI") else 0.0) for name in INDICES}
        return Answer(nothing, {name: np.zeros(count) for name in INDICES}, panels)
    samples, gauss = effort.samples, question.rule == "gauss"
    tolerance = question.tolerance if gauss else AREA_TOLERANCE
    integral = integrate(designs, panels, tolerance, samples, question.counted, means=gauss)
    means, doubts = integral.mean, integral.mean_error
    if not gauss:
        means, doubts = _simple(question, designs, panels, samples), np.zeros_like(means)
    box = bounding_box(designs, panels, integral.boundary, samples)
    with np.errstate(invalid="ignore", divide="ignore"):
        values = (*means, integral.area / box, integral.area, box)
        errors = (*doubts, integral.area_error / box, integral.area_error, np.zeros(count))
    return Answer(dict(zip(INDICES, values, strict=True)), dict(zip(INDICES, errors, strict=True)), panels)


def _simple(question: Question, designs: Designs, panels: Panels, samples: int) -> Floats:
    nodes = question.nodes or RADIAL_NODES[question.rule]
    low, high = question.counted
    if question.rule == "sector_mean":
        theta = np.linspace(low, high, question.rays or SECTOR_RAYS)
        fractions = np.arange(1, nodes + 1) / (nodes + 1)
    else:
        rays = question.rays or MIDPOINT_RAYS
        theta = low + (high - low) * (np.arange(rays) + 0.5) / rays
        fractions = (np.arange(nodes) + 0.5) / nodes
    return simple_means(designs, panels.reach, samples, theta, fractions, by_area=question.rule == "midpoint")


__all__ = ["BRISK", "CLOSE", "INDICES", "Answer", "Integral", "Question", "answer", "questions"]
