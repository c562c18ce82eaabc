"""The study file: reading, validation, and the mechanism and questions it describes.

The names below are imported when they are first used: a section of a study needs the readers of its fields, which stand
in this package, and reading a whole study needs every section.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechdesign.study.loaded import Study as Study
    from mechdesign.study.templates import template as template
    from mechdesign.study.templates import template_path as template_path
    from mechdesign.study.text.units import Units as Units

_HOMES = {
    "Study": "loaded",
    **dict.fromkeys(("template", "template_path"), "templates"),
    "Units": "text.units",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
