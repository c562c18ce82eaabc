"""A glance at a command's answer: what its tables and columns are called, before anything long is computed."""

from __future__ import annotations

import dataclasses
from importlib import import_module

from mechdesign.commands import COMMANDS
from mechdesign.questions.reliability.schema.section import Precision
from mechdesign.results import Result
from mechdesign.study import Study
from mechdesign.work.chunks import here

# Enough designs that one of them may well be feasible.
DESIGNS = 10
SAMPLES = 2
LOOSE = Precision.model_construct(relative=100.0, half_width=None)
# Commands whose answer costs much more than a look at it.
LONG = ("optimize", "reliability")


def ask(study: Study, command: str) -> Result:
    """A command's answer."""
    result: Result = getattr(import_module(COMMANDS[command].module), command)(study)
    return result


def look(study: Study, command: str) -> Result:
    """A command's answer with as few samples and designs as there may be.

    Raises
    ------
    MechdesignError
        What the command itself would raise, but where no design of so few is feasible.
    """
    reliability, optimize = study.reliability, study.optimize
    if reliability is not None:
        few = {"samples": SAMPLES, "precision": LOOSE, "sobol": reliability.sobol and SAMPLES}
        reliability = reliability.model_copy(update=few)
    if optimize is not None:
        method = "search" if optimize.method == "grid" else optimize.method
        optimize = optimize.model_copy(update={"method": method, "evaluations": DESIGNS, "subject_to": ()})
    with here():
        return ask(dataclasses.replace(study, reliability=reliability, optimize=optimize), command)
