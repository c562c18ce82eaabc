"""The optimize section of the study file, and conditions on results."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BeforeValidator, Discriminator, Tag, ValidationInfo

from mechdesign.ground.errors import suggestion
from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import ExpressionError
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.conditions import Condition, Judged, check_result
from mechdesign.study.schema.variable import Variable
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import failure, shown
from mechdesign.study.text.units import Amount

_METHODS = {
    "grid": "every design of the steps and choices of the variables",
    "search": "global search over ranges and choices, for each row of weights",
    "pareto": "the front between two goals or more, spread evenly",
}
_PAIR = fields.pair_of("[width, height]")


def _centre(raw: Any) -> Any:
    if raw != "free" and (not isinstance(raw, list) or len(raw) != 2):
        raise failure(f"expected [x, y] or free, not {shown(raw)}")
    return None if raw == "free" else raw


class Outline(fields.Model):
    """A circle, or a rectangle with sides along x and y."""

    one_of = ("a shape is one of rectangle: [width, height], circle: radius", "rectangle", "circle")
    rectangle: Annotated[tuple[fields.PositiveLengthPlace, fields.PositiveLengthPlace], _PAIR] | None = None
    """Sides [width, height], along x and y. Example: [200, 100]"""
    circle: fields.PositiveLengthPlace | None = None
    """Radius of a circle. Example: 80"""
    center: Annotated[
        tuple[fields.LengthPlace, fields.LengthPlace] | None,
        BeforeValidator(_centre),
        fields.OrShort({"const": "free"}),
    ] = None
    """Centre [x, y]. ``free``, or left out: anywhere in the region. Example: [0, 300]"""

    def named(self, moved: Collection[str] = ()) -> str:
        """``rectangle 180 x 90 at (0, 250)``; numbers that the parameters in `moved` change are named by their text."""

        def text(number: float) -> str:
            expression = Amount.of(number).expression
            return f"{number:g}" if expression is None or expression.names.isdisjoint(moved) else expression.text

        size = f"circle {text(self.circle)}" if self.circle is not None else ""
        if self.rectangle is not None:
            size = f"rectangle {' x '.join(map(text, self.rectangle))}"
        return size if self.center is None else f"{size} at ({', '.join(map(text, self.center))})"


class Containment(fields.Model):
    """A shape that the workspace must hold."""

    contains: Outline


def _condition_form(raw: Any) -> str:
    return "shape" if isinstance(raw, Containment) or (isinstance(raw, dict) and "contains" in raw) else "bounds"


AnyCondition = Annotated[
    Annotated[Containment, Tag("shape")] | Annotated[Condition, Tag("bounds")], Discriminator(_condition_form)
]


def _weight_row(raw: Any, info: ValidationInfo) -> Any:
    """Bring ``{GII: 1, SUI: 1}`` to a list in the order maximize then minimize; say what is wrong with a row."""
    if "maximize" not in info.data or "minimize" not in info.data:
        # The goals have mistakes, which are reported; the weights cannot be checked.
        return ()
    goals = [goal.name for goal in info.data["maximize"] + info.data["minimize"]]
    if isinstance(raw, Mapping):
        for name in raw:
            if name not in goals:
                raise failure(f"{name!r} is neither maximised nor minimised{suggestion(str(name), goals)}")
        return [raw.get(goal, 0) for goal in goals]
    if isinstance(raw, list) and len(raw) != len(goals):
        raise failure(f"{len(raw)} weights for {len(goals)} goals: {', '.join(goals)}")
    return raw


def _weights_that_choose(row: tuple[float, ...]) -> tuple[float, ...]:
    if any(weight < 0 for weight in row):
        raise failure("a weight is not negative: name the goal under 'minimize' instead of 'maximize', or the reverse")
    if row and not any(row):
        raise failure("all weights are zero: no design would be better than another; give one that is positive")
    return row


WeightRow = Annotated[
    tuple[fields.Pure, ...],
    BeforeValidator(_weight_row),
    AfterValidator(_weights_that_choose),
    fields.OrShort({"type": "object", "additionalProperties": fields.NUMBER_FORM}),
]


Goals = Annotated[tuple[Judged, ...], BeforeValidator(fields.as_list), fields.OrShort()]


class OptimizeSection(fields.Model):
    """What may be varied, what is to be best, and what every design must keep."""

    method: Annotated[str, fields.choice(_METHODS, "method of optimization")] = "grid"
    """How the best designs are looked for."""
    variables: dict[str, Variable]
    """Ranges or choices of parameters, of single dimensions (rod.length), or of any entry of the mechanism and of the
    questions by the name that ``--set`` takes. Example: {l_min: {from: 1, to: 5, step: 0.5}, l_a: {from: l_min, to:
    2*l_min, number: 9}} Example: {teeth: {from: 10, to: 30, integer: true}, d: {choices: [8, 10, 12]}} Example:
    {stiffness.elastic.rod: {choices: [bar, tube]}}
    """
    maximize: Goals = ()
    """Results that are to be large; one alone needs no list. Their worst row counts, the smallest, along a motion the
    worst place between the rows, too. Example: [GII, SUI, {result: reliability.reliability, where: {method: analytic}}]
    """
    minimize: Goals = ()
    """Results that are to be small; their largest row counts, of an error the absolute value, along a motion the worst
    place between the rows, too. Example: kinematics.C.y_error
    """
    weights: tuple[WeightRow, ...] | None = None
    """One optimum a row: weights of the goals, first those of ``maximize``, or by their names. Each goal is normalised
    by its range over the feasible designs. Left out: one row of equal weights. Example: [[1, 0], [1, 1], [2, 1]]
    """
    subject_to: tuple[AnyCondition, ...] = ()
    """What a design must keep to be feasible: bounds of results, in the worst row and along a motion between the rows,
    too, or a shape that the workspace contains. Example: [{result: workspace.area, at_least: 0.35}, {contains: {circle:
    80}}]
    """
    evaluations: Annotated[int, fields.whole(10, 10_000_000)] | None = None
    """Most designs that search and pareto evaluate; a search then uses them all. Left out: by the number of variables
    and goals. Example: 20000
    """

    def faults(self) -> Iterator[str]:
        goals = [goal.name for goal in self.maximize + self.minimize]
        twice = [goal for goal in goals if goals.count(goal) > 1]
        if twice:
            yield f"{twice[0]!r} is named twice among the goals"

    def checked(self, checker: Checker) -> Self:
        """Check the method, and the results that goals name, against the mechanism."""
        root: KeyPath = ("optimize",)
        report = checker.report
        if not self.variables:
            report((*root, "variables"), "an optimisation needs at least one variable")
        if not self.maximize and not self.minimize:
            report(root, "say what to 'maximize' or 'minimize'", at_key=True)
        if self.method == "pareto" and len(self.maximize + self.minimize) == 1:
            report((*root, "method"), "a Pareto front is between two goals or more; for one use search")
        if self.method == "grid" and self.evaluations is not None:
            report(
                (*root, "evaluations"),
                "the designs of a grid follow from its steps; 'evaluations' is of 'method: search'",
                at_key=True,
            )
        moved = checker.parameters.moved(self.variables)
        goals = [
            (goal, (*root, key, k)) for key in ("maximize", "minimize") for k, goal in enumerate(getattr(self, key))
        ]
        for goal, at in goals:
            _check_judged(checker, goal, at, moved)
        for k, condition in enumerate(self.subject_to):
            at = (*root, "subject_to", k)
            if isinstance(condition, Containment):
                checker.needs("workspace", "'contains'", (*at, "contains"))
                continue
            _check_judged(checker, condition, (*at, "result"), moved)
            for key in condition.given("at_least", "at_most"):
                _check_bound(checker, condition, (*at, key), moved)
        return self


def _check_judged(checker: Checker, judged: Judged, path: KeyPath, moved: Collection[str]) -> None:
    """Report a result that does not exist, or an expression that no parameter in `moved` changes."""
    if isinstance(judged.result, str):
        check_result(checker, judged.result, path)
    elif judged.result.names.isdisjoint(moved):
        checker.report(path, f"{judged.name!r} is the same for every design: no variable changes it")


def _check_bound(checker: Checker, condition: Condition, path: KeyPath, moved: Collection[str]) -> None:
    """Report a bound that a parameter in `moved` changes."""
    raw, names = checker.reporter.document.raw(path), frozenset[str]()
    # A text that is no expression has been reported.
    with suppress(ExpressionError):
        names = Expression.parse(str(raw)).names
    if names.isdisjoint(moved):
        return
    cure = f"a measure may take parameters, as in mechanism.measures: {{NAME: COORDINATE - ({raw})}}"
    if isinstance(condition.result, Expression):
        cure = f"bound the difference, {{result: {condition.result.text} - ({raw}), {path[-1]}: 0}}"
    checker.report(path, f"{raw!r} changes with the variables, and a bound is the same for every design; {cure}")
