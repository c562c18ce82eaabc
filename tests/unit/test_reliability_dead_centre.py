"""Near a dead centre: made mechanisms that cannot be assembled fail by every method; margins in closed form."""

from __future__ import annotations

import cmath
import math

import pytest
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign

# At 180 degrees rod and rocker reach 142 over 140.
FOUR_BAR = """
mechanism:
  links: {ground: {A: [0, 0], D: [100, 0]}, crank: [A, B, 40], rod: [B, C, 72], rocker: [D, C, 70]}
  drives: {theta: {angle: crank}}
  sketch: {B: [-20, 35], C: [45, 50]}
reliability:
  poses: [{theta: 180}]
  outputs: [C.x]
  limits: {C.x: 10000}
  dimensions: {crank.length: 1, rod.length: 2, rocker.length: {tolerance: [0, 3]}, ground.D.x: 3}
  methods: [analytic, second_order]
  sobol: 0
"""
# At 90 degrees the rod of 62 reaches over the crank of 50 and the offset of 10.
SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0], G: [0, -10]}, crank: [O, A, 50], rod: [A, B, 62], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [43, 25], B: [94, -10]}
reliability:
  poses: [{theta: 90}]
  outputs: [B.x]
  limits: {B.x: 10000}
  dimensions: {crank.length: 1, rod.length: 2, ground.G.y: 1.5}
  methods: [analytic, second_order]
  sobol: 0
"""
# The block at the side of the lever, 28 from its line, is led past the lever's pivot at a distance of 30.
LEVER = """
mechanism:
  links: {ground: {O: [0, 0], D: [0, 0]}, crank: [D, P, 30], lever: {O: [0, 0], Q: [0, 28]}, block: {P: [0, 0]}}
  joints: {slot: {prismatic: [lever, block], through: Q}}
  drives: {theta: {angle: crank}}
  sketch: {P: [30, 0], Q: [22, 18]}
reliability:
  poses: [{theta: 0}]
  outputs: [lever.angle]
  limits: {lever.angle: 3 rad}
  dimensions: {crank.length: 2, lever.Q.y: 1.5}
  methods: [analytic, second_order]
  sobol: 0
"""


def platform(turn: float) -> str:
    """Three driven legs of one length to a platform that is turned; at 0 degrees their lines meet."""
    ground, body, sketch = {}, {}, {"P": [0, 0]}
    for k in range(3):
        base, arm = cmath.rect(2, 2 * math.pi * k / 3), cmath.rect(1, 2 * math.pi * k / 3)
        ground[f"A{k}"], body[f"B{k}"] = [base.real, base.imag], [arm.real, arm.imag]
        there = arm * cmath.rect(1, math.radians(turn))
        sketch[f"B{k}"] = [there.real, there.imag]
    legs = "".join(f"    leg{k}: {{from: A{k}, to: B{k}, telescopic: true}}\n" for k in range(3))
    drives = ", ".join(f"l{k}: {{length: leg{k}}}" for k in range(3))
    length = abs(2 - cmath.rect(1, math.radians(turn)))
    return f"""
mechanism:
  links:
    ground: {ground}
    platform: {body | {"P": [0, 0]}}
{legs}
  drives: {{{drives}}}
  sketch: {sketch}
reliability:
  poses: [{{l0: {length}, l1: {length}, l2: {length}}}]
  outputs: [P]
  limits: {{P: {{radius: 100}}}}
  dimensions: {{l0: {{sigma: 0.01}}, l1: {{sigma: 0.01}}, l2: {{sigma: 0.01}}}}
  methods: [analytic, second_order]
  sobol: 0
