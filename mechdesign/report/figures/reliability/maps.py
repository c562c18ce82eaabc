"""Failure and standard deviations as maps, over a workspace or a grid of two coordinates."""

from __future__ import annotations

from matplotlib.figure import Figure

from mechdesign.report.figures import style
from mechdesign.report.figures.planes import Plane, map_sheet
from mechdesign.report.figures.reliability.looks import LOOKS, best_moments, best_probability, channels, select
from mechdesign.results import Result
from mechdesign.study import Study

MOST_MAPS = 4


def map_figures(study: Study, result: Result, over: Plane) -> dict[str, Figure]:
    """Standard deviation of each output, and the failure probability where there are limits."""
    moments = result.tables["moments"]
    method = best_moments(moments)
    shown = [channel for channel in channels(moments) if channel[1] == "position"] or channels(moments)
    parts = []
    for output, order, unit in shown[:MOST_MAPS]:
        rows = select(moments, output=output, order=order, method=method)
        parts.append((style.axis_label(output, unit), moments["sigma"][rows].reshape(over.x.shape)))
    note = f"by {LOOKS[method].words}; the error is that of made mechanisms at this pose"
    found = {"deviation_map": map_sheet(study, over, parts, "Standard deviation of the error", note)}
    if "reliability" in result.tables:
        table = result.tables["reliability"]
        method = best_probability(table)
        rows = select(table, method=method, scope="pose")
        failure = table["failure"][rows].reshape(over.x.shape)
        found["failure_map"] = map_sheet(
            study, over, [("", failure)], "Probability that an error leaves its limits", f"by {LOOKS[method].words}",
            logarithmic=True,
        )  # fmt: skip
    return found
