"""The largest circle and the largest rectangle with sides along x and y inside a region."""

from __future__ import annotations

import numpy as np

from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.region.growth import fitted
from mechdesign.region.panels import Panels
from mechdesign.region.shapes import Shape

# Columns of both shapes.
INSCRIBED = (
    "circle_x", "circle_y", "circle_radius", "rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height"
)  # fmt: skip
# Places within this part of a shape's size of its border are on it.
BORDER = 1e-6


def inscribed(panels: Panels) -> Floats:
    """The largest circle and rectangle inside the region of a single design, as `INSCRIBED` names it."""
    unit = float(panels.reach[0])
    radius, circle = fitted(Shape(2 * unit, 2 * unit, round=True), panels)
    factor, rectangle = fitted(Shape(unit, unit, round=False, stretches=True), panels)
    places = (np.asarray(shape.centre)[0] for shape in (circle, rectangle))
    (x, y), (middle_x, middle_y) = ((z.real, z.imag) for z in places)
    sides = factor * [rectangle.width, rectangle.height]
    return np.array([x, y, unit * radius[0], middle_x, middle_y, *sides[:, 0]])


def crossed(shapes: Floats, z: Complexes) -> list[str]:
    """Which of the shapes, as `INSCRIBED` names them, have one of some places inside: ``circle``, ``rectangle``."""
    x, y, radius, middle_x, middle_y, width, height = shapes
    within = {
        "circle": Shape(2 * radius, 2 * radius, round=True).scale_at(z - complex(x, y)),
        "rectangle": Shape(width, height, round=False).scale_at(z - complex(middle_x, middle_y)),
    }
    return [name for name, scale in within.items() if (scale < 1 - BORDER).any()]
