"""What a reliability section says is used as meant or refused: clearances, ends of tolerances, sizes."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from helpers import command_line
from helpers.studies import study_of

import mechdesign

SLIDER_CRANK = """
mechanism:
  parameters: {r: 100}
  links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, 250], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [310, 0]}
reliability:
  poses: [{theta: 40}]
  dimensions: {crank.length: {sigma: 0.1}}
  clearances: {A: {radial: 0.2}}
  outputs: [A, B.x]
  methods: [analytic]
"""


def share(*changes: str) -> tuple[float, list[str], set[str]]:
    """Of the clearance in the variance of A.x, the warnings, and which link's point A is said to be."""
    result = mechdesign.reliability(study_of(SLIDER_CRANK, *changes))
    table = result.tables["contributions"]
    own = table["output"] == "A.x"
    return float(table["share"][own & (table["source"] == "A")][0]), [*map(str, result.warnings)], set(table["on"][own])


def test_an_output_at_a_pin_with_clearance_is_of_a_link_that_is_said() -> None:
    unsaid, told, on = share()
    assert unsaid == 0.0
    assert on == {"crank"}
    assert any(text.startswith("A.x, A.y: A has a clearance and is that of crank, not of rod") for text in told)
    said = " ".join(" ".join(command_line.checked(SLIDER_CRANK)).split())
    assert "the pin A moves in rod; A.x and A.y are those of crank" in said


@pytest.mark.parametrize(("change", "link"), [
    ("reliability.outputs=[crank.A, B.x]", "crank"), ("reliability.outputs=[rod.A, B.x]", "rod"),
    ("reliability.limits={rod.A: {radius: 0.3}}", "rod"), ("reliability.limits={rod.A.y: 0.3}", "rod"),
    ("reliability.clearances.A.link=crank", "rod"),
])  # fmt: skip
def test_an_output_or_a_limit_names_its_link(change: str, link: str) -> None:
    """The rod's end moves with the pin, by a third of the radius in each direction; the crank's does not."""
    found, told, on = share(change)
    pin, made = 0.2 / 3, 0.1 * np.cos(np.radians(40))
    assert found == pytest.approx(pin**2 / (pin**2 + made**2) if link == "rod" else 0.0)
    assert on == {link}
    assert not any("clearance" in text for text in told)


@pytest.mark.parametrize(("changes", "message"), [
    (["reliability.outputs=[crank.A, rod.A.y]"], "'A' is that of link 'crank' elsewhere"),
    (["reliability.outputs=[slider.A]"], "link 'slider' has no point 'A'"),
    (["reliability.outputs=[rod.A]", "reliability.clearances.A.link=rod"], "moves its pin in link 'rod'"),
    (["reliability.limits={rod.B.x: 1, B.x: 2}"], "limited twice"),
    (["reliability.clearances.A={diametral: 0.02, tolerance: 0.03}"], "0.02 that is 0.03 smaller is negative"),
    (["reliability.clearances.A={radial: 0.02, tolerance: [-0.03, 0.1]}"], "0.02 that is 0.03 smaller is negative"),
])  # fmt: skip
def test_what_cannot_be_meant_is_refused(changes: list[str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(SLIDER_CRANK, *changes)


def test_a_clearance_whose_tolerance_reaches_zero_is_one() -> None:
    study_of(SLIDER_CRANK, "reliability.clearances.A={diametral: 0.02, tolerance: 0.02}")


def test_ends_of_the_worst_case() -> None:
    """An arm straight out: its length is 0.3 too long at the most and 0.1 too short, the pin 0.05 anywhere."""
    text = """
mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: {q: {angle: arm}}, sketch: {P: [100, 1]}}
reliability:
  poses: [{q: 0}, {q: 180}]
  dimensions: {arm.length: [-0.1, 0.3]}
  clearances: {O: {radial: 0.04, tolerance: [-0.02, 0.01], link: arm}}
  outputs: [P.x]
  methods: [analytic]
"""
    table = mechdesign.reliability(study_of(text)).tables["moments"]
    assert table["worst_low"] == pytest.approx([-0.15, -0.35])
    assert table["worst_high"] == pytest.approx([0.35, 0.15])
    assert table["worst_case"] == pytest.approx([0.35, 0.35])


def test_a_place_and_the_parameter_that_sets_it_are_told_to_count_both() -> None:
    change = "reliability.dimensions={r: {sigma: 0.1}, '*.length': {sigma: 0.1}}"
    result = mechdesign.reliability(study_of(SLIDER_CRANK, change))
    assert [text for text in map(str, result.warnings) if "both count" in text] == [
        "'crank.length' varies by its own tolerance, and with parameter 'r': both count, as independent errors that "
        "add up; leave one of them out if they are the same error"
    ]


@pytest.mark.parametrize("change", [
    "dimensions={crank.length: 1e14}", "dimensions={r: 1e59}", "dimensions={theta: 1e9}",
    "clearances={A: {radial: 1e14}}",
])  # fmt: skip
def test_what_is_larger_than_any_mechanism_is_refused(change: str) -> None:
    with pytest.raises(mechdesign.StudyError, match="more than a million"):
        mechdesign.reliability(study_of(SLIDER_CRANK, f"reliability.{change}"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("dimensions={crank.length: 1e308}", r"the number 1e\+308 is too large"),
        ("clearances={A: {radial: 1e200}}", r"the number 1e\+200 is too large a length"),
    ],
)
def test_what_is_larger_than_any_length_is_refused_when_read(change: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(SLIDER_CRANK, f"reliability.{change}")


@pytest.mark.slow
@pytest.mark.parametrize("change", [
    "limits={B.x: 0}", "limits={A: {radius: 0}}", "limits={B.x: {min: 0.1, max: 0.1}}",
    "dimensions={crank.length: 500}",
])  # fmt: skip
def test_no_tolerance_is_allocated_for_what_cannot_be_kept(change: str) -> None:
    changes = ["reliability.limits={B.x: 0.3}", f"reliability.{change}", "reliability.allocate={reliability: 0.999}"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = mechdesign.reliability(study_of(SLIDER_CRANK, *changes))
    assert "cannot be reached" in result.failed
