"""Tolerances from a reliability or a Cpk: the cheapest by the first-order model, confirmed by simulation.

Every pose has to reach the target by itself; the whole cycle does not. Where simulation and model differ beyond the
interval, the model's target is corrected by their ratio and the tolerances are allocated again: tighter where a pose
fails too often, cheaper where the model is pessimistic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.results import Result, Table
from mechdesign.questions.reliability.aims import Simulated, aim_of
from mechdesign.questions.reliability.allocated import allocated_data
from mechdesign.questions.reliability.cheapest import TIGHTEST, WIDEST, ToleranceModel, cheapest, tolerances
from mechdesign.questions.reliability.columns import ALLOCATION, CONFIRMATION
from mechdesign.questions.reliability.grades import graded
from mechdesign.questions.reliability.schema.section import Precision, ReliabilitySection
from mechdesign.questions.reliability.tables import at_poses
from mechdesign.questions.reliability.task import Partial, Task
from mechdesign.study import Study
from mechdesign.study.loading import load_data
from mechdesign.study.variants import rewritten

# Most rounds of allocation and simulation.
_MAX_ROUNDS = 14
# Least share by which a correction narrows the bracket of the model's target.
_BRACKET_PART = 0.1
# Coefficient of variation to which `auto` confirms failures, where the study gives no precision.
_PRECISION = 0.1
# Distance between a pose's level and the model's target up to which its constraint is active.
_ACTIVE = 1e-3
# Largest step by which a round lowers the target level of grades, as the next choice may have a smaller difference
# between simulation and model.
_LEVEL_STEP = 0.1
# Relative difference up to which costs are equal.
_SAME = 1e-9
# Share of the variance from which on a source that is not allocated is named as the reason of a failure.
_HELD_SHARE = 0.005
# Largest share of the variance that counts as none.
_NO_SHARE = 1e-12
# Least limit in the weights of variances, so that a limit of 0 does not divide by zero.
_NARROWEST = 1e-100


@dataclass(frozen=True, eq=False)
class _Round:
    """Tolerances, and the measures (see `Aim`) that they reach by the model and by simulation, shape (limits, poses).

    `targets` are the levels that the model had to reach. `bound` is a lower bound of the cost of any grades that reach
    them, infinite where tolerances are no grades.
    """

    model: ToleranceModel
    scales: Floats
    bound: float
    targets: Floats
    analytic: Floats
    simulated: Simulated
    method: str

    def missed(self) -> Flags:
        """Where the target is missed beyond chance; for grades also where simulation and model both miss it."""
        aim, target = self.model.aim, self.model.aim.level(self.model.aim.goal)
        missed = aim.level(self.simulated.best) < target
        if self.model.steps:
            missed |= (aim.level(self.simulated.value) < target) & (aim.level(self.analytic) < target)
        return np.asarray(missed)

    def idle(self) -> Flags:
        """Where the target is exceeded beyond chance, although the model's constraint is active.

        For grades wherever the model is pessimistic: a coarser grade may do.
        """
        aim = self.model.aim
        more = (aim.level(self.simulated.worst) > aim.level(aim.goal)) | self.simulated.unseen
        level = aim.level(self.analytic)
        if self.model.steps:
            return np.asarray(more & ((aim.level(self.simulated.worst) > level) | self.simulated.unseen))
        return np.asarray(more & (level < self.targets + _ACTIVE))

    def levels(self) -> tuple[Floats, Floats]:
        """Levels by the model, and the excess of the simulated levels over the target's."""
        aim = self.model.aim
        return aim.level(self.analytic), aim.level(aim.safe(self.simulated)) - aim.level(aim.goal)

    def worst(self) -> tuple[str, str, str]:
        """In words: the worst pose, the model's measure there, and the simulated one with its interval."""
        aim, task, simulated = self.model.aim, self.model.task, self.simulated
        k = _worst(aim.level(simulated.value))
        parts = simulated.value, simulated.worst, simulated.best, self.analytic
        value, worst, best, analytic = (aim.in_words(float(part[k])) for part in parts)
        return task.where(task.settings[k[1]].pose), analytic, f"{value} ({worst} to {best})"

    def cost(self) -> float:
        """Cost of the allocated tolerances."""
        return self.model.cost(np.log(self.scales[self.model.free]))[0]

    def tightest(self) -> bool:
        """Whether all allocated tolerances are at their tightest."""
        return bool((self.scales[self.model.free] < self.model.tightest * 1.001).all())


def _worst(level: Floats) -> tuple[int, int]:
    """Limit and pose of the least level."""
    limit, pose = np.unravel_index(int(np.argmin(level)), level.shape)
    return int(limit), int(pose)


