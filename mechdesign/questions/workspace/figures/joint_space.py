"""The region in the plane of the two drives: what ends it there, and where the mechanism is singular inside."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Rectangle

from mechdesign.drawing import style
from mechdesign.drawing.framing import extent
from mechdesign.drawing.labels import HALO
from mechdesign.drawing.marks import Axis, Dots, Lines, Own, Panel, PanelMark, Picture, Words
from mechdesign.drawing.panels import coordinate_label
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.mechanism import Configuration
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.workspace.figures.boundary import solved_inside
from mechdesign.questions.workspace.figures.regions import (
    PALE,
    HeldRegion,
    inner_loci,
    places,
    region_marks,
    stretch_of,
)
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.tables import curves
from mechdesign.study import Study

_SHAPE = 0.6  # height over width of a panel over an angle and a length
_STILL = 1e-6  # of the size of the region in the plane of the drives
_EDGE = 0.04  # of the height and the width, beyond the region
_CUT: dict[str, Any] = {"color": style.FAINT, "linestyle": (0, (1, 2)), "linewidth": 1.4, "zorder": 3.3,
                        "clip_on": False}  # fmt: skip


@picture(WorkspaceView, "joint_space", order=65)
def joint_space_picture(view: WorkspaceView) -> Picture | None:
    """The region over both drives, in the looks that it has in the plane of the point; None unless it has two drives.

    Where the drives turn without end, as around a ring, it goes on for ever: it is cut at a turn of one of them.
    """
    study, names = view.study, [*view.study.mechanism.drives]
    if len(names) != 2 or len(view.regions) != 1:
        return None
    region, turns = view.regions[0], np.array([_turn(study, name) for name in names])
    sketch = np.array([float(value) for value in _drives(study, study.mechanism.sketch_configuration)])
    assert study.workspace is not None
    place = complex(study.mechanism.sketch_configuration.point(study.workspace.point))
    cells, periods = _unrolled(region, _drives(study, solved_inside(study, region)), turns, sketch, place)
    cuts = _cuts(periods * turns, sketch)
    nodes = np.concatenate([part.reshape(-1, 2) for part in cells])
    shifts = _copies(cuts, nodes)
    boundary = _moved(region, region.boundary, [region.boundary[name] for name in names], nodes, turns, shifts, cuts)
    inside = region.singularities
    if inside is not None:
        inside = inside.take(np.concatenate([np.zeros(0, dtype=int), *inner_loci(region)]))
        drives = _drives(study, solved_inside(study, replace(region, local=inside)))
        inside = _moved(region, inside, drives, nodes, turns, shifts, cuts)
    everywhere = np.concatenate([(nodes + shift)[np.isfinite(nodes).all(axis=1)] for shift in shifts])
    for cut in cuts:
        own = everywhere[:, cut.drive]
        everywhere = everywhere[(own >= cut.begin) & (own <= cut.begin + cut.way)]
        everywhere = np.concatenate([everywhere, [np.where(np.arange(2) == cut.drive, end, sketch)
                                                  for end in (cut.begin, cut.begin + cut.way)]])  # fmt: skip
    uncut = np.array([drive not in [cut.drive for cut in cuts] for drive in range(2)])
    edge = _EDGE * uncut * np.ptp(everywhere, axis=0)
    window = np.stack([everywhere.min(axis=0) - edge, everywhere.max(axis=0) + edge])
    marks = [
        Own(partial(_cells, [part + shift for part in cells for shift in shifts], turns, window if cuts else None)),
        *region_marks(replace(region, others=None, boundary=boundary, singularities=inside)),
        *(Lines([cut.begin, cut.begin + cut.way], "y" if cut.drive else "x", label="cut: the drives turn on", look=_CUT)
          for cut in cuts),
        Dots(sketch[:1], sketch[1:], look={"color": style.INK, "markersize": 5, "zorder": 4}),
        Words(float(sketch[0]), float(sketch[1]), "sketch", (6, 4),
              look={"fontsize": 9, "zorder": 5, "path_effects": HALO}),
    ]  # fmt: skip
    return _picture(study, everywhere @ [1, 1j], marks, cuts)


class PlaneCut(NamedTuple):
    """Where the plane of the drives is cut open: at a value of one drive, and again a way of whole turns beyond it."""

    drive: int
    begin: float
    way: float
    period: Floats  # of both drives from cut to cut


def _cells(patches: Sequence[Floats], turns: Floats, window: Floats | None, axes: Axes) -> None:
    """The cells of a region's patches, each of shape (rays, nodes, 2), in a window; none about a place of no angle."""
    axes.grid(visible=False)
    for cells in patches:
        corners = [cells[:-1, :-1], cells[1:, :-1], cells[1:, 1:], cells[:-1, 1:]]
        quads = np.stack(corners, axis=2).reshape(-1, 4, 2)
        small = (np.ptp(quads, axis=1) < np.where(turns > 0, turns / 2, np.inf)).all(axis=1)
        if window is not None:
            small &= ((quads.max(axis=1) > window[0]) & (quads.min(axis=1) < window[1])).all(axis=1)
        drawn = PolyCollection(list(quads[small]), facecolors=PALE, linewidths=0, antialiaseds=False)
        axes.add_collection(drawn)
        if window is not None:
            # What lies beyond a cut is drawn before the other.
            size = np.diff(window, axis=0)[0].tolist()
            drawn.set_clip_path(Rectangle(window[0].tolist(), *size, transform=axes.transData))


