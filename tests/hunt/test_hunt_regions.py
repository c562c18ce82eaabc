"""Regions of random robots against plain rasters: the inverse problem solved here, by circles, slides and strokes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from helpers.studies import study_of
from scipy import ndimage

import mechdesign
from mechdesign.ground.results import Result
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH, SINGLE

Complex = np.ndarray
Flags = np.ndarray
# Which places are reached with the platform at an angle (radians), and the sign of the determinant there.
Solve = Callable[[Complex, float], tuple[Flags, np.ndarray]]
Seeds = Callable[[int], Iterator[int]]
CELLS = 700
# Which legs have the other elbow than in the sketch.
BOTH = np.array([(1, -1), (-1, 1), (-1, -1)])
# A raster counts cells on the boundary wrongly by at most this share of their area.
EDGE = 0.35


@dataclass(frozen=True)
class Robot:
    """A study, and the same robot solved here.

    Parameters
    ----------
    point : complex
        The point's place in the sketch, which is reached.
    half : float
        The region lies within a square of twice this side about the origin.
    modes : sequence of Solve
        The same with other elbows than the sketch's.
    """

    text: str
    solve: Solve
    point: complex
    half: float
    modes: Sequence[Solve] = ()


def leg(z: Complex, base: complex, crank: float, rod: float, side: int) -> tuple[Flags, Complex]:
    """Whether a leg of two links from a pin reaches places, and its elbow."""
    k = z - base
    along = (np.abs(k) ** 2 + crank**2 - rod**2) / (2 * np.abs(k))
    square = crank**2 - along**2
    return square > 0, base + k / np.abs(k) * (along + 1j * side * np.sqrt(np.maximum(square, 0)))


def sliding(z: Complex, base: complex, turn: complex, rod: float, side: int) -> tuple[Flags, np.ndarray]:
    """Whether a rod from a slide on a line reaches places, and how far along the line the slide is."""
    k = (z - base) / turn
    square = rod**2 - k.imag**2
    return square > 0, k.real + side * np.sqrt(np.maximum(square, 0))


def within(angle: np.ndarray, low: float, width: float) -> Flags:
    """Whether angles in radians lie in a range in degrees, on any turn."""
    return np.asarray((angle - np.radians(low)) % (2 * np.pi) < np.radians(width))


def cross(a: Complex | complex, b: Complex) -> np.ndarray:
    return np.asarray(np.real(a) * b.imag - np.imag(a) * b.real)


def determinant(bars: list[Complex], arms: list[complex]) -> np.ndarray:
    """Of a platform's Jacobian, whose rows are the directions of the bars and their moments about the point."""
    pairs = ((bars[1], bars[2]), (bars[2], bars[0]), (bars[0], bars[1]))
    return np.asarray(sum(cross(arm, bar) * cross(*pair) for arm, bar, pair in zip(arms, bars, pairs, strict=True)))


def told(z: Complex | complex) -> str:
    return f"[{np.real(z):.17g}, {np.imag(z):.17g}]"


def somewhere(rng: np.random.Generator, solve: Solve, half: float, angle: float = 0.0) -> complex | None:
    """A reached place whose neighbours are reached, too."""
    z = half * (rng.uniform(-1, 1, 4000) + 1j * rng.uniform(-1, 1, 4000))
    good = solve(z, angle)[0]
    for step in 1e-2 * half * np.exp(0.5j * np.pi * np.arange(4)):
        good &= solve(z + step, angle)[0]
    return complex(z[good][0]) if good.any() else None


