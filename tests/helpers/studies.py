"""Studies written in a test, without a file of their own."""

from __future__ import annotations

from pathlib import Path

from mechdesign.study import Study
from mechdesign.study.loading import load_bytes

# A slider-crank in line, whose stroke is twice its crank `r`.
IN_LINE = """
mechanism:
  parameters: {r: 30, l: 100}
  links: {ground: {O: [0, 0]}, crank: [O, A, r], rod: [A, B, l], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: [crank]
  sketch: {A: [0, 30], B: [95, 0]}
"""


def study_of(text: str, *overrides: str) -> Study:
    """Load a study from its text."""
    return load_bytes(text.encode(), Path("study.yaml"), overrides)
