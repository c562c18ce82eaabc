"""The same work by hand for one mechanism, in C (tests/benchmarks/floors.c) and in NumPy."""

from __future__ import annotations

import ctypes
import math
import platform
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Floats

SOURCE = Path(__file__).parents[1] / "tests" / "benchmarks" / "floors.c"
# Processors other than those of PCs have no `native` in every compiler.
NATIVE = ("-march=native",) if platform.machine() in ("x86_64", "AMD64") else ()
FLAGS = ("-O3", *NATIVE, "-ffast-math", "-shared", "-fPIC")
Places = Callable[[int], tuple[Floats, Floats]]  # so many places between 0 and 1, and their weights


class Rule(ctypes.Structure):
    """Places and weights of a rule of integration, as floors.c has them."""

    _fields_ = (("count", ctypes.c_int), ("at", ctypes.c_void_p), ("weight", ctypes.c_void_p))


def rule_of(at: Floats, weight: Floats) -> Rule:
    """A rule of arrays, which somebody else keeps."""
    return Rule(len(at), at.ctypes.data, weight.ctypes.data)


def compiler() -> str | None:
    """The C compiler of this machine."""
    return shutil.which("cc") or shutil.which("gcc")


@cache
def library() -> Any:
    """The functions of floors.c; None where there is no C compiler."""
    if (program := compiler()) is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "floors.so"
        subprocess.run([program, *FLAGS, str(SOURCE), "-o", str(file), "-lm"], check=True)
        functions = ctypes.CDLL(str(file))
    array, number, count = ctypes.c_void_p, ctypes.c_double, ctypes.c_long
    functions.four_bar.argtypes = [count, array, array]
    functions.arm.argtypes, functions.arm.restype = [count, ctypes.c_uint64, number], count
    functions.six_bar.argtypes = [count, array, number, array, array]
    functions.regions.argtypes = [ctypes.c_int, array, array, Rule, Rule, array]
    return functions


def evenly(count: int) -> tuple[Floats, Floats]:
    """Middles of equal parts."""
    return (np.arange(count) + 0.5) / count, np.full(count, 1 / count)


def between_poles(count: int) -> tuple[Floats, Floats]:
    """Gauss's rule for what grows at either end as one over a square root: over t, with places (1 - cos t) / 2."""
    at, weight = np.polynomial.legendre.leggauss(count)
    t = np.pi / 2 * (1 + at)
    return (1 - np.cos(t)) / 2, np.pi / 4 * weight * np.sin(t)


def region_sums(l_min: Floats, l_a: Floats, places: Places, rays: int, radii: int) -> Floats:
    """GII and GRI of designs of S1's 2-RRR: shape (2, designs); half of the rays on either side of its axis."""
    at, weight = places(rays // 2)
    at, weight = np.pi / 2 * np.concatenate([at, 1 + at]), np.pi / 2 * np.tile(weight, 2)
    radius, part = places(radii)
    sums = np.empty((len(l_min), 3))
    library().regions(
        len(l_min), l_min.ctypes.data, l_a.ctypes.data, rule_of(at, weight), rule_of(radius, part), sums.ctypes.data
    )
    return sums[:, :2].T


def ends_of_turns(crank: Floats, rod: Floats, rocker: Floats) -> list[Floats]:
    """Range of C.x, time ratio of the rocker, least transmission angle of four-bars, each of shape (designs,).

    Extremes lie near poses of 5 degrees, from which Newton's method goes on.
    """
    theta = np.linspace(0, 2 * np.pi, 73)
    a, b, c, d = (np.reshape(v, (-1, 1)) for v in (crank, rod, rocker, 4.0))

    def poses(theta: Floats) -> tuple[Any, Any]:
        pin = a * np.exp(1j * theta)
        span = d - pin
        along = (np.abs(span) ** 2 + b**2 - c**2) / (2 * np.abs(span))
        turn = span / np.abs(span) * (along + 1j * np.sqrt(b**2 - along**2)) / b
        return pin + (1.75 + 1.5j) * turn, np.angle(pin + b * turn - d)

    numbers = []
    for part in (0, 1):
        ends = []
        for sign in (1, -1):
            values = sign * (poses(theta)[part].real)
            place = theta[values.argmax(axis=1)][:, None]
            for _ in range(4):
                low, middle, high = (sign * poses(place + h)[part].real for h in (-1e-3, 0.0, 1e-3))
                place = place - 5e-4 * (high - low) / (high - 2 * middle + low)
            ends.append((sign * poses(place)[part].real, place))
        numbers += [ends[0][0] + ends[1][0], ends[0][1] - ends[1][1]]
    mu = [np.arccos((b**2 + c**2 - (d + side * a) ** 2) / (2 * b * c)) for side in (-1, 1)]
    return [part[:, 0] for part in (*numbers, np.minimum(mu[0], np.pi - mu[1]))]


def five_bar_ranges(lower: Floats, upper: Floats, other: Floats) -> Floats:
    """Ranges of the first drive of five-bars (degrees) over 91 poses of the tip; the other drive is computed, too."""
    reach = 1j * np.linspace(160, 250, 91) - 100
    a, b, c = (np.reshape(v, (-1, 1)) for v in (lower, upper, other))
    second = np.arccos((c**2 + np.abs(reach) ** 2 - 215**2) / (2 * c * np.abs(reach)))
    angle = np.angle(reach) - np.arccos((a**2 + np.abs(reach) ** 2 - b**2) / (2 * a * np.abs(reach)))
    return np.asarray(np.degrees(np.ptp(angle, axis=1)) + 0 * second.sum(axis=1))


def five_bar_deviations(l1: Floats, tolerance: Floats) -> Floats:
    """Standard deviations of the tip of five-bars at ten poses, sqrt(sum (J_i sigma_i)^2): shape (2, designs, 10)."""
    theta1, theta2, l2 = np.radians(np.linspace(90, 126, 10)), np.radians(80.0), 60.0
    e1, e2 = np.exp(1j * theta1), np.exp(1j * theta2)
    b, d = l1[:, None] * e1, 50 + l1[:, None] * e2
    half = 0.5 * (d - b)
    c = b + half + 1j * half / np.abs(half) * np.sqrt(l2**2 - np.abs(half) ** 2)
    u, v = (c - b) / l2, (c - d) / l2
    determinant = u.real * v.imag - u.imag * v.real

    def dot(one: Any, other: Any) -> Any:
        return one.real * other.real + one.imag * other.imag

    def moved(p: Any, q: Any) -> Any:
        return np.stack([(p * v.imag - q * u.imag) / determinant, (q * u.real - p * v.real) / determinant])

    sigma, drive = (tolerance / 3)[:, None], math.radians(0.03) / 3
    parts = [
        moved(dot(u, e1), 0) * sigma, moved(0, dot(v, e2)) * sigma, moved(1, 0) * sigma, moved(0, 1) * sigma,
        moved(0, v.real) * (0.02 / 3), moved(dot(u, 1j * b), 0) * drive, moved(0, dot(v, 1j * (d - 50))) * drive,
    ]  # fmt: skip
    return np.asarray(np.sqrt(sum(part**2 for part in parts)))
