"""Local indices of the workspace by name: each is declared by a file of its own, and listed nowhere else."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

FOLDER = "mechdesign.analyses.workspace.indices"
# Those that are evaluated where a study names none.
USUAL = ("inverse_condition", "resistivity", "manipulability", "sigma_min", "sigma_max")


def index_names() -> tuple[str, ...]:
    """Names of all indices, the usual ones first; nothing is imported for them."""
    files = sorted(module.name for module in iter_modules(import_module(FOLDER).__path__))
    return tuple(dict.fromkeys((*USUAL, *files)))


def index(name: str) -> Any:
    """The `mechdesign.analyses.workspace.index.Index` of a name."""
    return import_module(f"{FOLDER}.{name}").INDEX


def needed_section(name: str) -> str:
    """The section of the study that an index needs beside the workspace; empty where none, or no index has the name."""
    return str(index(name).section) if name in index_names() else ""
