"""Regions between limits of angles and stretched or folded legs, against the plane of the joint angles.

In the sketch's assembly modes a place of the point belongs to one pair of joint angles, so that the area is the
integral of the Jacobian's determinant over the pairs within the limits: a smooth sum, however narrow a limit is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.studies import study_of
from scipy import ndimage

from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH, SINGLE, Effort

Seeds = Callable[[int], Iterator[int]]
Complex = np.ndarray
EFFORTS = {"alone": (SINGLE, 1e-5), "of many": (BATCH, 1e-4)}


def cross(a: Complex | complex, b: Complex | complex) -> np.ndarray:
    return np.asarray((np.conj(a) * b).imag)


def told(z: Complex | complex) -> str:
    return f"[{np.real(z):.17g}, {np.imag(z):.17g}]"


def asked(text: str, effort: Effort, tolerance: float, *columns: str) -> list[tuple[float, float]]:
    """Numbers of a region and the errors that are told of them."""
    found = answer(questions(study_of(text), tolerance, columns)[0], {}, 1, effort)
    return [(float(found.values[name][0]), float(found.errors[name][0])) for name in columns]


@dataclass(frozen=True)
class FiveBar:
    """Motors in `bases` turn `cranks`; `rods` meet in a pin, and the point `at` is fixed to the first rod."""

    bases: Complex
    cranks: np.ndarray
    rods: np.ndarray
    at: complex
    low: np.ndarray
    high: np.ndarray
    angles: np.ndarray
    side: int

    @staticmethod
    def of(seed: int) -> FiveBar:
        """A random one with limits 2 to 180 degrees wide, drawn somewhere between them."""
        rng = np.random.default_rng(seed)
        while True:
            bases = np.array([-1, 1]) * rng.uniform(20, 60, 2) + 1j * rng.uniform(-20, 20, 2)
            cranks, rods = rng.uniform(60, 150, 2), rng.uniform(60, 150, 2)
            at = rods[0] * rng.uniform(0.5, 1.5) + 1j * rng.choice([0, 1]) * rng.uniform(-50, 50)
            width = np.radians(np.exp(rng.uniform(np.log(2), np.log(180), 2)))
            angles = rng.uniform(-np.pi, np.pi, 2)
            low = angles - width * rng.uniform(0.1, 0.9, 2)
            bar = FiveBar(bases, cranks, rods, complex(at), low, low + width, angles, int(rng.choice([-1, 1])))
            if np.isfinite(bar.pose(*angles)[3]):
                return bar

    def pose(self, one: np.ndarray, two: np.ndarray) -> tuple[Complex, Complex, Complex, Complex]:
        """Ends of the cranks, the pin of the rods, the point."""
        a, c = (
            base + crank * np.exp(1j * angle)
            for base, crank, angle in zip(self.bases, self.cranks, (one, two), strict=True)
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            span = np.abs(c - a)
            along = (span**2 + self.rods[0] ** 2 - self.rods[1] ** 2) / (2 * span)
            b = a + (c - a) / span * (along + 1j * self.side * np.sqrt(self.rods[0] ** 2 - along**2))
        return a, c, b, a + (b - a) / self.rods[0] * self.at

    def modes(self, one: np.ndarray, two: np.ndarray) -> np.ndarray:
        a, c, b, point = self.pose(one, two)
        return np.sign([cross(a - self.bases[0], point - a), cross(c - self.bases[1], b - c)])

    def areas(self, cells: int) -> tuple[float, float] | None:
        """Area of the piece that holds the sketch by a grid of angles, and the integral of the inverse condition."""
        part = (np.arange(cells) + 0.5) / cells
        one, two = (self.low[k] + part * (self.high - self.low)[k] for k in (0, 1))
        one, two = one[:, None], two[None]
        a, c, b, point = self.pose(one, two)
        good = (self.modes(one, two) == self.modes(*self.angles)[:, None, None]).all(axis=0) & np.isfinite(point)
        label, _ = ndimage.label(good)
        mine = tuple(((self.angles - self.low) / (self.high - self.low) * cells).astype(int))
        if not label[mine]:
            return None
        turned = cross(b - c, b - a)
        with np.errstate(invalid="ignore", divide="ignore"):
            by_one = 1j * (a - self.bases[0]) - 1j * (point - a) * cross(b - c, a - self.bases[0]) / turned
            by_two = 1j * (point - a) * cross(b - c, c - self.bases[1]) / turned
            size = np.abs(cross(by_one, by_two))
            total = np.abs(by_one) ** 2 + np.abs(by_two) ** 2
            largest = 0.5 * (total + np.sqrt(np.maximum(total**2 - 4 * size**2, 0)))
        cell = float(np.prod(self.high - self.low)) / cells**2
        own = label == label[mine]
        return cell * float(size[own].sum()), cell * float((size**2 / largest)[own].sum())

    @property
    def text(self) -> str:
        a, c, b, _ = self.pose(*self.angles)
        low, high = np.degrees([self.low, self.high])
        return f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{O1: {told(self.bases[0])}, O2: {told(self.bases[1])}}}
    left: [O1, A, {self.cranks[0]:.17g}]
    coupler: {{from: A, to: B, length: {self.rods[0]:.17g}, points: {{Q: {told(self.at)}}}}}
    right: [O2, C, {self.cranks[1]:.17g}]
    rod: [C, B, {self.rods[1]:.17g}]
  drives: {{q1: {{angle: left}}, q2: {{angle: right}}}}
  limits:
    - {{drive: q1, min: {low[0]:.17g}, max: {high[0]:.17g}}}
    - {{drive: q2, min: {low[1]:.17g}, max: {high[1]:.17g}}}
  sketch: {{A: {told(a)}, B: {told(b)}, C: {told(c)}}}
workspace: {{point: Q, assembly: same, indices: [inverse_condition]}}
"""