"""


def failures(result: mechdesign.Answer) -> dict[str, float]:
    table = result.tables["reliability"]
    return dict(zip(table["method"].tolist(), table["failure"].tolist(), strict=True))


@pytest.mark.parametrize(
    ("text", "distance"),
    [
        (FOUR_BAR, 3.5 / (math.hypot(1, 2, 1.5, 3) / 3)),
        (SLIDER_CRANK, 2 / (math.hypot(1, 2, 1.5) / 3)),
        (LEVER, 2 / (math.hypot(2, 1.5) / 3)),
    ],
    ids=["two links", "link and slide", "slide that turns"],
)
def test_what_cannot_be_assembled_fails_and_is_told(text: str, distance: float) -> None:
    """The margin is a sum of lengths: its probability is exact."""
    result = mechdesign.reliability(study_of(text))
    exact = float(ndtr(-distance))
    assert failures(result) == pytest.approx({"analytic": exact, "second_order": exact}, rel=1e-6)
    (told,) = [warning for warning in map(str, result.warnings) if "by the first order of the margin" in warning]
    assert told.startswith(f"analytic, second_order: {100 * exact:.2g} % of the made mechanisms cannot be assembled")


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (FOUR_BAR, ["crank.length", "rod.length", "rocker.length", "ground.D.x"]),
        (SLIDER_CRANK, ["crank.length", "rod.length", "ground.G.y"]),
        (LEVER, ["crank.length", "lever.Q.y"]),
    ],
    ids=["two links", "link and slide", "slide that turns"],
)
def test_each_length_alone_uses_up_the_margin(text: str, names: list[str]) -> None:
    """Of 2 in each of these mechanisms, three deviations of a tolerance of 2."""
    for name in names:
        study = study_of(text, f"reliability.dimensions={{{name}: 2}}", "reliability.methods=[analytic]")
        assert failures(mechdesign.reliability(study)) == pytest.approx({"analytic": float(ndtr(-3))}, rel=1e-6), name


def test_where_several_limits_and_a_dead_centre_count_simulation_agrees() -> None:
    limits = "reliability.limits={C.x: 12, C.y: [-40, 25], rocker.angle: 25 deg}"
    result = mechdesign.reliability(study_of(FOUR_BAR, limits, "reliability.methods=[analytic, monte_carlo]"))
    found = failures(result)
    assert found["analytic"] > float(ndtr(-3.5 / (math.hypot(1, 2, 1.5, 3) / 3)))
    capability = result.tables["capability"]
    assert capability["ppm"].min() >= 1e6 * ndtr(-3.5 / (math.hypot(1, 2, 1.5, 3) / 3)) * (1 - 1e-3)


@pytest.mark.slow
def test_links_that_are_solved_together() -> None:
    """Equal legs cannot be shorter than 1 on the mean; the probability is that of their mean but for curvature."""
    text = platform(6.0)
    result = mechdesign.reliability(study_of(text, "reliability.methods=[analytic, monte_carlo]", "seed=3"))
    found = failures(result)
    assert found["analytic"] == pytest.approx(found["monte_carlo"], rel=0.1)


STROKE = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 50], rod: [A, B, 150], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [35, 35], B: [180, 0]}
reliability:
  poses: [{theta: 0}, {theta: 90}]
  dimensions: {theta: {sigma: 1}}
  limits: {B.x: {min: -0.03}}
"""


def test_the_first_order_alone_is_warned_of_where_errors_curve():
    def warnings(**changes):
        overrides = {f"reliability.{key}": value for key, value in changes.items()}
        study = mechdesign.load(text=STROKE, overrides={"reliability.methods": ["analytic"], **overrides})
        return [str(w) for w in mechdesign.reliability(study).warnings if "curve" in str(w)]

    (message,) = warnings()
    assert "theta = 0 deg" in message
    # At the end of the stroke B falls back by r (1 + r/l)/2 of the squared angle, whatever its sign.
    exact = 2 * ndtr(-math.sqrt(2 * 0.03 / (50 * (1 + 50 / 150))) / math.radians(1))
    assert "0 to the first order" in message
    assert float(message.partition("order and ")[2].split()[0]) == pytest.approx(exact, rel=0.05)
    assert not warnings(poses=[{"theta": 90}])
    # Where both orders fail as often the deviation differs still: that of a squared normal angle.
    (deviation,) = warnings(limits={"B.x": {"min": -0.2}})
    sigma = 0.5 * 50 * (1 + 50 / 150) * math.radians(1) ** 2 * math.sqrt(2)
    assert "the standard deviation of B.x is 0 to the first order" in deviation
    assert float(deviation.partition("order and ")[2].split()[0]) == pytest.approx(sigma, rel=0.01)
    assert not warnings(methods=["analytic", "second_order"])
