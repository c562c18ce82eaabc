"""Design studies of planar mechanisms: one description, four questions.

>>> import mechdesign
>>> study = mechdesign.load("study.yaml", overrides=["reliability.samples=1000"])  # doctest: +SKIP
>>> mechdesign.reliability(study, seed=1).tables["moments"]["sigma"]  # doctest: +SKIP

The names below are imported when they are first used, so that ``mechdesign --help`` loads no numerics.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mechdesign.commands import COMMANDS

if TYPE_CHECKING:
    from mechdesign.analyses.kinematics.analysis import kinematics
    from mechdesign.analyses.optimize.analysis import optimize
    from mechdesign.analyses.reliability.analysis import reliability
    from mechdesign.analyses.stiffness.analysis import stiffness
    from mechdesign.analyses.workspace.analysis import workspace
    from mechdesign.errors import AssemblyError, MechdesignError, StudyError
    from mechdesign.study import load

    __version__: str

__all__ = [
    "AssemblyError",
    "MechdesignError",
    "StudyError",
    "__version__",
    "kinematics",
    "load",
    "optimize",
    "reliability",
    "stiffness",
    "workspace",
]

_HOMES = {
    "AssemblyError": "mechdesign.errors",
    "MechdesignError": "mechdesign.errors",
    "StudyError": "mechdesign.errors",
    "load": "mechdesign.study",
    **{name: command.module for name, command in COMMANDS.items()},
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("mechdesign")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
