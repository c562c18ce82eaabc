"""Clearance of a slide: the slider shifts across its line and tilts, against closed forms and finite differences."""

import re

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

RADIAL, LENGTH = 0.5, 20.0
# A slider on a line at 30 deg, moved along it; T is a point of the slider.
GUIDED = """
mechanism:
  links: {ground: {O: [0, 0]}, slider: {Q: [0, 0], T: [30, 10]}}
  joints: {guide: {prismatic: [ground, slider], through: O, direction: 30, point: Q, angle: -30}}
  drives: [guide]
  sketch: {Q: [43.3, 25]}
reliability:
  clearances: {guide: {radial: 0.5, length: 20, pin: PIN}}
  poses: [{guide: 50}]
  outputs: [T, slider.angle]
  limits: {T.y: 0.3}
  methods: [analytic, second_order, monte_carlo]
  samples: 100000
  sobol: 0
"""
VARIANCES = {"normal": 1 / 9, "uniform": 1 / 3, "contact": 1.0}
# A pin in the slot of a turning lever, whose line misses the lever's pivot.
QUICK_RETURN = """
mechanism:
  links:
    ground: {O: [0, 0], C: [0, -60]}
    crank: [O, P, 25]
    lever: {C: [0, 0], M: [5, 10], T: [0, 120]}
  joints: {slot: {slot: lever, through: M, direction: 80, point: P}}
  drives: [crank]
  sketch: {P: [20, 15], T: [20, 58]}
reliability:
  clearances: {slot: {fit: 10 H8/f7}}
  poses: [{crank: 40}, {crank: 200}]
  outputs: [T, slot.slide]
  rates: {crank: 3}
  methods: [analytic, second_order, monte_carlo]
  samples: 200000
  sobol: 0
"""


def rows(table, **wanted):
    """Rows of a table, by column."""
    keep = np.all([table[name] == value for name, value in wanted.items()], axis=0)
    return {name: table[name][keep] for name in (column.name for column in table.columns)}


@pytest.mark.slow
@pytest.mark.parametrize("pin", VARIANCES)
def test_a_slider_shifts_and_tilts_as_its_ends_lie_in_the_guide(pin):
    result = mechdesign.reliability(mechdesign.load(text=GUIDED.replace("PIN", pin)), seed=1)
    variance = VARIANCES[pin] * RADIAL**2
    # Ends a, b: shift (a + b)/2 along the normal, tilt (b - a)/length.
    normal, turned = np.array([-0.5, np.sqrt(0.75)]), np.array([-10.0, 30.0])
    ends = np.array([0.5 * normal - turned / LENGTH, 0.5 * normal + turned / LENGTH])
    sigma = np.sqrt(variance * (ends**2).sum(axis=0))
    found = rows(result.tables["moments"], method="analytic")
    assert found["sigma"] == pytest.approx([*sigma, np.degrees(np.sqrt(2 * variance) / LENGTH)], rel=1e-9)
    assert found["worst_case"] == pytest.approx([*(RADIAL * np.abs(ends).sum(axis=0)), np.degrees(2 * RADIAL / LENGTH)])
    assert set(result.tables["contributions"]["source"]) == {"guide"}
    assert result.tables["contributions"]["share"] == pytest.approx(1.0)
    # E exp(i tilt), of both ends the square of one's: the mean of T moves back by it.
    k = RADIAL / LENGTH
    shrunk = {"normal": np.exp(-(k**2) / 9), "uniform": (np.sin(k) / k) ** 2, "contact": np.cos(k) ** 2}[pin]
    mean = np.array([30.0, 10.0]) * (shrunk - 1.0)
    bent = rows(result.tables["moments"], method="second_order")
    assert (bent["mean"] - bent["nominal"])[:2] == pytest.approx(mean, rel=1e-3)
    drawn = rows(result.tables["moments"], method="monte_carlo")
    assert (drawn["mean"] - drawn["nominal"])[:2] == pytest.approx(mean, abs=4 * sigma.max() / np.sqrt(1e5))
    assert drawn["sigma"] == pytest.approx(found["sigma"], rel=0.01)
    # Four states in contact: T.y is off by (a n_a + b n_b).
    if pin == "contact":
        kept = np.mean([abs(a * ends[0, 1] + b * ends[1, 1]) * RADIAL <= 0.3 for a in (-1, 1) for b in (-1, 1)])
        assert rows(result.tables["reliability"], method="monte_carlo")["reliability"] == pytest.approx(kept, abs=0.01)


@pytest.mark.slow
def test_a_pin_in_a_slot_shifts_across_it_with_all_its_rates():
    study = mechdesign.load(text=QUICK_RETURN)
    result = mechdesign.reliability(study, seed=1)
    fit = (0.013 + 0.022 + 0.015 + 0.013) / 4  # mean radial clearance of 10 H8/f7: 0/+22 and -28/-13
    tolerances = (0.022**2 + 0.015**2) / 144
    place = (fit**2 + tolerances) / 9
    for row, crank in enumerate((40, 200)):
        found = rows(result.tables["moments"], method="analytic", crank=crank, order="position")
        moved = [study.mechanism.solve({"crank": crank}, {"slot.offset": h}) for h in (-1e-4, 1e-4)]
        slope = [(moved[1][name] - moved[0][name]) / 2e-4 for name in ("T.x", "T.y", "slot.slide")]
        assert found["sigma"] == pytest.approx(np.abs(slope) * np.sqrt(place), rel=1e-5), row
    first = rows(result.tables["moments"], method="analytic")
    for method, accuracy in (("second_order", 1e-3), ("monte_carlo", 3e-3)):
        assert rows(result.tables["moments"], method=method)["sigma"] == pytest.approx(first["sigma"], rel=accuracy)
    assert set(first["order"]) == {"position", "velocity", "acceleration"}


