"""The largest circle and rectangle inside the workspace."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke

from mechdesign.report.figures import style
from mechdesign.report.figures.workspace.regions import Region, fill, sheet, some
from mechdesign.results import Result
from mechdesign.study import Study

CIRCLE = ("circle_x", "circle_y", "circle_radius")
RECTANGLE = ("rectangle_x", "rectangle_y", "rectangle_width", "rectangle_height")
_HALO = [withStroke(linewidth=2.2, foreground="white")]


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
    for axes, region in zip(page.axes, shown, strict=True):
        fill(axes, region)
        size = 9 if len(shown) == 1 else 7.5
        if CIRCLE[0] in table:
            x, y, radius = (float(table[name][region.row]) for name in CIRCLE)
            if np.isfinite(radius):
                axes.add_patch(Circle((x, y), radius, edgecolor=style.BLUE, facecolor="none", linewidth=1.6, zorder=4))
                axes.plot(x, y, "+", color=style.BLUE, zorder=4)
                axes.annotate(f"r = {radius:.4g} {unit}".strip(), (x, y), (4, 4), textcoords="offset points",
                              color=style.BLUE, fontsize=size, zorder=5, path_effects=_HALO)  # fmt: skip
        if RECTANGLE[0] in table:
            x, y, width, height = (float(table[name][region.row]) for name in RECTANGLE)
            if np.isfinite(width):
                corner = (x - width / 2, y - height / 2)
                axes.add_patch(Rectangle(corner, width, height, edgecolor=style.GREEN, facecolor="none", linewidth=1.6,
                                         zorder=4))  # fmt: skip
                axes.annotate(f"{width:.4g} x {height:.4g} {unit}".strip(), corner, (4, 4), textcoords="offset points",
                              color=style.GREEN, fontsize=size, zorder=5, path_effects=_HALO)  # fmt: skip
    page.ends(shown)
    return page.figure
