"""Files for other tools: what is declared, and what stands in it, read back by a small parser of the test's own."""

from __future__ import annotations

import pytest

import mechdesign
from mechdesign.errors import StudyError
from mechdesign.exporting.exports import export_named, exports
from mechdesign.exporting.view import View

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    coupler: {from: A, to: B, length: 90, points: {P: [45, 25]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  plates: {width: 16, pin: 6, pins: {A: 8}, links: {coupler: {width: 12}}, kerf: 0.2}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 15}}
  outputs: [P]
"""


def exported(text, name, at=None, **changes):
    """What a file of a study holds."""
    return export_named(name).make(View(mechdesign.load(text=text, **changes), at))


@pytest.mark.parametrize("name", sorted(exports()))
def test_everything_that_is_declared_is_made_with_its_mark(name):
    content = exported(FOUR_BAR, name)
    data = content.data if isinstance(content.data, bytes) else content.data.encode()
    assert exports()[name].mark in data
    assert content.warnings == ()


def test_a_wrong_name_lists_those_there_are():
    with pytest.raises(StudyError, match=r"nothing is exported as 'mechanism.dfx'; did you mean 'mechanism.dxf'"):
        export_named("mechanism.dfx")
