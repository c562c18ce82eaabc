"""Pictures of a workspace: maps of indices, the boundary with the mechanism in several poses, ranges of the drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from mechdesign.analyses.workspace.tables import curves
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.workspace.maps import map_figures
from mechdesign.report.figures.workspace.regions import (
    MAX_REGIONS,
    PALE,
    ROOM,
    Region,
    coloured,
    fill,
    outline_of,
    regions,
    sheet,
    some,
)
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over

# The largest speed ratios may belong to dead centres, where they grow without bounds: this share has its own colours.
_SHOWN_RATIOS = 0.97
SIDES = {"inner": style.BLUE, "outer": style.VERMILION}
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (5, 1.5, 1.5, 1.5)))
CIRCLE = ("circle_x", "circle_y", "circle_radius")
RECTANGLE = ("rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height")
_HALO = [withStroke(linewidth=2.2, foreground="white")]


def figures(study: Study, result: Result) -> Mapping[str, Figure]:
    """A map of each local index, the boundary with poses, the largest shapes inside, the drives along the boundary.

    Where several values of held coordinates are asked for, maps show them side by side and the others the first. Of a
    point with one degree of freedom its path is drawn; over a range of a held coordinate, what ends the region.
    """
    if "path" in result.tables:
        return path_figures(study, result)
    if "local" not in result.tables:
        return range_figures(study, result)
    found = regions(study, result)
    if not found:
        return {}
    drawn = Gallery()
    drawn.add("of indices", map_figures, study, found)
    drawn.add("workspace", workspace_figure, study, result, found[0])
    drawn.add("inscribed", inscribed_figure, study, result, found)
    if len(found[0].boundary):
        drawn.add("drives", _drives, study, found[0].boundary)
    return drawn


def workspace_figure(study: Study, result: Result, region: Region, title: str = "") -> Figure:
    """The region, its boundary by what ends it, and the mechanism with its point at places along it [S1, Fig. 6]."""
    section, mechanism = study.workspace, study.mechanism
    assert section is not None
    configuration: Configuration = result.drawn["along"]
    reached = [configuration.point(point) for point in mechanism.points]
    extent = np.concatenate([region.places(), *(place[np.isfinite(place)] for place in reached), _sketch(study)])
    where = f" at {region.title}" if region.title else ""
    title = title or f"workspace of point {section.point}{where}, the mechanism along its boundary"
    page = sheet(study, extent, [""], title, bar=False, pad=ROOM)
    (axes,) = page.axes
    fill(axes, region)
    page.ends([region])
    for index in range(len(configuration.reason)):
        draw_mechanism(axes, mechanism, configuration, index, faint=True)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=True, drives=False)
    return page.figure


def _sketch(study: Study) -> Complexes:
    """Places of all points in the sketch pose."""
    mechanism = study.mechanism
    return np.concatenate([np.ravel(mechanism.sketch_configuration.point(point)) for point in mechanism.points])


def _drives(study: Study, boundary: Table) -> Figure:
    """Drive values along the boundary over the angle of the scan [S1, Fig. 7]."""
    names = study.mechanism.drives
    figure = style.new_figure(3.4 if len(names) < 4 else 5.0)
    axes = figure.add_subplot()
    named = set()
    for number, name in enumerate(names):
        for rows in curves(boundary):
            side = str(boundary["side"][rows[0]])
            label = f"{name}, {side} boundary"
            axes.plot(boundary["theta"][rows], boundary[name][rows], color=SIDES[side],
                      linestyle=DASHES[number % len(DASHES)], label="" if label in named else label)  # fmt: skip
            named.add(label)
    axes.set_xlim(float(boundary["theta"].min()), float(boundary["theta"].max()))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=9, steps=[1, 2, 3, 4.5, 6, 9, 10]))
    axes.set_title("Drives along the boundary of the workspace", loc="left")
    axes.set_xlabel(style.axis_label("angle of the scan", study.units.label("angle")))
    units = {study.units.label(study.mechanism.quantity(name)) for name in names}
    axes.set_ylabel(style.axis_label(", ".join(names), units.pop() if len(units) == 1 else ""))
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure


def inscribed_figure(study: Study, result: Result, found: Sequence[Region]) -> Figure | None:
    """The regions with the shapes that their row of indices gives; None where it gives none."""
    table = result.tables["indices"]
    if not any(name in table for name in (*CIRCLE, *RECTANGLE)):
        return None
    shown = some(found)
    places = np.concatenate([region.places() for region in shown])
    page = sheet(study, places, [region.title for region in shown], "largest circle and rectangle in the workspace",
                 bar=False)  # fmt: skip
    unit = study.units.label("length")
    size = 9 if len(shown) == 1 else 7.5
    for axes, region in zip(page.axes, shown, strict=True):
        fill(axes, region)
        shapes: list[tuple[Patch, tuple[float, float], str, str]] = []
        if CIRCLE[0] in table:
            x, y, radius = (float(table[name][region.row]) for name in CIRCLE)
            shapes.append((Circle((x, y), radius), (x, y), f"r = {radius:.4g}", style.BLUE))
            axes.plot(x, y, "+", color=style.BLUE, zorder=4)
        if RECTANGLE[0] in table:
            x, y, width, height = (float(table[name][region.row]) for name in RECTANGLE)
            corner = (x - width / 2, y - height / 2)
            shapes.append((Rectangle(corner, width, height), corner, f"{width:.4g} x {height:.4g}", style.GREEN))
        for shape, place, words, color in shapes:
            if np.isfinite(place).all():
                shape.set(edgecolor=color, facecolor="none", linewidth=1.6, zorder=4)
                axes.add_patch(shape)
                axes.annotate(f"{words} {unit}".strip(), place, (4, 4), textcoords="offset points", color=color,
                              fontsize=size, zorder=5, path_effects=_HALO)  # fmt: skip
    page.ends(shown)
    return page.figure


def path_figures(study: Study, result: Result) -> dict[str, Figure]:
    """``path``: the mechanism with the point's path, coloured by its speed ratio; ``speed_ratio`` over the drive."""
    path = result.tables["path"]
    return {"path": _path(study, path), "speed_ratio": _speed(study, path)}


