"""Pictures of workspaces: equal axes, what ends the region, levels of maps and their names, panels side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from helpers.pictures import figure_of
from helpers.studies import CROSSED, study_of
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle
from matplotlib.text import Text

import mechdesign
from mechdesign.door.report.page.moving import moving
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.pictures import figures
from mechdesign.ground.columns import Column
from mechdesign.ground.numerals import power
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.ground.results import Result, Table
from mechdesign.questions.workspace.figures.boundary import inscribed_picture
from mechdesign.questions.workspace.figures.index_maps import index_columns
from mechdesign.questions.workspace.figures.regions import fate, regions
from mechdesign.questions.workspace.figures.view import WorkspaceView

FIVE_BAR = """
units: {length: m}
mechanism:
  links:
    ground: {B1: [-0.15, 0], B2: [0.15, 0]}
    lower_1: [B1, D1, 0.25]
    upper_1: [D1, C, 0.4]
    lower_2: [B2, D2, 0.25]
    upper_2: [D2, C, 0.4]
  drives: {phi1: {angle: lower_1}, phi2: {angle: lower_2}}
  limits: [{distance: [B1, C], max: 0.6}]
  sketch: {D1: [-0.33, 0.17], D2: [0.33, 0.17], C: [0, 0.4]}
workspace: {point: C, scan: {about: [0, 0], from: 0, to: 180, rays: 40}}
"""
REACH = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, A, 100], lower: [A, P, 70]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  limits: [{angle: [ground, upper], min: 20, max: 150}]
  sketch: {A: [60, 80], P: [130, 80]}
workspace: {point: P}
"""
ARM = """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, A, 40]
    lower: [A, B, 30]
    hand: [B, T, 10]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}, q3: {angle: hand, from: lower}}
  sketch: {A: [20, 35], B: [48, 28], T: [48, 18]}
workspace: {point: T, at: {hand.angle: [-90, 0, 60]}, scan: {rays: 30}, characteristic_length: 10}
"""


@pytest.mark.slow
def test_maps_have_equal_axes_named_levels_and_a_legend_of_what_ends_the_region() -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.workspace(study)
    with style.context():
        drawn = figures(study, result)
        page = drawn["inverse_condition"]
    assert {*index_columns(regions(study, result)[0]), "workspace", "drives"} <= set(drawn)
    (axes,) = page.axes
    (bar,) = axes.child_axes
    assert axes.get_aspect() == 1
    ticks = np.round(bar.get_yticks(), 9).tolist()
    named = [float(text.get_text()) for text in axes.texts]
    assert named
    assert set(named) <= set(ticks)
    assert len(set(named)) == len(named)
    words = {text.get_text() for text in page.legends[0].get_texts()}
    assert {"ends at a limit", "a leg is stretched"} <= words
    assert axes.get_xlabel() == "x [m]"


def elbow(base: complex, tip: Complexes, inner: float, outer: float, side: int) -> Complexes:
    """The elbow of a leg on one side of the line from its base to its tip, by the law of cosines."""
    reach = np.abs(tip - base)
    with np.errstate(invalid="ignore"):
        turn = np.arccos((inner**2 + reach**2 - outer**2) / (2 * inner * reach))
    return base + inner * (tip - base) / reach * np.exp(1j * side * turn)


def five_bar_jacobian(tip: Complexes) -> Floats:
    """Each upper link keeps its length: the tip moves along it as the lower link's end does."""
    bases = (-0.15, 0.15)
    elbows = [elbow(base, tip, 0.25, 0.4, side) for base, side in zip(bases, (1, -1), strict=True)]
    upper = np.stack([np.stack([(tip - d).real, (tip - d).imag], axis=-1) for d in elbows], axis=-2)
    lower = [((tip - d) * np.conj(1j * (d - b))).real for d, b in zip(elbows, bases, strict=True)]
    upper[np.isnan(upper).any(axis=(1, 2))] = np.eye(2) * np.nan
    return np.linalg.solve(upper, np.stack(lower, axis=-1)[..., None] * np.eye(2))


def arm_jacobian(tip: Complexes) -> Floats:
    ways = 1j * tip, 1j * (tip - elbow(0, tip, 100, 70, 1))
    return np.stack([np.stack([way.real, way.imag], axis=-1) for way in ways], axis=-1)


