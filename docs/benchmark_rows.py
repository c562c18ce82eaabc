"""Rows of the page of benchmarks: what mechdesign does, and the same work by hand or by another package."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import floors
import numpy as np

import mechdesign
from mechdesign.ground.numerics.arrays import Floats

CONFIGS = Path(__file__).parents[1] / "configs"
OURS, PEERS = "mechdesign", ("C", "NumPy", "pylinkage")
# Sums over the regions of S1's robot: how their nodes lie, and how many half-lines and radii.
SUMS = {
    "64 × 72 nodes between the poles": (floors.between_poles, 64, 72),
    "300 × 200 even nodes": (floors.evenly, 300, 200),
}

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {C: [1.75, 1.5]}}
    rocker: [D, B, 3]
  drives: {theta: {angle: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
  measures: {mu: {angle: [rod, rocker]}}
"""
FIVE_BAR = """
mechanism:
  parameters: {a: 100, b: 215, c: 100}
  links:
    ground: {B1: [100, 0], B2: [-100, 0]}
    lower_1: [B1, D1, a]
    upper_1: [D1, C, b]
    lower_2: [B2, D2, c]
    upper_2: [D2, C, 215]
  drives: {phi1: {angle: lower_1}, phi2: {angle: lower_2}}
  sketch: {D1: [170, 72], D2: [-170, 72], C: [0, 205]}
kinematics:
  sweep: {C.x: {from: 0, to: 0, number: 1}, C.y: {from: 160, to: 250, number: 91}}
  outputs: [lower_1.angle]
"""
PRECISE = """
mechanism:
  parameters: {l1: 40, l2: 60, tol: 0.02}
  links:
    ground: {A: [0, 0], E: [50, 0]}
    left: [A, B, l1]
    right: [E, D, l1]
    up_left: [B, C, l2]
    up_right: [D, C, l2]
  drives: {theta1: {angle: left}, theta2: {angle: right}}
  sketch: {B: [-10, 38], D: [60, 38], C: [25, 87]}
reliability:
  sweep: {theta1: {from: 90, to: 126, number: 10}, theta2: 80}
  outputs: [C]
  dimensions: {"*.length": tol, ground.E.x: 0.02, theta1: 0.03, theta2: 0.03}
  methods: [analytic]
"""
WATT = """
units: {length: m, angle: rad, force: N}
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], G: [8, 0]}
    crank: {from: O, to: A, length: 1, mass: 1, inertia: 0.1}
    rod: {from: A, to: B, length: 3.5, mass: 2, inertia: 0.4}
    rocker: {from: D, to: B, length: 3, points: {C: [3.2, 0.4]}, mass: 2, inertia: 0.3}
    link: {from: C, to: F, length: 4, mass: 2, inertia: 0.5}
    last: {from: G, to: F, length: 3, mass: 1.5, inertia: 0.3}
  drives: {theta: {angle: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9], C: [2.9, 3.1], F: [6.7, 2.7]}
"""


@dataclass(frozen=True)
class Side:
    """One way to do the work: what takes the time, numbers of what it gives, and how far from ours they may be."""

    work: Callable[[], Any]
    numbers: Callable[[Any], Any]
    within: float = 1e-9  # of the largest number
    part: float = 1  # of the work, where all of it would take minutes


@dataclass(frozen=True)
class Row:
    """A row of the table: its work, made at a share of its full size, and why pylinkage does not do it."""

    title: str
    text: str
    sides: Callable[[float], Mapping[str, Side]]
    without: str


ROWS: dict[str, Row] = {}
Sides = Callable[[float], dict[str, Side]]


def row(title: str, text: str, without: str = "") -> Callable[[Sides], Sides]:
    """Enter a function as a row of its name."""

    def enter(sides: Sides) -> Sides:
        ROWS[sides.__name__] = Row(title, text, sides, without)
        return sides

    return enter


def in_c(side: Callable[[Any], Side]) -> dict[str, Side]:
    """The side of C, where there is a compiler."""
    return {} if floors.library() is None else {"C": side(floors.library())}


def has_pylinkage() -> bool:
    """Whether pylinkage and the compiler that makes it fast are installed."""
    return all(importlib.util.find_spec(name) is not None for name in ("pylinkage", "numba"))


