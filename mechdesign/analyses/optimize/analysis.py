"""Which dimensions are best? A grid, a search or a Pareto front of designs, compared by normalised, weighted goals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from mechdesign.analyses.optimize import search as searching
from mechdesign.analyses.optimize.cube import from_cube
from mechdesign.analyses.optimize.designs import grid, in_words
from mechdesign.analyses.optimize.explorer import Explorer, Outcome
from mechdesign.analyses.optimize.files import optimum_files
from mechdesign.analyses.optimize.goals import Evaluated, Evaluator, Goal, goals_of
from mechdesign.analyses.optimize.judging import CHUNK, Batch, Designs, Judge
from mechdesign.analyses.optimize.sensitivity import active_bounds, neighbours, sensitivity_table
from mechdesign.analyses.optimize.shown import best_design
from mechdesign.analyses.optimize.tables import Comparison, best_table, bounds_table, designs_table, optimum_table
from mechdesign.analyses.workspace.analysis import index_meanings
from mechdesign.analyses.workspace.question import GRID_TOLERANCE, questions
from mechdesign.errors import AssemblyError, Interrupted, StudyError
from mechdesign.journal import Journal
from mechdesign.numerics.arrays import Floats
from mechdesign.progress import NULL, Progress
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.threads import one_thread

# Numbers of rows that a search keeps.
MOST_KEPT = 10_000_000
MOST_REASONS = 10
Compute = Callable[[Iterable[Batch]], Iterator[Evaluated]]


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
    study : Study
        With an optimize section.
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
    goals = _goals(study)
    assert study.optimize is not None
    most_rows = 0 if study.optimize.method == "grid" else MOST_KEPT
    judge = Judge(study, goals, jobs, progress, journal, most_rows=most_rows)
    budget = _budget(study, len(goals), slow=judge.slow)
    judge.limit_rows(most_rows // budget)
    try:
        with judge.open() as compute:
            doubt = _ask(study, judge, compute, budget, study.seed if seed is None else seed)
            designs = judge.designs()
            if not designs.feasible.any():
                raise AssemblyError(_none_feasible(designs))
            compared = Comparison.of(study, designs, _weights(study, len(goals)), _meanings(study, goals))
            near = neighbours(study, compared)
            progress.start(len(near), "neighbours of the optimum")
            found = judge.evaluate(compute, _chunks(near.designs, judge.chunk))
    except KeyboardInterrupt:
        if journal is not None:
            journal.save()
        partial = judge.designs()
        if not len(partial):
            raise
        raise Interrupted(_finished_part(study, partial, _meanings(study, goals))) from None
    tables = [
        optimum_table(compared, active_bounds(study, compared)),
        designs_table(compared),
        bounds_table(compared),
        best_table(study, compared),
        sensitivity_table(study, compared, near, found),
    ]
    marked: dict[str, int] = {}
    if study.optimize.method == "pareto":
        from mechdesign.analyses.optimize.pareto_table import pareto_table

        table, marked = pareto_table(compared)
        tables.insert(0, table)
    files, doubts = optimum_files(study, compared, marked)
    counts = {"designs": len(designs), "infeasible": int((~designs.feasible).sum())}
    warnings = (*doubt, *_warnings(study, designs), *doubts)
    drawn = {"best": lambda: best_design(compared)}
    return Result("optimize", {table.name: table for table in tables}, warnings, counts, files=files, drawn=drawn)


def _goals(study: Study) -> tuple[Goal, ...]:
    section = study.optimize
    if section is None or not section.variables:
        raise StudyError((study.problem("an optimisation needs variables", "optimize", "variables"),))
    goals = goals_of(section)
    if not goals:
        message = "what is to be best? e.g. maximize: [GII, GRI, SUI], or minimize"
        raise StudyError((study.problem(message, "optimize", "maximize"),))
    return goals


def _weights(study: Study, goals: int) -> Floats:
    assert study.optimize is not None
    rows = study.optimize.weights
    return np.array(rows if rows else [[1.0] * goals], dtype=float).reshape(-1, goals)


def _budget(study: Study, goals: int, *, slow: bool) -> int:
    """How many designs may be evaluated where they are searched."""
    section = study.optimize
    assert section is not None
    if section.evaluations is not None:
        return section.evaluations
    if section.method == "pareto":
        from mechdesign.analyses.optimize import pareto

        return pareto.allowance(goals)
    rows = _weights(study, goals)
    return searching.allowance(len(section.variables), len(rows), goals, slow=slow)


def _ask(study: Study, judge: Judge, compute: Compute, budget: int, seed: int) -> tuple[str, ...]:
    """Evaluate the designs of the study's method; returns what is to be warned of."""
    assert study.optimize is not None
    section, goals = study.optimize, judge.goals
    if section.method == "grid":
        variables = grid(study)
        judge.progress.start(len(next(iter(variables.values()))), "designs")
        judge.evaluate(compute, _chunks(variables, CHUNK))
        return ()
    dimensions, smallest = len(section.variables), [each.smallest for each in goals]

    def evaluate(u: Floats) -> Outcome:
        designs, given = from_cube(study, u)
        found = np.full((len(u), judge.width), np.nan)
        if given.any():
            found[given] = judge.evaluate(compute, _chunks({k: v[given] for k, v in designs.items()}, judge.chunk))
        width = len(judge.wanted)
        found[:, :width][found[:, width] > 0] = np.nan
        column = {each: k for k, each in enumerate(judge.wanted)}
        margins = [(bound - found[:, column[each]]) * (1 if upper else -1) for each, bound, upper in judge.conditions]
        stacked = np.stack(margins, axis=1) if margins else np.empty((len(u), 0))
        return Outcome(found[:, : len(goals)], stacked, found[:, 2 * width + 2 :], found[:, 2 * width + 1])

    judge.progress.start(budget, "designs")
    explorer = Explorer(evaluate, dimensions, budget, judge.parts(), rough=judge.rough, slow=judge.slow)
    if section.method == "search":
        rows = _weights(study, len(goals)).tolist()
        patient = section.evaluations is not None
        return tuple(_doubts(searching.search(explorer, smallest, rows, seed, patient=patient), budget))
    from mechdesign.analyses.optimize import pareto

    # The ends of the front, and what is best on the whole, are searched for; between them it is spread.
    explorer.left = budget // 2
    alike = [[1.0] * len(goals)]
    searching.search(explorer, smallest, [*np.eye(len(goals)).tolist(), *alike], seed, patient=False)
    explorer.left += budget - budget // 2
    size, signs = pareto.population(explorer.left), np.where(smallest, 1.0, -1.0)
    begun = pareto.promising(explorer.known, signs, size // 2)
    others = searching.sample(dimensions, np.random.default_rng(seed), size - len(begun), explorer.left)
    pareto.evolve(explorer, signs, np.concatenate([explorer.known.u[begun], others]), seed)
    return ()


def _doubts(ending: searching.Ending, budget: int) -> Iterator[str]:
    """What speaks against the optima of a search."""
    more = f"allow more, e.g. optimize.evaluations: {4 * budget}"
    if not ending.checked:
        yield f"the search ended with its {budget} evaluations before its optimum was confirmed; {more}"
    for row, (ends, rounding) in enumerate(zip(ending.ends, ending.rounding, strict=True)):
        found = ends[np.isfinite(ends)]
        far = max(searching.AGREE * np.abs(found).min(initial=np.inf), rounding)
        agree = np.abs(found - found.min(initial=np.inf)) <= far
        if len(ends) > 1 and agree.sum() < len(ends):
            of = f" for row {row + 1} of the weights" if len(ending.ends) > 1 else ""
            lost = f", {len(ends) - len(found)} found no feasible design" if len(found) < len(ends) else ""
            spread = f"between {abs(found).min():.6g} and {abs(found).max():.6g}" if len(found) else "nowhere"
            yield (f"the {len(ends)} starts of the search{of} ended {spread}, {agree.sum()} of them within "
                   f"{100 * searching.AGREE:g} % of the best{lost}; {more}")  # fmt: skip


def _chunks(designs: Batch, size: int) -> Iterator[Batch]:
    count = len(next(iter(designs.values())))
    for k in range(0, count, size):
        yield {name: column[k : k + size] for name, column in designs.items()}


def _meanings(study: Study, goals: tuple[Goal, ...]) -> dict[str, tuple[str, str]]:
    if not any(each.index for each in goals):
        return {}
    question = Evaluator(study, [each for each in goals if each.index]).question
    assert question is not None
    return index_meanings(study, question)


def _none_feasible(designs: Designs) -> str:
    reasons = designs.reasons()
    if not reasons:
        return "no design can be made: the bounds of the variables leave no value"
    told = "; ".join(f"{reason} ({count} designs)" for reason, count, _ in reasons[:MOST_REASONS])
    return f"no design of {len(designs)} is feasible: {told}"


def _finished_part(study: Study, designs: Designs, meanings: dict[str, tuple[str, str]]) -> Result:
    weights = np.ones((1, len(designs.goals)))
    compared = Comparison.of(study, designs, weights, meanings)
    table: Table = designs_table(compared)
    told = f"interrupted after {len(designs)} designs; --resume goes on"
    return Result("optimize", {table.name: table}, (told,), {"designs": len(designs)}, interrupted=told)


def _warnings(study: Study, designs: Designs) -> Iterator[str]:
    reasons = designs.reasons()
    for reason, count, first in reasons[:MOST_REASONS]:
        row = {name: float(column[first]) for name, column in designs.variables.items()}
        yield f"{count} of {len(designs)} designs are infeasible: {reason} (first at {in_words(row)})"
    if len(reasons) > MOST_REASONS:
        yield f"designs are infeasible for {len(reasons) - MOST_REASONS} more reasons; see designs.csv"
    if study.workspace is None or study.workspace.integrate.rule != "gauss":
        return
    tolerance = questions(study, GRID_TOLERANCE)[0].tolerance
    for name, error in designs.errors.items():
        value = next(designs.values[each] for each in designs.values if each.name == name)
        loose = designs.feasible & (error > 2 * tolerance * np.abs(value))
        if loose.any():
            yield f"{name} of {int(loose.sum())} designs is not known to the tolerance asked for; see {name}_error"
