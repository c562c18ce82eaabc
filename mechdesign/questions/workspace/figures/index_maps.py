"""Maps of the local indices of a workspace: filled contours, each level named once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
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
from mechdesign.ground.indices import INDEX_NAMES, index
from mechdesign.ground.numerals import power
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.questions.workspace.figures.regions import (
    HeldRegion,
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


def index_columns(region: HeldRegion) -> list[str]:
    """Names of the local indices that a region's table holds."""
    return [name for name in region.local.names if name not in _NO_INDEX and name not in region.held]


@dataclass(frozen=True, eq=False)
class Scale:
    """Colours of a local index over some regions, the same in pictures and on pages.

    An index with bounds has all of these over several regions. One without has a scale for all regions together where
    their colours end near to each other; else each region has its own, and its values are parts of where that ends.

    Parameters
    ----------
    patches : sequence of sequence of Grid
        The values of each region, or their parts.
    labels : sequence of str
        What the colours of each region mean, with the unit.
    label : str
        What they mean in all of them.
    words : str
        How far colours of several regions can be compared.
    value : float, optional
        Of an index that is the same everywhere, and so has no colours.
    """

    patches: Sequence[Sequence[Grid]]
    norm: BoundaryNorm
    labels: Sequence[str]
    label: str
    words: str = ""
    value: float | None = None

    @classmethod
    def of(cls, regions: Sequence[HeldRegion], column: str) -> Scale:
        """That of a column of the table of local indices."""
        unit, name = regions[0].local.column(column).unit, column.replace("_", " ")
        shown, label = [[*grids(region.local, column)] for region in regions], style.axis_label(name, unit)
        several, (least, most) = len(regions) > 1, index(column).bounds
        parts, words = None, "; one scale for all panels" * several
        if several and math.isfinite(most - least):
            norm = colour_steps(round_levels(least, most, 11), least, most)
        else:
            parts = _parts(shown)
            if parts is not None:
                shown = [[(x, y, z / part) for x, y, z in patches] for patches, part in zip(shown, parts, strict=True)]
                words = "; each panel has a scale of its own"
            norm = _norm([patch for patches in shown for patch in patches])
        low, _, top = _ends([patch for patches in shown for patch in patches])
        value = low if parts is None and constant(low, top) else None
        if parts is None:
            return cls(shown, norm, [label] * len(regions), label, words, value)
        labels = [f"{name} in parts of {quantity(part, unit)}".strip() for part in parts]
        return cls(shown, norm, labels, f"{name}, in parts", words)


def _index_map(study: Study, regions: Sequence[HeldRegion], column: str, cut: str) -> Picture:
    meaning, scale = regions[0].local.column(column), Scale.of(regions, column)
    everywhere = np.concatenate([region.places() for region in regions])
    point = study.workspace.point if study.workspace else ""
    title = f"{column.replace('_', ' ')} at point {point}: {meaning.meaning}{cut}"
    if scale.value is None:
        title += scale.words
    else:
        title = f"{title}; {quantity(scale.value, meaning.unit).strip()} everywhere"
    panels = list[tuple[str, list[PanelMark]]]()
    for region, patches, label in zip(regions, scale.patches, scale.labels, strict=True):
        words = region.title + f"\nin {label.partition(' in ')[2]}" * (label != scale.label)
        within = _within(patches, scale.norm)
        lines = [] if scale.value is not None else contour_lines(within, scale.norm.boundaries[1:])
        drawn = (
            Own(partial(fill, local=region.local))
            if scale.value is not None
            else Coloured(partial(_field, within, scale.norm, lines), bar=scale.label)
        )
        marks = [drawn, *region_marks(region)]
        if len(regions) == 1 and scale.value is None:
            marks.append(Late(partial(label_levels, patches=patches, norm=scale.norm, drawn=lines)))
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
    ten = 10.0 ** power(float(np.abs(norm.boundaries).max()))
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
            anchors[best].real, anchors[best].imag, f"{level / ten:.6g}", fontsize=style.small(), ha="center",
            va="center", rotation=(turn + 90) % 180 - 90, rotation_mode="anchor",
            color="white" if norm(level) < 140 else style.INK, zorder=3.5,
            path_effects=[withStroke(linewidth=2.5, foreground=back)],
        )  # fmt: skip


def _on_paper(axes: Axes, places: Complexes) -> Complexes:
    """Places in points on paper."""
    return np.asarray(paper(axes, places) @ np.array([1, 1j]))


def _nearest(places: Complexes, others: Complexes) -> Floats:
    if not len(others):
        return np.full(len(places), np.inf)
    return np.asarray(np.abs(places[:, None] - others[None, :]).min(axis=1))


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
