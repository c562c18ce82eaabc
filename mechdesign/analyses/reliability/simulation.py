"""Monte Carlo simulation: made mechanisms chunk by chunk, exact kinematics of each, and only sums kept [S2, S3]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from mechdesign.analyses.reliability.setting import Setting, errors_of
from mechdesign.analyses.reliability.sources import Made, Sources
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.parallel import map_chunks
from mechdesign.progress import NULL, Progress

# Samples drawn together.
CHUNK = 20_000
# The density's grid, in standard deviations [S2, Fig. 4], and the chunks it is counted over: a million samples.
CELLS = 25
REACH = 3.0
_DENSITY_CHUNKS = 50
# The trend of the means is followed in steps of this many samples through the first chunks, whose errors are kept for a
# histogram too, then at powers of two.
_TREND_STEP = 1000
_TREND_CHUNKS = 16


def generator(seed: int, *stream: int) -> np.random.Generator:
    """The stream of this name, for example one chunk of samples at one pose.

    Every chunk of every pose has its own, so that the answer depends neither on the number of threads nor on how many
    samples follow.
    """
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy=seed, spawn_key=stream)))


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums over samples; they add up chunk by chunk, in order.

    Parameters
    ----------
    errors : ndarray, shape (channels,)
    products : ndarray, shape (channels, channels)
        Of errors about the nominal value, over valid samples: small numbers, so the variance loses no digits.
    density : ndarray of int, shape (CELLS * CELLS,) or (0,)
        Samples in each cell, over `counted` samples.
    trend : ndarray, shape (steps, 3 + channels)
        Samples, valid ones, failures and sums of errors after each step, from the begin of the chunk.
    kept : ndarray, shape (channels, n)
        Errors of valid samples of the first chunks.
    """

    samples: int
    valid: int
    failures: int
    errors: Floats
    products: Floats
    density: Ints
    counted: int
    trend: Floats
    kept: Floats

    @property
    def mean(self) -> Floats:
        """Mean error of each channel."""
        return self.errors / self.valid

    @property
    def covariance(self) -> Floats:
        """Covariance of the channels' errors; nan of a single sample."""
        if self.valid < 2:
            return np.full(self.products.shape, np.nan)
        centred = self.products - np.outer(self.errors, self.errors) / self.valid
        return np.asarray(centred / (self.valid - 1))

    @staticmethod
    def total(parts: Sequence[Sums]) -> Sums:
        """Those of chunks that follow each other."""
        return reduce(Sums.__add__, parts)

    def __add__(self, other: Sums) -> Sums:
        offset = np.concatenate([[self.samples, self.valid, self.failures], self.errors])
        return Sums(
            self.samples + other.samples,
            self.valid + other.valid,
            self.failures + other.failures,
            self.errors + other.errors,
            self.products + other.products,
            self.density + other.density if len(other.density) else self.density,
            self.counted + other.counted,
            np.concatenate([self.trend, other.trend + offset]) if len(other.trend) else self.trend,
            np.concatenate([self.kept, other.kept], axis=1) if other.kept.size else self.kept,
        )


def simulate(
    settings: Sequence[Setting], sources: Sources, seed: int, samples: int, sums: dict[int, Sums],
    jobs: int | None = 1, progress: Progress = NULL,
) -> None:  # fmt: skip
    """Fill `sums` by pose; they do not depend on `jobs`.

    All settings come forward together, so that an interrupt leaves something of each.
    """

    def work(item: tuple[int, Setting]) -> tuple[int, Sums]:
        chunk, setting = item
        return setting.pose, simulate_chunk(setting, sources, seed, chunk, min(CHUNK, samples - chunk * CHUNK))

    items = ((chunk, setting) for chunk in range(-(-samples // CHUNK)) for setting in settings)
    for pose, found in map_chunks(work, items, jobs):
        sums[pose] = sums[pose] + found if pose in sums else found
        progress.update(found.samples)


def simulate_chunk(setting: Setting, sources: Sources, seed: int, chunk: int, count: int) -> Sums:
    """Draw `count` made mechanisms at one pose and sum their errors."""
    made = sources.made(sources.draw(generator(seed, setting.pose, chunk), count))
    return sums_of(setting, made, count, chunk)


def sums_of(setting: Setting, made: Made, count: int, chunk: int) -> Sums:
    """Sums over made mechanisms; of the first chunks also the density, the trend and the errors."""
    errors, valid = errors_of(setting, made, count)
    within = setting.question.keeps(errors)
    failures, assembled = count - int(np.count_nonzero(within)), int(np.count_nonzero(valid))
    early = setting.followed and chunk < _TREND_CHUNKS
    trend = _trend(errors, valid, within) if early else np.zeros((0, 3 + len(errors)))
    if assembled < count:
        errors = errors[:, valid]
    sums = errors.sum(axis=1)
    if setting.followed and not early and chunk.bit_count() == 1:
        trend = np.concatenate([[count, assembled, failures], sums])[None]
    density = np.zeros(0, dtype=np.intp)
    if setting.scale is not None and setting.question.pair is not None and chunk < _DENSITY_CHUNKS:
        standard = [(errors[k] - mean) / sigma
                    for k, (mean, sigma) in zip(setting.question.pair, setting.scale, strict=True)]  # fmt: skip
        density = _count_cells(np.stack(standard))
    return Sums(
        count, assembled, failures, sums, errors @ errors.T, density, assembled if len(density) else 0, trend,
        errors if early else np.empty((len(errors), 0)),
    )  # fmt: skip


def _trend(errors: Floats, valid: Flags, within: Flags) -> Floats:
    begins = np.arange(0, len(valid), _TREND_STEP)
    steps = np.concatenate([[valid, ~within], np.where(valid, errors, 0.0)])
    counts = np.minimum(begins + _TREND_STEP, len(valid))
    return np.concatenate([counts[None], np.add.reduceat(steps, begins, axis=1).cumsum(axis=1)]).T


def _count_cells(standard: Floats) -> Ints:
    """Samples in each cell of the density's grid, from two standardised errors, shape (2, n)."""
    cells = np.floor((standard + REACH) * (CELLS / (2 * REACH)))
    x, y = cells[:, ((cells >= 0) & (cells < CELLS)).all(axis=0)]
    return np.bincount((x * CELLS + y).astype(np.intp), minlength=CELLS * CELLS)
