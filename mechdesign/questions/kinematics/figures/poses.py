"""The mechanism at its limits, dead points or some other poses, with velocities, accelerations and instant centres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.arrows import RATES, Arrows
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.framing import extent
from mechdesign.drawing.marks import Dots, PanelMark, Picture
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Scene
from mechdesign.drawing.sweep import ranks
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.questions.kinematics.instant_centres import Centre
from mechdesign.questions.kinematics.special_poses import LIMIT, SINGULAR, SpecialPose, SpecialPoses
from mechdesign.study import Study

_MAX_COLUMNS = 3
_LONGEST = 0.36  # of the larger side of the mechanism, the longest arrow
_SHORTEST = 0.01  # of the longest arrow: shorter ones are not drawn
_STILL = 1e-9  # of the fastest point's rate: slower points stand still
_NEAR = 1.1  # larger sides of the mechanism from its middle up to which instant centres are drawn
_SHAPES = ("o", "s", "D", "^", "v", "p")
KINDS = ("velocity", "acceleration")


@picture(MotionView, "poses", order=30)
def poses_picture(view: MotionView) -> Picture | None:
    """A panel a pose, all on one scale, with a key of the arrows; None where nothing but its motion is to be seen."""
    study, sweep, chosen = view.study, view.sweep, view.drawn.special
    if not chosen.shown:
        return None
    centres = list(chosen.shown[0].centres)
    if not (chosen.special or chosen.rates or centres or sweep.poses.listed):
        return None
    stills = [Scene(study.mechanism, special.configuration, sweep.scene.travel).at(special.index)
              for special in chosen.shown]  # fmt: skip
    middle, *sides = extent(np.concatenate([still.places for still in stills if still is not None]))
    side, points = max(sides), pointing(study)
    scales = [_scale(chosen.shown, points, order, side) for order in range(len(KINDS))]
    panels = []
    for special, still in zip(chosen.shown, stills, strict=True):
        marks: list[PanelMark] = []
        for order, scale in enumerate(scales):
            if scale:
                own, unit = rates_of(special, order), study.units.label(KINDS[order])
                vectors = {point: scale * own[point] for point in points}
                marks.append(_arrows(special, vectors, order, _SHORTEST * _LONGEST * side, 1 / scale, unit))
        near = {centre: shape for centre, shape in zip(centres, _SHAPES * len(centres), strict=False)
                if abs(special.centres[centre] - middle) <= _NEAR * side}  # fmt: skip
        marks += [Dots([z.real], [z.imag], label=f"instant centre {centre.name}", look=centre_look(shape))
                  for centre, shape in near.items() for z in [special.centres[centre]]]  # fmt: skip
        away = [_where(study, centre, special.centres[centre]) for centre in centres if centre not in near]
        lost = chosen.rates and not np.isfinite(list(special.velocities.values())).all()
        remark = "; ".join(filter(None, (special.event, "singular, no rates" * lost, *away)))
        tips = [mark.places + mark.vectors for mark in marks if isinstance(mark, Arrows)]
        shows = [still.places if still is not None else np.array([middle]), *tips,
                 np.array([special.centres[centre] for centre in near], dtype=complex)]  # fmt: skip
        title = "\n".join(filter(None, (special.where, remark)))
        panels.append(drawn_plane([*marks, Posed(still, drives=False)], np.concatenate(shows), study, title))
    return Picture(_heading(chosen, listed=sweep.poses.listed), panels, across=_MAX_COLUMNS, share="xy")


def pointing(study: Study) -> list[str]:
    """Points whose rates are drawn: those asked for, else those that tell most."""
    section, ranked = study.kinematics, ranks(study)
    points = dict.fromkeys(name.split(".")[0] for name in (section and section.outputs) or ())
    return [name for name in points if name in ranked] or [
        name for name, rank in ranked.items() if rank == max(ranked.values())
    ]


def rates_of(special: SpecialPose, order: int) -> Any:
    return special.accelerations if order else special.velocities


def place_of(special: SpecialPose, point: str) -> complex:
    return complex(special.configuration.point(point)[special.index])


def _scale(shown: Sequence[SpecialPose], points: Sequence[str], order: int, side: float) -> float:
    """Length of an arrow over its rate, 0 where nothing moves."""
    sizes = np.array([abs(rates_of(special, order)[point]) for special in shown for point in points])
    fastest = np.array([abs(rate) for special in shown for rate in rates_of(special, order).values()])
    largest = float(np.nanmax(sizes, initial=0.0))
    usual = float(np.nanmax(fastest, initial=0.0))
    if order:
        # At velocities v over the size of the mechanism accelerations are about v^2 / size, however small by chance.
        speeds = np.array([abs(rate) for special in shown for rate in special.velocities.values()])
        usual = max(usual, float(np.nanmax(speeds, initial=0.0)) ** 2 / side)
    moves = largest > _STILL * usual
    return _LONGEST * side / largest if moves else 0.0


def _heading(chosen: SpecialPoses, *, listed: bool) -> str:
    heading = "Poses asked for" if listed else "Poses spread evenly over the motion"
    if chosen.special:
        ends = [special.event.startswith(LIMIT) for special in chosen.shown if special.event]
        singular = [special.event.startswith(SINGULAR) for special in chosen.shown if special.event]
        parts = ["limits of the motion"] * any(ends) + ["singular poses"] * any(singular)
        parts += ["links that come into line"] * (sum(ends) + sum(singular) < len(ends))
        parts += ["poses between"] * any(not special.event for special in chosen.shown)
        heading = ", ".join(parts)
        heading = heading[0].upper() + heading[1:]
    return heading + (f"; the first {len(chosen.shown)}, and {chosen.left_out} more" if chosen.left_out else "")


def _arrows(
    special: SpecialPose, vectors: Mapping[str, complex], order: int, least: float, size: float, unit: str
) -> Arrows:  # fmt: skip
    """Rates of points at a pose that are long enough to be seen."""
    long = {point: vector for point, vector in vectors.items() if np.isfinite(vector) and abs(vector) > least}
    places = np.array([place_of(special, point) for point in long], dtype=complex)
    along: Complexes = np.array([*long.values()], dtype=complex)
    return Arrows(places, along, size, unit, label=KINDS[order], look=RATES[order])


def _where(study: Study, centre: Centre, z: complex) -> str:
    """A centre that is not drawn, and where it is."""
    x, y = (part if abs(part) > _STILL * abs(z) else 0.0 for part in (z.real, z.imag))
    place = f"at ({numeral(x, 4)}, {numeral(y, 4)}) {study.units.label('length')}"
    where = place if np.isfinite(z) else "at infinity" if np.isinf(z) else "none"
    return f"centre of {centre.one}, {centre.other}: {where}"


def centre_look(shape: str = "o") -> dict[str, Any]:
    """How an instant centre is marked."""
    return {"marker": shape, "linestyle": "none", "markersize": 8.5, "markerfacecolor": (1, 1, 1, 0.35),
            "markeredgecolor": style.PURPLE, "markeredgewidth": 2.2, "zorder": 4.8}  # fmt: skip
