"""The mechanism moving in a page: the poses of a result, as integers that a small script draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mechdesign.results import Result
from mechdesign.study import Study


@dataclass(frozen=True)
class Moving:
    """A mechanism that moves in a page."""

    drawing: str  # inline SVG in one pose: what is seen without script and in print
    beside: str  # inline SVG that shows where it is: motion curves, or the map that the pointer moves over
    data: Mapping[str, Any]  # what the script moves it by, as JSON


def moving(study: Study, result: Result) -> Moving | None:
    """The mechanism of a result that has poses to move through: a sweep, a path, the grid of a workspace."""
    return None
