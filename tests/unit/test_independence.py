"""Whether drives determine a mechanism is a matter of its structure: not of the order, nor of chance in the draws."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
import yaml
from helpers.studies import study_of

from mechdesign.errors import StudyError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.rigidity import Equations

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
    drawn = Equations.drawn
    monkeypatch.setattr(
        Equations, "drawn", lambda self, held, seed: drawn(self, held, seed) * (value if seed == 0 else 1.0)
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
    with pytest.raises(StudyError, match="hold each other more often than it takes; with the drives held, link 'r'"):
        study_of(TWICE)
