"""Extremes and velocities of random mechanisms, against circles that are cut here and differences along the way."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from helpers.linkages import FourBar, cut, swept
from helpers.studies import study_of

from mechdesign.questions.kinematics.analysis import kinematics

Seeds = Callable[[int], Iterator[int]]
# Own looks at a motion (a hundredth of a degree apart or so), and beside each place where it ends.
LOOKS = 40_001
BESIDE = np.concatenate([-np.geomspace(1e-9, 1.0, 60), [0.0], np.geomspace(1e-9, 1.0, 60)])


def dense(function: Callable[[np.ndarray], dict[str, np.ndarray]], low: float, high: float) -> np.ndarray:
    """Places all along a motion, crowded where it ends: found by halving, as nothing else is known here."""
    at = np.linspace(low, high, LOOKS)
    known = np.isfinite(next(iter(function(at).values())))
    first = np.flatnonzero(known[1:] != known[:-1])
    good, bad = np.where(known[first], at[first], at[first + 1]), np.where(known[first], at[first + 1], at[first])
    for _ in range(60):
        middle = (good + bad) / 2
        inside = np.isfinite(next(iter(function(middle).values())))
        good, bad = np.where(inside, middle, good), np.where(inside, bad, middle)
    return np.unique(np.concatenate([at, np.clip((good[:, None] + BESIDE).ravel(), low, high)]))


def compare(text: str, function: Callable[[np.ndarray], dict[str, np.ndarray]], low: float, high: float) -> None:
    """Smallest and largest values of a study's first table of extremes, and of the transmission angle."""
    at = dense(function, low, high)
    # Between the two looks beside each largest or smallest one there are more.
    best = [pick(np.nan_to_num(column, nan=fill)) for column in function(at).values()
            for pick, fill in ((np.argmin, np.inf), (np.argmax, -np.inf))]  # fmt: skip
    beside = [np.linspace(at[max(k - 1, 0)], at[min(k + 1, len(at) - 1)], 201) for k in best]
    at = np.unique(np.concatenate([at, *beside]))
    wanted = function(at)
    if not np.isfinite(next(iter(wanted.values()))).any():
        return
    result = kinematics(study_of(text))
    table = result.tables["extremes"]
    for name, values in wanted.items():
        if name == "transmission":
            loops = result.tables["loops"]
            row = int(np.flatnonzero(loops["coupler"] == "rod")[0])
            found = loops["transmission_min"][row], loops["transmission_max"][row]
        else:
            row = int(np.flatnonzero(table["output"] == name)[0])
            found = table["min"][row], table["max"][row]
        # A look is at most half a hundredth of a degree from an extreme, a kink of the transmission at most that.
        # At a dead centre 1e-14 of the crank's angle is 1e-7 of a length: rounding is measured by the column's size.
        size = max(1.0, float(np.nanmax(np.abs(values))))
        assert found == pytest.approx((np.nanmin(values), np.nanmax(values)), abs=2e-2, rel=1e-5), (name, text)
        for sign, value in ((1, np.nanmin(values)), (-1, np.nanmax(values))):
            assert sign * found[0 if sign == 1 else 1] <= sign * value + 1e-6 * size, (name, text)


def check_four_bar(seed: int, six: bool) -> None:
    rng = np.random.default_rng([seed, six])
    bar = FourBar(rng, six)
    low, high, step = swept(rng, bar.drawn)
    outputs = "[P, gap, F]" if six else "[P, gap]"
    text = (
        f"{bar.text()}kinematics:\n  sweep: {{crank: {{from: {low!r}, to: {high!r}, step: {step!r}}}}}\n"
        f"  outputs: {outputs}\n"
    )
    compare(text, bar.measured, low, high)


def test_extremes_of_four_bars(seeds: Seeds) -> None:
    for seed in seeds(13):
        check_four_bar(seed, six=False)


def test_extremes_of_six_bars(seeds: Seeds) -> None:
    for seed in seeds(8):
        check_four_bar(seed, six=True)


def test_extremes_of_slider_cranks(seeds: Seeds) -> None:
    for seed in seeds(8):
        rng = np.random.default_rng(seed)
        r, l, e = rng.uniform([20, 40, -30], [80, 160, 30]).tolist()  # noqa: E741
        drawn = float(rng.uniform(0, 360))
        px, py = rng.uniform(-60, 60, 2).tolist()

        def measured(crank: np.ndarray, r=r, l=l, e=e, p=complex(px, py)) -> dict[str, np.ndarray]:  # noqa: E741
            a = r * np.exp(1j * np.radians(crank))
            square = l * l - (e - a.imag) ** 2
            square = np.where((square < 0) & (square > -1e-13 * l * l), 0.0, square)
            with np.errstate(invalid="ignore"):
                b = a.real + np.sqrt(square) + 1j * e
            at = a + p * (b - a) / l
            return {"B.x": b.real, "P.x": at.real, "P.y": at.imag}

        far = float(measured(np.array([drawn]))["B.x"][0])
        a = complex(r * np.exp(1j * np.radians(drawn)))
        if not far - a.real > 0.1 * l:
            continue
        low, high, step = swept(rng, drawn)
        text = (
            f"mechanism:\n  links:\n    ground: {{O: [0, 0], G: [0, {e!r}]}}\n    crank: [O, A, {r!r}]\n"
            f"    rod: {{from: A, to: B, length: {l!r}, points: {{P: [{px!r}, {py!r}]}}}}\n    slider: {{B: [0, 0]}}\n"
            "  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}\n  drives: [crank]\n"
            f"  sketch: {{A: [{a.real!r}, {a.imag!r}], B: [{far!r}, {e!r}]}}\n"
            f"kinematics:\n  sweep: {{crank: {{from: {low!r}, to: {high!r}, step: {step!r}}}}}\n  outputs: [B.x, P]\n"
        )
        compare(text, measured, low, high)


