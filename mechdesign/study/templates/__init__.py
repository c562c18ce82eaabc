"""Commented studies to start from, as `mechdesign new` prints them."""

from __future__ import annotations

from pathlib import Path

from mechdesign.ground.errors import StudyError, suggestion

_FOLDER = Path(__file__).parent
# The one that is taken where none is named.
BUILT_IN = "two_link_arm"


def templates() -> tuple[str, ...]:
    """Names of the templates."""
    return tuple(sorted(file.stem for file in _FOLDER.glob("*.yaml")))


def template_path(name: str = BUILT_IN) -> Path:
    """File of a template.

    Raises
    ------
    StudyError
        If there is none of that name.
    """
    names = templates()
    if name not in names:
        raise StudyError(f"there is no template {name!r}{suggestion(name, names)}; there are {', '.join(names)}")
    return _FOLDER / f"{name}.yaml"


def template(name: str = BUILT_IN) -> str:
    """Text of a template."""
    return template_path(name).read_text(encoding="utf-8")
