"""Pictures of studies that stress their layout: long names, large and small numbers, many panels, thin regions."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.pages import faults, lost_curves
from helpers.pictures import figure_of
from helpers.studies import study_of

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.pictures import figures

HAND = "hand_mit_schraubgreifer_für_große_kästen_und_übergrößen_links"
ORIENTATIONS = f"""
units: {{length: mm}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, carriage: {{A: [0, 0]}}, cross: {{H: [0, 0]}}, {HAND}: [H, T, 120]}}
  joints: {{feed: {{prismatic: [ground, carriage]}}, rise: {{prismatic: [carriage, cross], direction: 90}}}}
  drives: {{x: {{slide: feed}}, y: {{slide: rise}}, q: {{angle: {HAND}}}}}
  limits: [{{drive: x, min: -10000, max: 10000}}, {{drive: y, min: -8000, max: 8000}}]
  sketch: {{T: [120, 0]}}
workspace:
  point: T
  at: {{{HAND}.angle: [0, 50, 100, 150, 200, 250, 300]}}
  scan: {{rays: 25}}
  characteristic_length: 300
  indices: inverse_condition
"""
STRIP = """
units: {length: mm}
mechanism:
  links: {ground: {O: [0, 0]}, carriage: {A: [0, 0]}, tool: {T: [0, 0]}}
  joints:
    feed: {prismatic: [ground, carriage]}
    cross: {prismatic: [carriage, tool], direction: 90}
  drives: {x: {slide: feed}, y: {slide: cross}}
  limits: [{drive: x, min: 0, max: 2000}, {drive: y, min: 0, max: 3}]
workspace: {point: T, scan: {about: [1000, 1.5], rays: 61}, indices: inverse_condition}
"""
CRANK, ROD = (f"{noun}_der_übergroßen_schmiedepresse_mit_schwungrad_und_bremse" for noun in ("kurbel", "pleuel"))
PRESS = f"""
units: {{length: mm}}
seed: 1
mechanism:
  links: {{ground: {{O: [0, 0]}}, {CRANK}: [O, A, 8000], {ROD}: [A, B, 24000]}}
  joints: {{guide: {{slot: ground, point: B}}}}
  drives: {{crank: {{angle: {CRANK}}}}}
  sketch: {{A: [0, 8000], B: [22000, 0]}}
reliability:
  outputs: [B.x, A.x, A.y]
  sweep: {{crank: {{from: 0, to: 360, step: 45}}}}
  dimensions: {{"*.length": {{tolerance: 0.000001}}}}
  clearances: {{A: {{radial: 0.000001, link: {CRANK}}}, B: {{radial: 0.000001}}}}
  rates: {{crank: 3}}
  methods: [analytic, monte_carlo]
  samples: 500
  sobol: 0
  limits: {{B.x: 0.000002}}
"""
FOUR_BAR = """
units: {length: mm}
seed: 1
mechanism:
  parameters: {a: 30, b: 90, c: 60}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, b], rocker: [D, B, c]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  targets: {rocker.angle: 100 + 0.2*crank}
kinematics: {sweep: {crank: {from: 20, to: 80, step: 20}}, outputs: [rocker.angle, B]}
"""
GOALS = (
    FOUR_BAR
    + """
optimize:
  method: pareto
  variables: {a: {from: 25, to: 35}, b: {from: 85, to: 95}, c: {from: 55, to: 65}}
  minimize: [kinematics.rocker.angle_error, a, b, c]
  evaluations: 120
"""
)
CASES = (
    FOUR_BAR
    + """
requirements: [{result: kinematics.rocker.angle_error, at_most: 12}]
matrix:
  vary:
    mechanism.parameters.a: "25:34:1"
    mechanism.parameters.b: "85:94:1"
    mechanism.parameters.c: [59, 61]
