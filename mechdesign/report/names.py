"""Names of the files that a command may write into the folder of its results, as patterns."""

from __future__ import annotations

from collections.abc import Iterator

from mechdesign.commands import COMMANDS, SENSITIVITIES, SWEEP
from mechdesign.indices import INDEX_NAMES
from mechdesign.questions.columns import tables_of

MECHANISM = "mechanism"
ANIMATION = "motion.gif"

_PICTURES = {
    "kinematics": "motion paths poses transmission modes",
    "workspace": "workspace range path speed_ratio ellipses inscribed drives",
    "optimize": "CPI objective indices designs pareto hypervolume convergence optimum",
    "reliability": "bands means deviations difference deviation_map failure_map reliability density density_contours "
    "histogram convergence estimate contributions allocation",
    "stiffness": "springs deflections free directions stiffness joint_forces force_hodographs",
    SWEEP.name: "main_effects scatter response",
    SENSITIVITIES.name: "sensitivities",
}
# Studies, and copies of the files that they read.
_STUDIES = {
    "optimize": "optimum.yaml optimum_*.yaml knee.yaml nearest.yaml *input_*",
    "reliability": "allocated.yaml *input_*",
}


def names(command: str, formats: str = "", *, animate: bool = False) -> Iterator[str]:
    """Patterns of the names of a command's tables and studies, and of its pictures in these formats."""
    # A table of cases has the name of its command.
    tables = [table.name for table in tables_of(command)] if command in COMMANDS else [command]
    yield from (f"{table}.csv" for table in tables)
    yield from _STUDIES.get(command, "").split()
    pictures = (MECHANISM, *_PICTURES[command].split(), *(INDEX_NAMES if command == "workspace" else ()))
    yield from (f"{name}.{kind}" for kind in formats.split(",") for name in pictures)
    if animate:
        yield ANIMATION
