"""Allocated tolerances: closed forms of linear chains, what is out of reach, and the study that is written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr, ndtri

import mechdesign

# A slider on the x axis whose error is that of a, b and the travel: a - b + travel, and c, which changes nothing.
CHAIN = """\
# Where the slider stops.
units: {length: mm, angle: deg}
mechanism:
  parameters: {a: 50, b: 30, c: 20}
  links:
    ground: {O: [0, 0], G: ["a - b", 0], H: [c, 5]}
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {travel: {slide: guide}}
  sketch: {B: [30, 0]}
reliability:
  dimensions:
    a: {tolerance: 0.1}       # the wall
    b: 0.2
    travel: {sigma: 0.05}     # the motor
  poses: [{travel: 10}]
  outputs: [B.x]
  limits: {B.x: 0.3}
  samples: 100000
  sobol: 0
  allocate: {reliability: 0.999}
"""
LEVER = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  poses: [{theta: 0}]
  samples: 100000
  sobol: 0
  limits: {P.x: 0.3}
  allocate: {reliability: 0.99}
"""


def allocated(result: mechdesign.Answer) -> dict[str, float]:
    table = result.tables["allocation"]
    return dict(zip(table["source"].tolist(), table["allocated"].tolist(), strict=True))


def ask(text: str, *overrides: str) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(text, *overrides))


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_a_linear_chain_has_lagranges_tolerances(exponent: float) -> None:
    """Minimise sum a/T^k where sum (s T)^2 is given: T ~ (a/s^2)^(1/(k + 2)); the motor's s is 3, of its sigma."""
    prices = {"a": 1.0, "b": 5.0, "travel": 0.3}
    cost = ", ".join(f"{name}: {{a: {a}, exponent: {exponent}}}" for name, a in prices.items())
    result = ask(CHAIN, f"reliability.allocate.cost={{{cost}}}")
    slopes = np.array([1 / 3, 1 / 3, 1.0])
    a = np.array(list(prices.values()))
    expected = (a / slopes**2) ** (1 / (exponent + 2))
    expected *= 0.3 / -ndtri(0.0005) / np.linalg.norm(slopes * expected)
    found = allocated(result)
    assert list(found) == list(prices)
    assert list(found.values()) == pytest.approx(expected, rel=2e-5)
    assert not result.failed
    table = result.tables["allocation"]
    given = np.array([0.1, 0.2, 0.05])
    assert table["given"] == pytest.approx(given)
    assert table["kind"].tolist() == ["tolerance", "tolerance", "sigma"]
    assert table["cost_given"] == pytest.approx(a / given**exponent)
    assert table["cost_allocated"] == pytest.approx(a / expected**exponent, rel=1e-4)
    assert table["share"] == pytest.approx((slopes * expected) ** 2 / np.sum((slopes * expected) ** 2), rel=1e-4)
    # Cheaper than all tolerances widened alike.
    alike = 0.3 / -ndtri(0.0005) / np.linalg.norm(slopes * given)
    assert table["cost_allocated"].sum() < 0.99 * (a / (alike * given) ** exponent).sum()


@pytest.mark.slow
def test_the_simulation_confirms_it_and_the_study_written_reaches_it() -> None:
    result = ask(CHAIN)
    confirmation = result.tables["confirmation"]
    assert confirmation["analytic"] == pytest.approx([0.999], abs=1e-6)
    assert confirmation["analytic"] >= 0.999
    assert confirmation["low"] < 0.999 < confirmation["high"]
    assert confirmation["met"].all()
    assert confirmation["method"].tolist() == ["monte_carlo"]
    again = mechdesign.reliability(study_of(result.files["allocated.yaml"], "seed=7", "reliability.allocate="))
    table = again.tables["reliability"]
    simulated = table["method"] == "monte_carlo"
    assert table["low"][simulated] < 0.999 < table["high"][simulated]
    assert table["reliability"][~simulated] == pytest.approx([0.999], abs=1e-6)


@pytest.mark.slow
def test_the_file_keeps_its_comments_and_says_the_new_tolerances(tmp_path: Path) -> None:
    (tmp_path / "chain.yaml").write_text(CHAIN)
    result = mechdesign.reliability(mechdesign.load(tmp_path / "chain.yaml"))
    text = result.files["allocated.yaml"]
    found = allocated(result)
    assert f"    a: {{tolerance: {found['a']}}}       # the wall\n    b: {found['b']}\n" in text
    assert f"    travel: {{sigma: {found['travel']}}}     # the motor\n" in text
    assert "# Where the slider stops." in text
    assert "allocate" not in text
    again = mechdesign.reliability(mechdesign.load(text=text))
    assert (list(again.tables), again.warnings) == (
        [name for name in result.tables if name[:4] not in ("allo", "conf")],
        [],
    )


