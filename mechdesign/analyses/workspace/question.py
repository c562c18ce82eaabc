"""The question of the workspace section, made ready: the field, the scan, the rule; and its answer for any designs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechdesign.analyses.poses import radians
from mechdesign.analyses.region.field import Places
from mechdesign.analyses.region.panels import Panels, find_panels
from mechdesign.analyses.region.pieces import Pieces
from mechdesign.analyses.region.rays import SAME_ROOT, Designs, Effort, Intervals
from mechdesign.analyses.region.regions import Region, problem, regions
from mechdesign.analyses.workspace.index import Prepared, prepare
from mechdesign.analyses.workspace.peaks import Peaks, find_peaks
from mechdesign.analyses.workspace.quadrature import integrate, simple_means
from mechdesign.analyses.workspace.ranged import Every, Ranged, Some, SomeDesigns
from mechdesign.analyses.workspace.strips import Integrand
from mechdesign.errors import Problem, StudyError
from mechdesign.indices import INDEX_NAMES, REGIONAL, STATISTICS, USUAL, needed_section
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.numerics.roots import dips
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over
from mechdesign.study.text.fields import parts_of
from mechdesign.study.text.units import Amount
from mechdesign.work.threads import keep_freed_memory

# The area that the rules of comparison divide is integrated to this relative tolerance.
AREA_TOLERANCE = 1e-6
# Relative tolerance of the integrals where the study says none: of one region, and of each design of many.
TOLERANCE, GRID_TOLERANCE = 1e-5, 1e-4
# Relative accuracy of the smallest and largest values of an index.
PEAK_TOLERANCE = 1e-5
COLUMNS = tuple(REGIONAL)
MEANS = {"GII": "inverse_condition", "GRI": "resistivity"}
# What is answered of a region over a range.
OF_RANGE = ("SUI", "area", "box_area")
# Rays through the ends of panels may meet an interval that rounding has closed (a cusp): it still bounds the region.
SLACK = 1e-9
# Rays beside the ends of panels, as parts of half a panel.
BESIDE = np.array([0.0, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
# Between rays a curve goes no farther than by this part of its fall to the next. The place of a tip is known to this
# part of the way there from the last ray that meets it; beyond that ray the distance falls so much more than before it,
# at so small a part of the angle that is left.
RISE, TIP, SHARP, TOWARDS = 0.5, 2.0, 4.0, 0.5
FLAT = 0.1 * SAME_ROOT
# Directions in which the rectangle around a region is measured: right, left, up, down.
SIDES = np.array([1, -1, -1j, 1j])
EVERY: Any = slice(None)


@dataclass(frozen=True, eq=False)
class Question(Region):
    """What the workspace section asks of a region.

    Parameters
    ----------
    counted : (float, float)
        Range of angle that the means are taken over (radians).
    indices : tuple of Prepared
        Local indices: those that the study asks for, and what `wanted` needs.
    wanted : tuple of str
        Columns of the answer.
    rays_through : type of Designs
        How rays meet the region of the field.
    """

    counted: tuple[float, float]
    rule: str
    tolerance: float
    nodes: int | None
    indices: tuple[Prepared, ...]
    wanted: tuple[str, ...]
    rays_through: type[Designs] = Designs


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


def columns(names: Iterable[str]) -> tuple[str, ...]:
    """Columns of a workspace with these local indices."""
    return (*COLUMNS, *(f"{name}_{kind}" for name in names for kind in STATISTICS))


def split(column: str) -> tuple[str, str]:
    """Local index and statistic of a column, ``("", "")`` of the area and its like."""
    if column in MEANS:
        return MEANS[column], "mean"
    name, _, kind = column.rpartition("_")
    return (name, kind) if kind in STATISTICS and name in INDEX_NAMES else ("", "")


def shared(study: Study, asked: Sequence[Question], moved: Collection[str]) -> bool:
    """Whether designs that differ in these parameters share the questions, but for what their fields take as arrays."""
    field = asked[0].field
    of_field = ("workspace.characteristic_length", *(() if field.plan.iterative else ("workspace.at.",)))
    numbers = [part for key, part in parts_of(study.workspace, "workspace") if not key.startswith(of_field)]
    followed = {name for part in numbers if isinstance(part, Amount) and part.expression
                for name in part.expression.names}  # fmt: skip
    return not isinstance(field, Ranged) and followed.union(study.fixed).isdisjoint(moved)


def batched(column: str) -> bool:
    """Whether a column is evaluated for many designs at once: the area and its like, and what the Jacobian gives."""
    name = split(column)[0]
    return column in COLUMNS or bool(name and needed_section(name) is None)


def questions(study: Study, tolerance: float = TOLERANCE, wanted: Sequence[str] | None = None) -> list[Question]:
    """One question a value of ``at``; over a range of one of them one for all its values.

    Parameters
    ----------
    tolerance : float
        Of the integrals where the study says none.
    wanted : sequence of str, optional
        Columns of the answer; left out, all of those indices that the study asks for.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed.
    """
    section = study.workspace
    over = {} if section is None else {name: values for name, values in section.at.items() if isinstance(values, Over)}
    for name, values in over.items():
        return list(_over_range(study, name, values, tolerance, columns(()) if wanted is None else wanted))
    found = regions(study)
    assert section is not None
    (start, stop), margin = found[0].scan, section.margin * study.units.angle_factor
    if stop - start <= 2 * margin:
        raise problem(study, "margin", "the margin leaves nothing of the scan; give a smaller one")
    integrate_by = section.integrate
    if "tolerance" in integrate_by.model_fields_set:
        tolerance = integrate_by.tolerance
    wanted = columns(USUAL if section.indices is None else section.indices) if wanted is None else tuple(wanted)
    indices = prepare(study, list(dict.fromkeys(filter(None, (split(column)[0] for column in wanted)))))
    counted = (start + margin, stop - margin)
    return [
        Question(**vars(region), counted=counted, rule=integrate_by.rule, tolerance=tolerance,
                 nodes=integrate_by.nodes, indices=indices, wanted=wanted)
        for region in found
    ]  # fmt: skip


def _over_range(
    study: Study, name: str, over: Over, tolerance: float, wanted: Sequence[str]
) -> Iterator[Question]:  # fmt: skip
    """One question a value of the other held coordinates."""
    assert study.workspace is not None
    for column in wanted:
        if column not in OF_RANGE:
            known = f"over a range of {name} there are {', '.join(OF_RANGE)} only"
            raise problem(study, "at", f"{column} has no value: {known}; ask for single values: at: {{{name}: [...]}}")
    # Only the area is asked, in which angles and lengths do not mix.
    update = {"at": {**study.workspace.at, name: (over.from_,)}, "indices": (),
              "characteristic_length": study.workspace.characteristic_length or 1.0}  # fmt: skip
    coordinate = study.mechanism.coordinate(name)
    low, high = (float(np.asarray(radians(study, coordinate, np.asarray(v)))) for v in (over.from_, over.to))
    single = replace(study, workspace=study.workspace.model_copy(update=update))
    for question in questions(single, tolerance, wanted):
        base = question.field
        if base.plan.iterative:
            message = (
                f"over a range of {name} the inverse problem must have a closed form, which it has not here; "
                f"ask for single values: at: {{{name}: [...]}}"
            )
            raise StudyError((Problem(message, f"workspace.at.{name}", str(study.path or "")),))
        common = base.mechanism, base.plan, base.held, base.same_assembly, base.length
        field = (Every if over.all else Some)(*common, list(study.workspace.at).index(name), low, high)
        held = {k: v for k, v in question.held.items() if k != name}
        yield replace(question, field=field, held=held, rays_through=Designs if over.all else SomeDesigns)


def answer(question: Question, places: Places, count: int, effort: Effort) -> Evaluation:
    """Indices of `count` designs, whose changed places are arrays of shape (count,).

    Raises
    ------
    AssemblyError
        If a region has no end.
    """
    keep_freed_memory()
    designs = question.rays_through(question.field, places, count, question.about, question.scan, effort)
    cuts = tuple(sorted(set(question.counted) - set(question.scan)))
    panels = find_panels(designs, cuts)
    pieces = None
    if count == 1 or question.field.same_assembly:
        pieces = Pieces.of(panels)
        if question.field.same_assembly:
            panels = pieces.only(0)
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
    for column in question.wanted:
        name, kind = split(column)
        if name:
            found[column] = _statistic(name, kind, question, integrands, means, doubts, peaks)
    values, errors = ({name: found[name][k] for name in question.wanted} for k in (0, 1))
    return Evaluation(values, errors, panels, pieces)


def areas_of_pieces(question: Question, given: Evaluation) -> list[float]:
    """Area of each piece of a single design's region."""
    assert given.pieces is not None
    if given.pieces.number[0] == 1 and "area" in given.values:
        return [float(given.values["area"][0])]
    none, whole = np.zeros((0, 1), dtype=bool), float(given.values["area"][0])
    return [
        float(integrate(part, question.tolerance, question.scan, (), none, whole).area[0])
        for part in given.pieces.all()
    ]


