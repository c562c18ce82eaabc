"""Tables of the reliability question, from the linear error model and what each method says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.poses import pose_columns
from mechdesign.analyses.reliability import methods
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.engine.sobol import SobolIndices
from mechdesign.analyses.reliability.question import links_meant
from mechdesign.analyses.reliability.sobol import columns as index_columns
from mechdesign.analyses.reliability.task import MethodResult, Task
from mechdesign.numerics.arrays import Ints
from mechdesign.results import Column, Table

# Where nothing was computed.
_UNKNOWN = Estimate(np.nan, np.nan, np.nan, 0)


def at_poses(task: Task, rows: Ints) -> list[Column]:
    """Columns of the poses of these rows."""
    return pose_columns(task.study, task.poses, rows)


def of_channels(task: Task, channels: Ints) -> list[Column]:
    """Columns of the names of these channels."""
    output, order, _ = task.labels
    return shared(task.study.units, output=output[channels], order=order[channels])


def moments(task: Task, found: Sequence[MethodResult]) -> Table:
    """Mean and standard deviation of every output and order at every pose."""
    known = [each for each in found if each.mean is not None] or [methods.run("analytic", task)]
    scale, linear = task.scale[:, None], task.linear
    shape = (task.poses.count, len(known), len(scale))
    pose, method, channel = (index.ravel() for index in np.indices(shape))
    mean, sigma = (
        np.stack([getattr(each, name) for each in known])[method, channel, pose] * scale[channel, 0]
        for name in ("mean", "sigma")
    )
    nominal = (task.nominal * scale)[channel, pose]
    low, high = linear.worst_ends()
    columns = [
        *at_poses(task, pose),
        *shared(task.study.units, method=np.array([each.method for each in known])[method]),
        *of_channels(task, channel),
        Column("nominal", nominal, meaning="value of the nominal mechanism, in `unit`"),
        Column("mean", nominal + mean, meaning="mean over made mechanisms, in `unit`"),
        Column("sigma", sigma, meaning="standard deviation of the error, in `unit`"),
        Column("worst_case", (linear.worst_case() * scale)[channel, pose],
               meaning="sum of |sensitivity| times the larger end of the tolerance, in `unit`"),
        Column("worst_low", (low * scale)[channel, pose], meaning="lowest error that the tolerances allow, in `unit`"),
        Column("worst_high", (high * scale)[channel, pose],
               meaning="highest error that the tolerances allow, in `unit`"),
        Column("unit", task.labels[2][channel], meaning="unit of the six columns before"),
        *shared(task.study.units, valid=task.reason[pose] == 0),
    ]  # fmt: skip
    return Table("moments", tuple(columns), "mean and standard deviation of outputs per pose and method")


def success(task: Task, found: Sequence[MethodResult]) -> Table:
    """Reliability of every pose by every method, and of the whole cycle."""
    entries = [(pose, each, each.estimates.get(pose, _UNKNOWN)) for pose in range(task.poses.count) for each in found]
    cycles = [(0, each, each.cycle) for each in found if each.cycle is not None]
    whole = np.arange(len(entries) + len(cycles)) >= len(entries)
    pose = np.array([row for row, _, _ in entries + cycles])
    used = [each.used.get(row, each.method) for row, each, _ in entries]
    used += ["monte_carlo" if estimate.samples else "bounds" for _, _, estimate in cycles]
    rho = [np.nan if each.rho is None else each.rho[row] for row, each, _ in entries] + [np.nan] * len(cycles)
    estimates = [estimate for _, _, estimate in entries + cycles]
    failure, low, high, error = (
        np.array([getattr(e, name) for e in estimates]) for name in ("failure", "low", "high", "error")
    )
    samples, invalid, evaluations = (
        np.array([getattr(e, name) for e in estimates], dtype=np.int64)
        for name in ("samples", "invalid", "evaluations")
    )
    kind = "99.7 %; of counted failures Clopper-Pearson"
    columns = [
        Column("scope", np.where(whole, "cycle", "pose"),
               meaning="a pose by itself, or one made mechanism at all poses, the steps between unseen"),
        *(replace(c, values=np.where(whole, np.nan, c.values)) for c in at_poses(task, pose)),
        *shared(task.study.units, method=[each.method for _, each, _ in entries + cycles]),
        Column("reliability", 1.0 - failure, meaning="probability that every limit is kept"),
        Column("low", 1.0 - high, meaning=f"lower end of its interval, {kind}"),
        Column("high", 1.0 - low, meaning=f"upper end of its interval, {kind}"),
        Column("failure", failure, meaning="1 - reliability, without loss of digits; 0 where no failure was seen, and "
               "failure_high bounds it"),
        Column("failure_low", low, meaning=f"lower end of its interval, {kind}; of a cycle's bounds the worst pose's"),
        Column("failure_high", high, meaning=f"upper end of its interval, {kind}; of a cycle's bounds the poses' sum"),
        Column("error", error,
               meaning="3 sqrt(p (1 - p)/N) of the simulation [S2, eq. 16]; else half the interval"),
        Column("samples", samples, meaning="samples that the value is taken from; 0: none"),
        Column("invalid", invalid, meaning="samples that cannot be assembled; they are failures"),
        *shared(task.study.units, evaluations=evaluations),
        Column("used", np.array(used), meaning="where the value comes from: of auto, the method it used"),
    ]  # fmt: skip
    if task.question.pair is not None:
        columns.append(Column("rho", np.array(rho), meaning="correlation of the two outputs"))
    valid = np.where(whole, (task.reason == 0).all(), task.reason[pose] == 0)
    columns.append(Column("valid", valid, meaning="1 where the nominal pose (all, of a cycle) is valid"))
    return Table("reliability", tuple(columns), "probability that the errors keep their limits")


def contributions(task: Task, indices: Mapping[int, SobolIndices]) -> Table:
    """Sensitivity to each source and its share of the variance, to the first order; Sobol' indices by pose."""
    sensitivity, share = (np.moveaxis(part, 2, 0) for part in (task.linear.sensitivity, task.linear.share()))
    pose, channel, source = (index.ravel() for index in np.indices(share.shape))
    names = np.array([source.name for source in task.sources.all])
    links = np.array([links_meant(task.study, c.coordinate) for c in task.question.channels])
    columns = [
        *at_poses(task, pose),
        Column("source", names[source], meaning="parameter, dimension, drive, or joint's clearance"),
        *of_channels(task, channel),
        Column("on", links[channel],
               meaning="links whose point the output is, where its pin has a clearance: the pin moves in another link"),
        Column("sensitivity", sensitivity.ravel(),
               meaning="derivative by the source, all angles in radians; a pin's is sqrt(s_x^2 + s_y^2)"),
        Column("share", share.ravel(), meaning="share of the output's variance, to the first order"),
        *index_columns(indices, share.shape),
    ]  # fmt: skip
    return Table("contributions", tuple(columns), "what the errors come from")
