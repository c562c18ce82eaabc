"""How precise is it when it is made? Error moments, reliability and contributions, analytically and by simulation."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.kinematics.rates import drive_rates
from mechdesign.analyses.poses import SolvedPoses, in_study_units, judge_failures, solve_poses, study_poses
from mechdesign.analyses.reliability import sobol, tables
from mechdesign.analyses.reliability.allocation import Allocated, allocate
from mechdesign.analyses.reliability.answer import Answer
from mechdesign.analyses.reliability.assembly import forward_plan
from mechdesign.analyses.reliability.comparison import disagreements
from mechdesign.analyses.reliability.cycle import notes, with_cycle
from mechdesign.analyses.reliability.deflection import Elastic, elasticity, unknown
from mechdesign.analyses.reliability.first_order import FirstOrder, Rates, linear_errors, nominal_values
from mechdesign.analyses.reliability.methods import METHODS, analytic
from mechdesign.analyses.reliability.question import Question, ask, unsaid
from mechdesign.analyses.reliability.shortfalls import pointless, unassembled, unreached
from mechdesign.analyses.reliability.simulation import Setting
from mechdesign.analyses.reliability.sources import Sources, find_sources
from mechdesign.analyses.reliability.task import MOST, Found, Partial, Task
from mechdesign.analyses.reliability.unseen import unseen
from mechdesign.errors import Interrupted
from mechdesign.mechanism import Configuration, Reason
from mechdesign.memory import keep_freed_memory
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses
from mechdesign.threads import one_thread

# Poses whose sensitivities are computed together.
_BLOCK = 2048
# Listed poses that get a density of their own.
_DENSITIES = 12


@one_thread()
def reliability(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Errors of a study's outputs from its tolerances and clearances.

    Parameters
    ----------
    study : Study
    seed : int, optional
        In place of the study's.
    jobs : int or None
        Threads; the result does not depend on it.

    Returns
    -------
    Result
        Tables ``moments``, ``reliability`` (where there are limits) and ``contributions``; of methods that sample the
        errors ``density`` (of two outputs), ``histogram``, ``convergence`` and ``estimate`` (where there are limits);
        where tolerances are allocated ``allocation`` and ``confirmation``, and the study ``allocated.yaml`` that has
        them.

    Raises
    ------
    StudyError
        If nothing varies.
    AssemblyError
        If no pose at all can be assembled.
    Interrupted
        On Ctrl-C, with what was found so far.
    """
    keep_freed_memory()
    sources, warnings = find_sources(study)
    section = study.reliability
    assert section is not None
    question = ask(study, section)
    poses = study_poses(study, "reliability")
    nominal, elastic, doubts = loaded(study, NominalPoses.solve(study, poses, question), question)
    warnings += [*doubts, *unsaid(study, question)]
    failures, failed = judge_failures(study, poses, nominal.reason)
    linear = first_order(study, nominal, question, sources, elastic)
    settings = _settings(study, nominal, question, linear, elastic, poses.listed)
    task = Task(
        settings, sources, linear, len(question.channels), poses.count, study.seed if seed is None else seed,
        section.samples, section.samples if "samples" in section.model_fields_set else MOST, section.precision,
        jobs, progress, poses.motion,
    )  # fmt: skip
    first = analytic(task)
    found: list[Found] = []
    interrupted = ""
    indices: dict[int, sobol.Indices] = {}
    allocated = Allocated()
    try:
        for method in section.methods:
            said = first if method == first.method else METHODS[method](task)
            found.append(with_cycle(said, task, found))
        indices = sobol.indices(task, section, poses.listed)
        allocated = allocate(study, poses, task)
    except Partial as partial:
        found.append(partial.found)
        interrupted = "interrupted: "
    except KeyboardInterrupt:
        if not found:
            raise
        interrupted = "interrupted: "
    centres = _in_study_units(study, question, nominal)
    answer = Answer(study, poses, question, nominal.reason, centres, linear, found, first, indices)
    counts = {"poses": poses.count}
    done = [sums for each in found for sums in each.sums.values()]
    if done:
        counts["samples"] = sum(sums.samples for sums in done)
        counts["invalid"] = sum(sums.samples - sums.valid for sums in done)
        if counts["invalid"]:
            failures.append(
                f"{counts['invalid']} of {counts['samples']} samples cannot be assembled; they count as failures"
            )
    cycles = [each.cycle.samples for each in found if each.cycle is not None and each.cycle.samples]
    if cycles:
        counts["cycles"] = cycles[0]
    failures = [
        *disagreements(study, poses, found), *unseen(study, poses, found), *unreached(study, poses, found, task),
        *pointless(study, poses, found), *unassembled(found), *notes(found, task),
        *sobol.doubts(study, poses, task, indices), *failures,
    ]  # fmt: skip
    if interrupted:
        interrupted += f"{counts.get('samples', 0)} samples, "
        interrupted += f"{counts['cycles']} whole cycles, " if cycles else ""
        interrupted += f"{', '.join(each.method for each in found)}"
    result = Result(
        "reliability", tables.build(answer) | allocated.tables, [*warnings, *failures, *allocated.notes], counts,
        "; ".join(filter(None, (failed, allocated.failed))), allocated.files, interrupted,
    )  # fmt: skip
    if interrupted:
        raise Interrupted(result)
    return result


