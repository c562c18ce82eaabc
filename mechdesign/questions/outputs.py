"""Outputs of a question: names of points, links and slides as coordinates."""

from __future__ import annotations

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.graph import GROUND
from mechdesign.study import Study


def default_outputs(mechanism: Mechanism) -> tuple[str, ...]:
    """Every moving point, link and slide."""
    graph = mechanism.graph
    still = {point for body, point in graph.points if body == GROUND}
    points = [point for point in mechanism.points if point not in still]
    moving = [name for name in mechanism.description.links if name != GROUND and graph.bodies[name][0] != 0]
    slides = [f"{name}.{'length' if k in graph.telescopic else 'slide'}" for k, name in enumerate(graph.slides)]
    return (*points, *(f"{link}.angle" for link in moving), *slides)


def expand_outputs(study: Study, names: tuple[str, ...]) -> list[Coordinate]:
    """Outputs as coordinates, a point as its x and y.

    Raises
    ------
    MechanismError
        For a name that is neither.
    """
    mechanism = study.mechanism
    coordinates = []
    for name in names:
        parts = [f"{name}.x", f"{name}.y"] if mechanism.graph.is_point(name) else [name]
        coordinates += [mechanism.coordinate(part) for part in parts]
    return coordinates
