"""Angles in expressions have no cut: the world's orientation changes no range, error, deviation or failure.

Random slider-cranks and four-bars, turned by any angle and mirrored or not, with random sums of their angles, against
positions by complex numbers, angles unwrapped along fine steps, and plain simulation. Only whole turns of what the
angles begin with may differ, the same along all of a motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.family.stacked import tables
from mechdesign.ground.errors import AssemblyError
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.poses import study_poses
from mechdesign.questions.reliability.analysis import reliability
from mechdesign.questions.workspace.analysis import workspace
from mechdesign.study.designs import Designs

Floats = np.ndarray
Seeds = Callable[[int], Iterator[int]]

SIGMA = 0.02


@dataclass(frozen=True)
class Linkage:
    """A crank of length r at the origin and a rod; its end on a line (slider) or on a rocker about a second pivot."""

    r: float
    rod: float
    out: float  # length of the rocker, or offset of the slider's line
    ground: float  # distance of the pivots; 0 for a slider
    side: float  # 1 or -1: the assembly; of a slider to the right or to the left
    turn: float  # degrees by which the world is turned
    mirror: float  # -1 where it is mirrored before

    def angles(self, theta: Floats, r: Floats | float, rod: Floats | float) -> list[Floats]:
        """Crank, rod and output in degrees, before turning and mirroring, each in any turn."""
        a = r * np.exp(1j * np.radians(theta))
        if self.ground:
            d = a - self.ground
            along = (abs(d) ** 2 + self.out**2 - rod**2) / (2 * abs(d))
            b = self.ground + d / abs(d) * (along + 1j * self.side * np.sqrt(self.out**2 - along**2))
            return [theta, np.degrees(np.angle(b - a)), np.degrees(np.angle(b - self.ground))]
        b = a.real + self.side * np.sqrt(rod**2 - (self.out - a.imag) ** 2) + 1j * self.out
        return [theta, np.degrees(np.angle(b - a)), np.zeros_like(theta)]

    def world(self, z: complex) -> complex:
        return complex(z if self.mirror > 0 else z.conjugate()) * np.exp(1j * np.radians(self.turn))

    def told(self, angle: Floats) -> Floats:
        return self.mirror * angle + self.turn

    def text(self) -> str:
        theta = np.array([50.0])
        _, rod, _ = self.angles(theta, self.r, self.rod)
        a = self.r * np.exp(1j * np.radians(50))
        b = a + self.rod * np.exp(1j * np.radians(rod[0]))
        pivot = self.world(self.ground if self.ground else 1j * self.out)
        last = f"last: [D, B, {self.out:.17g}]" if self.ground else "last: {B: [0, 0]}"
        guide = f"joints: {{guide: {{prismatic: [ground, last], through: D, direction: {self.turn:.17g}}}}}"
        sketch = ", ".join(
            f"{n}: [{z.real:.17g}, {z.imag:.17g}]" for n, z in (("A", self.world(a)), ("B", self.world(b)))
        )
        return f"""
units: {{length: mm, angle: deg}}
mechanism:
  links:
    ground: {{O: [0, 0], D: [{pivot.real:.17g}, {pivot.imag:.17g}]}}
    crank: [O, A, {self.r:.17g}]
    rod: [A, B, {self.rod:.17g}]
    {last}
  {"" if self.ground else guide}
  drives: {{th: {{angle: crank}}}}
  sketch: {{{sketch}}}
