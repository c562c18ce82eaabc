"""Response maps: each result over two numbers that vary, with the limits of the requirements."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from mechdesign.experiments.figures.sweep.planes import REDUCTIONS, Gates, Plane
from mechdesign.experiments.figures.sweep.quantities import (
    MOST_OVER_MAP,
    NAME,
    TITLE,
    Axis,
    frame,
    kinds_of,
    left_out,
    number_text,
    sample,
    without_number,
)
from mechdesign.experiments.figures.sweep.view import CasesView
from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.pictures import picture

# Entries of which every two have a map, and maps of a picture, also where none have room side by side.
MOST_ENTRIES, MOST_MAPS, MOST_BELOW = 4, 6, 4
LEVELS = 9
_AROUND = 0.5  # part of the range where requirements are met that has levels beyond it
# Inches of a row of maps, of one by itself, and of title and legend.
_TALL, _ALONE, _HEAD = 2.9, 4.4, 0.9
_BETWEEN = 0.05  # of the page, between a bar of colours and the next map's axis
_BESIDE = 1.6  # inches beside a map: its axis and the bar of colours
# Over what is not met; the lines are darker than every colour below the veil.
_VEIL, _HATCH = [(1.0, 1.0, 1.0, 0.6)], "#555555"
_MOST_OTHERS = 3  # entries that are named in a title


@picture(CasesView, "response", order=10)
def response(view: CasesView) -> Figure | None:
    """Each result over every two of the first entries that are numbers, with the limits, the cases and the best one.

    None where no two entries span a plane. Goals, 1 to be small and -1 to be large, come first where there is no room
    for all results. Where other entries vary, too, a map has the mean over them, or what is best where it is known
    which way is better, of the cases that meet every requirement, or else of the nearest miss.
    """
    if view.empty:
        return None
    entries, results, table, goals = view.entries, view.results, view.table, view.drawn.goals
    numbers = [entry for entry in entries if not entry.words]
    pairs = (Plane.of(x, y, others=len(entries) > 2) for x, y in combinations(numbers[:MOST_ENTRIES], 2))
    most = MOST_BELOW if style.narrow() else MOST_MAPS
    planes = [plane for plane in pairs if plane is not None][:most]
    ranked = sorted((result for result in results if result.ends), key=lambda axis: axis.name not in goals)
    if not planes or not ranked:
        return None
    taken, limited = ranked[: most // len(planes)], [result for result in results if result.limits]
    gates = [Gates.of(plane, limited, table) for plane in planes if limited]
    met = table["exit_code"] == 0
    counts = [met | gate.nearest for gate in gates] or [met] * len(planes)
    kinds, (drawn, size) = kinds_of(table, required=bool(limited)), sample(table, MOST_OVER_MAP)
    figure, panels = _page(len(planes) * len(taken))
    for kind in kinds:
        kind.draw_key(panels[0])
    keys = panels[0].get_legend_handles_labels()[0]
    for k, number in enumerate(taken):
        sign = goals.get(number.name, (number.high is not None) - (number.low is not None))
        reduction, word = REDUCTIONS[sign]
        fields = [plane.field(number.values, which, reduction) for plane, which in zip(planes, counts, strict=True)]
        norm = _norm(fields, number.values[met])
        for axes, plane, field in zip(panels[k :: len(taken)], planes, fields, strict=True):
            _map(axes, plane, field, norm)
            bar = style.color_bar(figure, ScalarMappable(norm, style.COLORMAP), ax=axes, pad=0.02)
            rest = [entry.name for entry in entries if entry not in (plane.x, plane.y)]
            over = f", {word} over {', '.join(rest) if len(rest) <= _MOST_OTHERS else f'{len(rest)} entries'}"
            name = style.axis_label(number.name, number.unit) + (over if rest else "")
            low, high = (float(end(fields)) for end in (np.nanmin, np.nanmax))
            if style.constant(low, high):
                name += f": {number_text(low)} everywhere"
                bar.ax.set_visible(False)
            axes.set_title(style.folded(name, NAME, _room(panels)), loc="left", fontsize=NAME)
    for k, axes in enumerate(panels):
        plane = planes[k // len(taken)]
        if gates:
            _draw_gates(axes, plane, gates[k // len(taken)])
        for kind in kinds:
            kind.draw(axes, plane.x.values, plane.y.values, drawn, size)
        frame(axes, plane.x, plane.y, _room(panels), _TALL - 1)
    keys += [
        Line2D([], [], color=style.INK, linestyle=_dashes(k), linewidth=1.4, label=_limits_in_words(axis))
        for k, axis in enumerate(limited)
        if any(gate.crossed(k) for gate in gates)
    ]
    words = [f"Response maps over {len(table):,} cases"]
    words += [f"dots: a sample of {len(drawn)} of them"] * (len(drawn) < len(table))
    words += [f"in {plane.classes} classes of each entry" for plane in planes[:1] if plane.classes]
    words += ["of the cases that meet every requirement, else of the nearest miss"] * bool(len(entries) > 2 and limited)
    words += ["hatched: what is required is not met"] * any(gate.unmet for gate in gates)
    heading = "; ".join(words) + without_number(taken, len(table)) + left_out(ranked, taken, "result")
    heading = style.folded(heading + left_out(numbers, numbers[:MOST_ENTRIES], "entry"), TITLE, style.width() - 0.2)
    figure.suptitle(heading, x=0.01, ha="left", fontsize=TITLE)
    columns = 1 if style.narrow() else 2
    labels = [style.folded(str(key.get_label()), NAME, style.width() / columns - 0.4) for key in keys]
    figure.legend(keys, labels, loc="outside lower left", ncols=columns)
    figure.set_layout_engine("constrained", wspace=_BETWEEN)
    return figure


def _page(count: int) -> tuple[Figure, list[Axes]]:
    """So many panels side by side, where there is room, and below each other."""
    columns = 1 if style.narrow() or count == 1 else 2
    rows = -(-count // columns)
    figure = style.new_figure(_HEAD + (_ALONE if count == 1 else _TALL * rows))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for surplus in panels[count:]:
        surplus.remove()
    return figure, [*panels[:count]]


def _room(panels: Sequence[Axes]) -> float:
    """Width of a map, inches."""
    return style.width() / (1 if style.narrow() or len(panels) == 1 else 2) - _BESIDE


def _norm(fields: Sequence[Floats], met: Floats) -> BoundaryNorm:
    """Levels over the values of cases that meet every requirement and somewhat beyond, without any over all."""
    finite, inside = (values[np.isfinite(values)] for values in (np.concatenate(fields), met))
    low, high = float(finite.min()), float(finite.max())
    ends = low, high
    if inside.size:
        around = _AROUND * np.ptp(inside)
        ends = max(low, inside.min() - around), min(high, inside.max() + around)
    return style.steps(style.levels(*ends, LEVELS), low, high)


def _map(axes: Axes, plane: Plane, field: Floats, norm: BoundaryNorm) -> None:
    axes.grid(visible=False)
    levels = np.asarray(norm.boundaries)
    between = levels[(levels > np.nanmin(field)) & (levels < np.nanmax(field))]
    style.filled(axes, [(*np.meshgrid(*plane.fine), np.ma.masked_invalid(field))], norm, between)


def _draw_gates(axes: Axes, plane: Plane, gates: Gates) -> None:
    """A line a result along its limits, hatched where they are not all kept."""
    if gates.unmet:
        least = [np.nanmin(gates.joint) - 1, 0]
        unmet = axes.contourf(*plane.fine, gates.joint, levels=least, colors=_VEIL, hatches=["////"])
        unmet.set(edgecolor=_HATCH, linewidth=0)
    for k, margin in enumerate(gates.single):
        if gates.crossed(k):
            line = axes.contour(*plane.fine, margin, levels=[0.0], colors=style.INK, linewidths=1.4)
            line.set(linestyle=_dashes(k), path_effects=[withStroke(linewidth=3.0, foreground="white")])


def _dashes(k: int) -> Any:
    return style.DASHES[k % len(style.DASHES)]


def _limits_in_words(limited: Axis) -> str:
    limits = [("at least", limited.low), ("at most", limited.high)]
    words = " and ".join(f"{word} {number_text(limit)}" for word, limit in limits if limit is not None)
    return f"{limited.name} {words} {style.printed(limited.unit)}".rstrip()
