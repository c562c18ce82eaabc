"""Sobol' indices: the share of the variance that each source has alone, and with all others together.

Two sets of points A, B and, for each source, A with that source's variables from B:

    first_i = E[f(B) (f(AB_i) - f(A))] / V      [Saltelli et al., Variance based sensitivity analysis, 2010, tab. 2b]
    total_i = E[(f(A) - f(AB_i))^2] / (2 V)     [Jansen, Analysis of variance designs for model output, 1999]

Of a linear model both are known. It stands beside the other as a control variate: what is sampled is how far that
departs from it. Independent replicates give Student's intervals of the ratios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mechdesign.analyses.reliability.engine.problem import CONFIDENCE, POINTS_TOGETHER
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.simulation import Setting, errors_of, generator
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import Task
from mechdesign.cautions import Caution
from mechdesign.numerics.arrays import Floats
from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.reliability import ReliabilitySection
from mechdesign.work.chunks import map_chunks

# Least number of replicates, and the most points of one.
_REPLICATES = 16
_REPLICATE_POINTS = 4_000
# Mechanisms solved a pose, and poses, where the study does not say how many points.
_POSE_MECHANISMS = 8_000
_POSES = 4
# Stream of random numbers, besides those of the methods.
_STREAM = 3


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Indices at one pose, shape (3, channels, sources): value, lower and upper end of its interval at 99.7 %.

    nan of a source without indices of its own and where nothing varies. Of the `samples` evaluated those are left out
    as `invalid` where a mechanism cannot be assembled.
    """

    first: Floats
    total: Floats
    samples: int
    invalid: int


@dataclass(frozen=True, eq=False)
class Replicate:
    """Sums over the points of one replicate, the model's first, the linear model's second.

    Parameters
    ----------
    products : ndarray, shape (3, 2, channels, sources)
        Of f(B) (f(AB_i) - f(A)), f(AB_i) - f(A) and (f(A) - f(AB_i))^2.
    sums, squares : ndarray, shape (2, channels)
        Of f and its square, over A and B.
    kept, points : int
        Points of A that enter, and all.
    """

    products: Floats
    sums: Floats
    squares: Floats
    kept: int
    points: int


def sample(
    model: Callable[[Floats], Floats], rows: Sequence[Sequence[int]], dimension: int, count: int,
    rng: np.random.Generator,
) -> Replicate:  # fmt: skip
    """One replicate of `count` points.

    Parameters
    ----------
    model : callable
        From standard normal variables, shape (dimension, n), to the values of the model and of the linear model (zero
        without one), shape (2, channels, n); nan where there is none.
    rows : sequence of sequences of int
        The variables of each source; one without has no indices.
    """
    asked = [k for k, own in enumerate(rows) if len(own)]
    points = np.empty((dimension, 2 + len(asked), count))
    points[:, :2] = rng.standard_normal((2, dimension, count)).swapaxes(0, 1)
    points[:, 2:] = points[:, :1]
    for place, k in enumerate(asked):
        own = list(rows[k])
        points[own, 2 + place] = points[own, 1]
    flat = points.reshape(dimension, -1)
    parts = [model(flat[:, begin : begin + POINTS_TOGETHER]) for begin in range(0, flat.shape[1], POINTS_TOGETHER)]
    found = np.concatenate(parts, axis=-1).reshape(*parts[0].shape[:2], 2 + len(asked), count)
    keep = np.isfinite(found).all(axis=(0, 1, 2))
    found = found[..., keep]
    of_a, of_b, change = found[:, :, 0], found[:, :, 1], found[:, :, 2:] - found[:, :, :1]
    products = np.full((3, *found.shape[:2], len(rows)), np.nan)
    products[..., asked] = [values.sum(axis=-1) for values in (of_b[:, :, None] * change, change, change * change)]
    sums, squares = of_a.sum(axis=-1) + of_b.sum(axis=-1), (of_a * of_a + of_b * of_b).sum(axis=-1)
    return Replicate(products, sums, squares, int(keep.sum()), count)


def combine(replicates: Sequence[Replicate], linear: tuple[Floats, Floats] | None = None) -> SobolIndices:
    """Indices and their intervals from independent replicates.

    `linear` are variances of the linear model: of each source, shape (channels, sources), and of all together.
    """
    points = sum(each.points for each in replicates)
    full = [each for each in replicates if each.kept]
    kept = sum(each.kept for each in full)
    if len(full) < 2:
        nowhere = np.full((3, *replicates[0].products.shape[2:]), np.nan)
        return SobolIndices(nowhere, nowhere, points, points - kept)
    # About the common mean, or a large mean would drown the products.
    centre = sum((each.sums for each in full), np.zeros_like(full[0].sums)) / (2 * kept)
    first = np.stack([(each.products[0] - centre[..., None] * each.products[1]) / each.kept for each in full])
    total = np.stack([0.5 * each.products[2] / each.kept for each in full])
    whole = np.stack([each.squares / (2 * each.kept) - centre * (each.sums / each.kept - centre) for each in full])
    # The linear model's variances are those over all points; without those that cannot be assembled they are others.
    if linear is not None and kept == points:
        first, total = (part[:, 0] - part[:, 1] + linear[0] for part in (first, total))
        whole = whole[:, 0] - whole[:, 1] + linear[1]
    else:
        first, total, whole = first[:, 0], total[:, 0], whole[:, 0]
    return SobolIndices(_ratio(first, whole[..., None]), _ratio(total, whole[..., None]), points, points - kept)


