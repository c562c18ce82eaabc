"""Small pictures of the shipped studies for the gallery: the moving linkage of a report as an SVG that moves by itself.

It moves by style rules, without a script, and stands still where the reader's system asks for less motion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, fromstring, tostring

import numpy as np

import mechdesign
from mechdesign.door.report.page.moving import moving
from mechdesign.door.report.page.tracks import PLACES, TIMES, TURNS, steps
from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.study import Study

# A moving part lies this far beside its pose at most: units of a drawing that is shown half as large, degrees, lengths.
_NEAR = {"translate": 1.0, "rotate": 0.5, "scale": 0.01}
_UNITS = {"translate": "px", "rotate": "deg", "scale": ""}
_DIGITS = {"translate": 0, "rotate": 1, "scale": 3}
_STYLE = (
    ".moving-trace{{stroke-width:2.5}}[class^=m-]{{animation:{seconds:g}s linear infinite{back}}}{rules}"
    "@media(prefers-reduced-motion:reduce){{*{{animation:none!important}}}}"
)
_MOVED_BY = ("data-at", "data-turn", "data-from", "data-to", "data-way")


def thumbnail(path: Path) -> str | None:
    """The mechanism of a study along its motion, as SVG; None where the study has no motion."""
    study = mechdesign.load(path)
    if study.synthesis is not None:
        study = best(study)
    try:
        shown = moving(study, mechdesign.kinematics(study), plain=True)
    except MechdesignError:
        return None
    if shown is None or "times" not in shown.data:
        return None
    root, tracks = fromstring(shown.drawing), Tracks(shown.data)
    root.set("xmlns", "http://www.w3.org/2000/svg")
    root.attrib.pop("class")
    for trace in root.iterfind("path[@class='moving-trace']"):
        trace.set("d", _thinned(trace.get("d", "")))
    rules: dict[tuple[str, ...], str] = {}
    for element in root.iter():
        key = tuple(element.attrib.pop(name, "") for name in _MOVED_BY)
        motion = tracks.motion(*key, element) if any(key) else {}
        if any(np.ptp(values, axis=0).max() > _NEAR[name] for name, values in motion.items()):
            name = f"m-{list(rules).index(key) if key in rules else len(rules)}"
            rules.setdefault(key, _rule(name, motion, tracks.times))
            element.attrib.pop("transform", None)
            element.set("class", name)
    back = "" if tracks.returns else " alternate"
    style = Element("style")
    style.text = _STYLE.format(seconds=tracks.seconds, back=back, rules="".join(rules.values()))
    root.insert(0, style)
    return tostring(root, encoding="unicode")


def best(task: Study) -> Study:
    """The best linkage for a task."""
    return mechdesign.load(text=mechdesign.synthesize(task).files["solution_1.yaml"])


class Tracks:
    """Places of the points and turns of the links over the time of a motion, in its longest run of valid poses."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data, count = data, data["poses"]
        times = steps(data["times"], count + 1) / TIMES
        # Behind the last pose of a closed motion comes the first again.
        poses = np.arange(count + (times[count] > times[count - 1])) % count
        valid = np.ones(count, dtype=bool)
        for first, last, _ in data["gaps"]:
            valid[first : last + 1] = False
        runs = np.split(np.arange(len(poses)), np.flatnonzero(np.diff(valid[poses])) + 1)
        run = max((run for run in runs if valid[poses[run[0]]]), key=len)
        self.poses, self.returns = poses[run], bool(data["returns"]) and len(runs) == 1
        self.times = (times[run] - times[run[0]]) / (times[run[-1]] - times[run[0]])
        self.seconds = data["seconds"]

    def motion(self, at: str, link: str, base: str, tip: str, way: str, element: Element) -> dict[str, Floats]:
        """Properties of an element's style over the poses, shape (poses, 1 or 2), by what it is moved by.

        A part of a telescopic leg or a spring is drawn level, turned and made longer.
        """
        if at:
            return {"translate": self._place(at)} | ({"rotate": self._turn(link)} if link else {})
        begin, span = self._place(base), self._place(tip) - self._place(base)
        length = np.hypot(*span.T)[:, None]
        angle = np.degrees(np.unwrap(np.arctan2(span[:, 1], span[:, 0])))[:, None]
        lines = [np.reshape(line.split(), (-1, 2)).astype(float) * [length[0, 0], -1] for line in way.split(",")]
        element.set("d", "".join("M" + "L".join(f"{x:.1f} {y:g}" for x, y in line) for line in lines))
        return {"translate": begin, "rotate": angle, "scale": length / length[0] * [1, 0] + [0, 1]}

    def _place(self, point: str) -> Floats:
        return np.column_stack([self._track(axis, point, PLACES) for axis in "xy"])

    def _turn(self, link: str) -> Floats:
        return np.unwrap(self._track("turn", link, TURNS), period=360)[:, None]

    def _track(self, kind: str, name: str, unit: int) -> Floats:
        return steps(self.data[kind][name], self.data["poses"])[self.poses] / unit


def _rule(name: str, motion: Mapping[str, Floats], times: Floats) -> str:
    """A class of a style sheet that gives an element its first pose and moves it through the others."""
    frames: dict[int, list[str]] = {}
    for key, values in motion.items():
        texts = [" ".join(f"{round(value, _DIGITS[key]) + 0.0:g}{_UNITS[key]}" for value in row) for row in values]
        for index in _corners(times, values, _NEAR[key]).tolist() if np.ptp(values, axis=0).max() > _NEAR[key] else [0]:
            frames.setdefault(index, []).append(f"{key}:{texts[index]}")
    still = ";".join(frames[0])
    moves = "".join(f"{100 * times[index]:.3g}%{{{';'.join(frames[index])}}}" for index in sorted(frames))
    return f".{name}{{{still};animation-name:{name}}}@keyframes {name}{{{moves}}}"


def _thinned(path: str) -> str:
    """A path of an SVG by as few points as show it."""
    lines = [np.reshape(re.findall(r"-?[\d.]+", line), (-1, 2)).astype(float) for line in path.split("M")[1:]]
    ways = [np.append(0.0, np.hypot(*np.diff(line, axis=0).T).cumsum()) for line in lines]
    kept = [line[_corners(way, line, _NEAR["translate"])] for way, line in zip(ways, lines, strict=True)]
    return "".join("M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in line) for line in kept)


def _corners(times: Floats, values: Floats, near: float) -> Ints:
    """Indices between which values over the time are straight but for a small distance [Douglas and Peucker, 1973]."""
    corners, parts = {0, len(times) - 1}, [(0, len(times) - 1)]
    while parts:
        first, last = parts.pop()
        # Two poses may stand at the same time, beside a limit where the mechanism is infinitely fast.
        between = np.arange(first + 1, last)
        share = ((times[between] - times[first]) / (times[last] - times[first] or 1))[:, None]
        away = np.abs(values[between] - values[first] - share * (values[last] - values[first])).max(axis=1)
        if away.max(initial=0.0) > near:
            middle = int(between[away.argmax()])
            corners.add(middle)
            parts += [(first, middle), (middle, last)]
    return np.array(sorted(corners))
