"""Pictures of a stiffness."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.stiffness import ARM, FIVE_BAR
from helpers.studies import study_of

import mechdesign
from mechdesign.report.figures import style
from mechdesign.report.figures.mechanism import mechanism_figure
from mechdesign.report.figures.stiffness import Coil, figures, quantity, round_down
from mechdesign.results import Result


def pictures(text: str, *overrides: str) -> set[str]:
    study = study_of(text, *overrides)
    with style.context():
        found = figures(study, mechdesign.stiffness(study))
        for figure in found.values():
            assert style.encoded(figure).startswith(b"\x89PNG")
    return set(found)


def sweep(text: str) -> str:
    return f"stiffness.sweep={text}"


@pytest.mark.parametrize(
    ("overrides", "names"),
    [
        ([], {"springs", "directions"}),
        (["stiffness.loads=[[10, -5]]"], {"springs", "directions", "deflections"}),
        (["stiffness.poses=null", sweep("{P.x: 0, P.y: {from: 0.3, to: 0.7, number: 9}}")],
         {"springs", "directions", "stiffness"}),
        (["stiffness.poses=null", sweep("{P.x: {from: 0, to: 0.1, step: 0.05}, P.y: {from: 0.3, to: 0.5, step: 0.1}}")],
         {"springs", "directions", "stiffness"}),
        # All rigid: no direction gives, and there is no curve to draw.
        (["stiffness.actuators={}"], {"springs"}),
    ],
)  # fmt: skip
def test_pictures_of_a_pin(overrides: list[str], names: set[str]) -> None:
    assert pictures(FIVE_BAR, *overrides) == names


def test_beams_and_brackets_are_drawn_in_the_mechanism() -> None:
    """Of the links that have brackets; the other's beam is plainly the link."""
    text = ARM.replace("upper: [O, E, 0.5]", "upper: {from: O, to: E, length: 0.5, points: {M: [0.2, 0.1]}}")
    with style.context():
        figure = mechanism_figure(study_of(text), Result("stiffness", {}))
    for axes in figure.axes:
        (bracket,) = (line for line in axes.lines if line.get_label() == "rigid bracket")
        beams = [line for line in axes.lines if np.ndim(line.get_xdata()) and line.get_linestyle() == "--"]
        ends = np.array(bracket.get_xydata()) @ [1, 1j]
        assert abs(ends[1] - ends[0]) == pytest.approx(0.1)
        assert abs(ends[0]) == pytest.approx(0.2)
        lengths = [abs(np.diff(np.array(line.get_xydata()) @ [1, 1j])[0]) for line in beams]
        assert lengths == pytest.approx([0.5])


def test_what_is_rigid_on_the_way_has_no_curve() -> None:
    """An arm that its drives hold rigidly; with a soft one, seen from its hinge, it gives to moments only."""
    along = [
        "stiffness.poses=null",
        sweep("{shoulder: {from: 0, to: 90, step: 10}, elbow: 50}"),
        "stiffness.elastic={}",
    ]
    assert pictures(ARM, *along, "stiffness.actuators={}") == set()
    assert pictures(ARM, *along, "stiffness.link=upper", "stiffness.at=O") == {"stiffness"}


def test_a_leg_without_springs_has_no_picture_of_them() -> None:
    assert pictures(ARM, "stiffness.loads=[[0, -100, 0]]") == {"directions", "deflections"}


def test_poses_that_fail_are_left_out() -> None:
    assert "springs" in pictures(FIVE_BAR, "stiffness.poses=[{P.x: 9, P.y: 9}, {P.x: 0.05, P.y: 0.45}]")


def test_coil_runs_from_its_point_to_its_anchor() -> None:
    coil = Coil("", 1 + 1j, 4 + 5j, 1 + 1j, 2.0, False)
    assert coil.path[[0, -1]] == pytest.approx([1 + 1j, 4 + 5j])
    across = ((coil.path - coil.place) * np.conj(3 + 4j) / 5).imag
    assert abs(across).max() == pytest.approx(0.24, rel=1e-2)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (37409110.8, "3.74·10⁷ N/m"),
        (25958.86, "25959 N/m"),
        (474.93, "475 N/m"),
        (2e-4, "2.00·10⁻⁴ N/m"),
        (np.inf, "rigid"),
    ],
)
def test_stiffness_in_three_digits(value: float, text: str) -> None:
    assert quantity(value, "N/m") == text


@pytest.mark.parametrize(("value", "expected"), [(2.0, 2.0), (1.99, 1.0), (730.0, 500.0), (0.01, 0.01), (0.049, 0.02)])
def test_scales_are_round(value: float, expected: float) -> None:
    assert round_down(value) == pytest.approx(expected)