@pytest.mark.slow
def test_every_method_agrees_on_a_slider_crank_with_slide_and_pin_clearances():
    text = """
    mechanism:
      links: {ground: {O: [0, 0], G: [0, -20]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0], T: [50, 10]}}
      joints: {guide: {prismatic: [ground, slider], through: G, direction: 0, point: B}}
      drives: [crank]
      sketch: {A: [0, 40], B: [110, -20]}
    reliability:
      dimensions: {guide.angle: 0.05, "*.length": js9}
      clearances: {guide: {fit: 16 H7/g6, length: 40, distribution: uniform}, A: {fit: 20 H7/g6}}
      poses: [{crank: 60}]
      limits: {T.y: 0.03, T.x: 0.12}
      methods: [analytic, second_order, monte_carlo, form, importance_sampling]
      samples: 50000
      sobol: 0
    """
    found = mechdesign.reliability(mechdesign.load(text=text), seed=3).tables["reliability"]["reliability"]
    assert 0.8 < found[0] < 0.99
    assert found == pytest.approx(found[0], abs=0.01)


@pytest.mark.parametrize(
    ("clearance", "message"),
    [
        ("{radial: 0.1}", "give that too"),
        ("{radial: 0.1, length: 20, link: slider}", "has no 'link'"),
        ("{radial: 0.1, length: 20 deg}", "where a length is expected"),
        ("{radial: 0.1, length: 20, pin: contact}, other: {radial: 1}", "there is no point, slide or coupling 'other'"),
    ],
)
def test_a_slide_says_what_its_clearance_lacks(clearance, message):
    text = re.sub(r"\{guide: \{radial.*\}\}", f"{{guide: {clearance}}}", GUIDED)
    with pytest.raises(mechdesign.StudyError, match=re.escape(message)):
        mechdesign.load(text=text)


def test_a_slot_and_a_pin_have_no_length_and_form_no_walls():
    with pytest.raises(mechdesign.StudyError, match="a pin in a slot does not tilt"):
        mechdesign.load(text=QUICK_RETURN.replace("H8/f7", "H8/f7, length: 9"))
    with pytest.raises(mechdesign.StudyError, match="a pin's clearance has none"):
        mechdesign.load(text=QUICK_RETURN.replace("slot: {fit", "P: {length: 9, fit"))
    slot = QUICK_RETURN.replace("H8/f7", "H8/f7, pin: contact")
    for text in (GUIDED.replace("PIN", "contact"), slot):
        with pytest.raises(mechdesign.StudyError, match="ask for monte_carlo or another pin model"):
            mechdesign.load(text=text.replace("second_order", "form"))


@pytest.mark.slow
def test_a_guide_is_where_its_links_have_it_however_their_pins_lie() -> None:
    """Pins with clearances at all points of a guide: its line through two points, at an angle, and what slides on it.

    The block's lug T keeps its distance from the line of the bar, and turns with it.
    """
    text = """
mechanism:
  links:
    ground: {O: [0, 0], Q: [200, -30]}
    bar: {O: [0, 0], R: [150, 40]}
    crank: [O, A, 60]
    coupler: [A, B, 110]
    block: {B: [5, 3], T: [20, 30]}
    prop: [R, S, 90]
    foot: [Q, S, 100]
  joints: {guide: {prismatic: [bar, block], through: [O, R], point: B}}
  drives: {tilt: {angle: bar}, theta: {angle: crank}}
  sketch: {R: [150, 40], A: [20, 56], B: [128, 34], S: [220, 60]}
  measures:
    line: bar.angle + atan2(40, 150)
    lug: (T.y - O.y)*cos(line) - (T.x - O.x)*sin(line)
    turn: {angle: [bar, block]}
reliability:
  poses: [{tilt: 0, theta: 70}]
  clearances:
    O: {radial: 0.3, link: crank}
    B: {radial: 0.3, link: block}
    R: {radial: 0.3, link: bar}
  outputs: [lug, turn, T, coupler.B]
  methods: [analytic, monte_carlo]
  samples: 2000
"""
    table = mechdesign.reliability(study_of(text)).tables["moments"]
    still = np.isin(table["output"], ["lug", "turn"])
    assert table["sigma"][still] == pytest.approx(np.zeros(4), abs=1e-9)
    assert (table["sigma"][~still] > 0.03).all()
    moving = study_of(
        text, "reliability.rates={theta: 60, tilt: 30}", "reliability.outputs=[T, coupler.B]",
        "reliability.samples=40000",
    )  # fmt: skip
    rates = mechdesign.reliability(moving).tables["moments"]
    analytic, sampled = (rates["sigma"][rates["method"] == method] for method in ("analytic", "monte_carlo"))
    assert sampled == pytest.approx(analytic, rel=0.03)
