"""Studies and overrides that are given as Python's data, as plain data and texts."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechdesign.ground.errors import StudyError
from mechdesign.study.text.document import in_yaml

if TYPE_CHECKING:
    pass


def override_texts(overrides: Sequence[str] | Mapping[str, Any]) -> tuple[str, ...]:
    """Overrides as ``a.b.c=value``; a value of a mapping is written in JSON, which YAML reads."""
    if isinstance(overrides, Mapping):
        return tuple(
            f"{name}={in_yaml(plain_data(value, f'the override {name!r}'))}" for name, value in overrides.items()
        )
    return (overrides,) if isinstance(overrides, str) else tuple(overrides)


def plain_data(value: Any, name: str) -> Any:
    """Data of mappings, lists, texts and numbers only."""

    def plainly(item: Any) -> Any:
        if isinstance(item, Mapping):
            return dict(item)
        if hasattr(item, "tolist"):
            return item.tolist()
        if isinstance(item, os.PathLike):
            return os.fspath(item)
        raise TypeError(f"it holds {type(item).__name__!r}")

    try:
        return json.loads(json.dumps(value, default=plainly))
    except (TypeError, ValueError, RecursionError) as error:
        raise StudyError(
            f"{name} is not plain data (mappings, lists, texts, numbers; an array becomes a list by .tolist()): {error}"
        ) from None
