"""Tolerances from a reliability: the cheapest by the first-order model, confirmed by simulation.

Every pose by itself has to reach the reliability; how likely one mechanism keeps the limits over a whole cycle is not
asked. Where a simulated pose misses what was asked beyond its interval, the model's own target there is corrected by
as much as the two differ, and the tolerances are sought again: tighter ones where it fails too often, and cheaper ones
where the model holds the tolerances back for nothing.
"""

from __future__ import annotations

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mechdesign.analyses.poses import pose_columns, pose_in_words
from mechdesign.analyses.reliability.cheapest import TIGHTEST, WIDEST, Model, UnreachableError, cheapest
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.first_order import FirstOrder
from mechdesign.analyses.reliability.methods import METHODS
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.reliability.task import Partial, Task
from mechdesign.analyses.reliability.tolerances import retold, tolerances
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Column, Table
from mechdesign.study import Study
from mechdesign.study.loading import load_document
from mechdesign.study.poses import Poses
from mechdesign.study.rewriting import rewritten
from mechdesign.study.schema.reliability import Precision
from mechdesign.study.text.document import Document, Mark

# How often a target is corrected, and the failures that the study's own samples must show to confirm one.
_ROUNDS = 5
_SEEN = 100
# Half the width of the interval that `auto` confirms failures with, where the study does not say.
_PRECISION = 0.1
# A pose holds the tolerances back where its failures are so near to those allowed.
_ACTIVE = 0.99
# A share of the variance that is none.
_NOTHING = 1e-12
# A limit of 0 weighs as much as this one.
_NARROW = 1e-100


@dataclass(frozen=True, eq=False)
class Allocated:
    """What an allocation gives to the result.

    Parameters
    ----------
    tables : dict of str to Table
        ``allocation`` and ``confirmation``.
    failed : str
        Why what was asked is not reached.
    """

    tables: dict[str, Table] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    failed: str = ""


@dataclass(frozen=True, eq=False)
class _Round:
    """Tolerances, and what model and simulation say of them, by pose (in the order of the settings)."""

    scales: Floats
    allowed: Floats
    analytic: Floats
    simulated: Sequence[Estimate]

    def missed(self, asked: float) -> Flags:
        """Poses that fail more often than asked, beyond what chance explains."""
        return np.array([estimate.low > asked for estimate in self.simulated])

    def corrected(self, asked: float) -> Floats:
        """Failures that the model may have so that simulation has those asked."""
        low, found, most = (np.array([getattr(e, name) for e in self.simulated]) for name in ("low", "failure", "high"))
        idle = (most < asked) & (self.analytic > _ACTIVE * self.allowed)
        # Where few failures are seen, or none, the interval's end keeps the correction on the safe side.
        found = np.where(idle & (most > 2.0 * low), most, found)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(self.missed(asked) | idle, self.analytic * asked / found, self.allowed))


def allocate(study: Study, poses: Poses, task: Task) -> Allocated:
    """Allocate the tolerances of a study that asks for it."""
    section = study.reliability
    if section is None or section.allocate is None or not task.settings:
        return Allocated()
    reliability = section.allocate.reliability
    asked = 1.0 - reliability
    found = tolerances(study, task.sources)
    free = np.array([k for k, tolerance in enumerate(found) if tolerance.cost is not None], dtype=np.intp)
    precision = section.precision or Precision(relative=_PRECISION)
    settings = [replace(setting, trend=False, scale=None, keep=False) for setting in task.settings]
    model = Model(settings, task.sources, task.linear, found, free, np.full(len(free), WIDEST))
    method = "auto" if "auto" in section.methods or task.samples * asked < _SEEN else "monte_carlo"
    allowed = np.full(len(settings), asked)
    rounds: list[_Round] = []
    failed = ""
    while len(rounds) < _ROUNDS:
        try:
            scales = cheapest(model, allowed)
        except UnreachableError as error:
            failed = _unreachable(study, poses, model, error, allowed, asked)
            break
        scales[free] = [found[k].rounded(float(scales[k])) for k in free.tolist()]
        analytic = model.failures(scales, range(len(settings)))
        simulated = _simulated(study, model, scales, replace(task, settings=settings, precision=precision), method)
        rounds.append(_Round(scales, allowed, analytic, simulated))
        # What has no influence to the first order may have one that only simulation sees.
        idle = _idle(model, scales) & (scales[free] > 1.0)
        if idle.any() and rounds[-1].missed(asked).any():
            model = replace(model, widest=np.where(idle, 1.0, model.widest))
            continue
        allowed = rounds[-1].corrected(asked)
        if (allowed == rounds[-1].allowed).all():
            break
    if not rounds:
        return Allocated(failed=failed)
    met = [each for each in rounds if not each.missed(asked).any()]
    last = min(met, key=lambda each: model.cost(np.log(each.scales[free]))[0]) if met else rounds[-1]
    if met:
        failed = ""
    elif not failed:
        failed = _missed(study, poses, model, last, reliability, method)
    heading = f"Tolerances of {study.name}, the cheapest for a reliability of {reliability:.15g}"
    text, beside = rewritten(study, retold(study, found, last.scales), heading)
    tables = (_allocation(model, last), _confirmation(study, poses, model, last, reliability, method))
    return Allocated(
        {table.name: table for table in tables}, _notes(study, poses, model, last, len(rounds), reliability, method),
        {"allocated.yaml": text, **beside}, failed,
    )  # fmt: skip