"""
)
SLOPES = """
mechanism:
  parameters: {the_radius_of_the_crank: 30, l: 100, e: 10}
  links: {ground: {O: [0, 0], G: [0, e]}, crank: [O, A, the_radius_of_the_crank], rod: [A, B, l], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: [crank]
  sketch: {A: [0, 30], B: [95, 10]}
kinematics: {poses: [{crank: 60}], outputs: [B.x]}
sensitivities: {results: [kinematics.B.x], parameters: [the_radius_of_the_crank, l, e, kinematics.poses.0.crank]}
"""
TIPS = [f"P{k}" for k in range(22)]
PLACES = ", ".join(f"{tip}: [{3 * k}, {2 * k - 21}]" for k, tip in enumerate(TIPS))
CURVES = f"""
units: {{length: mm}}
mechanism:
  links:
    ground: {{O: [0, 0]}}
    crank: {{from: O, to: A, length: 30, points: {{{PLACES}}}}}
  drives: [crank]
  sketch: {{A: [0, 30]}}
kinematics: {{sweep: {{crank: {{from: 0, to: 360, step: 15}}}}, outputs: [crank.angle, A, {", ".join(TIPS)}]}}
"""
O_LEFT, A, B, D = (f"{noun}_zwischen_gestell_und_übergroßer_schwinge_der_presse_{side}"
              for noun, side in (("lager", "li"), ("bolzen", "li"), ("bolzen", "re"), ("lager", "re")))  # fmt: skip
P = "messpunkt_auf_der_übergroßen_pleuelstange_der_schmiedepresse"
WHEEL, BAR, SWING = (f"{noun}_der_übergroßen_schmiedepresse_mit_bremse_und_antrieb"
                     for noun in ("schwungrad", "pleuel", "schwinge"))  # fmt: skip
LONG = f"""
mechanism:
  links:
    ground: {{{O_LEFT}: [0, 0], {D}: [100, 0]}}
    {WHEEL}: {{from: {O_LEFT}, to: {A}, length: 30, mass: 1 kg, center: [15, 0], inertia: 100 kg*mm^2}}
    {BAR}: {{from: {A}, to: {B}, length: 90, mass: 2 kg, center: [45, 0], inertia: 500 kg*mm^2,
      points: {{{P}: [45, 20]}}}}
    {SWING}: {{from: {D}, to: {B}, length: 60, mass: 1 kg, center: [30, 0], inertia: 300 kg*mm^2}}
  drives: {{antriebswinkel_der_übergroßen_schmiedepresse_mit_schwungrad: {{angle: {WHEEL}}}}}
  sketch: {{{A}: [0, 30], {B}: [75, 55]}}
"""
TURN = "antriebswinkel_der_übergroßen_schmiedepresse_mit_schwungrad: {from: 0, to: 360, step: 20}"
LONG_MOTION = f"""{LONG}
kinematics:
  outputs: [{P}, {SWING}.angle]
  sweep: {{{TURN}}}
  rates: {{antriebswinkel_der_übergroßen_schmiedepresse_mit_schwungrad: 60 rpm}}
"""
LONG_FORCES = f"""{LONG}
dynamics:
  sweep: {{{TURN}}}
  rates: {{antriebswinkel_der_übergroßen_schmiedepresse_mit_schwungrad: 60 rpm}}
"""
STAGES = range(10)
SCISSORS = "\n".join((
    "mechanism:", "  links:", "    ground: {Q0: [0, 0]}",
    *(f"    left_{k}: {{from: Q{k}, to: R{k + 1}, length: 100, points: {{M{k}: [50, 0]}}}}\n"
      f"    right_{k}: {{from: R{k}, to: Q{k + 1}, length: 100, points: {{M{k}: [50, 0]}}}}" for k in STAGES),
    "  joints: {floor: {slot: ground, point: R0}}", "  drives: {angle: {angle: left_0}}",
    "  sketch: {" + ", ".join(f"M{k}: [40, {60 * k + 30}], R{k}: [80, {60 * k}], Q{k + 1}: [0, {60 * k + 60}]"
                              for k in STAGES) + ", R10: [80, 600]}",
    "kinematics: {outputs: [Q10], rates: {angle: 10 deg/s}, sweep: {angle: {from: 20, to: 60, step: 4}}}",
))  # fmt: skip
RING = """
mechanism:
  links: {ground: {O: [0, 0]}, inner: [O, A, 250], outer: [A, P, 200]}
  drives: {q1: {angle: inner}, q2: {angle: outer}}
  sketch: {A: [250, 0], P: [250, 200]}
workspace: {point: P, scan: {rays: 61}, indices: inverse_condition}
"""
COLLISIONS = FOUR_BAR.replace("  targets", "  plates: {width: 40, pin: 4}\n  targets").replace(
    "outputs:", "collisions: [[crank, rocker]], outputs:")  # fmt: skip
LOADS = (
    FOUR_BAR
    + """
stiffness:
  at: B
  loads: [[100, 0], [1, 0], [0, -20]]
  sections: {bar: {E: 70 GPa, diameter: 8}}
  elastic: {rod: bar, rocker: bar}
  actuators: {crank: 1e6 N*mm/rad}
  poses: [{crank: 60}]
"""
)


@cache
def answered(command: str, text: str) -> tuple[mechdesign.Study, mechdesign.Answer]:
    """A study and what is answered to its question."""
    study = study_of(text)
    return study, getattr(mechdesign, command)(study)


# A page of paper has the least room; the wide one is looked at every night.
@pytest.mark.parametrize("look", [pytest.param("screen", marks=pytest.mark.nightly), "paper"])
@pytest.mark.parametrize(
    ("command", "study", "expected"),
    [
        ("workspace", ORIENTATIONS, {"workspace", "inscribed", "drives", "inverse_condition", "resistivity"}),
        ("workspace", STRIP, {"workspace", "inscribed", "drives", "joint_space", "inverse_condition", "resistivity"}),
        ("reliability", PRESS, {"bands", "deviations", "histogram", "convergence", "estimate", "reliability",
                                "contributions"}),
        ("optimize", GOALS, {"CPI", "designs", "pareto", "hypervolume", "optimum"}),
        ("sweep", CASES, {"main_effects", "scatter", "response"}),
        ("sensitivities", SLOPES, {"sensitivities"}),
        ("kinematics", LONG_MOTION, {"motion", "paths", "poses", "transmission"}),
        ("dynamics", LONG_FORCES, {"efforts", "free_bodies", "joint_forces", "bearings", "energies", "shaking"}),
        ("kinematics", SCISSORS, {"motion", "paths", "poses", "transmission"}),
        ("kinematics", COLLISIONS, {"motion", "paths", "poses", "transmission", "collisions"}),
        ("workspace", RING, {"workspace", "inscribed", "drives", "joint_space", "ellipses", "inverse_condition",
                               "resistivity"}),
    ],
    ids=["seven orientations", "a thin strip", "a large press with small clearances", "four goals", "200 cases",
         "a parameter of many letters", "names of sixty letters", "forces in joints of sixty letters", "twenty links",
         "a collision", "a ring"],
)  # fmt: skip
def test_pages_of_stressing_studies_are_laid_out(command: str, study: str, expected: set[str], look: str) -> None:
    given, result = answered(command, study)
    with style.context(look):
        drawn = figures(given, result)
        assert not drawn.failed
        assert set(drawn) == expected
        wrong = {}
        for name, figure in drawn.items():
            figure.canvas.draw()
            wrong[name] = [*faults(figure)]
            assert figure.get_figheight() <= style.tallest() + 0.05, name
    assert not any(wrong.values()), wrong


@pytest.mark.slow
def test_every_one_of_45_motion_curves_can_be_read() -> None:
    given, result = answered("kinematics", CURVES)
    with style.context():
        figure = figure_of(given, result, "motion")
        figure.canvas.draw()
        curves = {line.get_label() for axes in figure.axes for line in axes.get_lines()}
        assert len({f"{tip}.{axis}" for tip in TIPS for axis in "xy"} & curves) == 44
        assert not [*faults(figure), *lost_curves(figure)]


@pytest.mark.slow
def test_deflections_under_all_loads_have_one_magnification() -> None:
    given, result = answered("stiffness", LOADS)
    moves = result.tables["deflections"]
    with style.context():
        figure = figure_of(given, result, "deflections")
        figure.canvas.draw()
    ways = [next(line.get_xydata() for line in axes.get_lines() if line.get_linestyle() == ":") for axes in figure.axes]
    drawn = [float(np.hypot(*(way[1] - way[0]))) for way in ways]
    real = np.hypot(moves["dx"], moves["dy"])
    assert np.allclose(drawn / real, drawn[0] / real[0], rtol=1e-9)
    assert not [*faults(figure)]
