"""Random cycles against closed forms: flywheels under loads with corners, change points, arms that turn fully.

The models share nothing with the package.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from helpers.corner_motions import dynamic_cycle
from helpers.corners import Course, Jet, direction, scanned, swing, turned
from helpers.machines import DEGREE, number
from helpers.studies import study_of

import mechdesign

STEPS = (1, 2, 5, 7.5, 10, 15, 30)


def near(told: float, value: float, size: float, about: object) -> None:
    assert told == pytest.approx(value, abs=1e-6 * size), about


def check_flywheel(seed: int) -> None:
    rng = np.random.default_rng([seed, 51])
    case, rate = dynamic_cycle(seed)
    fluctuation = number(rng.uniform(0.005, 0.1))
    study = study_of(case.text + f"  flywheel: {{fluctuation: {fluctuation!r}}}\n")
    (wheel,) = [mechdesign.dynamics(study).tables["flywheel"]]
    kinetic = scanned(case.course, case.low, case.high, 20_001)["kinetic_energy"].mean
    mean, surplus = swing(case.course, "crank_effort", case.low, case.high, 20_001)
    # Kilograms and millimetres: a newton-millimetre is a thousand kg mm^2/s^2.
    surplus, speed = surplus * DEGREE, rate * DEGREE
    inertia = 2000 * kinetic / speed**2
    about = (seed, {name: wheel[name][0] for name in wheel.names}, mean, surplus, inertia, case.text)
    largest = scanned(case.course, case.low, case.high, 2001)["crank_effort"].peak
    near(wheel["mean_speed"][0], rate, rate, about)
    near(wheel["mean_effort"][0], mean, largest, about)
    near(wheel["surplus"][0], surplus, surplus, about)
    near(wheel["inertia"][0], inertia, inertia, about)
    near(wheel["fluctuation"][0], 1000 * surplus / speed**2 / inertia, 1000 * surplus / speed**2 / inertia, about)
    added = max(1000 * surplus / (fluctuation * speed**2) - inertia, 0.0)
    near(wheel["added_inertia"][0], added, max(added, inertia), about)


def test_flywheel_of_a_random_cycle() -> None:
    check_flywheel(0)


@pytest.mark.nightly
def test_flywheels_of_sixty_random_cycles() -> None:
    for seed in range(100, 160):
        check_flywheel(seed)


def check_extremes(text: str, columns: Course, low: float, high: float, rate: float) -> None:
    """Extremes of outputs, their velocities and accelerations against jets over time at many poses."""
    table = mechdesign.kinematics(study_of(text)).tables["extremes"]
    rows = {str(name): row for row, name in enumerate(table["output"])}

    def parts(at: np.ndarray) -> dict[str, np.ndarray]:
        found = {}
        for name, jet in columns(at).items():
            found |= {name: jet.value, f"{name}_velocity": jet.first, f"{name}_acceleration": jet.second}
        return found

    found = scanned(parts, low, high, 10_001)
    for name, course in found.items():
        # What stands still does so to the rounding of what it might do.
        largest = max(course.peak, -course.low, 1.0)
        if name.endswith("_acceleration"):
            largest = max(largest, found[name.replace("acceleration", "velocity")].peak * rate * DEGREE)
        for end, value in (("min", course.low), ("max", course.high)):
            told = float(table[end][rows[name]])
            assert told == pytest.approx(value, abs=1e-6 * largest), (name, end, value, text)


def swept(rng: np.random.Generator) -> tuple[str, float, float, float]:
    """A turn or more of a crank from anywhere: lines of a study, its rate and ends."""
    step = float(rng.choice(STEPS))
    low = float(rng.choice([0.0, -180.0, number(rng.uniform(-90, 90))]))
    high, rate = low + 360.0 * int(rng.integers(1, 3)), number(rng.uniform(20, 400))
    text = f"  sweep: {{crank: {{from: {low!r}, to: {high!r}, step: {step!r}}}}}\n  rates: {{crank: {rate!r}}}\n"
    return text, rate, low, high


def check_parallelogram(seed: int, *, crossed: bool = False) -> None:
    """A parallelogram, or one with its rod crossed, which turns as the mirror image in the diagonal."""
    rng = np.random.default_rng([seed, 52])
    r, d = number(rng.uniform(20, 60)), number(rng.uniform(80, 200))
    p = complex(number(rng.uniform(0, d)), number(rng.uniform(-50, 50)))
    drawn = float(rng.choice([-1, 1]) * rng.uniform(30, 150))
    motion, rate, low, high = swept(rng)

    def geometry(theta: Jet) -> tuple[Jet, Jet]:
        """The rod's vector for each unit, and the rocker's angle."""
        if not crossed:
            return Jet(np.ones(theta.value.shape, dtype=complex)), theta
        span = d - turned(theta) * r
        turning = direction(span) * 2
        return turned(turning), turning - theta

    start = Jet(np.array([drawn * DEGREE]), 1.0)
    a, b = turned(start) * r, turned(start) * r + geometry(start)[0] * d
    text = (
        f"mechanism:\n  links:\n    ground: {{O: [0, 0], D: [{d}, 0]}}\n    crank: [O, A, {r}]\n"
        f"    rod: {{from: A, to: B, length: {d}, points: {{M: [{p.real}, {p.imag}]}}}}\n    rocker: [D, B, {r}]\n"
        "  drives: [crank]\n  branch: follow\n"
        f"  sketch: {{A: [{a.value[0].real:.9f}, {a.value[0].imag:.9f}], "
        f"B: [{b.value[0].real:.9f}, {b.value[0].imag:.9f}]}}\n"
        f"kinematics:\n{motion}  outputs: [M, rocker.angle]\n"
    )

    def columns(at: np.ndarray) -> dict[str, Jet]:
        theta = Jet(at * DEGREE, np.full(at.shape, rate * DEGREE), np.zeros(at.shape))
        rod, rocker = geometry(theta)
        m = turned(theta) * r + rod * p
        return {"M.x": m.real, "M.y": m.imag, "rocker.angle": rocker * (1 / DEGREE)}

    first = columns(np.array([low]))["rocker.angle"].value[0]

    def told(at: np.ndarray) -> dict[str, Jet]:
        """Angles of a table are within half a turn at the first pose; at half a turn itself rounding chooses."""
        found = columns(at)
        angle = found.pop("rocker.angle") - 360.0 * np.round(first / 360)
        return found | ({"rocker.angle": angle} if abs(first / 360 % 1 - 0.5) > 1e-6 else {})

    check_extremes(text, told, low, high, rate)


def check_crossed(seed: int) -> None:
    check_parallelogram(seed, crossed=True)


def check_folding_slider(seed: int) -> None:
    """A slider-crank whose rod is as long as its crank: it folds where the crank is upright, B at the crank's pivot."""
    rng = np.random.default_rng([seed, 53])
    r, drawn = number(rng.uniform(20, 60)), float(rng.uniform(20, 70))
    motion, rate, low, high = swept(rng)
    a = r * np.exp(1j * drawn * DEGREE)
    text = (
        f"mechanism:\n  links: {{ground: {{O: [0, 0]}}, crank: [O, A, {r}], rod: [A, B, {r}], slider: {{B: [0, 0]}}}}\n"
        "  joints: {guide: {prismatic: [ground, slider], through: O, point: B}}\n  drives: [crank]\n  branch: follow\n"
        f"  sketch: {{A: [{a.real:.9f}, {a.imag:.9f}], B: [{2 * a.real:.9f}, 0]}}\n"
        f"kinematics:\n{motion}  outputs: [B.x]\n"
    )

    def columns(at: np.ndarray) -> dict[str, Jet]:
        return {"B.x": turned(Jet(at * DEGREE, np.full(at.shape, rate * DEGREE))).real * (2 * r)}

    check_extremes(text, columns, low, high, rate)


