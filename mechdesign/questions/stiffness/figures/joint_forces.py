"""Pictures of what joints bear under static loads along a motion: forces and moments as curves, and hodographs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.report.figures import style
from mechdesign.report.figures.framing import BELOW, LEFT, RIGHT, fit, windows
from mechdesign.report.figures.panels import (
    Along,
    clear_of_ticks,
    fitting,
    legend_below,
    quantity,
    stack,
    tick_abscissa,
)
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study

MAX_JOINTS = 6  # curves with a look of their own
MAX_LOADS = 3  # each with a panel of forces and one of moments
_NOTHING = 1e-6  # part of the largest force that is rounding, as a force or as a difference of forces
# An axis ends at so many times what 9 of 10 poses have at most, for near a singularity forces grow without bounds.
_USUAL = 0.9
_BEYOND = 4.0
_COLORS = (style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY)
_DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (2, 1)), (0, (6, 1.5, 1, 1.5)), (0, (9, 2)), (0, (1, 0.7)))
HEADING = "Static forces in the joints: the load alone, no inertia"
_PANEL, _LOW_PANEL = 1.75, 1.3  # inches, of few and of many
_LEGEND_LINE = 0.2  # inches
_HODOGRAPH = 3.6  # inches, its greatest height
_ARROWS = 3  # on a hodograph


@dataclass(frozen=True, eq=False)
class Joint:
    """What a joint bears under each load: a force (x + iy) or a moment on one link by another, shape (poses, loads).

    Joints that bear as much at every pose are drawn as one, such as the two of a link that nothing else acts on; `name`
    names them all, `words` the two links of the first.
    """

    name: str
    words: str
    values: NDArray[Any]

    @property
    def peak(self) -> float:
        """Largest magnitude of any pose and load."""
        return float(np.nan_to_num(np.abs(self.values)).max(initial=0.0))


def borne(table: Table, poses: int, reach: float) -> tuple[list[Joint], list[Joint]]:
    """Joints that bear a force, and joints that bear a moment, the most loaded first.

    Parameters
    ----------
    table : Table
        ``forces.csv``.
    reach : float
        Size of the mechanism: what is no more than rounding of the largest force at this arm is no moment.
    """
    loads = int(table["load"].max())
    joints = len(table) // (poses * loads)
    x, y, turning = (table[name].reshape(poses, loads, joints) for name in ("fx", "fy", "mz"))
    names, on, by = (table[name][:joints].tolist() for name in ("joint", "on", "by"))
    forces, moments = [], []
    for k, name in enumerate(names):
        # This is the load itself, at a point of one link.
        if on[k] == "asked" and on.count("asked") == 1:
            continue
        massless = on[k] == "asked" or on[k].startswith(("pin:", "slot:"))
        words = f"on {'the pin' if massless else on[k]} by {by[k]}"
        called = f"{name} ({by[k]})" if names.count(name) > 1 else name
        forces.append(Joint(called, words, x[..., k] + 1j * y[..., k]))
        moments.append(Joint(called, words, turning[..., k]))
    largest = max((force.peak for force in forces), default=0.0)
    return _loaded(forces, _NOTHING * largest), _loaded(moments, _NOTHING * max(largest * reach, _peak(moments)))


def _peak(joints: Sequence[Joint]) -> float:
    return max((joint.peak for joint in joints), default=0.0)


def _loaded(joints: Sequence[Joint], rounding: float) -> list[Joint]:
    """Joints with a peak above rounding, largest first; joints with equal magnitudes at every pose share one curve."""
    loaded: list[Joint] = []
    for joint in joints:
        if joint.peak <= rounding:
            continue
        gaps = [Joint("", "", np.abs(joint.values) - np.abs(other.values)).peak for other in loaded]
        if gaps and min(gaps) <= rounding:
            equal = gaps.index(min(gaps))
            loaded[equal] = replace(loaded[equal], name=f"{loaded[equal].name}, {joint.name}")
        else:
            loaded.append(replace(joint, values=np.where(np.abs(joint.values) <= rounding, 0.0, joint.values)))
    return sorted(loaded, key=lambda joint: -joint.peak)


@picture(StiffnessView, "joint_forces", "force_hodographs", order=60)
def joint_force_figures(view: StiffnessView) -> dict[str, Figure] | None:
    """``joint_forces`` over the poses of a motion, and ``force_hodographs``; none where no joint bears anything."""
    study, over = view.study, view.swept
    section = study.stiffness
    assert section is not None
    if over is None or "forces" not in view.result.tables:
        return None
    forces, moments = borne(view.result.tables["forces"], view.poses.count, study.mechanism.size)
    if not forces:
        return None
    loads = [f"{load_in_words(study, load)} at {section.at}" for load in section.loads[:MAX_LOADS]]
    kinds = {"force": forces[:MAX_JOINTS], "moment": moments[:MAX_JOINTS]}
    return {
        "joint_forces": _curves(study, kinds, loads, over),
        "force_hodographs": _hodographs(study, kinds["force"], loads, over),
    }


def _curves(study: Study, kinds: Mapping[str, Sequence[Joint]], loads: Sequence[str], over: Along) -> Figure:
    """Panels of forces and of moments for each load, the largest of each marked."""
    rows = [(number, kind, joints) for number in range(len(loads)) for kind, joints in kinds.items()
            if any(np.nan_to_num(joint.values[:, number]).any() for joint in joints)]  # fmt: skip
    looks = iter([{"color": color, "linestyle": dashes} for color, dashes in zip(_COLORS, _DASHES, strict=True)] * 2)
    look = {(kind, joint.name): next(looks) for kind, joints in kinds.items() for joint in joints}
    handles = [Line2D([], [], linewidth=1.8, label=f"{kind} in {name}", **look[kind, name]) for kind, name in look]
    labels = [str(line.get_label()) for line in handles]
    bottom = 0.65 + _LEGEND_LINE * (0.2 + -(-len(labels) // fitting(labels)))
    figure, panels = stack(len(rows), HEADING, over.label, tall=_PANEL if len(rows) < 4 else _LOW_PANEL, bottom=bottom)
    for axes, (number, kind, joints) in zip(panels, rows, strict=True):
        unit = study.units.label(kind)
        values = [np.abs(joint.values[:, number]) if kind == "force" else joint.values[:, number] for joint in joints]
        for joint, curve in zip(joints, values, strict=True):
            axes.plot(over.values, curve, linewidth=1.8, **look[kind, joint.name])
        worst = _mark_worst(study, axes, [joint.name for joint in joints], np.array(values), unit, over)
        if kind == "force":
            axes.set_ylim(bottom=0)
        axes.set_ylabel(style.axis_label(kind, unit))
        title = f"{loads[number]}: {kind} {worst}"
        size = 6.5 if style.narrow() else 9.5
        axes.set_title(style.folded(title, size, style.width() - 1.0), loc="left", fontsize=size)
    tick_abscissa(panels[-1], over)
    panels[-1].set_xlim(float(over.values.min()), float(over.values.max()))
    clear_of_ticks(figure, panels)
    legend_below(figure, handles, labels)
    return figure


def _mark_worst(
    study: Study, axes: Axes, names: Sequence[str], values: Floats, unit: str, over: Along
) -> str:  # fmt: skip
    """Mark the largest of some values, shape (joints, poses), and return it in words; rare peaks leave the axis."""
    sizes = np.nan_to_num(np.abs(values), nan=0.0, posinf=0.0)
    which, row = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
    least, most = np.nanmin(values, initial=0.0), float(sizes[which, row])
    usual = _BEYOND * float(np.quantile(sizes.max(axis=0), _USUAL))
    beyond = most > usual > 0
    if beyond:
        axes.set_ylim(-usual if least < -usual else 1.1 * least, usual)
    value = float(values[which, row])
    place = float(np.clip(value, *axes.get_ylim())) if beyond else value
    axes.axvline(over.values[row], color=style.FAINT, linewidth=0.9, zorder=1.5)
    axes.plot(over.values[row], place, "^" if beyond else "o", color=style.INK, markersize=7, markerfacecolor="none",
              markeredgewidth=1.6, clip_on=False, zorder=5)  # fmt: skip
    ends = " (beyond the axis)" if beyond else ""
    of = study.units.label(study.mechanism.quantity(over.name)) if over.name else ""
    at = f"{over.name} = {over.values[row]:.6g} {of}".rstrip() if over.name else f"pose {over.values[row]:g}"
    return f"at most {quantity(most, unit)}, in {names[int(which)]} at {at}{ends}"


def _hodographs(study: Study, joints: Sequence[Joint], loads: Sequence[str], over: Along) -> Figure:
    """Where the tip of each joint's force goes, drawn from the origin, a panel a load."""
    shown = np.array([joint.values[:, : len(loads)] for joint in joints])
    some = [number for number in range(len(loads)) if np.nan_to_num(shown[:, :, number]).any()]
    known = shown[np.isfinite(shown)]
    # As for the curves, peaks near a singularity are left out.
    places = np.append(known[np.abs(known) <= _BEYOND * np.quantile(np.abs(known), _USUAL)], 0.0)
    columns, unit = len(some), study.units.label("force")
    window = fit(places, (style.width() - RIGHT - LEFT * columns) / columns, _HODOGRAPH, 0.2)
    labels = [f"{joint.name.split(', ')[0]}: {joint.words}" for joint in joints]
    rows = -(-len(labels) // fitting(labels))
    figure, panels = windows(window, "", columns, columns, above=0.28, top=0.34,
                             below=BELOW + 0.1 + _LEGEND_LINE * rows)  # fmt: skip
    looks: list[dict[str, Any]] = [{"color": color, "linestyle": dashes}
                                   for color, dashes in zip(_COLORS, _DASHES, strict=True)]  # fmt: skip
    for axes, number in zip(panels, some, strict=True):
        for axis, name in ((axes.xaxis, "fx"), (axes.yaxis, "fy")):
            axis.set_label_text(style.axis_label(name, unit))
        axes.axhline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)
        axes.axvline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)
        for forces, look in zip(shown[:, :, number], looks, strict=False):
            _hodograph(axes, forces, look)
        axes.set_title(loads[number], loc="left", fontsize=9.5)
    words = (
        f"Way of the tip of each joint's static force over {over.name or 'the path'}; dot: first pose, ring: largest"
    )
    size = 8.0 if style.narrow() else 11.0
    words = style.folded(words, size, style.width() - LEFT)
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=size)
    handles = [Line2D([], [], linewidth=1.8, label=words, **look) for words, look in zip(labels, looks, strict=False)]
    legend_below(figure, handles, labels)
    return figure


