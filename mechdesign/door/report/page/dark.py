"""Colours of drawings on a dark screen: rules of CSS in place of those on paper."""

from __future__ import annotations

import colorsys
import re
from collections.abc import Iterable
from functools import cache

from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb

from mechdesign.drawing import style

_COLOR = re.compile(r'\b(?:fill|stroke)="(#[0-9a-fA-F]{3,6}|white|black)"')
# Lightness of white and of black on a dark screen, that of the weakest line, and from which on a colour is a tint of
# the paper.
_GROUND, _BRIGHT = 0.13, 0.93
_LINE = 0.6
_TINT = 0.7


def dark(drawings: Iterable[str]) -> str:
    """Rules for a dark screen for the colours of some drawings (SVG), but those of maps, which stand for numbers."""
    used = {color for drawing in drawings for color in _COLOR.findall(drawing)}
    rules = [
        f"svg [{kind}={_quoted(color)}]{{{kind}:{to_hex(_darkened(color))}}}"
        for color in sorted(used)
        if to_hex(color) not in _of_maps()
        for kind in ("fill", "stroke")
    ]
    return "".join(["@media screen and (prefers-color-scheme:dark){", *rules, "}\n"]) if rules else ""


def _quoted(color: str) -> str:
    return f'"{color}"' if color.startswith("#") else color


def _darkened(color: str) -> tuple[float, float, float]:
    """A colour in reversed lightness; lines and letters stay clear of the ground."""
    hue, lightness, saturation = colorsys.rgb_to_hls(*to_rgb(color))
    reverse = _BRIGHT - (_BRIGHT - _GROUND) * lightness
    return colorsys.hls_to_rgb(hue, reverse if lightness >= _TINT else max(reverse, _LINE), saturation)


@cache
def _of_maps() -> frozenset[str]:
    scale = colormaps[style.COLORMAP]
    return frozenset(to_hex(scale(k)) for k in range(scale.N))
