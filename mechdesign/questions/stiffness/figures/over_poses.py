"""Stiffness over the poses: curves along a motion, or maps over a plane."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import Along, Plane, map_sheet, quantity, tick_abscissa
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study

_LONGEST_NOTE = 900.0  # points of type times letters that fill a line above the curves
_NOTE_SHARE = 0.65  # of the width of a narrow page
_FLAT = 0.02  # part of its value by which a stiffness changes that is written, not drawn
_LOGARITHMIC = 5.0  # ratio of values above which their axis is logarithmic
# A logarithmic axis ends this factor beyond the quantiles at this share and its complement.
_BEYOND = 10.0
_TAIL = 0.04


@picture(StiffnessView, "stiffness", order=50)
def stiffness_figure(view: StiffnessView) -> Figure | None:
    """Stiffnesses along a motion, or a map of them; None of poses that are neither."""
    table = view.result.tables["stiffness"]
    if view.over is not None:
        return _map(view.study, table, view.over)
    return _curves(view.study, table, view.swept) if view.swept is not None else None


def _curves(study: Study, table: Table, over: Along) -> Figure | None:
    """Stiffnesses to a force and to a moment along a path; what is the same everywhere is written, not drawn."""
    units = study.units
    forces = {"k_x": ("-", style.BLUE, "o"), "k_y": ("-", style.ORANGE, "s"), "k_min": ("--", style.INK, ""),
              "k_max": (":", style.INK, "")}  # fmt: skip
    moments = {"k_phi": ("-", style.GREEN, "")}
    panels = []
    for about, kind, looks in (("stiffness to a force", "stiffness", forces),
                               ("to a moment", "rotational_stiffness", moments)):  # fmt: skip
        names = [name for name in looks if name in table and np.isfinite(table[name]).any()]
        flat = [name for name in names if _constant(table[name])]
        panels.append((about, units.label(kind), looks, [name for name in names if name not in flat], flat))
    if not any(curves or flat for *_, curves, flat in panels):
        return None
    notes = [f"{name} = {quantity(float(np.nanmean(table[name])), unit)}"
             for _, unit, _, _, flat in panels for name in flat]  # fmt: skip
    notes += [f"{name} rigid" for name in (*forces, *moments) if name in table and np.isinf(table[name]).all()]
    drawn = [panel for panel in panels if panel[3]] or [panel for panel in panels if panel[4]]
    figure = style.new_figure(5.2 if len(drawn) > 1 else 3.6)
    axes = figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (about, unit, looks, curves, flat) in zip(axes, drawn, strict=True):
        for k, name in enumerate(curves or flat):
            values = np.where(np.isfinite(table[name]), table[name], np.nan)
            dashes, color, marker = looks[name]
            step = max(1, len(values) // 12)
            axis.plot(over.values, values, dashes, label=name, color=color, marker=marker, markersize=5,
                      markevery=(k * step // 2, step), linewidth=2.4 if marker else 1.4)  # fmt: skip
        axis.set_ylabel(style.axis_label(about, unit))
        low, high = axis.dataLim.intervaly
        if high > _LOGARITHMIC * low > 0:
            axis.set_yscale("log")
            # Near a singularity a stiffness grows without bound or vanishes; elsewhere it stays legible.
            every = np.concatenate(
                [table[name][np.isfinite(table[name]) & (table[name] > 0)] for name in curves or flat]
            )
            usual = np.quantile(every, (_TAIL, 1 - _TAIL)) * (1 / _BEYOND, _BEYOND)
            axis.set_ylim(max(0.8 * low, usual[0]), min(1.25 * high, usual[1]))
        else:
            axis.set_ylim(0, 1.1 * high)
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    words = f"everywhere the same: {', '.join(notes)}"
    size = 9.0 if style.narrow() else min(9.0, _LONGEST_NOTE / len(words))
    if style.narrow():
        words = style.folded(words, size, _NOTE_SHARE * style.width())
    above = 20 + 72 * style.line(size) * words.count("\n")
    axes[0].set_title("Stiffness along the motion", loc="left", fontsize=10, pad=above if notes else 6)
    if notes:
        axes[0].annotate(words, (0, 1), (0, 6), "axes fraction", "offset points", fontsize=size)
    axes[-1].set_xlabel(over.label)
    tick_abscissa(axes[-1], over)
    figure.align_ylabels(axes)
    return figure


def _constant(values: Floats) -> bool:
    finite = values[np.isfinite(values)]
    return len(finite) == len(values) and float(np.ptp(finite)) <= _FLAT * float(np.abs(finite).max())


def _map(study: Study, table: Table, over: Plane) -> Figure:
    """k_min over the poses, and k_max beside it."""
    unit = study.units.label("stiffness")
    parts = []
    for name in ("k_min", "k_max"):
        values = np.where(np.isfinite(table[name]) & (table[name] > 0), table[name], np.nan)
        parts.append((style.axis_label(name, unit), values.reshape(over.x.shape)))
    about = f"at point {study.stiffness.at}" if study.stiffness is not None else ""
    return map_sheet(study, over, parts, "Stiffness to a force in the softest and the stiffest direction", about,
                     logarithmic=True)  # fmt: skip
