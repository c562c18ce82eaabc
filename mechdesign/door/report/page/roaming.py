"""A mechanism that follows the pointer over its workspace: poses at places that cover the region evenly."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element, tostring

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import BoundaryNorm, to_hex
from matplotlib.figure import Figure
from PIL import Image

from mechdesign.door.report.page.linkage import Canvas, Sketcher, add, dashed
from mechdesign.door.report.page.tracks import Map, MovingPicture, ShownNumbers, meanings, places
from mechdesign.drawing import style
from mechdesign.drawing.contours import Grid
from mechdesign.drawing.scene import Scene
from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Complexes, Ints, evenly
from mechdesign.ground.results import Result, Table
from mechdesign.mechanism import Configuration
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.workspace.figures.boundary import solved_inside
from mechdesign.questions.workspace.figures.index_maps import Scale, contours, index_columns
from mechdesign.questions.workspace.figures.regions import LEFT_OUT, LOOKS, PALE, HeldRegion, fate, grids, regions, some
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.questions.workspace.tables import curves
from mechdesign.study import Study

# Cells along the larger side of a region, each with at most one pose: for a single region, and for each of several.
CELLS = 60
FEW_CELLS = 32
_DPI = 72  # of the map of an index
_SWATCH = 16.0  # width of a colour in the legend
_NAMED_POSES = 12  # in which names keep off the links
_LINE = 17.0  # height of a line of the legend, in the drawing's units
_ENTRY = 170.0  # width of an entry
_COLORS = 24  # of the map
_OPAQUE = 128  # opacity from which on a pixel belongs to the map
_AROUND = 6.0  # left free around a region in a small map


def roaming(study: Study, result: Result, name: str) -> MovingPicture | None:
    """The mechanism in its workspace, for each of a few values of held coordinates, with a map of each index.

    `name` begins the ids in the drawing.
    """
    shown = some(regions(study, result))
    section, mechanism = study.workspace, study.mechanism
    if not shown or section is None:
        return None
    cells = CELLS if len(shown) == 1 else FEW_CELLS
    solved = [_solved(study, region, cells) for region in shown]
    reached = [np.ravel(configuration.point(point)) for _, configuration in solved for point in mechanism.points]
    everywhere = np.concatenate([*(region.places() for region in shown), *reached])
    sheet = Canvas.around(everywhere[np.isfinite(everywhere)])
    choices, drawn, alike = [], [], None
    for region, (rows, configuration) in zip(shown, solved, strict=True):
        table = _table(study, region, rows, configuration)
        begin = int(np.argmax(np.nan_to_num(table["inverse_condition"], nan=-1.0)))
        numbers = ShownNumbers(table, np.arange(len(rows)), begin, study.size, alike)
        alike = alike or numbers
        entries = [(column.name, [numbers.cell(column)]) for column in table.columns]
        links = mechanism.description.links
        step = sheet.scale * max(np.ptp(table[f"{section.point}.{axis}"]) for axis in "xy") / cells
        choice = {"title": region.title, "poses": len(rows), "first": begin, "step": round(step, 1)}
        choices.append(choice | {"numbers": numbers.tracks} | places(sheet, configuration, links))
        drawn.append((begin, entries))
    (begin, entries), (rows, configuration) = drawn[0], solved[0]
    root = sheet.root(f"the mechanism in the workspace of point {section.point}")
    indices = [index for index in index_columns(shown[0])
               if all(np.isfinite(region.local[index]).any() for region in shown)]  # fmt: skip
    scales = {index: Scale.of(shown, index) for index in indices}
    maps, layers = [], add(root, "defs")
    for k, region in enumerate(shown):
        maps.append((region.title, _maps(layers, sheet, region, k, scales, f"{name}-map-{k}")))
    add(root, "use", **{"class": "moving-region"}, href=f"#{maps[0][1][0].href}")
    scenes = Scene(mechanism, configuration).some([begin, *evenly(len(rows), _NAMED_POSES).tolist()])
    sketcher = Sketcher(root, sheet, scenes[0])
    sketcher.draw()
    sketcher.names(scenes)
    sketcher.ruler(study.units.label("length"))
    _legend(root, sheet, shown, scales)
    data = {"choices": choices, "point": section.point, "unit": study.units.label("length")}
    words = f"point {section.point} in its workspace" + (f", at {shown[0].title}" if shown[0].title else "")
    replaces = ("workspace", *indices)
    drawing = tostring(root, encoding="unicode")
    return MovingPicture(drawing, "", data, words, ["value"], entries, meanings(table), replaces, maps)


def _solved(study: Study, region: HeldRegion, cells: int) -> tuple[Ints, Configuration]:
    """Rows of the region's grid, at most one in each of even cells, and the poses there."""
    local, configuration = region.local, solved_inside(study, region)
    z = local["x"] + 1j * local["y"]
    valid = np.flatnonzero(configuration.valid)
    z, corner = z[valid], complex(z.real.min(), z.imag.min())
    size = max(np.ptp(z.real), np.ptp(z.imag)) / cells
    steps = (z - corner) / size
    column, row = np.floor(steps.real).astype(int), np.floor(steps.imag).astype(int)
    far = np.abs(steps - column - 0.5 - 1j * (row + 0.5))
    order = np.lexsort((far, column, row))
    cell = row[order] * (cells + 2) + column[order]
    nearest = valid[order[np.append(True, np.diff(cell) > 0)]]
    return nearest, configuration.take(nearest)


