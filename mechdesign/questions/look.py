"""A glance at a command's answer: what its tables and columns are called, before anything long is computed."""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from typing import Any

from mechdesign.commands import QUESTIONS
from mechdesign.ground.results import Result
from mechdesign.ground.work.chunks import here
from mechdesign.study import Study

# Enough designs that one of them may well be feasible.
DESIGNS = 10
SAMPLES = 2
# Part of the duration of a motion in time that a look at it takes.
INSTANT = 1e-6


def ask(study: Study, command: str, **options: Any) -> Result:
    """A command's answer, with options of its function."""
    result: Result = getattr(import_module(QUESTIONS[command].module), command)(study, **options)
    return result


def is_long(study: Study, command: str) -> bool:
    """Whether a command's answer costs much more than a look at it."""
    in_time = study.dynamics is not None and study.dynamics.forward is not None
    return command in ("optimize", "reliability") or (command == "dynamics" and in_time)


def with_fewer_rows(result: Result) -> Collection[str]:
    """Tables of which a look may have fewer rows than the full answer: those of designs, and of a motion in time."""
    if result.command == "optimize":
        return result.tables
    return result.tables.keys() - {"extremes"} if "forward" in result.tables else ()


def look(study: Study, command: str) -> Result:
    """A command's answer with as few samples and designs as there may be, and of a motion in time an instant.

    Raises
    ------
    MechdesignError
        What the command itself would raise, but where no design of so few is feasible.
    """
    reliability, optimize = study.reliability, study.optimize
    if reliability is not None:
        from mechdesign.questions.reliability.schema.section import Precision

        loose = Precision.model_construct(relative=100.0, half_width=None)
        few = {"samples": SAMPLES, "precision": loose, "sobol": reliability.sobol and SAMPLES}
        reliability = reliability.model_copy(update=few)
    if optimize is not None:
        method = "search" if optimize.method == "grid" else optimize.method
        optimize = optimize.model_copy(update={"method": method, "evaluations": DESIGNS, "subject_to": ()})
    dynamics = study.dynamics
    if dynamics is not None and dynamics.forward is not None:
        moment = {"duration": INSTANT * float(dynamics.forward.duration), "rows": 2}
        dynamics = dynamics.model_copy(update={"forward": dynamics.forward.model_copy(update=moment)})
    with here():
        few_study = study.with_sections(reliability=reliability, optimize=optimize, dynamics=dynamics)
        return ask(few_study, command)
