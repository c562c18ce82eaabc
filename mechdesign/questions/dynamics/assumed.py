"""What a study leaves out of its masses, and what is taken in its place."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.mechanism.algebra import norm2
from mechdesign.mechanism.elements.links import Mass
from mechdesign.mechanism.forces import local_center
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.dynamics.question import pace
from mechdesign.questions.dynamics.schema import DynamicsSection
from mechdesign.study import Study


def assumed(study: Study) -> list[Caution]:
    """Warnings of gravity, centres of mass and moments of inertia that are left out where forces follow from them."""
    section, warnings = DynamicsSection.of(study), []
    moves = section.modes or section.forward is not None or pace(study).rated
    forced = moves or any(section.gravity)
    if study.dynamics is None:
        message = "without a section 'dynamics' there is no gravity; give {gravity: [0, -9.81 m/s^2]}, or [0, 0]"
        warnings.append(Caution("assumed", message))
    if forced and (centers := ", ".join(_centers(study))):
        message = f"centres of mass that are left out are the middles of joints: {centers}; give 'center'"
        warnings.append(Caution("assumed", message))
    acting = any(_masses(study)) or section.loads or study.mechanism.description.springs
    if study.dynamics is not None and forced and not acting:
        warnings.append(
            Caution("assumed", "no link has a mass, and no load or spring acts: efforts and forces are zero")
        )
    if moves and (points := ", ".join(_points(study))):
        message = f"without 'inertia' these are point masses, with no moment of inertia of their own: {points}"
        warnings.append(Caution("assumed", message))
    return warnings


def _centers(study: Study) -> Iterator[str]:
    """Bodies with their centres of mass, where these are the middle of several points."""
    geometry, unit = study.mechanism.geometry, f" {study.units.label('length')}".rstrip()
    for body, mass in _masses(study):
        if mass.center is None and not mass.slender and len(mass.points) > 1:
            center = np.complex128(local_center(geometry, body, mass, {}))
            yield f"{_name(body)} [{center.real:.6g}, {center.imag:.6g}]{unit} between {' and '.join(mass.points)}"


def _points(study: Study) -> Iterator[str]:
    """Bodies that turn and whose moment of inertia is left out, with that of a slender bar between two joints."""
    graph, geometry = study.mechanism.graph, study.mechanism.geometry
    unit = f" {study.units.label('moment_of_inertia')}".rstrip()
    for body, mass in _masses(study):
        if not mass.left_out or graph.bodies[body][0] == graph.bodies[GROUND][0]:
            continue
        bar = ""
        if len(mass.points) == 2:
            one, other = (geometry.place(body, point, {}) for point in mass.points)
            bar = f" (inertia: rod would be {float(geometry.term(mass.mass, {}) * norm2(other - one)) / 12:.6g}{unit})"
        yield f"{_name(body)}{bar}"


def _masses(study: Study) -> Iterator[tuple[str, Mass]]:
    """Bodies with a mass that is not 0."""
    for body, mass in study.mechanism.description.masses.items():
        if float(study.mechanism.geometry.term(mass.mass, {})):
            yield body, mass


def _name(body: str) -> str:
    """A body as a study names it."""
    link, _, rod = body.partition(":")
    return f"the rod of {link}" if rod else link
