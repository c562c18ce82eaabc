"""Regions of a workspace for pictures, one for each value of the held coordinates: fill, outline, singularities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.questions.workspace.tables import curves
from mechdesign.report.figures import style
from mechdesign.report.figures.framing import BELOW, LEFT, PLANE, RIGHT, Window, extent, windows
from mechdesign.report.figures.panels import legend_at_left
from mechdesign.results import Result, Table
from mechdesign.study import Study

Grid = tuple[Floats, Floats, Floats]

# How a piece of the boundary is drawn by what ends the region there, and loci of singularities inside, of the closure
# (parallel) and of a leg (serial): colour, dashes, width, words.
LOOKS: Mapping[str, tuple[str, Any, float, str]] = {
    "limit": (style.INK, "-", 1.5, "ends at a limit"),
    "stretched": (style.BLUE, (0, (5, 1.5)), 1.5, "a leg is stretched"),
    "folded": (style.PURPLE, (0, (2, 1)), 1.5, "a leg is folded"),
    "reach": (style.ORANGE, (0, (4, 1.2)), 1.5, "a leg is at the end of its reach"),
    "singularity": (style.VERMILION, (0, (6, 1.5, 1, 1.5)), 1.5, "ends at a singularity"),
    "other": (style.FAINT, "-", 1.5, "a piece that is left out"),
    "forward": (style.VERMILION, "-", 1.8, "parallel singularity"),
    "inverse": (style.GREEN, (0, (3, 1)), 1.8, "leg in line (serial singularity)"),
}
# Of the region itself; opaque, so that patches leave no seams.
PALE = "#D5EBF8"
LEFT_OUT = "#ECECEC"
MAX_REGIONS = 6  # that a picture shows side by side
# Free room around what is shown, as a share of its size; with a mechanism there are symbols that reach beyond points.
_PAD = 0.03
ROOM = 0.07
# Inches.
_BAR = 0.95  # of a bar of colours with its numbers
_LEGEND = 0.24
_PANEL_TITLE = 0.34
_TITLE_LINE = 0.17  # more of it
_TITLE = 0.4
_ROW_GAP = 0.28
_BESIDE = 0.15  # of a panel without labels of its own
_MAX_HEIGHT = 6.5


def places(table: Table) -> Complexes:
    """Where each row of a table lies."""
    return np.asarray(table["x"] + 1j * table["y"])


def lines(boundary: Table) -> list[Complexes]:
    """The curves of a boundary."""
    z = places(boundary)
    return [z[rows] for rows in curves(boundary)]


def pieces(path: Table) -> list[Ints]:
    """Rows of each piece of a point's path."""
    return [np.flatnonzero(path["piece"] == piece) for piece in np.unique(path["piece"])]


@dataclass(frozen=True, eq=False)
class Region:
    """The region for one value of each held coordinate: its row of the table of indices, and its part of the others.

    The title is ``platform.angle = 15 deg``, empty where nothing is held; `others` are grids and boundary of the pieces
    that are left out.
    """

    title: str
    held: Mapping[str, float]
    row: int
    local: Table
    boundary: Table
    singularities: Table | None
    others: tuple[Table, Table] | None = None

    def places(self) -> Complexes:
        """Every place of the region's grid and outline, and of what is left out."""
        return np.concatenate([places(table) for table in (self.local, self.boundary, *(self.others or ()))])


def grids(local: Table, column: str) -> Iterator[Grid]:
    """x, y and a column of each patch, shape (rays, nodes)."""
    for patch in np.unique(local["patch"]):
        rows = local["patch"] == patch
        shape = (int(local["ray"][rows].max()) + 1, int(local["node"][rows].max()) + 1)
        x, y, z = (local[name][rows].reshape(shape) for name in ("x", "y", column))
        yield x, y, z


