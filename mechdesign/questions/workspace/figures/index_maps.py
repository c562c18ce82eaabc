"""Maps of the local indices of a workspace: filled contours, each level named once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.patheffects import withStroke

from mechdesign.drawing import style
from mechdesign.drawing.contours import Grid, colour_steps, constant, contour_lines, filled, round_levels
from mechdesign.drawing.labels import paper
from mechdesign.drawing.marks import Coloured, Late, Own, PanelMark, Picture
from mechdesign.drawing.panels import node_areas, quantile, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.ground.indices import INDEX_NAMES
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.questions.workspace.figures.regions import (
    Region,
    fill,
    grids,
    left_out,
    region_marks,
    region_picture,
    some,
)
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.study import Study

# Columns of the table that are no indices, beside the held coordinates.
_NO_INDEX = ("x", "y", "det_J", "patch", "ray", "node", "piece")
# The colours of an index with a thin tail end at the value below which this share of the area lies.
_SHOWN_AREA = 0.96
# Regions whose colours would end farther apart than by this factor have a scale each.
_ALIKE = 2.5
# Points on paper between the name of a level and lines of other levels, and other names.
CLEAR_OF_LINES = 5.0
CLEAR_OF_NAMES = 18.0


@picture(WorkspaceView, *INDEX_NAMES, order=80)
def index_pictures(view: WorkspaceView) -> dict[str, Picture] | None:
    """One map an index of the table of local indices; of many regions a few, spread evenly.

    There is none of an index that is infinite everywhere.
    """
    if not view.regions:
        return None
    shown = some(view.regions)
    names = [name for name in index_columns(view.regions[0]) if any(np.isfinite(r.local[name]).any() for r in shown)]
    return {name: _index_map(view.study, shown, name, left_out(view.regions)) for name in names}


def index_columns(region: Region) -> list[str]:
    """Names of the local indices that a region's table holds."""
    return [name for name in region.local.names if name not in _NO_INDEX and name not in region.held]


def _index_map(study: Study, regions: Sequence[Region], column: str, cut: str) -> Picture:
    index = regions[0].local.column(column)
    everywhere = np.concatenate([region.places() for region in regions])
    point = study.workspace.point if study.workspace else ""
    name = column.replace("_", " ")
    title, titles = f"{name} at point {point}: {index.meaning}{cut}", [region.title for region in regions]
    shown = [[*grids(region.local, column)] for region in regions]
    label = style.axis_label(name, index.unit)
    parts = _parts(shown)
    if parts is not None:
        title, label = f"{title}; each panel has a scale of its own", f"{name}, in parts"
        titles = [f"{words}\nin parts of {quantity(part, index.unit)}".strip()
                  for words, part in zip(titles, parts, strict=True)]  # fmt: skip
        shown = [[(x, y, z / part) for x, y, z in patches] for patches, part in zip(shown, parts, strict=True)]
    every = [patch for patches in shown for patch in patches]
    low, _, top = _ends(every)
    same = parts is None and constant(low, top)
    if same:
        title = f"{title}; {quantity(low, index.unit).strip()} everywhere"
    norm, panels = _norm(every), list[tuple[str, list[PanelMark]]]()
    for words, patches, region in zip(titles, shown, regions, strict=True):
        within = _within(patches, norm)
        lines = [] if same else contour_lines(within, norm.boundaries[1:])
        drawn = (
            Own(partial(fill, local=region.local))
            if same
            else Coloured(partial(_field, within, norm, lines), bar=label)
        )
        marks = [drawn, *region_marks(region)]
        if len(regions) == 1 and not same:
            marks.append(Late(partial(label_levels, patches=patches, norm=norm, drawn=lines)))
        panels.append((words, marks))
    return region_picture(study, everywhere, panels, title)


def _field(
    patches: Sequence[Grid], norm: BoundaryNorm, lines: Sequence[Sequence[Complexes]], axes: Axes
) -> tuple[ScalarMappable, dict[str, Any]]:  # fmt: skip
    """Filled contours, and what a bar of colours shows of them."""
    filled(axes, patches, norm, lines)
    return ScalarMappable(norm, style.COLORMAP), {"ticks": norm.boundaries}


