"""A kind of linkage, compiled once, and many linkages of it at once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.open_loops import OpenLoops
from mechdesign.mechanism.plan import Plan
from mechdesign.questions.synthesize.declared import BODY, MECHANISMS, POINT
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.schema.variable import plainly
from mechdesign.study.text.inputs import Folder
from mechdesign.study.text.units import Units


class Kind:
    """A kind of linkage, compiled once; `values` of its linkages have shape (count, places), angles in radians.

    Parameters
    ----------
    places : tuple of str
        Names of their dimensions.
    course : (float, float)
        Where the drive begins, and how far it runs: a turn.
    """

    turns = True  #: whether the drive turns; else it slides
    course = (0.0, 2 * np.pi)

    def __init__(self, name: str, study: Study, point: str, places: Sequence[str] = ()) -> None:
        self.name, self.study, self.point = name, study, point
        self.mechanism: Mechanism = study.mechanism
        self.places = tuple(places or self.mechanism.description.places)
        self._node = self.mechanism.graph.node(point)
        self._plans: dict[tuple[int, ...], Plan] = {}

    @property
    def nominal(self) -> Floats:
        """Dimensions of the linkage as it is declared."""
        return np.array([place.nominal for place in self.mechanism.description.places.values()])

    def __getitem__(self, place: str) -> int:
        """The column of a place."""
        return self.places.index(place)

    @property
    def drive(self) -> str:
        """Its only drive."""
        return self.mechanism.drives[0]

    @cached_property
    def modes(self) -> list[tuple[int, ...]]:
        """Its assembly modes."""
        every: list[tuple[int, ...]] = [()]
        for mode in self.mechanism.forward.modes:
            every = [(*modes, sign) for modes in every for sign in ((1, -1) if mode else (0,))]
        return every

    @property
    def begun(self) -> list[tuple[int, ...]]:
        """Those in which its linkages are sampled: with the opposite direction of a rail another one is the same."""
        groups = self.mechanism.forward.structure.groups
        return [
            modes
            for modes in self.modes
            if all(mode > 0 or group.form != "angle and fixed slide" for mode, group in zip(modes, groups, strict=True))
        ]

    @cached_property
    def pivots(self) -> tuple[tuple[int, int], ...]:
        """Columns of x and y of the points O, D and F of the frame."""
        return tuple(self._pair(f"ground.{name}") for name in "ODF" if f"ground.{name}.x" in self.places)

    @cached_property
    def rails(self) -> dict[int, int]:
        """By the number of the pivot through which a slide of the frame runs, the column of its direction."""
        joints = self.study.resolved["mechanism"].get("joints", {})
        names = [name for name in "ODF" if f"ground.{name}.x" in self.places]
        return {names.index(joint["through"]): self[f"{name}.direction"]
                for name, joint in joints.items() if joint["slot"] == "ground"}  # fmt: skip

    @property
    def directions(self) -> tuple[int, ...]:
        """Columns of the directions of slides of the frame."""
        return tuple(self.rails.values())

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Columns of all other lengths, which scale with the linkage."""
        fixed = {*self.directions, *(column for pair in self.pivots for column in pair)}
        places = self.mechanism.description.places.values()
        return tuple(k for k, place in enumerate(places) if place.quantity == "length" and k not in fixed)

    def scale(self, values: Floats, size: float) -> Floats:
        """By what differences from the values of a linkage count, for a task of a size: lengths and radians."""
        scale = np.maximum(np.abs(values), size)
        scale[[*self.directions]] = 1.0
        return scale

    def solve(self, values: Floats, angles: Floats, modes: tuple[int, ...]) -> Configuration:
        """Poses of linkages at values of the drive (radians), shape (count, poses)."""
        if modes not in self._plans:
            self._plans[modes] = Plan(self.mechanism, self.mechanism.forward.structure, modes)
        return self._plans[modes].solve([angles], self.dimensions(values[:, None]))

    def opened(self, values: Floats, poses: Floats) -> OpenLoops:
        """Poses whose loops need not close: drive, angles and slides have shape (unknowns, count, poses)."""
        return OpenLoops(self.mechanism.forward, self._node, [poses[0]], poses[1:], self.dimensions(values[:, None]))

    def shown(self, values: Floats, factor: float) -> dict[str, float]:
        """The values of one linkage as studies have them, `factor` radians being their unit of angle."""
        return {name: plainly(value) for name, value in zip(self.places, self.written(values, factor), strict=True)}

    def written(self, values: Floats, factor: float) -> Floats:
        """Values by their last axis in the units of studies, `factor` radians being that of angles."""
        places = self.mechanism.description.places
        return values / [factor if places[name].quantity == "angle" else 1.0 for name in self.places]

    def unit_of(self, place: str, units: Units) -> str:
        """The unit of a value."""
        return units.label(self.mechanism.description.places[place].quantity)

    def dimensions(self, values: Floats) -> dict[str, Number]:
        """Dimensions of the mechanism that differ from its own, in lengths and radians; `values` by their last axis."""
        return {name: values[..., k] for k, name in enumerate(self.places)}

    def points(self, poses: Configuration) -> Complexes:
        """Places of the point P, nan where the linkage cannot be assembled."""
        return np.where(poses.valid, np.broadcast_to(poses.nodes[self._node], poses.shape), np.nan)

    def derivatives(self, values: Floats, poses: Configuration) -> tuple[Complexes, Complexes]:
        """Derivatives of the point P by the values, shape (places, count, poses), and by the drive."""
        linear = self.mechanism.linearize(poses)
        by_drive = linear.by_drives[0].nodes[self._node]
        return self.by_places(values, linear), np.broadcast_to(by_drive, poses.shape)

    def by_places(self, values: Floats, linear: Linearization) -> Complexes:
        """Derivatives of the point P by the values, shape (places, count, poses)."""
        slopes = linear.sensitivity(self.places).nodes[self._node]
        return np.broadcast_to(slopes, (len(self.places), *linear.configuration.shape))

    def frame(self, values: Floats) -> Complexes:
        """Places of the points of the frame, shape (count, points)."""
        return np.stack([values[:, x] + 1j * values[:, y] for x, y in self.pivots], axis=1)

    def links(self, values: Floats) -> dict[str, Floats]:
        """Lengths of the links by their names, the frame as `ground`, each of shape (count,)."""
        lengths = {place.removesuffix(".length"): values[:, k] for k, place in enumerate(self.places)
                   if place.endswith(".length")}  # fmt: skip
        if "crank" in lengths or BODY in lengths:
            (x, y), (u, v) = (self._pair(f"ground.{name}") for name in "OD")
            lengths["ground"] = np.hypot(values[:, x] - values[:, u], values[:, y] - values[:, v])
        if BODY not in lengths:
            (x, y), (u, v) = (self._pair(f"{BODY}.{name}") for name in "AB")
            lengths[BODY] = np.hypot(values[:, x] - values[:, u], values[:, y] - values[:, v])
        return lengths

    def _pair(self, point: str) -> tuple[int, int]:
        return self[f"{point}.x"], self[f"{point}.y"]

    def samples(self, random: np.random.Generator, count: int, ratio: float, *, full_turn: bool) -> Floats:
        """Random linkages of a kind in no special place and size, about `count` of them; their cranks turn or may not.

        Lengths are log-uniform over a ratio; the crank is more often the shortest than by chance, as then it may turn.
        """
        values, few = np.tile(self.nominal, (count, 1)), np.log(ratio)
        lengths = [k for k, place in enumerate(self.places) if place.endswith(".length")]
        values[:, lengths] = np.exp(random.uniform(0, few, (count, len(lengths))))
        for number, (x, y) in enumerate(self.pivots):
            # The frame begins at O and runs along x to D.
            away = np.exp(random.uniform(0, few, count) + 1j * random.uniform(-np.pi, np.pi, count))
            away = (0 * away, np.abs(away), away)[number]
            values[:, x], values[:, y] = away.real, away.imag
        for x, y in self._points():
            link = self.places[x].partition(".")[0]
            length = values[:, self[f"{link}.length"]]
            arm = length * np.exp(random.uniform(-2, 1, count) + 1j * random.uniform(-np.pi, np.pi, count))
            values[:, x], values[:, y] = length / 2 + arm.real, arm.imag
        if self.directions:
            # The slide runs along x, beside the crank's pivot by up to its coupler.
            (x, y), (crank, coupler) = self.pivots[1], (self["crank.length"], self["coupler.length"])
            values[:, self.directions] = 0.0
            values[:, x], values[:, y] = 0.0, values[:, coupler] * random.uniform(-0.8, 0.8, count)
            values[:, crank] = values[:, coupler] * np.exp(random.uniform(-few, 0, count))
            return values
        links = self.links(values)
        others = np.min([links[name] for name in ("ground", "coupler", "rocker")], axis=0)
        shortest = random.uniform(size=count) < (0.85 if full_turn else 0.6)
        values[:, self["crank.length"]] = np.where(
            shortest, others * np.exp(random.uniform(-few, 0, count) / 2), links["crank"]
        )
        return values

    def _points(self) -> list[tuple[int, int]]:
        """Columns of x and y of the points of moving links."""
        return [(k, self[f"{place[:-1]}y"]) for k, place in enumerate(self.places)
                if place.endswith(".x") and not place.startswith("ground.")]  # fmt: skip

    def moved(self, values: Floats, turned: Complexes, shift: Complexes) -> Floats:
        """The linkages turned and scaled by complex numbers, then shifted; shape (count,) each."""
        moved = values.copy()
        for x, y in self.pivots:
            place = turned * (values[:, x] + 1j * values[:, y]) + shift
            moved[:, x], moved[:, y] = place.real, place.imag
        moved[:, self.sizes] *= np.abs(turned)[:, None]
        moved[:, self.directions] += np.angle(turned)[:, None]
        return moved


@cache
def kind_of(task: str, name: str) -> Kind:
    """A kind of linkage for a task, ``body``, ``function`` or ``path``."""
    study = load_data({"mechanism": MECHANISMS[task][name]}, (), None, Folder())
    return Kind(name, study, POINT if POINT in study.mechanism.points else "B")
