"""A kind of linkage, compiled once, and many linkages of it at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, cached_property
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.plan import Plan
from mechdesign.questions.synthesize.declared import BODY, MECHANISMS, POINT
from mechdesign.study.loading import load_data
from mechdesign.study.text.inputs import Folder


class Kind:
    """A kind of linkage, compiled once; `values` of its linkages have shape (count, places), angles in radians."""

    def __init__(self, name: str, mechanism: Mapping[str, Any]) -> None:
        self.name, self.data = name, mechanism
        self.mechanism: Mechanism = load_data({"mechanism": mechanism}, (), None, Folder()).mechanism
        description = self.mechanism.description
        self.places = tuple(description.places)
        self.nominal = np.array([place.nominal for place in description.places.values()])
        self._node = self.mechanism.graph.node(POINT if POINT in self.mechanism.points else "B")
        self._plans: dict[tuple[int, ...], Plan] = {}

    def __getitem__(self, place: str) -> int:
        """The column of a place."""
        return self.places.index(place)

    @cached_property
    def modes(self) -> list[tuple[int, ...]]:
        """Its assembly modes."""
        every: list[tuple[int, ...]] = [()]
        for mode in self.mechanism.forward.modes:
            every = [(*modes, sign) for modes in every for sign in ((1, -1) if mode else (0,))]
        return every

    @cached_property
    def pivots(self) -> tuple[tuple[int, int], ...]:
        """Columns of x and y of the points of the frame."""
        ground = [place for place in self.places if place.startswith("ground.") and place.endswith(".x")]
        return tuple((self[place], self[f"{place[:-1]}y"]) for place in ground)

    @cached_property
    def directions(self) -> tuple[int, ...]:
        """Columns of the directions of slides of the frame."""
        rails = [name for name, joint in self.data.get("joints", {}).items() if joint["slot"] == "ground"]
        return tuple(self[f"{name}.direction"] for name in rails)

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Columns of all other lengths, which scale with the linkage."""
        fixed = {*self.directions, *(column for pair in self.pivots for column in pair)}
        places = self.mechanism.description.places.values()
        return tuple(k for k, place in enumerate(places) if place.quantity == "length" and k not in fixed)

    def solve(self, values: Floats, angles: Floats, modes: tuple[int, ...]) -> Configuration:
        """Poses of linkages at values of the drive (radians), shape (count, poses)."""
        if modes not in self._plans:
            self._plans[modes] = Plan(self.mechanism, self.mechanism.forward.structure, modes)
        places = {name: values[:, k : k + 1] for k, name in enumerate(self.places)}
        return self._plans[modes].solve([angles], places)

    def points(self, poses: Configuration) -> Complexes:
        """Places of the point P, nan where the linkage cannot be assembled."""
        return np.where(poses.valid, np.broadcast_to(poses.nodes[self._node], poses.shape), np.nan)

    def derivatives(self, poses: Configuration) -> tuple[Complexes, Complexes]:
        """Derivatives of the point P by the places, shape (places, count, poses), and by the drive."""
        linear = self.mechanism.linearize(poses)
        by_place = linear.sensitivity(self.places).nodes[self._node]
        by_drive = linear.by_drives[0].nodes[self._node]
        return np.broadcast_to(by_place, (len(self.places), *poses.shape)), np.broadcast_to(by_drive, poses.shape)

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
    return Kind(name, MECHANISMS[task][name])