def _integrands(question: Question) -> tuple[Integrand, ...]:
    """What the wanted means and standard deviations need: the indices, and their squares."""
    asked = {split(column) for column in question.wanted}
    return tuple(
        Integrand(index, power)
        for power, kinds in ((1, ("mean", "std")), (2, ("std",)))
        for index in question.indices
        if any((index.name, kind) in asked for kind in kinds)
    )


def _peaks(question: Question, panels: Panels) -> Peaks | None:
    """Extremes, where they are wanted or an integral may be infinite."""
    asked = {split(column) for column in question.wanted}
    wanted = np.array([[(index.name, kind) in asked for index in question.indices] for kind in ("min", "max")])
    squares = any(kind == "std" for _, kind in asked)
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


def bounding_box(panels: Panels, boundary: tuple[Ints, Floats, Intervals]) -> tuple[Floats, Floats]:
    """Areas of the rectangles and their errors, shape (designs,) [S1, eq. 26]; 0 where the region is empty.

    The farthest place in a direction is a corner or cusp at the end of a panel, where rays are traced at several
    angles beside the end, or lies on a smooth curve, where parabolas through boundary points lead to it. A cusp may be
    too thin to be met at its tip, which is then at the end of the line through the places met beside it.
    """
    count, (design, theta, met) = len(panels.closes), boundary
    width = 0.5 * (panels.high - panels.low)
    ends = np.stack([panels.low + width * BESIDE[:, None], panels.high - width * BESIDE[:, None]], axis=1)
    owner = np.broadcast_to(panels.design, ends.shape).ravel()
    traced = panels.trace(owner, ends.ravel(), SLACK)
    beside = _farthest(panels.designs, ends.ravel(), traced)
    some = np.flatnonzero(met.counts)
    within = _farthest(panels.designs, theta, met)[:, some]
    design, theta = np.concatenate([owner, design[some]]), np.concatenate([ends.ravel(), theta[some]])
    away, at_end = np.concatenate([beside, within], axis=1), np.arange(len(design)) < 2 * len(width)
    order = np.lexsort((theta, design))
    # Neighbouring panels end at one ray.
    order = order[np.append(True, (np.diff(design[order]) > 0) | (np.diff(theta[order]) > 0))]
    design, theta, away, at_end = design[order], theta[order], away[:, order], at_end[order]
    best = np.full((2, len(SIDES), count), -np.inf)
    np.maximum.at(best, (EVERY, EVERY, design), away)
    same = (design[2:] == design[:-2]) & ~at_end[1:-1]
    before, here, after = away[:, :-2], away[:, 1:-1], away[:, 2:]
    with np.errstate(invalid="ignore"):
        fall = np.maximum(*(np.where(np.isfinite(other), here - other, 0.0) for other in (before, after)))
        top = same & (here >= before) & (here >= after) & (here + RISE * fall >= best[0][:, design[1:-1]])
    # Where a curve cannot rise by more than two ends of an interval that are one, there is nothing to climb.
    top &= RISE * fall > FLAT * panels.reach[design[1:-1]]
    side, middle = np.nonzero(top)
    if len(side):
        near = middle + np.arange(3)[:, None]
        lane = design[near[1]]
        np.maximum.at(best, (EVERY, side, lane), _climb(panels, side, lane, theta[near], away[side, near]))
    # A tip that was not climbed to may lie as far as the lines through rays on either side of it say.
    beside, step = beside.reshape(len(SIDES), len(BESIDE), -1), np.diff(BESIDE)[:, None]
    here = beside[:, 1:-1]
    with np.errstate(invalid="ignore"):
        nearer, farther = here - beside[:, :-2], here - beside[:, 2:]
        more = np.minimum(nearer * step[1:] / step[:-1], farther * step[:-1] / step[1:])
        more = np.where((more > 0) & np.isfinite(more), more, 0.0)
    np.maximum.at(best[1], (EVERY, owner[: 2 * len(width)]), (here + more).max(axis=1))
    size = (best[:, 0] + best[:, 1]) * (best[:, 2] + best[:, 3])
    area, most = np.where(np.isfinite(size), size, 0.0)
    return area, most - area + SAME_ROOT * area