class Robot:
    """A five-bar: two driven cranks and two rods that meet at C."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.base = rng.uniform(30, 100)
        self.a, self.b = rng.uniform(80, 120), rng.uniform(180, 260)

    def drives(self, c: np.ndarray) -> np.ndarray:
        """Angles of the cranks (radians), elbows outward."""
        right = cut(np.full_like(c, self.base), self.a, c, self.b, -1.0) - self.base
        left = cut(np.full_like(c, -self.base), self.a, c, self.b, 1.0) + self.base
        return np.array([np.angle(right), np.angle(left)])

    def text(self) -> str:
        q = self.drives(np.array([200j]))[:, 0]
        one, two = self.base + self.a * np.exp(1j * q[0]), -self.base + self.a * np.exp(1j * q[1])
        return (
            f"mechanism:\n  links:\n    ground: {{B1: [{self.base:.9f}, 0], B2: [{-self.base:.9f}, 0]}}\n"
            f"    l1: [B1, D1, {self.a:.9f}]\n    u1: [D1, C, {self.b:.9f}]\n"
            f"    l2: [B2, D2, {self.a:.9f}]\n    u2: [D2, C, {self.b:.9f}]\n"
            "  drives: {q1: {angle: l1}, q2: {angle: l2}}\n"
            f"  sketch: {{D1: [{one.real:.9f}, {one.imag:.9f}], D2: [{two.real:.9f}, {two.imag:.9f}], C: [0, 200]}}\n"
        )


def moved(rng: np.random.Generator) -> tuple[str, Callable[[np.ndarray], np.ndarray], np.ndarray]:
    """A path in a line of YAML, its place after a length of way, and the ways of its poses."""
    x, y, r = rng.uniform(-20, 20), rng.uniform(190, 210), rng.uniform(10, 40)
    n = int(rng.integers(5, 30))
    kind = rng.choice(["circle", "arc", "line", "polyline"])
    if kind == "circle":
        begin, sign = rng.uniform(-180, 180), rng.choice([-1, 1])
        way = 2 * np.pi * r * np.arange(n) / n
        back = str(sign < 0).lower()
        text = f"circle: {{center: [{x}, {y}], radius: {r}, from: {begin}, clockwise: {back}}}, points: {n}"
        return text, lambda s: complex(x, y) + r * np.exp(1j * (np.radians(begin) + sign * s / r)), way
    if kind == "arc":
        begin, end = rng.uniform(-180, 180, 2)
        way = np.linspace(0, r * np.radians(abs(end - begin)), n)
        text = f"arc: {{center: [{x}, {y}], radius: {r}, from: {begin}, to: {end}}}, points: {n}"
        turn = np.sign(end - begin)
        return text, lambda s: complex(x, y) + r * np.exp(1j * (np.radians(begin) + turn * s / r)), way
    corners = rng.uniform([-40, 180], [40, 230], (2 if kind == "line" else 4, 2))
    z = corners[:, 0] + 1j * corners[:, 1]
    lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
    listed = ", ".join(f"[{float(a)!r}, {float(b)!r}]" for a, b in corners)
    if kind == "line":
        return (
            f"line: [{listed}], points: {n}",
            lambda s: z[0] + (z[1] - z[0]) * s / lengths[1],
            lengths[1] * np.linspace(0, 1, n),
        )

    def along(s: np.ndarray) -> np.ndarray:
        # Each segment goes straight on, also beyond its corner: the side that begins there counts.
        k = np.clip(np.searchsorted(lengths, np.median(s) + 1e-9, side="right") - 1, 0, len(z) - 2)
        return z[k] + (z[k + 1] - z[k]) * (s - lengths[k]) / (lengths[k + 1] - lengths[k])

    return f"through: [{listed}]", along, lengths


def test_velocities_along_paths(seeds: Seeds) -> None:
    for seed in seeds(13):
        rng = np.random.default_rng(seed)
        robot = Robot(rng)
        form, place, ways = moved(rng)
        speed = float(rng.uniform(5, 300))
        text = f"{robot.text()}kinematics:\n  path: {{C: {{{form}}}}}\n  speed: {speed!r} mm/s\n  outputs: [C]\n"
        table = kinematics(study_of(text)).tables["motion"]
        assert len(table["q1"]) == len(ways)
        h = 1e-4 / speed * 100
        for row, s in enumerate(ways):
            at = place(s + speed * h * np.array([-1.0, 0.0, 1.0]))
            q = robot.drives(at)
            if np.isnan(q).any() or not table["valid"][row]:
                continue
            q = np.degrees(np.unwrap(q))
            for name, (before, now, after) in {"C.x": at.real, "C.y": at.imag, "q1": q[0], "q2": q[1]}.items():
                gap = table[name][row] - now
                assert gap - 360 * round(gap / 360) == pytest.approx(0, abs=1e-6), (name, text)
                size = speed / 50 + abs(table[f"{name}_velocity"][row])
                assert table[f"{name}_velocity"][row] == pytest.approx((after - before) / (2 * h), abs=1e-4 * size)
                bend = (after - 2 * now + before) / h**2
                size = speed**2 / 50 + abs(table[f"{name}_acceleration"][row])
                assert table[f"{name}_acceleration"][row] == pytest.approx(bend, abs=2e-3 * size), (name, text)
