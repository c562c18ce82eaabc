"""The region in the plane of the two drives: what ends it there, and where the mechanism is singular inside."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

from mechdesign.drawing import style
from mechdesign.drawing.framing import extent
from mechdesign.drawing.labels import HALO
from mechdesign.drawing.marks import Axis, Dots, Own, Panel, PanelMark, Picture, Words
from mechdesign.drawing.panels import coordinate_label
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Complexes, Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.mechanism import Configuration
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.workspace.figures.boundary import solved_inside
from mechdesign.questions.workspace.figures.regions import PALE, Region, inner_loci, places, region_marks, stretch_of
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.tables import curves
from mechdesign.study import Study

_SHAPE = 0.6  # height over width of a panel over an angle and a length
_STILL = 1e-6  # of the size of the region in the plane of the drives
_EDGE = 0.04  # of the height and the width, beyond the region


@picture(WorkspaceView, "joint_space", order=65)
def joint_space_picture(view: WorkspaceView) -> Picture | None:
    """The region over both drives, in the looks that it has in the plane of the point; None unless it has two drives.

    Where a drive turns without end it is cut open along the first ray of the scan.
    """
    study, names = view.study, view.study.mechanism.drives
    if len(names) != 2 or len(view.regions) != 1:
        return None
    region = view.regions[0]
    sketch, patches = _drives(study, study.mechanism.sketch_configuration), list(_patches(region.local))
    nodes = {name: _unrolled(study, name, values, region, patches)
             for name, values in _drives(study, solved_inside(study, region)).items()}  # fmt: skip
    shown = [np.stack([nodes[name][rows] for name in names], axis=-1) for rows in patches]
    ends = {name: region.boundary[name] for name in names}
    boundary = _moved(study, region, region.boundary, ends, nodes)
    inside = region.singularities
    if inside is not None:
        inside = inside.take(np.concatenate([np.zeros(0, dtype=int), *inner_loci(region)]))
        inside = _moved(
            study, region, inside, _drives(study, solved_inside(study, replace(region, local=inside))), nodes
        )
    cut = any(_cut(region, patches, values, _turn(study, name)) for name, values in nodes.items())
    everywhere = np.concatenate([places(boundary), *(cells.reshape(-1, 2) @ [1, 1j] for cells in shown)])
    x, y = (float(sketch[name]) for name in names)
    marks = [
        Own(partial(_cells, shown)),
        *region_marks(replace(region, others=None, boundary=boundary, singularities=inside)),
        Dots([x], [y], look={"color": style.INK, "markersize": 5, "zorder": 4}),
        Words(x, y, "sketch", (6, 4), look={"fontsize": 9, "zorder": 5, "path_effects": HALO}),
    ]
    return _picture(study, everywhere, marks, cut=cut)


def _cells(patches: Sequence[Floats], axes: Axes) -> None:
    """The cells of a region's patches, each of shape (rays, nodes, 2)."""
    axes.grid(visible=False)
    for cells in patches:
        corners = [cells[:-1, :-1], cells[1:, :-1], cells[1:, 1:], cells[:-1, 1:]]
        quads = np.stack(corners, axis=2).reshape(-1, 4, 2)
        axes.add_collection(PolyCollection(list(quads[np.isfinite(quads).all(axis=(1, 2))]), facecolors=PALE,
                                           linewidths=0, antialiaseds=False))  # fmt: skip


def _picture(study: Study, everywhere: Complexes, marks: Sequence[PanelMark], *, cut: bool) -> Picture:
    """A panel over both drives, of one scale where both are angles or both lengths."""
    names, (middle, wide, tall) = study.mechanism.drives, extent(everywhere)
    alike = len({study.mechanism.quantity(name) for name in names}) == 1
    stretch = stretch_of(wide / tall) if alike else 1.0
    any_mode = study.workspace is not None and study.workspace.assembly == "any"
    note = f"joint space, in the working mode {'that counts at each place' if any_mode else 'of the sketch'}"
    note += "; cut open at edges without a line" * cut
    if stretch != 1.0:
        note += f"; {names[stretch > 1]} drawn {max(stretch, 1 / stretch):g} times larger"
    half = (0.5 + _EDGE) * np.array([wide, tall])
    x, y = (Axis(coordinate_label(study, name), ends=(at - reach, at + reach))
            for name, at, reach in zip(names, (middle.real, middle.imag), half.tolist(), strict=True))  # fmt: skip
    panel = Panel(marks, x, y, equal=stretch if alike else _SHAPE * wide / tall)
    return Picture("Workspace in the plane of the drives", [panel], (note,))