def contours(axes: Axes, patches: Sequence[Grid], norm: BoundaryNorm) -> None:
    """Filled contours over the patches of a region."""
    within = _within(patches, norm)
    filled(axes, within, norm, contour_lines(within, norm.boundaries[1:]))


def _within(patches: Sequence[Grid], norm: BoundaryNorm) -> list[Grid]:
    """Patches with values that have a colour: beyond the last level an index grows without bound, at singularities."""
    low, high = norm.boundaries[[0, -1]]
    over = 2 * high - low
    return [(x, y, np.where(np.isfinite(z), np.minimum(z, over), over if norm.extend == "max" else low))
            for x, y, z in patches]  # fmt: skip


def label_levels(
    axes: Axes, patches: Sequence[Grid], norm: BoundaryNorm, drawn: Sequence[Sequence[Complexes]]
) -> None:  # fmt: skip
    """Name each level of a norm but the first on one of its lines, far from other lines and names; or not at all."""
    levels, edge = norm.boundaries[1:], np.zeros(0, dtype=complex)
    for x, y, _ in patches:
        z = x + 1j * y
        edge = np.concatenate([edge, z[0], z[-1], z[:, 0], z[:, -1]])
    blocked = _on_paper(axes, edge)
    ten = 10.0 ** style.power(float(np.abs(norm.boundaries).max()))
    lines = [[_on_paper(axes, part) for part in parts] for parts in drawn]
    every = [np.concatenate(parts) if parts else np.zeros(0, dtype=complex) for parts in lines]
    taken = np.zeros(0, dtype=complex)
    for k, level in enumerate(levels):
        places = [(line[j], part[j], part[j + 1] - part[j - 1])
                  for line, part in zip(drawn[k], lines[k], strict=True) if len(part) > 4
                  for j in range(2, len(part) - 2, max(1, len(part) // 40)) if part[j + 1] != part[j - 1]]  # fmt: skip
        if not places:
            continue
        anchors, at, along = np.array(places).T
        others = np.concatenate([*every[:k], *every[k + 1 :], blocked])
        room = np.minimum(_nearest(at, others) / CLEAR_OF_LINES, _nearest(at, taken) / CLEAR_OF_NAMES)
        # Upright names read best where there is room.
        best = int(np.argmax(np.minimum(room, 2.0) + np.abs(along.real) / np.abs(along)))
        if room[best] < 1:
            continue
        taken = np.append(taken, at[best])
        turn = float(np.degrees(np.angle(along[best])))
        back = colormaps[style.COLORMAP](norm(level))
        # A place of the drawing, not of the page, whose layout may still change.
        axes.text(
            anchors[best].real, anchors[best].imag, f"{level / ten:.6g}", fontsize=7.5, ha="center", va="center",
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
    """Colours of a local index over some regions; see `_norm`."""
    return _norm([patch for region in regions for patch in grids(region.local, column)])


def _norm(patches: Sequence[Grid]) -> BoundaryNorm:
    """Colours between round levels from the smallest value, or zero, to the largest, or to where a thin tail begins."""
    low, high, top = _ends(patches)
    return colour_steps(round_levels(0.0 if 0 <= low < 0.5 * high else low, high, 11), low, top)


def _parts(regions: Sequence[Sequence[Grid]]) -> list[float] | None:
    """The values where the colours of each region would end; None where those of one scale suit all regions."""
    ends = [_ends(patches) for patches in regions if any(np.isfinite(z).any() for _, _, z in patches)]
    highs = [high for _, high, _ in ends]
    if len(highs) < len(regions) or min(low for low, _, _ in ends) < 0 or max(highs) <= _ALIKE * min(highs):
        return None
    return highs


def _ends(patches: Sequence[Grid]) -> tuple[float, float, float]:
    """The smallest finite value, the value where the colours end, and the largest; infinite beyond a thin tail."""
    values = np.concatenate([z.ravel() for _, _, z in patches])
    areas = np.concatenate([node_areas(x, y).ravel() for x, y, _ in patches])
    finite = np.isfinite(values)
    values, areas = values[finite], areas[finite]
    high, low, top = quantile(values, areas, _SHOWN_AREA), float(values.min()), float(values.max())
    return (low, high, np.inf) if top > 1.4 * high + 1e-12 else (low, top, top)
