"""Draw a picture that is declared: columns, heights, room for what stands about each panel, one legend."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis as Drawn
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox

from mechdesign.drawing import style
from mechdesign.drawing.framing import highest, window_of
from mechdesign.drawing.legends import page_legend, panel_legend
from mechdesign.drawing.marks import Axis, Coloured, Lines, Own, Panel, Picture
from mechdesign.drawing.ticks import DIGIT, LABEL, NAMES, PAD, folded_names, tick

# Axes with a label that begins so are over a sweep or a path, whose label follows.
OVER = "over "
PLANE = "plane"  # label of axes whose places a page marks as the mechanism moves
_TITLE, _NOTE, _HEADING, _ASIDE = 11.0, 8.5, 9.5, 8.5  # points
# Inches: at the edges of a page, between what is separate.
_EDGE, _GAP = 0.1, 0.14
# Inches: the least width of panels by their kind, and the room beside them at first.
_NARROWEST = {"bars": 1.9, "map": 3.3, "equal": 2.6, "plane": 1.6, "grid": 1.2, "": 2.0}
_BESIDE = 0.9
# Inches: the height of a panel that stands alone, among up to so many below each other, among more, and the least.
_ALONE, _SOME, _MORE, _MOST, _LOWEST = 2.6, 1.75, 1.5, 1.2, 0.7
_MOST_SOME, _MOST_MORE = 4, 7
_HIGHEST_MAP, _HIGHEST_OF_TWO, _HIGHEST_PAGE = 6.0, 3.8, 7.6  # of one of equal axes, of others, of all together
_BESIDE_SHARE = 0.85  # exponent: drawings that stand beside each other may be so much smaller
_MAP = 0.8  # height over width of a map whose axes are not equal
_STILL = 1e-6  # of its size, by which a curve changes that stands still
_SLIVER = 0.45  # least height over width of axes of one scale
_MARGIN = 0.08  # of the range, beyond curves from a given end
_BAR, _ONE_OF_SEVERAL = 0.24, 0.16  # inches of a name with one bar, and of each of several
_AROUND_ROWS = 1.2  # inches of legend and axis of a page
_AROUND_BARS, _ABOUT_BARS = 1.6, 2.5  # inches of title and legend; names for which title and axis of a panel take room


@dataclass(eq=False)
class _Cell:
    """A panel in its place, and whether numbers and name stand at its axes; what stands about it, in inches."""

    panel: Panel
    axes: Axes
    row: int
    column: int
    span: int
    outer_x: bool
    outer_y: bool
    left: float = 0.0
    right: float = 0.0
    below: float = 0.0
    above: float = 0.0
    tall: float = 0.0

    @property
    def drawn_axes(self) -> Iterator[tuple[Drawn, Axis, bool]]:
        """Both axes as drawn and as declared, and whether numbers and name stand at them."""
        if not self.panel.bare:
            yield self.axes.xaxis, self.panel.x, self.outer_x
            yield self.axes.yaxis, self.panel.y, self.outer_y


def draw(picture: Picture) -> Figure:
    """The figure of a picture; use inside `style.context`.

    As many panels stand side by side as the width holds by the least width of their kind. The height of the page is the
    sum of the panels' own: bars by their number, equal axes by their spans, others by how many stand in a column. What
    stands about a panel is measured once and gets its room.
    """
    columns = _columns(picture)
    rows = -(-len(picture.panels) // columns)
    figure = style.new_figure(2.0 * rows)
    cells, entries = [*_cells(figure, picture, columns)], dict[str, Any]()
    several = Counter(map(id, picture.marks()))
    for cell in cells:
        _fill(cell, entries, several, alone=len(cells) == 1)
    for cell in cells:
        _end(cell)
    symbol = max((mark.symbol for mark in picture.marks()), default=0.0)
    legend = page_legend(figure, entries, symbol) if entries else None
    wide, planes = style.width() / columns - _BESIDE, sum(cell.panel.shows is not None for cell in cells)
    plane = highest(columns, -(-planes // columns))
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    for cell in cells:
        cell.tall = _height(cell, wide, rows, plane)
        _size(cell, wide)
    bars = [bar for cell in cells for bar in cell.axes.child_axes if isinstance(bar, Axes)]
    style.name_powers([*(cell.axes for cell in cells), *bars])
    for cell in cells:
        _measure(cell, renderer)
    left, right = ([max(getattr(cell, side) for cell in cells if cell.column == column) for column in range(columns)]
                   for side in ("left", "right"))  # fmt: skip
    wide = (style.width() - sum(left) - sum(right) - _GAP * (columns - 1) - 0.5 * _EDGE) / columns
    for cell in cells:
        cell.tall = _height(cell, wide, rows, plane)
        _name(cell, cell.span * wide)
    heading, top = _heading(picture)
    bottom = legend.get_window_extent(renderer).height / figure.dpi + _GAP if legend is not None else _EDGE
    sides = ("below", "tall", "above")
    below, tall, above = ([max(getattr(cell, side) for cell in _row(cells, row, side)) for row in range(rows)]
                          for side in sides)  # fmt: skip
    around = top + bottom + sum(below) + sum(above) + _GAP * (rows - 1)
    lower = min(1.0, (style.tallest() - around) / sum(tall))
    tall = [max(lower * own, _LOWEST) for own in tall]
    height = around + sum(tall)
    figure.set_figheight(height)
    for cell in cells:
        x = sum(left[: cell.column + 1]) + sum(right[: cell.column]) + cell.column * (wide + _GAP)
        own = wide if cell.span == 1 else style.width() - x - right[-1] - 0.5 * _EDGE
        y = height - top - sum(above[: cell.row + 1]) - sum(below[: cell.row]) - cell.row * _GAP - sum(tall[: cell.row])
        cell.tall = max(lower * cell.tall, _LOWEST) if cell.panel.bars else tall[cell.row]
        left_below = x / style.width(), (y - cell.tall) / height
        cell.axes.set_position((*left_below, own / style.width(), cell.tall / height))
        if cell.panel.shows is not None:
            _frame(cell, own)
        _place(cell, left[cell.column])
        style.show_whole_markers(cell.axes)
        for mark in cell.panel.marks:
            if mark.late:
                mark.draw(cell.axes)
            if legend is not None and mark.label in entries:
                which = [*entries].index(mark.label)
                inches = cell.axes.bbox.width / style.dots() / float(np.ptp(cell.axes.get_xlim()))
                if handle := legend.legend_handles[which]:
                    mark.size_symbol(handle, legend.get_texts()[which], inches)
    for words, size, down in heading:
        figure.text(_EDGE / style.width(), 1 - down / height, words, va="top", fontsize=size)
    return figure


def _row(cells: Sequence[_Cell], row: int, side: str) -> list[_Cell]:
    """Panels of a row by which it has its height: beside axes of one scale others are as high as these."""
    own = [cell for cell in cells if cell.row == row]
    return [cell for cell in own if cell.panel.equal and side == "tall"] or own


def _columns(picture: Picture) -> int:
    """Panels side by side."""
    first = next(panel for panel in picture.panels if panel is not None)
    names = first.y.words if first.kind == "bars" else ()
    if picture.share == "grid":
        return picture.across
    most = max(1, min(picture.across, len(picture.panels), fitting_panels(first.kind, names)))
    if first.shows is None:
        return most

    def size(columns: int) -> float:
        wide = (style.width() - _BESIDE) / columns - _GAP
        rows = -(-len(picture.panels) // columns)
        full = len(picture.panels) / (rows * columns)
        scale = full * window_of(first, wide, highest(columns, rows)).scale
        return float(scale * columns**_BESIDE_SHARE)

    return max(range(1, most + 1), key=size)


def fitting_panels(kind: str = "", names: Sequence[str] = ()) -> int:
    """Panels of a kind that the width holds side by side, of bars beside their names."""
    letters = max(map(len, names), default=0)
    return max(1, int((style.width() - min(NAMES * style.width(), DIGIT * letters)) / _NARROWEST[kind]))


def fitting_rows(legend: int, most: int) -> int:
    """Panels below each other that one page has room for, with so many rows of a legend above each."""
    room = _LOWEST + _GAP + style.line(LABEL) * legend
    return min(most, int((style.tallest() - _AROUND_ROWS) / room)) if style.narrow() else most


def fitting_names(names: Sequence[str], rows: int, bars: int) -> float:
    """How many of the names, with so many bars each, rows of panels have room for on one page."""
    return (style.tallest() - _AROUND_BARS) / rows / _bar_height(names, bars) - _ABOUT_BARS


def _cells(figure: Figure, picture: Picture, columns: int) -> Iterator[_Cell]:
    """The panels in rows, with the axes that they share."""
    by_x, by_y = dict[int, Axes](), dict[int, Axes]()
    planes = [panel.shows for panel in picture.panels if panel is not None and panel.shows is not None]
    everywhere, grid = picture.share != "grid", picture.share == "grid"
    for k, panel in enumerate(picture.panels):
        if panel is None:
            continue
        row, column = divmod(k, columns)
        same_x, same_y = ("x" in picture.share or grid), ("y" in picture.share or grid)
        beside = picture.panels[k + 1] if column + 1 < columns and k + 1 < len(picture.panels) else None
        bars = {mark.bar for mark in (beside.marks if beside else ()) if isinstance(mark, Coloured)} - {""}
        marks = [
            Own(mark.function) if isinstance(mark, Coloured) and mark.bar in bars else mark for mark in panel.marks
        ]
        axes = figure.add_axes(
            (0.1, 0.1, 0.5, 0.5), label=f"panel {k}", sharex=by_x.get(0 if everywhere else column) if same_x else None,
            sharey=by_y.get(0 if everywhere else row) if same_y else None,
        )  # fmt: skip
        by_x.setdefault(0 if everywhere else column, axes)
        by_y.setdefault(0 if everywhere else row, axes)
        outer_x = not same_x or not any(picture.panels[k + columns :: columns])
        outer_y = not same_y or not any(picture.panels[row * columns : k])
        # One that is left over is as wide as the page, unless it shares its axis or is a map.
        alone = k + 1 == len(picture.panels) and not (column or same_x or same_y or panel.kind == "map" or panel.equal)
        shows = np.concatenate(planes) if planes and picture.share == "xy" else panel.shows
        own = replace(panel, marks=marks, shows=shows)
        yield _Cell(own, axes, row, column, columns if alone else 1, outer_x, outer_y)


def _fill(cell: _Cell, entries: dict[str, Any], several: Mapping[int, int], *, alone: bool) -> None:
    """Draw the marks of a panel on its scales, and note what a legend names."""
    axes, panel = cell.axes, cell.panel
    for name, declared in (("x", panel.x), ("y", panel.y)):
        if declared.scale == "log":
            getattr(axes, f"set_{name}scale")("log")
        if declared.margin is not None:
            axes.margins(**dict[str, Any]({name: declared.margin}))
    # A narrow page has no room beside a panel that stands alone: it has the legend of the page.
    own = dict[str, Any]() if panel.legend and not (alone and style.narrow() and panel.legend == "beside") else entries
    for mark in panel.marks:
        handle = Line2D([], [], **mark.look) if mark.late else mark.draw(axes)
        if mark.label and handle is not None:
            # A straight line is no curve, also not among those that `lost_curves` of the tests looks at.
            handle.set_label("_" if isinstance(mark, Lines) else mark.label)
            (entries if several[id(mark)] > 1 else own).setdefault(mark.label, handle)
    if own and own is not entries:
        panel_legend(axes, panel, own, style.width() - _BESIDE)


def _end(cell: _Cell) -> None:
    """The ends of the axes of a panel, once all is drawn that shares them."""
    axes, panel = cell.axes, cell.panel
    if panel.bare:
        axes.set_axis_off()
        axes.set(xticks=[], yticks=[])
    if panel.bars or panel.y.words:
        axes.grid(visible=False, axis="y")
        axes.tick_params(axis="y", length=0)
    axes.set_xlim(*panel.x.ends)
    axes.set_ylim(*((len(panel.bars[0].values) - 0.42, -0.58) if panel.bars else panel.y.ends))
    low, high = panel.y.ends
    if low is not None and high is None and panel.y.scale == "linear":
        # The data's own margin is small where these lie far from the end that is given.
        reach = float(axes.dataLim.y1) - low
        axes.set_ylim(top=max(axes.get_ylim()[1], low + (1 + _MARGIN) * reach))
    if panel.equal:
        axes.set_aspect(panel.equal, anchor="NW")
        if panel.kind == "equal":
            _widen(axes)
    elif panel.y.ends == (None, None) and panel.y.scale == "linear" and not panel.bars:
        _straighten(axes)
    if panel.x.over or panel.plane:
        axes.set_label(PLANE if panel.plane else f"{OVER}{panel.x.label}")


def _straighten(axes: Axes) -> None:
    """What stands still is drawn straight, not by its rounding."""
    low, high = axes.dataLim.intervaly
    if np.isfinite(high - low) and high - low <= _STILL * max(abs(low), abs(high)):
        about = max(0.1 * abs(low + high) / 2, 0.1)
        axes.set_ylim((low + high) / 2 - about, (low + high) / 2 + about)


def _widen(axes: Axes) -> None:
    """Ends of axes of one scale with which a panel is neither a sliver nor higher than wide."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    tall = max(high - low, _SLIVER * (right - left))
    more, above = max(0.0, tall - (right - left)) / 2, (tall - (high - low)) / 2
    axes.set(xlim=(left - more, right + more), ylim=(low - above, high + above))