@pytest.mark.parametrize("effort", EFFORTS)
def test_five_bars_with_narrow_and_wide_limits(seeds: Seeds, effort: str) -> None:
    for seed in seeds(4):
        compare(FiveBar.of(seed), effort)


def compare(bar: FiveBar, effort: str) -> None:
    """Area and global index within twice the error that is told, where three grids agree on the true ones."""
    grids = [bar.areas(cells) for cells in (499, 800, 1200)]
    if None in grids:
        return
    areas, totals = np.array(grids, dtype=float).T
    (area, error), (index, doubt) = asked(bar.text, *EFFORTS[effort], "area", "GII")
    true, means = areas[-1], totals / areas
    if np.ptp(areas) > 1e-4 * true or np.ptp(means) > 1e-4 * means[-1]:
        return
    assert abs(area - true) <= 2 * error + 2 * np.ptp(areas), (area / true - 1, error / true)
    assert abs(index - means[-1]) <= 2 * doubt + 2 * np.ptp(means), (index / means[-1] - 1, doubt / index)


# Spikes beyond the farthest cell, bumps between samples and notches between rays were lost in these.
@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("seed", [2, 9, 11, 16, 33])
def test_spikes_and_crescents_that_were_lost(seed: int, effort: str) -> None:
    compare(FiveBar.of(seed), effort)


@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("width", [0.5, 2.0, 8.0])
@pytest.mark.parametrize(("shoulder", "elbow"), [(20, 90), (-70, -120)])
def test_an_arm_whose_shoulder_hardly_turns(shoulder: float, elbow: float, width: float, effort: str) -> None:
    """The crescent that the forearm sweeps: A = 2 w l1 l2, and the mean of 1/|det J| is w pi/A."""
    upper = 100 * np.exp(1j * np.radians(shoulder))
    hand = upper + 70 * np.exp(1j * np.radians(shoulder + elbow))
    text = f"""
units: {{length: mm}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, 100], fore: [A, P, 70]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{drive: q1, min: {shoulder - 0.5 * width}, max: {shoulder + 0.5 * width}}}]
  sketch: {{A: {told(upper)}, P: {told(hand)}}}
workspace: {{point: P, indices: [resistivity]}}
"""
    (area, error), (mean, doubt) = asked(text, *EFFORTS[effort], "area", "GRI")
    true = 2 * np.radians(width) * 7000
    assert abs(area - true) <= 2 * error
    assert abs(mean - np.radians(width) * np.pi / true) <= 2 * doubt
