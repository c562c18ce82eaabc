"""What joints bear along a motion: forces and moments as curves, and hodographs; of several loads, or of one."""

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
from mechdesign.study import Study
from mechdesign.study.poses import TIME

MAX_JOINTS = 6  # curves with a look of their own
NOTHING = 1e-6  # part of the largest force that is rounding, as a force or as a difference of forces
# An axis ends at so many times what 9 of 10 poses have at most, for near a singularity forces grow without bounds.
_USUAL = 0.9
_BEYOND = 4.0
COLORS = (style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY)
DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (2, 1)), (0, (6, 1.5, 1, 1.5)), (0, (9, 2)), (0, (1, 0.7)))
_SINGLE, _PANEL, _LOW_PANEL = 2.5, 1.75, 1.3  # inches, of one, of few and of many
_LEGEND_LINE = 0.2  # inches
_HODOGRAPH = 3.6  # inches, its greatest height
_ARROWS = 3  # on a hodograph


@dataclass(frozen=True, eq=False)
class Joint:
    """What a joint bears in some cases: a force (x + iy) or a moment on one link by another, shape (poses, cases).

    Joints that bear as much at every pose are drawn as one, such as the two of a link that nothing else acts on; `name`
    names them all, `words` the two links of the first.
    """

    name: str
    words: str
    values: NDArray[Any]

    @property
    def peak(self) -> float:
        """Largest magnitude of any pose and case."""
        return float(np.nan_to_num(np.abs(self.values)).max(initial=0.0))


def peak(joints: Sequence[Joint]) -> float:
    """Largest magnitude of any of some joints."""
    return max((joint.peak for joint in joints), default=0.0)


def loaded(joints: Sequence[Joint], rounding: float) -> list[Joint]:
    """Joints with a peak above rounding, largest first; joints with equal magnitudes at every pose share one curve."""
    borne: list[Joint] = []
    for joint in joints:
        if joint.peak <= rounding:
            continue
        gaps = [Joint("", "", np.abs(joint.values) - np.abs(other.values)).peak for other in borne]
        if gaps and min(gaps) <= rounding:
            equal = gaps.index(min(gaps))
            borne[equal] = replace(borne[equal], name=f"{borne[equal].name}, {joint.name}")
        else:
            borne.append(replace(joint, values=np.where(np.abs(joint.values) <= rounding, 0.0, joint.values)))
    return sorted(borne, key=lambda joint: -joint.peak)


