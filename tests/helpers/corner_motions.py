"""Random motions whose loads, measures and couplings have corners: as studies, and as closed forms of their columns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from helpers.corners import Course, Found, Jet, scanned, turned, value_of
from helpers.machines import DEGREE, MACHINES, Arm, Drive, Elbows, FourBar, SliderCrank, Way, number

Names = Mapping[str, Any]


class Pieces:
    """Random expressions with corners, of names whose values along the motion are known."""

    def __init__(self, rng: np.random.Generator, ranges: Mapping[str, tuple[float, float]]) -> None:
        self.rng, self.ranges, self.roots = rng, ranges, False

    def expression(self, scale: float, *, rough: bool = True) -> str:
        """One pulse or bend, two in each other, or a smooth course with one on it, about as large as `scale`.

        Without `rough` its slopes are finite everywhere.
        """
        form = self.rng.choice(["one", "product", "max", "min", "sum", "difference"])
        one, other = self.piece(rough), self.piece(rough)
        size = number(scale * self.rng.uniform(0.5, 1) * self.rng.choice([-1, 1]))
        core = {
            "one": one,
            "product": f"{one}*{self.wave()}",
            "max": f"max({one}, {other})",
            "min": f"min({one}, {self.level()})",
            "sum": f"({one} + 0.5*{other})",
            "difference": f"abs({one} - 0.4*{other})",
        }[form]
        course = f" + {number(0.2 * abs(size))}*{self.wave()}" if self.rng.random() < 0.5 else ""
        return f"{size}*{core}{course}"

    def level(self) -> str:
        return f"{number(self.rng.uniform(0.3, 0.9))}"

    def centre(self) -> tuple[str, float, float]:
        """A name, a place in its range, and a part of this range from 1/2 down to a thousandth."""
        name = str(self.rng.choice([*self.ranges]))
        low, high = self.ranges[name]
        part = float(np.exp(self.rng.uniform(np.log(1e-3), np.log(0.5))))
        return name, number(low + self.rng.uniform(0.15, 0.85) * (high - low)), number((high - low) * part)

    def wave(self) -> str:
        """A smooth course about 1."""
        name = str(self.rng.choice([*self.ranges]))
        low, high = self.ranges[name]
        return f"(1 + 0.5*sin({number(self.rng.uniform(60, 700) / (high - low))}*{name}))"

    def piece(self, rough: bool) -> str:
        """A pulse, or what bends; with `rough` it may be a pulse that begins and ends as a root."""
        kinds = ["tent", "block", "half wave", "bend", "clip", "gate", *["dome"] * rough]
        kind = str(self.rng.choice(kinds))
        name, c, w = self.centre()
        if kind == "tent":
            return f"max(0, 1 - abs({name} - {c})/{number(w / 2)})"
        if kind == "block":
            ramp = number(w * self.rng.uniform(0.05, 0.4))
            return f"max(0, min(1, ({name} - {c})/{ramp}, ({number(c + w)} - {name})/{ramp}))"
        if kind == "half wave":
            return f"max(0, sin({number(180 / w)}*max(0, min({w}, {name} - {c}))))"
        if kind == "bend":
            low, high = self.ranges[name]
            return f"abs({name} - {c})*{number(1 / (high - low))}"
        if kind == "clip":
            low, high = self.ranges[name]
            return f"max({self.level()}, abs(sin({number(self.rng.uniform(150, 900) / (high - low))}*({name} - {c}))))"
        if kind == "gate":
            other, _, _ = self.centre()
            low, high = self.ranges[other]
            steep = number(self.rng.uniform(3, 60) / (high - low))
            tent = f"max(0, 1 - abs({name} - {c})/{number(w / 2)})"
            return f"{tent}*max(0, min(1, {steep}*({other} - {number((low + high) / 2)})))"
        self.roots = True
        return f"sqrt(max(0, 1 - (({name} - {c})/{number(w / 2)})**2))"


@dataclass
class Case:
    """A study, and what its columns come to."""

    text: str
    course: Course
    low: float
    high: float
    command: str = "kinematics"
    breaks: tuple[float, ...] = ()
    place: Callable[[float], float] = field(default=lambda at: at)
    # Columns that are infinite at the end of a root.
    loose: set[str] = field(default_factory=set)

    def scanned(self, poses: int) -> dict[str, Found]:
        return scanned(self.course, self.low, self.high, poses, self.breaks)


class Forces:
    """Loads of random size at a point and on a link, as a study has them and along a motion."""

    def __init__(self, pieces: Pieces, point: str, link: str) -> None:
        self.point, self.link = point, link
        self.fx, self.fy = pieces.expression(50), pieces.expression(50)
        self.moment = pieces.expression(2000) if link else "0"
        turn = f", {{link: {link}, moment: '{self.moment}'}}" if link else ""
        self.text = f"  loads: [{{at: {point}, force: ['{self.fx}', '{self.fy}']}}{turn}]\n"

    def at(self, names: Names, shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Force and moment; velocities in them are those of the jets, which are over time."""
        values = {name: Jet(one.value) for name, one in names.items()}
        values |= {f"{name}_velocity": Jet(np.broadcast_to(one.first, shape)) for name, one in names.items()}
        fx, fy, moment = (value_of(text, values).value for text in (self.fx, self.fy, self.moment))
        return np.broadcast_to(fx + 1j * fy, shape), np.broadcast_to(moment, shape)


