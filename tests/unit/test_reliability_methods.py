"""Every method at limits of every kind, and at the nodes of a workspace."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign

SLIDER_CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 100], rod: [A, B, 250], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [310, 0]}
reliability:
  poses: [{theta: 40}]
  rates: {theta: 2 rad/s}
  dimensions: {crank.length: {sigma: 0.1}, rod.length: {sigma: 0.2}, theta: {sigma: 0.05}}
  clearances: {A: {radial: 0.2, link: crank, pin: uniform}}
  outputs: [B.x]
  samples: 100000
  precision: 0.05
"""
POLAR_ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, arm: {from: O, to: P, telescopic: true}}
  drives: {theta: {angle: arm}, reach: {length: arm}}
  limits: [{drive: theta, min: 0, max: 60}, {drive: reach, min: 50, max: 100}]
  sketch: {P: [60, 40]}
workspace: {point: P, scan: {rays: 2}, characteristic_length: 50}
reliability:
  poses: workspace
  dimensions: {theta: {sigma: 0.1}, reach: {sigma: 0.1}, ground.O.x: {sigma: 0.05}}
  limits: {P: {radius: 0.3}}
  samples: 2000
  precision: {half_width: 0.02}
"""
# With the option by which a pin's model may differ from another's: where errors are linear, and where pins are drawn.
METHODS = {
    "analytic": "analytic", "second_order": "analytic", "monte_carlo": "monte_carlo", "form": "monte_carlo",
    "importance_sampling": "monte_carlo", "auto": "monte_carlo",
}  # fmt: skip
# Sigmas of the errors of B.x and its rates are about 0.3, 0.3 and 0.8.
LIMITS = {
    "velocity": "{B.x_velocity: 0.6}",
    "acceleration on one side": "{B.x_acceleration: {min: -1.2}}",
    "three orders of one output": "{B.x: 0.6, B.x_velocity: 0.7, B.x_acceleration: {min: -1.5, max: 1.7}}",
    "a circle of velocities and an angle": "{A_velocity: {radius: 0.5}, rod.angle: {max: 0.05}}",
}


@pytest.mark.parametrize(
    ("methods", "message"),
    [("[]", "reliability.methods: name at least one"), ("[auto, form, auto]", "methods.2: 'auto' is given twice")],
)
def test_methods_are_at_least_one_and_none_twice(methods: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(SLIDER_CRANK, f"reliability.methods={methods}")


def test_form_without_a_design_point_says_so_and_gives_no_probability() -> None:
    """A crank that is 0.4 too long for certain breaks the limit, and nothing random leads there or away."""
    certain = ("reliability.dimensions={crank.length: [0.4, 0.4]}", "reliability.clearances={}",
               "reliability.limits={B.x: 0.1}", "reliability.samples=2000")  # fmt: skip
    sweep = "reliability.sweep={theta: {from: 30, to: 50, step: 10}}"
    study = study_of(SLIDER_CRANK, *certain, "reliability.poses=null", sweep, "reliability.methods=[analytic, form]")
    result = mechdesign.reliability(study)
    table = result.tables["reliability"]
    own = table["method"] == "form"
    assert table["failure"][~own].tolist() == [1.0] * 4
    assert np.isnan(table["failure"][own]).all()
    assert table["scope"][own].tolist() == ["pose"] * 3 + ["cycle"]
    (said,) = [note for note in map(str, result.warnings) if note.startswith("form:")]
    assert "theta = 30 deg and at 2 more poses" in said


@pytest.mark.nightly
@pytest.mark.parametrize("limits", LIMITS.values(), ids=LIMITS)
def test_all_methods_agree_about_limits_of_rates_and_of_several_outputs(limits: str) -> None:
    """The whole ladder against each other: their intervals overlap, and what claims none is near."""
    methods = f"reliability.methods=[{', '.join(METHODS)}]"
    table = mechdesign.reliability(study_of(SLIDER_CRANK, f"reliability.limits={limits}", methods), jobs=2).tables[
        "reliability"
    ]
    assert table["method"].tolist() == list(METHODS)
    low, failure, high = (
        dict(zip(METHODS, table[name], strict=True)) for name in ("failure_low", "failure", "failure_high")
    )
    plain = failure["monte_carlo"]
    assert 0.003 < plain < 0.3
    for method in ("importance_sampling", "auto"):
        assert low[method] <= high["monte_carlo"], method
        assert high[method] >= low["monte_carlo"], method
        assert low[method] < failure[method] < high[method], method
    for method, factor in (("analytic", 1.35), ("second_order", 1.35), ("form", 2.0)):
        # Uniform pins are no normal errors, and tangents are no limits.
        assert 1 / factor < failure[method] / plain < factor, method


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["analytic", "monte_carlo"])
def test_a_method_takes_the_pin_model_that_it_declares(kind: str) -> None:
    """Of two models of the pin, as an option gives one of them, only the methods of that option see another one."""
    changes = [f"reliability.methods=[{', '.join(METHODS)}]", "reliability.samples=2000", "reliability.limits={B.x: 1}",
               "reliability.rates={}", "reliability.precision={half_width: 0.2}"]  # fmt: skip
    failures = []
    for model in ("normal", "contact"):
        pin = {"analytic": "normal", "monte_carlo": "normal", kind: model}
        words = f"{{analytic: {pin['analytic']}, monte_carlo: {pin['monte_carlo']}}}"
        study = study_of(SLIDER_CRANK, *changes, f"reliability.clearances.A={{radial: 0.4, link: crank, pin: {words}}}")
        failures.append(mechdesign.reliability(study).tables["reliability"]["failure"])
    assert (failures[0] != failures[1]).tolist() == [pin == kind for pin in METHODS.values()]


@cache
def nodes() -> mechdesign.Table:
    """Nodes of the arm's workspace."""
    return mechdesign.workspace(study_of(POLAR_ARM)).tables["local"]


