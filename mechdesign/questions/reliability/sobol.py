"""Sobol' indices: the share of the variance that each source has alone, and with all others together.

Two sets of points A, B and, for each source, A with that source's variables from B:

    first_i = E[f(B) (f(AB_i) - f(A))] / V      [Saltelli et al., Variance based sensitivity analysis, 2010, tab. 2b]
    total_i = E[(f(A) - f(AB_i))^2] / (2 V)     [Jansen, Analysis of variance designs for model output, 1999]

The indices of the linear model have a closed form. It is the control variate: only the difference between the exact
model and the linear one is sampled. Independent replicates give Student's intervals of the ratios.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.questions.reliability.engine.problem import CONFIDENCE, POINTS_TOGETHER
from mechdesign.questions.reliability.first_order import FirstOrder
from mechdesign.questions.reliability.schema.methods import METHODS
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.questions.reliability.simulation import Setting, errors_of, generator
from mechdesign.questions.reliability.sources import Sources
from mechdesign.questions.reliability.task import Task

# Least number of replicates.
_REPLICATES = 16
# Most points of a replicate; more points make more replicates.
_REPLICATE_POINTS = 4_000
# Mechanisms solved at each pose where the study gives no number of points.
_POSE_MECHANISMS = 8_000
# Number of listed poses that have indices where the study gives no number of points.
_POSES = 4
# Name of this module's stream of random numbers; the methods have streams 1 and 2.
_STREAM = 3


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Indices at one pose, shape (3, channels, sources): value, lower and upper end of its interval at 99.7 %.

    nan for a correlated source, which has no indices, and where nothing varies. `samples` counts all points, `invalid`
    those that are left out because a mechanism cannot be assembled.
    """

    first: Floats
    total: Floats
    samples: int
    invalid: int


@dataclass(frozen=True, eq=False)
class Replicate:
    """Sums over the points of one replicate; axis of length 2: the exact model, then the linear one.

    Parameters
    ----------
    products : ndarray, shape (3, 2, channels, sources)
        Sums of f(B) (f(AB_i) - f(A)), f(AB_i) - f(A) and (f(A) - f(AB_i))^2.
    sums, squares : ndarray, shape (2, channels)
        Sums of f and of its square over A and B.
    kept, points : int
        Points at which all mechanisms are assembled, and all points.
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
        From standard normal variables, shape (dimension, n), to the values of the exact and of the linear model (zero
        where there is no linear one), shape (2, channels, n); nan where a mechanism is not assembled.
    rows : sequence of sequences of int
        The variables of each source; empty for a source without indices.
    """
    independent = [k for k, variables in enumerate(rows) if len(variables)]
    points = np.empty((dimension, 2 + len(independent), count))
    points[:, :2] = rng.standard_normal((2, dimension, count)).swapaxes(0, 1)
    points[:, 2:] = points[:, :1]
    for place, k in enumerate(independent):
        variables = list(rows[k])
        points[variables, 2 + place] = points[variables, 1]
    flat = points.reshape(dimension, -1)
    parts = [model(flat[:, begin : begin + POINTS_TOGETHER]) for begin in range(0, flat.shape[1], POINTS_TOGETHER)]
    values = np.concatenate(parts, axis=-1).reshape(*parts[0].shape[:2], 2 + len(independent), count)
    keep = np.isfinite(values).all(axis=(0, 1, 2))
    values = values[..., keep]
    of_a, of_b, change = values[:, :, 0], values[:, :, 1], values[:, :, 2:] - values[:, :, :1]
    products = np.full((3, *values.shape[:2], len(rows)), np.nan)
    products[..., independent] = [terms.sum(axis=-1) for terms in (of_b[:, :, None] * change, change, change * change)]
    sums, squares = of_a.sum(axis=-1) + of_b.sum(axis=-1), (of_a * of_a + of_b * of_b).sum(axis=-1)
    return Replicate(products, sums, squares, int(keep.sum()), count)


def combine(replicates: Sequence[Replicate], linear: tuple[Floats, Floats] | None = None) -> SobolIndices:
    """Indices and their intervals from independent replicates.

    `linear` are the variances of the linear model by source, shape (channels, sources), and in all, shape (channels,).
    """
    points = sum(replicate.points for replicate in replicates)
    full = [replicate for replicate in replicates if replicate.kept]
    kept = sum(replicate.kept for replicate in full)
    if len(full) < 2:
        missing = np.full((3, *replicates[0].products.shape[2:]), np.nan)
        return SobolIndices(missing, missing, points, points - kept)
    # Products are taken about the common mean, as a large mean would cost them digits.
    centre = sum((part.sums for part in full), np.zeros_like(full[0].sums)) / (2 * kept)
    first = np.stack([(part.products[0] - centre[..., None] * part.products[1]) / part.kept for part in full])
    total = np.stack([0.5 * part.products[2] / part.kept for part in full])
    whole = np.stack([part.squares / (2 * part.kept) - centre * (part.sums / part.kept - centre) for part in full])
    # The linear model's variances are those of all points: they correct the sampled ones only where none is left out.
    if linear is not None and kept == points:
        first, total = (part[:, 0] - part[:, 1] + linear[0] for part in (first, total))
        whole = whole[:, 0] - whole[:, 1] + linear[1]
    else:
        first, total, whole = first[:, 0], total[:, 0], whole[:, 0]
    return SobolIndices(_ratio(first, whole[..., None]), _ratio(total, whole[..., None]), points, points - kept)