def _table(study: Study, region: HeldRegion, rows: Ints, configuration: Configuration) -> Table:
    """Place, drives and local indices at some rows of the region's grid."""
    point = WorkspaceSection.of(study).point
    columns = [Column(f"{point}.{axis}", region.local[axis][rows], region.local.column(axis).unit)
               for axis in "xy"]  # fmt: skip
    for name in study.mechanism.drives:
        drive = study.mechanism.coordinate(name)
        values = np.asarray(in_study_units(study.units, drive, configuration.value(drive)))
        columns.append(Column(name, np.broadcast_to(values, len(rows)), study.units.label(drive.quantity)))
    indices = [region.local.column(name) for name in index_columns(region)]
    columns += [replace(column, values=column.values[rows].astype(float)) for column in indices]
    return Table("poses", tuple(columns))


def _maps(
    layers: Element, sheet: Canvas, region: HeldRegion, number: int, scales: Mapping[str, Scale], name: str
) -> list[Map]:  # fmt: skip
    """A group for each index with its map over a region, the one of a number, or a group of the region alone."""
    places = sheet.all(region.places())
    low, high = _corners(places)
    window = f"{low.real:.0f} {low.imag:.0f} {high.real - low.real:.0f} {high.imag - low.imag:.0f}"
    below, above = add(layers, "g", id=f"{name}-region"), add(layers, "g", id=f"{name}-boundary")
    _region(below, sheet, region)
    _boundary(above, sheet, region)
    maps = []
    for index, scale in scales.items() or [("", None)]:
        # Small maps are drawings of their own, which would fill what the large one does not.
        layer = add(layers, "g", id=f"{name}-{index}", fill="none")
        add(layer, "use", href=f"#{name}-region")
        if scale is None:
            maps.append(Map("", "region", "", f"{name}-", window))
        else:
            _map(layer, sheet, scale.patches[number], scale.norm)
            meaning = region.local.column(index).meaning
            maps.append(Map(index, scale.labels[number], meaning, f"{name}-{index}", window))
        add(layer, "use", href=f"#{name}-boundary")
    return maps


def _corners(places: Complexes) -> tuple[complex, complex]:
    """The upper left and the lower right corner around places of a drawing."""
    room = complex(_AROUND, _AROUND)
    return (complex(np.nanmin(places.real), np.nanmin(places.imag)) - room,
            complex(np.nanmax(places.real), np.nanmax(places.imag)) + room)  # fmt: skip


def _region(layer: Element, sheet: Canvas, region: HeldRegion) -> None:
    """The region, and faintly what is left out."""
    if region.others is not None:
        _fill(layer, sheet, region.others[0], LEFT_OUT)
    _fill(layer, sheet, region.local, PALE)


