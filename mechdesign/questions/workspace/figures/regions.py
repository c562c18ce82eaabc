"""Regions of a workspace for pictures, one for each value of the held coordinates: fill, outline, singularities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke

from mechdesign.drawing import style
from mechdesign.drawing.contours import Grid
from mechdesign.drawing.framing import extent
from mechdesign.drawing.marks import Own, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane, round_down
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints, evenly
from mechdesign.ground.results import Result, Table
from mechdesign.questions.workspace.tables import curves
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
_MAX_COLUMNS = 3
_LETTERS = 30  # of the title of a panel beside others


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
class HeldRegion:
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


def regions(study: Study, result: Result) -> list[HeldRegion]:
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
        built.append(HeldRegion(title, values, row, local, boundary, loci, others))
    return built


def fate(kind: str, at: str) -> str:
    """What ends the region at a piece of its boundary: one of `LOOKS`."""
    if kind == "limit":
        return "limit"
    for word in ("stretched", "folded", "reach"):
        if at.endswith(word):
            return word
    return "singularity"


def region_marks(region: HeldRegion) -> Iterator[PanelMark]:
    """A region's boundary by what ends it, faintly the pieces left out, and the singularities inside."""
    boundary = region.boundary
    ends: dict[str, list[Ints]] = {}
    for rows in curves(boundary):
        ends.setdefault(fate(str(boundary["kind"][rows[0]]), str(boundary["at"][rows[0]])), []).append(rows)
    # White below keeps the gaps of dashes clean.
    every = [rows for pieces in ends.values() for rows in pieces]
    yield _joined(boundary, every, "", {"color": "white", "linewidth": 2.1, "zorder": 3.1})
    for end, pieces in ends.items():
        color, dashes, width, words = LOOKS[end]
        look = {"color": color, "linestyle": dashes, "linewidth": width, "solid_capstyle": "round", "zorder": 3.15}
        yield _joined(boundary, pieces, words, look)
    if region.others is not None:
        local, boundary = region.others
        yield Own(partial(fill, local=local, color=LEFT_OUT, zorder=0.9))
        look = {"color": style.FAINT, "linewidth": 0.8, "zorder": 2.8}
        yield _joined(boundary, list(curves(boundary)), LOOKS["other"][-1], look)
    kinds: dict[str, list[Ints]] = {}
    for rows in inner_loci(region):
        assert region.singularities is not None
        kinds.setdefault(str(region.singularities["kind"][rows[0]]), []).append(rows)
    # A pale edge shows on every colour.
    for kind, pieces in kinds.items():
        color, dashes, width, words = LOOKS[kind]
        pale = {"color": color, "zorder": 3.2, "path_effects": [withStroke(linewidth=3.4, foreground="white")]}
        assert region.singularities is not None
        long, single = ([rows for rows in pieces if (len(rows) > 1) == more] for more in (True, False))
        yield _joined(region.singularities, long, words, pale | {"linestyle": dashes, "linewidth": width})
        yield _joined(region.singularities, single, "", pale | {"linestyle": "", "marker": "o", "markersize": 4})


def _joined(table: Table, pieces: Sequence[Ints], words: str, look: Mapping[str, Any]) -> Trace:
    """Some curves of a table as one broken line."""
    x, y = (np.concatenate([np.zeros(0), *(np.append(table[name][rows], np.nan) for rows in pieces)]) for name in "xy")
    return Trace(x, y, label=words, look=look)


def inner_loci(region: HeldRegion) -> list[Ints]:
    """Rows of each curve of singularities inside the region; `outline` draws those that end it."""
    table = region.singularities
    if table is None:
        return []
    ends = np.concatenate([places(table) for table in (region.boundary, *(region.others or ())[1:])])
    near = 1e-7 * float(np.abs(region.places()).max())
    z = places(table)
    return [rows for rows in curves(table)
            if not len(ends) or np.abs(ends - z[rows[len(rows) // 2]]).min() >= near]  # fmt: skip


def fill(axes: Axes, local: Table, color: str = PALE, **look: Any) -> None:
    """Fill a region: what lies between both curves of each patch."""
    axes.grid(visible=False)
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


def some(regions: Sequence[HeldRegion]) -> list[HeldRegion]:
    """At most `MAX_REGIONS` regions, evenly spread."""
    return [regions[k] for k in evenly(len(regions), MAX_REGIONS)]


def left_out(regions: Sequence[HeldRegion]) -> str:
    """How many regions `some` leaves out, in words for the end of a title."""
    return f" ({MAX_REGIONS} of {len(regions)} shown)" if len(regions) > MAX_REGIONS else ""


def region_picture(
    study: Study, places: Complexes, panels: Sequence[tuple[str, Sequence[PanelMark]]], title: str
) -> Picture:  # fmt: skip
    """Panels of marks under titles, which may have several lines, that all show the same part of the plane.

    The axes are equal, unless what is shown is a thin strip; the title says so.
    """
    _, wide, tall = extent(places)
    stretch = stretch_of(wide / tall)
    if stretch != 1.0:
        title += f"; {'y' if stretch > 1 else 'x'} drawn {max(stretch, 1 / stretch):g} times larger"
    titles, name = panel_titles([words for words, _ in panels], _LETTERS)
    title += f"; panels: values of {name}" * bool(name and len(panels) > 1)
    shown = [drawn_plane(marks, places, study, words, stretch=stretch, followed=True)
             for words, (_, marks) in zip(titles, panels, strict=True)]  # fmt: skip
    return Picture(title[0].upper() + title[1:], shown, across=_MAX_COLUMNS, share="xy" if len(panels) > 1 else "")


def panel_titles(titles: Sequence[str], letters: int) -> tuple[list[str], str]:
    """Titles ``name = value unit``, the value alone where they have more letters, and the name that is left out."""
    name, equals, _ = titles[0].partition(" = ")
    alike = equals and all(words.startswith(f"{name} = ") for words in titles)
    if not alike or max(map(len, titles)) <= letters:
        return [*titles], ""
    return [words.removeprefix(f"{name} = ") for words in titles], name


def stretch_of(ratio: float) -> float:
    """How many times larger lengths along y are drawn where width over height is `ratio`: 1, or a round number."""
    if ratio < 1:
        return 1 / stretch_of(1 / ratio)
    return round_down(ratio / _STRETCHED) if ratio > _LONGEST else 1.0