def _height(cell: _Cell, wide: float, rows: int, plane: float) -> float:
    """Inches of a panel of a width; `plane` those of a drawing at most."""
    panel, axes, most = cell.panel, cell.axes, _HIGHEST_OF_TWO
    if needed := max((mark.height for mark in panel.marks), default=0.0):
        return needed
    if panel.shows is not None:
        return window_of(panel, wide, plane).height
    if panel.equal and panel.kind == "map":
        most = _HIGHEST_MAP if rows == 1 else _HIGHEST_PAGE / rows
    if panel.bars:
        return (0.15 + len(panel.bars[0].values)) * _bar_height(panel.y.words, panel.bars[0].count)
    if panel.equal:
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        return min(most, panel.equal * wide * abs((high - low) / (right - left)))
    if panel.kind == "map":
        return min(most, _MAP * wide)
    if rows == 1:
        return _ALONE
    return panel.size * (_SOME if rows <= _MOST_SOME else _MORE if rows <= _MOST_MORE else _MOST)


def _frame(cell: _Cell, wide: float) -> None:
    """Ends of the axes of a plane of a width."""
    window = window_of(cell.panel, wide, cell.tall)
    middle, half = window.middle, complex(wide, cell.tall / cell.panel.equal) / 2 / window.scale
    cell.axes.set_xlim(middle.real - half.real, middle.real + half.real)
    cell.axes.set_ylim(middle.imag - half.imag, middle.imag + half.imag)