def _farthest(designs: Designs, theta: Floats, traced: Intervals) -> Floats:
    """How far rays reach in each direction of the rectangle, shape (directions, rays); -inf where they meet nothing."""
    places = designs.about + traced.by_ray(traced.inner, traced.outer) * np.exp(1j * theta)
    away = (places * SIDES[:, None, None, None]).real
    return np.asarray(np.fmax.reduce(away, axis=(1, 2), initial=-np.inf))


def _climb(panels: Panels, side: Ints, design: Ints, theta: Floats, away: Floats) -> Floats:
    """Largest distances in some directions, between the outer two of three rays each, shape (3, n), and their bounds.

    Of shape (2, n). Where rays nearer to the end of a panel meet less there is a tip: the line through rays beyond
    tells its place.
    """

    def depth(lane: Ints, angle: Floats) -> Floats:
        found = _farthest(panels.designs, angle, panels.trace(design[lane], angle, SLACK))
        return np.asarray(-found[side[lane], np.arange(len(lane))])

    every = np.arange(len(side))
    place, low = dips(depth, theta, -away, np.full(len(side), -np.inf))
    ends = np.sort(np.concatenate([panels.design + 1j * panels.low, panels.design + 1j * panels.high]))
    after = np.clip(np.searchsorted(ends, design + 1j * place), 1, len(ends) - 1)
    gaps = np.stack([ends[after - 1].imag, ends[after].imag]) - place
    gap = np.take_along_axis(gaps, np.abs(gaps).argmin(axis=0)[None], axis=0)[0]
    nearer, beside, farther = (-depth(every, place + part * gap) for part in (TOWARDS, -TOWARDS, -1.0))
    with np.errstate(invalid="ignore"):
        tip = (-low - nearer > SHARP * np.abs(-low - beside)) & np.isfinite(farther)
        tip &= np.abs(gap) < theta[2] - theta[0]
        more = np.where(tip, np.maximum(-low - farther, 0.0), 0.0)
    return np.stack([-low + more, -low + (1 + TIP) * more])
