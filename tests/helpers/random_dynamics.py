"""Random mechanisms with random masses, springs and loads, and the same for bodies by Newton and Euler."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from random import Random
from typing import Any, NamedTuple

import numpy as np
import yaml
from hypothesis import assume
from hypothesis import strategies as st

from helpers.layouts import DUMPER, GROUND, Coordinate
from helpers.newton_euler import Bodies, Jet
from helpers.random_mechanisms import Made, mechanisms
from helpers.studies import study_of
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.results import Result
from mechdesign.mechanism import Configuration
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.dynamics.analysis import dynamics
from mechdesign.questions.poses import study_poses
from mechdesign.study import Study

# A number, or an expression of a coordinate and its velocity: how a study writes it, and what it comes to.
SIZES: dict[str, Callable[[float, Floats, Floats], Any]] = {
    "{0}": lambda a, x, v: a,
    "{0} * {1}": lambda a, x, v: a * x,
    "max(0, {0} - {1}_velocity)": lambda a, x, v: np.maximum(0, a - v),
    "{0} * abs({1}_velocity) * {1}_velocity": lambda a, x, v: a * np.abs(v) * v,
}
TIMES = (0.0, -0.05, 0.03, 0.08)  # of the poses, from the pose drawn


class Size(NamedTuple):
    """The size of a load, a force or a moment."""

    form: str
    number: float
    name: str
    coordinate: Coordinate

    @property
    def text(self) -> float | str:
        return self.number if self.form == "{0}" else self.form.format(self.number, self.name)


class Load(NamedTuple):
    """A force [fx, fy] at one end, or a pull between two; or a moment on the link `on`."""

    ends: tuple[str, ...]
    sizes: tuple[Size, ...]
    on: str = ""
    within: str = ""

    @property
    def told(self) -> dict[str, Any]:
        sizes = [size.text for size in self.sizes]
        if self.on:
            return {"link": self.on, "moment": sizes[0]}
        if len(self.ends) == 2:
            return {"between": list(self.ends), "force": sizes[0]}
        return {"at": self.ends[0], "force": sizes} | ({"in": self.within} if self.within else {})


@dataclass
class Acting:
    """What acts on the bodies at each pose: energies, powers, and the forces and moments of springs and loads.

    A force is on a rigid body, or as ``pin:P`` on a pin, at a place in the world.
    """

    kinetic: Floats
    potential: Floats
    lost: Floats
    put_in: Floats
    forces: list[tuple[str, Complexes, Complexes]] = field(default_factory=list)
    moments: list[tuple[str, Floats]] = field(default_factory=list)


class Loaded:
    """A random mechanism, and what its study says of masses, springs, loads and motion."""

    def __init__(self, made: Made, rng: Random) -> None:
        self.made, self.layout, self.rng = made, made.layout, rng
        self.gravity = rng.choice([0j, -9.81j, complex(rng.uniform(-3, 3), rng.uniform(-9, 9))])
        self.rates = dict(made.rates)
        self.accelerations = {name: rng.uniform(-2, 2) for name in self.layout.drives if rng.random() < 0.7}
        #: By body: mass, centre in its frame (None for the middle of its points), moment of inertia.
        self.masses: dict[str, tuple[float, complex | None, float]] = {}
        for body in self.layout.rigid():
            if rng.random() < 0.8:
                center = None if rng.random() < 0.3 else complex(rng.uniform(-1, 1), rng.uniform(-1, 1))
                self.masses[body] = rng.uniform(0.1, 3), center, rng.choice([0.0, rng.uniform(0.01, 0.5)])
        self.springs = {f"s{k}": self._spring() for k in range(rng.randint(0, 3))}
        self.loads = [self._load() for _ in range(rng.randint(0, 4))]

    def __repr__(self) -> str:
        return f"\n{self.text}"

    # What is drawn.

    def _end(self) -> str:
        """A pin, or a point of one link."""
        point = self.rng.choice(list(self.layout.places))
        return self.rng.choice([point, f"{self.rng.choice(self.layout.owners(point))}.{point}"])

    def _ends(self) -> tuple[str, str]:
        """Two points that lie apart."""
        one, other = self._end(), self._end()
        at, to = (self.layout.places[end.rpartition(".")[2]] for end in (one, other))
        return (one, other) if abs(to - at) > 0.3 else self._ends()

    def _spring(self) -> dict[str, Any]:
        rng = self.rng
        told: dict[str, Any] = {"damping": rng.uniform(0, 2)} if rng.random() < 0.5 else {}
        if rng.random() < 0.5:
            told["preload"] = rng.uniform(-3, 3)
        kind = rng.choice(["linear", "zero", "gas", "turning", "damper"])
        if kind == "turning":
            one, other = rng.sample(list(self.layout.bodies), 2)
            # By turns and a part of one.
            near = (
                2 * math.pi * rng.randint(-1, 1)
                + cmath.phase(self.layout.bodies[other].turn / self.layout.bodies[one].turn)
                + rng.uniform(-1, 1)
            )
            return told | {"between": [one, other], "stiffness": rng.uniform(0, 5), "free_angle": near / self.degree}
        told["between"] = list(self._ends())
        if kind == "damper":
            return told | {"damping": rng.uniform(0.1, 2)}
        if kind == "gas":
            told.pop("preload", None)
            return told | {"force": rng.uniform(1, 9), "rise": rng.uniform(0, 3), "free_length": rng.uniform(0.5, 4)}
        free = 0.0 if kind == "zero" else rng.uniform(0.1, 4)
        return told | {"stiffness": rng.uniform(0.1, 9), "free_length": free}

    def _load(self) -> Load:
        rng = self.rng
        kind = rng.choice(["at", "within", "between", "moment"])
        if kind == "moment":
            return Load((), (self._size(),), on=rng.choice([name for name in self.layout.bodies if name != GROUND]))
        if kind == "between":
            return Load(self._ends(), (self._size(),))
        within = rng.choice(list(self.layout.bodies)) if kind == "within" else ""
        return Load((self._end(),), (self._size(), self._size()), within=within)

    def _size(self) -> Size:
        layout, rng = self.layout, self.rng
        points = [point for point in layout.places if GROUND not in layout.owners(point)]
        known: dict[str, Coordinate] = {f"{point}.{axis}": (axis, point) for point in points for axis in "xy"}
        name, coordinate = rng.choice([*known.items(), *layout.drives.items()])
        return Size(rng.choice(list(SIZES)), rng.uniform(-5, 5), name, coordinate)

    # How it is told.

    @property
    def degree(self) -> float:
        """The study's unit of angle."""
        return math.pi / 180 if self.layout.unit == "deg" else 1.0

    def _told(self, values: dict[str, float]) -> dict[str, float]:
        """Values of drives, or their rates, in the study's units."""
        drives = self.layout.drives
        return {name: v / self.degree if drives[name][0] == "angle" else v for name, v in values.items()}

    @property
    def text(self) -> str:
        """The study."""
        study = yaml.safe_load(self.made.text)
        study["units"] |= {"length": "m", "force": "N"}
        links = study["mechanism"]["links"]
        for body, (mass, center, inertia) in self.masses.items():
            name = body.removesuffix(":rod")
            told: dict[str, Any] = {"mass": mass, "inertia": inertia}
            if center is not None:
                told["center"] = [center.real, center.imag]
            link = links[name]
            if isinstance(link, list):
                link = dict(zip(("from", "to", "length"), link, strict=False))
            elif not {"from", "points"} & link.keys():
                link = {"points": link}
            links[name] = link | ({"rod": told} if body.endswith(":rod") else told)
        study["mechanism"]["springs"] = self.springs
        poses = [
            {name: self.layout.value(c) + self.rates[name] * time for name, c in self.layout.drives.items()}
            for time in TIMES
        ]
        study["dynamics"] = {
            "gravity": [self.gravity.real, self.gravity.imag], "loads": [load.told for load in self.loads],
            "poses": [self._told(pose) for pose in poses], "rates": self._told(self.rates),
            "accelerations": self._told(self.accelerations),
        }  # fmt: skip
        return yaml.dump(study, Dumper=DUMPER, sort_keys=False, default_flow_style=None, width=110)

    @cached_property
    def study(self) -> Study:
        return study_of(self.text)

    @cached_property
    def result(self) -> Result:
        """What the package answers."""
        return dynamics(self.study)

    # The same by Newton and Euler.

    @cached_property
    def bodies(self) -> Bodies:
        """The bodies in motion at the poses."""
        (solved,) = solve_poses(self.study.motion(study_poses(self.study, "dynamics")))
        assume(solved.configuration.valid.all())
        return self.at(solved.configuration, self.rates, self.accelerations)

    def at(
        self, configuration: Configuration, rates: Mapping[str, Floats | float],
        accelerations: Mapping[str, Floats | float],
    ) -> Bodies:  # fmt: skip
        """The bodies at some poses, with rates and accelerations of the drives."""
        layout = self.layout
        origin: dict[str, Complexes] = {}
        turn: dict[str, Complexes] = {}
        for body in layout.rigid():
            link = layout.bodies[body.removesuffix(":rod")]
            turn[body] = configuration.rotation(link.name)
            if body.endswith(":rod"):
                origin[body] = configuration.point(link.to)
            else:
                point = link.points[0]
                origin[body] = (
                    configuration.point(point) - turn[body] * (layout.places[point] - link.origin) / link.turn
                )
        bodies = Bodies(layout, origin, turn)
        bodies.move(rates, accelerations)
        return bodies

    @cached_property
    def acting(self) -> Acting:
        """Everything that acts on the bodies; what holds them is solved from then on."""
        acting = Acting(*(np.zeros(self.bodies.poses) for _ in range(4)))
        for body, (mass, center, inertia) in self.masses.items():
            place = self.middle(body) if center is None else center
            kinetic, potential = self.bodies.weigh(body, mass, place, inertia, self.gravity)
            acting.kinetic += kinetic
            acting.potential += potential
        for spring in self.springs.values():
            self._stretch(acting, spring)
        for load in self.loads:
            self._burden(acting, load)
        self.bodies.solve()
        return acting

    def middle(self, body: str) -> complex:
        """The middle of a body's joints, in its frame; with a single joint of its two ends, or of all its points."""
        if body.endswith(":rod"):
            return 0j
        link, layout = self.layout.bodies[body], self.layout
        sliding = {point for guide in layout.guides.values() for point in (guide.point, guide.through, guide.toward)}
        points = [point for point in link.points if len(layout.owners(point)) > 1 or point in sliding]
        if len(points) < 2:
            ends = link.points[:2] if link.style.endswith("pair") or link.style == "binary" else []
            points = ends if len(ends) == 2 else link.points
        return sum((layout.places[point] - link.origin) / link.turn for point in points) / len(points)

    def _point(self, end: str) -> Jet:
        link, _, point = end.rpartition(".")
        return self.bodies.point(link or self.layout.owners(point)[0], point)

    def _at(self, acting: Acting, end: str, force: Complexes) -> None:
        link, _, point = end.rpartition(".")
        jet = self._point(end)
        self.bodies.push(jet, force)
        acting.forces.append((self.layout.holder(link, point) if link else f"pin:{point}", jet.value, force))

    def _turn(self, acting: Acting, body: str, moment: Floats) -> None:
        self.bodies.push(self.bodies.angle(body), moment)
        acting.moments.append((body, moment))

    def _stretch(self, acting: Acting, spring: dict[str, Any]) -> None:
        one, other = spring["between"]
        constant = -spring["force"] if "force" in spring else spring.get("preload", 0.0)
        stiffness, damping = spring.get("rise", spring.get("stiffness", 0.0)), spring.get("damping", 0.0)
        if turning := one in self.layout.bodies:
            angle = self.bodies.angle(other, one)
            # Within half a turn of the sketch.
            drawn = cmath.phase(self.layout.bodies[other].turn / self.layout.bodies[one].turn)
            drawn += 2 * math.pi * (drawn < 1e-9 - math.pi)
            wound = drawn + np.angle(np.exp(1j * (angle.value - drawn)))
            way, rate = wound - self.degree * spring["free_angle"], angle.rate
        else:
            span = self._point(other) - self._point(one)
            length = np.abs(span.value)
            along = span.value / length
            way, rate = length - spring.get("free_length", 0.0), (along.conj() * span.rate).real
        back = constant + stiffness * way + damping * rate
        if turning:
            self._turn(acting, other, -back)
            self._turn(acting, one, back)
        else:
            self._at(acting, one, back * along)
            self._at(acting, other, -back * along)
        acting.potential += constant * way + 0.5 * stiffness * way**2
        acting.lost += damping * rate**2

    def _burden(self, acting: Acting, load: Load) -> None:
        sizes = [self._value(size) for size in load.sizes]
        if load.on:
            self._turn(acting, load.on, sizes[0])
            acting.put_in += sizes[0] * self.bodies.angle(load.on).rate
            return
        if len(load.ends) == 2:
            span = (self._point(load.ends[1]) - self._point(load.ends[0])).value
            pull = sizes[0] * span / np.abs(span)
            forces = [pull, -pull]
        else:
            forces = [(sizes[0] + 1j * sizes[1]) * self.bodies.vector(load.within or GROUND, 1 + 0j).value]
        for end, force in zip(load.ends, forces, strict=True):
            self._at(acting, end, force)
            acting.put_in += (force.conj() * self._point(end).rate).real

    def _value(self, size: Size) -> Floats:
        jet = self.bodies.coordinate(size.coordinate)
        unit = self.degree if size.coordinate[0] == "angle" else 1.0
        value = SIZES[size.form](size.number, jet.value / unit, jet.rate / unit)
        return np.broadcast_to(np.asarray(value, dtype=float), (self.bodies.poses,))


@st.composite
def loaded(draw: st.DrawFn, **kinds: Any) -> Loaded:
    """Random mechanisms (see `mechanisms`) with masses, springs and loads, in motion."""
    made = draw(mechanisms(**kinds))
    return Loaded(made, Random(draw(st.integers(0, 2**32 - 1))))