def five_bar(rng: np.random.Generator) -> Robot | None:
    """Two motors with ranges of angle, four links."""
    h = rng.uniform(10, 40)
    a, c, b, d = *rng.uniform(40, 120, 2), *rng.uniform(40, 150, 2)
    low, width = rng.uniform(-180, 180, 2), rng.uniform(40, 330, 2)
    sides = rng.choice([-1, 1], 2)

    def elbows(z: Complex, sides: np.ndarray = sides) -> tuple[Flags, Complex, Complex]:
        good, one = leg(z, -h, a, b, sides[0])
        also, two = leg(z, h, c, d, sides[1])
        return good & also, one, two

    def solve(z: Complex, _: float, sides: np.ndarray = sides) -> tuple[Flags, np.ndarray]:
        good, one, two = elbows(z, sides)
        good &= within(np.angle(one + h), low[0], width[0]) & within(np.angle(two - h), low[1], width[1])
        return good, cross(z - one, z - two)

    half = h + max(a + b, c + d)
    point = somewhere(rng, solve, half)
    if point is None:
        return None
    _, one, two = elbows(np.array(point))
    text = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{A: {told(-h)}, B: {told(h)}}}
    left: [A, D, {a:.17g}]
    right: [B, E, {c:.17g}]
    fore_left: [D, P, {b:.17g}]
    fore_right: [E, P, {d:.17g}]
  drives: {{t1: {{angle: left}}, t2: {{angle: right}}}}
  limits:
    - {{drive: t1, min: {low[0]:.17g}, max: {low[0] + width[0]:.17g}}}
    - {{drive: t2, min: {low[1]:.17g}, max: {low[1] + width[1]:.17g}}}
  sketch: {{D: {told(one)}, E: {told(two)}, P: {told(point)}}}
workspace: {{point: P, indices: []}}
"""
    return Robot(text, solve, point, half, [partial(solve, sides=sides * turn) for turn in BOTH])


def sliders(rng: np.random.Generator) -> Robot | None:
    """Two slides with strokes on rails, a rod from each."""
    bases = np.array([-1, 1]) * rng.uniform(0, 80) + 1j * rng.uniform(-30, 30, 2)
    turns = np.exp(1j * rng.uniform(-np.pi, np.pi, 2))
    rods, sides = rng.uniform(50, 150, 2), rng.choice([-1, 1], 2)
    low, stroke = rng.uniform(-100, 20, 2), rng.uniform(30, 200, 2)

    def slides(z: Complex, sides: np.ndarray = sides) -> tuple[Flags, list[np.ndarray]]:
        parts = [sliding(z, bases[k], turns[k], rods[k], sides[k]) for k in range(2)]
        return parts[0][0] & parts[1][0], [part[1] for part in parts]

    def solve(z: Complex, _: float, sides: np.ndarray = sides) -> tuple[Flags, np.ndarray]:
        good, moved = slides(z, sides)
        for k in range(2):
            good &= (moved[k] > low[k]) & (moved[k] < low[k] + stroke[k])
        return good, cross(*(z - bases[k] - moved[k] * turns[k] for k in range(2)))

    half = 90 + 220 + max(rods)
    point = somewhere(rng, solve, half)
    if point is None:
        return None
    pins = [bases[k] + slides(np.array(point))[1][k] * turns[k] for k in range(2)]
    directions = np.degrees(np.angle(turns))
    text = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{A: {told(bases[0])}, B: {told(bases[1])}}}
    one: {{D: [0, 0]}}
    two: {{E: [0, 0]}}
    left: [D, P, {rods[0]:.17g}]
    right: [E, P, {rods[1]:.17g}]
  joints:
    g1: {{prismatic: [ground, one], through: A, direction: {directions[0]:.17g}}}
    g2: {{prismatic: [ground, two], through: B, direction: {directions[1]:.17g}}}
  drives: {{s1: {{slide: g1}}, s2: {{slide: g2}}}}
  limits:
    - {{drive: s1, min: {low[0]:.17g}, max: {low[0] + stroke[0]:.17g}}}
    - {{drive: s2, min: {low[1]:.17g}, max: {low[1] + stroke[1]:.17g}}}
  sketch: {{D: {told(pins[0])}, E: {told(pins[1])}, P: {told(point)}}}
workspace: {{point: P, indices: []}}
"""
    return Robot(text, solve, point, half, [partial(solve, sides=sides * turn) for turn in BOTH])


def slider_arm(rng: np.random.Generator) -> Robot | None:
    """A slide on a rail and an arm on it, both with limits."""
    rod, side, low, stroke = rng.uniform(50, 150), rng.choice([-1, 1]), rng.uniform(-100, 20), rng.uniform(30, 300)
    start, width = rng.uniform(-180, 180), rng.uniform(30, 300)

    def solve(z: Complex, _: float, side: int = side) -> tuple[Flags, np.ndarray]:
        good, moved = sliding(z, 0, 1, rod, side)
        good &= (moved > low) & (moved < low + stroke) & within(np.angle(z - moved), start, width)
        return good, np.ones(z.shape)

    half = 330 + rod
    point = somewhere(rng, solve, half)
    if point is None:
        return None
    text = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{O: [0, 0]}}
    block: {{D: [0, 0]}}
    arm: [D, P, {rod:.17g}]
  joints: {{rail: {{prismatic: [ground, block], through: O}}}}
  drives: {{s: {{slide: rail}}, q: {{angle: arm}}}}
  limits:
    - {{drive: s, min: {low:.17g}, max: {low + stroke:.17g}}}
    - {{drive: q, min: {start:.17g}, max: {start + width:.17g}}}
  sketch: {{D: {told(float(sliding(np.array(point), 0, 1, rod, side)[1]))}, P: {told(point)}}}
