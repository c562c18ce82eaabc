"""Random tasks: which linkages pass them without a defect, by closed forms in fine steps."""

from typing import Any

import numpy as np
import pytest
import yaml
from helpers.guided import Guided, generates

import mechdesign

WIDE = {"reach": 30, "ratio": 100}


def rows_of(task: Any, seed: int) -> tuple[Any, list[dict[str, Any]]]:
    """The result and the rows of its solutions; none where no linkage does it."""
    study = mechdesign.load(text=yaml.safe_dump({"synthesis": {**task, "limits": WIDE, "solutions": 60}}))
    try:
        result = mechdesign.synthesize(study, seed=seed)
    except mechdesign.AssemblyError:
        return None, []
    table = result.tables["solutions"]
    return result, [{name: table[name][row] for name in table.names} for row in range(len(table))]


def of_body(seed: int) -> tuple[int, list[str]]:
    """How many linkages a random body has, and those of whose defects the closed forms tell otherwise."""
    random = np.random.default_rng(seed)
    count = 2 + seed % 4
    places, angles = random.normal(size=(count, 2)), random.uniform(-120, 120, count)
    if seed % 8 < 4:
        # A way rather than scattered positions, as tasks mostly are.
        places, angles = np.cumsum(places, axis=0), np.cumsum(random.uniform(5, 60, count))
    body = [{"x": float(x), "y": float(y), "angle": float(a)} for (x, y), a in zip(places, angles, strict=True)]
    turns = np.exp(1j * np.radians(angles))
    _, rows = rows_of({"body": body}, seed)
    wrong = [f"{seed}: {row['solution']} {row['kind']} {row['defects']!r}" for row in rows
             if Guided(row).passes(places @ [1, 1j], turns) != (row["defects"] == "")]  # fmt: skip
    return len(rows), wrong


def of_function(seed: int) -> tuple[int, list[str]]:
    """The same of a random function whose angles are those of the links."""
    random = np.random.default_rng(seed)
    count = 3 + seed % 2
    inputs = np.cumsum(random.uniform(5, 50, count)) + random.uniform(0, 360)
    outputs = np.cumsum(random.uniform(-40, 60, count)) + random.uniform(0, 360)
    task = {"input": inputs.tolist(), "output": outputs.tolist()}
    _, rows = rows_of({"function": task, "frame": 1.0}, seed)
    wrong = [f"{seed}: {row['solution']} {row['defects']!r} {row['max_error']:.3g}" for row in rows
             if generates(row, inputs, outputs) != (row["defects"] == "")]  # fmt: skip
    return len(rows), wrong


@pytest.mark.slow
def test_no_linkage_that_is_listed_without_a_defect_has_one() -> None:
    answers = [of_body(seed) for seed in (3, 6, 7, 11)] + [of_function(seed) for seed in (2, 4)]
    assert sum(count for count, _ in answers) > 50
    assert [words for _, wrong in answers for words in wrong] == []


@pytest.mark.nightly
@pytest.mark.parametrize("first", range(0, 500, 20))
def test_no_linkage_of_five_hundred_random_tasks_is_told_otherwise_than_by_closed_forms(first: int) -> None:
    answers = [(of_function if seed % 5 == 4 else of_body)(seed) for seed in range(first, first + 20)]
    assert sum(count for count, _ in answers) > 100
    assert [words for _, wrong in answers for words in wrong] == []


def runs(task: Any, seed: int) -> int:
    """How many solutions without a defect pass their positions as studies, in order and without a dead centre."""
    result, rows = rows_of(task, seed)
    count, output = 0, "rocker.angle" if "function" in task else "P"
    for row in rows:
        if row["defects"]:
            continue
        answer = mechdesign.kinematics(mechdesign.load(text=result.files[f"solution_{row['solution']}.yaml"]))
        motion = answer.tables["motion"]
        assert np.abs(motion[f"{output}_error"]).max() <= row["max_error"] + 1e-6
        assert [text for text in map(str, answer.warnings) if "dead centre" in text or "assembled" in text] == []
        steps = np.diff(motion["theta"])
        assert (steps > 0).all() or (steps < 0).all()
        assert np.abs(steps.sum()) <= 360 + 1e-6
        count += 1
    return count


LOG10 = {"input": [94.01923788646684, 120, 145.98076211353316], "output": [35.6125801, 65.0977500, 87.0510671]}
SWEEP = [{"x": 0, "y": 0, "angle": 0}, {"x": 2, "y": 1, "angle": 30}, {"x": 3, "y": 3, "angle": 75}]


@pytest.mark.slow
def test_solutions_without_a_defect_pass_the_task_as_studies() -> None:
    assert runs({"function": LOG10, "frame": 100}, 1) >= 1
    assert runs({"body": SWEEP, "pivots": [[0, -2], [3, -1]]}, 1) >= 2


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(40))
def test_solutions_of_random_tasks_without_a_defect_pass_them_as_studies(seed: int) -> None:
    random = np.random.default_rng(seed)
    places, angles = np.cumsum(random.normal(size=(3, 2)), axis=0), np.cumsum(random.uniform(5, 60, 3))
    body = [{"x": float(x), "y": float(y), "angle": float(a)} for (x, y), a in zip(places, angles, strict=True)]
    task = (
        {"function": {"input": angles.tolist(), "output": (places[:, 0] * 20).tolist()}}
        if seed % 4 == 3
        else {"body": body}
    )
    runs(task, seed)
