"""The answer for the regions of any number of designs: the wanted columns, each with an estimated error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.errors import AssemblyError, MechanismError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.work.threads import keep_freed_memory
from mechdesign.questions.workspace.box import bounding_box
from mechdesign.questions.workspace.inscribed import INSCRIBED, inscribed
from mechdesign.questions.workspace.peaks import find_peaks
from mechdesign.questions.workspace.quadrature import integrate, simple_means
from mechdesign.questions.workspace.question import Question
from mechdesign.questions.workspace.strips import Integrand
from mechdesign.region.any_mode import in_any_assembly
from mechdesign.region.field import Places
from mechdesign.region.panels import Panels
from mechdesign.region.pieces import Pieces, counted
from mechdesign.region.rays import BATCH, Effort

# The area that the rules of comparison divide is integrated to this relative tolerance.
AREA_TOLERANCE = 1e-6
# Relative accuracy of the area that lies in the other assembly.
LOOSE = 1e-3
# Relative accuracy of the smallest and largest values of an index.
PEAK_TOLERANCE = 1e-5


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The wanted columns for each design, their estimated errors (0 where the rule has none), and the counted panels.

    Of all pieces of the regions the first of each design is counted, or all are in any assembly; there are none for
    several designs whose pieces all count.
    """

    values: dict[str, Floats]
    errors: dict[str, Floats]
    panels: Panels
    pieces: Pieces | None


def answer(question: Question, places: Places, count: int, effort: Effort) -> Evaluation:
    """Indices of `count` designs, whose changed places are arrays of shape (count,).

    Raises
    ------
    AssemblyError
        If a region has no end.
    """
    keep_freed_memory()
    designs = question.designs(places, count, effort)
    panels, pieces = counted(designs, tuple(sorted(set(question.counted) - set(question.scan))))
    if not panels.closes.any():
        nothing = {name: np.full(count, 0.0 if name in ("area", "box_area") else np.nan) for name in question.columns}
        errors = {
            name: np.maximum(panels.raster_area, panels.undecided) * (name == "area") for name in question.columns
        }
        return Evaluation(nothing, errors, panels, pieces)
    gauss = question.rule == "gauss"
    tolerance = question.tolerance if gauss else AREA_TOLERANCE
    integrands = question.integrands
    squares = any(integrand.power == 2 for integrand in integrands)
    peaks = find_peaks(panels, question.indices, PEAK_TOLERANCE, question.extremes, squares=squares)
    endless = peaks.endless(integrands)
    means, doubts = np.full(endless.shape, np.inf), np.zeros(endless.shape)
    means[:, ~panels.closes] = np.nan
    # What is infinite for every design need not be looked at.
    some = np.flatnonzero(~endless[:, panels.closes].all(axis=1))
    finite = [integrands[k] for k in some]
    of_means = slice(None if gauss else 0)
    integral = integrate(panels, tolerance, question.counted, finite[of_means], endless[some[of_means]])
    if gauss:
        means[some], doubts[some] = integral.mean, integral.mean_error
    else:
        means[some] = simple_means(panels, finite, question.rule, question.nodes, question.rays, question.counted)
    # Where all pieces count, the raster tells if one is missing.
    every = pieces is None or not question.field.same_assembly or pieces.number <= 1
    missing = np.where(every, panels.raster_area - integral.area, 0.0)
    results = {"area": (integral.area, np.maximum(integral.area_error + panels.undecided, missing))}
    if {"SUI", "box_area"} & set(question.columns):
        box, doubt = bounding_box(panels, integral.boundary)
        share = integral.area / box
        results |= {
            "box_area": (box, doubt),
            "SUI": (share, (results["area"][1] + share * doubt) / np.maximum(box - doubt, 0.0)),
        }
    shapes = inscribed(panels, [name for name in question.columns if name in INSCRIBED])
    results |= {name: (size, np.zeros(count)) for name, size in shapes.items()}
    for column, (name, kind) in question.statistics.items():
        if kind in ("min", "max"):
            results[column] = peaks.of(name, kind)
        else:
            results[column] = (_mean if kind == "mean" else _spread)(integrands, means, doubts, name)
    values, errors = ({name: results[name][k] for name in question.columns} for k in (0, 1))
    return Evaluation(values, errors, panels, pieces)


def area_in_any_assembly(question: Question) -> float:
    """Area of a region in any assembly; 0 where it has no end or too many modes, and where no assembly bounds it.

    It is looked for as loosely as of a design of many.
    """
    if not any(name.startswith("assembly ") for _, name in question.field.labels):
        return 0.0
    loose = replace(question, indices=(), columns=("area",), rule="gauss", tolerance=LOOSE)
    try:
        every = replace(loose, field=in_any_assembly(question.field))
        return float(answer(every, {}, 1, BATCH).values["area"][0])
    except (AssemblyError, MechanismError):
        return 0.0


def areas(question: Question, evaluation: Evaluation, parts: Sequence[Panels]) -> list[float]:
    """Area of each piece of a single design's region; `parts` are the panels of each."""
    whole = float(evaluation.values["area"][0])
    if len(parts) == 1:
        return [whole]
    none = np.zeros((0, 1), dtype=bool)
    return [float(integrate(part, question.tolerance, question.scan, (), none, whole).area[0]) for part in parts]


def _spread(
    integrands: Sequence[Integrand], means: Floats, doubts: Floats, name: str
) -> tuple[Floats, Floats]:  # fmt: skip
    """Standard deviation of an index over each region, and its error, by the means of the index and its square."""
    (mean, doubt), (square, square_doubt) = (_mean(integrands, means, doubts, name, power) for power in (1, 2))
    spread = np.where(np.isinf(square), np.inf, np.sqrt(np.maximum(square - mean * mean, 0.0)))
    total = square_doubt + 2 * np.abs(mean) * doubt
    # Of a deviation that is nothing but its error the square is in doubt, not the root's slope.
    error = np.where(np.isinf(spread), 0.0, np.minimum(total / (2 * spread), np.sqrt(total)))
    return spread, error


def _mean(
    integrands: Sequence[Integrand], means: Floats, doubts: Floats, name: str, power: int = 1
) -> tuple[Floats, Floats]:  # fmt: skip
    """Mean of a power of an index over each region, and its error."""
    row = [(integrand.index.name, integrand.power) for integrand in integrands].index((name, power))
    return means[row], doubts[row]
