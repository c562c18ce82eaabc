"""The drives along the boundary of a region: over the length of each of its closed curves, the outer one first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.path import Path

from mechdesign.drawing import style
from mechdesign.drawing.labels import HALO
from mechdesign.drawing.marks import Axis, Lines, Panel, PanelMark, Picture, Trace, Words
from mechdesign.drawing.panels import MAX_PANELS
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints, evenly
from mechdesign.ground.results import Table
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.workspace.figures.regions import panel_titles, places
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.tables import curves
from mechdesign.study import Study

# Of the drives.
LINE_COLORS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE)
DASHES: tuple[Any, ...] = ("-", (0, (6, 1)), (0, (6, 1, 1.5, 1)), (0, (2, 1)))
_LIMIT = {"color": style.INK, "linewidth": 0.9, "zorder": 1.5}
_LETTERS = 60  # of the title of a panel
_TOGETHER, _EACH = 0.09, 0.03  # of its height, alone and for each of many, between limits whose names do not touch
_JOINED = 2e-5  # of the size of the region, between ends of curves that are one corner


class BoundaryLoop(NamedTuple):
    """Smooth parts of a boundary, one after the other, counterclockwise: their rows; and whether it is a hole's."""

    parts: Sequence[Ints]
    inner: bool


@picture(WorkspaceView, "drives", order=60)
def drives_picture(view: WorkspaceView) -> Picture | None:
    """Drive values along the boundary [S1, Fig. 7], over its length: a panel for each of its closed curves."""
    study, names = view.study, [*view.study.mechanism.drives]
    length = study.units.label("length")
    every = [(region.boundary, loop, region.title) for region in view.regions for loop in loops(region.boundary)]
    if not every:
        return None
    parts = [every[k] for k in evenly(len(every), MAX_PANELS)]
    words = [", ".join(filter(None, (where, _in_words(boundary, loop, length)))) for boundary, loop, where in parts]
    titles, held = panel_titles(words, _LETTERS)
    notes = [f"panels: values of {held}"] * bool(held)
    notes += [f"{len(parts)} of {len(every)} boundaries"] * (len(every) > len(parts))
    apart = max(_TOGETHER, _EACH * len(parts))
    units = {name: study.units.label(study.mechanism.quantity(name)) for name in names}
    # Units that differ stand in the legend.
    drive = Axis("drive")
    if len({*units.values()}) == 1:
        drive, units = Axis("drive", units[names[0]]), dict.fromkeys(names, "")
    limits, panels = _drive_limits(study), []
    for (boundary, loop, _), title in zip(parts, titles, strict=True):
        rows, z = np.concatenate(loop.parts), places(boundary)
        arc = np.append(0.0, np.cumsum(np.abs(np.diff(z[rows]))))
        own = {name: _rolled(study, name, boundary[name][rows]) for name in names}
        marks: list[PanelMark] = [
            Trace(arc, own[name], label=style.axis_label(name, units[name]), look={
                  "color": LINE_COLORS[k % len(LINE_COLORS)], "linestyle": DASHES[k % len(DASHES)], "linewidth": 1.9})
            for k, name in enumerate(names)
        ]  # fmt: skip
        marks += [Lines([*limits], label="limit of a drive", look=_LIMIT)]
        reach = np.ptp([*limits, *(end(own[name]) for name in names for end in (np.nanmin, np.nanmax))])
        marks += [Words(1, height, ", ".join(limited), (-2, 1.5), "x", look={"ha": "right", "path_effects": HALO})
                  for height, limited in _together(limits, apart * float(reach))]  # fmt: skip
        way = Axis("length along the boundary", length, ends=(0.0, float(arc[-1])))
        panels.append(Panel(marks, way, drive, title))
    return Picture("Drives along the boundary of the workspace, counterclockwise", panels, ("; ".join(notes),))


def loops(boundary: Table) -> list[BoundaryLoop]:
    """The closed curves of a boundary, that of each piece of the region before those of the holes in it.

    Each begins where the scan meets it first. A boundary that a scan of a part of the plane leaves open is one, too.
    """
    z, left, built = places(boundary), [*curves(boundary)], list[BoundaryLoop]()
    near = _JOINED * float(np.ptp(z.real) + np.ptp(z.imag))
    while left:
        parts = [left.pop(0)]
        while left:
            end, way = z[parts[-1][-1]], z[np.concatenate(parts)]
            gaps = np.array([[abs(z[rows[side]] - end) for side in (0, -1)] for rows in left])
            k, side = np.unravel_index(int(gaps.argmin()), gaps.shape)
            closed = np.ptp(way.real) + np.ptp(way.imag) > near and abs(way[0] - end) <= gaps.min()
            if closed or gaps.min() > near:
                break
            parts.append(left.pop(int(k))[:: -1 if side else 1])
        way = z[np.concatenate(parts)]
        if float(np.sum((np.conj(way) * np.roll(way, -1)).imag)) < 0:
            parts = [rows[::-1] for rows in parts[::-1]]
        first = min(range(len(parts)), key=lambda k: float(boundary["theta"][parts[k]].min()))
        built.append(BoundaryLoop([*parts[first:], *parts[:first]], inner=False))
    ways = [z[np.concatenate(loop.parts)] for loop in built]
    # What lies in a hole is the outer boundary of another piece.
    around = [sum(_inside(way, other) for other in ways if other is not way) for way in ways]
    named = [loop._replace(inner=bool(count % 2)) for loop, count in zip(built, around, strict=True)]
    return sorted(named, key=lambda loop: loop.inner)


def _inside(way: Complexes, other: Complexes) -> bool:
    """Whether a closed curve lies in another."""
    place = way[len(way) // 2]
    return bool(Path(np.column_stack([other.real, other.imag])).contains_point((place.real, place.imag)))


def _in_words(boundary: Table, loop: BoundaryLoop, length: str) -> str:
    """``inner boundary from (30, 40) mm``: where its length is 0, to a thousandth of its size."""
    rows = np.concatenate(loop.parts)
    step = 10.0 ** (np.floor(np.log10(np.ptp(boundary["x"][rows]) + np.ptp(boundary["y"][rows]))) - 3)
    x, y = (round(float(boundary[axis][rows[0]]) / step) * step + 0.0 for axis in "xy")
    return f"{'inner' if loop.inner else 'outer'} boundary from ({x:.6g}, {y:.6g}) {length}"


def _rolled(study: Study, name: str, values: Floats) -> Floats:
    """Values of a drive without whole turns between neighbours."""
    if study.mechanism.quantity(name) != "angle":
        return values
    return np.unwrap(values, period=2 * np.pi / study.units.angle_factor)


def _drive_limits(study: Study) -> dict[float, list[str]]:
    """Limits of the drives and whose they are."""
    limits: dict[float, list[str]] = {}
    for bound in study.mechanism.bounds:
        for end in bound.ends(study.mechanism.nominal) if bound.drive else ():
            if end is not None:
                value = round(float(np.asarray(in_study_units(study.units, bound.coordinate, end))), 9)
                limits.setdefault(value, []).append(bound.coordinate.name)
    return limits


def _together(limits: Mapping[float, Sequence[str]], near: float) -> list[tuple[float, list[str]]]:
    """Limits and whose they are; of those nearer to each other than a distance the highest, and the names of all."""
    groups: list[tuple[float, list[str]]] = []
    for limit in sorted(limits, reverse=True):
        if groups and groups[-1][0] - limit < near:
            groups[-1][1].extend(name for name in limits[limit] if name not in groups[-1][1])
        else:
            groups.append((limit, list(limits[limit])))
    return groups