def fails_most_where_the_tip_is_far(table: mechdesign.Table) -> None:
    """Nowhere is the arm exact, and the farther the tip the larger its error: 0.17 at a radius of 100."""
    assert set(table["scope"]) == {"pose"}
    assert table["valid"].mean() > 0.5
    assert np.isfinite(table["failure"][table["valid"]]).all()
    reach = np.hypot(table["P.x"], table["P.y"])
    assert table["failure"][np.argmax(reach)] > 2 * table["failure"][np.argmin(reach)]


@pytest.mark.nightly
@pytest.mark.parametrize("method", METHODS)
def test_some_nodes_of_a_workspace(method: str) -> None:
    """At the region's edges too."""
    some = nodes().take(np.unique(np.linspace(0, len(nodes()) - 1, 12).astype(int)))
    poses = [{"P.x": x, "P.y": y} for x, y in zip(some["x"].tolist(), some["y"].tolist(), strict=True)]
    study = study_of(POLAR_ARM, f"reliability.methods=[{method}]", f"reliability.poses={poses}")
    fails_most_where_the_tip_is_far(mechdesign.reliability(study, jobs=2).tables["reliability"])


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["analytic", "second_order", "monte_carlo"])
def test_all_nodes_of_a_workspace(method: str) -> None:
    study = study_of(POLAR_ARM, f"reliability.methods=[{method}]", "reliability.samples=500")
    table = mechdesign.reliability(study, jobs=2).tables["reliability"]
    assert len(table) > 1000
    reach = np.hypot(table["P.x"], table["P.y"])
    assert (reach.min(), reach.max()) == pytest.approx((50, 100))
    fails_most_where_the_tip_is_far(table)


@pytest.mark.slow
@pytest.mark.parametrize("method", [name for name in METHODS if name != "analytic"])
def test_an_interrupt_keeps_the_poses_that_are_finished(method: str) -> None:
    """Ctrl-C at the third report of progress; what had begun before is answered, the rest is nan."""

    class Impatient:
        reports = 0

        def start(self, total: int, stage: str) -> None:
            pass

        def update(self, n: int) -> None:
            self.reports += 1
            if self.reports == 3:
                raise KeyboardInterrupt

    changes = [
        "reliability.poses=[{theta: 30}, {theta: 40}, {theta: 50}, {theta: 60}]",
        "reliability.samples=2000",
        "reliability.limits={B.x: 0.6}",
        f"reliability.methods=[analytic, {method}]",
    ]
    with pytest.raises(KeyboardInterrupt) as caught:
        mechdesign.reliability(study_of(SLIDER_CRANK, *changes), progress=Impatient())
    result = caught.value.result
    table = result.tables["reliability"]
    assert np.isfinite(table["failure"][table["method"] == "analytic"]).all()
    assert np.isfinite(table["failure"][table["method"] == method]).tolist() == [True, True, True, False]
    assert result.interrupted.endswith(f"analytic, {method}")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["form", "importance_sampling", "monte_carlo", "analytic"])
