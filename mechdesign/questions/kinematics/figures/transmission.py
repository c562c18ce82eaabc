"""How well a mechanism passes force on along its motion: transmission angles and mechanical advantages."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.patheffects import withStroke

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Dots, Lines, Panel, PanelMark, Picture, Trace, Words, Zone
from mechdesign.drawing.panels import Along, abscissa, moving_names
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.sweep import Sweep
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.mechanism.four_bars import FourBar, four_bars
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.questions.kinematics.loops import SAME_ANGLE
from mechdesign.study import Study

# Transmission angles that textbooks call good, degrees.
GOOD = (40.0, 140.0)
BEST = 90.0
GOOD_WORDS = f"good: {GOOD[0]:g} to {GOOD[1]:g} deg"
MOST_LOOPS = 5
MOST_ADVANTAGES = 4
# Distances from where an advantage is infinite, as parts of that of the nearest pose, at which its curve is drawn.
_SHRINKING = 2.0 ** -np.arange(1, 9)
_BAND = "#E4EFE8"
# Largest over smallest size of a mechanical advantage from which on its axis is logarithmic.
_WIDE = 30.0
_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.BLUE, "linestyle": "-"}, {"color": style.ORANGE, "linestyle": (0, (6, 2))},
    {"color": style.GREEN, "linestyle": (0, (1, 1))}, {"color": style.PURPLE, "linestyle": (0, (6, 2, 1, 2))},
    {"color": style.SKY, "linestyle": (0, (3, 1, 1, 1, 1, 1))},
)  # fmt: skip


class Transmission(NamedTuple):
    """A four-bar or slider-crank, its transmission angle at the poses, and where it is worst (degrees)."""

    loop: FourBar
    kind: str  # Grashof's class, or the kind of slider-crank
    angle: Floats  # between coupler and output, 0 to 180
    worst: float
    at: float


@picture(MotionView, "transmission", order=40)
def transmission_picture(view: MotionView) -> Picture | None:
    """Transmission angles over the swept coordinate with the band that is good, and mechanical advantages."""
    study, tables, section = view.study, view.result.tables, view.study.kinematics
    if not view.sweep.poses.followed or not moving_names(view.sweep.poses):
        return None
    sweep = Sweep.of(view.curves.shown)
    over = abscissa(study, sweep.poses, section.speed if section is not None else None)
    every = transmissions(study, tables.get("loops"), sweep, over)
    loops = sorted(every, key=lambda loop: _off(loop.worst))[:MOST_LOOPS]
    advantages = list((section.mechanical_advantage if section is not None else {}).items())
    names = advantages[:MOST_ADVANTAGES]
    if not loops and not names:
        return None
    notes = [f"the {MOST_LOOPS} of {len(every)} loops that come nearest to a straight line"] * (len(every) > MOST_LOOPS)
    notes += [f"{len(names)} of {len(advantages)} mechanical advantages"] * (len(advantages) > len(names))
    heading = " and ".join(["transmission angle"] * bool(loops) + ["mechanical advantage"] * bool(names)).capitalize()
    panels = [_angles(over.values[sweep.rows], loops, over)] if loops else []
    toggles, motion = tables.get("toggles"), view.table("motion")
    places = toggles[over.name] if toggles is not None and over.name in toggles else np.empty(0)
    for output, source in names:
        column = motion.column(f"{output}_advantage")
        forces = ["moment" if study.mechanism.quantity(name) == "angle" else "force" for name in (output, source)]
        title = f"{forces[0]} of {output} over {forces[1]} put in at {source}"
        title += ", without the friction of the joints" * bool(study.mechanism.description.friction)
        panels.append(_advantage(over, column.values, column.unit, places, title))
    return Picture(heading, panels, ("; ".join(notes),), share="x")


def transmissions(study: Study, table: Table | None, sweep: Sweep, over: Along) -> list[Transmission]:
    """Every loop that has a transmission angle along the motion; the worst is that of the table of loops."""
    angles: list[Transmission] = []
    if table is None:
        return angles
    for k, loop in enumerate(four_bars(study.mechanism)):
        sine, cosine = loop.squareness(sweep.configuration, 3)
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


def _off(angle: float) -> float:
    """The acute angle: how far the links are from a straight line."""
    return min(angle, 180 - angle)


def _angles(x: Floats, loops: list[Transmission], over: Along) -> Panel:
    """The transmission angles of loops, the worst first, with the band that is good."""
    worst, green = loops[0], {"color": style.GREEN, "zorder": 1}
    constant = np.ptp(worst.angle[np.isfinite(worst.angle)]) <= np.degrees(SAME_ANGLE)
    words = f"worst: {worst.worst:.4g} deg"
    words += " everywhere" if constant else f" at {over.name} = {over.value(worst.at)}" if over.name else ""
    color = style.INK if GOOD[0] <= worst.worst <= GOOD[1] else style.VERMILION
    marks: list[PanelMark] = [
        Zone(*GOOD, label=GOOD_WORDS, look={"color": _BAND, "zorder": 0}),
        Lines(GOOD, look=green | {"linewidth": 0.9, "linestyle": (0, (5, 3))}),
        Lines([BEST], look=green | {"linewidth": 1.4}),
        *(Trace(x, loop.angle, label=f"{loop.loop.name}: {loop.kind}", look=look | {"linewidth": 1.8})
          for loop, look in zip(loops, _LOOKS, strict=False)),
        Dots([worst.at], [worst.worst], label=words,
             look={"color": color, "markersize": 7, "zorder": 5, "clip_on": False}),
    ]  # fmt: skip
    axis = Axis("angle between coupler and output", "deg", ends=(0, 180), ticks=(0, GOOD[0], BEST, GOOD[1], 180))
    return Panel(marks, over.axis, axis, f"{BEST:g} deg is best; 0 and 180 deg pass no force", size=1.4)


def _advantage(over: Along, values: Floats, unit: str, toggles: Floats, title: str) -> Panel:
    """A mechanical advantage; on a logarithmic axis its size, where it is boundless or spans `_WIDE`."""
    x, sizes, blue = over.values, np.abs(values), {"color": style.BLUE, "linewidth": 1.8}
    finite = sizes[np.isfinite(sizes) & (sizes > 0)]
    if not len(finite):
        return Panel([Words(0.5, 0.5, "no finite value", inside="xy", look={"ha": "center"})], over.axis, title=title)
    places = boundless(x, values, toggles)
    if not len(places) and finite.max() <= _WIDE * finite.min():
        return Panel([Trace(x, values, look=blue)], over.axis, Axis("mechanical advantage", unit), title, size=1.4)
    marks: list[PanelMark] = [Trace(*_towards(x, sizes, places), look=blue)]
    marks.append(Lines(places, "x", look={"color": style.VERMILION, "linestyle": (0, (6, 3)), "linewidth": 1.2}))
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for k, place in enumerate(places.tolist()):
        right = place > float(np.mean([x.min(), x.max()]))
        look = {"ha": "right" if right else "left", "va": "top", "fontsize": 9, "color": style.VERMILION}
        marks.append(Words(place, 0.96 - 0.1 * (k % 2), f"beyond bounds at {over.value(place)}",
                           (-5 if right else 5, 0), "y", look=look | {"path_effects": halo}))  # fmt: skip
    axis = Axis("size of the mechanical advantage", unit, "log", (float(finite.min()) / 1.5, float(finite.max()) * 1.5))
    return Panel(marks, over.axis, axis, title, size=1.4)


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
