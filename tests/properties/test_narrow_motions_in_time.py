"""Random motions in time with pulses, zones, events and limits, against SciPy with steps shorter than all of these."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.integrate import solve_ivp

from mechdesign.questions.dynamics.analysis import dynamics

G, DURATION = 9.81, 2.0
# Parts of the narrowest feature that a step of SciPy may take, and of the motion's size by which both may differ.
STEP, SAME = 0.2, 1e-6
UNITS = "units: {length: m, angle: rad, force: N}\n"
FREE = """
mechanism:
  links: {ground: {O: [0, 0]}, block: {points: {B: [0, 0]}, mass: 2}}
  joints: {way: {prismatic: [ground, block], through: O}}
  drives: {q: {slide: way}}
  sketch: {B: [0, 0]}
"""
PENDULUM = """
mechanism:
  links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 1, mass: 2, center: [0.5, 0], inertia: 0.3}}
  drives: {q: {angle: arm}}
  sketch: {P: [1, 0]}
"""
CRANK = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: 0.5, mass: 1, center: [0, 0], inertia: 0.6}
    rod: [A, B, 1.5]
    piston: {points: {B: [0, 0]}, mass: 2}
  joints: {bore: {prismatic: [ground, piston], through: O}}
  drives: {q: {angle: crank}}
  sketch: {A: [0.5, 0], B: [2, 0]}
"""
DOUBLE = """
mechanism:
  links:
    ground: {O: [0, 0]}
    a: {from: O, to: P, length: 1, mass: 1, center: [0.5, 0], inertia: 0.1}
    b: {from: P, to: Q, length: 0.8, mass: 1, center: [0.4, 0], inertia: 0.05}
  drives: {q: {angle: a}, r: {angle: b}}
  sketch: {P: [1, 0], Q: [1.8, 0]}
"""
# Accelerations from efforts, positions and velocities, of each mechanism.
Equations = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def free(effort: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    return effort / 2


def pendulum(effort: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    return (effort - 2 * G * 0.5 * np.cos(q)) / (0.3 + 2 * 0.25)


def crank(effort: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    sine, cosine, root = np.sin(q), np.cos(q), np.sqrt(1.5**2 - 0.25 * np.sin(q) ** 2)
    slope = -0.5 * sine - 0.25 * sine * cosine / root
    bend = -0.5 * cosine - 0.25 * (cosine**2 - sine**2) / root - (0.25 * sine * cosine) ** 2 / root**3
    return (effort - 2 * slope * bend * v**2) / (0.6 + 2 * slope**2)


def double(effort: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    cross = 0.4 * np.cos(q[0] - q[1])
    matrix = np.array([[0.35 + 1, cross], [cross, 0.05 + 0.16]])
    turned = 0.4 * np.sin(q[0] - q[1]) * np.array([v[1] ** 2, -(v[0] ** 2)])
    weight = G * np.array([1.5 * np.cos(q[0]), 0.4 * np.cos(q[1])])
    # The effort of r turns b against the ground, as its angle counts from there.
    return np.linalg.solve(matrix, effort - turned - weight)


@dataclass
class Case:
    """A mechanism under efforts that are narrow in time or along the way."""

    text: str
    accelerations: Equations
    names: tuple[str, ...]
    start: np.ndarray
    rates: np.ndarray
    weight: bool
    efforts: list[tuple[str, Callable[..., float]]] = field(default_factory=list)
    narrow: float = 1.0  # the shortest time that a feature takes, about
    extra: str = ""

    def study(self) -> str:
        """The study."""
        start = {name: float(value) for name, value in zip(self.names, self.start, strict=True)}
        start |= {f"{name}_velocity": float(value) for name, value in zip(self.names, self.rates, strict=True)}
        efforts = dict.fromkeys(self.names, "0*time")
        for k, (text, _) in enumerate(self.efforts):
            efforts[self.names[k % len(self.names)]] += f" + {text}"
        gravity = f"gravity: [0, -{G}], " if self.weight else ""
        words = ", ".join(f'{name}: "{text}"' for name, text in efforts.items())
        started = ", ".join(f"{name}: {value!r}" for name, value in start.items())
        return (
            f"{UNITS}{self.text}dynamics:\n"
            f"  {{{gravity}forward: {{duration: {DURATION}, rows: 21, start: {{{started}}}, "
            f"efforts: {{{words}}}{self.extra}}}}}\n"
        )

    def slope(self, time: float, state: np.ndarray) -> np.ndarray:
        """Derivative of positions and velocities."""
        count = len(self.names)
        q, v = state[:count], state[count:]
        effort = np.zeros(count)
        for k, (_, function) in enumerate(self.efforts):
            effort[k % count] += function(time, q[k % count], v[k % count])
        return np.concatenate([v, self.accelerations(effort, q, v)])


MECHANISMS = [
    (FREE, free, ("q",), False), (PENDULUM, pendulum, ("q",), True), (CRANK, crank, ("q",), False),
    (DOUBLE, double, ("q", "r"), True),
]  # fmt: skip


def drawn(seed: int) -> tuple[Case, np.random.Generator]:
    """A random case."""
    draw = np.random.default_rng(seed)
    text, equations, names, weight = MECHANISMS[seed % len(MECHANISMS)]
    start, rates = draw.uniform(-1, 1, len(names)), draw.uniform(1.5, 4, len(names)) * draw.choice([-1, 1], len(names))
    case = Case(text, equations, names, start, rates, weight)
    for k in range(len(names) * int(draw.integers(1, 4))):
        name, at = names[k % len(names)], k % len(names)
        width = float(10 ** draw.uniform(-3, -1))
        place = float(start[at] + draw.uniform(0.05, 1.5) * np.sign(rates[at]))
        instant, size = float(draw.uniform(0.1, 1.8)), float(draw.uniform(1, 20))
        zone = width * 2
        case.efforts.append([
            (f"{size / width**0.5!r}*max(0, 1 - abs(time - {instant!r})/{width!r})",
             lambda t, q, v, s=size / width**0.5, i=instant, w=width: s * max(0, 1 - abs(t - i) / w)),
            (f"{size!r}*max(0, sin(7*time) - {1 - width!r})/{width!r}",
             lambda t, q, v, s=size, w=width: s * max(0, np.sin(7 * t) - (1 - w)) / w),
            (f"-{size!r}*max(0, 1 - abs({name} - {place!r})/{zone!r})",
             lambda t, q, v, s=size, p=place, w=zone: -s * max(0, 1 - abs(q - p) / w)),
            (f"-{size!r}*{name}_velocity*min(1, max(0, 3 - abs({name} - {place!r})/{zone!r}))",
             lambda t, q, v, s=size, p=place, w=zone: -s * v * min(1, max(0, 3 - abs(q - p) / w))),
            (f"-{size / 4!r}*max(0, {name}_velocity - 2)", lambda t, q, v, s=size / 4: -s * max(0, v - 2)),
        ][int(draw.integers(5))])  # fmt: skip
        case.narrow = min(case.narrow, width / 3, zone / 8)
    return case, draw


def judge(seed: int) -> None:
    """The last state, the crossings of a random place, and the limit that ends the motion are those of SciPy."""
    case, draw = drawn(seed)
    watched = float(case.start[0] + draw.uniform(-1, 1))
    case.extra = f", events: {{passes: {{of: q, value: {watched!r}}}}}"
    limit = float(case.start[0] + draw.uniform(0.3, 3) * np.sign(case.rates[0])) if draw.uniform() < 0.5 else None

    def passes(time: float, state: np.ndarray) -> float:
        return float(state[0] - watched)

    def ends(time: float, state: np.ndarray) -> float:
        return 1.0 if limit is None else float((limit - state[0]) * np.sign(case.rates[0]))

    ends.terminal = True  # type: ignore[attr-defined]
    exact = solve_ivp(
        case.slope, (0, DURATION), np.concatenate([case.start, case.rates]), method="DOP853", rtol=1e-10, atol=1e-11,
        max_step=STEP * case.narrow, events=(passes, ends),
    )  # fmt: skip
    if limit is not None:
        low, high = sorted([limit, limit - 50 * float(np.sign(case.rates[0]))])
        case.text = case.text.rstrip() + f"\n  limits: [{{drive: q, min: {low!r}, max: {high!r}}}]\n"
    result = dynamics(study_of(case.study()))
    table, events = result.main, result.tables["events"]
    assert table["time"][-1] == pytest.approx(exact.t[-1], abs=SAME)
    size = np.abs(exact.y).max()
    for k, name in enumerate(case.names):
        assert table[name][-1] == pytest.approx(exact.y[k, -1], abs=SAME * size)
        assert table[f"{name}_velocity"][-1] == pytest.approx(exact.y[len(case.names) + k, -1], abs=100 * SAME * size)
    times = events["time"][(events["event"] == "passes") & np.isfinite(events["time"])]
    assert times == pytest.approx(exact.t_events[0], abs=10 * SAME)
    assert not [warning for warning in result.warnings if warning.kind == "unconverged"]


def test_nothing_narrow_is_passed_in_a_random_motion() -> None:
    judge(1)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [0, *range(2, 104)])
def test_nothing_narrow_is_passed_in_a_hundred_random_motions(seed: int) -> None:
    judge(seed)
