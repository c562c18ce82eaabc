"""The solved state of a mechanism for a batch of poses, and the values of coordinates in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Complexes, Flags, Ints
from mechdesign.mechanism.algebra import Either, Value, Vector, angle_of, nearest, norm2
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.geometry import Vectors
from mechdesign.mechanism.graph import Graph


class Reason(IntEnum):
    """Why a pose is not valid. Numbers from `NO_VALUE` on are this reason too, of the first coupling and the next."""

    OK = 0
    NOT_CLOSED = 1
    OTHER_ASSEMBLY = 2
    LIMIT = 3
    NOT_HELD = 4
    NOT_DETERMINED = 5
    NO_VALUE = 6

    @classmethod
    def of(cls, number: int) -> Reason:
        """The reason that a number stands for."""
        return cls(min(number, cls.NO_VALUE))

    @property
    def text(self) -> str:
        """Words for tables and messages."""
        return ("", *REASONS)[self]


# Reasons in words, each with what it is and what helps.
REASONS = {
    "cannot be assembled": "the links do not reach; change a length or the pose",
    "other assembly": "the pose is not reached from the sketch without a singularity; draw the assembly that is meant",
    "limit": "a stated limit is passed; widen it, or leave the pose out",
    "does not hold its load": "a motion is free under the load; add a drive or a link",
    "not determined": "links that meet have their other joints at one place, about which they turn freely; change a "
    "length or the pose",
    "coupling without a value": "what it follows is outside of its table, or its expression has no value there; extend "
    "it, or leave the pose out",
}


@dataclass(frozen=True, eq=False, repr=False)
class Configuration:
    """Positions of a mechanism, nan where a pose cannot be assembled; every array broadcasts to `shape`."""

    graph: Graph
    vectors: Vectors
    shape: tuple[int, ...]  # of the batch
    nodes: Sequence[Vector]  # complex position of each node
    rotations: Sequence[Vector]  # unit rotation exp(i theta) of each angle class
    slides: Sequence[Value]  # displacement of each slide
    closures: Sequence[Value]  # positive inside the range in which each group closes, zero at its limits
    reason: NDArray[np.int8]  # `Reason` of each pose, of this very shape
    places: Mapping[str, Value]  # dimensions that differ from the nominal ones
    # By name, values that angles are reported within half a turn of; other angles are in (-pi, pi].
    near: Mapping[str, Value] = field(default_factory=dict)
    counted: frozenset[str] = frozenset()  # names of angles whose turns count: given, or followed along a motion

    def __repr__(self) -> str:
        return (
            f"<Configuration of shape {self.shape}: {np.count_nonzero(self.valid)} of {self.reason.size} poses valid>"
        )

    @property
    def valid(self) -> Flags:
        """Whether each pose is assembled and within the limits."""
        return np.equal(self.reason, int(Reason.OK))

    def point(self, name: str) -> Complexes:
        """World position x + i y of a point, shape of the batch."""
        return np.broadcast_to(np.asarray(self.nodes[self.graph.node(name)], dtype=complex), self.shape)

    def rotation(self, body: str) -> Complexes:
        """Unit vector of a link's x axis in the world, shape of the batch."""
        return np.broadcast_to(np.asarray(self.body_rotation(body), dtype=complex), self.shape)

    def body_rotation(self, body: str) -> Vector:
        """Unit vector of a body's x axis, unbroadcast."""
        frame = self.graph.bodies[body][0]
        offset = self.vectors.offsets[body]
        turn = self.rotations[frame]
        return turn if isinstance(offset, float) else turn * offset

    def direction(self, edge: int) -> Vector:
        """Unit vector of an edge's slide in the world."""
        along: Vector = self.vectors.d[edge] * self.rotations[self.graph.edges[edge].frame]
        return along

    def value(self, coordinate: Coordinate) -> Value:
        """Value of a coordinate; angles in radians, in the turn that `near` tells."""
        if coordinate.kind == "x":
            return self.nodes[coordinate.node].real
        if coordinate.kind == "y":
            return self.nodes[coordinate.node].imag
        if coordinate.kind == "slide":
            return self.slides[coordinate.slide]
        if coordinate.kind == "distance":
            return np.sqrt(norm2(self.nodes[coordinate.other] - self.nodes[coordinate.node]))
        if coordinate.kind == "angle":
            turn = self.body_rotation(coordinate.body)
            angle = angle_of(turn * np.conj(self.body_rotation(coordinate.reference)))
            near = self.near.get(coordinate.name)
            return angle if near is None else nearest(angle, near)
        if coordinate.kind == "parameter":
            return self.vectors.parameters[coordinate.name]
        value = coordinate.formula.evaluate(self.user_values(coordinate))
        value = value * coordinate.formula.angle_unit if coordinate.quantity == "angle" else value
        near = self.near.get(coordinate.name) if coordinate.turn else None
        return value if near is None else nearest(value, near, coordinate.turn)

    def user_values(self, coordinate: Coordinate) -> dict[str, Value]:
        """Values of the parts of an expression, angles in the study's unit as its text expects."""
        unit = coordinate.formula.angle_unit
        return {
            part.name: self.value(part) / unit if part.quantity == "angle" else self.value(part)
            for part in coordinate.parts
        }

    def beside(self, other: Configuration, coordinates: Iterable[Coordinate]) -> Configuration:
        """The same poses with angles in the turns that they have in another configuration; turns that count stay."""
        near = {k: other.value(angle) for k, angle in angles_of(coordinates).items() if k not in self.counted}
        return replace(self, near={**self.near, **near})

    def take(self, index: Ints | int | tuple[int, ...] | tuple[Ints, ...]) -> Configuration:
        """Poses of a flat batch by index (shape (n,) or scalar)."""

        reason = np.asarray(self.reason[index])

        def pick(value: Either) -> Either:
            return np.broadcast_to(value, self.shape)[index] if np.ndim(value) else value

        return replace(
            self, vectors=self.vectors.map(pick), shape=reason.shape, reason=reason,
            nodes=[pick(x) for x in self.nodes], rotations=[pick(u) for u in self.rotations],
            slides=[pick(s) for s in self.slides], closures=[pick(c) for c in self.closures],
            places={name: pick(v) for name, v in self.places.items()}, near={k: pick(v) for k, v in self.near.items()},
        )  # fmt: skip


