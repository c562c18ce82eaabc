"""Pictures of a workspace: maps of indices, the boundary with the mechanism in several poses, ranges of the drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.workspace.tables import curves
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.report.before import Before, known
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.labels import paper
from mechdesign.report.figures.overlay import draw_line, draw_pose, name_both
from mechdesign.report.figures.panels import (
    MAX_PANELS,
    Along,
    coordinate_label,
    legend_below,
    node_areas,
    stack,
    tick_abscissa,
)
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.workspace.ellipses import ellipses_figure
from mechdesign.report.figures.workspace.regions import (
    MAX_REGIONS,
    PALE,
    ROOM,
    Grid,
    Region,
    coloured,
    fill,
    grids,
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
SIDES = ("inner", "outer")
# Of the drives.
LINE_COLORS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)
DASHES: tuple[Any, ...] = ("-", (0, (6, 1)), (0, (6, 1, 1.5, 1)), (0, (2, 1)))
_DRIVES_HEIGHT = 1.9  # inches
_SMALL_SYMBOLS = 0.7
CIRCLE = ("circle_x", "circle_y", "circle_radius")
RECTANGLE = ("rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height")
_HALO = [withStroke(linewidth=2.2, foreground="white")]
# Columns of the table that are no indices, beside the held coordinates.
_NO_INDEX = ("x", "y", "det_J", "patch", "ray", "node", "piece")
# An index whose largest values are a thin tail is cut off above this share of the area, which the bar shows.
_SHOWN_AREA = 0.96
# Points on paper between the name of a level and lines of other levels, and other names.
CLEAR_OF_LINES = 5.0
CLEAR_OF_NAMES = 18.0


def figures(study: Study, result: Result) -> Mapping[str, Figure]:
    """A map of each local index, the boundary with poses, the largest shapes inside, the drives along the boundary.

    Several values of held coordinates stand side by side. Of a point with one degree of freedom its path is drawn; over
    a range of a held coordinate, what ends the region.
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
    if len(found) == 1:
        drawn.add("workspace", workspace_figure, study, result, found[0])
        drawn.add("ellipses", ellipses_figure, study, found[0], result.drawn["ellipses"])
    else:
        drawn.add("workspace", _side_by_side, study, found, known(result.drawn))
    drawn.add("inscribed", inscribed_figure, study, result, found)
    if any(len(region.boundary) for region in found):
        drawn.add("drives", drives_figure, study, found)
    return drawn


def workspace_figure(study: Study, result: Result, region: Region, title: str = "") -> Figure:
    """The region, its boundary by what ends it, and the mechanism with its point at places along it [S1, Fig. 6]."""
    section, mechanism = study.workspace, study.mechanism
    assert section is not None
    configuration: Configuration = result.drawn["along"]
    reached = [configuration.point(point) for point in mechanism.points]
    before = known(result.drawn)
    extent = np.concatenate(
        [region.places(), *(place[np.isfinite(place)] for place in reached), _sketch(study), _places_before(before)]
    )
    where = f" at {region.title}" if region.title else ""
    title = title or f"workspace of point {section.point}{where}, the mechanism along its boundary"
    page = sheet(study, extent, [""], title, bar=False, pad=ROOM)
    (axes,) = page.axes
    fill(axes, region.local)
    page.ends([region])
    if before is not None:
        _draw_before(axes, before)
    for index in range(len(configuration.reason)):
        draw_mechanism(axes, mechanism, configuration, index, faint=True)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=True, drives=False)
    if before is not None:
        name_both(page.figure, before)
    return page.figure


def _lines_before(before: Before, held: Mapping[str, float] | None = None) -> list[Complexes]:
    """Curves that end the region of the study before, for values of held coordinates if they are given; its path."""
    tables, found = before.result.tables, []
    if "path" in tables:
        path = tables["path"]
        found = [(path["x"] + 1j * path["y"])[rows] for rows in _pieces(path)]
    elif "boundary" in tables:
        edge = tables["boundary"]
        edge = edge.take(edge.where(**{name: value for name, value in (held or {}).items() if name in edge}))
        found = [(edge["x"] + 1j * edge["y"])[rows] for rows in curves(edge)]
    return found


def _places_before(before: Before | None) -> Complexes:
    places = [*_lines_before(before), _sketch(before.study)] if before is not None else []
    return np.concatenate([np.empty(0, dtype=complex), *places])


def _draw_before(axes: Axes, before: Before, held: Mapping[str, float] | None = None) -> None:
    """The boundary or the path of the study before; where nothing is held, its mechanism in its sketch pose."""
    for line in _lines_before(before, held):
        draw_line(axes, line, 1.8)
    if held:
        return
    mechanism = before.study.mechanism
    draw_pose(axes, mechanism, mechanism.sketch_configuration)


