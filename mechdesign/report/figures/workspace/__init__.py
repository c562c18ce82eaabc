"""Pictures of a workspace: maps of indices, the boundary with the mechanism in several poses, ranges of the drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from mechdesign.analyses.workspace.tables import curves
from mechdesign.mechanism import Configuration
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.workspace.maps import map_figures
from mechdesign.report.figures.workspace.point_paths import path_figures
from mechdesign.report.figures.workspace.ranges import range_figures
from mechdesign.report.figures.workspace.regions import ROOM, Region, fill, regions, sheet, some
from mechdesign.results import Result, Table
from mechdesign.study import Study

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
    reached += [np.atleast_1d(mechanism.sketch_configuration.point(point)) for point in mechanism.points]
    extent = np.concatenate([region.places(), *(place[np.isfinite(place)] for place in reached)])
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