def allocate(task: Task, section: ReliabilitySection) -> tuple[Result, Study | None]:
    """Allocate the tolerances of a study with `allocate`: tables, warnings, the file of the study with the new ones.

    Returns this study as well, without `allocate`, where the tolerances reach what is asked.
    """
    if section.allocate is None or not task.settings:
        return Result("allocation", {}), None
    study, aim = task.study, aim_of(section.allocate)
    start = tolerances(study, task.sources)
    free = np.array([k for k, tolerance in enumerate(start) if tolerance.cost is not None], dtype=np.intp)
    task = replace(task, settings=[replace(setting, scale=None, followed=False) for setting in task.settings])
    if section.precision is None:
        task = replace(task, precision=Precision(relative=_PRECISION))
    model = ToleranceModel(task, aim, start, free, np.full(len(free), np.inf if section.allocate.grades else WIDEST))
    rounds = _rounds(model, aim.method(task, section))
    confirmed = [candidate for candidate in rounds if not candidate.missed().any()]
    if not confirmed and rounds[-1].tightest():
        return Result("allocation", {}, failed=_unreachable(rounds[-1])), None
    last = min(confirmed, key=_Round.cost) if confirmed else rounds[-1]
    where, by_model, by_simulation = last.worst()
    asked, failed = f"{float(aim.shown(np.array(aim.goal))):.15g}", ""
    if not confirmed:
        failed = (
            f"allocate: the {aim.noun} asked, {asked}, is not confirmed at {where}: with tolerances "
            f"for which the analytic model says {by_model}, {last.method} finds {by_simulation}; ask for a little less"
        )
    before = sum(start[k].price(start[k].given) for k in free.tolist())
    notes = [Caution(
        "allocated",
        f"allocated: the tolerances cost {last.cost():.6g} in place of {before:.6g}; asked is a {aim.noun} of {asked}, "
        f"and at {where}, the worst pose, it is {by_model} by the analytic model and {by_simulation} by {last.method}",
        "confirmation", pose=where,
    )]  # fmt: skip
    if len(rounds) > 1:
        notes.append(Caution(
            "allocated",
            "allocated: simulation and the analytic model differ; the target of the model was corrected "
            f"{len(rounds) - 1} times",
            "confirmation",
        ))  # fmt: skip
    if last.bound < last.cost() * (1.0 - _SAME):
        cheaper = f"allocated: not all choices of grades were compared; a cheaper one costs {last.bound:.6g} at least"
        notes.append(Caution("unconverged", cheaper, "allocation"))
    data, made = allocated_data(study, start, last.scales), None
    if confirmed:
        made = load_data(data, (), None, study.folder, study.drawn)
        made = made.with_sections(reliability=ReliabilitySection.of(made).model_copy(update={"allocate": None}))
    text, others = rewritten(study, data, f"Tolerances of {study.name}, the cheapest for a {aim.noun} of {asked}")
    tables = {"allocation": _allocation(last), "confirmation": _confirmation(last)}
    notes += _ends(replace(last, model=rounds[-1].model))
    return Result("allocation", tables, notes, failed=failed, files={"allocated.yaml": text, **others}), made


def _rounds(model: ToleranceModel, method: str) -> list[_Round]:
    """Allocations by the model in their order, each after the first for a target that simulation has corrected."""
    free, aim, rounds = model.free, model.aim, list[_Round]()
    settings = range(len(model.task.settings))
    limits = len(model.reached(np.ones(len(model.tolerances)), settings))
    targets = np.full((limits, len(settings)), aim.level(aim.goal))
    for _ in range(_MAX_ROUNDS):
        if model.steps:
            scales, bound = graded(model, targets)
        else:
            scales, bound = cheapest(model, targets), np.inf
            scales[free] = [model.tolerances[k].rounded(float(scales[k])) for k in free.tolist()]
        again = next((past for past in rounds if model.steps and (scales == past.scales).all()), None)
        if again is not None and any(past.missed().any() for past in rounds):
            break
        if again is None:
            simulated = _simulated(model, scales, method)
            last = _Round(model, scales, bound, targets, model.reached(scales, settings), simulated, method)
            rounds.append(last)
        else:
            last = replace(again, targets=targets)
        missed = last.missed()
        if missed.any() and last.tightest():
            break
        # A tolerance without influence to the first order may break limits in the simulation.
        without = _idle(model, scales) & (scales[free] > 1.0)
        if without.any() and missed.any():
            model = replace(model, widest=np.where(without, 1.0, model.widest))
            continue
        wrong = missed | last.idle()
        if not wrong.any():
            break
        corrected = targets - np.minimum(last.levels()[1], _LEVEL_STEP) if model.steps else _corrected(rounds)
        targets = np.where(wrong, corrected, targets)
    return rounds