def hide(value: Either, lost: Flags) -> Either:
    """A value with nan for the poses that are `lost`."""
    whole: NDArray[Any] = np.asarray(value)
    if whole.ndim == 0 and not lost.all():
        whole = np.broadcast_to(whole, lost.shape)
    elif whole.ndim == 0:
        return whole * np.nan if lost.ndim == 0 else np.broadcast_to(whole * np.nan, lost.shape)
    # Both parts of a position: (nan + 0i) would leave its y at zero.
    return np.where(lost, complex(np.nan, np.nan) if np.iscomplexobj(whole) else np.nan, whole)


def joined(
    parts: Iterable[Configuration], shape: tuple[int, ...], vectors: Vectors, places: Mapping[str, Value],
    angles: Iterable[str] = (),
) -> Configuration:  # fmt: skip
    """Flat batches of one mechanism joined to one batch of a shape.

    These `angles` keep their turns as far as they are known; others are in (-pi, pi].
    """
    count, end, whole, names = int(np.prod(shape, dtype=np.int64)), 0, list[Any](), list[str]()
    reason = np.empty(count, dtype=np.int8)
    for part in parts:
        some = slice(end, end := end + len(part.reason))
        reason[some] = part.reason
        names = names or [name for name in angles if name in part.near]
        values: list[Any] = [*part.nodes, *part.rotations, *part.slides, *part.closures]
        values += [np.broadcast_to(part.near[name], part.shape) for name in names]
        whole = whole or [value if np.ndim(value) == 0 else np.empty(count, dtype=value.dtype) for value in values]
        for k, value in enumerate(values):
            if np.ndim(value) > np.ndim(whole[k]):
                # What was the same for every pose so far is a single number.
                whole[k] = np.full(count, whole[k], dtype=value.dtype)
            if np.ndim(whole[k]):
                whole[k][some] = value
    full = iter([value.reshape(shape) if np.ndim(value) else value for value in whole])
    nodes, rotations, slides, closures = (
        list(islice(full, len(values))) for values in (part.nodes, part.rotations, part.slides, part.closures)
    )
    near, reason = dict(zip(names, full, strict=True)), reason.reshape(shape)
    return Configuration(part.graph, vectors, shape, nodes, rotations, slides, closures, reason, places, near)
