"""Machines and robots in closed form, and how they are driven: values and derivatives, without the package."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from helpers.corners import Jet, arccosine, direction, sine, size, turned

DEGREE = np.pi / 180


def number(value: float) -> float:
    """A number as a study has it, to six digits."""
    return float(f"{value:.6g}")


class SliderCrank:
    """A crank, a rod with a point P, and a slider B on a line with an offset."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.r, self.l = number(rng.uniform(20, 60)), number(rng.uniform(90, 180))
        self.e = number(rng.uniform(-25, 25))
        self.p = complex(number(rng.uniform(-40, 100)), number(rng.uniform(-50, 50)))
        self.links = (
            f"    ground: {{O: [0, 0], G: [0, {self.e}], Q: [300, 0]}}\n    crank: [O, A, {self.r}]\n"
            f"    rod: {{from: A, to: B, length: {self.l}, points: {{P: [{self.p.real}, {self.p.imag}]}}}}\n"
            "    slider: {B: [0, 0]}\n"
        )
        self.joints = "    guide: {prismatic: [ground, slider], through: G, point: B}\n"
        self.points, self.angles, self.lengths = ("A", "B", "P"), ("rod.angle",), ("B.x", "P.x", "P.y")
        self.bodies = {"crank": ("O", "crank"), "rod": ("A", "rod"), "slider": ("B", "")}
        self.pins = {"O": ("crank", ""), "A": ("rod", "crank"), "B": ("rod", "slider")}
        self.sliding = "slider"

    def geometry(self, theta: Jet) -> dict[str, Jet]:
        a = turned(theta) * self.r
        swing = (a.imag - self.e) * (1 / self.l)
        phi = -_arcsine(swing)
        b = a + turned(phi) * self.l
        return {"O": a * 0, "A": a, "B": b, "P": a + turned(phi) * self.p, "rod": phi, "crank": theta}


class FourBar:
    """A crank that turns fully, a rod with a point P, and a rocker."""

    def __init__(self, rng: np.random.Generator) -> None:
        while True:
            self.d = 100.0
            self.a, self.b, self.c = (number(x) for x in rng.uniform([15, 60, 60], [40, 130, 130]))
            shortest, *middle, longest = sorted([self.a, self.b, self.c, self.d])
            if shortest == self.a and sum(middle) - shortest - longest > 8:
                break
        self.side = int(rng.choice([-1, 1]))
        self.p = complex(number(rng.uniform(-60, 80)), number(rng.uniform(-60, 60)))
        self.links = (
            f"    ground: {{O: [0, 0], D: [100, 0], Q: [300, 0]}}\n    crank: [O, A, {self.a}]\n"
            f"    rod: {{from: A, to: B, length: {self.b}, points: {{P: [{self.p.real}, {self.p.imag}]}}}}\n"
            f"    rocker: [D, B, {self.c}]\n"
        )
        self.joints = ""
        self.points, self.angles = ("A", "B", "P"), ("rod.angle", "rocker.angle")
        self.lengths = ("B.x", "B.y", "P.x", "P.y")
        self.bodies = {"crank": ("O", "crank"), "rod": ("A", "rod"), "rocker": ("D", "rocker")}
        self.pins = {"O": ("crank", ""), "A": ("rod", "crank"), "B": ("rod", "rocker"), "D": ("rocker", "")}
        self.sliding = ""

    def geometry(self, theta: Jet) -> dict[str, Jet]:
        a = turned(theta) * self.a
        span = self.d - a  # always to the right
        d = size(span)
        at_a = arccosine((d * d + (self.b**2 - self.c**2)) / (d * (2 * self.b)))
        at_d = arccosine((d * d + (self.c**2 - self.b**2)) / (d * (2 * self.c)))
        along = direction(span)
        rod, rocker = along + at_a * self.side, along + np.pi - at_d * self.side
        return {
            "O": a * 0, "A": a, "B": a + turned(rod) * self.b, "P": a + turned(rod) * self.p, "rod": rod,
            "rocker": rocker, "D": a * 0 + self.d, "crank": theta,
        }  # fmt: skip