INDICES = {
    "inverse_condition": lambda most, least: least / most, "resistivity": lambda most, least: 1 / (most * least),
    "manipulability": lambda most, least: most * least, "sigma_min": lambda _, least: least,
    "sigma_max": lambda most, _: most,
}  # fmt: skip


@pytest.mark.parametrize(("text", "jacobian", "look"), [
    pytest.param(FIVE_BAR, five_bar_jacobian, "paper", marks=pytest.mark.slow),
    pytest.param(FIVE_BAR, five_bar_jacobian, "screen", marks=pytest.mark.nightly),
    pytest.param(REACH, arm_jacobian, "paper", marks=pytest.mark.nightly),
    pytest.param(REACH, arm_jacobian, "screen", marks=pytest.mark.nightly),
])  # fmt: skip
def test_every_name_of_a_level_stands_where_the_index_has_that_value(
    text: str, jacobian: Callable[[Complexes], Floats], look: str
) -> None:
    """Within two points on paper: over such a disc the closed form has values above and below the level."""
    study = study_of(text)
    result = mechdesign.workspace(study)
    disc = np.outer([0, 1, 2], np.exp(2j * np.pi * np.arange(16) / 16)).ravel()
    for name, index in INDICES.items():
        with style.context(look):
            page = figure_of(study, result, name)
            page.canvas.draw()
        (axes,) = page.axes
        (bar,) = axes.child_axes
        ten = 10.0 ** power(float(bar.get_yticks().max()))
        for words in axes.texts:
            box = words.get_window_extent()
            about = (box.min + box.max) @ np.array([0.5, 0.5j]) + disc * page.dpi / 72
            tips = axes.transData.inverted().transform(np.column_stack([about.real, about.imag])) @ np.array([1, 1j])
            matrices = jacobian(tips)
            field = index(*np.linalg.svd(matrices[np.isfinite(matrices).all(axis=(1, 2))], compute_uv=False).T)
            level = float(words.get_text()) * ten
            assert "e" not in words.get_text()
            assert field.min() <= level <= field.max(), (name, level, field[0])
        assert axes.texts, name


@pytest.mark.nightly
def test_held_coordinates_are_shown_side_by_side_at_one_scale() -> None:
    study = study_of(ARM)
    with style.context():
        page = figure_of(study, mechdesign.workspace(study), "inverse_condition")
    panels = page.axes[:3]
    assert [axes.get_title(loc="left") for axes in panels] == [
        "hand.angle = -90 deg", "hand.angle = 0 deg", "hand.angle = 60 deg"]  # fmt: skip
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1


@pytest.mark.nightly
def test_every_value_of_a_held_coordinate_is_in_the_workspace_and_its_drives() -> None:
    study = study_of(ARM)
    with style.context():
        drawn = figures(study, mechdesign.workspace(study))
    # More than the place of a point is given.
    assert "ellipses" not in drawn
    titles = ["hand.angle = -90 deg", "hand.angle = 0 deg", "hand.angle = 60 deg"]
    assert [axes.get_title(loc="left") for axes in drawn["workspace"].axes] == titles
    panels = drawn["drives"].axes
    assert {axes.get_title(loc="left").partition(", ")[0] for axes in panels} == set(titles)
    # A drive is told apart by its dashes, too, the same in all panels.
    looks = {str((line.get_color(), line._unscaled_dash_pattern)) for axes in panels for line in axes.lines}
    assert len(looks) == 3


@pytest.mark.parametrize(("kind", "at", "expected"), [
    ("limit", "q1 stretched", "limit"), ("singularity", "upper-lower stretched", "stretched"),
    ("singularity", "upper-lower folded", "folded"), ("singularity", "assembly 0", "singularity"),
])  # fmt: skip
def test_fates(kind: str, at: str, expected: str) -> None:
    assert fate(kind, at) == expected


@pytest.mark.slow
def test_an_index_that_grows_without_bound_is_cut_off_and_the_bar_says_so() -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.workspace(study)
    with style.context():
        page = figure_of(study, result, "resistivity")
    top = max(page.axes[0].child_axes[0].get_yticks())
    assert top < np.nanmax(result.tables["local"]["resistivity"]) / 10
    # An arrow instead of a flat end.
    assert page.axes[0].child_axes[0]._colorbar.extend == "max"