def _sketch(study: Study) -> Complexes:
    """Places of all points in the sketch pose."""
    mechanism = study.mechanism
    return np.concatenate([np.ravel(mechanism.sketch_configuration.point(point)) for point in mechanism.points])


def _side_by_side(study: Study, found: Sequence[Region], before: Before | None) -> Figure:
    """The region and its boundary for several values of held coordinates, each with the mechanism in a pose there."""
    title = "the mechanism where it is best conditioned"
    return regions_figure([(region.title, study, region) for region in some(found)], title, before)


def regions_figure(parts: Sequence[tuple[str, Study, Region]], title: str, before: Before | None = None) -> Figure:
    """Regions of some studies side by side on one scale, each under its words with the mechanism in a pose there."""
    study, shown = parts[0][1], [region for _, _, region in parts]
    assert study.workspace is not None
    poses = [_pose_inside(own, region) for _, own, region in parts]
    reached = [np.ravel(each.point(point)) for each in poses for point in study.mechanism.points]
    places = np.concatenate([*(region.places() for region in shown), *(z[np.isfinite(z)] for z in reached),
                             _places_before(before)])  # fmt: skip
    title = f"workspace of point {study.workspace.point}, {title}"
    page = sheet(study, places, [words for words, _, _ in parts], title, bar=False, pad=ROOM)
    for axes, (_, own, region), configuration in zip(page.axes, parts, poses, strict=True):
        fill(axes, region.local)
        draw_mechanism(axes, own.mechanism, configuration, faint=True, size=_SMALL_SYMBOLS)
        if before is not None:
            _draw_before(axes, before, region.held)
    page.ends(shown)
    if before is not None:
        name_both(page.figure, before)
    return page.figure


def _pose_inside(study: Study, region: Region) -> Configuration:
    """The pose at the node of a region where the Jacobian is conditioned best."""
    assert study.workspace is not None
    mechanism, point, local = study.mechanism, study.workspace.point, region.local
    best = int(np.argmax(np.nan_to_num(local["inverse_condition"], nan=-1.0)))
    given = {f"{point}.x": local["x"][best], f"{point}.y": local["y"][best], **region.held}
    plan = mechanism.plan(tuple(given))
    values = [np.atleast_1d(radians(study, mechanism.coordinate(name), value)) for name, value in given.items()]
    return plan.solve(values, limits=False)


def drives_figure(study: Study, found: Sequence[Region]) -> Figure:
    """Drive values along the boundary over the angle of the scan [S1, Fig. 7]: a panel a side of each region."""
    names, mechanism = study.mechanism.drives, study.mechanism
    parts = [
        (region.boundary, side, region.title)
        for region in some([region for region in found if len(region.boundary)])
        for side in SIDES
        if (region.boundary["side"] == side).any()
    ][:MAX_PANELS]
    label = style.axis_label("angle of the ray from the centre of the scan", study.units.label("angle"))
    figure, panels = stack(len(parts), "Drives along the boundary of the workspace", label, tall=_DRIVES_HEIGHT)
    units = {study.units.label(mechanism.quantity(name)) for name in names}
    limits: dict[float, list[str]] = {}
    for bound in mechanism.bounds:
        for end in bound.ends(mechanism.nominal) if bound.drive else ():
            if end is not None:
                value = round(float(np.asarray(in_study_units(study, bound.coordinate, end))), 9)
                limits.setdefault(value, []).append(bound.coordinate.name)
    entries: dict[str, Line2D] = {}
    for axes, (boundary, side, where) in zip(panels, parts, strict=True):
        for number, name in enumerate(names):
            for rows in curves(boundary):
                if boundary["side"][rows[0]] != side:
                    continue
                own = boundary.take(rows)
                (entries[name],) = axes.plot(own["theta"], own[name], color=LINE_COLORS[number % len(LINE_COLORS)],
                                             linestyle=DASHES[number % len(DASHES)], linewidth=1.9)  # fmt: skip
        for limit, limited in limits.items():
            entries["limit of a drive"] = axes.axhline(limit, color=style.INK, linewidth=0.9, zorder=1.5)
            axes.annotate(", ".join(limited), (1, limit), (-2, 1.5), xycoords=axes.get_yaxis_transform(), ha="right",
                          textcoords="offset points", fontsize=7.5, path_effects=_HALO)  # fmt: skip
        axes.set_title(", ".join(filter(None, (where, f"{side} boundary"))), loc="left", fontsize=9.5)
        axes.set_ylabel(style.axis_label("drive", "".join(units) if len(units) == 1 else ""))
    every = np.concatenate([boundary["theta"] for boundary, *_ in parts])
    tick_abscissa(panels[-1], Along(every, label))
    panels[-1].set_xlim(float(every.min()), float(every.max()))
    legend_below(figure, list(entries.values()), list(entries))
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
        fill(axes, region.local)
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
    return {"path": _path(study, path, known(result.drawn)), "speed_ratio": _speed(study, path)}


