"""Regions of a workspace as pictures need them, one a value of the held coordinates: fill, outline, singularities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from mechdesign.analyses.workspace.shown import curves
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.report.figures import style
from mechdesign.results import Result, Table
from mechdesign.study import Study

Grid = tuple[Floats, Floats, Floats]

# How a piece of the boundary is drawn by what ends the region there: colour, dashes, words.
FATES: Mapping[str, tuple[str, object, str]] = {
    "limit": (style.INK, "-", "ends at a limit"),
    "stretched": (style.BLUE, (0, (5, 1.5)), "a leg is stretched"),
    "folded": (style.PURPLE, (0, (2, 1)), "a leg is folded"),
    "reach": (style.ORANGE, (0, (4, 1.2)), "a leg is at the end of its reach"),
    "singularity": (style.VERMILION, (0, (6, 1.5, 1, 1.5)), "ends at a singularity"),
    "other": (style.FAINT, "-", "a piece that is left out"),
}
# Loci of singularities inside: of the closure (parallel) and of a leg (serial).
LOCI: Mapping[str, tuple[str, str]] = {
    "forward": (style.VERMILION, "parallel singularity"),
    "inverse": (style.GREEN, "leg in line (serial singularity)"),
}
# Of the region itself; opaque, so that patches leave no seams.
PALE = "#D5EBF8"
LEFT_OUT = "#ECECEC"
_LEFT, _RIGHT, _TOP, _BELOW, _BAR, _LEGEND = 0.72, 0.12, 0.34, 0.52, 0.95, 0.24
_TALLEST = 6.5
# Regions that a picture shows side by side.
MOST = 6
# Free room around what is shown, as a share of its size; with a mechanism there are symbols that reach beyond points.
_PAD, ROOM = 0.03, 0.07


@dataclass(frozen=True, eq=False)
class Region:
    """The region for one value of each held coordinate.

    Parameters
    ----------
    title : str
        ``platform.angle = 15 deg``; empty where nothing is held.
    held : mapping of str to float
    row : int
        Its row of the table of indices.
    others : (Table, Table) or None
        Grids and boundary of pieces that are left out.
    """

    title: str
    held: Mapping[str, float]
    row: int
    local: Table
    boundary: Table
    singularities: Table | None
    others: tuple[Table, Table] | None = None

    def grids(self, column: str) -> Iterator[Grid]:
        """x, y and a column of each patch, shape (rays, nodes)."""
        return _grids(self.local, column)

    def places(self) -> Complexes:
        """Every place of the region's grid and outline, and of what is left out."""
        found = [table["x"] + 1j * table["y"] for table in (self.local, self.boundary, *(self.others or ()))]
        return np.concatenate(found)


def _grids(local: Table, column: str) -> Iterator[Grid]:
    for patch in np.unique(local["patch"]):
        rows = local["patch"] == patch
        shape = (int(local["ray"][rows].max()) + 1, int(local["node"][rows].max()) + 1)
        x, y, z = (local[name][rows].reshape(shape) for name in ("x", "y", column))
        yield x, y, z


def regions(study: Study, result: Result) -> list[Region]:
    """The regions that are not empty, in the order of the table of indices."""
    indices = result.tables["indices"]
    held = [name for name in (study.workspace.at if study.workspace else ()) if name in result.tables["local"]]
    found = []
    for row in range(len(indices)):
        values = {name: float(indices[name][row]) for name in held}
        local = pick(result.tables["local"], values)
        if not len(local):
            continue
        lines = result.tables.get("singularities")
        title = ", ".join(
            f"{name} = {value:g} {study.units.label(study.mechanism.quantity(name))}".strip()
            for name, value in values.items()
        )
        boundary, others = pick(result.tables["boundary"], values), None
        if study.workspace is not None and study.workspace.assembly == "same" and (local["piece"] > 1).any():
            others = local.take(local["piece"] > 1), boundary.take(boundary["piece"] > 1)
            local, boundary = local.take(local["piece"] == 1), boundary.take(boundary["piece"] == 1)
        loci = pick(lines, values) if lines is not None and len(lines) else None
        found.append(Region(title, values, row, local, boundary, loci, others))
    return found


