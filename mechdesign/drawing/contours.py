"""Values over patches of a plane in steps of colour, and the bar that says what a colour means."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain, pairwise, starmap
from typing import Any, Literal

import numpy as np
from contourpy import FillType, LineType, contour_generator
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from mechdesign.drawing.style import COLORMAP, small
from mechdesign.ground.numerals import raised
from mechdesign.ground.numerics.arrays import Complexes, Floats

# x, y and a value at the nodes of a patch, each of shape (rays, nodes).
Grid = tuple[Floats, Floats, Floats]
# A value beyond all levels.
_BEYOND = 1e250
_MINUS = "\N{MINUS SIGN}"


def color_bar(axes: Axes, drawn: ScalarMappable, label: str = "", **options: Any) -> Colorbar:
    """A bar of colours without a frame beside a panel."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    beside = axes.inset_axes((1.02, 0, 0.04, 1))
    beside.tick_params(labelsize=small())
    bar = figure.colorbar(drawn, cax=beside, **options)
    if isinstance(bar.formatter, ScalarFormatter):
        # Powers of ten stand above the bar: long numbers would push its name off the page.
        bar.formatter = _Multiples()
        bar.formatter.set_powerlimits((-3, 5))
    bar.set_label(label)
    bar.outline.set_visible(False)
    return bar


class _Multiples(ScalarFormatter):
    """Numbers as multiples of a power of ten, which stands at the end of the axis in plain type."""

    def get_offset(self) -> str:
        _, ten, power = super().get_offset().partition("1e")
        return f"\N{MULTIPLICATION SIGN}10{raised(int(power.replace(_MINUS, '-')))}" if ten else ""


def constant(low: float, high: float) -> bool:
    """Whether a range is a single value but for rounding: a map of it would be one colour."""
    return math.isfinite(high - low) and high - low <= 1e-9 * max(abs(low), abs(high))


def round_levels(low: float, high: float, number: int) -> Floats:
    """About `number` levels at round numbers over a range; around the value where the range is a single one."""
    if constant(low, high):
        low, high = low - 0.5 * max(abs(low), 1e-12), high + 0.5 * max(abs(high), 1e-12)
    return np.asarray(MaxNLocator(nbins=number, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))


def colour_steps(levels: Floats, low: float, high: float) -> BoundaryNorm:
    """One colour between neighbouring levels, and one beyond each end that the values from `low` to `high` exceed."""
    ends: list[Literal["neither", "min", "max", "both"]] = ["neither", "min", "max", "both"]
    return BoundaryNorm(levels, 256, extend=ends[bool(low < levels[0]) + 2 * bool(high > levels[-1])])


def contour_lines(patches: Sequence[Grid], levels: Floats) -> list[list[Complexes]]:
    """The lines of each level over some patches."""
    makers = [contour_generator(x, y, z, line_type=LineType.Separate) for x, y, z in patches]
    return [
        [np.asarray(line, dtype=float) @ np.array([1, 1j]) for maker in makers for line in maker.lines(level)]
        for level in levels.tolist()
    ]


def filled(axes: Axes, patches: Sequence[Grid], norm: BoundaryNorm, lines: Sequence[Sequence[Complexes]]) -> None:
    """Fill patches between the levels of a norm, and draw white lines of some levels.

    All patches at once: Matplotlib's contours of many patches with one norm take a hundred times as long.
    """
    makers = [contour_generator(x, y, z, fill_type=FillType.OuterCode) for x, y, z in patches]
    ends, reach = norm.boundaries.tolist(), 2.0 * float(np.ptp(norm.boundaries))
    ends = [-_BEYOND] * (norm.extend in ("min", "both")) + ends + [_BEYOND] * (norm.extend in ("max", "both"))
    areas: list[Path] = []
    colors: list[Any] = []
    for low, high in pairwise(ends):
        inside = np.clip([low, high], norm.boundaries[0] - reach, norm.boundaries[-1] + reach).mean()
        count = len(areas)
        for maker in makers:
            areas += starmap(Path, zip(*maker.filled(low, high), strict=True))
        colors += [colormaps[COLORMAP](norm(inside))] * (len(areas) - count)
    axes.add_collection(PathCollection(areas, facecolors=colors, linewidths=0, antialiaseds=False), autolim=False)
    ways = [np.column_stack([line.real, line.imag]) for line in chain.from_iterable(lines)]
    axes.add_collection(LineCollection(ways, colors="white", linewidths=0.5, alpha=0.7), autolim=False)
    axes.update_datalim([(float(end(x)), float(end(y))) for x, y, _ in patches for end in (np.nanmin, np.nanmax)])
    axes.autoscale_view(tight=True)
