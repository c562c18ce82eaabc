"""Studies written in a test, without a file of their own."""

from __future__ import annotations

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


def study_of(text: str, *overrides: str) -> mechdesign.Study:
    """Load a study from its text."""
    return mechdesign.load(text=text, overrides=overrides)
