"""Design studies of planar mechanisms: one description, seven questions.

>>> import mechdesign
>>> from mechdesign.study import template_path
>>> study = mechdesign.load(template_path("four_bar"), overrides={"mechanism.links.rocker.2": 65})
>>> result = mechdesign.kinematics(study)
>>> result
<kinematics of 'four_bar': How does it move?
  motion (73 rows), extremes (12 rows), limits (0 rows), loops (1 row), toggles (2 rows)
  no warnings>
>>> result.tables["extremes"]["range"][:4].round(3)
array([54.   , 27.547, 55.587, 62.41 ])

In a notebook a study and a result show themselves; ``result.figure("paths")`` is one of its pictures, `figures` their
names, `verdicts` what is met of what the study requires, and ``result.save("folder")`` writes what the command writes.

Every question takes a `seed` of its random numbers in place of the study's own (0 is a seed); `jobs`, processes to
compute on (None: one for each processor), on which no result depends; and a `progress` that is told how far the
computation is. A `journal` keeps what is finished of a long one that is interrupted, and gives it when it begins anew.

The names below are imported when they are first used, so that ``mechdesign --help`` loads no numerics. Here nothing is
imported: a signal that comes before the command can hear it ends it with a traceback.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from mechdesign.door.api.cases import evaluate as evaluate
    from mechdesign.door.api.cases import sensitivities as sensitivities
    from mechdesign.door.api.cases import sweep as sweep
    from mechdesign.door.api.loading import load as load
    from mechdesign.door.api.questions import dynamics as dynamics
    from mechdesign.door.api.questions import kinematics as kinematics
    from mechdesign.door.api.questions import optimize as optimize
    from mechdesign.door.api.questions import reliability as reliability
    from mechdesign.door.api.questions import stiffness as stiffness
    from mechdesign.door.api.questions import synthesize as synthesize
    from mechdesign.door.api.questions import workspace as workspace
    from mechdesign.door.api.shown import Answer as Answer
    from mechdesign.door.report.requirements import Verdict as Verdict
    from mechdesign.door.report.requirements import requirements as requirements
    from mechdesign.ground.cautions import Caution as Caution
    from mechdesign.ground.columns import Column as Column
    from mechdesign.ground.errors import AssemblyError as AssemblyError
    from mechdesign.ground.errors import MechanismError as MechanismError
    from mechdesign.ground.errors import MechdesignError as MechdesignError
    from mechdesign.ground.errors import OutputError as OutputError
    from mechdesign.ground.errors import StudyError as StudyError
    from mechdesign.ground.results import Table as Table
    from mechdesign.study import Study as Study
    from mechdesign.study.importing.conversion import convert as convert

    __version__: str

_HOMES = {
    name: f"mechdesign.{home}"
    for home, names in (
        ("door.api.cases", "sweep sensitivities evaluate"),
        ("door.api.loading", "load"),
        ("door.api.questions", "kinematics workspace optimize reliability stiffness dynamics synthesize"),
        ("door.api.shown", "Answer"),
        ("ground.cautions", "Caution"),
        ("ground.columns", "Column"),
        ("ground.errors", "AssemblyError MechanismError MechdesignError OutputError StudyError"),
        ("study.importing.conversion", "convert"),
        ("door.report.requirements", "Verdict requirements"),
        ("ground.results", "Table"),
        ("study", "Study"),
    )
    for name in names.split()
}
__all__ = sorted((*_HOMES, "__version__"))


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from mechdesign.ground.versions import installed

        return installed("mechdesign")
    if name in _HOMES:
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)
    from mechdesign.commands import QUESTIONS

    if name in QUESTIONS:
        from mechdesign.door.api.questions import question

        return question(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
