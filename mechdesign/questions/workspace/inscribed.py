"""The largest circle and the largest rectangle with sides along x and y inside a region."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.region.growth import fitted
from mechdesign.region.panels import Panels
from mechdesign.region.shapes import Shape

# Columns of both shapes.
INSCRIBED = (
    "circle_x", "circle_y", "circle_radius", "rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height"
)  # fmt: skip
# Places within this part of a shape's size of its border are on it.
BORDER = 1e-6


def inscribed(panels: Panels, names: Collection[str] = INSCRIBED) -> dict[str, Floats]:
    """The largest circle and rectangle inside the region of each design, those of which there are `names`."""
    if not names:
        return {}
    traced, sizes = panels.trace(panels.design, 0.5 * (panels.low + panels.high)), dict[str, Floats]()
    unit = np.where(panels.closes, 0.0, 1.0)
    np.maximum.at(unit, panels.design[traced.ray], traced.outer)
    unit = np.where(unit > 0, unit, panels.reach)
    for name, shape in (
        ("circle", Shape(2 * unit, 2 * unit, round=True)),
        ("rectangle", Shape(unit, unit, round=False, stretches=True)),
    ):
        if not any(column.startswith(name) for column in names):
            continue
        factor, largest = fitted(shape, panels)
        centre = np.asarray(largest.centre)
        sizes |= {f"{name}_x": centre.real, f"{name}_y": centre.imag, f"{name}_width": factor * largest.width}
        sizes |= {f"{name}_height": factor * largest.height, f"{name}_radius": 0.5 * factor * largest.width}
    return {name: sizes[name] for name in names}


def crossed(shapes: Floats, z: Complexes) -> list[str]:
    """Which of the shapes, as `INSCRIBED` names them, have one of some places inside: ``circle``, ``rectangle``."""
    x, y, radius, middle_x, middle_y, width, height = shapes
    within = {
        "circle": Shape(2 * radius, 2 * radius, round=True).scale_at(z - complex(x, y)),
        "rectangle": Shape(width, height, round=False).scale_at(z - complex(middle_x, middle_y)),
    }
    return [name for name, scale in within.items() if (scale < 1 - BORDER).any()]