class Turning:
    """A machine whose crank is driven along a motion, and coordinates by their names in a study."""

    def __init__(self, rng: np.random.Generator, kinds: tuple[type, ...], *, timed: bool, whole: bool = False) -> None:
        self.machine = kinds[int(rng.integers(len(kinds)))](rng)
        self.drawn = float(rng.integers(-170, 170))
        self.drive = Drive(rng, self.drawn, timed=timed, whole=whole)
        self.start = self.machine.geometry(Jet(np.array([self.drawn * DEGREE]), np.ones(1), np.zeros(1)))
        self.turns = dict.fromkeys(self.machine.angles, 0.0)
        # Angles in loads and measures are within half a turn in the first pose, those in couplings as drawn.
        self.drawn_turns = {
            name: -360.0 * np.round(float(self.start[name.removesuffix(".angle")].value[0]) / DEGREE / 360)
            for name in self.machine.angles
        }
        here = self.by_angle(self.radians(np.array([self.drive.first])))[1]
        self.turns = {name: -360.0 * np.round(float(here[name].value[0]) / 360) for name in self.machine.angles}
        self.timed = timed
        self.span()

    def span(self) -> None:
        """Ranges of coordinates along the motion, and with the time and velocities."""
        at = np.linspace(self.drive.low, self.drive.high, 2001)
        jets = {name: one.along(self.radians(at)) for name, one in self.by_angle(self.radians(at))[1].items()}
        spans = {name: np.broadcast_to(one.value, at.shape) for name, one in jets.items()}
        self.positions = ranges_of(spans)
        self.drawn_positions = ranges_of({name: one.value for name, one in self.as_drawn(jets).items()})
        if self.timed:
            spans["time"] = at
        spans |= {f"{name}_velocity": np.broadcast_to(one.first, at.shape) for name, one in jets.items()}
        self.ranges = ranges_of(spans)
        # Names of angles within half a turn, and of all other coordinates.
        for ranges in (self.positions, self.ranges):
            for name in [name for name, ends in ranges.items() if ".angle" in name and max(map(abs, ends)) > 180]:
                del ranges[name]

    def follow(self, law: str) -> None:
        """Count the angles that the law of a coupling names as drawn, wherever they stand."""
        self.turns |= {name: turn for name, turn in self.drawn_turns.items() if name in law}
        self.span()

    def radians(self, at: np.ndarray) -> Jet:
        return self.drive.at(at) * DEGREE

    def by_angle(self, theta: Jet) -> tuple[dict[str, Jet], dict[str, Jet]]:
        """Places and coordinates by the crank's angle in radians, whatever it does in time."""
        theta = Jet(theta.value, np.ones_like(theta.value), np.zeros_like(theta.value))
        places = self.machine.geometry(theta)
        names = {"crank": theta * (1 / DEGREE)}
        for name in self.machine.angles:
            names[name] = places[name.removesuffix(".angle")] * (1 / DEGREE) + self.turns[name]
        for name in self.machine.lengths:
            point, _, axis = name.partition(".")
            names[name] = places[name] if name in places else getattr(places[point], {"x": "real", "y": "imag"}[axis])
        return places, names

    def as_drawn(self, names: Mapping[str, Jet]) -> dict[str, Jet]:
        """The same coordinates with their angles as couplings have them."""
        more = {name: self.drawn_turns[name] - self.turns[name] for name in self.machine.angles}
        return {name: one + more.get(name, 0.0) for name, one in names.items()}

    def sketch(self, **more: complex) -> str:
        """The points of the links by their places in the pose drawn."""
        told = [name for name in self.machine.points if f"points: {{{name}" not in self.machine.links]
        places = {name: complex(self.start[name].value[0]) for name in told} | more
        return ", ".join(f"{name}: [{z.real:.6f}, {z.imag:.6f}]" for name, z in places.items())


