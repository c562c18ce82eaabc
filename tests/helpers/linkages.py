"""Linkages by circles that are cut here, and the studies that describe them; nothing of the package is used."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline


def cut(one: Any, r: float, other: Any, s: float, side: float) -> np.ndarray:
    """Where circles about two places meet, left (`side` 1) or right of the way from one to the other; nan if not."""
    span = np.asarray(other - one)
    d = np.abs(span)
    x = (d * d + r * r - s * s) / (2 * d)
    square = r * r - x * x
    square = np.where((square < 0) & (square > -1e-13 * r * r), 0.0, square)
    with np.errstate(invalid="ignore"):
        return one + span / d * (x + side * 1j * np.sqrt(square))


def unwrapped(angle: np.ndarray) -> np.ndarray:
    """Angles (degrees) without jumps from pose to pose; nan stays."""
    found, known = angle.copy(), np.isfinite(angle)
    found[known] = np.unwrap(angle[known], period=360.0)
    return found


class FourBar:
    """A crank, a rod with a point P, and a rocker; P may carry a dyad to a second pivot."""

    def __init__(self, rng: np.random.Generator, six: bool) -> None:
        self.six = six
        while True:
            self.a, self.b, self.c = rng.uniform(20, 120, 3).tolist()
            self.d = 100.0
            self.p = complex(*rng.uniform(-80, 80, 2))
            self.side = rng.choice([-1.0, 1.0])
            self.e, self.f, self.g = complex(*rng.uniform(-150, 150, 2)), *rng.uniform(60, 250, 2).tolist()
            self.side2 = rng.choice([-1.0, 1.0])
            self.drawn = float(rng.uniform(0, 360))
            shortest, *middle, longest = sorted([self.a, self.b, self.c, self.d])
            if abs(sum(middle) - shortest - longest) < 0.5:
                continue
            near = {k: complex(v[0]) for k, v in self.points(np.array([self.drawn])).items()}
            # Not drawn near a dead centre, of which the side would not be clear.
            angles = [near["B"] - near["A"], near["B"] - 100.0]
            sine = abs(np.sin(np.angle(angles[0] / angles[1])))
            if np.isnan(sine) or sine < 0.1:
                continue
            if six:
                two = [near["F"] - near["P"], near["F"] - self.e]
                sine = abs(np.sin(np.angle(two[0] / two[1])))
                if np.isnan(sine) or sine < 0.1:
                    continue
            self.near = near
            return

    def points(self, crank: np.ndarray) -> dict[str, np.ndarray]:
        a = self.a * np.exp(1j * np.radians(crank))
        b = cut(a, self.b, np.full_like(a, self.d), self.c, self.side)
        p = a + self.p * (b - a) / self.b
        found = {"A": a, "B": b, "P": p}
        if self.six:
            found["F"] = cut(p, self.f, np.full_like(p, self.e), self.g, self.side2)
        return found

    def measured(self, crank: np.ndarray) -> dict[str, np.ndarray]:
        at = self.points(crank)
        last = at["F"] if self.six else at["P"]
        lost = np.isnan(last)
        found = {"P.x": at["P"].real, "P.y": at["P"].imag, "gap": np.abs(at["P"] - self.d)}
        if self.six:
            found |= {"F.x": at["F"].real, "F.y": at["F"].imag}
        found["P.y_error"] = at["P"].imag - (20 + 10 * np.sin(2 * np.radians(crank)))
        product = (at["B"] - at["A"]) * np.conj(at["B"] - self.d)
        sine = np.abs(product.imag) / (self.b * self.c)
        found["transmission"] = np.degrees(np.arcsin(np.minimum(sine, 1)))
        return {name: np.where(lost, np.nan, values) for name, values in found.items()}

    def text(self) -> str:
        places = {k: f"[{v.real:.6f}, {v.imag:.6f}]" for k, v in self.near.items() if k != "P"}
        more = f", E: [{self.e.real!r}, {self.e.imag!r}]" if self.six else ""
        dyad = f"    arm: [P, F, {self.f!r}]\n    lever: [E, F, {self.g!r}]\n" if self.six else ""
        return (
            "mechanism:\n  links:\n"
            f"    ground: {{O: [0, 0], D: [100, 0]{more}}}\n    crank: [O, A, {self.a!r}]\n"
            f"    rod: {{from: A, to: B, length: {self.b!r}, points: {{P: [{self.p.real!r}, {self.p.imag!r}]}}}}\n"
            f"    rocker: [D, B, {self.c!r}]\n{dyad}"
            "  drives: [crank]\n  measures: {gap: {distance: [D, P]}}\n"
            '  targets: {P.y: "20 + 10*sin(2*crank)"}\n'
            f"  sketch: {{{', '.join(f'{k}: {v}' for k, v in places.items())}}}\n"
        )


def swept(rng: np.random.Generator, drawn: float) -> tuple[float, float, float]:
    """A closed sweep, or an open one about the pose drawn, in steps of up to 30 deg."""
    step = float(rng.choice([5, 7.5, 10, 15, 20, 30]))
    if rng.random() < 0.5:
        return 0.0, 360.0, step
    count = int(rng.integers(3, 12))
    low = drawn - step * float(rng.uniform(0.2, count - 0.2))
    return low, low + step * count, step


class FiveBar:
    """Two cranks on fixed pivots and two rods that meet in C, which is led along a path; a force acts on C."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.o1, self.o2 = complex(*rng.uniform([-80, -20], [-30, 20])), complex(*rng.uniform([30, -20], [80, 20]))
        self.l1, self.l2, self.l3, self.l4 = rng.uniform(90, 150, 4).tolist()
        self.sides = rng.choice([-1.0, 1.0], 2)
        self.relative = bool(rng.random() < 0.5)
        self.force = complex(*rng.uniform(-10, 10, 2))
        while True:
            self.drawn = complex(*rng.uniform([-60, 60], [60, 200]))
            at = np.array([self.drawn])
            with np.errstate(all="ignore"):
                a, b = self.pins(at)
                turns = [(a - self.o1) / (at - a), (b - self.o2) / (at - b), (at - a) / (at - b)]
                sines = np.abs(np.sin(np.angle(turns)))
            if np.all(sines > 0.2):
                return

    def pins(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The rods' pins on the cranks."""
        return cut(self.o1, self.l1, c, self.l2, self.sides[0]), cut(self.o2, self.l3, c, self.l4, self.sides[1])

    def measured(self, c: np.ndarray) -> dict[str, np.ndarray]:
        """Columns of kinematics where C is; nan where it cannot be."""
        a, b = self.pins(c)
        lost = np.isnan(a) | np.isnan(b)
        found = {"C.x": c.real, "A.y": a.imag, "gap": np.abs(a - b)}
        q1, q2 = np.degrees(np.angle(a - self.o1)), np.degrees(np.angle(b - self.o2))
        found["q1"] = q1
        found["q2"] = q2 - q1 if self.relative else q2
        with np.errstate(all="ignore"):
            # (C - A) . C' = (C - A) . i (A - O) q', and the same on the other side.
            slope = [(c - p) / ((c - p) * np.conj(1j * (p - o))).real for p, o in ((a, self.o1), (b, self.o2))]
            j = np.array([[slope[0].real, slope[0].imag], [slope[1].real, slope[1].imag]])
            det = j[0, 0] * j[1, 1] - j[0, 1] * j[1, 0]
            fx, fy = self.force.real, self.force.imag
            # C' = J^-1 q'; the effort of a drive balances the force's work.
            t1 = -(fx * j[1, 1] - fy * j[1, 0]) / det
            t2 = -(-fx * j[0, 1] + fy * j[0, 0]) / det
        found["q1_effort"] = t1 + t2 if self.relative else t1
        found["q2_effort"] = t2
        return {name: np.where(lost, np.nan, values) for name, values in found.items()}

    def along(self, places: np.ndarray) -> dict[str, np.ndarray]:
        """The same along a path; the drives' angles go on without jumps from where they are near to the sketch's."""
        found = self.measured(places)
        for name in ("q1", "q2"):
            drawn = (self.measured(np.array([self.drawn]))[name][0] + 180) % 360 - 180
            values = unwrapped(found[name])
            known = values[np.isfinite(values)]
            found[name] = values + 360 * np.round((drawn - known[:1].sum()) / 360)
        return found

    def text(self) -> str:
        """The mechanism, its outputs and its load."""
        a, b = (complex(pin[0]) for pin in self.pins(np.array([self.drawn])))
        places = {"A": a, "B": b, "C": self.drawn}
        sketch = ", ".join(f"{name}: [{z.real:.5f}, {z.imag:.5f}]" for name, z in places.items())
        second = "{angle: r, from: l}" if self.relative else "{angle: r}"
        return (
            "mechanism:\n  links:\n"
            f"    ground: {{O1: [{self.o1.real!r}, {self.o1.imag!r}], O2: [{self.o2.real!r}, {self.o2.imag!r}]}}\n"
            f"    l: [O1, A, {self.l1!r}]\n    lr: [A, C, {self.l2!r}]\n"
            f"    r: [O2, B, {self.l3!r}]\n    rr: [B, C, {self.l4!r}]\n"
            f"  drives: {{q1: {{angle: l}}, q2: {second}}}\n"
            f"  sketch: {{{sketch}}}\n  measures: {{gap: {{distance: [A, B]}}}}\n"
            "kinematics:\n  outputs: [C.x, A.y, gap, q1, q2]\n"
            f"  loads: [{{at: C, force: [{self.force.real!r}, {self.force.imag!r}]}}]\n"
        )


class Path:
    """A path of a point: as a study has it, and as places close to each other."""

    def __init__(self, rng: np.random.Generator, about: complex) -> None:
        kind = rng.choice(["circle", "arc", "line", "through", "spline"])
        count = int(rng.integers(4, 40))
        fine = np.linspace(0, 1, 20_001)
        if kind in ("circle", "arc"):
            radius, begin = float(rng.uniform(10, 80)), float(rng.uniform(-180, 180))
            turn = 360.0 if kind == "circle" else float(rng.uniform(40, 300))
            center = about + complex(*rng.uniform(-40, 40, 2))
            self.places = center + radius * np.exp(1j * np.radians(begin + turn * fine))
            to = f", to: {begin + turn!r}" if kind == "arc" else ""
            shape = f"{kind}: {{center: [{center.real!r}, {center.imag!r}], radius: {radius!r}, from: {begin!r}{to}}}"
            self.text = f"{{{shape}, points: {count}}}"
            return
        number = 2 if kind == "line" else int(rng.integers(3, 7))
        points = about + rng.uniform(-90, 90, number) + 1j * rng.uniform(-90, 90, number)
        listed = [[float(z.real), float(z.imag)] for z in points]
        if kind == "spline":
            knots = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points)))])
            bc = "not-a-knot"
            self.places = CubicSpline(knots, points, bc_type=bc)(knots[-1] * fine)
            self.text = f"{{through: {listed}, spline: true, points: {count}}}"
            return
        self.places = np.interp(fine * (number - 1), np.arange(number), points)
        self.text = f"{{line: {listed}, points: {count}}}" if kind == "line" else str(listed)
