"""What the reference says of tables, against the manifests of runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechdesign.reference import tables
from mechdesign.study.text.units import KINDS, Units


def unsaid(manifest: Mapping[str, Any]) -> list[str]:
    """Columns of a manifest that the reference lacks, or of which it says something else."""
    units = Units(**manifest["study"]["resolved"].get("units", {}))
    wrong = []
    for name, told in manifest["tables"].items():
        alike = [table for table in tables() if table.name == name and table.says(told["meaning"])]
        for column in told["columns"]:
            fit = [text for table in alike for text in table.columns
                   if text.says(column["name"], column["meaning"])]  # fmt: skip
            kinds = [text.unit.split(" or ") if text.unit else ["none"] for text in fit]
            if not any(kind not in KINDS or column["unit"] == units.label(kind) for each in kinds for kind in each):
                wrong.append(f"{name}: {column}")
    return wrong