@pytest.mark.slow
def test_the_largest_shapes_are_drawn_where_the_table_has_them() -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.workspace(study)
    plain = Result("workspace", {**result.tables, "indices": Table("indices", (Column("area", np.ones(1)),))})
    shapes = {"circle_x": 0.0, "circle_y": 0.4, "circle_radius": 0.1, "rectangle_x": 0.0, "rectangle_y": 0.4,
              "rectangle_width": 0.2, "rectangle_height": 0.1}  # fmt: skip
    columns = tuple(Column(name, np.array([value])) for name, value in shapes.items())
    with style.context():
        assert inscribed_picture(WorkspaceView(study, plain)) is None
        shaped = Result("workspace", {**result.tables, "indices": Table("indices", columns)})
        page = draw(inscribed_picture(WorkspaceView(study, shaped)))
    assert page is not None
    circle, rectangle = page.axes[0].patches[-2:]
    assert circle.get_window_extent().height == pytest.approx(2 * rectangle.get_window_extent().height, rel=1e-6)
    assert [text.get_text() for text in page.axes[0].texts] == ["r = 0.1 m", "0.2 x 0.1 m"]


def test_the_path_of_a_point_is_drawn_with_its_speed() -> None:
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
workspace: {point: B}
"""
    study = study_of(text)
    result = mechdesign.workspace(study)
    with style.context():
        drawn = figures(study, result)
    assert set(drawn) == {"path", "speed_ratio"}
    axes = drawn["path"].axes[0]
    (segments,) = (lines for lines in axes.collections if lines.get_array() is not None)
    places = np.concatenate(segments.get_segments())
    assert np.hypot(places[:, 0] - 100, places[:, 1]) == pytest.approx(np.full(len(places), 60.0))
    assert axes.get_aspect() == 1


POLAR = """
mechanism:
  links: {ground: {O: [0, 0]}, boom: {from: O, to: T, telescopic: true}}
  drives: {q: {angle: boom}, s: {length: boom}}
  sketch: {T: [100, 60]}
  limits: [{drive: q, min: 0, max: 120}, {drive: s, min: 50, max: 200}]
workspace: {point: T, scan: {about: [0, 0], rays: 60}, characteristic_length: 100}
"""


@pytest.mark.slow
def test_ellipses_of_a_boom_are_radial_and_tangential() -> None:
    """Along the boom T moves 1 for 1, across it r / 100 for an arc of 100 mm; forces are the inverse."""
    study = study_of(POLAR)
    with style.context():
        page = figure_of(study, mechdesign.workspace(study), "ellipses")
    (axes,) = page.axes
    assert axes.get_aspect() == 1
    lines = [line for drawn in axes.collections if isinstance(drawn, LineCollection) for line in drawn.get_segments()]
    edges = [line @ [1, 1j] for line in lines if len(line) == 97]
    places = np.array([edge[:-1].mean() for edge in edges])
    velocity, force = np.split(places, 2)
    assert 20 <= len(velocity) <= 40
    assert velocity == pytest.approx(force)
    # As the legend says: 10 mm for 2 mm/s, and for 1 N.
    words = [text.get_text() for text in page.legends[-1].get_texts()]
    words = [text for text in words if "half axis" in text]
    assert "half axis 10 mm long: 2 mm/s" in words[0]
    assert "half axis 10 mm long: 1 N" in words[1]
    for kind, of_one in ((0, 10 / 2), (1, 10 / 1)):
        for edge, place in zip(edges[kind * len(velocity) :], velocity, strict=False):
            around = (edge - place) * np.conj(place) / abs(place)
            across = (abs(place) / 100) ** (1 - 2 * kind)
            assert np.abs(around.real).max() == pytest.approx(of_one, rel=2e-3)
            assert np.abs(around.imag).max() == pytest.approx(of_one * across, rel=2e-3)


@pytest.mark.slow
def test_an_index_that_is_the_same_everywhere_is_a_number_and_no_bar_of_colours() -> None:
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0]}, carriage: {A: [0, 0]}, tool: {T: [0, 0]}}
  joints: {feed: {prismatic: [ground, carriage]}, cross: {prismatic: [carriage, tool], direction: 90}}
  drives: {x: {slide: feed}, y: {slide: cross}}
  limits: [{drive: x, min: 0, max: 200}, {drive: y, min: 0, max: 100}]
workspace: {point: T, scan: {about: [100, 50], rays: 31}, indices: inverse_condition}
""")
    with style.context():
        page = figure_of(study, mechdesign.workspace(study), "inverse_condition")
    assert len(page.axes) == 1
    assert "1 everywhere" in " ".join(text.get_text() for text in page.findobj(Text)).replace("\n", " ")