def _picture(study: Study, everywhere: Complexes, marks: Sequence[PanelMark], cuts: Sequence[PlaneCut]) -> Picture:
    """A panel over both drives, of one scale where both are angles or both lengths."""
    names, (middle, wide, tall) = [*study.mechanism.drives], extent(everywhere)
    alike = len({study.mechanism.quantity(name) for name in names}) == 1
    stretch = stretch_of(wide / tall) if alike else 1.0
    any_mode = study.workspace is not None and study.workspace.assembly == "any"
    note = f"joint space, in the working mode {'that counts at each place' if any_mode else 'of the sketch'}"
    for cut in cuts:
        unit = study.units.label(study.mechanism.quantity(names[cut.drive]))
        note += f"; cut open at {names[cut.drive]} = {cut.begin:.6g} and {cut.begin + cut.way:.6g} {unit}".rstrip()
    if stretch != 1.0:
        note += f"; {names[stretch > 1]} drawn {max(stretch, 1 / stretch):g} times larger"
    half = (0.5 + _EDGE) * np.array([wide, tall])
    x, y = (Axis(coordinate_label(study, name), ends=(at - reach, at + reach))
            for name, at, reach in zip(names, (middle.real, middle.imag), half.tolist(), strict=True))  # fmt: skip
    panel = Panel(marks, x, y, equal=stretch if alike else _SHAPE * wide / tall)
    return Picture("Workspace in the plane of the drives", [panel], (note,))


def _drives(study: Study, configuration: Configuration) -> list[Floats]:
    """Drives of poses in the study's units."""
    coordinates = [study.mechanism.coordinate(name) for name in study.mechanism.drives]
    return [np.asarray(in_study_units(study.units, coordinate, configuration.value(coordinate)), dtype=float)
            for coordinate in coordinates]  # fmt: skip


def _turn(study: Study, name: str) -> float:
    """A whole turn of a drive in the study's units; 0 of one that does not turn."""
    return 2 * math.pi / study.units.angle_factor if study.mechanism.quantity(name) == "angle" else 0.0


def _unrolled(
    region: HeldRegion, drives: Sequence[Floats], turns: Floats, sketch: Floats, place: complex
) -> tuple[list[Floats], Floats]:  # fmt: skip
    """Drives at the nodes of each patch, shape (rays, nodes, 2), continuous from patch to patch; and whole turns.

    They are in the turn of the sketch, in which the point is at a place. The turns, shape (n, 2), are those of both
    drives along ways in the region that end where they begin.
    """
    z, patches, grids, edges = places(region.local), list[Floats](), list[Complexes](), list[EndRay]()
    for number, patch in enumerate(np.unique(region.local["patch"])):
        rows = np.flatnonzero(region.local["patch"] == patch)
        shape = int(region.local["ray"][rows].max()) + 1, -1
        patches.append(np.stack([_continuous(own[rows].reshape(shape), turn)
                                 for own, turn in zip(drives, turns.tolist(), strict=True)], axis=-1))  # fmt: skip
        grids.append(z[rows].reshape(shape))
        edges += [EndRay(number, grids[-1][end], patches[-1][end]) for end in (0, -1)]
    whole, near = np.where(turns > 0, turns, np.inf), _STILL * float(np.ptp(z.real) + np.ptp(z.imag))
    meetings = [(one.patch, other.patch, np.rint(gap / whole)) for one, other in permutations(edges, 2)
                if (gap := other.beyond(one, near)) is not None]  # fmt: skip
    away = [np.where(np.isfinite(own).all(axis=-1), np.abs(grid - place), np.inf)
            for own, grid in zip(patches, grids, strict=True)]  # fmt: skip
    offsets = dict[int, Floats]()
    for root in np.argsort([own.min() for own in away]).tolist():
        node = np.unravel_index(int(away[root].argmin()), away[root].shape)
        offsets.setdefault(root, np.rint((sketch - np.nan_to_num(patches[root][node])) / whole))
        while new := [(one, offsets[other] + turned) for one, other, turned in meetings
                      if one not in offsets and other in offsets]:  # fmt: skip
            offsets.update(new[:1])
    periods = [offsets[other] + turned - offsets[one] for one, other, turned in meetings]
    around = np.unique([period for period in periods if period.any()] or np.zeros((0, 2)), axis=0)
    return [values + offsets[k] * turns for k, values in enumerate(patches)], around


class EndRay(NamedTuple):
    """The first or the last ray of a patch: its nodes, and the drives there, shape (nodes, 2)."""

    patch: int
    way: Complexes
    drives: Floats

    def beyond(self, other: EndRay, near: float) -> Floats | None:
        """Drives at the middle of another edge less its own there; None where this edge does not pass that place."""
        half, along = len(other.way) // 2, self.way[-1] - self.way[0]
        if not along:
            return None
        at, place = ((self.way - self.way[0]) / along).real, (other.way[half] - self.way[0]) / along
        if abs(place.imag * along) > near or not -_STILL <= place.real <= 1 + _STILL:
            return None
        gap = np.array([np.interp(place.real, at, own) for own in self.drives.T]) - other.drives[half]
        return gap if np.isfinite(gap).all() else None


