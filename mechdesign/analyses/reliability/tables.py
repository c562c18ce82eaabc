"""Tables of the reliability question, from the linear error model and the sums of the simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.analyses.reliability import drawn_tables
from mechdesign.analyses.reliability.answer import Answer
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.question import links_meant
from mechdesign.analyses.reliability.sobol import columns as index_columns
from mechdesign.results import Column, Table

# Where nothing was computed.
_UNKNOWN = Estimate(float("nan"), float("nan"), float("nan"), 0)


def build(answer: Answer) -> dict[str, Table]:
    """All tables, the main one first."""
    found = [moments(answer)]
    if answer.question.limited:
        found.append(success(answer))
    found.append(contributions(answer))
    found += drawn_tables.build(answer)
    return {table.name: table for table in found}


def moments(answer: Answer) -> Table:
    """Mean and standard deviation of every output and order at every pose."""
    known = [each for each in answer.found if each.mean is not None] or [answer.first_order]
    count, channels, methods = answer.poses.count, len(answer.question.channels), len(known)
    shape = (count, methods, channels)
    mean, sigma, worst = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    nominal = np.broadcast_to(answer.nominal.T[:, None, :], shape)
    sensitivity = answer.linear.sensitivity()
    worst[:] = (answer.linear.worst_case(sensitivity).T * answer.scale)[:, None]
    ends = [np.broadcast_to((end.T * answer.scale)[:, None], shape) for end in answer.linear.worst_ends(sensitivity)]
    for m, each in enumerate(known):
        assert each.mean is not None
        assert each.sigma is not None
        mean[:, m] = answer.nominal.T + each.mean.T * answer.scale
        sigma[:, m] = each.sigma.T * answer.scale
    output, order, unit = answer.labels
    rows = np.repeat(np.arange(count), methods * channels)
    columns = [
        *answer.at(rows),
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
        Column(
            "worst_case", worst.ravel(), meaning="sum of |sensitivity| times the larger end of the tolerance, in `unit`"
        ),
        Column("worst_low", ends[0].ravel(), meaning="lowest error that the tolerances allow, in `unit`"),
        Column("worst_high", ends[1].ravel(), meaning="highest error that the tolerances allow, in `unit`"),
        Column("unit", np.tile(unit, count * methods), meaning="unit of the six columns before"),
        Column("valid", answer.reason[rows] == 0, meaning="1 where the nominal pose is assembled, within its limits"),
    ]
    return Table("moments", tuple(columns), "mean and standard deviation of outputs per pose and method")


def success(answer: Answer) -> Table:
    """Reliability of every pose by every method, and of the whole cycle."""
    count, names = answer.poses.count, [each.method for each in answer.found]
    cycles = [k for k, each in enumerate(answer.found) if each.cycle is not None]
    rows = np.concatenate([np.repeat(np.arange(count), len(names)), np.zeros(len(cycles), dtype=np.intp)])
    method = np.concatenate([np.tile(np.arange(len(names)), count), np.array(cycles, dtype=np.intp)])
    whole = np.arange(len(rows)) >= count * len(names)
    estimates: list[Estimate] = []
    used = []
    for row, k, cycle in zip(rows.tolist(), method.tolist(), whole.tolist(), strict=True):
        each = answer.found[k]
        estimate = each.cycle if cycle else each.estimates.get(row)
        estimates.append(_UNKNOWN if estimate is None else estimate)
        source = each.used.get(row, each.method)
        used.append(source if not cycle else "monte_carlo" if estimates[-1].samples else "bounds")
    error = np.array([_error(e) for e in estimates])
    failure, low, high = (np.array([getattr(e, name) for e in estimates]) for name in ("failure", "low", "high"))
    samples, invalid, evaluations = (
        np.array([getattr(e, name) for e in estimates], dtype=np.int64)
        for name in ("samples", "invalid", "evaluations")
    )
    rho = np.array([
        np.nan if cycle or answer.found[k].rho is None else answer.found[k].rho[row]
        for row, k, cycle in zip(rows, method, whole, strict=True)
    ])  # fmt: skip
    valid = np.where(whole, (answer.reason == 0).all(), answer.reason[rows] == 0)
    kind = "99.7 %; of counted failures Clopper-Pearson"
    columns = [
        Column(
            "scope",
            np.where(whole, "cycle", "pose"),
            meaning="a pose by itself, or one made mechanism at all poses, the steps between unseen",
        ),
        *(replace(c, values=np.where(whole, np.nan, c.values)) for c in answer.at(rows)),
        Column("method", np.array(names)[method], meaning="how it was computed"),
        Column("reliability", 1.0 - failure, meaning="probability that every limit is kept"),
        Column("low", 1.0 - high, meaning=f"lower end of its interval, {kind}"),
        Column("high", 1.0 - low, meaning=f"upper end of its interval, {kind}"),
        Column(
            "failure",
            failure,
            meaning="1 - reliability, without loss of digits; 0 where no failure was seen, and failure_high bounds it",
        ),
        Column("failure_low", low, meaning=f"lower end of its interval, {kind}; of a cycle's bounds the worst pose's"),
        Column("failure_high", high, meaning=f"upper end of its interval, {kind}; of a cycle's bounds the poses' sum"),
        Column("error", error, meaning="3 sqrt(p (1 - p)/N) of the simulation [S2, eq. 16]; else half the interval"),
        Column("samples", samples, meaning="samples that the value is taken from; 0: none"),
        Column("invalid", invalid, meaning="samples that cannot be assembled; they are failures"),
        Column("evaluations", evaluations, meaning="mechanisms that were solved for it"),
        Column("used", np.array(used), meaning="where the value comes from: of auto, the method it used"),
    ]
    if answer.question.pair is not None:
        columns.append(Column("rho", rho, meaning="correlation of the two outputs"))
    columns.append(Column("valid", valid, meaning="1 where the nominal pose (all, of a cycle) is valid"))
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
        *answer.at(rows),
        Column("source", np.tile(names, count * channels), meaning="parameter, dimension, drive, or joint's clearance"),
        Column("output", np.tile(np.repeat(output, len(names)), count), meaning="coordinate"),
        Column("order", np.tile(np.repeat(order, len(names)), count), meaning="position, velocity or acceleration"),
        Column(
            "on",
            np.tile(
                np.repeat([links_meant(answer.study, c.coordinate) for c in answer.question.channels], len(names)),
                count,
            ),
            meaning="links whose point the output is, where its pin has a clearance: the pin moves in another link",
        ),
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
