"""Drawings as SVG at full size, or shown reduced: a group a layer, sizes in millimetres."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count
from xml.sax.saxutils import escape, quoteattr

from mechdesign.door.exporting.drawing import CentreMark, Drawing, DrawnCircle, Path, Shape, Text, arc
from mechdesign.ground.errors import printable, printable_lines

MARGIN = 5.0  # around the drawing
STROKE, LINES = 0.2, 3000  # least width of lines, and their number side by side in a large drawing
CROSS = 1.0  # half length of the strokes of a mark


def to_svg(drawing: Drawing) -> str:
    """The drawing as the text of an SVG file, one unit of which is a millimetre."""
    low, high = drawing.box
    corner, size = complex(low.real, -high.imag) - MARGIN * (1 + 1j), high - low + 2 * MARGIN * (1 + 1j)
    scale = next(scale for scale in _scales() if max(size.real, size.imag) <= scale * drawing.longest)
    stroke = max(scale * STROKE, max(size.real, size.imag) / LINES)
    title = drawing.title + f", shown at 1:{scale}" * (scale > 1)
    remarks = "\n".join((title, "made by mechdesign; one unit is 1 mm", *drawing.remarks))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<!-- {escape(printable_lines(remarks)).replace('--', '- -')} -->",
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="{_n(size.real / scale)}mm" height="{_n(size.imag / scale)}mm" '
        f'viewBox="{_n(corner.real)} {_n(corner.imag)} {_n(size.real)} {_n(size.imag)}">',
        f"<title>{escape(printable(title))}</title>",
    ]
    for layer in drawing.layers:
        look = f'fill="none" stroke="{layer.color}" stroke-width="{stroke:.3g}"'
        lines.append(f'<g id="{layer.name}" inkscape:groupmode="layer" inkscape:label="{layer.name}" {look}>')
        for name, group in drawing.groups.items():
            lines += _group(name, [shape for shape in group if shape.layer == layer.name], layer.color)
        lines.append("</g>")
    return "\n".join([*lines, "</svg>", ""])


def _scales() -> Iterator[int]:
    """Those of ISO 5455: 1, 2, 5, 10, 20, 50, 100."""
    return (digit * 10**power for power in count() for digit in (1, 2, 5))


def _group(name: str, shapes: Sequence[Shape], color: str) -> list[str]:
    if not shapes:
        return []
    return [f"<g data-part={quoteattr(printable(name))}>", *(_element(shape, color) for shape in shapes), "</g>"]


def _element(shape: Shape, color: str) -> str:
    if isinstance(shape, DrawnCircle):
        x, y = shape.place.real, -shape.place.imag
        return f'<circle cx="{_n(x)}" cy="{_n(y)}" r="{_n(shape.radius)}"/>'
    if isinstance(shape, CentreMark):
        x, y = shape.place.real, -shape.place.imag
        return f'<path d="M {_n(x - CROSS)} {_n(y)} h {2 * CROSS:g} M {_n(x)} {_n(y - CROSS)} v {2 * CROSS:g}"/>'
    if isinstance(shape, Text):
        look = f'font-family="sans-serif" font-size="{_n(shape.height)}" fill="{color}" stroke="none"'
        middle = ' text-anchor="middle" dominant-baseline="central"' if shape.centred else ""
        place = f'x="{_n(shape.place.real)}" y="{_n(-shape.place.imag)}"'
        return f"<text {place} {look}{middle}>{escape(printable(shape.words))}</text>"
    return f'<path d="{_data(shape)}"/>'


def _data(path: Path) -> str:
    """The commands of a path; y counts downwards."""
    commands = [f"M {_at(path.corners[0])}"]
    for begin, end, bulge in path.pieces():
        if bulge:
            radius = _n(arc(begin, end, bulge)[1])
            commands.append(f"A {radius} {radius} 0 {int(abs(bulge) > 1)} {int(bulge < 0)} {_at(end)}")
        else:
            commands.append(f"L {_at(end)}")
    return " ".join([*commands, "Z"] if path.closed else commands)


def _at(place: complex) -> str:
    return f"{_n(place.real)} {_n(-place.imag)}"


def _n(value: float) -> str:
    """A number with the digits of a nanometre, without zeros at its end."""
    return f"{value:.6f}".rstrip("0").rstrip(".") if abs(value) >= 5e-7 else "0"