@pytest.mark.slow
@pytest.mark.parametrize(("asked", "most", "met"), [(0.999, 9e-4, False), (0.9999, 1.1e-4, True)])
def test_requirements_are_judged_with_the_allocated_tolerances(asked: float, most: float, met: bool) -> None:
    required = (
        f"requirements: [{{result: reliability.failure, at_most: {most}}}, "
        "{result: reliability.allocation.cost_allocated.max, at_most: 1000}]\n"
    )
    result = ask(CHAIN + required, f"reliability.allocate.reliability={asked}")
    # With the tolerances as they are given 8.4e-4 fail.
    given = 2 * ndtr(-0.3 / np.hypot(np.hypot(0.1, 0.2) / 3, 0.05))
    assert result.tables["reliability"]["failure"][0] == pytest.approx(given, rel=1e-6)
    errors, cost = result.verdicts
    assert errors.met == met
    assert errors.worst == pytest.approx(1 - asked, rel=0.2)
    assert "with the allocated tolerances" in str(errors)
    assert cost.met
    assert "allocated tolerances" not in str(cost)


@pytest.mark.slow
def test_rare_failures_are_confirmed_by_auto() -> None:
    result = ask(CHAIN, "reliability.allocate.reliability=0.9999999")
    confirmation = result.tables["confirmation"]
    assert confirmation["method"].tolist() == ["auto"]
    assert 0.9 < (1 - confirmation["analytic"][0]) / 1e-7 <= 1 + 1e-6
    assert confirmation["low"] < 1 - 1e-7 < confirmation["high"]
    assert confirmation["evaluations"][0] < 100_000


@pytest.mark.slow
def test_where_the_model_is_too_careful_simulation_makes_it_cheaper() -> None:
    """Uniform deviations have no tails: the normal model asks for tighter tolerances than they need."""
    text = CHAIN.replace("b: 0.2", "b: {tolerance: 0.2, distribution: uniform}")
    result = ask(text, "reliability.allocate.cost={b: 5}")
    confirmation = result.tables["confirmation"]
    assert confirmation["target"] < 0.998
    assert confirmation["analytic"] == pytest.approx(confirmation["target"], abs=1e-5)
    assert confirmation["low"] < 0.999 < confirmation["high"]
    assert any("was corrected" in note for note in map(str, result.warnings))


@pytest.mark.slow
def test_where_the_model_is_careless_simulation_makes_it_tighter() -> None:
    """A lognormal deviation of large spread has a longer tail than the normal of the same moments."""
    text = LEVER + "  dimensions: {lever.length: {sigma: 3, distribution: lognormal}}\n"
    result = ask(text, "reliability.limits={P.x: {max: 20}}")
    confirmation = result.tables["confirmation"]
    assert confirmation["target"] > 0.99
    assert confirmation["analytic"] == pytest.approx(confirmation["target"], abs=1e-5)
    assert confirmation["low"] < 0.99 < confirmation["high"]
    # ln(120/mean) = 2.3263 s - s^2/2, solved for the deviation of mean 100.
    s = np.roots([0.5, -2.3263478740408408, np.log(1.2)]).real.min()
    assert allocated(result)["lever.length"] == pytest.approx(100 * np.sqrt(np.expm1(s * s)), rel=0.02)


UNIFORM = "{{a: {{tolerance: 0.1, distribution: uniform}}, b: {{tolerance: {b}, distribution: uniform}}}}"


@pytest.mark.nightly
@pytest.mark.parametrize("asked", [0.9, 0.99, 0.999])
@pytest.mark.parametrize("price", [1.0, 5.0])
def test_two_uniform_tolerances_are_as_cheap_as_can_be(asked: float, price: float) -> None:
    """Sum of two uniform errors of half widths s and t: beyond L with (s + t - L)^2/(4 s t), where s + L > t > s."""
    dimensions = f"reliability.dimensions={UNIFORM.format(b=0.2)}"
    cost = f"reliability.allocate={{reliability: {asked}, cost: {{b: {price}}}}}"
    result = ask(CHAIN, dimensions, cost)
    ratio = np.linspace(1.0, 4.0, 3001)
    first = 0.3 / (1 + ratio - 2 * np.sqrt((1 - asked) * ratio))
    inside = first * ratio - first < 0.3
    cheapest = (1 / first + price / (first * ratio))[inside].min()
    found = result.tables["allocation"]["cost_allocated"].sum()
    assert cheapest * 0.995 < found < cheapest * 1.02
    confirmation = result.tables["confirmation"]
    assert confirmation["met"].all()
    assert confirmation["low"] < asked < confirmation["high"]


