"""A drawing sheet for the drawing office: the mechanism with its dimensions at a standard scale, tables, a title block.

Frame and margins are those of ISO 5457, the fields of the title block those of ISO 7200, scales those of ISO 5455.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.text import Annotation, Text
from matplotlib.textpath import text_to_path

from mechdesign import __version__
from mechdesign.door.exporting.drawing import DrawnCircle, Path, traced
from mechdesign.door.exporting.exports import Content, export
from mechdesign.door.exporting.mechanism import mechanism_drawing
from mechdesign.door.exporting.sheet_tables import Rows, general_tolerance, sheet_tables
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.drawing import style
from mechdesign.drawing.dimensions import draw_lines, workshop_lengths
from mechdesign.drawing.drawing import Posed, draw
from mechdesign.drawing.framing import extent
from mechdesign.drawing.scene import Still, pose
from mechdesign.drawing.shapes import link_colors, spring_shapes
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechdesignError, StudyError, printable
from mechdesign.ground.results import Result
from mechdesign.questions.kinematics.analysis import kinematics

INCH = 25.4
# Width and height of the papers, and the margins left and elsewhere (mm).
PAPERS = {"A4": (210.0, 297.0), "A3": (420.0, 297.0)}
LEFT, MARGIN = 20.0, 10.0
# Of the title block and the tables above it, and the height of its rows (mm).
WIDTH, BLOCK = 180.0, (9.0, 15.0, 10.0)
# Height of a row of a table, and between tables; least height of the drawing on A4 (mm).
ROW, GAP, LEAST = 4.2, 3.5, 110.0
# Room for each point of a mechanism below which a larger paper is taken (mm^2).
CROWDED = 400.0
# Opacity of plates.
PALE = 0.12
# Around the mechanism, for dimension lines and names (mm).
PAD = 22.0
# Sizes of type, of labels, tables and values (points); letters of a name in a table.
LABEL, CELL, VALUE = 6.0, 6.8, 8.5
MOST_LETTERS = 30
# How much wider bold letters are.
BOLD = 1.15
# Between columns of a table (mm).
COLUMN = 3.0
# Scales larger and smaller than life.
SCALES = [f * 10.0**k for k in range(4, -7, -1) for f in (5.0, 2.0, 1.0)]


@export(
    "sheet.pdf",
    "a drawing sheet: dimensions at a standard scale, tables, a title block",
    order=40,
    options=("at", "paper"),
)
def sheet_pdf(view: PosedStudy) -> Content:
    """The sheet as a PDF, and a warning where numbers of the motion are not on it."""
    mechanism = view.mechanism
    scene = pose(mechanism, view.pose)
    assert scene is not None
    result, warnings = _motion(view)
    tables = [[[style.shortened(words, MOST_LETTERS) for words in row] for row in rows]
              for rows in sheet_tables(view, scene, result)]  # fmt: skip
    with style.context():
        bands = _bands(tables)
        sheet = PaperSheet.of(view, scene, sum(band.height for band in bands))
        figure = sheet.draw(view, scene, bands)
        return Content(style.encoded(figure, "pdf", f"mechdesign {__version__}"), warnings)


def _motion(view: PosedStudy) -> tuple[Result | None, tuple[Caution, ...]]:
    """The answer of kinematics; none where the study gives no motion that can be assembled."""
    try:
        return kinematics(view.study), ()
    except MechdesignError as error:
        return None, (Caution("incomplete", f"numbers of the motion are not on the sheet: {error}"),)


@dataclass(frozen=True)
class PaperSheet:
    """A sheet of paper, the drawing's region on it (left, low, width, height; mm), and its scale."""

    paper: str
    region: tuple[float, float, float, float]
    scale: float

    @classmethod
    def of(cls, view: PosedStudy, scene: Still, tables: float) -> PaperSheet:
        """The paper that is asked for, or the smallest with room, and the largest standard scale on it.

        `tables` is the height of the tables (mm).

        Raises
        ------
        StudyError
            If another paper is asked for.
        """
        if view.paper not in (None, *PAPERS):
            raise StudyError(f"--paper is {' or '.join(PAPERS)}, not {view.paper!r}")
        low = MARGIN + sum(BLOCK) + tables
        small, large = (wide - LEFT - MARGIN for wide, _ in PAPERS.values())
        tall = PAPERS["A4"][1] - MARGIN
        sheets = {
            "A4": cls._scaled("A4", (LEFT, low, small, tall - low), view, scene),
            "A3": cls._scaled("A3", (LEFT, MARGIN, large - WIDTH, tall - MARGIN), view, scene),
        }
        fits = sheets["A4"].region[3] >= LEAST
        if view.paper == "A4" and not fits:
            raise StudyError("the tables leave no room for the drawing on A4: ask for --paper A3")
        _, across, up = extent(scene.places)
        area = across * up * (sheets["A4"].scale * view.millimetres) ** 2
        crowded = area < CROWDED * len(scene.points)
        return sheets[view.paper or ("A4" if fits and not crowded else "A3")]

    @classmethod
    def _scaled(
        cls, paper: str, region: tuple[float, float, float, float], view: PosedStudy, scene: Still
    ) -> PaperSheet:
        """A sheet at the largest standard scale at which the mechanism fits into the region."""
        _, across, up = extent(scene.places)
        most = min((region[2] - 2 * PAD) / across, (region[3] - 2 * PAD) / up) / view.millimetres
        return cls(paper, region, next((scale for scale in SCALES if scale <= most), SCALES[-1]))

    @property
    def words(self) -> str:
        """The scale as ISO 5455 writes it."""
        return f"{self.scale:g} : 1" if self.scale >= 1 else f"1 : {1 / self.scale:g}"

    def draw(self, view: PosedStudy, scene: Still, bands: Sequence[TableColumns]) -> Figure:
        """The whole sheet."""
        wide, tall = PAPERS[self.paper]
        figure = Figure(figsize=(wide / INCH, tall / INCH))
        FigureCanvasAgg(figure)
        page = figure.add_axes((0, 0, 1, 1))
        page.set_xlim(0, wide)
        page.set_ylim(0, tall)
        page.axis("off")
        right = wide - MARGIN
        _box(page, LEFT, MARGIN, right - LEFT, tall - 2 * MARGIN, 0.7)
        for x, y, dx, dy in ((wide / 2, MARGIN, 0, -5), (wide / 2, tall - MARGIN, 0, 5),
                             (LEFT, tall / 2, -5, 0), (right, tall / 2, 5, 0)):  # fmt: skip
            page.plot([x, x + dx], [y, y + dy], color=style.INK, linewidth=0.7 * 72 / INCH)
        self._mechanism(figure, page, view, scene)
        self._title(page, view, right - WIDTH)
        top = MARGIN + sum(BLOCK)
        for band in reversed(bands):
            top += band.height
            for k, column in enumerate(band.columns):
                y = top - GAP / 2
                for rows in column:
                    _draw_table(page, right - WIDTH + 2 + k * (band.room + 2 * COLUMN), y, rows, band.room)
                    y -= _height(rows)
        return figure

    def _mechanism(self, figure: Figure, page: Axes, view: PosedStudy, scene: Still) -> None:
        wide, tall = PAPERS[self.paper]
        left, low, across, up = self.region
        axes = figure.add_axes((left / wide, low / tall, across / wide, up / tall))
        axes.axis("off")
        middle, _, _ = extent(scene.places)
        half = complex(across, up) / 2 / self.scale / view.millimetres
        axes.set_xlim(middle.real - half.real, middle.real + half.real)
        axes.set_ylim(middle.imag - half.imag, middle.imag + half.imag)
        plates = view.mechanism.description.plates is not None
        if plates:
            _draw_plates(axes, view)
            centres = np.array([*scene.points.values()])
            axes.plot(centres.real, centres.imag, "+", color=style.INK, markersize=6, markeredgewidth=0.6)
            draw(axes, spring_shapes(scene))
        else:
            Posed(scene, names=False, drives=False).draw(axes)
        draw_lines(scene, axes, workshop_lengths(view.study, scene), bars=not plates)
        _keep_inside(axes)
        unit = view.study.units.label("length")
        words = f"Dimensions{f' in {unit}' if unit else ''}, at {view.posed}; "
        schematic = "schematic, as the study has no plates: widths are not to scale"
        words += "plates to scale" if plates else schematic + ", nor lengths of guides" * bool(scene.guides)
        page.text(left + 4, low + up - 6, words, fontsize=CELL, color=style.INK)

    def _title(self, page: Axes, view: PosedStudy, left: float) -> None:
        study = view.study
        unit = study.units.label("length") or "none (as mm)"
        rows = (
            (("Legal owner", "", 60.0), ("Created by", "", 40.0), ("Approved by", "", 40.0), ("Date", "", 40.0)),
            (("Title", printable(study.name), 95.0), ("Document type", "Mechanism with its dimensions", 50.0),
             ("General tolerance", general_tolerance(study), 35.0)),
            (("Scale", self.words, 25.0), ("Unit of length", unit, 30.0), ("Paper", self.paper, 15.0),
             ("Sheet", "1 / 1", 15.0), ("Identification (SHA-256 of the study)", study.text_sha256[:16], 55.0),
             ("Made with", f"mechdesign {__version__}", 40.0)),
        )  # fmt: skip
        top = MARGIN + sum(BLOCK)
        _box(page, left, MARGIN, WIDTH, sum(BLOCK), 0.7)
        for height, cells in zip(BLOCK, rows, strict=True):
            x, top = left, top - height
            for label, value, width in cells:
                _box(page, x, top, width, height, 0.25)
                page.text(x + 1, top + height - 1, label, fontsize=LABEL, va="top", color=style.INK)
                size = VALUE if label != "Title" else 1.4 * VALUE
                size = max(CELL, size * min(1.0, (width - 3) / max(_width(value, size), 1e-9)))
                shown = _cut(value, size, width - 3)
                page.text(x + 1.5, top + 0.38 * height, shown, fontsize=size, va="center", color=style.INK)
                x += width