def _pieces(path: Table) -> list[Ints]:
    return [np.flatnonzero(path["piece"] == piece) for piece in np.unique(path["piece"])]


def _ends(ratio: Floats) -> tuple[float, bool]:
    """The largest value with a colour of its own, and whether a tail lies beyond it."""
    finite = ratio[np.isfinite(ratio)]
    high, top = float(np.quantile(finite, _SHOWN_RATIOS)), float(finite.max())
    return (high, True) if top > 1.5 * high or len(finite) < len(ratio) else (top, False)


def _label(path: Table) -> str:
    return style.axis_label("speed ratio", path.column("speed_ratio").unit)


def _path(study: Study, path: Table) -> Figure:
    mechanism, section = study.mechanism, study.workspace
    assert section is not None
    z = path["x"] + 1j * path["y"]
    title = f"path of point {section.point}, by its speed over the drive's"
    page = sheet(study, np.concatenate([z, _sketch(study)]), [""], title, bar=True, pad=ROOM)
    (axes,) = page.axes
    ratio = path["speed_ratio"]
    top, tail = _ends(ratio)
    norm = Normalize(0.0, top)
    for rows in _pieces(path):
        axes.plot(z[rows].real, z[rows].imag, color=style.INK, linewidth=5.5, solid_capstyle="round", zorder=3.25)
        coloured(axes, z[rows], ratio[rows], norm, 4)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), _label(path), extend="max" if tail else "neither")
    return page.figure


def _speed(study: Study, path: Table) -> Figure:
    drive = study.mechanism.drives[0]
    figure = style.new_figure(3.4)
    axes = figure.add_subplot()
    pieces = _pieces(path)
    for rows, color in zip(pieces, style.PALETTE * len(pieces), strict=False):
        axes.plot(
            path[drive][rows], path["speed_ratio"][rows], color=color, label=f"piece {int(path['piece'][rows[0]])}"
        )
    top, tail = _ends(path["speed_ratio"])
    axes.set_ylim(0, 1.3 * top if tail else None)
    axes.set_title("Speed of the point over that of the drive", loc="left")
    axes.set_xlabel(style.axis_label(drive, study.units.label(study.mechanism.quantity(drive))))
    axes.set_ylabel(_label(path))
    axes.margins(x=0.01)
    if len(pieces) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure


