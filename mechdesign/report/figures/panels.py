"""Panels over a common axis, framed without a layout engine, which would take twice as long as drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.study import Study
from mechdesign.study.poses import Poses

# More of them in one picture cannot be told apart.
MOST_PANELS = 6
_LEFT, _RIGHT, _TOP, _APART = 0.88, 0.3, 0.62, 0.42  # inches
_TALL = 1.75
# Below the lowest panel: its axis alone, and with a legend of one or two rows.
BARE, WITH_LEGEND = 0.6, 0.95
_LETTER = 0.56  # mean width of a letter in font sizes


@dataclass(frozen=True, eq=False)
class Along:
    """What a sweep or a path runs over."""

    values: Floats
    label: str


def along(study: Study, poses: Poses) -> Along | None:
    """The abscissa of a sweep or path; None for listed poses, grids and what is too short to be a curve."""
    if poses.listed or len(poses.grid) != 1 or poses.count < 3:
        return None
    moving = moving_names(poses)
    if len(moving) != 1:
        return Along(np.arange(1.0, poses.count + 1), "pose along the path")
    return Along(poses.values[moving[0]], coordinate_label(study, moving[0]))


def moving_names(poses: Poses) -> list[str]:
    """Coordinates that are not the same at all poses."""
    return [name for name, values in poses.values.items() if np.ptp(values) > 0]


def coordinate_label(study: Study, name: str) -> str:
    """A coordinate's name and unit."""
    return style.axis_label(name, study.units.label(study.mechanism.quantity(name)))


def framed(
    height: float, *, left: float, right: float, top: float, bottom: float, apart: tuple[float, float] = (0.0, 0.0)
) -> Figure:
    """A figure with fixed margins (inches) and gaps down and across (parts of a panel)."""
    figure = style.new_figure(style.WIDTH, height, layout=None)
    figure.subplots_adjust(
        left / style.WIDTH, bottom / height, 1 - right / style.WIDTH, 1 - top / height, apart[1], apart[0]
    )
    return figure


def title(figure: Figure, text: str, note: str = "", left: float = _LEFT) -> None:
    """A title at the top left, and a smaller line below it."""
    height = figure.get_figheight()
    room = 72 * (style.WIDTH - left - 0.1) / _LETTER
    for words, size, below in ((text, 11.0, 0.1), (note, 8.5, 0.32)):
        if words:
            size = min(size, room / len(words))
            figure.text(left / style.WIDTH, 1 - below / height, words, va="top", fontsize=size)


def stack(
    panels: int, heading: str, label: str, *, note: str = "", tall: float = _TALL, bottom: float = WITH_LEGEND
) -> tuple[Figure, list[Axes]]:
    """Panels one below the other over one labelled axis, with this much room (inches) below for a legend."""
    extra = 0.1 if note else 0.0
    height = _TOP + extra + panels * tall + (panels - 1) * _APART + bottom
    figure = framed(height, left=_LEFT, right=_RIGHT, top=_TOP + extra, bottom=bottom, apart=(_APART / tall, 0.0))
    title(figure, heading, note)
    axes = list(figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0])
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
    """Places for the ticks of a sweep: degrees of much of a turn are told in parts of a turn."""
    turning = swept.label.endswith("[deg]") and np.ptp(swept.values) > 150
    steps = [1, 3, 4.5, 6, 9, 10] if turning else [1, 2, 2.5, 5, 10]
    axis.xaxis.set_major_locator(MaxNLocator(nbins=9, steps=steps))


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
