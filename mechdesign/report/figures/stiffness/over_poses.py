"""Stiffness over the poses: ellipses of its directions in a few, curves along a motion, or maps over a plane."""

from __future__ import annotations

import re
import textwrap
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.analyses.poses import pose_in_words
from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import LEFT, RIGHT
from mechdesign.report.figures.panels import (
    Along,
    Plane,
    legend_at_left,
    map_sheet,
    quantity,
    round_down,
    tick_abscissa,
)
from mechdesign.report.figures.scene import pose
from mechdesign.report.figures.stiffness.sheets import panels_of_poses, symbol_size
from mechdesign.results import Result
from mechdesign.study import Study

MAX_DIRECTIONS = 4  # poses
_LARGEST_ELLIPSE = 0.3  # longest drawn half axis over the size of the mechanism
_ONE_SCALE = 8.0  # ratio of the longest half axes above which each ellipse is drawn at its own scale
_LETTERS_AN_INCH = 14.5  # of a panel's title
# Main axes of the ellipse: column, words, angle from that of k_max, colour and dashes.
_MAIN_AXES: tuple[tuple[str, str, float, str, Any], ...] = (
    ("k_min", "softest", np.pi / 2, style.VERMILION, "-"),
    ("k_max", "stiffest", 0.0, style.BLUE, (0, (2, 1))),
)
_LONGEST_NOTE = 900.0  # points of type times letters that fill a line above the curves
_NOTE_SHARE = 0.65  # of the width of a narrow page
_FLAT = 0.02  # part of its value by which a stiffness changes that is written, not drawn
_LOGARITHMIC = 5.0  # ratio of values above which their axis is logarithmic
# Such an axis ends at this ratio beyond what all but this share of the stiffnesses at either end are.
_BEYOND = 10.0
_TAIL = 0.04


def directions_figure(study: Study, result: Result) -> Figure | None:
    """Where a force of every direction moves the asked point: an ellipse at it, in a few poses, with its main axes."""
    table, soft, poses = result.tables["stiffness"], result.tables["compliance"], result.drawn["poses"]
    shown, section = result.drawn["shown"], study.stiffness
    assert section is not None
    index = np.flatnonzero(np.isfinite(soft["C11"][shown.rows]) & (table["k_max"][shown.rows] > 0))
    some = np.unique(np.linspace(0, len(index) - 1, min(MAX_DIRECTIONS, len(index))).astype(int))
    posed = {int(k): pose(study.mechanism, shown.configuration, int(k)) for k in index[some]}
    scenes = {k: scene for k, scene in posed.items() if scene is not None}
    if not scenes:
        return None
    rows = shown.rows[list(scenes)]
    soft_ends = 1 / table["k_min"][rows]
    if not (np.isfinite(soft_ends).all() and (soft_ends > 0).all()):
        return None
    if soft_ends.max() < _ONE_SCALE * soft_ends.min():
        soft_ends[:] = soft_ends.max()
    force, span = _force(study), max(scene.span for scene in scenes.values())
    scales = [force * round_down(_LARGEST_ELLIPSE * span / (force * end)) for end in soft_ends.tolist()]
    turns, ellipses = np.exp(1j * np.linspace(0, 2 * np.pi, 361)), []
    for row, scale in zip(rows, scales, strict=True):
        xx, xy, yy = (float(soft[name][row]) for name in ("C11", "C12", "C22"))
        ellipses.append(scale * (xx * turns.real + xy * turns.imag + 1j * (xy * turns.real + yy * turns.imag)))
    places = [[*scene.points.values(), *(scene.points[section.at] + ellipse)]
              for scene, ellipse in zip(scenes.values(), ellipses, strict=True)]  # fmt: skip
    words = f"{force:g} {style.printed(study.units.label('force'))}"
    heading = f"ellipse: where a force of {words} in any direction moves {section.at}"
    wide = (style.width() - RIGHT) / min(len(scenes), 2) - LEFT
    # Broken between coordinates only.
    named = [re.sub("(?<!,) ", "\N{NO-BREAK SPACE}", pose_in_words(study, poses, int(row), 4)) for row in rows]
    where = [textwrap.fill(words, int(wide * _LETTERS_AN_INCH)) for words in named]
    lines = 4 + max(words.count("\n") for words in where)
    figure, panels = panels_of_poses(study, np.concatenate(places), len(scenes), heading, lines=lines)
    units = study.units.label("stiffness"), study.units.label("angle")
    shapes = zip(panels, scenes.items(), rows, scales, ellipses, where, strict=True)
    for axes, (k, scene), row, scale, ellipse, words in shapes:
        at = scene.points[section.at]
        draw_mechanism(axes, study.mechanism, shown.configuration, k, faint=True, size=symbol_size(len(panels)))
        axes.fill((at + ellipse).real, (at + ellipse).imag, color=style.SKY, alpha=0.35, linewidth=0, zorder=4)
        axes.plot((at + ellipse).real, (at + ellipse).imag, color=style.INK, linewidth=1.2, zorder=5)
        angle, said = float(table["k_angle"][row]) * study.units.angle_factor, []
        for name, what, turn, color, dashes in _MAIN_AXES:
            stiff, way = float(table[name][row]), np.exp(1j * (angle + turn))
            line = at + scale / stiff * way * np.array([-1, 1])
            axes.plot(line.real, line.imag, color=color, linestyle=dashes, linewidth=1.8, zorder=5.2)
            toward = np.mod(np.angle(way), np.pi) / study.units.angle_factor
            said.append(f"{what} {quantity(stiff, units[0])} at {toward:.3g} {units[1]}")
        axes.plot(at.real, at.imag, "o", color=style.INK, markersize=4, zorder=5.4)
        said = [words, *said, f"drawn {scale / force:g} times as large"]
        axes.set_title("\n".join(said), loc="left", fontsize=8.5)
    handles = [Line2D([], [], color=color, linestyle=dashes, linewidth=1.8, label=f"{what} direction, {name}")
               for name, what, _, color, dashes in _MAIN_AXES]  # fmt: skip
    legend_at_left(figure, handles, len(handles))
    return figure


