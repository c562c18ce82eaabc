"""Response maps: each result over two numbers that vary, with the limits of the requirements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.patheffects import withStroke

from mechdesign.drawing import style
from mechdesign.drawing.contours import colour_steps, constant, round_levels
from mechdesign.drawing.marks import Contours, Own, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.pictures import picture
from mechdesign.experiments.figures.sweep.planes import REDUCTIONS, CasePlane, Gates
from mechdesign.experiments.figures.sweep.quantities import (
    MOST_OVER_MAP,
    CaseAxis,
    kinds_of,
    left_out,
    names_of,
    number_text,
    sample,
    without_number,
)
from mechdesign.experiments.figures.sweep.view import CasesView
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.arrays import Floats

# Entries of which every two have a map, and maps of a picture, also where none have room side by side.
MOST_ENTRIES, MOST_MAPS, MOST_BELOW = 4, 6, 4
LEVELS = 9
_AROUND = 0.5  # part of the range where requirements are met that has levels beyond it
# Over what is not met; the lines are darker than every colour below the veil.
_VEIL, _HATCH = [(1.0, 1.0, 1.0, 0.6)], "#555555"
_MOST_OTHERS = 3  # entries that are named in a title


@picture(CasesView, "response", order=10)
def response(view: CasesView) -> Picture | None:
    """Each result over every two of the first entries that are numbers, with the limits, the cases and the best one.

    None where no two entries span a plane. Goals, 1 to be small and -1 to be large, come first where there is no room
    for all results. Where other entries vary, too, a map has the mean over them, or what is best where it is known
    which way is better, of the cases that meet every requirement, or else of the nearest miss.
    """
    if view.empty:
        return None
    entries, results, table, goals = view.entries, view.results, view.table, view.drawn.goals
    numbers = [entry for entry in entries if not entry.words]
    pairs = (CasePlane.of(x, y, others=len(entries) > 2) for x, y in combinations(numbers[:MOST_ENTRIES], 2))
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
    panels: dict[tuple[int, int], Panel] = {}
    for k, number in enumerate(taken):
        sign = goals.get(number.name, (number.high is not None) - (number.low is not None))
        reduction, word = REDUCTIONS[sign]
        fields = [plane.field(number.values, which, reduction) for plane, which in zip(planes, counts, strict=True)]
        norm, (low, high) = _norm(fields, number.values[met]), (float(end(fields)) for end in (np.nanmin, np.nanmax))
        same = constant(low, high)
        for place, (plane, field) in enumerate(zip(planes, fields, strict=True)):
            rest = [entry.name for entry in entries if entry not in (plane.x, plane.y)]
            over = f", {word} over {', '.join(rest) if len(rest) <= _MOST_OTHERS else f'{len(rest)} entries'}"
            title = style.axis_label(number.name, number.unit) + over * bool(rest)
            title += f": {number_text(low)} everywhere" * same
            marks: list[PanelMark] = [
                Contours([(*np.meshgrid(*plane.fine), np.ma.masked_invalid(field))], norm, everywhere=same),
                *(_gate_marks(plane, gates[place]) if gates else ()),
                *(kind.dots(plane.x, plane.y, drawn, size) for kind in kinds),
                *names_of(table, plane.x, plane.y),
                *(Trace([], [], label=_limits_in_words(axis), look={"color": style.INK, "linestyle": _dashes(j),
                                                                  "linewidth": 1.4})
                  for j, axis in enumerate(limited) if any(gate.crossed(j) for gate in gates)),
            ]  # fmt: skip
            panels[place, k] = Panel(marks, plane.x.axis, plane.y.axis, title)
    words = [f"Response maps over {len(table):,} cases"]
    words += [f"dots: a sample of {len(drawn)} of them"] * (len(drawn) < len(table))
    words += [f"in {plane.classes} classes of each entry" for plane in planes[:1] if plane.classes]
    words += ["of the cases that meet every requirement, else of the nearest miss"] * bool(len(entries) > 2 and limited)
    words += ["hatched: what is required is not met"] * any(gate.unmet for gate in gates)
    title = "; ".join(words) + without_number(taken, len(table)) + left_out(ranked, taken, "result")
    title += left_out(numbers, numbers[:MOST_ENTRIES], "entry")
    return Picture(title, [panels[place] for place in sorted(panels)], across=2)


def _norm(fields: Sequence[Floats], met: Floats) -> BoundaryNorm:
    """Levels over the values of cases that meet every requirement and somewhat beyond, without any over all."""
    finite, inside = (values[np.isfinite(values)] for values in (np.concatenate(fields), met))
    low, high = float(finite.min()), float(finite.max())
    ends = low, high
    if inside.size:
        around = _AROUND * np.ptp(inside)
        ends = max(low, inside.min() - around), min(high, inside.max() + around)
    return colour_steps(round_levels(*ends, LEVELS), low, high)


def _gate_marks(plane: CasePlane, gates: Gates) -> Iterator[PanelMark]:
    """A line a result along its limits, hatched where they are not all kept."""
    if gates.unmet:
        yield Own(partial(_hatch, plane, gates))
    for k, margin in enumerate(gates.single):
        if gates.crossed(k):
            yield Own(partial(_limit, plane, margin, _dashes(k)))


def _hatch(plane: CasePlane, gates: Gates, axes: Axes) -> None:
    least = [np.nanmin(gates.joint) - 1, 0]
    unmet = axes.contourf(*plane.fine, gates.joint, levels=least, colors=_VEIL, hatches=["////"])
    unmet.set(edgecolor=_HATCH, linewidth=0)


def _limit(plane: CasePlane, margin: Floats, dashes: Any, axes: Axes) -> None:
    line = axes.contour(*plane.fine, margin, levels=[0.0], colors=style.INK, linewidths=1.4)
    line.set(linestyle=dashes, path_effects=[withStroke(linewidth=3.0, foreground="white")])


def _dashes(k: int) -> Any:
    return style.DASHES[k % len(style.DASHES)]


def _limits_in_words(limited: CaseAxis) -> str:
    limits = [("at least", limited.low), ("at most", limited.high)]
    words = " and ".join(f"{word} {number_text(limit)}" for word, limit in limits if limit is not None)
    return f"{limited.name} {words} {printed(limited.unit)}".rstrip()