workspace: {{point: P, characteristic_length: 60, indices: []}}
"""
    return Robot(text, solve, point, half, [partial(solve, side=-side)])


def telescopes(rng: np.random.Generator) -> Robot | None:
    """Two legs with strokes."""
    h = rng.uniform(20, 100)
    short, stroke = rng.uniform(20, 120, 2), rng.uniform(20, 120, 2)

    def solve(z: Complex, _: float) -> tuple[Flags, np.ndarray]:
        one, two = np.abs(z + h), np.abs(z - h)
        good = (one > short[0]) & (one < short[0] + stroke[0]) & (two > short[1]) & (two < short[1] + stroke[1])
        return good, z.imag

    half = h + 250
    point = somewhere(rng, solve, half)
    if point is None:
        return None
    text = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{A: {told(-h)}, B: {told(h)}}}
    left: {{from: A, to: P, telescopic: true}}
    right: {{from: B, to: P, telescopic: true}}
  drives: {{l1: {{length: left}}, l2: {{length: right}}}}
  limits:
    - {{drive: l1, min: {short[0]:.17g}, max: {short[0] + stroke[0]:.17g}}}
    - {{drive: l2, min: {short[1]:.17g}, max: {short[1] + stroke[1]:.17g}}}
  sketch: {{P: {told(point)}}}
workspace: {{point: P, indices: []}}
"""
    return Robot(text, solve, point, half)


def platform(rng: np.random.Generator) -> Robot | None:
    """Three legs to a platform that is held at its drawn angle, 0: of two links with driven cranks, or with strokes."""
    places = np.exp(1j * (np.array([-150, -30, 90]) + rng.uniform(-30, 30, 3)) * np.pi / 180)
    bases, corners = rng.uniform(120, 300, 3) * places, rng.uniform(20, 80, 3) * np.roll(places, rng.integers(3))
    cranks, rods, sides = rng.uniform(60, 200, 3), rng.uniform(60, 200, 3), rng.choice([-1, 1], 3)
    short, stroke = rng.uniform(50, 200, 3), rng.uniform(80, 250, 3)
    telescopic = bool(rng.integers(2))

    def feet(z: Complex, angle: float) -> tuple[Flags, list[Complex]]:
        ends = [z + corner * np.exp(1j * angle) for corner in corners]
        if telescopic:
            lengths = [np.abs(ends[k] - bases[k]) for k in range(3)]
            good = np.all([(lengths[k] > short[k]) & (lengths[k] < short[k] + stroke[k]) for k in range(3)], axis=0)
            return good, [np.full(z.shape, base) for base in bases]
        parts = [leg(ends[k], bases[k], cranks[k], rods[k], sides[k]) for k in range(3)]
        return np.all([part[0] for part in parts], axis=0), [part[1] for part in parts]

    def solve(z: Complex, angle: float) -> tuple[Flags, np.ndarray]:
        good, pins = feet(z, angle)
        arms = [corner * np.exp(1j * angle) for corner in corners]
        bars = [z + arms[k] - pins[k] for k in range(3)]
        return good, determinant(bars, arms)

    half = 300.0
    point = somewhere(rng, solve, half)
    if point is None:
        return None
    pins = [complex(pin) for pin in feet(np.array(point), 0.0)[1]]
    ends = [complex(point + corner) for corner in corners]
    legs, drives, limits, drawn = [], [], [], []
    for k in range(3):
        if telescopic:
            legs.append(f"    leg_{k}: {{from: O{k}, to: C{k}, telescopic: true}}")
            drives.append(f"q{k}: {{length: leg_{k}}}")
            limits.append(f"    - {{drive: q{k}, min: {short[k]:.17g}, max: {short[k] + stroke[k]:.17g}}}")
        else:
            legs.append(f"    crank_{k}: [O{k}, A{k}, {cranks[k]:.17g}]\n    rod_{k}: [A{k}, C{k}, {rods[k]:.17g}]")
            drives.append(f"q{k}: {{angle: crank_{k}}}")
            drawn.append(f"A{k}: {told(pins[k])}")
        drawn.append(f"C{k}: {told(ends[k])}")
    ground = ", ".join(f"O{k}: {told(bases[k])}" for k in range(3))
    plate = ", ".join(f"C{k}: {told(corners[k])}" for k in range(3))
    lines = "\n".join(legs)
    text = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{{ground}}}
{lines}
    platform: {{P: [0, 0], {plate}}}
  drives: {{{", ".join(drives)}}}
  limits:{" []" if not limits else ""}
{chr(10).join(limits)}
  sketch: {{{", ".join(drawn)}, P: {told(point)}}}