class Whitworth:
    """A crank whose pin runs in the slot of an arm, which turns about a pivot within the crank's circle."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.r, self.c = number(rng.uniform(50, 100)), number(rng.uniform(10, 35))
        self.e = number(rng.uniform(30, 120))
        self.links = (
            f"    ground: {{O: [0, 0], D: [{self.c}, 0], Q: [300, 0]}}\n    crank: [O, A, {self.r}]\n"
            f"    arm: [D, P, {self.e}]\n"
        )
        self.joints = "    slot: {slot: arm, through: D, point: A}\n"
        self.points, self.angles, self.lengths = ("A", "P"), ("arm.angle",), ("P.x", "P.y", "slot.slide")

    def geometry(self, theta: Jet) -> dict[str, Jet]:
        a = turned(theta) * self.r
        arm = theta + direction(1 - turned(-theta) * (self.c / self.r))
        return {"A": a, "P": turned(arm) * self.e + self.c, "arm": arm, "slot.slide": size(a - self.c)}


class Cylinder:
    """A crank that swings an oscillating cylinder, which is a leg between two pins."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.r = number(rng.uniform(20, 60))
        self.d = number(rng.uniform(100, 160))
        self.p = complex(number(rng.uniform(-60, 60)), number(rng.uniform(-60, 60)))
        self.links = (
            f"    ground: {{O: [0, 0], D: [{self.d}, 0], Q: [300, 0]}}\n"
            f"    crank: {{from: O, to: A, length: {self.r}, points: {{P: [{self.p.real}, {self.p.imag}]}}}}\n"
            "    leg: {from: D, to: A, telescopic: true}\n"
        )
        self.joints = ""
        self.points, self.angles, self.lengths = ("A", "P"), ("leg.angle",), ("leg.length", "P.x")

    def geometry(self, theta: Jet) -> dict[str, Jet]:
        e = turned(theta)
        a = e * self.r
        span = self.d - a
        return {"A": a, "P": e * self.p, "leg": direction(span) + np.pi, "leg.length": size(span)}


def _arcsine(x: Jet) -> Jet:
    return np.pi / 2 - arccosine(x)


MACHINES = (SliderCrank, FourBar, Whitworth, Cylinder)


LAWS: dict[str, Callable[[Jet], Jet]] = {
    "cycloidal": lambda u: u - sine(u * 360) * (1 / (2 * np.pi)),
    "polynomial345": lambda u: u**3 * 10 - u**4 * 15 + u**5 * 6,
    "polynomial4567": lambda u: u**4 * 35 - u**5 * 84 + u**6 * 70 - u**7 * 20,
    "harmonic": lambda u: 0.5 - sine(u * 180 + 90) * 0.5,
    "constant": lambda u: u,
}


class Program:
    """A drive over time: moves by laws and dwells, without jumps of velocity."""

    def __init__(self, rng: np.random.Generator, start: float) -> None:
        names = ["cycloidal", "polynomial345", "polynomial4567", "harmonic"]
        self.moves: list[tuple[float, float, float, float, str]] = []
        at, time, lines = number(start), 0.0, []
        for k in range(int(rng.integers(1, 4))):
            span = number(rng.uniform(0.1, 0.8))
            if k and rng.random() < 0.4:
                lines.append(f"{{dwell: {span}}}")
                self.moves.append((time, span, at, at, "constant"))
            else:
                law, to = str(rng.choice(names)), number(at + rng.choice([-1, 1]) * rng.uniform(40, 300))
                first = f"from: {at}, " if not k else ""
                lines.append(f"{{{first}to: {to}, time: {span}, law: {law}}}")
                self.moves.append((time, span, at, to, law))
                at = to
            time += span
        self.end = time
        self.text = f"[{', '.join(lines)}]"
        self.breaks = tuple(begin for begin, *_ in self.moves[1:])

    def at(self, time: np.ndarray) -> Jet:
        """The drive (degrees)."""
        found = [np.zeros(time.shape) for _ in range(3)]
        which = np.searchsorted(self.breaks, time, side="right")
        for k, (begin, span, low, high, law) in enumerate(self.moves):
            here = which == k
            u = Jet((time[here] - begin) / span, 1 / span)
            value = LAWS[law](u) * (high - low) + low
            for part, of in zip(found, (value.value, value.first, value.second), strict=True):
                part[here] = of
        return Jet(*found)


