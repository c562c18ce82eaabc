"""A picture of how evenly a point moves and holds over its region: ellipses of velocity and of force."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from mechdesign.drawing import style
from mechdesign.drawing.framing import extent
from mechdesign.drawing.marks import Own, PanelMark, Picture, Trace
from mechdesign.drawing.panels import quantity, round_down
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.workspace.figures.regions import fill, region_marks, region_picture, stretch_of
from mechdesign.questions.workspace.figures.view import WorkspaceView

# Half axis of the largest ellipse drawn at the common scale, over the distance of neighbouring places; of this share
# of the ellipses none is larger. The rest would cover others: they grow without bounds towards singularities.
_LARGEST = 0.48
_USUAL = 0.7
_TURN = np.exp(1j * np.linspace(0.0, 2 * np.pi, 97))
_VELOCITY: dict[str, Any] = {"color": style.BLUE, "linestyle": "-"}
_FORCE: dict[str, Any] = {"color": style.VERMILION, "linestyle": (0, (3, 1.2))}


@picture(WorkspaceView, "ellipses", order=40)
def ellipses_picture(view: WorkspaceView) -> Picture | None:
    """Velocity ellipses, J u for drive rates u of unit size, and force ellipses, J^-T u for efforts u [Yoshikawa 1985].

    None where the Jacobian is not that of a point, and in a strip that is stretched: circles would not be round.
    """
    study, section, units = view.study, view.study.workspace, view.study.units
    ellipses = view.drawn.ellipses if len(view.regions) == 1 else None
    if ellipses is None or section is None or not len(ellipses.places):
        return None
    title = f"where point {section.point} is fast (velocity ellipse) and where strong (force ellipse)"
    (region,) = view.regions
    _, wide, tall = extent(region.places())
    if stretch_of(wide / tall) != 1.0:
        return None
    marks: list[PanelMark] = [Own(partial(fill, local=region.local)), *region_marks(region)]
    u, sizes, _ = np.linalg.svd(ellipses.matrices)
    inverse = 1 / sizes
    directions = u[:, 0, :] + 1j * u[:, 1, :]
    mechanism = study.mechanism
    angular = section.characteristic_length is None and mechanism.quantity(mechanism.drives[0]) == "angle"
    length, velocity = units.label("length"), units.label("velocity")
    rate, effort = (f"rad/{units.time}", units.label("moment")) if angular else (velocity, units.label("force"))
    mixed = section.characteristic_length
    arcs = f", 1 rad = {quantity(mixed, length)}" if mixed is not None else ""
    thin = False
    for name, half, look, unit, cause in (
        ("velocity", sizes, _VELOCITY, velocity, f"rates (root of squares {_one(rate)}{arcs})"),
        ("force", inverse, _FORCE, units.label("force"), f"efforts (root of squares {_one(effort)})"),
    ):
        on_axes, stands_for, fits = _scale(half.max(axis=1), ellipses.spacing)
        words = f"{quantity(on_axes, length).rstrip()} long: {quantity(stands_for, unit)}"
        named = f"{name} by unit drive {cause}: half axis {words}"
        marks.append(Trace([], [], label=named, look=look | {"linewidth": 1.4}))
        edges, widths = [], []
        for place, axis, pair in zip(ellipses.places, directions, half * on_axes / stands_for, strict=True):
            largest = float(pair.max())
            small = largest > fits
            share = fits / largest if small else 1.0
            ends = np.minimum(share * pair, fits)
            edge = place + ends[0] * axis[0] * _TURN.real + ends[1] * axis[1] * _TURN.imag
            edges.append(np.column_stack([edge.real, edge.imag]))
            widths.append(0.7 if small else 1.4)
            thin |= small
        marks.append(Own(partial(_lines, edges, widths, look)))
    if thin:
        marks.append(Trace([], [], label="thin: longer than drawn", look={"color": style.FAINT, "linewidth": 0.7}))
    return region_picture(study, region.places(), [("", marks)], title)


def _lines(edges: list[Floats], widths: list[float], look: dict[str, Any], axes: Axes) -> None:
    axes.add_collection(LineCollection(edges, linewidths=widths, zorder=4, **look))


def _one(unit: str) -> str:
    """One of a unit: 1 mm/s, 1/s."""
    return printed(unit if unit.startswith("1/") else f"1 {unit}")


def _scale(half: Floats, spacing: float) -> tuple[float, float, float]:
    """A round length on the axes, the round value of a half axis it stands for, and the longest half axis drawn."""
    fits = _LARGEST * spacing
    usual = float(np.quantile(half[np.isfinite(half)], _USUAL))
    lengths = [round_down(fits / part) for part in (1.0, 2.2, 5.0)]
    # For each length the next round value above, so that no ellipse that should fit is larger.
    scales = [(length, 1 / round_down(fits / (length * usual))) for length in lengths]
    return (*max(scales, key=lambda pair: pair[0] / pair[1]), fits)