@pytest.mark.slow
def test_one_uniform_tolerance_reaches_just_beyond_its_limit() -> None:
    """Beyond L of the half width t with 1 - L/t."""
    result = ask(CHAIN, "reliability.dimensions={a: {tolerance: 0.1, distribution: uniform}}",
                 "reliability.allocate={reliability: 0.98}")  # fmt: skip
    assert allocated(result)["a"] == pytest.approx(0.3 / 0.98, rel=3e-3)


@pytest.mark.slow
def test_what_is_held_and_cannot_break_the_limits_is_no_reason_to_refuse() -> None:
    """A pin on the rim of its hole leaves 0.01 of the limit; by normal errors of its variance it would break it."""
    text = LEVER.replace("P.x: 0.3", "P.x: 0.31") + (
        "  dimensions: {lever.length: {tolerance: 0.2, distribution: uniform}}\n"
        "  clearances: {O: {radial: 0.3, pin: contact, link: lever}}\n"
    )
    result = ask(text)
    assert not result.failed
    assert 0.01 < allocated(result)["lever.length"] < 0.05
    assert result.tables["confirmation"]["low"] < 0.99 < result.tables["confirmation"]["high"]


@pytest.mark.slow
def test_the_advice_where_it_cannot_be_reached_works() -> None:
    text = LEVER.replace("theta: 0}", "theta: 90}").replace("P.x: 0.3", "P.x: 0.005") + (
        "  dimensions: {lever.length: 0.2}\n  clearances: {O: {fit: 20 H7/g6, link: lever}}\n"
    )
    why = ask(text).failed
    assert "O (100%); name O in 'cost' to have it allocated too, with 'radial' in place of the fit of O" in why
    with pytest.raises(mechdesign.StudyError, match="a fit is not allocated"):
        ask(text, "reliability.allocate={reliability: 0.99, cost: {O: 1}}")
    radial = "reliability.clearances={O: {radial: 0.02, link: lever}}"
    assert not ask(text, "reliability.allocate={reliability: 0.99, cost: {O: 1}}", radial).failed


@pytest.mark.slow
def test_every_pose_reaches_it() -> None:
    sweep = "reliability.sweep={theta: {from: 0, to: 90, step: 5}}"
    result = ask(LEVER + "  dimensions: {lever.length: 0.2, theta: 0.2}\n", "reliability.poses=", sweep)
    confirmation = result.tables["confirmation"]
    assert len(confirmation) == 19
    assert (confirmation["analytic"] >= 0.99).all()
    assert confirmation["analytic"].min() == pytest.approx(0.99, abs=1e-5)
    assert confirmation["met"].all()
    # The lever's length counts at 0 and its angle at 90 degrees; either fills its own limit there, less elsewhere.
    found = allocated(result)
    alone = 3 * 0.3 / -ndtri(0.005)
    assert found["lever.length"] == pytest.approx(alone, rel=1e-3)
    assert found["theta"] == pytest.approx(np.degrees(alone / 100), rel=1e-3)


@pytest.mark.slow
def test_what_has_no_influence_is_as_wide_as_allowed_and_is_told() -> None:
    result = ask(CHAIN, "reliability.dimensions.c=0.05")
    assert allocated(result)["c"] == pytest.approx(0.5)
    assert [note for note in map(str, result.warnings) if "'c' has no influence" in note]
    assert allocated(result)["a"] == pytest.approx(allocated(ask(CHAIN))["a"], rel=1e-4)


@pytest.mark.slow
def test_what_only_simulation_sees_is_not_widened() -> None:
    """At a stretched lever the angle's error counts in the second order only: 100 (1 - cos)."""
    result = ask(LEVER + "  dimensions: {lever.length: 0.2, theta: 2}\n", "reliability.limits={P.x: 0.5}")
    assert not result.failed
    assert allocated(result)["theta"] == pytest.approx(2)
    assert [note for note in map(str, result.warnings) if "'theta' has no influence" in note and "keeps" in note]
    assert result.tables["confirmation"]["met"].all()


