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

Its names stand in `mechdesign.door.api.names`, which is imported when one of them is first used, so that ``mechdesign
--help`` loads no numerics. Here nothing is imported: a signal that comes before the command can hear it ends it with a
traceback.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from mechdesign.door.api.names import *  # noqa: F403

    __version__: str


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from mechdesign.ground.versions import VERSION

        return VERSION
    if name == "__all__":
        return __dir__()
    from mechdesign.commands import QUESTIONS
    from mechdesign.door.api import names, questions

    if hasattr(names, name):
        return getattr(names, name)
    if name in QUESTIONS:
        return questions.question(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    from mechdesign.door.api import names

    return ["__version__", *sorted(name for name in vars(names) if not name.startswith("_"))]
