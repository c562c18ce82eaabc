"""Sobol' indices of made mechanisms, beside the linear model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from mechdesign.analyses.reliability.engine.sobol import Replicate, SobolIndices, combine, sample
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.setting import Setting, errors_of
from mechdesign.analyses.reliability.simulation import generator
from mechdesign.analyses.reliability.sources import Sources
from mechdesign.analyses.reliability.task import Task
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import map_chunks
from mechdesign.results import Column
from mechdesign.study.schema.methods import METHODS
from mechdesign.study.schema.reliability import ReliabilitySection

REPLICATES = 16
# Mechanisms solved a pose, and poses, where the study does not say how many points.
BUDGET = 8_000
POSES = 4
# Points of a replicate: beyond these there are more of them.
_MOST = 4_000
_STREAM = 3


def indices(task: Task, section: ReliabilitySection) -> dict[int, SobolIndices]:
    """Indices by pose: of all poses where the study says of how many points, else of the first listed ones."""
    settings, count = task.settings, section.sobol
    if count is None:
        sampled = any(METHODS[method].sampled for method in section.methods)
        settings = settings[:POSES] if task.poses.listed and sampled else ()
    if not settings or count == 0:
        return {}
    sources, linear = task.sources, task.linear
    alone, owners = uncorrelated(sources), np.array(sources.owners)
    rows = [np.flatnonzero(owners == s.name).tolist() if s.name in alone else [] for s in sources.all]
    points = BUDGET // (sum(map(bool, rows)) + 2) if count is None else count
    replicates = max(REPLICATES, -(-points // _MOST))
    each = max(2, points // replicates)
    task.progress.start(len(settings) * replicates, "replicates")

    def work(item: tuple[Setting, int]) -> Replicate:
        setting, replicate = item
        rng = generator(task.seed, setting.pose, _STREAM, replicate)
        return sample(_beside(setting, sources, linear), rows, len(owners), each, rng)

    found: dict[int, list[Replicate]] = {setting.pose: [] for setting in settings}
    items = [(setting, replicate) for setting in settings for replicate in range(replicates)]
    for (setting, _), part in zip(items, map_chunks(work, items, task.jobs), strict=True):
        found[setting.pose].append(part)
        task.progress.update(1)
    return {pose: combine(parts, _variances(linear, pose)) for pose, parts in found.items()}


def uncorrelated(sources: Sources) -> set[str]:
    """Sources that vary by themselves; only they have indices of their own."""
    if sources.correlation is None:
        return set(sources.owners)
    lonely = np.count_nonzero(sources.correlation.coefficients, axis=0) == 1
    return {s.name for s, own in zip(sources.scalars, lonely, strict=True) if own} | {p.name for p in sources.pins}


def doubts(task: Task, found: Mapping[int, SobolIndices]) -> list[str]:
    """Which sources have no indices, and where made mechanisms are left out of them."""
    if not found:
        return []
    notes = []
    alone = uncorrelated(task.sources)
    bound = [s.name for s in task.sources.scalars if s.name not in alone]
    if bound:
        notes.append(f"Sobol' indices are of what varies by itself: {', '.join(bound)} are correlated and have none")
    pose, worst = max(found.items(), key=lambda item: item[1].invalid)
    if worst.invalid:
        notes.append(
            f"Sobol' indices: {worst.invalid} of {worst.samples} points are left out at {task.where(pose)}, since a "
            "mechanism there cannot be assembled"
        )
    return notes


def _beside(setting: Setting, sources: Sources, linear: FirstOrder) -> Callable[[Floats], Floats]:
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


def columns(found: Mapping[int, SobolIndices], shape: tuple[int, ...]) -> list[Column]:
    """``sobol_first``, ``sobol_first_low`` ... of all poses, channels and sources; nan where not asked."""
    made: list[Column] = []
    for kind, meaning in (
        ("first", "share of the output's variance that the source causes by itself [Sobol, 1993]"),
        ("total", "share that the source causes by itself and together with others"),
    ):
        values = np.full((3, *shape), np.nan)
        for pose, each in found.items():
            values[:, pose] = getattr(each, kind)
        ends = (
            ("", ""),
            ("_low", ", lower end of its interval, 99.7 %"),
            ("_high", ", upper end of its interval, 99.7 %"),
        )
        made += [Column(f"sobol_{kind}{end}", part.ravel(), meaning=meaning + more)
                 for (end, more), part in zip(ends, values, strict=True) if found]  # fmt: skip
    return made