def _corrected(rounds: Sequence[_Round]) -> Floats:
    """Levels that the model has to reach so that simulation reaches the target's, shape (limits, poses).

    By the secant rule between the lowest level of the model that met the target and the highest that missed it. Until
    there are both, the difference between simulation and model is taken to be constant.
    """
    levels, excess = (np.stack(part) for part in zip(*(past.levels() for past in rounds), strict=True))
    targets = levels[-1] - excess[-1]
    for place in np.ndindex(targets.shape):
        model, beyond = levels[:, *place], excess[:, *place]
        kept, broken = model[beyond >= 0], model[beyond < 0]
        if len(kept) and len(broken) and kept.min() > broken.max():
            high, low = kept.min(), broken.max()
            above, below = beyond[model == high][-1], beyond[model == low][-1]
            part = np.clip(below / (below - above), _BRACKET_PART, 1.0 - _BRACKET_PART)
            targets[place] = low + part * (high - low)
    return np.asarray(targets)


def _simulated(model: ToleranceModel, scales: Floats, method: str) -> Simulated:
    """Simulated measures of these tolerances at the poses of the settings."""
    try:
        linear = model.linear(scales)
        return model.aim.simulate(replace(model.task, sources=linear.sources, linear=linear), method)
    except Partial as partial:
        # The partial result is that of trial tolerances, not of the study's own.
        raise KeyboardInterrupt from partial


def _shares(model: ToleranceModel, scales: Floats) -> Floats:
    """Share of each source in the sum of limited variances, each over its limit squared, shape (poses, sources)."""
    poses = [setting.pose for setting in model.task.settings]
    linear = model.linear(scales).take(poses)
    question = model.task.question.take(poses).at(model.task.nominal[:, poses])
    weights = np.zeros((len(question.channels), len(poses)))
    for limit in question.limits:
        weights[[*limit.channels]] += 1.0 / np.maximum(np.minimum(abs(limit.low), abs(limit.high)), _NARROWEST) ** 2
    parts = np.nansum(linear.share() * (weights * linear.deviation() ** 2)[:, None], axis=0).T
    return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def _allocation(last: _Round) -> Table:
    rows = last.model.tolerances
    before = [tolerance.given for tolerance in rows]
    sizes = [tolerance.size(scale) for tolerance, scale in zip(rows, last.scales.tolist(), strict=True)]
    prices = [np.array([tolerance.price(size) for tolerance, size in zip(rows, widths, strict=True)])
              for widths in (before, sizes)]  # fmt: skip
    names = np.array([tolerance.grade(scale) for tolerance, scale in zip(rows, last.scales.tolist(), strict=True)])
    return ALLOCATION.table(ALLOCATION.columns(
        {}, source=np.array([tolerance.name for tolerance in rows]),
        kind=np.array([tolerance.kind for tolerance in rows]), given=np.array(before), allocated=np.array(sizes),
        unit=np.array([tolerance.unit for tolerance in rows]), **({"grade": names} if last.model.steps else {}),
        cost_given=prices[0], cost_allocated=prices[1],
        share=_shares(last.model, last.scales)[_worst(last.model.aim.level(last.analytic))[1]],
    ))  # fmt: skip


def _confirmation(last: _Round) -> Table:
    aim, simulated, task = last.model.aim, last.simulated, last.model.task
    # The worst limit at each pose.
    place = np.argmin(aim.level(simulated.value), axis=0), np.arange(len(task.settings))
    value, worst, best, analytic, target = (
        aim.shown(part[place])
        for part in (simulated.value, simulated.worst, simulated.best, last.analytic, aim.measure(last.targets))
    )
    poses = at_poses(task, np.array([setting.pose for setting in task.settings]))
    return CONFIRMATION.table(poses + CONFIRMATION.columns(
        {}, asked=aim.shown(np.full(len(value), aim.goal)), target=target, analytic=analytic, simulated=value,
        low=worst, high=best, method=np.full(len(value), last.method), evaluations=simulated.evaluations,
        met=np.logical_not(last.missed().any(axis=0)),
    ))  # fmt: skip


