"""Lengths of vectors about zero, and corners of measures and loads, in the methods that linearise."""

import itertools

import numpy as np
import pytest
from scipy.special import chndtr, ellipe, erf, i0e, i1e

import mechdesign

ROTOR = """
units: {length: mm}
mechanism:
  links:
    ground: {O: [0, 0]}
    rotor: {points: {O: [0, 0], P: [100, 0]}, mass: 2, center: [OFF, 0], inertia: 100}
  drives: {theta: {angle: rotor}}
dynamics: {}
reliability:
  poses: [{theta: 25}]
  rates: {theta: 100 rad/s}
  dimensions: {rotor.center.x: {sigma: SX}, rotor.center.y: {sigma: SY}}
  outputs: [shaking, O_force, shaking.x]
  limits: LIMITS
  methods: [analytic, second_order]
  sobol: 0
"""
# Newtons of a millimetre off the axis: 2 kg at 100 rad/s.
PULL = 20.0


def rotor(limits, off=0.0, sx=0.02, sy=0.02, text=ROTOR):
    changes = {"OFF": f"{off!r}", "SX": f"{sx!r}", "SY": f"{sy!r}", "LIMITS": limits}
    for word, value in changes.items():
        text = text.replace(word, value)
    return mechdesign.reliability(mechdesign.load(text=text))


def rows(table, **words):
    return table.take(table.where(**words))


@pytest.mark.parametrize("method", ["analytic", "second_order"])
@pytest.mark.parametrize("limit", [0.15, 0.4, 2.0, 3.5])
def test_the_force_of_a_balanced_rotor_has_the_law_of_rayleigh(method, limit):
    result, sigma = rotor(f"{{shaking: {{usl: {limit}}}}}"), PULL * 0.02
    failure = rows(result.tables["reliability"], method=method)["failure"][0]
    assert failure == pytest.approx(np.exp(-0.5 * (limit / sigma) ** 2), rel=1e-8)
    for name in ("shaking", "O_force"):
        moments = rows(result.tables["moments"], method=method, output=name)
        assert moments["mean"][0] == pytest.approx(sigma * np.sqrt(np.pi / 2), rel=1e-8)
        assert moments["sigma"][0] == pytest.approx(sigma * np.sqrt(2 - np.pi / 2), rel=1e-8)
    cpk = rows(result.tables["capability"], method=method)["cpk"][0]
    assert cpk == pytest.approx((limit - sigma * np.sqrt(np.pi / 2)) / (3 * sigma * np.sqrt(2 - np.pi / 2)), rel=1e-8)


@pytest.mark.parametrize("off", [0.005, 0.03, 0.11, 0.3, 0.39])
def test_the_force_of_an_unbalanced_rotor_has_the_law_of_rice(off):
    sigma, nominal = PULL * 0.02, PULL * off
    low, high = max(nominal - 1.1 * sigma, 0.5 * nominal), nominal + 1.7 * sigma
    result = rotor(f"{{shaking: {{lsl: {low!r}, usl: {high!r}}}}}", off)
    inside = [chndtr((end / sigma) ** 2, 2, (nominal / sigma) ** 2) for end in (low, high)]
    failure = rows(result.tables["reliability"], method="analytic")["failure"][0]
    assert failure == pytest.approx(1 - inside[1] + inside[0], rel=1e-7)
    half = (nominal / sigma) ** 2 / 4
    mean = sigma * np.sqrt(np.pi / 2) * ((1 + 2 * half) * i0e(half) + 2 * half * i1e(half))
    moments = rows(result.tables["moments"], method="analytic", output="shaking")
    assert moments["mean"][0] == pytest.approx(mean, rel=1e-8)
    assert moments["sigma"][0] == pytest.approx(np.sqrt(nominal**2 + 2 * sigma**2 - mean**2), rel=1e-6)


@pytest.mark.parametrize("sy", [0.019, 0.002, 1e-5, 0.0])
def test_unequal_deviations_give_the_law_of_hoyt_down_to_an_absolute_value(sy):
    result = rotor("{shaking: {usl: 0.5}}", sy=sy)
    a, b = PULL * 0.02, PULL * sy
    moments = rows(result.tables["moments"], method="analytic", output="shaking")
    assert moments["mean"][0] == pytest.approx(a * np.sqrt(2 / np.pi) * ellipe(1 - (b / a) ** 2), rel=1e-9)
    # Over the angle in the plane of the standardised components.
    phi = (np.arange(20000) + 0.5) * (2 * np.pi / 20000)
    exact = np.exp(-0.5 * 0.25 / np.maximum((a * np.cos(phi)) ** 2 + (b * np.sin(phi)) ** 2, 1e-300)).mean()
    failure = rows(result.tables["reliability"], method="analytic")["failure"][0]
    assert failure == pytest.approx(exact, rel=1e-6)
    if sy == 0.0:
        assert failure == pytest.approx(1 - erf(0.5 / (a * np.sqrt(2))), rel=1e-12)


