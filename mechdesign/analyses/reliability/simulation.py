"""Monte Carlo simulation: made mechanisms chunk by chunk, exact kinematics of each, and only sums kept [S2, S3]."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.reliability.deflection import Elastic
from mechdesign.analyses.reliability.error_limits import Band, Channel, Disc, correlation
from mechdesign.analyses.reliability.first_order import Rates, nominal_values
from mechdesign.analyses.reliability.sampling import CHUNK, generator
from mechdesign.analyses.reliability.sources import Made, Sources
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.plan import Plan
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.parallel import map_chunks
from mechdesign.progress import Progress

# The density's grid, in standard deviations [S2, Fig. 4], and the chunks it is counted over: a million samples.
CELLS = 25
REACH = 3.0
_DENSITY_CHUNKS = 50
# The trend of the means is followed in steps of this many samples through the first chunks, whose errors are kept for a
# histogram too, then at powers of two.
_TREND_STEP = 1000
_TREND_CHUNKS = 16


@dataclass(frozen=True, eq=False)
class Setting:
    """What to simulate at one pose.

    Parameters
    ----------
    pose : int
        Row of the pose; names its streams.
    plan : Plan
        That of the drives, in the assembly of the pose.
    nominal : Configuration
        Solved pose of the nominal mechanism.
    drives : sequence of float
        Values of the drives, which are held (radians, lengths).
    centres : sequence of float
        Nominal values of the channels.
    pair : (int, int) or None
        Channels whose covariance is wanted.
    scale : two of (float, float) or None
        Means and standard deviations for the density of the pair; None where no density is wanted.
    trend : bool
        Whether to follow the means and the failures.
    keep : bool
        Whether to keep the errors of the first chunks.
    elastic : Elastic or None
        Deflections at this pose.
    """

    pose: int
    mechanism: Mechanism
    plan: Plan
    nominal: Configuration
    drives: Sequence[float]
    channels: Sequence[Channel]
    centres: Sequence[float]
    rates: Rates
    bands: Sequence[Band]
    discs: Sequence[Disc]
    pair: tuple[int, int] | None
    scale: tuple[tuple[float, float], tuple[float, float]] | None
    trend: bool
    keep: bool
    elastic: Elastic | None = None

    @property
    def limited(self) -> bool:
        """Whether a reliability is asked."""
        return bool(self.bands or self.discs)


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums over samples; they add up chunk by chunk, in order.

    Parameters
    ----------
    errors, squares : ndarray, shape (channels,)
        Of errors about the nominal value, over valid samples: small numbers, so the variance loses no digits.
    product : float
        Of the errors of the pair.
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
    squares: Floats
    product: float
    density: NDArray[np.int64]
    counted: int
    trend: Floats
    kept: Floats

    @property
    def mean(self) -> Floats:
        """Mean error of each channel."""
        return self.errors / self.valid

    @property
    def deviation(self) -> Floats:
        """Standard deviation of each channel's error; nan of a single sample."""
        if self.valid < 2:
            return np.full(len(self.errors), np.nan)
        centred = self.squares - self.errors**2 / self.valid
        return np.asarray(np.sqrt(np.maximum(centred, 0.0) / (self.valid - 1)))

    def correlation(self, pair: tuple[int, int]) -> float:
        """Correlation of the errors of the pair."""
        if self.valid < 2:
            return float("nan")
        one, two = pair
        spread = self.deviation**2 * (self.valid - 1)
        mixed = self.product - self.errors[one] * self.errors[two] / self.valid
        return correlation(np.array([[spread[one], mixed], [mixed, spread[two]]]))

    def __add__(self, other: Sums) -> Sums:
        offset = np.concatenate([[self.samples, self.valid, self.failures], self.errors])
        return Sums(
            self.samples + other.samples,
            self.valid + other.valid,
            self.failures + other.failures,
            self.errors + other.errors,
            self.squares + other.squares,
            self.product + other.product,
            self.density + other.density if len(other.density) else self.density,
            self.counted + other.counted,
            np.concatenate([self.trend, other.trend + offset]) if len(other.trend) else self.trend,
            np.concatenate([self.kept, other.kept], axis=1) if other.kept.size else self.kept,
        )


