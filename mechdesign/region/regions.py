"""Regions that the workspace section asks for: the point, the held coordinates, the centre of the rays."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.errors import MechanismError, StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.jacobians import mixes
from mechdesign.motion.rows import DesignNumbers
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.region.any_mode import in_any_assembly
from mechdesign.region.field import HELD, LENGTH, Field
from mechdesign.study import Study
from mechdesign.study.text.units import Amount

# Rays of the tables of local indices and of the boundary, unless the study says how many.
RAYS = 181


@dataclass(frozen=True, eq=False)
class PlanarRegion:
    """A region of the plane: where a point can be while the other degrees of freedom are held.

    Parameters
    ----------
    held : mapping of str to float
        Values of the coordinates of ``at``, in the study's units.
    about : complex
        Centre of the rays.
    scan : (float, float)
        First and last angle of the rays (radians).
    rays : int or None
        Number of rays over the scan that the study sets; None where it leaves the choice to the analysis.
    factors : sequence of float
        Take the held values from the study's units to radians (1 for lengths).
    """

    field: Field
    held: dict[str, float]
    about: complex
    scan: tuple[float, float]
    rays: int | None
    factors: Sequence[float]

    def places(self, numbers: DesignNumbers) -> dict[str, Floats]:
        """Dimensions and numbers of the field that differ between designs, each of shape (designs,).

        Held values and the characteristic length may follow parameters: by `HELD` and `LENGTH`, their names in a field.
        """
        amounts = {f"{HELD}{k}": Amount.by("value*factor", value=value, factor=factor)
                   for k, (value, factor) in enumerate(zip(self.held.values(), self.factors, strict=True))}  # fmt: skip
        if self.field.length is not None:
            amounts[LENGTH] = Amount.of(self.field.length)
        varying = {
            name: numbers.of(amount)
            for name, amount in amounts.items()
            if amount.expression is not None and numbers.moves(amount)
        }
        return {**numbers.places, **varying}


def regions(study: Study) -> list[PlanarRegion]:
    """A region for each combination of the values of ``at``.

    Raises
    ------
    StudyError
        If the section lacks a key that has no default, or its keys do not fit the mobility.
    """
    section = study.workspace
    if section is None or section.point is None:
        raise problem(study, "point", "the point whose workspace is asked for is needed, e.g. {point: C}")
    mechanism, unit = study.mechanism, study.units.angle_factor
    scan = _scan(section, unit)
    outputs = (f"{section.point}.x", f"{section.point}.y")
    if mechanism.mobility < 2:
        raise problem(
            study, "point",
            f"the mobility is {mechanism.mobility}: point {section.point} moves on a curve, not in a region; "
            "use kinematics",
        )  # fmt: skip
    if len(section.at) != mechanism.mobility - 2:
        raise problem(
            study, "at",
            f"the mobility is {mechanism.mobility}: beside {section.point}.x and {section.point}.y "
            f"{mechanism.mobility - 2 or 'no'} coordinates are held, not {len(section.at)}",
        )  # fmt: skip
    try:
        plan = mechanism.plan((*outputs, *section.at))
    except MechanismError as error:
        raise problem(study, "point", str(error)) from None
    if section.characteristic_length is None and mixes(plan.structure.given, mechanism.forward.structure.given):
        raise problem(
            study, "characteristic_length",
            "the Jacobian mixes lengths and angles: name the length by which a radian counts, e.g. "
            "{characteristic_length: 0.1}",
        )  # fmt: skip
    field = Field(mechanism, plan, (), section.assembly == "same", section.characteristic_length)
    whole = (lambda field: field) if field.same_assembly else in_any_assembly
    sketch = mechanism.sketch_configuration
    at_sketch = complex(*(float(sketch.value(c)) for c in plan.structure.given[:2]))
    about = at_sketch if section.scan.about is None else complex(*section.scan.about)
    factors = [unit if c.quantity == "angle" else 1.0 for c in plan.structure.given[2:]]
    return [
        PlanarRegion(
            whole(replace(field, held=tuple(v * f for v, f in zip(values, factors, strict=True)))),
            dict(zip(section.at, values, strict=True)), about, scan, section.scan.rays, factors,
        )
        for values in itertools.product(*section.at.values())
    ]  # fmt: skip


def _scan(section: WorkspaceSection, unit: float) -> tuple[float, float]:
    """First and last angle of the rays (radians), at most a turn apart."""
    if section.scan.from_ is None or section.scan.to is None:
        return 0.0, 2 * np.pi
    start, stop = section.scan.from_ * unit, section.scan.to * unit
    return start, min(stop, start + 2 * np.pi)


def problem(study: Study, key: str, message: str) -> StudyError:
    """A mistake at a key of the workspace section."""
    return StudyError((study.problem(message, "workspace", key),))
