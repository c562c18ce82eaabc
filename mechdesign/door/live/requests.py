"""What pages ask, read from plain data; what no page asks is an error."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from mechdesign.door.report.page.linkage import Canvas

_LARGEST = 1e150  # number that a page may send
_WIDEST = 1e5  # size of a sheet, and of a mechanism on it, in units of the drawing


class RequestError(Exception):
    """A request that no page makes."""


def request_in(body: bytes) -> dict[str, Any]:
    """What a page asks, by the text of its request."""
    try:
        request = json.loads(body)
    except (ValueError, RecursionError):
        request = None
    if not isinstance(request, dict):
        raise RequestError
    return request


def changes_of(request: Mapping[str, Any]) -> dict[str, float]:
    """Changes of a study, by the names of parameters and dimensions."""
    changes = request.get("changes")
    # They become entries as `--set` takes them: a name ends before the sign.
    if not isinstance(changes, Mapping) or any("=" in str(name) for name in changes):
        raise RequestError
    return {str(name): number_of(value) for name, value in changes.items()}


def number_of(value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _LARGEST:
        raise RequestError
    return float(value)


def numbers_of(values: Any, count: int) -> list[float]:
    """So many numbers."""
    if not isinstance(values, list) or len(values) != count:
        raise RequestError
    return [*map(number_of, values)]


def texts_of(values: Any) -> list[str]:
    """A list of texts; none where it is left out."""
    if values is not None and not isinstance(values, list):
        raise RequestError
    return [str(value) for value in values or ()]


def sheet_of(request: Mapping[str, Any], size: float) -> Canvas:
    """The sheet on which the page draws a mechanism of a size: corner, scale, width and height."""
    x, y, scale, width, height = numbers_of(request.get("sheet"), 5)
    if min(scale, width, height) <= 0 or max(scale * size, width, height) > _WIDEST:
        raise RequestError
    return Canvas(complex(x, y), scale, width, height)
