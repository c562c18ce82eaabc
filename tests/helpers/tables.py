"""What the reference says of tables, against the manifests of runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from mechdesign.door.reference import tables
from mechdesign.ground.columns import PLACE, ColumnKind
from mechdesign.study.text.units import KINDS, Units


def unsaid(manifest: Mapping[str, Any]) -> list[str]:
    """Columns of a manifest that the reference lacks, or of which it says something else."""
    units = Units(**manifest["study"]["resolved"].get("units", {}))
    wrong = []
    for name, told in manifest["tables"].items():
        alike = [table for _, table in tables() if f"{table.name}.csv" == name and re.fullmatch(_pattern(table.meaning),
                                                                                       told["meaning"])]  # fmt: skip
        for column in told["columns"]:
            fit = [kind for table in alike for kind in table.kinds if _says(kind, column["name"], column["meaning"])]
            kinds = [kind.unit.split(" or ") if kind.unit else ["none"] for kind in fit]
            if not any(kind not in KINDS or column["unit"] == units.label(kind) for each in kinds for kind in each):
                wrong.append(f"{name}: {column}")
    return wrong


def named(kind: ColumnKind, name: str) -> re.Match[str] | None:
    """What the places are where a column of this name is of this kind; None where it is of another."""
    return next(filter(None, (re.fullmatch(_pattern(own), name) for own in kind.names)), None)


def _says(kind: ColumnKind, name: str, meaning: str) -> bool:
    """Whether a column of a manifest is of this kind, with this meaning."""
    found = named(kind, name)
    if found is None:
        return False
    told = PLACE.sub(lambda place: found.groupdict().get(_group(place[1]), place[0]), kind.meaning)
    return re.fullmatch(_pattern(told), meaning) is not None


def _group(name: str) -> str:
    return re.sub(r"\W", "_", name)


def _pattern(text: str) -> str:
    """The regular expression of a text with ``<places>``."""
    seen: set[str] = set()
    parts = PLACE.split(text)
    for k in range(1, len(parts), 2):
        group = _group(parts[k])
        parts[k] = f"(?P={group})" if group in seen else f"(?P<{group}>.+)"
        seen.add(group)
    return "".join(part if k % 2 else re.escape(part) for k, part in enumerate(parts))
