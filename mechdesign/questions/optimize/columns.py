"""Tables of an optimisation and their columns: names, meanings, units and formulas."""

from __future__ import annotations

from mechdesign.ground.columns import ColumnKind
from mechdesign.ground.results import KeyNumber, TableKind

VARIABLE = ColumnKind("<variable>", "design variable", "as the variable")
WORST_ROW = ColumnKind("<result>", "worst value of <result>", "as the result")
EXPRESSION = ColumnKind("<parameter>", "expression over parameters", "as the expression")
RESULT = ColumnKind("<result>", "<meaning of the result>", "as the result")
CPI = ColumnKind("CPI", "sum of the normalised indices", "", "sum of (value - worst)/(best - worst)")
SCORE = ColumnKind("score", "weighted sum of the normalised indices", "", "sum of w_k (value - worst)/(best - worst)")
OPTIMUM = TableKind.of("optimum", "the best design for each set of weights",
    ("what", "what the design is on the Pareto front"), ("w_<goal>", "weight of <goal>"), VARIABLE, WORST_ROW,
    EXPRESSION, RESULT, CPI, ("x of <shape>, y of <shape>", "where the centre of <shape> fits best", "length"), SCORE,
    ("<parameter>", "parameter that follows from the variables"),
    ("active", "bounds and conditions that the optimum lies at"))  # fmt: skip
DESIGNS = TableKind.of("designs", "every design that was evaluated",
    VARIABLE, WORST_ROW, EXPRESSION, RESULT, ("<result>_error", "estimated error of <result>", "as the result"), CPI,
    ("feasible", "1 where the design can be built and meets every requirement"),
    ("reason", "why it is not feasible"))  # fmt: skip
BOUNDS = TableKind.of("bounds", "extremes of each index over the feasible designs",
    ("index", "index"), ("min", "smallest value"), ("max", "largest value"),
    ("<variable>_at_min", "<variable> of the design with the smallest value", "as the variable"),
    ("<variable>_at_max", "<variable> of the design with the largest value", "as the variable"))  # fmt: skip
BEST = TableKind.of("best", "the best designs for each set of weights, none of them next to a better one",
    ("optimum", "row of optimum.csv whose weights are taken"), ("rank", "1 is the optimum"), VARIABLE, WORST_ROW,
    EXPRESSION, RESULT, CPI, SCORE)  # fmt: skip
SENSITIVITY = TableKind.of("sensitivity", "how the score changes a step from each optimum",
    ("optimum", "row of optimum.csv"), ("variable", "design variable that has a range; the others are held"),
    ("value", "at the optimum, in `unit`"), ("step", "the variable's own, else a hundredth of the range, in `unit`"),
    ("unit", "unit of the two columns before"),
    ("score_down", "change of the score one step down, nan where that leaves the bounds or is infeasible"),
    ("score_up", "change of the score one step up, nan where that leaves the bounds or is infeasible"))  # fmt: skip
PARETO = TableKind.of("pareto", "designs none of which is surpassed in every goal at once",
    VARIABLE, WORST_ROW, EXPRESSION, RESULT, CPI,
    ("knee", "1 at the design farthest from the plane through the front's ends"),
    ("crowding", "gap between the neighbours on the front; inf at its ends"))  # fmt: skip
HYPERVOLUME = TableKind.of("hypervolume", "how the front grew, and whether it still does",
    ("designs", "designs that were evaluated until then"), ("front", "how many of them no other surpassed"),
    ("hypervolume", "of their front, in boxes between the last front's best and worst values, up to a tenth beyond"),
    ("growth", "part of the hypervolume that the last tenth of these designs brought"))  # fmt: skip
NEAREST = TableKind.of("nearest", "conditions of the design that is nearest to a feasible one",
    ("condition", "what is asked, or why it cannot be built"), ("value", "what the design has, in `unit`"),
    ("bound", "what is asked for, in `unit`"),
    ("missing", "by how much the bound is missed, in `unit`; 0 where it is met"),
    ("unit", "unit of the three columns before"))  # fmt: skip
KEY_NUMBERS = (
    KeyNumber(OPTIMUM, "", "{name} of the best", "first"),
    KeyNumber(OPTIMUM, "<variable>", "best {name}", "first"),
)  # fmt: skip
# Studies that it writes, and copies of the files that they read.
STUDIES = "optimum.yaml optimum_*.yaml knee.yaml nearest.yaml *input_*"
