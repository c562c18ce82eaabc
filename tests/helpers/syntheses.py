"""Problems of dimensional synthesis: a study, and the same goal from closed forms of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats

# What a design costs that does not assemble, and the more so by how much it does not.
OPEN = 1e6


@dataclass(frozen=True)
class Problem:
    """A goal to be made small.

    Parameters
    ----------
    study : str
        Its text.
    goal : str
        Its column in optimum.csv.
    ranges : mapping
        Of the variables.
    cost : callable
        From variables, each of shape (designs,), to the goal; `OPEN` and more where a design does not assemble or
        misses a condition.
    rows : callable
        The same by the poses of the study alone, which lead a search to the largest error of a motion; as `cost` where
        left out.
    """

    study: str
    goal: str
    ranges: Mapping[str, tuple[float, float]]
    cost: Callable[..., Floats]
    rows: Callable[..., Floats] | None = None

    def of_cube(self, u: Floats, *, by_rows: bool = False) -> Floats:
        """The goal at points of the unit cube, shape (variables, designs), as SciPy asks for them."""
        low, high = np.array(list(self.ranges.values())).T
        cost = self.rows if by_rows and self.rows else self.cost
        return np.asarray(cost(*(low[:, None] + u * (high - low)[:, None])))


def third(p: Any, q: Any, to_p: Any, to_q: Any, side: float) -> tuple[Any, Any]:
    """Where two circles meet, on the left (1) or right of the way from p to q; and by how much they do not."""
    reach = np.abs(q - p)
    along = (reach**2 + to_p**2 - to_q**2) / (2 * reach)
    room = to_p**2 - along**2
    missed = np.maximum(-room, 0.0) / to_p**2
    return p + (along + 1j * side * np.sqrt(np.maximum(room, 0.0))) * (q - p) / reach, missed


def four_bar(a: Any, b: Any, c: Any, u: Any, v: Any, crank: Floats, d: Any, side: float) -> tuple[Any, Any, Any]:
    """Coupler point and rocker's angle (radians) for crank angles, shape (designs, angles), and what misses."""
    a, b, c, u, v, d = (np.asarray(value, dtype=float).reshape(-1, 1) for value in (a, b, c, u, v, d))
    pin = a * np.exp(1j * np.radians(crank))
    other, missed = third(pin, d, b, c, side)
    turn = (other - pin) / b
    return pin + turn * (u + 1j * v), np.angle(other - d), missed.sum(axis=1)


def _judged(values: Floats, missed: Floats) -> Floats:
    return np.asarray(np.where(missed > 0, OPEN * (1 + missed), values))


def _rms(errors: Floats) -> Floats:
    return np.asarray(np.sqrt((errors**2).mean(axis=1)))


# Of a motion the root mean square is that of the whole way, by a Gauss rule.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(48)
# Of the largest error these places between the ends, and parabolas between them, leave less than 1e-8 of it.
FINE = np.linspace(-1, 1, 3001)


def _of_motion(errors: Callable[[Floats], tuple[Floats, Floats]], crank: Floats, goal: str, *, rows: bool) -> Floats:
    """The root mean square of errors over the way of a crank, or the largest on it or at its poses, the rows.

    `OPEN` where some miss.
    """
    rms = goal.endswith("rms")
    at_poses, missed = errors(crank)
    places = NODES if rms or rows else FINE
    between, missed_between = errors((crank[-1] + crank[0] + (crank[-1] - crank[0]) * places) / 2)
    largest = np.abs(at_poses).max(axis=1) if rows else _largest(np.abs(between))
    values = np.sqrt(between**2 @ WEIGHTS / 2) if rms else largest
    return _judged(values, missed + missed_between)


def _largest(curves: Floats) -> Floats:
    """The greatest value of each, shape (designs, places), by the parabola through a top and the places beside it."""
    before, at, after = curves[:, :-2], curves[:, 1:-1], curves[:, 2:]
    bend = before - 2 * at + after
    top = (at >= before) & (at >= after) & (bend < 0)
    tops = at - np.where(top, (after - before) ** 2, 0) / np.where(top, 8 * bend, 1)
    return np.maximum(curves.max(axis=1), tops.max(axis=1))


