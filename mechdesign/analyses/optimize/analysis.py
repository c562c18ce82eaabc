"""Which dimensions are best? A grid, a search or a Pareto front of designs, compared; the best as study files."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
import yaml

from mechdesign.analyses.kinematics.analysis import kinematics
from mechdesign.analyses.look import ask
from mechdesign.analyses.optimize import pareto
from mechdesign.analyses.optimize import search as searching
from mechdesign.analyses.optimize.evaluation import Evaluator, missing
from mechdesign.analyses.optimize.explorer import Explorer
from mechdesign.analyses.optimize.goals import goals_of
from mechdesign.analyses.optimize.judge import Designs, Judge
from mechdesign.analyses.optimize.tables import (
    best_table,
    bounds_table,
    designs_table,
    optimum_table,
    sensitivity_table,
)
from mechdesign.analyses.optimize.variables import grid, in_words
from mechdesign.analyses.poses import solve_poses, solve_shown, study_poses
from mechdesign.analyses.region.curves import workspace_nodes
from mechdesign.analyses.region.rays import SINGLE
from mechdesign.analyses.workspace.analysis import index_meanings, workspace
from mechdesign.analyses.workspace.contained import Shape, fitting_scale
from mechdesign.analyses.workspace.question import answer, questions, split
from mechdesign.errors import AssemblyError, Interrupted, MechdesignError, StudyError
from mechdesign.journal import Journal
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.parallel import one_thread, workers
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.poses import PoseGroup, Poses
from mechdesign.study.schema.workspace import Over
from mechdesign.study.variants import changed_data, rewritten, variant

# Numbers that a search keeps of the rows behind its goals.
MAX_KEPT_ROWS = 10_000_000
# Reasons of infeasible designs that are reported one by one.
MAX_REASONS = 10
# Designs tie in a goal where it differs by no more, in its unit or as a part of its size.
TIE = 1e-12
# Poses between two listed ones at which it is looked whether an optimum can go from one to the other.
BETWEEN = 100


@one_thread()
def optimize(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Result:  # fmt: skip
    """Evaluate designs, and find the best for each set of weights [S1, eqs. 27, 28]; see `mechdesign.optimize`."""
    section = study.optimize
    if section is None or not section.variables:
        raise StudyError((study.problem("an optimisation needs variables", "optimize", "variables"),))
    goals = tuple(goals_of(section))
    if not goals:
        message = "what is to be best? e.g. maximize: [GII, GRI, SUI], or minimize"
        raise StudyError((study.problem(message, "optimize", "maximize"),))
    weights = np.array(section.weights or [[1.0] * len(goals)], dtype=float).reshape(-1, len(goals))
    evaluator = Evaluator(study, graded=section.method != "grid")
    meanings = _meanings(study, evaluator)
    budget = section.evaluations or (
        pareto.FRONT_EVALUATIONS * len(goals)
        if section.method == "pareto"
        else searching.allowance(len(section.variables), len(weights), len(goals), slow=evaluator.slow)
    )
    evaluator.limit_rows(MAX_KEPT_ROWS // budget)
    with workers(evaluator, jobs, processes=True, travels=True) as compute:
        judge = Judge(study, evaluator, compute, progress, journal)
        try:
            doubts = _ask(study, judge, evaluator, weights, budget, study.seed if seed is None else seed)
            designs = judge.designs(weights, meanings)
            if not designs.feasible.any():
                raise AssemblyError(_none_feasible(designs))
            sensitivity = sensitivity_table(designs, judge)
        except KeyboardInterrupt:
            if journal is not None:
                journal.save()
            partial = judge.designs(weights, meanings)
            if not len(partial):
                raise
            raise Interrupted(_finished_part(partial)) from None
    tables = [
        optimum_table(designs, _places(designs, evaluator)), designs_table(designs), bounds_table(designs),
        best_table(designs), sensitivity,
    ]  # fmt: skip
    marked: dict[str, int] = {}
    if section.method == "pareto":
        table, marked["knee"] = pareto.pareto_table(designs)
        tables.insert(0, table)
        doubts += tuple(pareto.doubts(designs, budget))
    files, wrong = optimum_files(study, designs, marked)
    counts = {"designs": len(designs), "infeasible": int((~designs.feasible).sum())}
    warnings = (*doubts, *_warnings(evaluator, designs), *wrong)
    drawn = {"designs": designs, "design": lambda numbers: drawn_design(designs, numbers)}
    return Result("optimize", {table.name: table for table in tables}, warnings, counts, files=files, drawn=drawn)


def _ask(
    study: Study, judge: Judge, evaluator: Evaluator, weights: Floats, budget: int, seed: int
) -> tuple[str, ...]:  # fmt: skip
    """Evaluate the designs of the study's method; returns what is to be warned of."""
    assert study.optimize is not None
    section = study.optimize
    if section.method == "grid":
        variables = grid(study)
        judge.progress.start(len(next(iter(variables.values()))), "designs")
        judge.evaluate(variables)
        return ()
    dimensions, smallest = len(section.variables), [each.smallest for each in judge.goals]
    judge.progress.start(budget, "designs")
    # Values of a workspace are known to a tolerance only.
    rough = bool(evaluator.questions)
    explorer = Explorer(judge.known, dimensions, budget, judge.parts(), rough=rough, slow=evaluator.slow)
    if section.method == "search":
        use_all = section.evaluations is not None
        ending = searching.search(explorer, smallest, weights.tolist(), seed, use_all=use_all)
        names = [[goal.name for goal, weight in zip(judge.goals, row, strict=True) if weight] for row in weights]
        return tuple(_doubts(ending, budget, [own[0] if len(own) == 1 else "a weighted sum" for own in names]))
    # The ends of the front, and what is best on the whole, are searched for; between them it is spread.
    explorer.left = budget // 2
    ones = np.ones((1, len(smallest)))
    searching.search(explorer, smallest, [*np.eye(len(smallest)).tolist(), *ones.tolist()], seed, use_all=False)
    explorer.left += budget - budget // 2
    pareto.spread(explorer, np.where(smallest, 1.0, -1.0), seed)
    return ()


