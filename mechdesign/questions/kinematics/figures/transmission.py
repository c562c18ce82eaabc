"""How well a mechanism passes force on along its motion: transmission angles and mechanical advantages."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from mechdesign.mechanism.algebra import quiet
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.numerics.arrays import Floats
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import (
    BELOW_BARE,
    Along,
    abscissa,
    fitting,
    legend_below,
    moving_names,
    stack,
    tick_abscissa,
)
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep
from mechdesign.results import Table
from mechdesign.study import Study

# Transmission angles that textbooks call good, degrees.
GOOD = (40.0, 140.0)
BEST = 90.0
GOOD_WORDS = f"good: {GOOD[0]:g} to {GOOD[1]:g} deg"
MOST_LOOPS = 5
MOST_ADVANTAGES = 4
_TALL = 2.5  # inches, a panel
_LEGEND_LINE = 0.19
_LEGEND_SYMBOL = 0.8  # inches, the line beside a name, and margins
# Distances from where an advantage is infinite, as parts of that of the nearest pose, at which its curve is drawn.
_SHRINKING = 2.0 ** -np.arange(1, 9)
_BAND = "#E4EFE8"
# Largest over smallest size of a mechanical advantage from which on its axis is logarithmic.
_WIDE = 30.0
_LOOKS = (
    (style.BLUE, "-"), (style.ORANGE, (0, (6, 2))), (style.GREEN, (0, (1, 1))), (style.PURPLE, (0, (6, 2, 1, 2))),
    (style.SKY, (0, (3, 1, 1, 1, 1, 1))),
)  # fmt: skip


class Transmission(NamedTuple):
    """A four-bar or slider-crank, its transmission angle at the poses, and where it is worst (degrees)."""

    loop: FourBar
    kind: str  # Grashof's class, or the kind of slider-crank
    angle: Floats  # between coupler and output, 0 to 180
    worst: float
    at: float


@picture(MotionView, "transmission", order=40)
def transmission_figure(view: MotionView) -> Figure | None:
    """Transmission angles over the swept coordinate with the band that is good, and mechanical advantages."""
    study, tables, sweep = view.study, view.result.tables, view.sweep
    section = study.kinematics
    if not sweep.poses.motion or not moving_names(sweep.poses):
        return None
    over = abscissa(study, sweep.poses, section.speed if section is not None else None)
    x = over.values[sweep.rows]
    loops = transmissions(study, tables.get("loops"), sweep, over)
    advantages = list((section.mechanical_advantage if section is not None else {}).items())
    names = advantages[:MOST_ADVANTAGES]
    if not loops and not names:
        return None
    notes = []
    if len(loops) > MOST_LOOPS:
        notes.append(f"the {MOST_LOOPS} of {len(loops)} loops that come nearest to a straight line")
    if len(advantages) > len(names):
        notes.append(f"{len(names)} of {len(advantages)} mechanical advantages")
    heading = " and ".join(["transmission angle"] * bool(loops) + ["mechanical advantage"] * bool(names)).capitalize()
    loops = sorted(loops, key=lambda loop: _off(loop.worst))[:MOST_LOOPS]
    labels = [GOOD_WORDS, *map(_label, loops)] if loops else []
    rows = -(-(len(labels) + 1) // fitting(labels)) if labels else 0  # with the worst of them
    rows += sum(label.count("\n") for label in labels)
    figure, axes = stack(bool(loops) + len(names), heading, over.label, note="; ".join(notes), tall=_TALL,
                         bottom=BELOW_BARE + _LEGEND_LINE * rows)  # fmt: skip
    if loops:
        _draw_angles(axes[0], x, loops, over)
        legend_below(figure, *axes[0].get_legend_handles_labels())
    toggles = tables.get("toggles")
    toggle_places = toggles[over.name] if toggles is not None and over.name in toggles else np.empty(0)
    motion = tables["motion"]
    for axis, (output, input_name) in zip(axes[bool(loops) :], names, strict=True):
        column = motion.column(f"{output}_advantage")
        large = _draw_advantage(axis, over, column.values, toggle_places)
        forces = ["moment" if study.mechanism.quantity(name) == "angle" else "force" for name in (output, input_name)]
        axis.set_title(f"{forces[0]} of {output} over {forces[1]} put in at {input_name}", loc="left", fontsize=9.5)
        words = "size of the\nmechanical advantage" if large else "mechanical advantage"
        axis.set_ylabel(style.axis_label(words, column.unit))
    axes[-1].set_xlim(*(x[[0, -1]] if x[0] < x[-1] else x[[-1, 0]]))
    tick_abscissa(axes[-1], over)
    return figure


def transmissions(study: Study, table: Table | None, sweep: Sweep, over: Along) -> list[Transmission]:
    """Every loop that has a transmission angle along the motion; the worst is that of the table of loops."""
    angles: list[Transmission] = []
    if table is None:
        return angles
    for k, loop in enumerate(four_bars(study.mechanism)):
        sine, cosine = loop.squareness(sweep.configuration, 3)
        with np.errstate(invalid="ignore"):
            angle = np.degrees(np.where(sweep.configuration.valid, np.arctan2(np.abs(sine), cosine), np.nan))
        if not np.isfinite(angle).any():
            continue
        place = float(table["transmission_min_at"][k]) if over.name else np.nan
        nearest = int(np.nanargmax(np.abs(angle - 90)))
        if np.isfinite(place):
            distance = np.where(np.isfinite(angle), np.abs(over.values[sweep.rows] - place), np.inf)
            nearest = int(distance.argmin())
        else:
            place = float(over.values[sweep.rows][nearest])
        least = float(np.degrees(table["transmission_min"][k] * study.units.angle_factor))
        least = least if np.isfinite(least) else _off(float(angle[nearest]))
        kind = str(table["class"][k])
        angles.append(Transmission(loop, kind, angle, least if angle[nearest] <= 90 else 180 - least, place))
    return angles


def _label(loop: Transmission) -> str:
    """The name of a loop and its class, as wide as the page at most."""
    return style.folded(f"{loop.loop.name}: {loop.kind}", 9, style.width() - _LEGEND_SYMBOL)


def _off(angle: float) -> float:
    """The acute angle: how far the links are from a straight line."""
    return min(angle, 180 - angle)


def _draw_angles(axis: Axes, x: Floats, loops: list[Transmission], over: Along) -> None:
    axis.axhspan(*GOOD, color=_BAND, linewidth=0, zorder=0, label=GOOD_WORDS)
    for end in GOOD:
        axis.axhline(end, color=style.GREEN, linewidth=0.9, linestyle=(0, (5, 3)), zorder=1)
    axis.axhline(BEST, color=style.GREEN, linewidth=1.4, zorder=1)
    for loop, (color, dashes) in zip(loops, _LOOKS, strict=False):
        axis.plot(x, loop.angle, color=color, linestyle=dashes, linewidth=1.8, label=_label(loop))
    worst = loops[0]
    words = f"worst: {worst.worst:.4g} deg" + (f" at {over.name} = {over.value(worst.at)}" if over.name else "")
    color = style.INK if GOOD[0] <= worst.worst <= GOOD[1] else style.VERMILION
    axis.plot([worst.at], [worst.worst], "o", color=color, markersize=7, zorder=5, clip_on=False, label=words)
    axis.set_ylim(0, 180)
    axis.set_yticks([0, GOOD[0], BEST, GOOD[1], 180])
    axis.set_ylabel("angle between coupler\nand output [deg]")
    axis.set_title(f"{BEST:g} deg is best; 0 and 180 deg pass no force", loc="left", fontsize=9.5)


@quiet
def _draw_advantage(axis: Axes, over: Along, values: Floats, toggles: Floats) -> bool:
    """Draw its curve; on a logarithmic axis, which is returned, its size, where it is boundless or spans `_WIDE`."""
    x, sizes = over.values, np.abs(values)
    finite = sizes[np.isfinite(sizes) & (sizes > 0)]
    if not len(finite):
        axis.text(0.5, 0.5, "no finite value", transform=axis.transAxes, ha="center")
        return False
    places = boundless(x, values, toggles)
    large = len(places) > 0 or bool(finite.max() > _WIDE * finite.min())
    if large:
        every, above = _towards(x, sizes, places)
        axis.set_yscale("log")
        axis.plot(every, above, color=style.BLUE, linewidth=1.8)
        axis.set_ylim(finite.min() / 1.5, finite.max() * 1.5)
    else:
        axis.plot(x, values, color=style.BLUE, linewidth=1.8)
    for place in places:
        axis.axvline(place, color=style.VERMILION, linestyle=(0, (6, 3)), linewidth=1.2)
        right = place > float(np.mean([x.min(), x.max()]))
        axis.annotate(f"beyond bounds at {over.value(place)}", (place, 0.96), xycoords=axis.get_xaxis_transform(),
                      xytext=(-5 if right else 5, 0), textcoords="offset points", ha="right" if right else "left",
                      va="top", fontsize=9, color=style.VERMILION,
                      path_effects=[withStroke(linewidth=2.5, foreground="white")])  # fmt: skip
    return large


def _towards(x: Floats, sizes: Floats, places: Floats) -> tuple[Floats, Floats]:
    """A curve on both sides of places where it is infinite: there it grows as the inverse of the distance."""
    finite = np.isfinite(sizes)
    # Where it is not known it stays nan.
    more = [np.column_stack([x, sizes])[~np.isinf(sizes)]]
    for place in places:
        for side in (x < place, x > place):
            some = np.flatnonzero(side & finite)
            if len(some):
                near = some[np.abs(x[some] - place).argmin()]
                more.append(np.column_stack([place + (x[near] - place) * _SHRINKING, sizes[near] / _SHRINKING]))
        more.append(np.array([[place, np.nan]]))
    both = np.concatenate(more)
    every, above = both[np.argsort(both[:, 0], kind="stable")].T
    return every, above


@quiet
def boundless(x: Floats, values: Floats, toggles: Floats) -> Floats:
    """Where a mechanical advantage goes through infinity: at poses, and between two at the toggle that lies there.

    Where none is known it is the root of its reciprocal.
    """
    inverse = np.where(np.isinf(values), 0.0, 1 / values)
    usual = np.nanmedian(np.abs(values[np.isfinite(values)])) if np.isfinite(values).any() else np.inf
    large = np.abs(values) > usual
    places = x[np.isinf(values)].tolist()
    for k in np.flatnonzero((inverse[:-1] * inverse[1:] < 0) & large[:-1] & large[1:]):
        root = float(x[k] + (x[k + 1] - x[k]) * inverse[k] / (inverse[k] - inverse[k + 1]))
        between = [at for at in toggles.tolist() if min(x[k], x[k + 1]) <= at <= max(x[k], x[k + 1])]
        places.append(min(between, key=lambda at: abs(at - root)) if between else root)
    return np.sort(np.array(places, dtype=float))
