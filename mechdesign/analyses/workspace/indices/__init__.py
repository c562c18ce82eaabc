"""Local performance indices, one a file.

Those of the Jacobian come first; the others need a section of the study beside the workspace.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mechdesign.analyses.workspace.indices import (
    deflection,
    inverse_condition,
    k_direction,
    k_min,
    manipulability,
    reliability,
    resistivity,
    sigma_max,
    sigma_min,
    sigma_position,
)
from mechdesign.analyses.workspace.indices.index import Index, Prepared
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.study import Study

_MODULES = (
    inverse_condition, resistivity, manipulability, sigma_min, sigma_max, k_min, k_direction, deflection,
    sigma_position, reliability,
)  # fmt: skip
INDICES: Mapping[str, Index] = {module.INDEX.name: module.INDEX for module in _MODULES}
OF_JACOBIAN = tuple(name for name, index in INDICES.items() if not index.section)


def prepare(study: Study, names: Sequence[str]) -> tuple[Prepared, ...]:
    """Indices made ready for a study.

    Raises
    ------
    StudyError
        If the study lacks what one of them needs.
    """
    return tuple(Prepared(INDICES[name], INDICES[name].prepare(study)) for name in names)


__all__ = ["INDICES", "OF_JACOBIAN", "Index", "Local", "Prepared", "prepare"]
