"""Drawings of mechanisms: what is in them, where, and the same bytes twice."""

import io
import time

import numpy as np
import pytest
from matplotlib.patches import PathPatch
from matplotlib.text import Text
from PIL import Image

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.labels import Label, paper, place_labels, positions
from mechdesign.drawing.layout import draw
from mechdesign.drawing.mechanism import mechanism_picture
from mechdesign.drawing.scene import hull, pose
from mechdesign.drawing.shapes import BAR, Line, Symbol, mechanism_shapes
from mechdesign.ground.results import Result

SLIDER = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, -20]}
    crank: [O, A, 40]
    rod: {from: A, to: B, length: 120, points: {P: [60, 15]}}
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "slider.yaml"
    path.write_text(SLIDER)
    return mechdesign.load(path)


def drawn(study):
    with style.context():
        figure = draw(mechanism_picture(study, Result("workspace", {})))
        return figure, style.encoded(figure)


@pytest.mark.slow
def test_every_joint_drive_slide_and_link_is_named_in_both_poses(study):
    figure, _ = drawn(study)
    assert [axes.get_title(loc="left")[:5] for axes in figure.axes] == ["Sketc", "First"]
    for axes in figure.axes:
        names = {text.get_text() for text in axes.texts}
        assert names >= {"O", "A", "B", "P", "theta", "crank", "rod"}


@pytest.mark.slow
def test_names_do_not_overlap(study):
    figure, _ = drawn(study)
    for axes in figure.axes:
        boxes = [Text.get_window_extent(text) for text in axes.texts]
        for k, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:k])


@pytest.mark.slow
def test_one_length_is_as_long_in_x_as_in_y(study):
    figure, _ = drawn(study)
    for axes in figure.axes:
        (x0, y0), (x1, y1) = axes.transData.transform([(0, 0), (1, 1)])
        assert x1 - x0 == pytest.approx(y1 - y0)


@pytest.mark.slow
def test_the_picture_has_the_same_bytes_again_and_no_metadata(study):
    _, first = drawn(study)
    _, second = drawn(study)
    assert first == second
    assert first[:8] == b"\x89PNG\r\n\x1a\n"
    assert b"Software" not in first


def test_joints_stand_where_the_mechanism_has_them(study):
    figure = style.new_figure(5)
    axes = figure.add_subplot()
    axes.set(xlim=(-60, 180), ylim=(-80, 80))
    configuration = study.mechanism.plan(("theta",)).solve([np.radians(60.0)])
    Posed(pose(study.mechanism, configuration)).draw(axes)
    shown = [patch.get_window_extent() for patch in axes.findobj(PathPatch)]
    for point in "OAB":
        place = complex(configuration.point(point))
        x, y = axes.transData.transform((place.real, place.imag))
        assert any(abs((box.x0 + box.x1) / 2 - x) < 1 and abs((box.y0 + box.y1) / 2 - y) < 1 for box in shown)


def test_a_pose_that_cannot_be_assembled_draws_nothing(study):
    figure = style.new_figure(5)
    axes = figure.add_subplot()
    configuration = study.mechanism.plan(("B.x",)).solve([1000.0])
    Posed(pose(study.mechanism, configuration)).draw(axes)
    assert not axes.lines
    assert not axes.texts
    assert pose(study.mechanism, configuration) is None


def test_pins_lie_on_bars_and_bars_on_the_ground_and_sizes_are_those_of_paper(study):
    mechanism = study.mechanism
    configuration = mechanism.plan(("theta",)).solve([np.radians(90.0)])
    shapes = mechanism_shapes(pose(mechanism, configuration))
    pins = [shape for shape in shapes if isinstance(shape, Symbol) and shape.fill == "white"]
    bars = [shape for shape in shapes if isinstance(shape, Line) and shape.width == BAR and not shape.filled]
    ground = [shape for shape in shapes if isinstance(shape, Symbol) and not shape.point and shape.place == 0]
    assert min(pin.layer for pin in pins) > max(bar.layer for bar in bars) > max(shape.layer for shape in ground)
    # The crank is 40 long, and stands upright.
    (crank,) = [bar for bar in bars if bar.link == "crank"]
    assert sorted(np.abs(crank.places)) == pytest.approx([0, 40])
    assert {pin.point: pin.place for pin in pins}["A"] == pytest.approx(40j)


