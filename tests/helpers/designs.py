"""Answers of many designs at once beside those of each alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from mechdesign.family.stacked import at_poses
from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.results import Result, Table
from mechdesign.motion.group import DesignGroup
from mechdesign.questions.poses import alike, study_poses
from mechdesign.study import Study
from mechdesign.study.designs import Designs

Answer = Result | Exception


def each_of(groups: Sequence[DesignGroup]) -> list[Answer]:
    """The answer of each design, in their order."""
    found = {row: group.of(k) for group in groups for k, row in enumerate(group.rows.tolist())}
    return [found[row] for row in sorted(found)]


def assert_as_alone(
    designs: Designs,
    ask: Callable[[Study], Result],
    tolerance: float = 1e-12,
    rounding: float = 0.0,
) -> list[Answer]:
    """The answers of all designs at once are those of each alone."""
    found: dict[int, Answer] = {}
    for rows in alike(designs, ask.__name__, np.arange(designs.count)):
        poses = study_poses(designs.study, ask.__name__, designs.take(rows).numbers)
        found |= zip(rows.tolist(), each_of(at_poses(designs.study, ask.__name__, poses)), strict=True)
    for k, answer in found.items():
        if isinstance(answer, AssemblyError):
            with pytest.raises(AssemblyError) as alone:
                ask(designs.one(k))
            assert str(answer) == str(alone.value)
        else:
            assert_alike(answer, ask(designs.one(k)), tolerance, rounding)
    return [found[k] for k in range(designs.count)]


def assert_alike(found: Result, expected: Result, tolerance: float, rounding: float) -> None:
    """Both say the same in every word and number, these as parts of the largest in their column."""
    assert (found.command, found.failed, list(found.warnings)) == (
        expected.command, expected.failed, list(expected.warnings),
    )  # fmt: skip
    assert dict(found.counts) == dict(expected.counts)
    assert dict(found.absent) == dict(expected.absent)
    assert list(found.tables) == list(expected.tables)
    for one, other in zip(found.tables.values(), expected.tables.values(), strict=True):
        _assert_same_table(one, other, tolerance, rounding)


def _assert_same_table(found: Table, expected: Table, tolerance: float, rounding: float) -> None:
    assert (found.name, found.meaning, len(found)) == (expected.name, expected.meaning, len(expected))
    if expected.scope is not None:
        assert found.scope is not None
        assert found.scope.poses_only == expected.scope.poses_only
        assert found.scope.missing == expected.scope.missing
    assert [(c.name, c.unit, c.meaning) for c in found.columns] == [
        (c.name, c.unit, c.meaning) for c in expected.columns
    ]
    for one, other in zip(found.columns, expected.columns, strict=True):
        values, wanted = np.asarray(one.values), np.asarray(other.values)
        if other.numeric:
            known = np.abs(wanted[np.isfinite(wanted)].astype(float))
            near = rounding + tolerance * known.max(initial=0.0)
            np.testing.assert_allclose(values, wanted, rtol=tolerance, atol=near, err_msg=one.name)
        else:
            assert values.tolist() == wanted.tolist(), one.name
