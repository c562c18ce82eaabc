"""The table of a Pareto front."""

from __future__ import annotations

import numpy as np

from mechdesign.analyses.optimize.pareto import crowding, distinct, front, knee
from mechdesign.analyses.optimize.tables import Comparison, value_columns, variable_columns
from mechdesign.results import Column, Table


def pareto_table(compared: Comparison) -> tuple[Table, dict[str, int]]:
    """The front over all feasible designs that were evaluated, the best of the first goal first, and its knee's row."""
    designs = compared.designs
    feasible = np.flatnonzero(designs.feasible)
    values = np.stack([designs.values[each][feasible] * (1 if each.smallest else -1) for each in designs.goals], axis=1)
    on_front = front(values)
    on_front = on_front[np.lexsort(values[on_front].T[::-1])]
    on_front = on_front[distinct(values[on_front])]
    rows, values = feasible[on_front], values[on_front]
    marked = np.zeros(len(rows), dtype=bool)
    marked[knee(values)] = True
    columns = (
        *variable_columns(compared, rows),
        *value_columns(compared, rows),
        Column("CPI", compared.cpi[rows], "", "sum of the normalised indices"),
        Column("knee", marked, "", "1 at the design farthest from the plane through the extremes of the front"),
        Column("crowding", crowding(values), "", "gap between the neighbours on the front; inf at its ends"),
    )
    return Table("pareto", columns, "designs none of which is surpassed in every goal at once"), {
        "knee": int(rows[marked][0])
    }