def _pieces(path: Table) -> list[Ints]:
    return [np.flatnonzero(path["piece"] == piece) for piece in np.unique(path["piece"])]


def _ends(ratio: Floats) -> tuple[float, bool]:
    """The largest value with a colour of its own, and whether a tail lies beyond it."""
    finite = ratio[np.isfinite(ratio)]
    high, top = float(np.quantile(finite, _SHOWN_RATIOS)), float(finite.max())
    return (high, True) if top > 1.5 * high or len(finite) < len(ratio) else (top, False)


def _label(path: Table) -> str:
    return style.axis_label("speed ratio", path.column("speed_ratio").unit)


def _path(study: Study, path: Table, before: Before | None) -> Figure:
    mechanism, section = study.mechanism, study.workspace
    assert section is not None
    z = path["x"] + 1j * path["y"]
    title = f"path of point {section.point}, by its speed over the drive's"
    page = sheet(study, np.concatenate([z, _sketch(study), _places_before(before)]), [""], title, bar=True, pad=ROOM)
    (axes,) = page.axes
    ratio = path["speed_ratio"]
    top, tail = _ends(ratio)
    norm = Normalize(0.0, top)
    for rows in _pieces(path):
        axes.plot(z[rows].real, z[rows].imag, color=style.INK, linewidth=5.5, solid_capstyle="round", zorder=3.25)
        coloured(axes, z[rows], ratio[rows], norm, 4)
    if before is not None:
        _draw_before(axes, before)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration)
    if before is not None:
        name_both(page.figure, before)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), _label(path), extend="max" if tail else "neither")
    return page.figure


def _speed(study: Study, path: Table) -> Figure:
    drive = study.mechanism.drives[0]
    figure = style.new_figure(3.4)
    axes = figure.add_subplot()
    pieces = _pieces(path)
    looks = zip(style.PALETTE * len(pieces), DASHES * len(pieces), strict=False)
    for rows, (color, dashes) in zip(pieces, looks, strict=False):
        axes.plot(
            path[drive][rows],
            path["speed_ratio"][rows],
            color=color,
            linestyle=dashes,
            label=f"piece {int(path['piece'][rows[0]])}",
        )
    top, tail = _ends(path["speed_ratio"])
    axes.set_ylim(0, 1.3 * top if tail else None)
    axes.set_title("Speed of the point over that of the drive", loc="left")
    axes.set_xlabel(coordinate_label(study, drive))
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
        "workspace": _region(study, shown, titles, title, known(result.drawn)),
        "range": _deciding(study, tables, titles, name, style.axis_label(name, unit)),
    }


def _places(tables: Sequence[Table]) -> Complexes:
    return np.concatenate([table["x"] + 1j * table["y"] for table in tables])


def _region(
    study: Study, found: Sequence[tuple[Mapping[str, float], Table]], titles: Sequence[str], title: str,
    before: Before | None,
) -> Figure:  # fmt: skip
    mechanism, tables = study.mechanism, [table for _, table in found]
    page = sheet(
        study,
        np.concatenate([_places(tables), _sketch(study), _places_before(before)]),
        titles,
        title,
        bar=False,
        pad=ROOM,
    )
    seen: set[str] = set()
    for axes, (held, table) in zip(page.axes, found, strict=True):
        if before is not None:
            _draw_before(axes, before, held)
        axes.add_patch(PathPatch(_area(table), facecolor=PALE, linewidth=0, zorder=0.5))
        seen |= outline_of(axes, table)
        alone = len(tables) == 1
        draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=alone, drives=False, faint=not alone)
    page.legend(seen)
    if before is not None:
        name_both(page.figure, before)
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


def map_figures(study: Study, found: Sequence[Region]) -> Gallery:
    """One map an index of the table of local indices; of many regions a few, spread evenly.

    There is none of an index that is infinite everywhere.
    """
    shown = some(found)
    names = [name for name in index_columns(found[0]) if any(np.isfinite(r.local[name]).any() for r in shown)]
    maps = Gallery()
    for name in names:
        maps.add(name, _index_map, study, shown, name)
    return maps


def index_columns(region: Region) -> list[str]:
    """Names of the local indices that a region's table holds."""
    return [name for name in region.local.names if name not in _NO_INDEX and name not in region.held]