def _drives(study: Study, configuration: Configuration) -> dict[str, Floats]:
    """Drives of poses in the study's units."""
    coordinates = {name: study.mechanism.coordinate(name) for name in study.mechanism.drives}
    return {name: np.asarray(in_study_units(study.units, coordinate, configuration.value(coordinate)), dtype=float)
            for name, coordinate in coordinates.items()}  # fmt: skip


def _turn(study: Study, name: str) -> float:
    """A whole turn of a drive in the study's units; 0 of one that does not turn."""
    return 2 * math.pi / study.units.angle_factor if study.mechanism.quantity(name) == "angle" else 0.0


def _patches(local: Table) -> Iterator[Ints]:
    """Rows of the table of nodes of each patch, shape (rays, nodes)."""
    for patch in np.unique(local["patch"]):
        rows = np.flatnonzero(local["patch"] == patch)
        yield rows.reshape(int(local["ray"][rows].max()) + 1, -1)


def _unrolled(study: Study, name: str, values: Floats, region: Region, patches: Sequence[Ints]) -> Floats:
    """A drive at the nodes of a region, continuous over each patch and from patch to patch, in the sketch's turn."""
    assert study.workspace is not None
    turn, z, mechanism = _turn(study, name), places(region.local), study.mechanism
    if not turn:
        return values
    unrolled, done = values.copy(), np.zeros(len(values), dtype=bool)
    for rows in patches:
        half = rows.shape[1] // 2
        middle = np.unwrap(values[rows[:, half]], period=turn)
        if done.any():
            gaps = np.abs(z[rows[[0, -1], half], None] - z[done])
            end, node = np.unravel_index(int(gaps.argmin()), gaps.shape)
            middle += turn * np.round((unrolled[done][node] - middle[[0, -1][end]]) / turn)
        unrolled[rows] = values[rows] - turn * np.round((values[rows] - middle[:, None]) / turn)
        done[rows] = True
    sketch = mechanism.sketch_configuration
    drawn = float(
        np.asarray(in_study_units(study.units, mechanism.coordinate(name), sketch.value(mechanism.coordinate(name))))
    )
    nearest = int(np.abs(z - sketch.point(study.workspace.point)).argmin())
    return np.asarray(unrolled + turn * np.round((drawn - unrolled[nearest]) / turn))


def _cut(region: Region, patches: Sequence[Ints], values: Floats, turn: float) -> bool:
    """Whether a drive differs by whole turns between two patches where they meet."""
    ends = np.concatenate([rows[[0, -1], rows.shape[1] // 2] for rows in patches])
    z, own = places(region.local)[ends], values[ends]
    meet = np.abs(z[:, None] - z) < _STILL * float(np.abs(z).max())
    return bool(turn and (meet & (np.abs(own[:, None] - own) > turn / 2)).any())


def _moved(
    study: Study, region: Region, table: Table, drives: Mapping[str, Floats], nodes: Mapping[str, Floats]
) -> Table:  # fmt: skip
    """Curves of a table with the drives in place of x and y, each in the turn of the region's node at its middle."""
    moved, kept = {name: values.copy() for name, values in drives.items()}, []
    grid, z = places(region.local), places(table)
    size = max(float(np.nanmax(values) - np.nanmin(values)) for values in nodes.values())
    for rows in curves(table):
        half = len(rows) // 2
        node = int(np.abs(grid - z[rows[half]]).argmin())
        for name, values in moved.items():
            if turn := _turn(study, name):
                own = np.unwrap(values[rows], period=turn)
                values[rows] = own - turn * np.round((own[half] - nodes[name][node]) / turn)
        # A point that turns about a place where two joints coincide moves while the drives stand still.
        still = all(np.ptp(values[rows]) < _STILL * size for values in moved.values())
        kept.append(rows[:1] if still else rows)
    axes = dict(zip("xy", moved.values(), strict=True))
    columns = (replace(column, values=axes.get(column.name, column.values)) for column in table.columns)
    return replace(table, columns=tuple(columns)).take(np.concatenate([np.zeros(0, dtype=int), *kept]))
