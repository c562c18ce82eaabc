"""Made mechanisms at one pose: exact kinematics, errors, limits, and Monte Carlo simulation chunk by chunk [S2, S3]."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.ground.work.chunks import map_chunks
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.plan import Plan
from mechdesign.questions.kinematics.rates import DriveRates
from mechdesign.questions.reliability.deflection import Elastic
from mechdesign.questions.reliability.engine.problem import Estimate, LimitStates, counted, slopes
from mechdesign.questions.reliability.first_order import derivatives, nominal_values
from mechdesign.questions.reliability.forces import ForceModel
from mechdesign.questions.reliability.limits import ErrorBound
from mechdesign.questions.reliability.question import ReliabilityQuestion
from mechdesign.questions.reliability.sources import Made, Sources

# Samples of a chunk.
CHUNK = 20_000
# Cells of the density's grid along each axis [S2, Fig. 4].
CELLS = 25
# Half the width of the grid, in standard deviations.
REACH = 3.0
# Number of chunks over which the density is counted: a million samples.
_DENSITY_CHUNKS = 50
# Samples between two entries of the trend in the first chunks; after these it has entries at powers of two.
_TREND_STEP = 1000
# Number of first chunks, whose errors are also kept for the histogram.
_TREND_CHUNKS = 16
# Rounds in which a free drive is set, and its largest step, radians.
_SET, _LARGEST_STEP = 3, 0.1
# Step of the difference quotients by the standard normal variables, in standard deviations.
_SOURCE_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class Setting:
    """One pose at which made mechanisms are solved, with the nominal drives and their rates.

    Parameters
    ----------
    pose : int
        Row of the pose, which also names its streams of random numbers.
    plan : Plan
        The drives' plan with the assembly modes of the pose.
    nominal, centres
        The nominal mechanism, and the nominal values of the channels.
    scale : two of (float, float) or None
        Mean and standard deviation of each error of the pair, for its density; None without a density.
    followed : bool
        Whether to record the trend of means and failures, and to keep the errors of the first chunks.
    """

    question: ReliabilityQuestion
    pose: int
    mechanism: Mechanism
    plan: Plan
    nominal: Configuration
    rates: DriveRates
    centres: Sequence[float]
    elastic: Elastic | None
    forces: ForceModel | None = None
    scale: tuple[tuple[float, float], tuple[float, float]] | None = None
    followed: bool = False

    @cached_property
    def drives(self) -> dict[str, Value]:
        """Nominal values of the drives."""
        return {name: self.nominal.value(self.mechanism.coordinate(name)) for name in self.mechanism.drives}

    def narrowed(self) -> Setting:
        """The same pose with the limited channels only, which suffice for the limits."""
        channels, vectors = self.question.limited_channels, self.question.vectors
        return replace(
            self, question=self.question.narrowed, centres=[self.centres[k] for k in channels], scale=None,
            elastic=None if self.elastic is None else self.elastic.of(vectors, self.question.narrowed.vectors),
            forces=self.forces if self.question.narrowed.columns else None,
        )  # fmt: skip


def forward_plan(mechanism: Mechanism, configuration: Configuration) -> Plan:
    """The drives' plan with the assembly modes of a single solved pose.

    A pose given by outputs is solved with the assembly modes of the inverse problem, and may be in another assembly
    mode of the drives than the sketch. Each group is tried in both modes, in order: it depends only on those before it.
    """
    forward = mechanism.forward
    drives = [configuration.value(mechanism.coordinate(name)) for name in mechanism.drives]
    modes = list(forward.modes)
    for index, group in enumerate(forward.structure.groups):
        errors = {}
        for mode in (modes[index], -modes[index]) if modes[index] else ():
            modes[index] = mode
            solved = Plan(mechanism, forward.structure, modes).solve(drives, start=configuration, limits=False)
            errors[mode] = sum(float(np.abs(solved.rotations[k] - configuration.rotations[k])) for k in group.angles)
            errors[mode] += sum(float(np.abs(solved.slides[k] - configuration.slides[k])) for k in group.slides)
        # A mode that cannot be assembled has nan and comes last.
        modes[index] = min(errors, key=lambda mode: (np.isnan(errors[mode]), errors[mode]), default=modes[index])
    return forward if tuple(modes) == forward.modes else Plan(mechanism, forward.structure, modes)


def solve(setting: Setting, made: Made) -> Configuration:
    """Made mechanisms at the pose, drives with their errors; angles at the turn nearest to the nominal pose."""
    nominal = setting.nominal
    drives = [value + made.drives.get(name, 0.0) for name, value in setting.drives.items()]
    solved = setting.plan.solve(drives, made.places, start=nominal, limits=False)
    free = setting.question.free
    if free is not None and np.isfinite(free.high):
        for _ in range(_SET):
            drives = [drives[0] - _late(setting, free, solved)]
            solved = setting.plan.solve(drives, made.places, start=nominal, limits=False)
    loads = [] if setting.forces is None else setting.forces.coordinates
    return solved.beside(nominal, [*setting.question.coordinates, *loads])


def _late(setting: Setting, limit: ErrorBound, solved: Configuration) -> Floats:
    """By how much the drive stands behind the place at which a point comes nearest to its target."""
    mechanism, by_drive = setting.mechanism, setting.mechanism.linearize(solved).by_drives[0]
    along: Value = 0.0
    square: Value = 0.0
    for k, middle in zip(limit.channels, limit.middle, strict=True):
        coordinate = setting.question.channels[k].coordinate
        assert coordinate is not None
        speed = first(solved, coordinate, by_drive)
        along = along + speed * (solved.value(coordinate) - setting.centres[k] - middle)
        square = square + speed**2
    late = np.where(square > 0, along / square, 0.0)
    largest = _LARGEST_STEP if mechanism.quantity(mechanism.drives[0]) == "angle" else np.inf
    return np.clip(late, -largest, largest)


def errors_of(setting: Setting, made: Made, count: int) -> tuple[Floats, Flags]:
    """Errors (value minus nominal), shape (channels, count), and which of the made mechanisms are assembled.

    Where forces are asked, the drives must hold the mechanism as well.
    """
    solved = solve(setting, made)
    forces = None if setting.forces is None else setting.forces.made(made.parameters)
    question, elastic = setting.question, setting.elastic
    channels = question.channels if elastic is None else question.vectors
    values = nominal_values(setting.mechanism, solved, channels, setting.rates, forces)
    errors = np.empty((len(question.channels), count))
    for error, value, centre in zip(errors, values, setting.centres, strict=False):
        np.subtract(value, centre, out=error)
    if elastic is not None:
        moved = elastic.errors(made.loads, count)
        errors += moved[: len(errors)]
        for output, parts in question.lengths:
            # A length is that of the deflected vector.
            vector = [values[part] + moved[part] for part in parts if part >= 0]
            errors[output] = np.linalg.norm(np.broadcast_arrays(*vector), axis=0) - setting.centres[output]
    valid = np.broadcast_to(solved.valid, (count,))
    return errors, valid if forces is None else valid & np.isfinite(errors).all(axis=0)


def problem_of(setting: Setting, sources: Sources) -> LimitStates:
    """Margins of the limits, nan where the mechanism cannot be assembled, with gradients where the model has them."""
    setting = setting.narrowed()
    question = setting.question

    def solved(u: Floats) -> tuple[Made, Floats, Floats]:
        made = sources.made(sources.at(u, directed=True))
        errors, valid = errors_of(setting, made, u.shape[1])
        distances = question.margins(errors)
        distances[:, ~valid] = np.nan
        return made, errors, distances

    def gradients(u: Floats) -> tuple[Floats, Floats]:
        made, errors, distances = solved(u)
        names = [name for part in made for name in part]
        forces = None if setting.forces is None else setting.forces.made(made.parameters)
        by_name = derivatives(
            setting.mechanism, solve(setting, made), question.channels, names, setting.rates, setting.elastic, forces
        )
        by_variable = np.einsum("cnp,ndp->cdp", by_name, slopes(varying, u, _SOURCE_STEP))
        return distances, question.margin_slopes(errors, by_variable)

    def varying(u: Floats) -> Floats:
        """Places, drives and loads, shape (names, n)."""
        parts = sources.made(sources.at(u, directed=True))
        return np.array([np.broadcast_to(value, (u.shape[1],)) for part in parts for value in part.values()])

    limits = LimitStates(len(sources.owners), lambda u: solved(u)[2], gradients, sources.circles)
    try:
        gradients(np.zeros((limits.dimension, 1)))
    except MechanismError:
        return LimitStates(limits.dimension, lambda u: solved(u)[2], circles=sources.circles)
    return limits


def generator(seed: int, *stream: int) -> np.random.Generator:
    """The stream of random numbers of this name; chunks of poses have their own, so that `jobs` changes no number."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy=seed, spawn_key=stream)))