def ranges_of(spans: Mapping[str, np.ndarray]) -> dict[str, tuple[float, float]]:
    return {name: (float(v.min()), float(v.max())) for name, v in spans.items() if np.ptp(v) > 1e-6 * np.abs(v).max()}


def kinematic(seed: int) -> Case:
    """A machine with one crank, loads and measures with corners, and perhaps what follows by such a coupling."""
    rng = np.random.default_rng([seed, 41])
    timed, coupled = bool(rng.random() < 0.5), bool(rng.random() < 0.4)
    turning = Turning(rng, MACHINES, timed=timed)
    machine, drive = turning.machine, turning.drive
    rough = bool(rng.random() < 0.3)
    links, joints, couplings, follower, law = machine.links, machine.joints, "", "", ""
    if coupled:
        follower = str(rng.choice(["wheel", "valve"]))
        law = Pieces(rng, turning.drawn_positions).expression(40, rough=False)
        turning.follow(law)
        couplings = f"  couplings: {{law: {{set: {follower}, to: '{law}'}}}}\n"
        if follower == "wheel":
            links += "    wheel: [Q, W, 50]\n"
        else:
            links += "    stem: {F: [0, 0]}\n"
            joints += "    valve: {prismatic: [ground, stem], through: Q, direction: 90, point: F}\n"
    pieces, still = Pieces(rng, turning.ranges), Pieces(rng, turning.positions)
    measure = still.expression(10, rough=rough)

    def led(names: Names) -> tuple[dict[str, Jet], dict[str, Jet]]:
        """Places and coordinates of what follows."""
        if not coupled:
            return {}, {}
        value = value_of(law, turning.as_drawn(names))
        if follower == "wheel":
            w = turned(value * DEGREE) * 50 + 300
            return {"W": w, "wheel": value * DEGREE}, {"wheel.angle": value, "W.x": w.real}
        return {"F": value * 1j + 300}, {"valve.slide": value}

    here = turning.by_angle(Jet(np.array([turning.drawn * DEGREE])))[1]
    more = {name: complex(np.ravel(one.value)[0]) for name, one in led(here)[0].items() if name != "wheel"}
    point = str(rng.choice([*machine.points[1:], *more]))
    link = str(rng.choice(["crank", *(name.removesuffix(".angle") for name in machine.angles if name != "leg.angle")]))
    forces = Forces(pieces, point, link if rng.random() < 0.5 else "")
    outputs = ["m", *machine.lengths[:1], *led(here)[1]]
    text = (
        f"mechanism:\n  links:\n{links}" + (f"  joints:\n{joints}" if joints else "") + "  drives: [crank]\n"
        f"{couplings}  measures: {{m: '{measure}'}}\n  sketch: {{{turning.sketch(**more)}}}\n"
        f"kinematics:\n{drive.text}{forces.text}  outputs: [{', '.join(outputs)}]\n"
    )

    def course(at: np.ndarray) -> dict[str, np.ndarray]:
        theta = turning.radians(at)
        places, names = turning.by_angle(theta)
        followed = led(names)
        places, all_names = {**places, **followed[0]}, {**names, **followed[1]}
        in_time = {name: one.along(theta) for name, one in names.items()} | {"time": Jet(at, 1.0)}
        force, moment = forces.at(in_time, at.shape)
        effort = -np.real(np.conj(force) * places[point].first)
        if forces.link:
            effort = effort - moment * (1.0 if forces.link == "crank" else places[forces.link].first)
        found = {"crank_effort": effort}
        if timed:
            all_names["crank"] = names["crank"]
        all_names["m"] = value_of(measure, names)
        for name in [*outputs, *["crank"] * timed]:
            one = all_names[name].along(theta)
            found |= {f"{name}_velocity": one.first, f"{name}_acceleration": one.second}
            if name != "crank":
                found[name] = one.value
        return found

    loose = {f"m_{word}" for word in ("velocity", "acceleration")} if still.roots else set[str]()
    return Case(text, course, drive.low, drive.high, breaks=drive.breaks, loose=loose)