@pytest.mark.slow
def test_user_settings_do_not_reach_the_picture_and_come_back(study):
    import matplotlib

    _, plain = drawn(study)
    with matplotlib.rc_context({"lines.linewidth": 9, "axes.facecolor": "red", "font.size": 22}):
        _, under_settings = drawn(study)
        assert matplotlib.rcParams["font.size"] == 22
    assert plain == under_settings


def test_hull_of_a_plate_and_of_a_bar():
    assert set(hull([0, 4, 4 + 4j, 4j, 2 + 2j])) == {0, 4, 4 + 4j, 4j}
    assert hull([3 + 3j, 1 + 1j, 2 + 2j]) == [1 + 1j, 3 + 3j]
    assert hull([1j, 1j]) == [1j]


@pytest.mark.nightly
def test_many_names_are_placed_in_time_that_grows_with_their_number():
    def seconds(count):
        with style.context():
            axes = style.new_figure(8).add_subplot()
            axes.set(xlim=(-1, 1), ylim=(-1, 1))
            places = np.sqrt(np.arange(count) / count) * np.exp(2.4j * np.arange(count))
            labels = [Label(f"P{k}", (place,), "black") for k, place in enumerate(places)]
            begun = time.process_time()
            place_labels(axes, labels, paper(axes, np.repeat(places, 9)), order=3)
            assert len(axes.texts) > count / 2  # names without room are left out
            return time.process_time() - begun

    # The bound is 20 times what it takes; each name against all others took 33 s.
    assert seconds(800) < 20


def test_names_go_where_least_is_covered():
    with style.context():
        axes = style.new_figure(4).add_subplot()
        axes.set(xlim=(-1, 1), ylim=(-1, 1))
        (origin,) = paper(axes, np.array([0j]))
        # Everything around the point is taken, but for what lies below it.
        x, y = np.meshgrid(np.linspace(-60, 60, 31), np.linspace(-60, 60, 31))
        around = np.column_stack([x.ravel(), y.ravel()])
        free = (np.abs(around[:, 0]) < 20) & (around[:, 1] < -3)
        place_labels(axes, [Label("O", (0j,), "black"), Label("P", (0j,), "black")], origin + around[~free], order=3)
        first, second = (text.xyann for text in axes.texts)
        assert first[1] < -6
        assert abs(first[0]) < 15
        assert second[1] < -6
        boxes = [Text.get_window_extent(text) for text in axes.texts]
        assert not boxes[0].overlaps(boxes[1])


def test_a_name_stands_where_it_covers_least_in_all_poses_together():
    label, window = Label("P", (0j,), "black"), np.array([[-100.0, -100.0], [100.0, 100.0]])
    x, y = (side.ravel() for side in np.meshgrid(np.linspace(-60, 60, 31), np.linspace(-60, 60, 31)))
    # Each pose leaves two sides free; the lower one is free in both.
    nets = [np.column_stack([x, y])[side] for side in ((x > -3) & (y > -3), (x < 3) & (y > -3))]
    (position,) = positions([label], [[np.zeros((1, 2))]] * 2, nets, window)
    assert position.offset[1] < -6
    assert not position.leader


@pytest.mark.slow
def test_a_picture_has_few_colours_and_none_that_is_off_by_what_an_eye_sees(study):
    """Areas to four levels of 255, edges to 48; a third of the bytes of a picture of all colours."""
    figure, data = drawn(study)
    exact = np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)
    picture = Image.open(io.BytesIO(data))
    few = np.asarray(picture.convert("RGB")).astype(int)
    off = np.sqrt(np.square(few - exact).sum(axis=2))
    assert off.max() <= 55
    same = (exact[1:-1, 1:-1] == exact[:-2, 1:-1]).all(axis=2) & (exact[1:-1, 1:-1] == exact[1:-1, :-2]).all(axis=2)
    assert np.sqrt(np.square(off).mean()) < 3.5
    assert (off[1:-1, 1:-1][same] <= 7).mean() > 0.995
    assert len(picture.getcolors()) <= 64
    whole = io.BytesIO()
    Image.fromarray(exact.astype(np.uint8)).save(whole, format="png")
    assert len(data) < len(whole.getvalue()) / 2.5