def first_order_tables(
    study: Study, poses: Poses, wanted: Collection[str]
) -> tuple[dict[str, Table], NDArray[np.int8]]:
    """Wanted tables of the first-order analysis at poses, perhaps of several designs, and why poses fail.

    Raises
    ------
    StudyError
        If nothing varies.
    """
    sources, _ = find_sources(study)
    section = study.reliability
    assert section is not None
    question = ask(study, section)
    nominal, elastic, _ = loaded(study, NominalPoses.solve(study, poses, question), question)
    linear = first_order(study, nominal, question, sources, elastic)
    settings = _settings(study, nominal, question, linear, elastic, listed=False)
    task = Task(settings, sources, linear, len(question.channels), poses.count, 0, 0, 0, None, 1, NULL)
    centres, first = _in_study_units(study, question, nominal), analytic(task)
    answer = Answer(study, poses, question, nominal.reason, centres, linear, [first], first)
    made = {"moments": tables.moments, "contributions": tables.contributions}
    if question.limited:
        made["reliability"] = tables.success
    return {name: make(answer) for name, make in made.items() if name in wanted}, nominal.reason


@dataclass(frozen=True, eq=False)
class NominalPoses:
    """The nominal mechanism at every pose.

    Parameters
    ----------
    reason : int8 array, shape (poses,)
    groups : tuple
        Per group of poses that give the same coordinates: rows, configuration, drives (n, drives), whether the
        drives were given, and the drives' rates.
    values : ndarray, shape (channels, poses)
        Radians and lengths.
    """

    reason: NDArray[np.int8]
    groups: tuple[tuple[Ints, Configuration, Floats, bool, Rates], ...]
    values: Floats

    @staticmethod
    def solve(study: Study, poses: Poses, question: Question) -> NominalPoses:
        reason = np.zeros(poses.count, dtype=np.int8)
        values = np.full((len(question.channels), poses.count), np.nan)
        groups = []
        for solved in solve_poses(study, poses, [channel.coordinate for channel in question.channels]):
            configuration = solved.configuration
            reason[solved.rows] = configuration.reason
            rates = _rates(study, poses, question, solved)
            found = nominal_values(study.mechanism, configuration, question.channels, rates)
            for row, value in zip(values, found, strict=True):
                row[solved.rows] = value
            each = [configuration.value(study.mechanism.coordinate(name)) for name in study.mechanism.drives]
            drives = np.stack([np.broadcast_to(value, configuration.shape) for value in each], axis=-1)
            forward = set(solved.given) == set(study.mechanism.drives)
            groups.append((solved.rows, configuration, drives, forward, rates))
        return NominalPoses(reason, tuple(groups), values)

    @property
    def assembled(self) -> Flags:
        """Poses that can be computed, those outside the limits of motion included."""
        return np.isin(self.reason, (Reason.OK, Reason.LIMIT))


