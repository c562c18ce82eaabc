"""Pictures of the cases of a matrix: what each entry does to each result, every two against another, and as maps."""

from __future__ import annotations

from mechdesign.experiments.figures.sweep.effects import main_effects, scatter
from mechdesign.experiments.figures.sweep.maps import response
from mechdesign.experiments.figures.sweep.quantities import Axis
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.requirements import DrawnCases
from mechdesign.results import Result
from mechdesign.study import Study


def figures(study: Study, result: Result) -> Gallery:
    """``main_effects`` and ``scatter``; of two numbers that vary or more ``response`` between them."""
    table, gallery, drawn = result.main, Gallery(), DrawnCases.of(result)
    entries = [Axis.of(table.column(name)) for name in drawn.entries]
    entries = [entry for entry in entries if len(entry.distinct) > 1]
    results = [Axis.of(table.column(name), *limits, varied=False) for name, limits in drawn.results.items()]
    if entries and results:
        gallery.add("main_effects", main_effects, entries, results, len(table))
        gallery.add("response", response, entries, results, table, drawn.goals)
        gallery.add("scatter", scatter, entries, results, table, required=bool(study.requirements))
    return gallery
