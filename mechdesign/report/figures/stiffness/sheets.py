"""The mechanism in a pose under a title, and several such drawings on one scale."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.stiffness.analysis import Drawn
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import ABOVE, BELOW, LEFT, MAX_HEIGHT, RIGHT, TITLE, fit, framed, windows
from mechdesign.study import Poses, Study

# Inches.
_PANEL_TITLE = 0.17  # a line
_HEADING = 0.32
_LEGEND = 0.3


def posed(study: Study, poses: Poses, drawn: Drawn, places: Complexes, what: str, **look: Any) -> tuple[Figure, Axes]:
    """The mechanism in a pose, in a window that holds these places, too."""
    title = style.folded(f"{what} at {pose_in_words(study, poses, drawn.row)}", 11.0, style.width() - LEFT)
    above = TITLE + style.line(11.0) * title.count("\n")
    figure, axes = framed(places, study.units.label("length"), height=MAX_HEIGHT, above=above)
    axes.set_title(title, loc="left")
    draw_mechanism(axes, study.mechanism, drawn.configuration, **look)
    return figure, axes


def panels_of_poses(
    study: Study, places: Complexes, count: int, heading: str, lines: int = 3
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Drawings of one scale, two in a row, under a heading, with room for titles of some lines and a legend."""
    columns = 1 if style.narrow() else min(count, 2)
    heading = style.folded(heading[0].upper() + heading[1:], 11.0, style.width() - LEFT - RIGHT)
    # All of them on a page of paper.
    tall = MAX_HEIGHT if count == 1 else min(3.2, 8.0 * columns / count)
    window = fit(places, (style.width() - RIGHT - LEFT * columns) / columns, tall)
    above = _PANEL_TITLE * lines + ABOVE
    top = _HEADING + style.line(11.0) * heading.count("\n")
    figure, axes = windows(window, study.units.label("length"), count, columns, above=above, top=top,
                           below=BELOW + _LEGEND)  # fmt: skip
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), heading, va="top", fontsize=11)
    return figure, axes


def symbol_size(panels: int) -> float:
    """Size of symbols, smaller where several drawings stand side by side."""
    return 1.0 if panels == 1 else 0.7