def _ratio(parts: Floats, whole: Floats) -> Floats:
    """Ratio of the means over replicates, and its interval (value, low, high), clipped to 0 and 1."""
    # SciPy takes a quarter of a second to import, and reading a study does not need it.
    from mechdesign.ground.numerics.statistics import student

    count, mean = len(parts), whole.mean(axis=0)
    value = np.where(mean > 0, parts.mean(axis=0) / mean, np.nan)
    spread = np.std((parts - value * whole) / mean, axis=0, ddof=1) / np.sqrt(count)
    half = student(count - 1, CONFIDENCE) * spread
    return np.asarray(np.clip(np.stack([value, value - half, value + half]), 0.0, 1.0))


def indices(task: Task, section: ReliabilitySection) -> dict[int, SobolIndices]:
    """Indices by pose: at all poses where the study gives the number of points, else at the first listed ones."""
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
    size = max(2, points // replicates)
    task.progress.start(len(settings) * replicates, "replicates")
    work = partial(_replicate, settings, sources, linear, rows, task.seed, size)
    parts: dict[int, list[Replicate]] = {setting.pose: [] for setting in settings}
    items = [(place, replicate) for place in range(len(settings)) for replicate in range(replicates)]
    for (place, _), part in zip(items, map_chunks(work, items, task.jobs, travels=True), strict=True):
        parts[settings[place].pose].append(part)
        task.progress.update(1)
    return {pose: combine(sums, _variances(linear, pose)) for pose, sums in parts.items()}


def _replicate(
    settings: Sequence[Setting], sources: Sources, linear: FirstOrder, rows: Sequence[Sequence[int]], seed: int,
    points: int, item: tuple[int, int],
) -> Replicate:  # fmt: skip
    setting, replicate = settings[item[0]], item[1]
    slopes = linear.components[:, :, setting.pose]
    if not np.isfinite(slopes).all():
        slopes = np.zeros_like(slopes)

    def both_models(u: Floats) -> Floats:
        drawn = sources.at(u)
        errors, valid = errors_of(setting, sources.made(drawn), u.shape[1])
        return np.stack([np.where(valid, errors, np.nan), slopes @ sources.components(drawn)])

    return sample(both_models, rows, len(sources.owners), points, generator(seed, setting.pose, _STREAM, replicate))


def uncorrelated(sources: Sources) -> set[str]:
    """Names of the sources that are correlated with no other; only they have indices."""
    if sources.correlation is None:
        return set(sources.owners)
    alone = np.count_nonzero(sources.correlation.coefficients, axis=0) == 1
    return {s.name for s, single in zip(sources.scalars, alone, strict=True) if single} | {p.name for p in sources.pins}


def doubts(task: Task, indices: Mapping[int, SobolIndices]) -> Iterator[Caution]:
    """Warnings of sources without indices, and of points that are left out."""
    if not indices:
        return
    alone = uncorrelated(task.sources)
    bound = [s.name for s in task.sources.scalars if s.name not in alone]
    if bound:
        words = f"Sobol' indices are of what varies by itself: {', '.join(bound)} are correlated and have none"
        yield Caution("incomplete", words, "contributions")
    pose, worst = max(indices.items(), key=lambda item: item[1].invalid)
    if worst.invalid:
        yield Caution(
            "unassembled",
            f"Sobol' indices: {worst.invalid} of {worst.samples} points are left out at {task.where(pose)}, since a "
            "mechanism there cannot be assembled",
            "contributions", pose=task.where(pose),
        )  # fmt: skip


def _variances(linear: FirstOrder, pose: int) -> tuple[Floats, Floats] | None:
    """Variances of the linear model by source and in all, with the laws of pins that are sampled; None if unknown."""
    pins = tuple(replace(pin, analytic=pin.sampled) for pin in linear.sources.pins)
    # The model beside which made mechanisms are sampled is linear, where a length about zero is not, too.
    plain = FirstOrder(linear.sources, linear.components, linear.offset).take([pose])
    model = replace(plain, sources=replace(linear.sources, pins=pins))
    whole = model.deviation()[:, 0] ** 2
    parts = np.nan_to_num(model.share()[:, :, 0]) * whole[:, None]
    return (parts, whole) if np.isfinite(whole).all() else None