def in_pylinkage(step: float, side: Callable[[Any], Side]) -> dict[str, Side]:
    """The side of pylinkage, where it is installed: with the four-bar, whose crank goes on by so many radians."""
    if not has_pylinkage():
        return {}
    import pylinkage

    o, d = pylinkage.Ground(0.0, 0.0, name="O"), pylinkage.Ground(4.0, 0.0, name="D")
    crank = pylinkage.Crank(anchor=o, radius=1.0, angular_velocity=step, name="A")
    pin = pylinkage.RRRDyad(anchor1=crank.output, anchor2=d, distance1=3.5, distance2=3.0, name="B")
    linkage = pylinkage.Linkage([o, d, crank, pin])
    linkage.set_input_velocity(crank, 10.0)
    return {"pylinkage": side(linkage)}


def turn_of(poses: int) -> Floats:
    """Crank angles of a turn (degrees) as pylinkage steps them: it ends where it began."""
    return np.linspace(0, 360, poses + 1)[1:]


def scattered(middles: tuple[float, ...], designs: int) -> Floats:
    """Numbers of designs within a twentieth of these: shape (numbers, designs)."""
    return np.array(middles)[:, None] * np.random.default_rng(1).uniform(0.95, 1.05, (len(middles), designs))


@row("Positions of a four-bar", "Both pins at 2,000,000 crank angles.")
def positions(share: float) -> dict[str, Side]:
    """`Mechanism.solve`."""
    poses = int(2_000_000 * share)
    turn, pins = turn_of(poses), np.empty((4, poses))
    theta = np.radians(turn)
    mechanism = mechdesign.load(text=FOUR_BAR).mechanism
    ours = Side(lambda: mechanism.solve({"theta": turn}), lambda pose: [pose["B.x"], pose["B.y"]])
    return {
        OURS: ours,
        **in_c(lambda c: Side(lambda: c.four_bar(poses, theta.ctypes.data, pins.ctypes.data), lambda _: pins[2:])),
        **in_pylinkage(
            2 * math.pi / poses,
            lambda linkage: Side(lambda: linkage.step_fast(poses), lambda places: places[:, 3].T, 1e-6),
        ),
    }


@row(
    "Motion of a four-bar",
    "Positions, velocities and accelerations at 200,000 crank angles. Ours is the whole answer of `kinematics`, with "
    "extremes and dead centres between the poses.",
)
def motion(share: float) -> dict[str, Side]:
    """`mechdesign.kinematics`."""
    poses = int(200_000 * share)
    sweep = f"sweep: {{theta: {{from: {360 / poses}, to: 360, number: {poses}}}}}"
    study = mechdesign.load(text=f"{FOUR_BAR}kinematics: {{{sweep}, outputs: [B], rates: {{theta: 10 rad/s}}}}\n")

    def ours(result: mechdesign.Answer) -> list[Floats]:
        return [result.main[f"B.{axis}_acceleration"] for axis in "xy"]

    return {OURS: Side(lambda: mechdesign.kinematics(study, jobs=1), ours)} | in_pylinkage(
        2 * math.pi / poses,
        lambda linkage: Side(lambda: linkage.step_fast_with_kinematics(poses), lambda result: result[2][:, 3].T, 1e-6),
    )


@row(
    "Designs of a four-bar",
    "Range of a coupler point, time ratio of the rocker and least transmission angle of 500 designs over a turn. Ours "
    "and NumPy's are exact between the poses; pylinkage has the range alone, at 72 poses.",
)
def turns(share: float) -> dict[str, Side]:
    """`mechdesign.evaluate`."""
    designs = max(int(500 * share), 5)
    lengths = scattered((1.0, 3.5, 3.0), designs)
    sweep = "kinematics: {sweep: {theta: {from: 0, to: 360, step: 5}}, outputs: [C, rocker.angle, mu]}\n"
    study = mechdesign.load(text=FOUR_BAR + sweep)
    entries = ("mechanism.links.crank.2", "mechanism.links.rod.length", "mechanism.links.rocker.2")
    values = dict(zip(entries, lengths, strict=True))
    extremes = [f"kinematics.extremes.{name}" for name in ("C.x.range", "rocker.angle.time_ratio", "mu.min")]

    def stepped(linkage: Any) -> Side:
        from pylinkage.population import Ensemble

        many = Ensemble(linkage, lengths.T.copy(), np.repeat(np.array(linkage.get_coords())[None], designs, axis=0))

        def ranges() -> Floats:
            places = many.simulate(72)
            a, b = (places[:, :, k, 0] + 1j * places[:, :, k, 1] for k in (2, 3))
            return np.asarray(np.ptp((a + (1.75 + 1.5j) * (b - a) / lengths[1][:, None]).real, axis=1))

        return Side(ranges, lambda result: result, 1e-2)

    return {
        OURS: Side(lambda: mechdesign.evaluate(study, values, extremes), lambda table: table[extremes[0]]),
        "NumPy": Side(lambda: floors.ends_of_turns(*lengths), lambda result: result[0], 1e-6),
        **in_pylinkage(math.radians(5), stepped),
    }


