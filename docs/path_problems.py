"""Ten published tasks of path generation: the linkages that sources print and those found, by one measure of error.

python docs/path_problems.py [NAME...]      finds them anew, and writes them into path_problems_found.yaml
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import yaml
from markup import table

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Axis, Dots, Panel, Picture, Trace
from mechdesign.ground.numerics.arrays import Complexes, Floats

DATA = Path(__file__).parent / "path_problems.yaml"
FOUND = Path(__file__).parent / "path_problems_found.yaml"
# Limits of the searches: those that hold without being written, and so wide that hardly one counts.
LIMITS: dict[str, dict[str, float]] = {"usual limits": {}, "wide limits": {"reach": 100, "ratio": 1000}}
SEED = 1
POSES, ZOOMS = 3600, 9  # crank angles of a curve, and how often the nearest is looked at closer
EXACT = 1e-9  # errors below this part of the task are none


@dataclass(frozen=True)
class FourBar:
    """A four-bar, its pivots as complex numbers, with its coupler point in the axes of the coupler."""

    pivot: complex
    other: complex
    crank: float
    coupler: float
    rocker: float
    point: complex
    side: int

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Self:
        """From a pivot, the frame and the point as lengths and angles (radians)."""
        frame, point = (length * np.exp(1j * angle) for length, angle in (data["frame"], data["point"]))
        pivot = complex(*data["pivot"])
        return cls(
            pivot, pivot + frame, *(float(data[name]) for name in ("crank", "coupler", "rocker")), point, data["side"]
        )

    def data(self) -> dict[str, Any]:
        """As `of` takes it."""
        frame = self.other - self.pivot
        numbers = {
            "pivot": [self.pivot.real, self.pivot.imag], "frame": [abs(frame), np.angle(frame)], "crank": self.crank,
            "coupler": self.coupler, "rocker": self.rocker, "point": [abs(self.point), np.angle(self.point)],
        }  # fmt: skip
        return {name: np.round(value, 10).tolist() for name, value in numbers.items()} | {"side": self.side}

    def pins(self, angles: Floats) -> tuple[Complexes, Complexes]:
        """Pins of crank and rocker at crank angles (radians); nan where the linkage does not close."""
        pin = self.pivot + self.crank * np.exp(1j * angles)
        span = self.other - pin
        along = (np.abs(span) ** 2 + self.coupler**2 - self.rocker**2) / (2 * np.abs(span))
        with np.errstate(invalid="ignore"):
            return pin, pin + span / np.abs(span) * (along + 1j * self.side * np.sqrt(self.coupler**2 - along**2))

    def curve(self, angles: Floats) -> Complexes:
        """Places of the coupler point."""
        pin, end = self.pins(angles)
        return np.asarray(pin + self.point * (end - pin) / self.coupler)

    def distances(self, points: Complexes) -> Floats:
        """Distance of each point from the nearest place of the curve."""
        angles = np.tile(np.linspace(0, 2 * np.pi, POSES, endpoint=False), (len(points), 1))
        width = 2 * np.pi / POSES
        for _ in range(ZOOMS):
            gaps = np.nan_to_num(np.abs(self.curve(angles) - points[:, None]), nan=np.inf)
            nearest = np.take_along_axis(angles, gaps.argmin(axis=1)[:, None], axis=1)
            angles = nearest + width * np.linspace(-1, 1, 41)
            width /= 16
        return np.asarray(gaps.min(axis=1))

    def error(self, points: Complexes) -> float:
        """Root mean square of the distances."""
        return float(np.sqrt((self.distances(points) ** 2).mean()))

    def transmission(self) -> float:
        """Smallest angle between coupler and rocker over a turn (degrees); nan where the crank does not turn."""
        pin, end = self.pins(np.linspace(0, 2 * np.pi, POSES))
        sine = np.abs(((end - pin) * np.conj(end - self.other)).imag) / (self.coupler * self.rocker)
        return float(np.degrees(np.arcsin(sine.min())))


@dataclass(frozen=True)
class Problem:
    """A task with its source, and the linkage that this prints."""

    name: str
    title: str
    source: str
    points: Complexes
    closed: bool
    pivots: Sequence[Sequence[float]]
    printed: FourBar | None

    @classmethod
    def of(cls, name: str, data: Mapping[str, Any]) -> Self:
        """From the file."""
        points = np.array([complex(*point) for point in data["points"]])
        printed = FourBar.of(data["printed"]) if "printed" in data else None
        return cls(
            name, data["title"], data["source"], points, data.get("closed", True), data.get("pivots", ()), printed
        )

    @property
    def size(self) -> float:
        """The greater extent of the points along x or y."""
        return float(max(np.ptp(self.points.real), np.ptp(self.points.imag)))

    def study(self, limits: Mapping[str, float] = LIMITS["usual limits"]) -> str:
        """The study that asks for its linkages."""
        points = [f"[{point.real:.10g}, {point.imag:.10g}]" for point in self.points]
        rows = [", ".join(points[k : k + 5]) for k in range(0, len(points), 5)]
        lines = ["seed: 1", "synthesis:", "  path:", f"    closed: {str(self.closed).lower()}"]
        lines.append(f"    points: [{(',' + chr(10) + ' ' * 13).join(rows)}]")
        if self.pivots:
            lines.append(f"  pivots: {[*map(list, self.pivots)]}")
        if limits:
            lines.append(f"  limits: {{{', '.join(f'{name}: {value}' for name, value in limits.items())}}}")
        return "\n".join(lines) + "\n"

    def solve(self, limits: Mapping[str, float]) -> FourBar:
        """The best linkage without a defect that a search finds."""
        best = mechdesign.synthesize(mechdesign.load(text=self.study(limits)), seed=SEED).main
        number = {name: float(best[name][0]) for name in best.names if name.endswith((".x", ".y", ".length"))}
        pivot, other, point = (
            complex(number[f"{name}.x"], number[f"{name}.y"]) for name in ("ground.O", "ground.D", "coupler.P")
        )
        crank, coupler, rocker = (number[f"{name}.length"] for name in ("crank", "coupler", "rocker"))
        sides = [FourBar(pivot, other, crank, coupler, rocker, point, side) for side in (1, -1)]
        return min(sides, key=lambda bar: bar.error(self.points))


def problems() -> list[Problem]:
    """All of them."""
    return [Problem.of(*item) for item in yaml.safe_load(DATA.read_text(encoding="utf-8")).items()]


def found() -> dict[str, dict[str, FourBar]]:
    """The linkages that were found, by problem and limits."""
    data = yaml.safe_load(FOUND.read_text(encoding="utf-8")) if FOUND.exists() else {}
    return {name: {limits: FourBar.of(bar) for limits, bar in bars.items()} for name, bars in data.items()}


def linkages() -> Iterator[tuple[Problem, dict[str, FourBar]]]:
    """Every problem with the printed linkage, where there is one, and those found."""
    solved = found()
    for problem in problems():
        yield problem, ({} if problem.printed is None else {"printed": problem.printed}) | solved[problem.name]


def error_of(problem: Problem, bar: FourBar) -> str:
    """The error of a linkage in words."""
    error = bar.error(problem.points)
    return "0" if error < EXACT * problem.size else f"{error:.4g}"


def angle_of(bar: FourBar) -> str:
    """The smallest transmission angle over a turn in words."""
    angle = bar.transmission()
    return "stops" if np.isnan(angle) else f"{angle:.0f}°"


def overview() -> str:
    """The table of all problems."""
    names, lines = ("printed", *LIMITS), list[list[str]]()
    for problem, bars in linkages():
        shown = [f"{error_of(problem, bars[name])} ({angle_of(bars[name])})" if name in bars else "" for name in names]
        place = re.sub(r"[^a-z]+", "-", problem.title.lower())
        lines.append([f"[{problem.title}](#{place})", str(len(problem.points)), *shown])
    return table(["problem", "points", *names], *lines)


def drawing(problem: Problem, bars: Mapping[str, FourBar]) -> str:
    """The points and the curves of the linkages, as SVG."""
    angles = np.linspace(0, 2 * np.pi, 721)
    looks = {"printed": (style.VERMILION, "--", 1.4), "usual limits": (style.BLUE, "-", 2.0),
             "wide limits": (style.GREEN, ":", 1.8)}  # fmt: skip
    marks: list[Any] = []
    for name, bar in bars.items():
        colour, dash, wide = looks[name]
        curve = bar.curve(angles)
        look = {"color": colour, "linestyle": dash, "linewidth": wide}
        marks.append(Trace(curve.real, curve.imag, label=name, look=look))
    points = problem.points
    marks.append(Dots(points.real, points.imag, label="points", look={"color": style.INK, "markersize": 4}))
    reach = problem.size * 0.15
    shows = np.array([points.real.min() - reach + 1j * (points.imag.min() - reach),
                      points.real.max() + reach + 1j * (points.imag.max() + reach)])  # fmt: skip
    with style.context():
        figure = draw(Picture(problem.title, [Panel(marks, Axis("x", ""), Axis("y", ""), equal=True, shows=shows)]))
        stream = io.StringIO()
        figure.savefig(stream, format="svg")
    return stream.getvalue()


def section(problem: Problem, bars: Mapping[str, FourBar]) -> str:
    """A problem: its source, its picture, its linkages, and the study."""
    head = ["", "first pivot", "second pivot", "crank", "coupler", "rocker", "P along, across the coupler"]
    rows = []
    for name, bar in bars.items():
        pivot, other, point = (f"{place.real:.6g}, {place.imag:.6g}" for place in (bar.pivot, bar.other, bar.point))
        lengths = [f"{length:.6g}" for length in (bar.crank, bar.coupler, bar.rocker)]
        rows.append([f"{name}, {'left' if bar.side > 0 else 'right'}", pivot, other, *lengths, point])
    picture = f"![{problem.title}](path_problems_{problem.name}.svg)"
    block = f"```{{code-block}} yaml\n:caption: {problem.name}.yaml\n\n{problem.study()}```"
    return "\n\n".join((f"## {problem.title}", problem.source, picture, table(head, *rows), block))


def sections() -> str:
    """The text of all problems."""
    return "\n\n".join(section(problem, bars) for problem, bars in linkages()) + "\n"


def pages() -> dict[str, str]:
    """What the page of the ten problems includes, and its pictures, by their paths in the folder of the site."""
    drawings = {f"theory/path_problems_{problem.name}.svg": drawing(problem, bars) for problem, bars in linkages()}
    return {"theory/_path_problems_table.md": overview() + "\n", "theory/_path_problems.md": sections()} | drawings


def main() -> None:
    """Find the linkages of these problems, or of all, write them, and print the table."""
    before, solved = found(), {}
    for problem in problems():
        anew = problem.name in sys.argv[1:] or len(sys.argv) == 1 or problem.name not in before
        bars = {name: problem.solve(limits) for name, limits in LIMITS.items()} if anew else before[problem.name]
        solved[problem.name] = {name: bar.data() for name, bar in bars.items()}
    head = "# What `python docs/path_problems.py` has found, written as path_problems.yaml has the printed linkages.\n"
    text = yaml.safe_dump(solved, sort_keys=False, width=120, default_flow_style=None)
    FOUND.write_text(head + text, encoding="utf-8")
    print(overview())


if __name__ == "__main__":
    main()