def test_loose_limits_do_not_run_away() -> None:
    result = ask(CHAIN, "reliability.limits.B.x=100")
    assert list(allocated(result).values()) == pytest.approx([1.0, 2.0, 0.5])
    assert sum("as wide as allowed" in note for note in map(str, result.warnings)) == 3


@pytest.mark.slow
def test_held_clearances_that_break_the_limits_alone_are_named_with_what_is_reachable() -> None:
    text = LEVER.replace("theta: 0}", "theta: 90}") + (
        "  dimensions: {lever.length: 0.2}\n  clearances: {O: {radial: 0.3, link: lever}}\n"
    )
    result = ask(text)
    # The pin's sigma is a third of its radius; along the lever at 90 degrees nothing else moves P.x.
    reach = 1 - 2 * 0.0013498980316300933
    assert not result.failed
    result = ask(text, "reliability.allocate.reliability=0.999")
    assert "allocation" not in result.tables
    assert "O (100%)" in result.failed
    assert f"{reach:.4f};" in result.failed
    assert "theta = 90 deg" in result.failed
    # Named in the cost it is allocated too.
    result = ask(text, "reliability.allocate={reliability: 0.999, cost: {O: 1}}")
    assert not result.failed
    assert allocated(result)["O"] == pytest.approx(0.3 / -ndtri(0.0005) * 3, rel=1e-3)


@pytest.mark.slow
def test_limits_that_no_tolerance_keeps() -> None:
    assert "shrink to nothing" in ask(CHAIN, "reliability.limits.B.x=1e-5").failed
    moved = ask(CHAIN, "reliability.dimensions.a=[0.5, 0.7]")
    assert "mean errors" in moved.failed
    # A clearance that is held, and would do, is not to blame.
    small = "  clearances: {O: {radial: 0.01, link: lever}}\n"
    text = LEVER.replace("theta: 0}", "theta: 90}") + small
    result = ask(text, "reliability.limits={P.y: 0.3}", "reliability.dimensions.lever.length=[0.5, 0.7]")
    assert "mean errors" in result.failed
    assert "held" not in result.failed


@pytest.mark.slow
def test_asymmetric_tolerances_keep_their_middle() -> None:
    result = ask(CHAIN, "reliability.dimensions.a=[-0.05, 0.15]")
    found = study_of(result.files["allocated.yaml"]).reliability
    assert found is not None
    low, high = found.dimensions["a"].tolerance
    assert 0.5 * (low + high) == pytest.approx(0.05)
    assert 0.5 * (high - low) == pytest.approx(allocated(result)["a"])
    assert result.tables["confirmation"]["met"].all()


WILD = """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, E, 100]
    fore: [E, P, 80]
  drives: [upper, fore]
  sketch: {E: [100, 0], P: [180, 0]}
reliability:
  dimensions: {"*.length": 0.03}
  poses: [{upper: 0, fore: ANGLE}]
  limits: {P.x: 0.05}
  samples: 20000
  sobol: 0
  allocate: {reliability: 0.99}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "names"), [("0", ["*.length"]), ("60", ["upper.length", "fore.length"])])
def test_a_wildcard_is_written_out_unless_its_places_stay_alike(angle: str, names: list[str]) -> None:
    result = ask(WILD.replace("ANGLE", angle))
    study = study_of(result.files["allocated.yaml"])
    assert list(study.resolved["reliability"]["dimensions"]) == names
    assert study.reliability is not None
    for name, size in allocated(result).items():
        assert study.reliability.dimensions[name].tolerance == pytest.approx((-size, size))
    assert not result.failed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("written", "after"),
    [
        ('"*.length": 0.03     # all\n', "    upper.length: {upper}\n    fore.length: {fore}     # all\n"),
        ('"*.length": {tolerance: 0.03, distribution: uniform}  # all\n',
         "    upper.length: {{tolerance: {upper}, distribution: uniform}}\n"
         "    fore.length: {{tolerance: {fore}, distribution: uniform}}  # all\n"),
    ],
)  # fmt: skip
def test_a_wildcard_is_written_out_in_its_place(tmp_path: Path, written: str, after: str) -> None:
    text = WILD.replace(
        '  dimensions: {"*.length": 0.03}\n', f"  dimensions:   # varying\n    {written}    upper: 0.01\n"
    )
    (tmp_path / "wild.yaml").write_text(text.replace("ANGLE", "60"))
    result = mechdesign.reliability(mechdesign.load(tmp_path / "wild.yaml"))
    found = allocated(result)
    sizes = {"upper": found["upper.length"], "fore": found["fore.length"]}
    new = result.files["allocated.yaml"]
    assert "  dimensions:   # varying\n" + after.format(**sizes) + f"    upper: {found['upper']}\n" in new
    flow = WILD.replace("ANGLE", "60").replace("0.03}", "0.03, upper: 0.01}  # varying")
    (tmp_path / "flow.yaml").write_text(flow)
    result = mechdesign.reliability(mechdesign.load(tmp_path / "flow.yaml"))
    found = allocated(result)
    said = f"upper.length: {found['upper.length']}, fore.length: {found['fore.length']}, upper: {found['upper']}"
    assert f"  dimensions: {{{said}}}  # varying\n" in result.files["allocated.yaml"]


def test_a_random_load_is_no_tolerance() -> None:
    """It is held, unless a cost names it; the fixed one takes a part of what the limit leaves."""
    text = (
        LEVER.replace("theta: 0}", "theta: 90}")
        + """\
  dimensions: {lever.length: 0.2, theta: 0.05, load.fx: {sigma: 1}}
