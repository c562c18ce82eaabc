"""A mechanism that follows the pointer over its workspace: poses at places that cover the region evenly."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element, tostring

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from PIL import Image

from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Ints, evenly
from mechdesign.questions.poses import in_study_units
from mechdesign.questions.workspace.figures.boundary import solved_inside
from mechdesign.questions.workspace.figures.index_maps import contours, index_columns, index_norm
from mechdesign.questions.workspace.figures.regions import LEFT_OUT, LOOKS, PALE, Region, fate, grids, regions, some
from mechdesign.questions.workspace.tables import curves
from mechdesign.report.figures import style
from mechdesign.report.figures.scene import pose, travels
from mechdesign.report.page.linkage import Sheet, Sketcher, add, dashed
from mechdesign.report.page.tracks import Moving, Numbers, meanings, places
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study

# Cells along the larger side of a region, each with at most one pose: for a single region, and for each of several.
CELLS = 60
FEW_CELLS = 32
_DPI = 96  # of the map of an index
_SWATCH = 16.0  # width of a colour in the legend
_NAMED_POSES = 12  # in which names keep off the links
_LINE = 17.0  # height of a line of the legend, in the drawing's units
_ENTRY = 170.0  # width of an entry
_COLORS = 64  # of the map


def roaming(study: Study, result: Result) -> Moving | None:
    """The mechanism in its workspace, for each of a few values of held coordinates."""
    shown = some(regions(study, result))
    section, mechanism = study.workspace, study.mechanism
    if not shown or section is None:
        return None
    cells = CELLS if len(shown) == 1 else FEW_CELLS
    solved = [_solved(study, region, cells) for region in shown]
    reached = [np.ravel(configuration.point(point)) for _, configuration in solved for point in mechanism.points]
    everywhere = np.concatenate([*(region.places() for region in shown), *reached])
    sheet = Sheet.around(everywhere[np.isfinite(everywhere)])
    choices, drawn, alike = [], [], None
    for region, (rows, configuration) in zip(shown, solved, strict=True):
        table = _table(study, region, rows, configuration)
        begin = int(np.argmax(np.nan_to_num(table["inverse_condition"], nan=-1.0)))
        numbers = Numbers(table, np.arange(len(rows)), begin, alike)
        alike = alike or numbers
        entries = [(column.name, [numbers.cell(column)]) for column in table.columns]
        links = mechanism.description.links
        step = sheet.scale * max(np.ptp(table[f"{section.point}.{axis}"]) for axis in "xy") / cells
        choice = {"title": region.title, "poses": len(rows), "first": begin, "step": round(step, 1)}
        choices.append(choice | {"numbers": numbers.tracks} | places(sheet, configuration, links))
        drawn.append((begin, entries))
    (begin, entries), (rows, configuration) = drawn[0], solved[0]
    scene = pose(mechanism, configuration, begin)
    assert scene is not None
    root = sheet.root(f"the mechanism in the workspace of point {section.point}")
    index = next((name for name in index_columns(shown[0])
                  if all(np.isfinite(region.local[name]).any() for region in shown)), "")  # fmt: skip
    norm = index_norm(shown, index) if index else None
    for k, region in enumerate(shown):
        layer = add(root, "g", **{"class": "moving-region" if k == 0 else "moving-region moving-off"})
        _region(layer, sheet, region)
        if norm is not None:
            _map(layer, sheet, region, index, norm)
        _boundary(layer, sheet, region)
    few = evenly(len(rows), _NAMED_POSES).tolist()
    scenes = list(filter(None, (pose(mechanism, configuration, index) for index in [begin, *few])))
    sketcher = Sketcher(root, sheet, mechanism, scene, travels(scenes))
    sketcher.draw()
    sketcher.names(scenes)
    sketcher.ruler(study.units.label("length"))
    _legend(root, sheet, shown, shown[0].local.column(index) if index else None, norm)
    data = {"choices": choices, "point": section.point, "unit": study.units.label("length")}
    words = f"point {section.point} in its workspace" + (f", at {shown[0].title}" if shown[0].title else "")
    return Moving(tostring(root, encoding="unicode"), "", data, words, ["value"], entries, meanings(table))


def _solved(study: Study, region: Region, cells: int) -> tuple[Ints, Configuration]:
    """Rows of the region's grid, at most one in each of even cells, and the poses there."""
    local, configuration = region.local, solved_inside(study, region)
    z = local["x"] + 1j * local["y"]
    known = np.flatnonzero(configuration.valid)
    z, corner = z[known], complex(z.real.min(), z.imag.min())
    size = max(np.ptp(z.real), np.ptp(z.imag)) / cells
    steps = (z - corner) / size
    column, row = np.floor(steps.real).astype(int), np.floor(steps.imag).astype(int)
    far = np.abs(steps - column - 0.5 - 1j * (row + 0.5))
    order = np.lexsort((far, column, row))
    cell = row[order] * (cells + 2) + column[order]
    nearest = known[order[np.append(True, np.diff(cell) > 0)]]
    return nearest, configuration.take(nearest)