FOUR_BAR = """\
units: {{length: mm, angle: deg}}
mechanism:
  parameters: {parameters}
  links:
    ground: {{O: [0, 0], D: [{d}, 0]}}
    crank: [O, A, a]
    coupler: {{from: A, to: B, length: b, points: {{C: [{u}, {v}]}}}}
    rocker: [D, B, c]
  drives: [crank]
  sketch: {{A: [30, 0], B: [{d} - 20, {side}80]}}
  targets: {{{target}}}
  measures: {{mu: {{angle: [coupler, rocker]}}}}
kinematics:
  sweep: {{crank: {{from: {begin}, to: {end}, step: {step}}}}}
  outputs: [C, rocker.angle, mu]
optimize:
  method: search
  variables: {variables}
  minimize: [{goal}]
"""


def four_bar_study(
    ranges: Mapping[str, tuple[float, float]], target: str, goal: str, crank: tuple[float, float, float], *,
    d: float = 100, u: str = "u", v: str = "v", side: float = 1, more: Mapping[str, float] | None = None,
) -> str:  # fmt: skip
    """A four-bar with its crank on the left; begins in the middle of the ranges."""
    middle = {name: (low + high) / 2 for name, (low, high) in ranges.items()} | dict(more or {})
    parameters = "{" + ", ".join(f"{name}: {value!r}" for name, value in middle.items()) + "}"
    variables = "{" + ", ".join(f"{k}: {{from: {low}, to: {high}}}" for k, (low, high) in ranges.items()) + "}"
    begin, end, step = crank
    return FOUR_BAR.format(
        parameters=parameters, d=d, u=u, v=v, side="" if side > 0 else "-", target=target, variables=variables,
        goal=goal, begin=begin, end=end, step=step,
    )  # fmt: skip


def held_height(goal: str, begin: float, end: float, step: float) -> Problem:
    """A coupler point at a height of 100 while the crank turns."""
    ranges = {"a": (10, 100), "b": (40, 200), "c": (40, 200), "u": (-100, 200), "v": (-100, 200)}
    crank = np.arange(begin, end + step / 2, step)

    def cost(a: Floats, b: Floats, c: Floats, u: Floats, v: Floats, *, rows: bool = False) -> Floats:
        def errors(angles: Floats) -> tuple[Floats, Floats]:
            point, _, missed = four_bar(a, b, c, u, v, angles, 100, 1)
            return point.imag - 100, missed

        return _of_motion(errors, crank, goal, rows=rows)

    study = four_bar_study(ranges, "C.y: 100", goal, (begin, end, step))
    return Problem(study, goal, ranges, cost, partial(cost, rows=True))


def function_generator(ranges: Mapping[str, tuple[float, float]], formula: str, wanted: Callable[[Floats], Floats],
                       goal: str) -> Problem:  # fmt: skip
    """A rocker that follows a function of the crank, measured from `first`."""
    crank = np.arange(20.0, 111.0, 5.0)

    def cost(a: Floats, b: Floats, c: Floats, first: Floats, *, rows: bool = False) -> Floats:
        def errors(angles: Floats) -> tuple[Floats, Floats]:
            _, angle, missed = four_bar(a, b, c, 0, 0, angles, 100, 1)
            return (np.degrees(angle) - first[:, None] - wanted(angles) + 180) % 360 - 180, missed

        return _of_motion(errors, crank, goal, rows=rows)

    study = four_bar_study(ranges, f'rocker.angle: "first + {formula}"', goal, (20, 110, 5), u="0", v="0")
    return Problem(study, goal, ranges, cost, partial(cost, rows=True))


def timed_path(
    number: int, shape: Callable[[Floats], Complexes], ranges: Mapping[str, tuple[float, float]], *,
    more: Mapping[str, float] | None = None,
) -> Problem:  # fmt: skip
    """A coupler point that passes points of a closed curve, one every so many degrees of the crank."""
    crank = np.arange(number) * 360 / number
    points = shape(np.radians(crank))
    goal = "kinematics.targets.C.rms"
    held = dict(more or {})

    def cost(*columns: Floats) -> Floats:
        at = dict(zip(ranges, columns, strict=True)) | held
        point, _, missed = four_bar(at["a"], at["b"], at["c"], at["u"], at["v"], crank, 100, 1)
        shift = np.reshape(at["x0"], (-1, 1)) + 1j * np.reshape(at["y0"], (-1, 1))
        return _judged(_rms(np.abs(point + shift - points)), missed)

    text = ", ".join(f"[{p.real!r}, {p.imag!r}]" for p in points.tolist())
    study = four_bar_study(ranges, f"C: [{text}]", goal, (0, 360 - 360 / number, 360 / number), more=held)
    study = study.replace("O: [0, 0], D: [100, 0]", "O: [x0, y0], D: [x0 + 100, y0]")
    return Problem(study, goal, ranges, cost)