def test_a_long_force_has_the_first_order_of_its_length():
    # A hundred deviations: the length follows the component along it.
    result = rotor("{shaking: {usl: 40.9}}", off=2.0)
    moments = rows(result.tables["moments"], method="analytic", output="shaking")
    assert moments["mean"][0] == pytest.approx(40.0, rel=1e-12)
    assert moments["sigma"][0] == pytest.approx(0.4, rel=1e-8)


ARM = """
units: {length: mm}
mechanism:
  links:
    ground: {O: [0, 0], Q: [60, 80], R: [60.05, 79.98]}
    arm: {from: O, to: A, length: 100}
    tip: {from: A, to: B, length: 40}
  drives: [arm, tip]
  measures:
    gap: {distance: [A, Q]}
    beside: {distance: [R, A]}
    off: "abs(A.x - 60)"
    oval: "hypot(A.x - 60, 2*(A.y - 80))"
    root: "sqrt((A.x - 60)**2 + (A.y - 80)*(A.y - 80))"
    turned: "abs(arm.angle - 53.12)"
    smooth: "exp((A.x - 60)/100) + (A.y - 80)**9 + atan2(A.y, A.x)"
    most: "max(A.x - 60, A.y - 80)"
    twice: "1 + 2*abs(A.x - 60)"
    way: "atan2(A.y - 80, A.x - 60)"
reliability:
  poses: [{arm: 53.13010235415598, tip: 20}]
  dimensions: {arm.length: {sigma: 0.03}, arm: {sigma: 0.02}, ground.Q.x: 0.03, tip.length: 0.05}
  clearances: {O: {radial: 0.02, pin: normal_in_disc}}
  outputs: [gap, beside, off, oval, root, turned, smooth]
  LIMITS
  methods: [analytic, second_order, monte_carlo]
  samples: 400000
  sobol: 0
"""


def arm(limits="", **changes):
    text = ARM.replace("LIMITS", f"limits: {limits}" if limits else "")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return mechdesign.reliability(mechdesign.load(text=text))


@pytest.mark.slow
def test_moments_of_distances_and_absolute_values_about_zero_are_those_of_made_mechanisms():
    table = arm().tables["moments"]
    for name in ("gap", "beside", "off", "oval", "root", "turned", "smooth"):
        made = rows(table, output=name, method="monte_carlo")
        for method in ("analytic", "second_order"):
            own = rows(table, output=name, method=method)
            assert own["mean"][0] == pytest.approx(made["mean"][0], rel=2e-3), (name, method)
            assert own["sigma"][0] == pytest.approx(made["sigma"][0], rel=5e-3), (name, method)


@pytest.mark.slow
@pytest.mark.parametrize(
    "limits",
    [
        "{gap: 0.07}",
        "{beside: {lsl: 0.03, usl: 0.1}}",
        "{off: 0.04, gap: 0.08}",
        "{oval: {lsl: 0.02, usl: 0.15}, A.y: 0.06}",
        "{root: 0.09, beside: {lsl: 0.01}, turned: {usl: 0.05}}",
        "{A: {radius: 0.09}, off: {usl: 0.05}, B.y: 0.1}",
    ],
)
def test_limits_of_lengths_among_others_fail_as_often_as_made_mechanisms(limits):
    table = arm(limits).tables["reliability"]
    made = rows(table, method="monte_carlo")
    low, high = made["failure_low"][0], made["failure_high"][0]
    for method in ("analytic", "second_order"):
        failure = rows(table, method=method)["failure"][0]
        assert low - 0.002 < failure < high + 0.002, method