def _force(study: Study) -> float:
    """The force of an ellipse: about the largest of the study's loads, or else one unit."""
    assert study.stiffness is not None
    loads = [abs(complex(*load[:2])) for load in study.stiffness.loads]
    return round_down(max(loads)) if any(loads) else 1.0


def curves_figure(study: Study, result: Result, over: Along) -> Figure | None:
    """Stiffnesses to a force and to a moment along a path; what is the same everywhere is written, not drawn."""
    table, units = result.tables["stiffness"], study.units
    forces = {"k_x": ("-", style.BLUE, "o"), "k_y": ("-", style.ORANGE, "s"), "k_min": ("--", style.INK, ""),
              "k_max": (":", style.INK, "")}  # fmt: skip
    moments = {"k_phi": ("-", style.GREEN, "")}
    panels = []
    for about, kind, looks in (("stiffness to a force", "stiffness", forces),
                               ("to a moment", "rotational_stiffness", moments)):  # fmt: skip
        known = [name for name in looks if name in table and np.isfinite(table[name]).any()]
        flat = [name for name in known if _constant(table[name])]
        panels.append((about, units.label(kind), looks, [name for name in known if name not in flat], flat))
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
            each = max(1, len(values) // 12)
            axis.plot(over.values, values, dashes, label=name, color=color, marker=marker, markersize=5,
                      markevery=(k * each // 2, each), linewidth=2.4 if marker else 1.4)  # fmt: skip
        axis.set_ylabel(style.axis_label(about, unit))
        low, high = axis.dataLim.intervaly
        if high > _LOGARITHMIC * low > 0:
            axis.set_yscale("log")
            # Near a singularity a stiffness grows or vanishes without bounds; what it is elsewhere stays legible.
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
    known = values[np.isfinite(values)]
    return len(known) == len(values) and float(np.ptp(known)) <= _FLAT * float(np.abs(known).max())


def map_figure(study: Study, result: Result, over: Plane) -> Figure:
    """k_min over the poses, and k_max beside it."""
    table, unit = result.tables["stiffness"], study.units.label("stiffness")
    parts = []
    for name in ("k_min", "k_max"):
        values = np.where(np.isfinite(table[name]) & (table[name] > 0), table[name], np.nan)
        parts.append((style.axis_label(name, unit), values.reshape(over.x.shape)))
    about = f"at point {study.stiffness.at}" if study.stiffness is not None else ""
    return map_sheet(study, over, parts, "Stiffness to a force in the softest and the stiffest direction", about,
                     logarithmic=True)  # fmt: skip