def _table(study: Study, region: Region, rows: Ints, configuration: Configuration) -> Table:
    """Place, drives and local indices at some rows of the region's grid."""
    assert study.workspace is not None
    columns = [Column(f"{study.workspace.point}.{axis}", region.local[axis][rows], region.local.column(axis).unit)
               for axis in "xy"]  # fmt: skip
    for name in study.mechanism.drives:
        drive = study.mechanism.coordinate(name)
        values = np.asarray(in_study_units(study, drive, configuration.value(drive)))
        columns.append(Column(name, np.broadcast_to(values, len(rows)), study.units.label(drive.quantity)))
    indices = [region.local.column(name) for name in index_columns(region)]
    columns += [replace(column, values=column.values[rows].astype(float)) for column in indices]
    return Table("poses", tuple(columns))


def _region(layer: Element, sheet: Sheet, region: Region) -> None:
    """The region, and faintly what is left out."""
    if region.others is not None:
        _fill(layer, sheet, region.others[0], LEFT_OUT)
    _fill(layer, sheet, region.local, PALE)


def _map(layer: Element, sheet: Sheet, region: Region, index: str, norm: BoundaryNorm) -> None:
    """A local index over the region, as a picture of few colours."""
    figure = Figure(figsize=(sheet.width / 72, sheet.height / 72), dpi=_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    contours(axes, list(grids(region.local, index)), norm, labels=False)
    far = sheet.corner + complex(sheet.width, -sheet.height) / sheet.scale
    axes.set_xlim(sheet.corner.real, far.real)
    axes.set_ylim(far.imag, sheet.corner.imag)
    stream = io.BytesIO()
    figure.savefig(stream, format="rgba", dpi=_DPI)
    pixels = Image.frombytes("RGBA", figure.canvas.get_width_height(), stream.getvalue()).convert("RGB")
    few, packed = pixels.quantize(_COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE), io.BytesIO()
    few.save(packed, format="png", optimize=True)
    data = f"data:image/png;base64,{base64.b64encode(packed.getvalue()).decode()}"
    add(layer, "image", href=data, width=sheet.width, height=sheet.height, preserveAspectRatio="none")


def _boundary(layer: Element, sheet: Sheet, region: Region) -> None:
    """The boundary, by what ends the region there."""
    table = region.boundary
    for rows in curves(table):
        line = add(layer, "path", d=sheet.path(table["x"][rows] + 1j * table["y"][rows]))
        _look(line, fate(str(table["kind"][rows[0]]), str(table["at"][rows[0]])))


def _fill(layer: Element, sheet: Sheet, local: Table, color: str) -> None:
    for x, y, _ in grids(local, "det_J"):
        z = x + 1j * y
        edge = np.concatenate([z[:, 0], z[::-1, -1]])
        add(layer, "path", d=f"{sheet.path(edge)}z", fill=color, stroke=color, stroke_width=0.6)


def _look(line: Element, kind: str) -> None:
    color, dashes, width, _ = LOOKS[kind]
    line.attrib |= {"stroke": to_hex(color), "stroke-width": f"{width:g}"}
    dashed(line, dashes, width)


def _legend(
    root: Element, sheet: Sheet, shown: Sequence[Region], index: Column | None, norm: BoundaryNorm | None
) -> None:
    """Below the drawing what ends the regions, and what the colours of the map mean."""
    seen = {fate(str(kind), str(at)) for region in shown
            for kind, at in zip(region.boundary["kind"], region.boundary["at"], strict=True)}  # fmt: skip
    kinds = [kind for kind in LOOKS if kind in seen]
    columns = int(sheet.width // _ENTRY)
    for k, kind in enumerate(kinds):
        x, y = 12 + _ENTRY * (k % columns), sheet.height + _LINE * (k // columns + 0.5)
        _look(add(root, "path", d=f"M{x:g} {y:.1f}h24"), kind)
        add(root, "text", LOOKS[kind][3], x=x + 30, y=y + 3.5, font_size=10, fill="#333333")
    height = sheet.height + _LINE * -(-len(kinds) // columns)
    if index is not None and norm is not None:
        height += _LINE
        levels = np.asarray(norm.boundaries, dtype=float)
        for k, level in enumerate((levels[1:] + levels[:-1]) / 2):
            add(root, "rect", x=12 + _SWATCH * k, y=height - 0.8 * _LINE, width=_SWATCH, height=0.6 * _LINE,
                fill=to_hex(colormaps[style.COLORMAP](int(norm(level)))))  # fmt: skip
        name = style.axis_label(index.name.replace("_", " "), index.unit)
        words = f"{name}, from {levels[0]:g} to {levels[-1]:g}{' and beyond' * (norm.extend != 'neither')}"
        add(root, "text", words, x=18 + _SWATCH * (len(levels) - 1), y=height - 0.3 * _LINE, font_size=10,
            fill="#333333")  # fmt: skip
    root.set("viewBox", f"0 0 {sheet.width:g} {height + 4:.1f}")