def test_contributions_and_worst_cases_of_a_distance_about_zero_are_those_of_its_vector():
    clearances = "  clearances: {O: {radial: 0.02, pin: normal_in_disc}}\n"
    result = arm("{gap: 0.1}", **{clearances: "", "[analytic, second_order, monte_carlo]": "analytic"})
    shares = rows(result.tables["contributions"], output="gap")
    # The deviation of A by the length is along the arm, by its angle across it, and that of Q along x.
    moved = {"arm.length": (0.03, np.array([0.6, 0.8])), "arm": (np.deg2rad(2.0), np.array([-0.8, 0.6])),
             "ground.Q.x": (0.01, np.array([-1.0, 0.0])), "tip.length": (0.0, np.zeros(2))}  # fmt: skip
    total = sum(sigma**2 for sigma, _ in moved.values())
    for name, share in zip(shares["source"].tolist(), shares["share"].tolist(), strict=True):
        assert share == pytest.approx(moved[name][0] ** 2 / total, rel=1e-6)
    ends = [np.linalg.norm(sum(sign * 3 * s * way for sign, (s, way) in zip(signs, moved.values(), strict=True)))
            for signs in itertools.product((-1, 1), repeat=4)]  # fmt: skip
    moments = rows(result.tables["moments"], output="gap", method="analytic")
    assert moments["worst_high"][0] == pytest.approx(max(ends), rel=1e-4)
    assert moments["worst_case"][0] == pytest.approx(max(ends), rel=1e-4)
    assert moments["worst_low"][0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("measure", ["most", "twice", "way", "gap_velocity"])
def test_what_has_a_corner_within_its_errors_has_no_first_order_and_the_message_names_the_method_to_use(measure):
    # The distance of a point that passes Q turns from falling to rising there.
    result = arm(
        f"{{{measure}: 0.1}}", samples="rates: {arm: 10, tip: 0}\n  samples",
        **{"400000": "2000"},
    )  # fmt: skip
    name, _, order = measure.partition("_")
    moments = rows(result.tables["moments"], output=name, order=order or "position")
    for method in ("analytic", "second_order"):
        assert np.isnan(rows(moments, method=method)["sigma"][0])
        assert np.isnan(rows(result.tables["reliability"], method=method)["failure"][0])
    assert rows(moments, method="monte_carlo")["sigma"][0] > 0
    message = next(str(w) for w in result.warnings if w.kind == "undefined" and str(w).startswith(measure))
    assert "arm = 53.1301" in message
    assert "monte_carlo" in message


@pytest.mark.slow
def test_a_corner_beyond_the_errors_changes_nothing():
    result = arm(**{"A.x - 60, A.y - 80": "A.x - 60.3, A.y - 80", "turned,": "most,"})
    moments = rows(result.tables["moments"], output="most")
    assert moments["sigma"] == pytest.approx(moments["sigma"][2], rel=0.01)
    assert not [w for w in result.warnings if w.kind == "undefined"]


LOADED = """
units: {length: m}
mechanism:
  parameters: {lift: 3}
  links: {ground: {O: [0, 0]}, arm: {from: O, to: A, length: 0.1}}
  drives: [arm]
  measures: {high: "max(A.y, 0.06)"}
dynamics: {loads: [{at: A, force: [0, "LOAD"]}], rates: {arm: 2 rad/s}, poses: [{arm: 0}]}
reliability:
  poses: [{arm: 39.9}, {arm: 41}]
  dimensions: {arm: {sigma: 0.05}, arm.length: {sigma: 1e-4}, lift: {sigma: 0.02}}
  outputs: [arm_effort, O_force]
  methods: [analytic, second_order]
"""


@pytest.mark.parametrize(
    ("load", "smooth"),
    [
        ("-100*max(0, arm - 40)", [False, True]),
        ("-100*max(0, arm - 38 - lift)", [True, False]),
        ("-100*max(0, A.y_velocity - 0.1536)", [False, True]),
        ("-high*hypot(lift - 3, 4)", [True, True]),
        ("-1/(lift - 2.95)", [False, False]),
        ("-100*max(0, arm - 20 - lift)", [True, True]),
    ],
)
def test_a_load_with_a_corner_within_the_errors_leaves_efforts_and_forces_without_a_first_order(load, smooth):
    result = mechdesign.reliability(mechdesign.load(text=LOADED.replace("LOAD", load)))
    table = result.tables["moments"]
    for name in ("arm_effort", "O_force"):
        for method in ("analytic", "second_order"):
            assert np.isfinite(rows(table, output=name, method=method)["sigma"]).tolist() == smooth
        assert any(w.kind == "undefined" and str(w).startswith(name) for w in result.warnings) == (False in smooth)


def test_a_length_has_its_law_beside_poses_that_cannot_be_assembled():
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0], Q: [0, 40]}, crank: [O, A, 40], rod: [A, B, 72], rocker: [D, B, 66]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [60, 55]}
  measures: {gap: {distance: [A, Q]}}
reliability:
  sweep: {theta: {from: 0, to: 360, step: 90}}
  dimensions: {crank.length: {sigma: 0.01}, ground.Q.x: {sigma: 0.01}}
  limits: {gap: {usl: 90}}
  methods: [analytic, second_order]