def dynamic(seed: int) -> Case:
    """A slider-crank or a four-bar with masses and weights, loaded by forces with corners: efforts and joint forces."""
    rng = np.random.default_rng([seed, 42])
    return _with_masses(rng, Turning(rng, (SliderCrank, FourBar), timed=bool(rng.random() < 0.4)))


def dynamic_cycle(seed: int) -> tuple[Case, float]:
    """The same through a whole turn at a constant rate, and this rate."""
    rng = np.random.default_rng([seed, 45])
    turning = Turning(rng, (SliderCrank, FourBar), timed=False, whole=True)
    # A load of the crank's angle does not return with the mechanism.
    del turning.ranges["crank"]
    return _with_masses(rng, turning), float(turning.drive.at(np.zeros(1)).first[0])


def _with_masses(rng: np.random.Generator, turning: Turning) -> Case:
    machine, drive = turning.machine, turning.drive
    pieces = Pieces(rng, turning.ranges)
    forces = Forces(pieces, "P", "rod" if rng.random() < 0.5 else "")
    gravity = -9810.0j if rng.random() < 0.5 else 0j
    masses, links = {}, machine.links
    for body in machine.bodies:
        masses[body] = number(rng.uniform(0.1, 2)), complex(*(number(x) for x in rng.uniform(-20, 40, 2))), 0.0
        mass, center, inertia = masses[body][0], masses[body][1], number(rng.uniform(50, 500))
        masses[body] = mass, center, inertia
        more = f", mass: {mass} kg, center: [{center.real}, {center.imag}], inertia: {inertia} kg*mm^2}}\n"
        old = next(line for line in links.splitlines(keepends=True) if line.startswith(f"    {body}:"))
        inside = old.split(": ", 1)[1].strip()
        if inside.startswith("["):
            one, other, length = inside[1:-1].split(", ")
            inside = f"{{from: {one}, to: {other}, length: {length}}}"
        elif inside.startswith("{B"):
            inside = f"{{points: {inside}}}"
        links = links.replace(old, f"    {body}: {inside[:-1]}{more}")
    text = (
        f"mechanism:\n  links:\n{links}" + (f"  joints:\n{machine.joints}" if machine.joints else "")
        + f"  drives: [crank]\n  sketch: {{{turning.sketch()}}}\n"
        f"dynamics:\n{drive.text}{forces.text}  gravity: [0, {gravity.imag!r} mm/s^2]\n"
    )  # fmt: skip

    def course(at: np.ndarray) -> dict[str, np.ndarray]:
        theta = turning.radians(at)
        places, names = turning.by_angle(theta)
        in_time = {name: one.along(theta) for name, one in names.items()} | {"time": Jet(at, 1.0)}
        force, moment = forces.at(in_time, at.shape)
        effort = -np.real(np.conj(force) * places["P"].first) - moment * (places["rod"].first if forces.link else 0)
        kinetic = potential = np.zeros(at.shape)
        shaking, turn = force + 0, (np.conj(places["P"].value) * force).imag + moment
        # Newtons and newton-millimetres of kg and mm.
        pulls, twists = {}, {}
        for body, (mass, center, inertia) in masses.items():
            origin, angle = machine.bodies[body]
            turns = places[angle] if angle else theta * 0
            middle = places[origin] + turned(turns) * center
            moving, spin = middle.along(theta), turns.along(theta)
            pull, twist = mass * (gravity - moving.second) / 1000, -inertia * spin.second / 1000
            effort = effort - np.real(np.conj(pull) * middle.first) - twist * turns.first
            kinetic = kinetic + (mass * np.abs(moving.first) ** 2 + inertia * spin.first**2) / 2000
            potential = potential - mass * np.real(np.conj(gravity) * middle.value) / 1000
            shaking, turn = shaking + pull, turn + (np.conj(middle.value) * pull).imag + twist
            pulls[body], twists[body] = (middle.value, pull), twist
        found = {
            "crank_effort": effort, "crank_power": effort * theta.first, "shaking.x": shaking.real,
            "shaking.y": shaking.imag, "shaking": np.abs(shaking), "shaking_moment": turn, "kinetic_energy": kinetic,
            "potential_energy": potential,
        }  # fmt: skip
        return found | joint_forces(machine, places, pulls, twists, (force, moment), effort)

    return Case(text, course, drive.low, drive.high, command="dynamics", breaks=drive.breaks)


