"""The table of results of designs that are given by arrays of values."""

from __future__ import annotations

from mechdesign.ground.columns import CHOSEN
from mechdesign.ground.results import TableKind

EVALUATED = TableKind.of("evaluated", "results of each design", ("<result>", CHOSEN, "as the result"),
    ("valid", "1 where the design can be built and every pose, sample or part of its motion counts"),
    ("reason", "why it is not valid"))  # fmt: skip
