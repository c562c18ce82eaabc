"""Which dimensions are best? A grid, a search or a Pareto front of designs, compared; the best as study files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechdesign.family.evaluator import missing
from mechdesign.family.goals import shape_of
from mechdesign.family.question import DesignsQuestion
from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import AssemblyError, Interrupted, MechdesignError, StudyError
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.progress import NULL, Progress
from mechdesign.ground.results import Drawn, Result
from mechdesign.ground.work.chunks import workers
from mechdesign.ground.work.journal import Journal
from mechdesign.ground.work.threads import one_thread
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.kinematics.drawn import DrawnMotion
from mechdesign.questions.look import ask
from mechdesign.questions.optimize import pareto
from mechdesign.questions.optimize import search as searching
from mechdesign.questions.optimize.curves import near_curves
from mechdesign.questions.optimize.explorer import Explorer
from mechdesign.questions.optimize.files import design_files
from mechdesign.questions.optimize.judge import DesignSet, Judge
from mechdesign.questions.optimize.question import VariableFamily, designs_question
from mechdesign.questions.optimize.schema import Containment
from mechdesign.questions.optimize.tables import (
    best_table,
    bounds_table,
    designs_table,
    nearest_table,
    optimum_table,
    sensitivity_table,
)
from mechdesign.questions.optimize.variables import Design, from_cube, grid, in_words, study_of
from mechdesign.questions.poses import Shown, solve_shown
from mechdesign.questions.workspace.analysis import workspace
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions, split
from mechdesign.region.growth import fitted
from mechdesign.region.rays import SINGLE
from mechdesign.region.shapes import Shape
from mechdesign.study import Study

# Most numbers of rows behind the goals that a search keeps.
MAX_KEPT_ROWS = 30_000_000
# Reasons of infeasible designs that are reported one by one.
MAX_REASONS = 10
# Largest difference of a goal, in its unit or as a part of its size, with which designs tie.
TIE = 1e-12


@one_thread()
def optimize(
    study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL,
    journal: Journal | None = None,
) -> Result:  # fmt: skip
    """Evaluate designs, and find the best for each set of weights [S1, eqs. 27, 28]; see `mechdesign.optimize`."""
    section = study.optimize
    if section is None or not section.variables:
        message = "are missing: say what may change, for example {crank.length: {from: 20, to: 40, step: 5}}"
        raise StudyError((study.problem(message, "optimize", "variables"),))
    if not (section.maximize or section.minimize):
        message = "what is to be best? e.g. maximize: [GII, GRI, SUI], or minimize"
        raise StudyError((study.problem(message, "optimize", "maximize"),))
    question = designs_question(study, graded=section.method != "grid")
    goals = question.objectives
    weights = np.array(section.weights or [[1.0] * len(goals)], dtype=float).reshape(-1, len(goals))
    budget = section.evaluations or (
        pareto.allowance(len(goals), alone=bool(question.alone))
        if section.method == "pareto"
        else searching.allowance(len(section.variables), len(weights), alone=bool(question.alone))
    )
    question.limit(MAX_KEPT_ROWS // budget)
    meanings = question.meanings
    with workers(VariableFamily(question), jobs, travels=True) as compute:
        judge = Judge(question, compute, progress, journal)
        try:
            doubts = _ask(study, judge, weights, budget, study.seed if seed is None else seed)
            designs = judge.designs(weights, meanings)
            if not designs.feasible.any():
                raise _nothing_feasible(study, designs, judge.nearest())
            if section.method == "pareto":
                pareto_front = pareto.front_of(designs)
                designs = pareto.optima(designs, pareto_front, weights if section.weights else weights[:0])
            sensitivity = sensitivity_table(designs, judge)
        except KeyboardInterrupt:
            if journal is not None:
                journal.save()
            partial = judge.designs(weights, meanings)
            if not len(partial):
                raise
            raise Interrupted(_finished_part(partial)) from None
    tables = [
        optimum_table(designs, _places(designs, question)), designs_table(designs), bounds_table(designs),
        best_table(designs), sensitivity,
    ]  # fmt: skip
    if section.method == "pareto":
        growth = pareto.growth_table(designs)
        tables = [pareto.pareto_table(designs, pareto_front), *tables, growth]
        doubts += tuple(pareto.doubts(growth, budget))
    files, wrong = design_files(study, designs, _optima(designs))
    counts = {"designs": len(designs), "infeasible": int((~designs.feasible).sum())}
    warnings = (*doubts, *_warnings(question, designs), *wrong)
    named = {table.name: table for table in tables}
    return Result("optimize", named, warnings, counts, files=files, drawn=DrawnDesigns(designs))


def _ask(
    study: Study, judge: Judge, weights: Floats, budget: int, seed: int
) -> tuple[Caution, ...]:  # fmt: skip
    """Evaluate the designs of the study's method; returns warnings."""
    assert study.optimize is not None
    section = study.optimize
    if section.method == "grid":
        variables = grid(study)
        judge.progress.start(len(next(iter(variables.values()))), "designs")
        judge.evaluate(variables)
        return ()
    dimensions, signs = len(section.variables), np.array([goal.sign for goal in judge.goals])
    judge.progress.start(budget, "designs")
    explorer = Explorer(
        judge.points, dimensions, budget, judge.parts(), snap=lambda u: from_cube(study, u).u, rough=judge.rough
    )
    if section.method == "search":
        use_all = section.evaluations is not None
        near = near_curves(study, judge.goals, judge.conditions, seed)
        ending = searching.search(explorer, signs, weights.tolist(), seed, use_all=use_all, near=near)
        names = [[goal.name for goal, weight in zip(judge.goals, row, strict=True) if weight] for row in weights]
        objectives = [own[0] if len(own) == 1 else "a weighted sum" for own in names]
        return tuple(_doubts(ending, budget, objectives))
    pareto.search_front(explorer, signs, seed, use_all=section.evaluations is not None)
    return ()


