"""Backlash of couplings: the play of what follows, against closed forms and a simulation of its own."""

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

# Two cranks, of which gears turn the second (-2 times as fast, pitch radii 200/3 and 100/3), and a cam's valve.
GEARED = """
mechanism:
  links: {ground: {O: [0, 0], C: [100, 0]}, one: [O, A, 30], two: [C, D, 35], valve: {V: [0, 0]}}
  joints: {guide: {prismatic: [ground, valve], through: O, direction: 90}}
  drives: [one]
  couplings:
    gears: {set: two, of: one, ratio: -2, phase: 15}
    cam: {set: guide, to: 12 + 5*(1 - cos(2*one.angle))}
  sketch: {A: [30, 0], D: [130, 0], V: [0, 12]}
reliability:
  poses: [{one: 40}]
  outputs: [D.x, two.angle, guide.slide]
  clearances: {gears: {backlash: %s}, cam: {backlash: 0.02}}
  methods: [analytic, second_order, monte_carlo]
  samples: 60000
  sobol: 0
"""
# dD.x/d(angle of two) = -35 sin(-65 deg).
GAIN = 35 * np.sin(np.radians(65))


def sigmas(text: str) -> dict[tuple[str, str], float]:
    table = mechdesign.reliability(study_of(text), seed=1).tables["moments"]
    return dict(zip(zip(table["method"], table["output"], strict=True), table["sigma"], strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("backlash", "radians"),
    [
        ("0.2", np.radians(0.2) / np.sqrt(12)),
        ("0.1 mm", 0.1 / (100 / 3) / np.sqrt(12)),
        ("0.2, pin: contact", np.radians(0.2) / 2),
        ("0.2, pin: normal", np.radians(0.2) / 6),
        # E[b^2]/12 of a backlash that is uniform itself.
        ("0.2, tolerance: 0.1, distribution: uniform", np.radians(np.sqrt((0.04 + 0.01 / 3) / 12))),
    ],
)
def test_uniform_play_has_a_twelfth_of_the_squared_backlash(backlash: str, radians: float) -> None:
    found = sigmas(GEARED % backlash)
    for method, accuracy in (("analytic", 1e-9), ("second_order", 1e-3), ("monte_carlo", 0.01)):
        assert found[method, "two.angle"] == pytest.approx(np.degrees(radians), rel=accuracy)
        assert found[method, "D.x"] == pytest.approx(GAIN * radians, rel=accuracy)
        assert found[method, "guide.slide"] == pytest.approx(0.02 / np.sqrt(12), rel=accuracy)


@pytest.mark.parametrize(
    ("clearances", "message"),
    [
        ("gears: {radial: 0.1}", "give its play from one flank to the other as 'backlash'"),
        ("gears: {backlash: 0.1, link: two}", "the backlash of a coupling has no 'link'"),
        ("cam: {backlash: 1 deg}", "'1 deg' is an angle, where a length is expected"),
        ("gears: {backlash: 0.1 mm, tolerance: 0.01 deg}", "'0.01 deg' is an angle, where a length is expected"),
        ("gears: {backlash: 0.1, tolerance: 0.2}", "such teeth jam"),
        ("O: {backlash: 0.1}", "of a pin or a slide give 'radial', 'diametral' or a 'fit'"),
        ("gear: {backlash: 0.1}", "there is no point, slide or coupling 'gear'; did you mean 'gears'"),
    ],
)
def test_mistakes_are_named(clearances: str, message: str) -> None:
    text = GEARED.replace("{gears: {backlash: %s}, cam: {backlash: 0.02}}", f"{{{clearances}}}")
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(text)
    assert message in str(caught.value)


def test_a_length_needs_a_pitch_circle() -> None:
    belt = GEARED.replace("phase: 15}", "phase: 15, wheels: belt}")
    with pytest.raises(
        mechdesign.StudyError, match="is a length along a pitch circle, and that of 'gears' is not known"
    ):
        study_of(belt % "0.1 mm")
    assert sigmas(belt.replace("wheels: belt", "wheels: belt, radius: 10") % "0.1 mm")[
        "analytic", "two.angle"
    ] == pytest.approx(np.degrees(0.1 / 10 / np.sqrt(12)))


def coupler_point(ratio: float, phase: float, one: float = 25.0) -> complex:
    """Where the rods of 80 and 85 of a geared five-bar meet, on the left of the way from crank to crank (degrees)."""
    a, d = 30 * np.exp(1j * np.radians(one)), 100 + 35 * np.exp(1j * np.radians(ratio * one + phase))
    apart = abs(d - a)
    along = (80**2 - 85**2 + apart**2) / (2 * apart)
    return complex(a + (d - a) / apart * (along + 1j * np.sqrt(80**2 - along**2)))


def test_a_five_bar_has_the_sensitivities_of_its_circles() -> None:
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0], C: [100, 0]}, one: [O, A, 30], two: [C, D, 35], left: [A, B, 80], right: [D, B, 85]}
  drives: [one]
  couplings: {gears: {set: two, of: one, ratio: -2, phase: 60}}
  sketch: {A: [30, 0], D: [117, 30], B: [50, 90]}
