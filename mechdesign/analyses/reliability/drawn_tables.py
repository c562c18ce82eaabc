"""Tables of what was drawn: the density of two errors, histograms, and how means and failures settle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.analyses.reliability.first_order import correlation
from mechdesign.analyses.reliability.simulation import CELLS, REACH, Sums
from mechdesign.analyses.reliability.tables import at_poses, of_channels
from mechdesign.analyses.reliability.task import Task
from mechdesign.results import Column, Table

# A histogram has about so many bins, of samples that vary no farther than so many standard deviations.
BINS, WIDEST = 60, 6.0
ROUNDING = 1e-12


def build(task: Task, sums: Mapping[int, Sums]) -> list[Table]:
    """Those that there is something to say in; sums by pose."""
    made = [_density(task, sums), _histogram(task, sums)]
    followed = next(((row, each) for row, each in sorted(sums.items()) if len(each.trend)), None)
    if followed is not None:
        made += [_convergence(task, *followed), _estimate(task, *followed) if task.question.limited else None]
    return [table for table in made if table is not None]


def _density(task: Task, sums: Mapping[int, Sums]) -> Table | None:
    """Density of the two outputs within 3 standard deviations: bivariate normal beside the simulated one [S2]."""
    pair = list(task.question.pair or ())
    rows = [row for row, each in sorted(sums.items()) if pair and len(each.density) and each.counted]
    blocks = task.linear.covariance()[rows][:, pair][:, :, pair] if rows else np.zeros((0, 2, 2))
    rho = correlation(blocks)
    kept = np.flatnonzero(1.0 - rho**2 > 0)
    if not len(kept):
        return None
    rows, blocks, rho = [rows[k] for k in kept], blocks[kept], rho[kept, None]
    centres = (np.arange(CELLS) + 0.5) * (2 * REACH / CELLS) - REACH
    place = [grid.ravel() for grid in np.meshgrid(centres, centres, indexing="ij")]
    x, y = place
    rest = 1.0 - rho**2
    normal = np.exp(-(x * x - 2 * rho * x * y + y * y) / (2 * rest)) / (2 * np.pi * np.sqrt(rest))
    simulated = [sums[row].density / (sums[row].counted * (2 * REACH / CELLS) ** 2) for row in rows]
    names, shift = [task.question.channels[k].name for k in pair], task.linear.shift()
    columns = at_poses(task, np.repeat(rows, len(x)))
    for k, channel in enumerate(pair):
        sigma, mean = np.sqrt(blocks[:, k, k]) * task.scale[channel], shift[channel, rows] * task.scale[channel]
        errors = mean[:, None] + np.outer(sigma, place[k])
        columns.append(Column(f"{names[k]}_error", errors.ravel(), task.labels[2][channel], "centre of the cell"))
    for axis, name, values in zip("xy", names, place, strict=True):
        meaning = f"error of {name} about its mean, in deviations of the first order"
        columns.append(Column(axis, np.tile(values, len(rows)), meaning=meaning))
    columns += [
        Column("normal", normal.ravel(), meaning="bivariate normal density, standardised"),
        Column("simulated", np.concatenate(simulated), meaning="density of the samples, standardised"),
    ]
    return Table("density", tuple(columns), "density of two errors: bivariate normal and simulation [S2, Figs. 4, 5]")


def _histogram(task: Task, sums: Mapping[int, Sums]) -> Table | None:
    """Each output's error at the first pose, beside the normal law of the same mean and deviation."""
    row = next((row for row, each in sorted(sums.items()) if each.kept.shape[1] > 1), None)
    if row is None:
        return None
    units, nominal = task.labels[2], np.abs(task.nominal[:, row] * task.scale)
    varying, parts = [], []
    for k, error in enumerate(sums[row].kept * task.scale[:, None]):
        mean, sigma = float(error.mean()), float(error.std(ddof=1))
        # What does not vary has rounding for its deviation: of the size of what it is computed from.
        size = task.study.mechanism.size if units[k] == task.study.units.label("length") else 0.0
        if not sigma > ROUNDING * max(size, float(nominal[units == units[k]].max())):
            continue
        low = max(float(error.min()), mean - WIDEST * sigma)
        high = min(float(error.max()), mean + WIDEST * sigma)
        count, edges = np.histogram(error, bins=BINS, range=(low, high))
        middle = 0.5 * (edges[1:] + edges[:-1])
        normal = np.exp(-0.5 * ((middle - mean) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
        varying.append(k)
        parts.append(np.stack([edges[:-1], edges[1:], count, normal]))
    if not parts:
        return None
    channel, samples = np.repeat(varying, BINS), sums[row].kept.shape[1]
    low_, high_, count_, normal_ = np.concatenate(parts, axis=1)
    columns = [
        *at_poses(task, np.full(len(channel), row)),
        *of_channels(task, channel),
        Column("low", low_, meaning="begin of the bin of errors, in `unit`"),
        Column("high", high_, meaning="end of the bin, in `unit`"),
        Column("count", count_.astype(np.int64), meaning=f"samples in the bin, of {samples}"),
        Column("density", count_ / (samples * (high_ - low_)), meaning="their density, in 1/`unit`"),
        Column("normal", normal_, meaning="density of the normal law of the samples' mean and deviation, in 1/`unit`"),
        Column("unit", units[channel], meaning="unit of the error"),
    ]
    return Table("histogram", tuple(columns), "errors that were drawn at the first pose, and their normal fit")


def _convergence(task: Task, row: int, sums: Sums) -> Table:
    """Mean of each output after so many samples, at the first pose [S3, Fig. 4]."""
    trend = sums.trend[sums.trend[:, 1] > 0]
    means = (task.nominal[:, row] + trend[:, 3:] / trend[:, 1:2]) * task.scale
    step, channel = (index.ravel() for index in np.indices(means.shape))
    columns = [
        *at_poses(task, np.full(len(step), row)),
        Column("samples", trend[step, 1].astype(np.int64), meaning="valid samples so far"),
        *of_channels(task, channel),
        Column("mean", means.ravel(), meaning="their mean, in `unit`"),
        Column("unit", task.labels[2][channel], meaning="unit of the mean"),
    ]
    return Table("convergence", tuple(columns), "trend of the means with the number of samples [S3, Fig. 4]")


def _estimate(task: Task, row: int, sums: Sums) -> Table:
    """Share of failures after so many samples, with its interval, at the first pose."""
    from mechdesign.analyses.reliability.engine.intervals import binomial

    samples, failures = (sums.trend[:, k].astype(np.int64) for k in (0, 2))
    interval = np.array([binomial(k, n) for k, n in zip(failures.tolist(), samples.tolist(), strict=True)])
    columns = [
        *at_poses(task, np.full(len(samples), row)),
        Column("samples", samples, meaning="samples so far"),
        Column("failure", failures / samples, meaning="share of them that broke a limit or cannot be assembled"),
        Column("failure_low", interval[:, 0], meaning="lower end of its interval, 99.7 %, Clopper-Pearson"),
        Column("failure_high", interval[:, 1], meaning="upper end of its interval, 99.7 %, Clopper-Pearson"),
    ]
    return Table("estimate", tuple(columns), "probability of failure with the number of samples")
