"""Maps of the local indices of a workspace: filled contours, each level named once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from mechdesign.indices import INDEX_NAMES
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.questions.workspace.figures.regions import Grid, Region, grids, sheet, some
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.report.figures import style
from mechdesign.report.figures.labels import paper
from mechdesign.report.figures.panels import node_areas, quantile
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.rendering import Gallery
from mechdesign.study import Study

# Columns of the table that are no indices, beside the held coordinates.
_NO_INDEX = ("x", "y", "det_J", "patch", "ray", "node", "piece")
# The colours of an index with a thin tail end at the value below which this share of the area lies.
_SHOWN_AREA = 0.96
# Points on paper between the name of a level and lines of other levels, and other names.
CLEAR_OF_LINES = 5.0
CLEAR_OF_NAMES = 18.0


@picture(WorkspaceView, *INDEX_NAMES, order=80)
def map_figures(view: WorkspaceView) -> Gallery | None:
    """One map an index of the table of local indices; of many regions a few, spread evenly.

    There is none of an index that is infinite everywhere.
    """
    if not view.regions:
        return None
    shown = some(view.regions)
    names = [name for name in index_columns(view.regions[0]) if any(np.isfinite(r.local[name]).any() for r in shown)]
    maps = Gallery()
    for name in names:
        maps.add(name, _index_map, view.study, shown, name)
    return maps


def index_columns(region: Region) -> list[str]:
    """Names of the local indices that a region's table holds."""
    return [name for name in region.local.names if name not in _NO_INDEX and name not in region.held]


def _index_map(study: Study, regions: Sequence[Region], column: str) -> Figure:
    norm = index_norm(regions, column)
    index = regions[0].local.column(column)
    places = np.concatenate([region.places() for region in regions])
    point = study.workspace.point if study.workspace else ""
    name = column.replace("_", " ")
    page = sheet(
        study, places, [region.title for region in regions], f"{name} at point {point}: {index.meaning}", bar=True
    )
    for axes, region in zip(page.axes, regions, strict=True):
        contours(axes, list(grids(region.local, column)), norm, labels=len(regions) == 1)
    page.ends(regions)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), style.axis_label(name, index.unit), ticks=norm.boundaries)
    return page.figure


def contours(axes: Axes, patches: Sequence[Grid], norm: BoundaryNorm, *, labels: bool) -> None:
    """Filled contours over the patches of a region, each level named once, where its line is longest."""
    drawn = []
    low, high = norm.boundaries[[0, -1]]
    # Beyond the last level the index grows without bound, at singularities.
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
        # Upright names read best where there is room.
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


def index_norm(regions: Sequence[Region], column: str) -> BoundaryNorm:
    """Colours between round levels from the smallest value, or zero, to the largest, or to where a thin tail begins."""
    patches = [patch for region in regions for patch in grids(region.local, column)]
    values = np.concatenate([z.ravel() for _, _, z in patches])
    areas = np.concatenate([node_areas(x, y).ravel() for x, y, _ in patches])
    finite = np.isfinite(values)
    values, areas = values[finite], areas[finite]
    high = quantile(values, areas, _SHOWN_AREA)
    low, top = float(values.min()), float(values.max())
    if top > 1.4 * high + 1e-12:
        top = np.inf
    else:
        high = top
    return style.steps(style.levels(0.0 if 0 <= low < 0.5 * high else low, high, 11), low, top)