stiffness: {link: lever, at: P, actuators: {theta: 1e6}}
"""
    )
    result = ask(text, "reliability.load=[10, 0, 0]")
    table = result.tables["allocation"]
    assert np.isnan(table["cost_given"]).tolist() == [False, False, True]
    # C11 = 100^2/1e6: the load moves P.x by 0.1 on the average, and by sigma 0.01.
    assert result.tables["confirmation"]["met"].all()
    angle = np.radians(allocated(result)["theta"]) * 100 / 3
    assert np.hypot(angle, 0.01) == pytest.approx((0.3 - 0.1) / -ndtri(0.01), rel=1e-4)


@pytest.mark.slow
def test_a_diameter_stays_a_diameter() -> None:
    text = LEVER.replace("theta: 0}", "theta: 90}") + (
        "  clearances: {O: {diametral: 0.8, tolerance: [-0.1, 0.3], link: lever}}\n"
    )
    result = ask(text, "reliability.allocate.cost={O: 1}")
    given = result.tables["allocation"]["given"]
    assert given == pytest.approx([0.4])
    scale = allocated(result)["O"] / 0.4
    found = study_of(result.files["allocated.yaml"]).resolved["reliability"]["clearances"]["O"]
    assert found["diametral"] == pytest.approx(0.8 * scale, rel=1e-5)
    assert found["tolerance"] == pytest.approx([-0.1 * scale, 0.3 * scale])


def test_correlated_tolerances() -> None:
    """Two that go together by 0.6 have the variance T^2 (2 + 1.2)/9 where they are alike."""
    text = CHAIN.replace("    travel: {sigma: 0.05}     # the motor\n", "").replace("a - b", "a + b - 60")
    result = ask(text, "reliability.correlation=[[a, b, 0.6]]")
    expected = 0.3 / -ndtri(0.0005) * 3 / np.sqrt(3.2)
    assert list(allocated(result).values()) == pytest.approx([expected, expected], rel=1e-4)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["reliability.limits="], "give some"),
        (["reliability.dimensions={a: 0}"], "nothing to allocate"),
        (["reliability.allocate.cost={z: 1}"], "'z'"),
        (["reliability.allocate.cost={a: {a: 1, exponent: 0}}"], "must be positive"),
        (["reliability.allocate.reliability=1"], "between 0 and 1"),
    ],
)
def test_what_cannot_be_asked(overrides: list[str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(CHAIN, *overrides)


@pytest.mark.slow
def test_an_optimisation_asks_for_no_tolerances_unless_their_cost_is_a_goal() -> None:
    """The variable changes no error: all designs have the cost, and the failures, of the study itself."""
    text = CHAIN + "optimize:\n  variables: {c: {from: 10, to: 30, number: 3}}\n  minimize: GOAL\n"
    cost = mechdesign.optimize(study_of(text.replace("GOAL", "reliability.cost_allocated")))
    table = mechdesign.reliability(study_of(CHAIN)).tables["allocation"]
    assert cost.tables["optimum"]["reliability.cost_allocated"] == pytest.approx(
        table["cost_allocated"].max(), rel=1e-3
    )
    out_of_reach = study_of(text.replace("GOAL", "reliability.failure"), "reliability.limits.B.x=1e-5")
    assert mechdesign.optimize(out_of_reach).tables["optimum"]["reliability.failure"][0] > 0.9