def _index_map(study: Study, found: Sequence[Region], column: str) -> Figure:
    norm = index_norm(found, column)
    told = found[0].local.column(column)
    places = np.concatenate([region.places() for region in found])
    point = study.workspace.point if study.workspace else ""
    name = column.replace("_", " ")
    page = sheet(
        study, places, [region.title for region in found], f"{name} at point {point}: {told.meaning}", bar=True
    )
    for axes, region in zip(page.axes, found, strict=True):
        contours(axes, list(grids(region.local, column)), norm, labels=len(found) == 1)
    page.ends(found)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), style.axis_label(name, told.unit), ticks=norm.boundaries)
    return page.figure


def contours(axes: Axes, patches: Sequence[Grid], norm: BoundaryNorm, *, labels: bool) -> None:
    """Filled contours over the patches of a region, each level named once, where its line is longest."""
    drawn = []
    low, high = norm.boundaries[[0, -1]]
    # Beyond the last level is where an index grows without bounds, on singularities.
    over = 2 * high - low
    for x, y, z in patches:
        shown = np.where(np.isfinite(z), np.minimum(z, over), over if norm.extend == "max" else low)
        drawn.append(style.filled(axes, x, y, shown, norm, norm.boundaries[1:]))
    if labels:
        edges = [np.concatenate([z[0], z[-1], z[:, 0], z[:, -1]]) for z in (x + 1j * y for x, y, _ in patches)]
        label_levels(axes, drawn, norm, _on_paper(axes, np.concatenate(edges)))


def label_levels(axes: Axes, drawn: Sequence[QuadContourSet], norm: BoundaryNorm, blocked: Complexes) -> None:
    """Name each level once on one of its lines, far from other lines and names; or not at all."""
    levels = norm.boundaries[1:]
    parts_of = [contour.allsegs for contour in drawn]
    lines = [[_on_paper(axes, part @ [1, 1j]) for parts in parts_of for part in parts[k]] for k in range(len(levels))]
    every = [np.concatenate(parts) if parts else np.zeros(0, dtype=complex) for parts in lines]
    taken = np.zeros(0, dtype=complex)
    for k, level in enumerate(levels):
        places = [(part[j], part[j + 1] - part[j - 1]) for part in lines[k] if len(part) > 4
                  for j in range(2, len(part) - 2, max(1, len(part) // 40)) if part[j + 1] != part[j - 1]]  # fmt: skip
        if not places:
            continue
        at, along = np.array(places).T
        others = np.concatenate([*every[:k], *every[k + 1 :], blocked])
        room = np.minimum(_nearest(at, others) / CLEAR_OF_LINES, _nearest(at, taken) / CLEAR_OF_NAMES)
        # Where there is room, upright names read best.
        best = int(np.argmax(np.minimum(room, 2.0) + np.abs(along.real) / np.abs(along)))
        if room[best] < 1:
            continue
        taken = np.append(taken, at[best])
        turn = float(np.degrees(np.angle(along[best])))
        back = colormaps[style.COLORMAP](norm(level))
        place = (at[best].real, at[best].imag)
        axes.annotate(
            f"{level:g}", place, xycoords="figure points", fontsize=7.5, ha="center", va="center",
            rotation=(turn + 90) % 180 - 90, rotation_mode="anchor", color="white" if norm(level) < 140 else style.INK,
            zorder=3.5, path_effects=[withStroke(linewidth=2.5, foreground=back)],
        )  # fmt: skip


def _on_paper(axes: Axes, places: Complexes) -> Complexes:
    """Places in points on paper."""
    return np.asarray(paper(axes, places) @ np.array([1, 1j]))


def _nearest(places: Complexes, others: Complexes) -> Floats:
    if not len(others):
        return np.full(len(places), np.inf)
    return np.asarray(np.abs(places[:, None] - others[None, :]).min(axis=1))


def index_norm(found: Sequence[Region], column: str) -> BoundaryNorm:
    """Colours between round levels from the smallest value, or zero, to the largest, or to where a thin tail begins."""
    patches = [patch for region in found for patch in grids(region.local, column)]
    values = np.concatenate([z.ravel() for _, _, z in patches])
    areas = np.concatenate([node_areas(x, y).ravel() for x, y, _ in patches])
    finite = np.isfinite(values)
    values, areas = values[finite], areas[finite]
    order = np.argsort(values)
    share = np.cumsum(areas[order]) / areas.sum()
    high = float(values[order[min(int(np.searchsorted(share, _SHOWN_AREA)), len(order) - 1)]])
    low, top = float(values.min()), float(values.max())
    if top > 1.4 * high + 1e-12:
        top = np.inf
    else:
        high = top
    return style.steps(style.levels(0.0 if 0 <= low < 0.5 * high else low, high, 11), low, top)