LEGS = """
units: {length: dimensionless}
mechanism:
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits: [{drive: l1, min: 0.5, max: 2}, {drive: l2, min: 0.5, max: 2}]
  sketch: {C: [0, 1.2]}
workspace: {point: C, scan: {about: [0, 0], rays: 61}, assembly: any, indices: []}
"""
SERIAL = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 100], lower: [E, P, 60]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [80, 60], P: [80, 120]}
workspace: {point: P, scan: {about: [0, 0], rays: 61}, indices: []}
"""


def joint_space(text: str) -> tuple[dict[str, np.ndarray], str]:
    """Curves of the picture by their colours, shape (points, 2), and its words."""
    study = study_of(text)
    result = mechdesign.workspace(study)
    with style.context():
        figure = figure_of(study, result, "joint_space")
        style.encoded(figure)
    (axes,) = figure.axes
    drawn = {
        str(line.get_color()): np.asarray(line.get_xydata()) for line in axes.get_lines() if len(line.get_xydata()) > 2
    }
    words = " ".join(text.get_text() for text in figure.findobj(Text))
    return {color: curve[np.isfinite(curve).all(axis=1)] for color, curve in drawn.items()}, words


@pytest.mark.slow
def test_in_the_plane_of_two_strokes_limits_are_a_square_and_the_stretched_legs_a_line() -> None:
    curves, words = joint_space(LEGS)
    assert curves[style.VERMILION].sum(axis=1) == pytest.approx(2, abs=1e-6)
    limits = curves[style.INK]
    assert np.minimum(abs(limits - 0.5), abs(limits - 2)).min(axis=1) == pytest.approx(0, abs=1e-9)
    assert "parallel singularity" in words
    assert "cut open" not in words


@pytest.mark.slow
def test_in_the_plane_of_two_cranks_a_singularity_is_where_the_rods_are_in_line() -> None:
    curves, _ = joint_space(CROSSED)
    ends = [
        place + 80 * np.exp(1j * np.radians(angle))
        for place, angle in zip((-100, 100), curves[style.VERMILION].T, strict=True)
    ]
    assert abs(ends[1] - ends[0]) == pytest.approx(220, rel=1e-6)


@pytest.mark.slow
def test_the_plane_of_drives_that_turn_is_cut_open_once() -> None:
    curves, words = joint_space(SERIAL)
    assert "cut open" in words
    for color, elbow in ((style.BLUE, 0.0), (style.PURPLE, 180.0)):
        q1, q2 = curves[color].T
        assert abs(q2) == pytest.approx(elbow, abs=1e-4)
        assert np.ptp(q1) == pytest.approx(360, abs=1e-3)


RING = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: [O, A, 200]
    forearm: [A, P, 150]
    motor: [O, M, 20]
  drives: [arm, motor]
  couplings: {elbow: {set: forearm, of: motor, ratio: 1, phase: 0, wheels: belt, radius: 20}}
  sketch: {M: [10, 17], A: [190, 60], P: [260, 190]}
workspace: {point: P, scan: {rays: 61}, indices: []}
"""


@pytest.mark.slow
def test_a_ring_is_a_strip_in_the_plane_of_the_drives_without_fins() -> None:
    # P is reached with an elbow that opens by 0 < motor - arm < 180 degrees, whatever the arm's angle.
    curves, words = joint_space(RING)
    assert "cut open at arm = -180 and 180 deg" in words
    for color, elbow in ((style.BLUE, 0.0), (style.PURPLE, 180.0)):
        arm, motor = curves[color].T
        assert motor - arm == pytest.approx(elbow, abs=1e-3)
        assert (arm.min(), arm.max()) == pytest.approx((-180, 180), abs=1e-3)
    study = study_of(RING)
    with style.context():
        (axes,) = figure_of(study, mechdesign.workspace(study), "joint_space").axes
    cells = [path.vertices[:4] for drawn in axes.collections for path in drawn.get_paths()]
    arm, motor = np.stack(cells, axis=-1).transpose(1, 0, 2)
    area = np.abs(np.sum(arm * np.roll(motor, -1, axis=0) - np.roll(arm, -1, axis=0) * motor, axis=0)) / 2
    inside = (arm.min(axis=0) >= -180) & (arm.max(axis=0) <= 180)
    assert ((motor - arm > -1e-3) & (motor - arm < 180 + 1e-3)).all()
    assert area[inside].sum() == pytest.approx(360 * 180, rel=0.05)