def pick(table: Table, values: Mapping[str, float]) -> Table:
    """Rows of a table in which columns have these values."""
    rows = np.ones(len(table), dtype=bool)
    for name, value in values.items():
        rows &= table[name] == value
    return table.take(rows)


def fate(kind: str, at: str) -> str:
    """What ends the region at a piece of its boundary: one of `FATES`."""
    if kind == "limit":
        return "limit"
    for word in ("stretched", "folded", "reach"):
        if at.endswith(word):
            return word
    return "singularity"


def outline(axes: Axes, region: Region, *, width: float = 1.5) -> set[str]:
    """Draw a region's boundary, coloured by what ends it, and faintly what is left out; returns what occurs."""
    seen = outline_of(axes, region.boundary, width=width)
    if region.others is not None:
        local, boundary = region.others
        for x, y, _ in _grids(local, "det_J"):
            axes.fill(*_edge(x, y), color=LEFT_OUT, linewidth=0, antialiased=False, zorder=0.9)
        for rows in curves(boundary):
            axes.plot(boundary["x"][rows], boundary["y"][rows], color=style.FAINT, linewidth=0.8, zorder=2.8)
        seen.add("other")
    return seen


def outline_of(axes: Axes, boundary: Table, *, width: float = 1.5) -> set[str]:
    """Draw the curves of a table, coloured by what ends the region there; returns the fates that occur."""
    seen = set()
    pieces = list(curves(boundary))
    # White below keeps the gaps of dashes clean.
    for rows in pieces:
        axes.plot(boundary["x"][rows], boundary["y"][rows], color="white", linewidth=width + 0.6, zorder=3.1)
    for rows in pieces:
        found = fate(str(boundary["kind"][rows[0]]), str(boundary["at"][rows[0]]))
        color, dashes, _ = FATES[found]
        axes.plot(boundary["x"][rows], boundary["y"][rows], color=color, linestyle=dashes, linewidth=width,
                  solid_capstyle="round", zorder=3.15)  # fmt: skip
        seen.add(found)
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
    edge = np.concatenate([table["x"] + 1j * table["y"] for table in every])
    near = 1e-7 * float(np.abs(region.places()).max())
    for rows in curves(table):
        middle = complex(table["x"][rows[len(rows) // 2]], table["y"][rows[len(rows) // 2]])
        if len(edge) and np.abs(edge - middle).min() < near:
            continue
        kind = str(table["kind"][rows[0]])
        axes.plot(table["x"][rows], table["y"][rows], color=LOCI[kind][0], linewidth=1.8, zorder=3.2,
                  marker="o" if len(rows) == 1 else "", markersize=4,
                  path_effects=[withStroke(linewidth=3.4, foreground="white")])  # fmt: skip
        seen.add(kind)
    return seen


def fill(axes: Axes, region: Region) -> None:
    """Fill the region in a pale colour."""
    for x, y, _ in region.grids("det_J"):
        axes.fill(*_edge(x, y), color=PALE, linewidth=0, antialiased=False)


def _edge(x: Floats, y: Floats) -> list[Floats]:
    """Coordinates along both curves of a patch."""
    return [np.concatenate([side[:, 0], side[::-1, -1]]) for side in (x, y)]


def some(found: Sequence[Region]) -> list[Region]:
    """Of many regions a few, spread evenly."""
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, min(len(found), MOST)).astype(int))]