def _simulated(study: Study, model: Model, scales: Floats, task: Task, method: str) -> list[Estimate]:
    """What simulation says of the study that is written, at each pose."""
    data = retold(study, model.tolerances, scales)
    name = str(study.path or "")
    path = study.path or pathlib.Path()
    document = Document(name, data, values={(): Mark(name)})
    other = load_document(document, path, study.text_sha256, study.overrides, study.seed, study.mechanism)
    sources, _ = find_sources(other)
    try:
        said = METHODS[method](replace(task, sources=sources, linear=_retold_linear(model.linear, sources)))
    except Partial as partial:
        # What it had found is not the answer to the study's own question.
        raise KeyboardInterrupt from partial
    return [said.estimates[setting.pose] for setting in model.settings]


def _retold_linear(linear: FirstOrder, sources: Sources) -> FirstOrder:
    known = sources.first_order
    mean, variance = (np.array([getattr(known[k], name) for k in linear.owner]) for name in ("mean", "variance"))
    return replace(linear, sources=known, mean=mean, variance=variance)


def _shares(model: Model, scales: Floats, k: int) -> Floats:
    """Share of each source in the variances of the limited errors at a pose, each over the square of its limit."""
    setting = model.settings[k]
    linear = model.with_scales(scales).take([setting.pose])
    share, variance = linear.share()[:, :, 0], linear.deviation()[:, 0] ** 2
    weights = np.zeros(len(variance))
    for band in setting.bands:
        weights[band.output] += 1.0 / max(min(abs(band.low), abs(band.high)), _NARROW) ** 2
    for disc in setting.discs:
        weights[[disc.x, disc.y]] += 1.0 / max(disc.radius, _NARROW) ** 2
    parts = np.nansum(share * (weights * variance)[:, None], axis=0)
    return np.asarray(parts / parts.sum()) if parts.sum() > 0 else np.full(len(parts), np.nan)


def _allocation(model: Model, last: _Round) -> Table:
    found, scales = model.tolerances, last.scales
    given = np.array([tolerance.given for tolerance in found])
    sizes = np.array([tolerance.size(scale) for tolerance, scale in zip(found, scales.tolist(), strict=True)])
    share = _shares(model, scales, int(np.argmax(last.analytic)))
    columns = (
        Column("source", np.array([tolerance.name for tolerance in found]), meaning="what varies"),
        Column("kind", np.array([tolerance.kind for tolerance in found]),
               meaning="tolerance: half its width; sigma; clearance: its mean radial clearance"),
        Column("given", given, meaning="as the study gives it, in `unit`"),
        Column("allocated", sizes, meaning="the cheapest, in `unit`"),
        Column("unit", np.array([tolerance.unit for tolerance in found]), meaning="unit of the two columns before"),
        Column("cost_given", np.array([tolerance.price(tolerance.given) for tolerance in found]),
               meaning="a/T^exponent; nan where it is held"),
        Column("cost_allocated", np.array([t.price(size) for t, size in zip(found, sizes.tolist(), strict=True)]),
               meaning="a/T^exponent; nan where it is held"),
        Column("share", share, meaning="share of the limited errors' variance (over the square of each limit) with the "
               "allocated tolerances, at the pose that fails most often"),
    )  # fmt: skip
    return Table("allocation", columns, "the cheapest tolerances that reach the reliability asked")


def _confirmation(study: Study, poses: Poses, model: Model, last: _Round, reliability: float, method: str) -> Table:
    rows = [setting.pose for setting in model.settings]
    said = last.simulated
    failure, low, high = (np.array([getattr(e, name) for e in said]) for name in ("failure", "low", "high"))
    columns = [
        *(Column(c.name, c.values[rows], c.unit, c.meaning) for c in pose_columns(study, poses)),
        Column("asked", np.full(len(rows), reliability), meaning="reliability asked for"),
        Column("target", 1.0 - last.allowed, meaning="what the analytic model had to reach for it"),
        Column("analytic", 1.0 - last.analytic, meaning="reliability by the first-order model"),
        Column("simulated", 1.0 - failure, meaning="reliability by simulation"),
        Column("low", 1.0 - high, meaning="lower end of its interval, 99.7 %"),
        Column("high", 1.0 - low, meaning="upper end of its interval, 99.7 %"),
        Column("method", np.full(len(rows), method), meaning="how it was simulated"),
        Column("evaluations", np.array([e.evaluations for e in said]), meaning="mechanisms that were solved for it"),
        Column("met", ~last.missed(1.0 - reliability), meaning="1 where the interval holds the reliability asked, or "
               "all of it is above"),
    ]  # fmt: skip
    return Table("confirmation", tuple(columns), "reliability of the allocated tolerances")


