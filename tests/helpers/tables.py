"""What the reference says of tables, against the manifests of runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdesign.reference import tables
from mechdesign.study.text.units import KINDS, Units

Said = tuple[str, str, str]
"""Names of a table and of a column as the reference has them, and the meaning of the table."""


def said(manifest: Mapping[str, Any]) -> tuple[set[Said], list[str]]:
    """What the reference has of the columns of a manifest; what it lacks or says otherwise."""
    units = Units(**manifest["study"]["resolved"].get("units", {}))
    found: set[Said] = set()
    wrong = []
    for name, told in manifest["tables"].items():
        alike = [table for table in tables() if table.name == name and table.says(told["meaning"])]
        for column in told["columns"]:
            fit = [(table, text) for table in alike for text in table.columns
                   if text.says(column["name"], column["meaning"])]  # fmt: skip
            found.update((table.name, table.meaning, text.name) for table, text in fit)
            kinds = [text.unit.split(" or ") if text.unit else ["none"] for _, text in fit]
            if not any(kind not in KINDS or column["unit"] == units.label(kind) for each in kinds for kind in each):
                wrong.append(f"{name}: {column}")
    return found, wrong
