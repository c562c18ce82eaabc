"""What pictures with an abscissa share: what a sweep runs over, panels below one another, titles and legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# More of them in one picture cannot be told apart.
MAX_PANELS = 6
# Inches.
_LEFT = 0.88
_RIGHT = 0.3
_TOP = 0.62
_GAP = 0.42
_HEIGHT = 1.75
BELOW_BARE = 0.6  # below the lowest panel: its axis alone
BELOW_WITH_LEGEND = 0.95  # and with a legend of one or two rows
_LETTER = 0.56  # mean width of a letter in font sizes
# Steps of ticks that are parts of a turn in degrees.
TURNS = (1, 1.5, 3, 4.5, 6, 9, 10)


class Along(NamedTuple):
    """What a sweep or a path runs over."""

    values: Floats
    label: str
    name: str = ""


def along(study: Study, poses: Poses) -> Along | None:
    """The abscissa of a sweep or path; None for listed poses, grids and what is too short to be a curve."""
    return None if poses.listed or len(poses.grid) != 1 or poses.count < 3 else abscissa(study, poses)


def abscissa(study: Study, poses: Poses) -> Along:
    """The one coordinate that moves, always the same way, or else the number of the pose."""
    moving = moving_names(poses)
    if len(moving) != 1 or np.ptp(np.sign(np.diff(poses.values[moving[0]]))):
        return Along(np.arange(1.0, poses.count + 1), "pose along the path")
    return Along(poses.values[moving[0]], coordinate_label(study, moving[0]), moving[0])


def moving_names(poses: Poses) -> list[str]:
    """Coordinates that are not the same at all poses."""
    return [name for name, values in poses.values.items() if np.ptp(values) > 0]


def coordinate_label(study: Study, name: str) -> str:
    """A coordinate's name and unit."""
    return style.axis_label(name, study.units.label(study.mechanism.quantity(name)))


def title(figure: Figure, text: str, note: str = "", left: float = _LEFT) -> None:
    """A title at the top left, and a smaller line below it."""
    height = figure.get_figheight()
    room = 72 * (style.WIDTH - left - 0.1) / _LETTER
    for words, size, below in ((text, 11.0, 0.1), (note, 8.5, 0.32)):
        if words:
            size = min(size, room / len(words))
            figure.text(left / style.WIDTH, 1 - below / height, words, va="top", fontsize=size)


def stack(
    panels: int, heading: str, label: str, *, note: str = "", tall: float = _HEIGHT, bottom: float = BELOW_WITH_LEGEND
) -> tuple[Figure, list[Axes]]:
    """Panels one below the other over one labelled axis, with this much room (inches) below for a legend."""
    top = _TOP + 0.1 * bool(note)
    figure, axes = style.page(panels, 1, tall, left=_LEFT, right=_RIGHT, top=top, bottom=bottom, down=_GAP, sharex=True)
    title(figure, heading, note)
    for axis in axes:
        # Given places: to find them from the tick labels would take as long as the rest of the picture.
        axis.set_title("", y=1.02)
        axis.locator_params(axis="y", nbins=5)
        axis.yaxis.set_label_coords(-(_LEFT - 0.05) / (style.WIDTH - _LEFT - _RIGHT), 0.5, transform=axis.transAxes)
        axis.yaxis.label.set_verticalalignment("top")
    axes[-1].xaxis.set_label_coords(0.5, -0.35 / tall, transform=axes[-1].transAxes)
    axes[-1].set_xlabel(label)
    return figure, axes


def tick_abscissa(axis: Axes, swept: Along) -> None:
    """Places for the ticks of a sweep: over much of a turn its parts, such as 30 or 45 degrees."""
    turning = swept.label.endswith("[deg]") and np.ptp(swept.values) > 150
    axis.xaxis.set_major_locator(MaxNLocator(nbins=9, steps=TURNS if turning else [1, 2, 2.5, 5, 10]))


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    """One legend at the bottom, in as many columns as the width holds."""
    if labels:
        figure.legend(handles, labels, loc="lower center", ncols=fitting(labels), borderaxespad=0.2)


def number(value: float) -> str:
    """A probability in three digits."""
    return f"{value:.3g}" if value == 0 or value >= 1e-3 else style.in_powers(value)


def fitting(labels: Sequence[str]) -> int:
    """Columns of a legend that the width of a figure holds."""
    return max(1, min(len(labels), 118 // (8 + max(len(label) for label in labels))))
