"""Centrodes: where the instant centre of two links goes in each of them; one rolls on the other as the links move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.framing import extent
from mechdesign.drawing.marks import Dots, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Complexes, Flags
from mechdesign.ground.results import Table
from mechdesign.mechanism.algebra import vector
from mechdesign.questions.kinematics.figures.poses import centre_look
from mechdesign.questions.kinematics.figures.view import MotionView

MOST_PAIRS = 4
_NEAR = 0.75  # distance from the middle, in sizes of the mechanism, up to which a centrode widens the window
_STILL = 1e-9  # a centre that moves less than this part of the mechanism's size is a pin of the link
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
def centrodes_picture(view: MotionView) -> Picture | None:
    """A panel for each pair of links whose instant centre is asked for; None where each stays at a pin."""
    if "instant_centres" not in view.result.tables or not view.sweep.poses.followed or not len(view.sweep.valid):
        return None
    sweep = Sweep.of(view.curves.shown)
    pairs = centrodes(sweep, view.table("instant_centres"))[:MOST_PAIRS]
    if not pairs:
        return None
    middle, *sides = extent(sweep.extent)
    panels = []
    for pair in pairs:
        marks, shows = list[PanelMark](), [sweep.extent]
        for path, words, (color, dashes) in zip(pair[-2:], ("fixed", "moving"), _LOOKS, strict=True):
            broken = np.where(leaps(path - middle, max(sides)), complex(np.nan, np.nan), path)
            look = {"color": color, "linestyle": dashes, "linewidth": 1.5, "zorder": 4.7}  # above the links
            marks.append(Trace(broken.real, broken.imag, label=f"{words} centrode", look=look))
            shows.append(path[np.abs(path - middle) <= _NEAR * max(sides)])
        marks += [Dots([pair.centre.real], [pair.centre.imag], label="instant centre", look=centre_look()),
                  Posed(sweep.at(pair.pose), drives=False)]  # fmt: skip
        title = f"{pair.moving} on {pair.fixed}\n{sweep.words(pair.pose)}"
        panels.append(drawn_plane(marks, np.concatenate(shows), view.study, title))
    heading = "Centrodes: paths of the instant centre in both links; one rolls on the other"
    return Picture(heading, panels, across=2, share="xy")


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