def simulate(
    settings: Sequence[Setting],
    sources: Sources,
    seed: int,
    samples: int,
    jobs: int | None,
    progress: Progress,
    sums: list[Sums | None],
) -> None:
    """Fill `sums`, one of each setting; they do not depend on `jobs`.

    All settings come forward together, so that an interrupt leaves something of each.
    """

    def tasks() -> Iterable[tuple[int, int, int]]:
        for chunk in range(-(-samples // CHUNK)):
            for k in range(len(settings)):
                yield k, chunk, min(CHUNK, samples - chunk * CHUNK)

    def work(task: tuple[int, int, int]) -> tuple[int, Sums]:
        k, chunk, count = task
        return k, simulate_chunk(settings[k], sources, seed, chunk, count)

    for k, found in map_chunks(work, tasks(), jobs):
        before = sums[k]
        sums[k] = found if before is None else before + found
        progress.update(found.samples)


def simulate_chunk(setting: Setting, sources: Sources, seed: int, chunk: int, count: int) -> Sums:
    """Draw `count` made mechanisms at one pose and sum their errors."""
    made = sources.made(sources.draw(generator(seed, setting.pose, chunk), count))
    return sums_of(setting, made, count, chunk)


def sums_of(setting: Setting, made: Made, count: int, chunk: int) -> Sums:
    """Sums over made mechanisms; of the first chunks also the density, the trend and the errors."""
    errors, valid = errors_of(setting, made, count)
    within = keeps(setting, errors)
    failures = 0 if within is None else count - int(np.count_nonzero(within))
    assembled = int(np.count_nonzero(valid))
    trend = np.zeros((0, 3 + len(errors)))
    if setting.trend and chunk < _TREND_CHUNKS:
        trend = _trend(errors, valid, within)
    if assembled < count:
        errors = [error[valid] for error in errors]
    sums = np.array([error.sum() for error in errors])
    squares = np.array([(error * error).sum() for error in errors])
    product = 0.0
    density = np.zeros(0, dtype=np.int64)
    if setting.pair is not None:
        x, y = (errors[k] for k in setting.pair)
        product = float((x * y).sum())
        if setting.scale is not None and chunk < _DENSITY_CHUNKS:
            density = _count_cells(x, y, setting.scale)
    if setting.trend and chunk >= _TREND_CHUNKS and chunk.bit_count() == 1:
        trend = np.concatenate([[count, assembled, failures], sums])[None]
    kept = np.stack(errors) if setting.keep and chunk < _TREND_CHUNKS else np.zeros((len(errors), 0))
    return Sums(
        count, assembled, failures, sums, squares, product, density, assembled if len(density) else 0, trend, kept
    )


def _trend(errors: Sequence[Floats], valid: Flags, within: Flags | None) -> Floats:
    count = len(valid)
    begins = np.arange(0, count, _TREND_STEP)
    broken = np.zeros(count, dtype=bool) if within is None else ~within
    steps = [np.minimum(begins + _TREND_STEP, count).astype(float)]
    for flag in (valid, broken):
        steps.append(np.cumsum(np.add.reduceat(flag.astype(float), begins)))
    for error in errors:
        steps.append(np.cumsum(np.add.reduceat(np.where(valid, error, 0.0), begins)))
    return np.stack(steps, axis=1)


def limited_part(setting: Setting) -> Setting:
    """The same pose with the limited channels only: nothing else needs to be computed."""
    wanted = sorted({b.output for b in setting.bands} | {k for d in setting.discs for k in (d.x, d.y)})
    place = {channel: k for k, channel in enumerate(wanted)}
    return replace(
        setting,
        channels=[setting.channels[k] for k in wanted],
        centres=[setting.centres[k] for k in wanted],
        bands=[replace(band, output=place[band.output]) for band in setting.bands],
        discs=[replace(disc, x=place[disc.x], y=place[disc.y]) for disc in setting.discs],
        pair=None,
        scale=None,
        elastic=None if setting.elastic is None else setting.elastic.only(wanted),
    )


def solve(setting: Setting, made: Made) -> Configuration:
    """Made mechanisms with the drives at the pose, and their errors; angles on the branch of the nominal pose."""
    given: list[Value] = [
        value + made.drives[name] if name in made.drives else value
        for name, value in zip(setting.mechanism.drives, setting.drives, strict=True)
    ]
    solved = setting.plan.solve(given, made.places, start=setting.nominal, limits=False)
    return solved.beside(setting.nominal, [channel.coordinate for channel in setting.channels])


def errors_of(setting: Setting, made: Made, count: int) -> tuple[list[Floats], Flags]:
    """Errors (value minus nominal) of each channel for made mechanisms, and which of them are assembled."""
    mechanism, solved = setting.mechanism, solve(setting, made)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        values = nominal_values(mechanism, solved, setting.channels, setting.rates)
    errors = []
    bent = None if setting.elastic is None else setting.elastic.errors(made.loads, count)
    for k, (value, centre) in enumerate(zip(values, setting.centres, strict=True)):
        errors.append(np.broadcast_to(value - centre if bent is None else value - centre + bent[k], (count,)))
    return errors, np.broadcast_to(solved.valid, (count,))


def keeps(setting: Setting, errors: Sequence[Floats]) -> Flags | None:
    """Which samples keep every limit; one that is not assembled is nan and keeps none. None where there are none."""
    kept: Flags | None = None
    with np.errstate(invalid="ignore"):
        for band in setting.bands:
            error = errors[band.output]
            inside = (
                np.abs(error) <= band.high if band.low == -band.high else (error >= band.low) & (error <= band.high)
            )
            kept = inside if kept is None else kept & inside
        for disc in setting.discs:
            x, y = errors[disc.x], errors[disc.y]
            inside = x * x + y * y <= disc.radius * disc.radius
            kept = inside if kept is None else kept & inside
    return kept


def _count_cells(x: Floats, y: Floats, scale: tuple[tuple[float, float], tuple[float, float]]) -> NDArray[np.int64]:
    cells = []
    inside = np.ones(len(x), dtype=bool)
    for value, (mean, sigma) in zip((x, y), scale, strict=True):
        cell = np.floor(((value - mean) / sigma + REACH) * (CELLS / (2 * REACH)))
        inside &= (cell >= 0) & (cell < CELLS)
        cells.append(cell)
    index = cells[0][inside] * CELLS + cells[1][inside]
    return np.bincount(index.astype(np.intp), minlength=CELLS * CELLS)