workspace: {{point: P, at: {{platform.angle: 0}}, characteristic_length: 60, indices: []}}
"""
    return Robot(text, solve, point, half)


FAMILIES = {"five_bar": five_bar, "sliders": sliders, "slider_arm": slider_arm, "telescopes": telescopes,
            "platform": platform}  # fmt: skip


def raster(robot: Robot, cells: int, angle: float, same: bool) -> tuple[Flags, float]:
    """Cells of a square that are reached, in the assembly of the sketch or in any; and a cell's side."""
    side = 2 * robot.half / cells
    x = (np.arange(cells) + 0.5) * side - robot.half
    with np.errstate(invalid="ignore", divide="ignore"):
        good, sign = robot.solve(x + 1j * x[:, None], angle)
        for mode in () if same else robot.modes:
            good = good | mode(x + 1j * x[:, None], angle)[0]
        drawn = robot.solve(np.array(robot.point), 0.0)[1]
    return np.asarray(good & (sign * drawn > 0) if same else good), side


def holding(good: Flags, robot: Robot, side: float) -> Flags:
    """The piece of a raster that holds the sketch's place."""
    label, _ = ndimage.label(good)
    row, column = (int((v + robot.half) / side) for v in (robot.point.imag, robot.point.real))
    return np.asarray(label == label[row, column]) & (label[row, column] > 0)


def area_of(good: Flags, side: float) -> tuple[float, float]:
    """Area of a raster's cells, and what it is not known to."""
    edge = good ^ ndimage.binary_erosion(good)
    return float(good.sum()) * side**2, EDGE * float(edge.sum()) * side**2


def truth(robot: Robot, same: bool) -> tuple[float, float] | None:
    """Area of the region by a raster; None where it does not tell whether pieces hang together."""
    good, side = raster(robot, CELLS, 0.0, same)
    if not same:
        return area_of(good, side)
    area, doubt = area_of(holding(good, robot, side), side)
    finer, fine_side = raster(robot, 2 * CELLS, 0.0, same)
    other, _ = area_of(holding(finer, robot, fine_side), fine_side)
    grown, _ = area_of(holding(ndimage.binary_dilation(good), robot, side) & good, side)
    return (area, doubt) if abs(area - other) <= doubt and abs(grown - area) <= doubt else None


def asked(robot: Robot, *changes: str) -> Result:
    return mechdesign.workspace(study_of(robot.text, *changes))


def compare(robot: Robot, same: bool, about: complex | None = None) -> None:
    wanted = truth(robot, same)
    if wanted is None:
        return
    centre = [] if about is None else [f"workspace.scan.about={told(about)}"]
    found = asked(robot, f"workspace.assembly={'same' if same else 'any'}", *centre).main["area"][0]
    assert abs(found - wanted[0]) <= wanted[1], (found, wanted)


@pytest.mark.parametrize("same", [False, True], ids=["any", "same"])
@pytest.mark.parametrize(("family", "cases"), [("five_bar", 3), ("sliders", 2), ("slider_arm", 2), ("telescopes", 1),
                                              ("platform", 1)])  # fmt: skip
def test_areas_of_random_robots(seeds: Seeds, family: str, cases: int, same: bool) -> None:
    for seed in seeds(cases):
        robot = FAMILIES[family](np.random.default_rng(seed))
        if robot is not None:
            compare(robot, same)


