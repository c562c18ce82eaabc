"""Regions of a workspace for pictures, one for each value of the held coordinates: fill, outline, singularities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from mechdesign.numerics.arrays import Complexes, Floats, Ints, evenly
from mechdesign.questions.workspace.tables import curves
from mechdesign.report.figures import style
from mechdesign.report.figures.framing import BELOW, LEFT, PLANE, RIGHT, Window, extent, windows
from mechdesign.report.figures.panels import legend_at_left, round_down
from mechdesign.report.figures.style import Grid
from mechdesign.results import Result, Table
from mechdesign.study import Study

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
MAX_REGIONS = 9  # that a picture shows side by side
# A region longer than so many times its width is stretched across, to about this ratio of its sides.
_LONGEST, _STRETCHED = 10.0, 1.2
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
_BESIDE, _BESIDE_NARROW = 0.45, 0.3  # of a panel without labels of its own
_TICK = 0.65  # from one number along x to the next, twice that along y
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
    boundary = region.boundary
    ends: dict[str, list[Ints]] = {}
    for rows in curves(boundary):
        ends.setdefault(fate(str(boundary["kind"][rows[0]]), str(boundary["at"][rows[0]])), []).append(rows)
    # White below keeps the gaps of dashes clean.
    every = [rows for pieces in ends.values() for rows in pieces]
    _draw(axes, boundary, every, color="white", linewidth=2.1, zorder=3.1)
    for end, pieces in ends.items():
        color, dashes, width, _ = LOOKS[end]
        _draw(axes, boundary, pieces, color=color, linestyle=dashes, linewidth=width, solid_capstyle="round",
              zorder=3.15)  # fmt: skip
    kinds = set(ends)
    if region.others is not None:
        local, boundary = region.others
        fill(axes, local, LEFT_OUT, zorder=0.9)
        _draw(axes, boundary, list(curves(boundary)), color=style.FAINT, linewidth=0.8, zorder=2.8)
        kinds.add("other")
    return kinds


def _draw(axes: Axes, table: Table, pieces: Sequence[Ints], **look: Any) -> None:
    """Draw some curves of a table as one broken line."""
    if pieces:
        axes.plot(*(np.concatenate([np.append(table[name][rows], np.nan) for rows in pieces]) for name in "xy"), **look)


def inner_loci(region: Region) -> list[Ints]:
    """Rows of each curve of singularities inside the region; `outline` draws those that end it."""
    table = region.singularities
    if table is None:
        return []
    ends = np.concatenate([places(table) for table in (region.boundary, *(region.others or ())[1:])])
    near = 1e-7 * float(np.abs(region.places()).max())
    z = places(table)
    return [rows for rows in curves(table)
            if not len(ends) or np.abs(ends - z[rows[len(rows) // 2]]).min() >= near]  # fmt: skip


def loci(axes: Axes, region: Region) -> set[str]:
    """Draw the singularities inside the region, with a pale edge that shows on every colour; returns their kinds."""
    table = region.singularities
    if table is None:
        return set()
    kinds: dict[str, list[Ints]] = {}
    for rows in inner_loci(region):
        kinds.setdefault(str(table["kind"][rows[0]]), []).append(rows)
    for kind, pieces in kinds.items():
        color, dashes, width, _ = LOOKS[kind]
        look: dict[str, Any] = {
            "color": color,
            "zorder": 3.2,
            "path_effects": [withStroke(linewidth=3.4, foreground="white")],
        }
        _draw(axes, table, [rows for rows in pieces if len(rows) > 1], linestyle=dashes, linewidth=width, **look)
        _draw(axes, table, [rows for rows in pieces if len(rows) == 1], linestyle="", marker="o", markersize=4, **look)
    return set(kinds)


def fill(axes: Axes, local: Table, color: str = PALE, **look: Any) -> None:
    """Fill a region: what lies between both curves of each patch."""
    edges = [np.column_stack([np.concatenate([side[:, 0], side[::-1, -1]]) for side in (x, y)])
             for x, y, _ in grids(local, "det_J")]  # fmt: skip
    axes.add_collection(PolyCollection(edges, facecolors=color, linewidths=0, antialiaseds=False, **look))


def coloured(axes: Axes, z: Complexes, values: Floats, norm: Normalize, width: float = 3.5) -> LineCollection:
    """Draw a line in the plane, coloured by values at its places."""
    ends = np.column_stack([z.real, z.imag])
    drawn = LineCollection(list(np.stack([ends[:-1], ends[1:]], axis=1)), array=values[:-1], norm=norm,
                           cmap=style.COLORMAP, linewidths=width, capstyle="round", zorder=3.26)  # fmt: skip
    axes.add_collection(drawn)
    return drawn


def some(regions: Sequence[Region]) -> list[Region]:
    """At most `MAX_REGIONS` regions, evenly spread."""
    return [regions[k] for k in evenly(len(regions), MAX_REGIONS)]


def left_out(regions: Sequence[Region]) -> str:
    """How many regions `some` leaves out, in words for the end of a title."""
    return f" ({MAX_REGIONS} of {len(regions)} shown)" if len(regions) > MAX_REGIONS else ""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A figure of panels of one scale, with room for a bar of colours at the right and a legend below.

    Along y lengths are drawn `stretch` times as large as along x.
    """

    figure: Figure
    axes: tuple[Axes, ...]
    bar: Axes | None
    stretch: float

    def ends(self, regions: Sequence[Region]) -> None:
        """Draw what ends each region, a panel each, and its singularities, with a legend."""
        panels = list(zip(self.axes, regions, strict=True))
        self.legend(set().union(*(outline(*panel) | loci(*panel) for panel in panels)))

    def legend(self, kinds: set[str]) -> None:
        """Entries in one row below the panels for what `outline` and `loci` have drawn."""
        entries = [Line2D([], [], color=color, linestyle=dashes, linewidth=width, label=words)
                   for name, (color, dashes, width, words) in LOOKS.items() if name in kinds]  # fmt: skip
        if entries:
            legend_at_left(self.figure, entries, 4, columnspacing=1.4, borderaxespad=0.3)

    def color_bar(self, drawn: ScalarMappable, label: str, **options: Any) -> None:
        """What the colours of the panels mean."""
        style.color_bar(self.figure, drawn, label, cax=self.bar, **options)