def _rates(study: Study, poses: Poses, question: Question, solved: SolvedPoses) -> Rates:
    """Rates of the drives at some poses, at which they are held for made mechanisms too; none where none are asked."""
    section = study.reliability
    if section is None or question.orders == 1:
        return Rates((), ())
    found = drive_rates(study, section, poses, solved, study.mechanism.linearize(solved.configuration))
    return Rates(tuple(found.velocities), tuple(found.accelerations))


def loaded(study: Study, nominal: NominalPoses, question: Question) -> tuple[NominalPoses, Elastic | None, list[str]]:
    """Deflections at every pose where the study has a load, poses that do not hold it marked, and what is doubtful."""
    bent, notes = elasticity(study)
    if bent is None:
        return nominal, None, notes
    flexibility = np.full((len(question.channels), 3, len(nominal.reason)), np.nan)
    for rows, configuration, *_ in nominal.groups:
        for begin in range(0, len(rows), _BLOCK):
            block = np.arange(begin, min(begin + _BLOCK, len(rows)))
            part = bent.at(configuration.take(block), question.channels)
            flexibility[:, :, rows[block]] = part.flexibility
    elastic = Elastic(flexibility, bent.load)
    reason = np.where(nominal.assembled & ~elastic.held, np.int8(Reason.NOT_HELD), nominal.reason)
    return replace(nominal, reason=reason), elastic, [*notes, *unknown(bent, question.channels)]


def first_order(
    study: Study, nominal: NominalPoses, question: Question, sources: Sources, elastic: Elastic | None
) -> FirstOrder:
    """Linear error model at every pose; nan where the pose is not assembled."""
    parts: FirstOrder | None = None
    components = np.zeros((len(question.channels), 0, 0))
    for rows, configuration, _, _, rates in nominal.groups:
        for begin in range(0, len(rows), _BLOCK):
            block = np.arange(begin, min(begin + _BLOCK, len(rows)))
            with np.errstate(invalid="ignore", divide="ignore"):
                parts = linear_errors(
                    study.mechanism, configuration.take(block), question.channels, sources, rates.take(block),
                    None if elastic is None else elastic.take(rows[block]),
                )  # fmt: skip
            if not components.size:
                components = np.full((*parts.components.shape[:2], len(nominal.reason)), np.nan)
            components[:, :, rows[block]] = parts.components
    assert parts is not None
    components[:, :, ~nominal.assembled] = np.nan
    return replace(parts, components=components, offset=None if elastic is None else elastic.offset)


def _settings(
    study: Study, nominal: NominalPoses, question: Question, linear: FirstOrder, elastic: Elastic | None, listed: bool
) -> list[Setting]:
    mechanism = study.mechanism
    mean, sigma = linear.shift(), linear.deviation()
    assembled = np.flatnonzero(nominal.assembled)
    settings = []
    for rows, configuration, drives, given, rates in nominal.groups:
        for k, row in enumerate(rows):
            if not nominal.assembled[row]:
                continue
            pose = configuration.take(k)
            scale = None
            if question.pair is not None and listed and row in assembled[:_DENSITIES]:
                one, two = ((float(mean[channel, row]), float(sigma[channel, row])) for channel in question.pair)
                scale = (one, two) if one[1] > 0 and two[1] > 0 else None
            settings.append(
                Setting(
                    int(row),
                    mechanism,
                    mechanism.forward if given else forward_plan(mechanism, pose),
                    pose,
                    drives[k].tolist(),
                    question.channels,
                    nominal.values[:, row].tolist(),
                    rates.take(k),
                    question.bands,
                    question.discs,
                    question.pair,
                    scale,
                    bool(row == assembled[0]),
                    bool(row == assembled[0]),
                    None if elastic is None else elastic.take([int(row)]),
                )
            )
    return sorted(settings, key=lambda setting: setting.pose)


def _in_study_units(study: Study, question: Question, nominal: NominalPoses) -> Floats:
    """Nominal values in study units, shape (channels, poses)."""
    return np.stack([
        in_study_units(study, c.coordinate, row) for c, row in zip(question.channels, nominal.values, strict=True)
    ])  # fmt: skip
