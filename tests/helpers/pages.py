"""What is wrong with the layout of a figure: text over text or off the page, places on unequal axes, lost curves."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from mechdesign.drawing import style

# Texts may share so many pixels: letters seldom fill their box to its corners.
SHARED = 2.0
# Of a letter's height: the part of a box that letters without strokes above and below leave free.
LOOSE = 0.15
# Points on paper, of the least type.
LEAST = 6.75
# Letters of a number along an axis.
MOST_DIGITS = 8
# Inches of an axis for each letter, from which two of its numbers have room.
NUMBER = 0.25
# Inches by which a picture may exceed the height of its page.
HIGHER = 0.05
# Of an axis: a curve that varies, but over less than this, is read as constant.
FLAT = 0.02


def texts(figure: Figure) -> Iterator[tuple[str, Bbox, float, float]]:
    """Every text that is drawn, its box in pixels, its angle and its type in points on paper.

    A turned text's box is that of its ends.
    """
    printed = min(look.reduction for look in style.LOOKS.values() if look.width >= figure.get_figwidth() - HIGHER)
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    # Tick labels beyond the limits of their axis are there, but not drawn.
    hidden: set[Text] = set()
    for axis in (axis for axes in figure.findobj(Axes) for axis in axes._axis_map.values()):  # type: ignore[attr-defined]
        # In space Matplotlib moves the labels of ticks as it draws them, and back.
        seen = set(axis._update_ticks()) if axis.axes.get_visible() and axis.axes.name != "3d" else set()
        ticks = (*axis.get_major_ticks(), *axis.get_minor_ticks())
        hidden.update(label for tick in ticks if tick not in seen for label in (tick.label1, tick.label2))
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text in hidden or not text.get_visible() or not text.get_text().strip():
            continue
        # Without the line that leads from a name to what it names.
        box = Text.get_window_extent(text, renderer)
        if np.isfinite(box.extents).all():
            spare = LOOSE * min(box.width, box.height)
            box = Bbox.from_extents(box.x0, box.y0 + spare, box.x1, box.y1 - spare)
            yield text.get_text(), box, text.get_rotation(), printed * text.get_fontsize()


def faults(figure: Figure) -> Iterator[str]:
    """What is wrong with a figure that has been drawn, in words."""
    found = list(texts(figure))
    page = figure.bbox
    if figure.get_figheight() > style.tallest() + HIGHER:
        yield f"{figure.get_figheight():.2f} inches high on a page of {style.tallest():.2f}"
    for words, box, _, size in found:
        if size < LEAST:
            yield f"{words!r} in type of {size:.2g} points"
        if box.x0 < -SHARED or box.y0 < -SHARED or box.x1 > page.width + SHARED or box.y1 > page.height + SHARED:
            yield f"{words!r} leaves the page"
    for (one, a, turn, _), (other, b, also, _) in combinations(found, 2):
        across, down = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        if across > SHARED and down > SHARED and turn % 90 == 0 and also % 90 == 0:
            yield f"{one!r} over {other!r}"
    for axes in figure.findobj(Axes):
        assert isinstance(axes, Axes)
        yield from _lost_digits(axes)
    for axes in figure.axes:
        labels = axes.get_xlabel(), axes.get_ylabel()
        if (
            _place(labels)
            and axes.get_aspect() != 1.0
            and not any("times larger" in " ".join(words.split()) for words, *_ in found)
        ):
            yield f"unequal axes of a place: {' and '.join(labels)}"


def lost_curves(figure: Figure) -> Iterator[str]:
    """Curves of a legend that vary over too little of their axis to be read, and those that a later one covers."""
    # Of places nothing is read along one axis alone.
    for axes in (axes for axes in figure.axes if axes.get_aspect() == "auto"):
        curves = [line for line in axes.get_lines() if not line.get_label().startswith("_")]  # type: ignore[attr-defined]
        # Flat beside dots or a band it tells that it varies less than these.
        alone = not axes.collections and all(line.get_linestyle() != "None" for line in axes.get_lines())
        low, high = axes.get_ybound()
        for k, curve in enumerate(curves):
            y = np.asarray(curve.get_ydata(), dtype=float)
            y = y[np.isfinite(y)]
            reach = float(np.ptp(y)) if len(y) else 0.0
            if alone and axes.get_yscale() == "linear" and 1e-9 * (high - low) < reach < FLAT * (high - low):
                yield f"{curve.get_label()!r} is flat along {axes.get_ylabel()!r}"
            for other in curves[k + 1 :]:
                alike = np.array_equal(curve.get_xydata(), other.get_xydata(), equal_nan=True)
                if alike and other.get_linestyle() == "-" and other.get_linewidth() >= curve.get_linewidth():
                    yield f"{other.get_label()!r} covers {curve.get_label()!r}"


def _lost_digits(axes: Axes) -> Iterator[str]:
    """Axes whose power of ten stands apart from their label, numbers alike, of many digits or alone, broken units."""
    for axis in (axes.xaxis, axes.yaxis) if axes.get_visible() and axes.name != "3d" else ():
        label = axis.get_label_text()
        power = axis.offsetText.get_text() if axis.offsetText.get_visible() else ""
        if power and (label or "e" in power):
            yield f"{power!r} apart from {label!r}"
        drawn = [tick.label1.get_text() for tick in axis._update_ticks() if tick.label1.get_visible()]
        numbers = [text for text in drawn if text.strip("-\N{MINUS SIGN}.0123456789") == "" and text]
        if len(set(numbers)) < len(numbers) or any(len(text) > MOST_DIGITS for text in numbers):
            yield f"numbers {numbers} along {label!r}"
        room = axes.bbox.width / style.dots()
        if len(numbers) == 1 and axis.get_scale() == "linear" and room > NUMBER * (len(numbers[0]) + 1):
            yield f"{numbers[0]} alone along {label!r}"
        if any(line.count("[") != line.count("]") for line in label.split("\n")):
            yield f"a unit in two lines of {label!r}"


def _place(labels: tuple[str, str]) -> bool:
    """Whether two labels are those of a point's coordinates."""
    (one, _, unit), (other, _, also) = (label.partition(" [") for label in labels)
    x, y = (name == letter or name.endswith(f".{letter}") for name, letter in ((one, "x"), (other, "y")))
    return x and y and unit == also and one[:-1] == other[:-1]