def _doubts(ending: searching.Ending, budget: int, objectives: Sequence[str]) -> Iterator[str]:
    """What speaks against the optima of a search; `objectives` are what each row of weights looks for."""
    more = f"allow more, e.g. optimize.evaluations: {4 * budget}"
    if not ending.checked:
        yield f"the search ended with its {budget} evaluations before its optimum was confirmed; {more}"
    for row, (ends, rounding, best) in enumerate(zip(ending.ends, ending.rounding, ending.best, strict=True)):
        found = ends[np.isfinite(ends)]
        far = max(searching.AGREEMENT * np.abs(found).min(initial=np.inf), rounding)
        agree = np.abs(found - found.min(initial=np.inf)) <= far
        if len(ends) > 1 and agree.sum() < len(ends):
            of = f" for row {row + 1} of the weights" if len(ending.ends) > 1 else ""
            lost = f", {len(ends) - len(found)} found no feasible design" if len(found) < len(ends) else ""
            spread = "nowhere"
            if len(found):
                spread = f"with {objectives[row]} between {abs(found).min():.6g} and {abs(found).max():.6g}"
            last = f", and the last steps from the best led to {abs(best):.6g}" * bool(
                len(found) and best < found.min() - far
            )
            yield (f"the {len(ends)} starts of the search{of} ended {spread}, {agree.sum()} of them within "
                   f"{100 * searching.AGREEMENT:g} % of the best{lost}{last}; {more}")  # fmt: skip


def _none_feasible(designs: Designs) -> str:
    reasons = designs.counted()
    if not reasons:
        return "no design can be made: the bounds of the variables leave no value"
    told = "; ".join(f"{reason} ({count} designs)" for reason, count, _ in reasons[:MAX_REASONS])
    for each in designs.conditions:
        index, statistic = split(each.column) if each.regional and each.shape is None else ("", "")
        values = designs.found[each][np.isfinite(designs.found[each])] if statistic == "min" else np.empty(0)
        if values.size and (np.abs(values) <= 0).all():
            told += (f"; {each.column} is 0 in all of them, as it is wherever the region ends at a singularity: bound "
                     f"{index}_mean, or keep the region off singularities by mechanism.limits")  # fmt: skip
    return f"no design of {len(designs)} is feasible: {told}"


def _finished_part(designs: Designs) -> Result:
    table = designs_table(designs)
    told = f"interrupted after {len(designs)} designs; --resume goes on"
    return Result("optimize", {table.name: table}, (told,), {"designs": len(designs)}, interrupted=told)