reliability:
  poses: [{one: 25}]
  outputs: [B]
  dimensions: {gears.ratio: 0.01, gears.phase: 0.1}
  clearances: {gears: {backlash: 0.1}}
  methods: [analytic]
  sobol: 0
""")
    table = mechdesign.reliability(study).tables["contributions"]
    h = 1e-5
    by_ratio = (coupler_point(-2 + h, 60) - coupler_point(-2 - h, 60)) / (2 * h)
    by_phase = (coupler_point(-2, 60 + h) - coupler_point(-2, 60 - h)) / (2 * h)
    expected = {"gears.ratio": by_ratio, "gears.phase": by_phase, "gears": by_phase}
    for source, output, slope in zip(table["source"], table["output"], table["derivative"], strict=True):
        own = expected[source]
        assert abs(slope) == pytest.approx(abs(own.real if output == "B.x" else own.imag), rel=1e-7)


def test_play_at_the_flanks_has_no_smooth_failure() -> None:
    with pytest.raises(
        mechdesign.StudyError, match="the play of 'gears' is at one end or at the other, and form needs"
    ):
        study_of((GEARED % "0.1, pin: contact").replace("monte_carlo]", "form]"))


@pytest.mark.slow
def test_an_allocated_backlash_keeps_its_unit() -> None:
    """D.x = +-0.05 at a Cpk of 1 is 3 sigma = 3 gain b/(r sqrt(12)); b is rounded down to six digits."""
    more = "  limits: {D.x: 0.05}\n  allocate: {cpk: 1, cost: {gears: 1}}\n"
    result = mechdesign.reliability(study_of((GEARED % "0.1 mm") + more))
    backlash = 0.05 / 3 * np.sqrt(12) * (100 / 3) / GAIN
    table = result.tables["allocation"]
    row = list(table["source"]).index("gears")
    assert (table["given"][row], table["unit"][row]) == (0.1, "mm")
    assert backlash * (1 - 1e-5) < table["allocated"][row] <= backlash
    assert f"{table['allocated'][row]:.12g} mm" in "".join(result.files.values())


@pytest.mark.slow
def test_designs_have_pitch_circles_of_their_own() -> None:
    """The wheel that follows by the ratio i has the radius e/(1 + |i|) where the axes are e apart."""
    study = study_of(
        GEARED.replace("ratio: -2", "ratio: i").replace("mechanism:", "mechanism:\n  parameters: {i: -2}")
        % "0.1 mm"
        + "optimize:\n  variables: {i: {from: -3, to: -1, step: 1}}\n"
        "  minimize: [{result: reliability.moments.sigma, where: {output: two.angle, method: analytic}}]\n"
    )
    designs = mechdesign.optimize(study).tables["designs"]
    radius = 100 / (1 - designs["i"])
    sigma = np.degrees(0.1 / radius / np.sqrt(12))
    name = next(name for name in designs.names if name.startswith("reliability.moments.sigma"))
    assert designs[name] == pytest.approx(sigma, rel=1e-9)