def _ratio(parts: Floats, whole: Floats) -> Floats:
    """Ratio of means over replicates and its interval: value, low, high; what is below 0 or above 1 is moved there."""
    # SciPy takes a quarter of a second to import, and reading a study does not need it.
    from mechdesign.numerics.statistics import student

    count, mean = len(parts), whole.mean(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.where(mean > 0, parts.mean(axis=0) / mean, np.nan)
        spread = np.std((parts - value * whole) / mean, axis=0, ddof=1) / np.sqrt(count)
    half = student(count - 1, CONFIDENCE) * spread
    return np.asarray(np.clip(np.stack([value, value - half, value + half]), 0.0, 1.0))


def indices(task: Task, section: ReliabilitySection) -> dict[int, SobolIndices]:
    """Indices by pose: of all poses where the study says of how many points, else of the first listed ones."""
    settings, count = task.settings, section.sobol
    if count is None:
        sampled = any(METHODS[method].sampled for method in section.methods)
        settings = settings[:_POSES] if task.poses.listed and sampled else ()
    if not settings or count == 0:
        return {}
    sources, linear = task.sources, task.linear
    alone, owners = uncorrelated(sources), np.array(sources.owners)
    rows = [np.flatnonzero(owners == s.name).tolist() if s.name in alone else [] for s in sources.all]
    points = _POSE_MECHANISMS // (sum(map(bool, rows)) + 2) if count is None else count
    replicates = max(_REPLICATES, -(-points // _REPLICATE_POINTS))
    each = max(2, points // replicates)
    task.progress.start(len(settings) * replicates, "replicates")
    work = partial(_replicate, settings, sources, linear, rows, task.seed, each)
    found: dict[int, list[Replicate]] = {setting.pose: [] for setting in settings}
    items = [(place, replicate) for place in range(len(settings)) for replicate in range(replicates)]
    for (place, _), part in zip(items, map_chunks(work, items, task.jobs, travels=True), strict=True):
        found[settings[place].pose].append(part)
        task.progress.update(1)
    return {pose: combine(parts, _variances(linear, pose)) for pose, parts in found.items()}


def _replicate(
    settings: Sequence[Setting], sources: Sources, linear: FirstOrder, rows: Sequence[Sequence[int]], seed: int,
    points: int, item: tuple[int, int],
) -> Replicate:  # fmt: skip
    place, replicate = item
    rng = generator(seed, settings[place].pose, _STREAM, replicate)
    return sample(_both_models(settings[place], sources, linear), rows, len(sources.owners), points, rng)


def uncorrelated(sources: Sources) -> set[str]:
    """Sources that vary by themselves; only they have indices of their own."""
    if sources.correlation is None:
        return set(sources.owners)
    lonely = np.count_nonzero(sources.correlation.coefficients, axis=0) == 1
    return {s.name for s, own in zip(sources.scalars, lonely, strict=True) if own} | {p.name for p in sources.pins}


def doubts(task: Task, found: Mapping[int, SobolIndices]) -> list[Caution]:
    """Which sources have no indices, and where made mechanisms are left out of them."""
    if not found:
        return []
    notes = []
    alone = uncorrelated(task.sources)
    bound = [s.name for s in task.sources.scalars if s.name not in alone]
    if bound:
        words = f"Sobol' indices are of what varies by itself: {', '.join(bound)} are correlated and have none"
        notes.append(Caution("incomplete", words, "contributions"))
    pose, worst = max(found.items(), key=lambda item: item[1].invalid)
    if worst.invalid:
        notes.append(Caution(
            "unassembled",
            f"Sobol' indices: {worst.invalid} of {worst.samples} points are left out at {task.where(pose)}, since a "
            "mechanism there cannot be assembled",
            "contributions", pose=task.where(pose),
        ))  # fmt: skip
    return notes


def _both_models(setting: Setting, sources: Sources, linear: FirstOrder) -> Callable[[Floats], Floats]:
    slopes = linear.components[:, :, setting.pose]
    if not np.isfinite(slopes).all():
        slopes = np.zeros_like(slopes)

    def model(u: Floats) -> Floats:
        drawn = sources.at(u)
        errors, valid = errors_of(setting, sources.made(drawn), u.shape[1])
        return np.stack([np.where(valid, errors, np.nan), slopes @ sources.components(drawn)])

    return model


def _variances(linear: FirstOrder, pose: int) -> tuple[Floats, Floats] | None:
    """Variances of the linear model with the pins as they are sampled: of each source, and of all together."""
    pins = tuple(replace(pin, analytic=pin.sampled) for pin in linear.sources.pins)
    model = replace(linear.take([pose]), sources=replace(linear.sources, pins=pins))
    whole = model.deviation()[:, 0] ** 2
    own = np.nan_to_num(model.share()[:, :, 0]) * whole[:, None]
    return (own, whole) if np.isfinite(whole).all() else None