def joint_forces(
    machine: Any, places: Names, pulls: Mapping[str, Any], twists: Mapping[str, Any], load: Any, effort: np.ndarray
) -> dict[str, np.ndarray]:
    """Magnitudes of the forces in the pins, by the equilibrium of every body for itself."""
    bodies, pins = [*machine.bodies], [*machine.pins]
    unknowns = 2 * len(pins) + (2 if machine.sliding else 0)
    matrix = np.zeros((*effort.shape, 3 * len(bodies), unknowns))
    right = np.zeros((*effort.shape, 3 * len(bodies)))
    for k, pin in enumerate(pins):
        at = np.broadcast_to(places[pin].value, effort.shape)
        for body, sign in zip(machine.pins[pin], (1, -1), strict=True):
            if body:
                row = 3 * bodies.index(body)
                matrix[..., row, 2 * k] = matrix[..., row + 1, 2 * k + 1] = sign
                matrix[..., row + 2, 2 * k], matrix[..., row + 2, 2 * k + 1] = -sign * at.imag, sign * at.real
    if machine.sliding:
        row, at = 3 * bodies.index(machine.sliding), places["B"].value
        matrix[..., row + 1, -2], matrix[..., row + 2, -2] = 1, at.real
        matrix[..., row + 2, -1] = 1
    for k, body in enumerate(bodies):
        at, force = pulls[body]
        right[..., 3 * k], right[..., 3 * k + 1] = -force.real, -force.imag
        right[..., 3 * k + 2] = -(np.conj(at) * force).imag - twists[body]
    force, moment = load
    row = 3 * bodies.index("rod")
    right[..., row] -= force.real
    right[..., row + 1] -= force.imag
    right[..., row + 2] -= (np.conj(places["P"].value) * force).imag + moment
    right[..., 2] -= effort
    # The drive's moment is known by virtual work: the moments on the crank are one equation more than unknowns.
    rows = [k for k in range(3 * len(bodies)) if k != 2]
    held = np.linalg.solve(matrix[..., rows, :], right[..., rows, None])[..., 0]
    assert np.allclose((matrix[..., 2, :] * held).sum(-1), right[..., 2], rtol=1e-6, atol=1e-6 * np.abs(right).max())
    forces = {f"{pin}_force": np.hypot(held[..., 2 * k], held[..., 2 * k + 1]) for k, pin in enumerate(pins)}
    return forces | ({"guide_force": np.abs(held[..., -2])} if machine.sliding else {})


def path(seed: int) -> Case:
    """A robot whose point passes a path at a constant speed under loads with corners: drives, rates and efforts."""
    rng = np.random.default_rng([seed, 43])
    robot = (Arm, Elbows)[int(rng.integers(2))](rng)
    way = Way(rng, robot.about, robot.radius)

    def named(at: np.ndarray) -> tuple[dict[str, Jet], Jet, Jet]:
        c = way.at(at)
        drives, one, two = robot.moved(c)
        names = {name: angle * (1 / DEGREE) for name, angle in drives.items()}
        return names | {"C.x": c.real, "C.y": c.imag}, one, two

    at = np.linspace(0, way.high, 2001)
    spans = {name: one.value for name, one in named(at)[0].items()}
    positions = ranges_of(spans)
    spans |= {f"{name}_velocity": np.broadcast_to(one.first, at.shape) for name, one in named(at)[0].items()}
    loading = ranges_of(spans)
    for ranges in (positions, loading):
        for name in [name for name, ends in ranges.items() if name in ("q1", "q2") and max(map(abs, ends)) > 180]:
            del ranges[name]
    pieces, still = Pieces(rng, loading), Pieces(rng, positions)
    measure = still.expression(10, rough=False)
    forces = Forces(pieces, "C", "")
    text = (
        f"mechanism:\n  links:\n{robot.links}  drives: {robot.drives}\n  measures: {{m: '{measure}'}}\n"
        f"  sketch: {robot.sketch(robot.about)}\n"
        f"kinematics:\n  path: {{C: {way.text}}}\n  speed: {way.speed}\n{forces.text}  outputs: [C.x, m]\n"
    )

    def course(at: np.ndarray) -> dict[str, np.ndarray]:
        names, one, two = named(at)
        force, _ = forces.at(names, at.shape)
        found = {f"{name}_effort": -np.real(np.conj(force) * lead.value) for name, lead in (("q1", one), ("q2", two))}
        names = {name: names[name] for name in ("q1", "q2", "C.x")} | {"m": value_of(measure, names)}
        for name, jet_in_time in names.items():
            found |= {f"{name}_velocity": jet_in_time.first, f"{name}_acceleration": jet_in_time.second}
            if name in ("C.x", "m"):
                found[name] = jet_in_time.value
        return found

    def place(row: float) -> float:
        return float(np.interp(row, np.arange(len(way.ways)), way.ways))

    return Case(text, course, 0.0, way.high, breaks=way.breaks, place=place)