def _draw_plates(axes: Axes, view: PosedStudy) -> None:
    """Draw every plate with its holes and slots, and what is on it, in the pose that is shown."""
    colors = link_colors(view.mechanism.description)
    for rank, (name, group) in enumerate(mechanism_drawing(view).groups.items()):
        shapes = [shape for shape in group if isinstance(shape, Path | DrawnCircle) and shape.layer != "curves"]
        for k, shape in enumerate(shapes):
            places = np.array(traced(shape)) / view.millimetres
            thin = shape.layer == "engrave"
            axes.plot(places.real, places.imag, color=colors.get(name, style.INK), zorder=2 + 0.01 * rank,
                      linewidth=0.5 if thin else 1.2, linestyle=(0, (9, 3, 2, 3)) if thin else "-")  # fmt: skip
            if k == 0 and name in colors:
                axes.fill(places.real, places.imag, color=colors[name], alpha=PALE, linewidth=0, zorder=1)


def _keep_inside(axes: Axes) -> None:
    """Move names that reach beyond the sides of the drawing's region back into it, as far as they have room."""
    for name in axes.texts:
        if isinstance(name, Annotation) and name.get_text():
            # The first call places the name, and its box has the line that leads there too.
            name.get_window_extent()
            box = Text.get_window_extent(name)
            beyond = max(box.x1 - axes.bbox.x1, 0.0) + min(box.x0 - axes.bbox.x0, 0.0)
            x, y = name.xyann
            name.xyann = (x - beyond * 72 / axes.figure.dpi, y)


