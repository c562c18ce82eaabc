"""A model for a simulator as text: numbers, comments, colours, and the shapes of links."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement

from mechdesign import __version__
from mechdesign.door.exporting.bodies import RigidBodies, RigidBody
from mechdesign.drawing.shapes import link_colors
from mechdesign.ground.errors import printable
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.plates import hull

# Name of what does not move.
WORLD = "world"
# Decimals of places (m).
DECIMALS = 12


def add(element: Element, tag: str, **attributes: str) -> Element:
    """Add an element with attributes; returns it."""
    return SubElement(element, tag, attributes)


def numbers(*values: float) -> str:
    """Numbers for an attribute, with ten digits."""
    return " ".join(f"{value + 0.0:.10g}" for value in values)


def name_of(body: str) -> str:
    """Name of a body in the file; simulators have a world of their own."""
    return f"{body}.link" if body == WORLD else body


def planar(place: complex) -> str:
    """A place or vector of the plane in space."""
    return numbers(round(place.real, DECIMALS), round(place.imag, DECIMALS), 0.0)


def comment(words: Iterable[str]) -> Any:
    """Lines as a comment, in which no two hyphens follow each other."""
    return Comment("".join(f"\n  {printable(line).replace('--', '- -')}" for line in words) + "\n")


def outlines(bodies: RigidBodies, body: RigidBody) -> tuple[list[tuple[complex, complex]], float]:
    """Straight parts of a body's plate in its frame, and half of its width (m); blocks and rods are smaller."""
    view, length = bodies.view, bodies.scales.length
    radius = length * float(view.sizes.radius(body.link))
    link = bodies.description.links[body.link]
    if ":block" in body.name:
        return [(0j, 0j)], 0.7 * radius
    if link.telescopic:
        reach = 0.6 * length * abs(float(view.pose.slides[bodies.graph.slides.index(body.link)]))
        return ([(-reach + 0j, 0j)], 0.6 * radius) if ":rod" in body.name else ([(0j, reach + 0j)], radius)
    corners = hull([length * place for place in view.outline(body.link)])
    if len(corners) < 3:
        return [(corners[0], corners[-1])], radius
    return list(zip(corners, [*corners[1:], corners[0]], strict=True)), radius


def words(bodies: RigidBodies) -> list[str]:
    """What a file says at its head: what it is of, its units, and bodies whose mass is a stand-in."""
    view = bodies.view
    light = [body.name for body in bodies.bodies.values() if not body.weighed and body.name != GROUND]
    lines = [
        f"{view.study.name}: written by mechdesign {__version__}",
        f"At {view.posed}. Metres, kilograms, seconds, radians; the mechanism moves in the x-y plane.",
    ]
    if light:
        lines.append(f"Without a mass in the study, and so with {bodies.small_mass:.3g} kg: {', '.join(light)}.")
    return [*lines, *(f"{str(caution)[0].upper()}{str(caution)[1:]}." for caution in bodies.left_out)]


def paint(mechanism: Mechanism) -> dict[str, str]:
    """The colour of each link as red, green, blue and opacity, from 0 to 1."""
    return {
        link: " ".join(f"{int(color[k : k + 2], 16) / 255:.3g}" for k in (1, 3, 5)) + " 1"
        for link, color in link_colors(mechanism.description).items()
    }
