"""Regions of platforms whose legs reach annuli, over a range of orientations; written without the package.

At the orientation phi, leg k holds the point z where low <= |z - base + corner e^(i phi)| <= high. The square of that
distance is a cosine of phi, so that the orientations which a leg admits are known in closed form.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

# Samples of a curve, and how far beside it the region is looked for.
SAMPLES, NUDGE = 2001, 1e-10
# Base, corner on the platform, least and largest length.
Leg = tuple[complex, complex, float, float]


def reached(z: np.ndarray, legs: Sequence[Leg], start: float, stop: float) -> np.ndarray:
    """Whether some orientation (radians) is reached at points `z`: one at which those of a leg end."""
    ends = [np.full(z.shape, start), np.full(z.shape, stop)]
    spans = []
    for base, corner, low, high in legs:
        arm, rho = z - base, abs(corner)
        size = np.abs(arm)
        # |arm + corner e^(i phi)|^2 = size^2 + rho^2 + 2 size rho cos(phi + offset)
        offset = np.angle(corner) - np.angle(arm)
        with np.errstate(divide="ignore", invalid="ignore"):
            bounds = [np.clip((r * r - size**2 - rho**2) / (2 * size * rho), -1, 1) for r in (low, high)]
            never = (size + rho < low) | (np.abs(size - rho) > high)
        spans.append((offset, np.arccos(bounds[1]), np.arccos(bounds[0]), never))
        for angle in (*spans[-1][1:3], -spans[-1][1], -spans[-1][2]):
            ends.append(start + np.mod(angle - offset - start, 2 * np.pi))
    found = np.zeros(z.shape, dtype=bool)
    for phi in ends:
        good = phi <= stop
        for offset, near, far, never in spans:
            turn = np.abs(np.mod(phi + offset + np.pi, 2 * np.pi) - np.pi)
            good &= (turn >= near - 1e-12) & (turn <= far + 1e-12) & ~never
        found |= good
    return found


def always(z: np.ndarray, legs: Sequence[Leg], start: float, stop: float) -> np.ndarray:
    """Whether every orientation is reached at points `z`: by the nearest and farthest place of each arc of centres."""
    inside = np.ones(z.shape, dtype=bool)
    for base, corner, low, high in legs:
        arm, rho = z - base, abs(corner)
        offset = np.angle(corner) - np.angle(arm)
        ends = [np.abs(arm + corner * np.exp(1j * phi)) for phi in (start, stop)]
        nearest, farthest = np.minimum(*ends), np.maximum(*ends)
        # The cosine's own extremes, where the range holds them.
        farthest = np.where(np.mod(-offset - start, 2 * np.pi) <= stop - start, np.abs(arm) + rho, farthest)
        nearest = np.where(
            np.mod(np.pi - offset - start, 2 * np.pi) <= stop - start, np.abs(np.abs(arm) - rho), nearest
        )
        inside &= (nearest >= low) & (farthest <= high)
    return inside


def area(inside: Callable[[np.ndarray], np.ndarray], legs: Sequence[Leg], start: float, stop: float) -> float:
    """Area of `reached` or `always` by Green's theorem, along the curves on which a leg is as long or short as may be.

    These are circles about its base (the corner points at it, or away), circles about its centre at either end of the
    range, and the curves on which two legs are at their bounds.
    """
    centre = [lambda phi, b=base, c=corner: b - c * np.exp(1j * phi) for base, corner, _, _ in legs]
    turn = (0.0, 2 * np.pi)
    curves = []
    for k, (base, corner, *bounds) in enumerate(legs):
        rho = abs(corner)
        for bound in bounds:
            for middle, radius in [
                *((base, radius) for radius in (abs(bound - rho), bound + rho)),
                *((centre[k](phi), bound) for phi in (start, stop)),
            ]:
                curves.append((turn, lambda t, m=middle, r=radius: m + r * np.exp(1j * t)))
            for j, (_, _, *others) in enumerate(legs[:k]):
                for other in others:
                    for side in (-1, 1):
                        curves.append(((start, stop), lambda t, j=j, k=k, p=other, q=bound, s=side: _cross(
                            centre[j](t), p, centre[k](t), q, s)))  # fmt: skip
    # Where curves touch, both count within the root of the nudge: extrapolated to none.
    near, far = (sum(_green(inside, curve, *span, nudge) for span, curve in curves) for nudge in (NUDGE, 4 * NUDGE))
    return 2 * near - far


def _cross(p: np.ndarray, r: float, q: np.ndarray, s: float, side: int) -> np.ndarray:
    """Where two circles cross; nan where they do not."""
    span = q - p
    distance = np.abs(span)
    with np.errstate(invalid="ignore"):
        along = (distance**2 + r**2 - s**2) / (2 * distance)
        return np.asarray(p + span / distance * (along + side * 1j * np.sqrt(r**2 - along**2)))


def _green(
    inside: Callable[[np.ndarray], np.ndarray], curve: Callable, start: float, stop: float, nudge: float
) -> float:
    """Integral of Im(conj(z) dz)/2 along those parts of a curve with the region on one side only."""

    def side(t: np.ndarray) -> np.ndarray:
        """1 with the region on the left, -1 on the right, 0 on both or none."""
        step = 1e-6 * (stop - start)
        z, ahead = curve(t), curve(t + step) - curve(t - step)
        with np.errstate(invalid="ignore"):
            across = nudge * 1j * ahead / np.abs(ahead)
        good = np.isfinite(across)
        across, z = np.where(good, across, 0), np.where(good, z, 0)
        return np.where(good, inside(z + across).astype(int) - inside(z - across), 0)

    t = np.linspace(start, stop, SAMPLES)
    sides = side(t)
    cell = np.flatnonzero(sides[1:] != sides[:-1])
    a, b = t[cell], t[cell + 1]
    for _ in range(40):
        middle = 0.5 * (a + b)
        same = side(middle) == sides[cell]
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    places = np.concatenate([[start], 0.5 * (a + b), [stop]])
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for low, high in itertools.pairwise(places):
        towards = side(np.array([0.5 * (low + high)]))[0]
        if towards:
            # Denser towards both ends: a square root there is smooth in u.
            u = 0.5 * np.pi * nodes
            t = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(u)
            z = curve(t)
            # The integral by parts of the nodes' polynomial: dz by the spectral derivative in u.
            slope = np.polynomial.Legendre.fit(nodes, z, 50, domain=[-1, 1]).deriv()(nodes)
            total += towards * 0.5 * np.imag(weights @ (np.conj(z) * slope))
    return total
