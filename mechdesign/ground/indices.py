"""Local indices of the workspace by name: each is declared by a file of its own, and listed nowhere else."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, NamedTuple

FOLDER = "mechdesign.questions.workspace.indices"
# Those that are evaluated where a study names none.
USUAL = ("inverse_condition", "resistivity", "manipulability", "sigma_min", "sigma_max")


class Regional(NamedTuple):
    """A number of a whole workspace: its name in full, and where it comes from."""

    name: str
    meaning: str
    source: str = ""


# What every workspace has. Of the local indices follow their statistics, as ``sigma_min_mean``.
REGIONAL = {
    "GII": Regional("global isotropy index", "mean of the inverse condition number over the region", "S1, eq. 23"),
    "GRI": Regional("global resistivity index", "mean of 1/abs(det J) over the region", "S1, eq. 25"),
    "SUI": Regional("space utilization index", "area of the region over that of the rectangle around it", "S1, eq. 26"),
    "area": Regional("area", "area of the region"),
    "box_area": Regional("area of the box", "area of the rectangle around the region"),
}
STATISTICS = {"mean": "mean", "min": "infimum", "max": "supremum", "std": "standard deviation"}


class _Names(Mapping[str, Any]):
    """The folder's indices by name, the usual ones first; one is imported when it is asked for, none for its name."""

    def __getitem__(self, name: str) -> Any:
        return index(name)

    def __iter__(self) -> Iterator[str]:
        files = sorted(module.name for module in iter_modules(import_module(FOLDER).__path__))
        return iter(dict.fromkeys((*USUAL, *files)))

    def __contains__(self, name: object) -> bool:
        return name in USUAL or any(name == listed for listed in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


INDEX_NAMES = _Names()


def index(name: str) -> Any:
    """The `mechdesign.questions.workspace.index.Index` of a name."""
    return import_module(f"{FOLDER}.{name}").INDEX


def needed_section(name: str) -> str | None:
    """The section of the study that an index needs besides the workspace; None where none, or no index has the name."""
    return (index(name).section or None) if name in INDEX_NAMES else None