"""


def draw(rng: np.random.Generator) -> Linkage:
    turn, side = float(rng.choice([0, 90, 180, rng.uniform(0, 360)])), float(rng.choice([-1, 1]))
    mirror = float(rng.choice([-1, 1]))
    if rng.random() < 0.5:
        r = rng.uniform(10, 25)
        return Linkage(r, r * rng.uniform(1.8, 4), r * rng.uniform(-0.5, 0.5), 0.0, side, turn, mirror)
    while True:
        r, rod, out, ground = rng.uniform([10, 30, 30, 40], [25, 90, 90, 100])
        lengths = sorted([r, rod, out, ground])
        if lengths[0] == r and r + lengths[3] < 0.93 * (lengths[1] + lengths[2]):
            return Linkage(r, rod, out, ground, side, turn, mirror)


def sum_of(weights: Floats, linkage: Linkage, theta: Floats, r: Floats | float, rod: Floats | float) -> Floats:
    """The weighted sum of the angles as the world shows them, continuous from the first value on."""
    found = np.zeros_like(theta)
    for weight, angle in zip(weights, linkage.angles(theta, r, rod), strict=True):
        found = found + weight * np.unwrap(linkage.told(angle), period=360)
    return found


@pytest.mark.parametrize("step", [5, 40])
def test_sums_of_angles_along_a_motion(seeds: Seeds, step: int) -> None:
    for seed in seeds(4):
        rng = np.random.default_rng([seed, step])
        linkage = draw(rng)
        weights = rng.uniform(-2, 2, 3).round(3) * [1, 1, bool(linkage.ground)]
        begin, rows = rng.uniform(-200, 200), int(720 // step) + 1
        fine = begin + np.arange((rows - 1) * step * 4 + 1) / 4
        expected = sum_of(weights, linkage, fine, linkage.r, linkage.rod)
        first, last = (float(linkage.told(np.float64(end))) for end in (fine[0], fine[-1]))
        low, high = min(first, last), max(first, last)
        if last < first:
            expected = expected[::-1]
        names = ["th", "rod.angle", "last.angle"][: 3 if linkage.ground else 2]
        formula = " + ".join(f"({weight})*{name}" for weight, name in zip(weights, names, strict=False))
        study = study_of(
            linkage.text()
            + f"  measures: {{sum: {formula} + 17, swing: sum - ({weights[0]})*th,"
            + " third: th/3, square: rod.angle**2/100}\n  targets: {third: th/3}\n"
            + f"kinematics: {{sweep: {{th: {{from: {low:.17g}, to: {high:.17g}, number: {rows}}}}}, rates: {{th: 1}},"
            + " outputs: [sum, swing, third, square, rod.angle]}\n"
        )
        found = kinematics(study).tables
        motion = found["motion"]
        offset = motion["sum"] - expected[:: 4 * step]
        assert offset == pytest.approx(offset[0], abs=1e-7), (seed, linkage)
        assert motion["third_error"] == pytest.approx(0, abs=1e-9)
        # The derivative of a measure that is not linear is that of the values beside it.
        angle, rate = motion["rod.angle"], motion["rod.angle_velocity"]
        assert motion["square"] == pytest.approx(angle**2 / 100)
        assert motion["square_velocity"] == pytest.approx(2 * angle * rate / 100)
        if step == 5:
            extremes = {name: found["extremes"]["range"][k] for k, name in enumerate(found["extremes"]["output"])}
            swing = expected - weights[0] * np.linspace(low, high, len(fine))
            assert extremes["swing"] == pytest.approx(np.ptp(swing), abs=1e-3), (seed, linkage)
        # Many designs at once have the motions of each.
        designs = Designs(study, {"rod.length": linkage.rod * np.array([1, 1.01, 1])})
        poses = study_poses(study, "kinematics", designs.numbers)
        several = tables(study, "kinematics", ["motion"], poses)
        again = several.result.tables["motion"]["sum"].reshape(3, -1)
        assert again[[0, 2]] == pytest.approx(np.stack([motion["sum"]] * 2), abs=1e-9)
        assert np.ptp(again[1] - motion["sum"]) < 90


def test_errors_of_samples_are_on_the_branch_of_the_nominal_pose(seeds: Seeds) -> None:
    for seed in seeds(3):
        rng = np.random.default_rng(seed)
        linkage = draw(rng)
        weights = rng.uniform(-2, 2, 3).round(3) * [1, 1, bool(linkage.ground)]
        theta = rng.uniform(-180, 540, 4)
        # One pose has its rod on the cut itself.
        turned = linkage.turn + 180 - float(linkage.told(linkage.angles(theta[:1], linkage.r, linkage.rod)[1])[0])
        linkage = Linkage(**{**linkage.__dict__, "turn": turned})
        names = ["th", "rod.angle", "last.angle"][: 3 if linkage.ground else 2]
        formula = " + ".join(f"({weight})*{name}" for weight, name in zip(weights, names, strict=False))
        sizes = linkage.r + rng.normal(0, SIGMA, 4000), linkage.rod + rng.normal(0, SIGMA, 4000)
        spread = []
        for at in theta:
            made = linkage.angles(np.full(4000, at), *sizes)
            nominal = linkage.angles(np.array([at]), linkage.r, linkage.rod)
            spread.append(
                sum(w * ((m - n + 180) % 360 - 180) for w, m, n in zip(weights, made, nominal, strict=True)).std()
            )
        poses = ", ".join(f"{{th: {float(linkage.told(at)):.17g}}}" for at in theta)
        text = linkage.text() + f"  measures: {{sum: {formula} + 17}}\nreliability:\n  poses: [{poses}]\n"
        text += f"  dimensions: {{crank.length: {{sigma: {SIGMA}}}, rod.length: {{sigma: {SIGMA}}}}}\n"
        text += f"  outputs: [sum]\n  limits: {{sum: {47 * max(spread):.17g}}}\n"
        text += "  methods: [analytic, second_order, monte_carlo, form]\n  samples: 4096\n"
        found = reliability(study_of(text)).tables
        for method in ("analytic", "second_order", "monte_carlo"):
            mine = found["moments"]["method"] == method
            assert found["moments"]["sigma"][mine] == pytest.approx(spread, rel=0.08), (seed, method, linkage)
        failure = found["reliability"]["failure"][np.isin(found["reliability"]["method"], ["analytic", "monte_carlo"])]
        assert failure.max() < 1e-6, (seed, linkage)


def test_drives_on_a_boundary_lie_within_their_limits(seeds: Seeds) -> None:
    for seed in seeds(1):
        rng = np.random.default_rng(seed)
        text, low, high, (a, b) = arm(rng)
        boundary = workspace(study_of(text + "workspace: {point: P}\n")).tables["boundary"]
        for k, name in enumerate(("q1", "q2")):
            value = boundary[name]
            assert value.min() > low[k] - 1e-6, (seed, name)
            assert value.max() < high[k] + 1e-6, (seed, name)
        q1, q2 = np.radians(boundary["q1"]), np.radians(boundary["q2"])
        z = a * np.exp(1j * q1) + b * np.exp(1j * (q1 + q2))
        assert z.real == pytest.approx(boundary["x"], abs=1e-5)
        assert z.imag == pytest.approx(boundary["y"], abs=1e-5)


def test_drives_along_a_path_lie_within_their_limits(seeds: Seeds) -> None:
    for seed in seeds(5):
        rng = np.random.default_rng(seed)
        text, low, high, lengths = arm(rng)
        # A way of the drives themselves, well within the elbow's range and round the shoulder.
        t = np.linspace(0, 1, 90)
        way = np.stack([rng.uniform(-500, 500) + rng.uniform(-700, 700) * t, rng.uniform(30, 40) + 10 * np.sin(5 * t)])
        q1, q2 = np.radians(way)
        z = lengths[0] * np.exp(1j * q1) + lengths[1] * np.exp(1j * (q1 + q2))
        path = ", ".join(f"[{p.real:.17g}, {p.imag:.17g}]" for p in z)
        text += f"  measures: {{both: 2*q1 + q2}}\nkinematics: {{path: {{P: [{path}]}}, outputs: [P, both]}}\n"
        # Of a limit below a turn a pose tells all, of a wider one the motion, from a turn of its own.
        inside = (way[0] - low[0]) % 360 <= high[0] - low[0]
        turns = np.arange(-9, 10)[:, None] * 360
        if high[0] - low[0] >= 360:
            within = (way[0] + turns >= low[0] - 1e-9) & (way[0] + turns <= high[0] + 1e-9)
            inside = within[within[:, 0]]
            # Where the whole motion has a turn in which it fits, it is valid.
            inside = inside[inside.all(axis=1)][0] if inside.all(axis=1).any() else None
        try:
            found = kinematics(study_of(text)).tables["motion"]
        except AssemblyError:
            assert inside is not None, seed
            assert not inside.any(), seed
            continue
        valid = found["valid"].astype(bool)
        assert inside is None or (valid == inside).all(), seed
        assert found["both"] == pytest.approx(2 * found["q1"] + found["q2"])
        assert np.cos(np.radians(found["q1"] - way[0])) == pytest.approx(1, abs=1e-9)
        assert (np.abs(2 * found["q1"][valid] - low[0] - high[0]) <= high[0] - low[0] + 1e-9).all(), seed
        together = valid[1:] & valid[:-1]
        # A step may pass over what a limit below a turn leaves out.
        moved, steps = np.diff(found["q1"])[together], np.diff(way[0])[together]
        passing = 360 * np.round((moved - steps) / 360) * (high[0] - low[0] < 360)
        assert moved - passing == pytest.approx(steps, abs=1e-7), seed


def test_a_swept_drive_is_judged_as_it_is_given(seeds: Seeds) -> None:
    for seed in seeds(5):
        rng = np.random.default_rng(seed)
        text, low, high, _ = arm(rng)
        swept = np.linspace(low[0] - rng.uniform(0, 500), high[0] + rng.uniform(0, 500), 200)
        text += f"kinematics: {{sweep: {{q1: {{from: {swept[0]:.17g}, to: {swept[-1]:.17g}, number: 200}}, q2: 30}}}}\n"
        found = kinematics(study_of(text)).tables
        assert (found["motion"]["valid"] == (swept >= low[0]) & (swept <= high[0])).all(), seed
        ends = [end for end in (low[0], high[0]) if swept[0] < end < swept[-1]]
        assert found["limits"]["q1"] == pytest.approx(ends, abs=1e-8), seed


def arm(rng: np.random.Generator) -> tuple[str, Floats, Floats, Floats]:
    """An arm of two links whose shoulder turns between limits below and above a turn; its lengths, too."""
    lengths = rng.uniform(60, 120, 2).round(3)
    low = np.array([rng.uniform(-400, 100), rng.uniform(5, 15)]).round(1)
    high = low + np.array([rng.choice([200, 300, 359, 400, 700]) * rng.uniform(0.9, 1), rng.uniform(60, 150)]).round(1)
    at = np.radians((low + high) / 2)
    elbow = lengths[0] * np.exp(1j * at[0])
    hand = elbow + lengths[1] * np.exp(1j * at.sum())
    text = f"""
units: {{length: mm, angle: deg}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, E, {lengths[0]:.17g}], fore: [E, P, {lengths[1]:.17g}]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  sketch: {{E: [{elbow.real:.17g}, {elbow.imag:.17g}], P: [{hand.real:.17g}, {hand.imag:.17g}]}}
  limits:
    - {{drive: q1, min: {low[0]:.17g}, max: {high[0]:.17g}}}
    - {{drive: q2, min: {low[1]:.17g}, max: {high[1]:.17g}}}
"""
    return text, low, high, lengths
