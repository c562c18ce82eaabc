"""First-order reliability of many designs at once, whatever of it follows them, against each design by itself."""

import numpy as np
import pytest

import mechdesign
from mechdesign.family import stacked
from mechdesign.questions.poses import study_poses
from mechdesign.study.designs import Designs

TABLES = ("moments", "reliability", "capability", "contributions")
CRANK = """
mechanism:
  parameters: {{r: 30, k: 2, half: k*10, t: 0.02, w: 0.4, s: 12}}
  links:
    ground: {{O: [0, 0], C: [100, half - 20]}}
    crank: [O, P, r]
    rod: {{from: P, to: Q, length: 10*sqrt(r) + 40, points: {{T: [half, 10]}}}}
    rocker: [C, Q, 80]
  drives: {{crank: {{angle: crank}}}}
  sketch: {{P: [20, 25], Q: [85, 78]}}
reliability: {{sweep: {{crank: {{from: 20, to: 80, number: 4}}}}, methods: analytic, {section}}}
{more}
"""
SLIDER = """
mechanism:
  parameters: {{c: 0.05, s: 30, l: 90}}
  links: {{ground: {{O: [0, 0]}}, crank: [O, A, 40], rod: [A, B, l], slider: {{B: [0, 0]}}}}
  joints: {{guide: {{prismatic: [ground, slider], through: O}}}}
  drives: {{crank: {{angle: crank}}}}
  sketch: {{A: [20, 30], B: [100, 0]}}
reliability: {{sweep: {{crank: {{from: 20, to: 80, number: 4}}}}, methods: analytic, {section}}}
{more}
"""
LIMITS = "limits: {Q.x: 0.1, Q.y: 0.2}"
LOADED = """stiffness: {at: Q, loads: [[0, 5, 0]], bearings: {O: 1e5}, elastic: {rocker: bar},
  sections: {bar: {area: 50, inertia: 300, E: 200000}}}
"""

KINDS = {
    "half a tolerance": (CRANK, f"dimensions: {{'*.length': t, crank: 0.1}}, {LIMITS}", ["t", "r"]),
    "both ends": (CRANK, f"dimensions: {{r: [-t, 3*t], rocker.length: 0.1}}, {LIMITS}", ["t"]),
    "sigma": (CRANK, f"dimensions: {{rocker.length: {{sigma: t/3}}, crank: 0.1}}, {LIMITS}", ["t"]),
    "uniform": (
        CRANK, f"dimensions: {{rocker.length: {{tolerance: [-t, 0.1], distribution: uniform}}}}, {LIMITS}", ["t"]),
    "triangular": (
        CRANK, f"dimensions: {{r: {{tolerance: [-t, 0.1], distribution: triangular}}}}, {LIMITS}", ["t", "r"]),
    "lognormal": (CRANK, f"dimensions: {{r: {{tolerance: t, distribution: lognormal}}}}, {LIMITS}", ["t", "r"]),
    "beta": (
        CRANK, f"dimensions: {{r: {{tolerance: t, distribution: beta, shape: [k, 5]}}}}, {LIMITS}", ["t", "k"]),
    "class of a parameter": (CRANK, f"dimensions: {{r: h9, rocker.length: js8}}, {LIMITS}", ["r"]),
    "class of a place": (
        CRANK, f"dimensions: {{r: ISO 2768-m, rocker.length: js8}}, {LIMITS}", ["rocker.length", "r"]),
    "what a parameter moves": (CRANK, f"dimensions: {{r: 0.05, k: 0.01}}, {LIMITS}", ["r", "k"]),
    "a formula's parameter as a number": (CRANK, f"dimensions: {{r: 0.05, k: 0.01}}, {LIMITS}", ["half"]),
    "a place as a number": (CRANK, f"dimensions: {{r: 0.05, k: 0.01}}, {LIMITS}", ["rod.length", "r"]),
    "correlation": (
        CRANK, f"dimensions: {{r: 0.05, rocker.length: 0.05}}, correlation: [[r, rocker.length, w]], {LIMITS}", ["w"]),
    "correlation of laws": (
        CRANK, "dimensions: {r: {tolerance: [-t, 0.1], distribution: triangular}, rocker.length: 0.05}, "
        f"correlation: [[r, rocker.length, w]], {LIMITS}", ["w", "t"]),
    "limits": (CRANK, "dimensions: {'*.length': 0.1}, limits: {Q.x: t, Q.y: [-t, 2*t]}", ["t", "r"]),
    "limits of values": (
        CRANK, "dimensions: {'*.length': 0.1}, limits: {rocker.angle: {lsl: s, usl: s + 90}, Q.y: {usl: 80 + t}}",
        ["s", "t"]),
    "circle": (CRANK, "dimensions: {'*.length': 0.1}, limits: {T: {radius: t}}", ["t", "r"]),
    "circle and band": (CRANK, "dimensions: {'*.length': 0.1}, limits: {T: {radius: 5*t}, Q.x: 0.1}", ["t"]),
    "three limits": (CRANK, "dimensions: {'*.length': 0.1}, limits: {T.x: 4*t, T.y: 0.1, Q.x: 0.1}", ["t"]),
    "rates": (
        CRANK, "dimensions: {'*.length': 0.1}, rates: {crank: s}, limits: {Q.x: 0.1, Q.x_velocity: 0.5}", ["s", "r"]),
    "clearance": (
        SLIDER, "clearances: {A: {radial: c, tolerance: c/3}, B: {diametral: 2*c, pin: uniform}}, limits: {B.x: 0.1}",
        ["c", "l"]),
    "slide": (
        SLIDER, "dimensions: {crank.length: 0.05}, clearances: {guide: {radial: c, length: s}}, limits: {B.x: 0.1}",
        ["c", "s"]),
    "lognormal clearance": (
        SLIDER, "clearances: {A: {radial: c, tolerance: c/4, distribution: lognormal}}, limits: {B.x: 0.1}", ["c"]),
}  # fmt: skip


