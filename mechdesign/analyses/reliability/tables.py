"""Tables of the reliability question, from the linear error model and the sums of the simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.error_limits import correlation
from mechdesign.analyses.reliability.first_order import ORDERS, FirstOrder
from mechdesign.analyses.reliability.methods import Found
from mechdesign.analyses.reliability.simulation import CELLS, REACH, Sums
from mechdesign.analyses.reliability.sobol import Indices
from mechdesign.analyses.reliability.sobol import columns as index_columns
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

if TYPE_CHECKING:
    from mechdesign.analyses.reliability.analysis import Question

Floats = NDArray[np.float64]

_KINDS = {
    "length": ("length", "velocity", "acceleration"),
    "angle": ("angle", "angular_velocity", "angular_acceleration"),
    "none": ("none", "none", "none"),
}


@dataclass(frozen=True, eq=False)
class Answer:
    """All that the tables are made from.

    Parameters
    ----------
    reason : int8 array, shape (poses,)
    nominal : ndarray, shape (channels, poses)
        In study units.
    found : sequence of Found
        What each method says.
    first_order : Found
        What the analytic method says, whose moments stand in where no method gives any.
    indices : dict of int to Indices
        Sobol' indices by pose, where they are asked.
    """

    study: Study
    poses: Poses
    question: Question
    reason: NDArray[np.int8]
    nominal: Floats
    linear: FirstOrder
    found: Sequence[Found]
    first_order: Found
    indices: Mapping[int, Indices] = field(default_factory=dict)

    @property
    def sums(self) -> dict[int, Sums]:
        """By pose, of the first method that samples the errors."""
        return next((each.sums for each in self.found if each.sums), {})

    @property
    def scale(self) -> Floats:
        """Study units in one unit of the core, shape (channels,)."""
        turn = 1.0 / self.study.units.angle_factor
        return np.array([turn if c.coordinate.quantity == "angle" else 1.0 for c in self.question.channels])

    @property
    def labels(self) -> tuple[list[str], list[str], list[str]]:
        """Output, order and unit of each channel."""
        channels = self.question.channels
        return (
            [c.coordinate.name for c in channels],
            [ORDERS[c.order] for c in channels],
            [self.study.units.label(_KINDS[c.coordinate.quantity][c.order]) for c in channels],
        )


def build(answer: Answer) -> dict[str, Table]:
    """All tables, the main one first."""
    found = [moments(answer)]
    if answer.question.limited:
        found.append(success(answer))
    found.append(contributions(answer))
    found += [table for make in (density, convergence) if (table := make(answer)) is not None]
    return {table.name: table for table in found}


def _poses(answer: Answer, rows: NDArray[np.intp]) -> list[Column]:
    return [Column(c.name, c.values[rows], c.unit, c.meaning) for c in pose_columns(answer.study, answer.poses)]


def moments(answer: Answer) -> Table:
    """Mean and standard deviation of every output and order at every pose."""
    known = [each for each in answer.found if each.mean is not None] or [answer.first_order]
    count, channels, methods = answer.poses.count, len(answer.question.channels), len(known)
    shape = (count, methods, channels)
    mean, sigma, worst = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    nominal = np.broadcast_to(answer.nominal.T[:, None, :], shape)
    worst[:] = (answer.linear.worst_case(answer.linear.sensitivity()).T * answer.scale)[:, None]
    for m, each in enumerate(known):
        assert each.mean is not None
        assert each.sigma is not None
        mean[:, m] = answer.nominal.T + each.mean.T * answer.scale
        sigma[:, m] = each.sigma.T * answer.scale
    output, order, unit = answer.labels
    rows = np.repeat(np.arange(count), methods * channels)
    columns = [
        *_poses(answer, rows),
        Column(
            "method",
            np.tile(np.repeat([each.method for each in known], channels), count),
            meaning="how it was computed",
        ),
        Column("output", np.tile(output, count * methods), meaning="coordinate"),
        Column("order", np.tile(order, count * methods), meaning="position, velocity or acceleration"),
        Column("nominal", nominal.ravel(), meaning="value of the nominal mechanism, in `unit`"),
        Column("mean", mean.ravel(), meaning="mean over made mechanisms, in `unit`"),
        Column("sigma", sigma.ravel(), meaning="standard deviation of the error, in `unit`"),
        Column("worst_case", worst.ravel(), meaning="sum of |sensitivity| times tolerance, in `unit`"),
        Column("unit", np.tile(unit, count * methods), meaning="unit of the four columns before"),
        Column("valid", answer.reason[rows] == 0, meaning="1 where the nominal pose is assembled, within its limits"),
    ]
    return Table("moments", tuple(columns), "mean and standard deviation of outputs per pose and method")


def success(answer: Answer) -> Table:
    """Reliability of every pose by every method."""
    question, count, methods = answer.question, answer.poses.count, len(answer.found)
    names = ("failure", "failure_low", "failure_high", "error", "rho")
    values = {name: np.full((count, methods), np.nan) for name in names}
    numbers = {name: np.zeros((count, methods), dtype=np.int64) for name in ("samples", "invalid", "evaluations")}
    used = np.full((count, methods), "", dtype=object)
    for m, each in enumerate(answer.found):
        if each.rho is not None:
            values["rho"][:, m] = each.rho
        used[:, m] = each.method
        for row, estimate in each.estimates.items():
            values["failure"][row, m], values["failure_low"][row, m], values["failure_high"][row, m] = (
                estimate.failure, estimate.low, estimate.high,
            )  # fmt: skip
            values["error"][row, m] = _error(estimate)
            for name, column in numbers.items():
                column[row, m] = getattr(estimate, name)
            used[row, m] = each.used.get(row, each.method)
    rows = np.repeat(np.arange(count), methods)
    kind = "99.7 %; of counted failures Clopper-Pearson"
    columns = [
        Column("scope", np.full(count * methods, "pose"), meaning="each pose by itself"),
        *_poses(answer, rows),
        Column("method", np.tile([each.method for each in answer.found], count), meaning="how it was computed"),
        Column("reliability", 1.0 - values["failure"].ravel(), meaning="probability that every limit is kept"),
        Column("low", 1.0 - values["failure_high"].ravel(), meaning=f"lower end of its interval, {kind}"),
        Column("high", 1.0 - values["failure_low"].ravel(), meaning=f"upper end of its interval, {kind}"),
        Column("failure", values["failure"].ravel(), meaning="1 - reliability, without loss of digits"),
        Column("failure_low", values["failure_low"].ravel(), meaning=f"lower end of its interval, {kind}"),
        Column("failure_high", values["failure_high"].ravel(), meaning=f"upper end of its interval, {kind}"),
        Column("error", values["error"].ravel(), meaning="3 sqrt(p (1 - p)/N) of the simulation [S2, eq. 16]"),
        Column("samples", numbers["samples"].ravel(), meaning="samples that the value is taken from; 0: none"),
        Column("invalid", numbers["invalid"].ravel(), meaning="samples that cannot be assembled; they are failures"),
        Column("evaluations", numbers["evaluations"].ravel(), meaning="mechanisms that were solved for it"),
        Column("used", used.ravel().astype(str), meaning="where the value comes from: of auto, the method it used"),
    ]
    if question.pair is not None:
        columns.append(Column("rho", values["rho"].ravel(), meaning="correlation of the two outputs"))
    columns.append(Column("valid", answer.reason[rows] == 0, meaning="1 where the nominal pose is valid"))
    return Table("reliability", tuple(columns), "probability that the errors keep their limits")


def _error(estimate: Estimate) -> float:
    """Three standard errors of counted failures [S2, eq. 16]; of another method half its interval."""
    if estimate.samples and estimate.failure == estimate.failures / estimate.samples:
        # SciPy takes a quarter of a second to import, and only a study with limits needs it.
        from mechdesign.analyses.reliability.engine.intervals import simulation_error

        return simulation_error(estimate.failure, estimate.samples)
    return 0.5 * (estimate.high - estimate.low)


def contributions(answer: Answer) -> Table:
    """Sensitivity to each source and its share of the variance, to the first order."""
    linear, count, channels = answer.linear, answer.poses.count, len(answer.question.channels)
    names = [source.name for source in linear.sources]
    sensitivity = linear.sensitivity()
    share = linear.share()
    output, order, _ = answer.labels
    rows = np.repeat(np.arange(count), channels * len(names))
    columns = [
        *_poses(answer, rows),
        Column("source", np.tile(names, count * channels), meaning="parameter, dimension, drive, or joint's clearance"),
        Column("output", np.tile(np.repeat(output, len(names)), count), meaning="coordinate"),
        Column("order", np.tile(np.repeat(order, len(names)), count), meaning="position, velocity or acceleration"),
        Column(
            "sensitivity",
            np.moveaxis(sensitivity, 2, 0).ravel(),
            meaning="derivative by the source, all angles in radians; a pin's is sqrt(s_x^2 + s_y^2)",
        ),
        Column("share", np.moveaxis(share, 2, 0).ravel(), meaning="share of the output's variance, to the first order"),
    ]
    if answer.indices:
        columns += index_columns(answer.indices, (count, channels, len(names)))
    return Table("contributions", tuple(columns), "what the errors come from")


def density(answer: Answer) -> Table | None:
    """Density of the two outputs over +-3 standard deviations: bivariate normal beside the simulated one [S2]."""
    pair, linear = answer.question.pair, answer.linear
    if pair is None:
        return None
    centres = (np.arange(CELLS) + 0.5) * (2 * REACH / CELLS) - REACH
    x, y = (grid.ravel() for grid in np.meshgrid(centres, centres, indexing="ij"))
    rows, normal, simulated, scales = [], [], [], []
    covariance = linear.covariance()
    for row, sums in sorted(answer.sums.items()):
        if not len(sums.density):
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
    if not rows:
        return None
    cells, sigma = CELLS * CELLS, np.array(scales)
    output, _, unit = answer.labels
    names = [output[k] for k in pair]
    columns = [
        *_poses(answer, np.repeat(np.array(rows, dtype=np.intp), cells)),
        Column(f"{names[0]}_error", np.outer(sigma[:, 0], x).ravel(), unit[pair[0]], "centre of the cell"),
        Column(f"{names[1]}_error", np.outer(sigma[:, 1], y).ravel(), unit[pair[1]], "centre of the cell"),
        Column("x", np.tile(x, len(rows)), meaning=f"error of {names[0]} in standard deviations of the first order"),
        Column("y", np.tile(y, len(rows)), meaning=f"error of {names[1]} in standard deviations of the first order"),
        Column("normal", np.concatenate(normal), meaning="bivariate normal density, standardised"),
        Column("simulated", np.concatenate(simulated), meaning="density of the samples, standardised"),
    ]
    return Table("density", tuple(columns), "density of two errors: bivariate normal and simulation [S2, Figs. 4, 5]")


def convergence(answer: Answer) -> Table | None:
    """Mean of each output after so many samples, at the first pose [S3, Fig. 4]."""
    followed = [(row, sums) for row, sums in sorted(answer.sums.items()) if len(sums.trend)]
    if not followed:
        return None
    row, sums = followed[0]
    samples, means = sums.trend[:, :1], sums.trend[:, 1:] / sums.trend[:, :1]
    means = answer.nominal[:, row] + means * answer.scale
    output, order, unit = answer.labels
    steps, channels = means.shape
    columns = [
        *_poses(answer, np.full(steps * channels, row)),
        Column("samples", np.repeat(samples[:, 0].astype(np.int64), channels), meaning="valid samples so far"),
        Column("output", np.tile(output, steps), meaning="coordinate"),
        Column("order", np.tile(order, steps), meaning="position, velocity or acceleration"),
        Column("mean", means.ravel(), meaning="their mean, in `unit`"),
        Column("unit", np.tile(unit, steps), meaning="unit of the mean"),
    ]
    return Table("convergence", tuple(columns), "trend of the means with the number of samples [S3, Fig. 4]")