def _map(layer: Element, sheet: Canvas, patches: Sequence[Grid], norm: BoundaryNorm) -> None:
    """A local index over the patches of a region, as a picture of few colours."""
    figure = Figure(figsize=(sheet.width / 72, sheet.height / 72), dpi=_DPI, facecolor="none")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    contours(axes, patches, norm)
    far = sheet.corner + complex(sheet.width, -sheet.height) / sheet.scale
    axes.set_xlim(sheet.corner.real, far.real)
    axes.set_ylim(far.imag, sheet.corner.imag)
    stream = io.BytesIO()
    figure.savefig(stream, format="rgba", dpi=_DPI)
    pixels = Image.frombytes("RGBA", figure.canvas.get_width_height(), stream.getvalue())
    few = pixels.convert("RGB").quantize(_COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    # Beyond the region, where the ground of the drawing shows, one more colour.
    palette = few.getpalette() or []
    few.putpalette([*palette[: 3 * _COLORS], *[255] * (3 * (_COLORS + 1) - len(palette[: 3 * _COLORS]))])
    few.paste(_COLORS, mask=pixels.getchannel("A").point(lambda alpha: 255 * (alpha < _OPAQUE)))
    packed = io.BytesIO()
    few.save(packed, format="png", optimize=True, transparency=_COLORS)
    data = f"data:image/png;base64,{base64.b64encode(packed.getvalue()).decode()}"
    add(layer, "image", href=data, width=sheet.width, height=sheet.height, preserveAspectRatio="none")


def _boundary(layer: Element, sheet: Canvas, region: HeldRegion) -> None:
    """The boundary, by what ends the region there."""
    table = region.boundary
    for rows in curves(table):
        line = add(layer, "path", d=sheet.path(table["x"][rows] + 1j * table["y"][rows]))
        _look(line, fate(str(table["kind"][rows[0]]), str(table["at"][rows[0]])))


def _fill(layer: Element, sheet: Canvas, local: Table, color: str) -> None:
    for x, y, _ in grids(local, "det_J"):
        z = x + 1j * y
        edge = np.concatenate([z[:, 0], z[::-1, -1]])
        add(layer, "path", d=f"{sheet.path(edge)}z", fill=color, stroke=color, stroke_width=0.6)


def _look(line: Element, kind: str) -> None:
    color, dashes, width, _ = LOOKS[kind]
    line.attrib |= {"stroke": to_hex(color), "stroke-width": f"{width:g}"}
    dashed(line, dashes, width)


def _legend(root: Element, sheet: Canvas, shown: Sequence[HeldRegion], scales: Mapping[str, Scale]) -> None:
    """Below the drawing what ends the regions, and what the colours of each map mean; the first is seen."""
    fates = {fate(str(kind), str(at)) for region in shown
            for kind, at in zip(region.boundary["kind"], region.boundary["at"], strict=True)}  # fmt: skip
    kinds = [kind for kind in LOOKS if kind in fates]
    columns = int(sheet.width // _ENTRY)
    for k, kind in enumerate(kinds):
        x, y = 12 + _ENTRY * (k % columns), sheet.height + _LINE * (k // columns + 0.5)
        _look(add(root, "path", d=f"M{x:g} {y:.1f}h24"), kind)
        add(root, "text", LOOKS[kind][3], x=x + 30, y=y + 3.5, font_size=10, fill="#333333")
    height = sheet.height + _LINE * -(-len(kinds) // columns)
    height += _LINE * bool(scales)
    for number, (index, scale) in enumerate(scales.items()):
        norm = scale.norm
        entry = add(root, "g", **{"class": f"moving-legend{' moving-off' * bool(number)}"}, data_index=index)
        levels = np.asarray(norm.boundaries, dtype=float)
        for k, level in enumerate((levels[1:] + levels[:-1]) / 2):
            add(entry, "rect", x=12 + _SWATCH * k, y=height - 0.8 * _LINE, width=_SWATCH, height=0.6 * _LINE,
                fill=to_hex(colormaps[style.COLORMAP](int(norm(level)))))  # fmt: skip
        beyond = " and beyond" * (norm.extend != "neither")
        words = f"{scale.label}, from {levels[0]:g} to {levels[-1]:g}{beyond}{scale.words.replace('panel', 'map')}"
        add(entry, "text", words, x=18 + _SWATCH * (len(levels) - 1), y=height - 0.3 * _LINE, font_size=10,
            fill="#333333")  # fmt: skip
    root.set("viewBox", f"0 0 {sheet.width:g} {height + 4:.1f}")
