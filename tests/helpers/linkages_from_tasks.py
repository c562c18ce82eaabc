"""Linkages for tasks by linear systems and by Newton's method from many starts, written without the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from helpers.gallery import meet

GALLERY = Path(__file__).parents[2] / "configs" / "gallery"
TRAY = GALLERY / "five_positions.yaml"
LINKS = (("ground.O", "coupler.A", "crank"), ("ground.D", "coupler.B", "rocker"))


def freudenstein(inputs, outputs, frame: float):
    """Crank, coupler and rocker of the four-bar of three pairs (degrees)."""
    crank, rocker = np.radians(inputs), np.radians(outputs)
    rows = np.column_stack([np.cos(rocker), -np.cos(crank), np.ones(3)])
    k1, k2, k3 = np.linalg.solve(rows, np.cos(crank - rocker))
    a, c = frame / k1, frame / k2
    return a, np.sqrt(a**2 + c**2 + frame**2 - 2 * a * c * k3), c


def by_newton(places: np.ndarray, rotations: np.ndarray, starts: int, random: np.random.Generator) -> np.ndarray:
    """Pivots and pins of links, from starts at random; shape (count, 2)."""
    p, r = places, rotations
    u = random.normal(size=(starts, 5)) * 3
    for _ in range(80):
        a, x, k = u[:, 0] + 1j * u[:, 1], u[:, 2] + 1j * u[:, 3], u[:, 4]
        arm, back = p + r * x[:, None], (np.conj(p) - np.conj(a)[:, None]) * r
        gap = np.abs(p) ** 2 + k[:, None] + 2 * (np.conj(p) * r * x[:, None] - np.conj(a)[:, None] * arm).real
        slope = np.stack([-2 * arm.real, -2 * arm.imag, 2 * back.real, -2 * back.imag, np.ones_like(gap)], axis=2)
        regular = np.abs(np.linalg.det(slope)) > 1e-12
        u, gap, slope = u[regular], gap[regular], slope[regular]
        step = np.linalg.solve(slope, gap[..., None])[..., 0]
        u = u - step * np.minimum(1, 5 / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-300))
    a, x, k = u[:, 0] + 1j * u[:, 1], u[:, 2] + 1j * u[:, 3], u[:, 4]
    gap = np.abs(p + r * x[:, None] - a[:, None]) ** 2 - (np.abs(x) ** 2 + np.abs(a) ** 2 - k)[:, None]
    good = (np.abs(gap).max(axis=1) < 1e-10) & (np.abs(u[:, :4]).max(axis=1) < 30)
    return np.stack([a, x], axis=1)[good]


def nearest_link(tables, pivot: complex, pin: complex, length: float) -> float:
    """How far the nearest crank of the solutions is from a link."""
    table = tables["solutions"]
    foot, point = (table[f"{name}.x"] + 1j * table[f"{name}.y"] for name in ("ground.O", "coupler.A"))
    return np.nanmin(np.abs(foot - pivot) + np.abs(point - pin) + np.abs(table["crank.length"] - length))


def _tray():
    body = yaml.safe_load(TRAY.read_text(encoding="utf-8"))["synthesis"]["body"]
    return np.array([at["x"] + 1j * at["y"] for at in body]), np.exp(1j * np.radians([at["angle"] for at in body]))


def ptp_of_lengths(tables):
    """Spread over the positions of the tray of each link's length, and of its length told."""
    table, (places, rotations) = tables["solutions"], _tray()
    spreads = []
    for pivot, pin, link in LINKS:
        foot, point = (table[f"{name}.x"] + 1j * table[f"{name}.y"] for name in (pivot, pin))
        lengths = np.abs(places + rotations * point[:, None] - foot[:, None])
        spreads.append(np.ptp(np.column_stack([lengths, table[f"{link}.length"]]), axis=1))
    return np.concatenate(spreads)


def missing_links(tables) -> int:
    """How many links that Newton's method finds for the tray are in none of its linkages."""
    table, (places, rotations) = tables["solutions"], _tray()
    own = {complex(round(x, 4), round(y, 4)) for pivot, _, _ in LINKS
           for x, y in zip(table[f"{pivot}.x"], table[f"{pivot}.y"], strict=True)}  # fmt: skip
    links = by_newton((places - 50) / 100, rotations, 120, np.random.default_rng(1))
    near = {complex(round(100 * pivot.real + 50, 4), round(100 * pivot.imag, 4)) for pivot, _ in links}
    return len(near - own)


def structural_error(x1: float, x3: float) -> float:
    """Largest error of the follower for y = log10(x), exact at x1, 1.5 and x3, in degrees.

    K1 cos(follower) - K2 cos(crank) + K3 = cos(crank - follower), linear in the ratios K, and solved for the follower
    by its half-angle tangent: F. Freudenstein, Approximate synthesis of four-bar linkages, Trans. ASME 77 (1955).
    """

    def wanted(x):
        return np.radians(90 + 60 * (x - 1)), np.radians(30 + 60 * np.log2(x))

    crank, follower = wanted(np.array([x1, 1.5, x3]))
    k1, k2, k3 = np.linalg.solve(
        np.column_stack([np.cos(follower), -np.cos(crank), np.ones(3)]), np.cos(crank - follower)
    )
    crank, follower = wanted(np.linspace(1, 2, 60_001))
    # a cos(follower) + b sin(follower) = c
    a, b, c = np.cos(crank) - k1, np.sin(crank), k3 - k2 * np.cos(crank)
    middle, half = np.arctan2(b, a), np.arccos(c / np.hypot(a, b))
    errors = [np.angle(np.exp(1j * (middle + side * half - follower))) for side in (1, -1)]
    return float(np.degrees(min(np.abs(error).max() for error in errors)))


def structural_errors(first, third):
    """The same of many."""
    return np.array([structural_error(x1, x3) for x1, x3 in zip(first, third, strict=True)])


def task(name: str):
    """The points of a path of the gallery."""
    path = yaml.safe_load((GALLERY / f"{name}.yaml").read_text(encoding="utf-8"))["synthesis"]["path"]
    return np.array([complex(*point) for point in path["points"]])


def distances(tables, points):
    """Distances of points from the coupler curve of the best solution, a four-bar drawn with circles.

    Of its two assemblies the nearer one counts.
    """
    table = tables["solutions"]
    best = {name: values[np.argmin(table["error"])] for name, values in table.items()}
    pivot, other, carried = (
        best[f"{name}.x"] + 1j * best[f"{name}.y"] for name in ("ground.O", "ground.D", "coupler.P")
    )
    every = []
    for side in (1, -1):
        width = 2 * np.pi / 2000
        angles = np.tile(np.arange(0, 2 * np.pi, width), (len(points), 1))
        for _ in range(12):
            pin = pivot + best["crank.length"] * np.exp(1j * angles)
            with np.errstate(invalid="ignore"):
                end = meet(pin, best["coupler.length"], other, best["rocker.length"], side)
            gaps = np.nan_to_num(
                np.abs(pin + carried * (end - pin) / best["coupler.length"] - points[:, None]), nan=np.inf
            )
            angles = angles[np.arange(len(points)), gaps.argmin(axis=1)][:, None] + width * np.linspace(-1, 1, 41)
            width /= 16
        every.append(gaps.min(axis=1))
    return min(every, key=np.max)