@dataclass(frozen=True, eq=False)
class Sums:
    """Sums of errors about the nominal value, and of their products, over valid samples; chunks add up in order.

    Parameters
    ----------
    broken : ndarray of int, shape (limits,)
        Samples that break each limit, in the order of `ReliabilityQuestion.kept`.
    density : ndarray of int, shape (CELLS * CELLS,) or (0,)
        Samples in each cell, of `counted` samples.
    trend : ndarray, shape (steps, 3 + channels)
        Numbers of samples, valid ones and failures, and sums of errors, cumulated step by step.
    first : tuple of ndarray, each of shape (channels, n)
        Errors of valid samples of the first chunks.
    """

    samples: int
    valid: int
    failures: int
    broken: Ints
    errors: Floats
    products: Floats
    density: Ints
    counted: int
    trend: Floats
    first: tuple[Floats, ...]

    @cached_property
    def kept(self) -> Floats:
        """Errors of the samples that are kept, shape (channels, n)."""
        return np.concatenate([np.empty((len(self.errors), 0)), *self.first], axis=1)

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

    @property
    def estimate(self) -> Estimate:
        """Probability of failure from counted failures."""
        return counted(self.failures, self.samples, self.samples - self.valid, self.samples)

    def __add__(self, other: Sums) -> Sums:
        offset = np.concatenate([[self.samples, self.valid, self.failures], self.errors])
        return Sums(
            self.samples + other.samples,
            self.valid + other.valid,
            self.failures + other.failures,
            self.broken + other.broken,
            self.errors + other.errors,
            self.products + other.products,
            self.density + other.density if len(other.density) else self.density,
            self.counted + other.counted,
            np.concatenate([self.trend, other.trend + offset]) if len(other.trend) else self.trend,
            self.first + other.first,
        )


