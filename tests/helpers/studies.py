"""Studies written in a test, without a file of their own."""

from __future__ import annotations

import re
from pathlib import Path

import mechdesign

# A slider-crank in line, whose stroke is twice its crank `r`.
IN_LINE = """
mechanism:
  parameters: {r: 30, l: 100}
  links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: [crank]
  sketch: {A: [0, 30], B: [95, 0]}
"""
# A five-bar robot whose legs are alike, with all its assembly modes.
FIVE_BAR = """
units: {length: m}
mechanism:
  links:
    ground: {A: [-0.15, 0], B: [0.15, 0]}
    left: [A, D, 0.25]
    left_rod: [D, P, 0.40]
    right: [B, E, 0.25]
    right_rod: [E, P, 0.40]
  drives: {q1: {angle: left}, q2: {angle: right}}
  sketch: {D: [-0.38, 0.1], E: [0.38, 0.1], P: [0.05, 0.45]}
workspace: {point: P, assembly: any}
"""
# A four-bar with dimensions of all laws; pins of every kind with and without a spread of the radius.
VARIED = """
mechanism:
  links:
    ground: {A: [0, 0], D: [100, 0]}
    crank: [A, B, 40]
    rod: [B, C, 90]
    rocker: [D, C, 70]
  drives: {theta: {angle: crank}}
  sketch: {B: [20, 35], C: [95, 70]}
reliability:
  poses: [{theta: 60}]
  dimensions:
    crank.length: {tolerance: [-0.2, 1.0], distribution: triangular}
    rod.length: {sigma: 9, distribution: lognormal}
    rocker.length: {tolerance: [0, 0.7], distribution: uniform}
    ground.D.y: {tolerance: 1.5, distribution: truncated_normal}
    ground.D.x: {sigma: 0.4}
  clearances:
    A: {radial: 0.5, tolerance: [-0.2, 0.4], distribution: triangular, pin: uniform, link: crank}
    B: {radial: 1.0, pin: normal_in_disc, link: rod, effect: length}
    C: {radial: 0.4, tolerance: 0.3, pin: contact, link: rocker}
  methods: [second_order]
"""
# A slider-crank whose block is dragged along a level guide.
SLIDER_CRANK = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    block: {points: [B]}
  joints: {guide: {prismatic: [ground, block], direction: 0}}
  drives: {theta: {angle: crank}}
  sketch: {A: [20, 22], B: [105, 0]}
"""
# A crank-rocker with a coupler point.
FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {P: [45, 20]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
"""
# The same with comments, which stay where a program changes a number.
COMMENTED_FOUR_BAR = (
    FOUR_BAR.lstrip()
    .replace("  links:", "  links:                              # a point of two links is the pin between them")
    .replace("D: [100, 0]}", "D: [100, 0]}  # the pivots")
)
# A five-bar whose forearms come in line inside the region of all its assemblies.
CROSSED = """
units: {length: mm}
mechanism:
  links:
    ground: {O1: [-100, 0], O2: [100, 0]}
    upper_1: [O1, A1, 80]
    upper_2: [O2, A2, 80]
    lower_1: [A1, P, 110]
    lower_2: [A2, P, 110]
  drives: {q1: {angle: upper_1}, q2: {angle: upper_2}}
  sketch: {A1: [-90, 79], A2: [90, 79], P: [0, 142]}
workspace: {point: P, scan: {about: [0, 0], rays: 61}, assembly: any, indices: inverse_condition}
"""
# A 3-RPR platform whose legs drive it at given speeds.
PLATFORM = """
mechanism:
  links:
    ground: {A1: [-60, 0], A2: [60, 0], A3: [30, -20]}
    platform: {B1: [-20, 0], B2: [20, 0], B3: [25, 15]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  sketch: {B1: [-20, 100], B2: [20, 100], B3: [25, 115]}
reliability:
  poses: [{B1.x: -20, B1.y: 100, platform.angle: 0}]
  rates: {l1: 10, l2: 5}
  outputs: [B1, platform.angle]
"""


def of_readme() -> str:
    """The study in ten lines of README.md."""
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    (study,) = re.findall(r"^```yaml\n(mechanism:\n.*?)^```", text, re.DOTALL | re.MULTILINE)
    return str(study)


def study_of(text: str, *overrides: str) -> mechdesign.Study:
    """Load a study from its text."""
    return mechdesign.load(text=text, overrides=overrides)