def range_figures(study: Study, result: Result) -> dict[str, Figure]:
    """``workspace``: the region and what ends it, with the sketch; ``range``: which value decides there."""
    section = study.workspace
    assert section is not None
    (name, over), *_ = ((name, values) for name, values in section.at.items() if isinstance(values, Over))
    indices, boundary = result.tables["indices"], result.tables["boundary"]
    others = [other for other in section.at if other != name and other in indices]
    rows = [{other: float(indices[other][row]) for other in others} for row in range(len(indices))]
    shown = [(values, boundary.take(boundary.where(**values))) for values in rows]
    shown = [(values, table) for values, table in shown if len(table)][:MAX_REGIONS]
    titles = [", ".join(f"{other} = {value:g}" for other, value in values.items()) for values, _ in shown]
    unit = study.units.label(study.mechanism.quantity(name))
    ends = f"{name} from {over.from_:g} to {over.to:g} {unit}".strip()
    title = f"point {section.point} {'at every' if over.all else 'at some'} {ends}"
    tables = [table for _, table in shown]
    return {
        "workspace": _region(study, tables, titles, title),
        "range": _deciding(study, tables, titles, name, style.axis_label(name, unit)),
    }


def _places(tables: Sequence[Table]) -> Complexes:
    return np.concatenate([table["x"] + 1j * table["y"] for table in tables])


def _region(study: Study, tables: Sequence[Table], titles: Sequence[str], title: str) -> Figure:
    mechanism = study.mechanism
    page = sheet(study, np.concatenate([_places(tables), _sketch(study)]), titles, title, bar=False, pad=ROOM)
    seen: set[str] = set()
    for axes, table in zip(page.axes, tables, strict=True):
        axes.add_patch(PathPatch(_area(table), facecolor=PALE, linewidth=0, zorder=0.5))
        seen |= outline_of(axes, table)
        alone = len(tables) == 1
        draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=alone, drives=False, faint=not alone)
    page.legend(seen)
    return page.figure


def _deciding(study: Study, tables: Sequence[Table], titles: Sequence[str], name: str, label: str) -> Figure:
    page = sheet(study, _places(tables), titles, f"the {name} that ends the region", bar=True)
    every = np.concatenate([table[name] for table in tables])
    norm = Normalize(float(every.min()), float(every.max()))
    for axes, table in zip(page.axes, tables, strict=True):
        axes.add_patch(PathPatch(_area(table), facecolor="#F2F2F2", linewidth=0, zorder=0.5))
        for rows in curves(table):
            coloured(axes, table["x"][rows] + 1j * table["y"][rows], table[name][rows], norm)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), label)
    return page.figure


def _area(table: Table) -> Path:
    """What the curves of a boundary enclose: curves joined end to end, and holes by the even-odd rule."""
    pieces = [table["x"][rows] + 1j * table["y"][rows] for rows in curves(table)]
    vertices, codes = [], []
    for loop in loops(pieces):
        vertices.append(np.column_stack([loop.real, loop.imag]))
        codes += [Path.MOVETO, *[Path.LINETO] * (len(loop) - 2), Path.CLOSEPOLY]
    return Path(np.concatenate(vertices), codes)


def loops(pieces: Sequence[Complexes]) -> list[Complexes]:
    """Curves joined where an end of one lies at an end of another, each loop closed.

    Parameters
    ----------
    pieces : sequence of ndarray of complex
        In any order and direction; what stays open is closed by a straight line.
    """
    left = [piece for piece in pieces if len(piece) > 1]
    near = 1e-6 * max((float(np.abs(piece - piece[0]).max()) for piece in left), default=1.0)
    found = []
    while left:
        loop = left.pop(0)
        while left:
            gaps = np.abs([(piece[0] - loop[-1], piece[-1] - loop[-1]) for piece in left])
            which, end = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
            if gaps[which, end] > near and abs(loop[0] - loop[-1]) <= gaps[which, end]:
                break
            piece = left.pop(int(which))
            loop = np.concatenate([loop, piece[::-1] if end else piece])
        found.append(np.append(loop, loop[0]))
    return found