def _continuous(values: Floats, turn: float) -> Floats:
    """Values of a drive at nodes, shape (rays, nodes), without jumps from node to node and from ray to ray."""
    if not turn:
        return values
    rolled = values.copy()
    for ray in rolled:
        finite = np.isfinite(ray)
        ray[finite] = np.unwrap(ray[finite], period=turn)
    middle = rolled[:, rolled.shape[1] // 2].copy()
    finite = np.isfinite(middle)
    turned = np.zeros(len(middle))
    turned[finite] = np.unwrap(middle[finite], period=turn) - middle[finite]
    return rolled + turned[:, None]


def _cuts(periods: Floats, sketch: Floats) -> list[PlaneCut]:
    """Where the plane is cut: for each period at a value of a drive that it turns, half a way before the sketch."""
    cuts, left = list[PlaneCut](), [*periods]
    for drive in range(2):
        turning = [period for period in left if period[drive]]
        if turning:
            period = min(turning, key=lambda own: abs(own[drive]))
            way = abs(period[drive])
            left = [own - period * round(own[drive] / period[drive]) for own in left]
            cuts.append(PlaneCut(drive, way * (round(sketch[drive] / way) - 0.5), way, period))
    return cuts


def _copies(cuts: Sequence[PlaneCut], nodes: Floats) -> list[Floats]:
    """By how much what is drawn once is moved so that it fills the plane between its cuts."""
    shifts = [np.zeros(2)]
    for cut in cuts:
        own = nodes[np.isfinite(nodes[:, cut.drive]), cut.drive]
        first = math.ceil((cut.begin - own.max()) / cut.way)
        last = math.floor((cut.begin + cut.way - own.min()) / cut.way)
        sign = math.copysign(1.0, cut.period[cut.drive])
        shifts = [shift + sign * k * cut.period for shift in shifts for k in range(first, last + 1)]
    return shifts


def _moved(
    region: HeldRegion, table: Table, drives: Sequence[Floats], nodes: Floats, turns: Floats, shifts: Sequence[Floats],
    cuts: Sequence[PlaneCut],
) -> Table:  # fmt: skip
    """Curves of a table with the drives in place of x and y, each in the turn of the node at its middle."""
    moved, grid, z = np.stack(drives, axis=-1), places(region.local), places(table)
    finite = np.isfinite(nodes).all(axis=1)
    size, parts, kept = float(np.ptp(nodes[finite], axis=0).max()), list[Floats](), list[Ints]()
    for rows in curves(table):
        half = len(rows) // 2
        node = nodes[int(np.where(finite, np.abs(grid - z[rows[half]]), np.inf).argmin())]
        for own, turn, there in zip(moved.T, turns.tolist(), node.tolist(), strict=True):
            if turn:
                rolled = np.unwrap(own[rows], period=turn)
                own[rows] = rolled - turn * np.round((rolled[half] - there) / turn)
        # A point that turns about a place where two joints coincide moves while the drives stand still.
        still = (np.ptp(moved[rows], axis=0) < _STILL * size).all()
        rows = rows[:1] if still else rows
        for shift in shifts:
            for points, own in _between(moved[rows] + shift, rows, cuts):
                parts.append(points)
                kept.append(own)
    rows = np.concatenate([np.zeros(0, dtype=np.intp), *kept])
    x, y = np.concatenate([np.zeros((0, 2)), *parts]).T
    new = {"x": x, "y": y, "curve": np.repeat(np.arange(len(kept)), [len(own) for own in kept])}
    return replace(table, columns=tuple(
        replace(column, values=new.get(column.name, column.values[rows])) for column in table.columns
    ))  # fmt: skip


def _between(points: Floats, rows: Ints, cuts: Sequence[PlaneCut]) -> Iterator[tuple[Floats, Ints]]:
    """The parts of a curve, shape (n, 2), between cuts, and their rows."""
    good = np.ones(len(points), dtype=bool)
    for cut in cuts:
        for end in (cut.begin, cut.begin + cut.way):
            beyond = points[:, cut.drive] - end
            k = np.flatnonzero(beyond[:-1] * beyond[1:] < 0)
            part = (beyond[k] / (beyond[k] - beyond[k + 1]))[:, None]
            points = np.insert(points, k + 1, points[k] + part * (points[k + 1] - points[k]), axis=0)
            rows, good = np.insert(rows, k + 1, rows[k]), np.insert(good, k + 1, good[k])
        own, edge = points[:, cut.drive], _STILL * cut.way
        good &= (own >= cut.begin - edge) & (own <= cut.begin + cut.way + edge)
    for run in np.split(np.arange(len(points)), np.flatnonzero(np.diff(good)) + 1):
        if good[run[0]]:
            yield points[run], rows[run]