def sheet(
    study: Study, places: Complexes, titles: Sequence[str], title: str, *, bar: bool, pad: float = _PAD,
    below: float = 0.0,
) -> Sheet:  # fmt: skip
    """Panels that all show the same part of the plane, `titles` above them and `title` above all.

    Titles of panels may have several lines. So many inches more than a legend of what ends the region needs are left
    `below`. The axes are equal, unless what is shown is a thin strip; the title says so.
    """
    number = len(titles)
    middle, wide, tall = extent(places)
    stretch = stretch_of(wide / tall)
    tall *= stretch
    columns = number if number < 4 else 2 if number == 4 else 3
    if style.narrow() or (number > 1 and wide > 2 * tall):
        columns = 1 if number < 3 else 2
    if stretch != 1.0:
        title += f"; {'y' if stretch > 1 else 'x'} drawn {max(stretch, 1 / stretch):g} times larger"
    rows = -(-number // columns)
    room = style.width() - RIGHT - (_BAR if bar else 0.0)
    wide, tall = wide + 2 * pad * max(wide, tall), tall + 2 * pad * max(wide, tall)
    pitch = (room - LEFT) / columns
    inside = room / columns - LEFT if columns < 3 else pitch - _BESIDE
    if style.narrow():
        inside = pitch - _BESIDE_NARROW
    above, down = 0.0, _ROW_GAP
    if number > 1:
        titles, name = panel_titles(titles, inside)
        title += f"; panels: values of {name}" * bool(name)
        above = _PANEL_TITLE + _TITLE_LINE * max(name.count("\n") for name in titles)
        down = above + _ROW_GAP
    title = style.folded(title[0].upper() + title[1:], 11.0, style.width() - LEFT - 0.1)
    top = _TITLE + style.line(11.0) * title.count("\n")
    below += BELOW + _LEGEND
    free = style.tallest() - top - above - (rows - 1) * down - below
    scale = min(inside / wide, min(_MAX_HEIGHT if rows == 1 else 7.5, free) / rows / tall)
    window = Window(middle, scale, scale * wide, scale * tall)
    figure, panels = windows(
        window, study.units.label("length"), number, columns, gap=pitch - window.width, above=down,
        top=top + above - down, below=below, stretch=stretch,
    )  # fmt: skip
    outer = figure.get_figheight()
    for axes, name in zip(panels, titles, strict=True):
        axes.grid(visible=False)
        axes.set_label(PLANE)
        axes.set_title(name, loc="left", fontsize=9.5)
        axes.locator_params(axis="x", nbins=max(1, int(window.width / _TICK)))
        axes.locator_params(axis="y", nbins=max(1, int(2 * window.height / _TICK)))
    figure.text(LEFT / style.width(), 1 - 0.12 / outer, title, va="top", fontsize=11)
    colors = None
    if bar:
        edge = (LEFT + window.width if number == 1 else room) + 0.15
        every = rows * window.height + (rows - 1) * down
        long, middle_up = min(every, 4.0), below + every / 2
        low = (middle_up - long / 2) / outer
        colors = figure.add_axes((edge / style.width(), low, 0.16 / style.width(), long / outer))
    return Sheet(figure, tuple(panels), colors, stretch)


def panel_titles(titles: Sequence[str], room: float, most: int = 2) -> tuple[list[str], str]:
    """Titles ``name = value unit`` in lines of so many inches; the value alone where these are more than `most`.

    The name that is left out is returned as well, else nothing.
    """
    name, equals, _ = titles[0].partition(" = ")
    long = style.folded(titles[0].partition("\n")[0], 9.5, room).count("\n") >= most
    if not (long and equals and all(words.startswith(f"{name} = ") for words in titles)):
        name = ""
    return [style.folded(words.removeprefix(f"{name} = "), 9.5, room) for words in titles], name


def stretch_of(ratio: float) -> float:
    """How many times larger lengths along y are drawn where width over height is `ratio`: 1, or a round number."""
    if ratio < 1:
        return 1 / stretch_of(1 / ratio)
    return round_down(ratio / _STRETCHED) if ratio > _LONGEST else 1.0