def simulate(
    settings: Sequence[Setting], sources: Sources, seed: int, samples: int, jobs: int | None = 1
) -> Iterator[tuple[int, Sums]]:
    """Sums of every chunk, and its pose: each chunk at all poses before the next, so that an interrupt keeps them."""
    work = partial(_simulated, settings, sources, seed, samples)
    return map_chunks(work, range(-(-samples // CHUNK) * len(settings)), jobs, travels=True)


def _simulated(
    settings: Sequence[Setting], sources: Sources, seed: int, samples: int, item: int
) -> tuple[int, Sums]:  # fmt: skip
    chunk, place = divmod(item, len(settings))
    count = min(CHUNK, samples - chunk * CHUNK)
    return settings[place].pose, simulate_chunk(settings[place], sources, seed, chunk, count)


def simulate_chunk(setting: Setting, sources: Sources, seed: int, chunk: int, count: int) -> Sums:
    """Sums of the errors of `count` made mechanisms at one pose.

    The first chunks also have the density, the trend and the errors.
    """
    made = sources.made(sources.draw(generator(seed, setting.pose, chunk), count))
    errors, valid = errors_of(setting, made, count)
    kept = setting.question.kept(errors)
    within = np.asarray(kept.all(axis=0))
    broken = np.array([count - np.count_nonzero(row) for row in kept], dtype=np.intp)
    failures, assembled = count - int(np.count_nonzero(within)), int(np.count_nonzero(valid))
    early = setting.followed and chunk < _TREND_CHUNKS
    trend = _trend(errors, valid, within) if early else np.zeros((0, 3 + len(errors)))
    if assembled < count:
        errors = errors[:, valid]
    # Row by row, which takes linear algebra half the time of so flat a product of matrices.
    sums, products = errors.sum(axis=1), np.array([errors @ row for row in errors])
    if setting.followed and not early and chunk.bit_count() == 1:
        trend = np.concatenate([[count, assembled, failures], sums])[None]
    density = np.zeros(0, dtype=np.intp)
    if setting.scale is not None and setting.question.pair is not None and chunk < _DENSITY_CHUNKS:
        density = _count_cells(*(
            (errors[k] - mean) / sigma for k, (mean, sigma) in zip(setting.question.pair, setting.scale, strict=True)
        ))  # fmt: skip
    return Sums(
        count, assembled, failures, broken, sums, products, density, assembled if len(density) else 0, trend,
        (errors,) if early else (),
    )  # fmt: skip


def _trend(errors: Floats, valid: Flags, within: Flags) -> Floats:
    begins = np.arange(0, len(valid), _TREND_STEP)
    steps = np.concatenate([[valid, ~within], np.where(valid, errors, 0.0)])
    counts = np.minimum(begins + _TREND_STEP, len(valid))
    return np.concatenate([counts[None], np.add.reduceat(steps, begins, axis=1).cumsum(axis=1)]).T


def _count_cells(x: Floats, y: Floats) -> Ints:
    """Samples in each cell of the density's grid, from standardised errors of both outputs, shape (n,)."""
    # A row of cells on either side counts what lies beyond the grid, or is nan.
    x, y = (
        np.fmin(np.fmax(np.floor((part + REACH) * (CELLS / (2 * REACH))), -1.0), float(CELLS)) + 1.0 for part in (x, y)
    )
    counts = np.bincount((x * (CELLS + 2) + y).astype(np.intp), minlength=(CELLS + 2) ** 2)
    return counts.reshape(CELLS + 2, -1)[1:-1, 1:-1].ravel()