class Drive:
    """The crank along a motion: even steps at a constant rate, or laws over time."""

    def __init__(self, rng: np.random.Generator, drawn: float, *, timed: bool, whole: bool = False) -> None:
        if timed:
            program = Program(rng, drawn + float(rng.uniform(-60, 60)))
            self.low, self.high, self.breaks, self.first = 0.0, program.end, program.breaks, 0.0
            self.text = f"  motion: {{crank: {program.text}}}\n  instants: {rng.integers(13, 182)}\n"
            self.at = program.at
            return
        step = float(rng.choice([1, 2, 5, 7.5, 10, 15, 30]))
        # Not from 0, where the angle of a cylinder is half a turn, one way or the other.
        low = number(drawn + rng.uniform(-40, 40)) if rng.random() < 0.5 else 0.25
        count = round((360.0 if whole or rng.random() < 0.6 else rng.uniform(3 * step, 360)) / step)
        rate = number(rng.uniform(20, 400) * rng.choice([-1, 1, 1]))
        self.low, self.high, self.breaks = low, low + step * count, ()
        ends = f"from: {low!r}, to: {self.high!r}, step: {step!r}"
        self.first = low
        if not whole and rng.random() < 0.2:
            ends = f"from: {self.high!r}, to: {low!r}, step: {-step!r}"
            self.first = self.high
        self.text = f"  sweep: {{crank: {{{ends}}}}}\n  rates: {{crank: {rate}}}\n"
        self.at = lambda at: Jet(at, np.full(at.shape, rate), np.zeros(at.shape))


class Way:
    """A line, a polyline or a circle that a point passes at a constant speed, by the length of the way."""

    def __init__(self, rng: np.random.Generator, about: complex, radius: float) -> None:
        self.speed = number(rng.uniform(20, 300))
        kind = str(rng.choice(["line", "through", "circle"]))
        if kind == "circle":
            center = about + radius * 0.4 * complex(*rng.uniform(-1, 1, 2))
            self.center, self.radius = complex(number(center.real), number(center.imag)), number(0.6 * radius)
            count = int(rng.integers(8, 73))
            self.high, self.breaks = 2 * np.pi * self.radius, ()
            self.ways = self.high * np.arange(count + 1) / count
            shape = f"{{center: [{self.center.real}, {self.center.imag}], radius: {self.radius}}}"
            self.text = f"{{circle: {shape}, points: {count}}}"
            return
        self.radius = 0.0
        corners = [about + radius * complex(*rng.uniform(-0.7, 0.7, 2)) for _ in range(2 if kind == "line" else 4)]
        self.corners = np.array([complex(number(z.real), number(z.imag)) for z in corners])
        self.ends = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.corners)))])
        self.high, self.breaks = float(self.ends[-1]), tuple(self.ends[1:-1].tolist())
        listed = ", ".join(f"[{z.real}, {z.imag}]" for z in self.corners.tolist())
        count = int(rng.integers(3, 40))
        self.ways = self.ends if kind == "through" else np.linspace(0, self.high, count)
        self.text = f"{{through: [{listed}]}}" if kind == "through" else f"{{line: [{listed}], points: {count}}}"

    def at(self, way: np.ndarray) -> Jet:
        """The point over time."""
        v = self.speed
        if self.radius:
            turning = Jet(way / self.radius, np.full(way.shape, v / self.radius), np.zeros(way.shape))
            return turned(turning) * self.radius + self.center
        k = np.searchsorted(self.breaks, way, side="right")
        ahead = np.diff(self.corners)[k] / np.diff(self.ends)[k]
        return Jet(self.corners[k] + ahead * (way - self.ends[k]), ahead * v, np.zeros(way.shape, dtype=complex))


