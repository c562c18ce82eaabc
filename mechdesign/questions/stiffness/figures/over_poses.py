"""Stiffness over the poses: curves along a motion, or maps over a plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Panel, Picture, Trace
from mechdesign.drawing.panels import Along, Plane, maps, quantity
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.study import Study

_LOOKS = {
    "stiffness": {"k_x": ("-", style.BLUE, "o"), "k_y": ("-", style.ORANGE, "s"), "k_min": ("--", style.INK, ""),
                  "k_max": (":", style.INK, "")},
    "rotational_stiffness": {"k_phi": ("-", style.GREEN, "")},
}  # fmt: skip
_FLAT = 0.02  # part of its value by which a stiffness changes that is written, not drawn
_LOGARITHMIC = 5.0  # ratio of values above which their axis is logarithmic
# A logarithmic axis ends this factor beyond the quantiles at this share and its complement.
_BEYOND = 10.0
_TAIL = 0.04


@picture(StiffnessView, "stiffness", order=50)
def stiffness_picture(view: StiffnessView) -> Picture | None:
    """Stiffnesses along a motion, or a map of them; None of poses that are neither."""
    table = view.table("stiffness")
    if view.over is not None:
        return _map(view.study, table, view.over)
    return _curves(view.study, table, view.swept) if view.swept is not None else None


def _curves(study: Study, table: Table, over: Along) -> Picture | None:
    """Stiffnesses to a force and to a moment along a path; what is the same everywhere is written, not drawn."""
    panels, notes, shown = [], list[str](), list[tuple[str, str, list[str], list[str]]]()
    for about, kind in (("stiffness to a force", "stiffness"), ("to a moment", "rotational_stiffness")):
        names = [name for name in _LOOKS[kind] if name in table]
        finite = [name for name in names if np.isfinite(table[name]).any()]
        flat, unit = [name for name in finite if _constant(table[name])], study.units.label(kind)
        notes += [f"{name} = {quantity(float(np.nanmean(table[name])), unit)}" for name in flat]
        shown.append((kind, about, [name for name in finite if name not in flat], flat))
    notes += [f"{name} rigid" for looks in _LOOKS.values() for name in looks
              if name in table and np.isinf(table[name]).all()]  # fmt: skip
    moving = any(curves for *_, curves, _ in shown)
    for kind, about, curves, flat in shown:
        names = curves if moving else flat
        if not names:
            continue
        marks = []
        for k, name in enumerate(names):
            dashes, color, marker = _LOOKS[kind][name]
            marks.append(Trace(over.values, np.where(np.isfinite(table[name]), table[name], np.nan), label=name, look={
                "linestyle": dashes, "color": color, "marker": marker, "markersize": 5,
                "markevery": over.spread(12, k / 2), "linewidth": 2.4 if marker else 1.4}))  # fmt: skip
        axis = _axis(about, study.units.label(kind), [table[name] for name in names])
        panels.append(Panel(marks, over.axis, axis, legend="beside"))
    if not panels:
        return None
    note = f"everywhere the same: {', '.join(notes)}" if notes else ""
    return Picture("Stiffness along the motion", panels, (note,), share="x")


def _axis(about: str, unit: str, curves: Sequence[Floats]) -> Axis:
    """From zero, or logarithmic: near a singularity a stiffness grows without bound or vanishes, elsewhere it stays
    legible."""
    every = np.concatenate(curves)
    every = every[np.isfinite(every)]
    low, high = float(every.min()), float(every.max())
    if not high > _LOGARITHMIC * low > 0:
        return Axis(about, unit, ends=(0.0, 1.1 * high))
    usual = np.quantile(every[every > 0], (_TAIL, 1 - _TAIL)) * (1 / _BEYOND, _BEYOND)
    return Axis(about, unit, "log", (max(0.8 * low, float(usual[0])), min(1.25 * high, float(usual[1]))))


def _constant(values: Floats) -> bool:
    finite = values[np.isfinite(values)]
    return len(finite) == len(values) and float(np.ptp(finite)) <= _FLAT * float(np.abs(finite).max())


def _map(study: Study, table: Table, over: Plane) -> Picture:
    """k_min over the poses, and k_max beside it."""
    unit = study.units.label("stiffness")
    parts = []
    for name in ("k_min", "k_max"):
        values = np.where(np.isfinite(table[name]) & (table[name] > 0), table[name], np.nan)
        parts.append((style.axis_label(name, unit), values.reshape(over.x.shape)))
    about = f"at point {study.stiffness.at}" if study.stiffness is not None else ""
    return maps(study, over, parts, "Stiffness to a force in the softest and the stiffest direction", about,
                logarithmic=True)  # fmt: skip