def _bar_height(names: Sequence[str], bars: int) -> float:
    """Inches of a name with so many bars."""
    lines = 1 + max((name.count("\n") for name in folded_names(names)), default=0)
    return max(_BAR, _ONE_OF_SEVERAL * bars + 0.04, style.line(LABEL) * lines)


def _size(cell: _Cell, wide: float) -> None:
    """A panel in about its size, its ticks, and the names of its axes."""
    figure = cell.axes.get_figure(root=True)
    assert figure is not None
    cell.axes.set_position((0.2, 0.2, wide / style.width(), cell.tall / figure.get_figheight()))
    if cell.panel.shows is not None:
        _frame(cell, wide)
    for axis, declared, outer in cell.drawn_axes:
        # What axes share is set at one of them.
        if outer:
            tick(axis, declared, wide if axis is cell.axes.xaxis else cell.tall)
        axis.set_tick_params(labelbottom=outer and declared.numbers, labelleft=outer and declared.numbers)
        axis.set_label_text(declared.label if outer else "")
        axis.offsetText.set_visible(outer and declared.numbers)


def _measure(cell: _Cell, renderer: Any) -> None:
    """Inches that numbers, legends and bars of colours take about a panel, and the name of its upright axis."""
    axes = cell.axes
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_visible(False)
        # `_place` places it; else Matplotlib looks for a place beside the numbers of all axes that share a scale.
        axis.set_label_coords(0.5, 0.5)
    # Nothing else reaches beyond the axes; numbers that are not shown would cost as much as the others.
    parts = [axis.get_tightbbox(renderer) for axis, _, outer in cell.drawn_axes if outer]
    parts += [child.get_tightbbox(renderer) for child in (*axes.child_axes, axes.get_legend()) if child is not None]
    tight = Bbox.union([axes.bbox, *filter(None, parts)])
    box, dots = axes.bbox, style.dots()
    cell.left, cell.right = (max(0.0, side) / dots for side in (box.x0 - tight.x0, tight.x1 - box.x1))
    cell.below, cell.above = (max(0.0, side) / dots for side in (box.y0 - tight.y0, tight.y1 - box.y1))
    if cell.outer_x and cell.panel.x.numbers and not cell.panel.x.words and not cell.panel.bare:
        # In its final width its last number may stand at its end.
        numbers = axes.xaxis.get_major_formatter().format_ticks(axes.xaxis.get_majorticklocs().tolist())
        cell.right = max(cell.right, 0.5 * DIGIT * max(map(len, numbers), default=0) - 0.5 * _EDGE)
    label = axes.yaxis.label
    label.set_text(style.folded(label.get_text(), LABEL, cell.tall))
    cell.left += _lines(label.get_text(), LABEL) + 2 * PAD


