"""Tables of the reliability question from the linear error model, the results of the methods, and their samples."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from mechdesign.ground.columns import Column
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Table
from mechdesign.questions.reliability import methods
from mechdesign.questions.reliability.columns import (
    CAPABILITY,
    CONTRIBUTIONS,
    CONVERGENCE,
    DENSITY,
    ESTIMATE,
    HISTOGRAM,
    MOMENTS,
    RELIABILITY,
)
from mechdesign.questions.reliability.engine.problem import Estimate, binomial, counted
from mechdesign.questions.reliability.first_order import correlation
from mechdesign.questions.reliability.question import ReliabilityQuestion, holders
from mechdesign.questions.reliability.simulation import CELLS, REACH, Sums
from mechdesign.questions.reliability.sobol import SobolIndices
from mechdesign.questions.reliability.task import MethodResult, Strings, Task

# Bins of a histogram.
_BINS = 60
# Largest distance of a histogram's errors from the mean, in standard deviations.
_FARTHEST = 6.0
# Standard deviation, as a share of the output's size, up to which it is rounding and the output constant.
_CONSTANT = 1e-12
# Estimate at poses that were not computed.
_UNKNOWN = Estimate(np.nan, np.nan, np.nan, 0)


def at_poses(task: Task, rows: Ints) -> list[Column]:
    """Columns of the poses of these rows."""
    return task.study.motion(task.poses).columns(rows)


def _channels(task: Task, channels: Ints) -> dict[str, Strings]:
    """Names of these channels, by columns."""
    output, order, _ = task.labels
    return {"output": output[channels], "order": order[channels]}


def _rows(*shape: int) -> list[Ints]:
    """The numbers along each axis of all rows of a table."""
    return [index.ravel() for index in np.indices(shape)]


def _with_moments(task: Task, results: Sequence[MethodResult]) -> Sequence[MethodResult]:
    """Results with moments of the errors; the first order's where no method has any."""
    return [result for result in results if result.sums or result.normal] or [methods.run("analytic", task)]


def _lost(results: Sequence[MethodResult], pose: Ints, method: Ints) -> Strings:
    """How many samples behind moments cannot be assembled, in words, for rows by pose and method."""

    def words(row: int, result: MethodResult) -> str:
        sums = result.sums.get(row) if result.normal is None else None
        lost = 0 if sums is None else sums.samples - sums.valid
        return f"{lost} of {sums.samples} samples cannot be assembled" if sums is not None and lost else ""

    pairs = {pair: words(pair[0], results[pair[1]]) for pair in {*zip(pose.tolist(), method.tolist(), strict=True)}}
    return np.array([pairs[pair] for pair in zip(pose.tolist(), method.tolist(), strict=True)], dtype=str)


def judged(
    task: Task,
    results: Sequence[MethodResult],
    indices: Mapping[int, SobolIndices],
    names: Collection[str] | None = None,
) -> Iterator[Table]:
    """Tables of what the methods say, or some of them; of limits only where there are any."""
    makers = {
        "moments": partial(moments, task, results), "reliability": partial(success, task, results),
        "capability": partial(capability, task, results), "contributions": partial(contributions, task, indices),
    }  # fmt: skip
    limits = () if task.question.limits else ("reliability", "capability")
    return (make() for name, make in makers.items() if name not in limits and (names is None or name in names))


def moments(task: Task, results: Sequence[MethodResult]) -> Table:
    """Mean and standard deviation of every output and order at every pose."""
    results = _with_moments(task, results)
    means, covariances = (np.stack(part) for part in zip(*(result.moments(task) for result in results), strict=True))
    scale, linear = task.scale, task.linear
    pose, method, channel = _rows(task.poses.count, len(results), len(scale))
    sigma = np.sqrt(np.maximum(covariances[method, pose, channel, channel], 0.0)) * scale[channel]

    def column(values: Floats) -> Floats:
        return np.asarray((values * scale[:, None])[channel, pose])

    nominal, low, high = (column(values) for values in (task.nominal, *linear.worst_ends()))
    table = MOMENTS.table(at_poses(task, pose) + MOMENTS.columns(
        {}, method=np.array([result.method for result in results])[method], **_channels(task, channel), nominal=nominal,
        mean=nominal + means[method, channel, pose] * scale[channel], sigma=sigma,
        worst_case=column(linear.worst_case()), worst_low=low, worst_high=high, unit=task.labels[2][channel],
        valid=task.reason[pose] == 0,
    ))  # fmt: skip
    return replace(table, unassembled=dict.fromkeys(("mean", "sigma"), _lost(results, pose, method)))