class Arm:
    """Two links one after the other; the second is driven against the first."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.a, self.b = number(rng.uniform(100, 160)), number(rng.uniform(100, 160))
        self.about = complex(number(rng.uniform(-30, 30)), number(0.75 * (self.a + self.b)))
        self.radius = 0.15 * (self.a + self.b)
        self.side = int(rng.choice([-1, 1]))
        self.links = f"    ground: {{O: [0, 0]}}\n    one: [O, A, {self.a}]\n    two: [A, C, {self.b}]\n"
        self.drives = "{q1: {angle: one}, q2: {angle: two, from: one}}"

    def moved(self, c: Jet) -> tuple[dict[str, Jet], Jet, Jet]:
        """Coordinates (radians), and what C moves by for each radian of the drives."""
        elbow = (c * c.conj).real
        q2 = arccosine((elbow - (self.a**2 + self.b**2)) * (1 / (2 * self.a * self.b))) * self.side
        # Above the axis the angle of C has no jump.
        q1 = direction(c) - direction(turned(q2) * self.b + self.a)
        return {"q1": q1, "q2": q2}, c * 1j, (c - turned(q1) * self.a) * 1j

    def sketch(self, c: complex) -> str:
        q1 = self.moved(Jet(np.array([c])))[0]["q1"].value[0]
        a = self.a * np.exp(1j * q1)
        return f"{{A: [{a.real:.6f}, {a.imag:.6f}], C: [{c.real:.6f}, {c.imag:.6f}]}}"


class Elbows:
    """A five-bar: two driven cranks on the ground and two rods that meet in C, elbows outward."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.base = number(rng.uniform(30, 80))
        self.a, self.b = number(rng.uniform(80, 120)), number(rng.uniform(160, 230))
        self.about, self.radius = complex(0, number(0.66 * (self.a + self.b))), 0.1 * (self.a + self.b)
        self.links = (
            f"    ground: {{O: [{-self.base}, 0], D: [{self.base}, 0]}}\n    one: [O, A, {self.a}]\n"
            f"    left: [A, C, {self.b}]\n    two: [D, B, {self.a}]\n    right: [B, C, {self.b}]\n"
        )
        self.drives = "{q1: {angle: one}, q2: {angle: two}}"

    def moved(self, c: Jet) -> tuple[dict[str, Jet], Jet, Jet]:
        angles, rods, arms = [], [], []
        for side, base in ((1, -self.base), (-1, self.base)):
            span = c - base
            d = size(span)
            angle = direction(span) + arccosine((d * d + (self.a**2 - self.b**2)) / (d * (2 * self.a))) * side
            angles.append(angle)
            arms.append(turned(angle) * self.a)
            rods.append(span - arms[-1])
        # C moves across a rod that rests; along the other one its pin leads: (C - A) . C' = (C - A) . i a q'.
        led = [(rod.conj * arm * 1j).real for rod, arm in zip(rods, arms, strict=True)]
        across = (rods[0].conj * rods[1]).imag
        return (
            {"q1": angles[0], "q2": angles[1]},
            rods[1] * (led[0] / across) * -1j,
            rods[0] * (led[1] / across) * 1j,
        )

    def sketch(self, c: complex) -> str:
        found = self.moved(Jet(np.array([c])))[0]
        a = -self.base + self.a * np.exp(1j * found["q1"].value[0])
        b = self.base + self.a * np.exp(1j * found["q2"].value[0])
        places = {"A": a, "B": b, "C": c}
        return "{" + ", ".join(f"{name}: [{z.real:.6f}, {z.imag:.6f}]" for name, z in places.items()) + "}"
