"""Linkages that pass up to nine points exactly, each point in an assembly of its own, against circles that meet."""

from typing import Any

import numpy as np
import pytest
import yaml

import mechdesign
from mechdesign.mechanism.open_loops import OpenLoops
from mechdesign.questions.synthesize.kinds import kind_of

# Morgan and Wampler 1990, problem 7.
FIVE = [[0.5, 1.06], [0.22, 0.78], [-0.13, 0.43], [-0.34, 0.22], [-0.83, -0.27]]
TASK = {"path": {"points": FIVE}, "pivots": [[0, 0], [1, 0]], "limits": {"reach": 100, "ratio": 1000}}


def answer(**more: Any) -> Any:
    return mechdesign.synthesize(mechdesign.load(text=yaml.safe_dump({"synthesis": {**TASK, **more}})), seed=1)


def misses(row: dict[str, Any], point: complex, side: float) -> float:
    """By how much the rocker of a four-bar from 0 to 1 is too long or short where its point is at a place.

    The crank's pin is one of the two points in which a circle about 0 and one about the place meet.
    """
    arm = complex(row["coupler.P.x"], row["coupler.P.y"])
    crank, reach = row["crank.length"], abs(arm)
    along = (abs(point) ** 2 + crank**2 - reach**2) / (2 * abs(point))
    pin = point / abs(point) * (along + 1j * side * np.sqrt(complex(crank**2 - along**2)))
    other = pin + (point - pin) / arm * row["coupler.length"]
    return abs(abs(other - 1) - row["rocker.length"])


@pytest.mark.nightly
def test_linkages_that_need_an_assembly_at_each_point_are_listed_behind_the_others() -> None:
    result = answer(evaluations=200, solutions=200)
    table = result.tables["solutions"]
    exact = np.flatnonzero(np.asarray(table["max_error"]) < 1e-9)
    assert len(exact) > 5
    assert any("branch" in table["defects"][k] for k in exact)
    for k in exact:
        row = {name: table[name][k] for name in table.names}
        for point in np.array(FIVE) @ [1, 1j]:
            assert min(misses(row, point, 1.0), misses(row, point, -1.0)) < 1e-9 * max(1.0, row["crank.length"])
    faulty = np.asarray(table["defects"]) != ""
    assert (np.diff(faulty.astype(int)) >= 0).all()
    # Their files say at which points their one assembly is elsewhere, as their own motion does.
    last = max(k for k in exact if "branch" in table["defects"][k])
    text = result.files[f"solution_{last + 1}.yaml"]
    errors = np.asarray(mechdesign.kinematics(mechdesign.load(text=text)).tables["motion"]["P_error"])
    elsewhere = ", ".join(str(k + 1) for k in np.flatnonzero(errors > 1e-6))
    assert f"a position needs another assembly ({elsewhere})" in " ".join(text.replace("\n# ", " ").split())


@pytest.mark.parametrize("name", ["four_bar", "slider_crank", "stephenson"])
def test_derivatives_of_open_loops_are_differences(name: str) -> None:
    kind, random = kind_of("path", name), np.random.default_rng(3)
    values = kind.samples(random, 4, 3, full_turn=False)
    poses = kind.solve(values, random.uniform(0, 6, (4, 2)), kind.modes[0])
    unknowns = OpenLoops.closed(kind.mechanism.forward.structure, poses)
    poses = random.uniform(0.2, 1, (1 + len(unknowns), 4, 2))
    loops, step = kind.opened(values, poses), 1e-6
    for place, slope in zip(kind.places, np.moveaxis(loops.by_places(kind.places), -1, 0), strict=True):
        change = step * (np.array(kind.places) == place)
        moved = kind.opened(values + change, poses).values - kind.opened(values - change, poses).values
        np.testing.assert_allclose(slope, moved / (2 * step), atol=1e-8)
    whole = np.concatenate([loops.by_places([kind.drive]), loops.by_unknowns()], axis=-1)
    for number, slope in enumerate(np.moveaxis(whole, -1, 0)):
        change = step * (np.arange(len(poses)) == number)[:, None, None]
        moved = kind.opened(values, poses + change).values - kind.opened(values, poses - change).values
        np.testing.assert_allclose(slope, moved / (2 * step), atol=1e-8)