"""
    result = mechdesign.reliability(mechdesign.load(text=text))
    for method in ("analytic", "second_order"):
        moments = rows(result.tables["moments"], method=method)
        assert moments["sigma"][1] == pytest.approx(0.01 * np.sqrt(2 - np.pi / 2), rel=1e-6)
        assert np.isnan(moments["sigma"]).tolist() == [False, False, True, False, False]
    shares = rows(result.tables["contributions"], output="gap", theta=90.0)
    assert shares["share"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.slow
def test_designs_and_allocation_judge_a_length_by_its_own_law():
    text = ROTOR.replace("center: [OFF, 0]", "center: [e, 0]").replace("  links:", "  parameters: {e: 0}\n  links:", 1)
    text = text.replace("SX", "0.02").replace("SY", "0.02").replace("LIMITS", "{shaking: {usl: 0.8}}")
    text = text.replace(", second_order", "")
    study = mechdesign.load(
        text=text + "optimize: {variables: {e: {from: 0, to: 0.06, number: 4}}, minimize: [reliability.failure]}\n"
    )
    failures = mechdesign.optimize(study).tables["designs"]["reliability.failure"]
    expected = [1 - chndtr(4.0, 2, (PULL * e / 0.4) ** 2) for e in (0, 0.02, 0.04, 0.06)]
    assert failures == pytest.approx(expected, rel=1e-6)
    tolerances = text.replace("sigma: 0.02", "tolerance: 0.06") + "  allocate: {reliability: 0.95}\n"
    confirmed = mechdesign.reliability(mechdesign.load(text=tolerances)).tables
    assert confirmed["confirmation"]["met"].all()
    # Equal costs: equal deviations s with exp(-(limit / s)^2 / 2) of 5 %.
    sigma = 0.8 / PULL / np.sqrt(-2 * np.log(0.05))
    assert confirmed["allocation"]["allocated"] == pytest.approx(3 * sigma, rel=0.03)


FOUR_BAR = """
units: {{length: mm}}
mechanism:
  links:
    ground: {{O: [0, 0], D: [{d}, 5], Q: [{q[0]}, {q[1]}]}}
    crank: [O, A, {a}]
    rod: {{from: A, to: B, length: {b}, points: {{P: [45, {p}]}}}}
    rocker: [D, B, {c}]
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0, {a}], B: [{d}, {c}]}}
  measures:
    gap: {{distance: [P, Q]}}
    side: "abs({n[0]}*(P.x - Q.x) + {n[1]}*(P.y - Q.y))"
reliability:
  poses: [{{theta: {theta}}}]
  dimensions: {{"*.length": {t[0]}, rod.P.x: {t[1]}, theta: {t[2]}, ground.Q.y: {t[3]}}}
  outputs: [gap, side, P.x, P.y]
  limits: {limits}
  methods: [analytic, second_order, monte_carlo]
  samples: 100000
  sobol: 0
"""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_lengths_of_random_four_bars_fail_and_spread_as_made_mechanisms_do(seed):
    rng = np.random.default_rng(seed)
    numbers = {"a": 20, "b": rng.uniform(80, 130), "c": rng.uniform(65, 95), "d": rng.uniform(80, 115),
               "p": rng.uniform(-40, 40), "theta": rng.uniform(0, 360), "n": rng.normal(size=2),
               "t": rng.uniform(0.005, 0.06, 4), "q": (0.0, 0.0), "limits": "{}"}  # fmt: skip
    first = mechdesign.reliability(mechdesign.load(text=FOUR_BAR.format(**numbers).replace("[analytic, second_order, "
                                   "monte_carlo]", "analytic"))).tables["moments"]  # fmt: skip
    x, y = (rows(first, output=name) for name in ("P.x", "P.y"))
    sigma = np.hypot(x["sigma"][0], y["sigma"][0])
    # From on the target to as far from it as is long.
    away = rng.choice([0.0, 0.3, 1.0, 4.0, 15.0, 25.0]) * sigma * np.exp(1j * rng.uniform(0, 2 * np.pi))
    numbers["q"] = x["nominal"][0] + away.real, y["nominal"][0] + away.imag
    low, high = max(abs(away) - rng.uniform(0.5, 2) * sigma, 0.0), abs(away) + rng.uniform(0.5, 2) * sigma
    limits = [f"gap: {{lsl: {low}, usl: {high}}}", f"side: {{usl: {abs(away) + sigma}}}", f"P.x: {2 * sigma}"]
    numbers["limits"] = f"{{{', '.join(limits[: rng.integers(1, 4)])}}}"
    tables = mechdesign.reliability(mechdesign.load(text=FOUR_BAR.format(**numbers))).tables
    made = rows(tables["reliability"], method="monte_carlo")["failure"][0]
    for method in ("analytic", "second_order"):
        assert rows(tables["reliability"], method=method)["failure"][0] == pytest.approx(made, abs=0.012)
        for name in ("gap", "side"):
            own, drawn = (rows(tables["moments"], output=name, method=m) for m in (method, "monte_carlo"))
            assert own["mean"][0] == pytest.approx(drawn["mean"][0], abs=0.04 * drawn["sigma"][0])
            assert own["sigma"][0] == pytest.approx(drawn["sigma"][0], rel=0.03)