def _box(page: Axes, left: float, low: float, width: float, height: float, line: float) -> None:
    x = [left, left + width, left + width, left, left]
    y = [low, low, low + height, low + height, low]
    page.plot(x, y, color=style.INK, linewidth=line * 72 / INCH, solid_joinstyle="miter")


def _width(words: str, size: float) -> float:
    """Width of words (mm)."""
    wide = text_to_path.get_text_width_height_descent(words, FontProperties(size=size), False)[0] if words else 0.0
    return float(wide) * INCH / 72


def _height(rows: Rows) -> float:
    return ROW * len(rows) + GAP if rows else 0.0


def _widths(rows: Rows) -> list[float]:
    """Widths of the columns (mm)."""
    sizes = [BOLD * CELL, *[1.05 * CELL] * (len(rows) - 1)]
    return [max(_width(row[k], size) for row, size in zip(rows, sizes, strict=True)) for k in range(len(rows[0]))]


@dataclass(frozen=True)
class TableColumns:
    """Tables beside each other, in columns of tables below each other, each `room` wide (mm)."""

    columns: Sequence[Sequence[Rows]]
    room: float

    @property
    def height(self) -> float:
        """Height of the tallest column (mm)."""
        return max(sum(map(_height, column)) for column in self.columns)


def _bands(tables: Sequence[Rows]) -> list[TableColumns]:
    """Tables in two columns where they are narrow enough, in their order; what is wider has its own band."""
    room = WIDTH - 4.0
    half = room / 2 - COLUMN
    narrow = [rows for rows in tables if sum(_widths(rows)) + COLUMN * (len(rows[0]) - 1) <= half]
    bands = [TableColumns([[rows]], room) for rows in tables if rows not in narrow]
    if len(narrow) < 2:
        return [TableColumns([[rows]], room) for rows in tables]
    # Split where the taller column is lowest.
    splits = [[narrow[:k], narrow[k:]] for k in range(1, len(narrow))]
    return [min((TableColumns(split, half) for split in splits), key=lambda band: band.height), *bands]


def _draw_table(page: Axes, left: float, top: float, rows: Rows, room: float) -> None:
    """Draw a table; words without room are cut."""
    widths = _widths(rows)
    gaps = COLUMN * (len(widths) - 1)
    # The widest column gives up what is still missing.
    widest = int(np.argmax(widths))
    widths[widest] -= max(0.0, sum(widths) + gaps - room)
    starts = left + np.concatenate([[0.0], np.cumsum(np.array(widths[:-1]) + COLUMN)])
    for number, row in enumerate(rows):
        y = top - (number + 0.5) * ROW
        for x, words, width in zip(starts, row, widths, strict=True):
            page.text(x, y, _cut(words, CELL, width), fontsize=CELL, va="center", color=style.INK,
                      fontweight="bold" if number == 0 else "normal")  # fmt: skip
    page.plot([left, left + room], [top - ROW] * 2, color=style.INK, linewidth=0.25 * 72 / INCH)


def _cut(words: str, size: float, width: float) -> str:
    """Words that fit into a width, with dots in place of what does not."""
    if _width(words, size) <= width + 0.1:
        return words
    while words and _width(words + "\N{HORIZONTAL ELLIPSIS}", size) > width:
        words = words[:-1]
    return words + "\N{HORIZONTAL ELLIPSIS}"
