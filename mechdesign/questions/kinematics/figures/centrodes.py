"""Centrodes: where the instant centre of two links goes in each of them; one rolls on the other as the links move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from mechdesign.mechanism.algebra import vector
from mechdesign.numerics.arrays import Complexes, Flags
from mechdesign.questions.kinematics.figures.poses import centre_look
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import LEFT, RIGHT, extent, legend_at_left, tiled, windows
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep
from mechdesign.results import Table

MOST_PAIRS = 4
_NEAR = 0.75  # distance from the middle, in sizes of the mechanism, up to which a centrode widens the window
_STILL = 1e-9  # a centre that moves less than this part of the mechanism's size is a pin of the link
_MAX_COLUMNS = 2
_PADS = (0.4, 0.3)  # inches around what is drawn, in one column and in several
_PAGE = 8.0  # inches, of all panels together, about
_MIN_HEIGHT = 2.0  # inches, of a panel
_TITLE = 0.5  # inches above a panel
_HEADING = 0.36
_GAP = 0.15
_LEGEND = 0.3
_LOOKS = ((style.INK, (0, (7, 2, 1.5, 2))), (style.VERMILION, "-"))


class Centrodes(NamedTuple):
    """The centrodes of two links where both are at one of the poses, at which they touch in `centre`."""

    moving: str
    fixed: str
    pose: int
    centre: complex
    on_fixed: Complexes
    on_moving: Complexes


@picture(MotionView, "centrodes", order=35)
def centrodes_figure(view: MotionView) -> Figure | None:
    """A panel for each pair of links whose instant centre is asked for; None where each stays at a pin."""
    sweep, table = view.sweep, view.result.tables.get("instant_centres")
    if table is None or not sweep.poses.followed or not len(sweep.valid):
        return None
    pairs = centrodes(sweep, table)[:MOST_PAIRS]
    if not pairs:
        return None
    middle, *sides = extent(sweep.extent)
    near = [path[np.abs(path - middle) <= _NEAR * max(sides)]
            for pair in pairs for path in (pair.on_fixed, pair.on_moving)]  # fmt: skip
    places, count = np.concatenate([sweep.extent, *near]), len(pairs)
    columns, window = tiled(places, count, _MAX_COLUMNS, gap=_GAP, pads=_PADS, page=_PAGE, least=_MIN_HEIGHT)
    unit = view.study.units.label("length")
    figure, panels = windows(window, unit, count, columns, gap=_GAP, above=_TITLE, top=_HEADING, below=0.55 + _LEGEND)
    heading = "Centrodes: paths of the instant centre in both links; one rolls on the other"
    heading = style.folded(heading, 11, style.width() - LEFT - RIGHT)
    style.grow(figure, above=style.line(11) * heading.count("\n"))
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), heading, va="top", fontsize=11)
    for axes, pair in zip(panels, pairs, strict=True):
        title = f"{pair.moving} on {pair.fixed}\n{sweep.words(pair.pose)}"
        axes.set_title(style.folded(title, 9, window.width), loc="left", fontsize=9)
        for path, words, (color, dashes) in zip(pair[-2:], ("fixed", "moving"), _LOOKS, strict=True):
            path = np.where(leaps(path - middle, max(sides)), complex(np.nan, np.nan), path)
            axes.plot(path.real, path.imag, color=color, linestyle=dashes, linewidth=1.5, zorder=2.75,
                      label=f"{words} centrode")  # fmt: skip
        axes.plot([pair.centre.real], [pair.centre.imag], **centre_look(), label="instant centre")
        draw_mechanism(axes, sweep.mechanism, sweep.configuration, pair.pose, travel=sweep.travel, drives=False,
                       size=1.0 if columns == 1 else 0.7)  # fmt: skip
    handles = [line for line in panels[0].lines if not str(line.get_label()).startswith("_")]
    legend_at_left(figure, handles, len(handles))
    return figure


def centrodes(sweep: Sweep, table: Table) -> list[Centrodes]:
    """Those of every pair whose instant centre moves, at the pose that shows it nearest to the mechanism's middle."""
    middle, *sides = extent(sweep.extent)
    pairs = []
    for name in table.names:
        pair, _, column = name.rpartition(".")
        if column != "x":
            continue
        moving, fixed = pair.split(".")
        centre = vector(table[name], table[f"{pair}.y"])[sweep.rows]
        centre = np.where(np.isfinite(centre), centre, complex(np.nan, np.nan))
        frames = {link: _frame(sweep, link) for link in (moving, fixed)}
        local = {link: (centre - origin) / turn for link, (origin, turn) in frames.items()}
        valid = np.isfinite(centre) & sweep.configuration.valid
        if not valid.any() or any(np.abs(z[valid] - z[valid][0]).max() <= _STILL * max(sides) for z in local.values()):
            continue
        pose = int(np.where(valid, np.abs(centre - middle), np.inf).argmin())
        paths = [frames[link][0][pose] + frames[link][1][pose] * local[link] for link in (fixed, moving)]
        pairs.append(Centrodes(moving, fixed, pose, complex(centre[pose]), *paths))
    return pairs


def _frame(sweep: Sweep, link: str) -> tuple[Complexes, Complexes]:
    """A point of a link and the unit vector of its x axis at the poses."""
    (first, *_) = sweep.mechanism.description.links[link].all_points
    return sweep.configuration.point(first), sweep.configuration.rotation(link)


def leaps(path: Complexes, side: float) -> Flags:
    """Points after which a path passes through infinity; `path` is relative to the mechanism's middle."""
    far = np.abs(path) > side
    turned = (np.conj(path[:-1]) * path[1:]).real < 0
    return np.append(far[:-1] & far[1:] & turned, False)