def tray(conditioning: float | None) -> Problem:
    """The shortest links of a symmetric five-bar that serves a tray 180 x 90, the middle of which is at (0, y0)."""
    ranges = {"l1": (60, 140), "l2": (80, 220), "y0": (60, 260)}
    x, y = (part.ravel() for part in np.meshgrid(np.arange(-90, 91, 15), np.arange(-45, 46, 15), indexing="ij"))

    def cost(l1: Floats, l2: Floats, y0: Floats) -> Floats:
        l1, l2, y0 = (value[:, None] for value in (l1, l2, y0))
        tip = x + 1j * (y + y0)
        left, missed_left = third(-59, tip, l1, l2, 1)
        right, missed_right = third(59, tip, l1, l2, -1)
        one, two = tip - left, tip - right
        sine = np.abs((np.conj(one) * two).imag) / l2**2
        missed = missed_left.sum(axis=1) + missed_right.sum(axis=1)
        short = 0.0 if conditioning is None else np.maximum(conditioning - sine.min(axis=1), 0.0)
        total = (l1 + l2)[:, 0]
        return np.where(missed > 0, OPEN * (2 + missed), np.where(short > 0, OPEN * (1 + short), total))

    poses = "\n".join(f"    - {{C.x: {a}, C.y: y0 + {b}}}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    study = f"""\
units: {{length: mm, angle: deg}}
mechanism:
  parameters: {{l1: 120, l2: 180, y0: 160}}
  links:
    ground: {{B1: [-59, 0], B2: [59, 0], S: [l1 + l2, 0]}}
    left: [B1, D1, l1]
    right: [B2, D2, l1]
    upper_left: [D1, C, l2]
    upper_right: [D2, C, l2]
  drives: {{q1: {{angle: left}}, q2: {{angle: right}}}}
  sketch: {{D1: [-150, 80], D2: [150, 80], C: [0, 160]}}
kinematics:
  outputs: [C, S.x]
  poses:
{poses}
optimize:
  method: search
  variables: {{l1: {{from: 60, to: 140}}, l2: {{from: 80, to: 220}}, y0: {{from: 60, to: 260}}}}
  minimize: [kinematics.S.x]
"""
    if conditioning is not None:
        study += f"  subject_to: [{{result: kinematics.conditioning, at_least: {conditioning}}}]\n"
    return Problem(study, "kinematics.S.x", ranges, cost)


LINKS = {"a": (10, 60), "b": (60, 200), "c": (60, 200)}
BESIDE = {**LINKS, "u": (-100, 200), "v": (-100, 200)}

GENERATOR = {**LINKS, "first": (0, 180)}
RMS, WORST = "kinematics.targets.rocker.angle.rms", "kinematics.rocker.angle_error"
POINT = {"u": (-100, 200), "v": (-100, 200)}
GIVEN = {"a": 30, "b": 110, "c": 90, "x0": 0, "y0": 0}


def square(x: Floats) -> Floats:
    return (x - 20) ** 2 / 150


def sine(x: Floats) -> Floats:
    return np.asarray(40 * np.sin(np.radians(x - 20)))


def ellipse(t: Floats) -> Complexes:
    return 60 * np.cos(t + 0.4) + 25j * np.sin(t + 0.4) + 40 + 60j


def small_ellipse(t: Floats) -> Complexes:
    return 30 * np.cos(t) + 20j * np.sin(t) + 40 + 60j


def eight(t: Floats) -> Complexes:
    return 40 * np.cos(t) + 20j * np.sin(2 * t) + 50 + 60j


PROBLEMS: Mapping[str, Callable[[], Problem]] = {
    "tray": lambda: tray(None),
    "tray with conditioning": lambda: tray(0.25),
    "height, rms": lambda: held_height("kinematics.targets.C.y.rms", 40, 140, 5),
    "height, worst": lambda: held_height("kinematics.C.y_error", 40, 140, 5),
    "height over half a turn": lambda: held_height("kinematics.targets.C.y.rms", 0, 180, 10),
    "square, rms": lambda: function_generator(GENERATOR, "(crank - 20)**2/150", square, RMS),
    "sine, worst": lambda: function_generator(GENERATOR, "40*sin(crank - 20)", sine, WORST),
    "ellipse, links given": lambda: timed_path(12, small_ellipse, POINT, more=GIVEN),
    "figure of eight": lambda: timed_path(18, eight, {**BESIDE, "y0": (-60, 60)}, more={"x0": 0}),
    "ellipse": lambda: timed_path(12, ellipse, {**BESIDE, "x0": (-100, 100), "y0": (-100, 100)}),
}