@row(
    "Designs of a five-bar",
    "Range of a drive of 500 designs while the tip passes 91 poses.",
    "moved by cranks, not by the tip",
)
def robots(share: float) -> dict[str, Side]:
    """`mechdesign.evaluate`."""
    sizes = scattered((100, 215, 100), max(int(500 * share), 5))
    study, swing = mechdesign.load(text=FIVE_BAR), "kinematics.extremes.lower_1.angle.range"
    values = {f"mechanism.parameters.{name}": size for name, size in zip("abc", sizes, strict=True)}
    return {
        OURS: Side(lambda: mechdesign.evaluate(study, values, [swing]), lambda table: table[swing]),
        "NumPy": Side(lambda: floors.five_bar_ranges(*sizes), lambda result: result, 1e-2),
    }


@row(
    "Precision of designs",
    "First order: the largest deviation of the tip of 500 five-bars, at ten poses each.",
    "deviations by Monte Carlo only",
)
def precision(share: float) -> dict[str, Side]:
    """`mechdesign.evaluate`."""
    l1, tolerance = scattered((40, 0.02), max(int(500 * share), 5))
    study, worst = mechdesign.load(text=PRECISE), "reliability.moments.sigma.max"
    values = {"mechanism.parameters.l1": l1, "mechanism.parameters.tol": tolerance}

    def by_hand() -> Floats:
        return np.asarray(floors.five_bar_deviations(l1, tolerance).max(axis=(0, 2)))

    return {
        OURS: Side(lambda: mechdesign.evaluate(study, values, [worst]), lambda table: table[worst]),
        "NumPy": Side(by_hand, lambda result: result, 1e-6),
    }


@row(
    "Monte Carlo",
    "How many of 4,000,000 made two-link arms with clearances miss their place by more than 0.05.",
    "no clearances",
)
def arms(share: float) -> dict[str, Side]:
    """`mechdesign.reliability`."""
    samples = max(int(4_000_000 * share), 100_000)
    poses, methods = "reliability.poses=[{theta1: 30, theta2: 60}]", "reliability.methods=[monte_carlo]"
    study = mechdesign.load(CONFIGS / "two_link_arm.yaml", overrides=[f"reliability.samples={samples}", poses, methods])
    # Six standard deviations of the difference of two counts of a failure of 0.0065.
    apart = 6 * math.sqrt(2 / (0.0065 * samples))
    return {
        OURS: Side(
            lambda: mechdesign.reliability(study, jobs=1), lambda result: result.tables["reliability"]["failure"][0]
        ),
        **in_c(lambda c: Side(lambda: c.arm(samples, 1, 0.05), lambda failures: failures / samples, apart)),
    }


@row(
    "Monte Carlo of a four-bar",
    "Deviations of a pin of 10,000 made four-bars at 72 poses each; pylinkage makes a fiftieth of them, and its time "
    "counts fifty times.",
)
def made(share: float) -> dict[str, Side]:
    """`mechdesign.reliability`."""
    samples = max(int(10_000 * share), 1000)
    few = samples // 50 if share == 1 else 100
    dimensions = '{"*.length": {tolerance: 0.01, distribution: uniform}}'
    study = mechdesign.load(
        text=f"{FOUR_BAR}reliability: {{sweep: {{theta: {{from: 5, to: 360, number: 72}}}}, outputs: [B], "
        f"methods: [monte_carlo], samples: {samples}, dimensions: {dimensions}}}\n"
    )

    def analysed(linkage: Any) -> Side:
        errors = dict.fromkeys(("A_radius", "B_dist1", "B_dist2"), 0.01)
        work = partial(linkage.analyze_tolerance, errors, iterations=72, n_samples=few, seed=1)
        return Side(work, lambda result: result.position_std.mean(), 6 / math.sqrt(2 * few), few / samples)

    def ours(result: mechdesign.Answer) -> Any:
        return np.hypot(*result.tables["moments"]["sigma"].reshape(-1, 2).T).mean()

    return {OURS: Side(lambda: mechdesign.reliability(study, jobs=1), ours)} | in_pylinkage(math.radians(5), analysed)


