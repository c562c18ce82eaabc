"""Tables of a synthesis and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import KeyNumber, TableKind

# What is wrong with linkages that fulfil a task and do not move through it.
DEFECTS = {
    "branch": "a position needs another assembly", "circuit": "a dead centre lies between two",
    "order": "the drive cannot pass them in their order",
}  # fmt: skip
SOLUTIONS = TableKind.of("solutions", "linkages that do the task, best first",
    ("solution", "number in the name of its file, such as solution_1.yaml"), ("kind", "kind of linkage"),
    ("error", "distance from the task, of a function error of its output: root mean square over the positions",
     "as the task"),
    ("max_error", "largest such distance", "as the task"),
    ("defects", f"{'; '.join(f'{name}: {text}' for name, text in DEFECTS.items())}; empty where there is none"),
    ("class", "class of its four-bar or slider-crank by the links that turn fully"),
    ("full_turn", "1 where the drive turns fully"),
    ("transmission_angle", "smallest over a turn where the drive turns fully, else on the way through the "
     "task; 0 at a dead centre", "angle"),
    ("size", "greatest extent of pivots and pins along x or y at the positions", "length"),
    ("yield", "share of made linkages that miss the task by no more than the limit at every position, and can be "
     "assembled all round where the drawn one turns"),
    ("yield_low", "lower end of its interval"), ("yield_high", "upper end of its interval"),
    ("peak_effort", "greatest effort of the drive on its way through the task under the loads of `judge`", "moment"),
    ("score", "sum of the ranks' shares of their ranges, by their weights; 1 is the best"),
    ColumnKind("<dimension>", "dimension of the linkage by its name in its study", "as the dimension"))  # fmt: skip
CENTRE_POINTS = TableKind.of("centre_points", "links that pass four positions, along the curve of their pivots as far "
    "as limits.reach",
    ("curve", "number of the part of the curve, along which rows follow each other"),
    ("centre.x", "pivot in the frame", "length"), ("centre.y", "pivot in the frame", "length"),
    ("circle.x", "its pin in the body, which passes a circle about the pivot", "length"),
    ("circle.y", "its pin in the body", "length"), ("length", "of the link", "length"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(SOLUTIONS, "error", "error of the best", "first"),
    KeyNumber(SOLUTIONS, "transmission_angle", "its smallest transmission angle", "first"),
    KeyNumber(SOLUTIONS, "yield", "its yield", "first", bounds=("yield_low", "yield_high")),
    KeyNumber(SOLUTIONS, "peak_effort", "its peak effort", "first"),
)  # fmt: skip
# Columns that come first on a terminal.
FIRST = ("solution", "kind", "error", "transmission_angle", "yield", "yield_low", "yield_high", "peak_effort",
         "defects", "class", "size")  # fmt: skip
# Studies that it writes.
STUDIES = "solution_*.yaml nearest.yaml"