# Robots whose pieces were lost: beyond the reach that few rays had told, seen from the sketch's piece.
@pytest.mark.parametrize(("family", "seed"), [("five_bar", 0), ("five_bar", 15), ("five_bar", 51), ("five_bar", 99),
                                              ("sliders", 3), ("sliders", 71)])  # fmt: skip
def test_pieces_that_were_lost(family: str, seed: int) -> None:
    robot = FAMILIES[family](np.random.default_rng(seed))
    assert robot is not None
    compare(robot, same=False)
    wanted = truth(robot, same=False)
    assert wanted is not None
    # As a design of many, looked at less closely.
    question = questions(study_of(robot.text, "workspace.assembly=any"), 1e-4, ("area",))[0]
    found = answer(question, {}, 1, BATCH).values["area"][0]
    assert abs(found - wanted[0]) <= wanted[1], (found, wanted)


@pytest.mark.parametrize(("family", "seed"), [("five_bar", 15), ("sliders", 3)])
def test_the_area_is_the_same_from_everywhere(family: str, seed: int) -> None:
    """Seen from the sketch's place, from outside, and from far away."""
    robot = FAMILIES[family](np.random.default_rng(seed))
    assert robot is not None
    centres = [robot.point, 0.7 * robot.half * np.exp(1j), 3 * robot.half * np.exp(4j)]
    areas = [
        asked(robot, "workspace.assembly=any", f"workspace.scan.about={told(centre)}").main["area"][0]
        for centre in centres
    ]
    assert areas == pytest.approx(np.full(3, areas[0]), rel=1e-5)


# Limited expressions over an arm's angles and points, which no whole turn of an angle changes.
TURNING = ["cos({n}*q1)", "sin({n}*q1 + q2)", "sin(q1)*l2", "A.y*P.x", "P.x*P.y", "cos({n}*q1) + cos({n}*q2)",
           "sin(q1 + q2) + A.x/l1", "A.x - P.y"]  # fmt: skip


def of_joints(text: str, lengths: np.ndarray, q1: np.ndarray, q2: np.ndarray) -> np.ndarray:
    """An expression at angles of both joints (radians)."""
    elbow = lengths[0] * np.exp(1j * q1)
    hand = elbow + lengths[1] * np.exp(1j * (q1 + q2))
    names = {"q1": q1, "q2": q2, "l1": lengths[0], "l2": lengths[1], "sin": np.sin, "cos": np.cos,
             "A_x": elbow.real, "A_y": elbow.imag, "P_x": hand.real, "P_y": hand.imag}  # fmt: skip
    return np.asarray(eval(text.replace(".", "_"), names) + 0 * q1)


def swept(inside: Flags, lengths: np.ndarray, at: tuple[float, float]) -> tuple[float, float]:
    """Area that cells of the joints' angles sweep, those that hang together with the cell `at` (radians), and doubt."""
    rows, columns = inside.shape
    ends = np.cos(np.linspace(0, np.pi, columns + 1))
    size = lengths.prod() * 2 * np.pi / rows * -np.diff(ends)
    label, _ = ndimage.label(np.concatenate([inside, inside]))
    row, column = int(at[0] % (2 * np.pi) / (2 * np.pi) * rows), int(at[1] / np.pi * columns)
    # Twice round, so that a piece over angle 0 is whole once.
    own = label == label[row, column]
    own |= label == label[row + rows, column]
    whole = own[:rows] | own[rows:]
    edge = whole ^ (ndimage.binary_erosion(np.concatenate([whole] * 3))[rows : 2 * rows])
    return float((whole * size).sum()), EDGE * float((edge * size).sum())


