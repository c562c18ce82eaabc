"""Which dimensions are best? A grid, a search or a Pareto front of designs, compared; the best as study files."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import yaml

from mechdesign.analyses.kinematics.analysis import kinematics
from mechdesign.analyses.optimize import pareto
from mechdesign.analyses.optimize import search as searching
from mechdesign.analyses.optimize.evaluation import Evaluator
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
from mechdesign.analyses.poses import solve_shown
from mechdesign.analyses.workspace.analysis import index_meanings, workspace
from mechdesign.errors import AssemblyError, Interrupted, MechdesignError, StudyError
from mechdesign.journal import Journal
from mechdesign.mechanism import Mechanism
from mechdesign.numerics.arrays import Floats
from mechdesign.parallel import one_thread, workers
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.variants import changed_data, rewritten, variant

# Numbers that a search keeps of the rows behind its goals.
MAX_KEPT_ROWS = 10_000_000
# Reasons of infeasible designs that are reported one by one.
MAX_REASONS = 10


@one_thread()
def optimize(
    study: Study,
    *,
    seed: int | None = None,
    jobs: int | None = 1,
    progress: Progress = NULL,
    journal: Journal | None = None,
) -> Result:
    """Evaluate designs, and find the best one for each set of weights [S1, eqs. 27, 28].

    Parameters
    ----------
    seed : int, optional
        Of the search and the front, in place of the study's; a grid is not random.
    jobs : int or None
        Workers; the result does not depend on their number.
    journal : Journal, optional
        Where finished designs are kept when the computation is interrupted, and found when it is begun anew.

    Raises
    ------
    StudyError
        If there is nothing to vary or to compare.
    AssemblyError
        If no design is feasible; the message says why, what most designs fail by first.
    Interrupted
        On Ctrl-C, with the designs that are finished.
    """
    section = study.optimize
    if section is None or not section.variables:
        raise StudyError((study.problem("an optimisation needs variables", "optimize", "variables"),))
    goals = tuple(goals_of(section))
    if not goals:
        message = "what is to be best? e.g. maximize: [GII, GRI, SUI], or minimize"
        raise StudyError((study.problem(message, "optimize", "maximize"),))
    weights = np.array(section.weights or [[1.0] * len(goals)], dtype=float).reshape(-1, len(goals))
    evaluator = Evaluator(study, graded=section.method != "grid")
    meanings = index_meanings(study, evaluator.question) if evaluator.question is not None else {}
    budget = section.evaluations or (
        pareto.FRONT_EVALUATIONS * len(goals)
        if section.method == "pareto"
        else searching.allowance(len(section.variables), len(weights), len(goals), slow=evaluator.slow)
    )
    evaluator.limit_rows(MAX_KEPT_ROWS // budget)
    with workers(evaluator, jobs, processes=True) as compute:
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
        optimum_table(designs), designs_table(designs), bounds_table(designs),
        best_table(designs), sensitivity,
    ]  # fmt: skip
    marked: dict[str, int] = {}
    if section.method == "pareto":
        table, marked["knee"] = pareto.pareto_table(designs)
        tables.insert(0, table)
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
    rough = evaluator.question is not None
    explorer = Explorer(judge.known, dimensions, budget, judge.parts(), rough=rough, slow=evaluator.slow)
    if section.method == "search":
        use_all = section.evaluations is not None
        return tuple(_doubts(searching.search(explorer, smallest, weights.tolist(), seed, use_all=use_all), budget))
    # The ends of the front, and what is best on the whole, are searched for; between them it is spread.
    explorer.left = budget // 2
    ones = np.ones((1, len(smallest)))
    searching.search(explorer, smallest, [*np.eye(len(smallest)).tolist(), *ones.tolist()], seed, use_all=False)
    explorer.left += budget - budget // 2
    pareto.spread(explorer, np.where(smallest, 1.0, -1.0), seed)
    return ()


def _doubts(ending: searching.Ending, budget: int) -> Iterator[str]:
    """What speaks against the optima of a search."""
    more = f"allow more, e.g. optimize.evaluations: {4 * budget}"
    if not ending.checked:
        yield f"the search ended with its {budget} evaluations before its optimum was confirmed; {more}"
    for row, (ends, rounding) in enumerate(zip(ending.ends, ending.rounding, strict=True)):
        found = ends[np.isfinite(ends)]
        far = max(searching.AGREEMENT * np.abs(found).min(initial=np.inf), rounding)
        agree = np.abs(found - found.min(initial=np.inf)) <= far
        if len(ends) > 1 and agree.sum() < len(ends):
            of = f" for row {row + 1} of the weights" if len(ending.ends) > 1 else ""
            lost = f", {len(ends) - len(found)} found no feasible design" if len(found) < len(ends) else ""
            spread = f"between {abs(found).min():.6g} and {abs(found).max():.6g}" if len(found) else "nowhere"
            yield (f"the {len(ends)} starts of the search{of} ended {spread}, {agree.sum()} of them within "
                   f"{100 * searching.AGREEMENT:g} % of the best{lost}; {more}")  # fmt: skip


def _none_feasible(designs: Designs) -> str:
    reasons = designs.counted()
    if not reasons:
        return "no design can be made: the bounds of the variables leave no value"
    told = "; ".join(f"{reason} ({count} designs)" for reason, count, _ in reasons[:MAX_REASONS])
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
    if evaluator.question is None or evaluator.question.rule != "gauss":
        return
    for each, error in designs.errors.items():
        loose = designs.feasible & (error > 2 * evaluator.question.tolerance * np.abs(designs.found[each]))
        if loose.any():
            told = f"{each.name} of {int(loose.sum())} designs is not known to the tolerance asked for"
            yield f"{told}; see {each.name}_error"


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
            mechanism = variant(study, numbers).mechanism
            if not _assembles_alike(study, mechanism, data):
                # With the sketch as it assembles.
                sketch = data["mechanism"]["sketch"]
                places = [np.asarray(mechanism.sketch_configuration.point(point)).item() for point in sketch]
                sketch |= {point: [z.real, z.imag] for point, z in zip(sketch, places, strict=True)}
                if not _assembles_alike(study, mechanism, data):
                    doubts.append(f"{name}.yaml: its sketch chooses another assembly than the optimum's; mend it")
        except MechdesignError as error:
            doubts.append(f"{name}.yaml: {str(error).splitlines()[0]}")
        text, beside = rewritten(study, data, heading)
        files |= {f"{name}.yaml": text, **beside}
    return files, doubts


def _assembles_alike(study: Study, mechanism: Mechanism, data: Mapping[str, Any]) -> bool:
    """Whether the study of this data has the assembly of the mechanism that was evaluated."""
    try:
        alone = load_bytes(yaml.safe_dump(dict(data), sort_keys=False).encode(), study.path)
    except MechdesignError:
        return False
    return alone.mechanism.forward.modes == mechanism.forward.modes


def drawn_design(designs: Designs, numbers: Mapping[str, float]) -> tuple[Study, Result]:
    """A design as a study, with what was judged of it: its workspace, or else its motion with the targets' errors."""
    made = variant(designs.study, numbers)
    if made.workspace is not None and any(each.command == "workspace" for each in designs.goals):
        # The region is drawn, not its indices.
        plain = dataclasses.replace(made, workspace=made.workspace.model_copy(update={"indices": ()}))
        result = workspace(plain)
        if "local" in result.tables:
            return plain, result
    with suppress(MechdesignError):
        if any(each.command == "kinematics" for each in designs.goals):
            return made, kinematics(made)
        return made, Result("kinematics", {}, drawn={"motion": solve_shown(made)})
    return made, Result("kinematics", {})
