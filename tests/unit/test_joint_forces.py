"""Joint forces where several joints meet: clamps in a row, loads on pins, and what equilibrium leaves open."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

CLAMPS = {
    "first": "{fixed: [arm, middle], point: P, angle: 0}",
    "second": "{fixed: [middle, tip], point: P, angle: 90}",
    "third": "{fixed: [tip, last], point: P, angle: -90}",
}
CLAMPED = """
units: {length: m, force: N}
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: {from: O, to: P, length: 2, mass: 1, center: [1, 0]}
    middle: {points: {P: [0, 0]}, mass: 2, center: [1, 0]}
    tip: {points: {P: [0, 0]}, mass: 3, center: [0, 1]}
    last: {points: {P: [0, 0]}, mass: 4, center: [3, 0]}
  joints: {%s}
  drives: [arm]
  sketch: {P: [2, 0]}
dynamics: {gravity: [0, -10], poses: [{arm: 0}], loads: [{at: P, force: [0, -5]}, {link: last, moment: 7}]}
"""


def borne(result: mechdesign.Answer, joint: str, on: str) -> list[float]:
    """What a joint does to a link: fx, fy and moment, at the first pose."""
    table = result.tables["joint_forces"]
    (row,) = [k for k in range(len(table)) if table["joint"][k] == joint and on in (table["on"][k], table["by"][k])]
    sign = 1 if table["on"][row] == on else -1
    return [sign * float(table[part][row]) for part in ("fx", "fy", "moment")]


@pytest.mark.parametrize("order", list(itertools.permutations(CLAMPS)), ids="-".join)
def test_each_clamp_in_a_row_bears_what_hangs_on_it(order: tuple[str, ...]) -> None:
    result = mechdesign.dynamics(study_of(CLAMPED % ", ".join(f"{name}: {CLAMPS[name]}" for name in order)))
    # tip's y axis points along -x at arm 0, and last along x.
    assert borne(result, "third", "last") == pytest.approx([0, 40, 3 * 40 - 7])
    assert borne(result, "second", "tip") == pytest.approx([0, 70, -30 + 113])
    assert borne(result, "first", "middle") == pytest.approx([0, 90, 20 + 83])
    assert borne(result, "O", "arm") == pytest.approx([0, 105, 0])
    assert result.main["arm_effort"] == pytest.approx([10 + 103 + 2 * 95])


def test_a_clamp_is_seen_from_either_link() -> None:
    turned = dict(
        CLAMPS, first="{fixed: [middle, arm], point: P, angle: 0}", third="{fixed: [last, tip], point: P, angle: 90}"
    )
    result = mechdesign.dynamics(study_of(CLAMPED % ", ".join(f"{name}: {text}" for name, text in turned.items())))
    assert borne(result, "third", "last") == pytest.approx([0, 40, 113])
    assert borne(result, "second", "tip") == pytest.approx([0, 70, 83])
    # The load on the pin acts on the first link that hangs on no other there, now on this.
    assert borne(result, "first", "middle") == pytest.approx([0, 95, 103])


WEDGE = """
units: {length: m, force: N}
mechanism:
  links:
    ground: {O: [0, 0], U: [5, 0]}
    wedge: {A: [0, 0], B: [1, 0]}
    punch: {C: [0, 0], D: [0, 1]}
  joints:
    base: {prismatic: [ground, wedge], through: O, point: A}
    face: {prismatic: [wedge, punch], through: B, direction: 30, point: C, angle: -30}
    guide: {prismatic: [ground, punch], through: U, direction: 90, point: D, angle: -90}
  drives: {push: {slide: base}}
  sketch: {A: [1, 0], B: [2, 0], C: [5, 1.7], D: [5, 2.7]}
dynamics: {poses: [{push: 1}], loads: [{at: D, force: [0, -60]}]}
"""


def test_moments_in_a_ring_of_slides_stay_open_and_forces_do_not() -> None:
    result = mechdesign.dynamics(study_of(WEDGE))
    assert result.main["push_effort"] == pytest.approx([-60 * np.tan(np.radians(30))])
    for joint, on, force in (("face", "punch", (-60 * np.tan(np.radians(30)), 60)), ("guide", "punch", (34.641016, 0))):
        fx, fy, moment = borne(result, joint, on)
        assert (fx, fy) == pytest.approx(force, abs=1e-6)
        assert np.isnan(moment)
    (caution,) = [caution for caution in result.warnings if caution.kind == "undefined"]
    assert "base, face, guide" in caution.message


@pytest.mark.parametrize(("end", "on_rod"), [("B", 0.0), ("rod.B", 8.0), ("rocker.B", 0.0)])
def test_a_load_at_a_pin_is_on_it_or_on_one_link(end: str, on_rod: float) -> None:
    """Whatever it acts on, the links without mass are bars: what the pin does to each makes up for the load."""
    result = mechdesign.dynamics(
        study_of(f"""
mechanism:
  links: {{ground: {{O: [0, 0], D: [40, 0]}}, crank: [O, A, 10], rod: [A, B, 30], rocker: [D, B, 25]}}
  drives: [crank]
  sketch: {{A: [7, 7], B: [33, 24]}}
dynamics: {{poses: [{{crank: 45}}], loads: [{{at: {end}, force: [0, -8]}}]}}
""")
    )
    table = result.tables["joint_forces"]
    assert ("pin:B" in table["by"]) == (end == "B")
    fx, fy, _ = borne(result, "B", "rod")
    at_a = borne(result, "A", "rod")
    assert (fx + at_a[0], fy + at_a[1]) == pytest.approx((0, on_rod), abs=1e-12)