def _ends(last: _Round) -> list[Caution]:
    """Warnings of tolerances at the ends of their ranges, and of those that have no grade."""
    model, notes = last.model, []
    idle, free = _idle(model, last.scales), model.free.tolist()
    tight, wide = (f"{factor:g} times the given tolerance" for factor in (TIGHTEST, WIDEST))
    widest = [float(steps[-1]) for steps in model.steps] or model.widest.tolist()
    for place, k in enumerate(free):
        scale, most, text = float(last.scales[k]), widest[place], ""
        grade = model.tolerances[k].grade(scale)
        if scale < model.tightest[place] * 1.001:
            text = f"is {f'in the finest grade, {grade}' if grade else f'as tight as allowed, {tight}'}"
        elif model.widest[place] == 1.0:
            kept = f"gets a grade within the given tolerance, {grade}" if grade else "keeps the given tolerance"
            text = "has no influence on the limited errors to the first order, but a wider one breaks the limits; it "
            text += kept
        elif idle[place]:
            kept = f"the coarsest grade, {grade}" if grade else f"{wide}, the widest allowed"
            text = f"has no influence on the limited errors; it gets {kept}"
        elif scale > most * 0.999:
            text = f"is {f'in the coarsest grade, {grade}' if grade else f'as wide as allowed, {wide}'}"
        if text:
            notes.append(Caution("allocated", f"allocated: '{model.tolerances[k].name}' {text}", "allocation", k))
    held = [t.name for k, t in enumerate(model.tolerances) if model.steps and k not in free]
    if held:
        words = f"allocated: held as given, for grades are of lengths with a tolerance: {', '.join(held)}"
        notes.append(Caution("allocated", words, "allocation"))
    return notes


def _idle(model: ToleranceModel, scales: Floats) -> Flags:
    """Which allocated tolerances change no limited error at any pose, to the first order, shape (free,)."""
    return np.asarray(~(np.abs(_shares(model, scales)[:, model.free]) > _NO_SHARE).any(axis=0))


def _unreachable(last: _Round) -> str:
    """The error message: what the tightest tolerances reach, why they miss the target, and the remedy."""
    model, tightest, aim = last.model, last.scales, last.model.aim
    limit, worst = _worst(aim.level(last.simulated.value))
    setting = model.task.settings[worst]
    question, pose, share = setting.question, setting.pose, _shares(model, tightest)[worst]
    linear = model.linear(tightest).take([pose])
    closing = replace(model.task.closing.take([pose]), sources=linear.sources)
    centred = aim.by_model(question, replace(linear, offset=linear.offset - linear.shift()), closing)
    held = [k for k, tolerance in enumerate(model.tolerances) if tolerance.cost is None and share[k] > _HELD_SHARE]
    if not question.kept(np.zeros((len(question.channels), 1))).all():
        reason = "the nominal value lies outside its limits"
    elif linear.shift().any() and (aim.level(centred) >= aim.level(aim.goal)).all():
        reason = "the mean errors, which the width of no tolerance changes, break the limits by themselves"
    elif held:
        held.sort(key=lambda k: -share[k])
        named = ", ".join(f"{model.tolerances[k].name} ({share[k]:.0%})" for k in held)
        reason = f"what is held breaks the limits by itself: {named}{_advice(model, tightest, held, worst)}"
    elif model.steps:
        reason = "grades that are finer would have to be allowed"
    else:
        reason = "they would have to shrink to nothing"
    with_what = "in their finest grades" if model.steps else f"at {TIGHTEST:g} times the given ones"
    reached = f"{aim.in_words(float(last.simulated.value[limit, worst]))} by {last.method} and by the analytic model "
    return (
        f"allocate: a {aim.noun} of {aim.in_words(aim.goal)} cannot be reached at {model.task.where(pose)}: with all "
        f"tolerances {with_what} it is {reached}{aim.in_words(float(last.analytic[limit, worst]))}; {reason}"
    )


def _advice(model: ToleranceModel, tightest: Floats, held: Sequence[int], worst: int) -> str:
    """Advice to allocate the held clearances and loads too, if that reaches the target; else empty."""
    section, tolerances = ReliabilitySection.of(model.task.study), model.tolerances
    free = [k for k in held if tolerances[k].kind != "measured"]
    names = [tolerances[k].name for k in free]
    fits = [name for name in names if name in section.clearances and section.clearances[name].fit is not None]
    scales = tightest.copy()
    scales[free] = TIGHTEST
    aim = model.aim
    if not free or model.steps or (aim.level(model.reached(scales, [worst])) < aim.level(aim.goal)).any():
        return ""
    instead = f", with 'radial' in place of the fit of {', '.join(fits)}" if fits else ""
    return f"; name {', '.join(names)} in 'cost' to have it allocated too{instead}"
