"""Plane vectors as complex numbers: products, rotations and angles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce
from operator import add
from typing import TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints

# A number or an array that broadcasts against the batch; numbers stay numbers, which keeps constants cheap.
Value = float | NDArray[np.floating]
# The same for plane vectors; a real number is a vector along x.
Vector = Value | complex | NDArray[np.complexfloating]
Either = TypeVar("Either", Value, Vector)

TURN = 2 * np.pi


def picked(value: Either, index: Ints | int | slice) -> Either:
    """Values of some poses of a flat batch; a value that is the same for all poses stays a number."""
    return value[index] if isinstance(value, np.ndarray) and value.ndim else value


def largest(values: Iterable[Value], least: float = 0.0) -> Value:
    """The largest absolute value, at least `least`."""
    size: Value = least
    for value in values:
        size = np.maximum(size, np.abs(value))
    return size


def norm2(z: Vector) -> Value:
    """Squared length of a vector."""
    return z.real * z.real + z.imag * z.imag


def cross(a: Vector, b: Vector) -> Value:
    """Third component of a x b."""
    return a.real * b.imag - a.imag * b.real


def dot(a: Vector, b: Vector) -> Value:
    """Scalar product of two vectors."""
    return a.real * b.real + a.imag * b.imag


def plus(total: Either, sign: int, term: Either) -> Either:
    """``total + sign * term``; an array is not copied where the other is the number 0."""
    if isinstance(term, float | complex) and term == 0:
        return total
    if isinstance(total, float | complex) and total == 0:
        return term if sign > 0 else -1.0 * term
    return total + term if sign > 0 else total - term


def added(*terms: Vector) -> Vector:
    """Sum of many terms from left to right, whose type a checker finds at once: it tries all kinds of each ``+``."""
    return reduce(add, terms)


def times(a: Value, b: Either) -> Either:
    """Product; an array is not copied where the other factor is the number 0 or 1."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, float) and one in (0.0, 1.0):
            return 0.0 if one == 0.0 else other
    return a * b


@overload
def vector(x: Floats, y: Floats) -> Complexes: ...
@overload
def vector(x: Value, y: Value) -> Vector: ...
def vector(x: Value, y: Value) -> Vector:
    """Complex number x + i y without the temporaries of ``x + 1j * y``."""
    if not np.ndim(x) and not np.ndim(y):
        # A NumPy scalar, not Python's: it divides by zero without raising.
        return np.complex128(complex(x, y))
    z = np.empty(np.broadcast_shapes(np.shape(x), np.shape(y)), dtype=complex)
    z.real = x
    z.imag = y
    return z


def rotation(angle: Value) -> Vector:
    """Unit vector at `angle` (radians).

    By the tangent of half the angle, which takes NumPy a third of the time of a sine and a cosine.
    """
    t = np.tan(0.5 * np.asarray(angle))
    square = t * t
    scale = 1.0 / (1.0 + square)
    return vector((1.0 - square) * scale, (t + t) * scale)


def angle_of(z: Vector) -> Floats:
    """Angle of a vector in (-pi, pi]."""
    angle = np.angle(z)
    return np.where(angle <= -np.pi, np.pi, angle)


def fit(local: Sequence[complex], places: Sequence[complex]) -> complex:
    """Vector along which local vectors turn best onto those between some places (least squares)."""
    one, other = (sum(part) / len(part) for part in (local, places))
    return sum(((b - other) * (a - one).conjugate() for a, b in zip(local, places, strict=True)), 0j)


def wrap(angle: Value) -> Value:
    """Angle brought into (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, TURN)


def nearest(angle: Value, near: Value, turn: float = TURN) -> Value:
    """An angle with whole turns added so that it lies within half a turn of `near`; `turn` is its period."""
    return angle + turn * np.round((near - angle) / turn)
