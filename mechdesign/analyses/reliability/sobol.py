"""Sobol' indices: the share of the variance that each source has alone, and with all others together.

Two sets of points A, B and, for each source, A with that source's variables from B:

    first_i = E[f(B) (f(AB_i) - f(A))] / V      [Saltelli et al., Variance based sensitivity analysis, 2010, tab. 2b]
    total_i = E[(f(A) - f(AB_i))^2] / (2 V)     [Jansen, Analysis of variance designs for model output, 1999]

Of a linear model both are known. It stands beside the mechanism as a control variate: what is sampled is how far the
mechanism departs from it. Independent replicates give Student's intervals of the ratios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.reliability.engine.precision import CONFIDENCE
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.pins import PIN_LAWS
from mechdesign.analyses.reliability.sampling import CHUNK, generator
from mechdesign.analyses.reliability.simulation import Setting, errors_of
from mechdesign.analyses.reliability.sources import Drawn, Sources
from mechdesign.analyses.reliability.task import Task
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import map_chunks
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.study.schema.reliability import SAMPLING, ReliabilitySection

REPLICATES = 16
# Mechanisms solved a pose, and poses, where the study does not say how many points.
BUDGET = 8_000
POSES = 4
# Points of a replicate: beyond these there are more of them.
_MOST = 4_000
_STREAM = 3


@dataclass(frozen=True, eq=False)
class Indices:
    """Indices at one pose.

    Parameters
    ----------
    first, total : ndarray, shape (3, channels, sources)
        Value, and lower and upper end of its interval at 99.7 %; nan of a source without indices of its own and where
        nothing varies.
    samples, invalid : int
        Points evaluated, and those left out since a mechanism cannot be assembled.
    """

    first: Floats
    total: Floats
    samples: int
    invalid: int


@dataclass(frozen=True, eq=False)
class Control:
    """Variances of the linear model.

    Parameters
    ----------
    own : ndarray, shape (channels, sources)
        Of each source.
    whole : ndarray, shape (channels,)
        Of all together.
    """

    own: Floats
    whole: Floats


@dataclass(frozen=True, eq=False)
class Sampled:
    """Sums over the points of one replicate, the model's first, the linear model's second.

    Parameters
    ----------
    mixed, change, square : ndarray, shape (2, channels, sources)
        Of f(B) (f(AB_i) - f(A)), f(AB_i) - f(A) and (f(A) - f(AB_i))^2.
    sums, squares : ndarray, shape (2, channels)
        Of f and its square, over A and B.
    kept, points : int
        Points of A that enter, and all.
    """

    mixed: Floats
    change: Floats
    square: Floats
    sums: Floats
    squares: Floats
    kept: int
    points: int


def sample(
    model: Callable[[Floats], Floats], rows: Sequence[Sequence[int]], dimension: int, count: int,
    rng: np.random.Generator,
) -> Sampled:  # fmt: skip
    """One replicate of `count` points.

    Parameters
    ----------
    model : callable
        From standard normal variables, shape (dimension, n), to the values of the model and of the linear model
        beside it (zero without one), shape (2, channels, n); nan where there is none.
    rows : sequence of sequences of int
        The variables of each source; a source without is not asked.
    """
    asked = [k for k, own in enumerate(rows) if len(own)]
    points = np.empty((dimension, 2 + len(asked), count))
    points[:, :2] = rng.standard_normal((2, dimension, count)).swapaxes(0, 1)
    points[:, 2:] = points[:, :1]
    for place, k in enumerate(asked):
        own = list(rows[k])
        points[own, 2 + place] = points[own, 1]
    flat = points.reshape(dimension, -1)
    parts = [model(flat[:, begin : begin + CHUNK]) for begin in range(0, flat.shape[1], CHUNK)]
    found = np.concatenate(parts, axis=-1).reshape(*parts[0].shape[:2], 2 + len(asked), count)
    of_a, of_b = found[:, :, 0], found[:, :, 1]
    mixed_values = np.full((len(rows), *of_a.shape), np.nan)
    mixed_values[asked] = np.moveaxis(found[:, :, 2:], 2, 0)
    keep = np.isfinite(of_a).all(axis=(0, 1)) & np.isfinite(of_b).all(axis=(0, 1))
    keep &= np.isfinite(mixed_values[asked]).all(axis=(0, 1, 2))
    of_a, of_b = of_a[:, :, keep], of_b[:, :, keep]
    change = mixed_values[:, :, :, keep] - of_a
    return Sampled(
        np.moveaxis((of_b * change).sum(axis=-1), 0, -1),
        np.moveaxis(change.sum(axis=-1), 0, -1),
        np.moveaxis((change * change).sum(axis=-1), 0, -1),
        of_a.sum(axis=-1) + of_b.sum(axis=-1),
        (of_a * of_a).sum(axis=-1) + (of_b * of_b).sum(axis=-1),
        int(np.count_nonzero(keep)),
        count,
    )


def combine(replicates: Sequence[Sampled], control: Control | None = None) -> Indices:
    """Indices and their intervals from independent replicates."""
    points = sum(each.points for each in replicates)
    full = [each for each in replicates if each.kept]
    kept = sum(each.kept for each in full)
    shape = (3, *replicates[0].mixed.shape[1:])
    if len(full) < 2:
        return Indices(np.full(shape, np.nan), np.full(shape, np.nan), points, points - kept)
    # About the common mean, or a large mean would drown the products.
    centre = sum((each.sums for each in full), np.zeros_like(full[0].sums)) / (2 * kept)
    first = np.stack([(each.mixed - centre[..., None] * each.change) / each.kept for each in full])
    total = np.stack([0.5 * each.square / each.kept for each in full])
    whole = np.stack([each.squares / (2 * each.kept) - centre * (each.sums / each.kept - centre) for each in full])
    # The linear model's variances are those over all points; without those that cannot be assembled they are others.
    if control is not None and kept == points:
        first, total = (part[:, 0] - part[:, 1] + control.own for part in (first, total))
        whole = whole[:, 0] - whole[:, 1] + control.whole
    else:
        first, total, whole = first[:, 0], total[:, 0], whole[:, 0]
    return Indices(_ratio(first, whole[..., None]), _ratio(total, whole[..., None]), points, points - kept)


def _ratio(parts: Floats, whole: Floats) -> Floats:
    """Ratio of means over replicates and its interval: value, low, high; what is below 0 or above 1 is moved there."""
    count, mean = len(parts), whole.mean(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.where(mean > 0, parts.mean(axis=0) / mean, np.nan)
        spread = np.std((parts - value * whole) / mean, axis=0, ddof=1) / np.sqrt(count)
    half = student(count - 1) * spread
    return np.asarray(np.clip(np.stack([value, value - half, value + half]), 0.0, 1.0))


def student(degrees: int) -> float:
    """Student's quantile of half the width of an interval at 99.7 %, to 1e-5 from 15 degrees of freedom on.

    [Fisher & Cornish, 1960; Abramowitz & Stegun, eq. 26.7.5.] SciPy, which has it too, takes a quarter of a second.
    """
    z, v = NormalDist().inv_cdf(0.5 * (1.0 + CONFIDENCE)), float(degrees)
    terms = (
        (z**3 + z) / (4 * v),
        (5 * z**5 + 16 * z**3 + 3 * z) / (96 * v**2),
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * v**3),
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / (92160 * v**4),
    )
    return z + sum(terms)


def indices(task: Task, section: ReliabilitySection, listed: bool) -> dict[int, Indices]:
    """Indices by pose: of all poses where the study says of how many points, else of the first listed ones."""
    settings, count = task.settings, section.sobol
    if count is None:
        settings = settings[:POSES] if listed and SAMPLING.intersection(section.methods) else ()
    if not settings or count == 0:
        return {}
    sources, linear = task.sources, task.linear
    alone = uncorrelated(sources)
    owners = np.array(sources.owners)
    rows = [np.flatnonzero(owners == s.name).tolist() if s.name in alone else [] for s in linear.sources]
    points = BUDGET // (sum(map(bool, rows)) + 2) if count is None else count
    replicates = max(REPLICATES, -(-points // _MOST))
    each = max(2, points // replicates)
    task.progress.start(len(settings) * replicates, "replicates")

    def work(item: tuple[Setting, int]) -> Sampled:
        setting, replicate = item
        rng = generator(task.seed, setting.pose, _STREAM, replicate)
        return sample(_beside(setting, sources, linear), rows, len(owners), each, rng)

    found: dict[int, list[Sampled]] = {setting.pose: [] for setting in settings}
    items = [(setting, replicate) for setting in settings for replicate in range(replicates)]
    for (setting, _), part in zip(items, map_chunks(work, items, task.jobs), strict=True):
        found[setting.pose].append(part)
        task.progress.update(1)
    return {pose: combine(parts, _control(sources, linear, pose)) for pose, parts in found.items()}


def uncorrelated(sources: Sources) -> set[str]:
    """Sources that vary by themselves; only they have indices of their own."""
    if sources.correlation is None:
        return set(sources.owners)
    lonely = np.count_nonzero(sources.correlation.coefficients, axis=0) == 1
    return {s.name for s, own in zip(sources.scalars, lonely, strict=True) if own} | {p.name for p in sources.pins}


def doubts(study: Study, poses: Poses, task: Task, found: Mapping[int, Indices]) -> list[str]:
    """Which sources have no indices, and where made mechanisms are left out of them."""
    if not found:
        return []
    notes = []
    bound = [s.name for s in task.sources.scalars if s.name not in uncorrelated(task.sources)]
    if bound:
        notes.append(f"Sobol' indices are of what varies by itself: {', '.join(bound)} are correlated and have none")
    lost = {pose: indices for pose, indices in found.items() if indices.invalid}
    if lost:
        pose, indices = max(lost.items(), key=lambda item: item[1].invalid)
        notes.append(
            f"Sobol' indices: {indices.invalid} of {indices.samples} points are left out at "
            f"{pose_in_words(study, poses, pose)}, since a mechanism there cannot be assembled"
        )
    return notes


def _beside(setting: Setting, sources: Sources, linear: FirstOrder) -> Callable[[Floats], Floats]:
    slopes = linear.components[:, :, setting.pose]
    if not np.isfinite(slopes).all():
        slopes = np.zeros_like(slopes)

    def model(u: Floats) -> Floats:
        drawn = sources.at(u)
        errors, valid = errors_of(setting, sources.made(drawn), u.shape[1])
        values = np.where(valid, np.stack(errors), np.nan)
        return np.stack([values, slopes @ _components(sources, drawn, u.shape[1])])

    return model


def _components(sources: Sources, drawn: Drawn, count: int) -> Floats:
    """Values of the components of the linear model, shape (components, count)."""
    rows: list[Floats | float] = [*drawn.scalars]
    for pin, radius, place in zip(sources.pins, drawn.radii, drawn.pins, strict=True):
        rows += [radius * part for part, _ in zip(place, pin.places, strict=False)]
    return np.stack([np.broadcast_to(row, (count,)) for row in rows]) if rows else np.zeros((0, count))


def _control(sources: Sources, linear: FirstOrder, pose: int) -> Control | None:
    """Variances of the linear model with the pins as they are sampled."""
    variance = linear.variance.copy()
    pins = len(linear.sources) - len(sources.pins)
    for k, pin in enumerate(sources.pins):
        ratio = PIN_LAWS[pin.sampled].variance / PIN_LAWS[pin.analytic].variance
        variance[linear.owner == pins + k] *= ratio
    slopes = linear.components[:, :, pose]
    sigma = slopes * np.sqrt(variance)
    whole = (sigma**2).sum(axis=1) if linear.correlation is None else ((sigma @ linear.correlation) * sigma).sum(axis=1)
    own = np.stack([(sigma[:, linear.owner == k] ** 2).sum(axis=1) for k in range(len(linear.sources))], axis=1)
    return Control(own, whole) if np.isfinite(whole).all() else None


def columns(found: Mapping[int, Indices], shape: tuple[int, int, int]) -> list[Column]:
    """``sobol_first``, ``sobol_first_low`` ... of all poses, channels and sources; nan where not asked."""
    made = []
    for kind, meaning in (
        ("first", "share of the output's variance that the source causes by itself [Sobol, 1993]"),
        ("total", "share that the source causes by itself and together with others"),
    ):
        values = np.full((3, *shape), np.nan)
        for pose, indices in found.items():
            values[:, pose] = getattr(indices, kind)
        ends = ("", "_low", "_high"), ("", ", lower end of its interval, 99.7 %", ", upper end of its interval, 99.7 %")
        made += [Column(f"sobol_{kind}{end}", part.ravel(), meaning=meaning + more)
                 for end, more, part in zip(*ends, values, strict=True)]  # fmt: skip
    return made