def regions(study: Study, result: Result) -> list[Region]:
    """The regions that are not empty, in the order of the table of indices."""
    indices = result.tables["indices"]
    held = [name for name in (study.workspace.at if study.workspace else ()) if name in result.tables["local"]]
    built = []
    for row in range(len(indices)):
        values = {name: float(indices[name][row]) for name in held}
        local = result.tables["local"]
        local = local.take(local.where(**values))
        if not len(local):
            continue
        lines = result.tables.get("singularities")
        title = ", ".join(
            f"{name} = {value:g} {study.units.label(study.mechanism.quantity(name))}".strip()
            for name, value in values.items()
        )
        boundary, others = result.tables["boundary"], None
        boundary = boundary.take(boundary.where(**values))
        if study.workspace is not None and study.workspace.assembly == "same" and (local["piece"] > 1).any():
            others = local.take(local["piece"] > 1), boundary.take(boundary["piece"] > 1)
            local, boundary = local.take(local["piece"] == 1), boundary.take(boundary["piece"] == 1)
        loci = lines.take(lines.where(**values)) if lines is not None and len(lines) else None
        built.append(Region(title, values, row, local, boundary, loci, others))
    return built


def fate(kind: str, at: str) -> str:
    """What ends the region at a piece of its boundary: one of `LOOKS`."""
    if kind == "limit":
        return "limit"
    for word in ("stretched", "folded", "reach"):
        if at.endswith(word):
            return word
    return "singularity"


def outline(axes: Axes, region: Region) -> set[str]:
    """Draw a region's boundary by what ends it, and faintly the pieces left out; returns the keys of `LOOKS` drawn."""
    seen = outline_of(axes, region.boundary)
    if region.others is not None:
        local, boundary = region.others
        fill(axes, local, LEFT_OUT, zorder=0.9)
        for rows in curves(boundary):
            axes.plot(boundary["x"][rows], boundary["y"][rows], color=style.FAINT, linewidth=0.8, zorder=2.8)
        seen.add("other")
    return seen


def outline_of(axes: Axes, boundary: Table) -> set[str]:
    """Draw the curves of a boundary, coloured by what ends the region there; returns the keys of `LOOKS` drawn."""
    seen = set()
    pieces = list(curves(boundary))
    # White below keeps the gaps of dashes clean.
    for rows in pieces:
        axes.plot(boundary["x"][rows], boundary["y"][rows], color="white", linewidth=2.1, zorder=3.1)
    for rows in pieces:
        end = fate(str(boundary["kind"][rows[0]]), str(boundary["at"][rows[0]]))
        color, dashes, width, _ = LOOKS[end]
        axes.plot(boundary["x"][rows], boundary["y"][rows], color=color, linestyle=dashes, linewidth=width,
                  solid_capstyle="round", zorder=3.15)  # fmt: skip
        seen.add(end)
    return seen


