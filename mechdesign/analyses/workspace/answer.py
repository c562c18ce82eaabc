"""The answer for the regions of any number of designs: the wanted columns, each with an estimated error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.region.field import Places
from mechdesign.analyses.region.panels import Panels
from mechdesign.analyses.region.pieces import Pieces, counted
from mechdesign.analyses.region.rays import Effort
from mechdesign.analyses.workspace.box import bounding_box
from mechdesign.analyses.workspace.peaks import Peaks, find_peaks
from mechdesign.analyses.workspace.quadrature import integrate, simple_means
from mechdesign.analyses.workspace.question import Question
from mechdesign.analyses.workspace.strips import Integrand
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.work.threads import keep_freed_memory

# The area that the rules of comparison divide is integrated to this relative tolerance.
AREA_TOLERANCE = 1e-6
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
    designs = question.rays_through(question.field, places, count, question.about, question.scan, effort)
    panels, pieces = counted(designs, tuple(sorted(set(question.counted) - set(question.scan))))
    if not panels.closes.any():
        nothing = {name: np.full(count, 0.0 if name in ("area", "box_area") else np.nan) for name in question.wanted}
        errors = {name: np.maximum(panels.seen, panels.unseen) * (name == "area") for name in question.wanted}
        return Evaluation(nothing, errors, panels, pieces)
    gauss = question.rule == "gauss"
    tolerance = question.tolerance if gauss else AREA_TOLERANCE
    integrands, peaks = _integrands(question), _peaks(question, panels)
    endless = _endless(question, integrands, peaks, count)
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
    missing = np.where(every, panels.seen - integral.area, 0.0)
    found = {"area": (integral.area, np.maximum(integral.area_error + panels.unseen, missing))}
    if {"SUI", "box_area"} & set(question.wanted):
        box, doubt = bounding_box(panels, integral.boundary)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = integral.area / box
            found |= {
                "box_area": (box, doubt),
                "SUI": (share, (found["area"][1] + share * doubt) / np.maximum(box - doubt, 0.0)),
            }
    for column, (name, kind) in question.statistics.items():
        found[column] = _statistic(name, kind, question, integrands, means, doubts, peaks)
    values, errors = ({name: found[name][k] for name in question.wanted} for k in (0, 1))
    return Evaluation(values, errors, panels, pieces)


def _integrands(question: Question) -> tuple[Integrand, ...]:
    """What the wanted means and standard deviations need: the indices, and their squares."""
    return tuple(
        Integrand(index, power)
        for power, kinds in ((1, ("mean", "std")), (2, ("std",)))
        for index in question.indices
        if any(question.asks(index.name, kind) for kind in kinds)
    )


def _peaks(question: Question, panels: Panels) -> Peaks | None:
    """Extremes, where they are wanted or an integral may be infinite."""
    wanted = np.array([[question.asks(index.name, kind) for index in question.indices] for kind in ("min", "max")])
    squares = any(kind == "std" for _, kind in question.statistics.values())
    if not wanted.any() and not squares and all(index.index.crossing != np.inf for index in question.indices):
        return None
    return find_peaks(panels, question.indices, PEAK_TOLERANCE, wanted)


def _endless(question: Question, integrands: Sequence[Integrand], peaks: Peaks | None, count: int) -> Flags:
    """Integrals that are infinite: the integrand grows at least as 1/distance towards a curve."""
    if peaks is None:
        return np.zeros((len(integrands), count), dtype=bool)
    order = dict(zip((index.name for index in question.indices), peaks.order, strict=True))
    grows = [integrand.power * order[integrand.index.name] >= 1 for integrand in integrands]
    return np.array(grows, dtype=bool).reshape(-1, count)


def _statistic(
    name: str, kind: str, question: Question, integrands: Sequence[Integrand], means: Floats, doubts: Floats,
    peaks: Peaks | None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Values and errors of one statistic of one index."""
    if kind in ("min", "max"):
        assert peaks is not None
        at = (("min", "max").index(kind), [index.name for index in question.indices].index(name))
        return peaks.value[at], peaks.error[at]
    row = {(integrand.index.name, integrand.power): k for k, integrand in enumerate(integrands)}
    mean, doubt = means[row[name, 1]], doubts[row[name, 1]]
    if kind == "mean":
        return mean, doubt
    square, square_doubt = means[row[name, 2]], doubts[row[name, 2]]
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = np.where(np.isinf(square), np.inf, np.sqrt(np.maximum(square - mean * mean, 0.0)))
        total = square_doubt + 2 * np.abs(mean) * doubt
        # Of a deviation that is nothing but its error the square is in doubt, not the root's slope.
        error = np.where(np.isinf(spread), 0.0, np.minimum(total / (2 * spread), np.sqrt(total)))
    return spread, error
