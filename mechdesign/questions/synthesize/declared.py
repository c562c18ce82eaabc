"""The kinds of linkages that are looked for, as data of mechanisms whose point P, or body `coupler`, does the task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

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
MECHANISMS = {"path": _PATHS, "body": _BODIES, "function": _FUNCTIONS}
PATHS, BODIES, FUNCTIONS = map(tuple, MECHANISMS.values())


def in_words(kind: str) -> str:
    """A kind of linkage in texts, such as four-bar."""
    return kind.replace("four_bar", "four-bar").replace("slider_crank", "slider-crank").replace("_", " ")


def starting(section: Mapping[str, Any]) -> Mapping[str, Any]:
    """The mechanism of the first kind that the task of a synthesis section looks for, as data."""
    task = next((task for task in MECHANISMS if task in section), "path")
    kinds = section.get("kind" if task == "function" else "kinds") or [FOUR_BAR]
    first = kinds if isinstance(kinds, str) else kinds[0] if isinstance(kinds, list) else FOUR_BAR
    return MECHANISMS[task].get(first, MECHANISMS[task][FOUR_BAR]) if isinstance(first, str) else _PATHS[FOUR_BAR]


def links(task: str, kinds: Sequence[str]) -> list[str]:
    """Names of the links of kinds of linkages for a task, each once."""
    return [
        *dict.fromkeys(link for kind in kinds if kind in MECHANISMS[task] for link in MECHANISMS[task][kind]["links"])
    ]