def joint_curves(
    study: Study, heading: str, kinds: Mapping[str, Sequence[Joint]], cases: Sequence[str], over: Along, *,
    cut: bool = True,
) -> Figure:  # fmt: skip
    """Panels of forces and of moments for each case, the largest of each marked.

    Parameters
    ----------
    cases : sequence of str
        Title of each case.
    cut : bool
        Whether rare peaks leave the axis: those near a singularity are not to hide the rest.
    """
    rows = [(number, kind, joints) for number in range(len(cases)) for kind, joints in kinds.items()
            if any(np.nan_to_num(joint.values[:, number]).any() for joint in joints)]  # fmt: skip
    looks = iter([{"color": color, "linestyle": dashes} for color, dashes in zip(COLORS, DASHES, strict=True)] * 2)
    look = {(kind, joint.name): next(looks) for kind, joints in kinds.items() for joint in joints}
    handles = [Line2D([], [], linewidth=1.8, label=f"{kind} in {name}", **look[kind, name]) for kind, name in look]
    labels = [str(line.get_label()) for line in handles]
    bottom = 0.65 + _LEGEND_LINE * (0.2 + -(-len(labels) // fitting(labels)))
    figure, panels = stack(
        len(rows),
        heading,
        over.label,
        tall=_SINGLE if len(rows) == 1 else _PANEL if len(rows) < 4 else _LOW_PANEL,
        bottom=bottom,
    )
    for axes, (number, kind, joints) in zip(panels, rows, strict=True):
        unit = study.units.label(kind)
        values = [np.abs(joint.values[:, number]) if kind == "force" else joint.values[:, number] for joint in joints]
        for joint, curve in zip(joints, values, strict=True):
            axes.plot(over.values, curve, linewidth=1.8, **look[kind, joint.name])
        worst = _mark_worst(study, axes, [joint.name for joint in joints], np.array(values), unit, over, cut)
        if kind == "force":
            axes.set_ylim(bottom=0)
        axes.set_ylabel(style.axis_label(kind, unit))
        title = ": ".join(filter(None, (cases[number], f"{kind} {worst}")))
        size = 6.5 if style.narrow() else 9.5
        axes.set_title(style.folded(title, size, style.width() - 1.0), loc="left", fontsize=size)
    tick_abscissa(panels[-1], over)
    panels[-1].set_xlim(float(over.values.min()), float(over.values.max()))
    clear_of_ticks(figure, panels)
    legend_below(figure, handles, labels)
    return figure


def _mark_worst(
    study: Study, axes: Axes, names: Sequence[str], values: Floats, unit: str, over: Along, cut: bool
) -> str:  # fmt: skip
    """Mark the largest of some values, shape (joints, poses), and return it in words."""
    sizes = np.nan_to_num(np.abs(values), nan=0.0, posinf=0.0)
    which, row = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
    least, most = np.nanmin(values, initial=0.0), float(sizes[which, row])
    usual = _BEYOND * float(np.quantile(sizes.max(axis=0), _USUAL))
    beyond = cut and most > usual > 0
    if beyond:
        axes.set_ylim(-usual if least < -usual else 1.1 * least, usual)
    value = float(values[which, row])
    place = float(np.clip(value, *axes.get_ylim())) if beyond else value
    axes.axvline(over.values[row], color=style.FAINT, linewidth=0.9, zorder=1.5)
    axes.plot(over.values[row], place, "^" if beyond else "o", color=style.INK, markersize=7, markerfacecolor="none",
              markeredgewidth=1.6, clip_on=False, zorder=5)  # fmt: skip
    ends = " (beyond the axis)" if beyond else ""
    where = place_in_words(study, over, float(over.values[row]))
    return f"at most {quantity(most, unit)}, in {names[int(which)]} at {where}{ends}"


def place_in_words(study: Study, over: Along, value: float) -> str:
    """Where on an abscissa: the coordinate with its value, or the number of the pose."""
    if not over.name:
        return f"pose {value:g}"
    unit = study.units.label("time" if over.name == TIME else study.mechanism.quantity(over.name))
    return f"{over.name} = {value:.6g} {unit}".rstrip()


def joint_hodographs(
    study: Study, joints: Sequence[Joint], cases: Sequence[str], over: Along, *, noun: str = "force", cut: bool = True
) -> Figure:  # fmt: skip
    """Where the tip of each joint's force goes, drawn from the origin, a panel a case with its title."""
    shown = np.array([joint.values[:, : len(cases)] for joint in joints])
    some = [number for number in range(len(cases)) if np.nan_to_num(shown[:, :, number]).any()]
    finite = shown[np.isfinite(shown)]
    # As for the curves, peaks near a singularity are left out.
    usual = _BEYOND * np.quantile(np.abs(finite), _USUAL) if cut else np.inf
    places = np.append(finite[np.abs(finite) <= usual], 0.0)
    columns = 1 if style.narrow() else len(some)
    window = fit(places, (style.width() - RIGHT - LEFT * columns) / columns, _HODOGRAPH, 0.2)
    labels = [f"{joint.name.split(', ')[0]}: {joint.words}" for joint in joints]
    rows = -(-len(labels) // fitting(labels))
    words = f"Way of the tip of each joint's {noun} over {over.name or 'the path'}; dot: first pose, ring: largest"
    size = 8.0 if style.narrow() else 11.0
    words = style.folded(words, size, style.width() - LEFT - RIGHT)
    figure, panels = windows(window, "", len(some), columns, above=0.28 if columns > 1 else 0.75, top=0.34,
                             below=BELOW + 0.1 + _LEGEND_LINE * rows)  # fmt: skip
    looks: list[dict[str, Any]] = [{"color": color, "linestyle": dashes}
                                   for color, dashes in zip(COLORS, DASHES, strict=True)]  # fmt: skip
    for axes, number in zip(panels, some, strict=True):
        force_axes(study, axes)
        for forces, look in zip(shown[:, :, number], looks, strict=False):
            hodograph(axes, forces, look)
        axes.set_title(cases[number], loc="left", fontsize=9.5)
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=size)
    handles = [Line2D([], [], linewidth=1.8, label=words, **look) for words, look in zip(labels, looks, strict=False)]
    style.name_powers(panels)
    legend_below(figure, handles, labels)
    return figure


def force_axes(study: Study, axes: Axes) -> None:
    """Name the axes of a force's components, and draw the lines of those."""
    unit = study.units.label("force")
    for axis, name in ((axes.xaxis, "fx"), (axes.yaxis, "fy")):
        axis.set_label_text(style.axis_label(name, unit))
        axis.set_tick_params(labelbottom=True, labelleft=True)
    axes.axhline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)
    axes.axvline(0, color=style.FAINT, linewidth=0.9, zorder=1.5)


def hodograph(axes: Axes, forces: Complexes, look: Mapping[str, Any]) -> None:
    """Hodograph of a force with its first and its largest value, and arrows in the direction of motion."""
    axes.plot(forces.real, forces.imag, linewidth=1.6, **look)
    finite = forces[np.isfinite(forces)]
    if not len(finite):
        return
    first, worst = finite[0], finite[np.argmax(np.abs(finite))]
    axes.plot(first.real, first.imag, "o", color=look["color"], markersize=5)
    axes.plot([0, worst.real], [0, worst.imag], color=look["color"], linewidth=0.8)
    axes.plot(worst.real, worst.imag, "o", color=look["color"], markersize=9, markerfacecolor="none",
              markeredgewidth=1.6)  # fmt: skip
    for k in np.linspace(0, len(finite) - 2, _ARROWS + 2).astype(int)[1:-1]:
        if finite[k] != finite[k + 1]:
            tail, tip = ((place.real, place.imag) for place in finite[k : k + 2])
            axes.annotate("", tip, tail, annotation_clip=True,
                          arrowprops={"arrowstyle": "-|>", "color": look["color"], "linewidth": 0, "shrinkA": 0,
                                      "shrinkB": 0, "mutation_scale": 12})  # fmt: skip