def _notes(
    study: Study, poses: Poses, model: Model, last: _Round, rounds: int, reliability: float, method: str
) -> list[str]:
    found = model.tolerances
    before, after = (
        sum(found[k].price(found[k].given * scales[k]) for k in model.free.tolist())
        for scales in (np.ones(len(found)), last.scales)
    )
    worst = int(np.argmax([estimate.failure for estimate in last.simulated]))
    estimate = last.simulated[worst]
    notes = [
        f"allocated: the tolerances cost {after:.6g} in place of {before:.6g}; asked is a reliability of "
        f"{reliability:.15g}, and at {pose_in_words(study, poses, model.settings[worst].pose)}, the worst pose, it is "
        f"{_plain(last.analytic[worst])} by the analytic model and {_plain(estimate.failure)} ("
        f"{_plain(estimate.high)} to {_plain(estimate.low)}) by {method}"
    ]
    if rounds > 1:
        notes.append(
            f"allocated: simulation and the analytic model differ; the target of the model was corrected {rounds - 1} "
            "times"
        )
    idle = _idle(model, last.scales)
    for k, scale, widest, nothing in zip(model.free, last.scales[model.free], model.widest, idle, strict=True):
        name = found[k].name
        if scale < TIGHTEST * 1.001:
            notes.append(f"allocated: '{name}' is as tight as allowed, {TIGHTEST:g} times the given tolerance")
        elif widest < WIDEST:
            notes.append(
                f"allocated: '{name}' has no influence on the limited errors to the first order, but a wider one "
                "breaks the limits; it keeps the given tolerance"
            )
        elif nothing:
            notes.append(
                f"allocated: '{name}' has no influence on the limited errors; it gets {WIDEST:g} times the given "
                "tolerance, the widest allowed"
            )
        elif scale > WIDEST * 0.999:
            notes.append(f"allocated: '{name}' is as wide as allowed, {WIDEST:g} times the given tolerance")
    return notes


def _idle(model: Model, scales: Floats) -> Flags:
    """Allocated tolerances that change no limited error at any pose, to the first order."""
    shares = [_shares(model, scales, k)[model.free] for k in range(len(model.settings))]
    return np.asarray(~(np.abs(shares) > _NOTHING).any(axis=0))


def _plain(failure: float) -> str:
    """A reliability with as many digits as tell it from 1."""
    digits = 6 if failure <= 0 else max(6, int(np.ceil(-np.log10(failure))) + 3)
    return f"{1.0 - failure:.{digits}f}".rstrip("0").rstrip(".")


def _missed(study: Study, poses: Poses, model: Model, last: _Round, reliability: float, method: str) -> str:
    worst = int(np.argmax([estimate.failure for estimate in last.simulated]))
    estimate = last.simulated[worst]
    return (
        f"allocate: the reliability asked, {reliability:.15g}, is not confirmed at "
        f"{pose_in_words(study, poses, model.settings[worst].pose)}: with tolerances for which the analytic model says "
        f"{_plain(last.analytic[worst])}, {method} finds {_plain(estimate.failure)} ({_plain(estimate.high)} to "
        f"{_plain(estimate.low)})"
    )


def _unreachable(
    study: Study, poses: Poses, model: Model, error: UnreachableError, allowed: Floats, asked: float
) -> str:
    """Why the tightest tolerances do not do, and what they reach."""
    # SciPy takes a quarter of a second to import, and a study without limits does not need it.
    from mechdesign.analyses.reliability.probability import failure_probability

    worst = int(np.argmax(error.failures / allowed))
    pose = pose_in_words(study, poses, model.settings[worst].pose)
    tightest = model.scales(np.full(len(model.free), np.log(TIGHTEST)))
    share = _shares(model, tightest, worst)
    held = [
        f"{tolerance.name} ({share[k]:.0%})"
        for k, tolerance in sorted(enumerate(model.tolerances), key=lambda pair: -share[pair[0]])
        if tolerance.cost is None and share[k] > 0.005
    ]
    target = f"{_plain(asked)}"
    if allowed[worst] < asked:
        target += f" (for which the analytic model, as simulation shows, has to reach {_plain(allowed[worst])})"
    linear = model.with_scales(tightest).take([model.settings[worst].pose])
    centred = failure_probability(linear.covariance()[0], model.settings[worst].bands, model.settings[worst].discs)
    if linear.shift().any() and centred <= allowed[worst]:
        reason = "the mean errors, which the width of no tolerance changes, break the limits by themselves"
        held = []
    elif held:
        reason = f"what is held breaks the limits by itself: {', '.join(held)}"
    else:
        reason = "they would have to shrink to nothing"
    return (
        f"allocate: a reliability of {target} cannot be reached at {pose}: with all tolerances at {TIGHTEST:g} times "
        f"the given ones it is {_plain(error.failures[worst])}; {reason}"
        + ("; a clearance that 'cost' names is allocated too" if held else "")
    )