def loci(axes: Axes, region: Region) -> set[str]:
    """Draw the singularities inside the region, with a pale edge that shows on every colour; returns their kinds.

    Those that end the region are drawn by `outline`.
    """
    table = region.singularities
    if table is None:
        return set()
    seen = set()
    every = [region.boundary, *(region.others or ())[1:]]
    edge = np.concatenate([places(table) for table in every])
    near = 1e-7 * float(np.abs(region.places()).max())
    for rows in curves(table):
        middle = complex(table["x"][rows[len(rows) // 2]], table["y"][rows[len(rows) // 2]])
        if len(edge) and np.abs(edge - middle).min() < near:
            continue
        kind = str(table["kind"][rows[0]])
        axes.plot(table["x"][rows], table["y"][rows], color=LOOKS[kind][0], linestyle=LOOKS[kind][1],
                  linewidth=LOOKS[kind][2], zorder=3.2,
                  marker="o" if len(rows) == 1 else "", markersize=4,
                  path_effects=[withStroke(linewidth=3.4, foreground="white")])  # fmt: skip
        seen.add(kind)
    return seen


def fill(axes: Axes, local: Table, color: str = PALE, **look: Any) -> None:
    """Fill a region: what lies between both curves of each patch."""
    for x, y, _ in grids(local, "det_J"):
        edge = [np.concatenate([side[:, 0], side[::-1, -1]]) for side in (x, y)]
        axes.fill(*edge, color=color, linewidth=0, antialiased=False, **look)


def coloured(axes: Axes, z: Complexes, values: Floats, norm: Normalize, width: float = 3.5) -> LineCollection:
    """Draw a line in the plane, coloured by values at its places."""
    ends = np.column_stack([z.real, z.imag])
    drawn = LineCollection(list(np.stack([ends[:-1], ends[1:]], axis=1)), array=values[:-1], norm=norm,
                           cmap=style.COLORMAP, linewidths=width, capstyle="round", zorder=3.26)  # fmt: skip
    axes.add_collection(drawn)
    return drawn


def some(regions: Sequence[Region]) -> list[Region]:
    """At most `MAX_REGIONS` regions, evenly spread."""
    return [regions[k] for k in np.unique(np.linspace(0, len(regions) - 1, min(len(regions), MAX_REGIONS)).astype(int))]


@dataclass(frozen=True, eq=False)
class Sheet:
    """A figure of panels of one scale, with room for a bar of colours at the right and a legend below."""

    figure: Figure
    axes: tuple[Axes, ...]
    bar: Axes | None

    def ends(self, regions: Sequence[Region]) -> None:
        """Draw what ends each region, a panel each, and its singularities, with a legend."""
        panels = list(zip(self.axes, regions, strict=True))
        self.legend(set().union(*(outline(*panel) | loci(*panel) for panel in panels)))

    def legend(self, seen: set[str]) -> None:
        """Entries in one row below the panels for what `outline` and `loci` have drawn."""
        entries = [Line2D([], [], color=color, linestyle=dashes, linewidth=width, label=words)
                   for name, (color, dashes, width, words) in LOOKS.items() if name in seen]  # fmt: skip
        if entries:
            legend_at_left(self.figure, entries, 4, columnspacing=1.4, borderaxespad=0.3)

    def color_bar(self, drawn: ScalarMappable, label: str, **options: Any) -> None:
        """What the colours of the panels mean."""
        style.color_bar(self.figure, drawn, label, cax=self.bar, **options)


def sheet(
    study: Study, places: Complexes, titles: Sequence[str], title: str, *, bar: bool, pad: float = _PAD,
    below: float = 0.0,
) -> Sheet:  # fmt: skip
    """Panels with equal axes that all show the same part of the plane, `titles` above them and `title` above all.

    Titles of panels may have several lines.
    So many inches more than a legend of what ends the region needs are left `below`.
    """
    number = len(titles)
    columns = number if number < 4 else 2 if number == 4 else 3
    if style.narrow():
        columns = 1 if number < 3 else 2
    title = style.folded(title[0].upper() + title[1:], 11.0, style.width() - LEFT - 0.1)
    rows = -(-number // columns)
    room = style.width() - RIGHT - (_BAR if bar else 0.0)
    middle, wide, tall = extent(places)
    wide, tall = wide + 2 * pad * max(wide, tall), tall + 2 * pad * max(wide, tall)
    pitch = (room - LEFT) / columns
    inside = pitch - _BESIDE if style.narrow() else room / columns - LEFT
    scale = min(inside / wide, (_MAX_HEIGHT if rows == 1 else 7.5 / rows) / tall)
    window, above, down = Window(middle, scale, scale * wide, scale * tall), 0.0, _ROW_GAP
    if number > 1:
        titles = [style.folded(words, 9.5, inside - 0.15) if style.narrow() else words for words in titles]
        above = _PANEL_TITLE + _TITLE_LINE * max(name.count("\n") for name in titles)
        down = above + _ROW_GAP
    figure, panels = windows(
        window, study.units.label("length"), number, columns, gap=pitch - window.width, above=down,
        top=_TITLE + style.line(11.0) * title.count("\n") + above - down, below=BELOW + _LEGEND + below,
    )  # fmt: skip
    outer = figure.get_figheight()
    for axes, name in zip(panels, titles, strict=True):
        axes.grid(visible=False)
        axes.set_label(PLANE)
        axes.set_title(name, loc="left", fontsize=9.5)
    figure.text(LEFT / style.width(), 1 - 0.12 / outer, title, va="top", fontsize=11)
    colors = None
    if bar:
        edge = (LEFT + window.width if number == 1 else room) + 0.15
        every = rows * window.height + (rows - 1) * down
        long, middle_up = min(every, 4.0), BELOW + _LEGEND + below + every / 2
        low = (middle_up - long / 2) / outer
        colors = figure.add_axes((edge / style.width(), low, 0.16 / style.width(), long / outer))
    return Sheet(figure, tuple(panels), colors)