def _doubts(ending: searching.Ending, budget: int, objectives: Sequence[str]) -> Iterator[Caution]:
    """Warnings about the optima of a search; `objectives` names the objective of each row of weights."""
    more = f"allow more, e.g. optimize.evaluations: {4 * budget}"
    if not ending.checked:
        early = f"the search ended with its {budget} evaluations before its optimum was confirmed; {more}"
        yield Caution("unconverged", early, "optimum")
    for row, (ends, rounding, best) in enumerate(zip(ending.ends, ending.rounding, ending.best, strict=True)):
        feasible = ends[np.isfinite(ends)]
        far = max(searching.AGREEMENT * np.abs(feasible).min(initial=np.inf), rounding)
        agree = np.abs(feasible - feasible.min(initial=np.inf)) <= far
        if len(ends) > 1 and agree.sum() < min(len(ends), searching.CONFIRMATIONS):
            of = f" for row {row + 1} of the weights" if len(ending.ends) > 1 else ""
            lost = f", {len(ends) - len(feasible)} found no feasible design" if len(feasible) < len(ends) else ""
            spread = "nowhere"
            if len(feasible):
                ends_at = " and ".join(numeral(end) for end in (abs(feasible).min(), abs(feasible).max()))
                spread = f"with {objectives[row]} between {ends_at}"
            last = f", and the last steps from the best led to {numeral(abs(best))}" * bool(
                len(feasible) and best < feasible.min() - far
            )
            yield Caution(
                "unconverged",
                f"the {len(ends)} starts of the search{of} ended {spread}, {agree.sum()} of them within "
                f"{100 * searching.AGREEMENT:g} % of the best{lost}{last}; {more}",
                "optimum", row,
            )  # fmt: skip


