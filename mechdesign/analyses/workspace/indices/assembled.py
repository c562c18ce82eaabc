"""Indices that are computed from whole configurations: those that can be assembled, in blocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechdesign.analyses.workspace.indices.index import Evaluate
from mechdesign.analyses.workspace.indices.local import Local
from mechdesign.mechanism.configuration import Configuration
from mechdesign.numerics.arrays import Floats

BLOCK = 4096


def assembled_only(evaluate: Callable[[Configuration], Floats]) -> Evaluate:
    """An index from what evaluates flat batches of assembled configurations; nan where there is none."""

    def everywhere(local: Local) -> Floats:
        whole = local.configuration
        configuration = replace(whole, reason=np.broadcast_to(whole.reason, whole.shape))
        finite = np.ones(configuration.shape, dtype=bool)
        for node in configuration.nodes:
            finite &= np.isfinite(node)
        found = np.full(configuration.shape, np.nan)
        rows = np.nonzero(finite)
        for k in range(0, len(rows[0]), BLOCK):
            block = tuple(row[k : k + BLOCK] for row in rows)
            found[block] = evaluate(configuration.take(block))
        return found

    return everywhere
