"""Ticks along an axis: numbers that lie apart, names, parts of a turn."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axis import Axis as Drawn
from matplotlib.ticker import FixedLocator, MaxNLocator

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis

LABEL = 10.0  # points, of the name of an axis
NAMES = 0.4  # of the width, for names beside bars
# Inches: between a text and what it is of, of a digit, from tick to tick.
PAD, DIGIT, _UP, _ALONG = 0.06, 0.083, 0.29, 0.47
_MOST, _CLOSER = 9, 4
# Of steps between ticks; those of degrees are parts of a turn.
_STEPS, _TURNS, _MUCH_OF_A_TURN = (1, 2, 2.5, 5, 10), (1, 1.5, 3, 4.5, 6, 9, 10), 150


def tick(axis: Drawn, declared: Axis, inches: float) -> None:
    """Ticks along so many inches of an axis."""
    upright = axis is axis.axes.yaxis
    if declared.words or len(declared.ticks):
        places = declared.ticks if len(declared.ticks) else range(len(declared.words))
        room = NAMES * style.width() if upright else inches / max(len(declared.words), 1) - PAD
        words = [style.folded(word, LABEL if upright else style.small(), room) for word in declared.words]
        # Names that have no room side by side stand upright.
        lies = upright or all(style.length(line, style.small()) <= 72 * room
                              for word in words for line in word.split("\n"))  # fmt: skip
        axis.set_ticks([*places], labels=(words if lies else declared.words) or None)
        if words and not upright:
            axis.set_tick_params(labelsize=style.small(), labelrotation=0 if lies else 90)
    elif declared.scale == "linear":
        low, high = axis.get_view_interval()
        turning = declared.over and declared.label.endswith("[deg]") and abs(high - low) > _MUCH_OF_A_TURN
        most = min(_MOST, int(inches / (_UP if upright else _ALONG)))
        # One number says nothing of the scale: then closer ones, as far as they lie apart.
        for count in (*range(most, 1, -1), *range(most + 1, most + _CLOSER), 1):
            axis.set_major_locator(MaxNLocator(count, steps=_TURNS if turning else _STEPS, min_n_ticks=1))
            places = [place for place in axis.get_majorticklocs().tolist() if min(low, high) <= place <= max(low, high)]
            numbers = axis.get_major_formatter().format_ticks(places)
            need = DIGIT * (max(map(len, numbers), default=0) + 0.7) * abs(high - low) / inches
            every = [step for step in (1, 2) if len(places) <= step or places[step] - places[0] >= need]
            if not upright and every and every[0] > 1:
                places = places[::2]
                axis.set_major_locator(FixedLocator(places))
            if (upright or every) and len(places) > 1:
                break


def folded_names(names: Sequence[str]) -> list[str]:
    """Names beside bars in lines of their room."""
    return [style.folded(name, LABEL, NAMES * style.width()) for name in names]