def _warnings(evaluator: Evaluator, designs: Designs) -> Iterator[str]:
    reasons = designs.counted()
    for reason, count, first in reasons[:MAX_REASONS]:
        place = in_words(designs.numbers(first))
        yield f"{count} of {len(designs)} designs are infeasible: {reason} (first at {place})"
    if len(reasons) > MAX_REASONS:
        yield f"designs are infeasible for {len(reasons) - MAX_REASONS} more reasons; see designs.csv"
    for goal, values in zip(designs.goals, designs.values[designs.feasible].T, strict=True):
        if len(values) > 1 and np.ptp(values) <= TIE * max(1.0, np.abs(values).max()):
            yield (f"all {len(values)} feasible designs tie: {goal.name} is {values[0]:.6g} in each of them; a goal of "
                   "magnitudes says abs: true")  # fmt: skip
    for goal in [each for each in designs.goals if each.unassembled]:
        optimum = ask(variant(evaluator.study, designs.numbers(designs.best)), goal.command)
        if part := missing(goal, optimum):
            yield f"{goal.name} of the optimum is that of a part of the motion: {part}"
    if not evaluator.questions or evaluator.questions[0].rule != "gauss":
        return
    for each, error in designs.errors.items():
        loose = designs.feasible & (error > 2 * evaluator.questions[0].tolerance * np.abs(designs.found[each]))
        if loose.any():
            told = f"{each.name} of {int(loose.sum())} designs is not known to the tolerance asked for"
            yield f"{told}; see {each.name}_error"


def _meanings(study: Study, evaluator: Evaluator) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each number of the workspace, by its column."""
    if not evaluator.questions:
        return {}
    assert study.workspace is not None
    found = index_meanings(study, evaluator.questions[0])
    for each in evaluator.goals:
        if each.shape is not None:
            told = f"largest factor by which the {each.shape.name} may be scaled for the workspace to hold it"
            found[each.column] = "", f"{told}: contained from 1 on, negative where its centre lies outside"
    if len(evaluator.questions) > 1:
        held = [f"{name} = {', '.join(f'{v:g}' for v in values)}"
                for name, values in study.workspace.at.items() if not isinstance(values, Over)]  # fmt: skip
        return {name: (unit, f"{meaning}; the worst at {'; '.join(held)}") for name, (unit, meaning) in found.items()}
    return found


def optimum_files(study: Study, designs: Designs, marked: Mapping[str, int]) -> tuple[dict[str, str], list[str]]:
    """Texts by file name, ``optimum.yaml`` for the first row of weights, ``optimum_2.yaml`` ..., and what is wrong.

    `marked` are further designs worth a file, by its name without the suffix.
    """
    goals = [each.name for each in designs.goals]
    wanted = {}
    for row, winner in enumerate(designs.winners.tolist()):
        weights = ", ".join(f"{each} {weight:g}" for each, weight in zip(goals, designs.weights[row], strict=True))
        name = f"optimum_{row + 1}" if row else "optimum"
        wanted[name] = winner, f"Optimum of {study.name} for the weights {weights}"
    wanted |= {name: (k, f"{name.capitalize()} of the Pareto front of {study.name}") for name, k in marked.items()}
    files: dict[str, str] = {}
    doubts = []
    for name, (k, heading) in wanted.items():
        numbers = designs.numbers(k)
        heading = f"{heading}: {in_words(numbers)}"
        data = changed_data(study, numbers)
        try:
            best = variant(study, numbers)
            doubts += [f"{name}.yaml: {words}" for words in _parted(best, designs)]
            judged = [each for each in (*designs.goals, *designs.conditions) if not each.expression]
            commands = tuple(dict.fromkeys(each.command for each in judged))
            drawings, given = _drawings(best, commands), _given(best, commands)
            while not _assembles_alike(study, best.mechanism, data, given):
                pose = next(drawings, None)
                if pose is None:
                    doubts.append(f"{name}.yaml: its sketch chooses another assembly than the optimum's; mend it")
                    break
                sketch = data["mechanism"]["sketch"]
                places = [np.asarray(pose.point(point)).item() for point in sketch]
                sketch |= {point: [z.real, z.imag] for point, z in zip(sketch, places, strict=True)}
        except MechdesignError as error:
            doubts.append(f"{name}.yaml: {str(error).splitlines()[0]}")
        text, beside = rewritten(study, data, heading)
        files |= {f"{name}.yaml": text, **beside}
    return files, doubts


def _parted(study: Study, designs: Designs) -> Iterator[str]:
    """Listed poses that one drive does not lead from one to the next."""
    if not any(each.command == "kinematics" and not each.expression for each in designs.goals):
        return
    poses = study_poses(study, "kinematics")
    if not poses.listed or len(poses.groups) > 1 or len(poses.names) > 1 or poses.count < 2:
        return
    (name,), listed = poses.names, poses.groups[0].values[poses.names[0]]
    values = np.linspace(listed[:-1], listed[1:], BETWEEN + 2, axis=1)[:, 1:-1].ravel()
    group = PoseGroup((name,), {name: values}, np.arange(len(values)))
    failed = np.zeros(len(values), dtype=bool)
    for solved in solve_poses(study, Poses((group,), len(values), False, (len(values),))):
        failed[solved.rows] = ~solved.configuration.valid
    missed = np.flatnonzero(failed.reshape(-1, BETWEEN).any(axis=1)).tolist()
    unit = study.units.label(study.mechanism.quantity(name))
    if missed:
        ways = ", ".join(f"{k + 1} and {k + 2} ({listed[k]:.6g} to {listed[k + 1]:.6g} {unit})" for k in missed)
        yield (
            f"{name} cannot run from pose to pose: between poses {ways} the mechanism is stopped or comes apart; "
            "a condition keeps off such places, e.g. subject_to: [{result: kinematics.conditioning, at_least: 0.3}]"
        )


def _given(study: Study, commands: Iterable[str]) -> list[tuple[str, ...]]:
    """Coordinates from which commands find poses, and the drives."""
    found = [study.mechanism.drives]
    for command in commands:
        if command == "workspace" and study.workspace is not None:
            found.append((f"{study.workspace.point}.x", f"{study.workspace.point}.y", *study.workspace.at))
        else:
            found += [tuple(group.names) for group in study_poses(study, command).groups]
    return found


def _drawings(study: Study, commands: Iterable[str]) -> Iterator[Configuration]:
    """Poses that a design may be drawn in: its sketch as it assembles, or else one that a command asks for."""
    yield study.mechanism.sketch_configuration
    for command in commands:
        poses = workspace_nodes(study) if command == "workspace" else study_poses(study, command)
        for solved in solve_poses(study, poses):
            pose = solved.configuration
            valid = np.flatnonzero(pose.valid)
            if valid.size:
                # A workspace begins at its boundary, where legs are stretched: the pose that is farthest from that.
                closures = [np.broadcast_to(each, pose.shape)[valid] for each in pose.closures]
                farthest = int(np.min(closures, axis=0).argmax()) if closures else valid.size // 2
                yield pose.take(int(valid[farthest]))
                break


def _assembles_alike(
    study: Study, mechanism: Mechanism, data: Mapping[str, Any], given: Iterable[tuple[str, ...]]
) -> bool:  # fmt: skip
    """Whether the study of this data has the assemblies of the mechanism that was evaluated, whatever is given."""
    try:
        text = yaml.safe_dump(dict(data), sort_keys=False).encode()
        alone = load_bytes(text, study.path, folder=study.folder).mechanism
        return all(alone.plan(names).modes == mechanism.plan(names).modes for names in given)
    except MechdesignError:
        return False


def _centres(study: Study, shapes: Sequence[Shape]) -> list[complex]:
    """Where a design's workspace holds shapes best."""
    if not shapes:
        return []
    panels = answer(questions(study, wanted=("area",))[0], {}, 1, SINGLE).panels
    return [complex(fitting_scale(shape, panels)[1][0]) for shape in shapes]