def test_a_limit_of_the_smallest_number_there_is(method):
    """Every sample breaks it; numbers beyond all bounds on the way are no warnings."""
    text = (
        "mechanism: {links: {ground: {O: [0, 0]}, upper: [O, A, 120], lower: [A, P, 90]},"
        " drives: {q1: {angle: upper}, q2: {angle: lower}}}\n"
        "kinematics: {poses: [{q1: 30, q2: 60}]}\n"
        "reliability: {dimensions: {upper.length: {tolerance: 0.1}}, limits: {P.x: 5.0e-324}, samples: 2000,"
        f" methods: [{method}]}}\n"
    )
    found = mechdesign.reliability(mechdesign.load(text=text))
    failure = found.tables["reliability"]["failure"]
    # A design point is known to a thousandth of sigma; whoever finds none says so.
    near = 1e-3 if method == "form" else 0.0
    assert failure[0] >= 1 - near or (np.isnan(failure[0]) and "no design point" in str(found.warnings[0]))


FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 5]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {P: [45, 20]}}
    rocker: {from: D, to: B, length: 60, points: {Q: [30, 10]}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
reliability:
  poses: [{theta: 40}]
  dimensions:
    '*.length': {sigma: 0.02}
    rod.P.x: {sigma: 0.02}
    rod.P.y: {sigma: 0.02}
    rocker.Q.x: {sigma: 0.01}
    rocker.Q.y: {sigma: 0.02}
    ground.O.x: {sigma: 0.01}
    ground.O.y: {sigma: 0.01}
    ground.D.x: {sigma: 0.02}
    ground.D.y: {sigma: 0.01}
    theta: {sigma: 0.02}
  outputs: [P.x, P.y, rocker.angle, Q.x]
  samples: 20000
"""


@pytest.fixture(scope="module")
def spread() -> dict[str, tuple[float, float]]:
    """Nominal value and standard deviation of the four-bar's outputs."""
    table = mechdesign.reliability(study_of(FOUR_BAR, "reliability.methods=[analytic]")).tables["moments"]
    columns = (table[name].tolist() for name in ("output", "nominal", "sigma"))
    return {output: (nominal, sigma) for output, nominal, sigma in zip(*columns, strict=True)}


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("beyond", [25.0, 11.0, 3.0, 1.0, -1.0, -6.0, -9.5, -14.0])
def test_form_of_one_limit_is_that_of_a_normal_error_inside_of_it_and_outside(
    beyond: float, side: int, spread: dict[str, tuple[float, float]]
) -> None:
    nominal, sigma = spread["P.x"]
    end = "usl" if side > 0 else "lsl"
    limit = f"reliability.limits={{P.x: {{{end}: {nominal - side * beyond * sigma!r}}}}}"
    table = mechdesign.reliability(study_of(FOUR_BAR, limit, "reliability.methods=[form]")).tables["reliability"]
    # The four-bar's errors are linear over such tolerances but for some hundredths of a deviation.
    lowest, highest = ndtr(beyond - 0.05), ndtr(beyond + 0.05)
    assert lowest <= table["failure"][0] <= highest


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_form_agrees_with_sampling_wherever_the_nominal_lies_among_several_limits(
    seed: int, spread: dict[str, tuple[float, float]]
) -> None:
    rng = np.random.default_rng(seed)
    limits = []
    for output in rng.permutation([*spread])[: rng.integers(1, 4)].tolist():
        low, high = np.sort(rng.uniform(-12, 12, 2)) if rng.random() < 0.5 else np.sort(rng.normal(0, 2.5, 2))
        nominal, sigma = spread[output]
        limits.append(f"{output}: {{lsl: {nominal + low * sigma:.12g}, usl: {nominal + high * sigma:.12g}}}")
    methods = "reliability.methods=[form, importance_sampling, analytic]"
    study = study_of(FOUR_BAR, f"reliability.limits={{{', '.join(limits)}}}", methods)
    table = mechdesign.reliability(study).tables["reliability"]
    form, sampled, analytic = table["failure"].tolist()
    assert form == pytest.approx(analytic, rel=0.03, abs=1e-14), limits
    assert sampled == pytest.approx(analytic, rel=0.05, abs=1e-14), limits