def batch_of(study, names, count=6, width=0.2, seed=1):
    rng = np.random.default_rng(seed)
    return Designs(study, {name: study.sizes[name] * (1 + width * rng.uniform(-1, 1, count)) for name in names})


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_all_designs_at_once_are_each_by_itself(kind):
    text, section, names = KINDS[kind]
    check(mechdesign.load(text=text.format(section=section, more="")), names)


def check(study, names):
    designs = batch_of(study, names)
    assert stacked.shared(study, "reliability", names)
    together = stacked.tables(study, "reliability", TABLES, study_poses(study, "reliability", designs.numbers))
    varied = 0.0
    for k in range(designs.count):
        alone = mechdesign.reliability(designs.one(k))
        for name in TABLES:
            table, own = together.result.tables[name], alone.tables[name]
            rows = slice(k * len(own), (k + 1) * len(own))
            for column in own.columns:
                if column.values.dtype.kind == "f":
                    assert table[column.name][rows] == pytest.approx(column.values, rel=1e-12, abs=1e-300, nan_ok=True)
                else:
                    assert table[column.name][rows].tolist() == column.values.tolist()
        varied = max(varied, np.ptp(together.result.tables["reliability"]["failure"]))
    assert varied > 0


@pytest.mark.slow
def test_loads_and_measured_values_follow_designs(tmp_path):
    values = 80 + 0.02 * np.random.default_rng(3).standard_normal(30)
    (tmp_path / "lengths.csv").write_text("\n".join(map(str, ["L", *values])))
    section = (
        "dimensions: {rocker.length: {measured: lengths.csv, nominal: 76 + 2*k}, load.fy: t}, "
        "load: [0, 40*k, 0], limits: {Q.x: 0.1, Q.y: 0.2}"
    )
    study = tmp_path / "study.yaml"
    study.write_text(CRANK.format(section=section, more=LOADED))
    check(mechdesign.load(study), ["k", "t"])


@pytest.mark.slow
@pytest.mark.parametrize("names", [["s"], ["w"], ["k", "half", "r"], ["rod.T.x", "rod.T.y"]], ids="-".join)
def test_what_yields_under_the_load_follows_designs(names):
    """Sections, actuators, bearings and loads, and the points along a link that bends."""
    yielding = """stiffness: {at: T, link: rod, loads: [[0, 5*k, 0]], bearings: {O: s*1e4}, elastic: {rocker: bar,
  rod: bar},
  sections: {bar: {area: 50*w, inertia: 300, E: 1e5*k}}, actuators: {crank: [1e6*s, 3e6]}}
"""
    section = "dimensions: {'*.length': 0.1}, limits: {Q.x: 0.1, T.y: 0.2}"
    check(mechdesign.load(text=CRANK.format(section=section, more=yielding)), names)


def test_an_angle_of_a_class_goes_by_the_leg_of_each_design():
    text = """
    mechanism:
      parameters: {leg: 60}
      links: {ground: {O: [0, 0]}, arm: [O, P, 90], bracket: {P: [0, 0], T: [leg, 0]}}
      joints: {plate: {fixed: [arm, bracket], angle: 30}}
      drives: [arm]
      sketch: {P: [90, 0]}
    reliability:
      poses: [{arm: 70}]
      methods: analytic
      dimensions: {plate.angle: {tolerance: ISO 2768-c, leg: leg}}
      limits: {T.x: 0.5}
    """
    study = mechdesign.load(text=text)
    designs = Designs(study, {"leg": np.array([20.0, 49.0, 51.0, 119.0, 121.0])})
    poses = study_poses(study, "reliability", designs.numbers)
    found = stacked.tables(study, "reliability", ["moments"], poses).result.tables["moments"]["worst_high"]
    alone = [mechdesign.reliability(designs.one(k)).tables["moments"]["worst_high"] for k in range(5)]
    assert found == pytest.approx(np.concatenate(alone), rel=1e-12)


def test_a_design_whose_tolerances_are_none_does_not_spoil_the_others():
    text = CRANK.format(
        section="dimensions: {r: {tolerance: j8}, rocker.length: [-t, 0.05]}, limits: {Q.x: 0.1}", more=""
    ).replace("r: 30", "r: 2.5").replace("P: [20, 25]", "P: [2, 1.5]").replace("10*sqrt(r) + 40", "80")  # fmt: skip
    values = {"mechanism.parameters.r": [2.5, 2.6, 3.2, 2.9], "mechanism.parameters.t": [0.02, 0.03, 0.02, -0.07]}
    table = mechdesign.evaluate(mechdesign.load(text=text), values, ["reliability.moments.sigma.max"])
    assert table["valid"].tolist() == [True, True, False, False]
    assert "gives no j8 of ... mm here" in table["reason"][2]
    assert "the lowest deviation is above the highest" in table["reason"][3]
    assert np.isfinite(table["reliability.moments.sigma.max"][:2]).all()
