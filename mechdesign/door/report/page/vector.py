"""Figures in an HTML page: inline SVG where that is small, else a PNG as a data URI."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree

import matplotlib
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from mechdesign.door.report.page.axes import axes_of
from mechdesign.drawing import style

Element = ElementTree.Element

# SVG may have this many times the bytes of a PNG, which can be neither enlarged nor searched.
MAX_RATIO = 1.5
# SVG with fewer bytes than this is always taken.
SMALL = 40_000
# Decimals of the places in SVG, in points of 1/72 inch.
_DECIMALS = 2
_FONTS = "'DejaVu Sans',Verdana,Geneva,sans-serif"
_NUMBER = re.compile(r"-?\d*\.?\d+(?:e[-+]?\d+)?")
_TOKEN = re.compile(rf"[A-Za-z]|{_NUMBER.pattern}")
_REFERENCE = re.compile(r"#([\w.-]+)")
_SPACE = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
# Attributes that a page does not need, and defaults of SVG.
_LEFT_OUT = {f"{_SPACE}metadata", f"{_SPACE}style"}
_ASSUMED = {"stroke-linejoin": "round", "stroke-linecap": "butt", "stroke-dasharray": "none", "text-anchor": "start"}
# Mark of texts with a white edge, so that they can be recognised in the SVG.
_HALO = "halo"


def described(figure: Figure) -> str:
    """Alternative text of a figure: the titles of its panels and the labels of their axes."""
    parts: dict[str, None] = {}
    for axes in figure.axes:
        labels = axes.get_xlabel(), axes.get_ylabel()
        titles = [axes.get_title(loc) for loc in ("left", "center", "right")]
        words = [title for title in titles if title]
        words += [f"{labels[1]} over {labels[0]}" if all(labels) else "".join(labels)] if any(labels) else []
        parts.setdefault(": ".join(words), None)
    return "; ".join(" ".join(part.split()) for part in parts if part)


def picture_of(command: str, name: str, figure: Figure, png: bytes | None = None) -> str:
    """A picture of a question as it stands in a page; see `picture`."""
    return picture(figure, f"{command}-{name}", f"{name.replace('_', ' ')}: {described(figure)}", png)


def picture(figure: Figure, name: str, alt: str, png: bytes | None = None) -> str:
    """A figure as HTML; use inside `style.context`.

    Parameters
    ----------
    name : str
        Begins the ids inside: unique in the page.
    png : bytes, optional
        The figure as it is written into a file, if it has been.
    """
    drawn = inline(figure, name, alt)
    if len(drawn) <= SMALL:
        return drawn
    pixels = base64.b64encode(style.encoded(figure, "png") if png is None else png).decode()
    if len(drawn) <= MAX_RATIO * len(pixels):
        return drawn
    width, height = (round(inches * style.DPI) for inches in figure.get_size_inches())
    image = Element("img", alt=alt, width=f"{width}", height=f"{height}", src=f"data:image/png;base64,{pixels}")
    return ElementTree.tostring(image, encoding="unicode")


def inline(figure: Figure, name: str, alt: str) -> str:
    """A figure as an SVG element for a page, with texts as texts and without links to other files; see `picture`."""
    haloed = dict[Text, Any]()
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        halo = _halo(text)
        if halo is not None:
            # As a path effect it would turn the letters into outlines.
            haloed[text] = text.get_path_effects()
            text.set_path_effects([])
            text.set_gid(f"{_HALO}{halo:g}")
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        root = ElementTree.fromstring(style.encoded(figure, "svg"))
    for text, effects in haloed.items():
        text.set_path_effects(effects)
    _clean(root, "")
    used = {
        match for element in root.iter() for value in element.attrib.values() for match in _REFERENCE.findall(value)
    }
    names = {old: f"{name}-{count}" for count, old in enumerate(dict.fromkeys(_ids(root, used)))}
    _rename(root, names)
    _unwrap(root)
    _inherited(root)
    box = root.attrib["viewBox"]
    root.attrib.clear()
    root.attrib |= {"viewBox": box, "role": "img", "aria-label": alt, "font-family": _FONTS, "stroke-linejoin": "round"}
    if axes := axes_of(figure):
        root.set("data-axes", json.dumps(axes, separators=(",", ":"), ensure_ascii=False))
    return ElementTree.tostring(root, encoding="unicode")


def _halo(text: Text) -> float | None:
    effects = text.get_path_effects()
    widths = [float(effect._gc["linewidth"]) for effect in effects if isinstance(effect, withStroke)]  # type: ignore[attr-defined]
    return widths[0] if len(widths) == len(effects) == 1 else None


def _clean(element: Element, halo: str) -> None:
    """Convert names, attributes and numbers of an element and its children to what HTML accepts, and round them."""
    halo = element.get("id", "").removeprefix(_HALO) if element.get("id", "").startswith(_HALO) else halo
    for child in list(element):
        if child.tag in _LEFT_OUT:
            element.remove(child)
        else:
            _clean(child, halo)
    element.tag = element.tag.removeprefix(_SPACE)
    attributes = dict(element.attrib)
    element.attrib.clear()
    looks = dict(part.split(":", 1) for part in attributes.pop("style", "").split(";") if ":" in part)
    for key, value in (*attributes.items(), *((key.strip(), value.strip()) for key, value in looks.items())):
        key = "href" if key == _LINK else key
        if key == "d":
            value = _path(value)
        elif key == "font":
            key, value = "font-size", value.split("px")[0].split()[-1]
        elif key == "font-size":
            value = value.removesuffix("px")
        elif key not in ("id", "href", "class", "clip-path", "fill", "stroke", "viewBox", "font-family", "font-weight"):
            value = _NUMBER.sub(lambda match: _rounded(match[0]), value)
        if key != "font-family" and _ASSUMED.get(key) != value and not value.startswith("rotate(-0 "):
            element.set(key, value)
    if element.tag == "text":
        if not len(element) and element.text:
            element.set("textLength", _rounded(str(_length(element.text, element.attrib))))
        if halo:
            element.attrib |= {"stroke": "#fff", "stroke-width": halo, "paint-order": "stroke"}
    if element.tag not in ("text", "tspan"):
        element.text = None
    if element.tag != "tspan":
        element.tail = None


def _rounded(number: str) -> str:
    text = f"{float(number):.{_DECIMALS}f}".rstrip("0").rstrip(".")
    # Scales of font units are small numbers and keep more digits.
    return (text if abs(float(number)) >= 0.1 or float(number) == 0 else f"{float(number):.4g}").replace("-0.", "-.")


def _length(text: str, look: dict[str, str]) -> float:
    """Length of a text in the font of the layout; the browser keeps this length with another font."""
    weight = "bold" if look.get("font-weight") in ("bold", "700") else "normal"
    # Fonts are opened anew in each forked process: two processes that share a file position find no glyphs.
    font = get_font(findfont(FontProperties(family="DejaVu Sans", weight=weight)))
    font.set_size(100.0, 72)
    font.set_text(text)
    return float(font.get_width_height()[0]) / 64 * float(look.get("font-size", 10.0)) / 100


def _path(text: str) -> str:
    """A path in relative steps, in whole units of the last decimal, as short as possible."""
    unit = 10**_DECIMALS
    commands: list[str] = []
    here, start, command, last = (0, 0), (0, 0), "", ""
    numbers: list[int] = []
    for token in _TOKEN.findall(text):
        if token.isalpha():
            command, numbers = token, []
            if token in "zZ":
                commands.append("z")
                here, last = start, "z"
            continue
        numbers.append(round(float(token) * unit))
        if len(numbers) < {"M": 2, "L": 2, "Q": 4, "C": 6}[command]:
            continue
        points = list(zip(numbers[::2], numbers[1::2], strict=True))
        numbers = []
        steps = [coordinate for x, y in points for coordinate in (x - here[0], y - here[1])]
        if command == "M":
            commands.append("M" + _joined(points[0]))
            start, last = points[0], "m"
        else:
            # One command letter serves all following steps of its kind.
            letter = command.lower()
            way = _joined(tuple(steps))
            commands.append((letter if letter != last else "" if way[0] == "-" else " ") + way)
            last = letter
        here = points[-1]
    return "".join(commands)


def _joined(numbers: tuple[int, ...]) -> str:
    joined = ""
    for number in numbers:
        text = f"{number / 10**_DECIMALS:.{_DECIMALS}f}".rstrip("0").rstrip(".")
        text = text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text
        joined += text if not joined or text[0] == "-" else f" {text}"
    return joined


def _ids(root: Element, used: set[str]) -> Iterator[str]:
    return (element.attrib["id"] for element in root.iter() if element.get("id") in used)


def _rename(root: Element, names: dict[str, str]) -> None:
    renamed: Callable[[re.Match[str]], str] = lambda match: f"#{names[match[1]]}" if match[1] in names else match[0]  # noqa: E731
    for element in root.iter():
        identity = element.attrib.pop("id", None)
        for key in ("href", "clip-path", "fill"):
            if key in element.attrib:
                element.set(key, _REFERENCE.sub(renamed, element.attrib[key]))
        if identity in names:
            element.set("id", names[identity])


def _inherited(root: Element) -> None:
    """Remove from uses of a symbol the looks that the symbol has itself."""
    symbols = {f"#{element.get('id')}": element for element in root.iter() if element.get("id")}
    for use in root.iter("use"):
        symbol = symbols[use.attrib["href"]]
        for look in symbol.attrib.keys() & use.attrib.keys() & {"fill", "stroke", "stroke-width"}:
            del use.attrib[look]


def _unwrap(element: Element) -> None:
    """Remove groups and definitions without attributes or content."""
    for child in list(element):
        _unwrap(child)
    children = []
    for child in element:
        children += list(child) if child.tag == "g" and not child.attrib else [child]
    element[:] = children