@row(
    "Forces of a six-bar",
    "Effort and forces of seven joints of Watt's six-bar with masses at 100,000 poses. Ours is the whole answer of "
    "`dynamics`, with its tables.",
    "no forces",
)
def forces(share: float) -> dict[str, Side]:
    """`mechdesign.dynamics`."""
    poses = int(100_000 * share)
    sweep = f"sweep: {{theta: {{from: {2 * math.pi / poses!r}, to: 2*pi, number: {poses}}}}}"
    study = mechdesign.load(text=f"{WATT}dynamics: {{gravity: [0, -9.81], {sweep}, rates: {{theta: 10}}}}\n")
    theta, effort, joints = np.radians(turn_of(poses)), np.empty(poses), np.empty((7, 2, poses))

    def by_hand(c: Any) -> Side:
        def work() -> None:
            c.six_bar(poses, theta.ctypes.data, 10.0, effort.ctypes.data, joints.ctypes.data)

        return Side(work, lambda _: [effort, np.hypot(*joints[4])])

    def ours(result: mechdesign.Answer) -> list[Floats]:
        table = result.tables["joint_forces"]
        return [result.main["theta_effort"], table["magnitude"][table["joint"] == "C"]]

    return {OURS: Side(lambda: mechdesign.dynamics(study, jobs=1), ours)} | in_c(by_hand)


def s1_designs(result: mechdesign.Answer, *names: str) -> Floats:
    """Columns of the designs of S1's grid: shape (names, designs)."""
    return np.array([result.tables["designs"][name] for name in names])


def s1_grid(share: float, sums: str, within: float) -> dict[str, Side]:
    """`mechdesign.optimize` over S1's grid of 4,556 designs, or one with wider steps, beside sums in C."""
    steps = {f"optimize.variables.{name}.step": 0.03 / min(1, 2 * share) for name in ("l_min", "l_a")}
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", steps)
    lengths = s1_designs(mechdesign.optimize(study, jobs=1), "l_min", "l_a")
    ours = Side(lambda: mechdesign.optimize(study, jobs=1), lambda result: s1_designs(result, "GII", "GRI"))
    return {OURS: ours} | in_c(
        lambda _: Side(lambda: floors.region_sums(*lengths, *SUMS[sums]), lambda result: result, within)
    )


@row(
    "S1's grid, equal accuracy",
    "Isotropy and resistivity of 4,556 2-RRR robots over their regions, asked to 1e-4. The sums in C have 64 × 72 "
    "nodes, which lie where this robot's indices want them.",
    "no regions",
)
def grid(share: float) -> dict[str, Side]:
    """With a rule that was made for where this robot is singular."""
    return s1_grid(share, "64 × 72 nodes between the poles", 1e-3)


@row(
    "S1's grid, plain sums",
    "The same beside sums over 300 × 200 even nodes, which are less exact (below).",
    "no regions",
)
def plain_grid(share: float) -> dict[str, Side]:
    """With even nodes."""
    return s1_grid(share, "300 × 200 even nodes", 0.05)


def accuracy() -> dict[str, float]:
    """Largest relative errors of isotropy and resistivity over S1's grid, beside our own asked to 1e-6."""
    study = CONFIGS / "two_rrr.yaml"
    result, exact = (
        mechdesign.optimize(mechdesign.load(study, {"workspace.integrate": {"rule": "gauss", "tolerance": tolerance}}))
        for tolerance in (1e-4, 1e-6)
    )
    indices = {OURS: s1_designs(result, "GII", "GRI")}
    if floors.library() is not None:
        lengths = s1_designs(result, "l_min", "l_a")
        indices |= {f"C, {name}": floors.region_sums(*lengths, *sums) for name, sums in SUMS.items()}
    apart = {name: np.abs(values / s1_designs(exact, "GII", "GRI") - 1).max() for name, values in indices.items()}
    return {name: float(f"{error:.2g}") for name, error in apart.items()}
