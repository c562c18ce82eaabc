"""A circle or a rectangle: where its outline is, seen from its centre, and how it changes with its parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints

# Rays from a shape's centre to places spread along its outline; a side of a rectangle has `SIDE_RAYS` or more.
RAYS = 120
SIDE_RAYS = 6


@dataclass(frozen=True)
class Shape:
    """A circle, or a rectangle with sides along x and y.

    Numbers are the same for all designs, or of shape (designs,).

    Parameters
    ----------
    centre : complex or ndarray, optional
        None where it may lie anywhere.
    stretches : bool
        Whether the sides of a rectangle may change as long as its area stays.
    """

    width: Number
    height: Number
    round: bool
    centre: complex | Complexes | None = None
    stretches: bool = False

    def of(self, design: Ints | int) -> Shape:
        """The shapes of some designs."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: value[design] for name, value in values.items() if np.ndim(value)})

    def placed(self, centre: complex | Complexes, stretch: Floats | float) -> Shape:
        """The shape at a centre, its width grown by the factor exp(stretch) and its height shrunk by it."""
        factor = np.exp(stretch)
        return replace(self, centre=centre, width=self.width * factor, height=self.height / factor)

    def directions(self, number: int = RAYS) -> Floats:
        """Directions from the centre to places spread along the outline (radians in [0, 2 pi), ascending).

        Of shape (places, designs), or (places, 1) where they are the same for all designs.
        """
        if self.round:
            return (2 * np.pi * np.arange(number) / number)[:, None]
        width, height = np.broadcast_arrays(np.atleast_1d(self.width), np.atleast_1d(self.height))
        long = float(np.median(width / (width + height)))
        x, y = (np.linspace(-side / 2, side / 2, max(SIDE_RAYS, round(0.5 * number * share)) + 1)
                for side, share in ((width, long), (height, 1 - long)))  # fmt: skip
        around = np.concatenate([x[:-1] + 1j * y[0], x[1:] + 1j * y[-1], x[0] + 1j * y[1:], x[-1] + 1j * y[:-1]])
        return np.sort(np.angle(around) % (2 * np.pi), axis=0)

    @property
    def corners(self) -> Floats:
        """Directions of the corners from the centre (radians, in [0, 2 pi)), shape (..., corners)."""
        corner = np.arctan2(self.height, self.width)
        angles = [] if self.round else [corner, np.pi - corner, np.pi + corner, 2 * np.pi - corner]
        return np.stack(np.broadcast_arrays(*angles), axis=-1) if angles else np.array([])

    def radius(self, theta: Floats) -> Floats:
        """Distance of the outline from the centre."""
        if self.round:
            return np.broadcast_to(np.asarray(self.width) / 2, np.broadcast_shapes(theta.shape, np.shape(self.width)))
        return 0.5 * np.minimum(self.width / np.abs(np.cos(theta)), self.height / np.abs(np.sin(theta)))

    def scale_at(self, way: Complexes) -> Floats:
        """Scale at which the outline passes through a place, seen from the centre."""
        return np.asarray(np.abs(way) / self.radius(np.angle(way)))

    def normal(self, theta: Floats) -> Complexes:
        """Outward unit normals of the outline in directions from the centre."""
        x, y = np.cos(theta), np.sin(theta)
        if self.round:
            return np.asarray(x + 1j * y)
        return np.where(np.abs(x) * self.height > np.abs(y) * self.width, np.sign(x) + 0j, 1j * np.sign(y))

    def slopes(self, normal: Complexes) -> Floats:
        """How the scale at which the outline touches a boundary changes with the shape, shape (3, ...).

        With x and y of the centre the scale itself changes, with the stretch its logarithm; the boundary has the unit
        `normal` away from the shape.
        """
        if self.round:
            half, stretch = self.width / 2, 0 * normal.real
        else:
            x, y = 0.5 * self.width * np.abs(normal.real), 0.5 * self.height * np.abs(normal.imag)
            half, stretch = x + y, (y - x) / (x + y)
        return np.stack([-normal.real / half, -normal.imag / half, stretch])