@pytest.mark.parametrize("check", [check_parallelogram, check_crossed, check_folding_slider])
def test_rates_of_some_motions_through_change_points(check: Callable[[int], None]) -> None:
    for seed in range(3):
        check(seed)


@pytest.mark.nightly
@pytest.mark.parametrize("check", [check_parallelogram, check_folding_slider])
def test_rates_of_sixty_motions_through_change_points(check: Callable[[int], None]) -> None:
    for seed in range(100, 160):
        check(seed)


def check_whitworth(seed: int) -> None:
    """A wheel that follows the arm over several turns, by its ratio or an expression; the crank or the arm is swept."""
    rng = np.random.default_rng([seed, 54])
    r, c = number(rng.uniform(60, 120)), number(rng.uniform(10, 50))
    ratio, phase = (
        number(rng.choice([-2, -1, -0.5, 1 / 3, 0.5, 1.5]) * rng.uniform(0.9, 1.1)),
        float(rng.integers(0, 90)),
    )
    led, written = str(rng.choice(["crank", "arm.angle"])), bool(rng.random() < 0.5)
    step, count = float(rng.choice([5, 10, 30, 60])), int(rng.integers(1, 4))
    low, rate = float(rng.choice([0.0, -360.0, number(rng.uniform(-170, 170))])), number(rng.uniform(20, 200))
    low += float(rng.choice([0.0, 720.0])) * (low > 0)
    fx, fy = number(rng.uniform(-20, 20)), number(rng.uniform(-20, 20))
    drawn = float(rng.integers(-170, 170))

    def arm_of(theta: Jet) -> Jet:
        return theta + direction(1 - turned(-theta) * (c / r))

    def crank_of(arm: Jet) -> Jet:
        s, e = turned(arm).real * -c, turned(arm)
        inner = r * r - (e.imag * c) * (e.imag * c)
        root = np.sqrt(inner.value)
        along = s + inner.through(root, 0.5 / root, -0.25 / root**3)
        # The crank's pin seen from its own pivot, against the arm's direction.
        return arm + direction(along + turned(-arm) * c)

    def wheel_of(arm: Jet) -> Jet:
        """Degrees; the arm counts from the sketch, where it is within half a turn."""
        start = arm_of(Jet(np.array([drawn * DEGREE]), 1.0)).value[0]
        return (arm - 2 * np.pi * np.round(start / 2 / np.pi)) * (ratio / DEGREE) + phase

    at = low + step * np.arange(round(count * 360 / step) + 1)

    def columns(at: np.ndarray) -> dict[str, Jet]:
        given = Jet(at * DEGREE, np.full(at.shape, rate * DEGREE), np.zeros(at.shape))
        arm = arm_of(given) if led == "crank" else given
        wheel = wheel_of(arm)
        p = turned(wheel * DEGREE) * 30 + 260
        return {"P.x": p.real, "P.y": p.imag, "crank": (given if led == "crank" else crank_of(given)) * (1 / DEGREE)}

    coupling = f"to: '{phase} + {ratio}*arm.angle'" if written else f"of: arm, ratio: {ratio}, phase: {phase}"
    start = Jet(np.array([drawn * DEGREE]), 1.0)
    a, arm = turned(start).value[0] * r, arm_of(start)
    e, p = c + 50 * np.exp(1j * arm.value[0]), 260 + 30 * np.exp(1j * DEGREE * wheel_of(arm).value[0])
    text = (
        f"mechanism:\n  links: {{ground: {{O: [0, 0], C: [{c}, 0], Q: [260, 0]}}, crank: [O, A, {r}], arm: [C, E, 50], "
        "wheel: [Q, P, 30]}\n  joints: {slot: {slot: arm, through: C, point: A}}\n  drives: [crank]\n"
        f"  couplings: {{gear: {{set: wheel, {coupling}}}}}\n"
        f"  sketch: {{A: [{a.real:.9f}, {a.imag:.9f}], E: [{e.real:.9f}, {e.imag:.9f}], "
        f"P: [{p.real:.9f}, {p.imag:.9f}]}}\n"
        f"kinematics:\n  sweep: {{{led}: {{from: {low!r}, to: {float(at[-1])!r}, step: {step!r}}}}}\n"
        f"  rates: {{{led}: {rate!r}}}\n  outputs: [P]\n  loads: [{{at: P, force: [{fx}, {fy}]}}]\n"
    )
    result = mechdesign.kinematics(study_of(text))
    rows, motion = columns(at), result.tables["motion"]
    assert motion["valid"].all(), text
    for name in ("P.x", "P.y"):
        assert motion[name] == pytest.approx(rows[name].value, abs=1e-7), (seed, name, text)
        assert motion[f"{name}_velocity"] == pytest.approx(rows[name].first, abs=1e-5), (seed, name, text)
    effort = -(fx * rows["P.x"].first + fy * rows["P.y"].first) / (rows["crank"].first * DEGREE)
    assert motion["crank_effort"] == pytest.approx(effort, abs=1e-6 * np.abs(effort).max()), (seed, text)
    assert size_of_turns(motion["crank"], rows["crank"].value) < 1e-7, (seed, text)
    check_extremes(
        text, lambda at: {name: jet for name, jet in columns(at).items() if name != "crank"}, low, float(at[-1]), rate
    )


def size_of_turns(told: np.ndarray, values: np.ndarray) -> float:
    """The largest difference of two angles, but for the same whole turns everywhere."""
    gap = told - values
    return float(np.abs(gap - 360 * np.round(gap[0] / 360)).max())


def test_what_follows_an_arm_that_turns_fully_keeps_its_turns() -> None:
    for seed in range(6):
        check_whitworth(seed)


@pytest.mark.nightly
def test_what_follows_sixty_arms_that_turn_fully_keeps_its_turns() -> None:
    for seed in range(100, 160):
        check_whitworth(seed)