def test_arms_with_limited_expressions(seeds: Seeds) -> None:
    """One design looked at closely and among many, against its joints' angles: P is at one pair of them only."""
    for seed in seeds(2):
        rng = np.random.default_rng(seed)
        lengths = rng.uniform(4, 10, 2)
        if rng.integers(2):
            lengths[1] = lengths[0] * (1 + 10 ** rng.uniform(-4, -1))
        text = str(rng.choice(TURNING)).format(n=rng.integers(1, 5))
        q1, q2 = rng.uniform(0, 2 * np.pi), rng.uniform(0.3, 2.8)
        value = of_joints(text, lengths, *(np.array([q]) for q in (q1, q2)))[0]
        spread = np.ptp(of_joints(text, lengths, *rng.uniform(0, 2 * np.pi, (2, 500))))
        low, high = value - spread * rng.uniform(0.02, 0.5), value + spread * rng.uniform(0.02, 0.5)
        found = []
        for cells in (CELLS, 2 * CELLS):
            a, b = (np.arange(2 * cells) + 0.5) * np.pi / cells, (np.arange(cells) + 0.5) * np.pi / cells
            values = of_joints(text, lengths, *np.meshgrid(a, b, indexing="ij"))
            inside = (values > low) & (values < high)
            found.append(swept(inside, lengths, (q1, q2)))
            found.append((swept(ndimage.binary_dilation(inside), lengths, (q1, q2))[0], 0.0))
        (area, doubt), (grown, _), (other, _), _ = found
        elbow = lengths[0] * np.exp(1j * q1)
        study = study_of(f"""
mechanism:
  parameters: {{l1: {lengths[0]:.17g}, l2: {lengths[1]:.17g}}}
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, l1], fore: [A, P, l2]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  measures: {{m: {text}}}
  limits: [{{measure: m, min: {low:.17g}, max: {high:.17g}}}]
  sketch: {{A: {told(elbow)}, P: {told(elbow + lengths[1] * np.exp(1j * (q1 + q2)))}}}
workspace: {{point: P, indices: []}}
""")
        if abs(area - other) > doubt or abs(grown - area) > 3 * doubt:
            continue
        question = questions(study, 1e-4, ("area",))[0]
        for effort in (SINGLE, BATCH):
            got = answer(question, {}, 1, effort).values["area"][0]
            # Limits along a row of cells are miscounted alike.
            assert abs(got - area) <= 2 * doubt, (seed, text, effort, got, area, doubt)


DIVIDED = """
units: {length: m}
mechanism:
  measures: {aside: P.x*P.x}
  links:
    ground: {A1: [-0.6, 0], A2: [0.6, 0], A3: [0.3, -0.2]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.2, 0], B2: [0.2, 0], B3: [0.25, 0.15]}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  limits:
    - {drive: l1, min: 0.4, max: 1.4}
    - {drive: l2, min: 0.4, max: 1.4}
    - {drive: l3, min: 0.3, max: 1.6}
    - {measure: aside, min: 0.04}
  sketch: {P: [0.4, 1], B1: [0.2, 1], B2: [0.6, 1], B3: [0.65, 1.15]}
workspace: {point: P, at: {platform.angle: 5}, assembly: same, characteristic_length: 1}
"""


def test_at_a_held_angle_only_the_sketchs_piece_counts() -> None:
    """A platform on three strokes that may not pass a strip in the middle."""
    bases, corners = np.array([-0.6, 0.6, 0.3 - 0.2j]), np.array([-0.2, 0.2, 0.25 + 0.15j])
    low, high = np.array([0.4, 0.4, 0.3]), np.array([1.4, 1.4, 1.6])

    def solve(z: Complex, angle: float) -> tuple[Flags, np.ndarray]:
        arms = corners * np.exp(1j * angle)
        bars = [z + arm - base for arm, base in zip(arms, bases, strict=True)]
        good = np.all(
            [(np.abs(bar) > a) & (np.abs(bar) < b) for bar, a, b in zip(bars, low, high, strict=True)], axis=0
        )
        return good & (z.real**2 > 0.04), determinant(bars, list(arms))

    robot = Robot(DIVIDED, solve, 0.4 + 1j, 2.0)
    good, side = raster(robot, CELLS, np.radians(5), True)
    one, every = area_of(holding(good, robot, side), side), area_of(good, side)
    assert one[0] < 0.9 * every[0]
    result = asked(robot)
    pieces = result.tables["pieces"]
    assert abs(result.main["area"][0] - one[0]) <= 1.5 * one[1]
    assert result.main["area"][0] == pytest.approx(pieces["area"][0], rel=1e-5)
    assert pieces["sketch"].tolist() == [1] + [0] * (len(pieces["piece"]) - 1)
    edge = result.tables["boundary"]
    assert set(edge["piece"]) == set(pieces["piece"])
    x, y = (edge[axis][edge["piece"] == 1] for axis in "xy")
    assert result.main["box_area"][0] == pytest.approx(np.ptp(x) * np.ptp(y), rel=1e-3)
    assert any("do not hang together" in warning for warning in map(str, result.warnings))
