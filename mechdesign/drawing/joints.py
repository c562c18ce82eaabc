"""What joints bear along a motion: forces and moments as curves, and hodographs; of several loads, or of one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from mechdesign.drawing import style
from mechdesign.drawing.marks import Axis, Dots, Lines, Own, Panel, PanelMark, Picture, Trace
from mechdesign.drawing.panels import Along, quantile, quantity
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.numerics.rounding import STILL, unchanging
from mechdesign.motion.rules import TIME
from mechdesign.study import Study

MAX_JOINTS = 6  # curves with a look of their own
NOTHING = 1e-6  # part of the largest force that is rounding, as a force or as a difference of forces
# An axis ends at so many times what 9 of 10 poses have at most, for near a singularity forces grow without bounds.
_USUAL = 0.9
_BEYOND = 4.0
_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.BLUE, "linestyle": "-"}, {"color": style.VERMILION, "linestyle": (0, (6, 1.5))},
    {"color": style.GREEN, "linestyle": (0, (2, 1))}, {"color": style.ORANGE, "linestyle": (0, (6, 1.5, 1, 1.5))},
    {"color": style.PURPLE, "linestyle": (0, (9, 2))}, {"color": style.SKY, "linestyle": (0, (1, 0.7))},
)  # fmt: skip
# A ring about a peak.
PEAK: dict[str, Any] = {"color": style.INK, "markersize": 7, "markerfacecolor": "none", "markeredgewidth": 1.6,
                        "clip_on": False, "zorder": 5}  # fmt: skip
_ARROWS = 3  # on a hodograph
_SHAFT = 0.01  # of its way, the part that gives an arrow its direction
_EDGE = 0.06  # of the largest component, about hodographs


@dataclass(frozen=True, eq=False)
class JointLoad:
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


def peak(joints: Sequence[JointLoad]) -> float:
    """Largest magnitude of any of some joints."""
    return max((joint.peak for joint in joints), default=0.0)


def largest(sizes: Floats) -> int:
    """Index of the largest of some sizes along a motion, flat; of those that differ by rounding the first."""
    return int(np.argmax(sizes.ravel() >= (1 - STILL) * np.nanmax(sizes)))


def loaded(joints: Sequence[JointLoad], rounding: float) -> list[JointLoad]:
    """Joints with a peak above rounding, largest first; joints with equal magnitudes at every pose share one curve."""
    borne: list[JointLoad] = []
    for joint in joints:
        if joint.peak <= rounding:
            continue
        gaps = [JointLoad("", "", np.abs(joint.values) - np.abs(other.values)).peak for other in borne]
        if gaps and min(gaps) <= rounding:
            equal = gaps.index(min(gaps))
            borne[equal] = replace(borne[equal], name=f"{borne[equal].name}, {joint.name}")
        else:
            borne.append(replace(joint, values=np.where(np.abs(joint.values) <= rounding, 0.0, joint.values)))
    return sorted(borne, key=lambda joint: -joint.peak)


def joint_curves(
    study: Study, heading: str, kinds: Mapping[str, Sequence[JointLoad]], cases: Sequence[str], over: Along, *,
    cut: bool = True,
) -> Picture:  # fmt: skip
    """Panels of forces and of moments for each case, the largest of each marked.

    Parameters
    ----------
    cases : sequence of str
        Title of each case.
    cut : bool
        Whether rare peaks leave the axis: those near a singularity are not to hide the rest.
    """
    looks = iter([*_LOOKS, *_LOOKS])
    look = {(kind, joint.name): next(looks) | {"linewidth": 1.8} for kind, joints in kinds.items() for joint in joints}
    panels = []
    for number, case in enumerate(cases):
        for kind, joints in kinds.items():
            if not any(np.nan_to_num(joint.values[:, number]).any() for joint in joints):
                continue
            values = np.array([joint.values[:, number] for joint in joints])
            values = np.abs(values) if kind == "force" else values
            marks: list[PanelMark] = [
                Trace(over.values, curve, label=f"{kind} in {joint.name}", look=look[kind, joint.name])
                for joint, curve in zip(joints, values, strict=True)
            ]
            unit = study.units.label(kind)
            worst, ends = _mark_worst(study, [joint.name for joint in joints], values, unit, over, cut, marks)
            axis = Axis(kind, unit, ends=(0.0, ends[1]) if kind == "force" else ends)
            panels.append(Panel(marks, over.axis, axis, ": ".join(filter(None, (case, f"{kind} {worst}")))))
    return Picture(heading, panels, share="x")


def _mark_worst(
    study: Study, names: Sequence[str], values: Floats, unit: str, over: Along, cut: bool, marks: list[PanelMark]
) -> tuple[str, tuple[float | None, float | None]]:  # fmt: skip
    """Mark the largest of some values, shape (joints, poses); it in words, and ends of the axis before rare peaks."""
    sizes = np.nan_to_num(np.abs(values), nan=0.0, posinf=0.0)
    which, row = np.unravel_index(largest(sizes), sizes.shape)
    least, most, value = float(np.nanmin(values, initial=0.0)), float(sizes[which, row]), float(values[which, row])
    # Each place counts by how much of the motion is its: there are more of them where a curve bends.
    parts = np.abs(np.gradient(over.values)) if over.values.size > 1 else np.ones(1)
    usual = _BEYOND * quantile(sizes.max(axis=0), parts, _USUAL)
    beyond, ends = cut and most > usual > 0, tuple[float | None, float | None]((None, None))
    if beyond:
        ends = -usual if least < -usual else 1.1 * least, usual
        value = float(np.clip(value, *ends))
    if unchanging(np.nanmin(values[which]), np.nanmax(values[which])):
        return f"{quantity(most, unit)} everywhere, in {names[int(which)]}", ends
    marks.append(Lines([over.values[row]], "x", look={"color": style.FAINT, "linewidth": 0.9, "zorder": 1.5}))
    marks.append(Dots([over.values[row]], [value], look=PEAK | {"marker": "^" if beyond else "o"}))
    where = place_in_words(study, over, float(over.values[row]))
    return f"at most {quantity(most, unit)}, in {names[int(which)]} at {where}{' (beyond the axis)' * beyond}", ends


def place_in_words(study: Study, over: Along, value: float) -> str:
    """Where on an abscissa: the coordinate with its value, or the number of the pose."""
    if not over.name:
        return f"pose {value:g}"
    unit = study.units.label("time" if over.name == TIME else study.mechanism.quantity(over.name))
    return f"{over.name} = {numeral(value)} {unit}".rstrip()


def joint_hodographs(
    study: Study, joints: Sequence[JointLoad], cases: Sequence[str], over: Along, *, noun: str = "force",
    cut: bool = True,
) -> Picture:  # fmt: skip
    """Where the tip of each joint's force goes, drawn from the origin, a panel a case with its title."""
    shown = np.array([joint.values[:, : len(cases)] for joint in joints])
    finite = shown[np.isfinite(shown)]
    # As for the curves, peaks near a singularity are left out.
    usual = _BEYOND * np.quantile(np.abs(finite), _USUAL) if cut else np.inf
    places = np.append(finite[np.abs(finite) <= usual], 0.0)
    panels = []
    for number, case in enumerate(cases):
        if np.nan_to_num(shown[:, :, number]).any():
            marks = [mark for joint, forces, look in zip(joints, shown[:, :, number], _LOOKS, strict=False)
                     for mark in hodograph(forces, look, f"{joint.name.split(', ')[0]}: {joint.words}")]  # fmt: skip
            panels.append(force_panel(study, marks, case, places))
    words = f"Way of the tip of each joint's {noun} over {over.name or 'the path'}; dot: first pose, ring: largest"
    return Picture(words, panels, across=3)