def _places(designs: Designs, evaluator: Evaluator) -> dict[str, Complexes]:
    """Where the optima hold shapes that may lie anywhere, of a single region."""
    shapes = [each.shape for each in designs.conditions if each.shape is not None and each.shape.centre is None]
    if not shapes or len(evaluator.questions) > 1:
        return {}
    rows = [_centres(variant(designs.study, designs.numbers(k)), shapes) for k in designs.winners.tolist()]
    return {shape.name: column for shape, column in zip(shapes, np.array(rows, dtype=complex).T, strict=True)}


def drawn_design(designs: Designs, numbers: Mapping[str, float]) -> tuple[Study, Result]:
    """A design as a study, with what was judged of it: its workspace, or else its motion with the targets' errors."""
    made = variant(designs.study, numbers)
    judged = (*designs.goals, *designs.conditions)
    if made.workspace is not None and any(each.command == "workspace" for each in judged):
        # The region is drawn, not its indices.
        plain = dataclasses.replace(made, workspace=made.workspace.model_copy(update={"indices": ()}))
        result = workspace(plain)
        if "local" in result.tables:
            shapes = [each.shape for each in designs.conditions if each.shape is not None]
            contained = list(zip(shapes, _centres(plain, shapes), strict=True))
            return plain, dataclasses.replace(result, drawn={**result.drawn, "contained": contained})
    with suppress(MechdesignError):
        if any(each.command == "kinematics" for each in designs.goals):
            return made, kinematics(made).seen
        return made, Result("kinematics", {}, drawn={"motion": solve_shown(made)})
    return made, Result("kinematics", {})