def coupled_by_table(seed: int) -> Case:
    """A valve that follows the crank of a four-bar by a table, under a load with corners at the valve and at B."""
    rng = np.random.default_rng([seed, 44])
    turning = Turning(rng, (FourBar, SliderCrank), timed=False)
    machine, drive = turning.machine, turning.drive
    closed = bool(rng.random() < 0.5)
    inner = np.unique(np.round(rng.uniform(10, 350, int(rng.integers(3, 12)))))
    # The pose drawn lies within the table.
    ends = min(drive.low, turning.drawn), max(drive.high, turning.drawn)
    lows = [0.0, 360.0] if closed else [np.floor(ends[0]) - 10, np.ceil(ends[1]) + 10]
    places = np.array([lows[0], *(inner if closed else lows[0] + inner / 360 * (lows[1] - lows[0])), lows[1]])
    places = np.array([number(x) for x in places])
    lifts = np.array([number(x) for x in rng.uniform(10, 40, len(places))])
    if closed:
        lifts[-1] = lifts[0]
    spline = CubicSpline(places, lifts, bc_type="periodic" if closed else "not-a-knot")
    table = ", ".join(f"[{a}, {b}]" for a, b in zip(places.tolist(), lifts.tolist(), strict=True))
    links = machine.links + "    stem: {F: [0, 0]}\n"
    joints = machine.joints + "    valve: {prismatic: [ground, stem], through: Q, direction: 90, point: F}\n"

    def lifted(crank: Jet) -> Jet:
        x = np.mod(crank.value, 360) if closed else crank.value
        return crank.through(spline(x), spline(x, 1), spline(x, 2))

    lift = lifted(drive.at(np.linspace(drive.low, drive.high, 2001))).value
    positions = {**turning.positions, "valve.slide": (float(lift.min()), float(lift.max()))}
    measure = Pieces(rng, positions).expression(10, rough=False)
    pieces = Pieces(rng, positions)
    forces = Forces(pieces, str(rng.choice(["F", "B"])), "")
    start = complex(300, lifted(Jet(np.array([turning.drawn]), 1.0)).value[0])
    text = (
        f"mechanism:\n  links:\n{links}  joints:\n{joints}  drives: [crank]\n"
        f"  couplings: {{law: {{set: valve, of: crank, table: [{table}]}}}}\n  measures: {{m: '{measure}'}}\n"
        f"  sketch: {{{turning.sketch(F=start)}}}\nkinematics:\n{drive.text}{forces.text}  outputs: [m, valve.slide]\n"
    )

    def course(at: np.ndarray) -> dict[str, np.ndarray]:
        theta = turning.radians(at)
        places, names = turning.by_angle(theta)
        names = {**names, "valve.slide": lifted(names["crank"])}
        places = {**places, "F": names["valve.slide"] * 1j + 300}
        force, _ = forces.at({name: one.along(theta) for name, one in names.items()}, at.shape)
        found = {"crank_effort": -np.real(np.conj(force) * places[forces.point].first)}
        for name, one in {"m": value_of(measure, names), "valve.slide": names["valve.slide"]}.items():
            moving = one.along(theta)
            found |= {name: moving.value, f"{name}_velocity": moving.first, f"{name}_acceleration": moving.second}
        return found

    knots = places[None] + 360 * np.arange(-3, 4)[:, None] if closed else places
    breaks = tuple(float(x) for x in knots.ravel() if drive.low < x < drive.high)
    return Case(text, course, drive.low, drive.high, breaks=breaks)