@pytest.mark.slow
def test_drives_along_a_boundary_are_over_its_length_the_circle_of_a_hole_by_itself() -> None:
    study = study_of(RING)
    with style.context():
        outer, inner = figure_of(study, mechdesign.workspace(study), "drives").axes
    for axes, words, radius, elbow in ((outer, "outer", 350, 0), (inner, "inner", 50, 180)):
        assert axes.get_title(loc="left").startswith(f"{words} boundary")
        arm, motor = (np.asarray(line.get_xydata()) for line in axes.lines[:2])
        assert arm[-1, 0] == pytest.approx(2 * np.pi * radius, rel=3e-3)
        assert motor[:, 1] - arm[:, 1] == pytest.approx(elbow, abs=1e-3)
        assert np.degrees(arm[:, 0] / radius) == pytest.approx(arm[:, 1] - arm[0, 1], abs=1)


@pytest.mark.slow
@pytest.mark.parametrize("look", ["screen", "paper"])
def test_the_size_of_a_rectangle_keeps_off_the_outline_of_the_circle(look: str) -> None:
    study = study_of(FIVE_BAR)
    result = mechdesign.workspace(study)
    with style.context(look):
        figure = draw(inscribed_picture(WorkspaceView(study, result)))
        figure.canvas.draw()
        (axes,) = figure.axes
        (circle,) = (patch for patch in axes.patches if isinstance(patch, Circle))
        (size,) = (text for text in axes.texts if " x " in text.get_text())
        box = Text.get_window_extent(size).transformed(axes.transData.inverted())
    corners = np.array(box.corners()) @ [1, 1j] - complex(*circle.center)
    nearest = complex(
        np.clip(0, corners.real.min(), corners.real.max()), np.clip(0, corners.imag.min(), corners.imag.max())
    )
    assert abs(corners).max() < circle.radius or abs(nearest) > circle.radius


def colours(axes: Axes) -> tuple[float, float]:
    """Ends of the bar beside a map."""
    ticks = axes.child_axes[0].get_yticks()
    return float(min(ticks)), float(max(ticks))


@pytest.mark.nightly
def test_maps_of_several_orientations_have_the_same_colours_in_the_picture_and_on_the_page() -> None:
    study = study_of(ARM.replace("rays: 30", "rays: 20"))
    result = mechdesign.workspace(study)
    local = result.tables["local"]
    # One orientation has values many times those of another, of an index without bounds.
    grown = np.where(local["hand.angle"] > 0, 10, 1) * local["sigma_min"]
    columns = (replace(column, values=grown) if column.name == "sigma_min" else column for column in local.columns)
    result = replace(result, tables={**result.tables, "local": replace(local, columns=tuple(columns))})
    page = moving(study, result)
    assert page is not None
    with style.context():
        bounded, alike, own = (
            figure_of(study, result, name) for name in ("inverse_condition", "sigma_max", "sigma_min")
        )
        words = [
            " ".join(text.get_text() for text in figure.findobj(Text)).replace("\n", " ")
            for figure in (bounded, alike, own)
        ]
    assert {colours(axes) for axes in bounded.axes[:3] if axes.child_axes} == {(0.0, 1.0)}
    assert ["one scale" in part for part in words] == [True, True, False]
    assert "scale of its own" in words[2]
    assert "inverse condition, from 0 to 1; one scale" in page.drawing
    assert "scale of its own" in page.drawing
    parts = [axes.get_title(loc="left").split("\n")[-1] for axes in own.axes[:3]]
    labels = [chosen.label for _, maps in page.maps for chosen in maps if chosen.index == "sigma_min"]
    assert labels == [f"sigma min {part}" for part in parts]
    assert len({*labels}) == 2