def _hodograph(axes: Axes, forces: Complexes, look: Mapping[str, Any]) -> None:
    """Hodograph of a force with its first and its largest value, and arrows in the direction of motion."""
    axes.plot(forces.real, forces.imag, linewidth=1.6, **look)
    known = forces[np.isfinite(forces)]
    if not len(known):
        return
    first, worst = known[0], known[np.argmax(np.abs(known))]
    axes.plot(first.real, first.imag, "o", color=look["color"], markersize=5)
    axes.plot([0, worst.real], [0, worst.imag], color=look["color"], linewidth=0.8)
    axes.plot(worst.real, worst.imag, "o", color=look["color"], markersize=9, markerfacecolor="none",
              markeredgewidth=1.6)  # fmt: skip
    for k in np.linspace(0, len(known) - 2, _ARROWS + 2).astype(int)[1:-1]:
        if known[k] != known[k + 1]:
            tail, tip = ((place.real, place.imag) for place in known[k : k + 2])
            axes.annotate("", tip, tail, annotation_clip=True,
                          arrowprops={"arrowstyle": "-|>", "color": look["color"], "linewidth": 0, "shrinkA": 0,
                                      "shrinkB": 0, "mutation_scale": 12})  # fmt: skip


def load_in_words(study: Study, load: Sequence[float]) -> str:
    """``fx = 3 N, mz = 2 N·m``, without what is zero."""
    units = [study.units.label(kind) for kind in ("force", "force", "moment")]
    parts = [
        f"{name} = {value:g} {style.printed(unit)}"
        for name, value, unit in zip(("fx", "fy", "mz"), load, units, strict=False)
        if value
    ]
    return ", ".join(parts) or "no load"