def success(task: Task, results: Sequence[MethodResult]) -> Table:
    """Reliability of every pose by every method, and of the whole cycle."""
    entries, length = [], task.poses.count // task.poses.designs
    for design, first in enumerate(range(0, task.poses.count, length)):
        entries += [(pose, result, result.estimates.get(pose, _UNKNOWN), result.used.get(pose, result.method), False)
                    for pose in range(first, first + length) for result in results]  # fmt: skip
        cycles = [(result, result.cycles[design]) for result in results if result.cycles]
        entries += [(first, result, cycle, "monte_carlo" if cycle.samples else "bounds", True)
                    for result, cycle in cycles]  # fmt: skip
    poses, methods_of, estimates, used, cycle_of = zip(*entries, strict=True)
    pose, whole = np.array(poses), np.array(cycle_of)
    failure, low, high, error, samples, invalid, evaluations = (
        np.array([getattr(e, name) for e in estimates])
        for name in ("failure", "low", "high", "error", "samples", "invalid", "evaluations")
    )
    columns = [
        *RELIABILITY.columns({}, scope=np.where(whole, "cycle", "pose")),
        *(replace(c, values=np.where(whole, np.nan, c.values)) for c in at_poses(task, pose)),
        *RELIABILITY.columns(
            {"kind of interval": "99.7 %; of counted failures Clopper-Pearson"},
            method=[result.method for result in methods_of], reliability=1.0 - failure, low=1.0 - high, high=1.0 - low,
            failure=failure, failure_low=low, failure_high=high, error=error, samples=samples, invalid=invalid,
            evaluations=evaluations, used=np.array(used), sigma_level=_sigma_level(failure), ppm=1e6 * failure,
        ),
    ]  # fmt: skip
    if task.question.pair is not None:
        pair = np.ix_(range(task.poses.count), task.question.pair, task.question.pair)
        values = np.full(len(whole), np.nan)
        values[~whole] = np.stack([correlation(result.moments(task)[1][pair]) for result in results], axis=1).ravel()
        columns += RELIABILITY.columns({}, rho=values)
    all_valid = (task.reason == 0).reshape(task.poses.designs, -1).all(axis=1)
    valid = np.where(whole, all_valid[pose // length], task.reason[pose] == 0)
    table = RELIABILITY.table([*columns, *RELIABILITY.columns({}, valid=valid)])
    lost = np.where(whole, "", _lost(results, pose, np.array([results.index(result) for result in methods_of])))
    return replace(table, unassembled={"rho": lost} if task.question.pair is not None else {})


def _sigma_level(failure: Floats) -> Floats:
    return np.asarray(-scipy.special.ndtri(failure))


def capability(task: Task, results: Sequence[MethodResult]) -> Table:
    """Process capability of each limited output by itself, at every pose by every method that has moments [ISO 22514].

    Limits of an error are added to the nominal value.
    """
    results, question = _with_moments(task, results), task.question.at(task.nominal)
    limits, single = question.limits, task.question.single
    shape = (task.poses.count, len(results), len(limits))
    pose, method, limit = _rows(*shape)
    rows, rounds = [limit.output for limit in limits], np.array([limit.round for limit in limits])
    scale = task.scale[rows]
    means, covariances = (np.stack(part) for part in zip(*(result.moments(task) for result in results), strict=True))
    # Circles have no value and no limits of a value: nan.
    sigma = np.sqrt(np.maximum(covariances[:, :, rows, rows].swapaxes(0, 1), 0.0))
    parts = (task.nominal[rows].T[:, None], np.moveaxis(means[:, rows], 2, 0), sigma)
    nominal, mean, sigma = (np.broadcast_to(np.where(rounds, np.nan, part * scale), shape) for part in parts)
    low, high = np.empty((2, *shape))
    for k, own in enumerate(limits):
        low[..., k], high[..., k] = (scale[k] * np.reshape(end, (-1, 1)) for end in (own.low, own.high))
    both = np.isfinite(low) & np.isfinite(high)
    cp = np.where(both, (high - low) / (6.0 * sigma), np.nan)
    cpk = np.where(np.isfinite(low) | np.isfinite(high), np.minimum(high - mean, mean - low) / (3.0 * sigma), np.nan)
    upper = np.where(np.isfinite(high), np.where(rounds, 0.0, nominal) + high, np.nan)
    estimates = [_by_limit(task, result, single) for result in results]
    failure, least, most = (
        np.array([[[getattr(by_pose.get(row, _UNKNOWN), name) for by_pose in limits] for limits in estimates]
                  for row in range(len(nominal))])
        for name in ("failure", "low", "high")
    )  # fmt: skip
    output, order, unit = (label[rows] for label in task.labels)
    output = np.array(
        [name.rpartition(".")[0] if own.round else name for name, own in zip(output, limits, strict=True)]
    )
    table = CAPABILITY.table(at_poses(task, pose) + CAPABILITY.columns(
        {}, method=np.array([result.method for result in results])[method], output=output[limit], order=order[limit],
        lsl=np.where(np.isfinite(low), nominal + low, np.nan).ravel(), usl=upper.ravel(), nominal=nominal.ravel(),
        mean=(nominal + mean).ravel(), sigma=sigma.ravel(), cp=cp.ravel(), cpk=cpk.ravel(),
        sigma_level=_sigma_level(failure).ravel(), ppm=1e6 * failure.ravel(), ppm_low=1e6 * least.ravel(),
        ppm_high=1e6 * most.ravel(), unit=unit[limit], valid=task.reason[pose] == 0,
    ))  # fmt: skip
    return replace(table, unassembled=dict.fromkeys(("mean", "sigma", "cp", "cpk"), _lost(results, pose, method)))


def _by_limit(task: Task, result: MethodResult, single: Sequence[ReliabilityQuestion]) -> list[dict[int, Estimate]]:
    """Estimates by pose for each limit alone: from normal errors, or from the failures counted among plain samples."""
    if len(single) == 1 and result.estimates:
        return [result.estimates]
    if result.normal is not None:
        return [methods.of_normal(task, question, *result.normal) for question in single]
    return [
        {pose: counted(int(sums.broken[k]), sums.samples, sums.samples - sums.valid, sums.samples)
         for pose, sums in result.sums.items()}
        for k in range(len(single))
    ]  # fmt: skip


def contributions(task: Task, indices: Mapping[int, SobolIndices]) -> Table:
    """Sensitivity to each source and its share of the variance, to the first order; Sobol' indices by pose."""
    sensitivity, share = (np.moveaxis(part, 2, 0) for part in (task.linear.sensitivity, task.linear.share()))
    pose, channel, source = _rows(*share.shape)
    names = np.array([source.name for source in task.sources.all])
    pins, study = [pin.quantity for pin in task.sources.pins], task.study
    turned = [study.units.angle_factor if quantity == "angle" else 1.0 for quantity in pins]
    factors = np.array([scalar.factor for scalar in task.sources.scalars] + turned)
    # A parameter without a known unit appears by its name in the derivative's unit.
    below = [scalar.name if scalar.unit is None else scalar.unit for scalar in task.sources.scalars]
    below += [study.units.label(quantity) for quantity in pins]
    units = np.array([[study.units.ratio(unit, of_source) for of_source in below] for unit in task.labels[2].tolist()])
    links = np.array([holders(task.study, channel) for channel in task.question.channels])
    table = CONTRIBUTIONS.table(at_poses(task, pose) + CONTRIBUTIONS.columns(
        {}, source=names[source], **_channels(task, channel), on=links[channel], sensitivity=sensitivity.ravel(),
        derivative=(sensitivity * task.scale[:, None] * factors).ravel(), unit=units[channel, source],
        share=share.ravel(), **_index_values(indices, share.shape),
    ))  # fmt: skip
    lost = {row: f"{own.invalid} of {own.samples} samples cannot be assembled" * (own.invalid > 0)
            for row, own in indices.items()}  # fmt: skip
    words = np.array([lost.get(row, "") for row in pose.tolist()], dtype=str)
    return replace(table, unassembled={name: words for name in table.names if name.startswith("sobol_")})


def _index_values(by_pose: Mapping[int, SobolIndices], shape: tuple[int, ...]) -> dict[str, Floats]:
    """``sobol_first``, ``sobol_first_low`` ... of all poses, channels and sources; none where not asked."""
    columns: dict[str, Floats] = {}
    for kind in ("first", "total") if by_pose else ():
        values = np.full((3, *shape), np.nan)
        for pose, indices in by_pose.items():
            values[:, pose] = getattr(indices, kind)
        columns |= {f"sobol_{kind}{end}": part.ravel() for end, part in zip(("", "_low", "_high"), values, strict=True)}
    return columns


def of_drawn(task: Task, sums: Mapping[int, Sums]) -> list[Table]:
    """Density, histogram, convergence and estimate tables, those that `sums` by pose have data for."""
    built = [_density(task, sums), _histogram(task, sums)]
    followed = next(((row, part) for row, part in sorted(sums.items()) if len(part.trend)), None)
    if followed is not None:
        built += [_convergence(task, *followed), _estimate(task, *followed) if task.question.limits else None]
    return [table for table in built if table is not None]


def _density(task: Task, sums: Mapping[int, Sums]) -> Table | None:
    """Density of the two outputs within 3 standard deviations: bivariate normal beside the simulated one [S2]."""
    pair = list(task.question.pair or ())
    rows = [row for row, part in sorted(sums.items()) if pair and len(part.density) and part.counted]
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
        columns.append(DENSITY["<output>_error"].column(errors.ravel(), task.labels[2][channel], output=names[k]))
    for axis, name, values in zip("xy", names, place, strict=True):
        columns += DENSITY.columns({"output": name}, **{axis: np.tile(values, len(rows))})
    columns += DENSITY.columns({}, normal=normal.ravel(), simulated=np.concatenate(simulated))
    return DENSITY.table(columns)


def _histogram(task: Task, sums: Mapping[int, Sums]) -> Table | None:
    """Each output's error at the pose that is shown, beside the normal law of the same mean and deviation."""
    row = next((row for row, part in sorted(sums.items()) if part.kept.shape[1] > 1), None)
    if row is None:
        return None
    units, nominal = task.labels[2], np.abs(task.nominal[:, row] * task.scale)
    varying, parts = [], []
    for k, error in enumerate(sums[row].kept * task.scale[:, None]):
        mean, sigma = float(error.mean()), float(error.std(ddof=1))
        # The deviation of a constant output is rounding, which scales with the lengths it is computed from.
        size = task.study.mechanism.size if units[k] == task.study.units.label("length") else 0.0
        if not sigma > _CONSTANT * max(size, float(nominal[units == units[k]].max())):
            continue
        low = max(float(error.min()), mean - _FARTHEST * sigma)
        high = min(float(error.max()), mean + _FARTHEST * sigma)
        count, edges = np.histogram(error, bins=_BINS, range=(low, high))
        middle = 0.5 * (edges[1:] + edges[:-1])
        normal = np.exp(-0.5 * ((middle - mean) / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi))
        varying.append(k)
        parts.append(np.stack([edges[:-1], edges[1:], count, normal]))
    if not parts:
        return None
    channel, samples = np.repeat(varying, _BINS), sums[row].kept.shape[1]
    low_, high_, count_, normal_ = np.concatenate(parts, axis=1)
    return HISTOGRAM.table(at_poses(task, np.full(len(channel), row)) + HISTOGRAM.columns(
        {"samples": str(samples)}, **_channels(task, channel), low=low_, high=high_, count=count_.astype(np.int64),
        density=count_ / (samples * (high_ - low_)), normal=normal_, unit=units[channel],
    ))  # fmt: skip


def _convergence(task: Task, row: int, sums: Sums) -> Table:
    """Mean of each output by the number of samples, at the pose that is shown [S3, Fig. 4]."""
    trend = sums.trend[sums.trend[:, 1] > 0]
    means = (task.nominal[:, row] + trend[:, 3:] / trend[:, 1:2]) * task.scale
    step, channel = _rows(*means.shape)
    return CONVERGENCE.table(at_poses(task, np.full(len(step), row)) + CONVERGENCE.columns(
        {}, samples=trend[step, 1].astype(np.int64), **_channels(task, channel), mean=means.ravel(),
        unit=task.labels[2][channel],
    ))  # fmt: skip


def _estimate(task: Task, row: int, sums: Sums) -> Table:
    """Share of failures by the number of samples, with its interval, at the pose that is shown."""
    samples, failures = (sums.trend[:, k].astype(np.int64) for k in (0, 2))
    interval = np.array([binomial(k, n) for k, n in zip(failures.tolist(), samples.tolist(), strict=True)])
    columns = ESTIMATE.columns(
        {}, samples=samples, failure=failures / samples, failure_low=interval[:, 0], failure_high=interval[:, 1]
    )
    return ESTIMATE.table([*at_poses(task, np.full(len(samples), row)), *columns])
