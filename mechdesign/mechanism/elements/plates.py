"""Links as plates that are cut from sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element, Term

NO_CLASS = "none"
_CLASSES = {
    NO_CLASS: "that of `reliability` where its dimensions are of one such class, else none",
    "ISO 2768-f": "fine: 0.05 mm of lengths up to 6 mm, 0.1 up to 30 mm, 0.15 up to 120 mm, 0.2 up to 400 mm",
    "ISO 2768-m": "medium: 0.1 mm of lengths up to 6 mm, 0.2 up to 30 mm, 0.3 up to 120 mm, 0.5 up to 400 mm",
    "ISO 2768-c": "coarse: 0.3 mm of lengths up to 6 mm, 0.5 up to 30 mm, 0.8 up to 120 mm, 1.2 up to 400 mm",
    "ISO 2768-v": "very coarse: 0.5 mm of lengths up to 6 mm, 1 up to 30 mm, 1.5 up to 120 mm, 2.5 up to 400 mm",
}


@dataclass(frozen=True)
class Plates(Element):
    """Links as flat plates that are cut to size, and the pins that join them."""

    width: declared.PositiveLength = 0.0
    """Width of every link that has none of its own: the outline is as far from its points as half of it. Left out: the
    least ``width`` of a link. Example: 20 mm
    """
    pin: declared.PositiveLength | None = None
    """Diameter of every pin and its holes. Left out: 0.4 of ``width``. Example: 6 mm"""
    thickness: declared.PositiveLength | None = None
    """Thickness of a plate, and so the height of a layer. Left out: 0.25 of ``width``. Example: 5 mm"""
    pins: Annotated[Mapping[str, Term], declared.Notation("diameters")] = field(default_factory=dict)
    """Diameters of pins that differ, by their point. Example: {A: 8 mm}"""
    kerf: declared.NonNegativeLength = 0.0
    """Width of the cut that laser, water or wire takes away: outlines are larger by half of it, holes smaller. Left
    out: 0. Example: 0.2 mm
    """
    sheet: declared.PositiveLength | None = None
    """Width of the sheet on which the parts lie in rows. Left out: 600 mm. Example: 300 mm"""
    general_tolerance: Annotated[str, declared.Choice(_CLASSES, "general tolerance")] = NO_CLASS
    """Tolerance of every dimension on the drawing sheet that has none of its own. Example: ISO 2768-m"""
    widths: Mapping[str, Term] = field(default_factory=dict)  # of links that have one
    layers: Mapping[str, int] = field(default_factory=dict)  # of links that have one, from 1 on
