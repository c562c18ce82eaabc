"""Pictures of a stiffness."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.stiffness import ARM, FIVE_BAR
from helpers.studies import study_of

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.mechanism import mechanism_picture
from mechdesign.drawing.panels import plane, quantity, round_down
from mechdesign.drawing.pictures import figures
from mechdesign.ground.results import Result


def pictures(text: str, *overrides: str) -> set[str]:
    study = study_of(text, *overrides)
    with style.context():
        found = figures(study, mechdesign.stiffness(study))
        for figure in found.values():
            assert style.encoded(figure).startswith(b"\x89PNG")
    return set(found)


def sweep(text: str) -> str:
    return f"stiffness.sweep={text}"


@pytest.mark.nightly
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
        figure = draw(mechanism_picture(study_of(text), Result("stiffness", {})))
    for axes in figure.axes:
        (bracket,) = (line for line in axes.lines if line.get_label() == "rigid bracket")
        beams = [line for line in axes.lines if np.ndim(line.get_xdata()) and line.get_linestyle() == "--"]
        ends = np.array(bracket.get_xydata()) @ [1, 1j]
        assert abs(ends[1] - ends[0]) == pytest.approx(0.1)
        assert abs(ends[0]) == pytest.approx(0.2)
        lengths = [abs(np.diff(np.array(line.get_xydata()) @ [1, 1j])[0]) for line in beams]
        assert lengths == pytest.approx([0.5])


@pytest.mark.slow
def test_what_is_rigid_on_the_way_has_no_curve() -> None:
    """An arm that its drives hold rigidly; with a soft one, seen from its hinge, it gives to moments only."""
    along = [
        "stiffness.poses=null",
        sweep("{shoulder: {from: 0, to: 90, step: 10}, elbow: 50}"),
        "stiffness.elastic={}",
    ]
    assert pictures(ARM, *along, "stiffness.actuators={}") == set()
    assert pictures(ARM, *along, "stiffness.link=upper", "stiffness.at=O") == {"stiffness"}


@pytest.mark.slow
def test_a_leg_without_springs_has_no_picture_of_them() -> None:
    assert pictures(ARM, "stiffness.loads=[[0, -100, 0]]") == {"directions", "deflections"}


@pytest.mark.slow
def test_poses_that_fail_are_left_out() -> None:
    assert "springs" in pictures(FIVE_BAR, "stiffness.poses=[{P.x: 9, P.y: 9}, {P.x: 0.05, P.y: 0.45}]")


def test_ellipse_of_a_point_has_the_axes_of_its_compliance() -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.stiffness(study)
    with style.context():
        axes = figure_of(study, result, "directions").axes[0]
    assert axes.get_aspect() == 1
    lines = {str(line.get_label()).split()[0]: np.array(line.get_xydata()) @ [1, 1j] for line in axes.lines}
    (edge,) = (line for line in lines.values() if len(line) > 300)
    soft, stiff = lines["softest"], lines["stiffest"]
    spans = np.abs(edge - edge[:-1].mean())
    table = result.tables["stiffness"]
    assert spans.max() / spans.min() == pytest.approx(table["k_max"][0] / table["k_min"][0], rel=1e-3)
    assert np.abs(np.diff(soft)) == pytest.approx(2 * spans.max(), rel=1e-3)
    assert np.angle(np.diff(stiff)[0] ** 2) == pytest.approx(np.angle(np.exp(2j * np.radians(table["k_angle"][0]))))


@pytest.mark.slow
def test_each_load_is_drawn_alone_and_legs_stay_on_their_pins() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs/planar_2rpr_rp.yaml")
    result = mechdesign.stiffness(study)
    with style.context():
        panels = figure_of(study, result, "deflections").axes
    assert len(panels) == len(study.stiffness.loads) == 3  # type: ignore[union-attr]
    for axes in panels:
        ends = np.array([end for line in axes.lines if len(line.get_xdata()) > 2 for end in line.get_xydata()[[0, -1]]])
        for pin in ([-0.6, 0], [0.6, 0], [0.3, -0.2]):
            assert np.hypot(*(ends - pin).T).min() < 1e-6


@pytest.mark.slow
def test_the_stiffness_of_a_spring_stands_beside_its_middle_away_from_the_others() -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.stiffness(study)
    with style.context():
        (axes,) = figure_of(study, result, "springs").axes
    named = [text for text in axes.texts if text.get_text().endswith("N/m")]
    assert len(named) == 2
    middle = sum(complex(*text.xy) for text in named) / 2
    for text in named:
        away = (complex(*text.xy) - middle).conjugate() * complex(*text.xyann)
        assert away.real > 0


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (37409110.8, "37.4 MN/m"),
        (25958.86, "26 kN/m"),
        (15958.86, "15959 N/m"),
        (474.93, "475 N/m"),
        (2e-4, "200 µN/m"),
        (np.inf, "rigid"),
    ],
)
def test_stiffness_in_three_digits(value: float, text: str) -> None:
    assert quantity(value, "N/m") == text


@pytest.mark.parametrize(("value", "expected"), [(2.0, 2.0), (1.99, 1.0), (730.0, 500.0), (0.01, 0.01), (0.049, 0.02)])
def test_scales_are_round(value: float, expected: float) -> None:
    assert round_down(value) == pytest.approx(expected)


CRANK = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 30], rod: [A, B, 90], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: O, point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [85, 0]}
stiffness:
  {link: slider, at: B, actuators: {theta: 1e6}, sweep: {theta: {from: 0, to: 350, step: 10}}, loads: [[-10, 0, 0]]}
"""