def _name(cell: _Cell, wide: float) -> None:
    """The title of a panel and the name of its lower axis, in lines of its width, for which there is room."""
    axes, panel, label = cell.axes, cell.panel, cell.axes.xaxis.label
    label.set_text(style.folded(label.get_text(), LABEL, wide))
    cell.below += _lines(label.get_text(), LABEL)
    # Both in one line if that holds them.
    together = style.folded(f"{panel.title}   {panel.aside}", _HEADING, wide)
    words = [panel.title] if "\n" not in together else [panel.title, panel.aside]
    title = style.folded("\n".join(filter(None, words)), _HEADING, wide)
    look: dict[str, Any] = {"pad": 72 * (cell.above + PAD)}
    axes.set_title(title, loc="left", fontsize=_HEADING, **look)
    if panel.aside and len(words) == 1:
        axes.set_title(panel.aside, loc="right", fontsize=_ASIDE, color=style.VERMILION, **look)
    if title or panel.aside:
        cell.above += _lines(title or panel.aside, _HEADING)


def _place(cell: _Cell, left: float) -> None:
    """Ticks that suit the final size of a panel, and the names of its axes at the edges of its room."""
    axes = cell.axes
    axes.apply_aspect()
    width, height = axes.bbox.width / style.dots(), axes.bbox.height / style.dots()
    for axis, declared, outer in cell.drawn_axes:
        if outer and not (declared.words or len(declared.ticks)):
            tick(axis, declared, width if axis is axes.xaxis else height)
        axis.label.set_visible(True)
    axes.yaxis.set_label_coords((PAD - left) / width, 0.5)
    axes.yaxis.label.set_verticalalignment("top")
    axes.xaxis.set_label_coords(0.5, -cell.below / height)
    axes.xaxis.label.set_verticalalignment("bottom")


def _lines(text: str, size: float) -> float:
    """Inches of a text's lines with what keeps it apart."""
    return style.line(size) * (1 + text.count("\n")) + PAD if text else 0.0


def _heading(picture: Picture) -> tuple[list[tuple[str, float, float]], float]:
    """Title and notes in lines of the page with their sizes and places from the top, and inches of them all."""
    lines, down = [], _EDGE
    for words, size in ((picture.title, _TITLE), *((note, _NOTE) for note in picture.notes)):
        if words:
            lines.append((style.folded(words, size, style.width() - 2 * _EDGE), size, down))
            down += _lines(lines[-1][0], size)
    return lines, down + PAD
