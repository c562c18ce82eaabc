"""What no table shows of a compiled mechanism: groups of inverse problems, gaps, draws that find what is determined.

Whether drives determine a mechanism is a matter of its structure: not of the order, nor of chance in the draws.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pytest
import yaml
from helpers.drawings import distance
from helpers.studies import study_of
from scipy.spatial import ConvexHull

import mechdesign
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.plates import gap
from mechdesign.mechanism.rigidity import LoopEquations, null_space, separated

CONFIGS = Path(__file__).parents[2] / "configs"
# Four pins with all six bars between them, on two links of a four-bar; and a link that nothing holds.
TWICE = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 40]
    b: [D, B, 45]
    l: [A, B]
    m: [A, C]
    n: [B, C]
    o: [A, E]
    p: [B, E]
    q: [C, E, 80]
    r: [C, F, 10]
  drives: [crank]
  sketch: {A: [0, 40], B: [105, 45], C: [30, 100], E: [70, 110], F: [40, 100]}
"""


def train(count: int, order: Random) -> Mechanism:
    """Four-bars, each driven by the rocker of the one before; the last moves a platform on three bars (no dyad)."""
    end = 3.0 * count
    ground = {"A": [0, 0], "P": [end + 6, 0], "Q": [end + 6, 4]} | {f"O{k}": [3 * k, 0] for k in range(1, count + 1)}
    sketch = {f"B{k}": [3 * k, 1] for k in range(count + 1)}
    sketch |= {"E": [end + 1.5, 2.3], "F": [end + 3.5, 2.3], "G": [end + 2.5, 3.3]}
    links = {"ground": ground, "crank": ["A", "B0", 1], "platform": {"points": ["E", "F", "G"]}}
    links |= {"hip": [f"B{count}", "E"], "left": ["P", "F"], "right": ["Q", "G"]}
    for k in range(1, count + 1):
        links |= {f"rod{k}": [f"B{k - 1}", f"B{k}", 3], f"rocker{k}": [f"O{k}", f"B{k}", 1]}
    pairs = list(links.items())
    order.shuffle(pairs)
    section = {"links": dict(pairs), "drives": ["crank"], "sketch": sketch}
    return study_of(yaml.safe_dump({"mechanism": section}, sort_keys=False)).mechanism


def spoil(value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the draws of dimensions the first is useless."""
    drawn = LoopEquations.drawn
    monkeypatch.setattr(
        LoopEquations, "drawn", lambda self, held, seed: drawn(self, held, seed) * (value if seed == 0 else 1.0)
    )


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_the_verdict_on_a_long_train_does_not_depend_on_its_order(seed: int) -> None:
    """Its equations as a whole are singular but for rounding in many a draw: one that is not tells."""
    mechanism = train(100, Random(seed))
    assert mechanism.drives == ("crank",)
    assert mechanism.forward.iterative


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_a_draw_that_happens_to_be_singular_or_undefined_is_not_believed(
    value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil(value, monkeypatch)
    assert train(1, Random(0)).forward.iterative


@pytest.mark.slow
@pytest.mark.parametrize("value", [0.0, np.nan])
def test_what_no_draw_determines_is_refused(value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    spoil(value, monkeypatch)
    with pytest.raises(
        mechdesign.StudyError, match="hold each other more often than it takes; with the drives held, link 'r'"
    ):
        study_of(TWICE)


@pytest.mark.parametrize(("name", "given", "forms"), [
    ("two_rrr", "C.x C.y", ["two angles"] * 2),
    # Each leg of a platform whose pose is given is found alone, as a vector's length and direction.
    ("planar_3rpr", "P.x P.y platform.angle", ["angle and turning slide"] * 3),
])  # fmt: skip
def test_each_leg_of_a_given_platform_is_a_group_of_its_own(name: str, given: str, forms: list[str]) -> None:
    groups = mechdesign.load(CONFIGS / f"{name}.yaml").mechanism.plan(given.split()).structure.groups
    assert [group.form for group in groups if group.form != "place"] == forms


@pytest.mark.parametrize("rows", [0, 3])
def test_null_spaces_of_matrices_with_nothing_in_them(rows: int) -> None:
    assert null_space(np.zeros((rows, 2))).shape == (2, 2)


def test_independent_motions_come_one_by_one() -> None:
    one, two = np.array([1.0, 0.0, 0.0, 2.0]), np.array([0.0, 1.0, 1.0, 0.0])
    found = separated(np.array([one + two, one - 2 * two]).T, 3)
    assert sorted(np.flatnonzero(row).tolist() for row in found) == [[0, 3], [1, 2]]


def test_the_gap_is_the_distance_of_the_hull_of_differences_from_the_origin():
    random = np.random.default_rng(3)
    for k in range(200):
        count, other = random.integers(1, 6, 2)
        one = random.normal(size=count) + 1j * random.normal(size=count)
        two = random.normal(size=other) + 1j * random.normal(size=other) + random.normal(scale=3)
        value = float(gap(list(one), list(two)))
        if value > 0:
            assert value == pytest.approx(distance(list(one), list(two)), abs=1e-12), k
        elif count > 2 or other > 2:
            differences = (two[:, None] - one).ravel()
            facets = ConvexHull(np.column_stack([differences.real, differences.imag])).equations
            assert value == pytest.approx(facets[:, 2].max(), abs=1e-12), k


def test_the_gap_of_points_and_bars_in_special_places():
    assert float(gap([0j], [3 + 4j])) == 5
    assert float(gap([1j], [1j])) == 0
    assert float(gap([-1 + 0j, 1 + 0j], [2j, -1j])) == -1
    assert float(gap([0j, 4 + 0j], [1 + 2j, 3 + 2j])) == 2
    assert float(gap([0j, 4 + 0j], [5 + 0j, 7 + 0j])) == 1
    lost = gap([np.array([0j, complex(np.nan, np.nan)])], [3 + 4j])
    np.testing.assert_array_equal(lost, [5, np.nan])