@pytest.mark.slow
def test_joint_forces_of_a_slider_crank_are_those_of_its_triangle() -> None:
    """The rod bears F / cos(phi), the guide F tan(phi), the crank's drive F r sin(theta + phi) / cos(phi)."""
    study = study_of(CRANK)
    with style.context():
        drawn = figures(study, mechdesign.stiffness(study))
    forces, moments = drawn["joint_forces"].axes
    rod, guide, crossing, mark = (np.array(line.get_xydata()) for line in forces.lines)
    theta = np.radians(rod[:, 0])
    phi = np.arcsin(np.sin(theta) / 3)
    assert rod[:, 1] == pytest.approx(10 / np.cos(phi), rel=1e-9)
    assert guide[:, 1] == pytest.approx(10 * np.abs(np.tan(phi)), rel=1e-9, abs=1e-4)
    assert (mark[0, 0], crossing[0, 0]) == pytest.approx((90, 90))
    assert mark[0, 1] == pytest.approx(10 / np.sqrt(1 - 1 / 9))
    assert np.abs(moments.lines[0].get_ydata()) == pytest.approx(
        np.abs(300 * np.sin(theta + phi) / np.cos(phi)), rel=1e-9, abs=1e-3)  # fmt: skip
    words = [text.get_text() for text in drawn["joint_forces"].legends[0].get_texts()]
    assert words == ["force in O, A, B", "force in guide", "moment in O"]
    # On the ground by the crank, from the origin: along the rod, which is in compression.
    way = np.array(drawn["force_hodographs"].axes[0].lines[2].get_xydata()) @ [1, 1j]
    assert way == pytest.approx(-10 * (1 - 1j * np.tan(phi)), rel=1e-9, abs=1e-4)


@pytest.mark.slow
def test_forces_that_grow_without_bounds_end_at_the_axis() -> None:
    """Driven by its slider, the crank jams at its dead centres."""
    study = study_of(CRANK, "mechanism.drives={s: {slide: guide}}", "stiffness.link=crank", "stiffness.at=A",
                     "stiffness.actuators={s: 1e6}", "stiffness.loads=[[0, -10, 0]]",
                     "stiffness.sweep={s: {from: 61, to: 119.9999, step: 0.9833}}")  # fmt: skip
    with style.context():
        (forces,) = figure_of(study, mechdesign.stiffness(study), "joint_forces").axes
    most = max(float(np.nanmax(line.get_ydata())) for line in forces.lines[:2])
    assert forces.get_ylim()[1] < most / 2
    assert "beyond the axis" in forces.get_title(loc="left")
    assert forces.lines[-1].get_ydata()[0] == forces.get_ylim()[1]


HAND = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, A, 40], lower: [A, B, 30], hand: [B, T, 10]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}, q3: {angle: hand, from: lower}}
  sketch: {A: [20, 35], B: [48, 28], T: [48, 18]}
workspace: {point: T, at: {hand.angle: [-90, 0]}, scan: {about: [0, 0]}, characteristic_length: 10}
stiffness: {at: T, actuators: {q1: 1e5, q2: 1e5, q3: 1e5}, poses: workspace}
"""


@pytest.mark.slow
def test_held_values_have_a_map_each_up_to_their_boundary() -> None:
    """With its hand held the arm's tip reaches the ring of its wrist, from 10 to 70, moved by the hand."""
    study = study_of(HAND)
    result = mechdesign.stiffness(study)
    with style.context():
        panels = [axes for axes in figure_of(study, result, "stiffness").axes if axes.get_xlabel()]
    words = [f"hand.angle = {angle} deg, {name} [N/mm]" for angle in (-90, 0) for name in ("k_min", "k_max")]
    assert [axes.get_title(loc="left") for axes in panels] == words
    over = plane(study, result.drawn.shown.poses)
    assert over is not None
    for (_, sectors), hand in zip(over.maps, (-10j, 10), strict=True):
        for curve in sectors.outline:
            assert np.abs(np.abs(curve - hand)[:, None] - (10, 70)).min(axis=1) == pytest.approx(0, abs=1e-6)
        ends = np.concatenate([patch.nodes[:, [0, -1]].ravel() for patch in sectors.patches])
        assert np.abs(np.abs(ends - hand)[:, None] - (10, 70)).min(axis=1) == pytest.approx(0, abs=1e-3)
        # Finer than the poses are.
        assert len(ends) > 2 * sum(patch.rays.stop - patch.rays.start for patch in sectors.patches)


@pytest.mark.slow
def test_deflections_of_all_loads_have_one_magnification() -> None:
    study = mechdesign.load(Path(__file__).parents[2] / "configs/planar_2rpr_rp.yaml")
    result = mechdesign.stiffness(study)
    with style.context():
        figure = figure_of(study, result, "deflections")
    (scale,) = re.findall(r"drawn (\S+) times as large", " ".join(text.get_text() for text in figure.texts))
    moves = result.tables["deflections"]
    for k, axes in enumerate(figure.axes):
        (dotted,) = (line for line in axes.lines if line.get_linestyle() == ":")
        size = float(np.hypot(*np.diff(dotted.get_xydata(), axis=0)[0]))
        assert size == pytest.approx(float(scale) * np.hypot(moves["dx"][k], moves["dy"][k]), rel=1e-6)
