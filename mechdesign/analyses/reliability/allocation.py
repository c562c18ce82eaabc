"""Tolerances from a reliability: the cheapest by the first-order model, confirmed by simulation.

Every pose by itself has to reach the reliability, not a whole cycle. Where simulation and model differ beyond the
interval, the model's target is corrected by their ratio and the tolerances are sought again: tighter where the pose
fails too often, cheaper where the model holds them back needlessly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.reliability import methods
from mechdesign.analyses.reliability.cheapest import (
    DIGITS,
    TIGHTEST,
    WIDEST,
    Tolerance,
    ToleranceModel,
    cheapest,
    distance,
    tolerances,
)
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.tables import at_poses
from mechdesign.analyses.reliability.task import Partial, Task
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.reliability import Precision, ReliabilitySection
from mechdesign.study.schema.variation import Clearance, Dimension
from mechdesign.study.text.document import plain
from mechdesign.study.variants import rewritten

# How often the model's target is corrected, and the part of a bracket that each correction leaves out at least.
_MAX_ROUNDS = 14
_BRACKET_PART = 0.1
# Expected failures from which on the study's own samples confirm them.
_ENOUGH_FAILURES = 100
# Relative precision by which `auto` confirms failures, where the study does not say.
_PRECISION = 0.1
# Share of the failures asked that a simulation which sees none is counted for at most.
_UNSEEN = 0.01
# A pose holds the tolerances back from this share of the failures allowed on.
_ACTIVE = 0.99
# Share of the variance from which on what is held is to blame.
_HELD_SHARE = 0.005
# Largest share of the variance that counts as none.
_NO_SHARE = 1e-12
# A limit of 0 weighs as much as this one.
_NARROWEST = 1e-100


@dataclass(frozen=True, eq=False)
class _Round:
    """Tolerances, and their failures by the model and by simulation, by pose in the order of the settings."""

    model: ToleranceModel
    scales: Floats
    allowed: Floats
    analytic: Floats
    simulated: Sequence[Estimate]
    method: str

    def missed(self, asked: float) -> Flags:
        """Poses that fail more often than asked, beyond what chance explains."""
        return np.array([estimate.low > asked for estimate in self.simulated])

    def idle(self, asked: float) -> Flags:
        """Poses that fail less often than asked, beyond what chance explains, though the model holds them back."""
        often = np.array([estimate.high >= asked and estimate.failure > 0 for estimate in self.simulated])
        return np.asarray(~often & (self.analytic > _ACTIVE * self.allowed))

    def distances(self, asked: float) -> tuple[Floats, Floats]:
        """Of the limits by the model, and by simulation less the one asked, see `cheapest.distance`, by pose."""
        # Where few failures are seen, or none, the interval's end keeps the correction on the safe side.
        seen = [min(e.high, _UNSEEN * asked) if not e.failure else e.high if 2.0 * e.low < e.high < asked else e.failure
                for e in self.simulated]  # fmt: skip
        return distance(self.analytic), distance(np.array(seen)) - float(distance(np.array(asked)))

    def worst(self) -> tuple[str, str, str]:
        """In words: the pose that fails most often, its reliability by the model, and by simulation."""
        k = int(np.argmax([estimate.failure for estimate in self.simulated]))
        estimate = self.simulated[k]
        simulated = f"{_plain(estimate.failure)} ({_plain(estimate.high)} to {_plain(estimate.low)})"
        return self.model.task.where(self.model.task.settings[k].pose), _plain(self.analytic[k]), simulated


def allocate(task: Task, section: ReliabilitySection) -> Result:
    """Allocate the tolerances of a study that asks for it: tables, notes, and the study that has them."""
    if section.allocate is None or not task.settings:
        return Result("allocation", {})
    study, reliability = task.study, section.allocate.reliability
    asked = 1.0 - reliability
    found = tolerances(study, task.sources)
    free = np.array([k for k, tolerance in enumerate(found) if tolerance.cost is not None], dtype=np.intp)
    task = replace(task, settings=[replace(setting, scale=None, followed=False) for setting in task.settings])
    if section.precision is None:
        task = replace(task, precision=Precision(relative=_PRECISION))
    model = ToleranceModel(task, found, free, np.full(len(free), WIDEST))
    method = "auto" if "auto" in section.methods or task.samples * asked < _ENOUGH_FAILURES else "monte_carlo"
    allowed = np.full(len(task.settings), asked)
    rounds: list[_Round] = []
    failed = ""
    while len(rounds) < _MAX_ROUNDS:
        scales = cheapest(model, allowed)
        scales[free] = [found[k].rounded(float(scales[k])) for k in free.tolist()]
        analytic = model.failures(scales, range(len(task.settings)))
        last = _Round(model, scales, allowed, analytic, _simulated(model, scales, method), method)
        rounds.append(last)
        missed = last.missed(asked)
        if missed.any() and (scales[free] < TIGHTEST * 1.001).all():
            failed = _unreachable(last, asked)
            break
        # What has no influence to the first order may have one that only simulation sees.
        without = _idle(model, scales) & (scales[free] > 1.0)
        if without.any() and missed.any():
            model = replace(model, widest=np.where(without, 1.0, model.widest))
            continue
        wrong = missed | last.idle(asked)
        if not wrong.any():
            break
        allowed = np.where(wrong, _corrected(rounds, asked), allowed)
    met = [each for each in rounds if not each.missed(asked).any()]
    if not met and failed:
        return Result("allocation", {}, failed=failed)
    last = min(met, key=lambda each: model.cost(np.log(each.scales[free]))[0]) if met else rounds[-1]
    where, by_model, by_simulation = last.worst()
    failed = ""
    if not met:
        failed = (
            f"allocate: the reliability asked, {reliability:.15g}, is not confirmed at {where}: with tolerances for "
            f"which the analytic model says {by_model}, {method} finds {by_simulation}"
        )
    before, after = (sum(found[k].price(found[k].given * scales[k]) for k in free.tolist())
                     for scales in (np.ones(len(found)), last.scales))  # fmt: skip
    notes = [
        f"allocated: the tolerances cost {after:.6g} in place of {before:.6g}; asked is a reliability of "
        f"{reliability:.15g}, and at {where}, the worst pose, it is {by_model} by the analytic model and "
        f"{by_simulation} by {method}"
    ]
    if len(rounds) > 1:
        notes.append(
            "allocated: simulation and the analytic model differ; the target of the model was corrected "
            f"{len(rounds) - 1} times"
        )
    heading = f"Tolerances of {study.name}, the cheapest for a reliability of {reliability:.15g}"
    text, others = rewritten(study, allocated_data(study, found, last.scales), heading)
    tables = {"allocation": _allocation(last), "confirmation": _confirmation(last, reliability)}
    notes += _ends(replace(last, model=model))
    return Result("allocation", tables, notes, failed=failed, files={"allocated.yaml": text, **others})


def _corrected(rounds: Sequence[_Round], asked: float) -> Floats:
    """Failures that the model may have at each pose so that simulation has those asked.

    Between the widest tolerances that keep them and the tightest that do not by the rule of the secant; before both are
    known, simulation is taken to follow the model.
    """
    from scipy.special import ndtr

    points = np.array([each.distances(asked) for each in rounds])
    wanted = np.empty(points.shape[2])
    for k, (model, excess) in enumerate(zip(points[:, 0].T, points[:, 1].T, strict=True)):
        kept, broken = model[excess >= 0], model[excess < 0]
        wanted[k] = model[-1] - excess[-1]
        if len(kept) and len(broken) and kept.min() > broken.max():
            high, low = kept.min(), broken.max()
            above, below = excess[model == high][-1], excess[model == low][-1]
            part = np.clip(below / (below - above), _BRACKET_PART, 1.0 - _BRACKET_PART)
            wanted[k] = low + part * (high - low)
    return np.asarray(2.0 * ndtr(-np.exp(wanted)))


def _simulated(model: ToleranceModel, scales: Floats, method: str) -> list[Estimate]:
    """What simulation says of these tolerances, at each pose."""
    task = model.task
    try:
        linear = model.linear(scales)
        said = methods.run(method, replace(task, sources=linear.sources, linear=linear))
    except Partial as partial:
        # What it had found is not the answer to the study's own question.
        raise KeyboardInterrupt from partial
    return [said.estimates[setting.pose] for setting in task.settings]


def _shares(model: ToleranceModel, scales: Floats) -> Floats:
    """Shares of the sources in the variances of limited errors over their squared limits, shape (poses, sources)."""
    poses = [setting.pose for setting in model.task.settings]
    question, linear = model.task.question.at(model.task.nominal[:, poses]), model.linear(scales).take(poses)
    weights = np.zeros((len(question.channels), len(poses)))
    for band in question.bands:
        weights[band.output] += 1.0 / np.maximum(np.minimum(abs(band.low), abs(band.high)), _NARROWEST) ** 2
    for disc in question.discs:
        weights[[disc.x, disc.y]] += 1.0 / max(disc.radius, _NARROWEST) ** 2
    parts = np.nansum(linear.share() * (weights * linear.deviation() ** 2)[:, None], axis=0).T
    with np.errstate(invalid="ignore"):
        return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def _allocation(last: _Round) -> Table:
    found, given = last.model.tolerances, [tolerance.given for tolerance in last.model.tolerances]
    sizes = [tolerance.size(scale) for tolerance, scale in zip(found, last.scales.tolist(), strict=True)]
    prices = [np.array([tolerance.price(size) for tolerance, size in zip(found, each, strict=True)])
              for each in (given, sizes)]  # fmt: skip
    columns = (
        Column("source", np.array([tolerance.name for tolerance in found]), meaning="what varies"),
        Column("kind", np.array([tolerance.kind for tolerance in found]),
               meaning="tolerance: half its width; sigma; measured: the values' sigma; clearance: its mean radial one"),
        Column("given", np.array(given), meaning="as the study gives it, in `unit`"),
        Column("allocated", np.array(sizes), meaning="the cheapest, in `unit`"),
        Column("unit", np.array([tolerance.unit for tolerance in found]), meaning="unit of the two columns before"),
        Column("cost_given", prices[0], meaning="a/T^exponent; nan where it is held"),
        Column("cost_allocated", prices[1], meaning="a/T^exponent; nan where it is held"),
        Column("share", _shares(last.model, last.scales)[int(np.argmax(last.analytic))],
               meaning="share of the limited errors' variance (over the square of each limit) with the "
               "allocated tolerances, at the pose that fails most often"),
    )  # fmt: skip
    return Table("allocation", columns, "the cheapest tolerances that reach the reliability asked")


def _confirmation(last: _Round, reliability: float) -> Table:
    rows = np.array([setting.pose for setting in last.model.task.settings])
    said = last.simulated
    failure, low, high = (np.array([getattr(e, name) for e in said]) for name in ("failure", "low", "high"))
    columns = [
        *at_poses(last.model.task, rows),
        Column("asked", np.full(len(rows), reliability), meaning="reliability asked for"),
        Column("target", 1.0 - last.allowed, meaning="what the analytic model had to reach for it"),
        Column("analytic", 1.0 - last.analytic, meaning="reliability by the first-order model"),
        Column("simulated", 1.0 - failure, meaning="reliability by simulation"),
        Column("low", 1.0 - high, meaning="lower end of its interval, 99.7 %"),
        Column("high", 1.0 - low, meaning="upper end of its interval, 99.7 %"),
        Column("method", np.full(len(rows), last.method), meaning="how it was simulated"),
        *shared(last.model.task.study.units, evaluations=[e.evaluations for e in said]),
        Column("met", ~last.missed(1.0 - reliability), meaning="1 where the interval holds the reliability asked, or "
               "all of it is above"),
    ]  # fmt: skip
    return Table("confirmation", tuple(columns), "reliability of the allocated tolerances")


def _ends(last: _Round) -> list[str]:
    """Which tolerances end at what is allowed."""
    model, notes = last.model, []
    idle = _idle(model, last.scales)
    for k, scale, widest, nothing in zip(model.free, last.scales[model.free], model.widest, idle, strict=True):
        what = ""
        if scale < TIGHTEST * 1.001:
            what = f"is as tight as allowed, {TIGHTEST:g} times the given tolerance"
        elif widest < WIDEST:
            what = ("has no influence on the limited errors to the first order, but a wider one breaks the limits; it "
                    "keeps the given tolerance")  # fmt: skip
        elif nothing:
            what = (f"has no influence on the limited errors; it gets {WIDEST:g} times the given tolerance, the widest "
                    "allowed")  # fmt: skip
        elif scale > WIDEST * 0.999:
            what = f"is as wide as allowed, {WIDEST:g} times the given tolerance"
        if what:
            notes.append(f"allocated: '{model.tolerances[k].name}' {what}")
    return notes


def _idle(model: ToleranceModel, scales: Floats) -> Flags:
    """Allocated tolerances that change no limited error at any pose, to the first order."""
    return np.asarray(~(np.abs(_shares(model, scales)[:, model.free]) > _NO_SHARE).any(axis=0))


def _plain(failure: float) -> str:
    """A reliability with as many digits as tell it from 1."""
    digits = 6 if failure <= 0 else max(6, int(np.ceil(-np.log10(failure))) + 3)
    return f"{1.0 - failure:.{digits}f}".rstrip("0").rstrip(".")


def _unreachable(last: _Round, asked: float) -> str:
    """Why the tightest tolerances do not do, what they reach, and what would mend it."""
    # SciPy takes a quarter of a second to import, and a study without limits does not need it.
    from mechdesign.analyses.reliability.probability import failure_probability

    model, tightest = last.model, last.scales
    worst = int(np.argmax([estimate.failure for estimate in last.simulated]))
    setting = model.task.settings[worst]
    question, pose, share = setting.question, setting.pose, _shares(model, tightest)[worst]
    linear = model.linear(tightest).take([pose])
    centred = failure_probability(linear.covariance()[0], question.bands, question.discs)
    held = [k for k, tolerance in enumerate(model.tolerances) if tolerance.cost is None and share[k] > _HELD_SHARE]
    if not question.kept(np.zeros((len(question.channels), 1))).all():
        reason = "the nominal value lies outside its limits"
    elif linear.shift().any() and centred <= asked:
        reason = "the mean errors, which the width of no tolerance changes, break the limits by themselves"
    elif held:
        held.sort(key=lambda k: -share[k])
        named = ", ".join(f"{model.tolerances[k].name} ({share[k]:.0%})" for k in held)
        reason = f"what is held breaks the limits by itself: {named}{_advice(model, tightest, held, worst, asked)}"
    else:
        reason = "they would have to shrink to nothing"
    return (
        f"allocate: a reliability of {_plain(asked)} cannot be reached at {model.task.where(pose)}: with all "
        f"tolerances at {TIGHTEST:g} times the given ones it is {_plain(last.simulated[worst].failure)} by "
        f"{last.method} and by the analytic model {_plain(last.analytic[worst])}; {reason}"
    )


def _advice(model: ToleranceModel, tightest: Floats, held: Sequence[int], worst: int, asked: float) -> str:
    """What to write so that clearances and loads that are held are allocated too, if that is enough."""
    section, tolerances = model.task.study.reliability, model.tolerances
    assert section is not None
    free = [k for k in held if tolerances[k].kind != "measured"]
    names = [tolerances[k].name for k in free]
    fits = [name for name in names if name in section.clearances and section.clearances[name].fit is not None]
    scales = tightest.copy()
    scales[free] = TIGHTEST
    if not free or model.failures(scales, [worst])[0] > asked:
        return ""
    instead = f", with 'radial' in place of the fit of {', '.join(fits)}" if fits else ""
    return f"; name {', '.join(names)} in 'cost' to have it allocated too{instead}"


def allocated_data(study: Study, tolerances: Sequence[Tolerance], scales: Floats) -> dict[str, Any]:
    """The study's data where tolerances are as many times as wide.

    What a wildcard gives is written out, place by place, unless all of it stays alike. What is done is no longer asked:
    `allocate` is left out, unless a requirement judges its tables.
    """
    section = study.reliability
    assert section is not None
    data: dict[str, Any] = plain(study.resolved)
    changed = {t.name: (t, scale) for t, scale in zip(tolerances, scales.tolist(), strict=True) if t.cost is not None}
    given = data["reliability"]
    if not any(each.result.split(".")[1:2] in (["allocation"], ["confirmation"]) for each in study.requirements):
        del given["allocate"]
    entries = given.get("dimensions") or {}
    # Of several wildcards the last one counts.
    key_of = {name: name if name in entries else [key for key in entries if fnmatchcase(name, key)][-1]
              for name in section.dimensions}  # fmt: skip
    dimensions: dict[str, Any] = {}
    for key, raw in entries.items():
        own = {name: _dimension(raw, section.dimensions[name], *changed[name]) if name in changed else raw
               for name, origin in key_of.items() if origin == key}  # fmt: skip
        values = [*own.values(), raw]
        dimensions |= own if any(value != values[0] for value in values[:-1]) else {key: values[0]}
    if entries:
        given["dimensions"] = dimensions
    for point, raw in (given.get("clearances") or {}).items():
        if point in changed:
            given["clearances"][point] = _clearance(raw, section.clearances[point], *changed[point])
    return data


def _dimension(raw: Any, dimension: Dimension, tolerance: Tolerance, scale: float) -> Any:
    size = _number(tolerance.given * scale)
    if isinstance(raw, dict) and raw.get("sigma") is not None:
        return {**raw, "sigma": size}
    width = raw["tolerance"] if isinstance(raw, dict) else raw
    new: Any = size
    middle = 0.5 * sum(dimension.ends)
    if isinstance(width, list) or middle:
        new = [_number(middle - size, 12), _number(middle + size, 12)]
    # An allocated number is of no class, and needs no leg to go by.
    return {**{key: raw[key] for key in raw if key != "leg"}, "tolerance": new} if isinstance(raw, dict) else new


def _clearance(raw: dict[str, Any], clearance: Clearance, tolerance: Tolerance, scale: float) -> dict[str, Any]:
    """Its radius or diameter, and the tolerance of that, in proportion."""
    key = "radial" if clearance.radial is not None else "diametral"
    size = clearance.radius if clearance.radial is not None else 2.0 * clearance.radius
    new = {**raw, key: _number(size * scale)}
    if isinstance(raw.get("tolerance"), list):
        new["tolerance"] = [_number(scale * end, 12) for end in clearance.tolerance]
    elif raw.get("tolerance") is not None and clearance.tolerance[1]:
        new["tolerance"] = _number(scale * clearance.tolerance[1], 12)
    return new


def _number(value: float, digits: int = DIGITS) -> float:
    return float(f"{value:.{digits}g}")
