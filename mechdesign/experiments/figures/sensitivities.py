"""Picture of derivatives: bars of what one per cent of each number changes of each result."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.pictures import View, picture
from mechdesign.results import Table

# Panels, and bars of each, that a picture has room for.
MOST_RESULTS, MOST_BARS = 8, 20
# Inches.
_LEFT, _RIGHT, _TOP, _BOTTOM, _DOWN = 1.75, 0.2, 0.75, 0.5, 0.75
_BAR = 0.26
_LETTER = 0.083
_WORDS = 0.42  # part of the width of a panel at its right, for the derivatives in figures
_NAME, _FIGURES, _TITLE = 9.0, 8.0, 10.0  # points
# Elasticities below this part of the largest count as zero.
_NONE = 1e-9


@picture(View, "sensitivities")
def sensitivities_figure(view: View) -> Figure:
    """A panel a result: bars of elasticity, the largest first, with derivative and error in figures beside them."""
    table = view.result.main
    results = list(dict.fromkeys(table["result"].tolist()))
    shown = [np.flatnonzero(table["result"] == name) for name in results[:MOST_RESULTS]]
    shown = [rows[_order(table["elasticity"][rows])][:MOST_BARS] for rows in shown]
    tall = _BAR * max(map(len, shown)) + 0.1
    left = min(_LEFT, 0.3 + _LETTER * max(len(_short(name)) for rows in shown for name in table["parameter"][rows]))
    room = style.width() - left - _RIGHT
    titles = [style.folded(_named(table, int(rows[0])), _NAME, room) for rows in shown]
    label = "change of the result, in % of its size, for 1 % of the number more"
    label, fold = style.folded(label, _NAME, room), style.line(_NAME)
    lines = max(words.count("\n") for words in titles)
    figure, panels = style.page(
        len(shown), 1, tall, left=left, right=_RIGHT, top=_TOP + fold * lines,
        bottom=_BOTTOM + fold * label.count("\n"), down=_DOWN + fold * lines,
    )  # fmt: skip
    for axes, rows, words in zip(panels, shown, titles, strict=True):
        _panel(axes, table, rows)
        axes.set_title(words, fontsize=_NAME, loc="left")
    if not style.narrow():
        panels[0].set_title("derivative", fontsize=_FIGURES, loc="right")
    panels[-1].set_xlabel(label, fontsize=_NAME)
    cut = [f"{len(results) - len(shown)} more results"] if len(results) > len(shown) else []
    cut += ["the largest of each"] if any(len(rows) == MOST_BARS for rows in shown) else []
    words = "Sensitivities: what 1 % of each number changes, and the derivatives" + "".join(f"; {note}" for note in cut)
    figure.text(0.01, 1 - 0.08 / figure.get_figheight(), style.folded(words, _TITLE, style.width() - 0.2), va="top",
                fontsize=_TITLE)  # fmt: skip
    return figure


def _order(elasticity: Floats) -> Ints:
    """Order of elasticities by size, the largest first, unknown ones last."""
    return np.argsort(-np.nan_to_num(np.abs(elasticity), nan=-1.0), kind="stable")


def _panel(axes: Axes, table: Table, rows: Ints) -> None:
    places = np.arange(len(rows))
    sizes = np.nan_to_num(table["elasticity"][rows])
    settled = table["settled"][rows] == 1
    colours = [style.BLUE if size >= 0 else style.VERMILION for size in sizes]
    bars = axes.barh(places, sizes, 0.62, color=colours, zorder=2)
    for bar, sure in zip(bars, settled.tolist(), strict=True):
        if not sure:
            bar.set(hatch="////", edgecolor="white")
    axes.grid(visible=False, axis="y")
    axes.axvline(0.0, color=style.INK, linewidth=0.8, zorder=3)
    largest = max(float(np.abs(sizes).max(initial=0.0)), _NONE)
    low, high = min(0.0, float(sizes.min())), max(0.0, float(sizes.max()))
    room = 0.06 * (high - low or largest)
    low, high = low - room, high + room
    axes.set_xlim(low, low + (high - low) / (1 - _WORDS))
    ticks = [tick for tick in axes.get_xticks() if low <= tick <= high]
    axes.set_xticks(ticks)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_yticks(places, [_short(name) for name in table["parameter"][rows]])
    axes.tick_params(labelsize=_NAME)
    for place, row in enumerate(rows.tolist()):
        axes.text(1.0, place, _figures(table, row), transform=axes.get_yaxis_transform(), ha="right", va="center",
                  fontsize=_FIGURES)  # fmt: skip


def _short(name: str) -> str:
    """A parameter by its name in the mechanism."""
    return str(name).removeprefix("mechanism.")


def _named(table: Table, row: int) -> str:
    """A result with its value."""
    unit = style.printed(str(table["value_unit"][row]))
    return f"{table['result'][row]} = {table['value'][row]:.6g} {unit}".rstrip()


def _figures(table: Table, row: int) -> str:
    """The derivative as text; at a kink both one-sided ones."""
    unit = style.printed(str(table["unit"][row]))
    if np.isfinite(table["below"][row]):
        return f"kink: {table['below'][row]:.4g} below, {table['above'][row]:.4g} above {unit}".rstrip()
    if np.isnan(table["derivative"][row]):
        return "not known here"
    error = "" if table["settled"][row] else f" \N{PLUS-MINUS SIGN} {table['error'][row]:.1g}"
    return f"{table['derivative'][row]:.4g}{error} {unit}".rstrip()
