"""Tables of what was drawn at single poses: density, histogram, and how means and failures settle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.reliability.answer import Answer
from mechdesign.analyses.reliability.error_limits import correlation
from mechdesign.analyses.reliability.simulation import CELLS, REACH, Sums
from mechdesign.numerics.arrays import Floats
from mechdesign.results import Column, Table

# A histogram has about so many bins, of samples that vary no farther than so many standard deviations.
BINS, WIDEST = 60, 6.0
ROUNDING = 1e-12


def build(answer: Answer) -> list[Table]:
    """Those that there is something to say in."""
    made = (make(answer) for make in (density, histogram, convergence, estimate))
    return [table for table in made if table is not None]


def density(answer: Answer) -> Table | None:
    """Density of the two outputs within 3 standard deviations: bivariate normal beside the simulated one [S2]."""
    pair, linear = answer.question.pair, answer.linear
    if pair is None:
        return None
    centres = (np.arange(CELLS) + 0.5) * (2 * REACH / CELLS) - REACH
    x, y = (grid.ravel() for grid in np.meshgrid(centres, centres, indexing="ij"))
    rows, normal, simulated, scales, means = [], [], [], [], []
    covariance, shift = linear.covariance(), linear.shift()
    for row, sums in sorted(answer.sums.items()):
        if not len(sums.density) or not sums.counted:
            continue
        block = covariance[row][np.ix_(pair, pair)]
        rho, rest = correlation(block), 1.0 - correlation(block) ** 2
        if not rest > 0:
            continue
        exponent = -(x * x - 2 * rho * x * y + y * y) / (2 * rest)
        rows.append(row)
        normal.append(np.exp(exponent) / (2 * np.pi * np.sqrt(rest)))
        simulated.append(sums.density / (sums.counted * (2 * REACH / CELLS) ** 2))
        scales.append(np.sqrt(np.diagonal(block)) * answer.scale[list(pair)])
        means.append(shift[list(pair), row] * answer.scale[list(pair)])
    if not rows:
        return None
    cells, sigma, mean = CELLS * CELLS, np.array(scales), np.array(means)
    unit = answer.labels[2]
    names = [answer.question.channels[k].name for k in pair]
    columns = [
        *answer.at(np.repeat(np.array(rows, dtype=np.intp), cells)),
        Column(
            f"{names[0]}_error", (mean[:, :1] + np.outer(sigma[:, 0], x)).ravel(), unit[pair[0]], "centre of the cell"
        ),
        Column(
            f"{names[1]}_error", (mean[:, 1:] + np.outer(sigma[:, 1], y)).ravel(), unit[pair[1]], "centre of the cell"
        ),
        Column(
            "x", np.tile(x, len(rows)), meaning=f"error of {names[0]} about its mean, in deviations of the first order"
        ),
        Column(
            "y", np.tile(y, len(rows)), meaning=f"error of {names[1]} about its mean, in deviations of the first order"
        ),
        Column("normal", np.concatenate(normal), meaning="bivariate normal density, standardised"),
        Column("simulated", np.concatenate(simulated), meaning="density of the samples, standardised"),
    ]
    return Table("density", tuple(columns), "density of two errors: bivariate normal and simulation [S2, Figs. 4, 5]")


def histogram(answer: Answer) -> Table | None:
    """Each output's error at the first pose, beside the normal law of the same mean and deviation."""
    kept = [(row, sums.kept) for row, sums in sorted(answer.sums.items()) if sums.kept.shape[1] > 1]
    if not kept:
        return None
    row, errors = kept[0]
    names, orders, units = answer.labels
    parts: list[tuple[int, Floats, Floats, NDArray[np.int64], Floats]] = []
    for channel, error in enumerate(errors * answer.scale[:, None]):
        mean, sigma = float(error.mean()), float(error.std(ddof=1))
        # What does not vary has rounding for its deviation: of the size of what it is computed from.
        alike = [k for k, unit in enumerate(units) if unit == units[channel]]
        size = answer.study.mechanism.size if units[channel] == answer.study.units.label("length") else 0.0
        if not sigma > ROUNDING * max(size, float(np.abs(answer.nominal[alike, row]).max())):
            continue
        low = max(float(error.min()), mean - WIDEST * sigma)
        high = min(float(error.max()), mean + WIDEST * sigma)
        count, edges = np.histogram(error, bins=BINS, range=(low, high))
        middle = 0.5 * (edges[1:] + edges[:-1])
        normal = np.exp(-0.5 * ((middle - mean) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
        parts.append((channel, edges[:-1], edges[1:], count, normal))
    if not parts:
        return None
    channels = np.repeat([part[0] for part in parts], BINS)
    low_, high_, count_, normal_ = (np.concatenate([part[k] for part in parts]) for k in range(1, 5))
    columns = [
        *answer.at(np.full(len(channels), row)),
        Column("output", np.array(names)[channels], meaning="coordinate"),
        Column("order", np.array(orders)[channels], meaning="position, velocity or acceleration"),
        Column("low", low_, meaning="begin of the bin of errors, in `unit`"),
        Column("high", high_, meaning="end of the bin, in `unit`"),
        Column("count", count_, meaning=f"samples in the bin, of {errors.shape[1]}"),
        Column("density", count_ / (errors.shape[1] * (high_ - low_)), meaning="their density, in 1/`unit`"),
        Column("normal", normal_, meaning="density of the normal law of the samples' mean and deviation, in 1/`unit`"),
        Column("unit", np.array(units)[channels], meaning="unit of the error"),
    ]
    return Table("histogram", tuple(columns), "errors that were drawn at the first pose, and their normal fit")


def _followed(answer: Answer) -> tuple[int, Sums] | None:
    return next(((row, sums) for row, sums in sorted(answer.sums.items()) if len(sums.trend)), None)


def convergence(answer: Answer) -> Table | None:
    """Mean of each output after so many samples, at the first pose [S3, Fig. 4]."""
    followed = _followed(answer)
    if followed is None:
        return None
    row, sums = followed
    trend = sums.trend[sums.trend[:, 1] > 0]
    samples, means = trend[:, 1], trend[:, 3:] / trend[:, 1:2]
    means = answer.nominal[:, row] + means * answer.scale
    output, order, unit = answer.labels
    steps, channels = means.shape
    columns = [
        *answer.at(np.full(steps * channels, row)),
        Column("samples", np.repeat(samples.astype(np.int64), channels), meaning="valid samples so far"),
        Column("output", np.tile(output, steps), meaning="coordinate"),
        Column("order", np.tile(order, steps), meaning="position, velocity or acceleration"),
        Column("mean", means.ravel(), meaning="their mean, in `unit`"),
        Column("unit", np.tile(unit, steps), meaning="unit of the mean"),
    ]
    return Table("convergence", tuple(columns), "trend of the means with the number of samples [S3, Fig. 4]")


def estimate(answer: Answer) -> Table | None:
    """Share of failures after so many samples, with its interval, at the first pose."""
    followed = _followed(answer)
    if followed is None or not answer.question.limited:
        return None
    from mechdesign.analyses.reliability.engine.intervals import binomial

    row, sums = followed
    samples, failures = (sums.trend[:, k].astype(np.int64) for k in (0, 2))
    interval = np.array([binomial(k, n) for k, n in zip(failures.tolist(), samples.tolist(), strict=True)])
    columns = [
        *answer.at(np.full(len(samples), row)),
        Column("samples", samples, meaning="samples so far"),
        Column("failure", failures / samples, meaning="share of them that broke a limit or cannot be assembled"),
        Column("failure_low", interval[:, 0], meaning="lower end of its interval, 99.7 %, Clopper-Pearson"),
        Column("failure_high", interval[:, 1], meaning="upper end of its interval, 99.7 %, Clopper-Pearson"),
    ]
    return Table("estimate", tuple(columns), "probability of failure with the number of samples")
