"""Picture of derivatives: bars of what one per cent of each number changes of each result."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Bars, Lines, Panel, PanelMark, Picture, Words
from mechdesign.drawing.pictures import View, picture
from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Table

# Panels, and bars of each, that a picture has room for.
MOST_RESULTS, MOST_BARS = 8, 20
_WORDS = 0.42  # part of the width of a panel at its right, for the derivatives in figures
# Elasticities below this part of the largest count as zero.
_NONE = 1e-9


@picture(View, "sensitivities")
def sensitivities_picture(view: View) -> Picture:
    """A panel a result: bars of elasticity, the largest first, with derivative and error in figures beside them."""
    table = view.result.main
    results = list(dict.fromkeys(table["result"].tolist()))
    shown = [np.flatnonzero(table["result"] == name) for name in results[:MOST_RESULTS]]
    shown = [rows[_order(table["elasticity"][rows])][:MOST_BARS] for rows in shown]
    notes = [f"{len(results) - len(shown)} more results"] if len(results) > len(shown) else []
    notes += ["the largest of each"] if any(len(rows) == MOST_BARS for rows in shown) else []
    title = "Sensitivities: what 1 % of each number changes, and the derivatives"
    return Picture(title, [_panel(table, rows, last=rows is shown[-1]) for rows in shown], ("; ".join(notes),))


def _order(elasticity: Floats) -> Ints:
    """Order of elasticities by size, the largest first, unknown ones last."""
    return np.argsort(-np.nan_to_num(np.abs(elasticity), nan=-1.0), kind="stable")


def _panel(table: Table, rows: Ints, *, last: bool) -> Panel:
    """Bars of one result with their derivatives at the right."""
    sizes, sure = np.nan_to_num(table["elasticity"][rows]), table["settled"][rows] == 1
    low, high = min(0.0, float(sizes.min())), max(0.0, float(sizes.max()))
    room = 0.06 * ((high - low) or _NONE)
    low, high = low - room, high + room
    marks: list[PanelMark] = [Lines([0.0], "x", look={"color": style.INK, "linewidth": 0.8, "zorder": 3})]
    for color, hatch, some in (
        (style.BLUE, "", (sizes >= 0) & sure), (style.VERMILION, "", (sizes < 0) & sure),
        (style.BLUE, "////", (sizes >= 0) & ~sure), (style.VERMILION, "////", (sizes < 0) & ~sure),
    ):  # fmt: skip
        marks.append(Bars(np.where(some, sizes, 0.0), look={"color": color, "hatch": hatch, "zorder": 2}))
    look: dict[str, Any] = {"ha": "right", "va": "center"}
    marks += [Words(1.0, place, _figures(table, row), inside="x", look=look) for place, row in enumerate(rows.tolist())]
    unit = printed(str(table["value_unit"][rows[0]]))
    title = f"{table['result'][rows[0]]} = {numeral(table['value'][rows[0]])} {unit}".rstrip()
    words = "change of the result, in % of its size, for 1 % of the number more" if last else ""
    names = Axis(words=[str(name).removeprefix("mechanism.") for name in table["parameter"][rows]])
    return Panel(marks, Axis(words, ends=(low, low + (high - low) / (1 - _WORDS))), names, title, "derivative")


def _figures(table: Table, row: int) -> str:
    """The derivative as text; at a kink both one-sided ones."""
    unit = printed(str(table["unit"][row]))
    if np.isfinite(table["below"][row]):
        return f"kink: {numeral(table['below'][row], 4)} below, {numeral(table['above'][row], 4)} above {unit}".rstrip()
    if np.isnan(table["derivative"][row]):
        return "not known here"
    error = "" if table["settled"][row] else f" \N{PLUS-MINUS SIGN} {table['error'][row]:.1g}"
    return f"{numeral(table['derivative'][row], 4)}{error} {unit}".rstrip()
