"""The look of every picture: fonts, colours and bytes that do not depend on the user's settings."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, NamedTuple, cast
from unicodedata import east_asian_width

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from matplotlib.ticker import LogFormatter, NullLocator, ScalarFormatter
from numpy.typing import NDArray
from PIL import Image

from mechdesign.drawing import fonts
from mechdesign.ground.numerals import as_written, printed, raised, reading

DPI = 120
# Of zlib, 0 to 9: a tenth fewer bytes than its usual 6 for 9 ms a picture; 9 takes 20 ms more for two hundredths.
_DEFLATE_LEVEL = 8
# Of colours in few: the largest distance and its root mean square (of 255 a channel), buckets of 6 bits a channel, and
# pixels side by side from which on a colour is that of an area, which keeps its colour but for `_OF_AREA`.
_FARTHEST, _OF_AREA, _MEAN, _SHADES, _AREA = 48, 6, 3.0, 1 << 18, 4
_WIDE = 64  # pixels of an area


class Look(NamedTuple):
    """A page and how finely it is drawn: laid out with type of 10 points on so many inches, and then reduced."""

    width: float
    height: float  # at most
    dots: int  # an inch of the layout
    reduction: float


# Inches, of a journal's column.
_COLUMN = 88 / 25.4
_TALLEST = 230 / 25.4
_REDUCTION = 0.8  # to type of 8 points
_NARROW = 6.0  # inches
_LEAST_PRINTED = 6.8  # points
LOOKS = {
    # 960 pixels, which a README shows at about 800.
    "screen": Look(8.0, math.inf, DPI, 1.0),
    # 300 dots an inch of paper.
    "paper": Look(_COLUMN / _REDUCTION, _TALLEST / _REDUCTION, 240, _REDUCTION),
}

# Okabe and Ito: told apart with every kind of colour vision, and in grey by their order of brightness.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442")
BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY, YELLOW = PALETTE
# For pictures in grey, where brightness tells few apart.
DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (2, 1)), (0, (6, 1, 1.5, 1)), (0, (1, 1.5)), (0, (8, 1, 1, 1, 1, 1)))
HATCHES = ("", "////", "....", "xxxx")
INK = "#222222"
FAINT = "#9A9A9A"
COLORMAP = "cividis"
_DECADES = 100.0  # ratio of the ends of a logarithmic axis beyond which powers of ten alone have ticks


# What stands in one line: a name, an equals sign, a number and its unit; a unit in brackets; a number and its unit.
_EQUATION = re.compile(r"\S+ = [^\s,]+( [^\s,=]+(?=,|$))?|\[[^] ]+ [^]]+\]|(?<!\S)-?\d[\d.]* [^\W\d]\S*")
# What a long word may be broken into: never the value of a name, which would read as two numbers.
_PARTS = re.compile(r"\xa0?=\xa0.+|[^._\xa0]+[._]*|[._]+|\xa0(?!=)")
_NAME = re.compile(r"[\w.]+")
_MOST_LETTERS, _FEWEST_LETTERS = 36, 16  # of a name in a line of text, of a long one in a narrow line
_LETTER = 0.58  # mean width of a letter in font sizes
NO_BREAK = "\N{NO-BREAK SPACE}"
_MINUS = "\N{MINUS SIGN}"

_SETTINGS: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 11,
    # Given: to find it from all that stands above the axes takes as long as a tenth of the picture.
    "axes.titley": 1.0,
    "axes.labelsize": 10,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.prop_cycle": cycler(color=PALETTE),
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "xtick.color": INK,
    "ytick.color": INK,
    "image.cmap": COLORMAP,
    # Names of clips in SVG follow from what they are; PDF has fonts that journals take.
    "svg.hashsalt": "mechdesign",
    "pdf.fonttype": 42,
}


@contextmanager
def context(look: str = "screen") -> Iterator[None]:
    """Matplotlib's defaults with one of `LOOKS` inside the context; afterwards the user's settings apply again.

    NumPy does not warn there, as it does not inside a question.
    """
    wide, _, dots, reduction = LOOKS[look]
    page = {"figure.figsize": (wide, wide), "figure.dpi": dots, "savefig.dpi": dots / reduction}
    # As rcdefaults, which reads all styles that come with Matplotlib besides.
    defaults = {name: value for name, value in matplotlib.rcParamsDefault.items() if not name.startswith("backend")}
    with matplotlib.rc_context(), fonts.quiet(), np.errstate(all="ignore"):
        matplotlib.rcParams.update(defaults | _SETTINGS | page | {"font.family": fonts.families()})
        yield


def width() -> float:
    """Width of the page, inches of its layout."""
    return float(matplotlib.rcParams["figure.figsize"][0])


def dots() -> float:
    """Dots an inch of the layout."""
    return float(matplotlib.rcParams["figure.dpi"])


def tallest() -> float:
    """Greatest height of the page, inches of its layout."""
    return _look().height


def narrow() -> bool:
    """Whether panels have no room side by side."""
    return width() < _NARROW


class NotebookFigure(Figure):
    """A figure that notebooks show as a PNG; plain Matplotlib figures are shown only if pyplot manages them."""

    def _repr_png_(self) -> bytes:
        with context():
            return encoded(self)

    def draw(self, renderer: Any) -> None:
        """As Matplotlib does; of letters without a font `fonts.lost_letters` tells."""
        with fonts.quiet():
            super().draw(renderer)


def new_figure(height: float) -> Figure:
    """An empty figure as wide as the page (inches) with the Agg canvas; use inside `context`."""
    figure = NotebookFigure(figsize=(width(), height))
    FigureCanvasAgg(figure)
    return figure


def small() -> float:
    """The least size of type, points of the layout: 6.8 points on paper."""
    return max(8.0, _LEAST_PRINTED / _look().reduction)


def line(size: float) -> float:
    """Height of a line of type of a size (points), inches."""
    return 1.2 * size / 72


def folded(words: str, size: float, room: float) -> str:
    """Text of a size (points) in lines of at most `room` inches.

    ``x = 2 mm`` is broken only where it does not fit, before the equals sign; a number keeps its unit, a unit in
    brackets its factors. A word that fits no line is broken after its dots and underscores. Long names are shortened.
    """
    fitting = int(72 * room / (_LETTER * size))
    words, lines = shortened(words, _MOST_LETTERS, max(_FEWEST_LETTERS, min(_MOST_LETTERS, fitting))), list[str]()
    if max(map(len, words.split("\n"))) * size <= 72 * room:
        return words  # no letter is wider than high

    def fits(line: str) -> bool:
        return length(line, size) <= 72 * room

    def joined(equation: re.Match[str]) -> str:
        if fits(equation[0]):
            return equation[0].replace(" ", NO_BREAK)
        name, value = equation[0].split(" ", 1)
        return f"{name} {value.replace(' ', NO_BREAK)}"

    for line in words.split("\n"):
        lines.append("")
        for word in _EQUATION.sub(joined, line).split(" "):
            gap = " "
            for part in [word] if fits(word) else _PARTS.findall(word):
                longer = f"{lines[-1]}{gap if lines[-1] else ''}{part}"
                if lines[-1] and not fits(longer):
                    lines.append(part.lstrip(NO_BREAK))
                else:
                    lines[-1] = longer
                gap = ""
    return "\n".join(lines).replace(NO_BREAK, " ")


def shortened(words: str, most: int, left: int = 0) -> str:
    """Text whose names of more letters than `most` are cut in their middle to as many, or those `left`.

    Beginning and end tell names apart.
    """
    left = left or most

    def ends(name: re.Match[str]) -> str:
        if len(name[0]) <= most:
            return name[0]
        return f"{name[0][: left // 2]}\N{HORIZONTAL ELLIPSIS}{name[0][len(name[0]) + left // 2 + 1 - left :]}"

    return _NAME.sub(ends, words)


def letters(line: str) -> int:
    """Letters of a line of text, those of East Asia counted twice, which are as wide as high."""
    return len(line) + sum(east_asian_width(letter) in "WF" for letter in line) * (not line.isascii())


@lru_cache(maxsize=1024)
def length(line: str, size: float) -> float:
    """Points of a line of type of a size."""
    return float(text_to_path.get_text_width_height_descent(line, FontProperties(size=size), False)[0])


def axis_label(name: str, unit: str = "") -> str:
    """``name [unit]``, or the name alone where there is no unit."""
    return f"{name} [{printed(unit)}]" if unit else name


class _Powers(LogFormatter):
    """Powers of ten in plain type: Matplotlib sets them as formulas, which takes as long as the rest of a picture."""

    def __call__(self, value: float, position: int | None = None) -> str:
        if not super().__call__(value, position):
            return ""
        digit, power = f"{value:.0e}".split("e")
        return ("" if digit == "1" else f"{digit}\N{MIDDLE DOT}") + f"10{raised(int(power))}"


def name_powers(panels: Iterable[Axes]) -> None:
    """Write the power of ten of an axis into the unit of its label, ``force [kN]``, once all is drawn.

    At the end of the axis, where Matplotlib writes it, it would lie over titles and legends. An axis without a label,
    such as that of a bar of colours below a title, keeps it there.
    """
    for axes in panels:
        for axis in (axes.xaxis, axes.yaxis):
            formatter, label = axis.get_major_formatter(), axis.get_label_text()
            if isinstance(formatter, LogFormatter):
                axis.set_major_formatter(_Powers())
                axis.set_minor_formatter(_Powers())
                low, high = axis.get_view_interval()
                if high > _DECADES * low:
                    # Each of its ticks costs as much as a line.
                    axis.set_minor_locator(NullLocator())
            if not isinstance(formatter, ScalarFormatter) or not label or not axis.offsetText.get_visible():
                continue
            axis.offsetText.set_visible(False)
            name, bracket, rest = label.partition("[")
            unit, _, rest = rest.partition("]")
            largest = float(np.abs(axis.get_view_interval()).max())
            exponent, unit = reading(largest, as_written(unit))
            formatter.set_scientific(exponent != 0)
            if exponent:
                formatter.set_powerlimits((exponent, exponent))
            if bracket:
                axis.set_label_text(f"{name}[{unit}]{rest}")
            elif exponent:
                axis.set_label_text(f"{label} [{unit}]")


def show_whole_markers(axes: Axes) -> None:
    """Markers of curves that end at the edges of a panel are not cut there."""
    for line in axes.get_lines():
        places, (low, high) = np.asarray(line.get_xydata(), float), np.sort([axes.get_xlim(), axes.get_ylim()]).T
        inside = (low <= places) & (places <= high) | np.isnan(places)
        line.set_clip_on(line.get_marker() in ("", "None") or not inside.all())


def encoded(figure: Figure, kind: str = "png", creator: str | None = None) -> bytes:
    """A figure as a file's bytes, ``png``, ``svg`` or ``pdf``, without date or host; `creator` is who made a PDF.

    A PNG has few colours, a quarter of the size.
    """
    stream, dots = io.BytesIO(), matplotlib.rcParams["savefig.dpi"]
    if kind == "svg":
        figure.savefig(stream, format=kind, metadata={"Date": None})
        return _reduced(stream.getvalue(), _look().reduction)
    if kind == "pdf":
        # Its modules take a fifth of a second to import.
        from mechdesign.drawing.reduced_pdf import pdf

        return pdf(figure, creator, _look().reduction)
    figure.canvas.draw()
    few = _in_few_colours(np.asarray(cast(Any, figure.canvas).buffer_rgba()))
    few.save(stream, format="png", dpi=(dots, dots), compress_level=_DEFLATE_LEVEL)
    return stream.getvalue()


def _in_few_colours(pixels: NDArray[np.uint8]) -> Image.Image:
    """A picture of pixels (height, width, 4) in as few colours as no eye misses, at most 256.

    Areas keep their colours. Of the shades one after another is taken that is farthest from those taken, rare ones
    last, until none is farther than `_FARTHEST`, of areas than `_OF_AREA`, and all pixels are in the mean nearer than
    `_MEAN`.
    """
    height, width, _ = pixels.shape
    colours = pixels.view(np.uint32).ravel()
    # A run of equal pixels is looked up as one pixel.
    begins = np.concatenate([[0], np.flatnonzero(colours[1:] != colours[:-1]) + 1])
    lengths, colours = np.diff(begins, append=len(colours)), colours[begins]
    shades = colours >> 2 & 0x3F | colours >> 4 & 0xFC0 | colours >> 6 & 0x3F000
    shown, areas = np.empty(_SHADES, dtype=np.uint32), lengths > _AREA
    shown[shades], shown[shades[areas]] = colours, colours[areas]
    counts = np.bincount(shades, lengths, _SHADES)
    used = np.flatnonzero(counts)
    counts, colors = counts[used], shown[used].view(np.uint8).reshape(-1, 4)[:, :3].astype(float)
    wide = np.bincount(shades[areas], lengths[areas], _SHADES)[used] > _WIDE
    most = np.where(wide, _OF_AREA, _FARTHEST) ** 2.0
    far, nearest, taken = np.full(len(used), np.inf), np.zeros(_SHADES, dtype=np.uint8), [int(np.argmax(counts))]
    while True:
        distances = np.square(colors - colors[taken[-1]]).sum(axis=1)
        nearest[used[distances < far]] = len(taken) - 1
        far = np.minimum(far, distances)
        if len(taken) == 256 or ((far <= most).all() and far @ counts <= _MEAN**2 * height * width):
            break
        taken.append(int(np.argmax(far / most * counts**0.25)))
    picture = Image.frombytes("P", (width, height), np.repeat(nearest[shades], lengths).tobytes())
    picture.putpalette(colors[taken].astype(np.uint8).tobytes())
    return picture


def _look() -> Look:
    """That of the page."""
    return next((look for look in LOOKS.values() if look.width == width()), LOOKS["screen"])


def _reduced(drawing: bytes, share: float) -> bytes:
    """An SVG shown at a share of its size: its coordinates stay."""
    if share == 1.0:
        return drawing

    def smaller(size: re.Match[bytes]) -> bytes:
        return b'%s="%.6gpt"' % (size[1], share * float(size[2]))

    return re.sub(rb'(width|height)="([0-9.]+)pt"', smaller, drawing, count=2)
