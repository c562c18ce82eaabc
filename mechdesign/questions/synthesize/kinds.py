"""The kinds of linkages that are looked for: each a mechanism whose point P, or body `coupler`, does the task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.plan import Plan
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.text.inputs import Folder

FOUR_BAR, SLIDER_CRANK, INVERTED = "four_bar", "slider_crank", "inverted_slider_crank"
TRAMMEL, INVERTED_TRAMMEL, CONCHOID = "trammel", "inverted_trammel", "conchoid"
WATT, STEPHENSON = "watt", "stephenson"
POINT, BODY, DRIVE = "P", "coupler", "theta"

_FRAME = {"O": [0, 0], "D": [1, 0]}
_CRANK, _ROCKER, _DRIVEN = ["O", "A", 0.3], ["D", "B", 0.8], {DRIVE: {"angle": "crank"}}
_BAR = {"from": "A", "to": "B", "length": 0.9}
_SKETCH = {"A": [0, 0.3], "B": [0.8, 0.77]}
_RAIL = {"slot": "ground", "through": "D", "direction": 0, "point": "B"}
_RAIL_SKETCH = {"A": [0, 0.3], "B": [0.85, 0]}
# Each with the point P of its coupler; of one that is not shown here the coupler is the body of the task.
_PATHS: dict[str, dict[str, Any]] = {
    FOUR_BAR: {
        "links": {"ground": _FRAME, "crank": _CRANK, BODY: {**_BAR, "points": {POINT: [0.5, 0.4]}}, "rocker": _ROCKER},
        "drives": _DRIVEN, "sketch": _SKETCH,
    },
    SLIDER_CRANK: {
        "links": {"ground": _FRAME, "crank": _CRANK, BODY: {**_BAR, "points": {POINT: [0.5, 0.4]}}},
        "joints": {"rail": _RAIL}, "drives": _DRIVEN, "sketch": _RAIL_SKETCH,
    },
    WATT: {
        "links": {
            "ground": _FRAME, "crank": _CRANK, BODY: {**_BAR, "points": {"E": [0.6, 0.5]}},
            "rocker": {"from": "D", "to": "B", "length": 0.8, "points": {"F": [0.8, -0.5]}},
            "arm": {"from": "E", "to": "H", "length": 0.9, "points": {POINT: [0.6, 0.4]}}, "stay": ["F", "H", 0.8],
        },
        "drives": _DRIVEN, "sketch": {**_SKETCH, "H": [1.2, 1.4]},
    },
    STEPHENSON: {
        "links": {
            "ground": {**_FRAME, "F": [1.6, 0.6]}, "crank": _CRANK, BODY: {**_BAR, "points": {"C": [0.6, 0.5]}},
            "rocker": _ROCKER,
            "arm": {"from": "C", "to": "H", "length": 0.9, "points": {POINT: [0.6, 0.4]}}, "stay": ["F", "H", 0.8],
        },
        "drives": _DRIVEN, "sketch": {**_SKETCH, "H": [1.1, 1.4]},
    },
}  # fmt: skip
_IN_BODY = {"A": [-0.45, 0], "B": [0.45, 0], POINT: [0, 0]}
_LINKS = {"ground": _FRAME, "crank": _CRANK, BODY: _IN_BODY}
_TURNED, _UP = {DRIVE: {"angle": BODY}}, {**_RAIL, "through": "O", "direction": 90, "point": "A"}
_GUIDE = {"slot": BODY, "through": "B", "direction": 0, "point": "D"}
_BODIES: dict[str, dict[str, Any]] = {
    FOUR_BAR: {"links": {**_LINKS, "rocker": _ROCKER}, "drives": _DRIVEN, "sketch": _SKETCH},
    SLIDER_CRANK: {"links": _LINKS, "joints": {"rail": _RAIL}, "drives": _DRIVEN, "sketch": _RAIL_SKETCH},
    INVERTED: {
        "links": _LINKS, "joints": {"guide": _GUIDE}, "drives": _DRIVEN, "sketch": {"A": [0, 0.3], "B": [0.9, 0.05]},
    },
    TRAMMEL: {"links": {"ground": _FRAME, BODY: _IN_BODY}, "joints": {"rail": _RAIL, "second_rail": _UP},
              "drives": _TURNED, "sketch": {"A": [0, 0.4], "B": [0.8, 0]}},
    INVERTED_TRAMMEL: {
        "links": {"ground": _FRAME, BODY: _IN_BODY},
        "joints": {"guide": _GUIDE, "second_guide": {**_GUIDE, "through": "A", "direction": 60, "point": "O"}},
        "drives": _TURNED, "sketch": {"A": [0.3, 0.3], "B": [0.9, 0.2]},
    },
    CONCHOID: {
        "links": {"ground": _FRAME, BODY: _IN_BODY},
        "joints": {"second_rail": _UP, "guide": _GUIDE},
        "drives": _TURNED, "sketch": {"A": [0, 0.4], "B": [0.8, 0.1]},
    },
}  # fmt: skip

_FUNCTIONS: dict[str, dict[str, Any]] = {
    FOUR_BAR: {
        "links": {"ground": _FRAME, "crank": _CRANK, BODY: ["A", "B", 0.9], "rocker": _ROCKER},
        "drives": _DRIVEN, "sketch": _SKETCH,
    },
    SLIDER_CRANK: {
        "links": {"ground": _FRAME, "crank": _CRANK, BODY: ["A", "B", 0.9]},
        "joints": {"rail": _RAIL}, "drives": _DRIVEN, "sketch": _RAIL_SKETCH,
    },
}  # fmt: skip
_ALL = {"path": _PATHS, "body": _BODIES, "function": _FUNCTIONS}
PATHS, BODIES, FUNCTIONS = map(tuple, _ALL.values())


def starting(section: Mapping[str, Any]) -> Mapping[str, Any]:
    """The mechanism of the first kind that the task of a synthesis section looks for, as data."""
    task = next((task for task in _ALL if task in section), "path")
    kinds = section.get("kind" if task == "function" else "kinds") or [FOUR_BAR]
    first = kinds if isinstance(kinds, str) else kinds[0] if isinstance(kinds, list) else FOUR_BAR
    return _ALL[task].get(first, _ALL[task][FOUR_BAR]) if isinstance(first, str) else _PATHS[FOUR_BAR]


def links(task: str, kinds: Sequence[str]) -> list[str]:
    """Names of the links of kinds of linkages for a task, each once."""
    return [*dict.fromkeys(link for kind in kinds if kind in _ALL[task] for link in _ALL[task][kind]["links"])]


class Kind:
    """A kind of linkage, compiled once; `values` of its linkages have shape (count, places), angles in radians."""

    def __init__(self, name: str, mechanism: Mapping[str, Any]) -> None:
        self.name, self.data = name, mechanism
        self.study: Study = load_data({"mechanism": mechanism}, (), None, Folder())
        self.mechanism: Mechanism = self.study.mechanism
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
    return Kind(name, _ALL[task][name])