def _optima(designs: DesignSet) -> dict[str, tuple[int, str]]:
    """The optima by the names of their files: ``optimum`` for the first row, then ``optimum_2``; and a front's knee."""
    files = {}
    for row, winner in enumerate(designs.winners.tolist()):
        pairs = zip(designs.goals, designs.weights[row], strict=True)
        weights = ", ".join(f"{goal.name} {weight:g}" for goal, weight in pairs)
        mark = designs.marks[row] if designs.marks else ""
        heading = f"Optimum of {designs.study.name} for the weights {weights}"
        if row < len(designs.chosen):
            heading = f"{mark[0].upper()}{mark[1:]} on the Pareto front of {designs.study.name}"
        files[f"optimum_{row + 1}" if row else "optimum"] = winner, heading
    return files | ({"knee": files["optimum"]} if len(designs.chosen) else {})


def _nothing_feasible(study: Study, designs: DesignSet, nearest: int | None) -> AssemblyError:
    """Why no design is feasible, and by how much the nearest one misses each condition."""
    message = _none_feasible(designs)
    if nearest is None:
        return AssemblyError(message)
    table = nearest_table(designs, nearest)
    short = [
        f"{row['condition']} by {numeral(row['missing'])} {row['unit']}".rstrip()
        + f" (it is {numeral(row['value'])})" * bool(np.isfinite(row["value"]))
        for row in table if not row["missing"] <= 0
    ]  # fmt: skip
    if short:
        message += f"; the nearest, {in_words(designs.design(nearest))}, misses {', '.join(short)}; see nearest.yaml"
    files, wrong = design_files(study, designs, {"nearest": (nearest, f"Nearest to a feasible design of {study.name}")})
    counts = {"designs": len(designs), "infeasible": len(designs)}
    tables = {part.name: part for part in (table, designs_table(designs))}
    return AssemblyError(message, Result("optimize", tables, tuple(wrong), counts, failed=message, files=files))


def _none_feasible(designs: DesignSet) -> str:
    reasons = designs.counted()
    if not reasons:
        return "no design can be made: the bounds of the variables leave no value"
    message = "; ".join(f"{reason} ({count} designs)" for reason, count, _ in reasons[:MAX_REASONS])
    for condition in designs.conditions:
        index, statistic = split(condition.column) if condition.regional and condition.outline is None else ("", "")
        values = designs.results[condition]
        if statistic == "min" and np.isfinite(values).any() and not np.any(values[np.isfinite(values)]):
            message += (
                f"; {condition.column} is 0 in all of them, as it is wherever the region ends at a singularity: "
                f"bound {index}_mean, or keep the region off singularities by mechanism.limits"
            )
    return f"no design of {len(designs)} is feasible: {message}"


def _finished_part(designs: DesignSet) -> Result:
    table = designs_table(designs)
    message = f"interrupted after {len(designs)} designs; --resume goes on"
    partly = Caution("incomplete", message, table.name)
    return Result("optimize", {table.name: table}, (partly,), {"designs": len(designs)}, interrupted=message)


def _warnings(question: DesignsQuestion, designs: DesignSet) -> Iterator[Caution]:
    reasons = designs.counted()
    for reason, count, first in reasons[:MAX_REASONS]:
        place = in_words(designs.design(first))
        words = f"{count} of {len(designs)} designs are infeasible: {reason} (first at {place})"
        yield Caution("infeasible", words, "designs", first, place)
    if len(reasons) > MAX_REASONS:
        words = f"designs are infeasible for {len(reasons) - MAX_REASONS} more reasons; see designs.csv"
        yield Caution("infeasible", words, "designs")
    for goal, values in zip(designs.goals, designs.values[designs.feasible].T, strict=True):
        if len(values) > 1 and np.ptp(values) <= TIE * max(1.0, np.abs(values).max()):
            yield Caution(
                "suspect",
                f"all {len(values)} feasible designs tie: {goal.name} is {numeral(values[0])} in each of them; a goal "
                "of magnitudes says abs: true",
                "designs",
            )
    for goal in filter(lambda goal: goal.unassembled, designs.goals):
        optimum = ask(study_of(question.study, designs.design(designs.best)), goal.command)
        if part := missing(goal, optimum):
            of = f"{goal.name} of the optimum is that of a part of the motion"
            yield Caution("unassembled", f"{of}, as 'unassembled: allowed' lets it: {part}", "optimum")
    if not question.regions or question.regions[0].rule != "gauss":
        return
    for goal, error in designs.errors.items():
        loose = designs.feasible & (error > 2 * question.regions[0].tolerance * np.abs(designs.results[goal]))
        if loose.any():
            yield Caution(
                "unconverged",
                f"{goal.name} of {int(loose.sum())} designs is not known to the tolerance asked for; see "
                f"{goal.name}_error, or allow a larger workspace.integrate.tolerance",
                "designs", int(loose.argmax()),
            )  # fmt: skip