def force_panel(study: Study, ways: Iterable[PanelMark], title: str, places: Complexes | None = None) -> Panel:
    """Hodographs over the components of a force on one scale, in a window that shows some places, or all."""
    unit, thin = study.units.label("force"), {"color": style.FAINT, "linewidth": 0.9, "zorder": 1.5}
    ends = [(None, None)] * 2 if places is None else [
        (float(part.min() - _EDGE * size), float(part.max() + _EDGE * size))
        for size in [max(np.ptp(places.real), np.ptp(places.imag))] for part in (places.real, places.imag)
    ]  # fmt: skip
    marks = [Lines([0.0], look=thin), Lines([0.0], "x", look=thin), *ways]
    return Panel(marks, Axis("fx", unit, ends=ends[0]), Axis("fy", unit, ends=ends[1]), title, equal=True)


def hodograph(forces: Complexes, look: Mapping[str, Any], label: str = "") -> Iterator[PanelMark]:
    """Hodograph of a force with its first and its largest value, and arrows in the direction of motion."""
    yield Trace(forces.real, forces.imag, label=label, look={"linewidth": 1.6} | dict(look))
    finite, color = forces[np.isfinite(forces)], look["color"]
    if not len(finite):
        return
    first, worst = finite[0], finite[largest(np.abs(finite))]
    yield Dots([first.real], [first.imag], look={"color": color, "markersize": 5})
    yield Trace([0, worst.real], [0, worst.imag], look={"color": color, "linewidth": 0.8})
    yield Dots([worst.real], [worst.imag], look=PEAK | {"color": color, "markersize": 9, "clip_on": True})
    way = np.append(0.0, np.cumsum(np.abs(np.diff(finite))))
    heads = np.linspace(0, way[-1], _ARROWS + 2)[1:-1]
    ends = (np.interp(at, way, finite) for at in (heads - _SHAFT * way[-1], heads))
    yield Own(partial(_arrows, [(tail, tip) for tail, tip in zip(*ends, strict=True) if tail != tip], color))


def _arrows(steps: Sequence[tuple[complex, ...]], color: str, axes: Axes) -> None:
    """Heads of arrows at some steps of a way."""
    look = {"arrowstyle": "-|>", "color": color, "linewidth": 0, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12}
    for tail, tip in steps:
        axes.annotate("", (tip.real, tip.imag), (tail.real, tail.imag), annotation_clip=True, arrowprops=look)