@dataclass(frozen=True, eq=False)
class Sheet:
    """A figure of panels of one scale, with room for a bar of colours at the right and a legend below."""

    figure: Figure
    axes: tuple[Axes, ...]
    bar: Axes | None

    def ends(self, found: Sequence[Region]) -> None:
        """Draw what ends each region, a panel each, and its singularities, with a legend."""
        fates, kinds = set[str](), set[str]()
        for axes, region in zip(self.axes, found, strict=True):
            fates |= outline(axes, region)
            kinds |= loci(axes, region)
        self.legend(fates, kinds)

    def legend(self, fates: set[str], kinds: set[str]) -> None:
        """Entries in one row below the panels for what `outline` and `loci` have drawn."""
        lines = [(color, dashes, 1.5, words) for name, (color, dashes, words) in FATES.items() if name in fates]
        lines += [(color, "-", 1.8, words) for kind, (color, words) in LOCI.items() if kind in kinds]
        entries = [Line2D([], [], color=color, linestyle=dashes, linewidth=width, label=words)  # type: ignore[arg-type]
                   for color, dashes, width, words in lines]  # fmt: skip
        if entries:
            self.figure.legend(handles=entries, loc="lower left", ncols=4, columnspacing=1.4, borderaxespad=0.3,
                               bbox_to_anchor=(_LEFT / style.WIDTH - 0.02, 0.0))  # fmt: skip

    def color_bar(self, drawn: ScalarMappable, label: str, **options: Any) -> None:
        """What the colours of the panels mean."""
        bar = self.figure.colorbar(drawn, cax=self.bar, **options)
        bar.set_label(label)
        bar.outline.set_visible(False)


def sheet(study: Study, places: Complexes, titles: Sequence[str], title: str, *, bar: bool, pad: float = _PAD) -> Sheet:
    """Panels with equal axes that all show the same part of the plane, `titles` above them and `title` above all."""
    number = len(titles)
    x, y = places.real, places.imag
    pad = pad * max(float(np.ptp(x)), float(np.ptp(y)), 1e-12)
    wide, tall = float(np.ptp(x)) + 2 * pad, float(np.ptp(y)) + 2 * pad
    columns = number if number < 4 else 2 if number == 4 else 3
    rows = -(-number // columns)
    room = style.WIDTH - _RIGHT - (_BAR if bar else 0.0)
    scale = min((room - _LEFT * columns) / columns / wide, (_TALLEST if rows == 1 else 7.5 / rows) / tall)
    width, height = scale * wide, scale * tall
    above = _TOP if number > 1 else 0.0
    outer = 0.4 + rows * (height + above) + (rows - 1) * 0.28 + _BELOW + _LEGEND
    figure = style.new_figure(style.WIDTH, outer, layout=None)
    step = (room - _LEFT) / columns
    panels = []
    for k, name in enumerate(titles):
        column, row = k % columns, k // columns
        left = _LEFT + column * step + max(0.0, (step - _LEFT - width) / 2) * (number > 1)
        low = _LEGEND + _BELOW + (rows - 1 - row) * (height + above + 0.28)
        axes = figure.add_axes((left / style.WIDTH, low / outer, width / style.WIDTH, height / outer))
        axes.set_xlim(float(x.min()) - pad, float(x.max()) + pad)
        axes.set_ylim(float(y.min()) - pad, float(y.max()) + pad)
        axes.set_aspect("equal")
        axes.grid(visible=False)
        axes.set_title(name, loc="left", fontsize=9.5)
        unit = study.units.label("length")
        if row == rows - 1 or k + columns >= number:
            axes.set_xlabel(style.axis_label("x", unit))
        if column == 0:
            axes.set_ylabel(style.axis_label("y", unit))
        panels.append(axes)
    figure.text(_LEFT / style.WIDTH, 1 - 0.12 / outer, title[0].upper() + title[1:], va="top", fontsize=11)
    colors = None
    if bar:
        edge = (_LEFT + (columns - 1) * step + width if number == 1 else room) + 0.15
        long = min(rows * (height + above + 0.28) - above - 0.28, 4.0)
        middle = _LEGEND + _BELOW + (rows * (height + above + 0.28) - above - 0.28) / 2
        colors = figure.add_axes((edge / style.WIDTH, (middle - long / 2) / outer, 0.16 / style.WIDTH, long / outer))
    return Sheet(figure, tuple(panels), colors)