def _centres(study: Study, shapes: Sequence[Shape]) -> list[complex]:
    """Places at which a design's workspace holds shapes at the largest scale."""
    if not shapes:
        return []
    panels = answer(questions(study, columns=("area",))[0], {}, 1, SINGLE).panels
    return [complex(np.asarray(fitted(shape, panels)[1].centre)[0]) for shape in shapes]


def _places(designs: DesignSet, question: DesignsQuestion) -> dict[str, Complexes]:
    """Places of shapes without a given centre in the workspaces of the optima; none where there are several regions."""
    outlines = [condition.outline for condition in designs.conditions if condition.outline is not None]
    free = [outline for outline in outlines if outline.center is None]
    if not free or len(question.regions) > 1:
        return {}
    moved = designs.study.parameters.moved(designs.variables)
    made = (study_of(designs.study, designs.design(k)) for k in designs.winners.tolist())
    rows = [_centres(study, [shape for shape in _shapes(study) if shape.centre is None]) for study in made]
    return dict(zip((outline.named(moved) for outline in free), np.array(rows, dtype=complex).T, strict=True))


def _shapes(study: Study) -> list[Shape]:
    """The shapes that a design's workspace has to contain."""
    conditions = study.optimize.subject_to if study.optimize is not None else ()
    return [shape_of(condition.contains) for condition in conditions if isinstance(condition, Containment)]


@dataclass(frozen=True, eq=False)
class DrawnDesign:
    """A design as a study, with what was judged of it.

    Parameters
    ----------
    region : Result or None
        Its workspace, without indices; None where no goal or condition is about that.
    contained : sequence of (Shape, complex)
        What the region is to contain, each with the place of its centre where it fits best.
    motion : Result or None
        Its motion with the errors of the targets; None where no goal is about that, or no pose assembles.
    shown : Shown or None
        The poses of its motion, judged or not; None beside a region, and where they cannot be solved.
    """

    study: Study
    region: Result | None = None
    contained: Sequence[tuple[Shape, complex]] = ()
    motion: Result | None = None
    shown: Shown | None = None


@dataclass(frozen=True, eq=False)
class DrawnDesigns(Drawn):
    """All designs that were evaluated."""

    designs: DesignSet

    @cached_property
    def best(self) -> DrawnDesign:
        """The best of them, computed when it is first drawn."""
        return drawn_design(self.designs, self.designs.design(self.designs.best))


def drawn_design(designs: DesignSet, design: Design) -> DrawnDesign:
    """Compute what pictures of one design show: its workspace if that was judged, or else its motion."""
    made = study_of(designs.study, design)
    judged = (*designs.goals, *designs.conditions)
    if made.workspace is not None and any(goal.command == "workspace" for goal in judged):
        # Only the region is drawn.
        plain = made.with_sections(workspace=made.workspace.model_copy(update={"indices": ()}))
        result = workspace(plain)
        if "local" in result.tables:
            shapes = _shapes(made)
            return DrawnDesign(plain, result, list(zip(shapes, _centres(plain, shapes), strict=True)))
    with suppress(MechdesignError):
        if any(goal.command == "kinematics" for goal in designs.goals):
            motion = kinematics(made).seen
            return DrawnDesign(made, motion=motion, shown=DrawnMotion.of(motion).shown)
        return DrawnDesign(made, shown=solve_shown(made))
    return DrawnDesign(made)
