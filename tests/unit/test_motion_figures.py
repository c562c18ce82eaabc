"""Pictures of motions: what they show of a sweep, its limits and its assemblies."""

import numpy as np
import pytest
from helpers.pages import faults
from helpers.pictures import figure_of
from helpers.studies import study_of
from matplotlib.colors import to_rgb
from matplotlib.patches import Polygon
from matplotlib.text import Text

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Picture
from mechdesign.drawing.mechanism import sketch_picture
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.pictures import figures
from mechdesign.drawing.sweep import Sweep, ranks
from mechdesign.questions.kinematics.figures.animation import _frames as frames_of
from mechdesign.questions.kinematics.figures.animation import in_order
from mechdesign.questions.kinematics.figures.centrodes import centrodes
from mechdesign.questions.kinematics.figures.curves import motion_curves
from mechdesign.questions.kinematics.figures.paths import path_looks, path_marks
from mechdesign.questions.kinematics.figures.polygons import centripetal, images
from mechdesign.questions.kinematics.figures.poses import place_of
from mechdesign.questions.kinematics.figures.view import MotionView

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {C: [45, 40]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 5}}
"""
FIVE_BAR = """
units: {length: mm, time: s}
mechanism:
  links:
    ground: {O1: [-50, 0], O2: [50, 0]}
    left: [O1, A, 100]
    left_rod: [A, C, 140]
    right: [O2, B, 100]
    right_rod: [B, C, 140]
  drives: {q1: {angle: left}, q2: {angle: right}}
  sketch: {A: [-110, 80], B: [110, 80], C: [0, 165]}
kinematics: {path: {C: {circle: {center: [0, 160], radius: 20}, points: 12}}, speed: 50, outputs: [C]}
"""
ROCKER = """
mechanism:
  links: {ground: {O: [0, 0], D: [60, 0]}, crank: [O, A, 50], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [20, 45], B: [110, 34]}
kinematics:
  sweep: {crank: {from: -180, to: 180, step: 5}}
  rates: {crank: 60 rpm}
"""


def drawn(study, name, look="screen", **options):
    with style.context(look):
        figure = figure_of(study, mechdesign.kinematics(study, **options), name)
        figure.canvas.draw()
        return figure


def names(study):
    with style.context():
        return set(figures(study, mechdesign.kinematics(study)))


def sweep_of(study):
    return Sweep.of(mechdesign.kinematics(study).drawn.shown)


def boxes(axes):
    return [text.get_window_extent() for text in axes.texts if text.get_text()]


@pytest.mark.slow
def test_paths_and_their_mechanism_lie_within_the_picture_and_names_apart():
    figure = drawn(study_of(FOUR_BAR), "paths")
    (axes,) = figure.axes
    window = axes.get_window_extent()
    for line in axes.lines:
        places = axes.transData.transform(line.get_xydata())
        places = places[np.isfinite(places).all(axis=1)]
        assert (places >= window.min).all()
        assert (places <= window.max).all()
    names = boxes(axes)
    assert len(names) >= 8
    for k, box in enumerate(names):
        assert not any(box.overlaps(other) for other in names[:k])


@pytest.mark.slow
def test_names_are_nearest_to_their_own_pins_or_have_a_line():
    study = study_of(FOUR_BAR.replace("points: {C: [45, 40]}", "points: {C: [45, 6], E: [45, -6], F: [51, 0]}"))
    (axes,) = drawn(study, "paths").axes
    names = [text for text in axes.texts if text.get_text() in "ODABCEF"]
    assert len(names) == 7
    pins = {text.get_text(): axes.transData.transform(text.xy) for text in names}
    for text in names:
        box = Text.get_window_extent(text)
        gaps = {name: np.hypot(*np.maximum(np.maximum(box.min - pin, pin - box.max), 0)) for name, pin in pins.items()}
        assert min(gaps, key=gaps.get) == text.get_text() or text.arrow_patch is not None


@pytest.mark.slow
def test_numbers_of_ticks_are_clear_of_the_names_of_axes():
    figure = drawn(study_of(FOUR_BAR.replace("sweep:", "rates: {theta: 1e-3}\n  sweep:")), "motion")
    for axes in figure.axes:
        name = axes.yaxis.label.get_window_extent()
        assert all(not name.overlaps(tick.get_window_extent()) for tick in axes.get_yticklabels() if tick.get_text())


@pytest.mark.slow
def test_the_coupler_point_tells_most():
    assert ranks(study_of(FOUR_BAR)) == {"A": 0, "B": 0, "C": 2}
    assert ranks(study_of(FOUR_BAR.replace("sweep:", "outputs: [B.x]\n  sweep:")))["B"] == 2
    figure = drawn(study_of(FOUR_BAR), "paths")
    study = study_of(FOUR_BAR)
    path = np.asarray(sweep_of(study).places["C"])
    bold = max(
        (line for line in figure.axes[0].lines if len(line.get_xdata()) == 73), key=lambda line: line.get_linewidth()
    )
    np.testing.assert_allclose(bold.get_xdata(), path.real)


@pytest.mark.parametrize(
    "poses",
    ["sweep: {theta: {from: 0, to: 360, step: 45}}", "path: {A: {circle: {center: [0, 0], radius: 30}, points: 8}}"],
)
def test_traces_of_few_poses_are_curves(poses):
    """A crank's pin stays on its circle between the poses of a sweep, and of a path given by few points."""
    text = FOUR_BAR.replace("sweep: {theta: {from: 0, to: 360, step: 5}}", poses)
    if "path" in poses:
        text = text.replace("crank: [O, A, 30]", "crank: {from: O, to: A, telescopic: true}")
        text = text.replace("drives: {theta: {angle: crank}}", "drives: {theta: {angle: crank}, l: {length: crank}}")
    trace = sweep_of(study_of(text)).traces["A"]
    middles = (trace[1:] + trace[:-1]) / 2
    np.testing.assert_allclose(np.abs(trace), 30, rtol=1e-9)
    np.testing.assert_allclose(np.abs(middles), 30, rtol=3e-3)
    assert abs(trace[-1] - trace[0]) < 1e-9


@pytest.mark.slow
def test_curves_of_what_moves_only():
    study = study_of(FOUR_BAR.replace("sweep:", "rates: {theta: 10}\n  sweep:"))
    figure = drawn(study, "motion")
    names = {text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()}
    assert names == {"C.x", "C.y", "A.x", "A.y", "B.x", "B.y", "rod.angle", "rocker.angle"}
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == [
        "position [mm]", "angle [deg]", "velocity [mm/s]", "velocity [deg/s]", "acceleration [mm/s²]",
        "acceleration [deg/s²]",
    ]  # fmt: skip
    assert figure.axes[-1].get_xlabel() == "theta [deg]"


@pytest.mark.slow
def test_what_stands_still_is_drawn_straight_and_only_where_it_is_asked_for():
    parallelogram = FOUR_BAR.replace("length: 90", "length: 100").replace("[D, B, 60]", "[D, B, 30]")
    study = study_of(
        parallelogram.replace("B: [75, 55]", "B: [100, 30]").replace("from: 0, to: 360", "from: 10, to: 170"),
        "kinematics.outputs=[rod.angle]", "kinematics.rates={theta: 10}",
    )  # fmt: skip
    (axes,) = drawn(study, "motion").axes
    low, high = axes.get_ylim()
    assert high - low > 0.1
    assert np.ptp(axes.lines[0].get_ydata()) < 1e-6
    assert axes.get_ylabel() == "angle [deg]"


@pytest.mark.slow
def test_limits_of_motion_and_what_is_not_valid_are_marked():
    study = study_of(ROCKER)
    result = mechdesign.kinematics(study)
    limits = sorted(result.tables["limits"]["crank"])
    assert len(limits) == 2
    with style.context():
        figure = draw(motion_curves(study, result.tables, result.drawn.shown.poses))
    for axes in figure.axes:
        marks = sorted(line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2)
        assert marks == pytest.approx(limits)
        (shade,) = axes.patches
        assert shade.get_extents().transformed(axes.transData.inverted()).intervalx == pytest.approx(limits, abs=1e-6)
    words = {text.get_text() for text in figure.legends[0].get_texts()}
    assert words == {"dead centre", "not valid"}


@pytest.mark.slow
def test_a_rate_without_bound_does_not_flatten_the_rest():
    limit = max(mechdesign.kinematics(study_of(ROCKER)).tables["limits"]["crank"])
    study = study_of(ROCKER, f"kinematics.sweep={{crank: {{from: {limit + 1e-4}, to: 180, step: 2}}}}")
    result = mechdesign.kinematics(study)
    with style.context():
        figure = draw(motion_curves(study, result.tables, result.drawn.shown.poses))
    rates = result.tables["motion"]["rocker.angle_velocity"]
    usual = np.nanpercentile(np.abs(rates), 90)
    axes = next(axes for axes in figure.axes if axes.get_ylabel() == "velocity [deg/s]")
    assert np.nanmax(np.abs(rates)) > 10 * usual
    assert max(map(abs, axes.get_ylim())) < 5 * usual


@pytest.mark.slow
def test_between_the_last_pose_and_a_dead_centre_curves_are_bent_and_rates_legible():
    """Three links of 60 on a ground of 150 stretch beyond 40 deg: cos(mu) = 1 - d^2 / 7200 [law of cosines]."""
    study = study_of("""
mechanism:
  links: {ground: {O: [0, 0], C: [150, 0]}, crank: [O, A, 60], coupler: [A, B, 60], rocker: [C, B, 60]}
  drives: [crank]
  sketch: {A: [59, 10], B: [105, 40]}
kinematics: {sweep: {crank: {from: -60, to: 60, step: 10}}, rates: {crank: 1 rad/s}}
""")
    crank = np.array([42, 45, 48])
    across = 60**2 + 150**2 - 2 * 60 * 150 * np.cos(np.radians(crank))
    curve = next(line for line in drawn(study, "transmission").axes[0].lines if len(line.get_xdata()) > 5)
    angle = np.interp(crank, *curve.get_data())
    assert angle == pytest.approx(np.degrees(np.arccos(1 - across / 7200)), abs=0.2)
    axes = next(axes for axes in drawn(study, "motion").axes if axes.get_ylabel() == "velocity [deg/s]")
    rates = max(axes.lines, key=lambda line: len(line.get_xdata()))
    assert np.ptp(axes.get_ylim()) < 5 * np.ptp(np.interp([-40, 40], *rates.get_data()))


@pytest.mark.slow
def test_an_animation_of_a_turn_with_a_gap_has_no_jump():
    sweep = sweep_of(study_of(ROCKER))
    assert not sweep.closed
    path = np.asarray(sweep.places["B"])
    order = in_order(sweep)
    assert set(order) | {0} == set(sweep.valid)
    assert max(abs(np.diff(path[order]))) < 0.5 * max(abs(np.diff(path[sweep.valid])))


def test_a_long_sweep_is_drawn_at_a_bounded_number_of_poses():
    sweep = sweep_of(study_of(FOUR_BAR, "kinematics.sweep={theta: {from: 0, to: 360, step: 0.01}}"))
    assert len(sweep.rows) == 2001
    assert (sweep.rows[0], sweep.rows[-1]) == (0, 36000)
    assert sweep.closed


@pytest.mark.slow
def test_listed_poses_are_drawn_one_by_one_and_have_no_curves():
    study = study_of(FOUR_BAR, "kinematics={poses: [{theta: 0}, {theta: 30}]}")
    assert names(study) == {"poses"}
    titles = [axes.get_title(loc="left") for axes in drawn(study, "poses").axes]
    assert titles == ["theta = 0 deg", "theta = 30 deg"]


@pytest.mark.nightly
def test_special_poses_say_what_is_special_and_their_arrows_are_to_scale():
    study = study_of(FOUR_BAR, "kinematics.rates={theta: 1 rad/s}", "kinematics.outputs=[A, rocker.angle]")
    figure = drawn(study, "poses")
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert sum(title.endswith("rocker reverses") for title in titles) == 2
    (legend,) = figure.legends
    words = {text.get_text().split(" ")[0]: text.get_text() for text in legend.get_texts()}
    key = dict(zip(words, legend.legend_handles, strict=True))
    for name, size, heading in (("velocity", 30, 1j), ("acceleration", 30, -1)):
        # A turns about O at 1 rad/s.
        for axes in figure.axes:
            (line,) = [line for line in axes.lines if line.get_label() == name]
            base, tip = line.get_xydata() @ [1, 1j]
            assert abs(tip - base) > 0
            np.testing.assert_allclose((tip - base) / abs(tip - base), heading * base / 30, atol=1e-9)
            pixels = np.hypot(*np.diff(axes.transData.transform(line.get_xydata()), axis=0)[0])
            length = np.diff(key[name].get_xdata())[0] * figure.dpi / 72
            assert pixels / length == pytest.approx(size / float(words[name].split(" ")[1]))
    assert key["velocity"].get_linestyle() == "-"
    assert key["acceleration"].get_linestyle() == "--"


@pytest.mark.slow
def test_a_limit_of_motion_is_a_special_pose_without_rates():
    poses = mechdesign.kinematics(study_of(ROCKER)).drawn.special
    limits = [each for each in poses.shown if each.event.startswith("limit of motion: dead centre")]
    assert len(limits) == 2
    for each in limits:
        rod, rocker = (each.configuration.rotation(link)[each.index] for link in ("rod", "rocker"))
        assert abs((rod * np.conj(rocker)).imag) < 1e-6
        assert np.isnan(each.velocities["B"])
    assert [each.place for each in poses.shown] == sorted(each.place for each in poses.shown)


@pytest.mark.slow
def test_a_stretched_arm_is_a_special_pose():
    arm = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 50], lower: [E, P, 30]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [30, 30], P: [10, 50]}
kinematics: {sweep: {q1: 30, q2: {from: -97, to: 200, step: 11}}, rates: {q2: 10}, outputs: [P]}
"""
    study = study_of(arm)
    poses = mechdesign.kinematics(study).drawn.special
    singular = [each for each in poses.shown if each.event == "singular: det_J is 0"]
    assert [each.place for each in singular] == pytest.approx([0, 180], abs=1e-8)
    assert drawn(study, "poses").texts[0].get_text() == "Singular poses, poses between"


def test_special_poses_of_one_configuration_are_shown_once():
    """The outer dead centre of an engine at 0 and 360 deg is one pose."""
    slider = FOUR_BAR.replace("rocker: [D, B, 60]", "rocker: {B: [0, 0]}").replace(
        "  drives:", "  joints: {guide: {prismatic: [ground, rocker]}}\n  drives:"
    )
    poses = mechdesign.kinematics(study_of(slider.replace("B: [75, 55]", "B: [85, 0]"))).drawn.special
    assert [each.place for each in poses.shown if each.event] == pytest.approx([0, 180])


@pytest.mark.nightly
def test_ticks_of_equal_time_are_equal_steps_of_the_drive():
    figure = drawn(study_of(FOUR_BAR, "kinematics.rates={theta: 60 rpm}"), "paths")
    (ticks,) = figure.axes[0].collections
    middles = np.array([path.vertices.mean(axis=0) @ [1, 1j] for path in ticks.get_paths()])
    path = sweep_of(study_of(FOUR_BAR)).places["C"]
    np.testing.assert_allclose(middles, path[:-1:3], atol=1e-9)
    assert [text.get_text() for text in figure.texts][1:] == ["four-bar O A B D: crank-rocker"]
    (ticks,) = figure.legends[0].get_texts()
    assert ticks.get_text() == "ticks every 0.0417 s (15 deg of theta); numbers: theta"
    # Of what speeds up equal steps are not equal times.
    faster = study_of(FOUR_BAR, "kinematics.rates={theta: 6}", "kinematics.accelerations={theta: 1}")
    assert drawn(faster, "paths").legends[0].get_texts()[-1].get_text() == "ticks every 15 deg of theta; numbers: theta"


@pytest.mark.nightly
def test_crank_angles_stand_beside_their_places_on_the_coupler_curve():
    (axes,) = drawn(study_of(FOUR_BAR), "paths").axes
    path = sweep_of(study_of(FOUR_BAR)).places["C"]
    numbers = {text.get_text(): text.xy for text in axes.texts if text.get_text().endswith("\N{DEGREE SIGN}")}
    assert len(numbers) > 6
    for angle, (x, y) in numbers.items():
        assert complex(x, y) == pytest.approx(path[int(angle[:-1]) // 5])


def test_a_path_passed_at_a_speed_has_the_time_on_its_axis():
    study = study_of(FIVE_BAR)
    with style.context():
        figure = figure_of(study, mechdesign.kinematics(study), "motion")
    axes = figure.axes[-1]
    assert axes.get_xlabel() == "time [s]"
    # Twelve places of a circle, and its end.
    times, rows = axes.lines[0].get_xdata(), np.arange(13) * 2 * np.pi * 20 / 12 / 50
    np.testing.assert_allclose(np.abs(times[:, None] - rows).min(axis=0), 0, atol=1e-9)
    assert times[-1] == pytest.approx(rows[-1])


@pytest.mark.slow
def test_plates_lie_below_the_paths_of_points_and_arrows_below_names():
    (axes,) = drawn(study_of(FOUR_BAR), "paths").axes
    plates = [patch.get_zorder() for patch in axes.patches if isinstance(patch, Polygon) and patch.get_closed()]
    paths = [line.get_zorder() for line in axes.lines if len(line.get_xdata()) == 73]
    assert plates
    assert max(plates) < min(paths)


def test_paths_of_several_points_of_a_link_have_colours_of_their_own():
    looks = {look.point: look for look in path_looks(sweep_of(study_of(FOUR_BAR, "kinematics.outputs=[A, B, C]")))}
    assert len({looks[point].color for point in "BC"}) == 2


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["jansen", "toggle_clamp"])
def test_a_picture_on_paper_is_no_taller_than_a_page(name):
    study = mechdesign.load(f"configs/gallery/{name}.yaml")
    with style.context("paper"):
        found = figures(study, mechdesign.kinematics(study))
        heights = [figure.get_figheight() for figure in found.values()]
    assert max(heights) * 0.8 * 25.4 < 231


def centrodes_of(study):
    result = mechdesign.kinematics(study)
    return centrodes(Sweep.of(result.drawn.shown), result.tables["instant_centres"])


@pytest.mark.parametrize("pair", ["[crank, rocker]", "[rod, ground]"])
def test_centrodes_touch_at_the_instant_centre_and_roll_without_slip(pair):
    fine = study_of(FOUR_BAR, "kinematics.sweep.theta.step=0.25", f"kinematics.instant_centres=[{pair}]")
    (found,) = centrodes_of(fine)
    k = found.pose
    assert found.on_fixed[k] == pytest.approx(found.centre)
    assert found.on_moving[k] == pytest.approx(found.centre)
    # A common tangent, and equal arcs: small chords are as long as they.
    tangents = [path[k + 1] - path[k - 1] for path in (found.on_fixed, found.on_moving)]
    assert abs((tangents[0] * np.conj(tangents[1])).imag) < 0.02 * abs(tangents[0] * tangents[1])
    near = slice(max(k - 60, 0), k + 60)
    arcs = [np.abs(np.diff(path[near])) for path in (found.on_fixed, found.on_moving)]
    np.testing.assert_allclose(*arcs, rtol=2e-3)


def test_the_centrodes_of_a_bar_on_two_guides_are_cardan_s_circles():
    (found,) = centrodes_of(mechdesign.load("configs/gallery/trammel.yaml"))
    np.testing.assert_allclose(np.abs(found.on_fixed), 60, rtol=1e-9)
    middle = (found.on_moving.max() + found.on_moving.min()) / 2
    box = found.on_moving
    assert [np.ptp(box.real), np.ptp(box.imag)] == pytest.approx([60, 60], rel=2e-2)
    assert abs(middle) < 60


def test_a_pin_has_no_centrodes():
    assert not centrodes_of(study_of(FOUR_BAR, "kinematics.instant_centres=[[crank, rod]]"))


RATES = ("kinematics.rates={theta: 60 rpm}", "kinematics.outputs=[A, B, C]")
ASKED = (*RATES, "kinematics.pictures=[polygons]")


def test_a_velocity_polygon_ends_at_the_velocities_of_the_table():
    study = study_of(FOUR_BAR, *ASKED)
    view = MotionView(study, mechdesign.kinematics(study))
    motion, shown = view.result.tables["motion"], view.drawn.special.shown
    for each in shown:
        if each.row % 1:
            continue
        for order, kind in enumerate(("velocity", "acceleration")):
            tips = {}
            for points in images(view, each, order).values():
                tips |= points
            assert tips["O"] == tips["D"] == 0
            for point in "ABC":
                row = int(each.row)
                parts = [motion[f"{point}.{axis}_{kind}"][row] for axis in "xy"]
                assert tips[point] == pytest.approx(complex(*parts))
            # Two points of a link: what one has against the other is across their line, or -omega^2 along it besides.
            arm = place_of(each, "B") - place_of(each, "A")
            along = ((tips["B"] - tips["A"]) * np.conj(arm)).real / abs(arm)
            wanted = (centripetal(each, "A", "B") * np.conj(arm)).real / abs(arm) if order else 0.0
            assert along == pytest.approx(wanted, abs=1e-9 * max(map(abs, tips.values())))


@pytest.mark.nightly
def test_polygons_are_drawn_where_they_are_asked_for():
    assert "polygons" in names(study_of(FOUR_BAR, *ASKED))
    assert "polygons" not in names(study_of(FOUR_BAR, *RATES))
    with pytest.raises(mechdesign.StudyError, match="polygons show velocities: give 'rates'"):
        study_of(FOUR_BAR, "kinematics.pictures=[polygons]")


@pytest.mark.nightly
def test_transmission_angles_stand_before_their_band_and_the_worst_is_marked():
    study = study_of(FOUR_BAR)
    (axes,) = drawn(study, "transmission").axes
    (band,) = axes.patches
    assert band.get_extents().transformed(axes.transData.inverted()).intervaly == pytest.approx((40, 140))
    curve = max(axes.lines, key=lambda line: len(line.get_xdata()))
    # By the law of cosines in the triangle of coupler, rocker and the line from A to D.
    square = 100**2 + 30**2 - 2 * 100 * 30 * np.cos(np.radians(curve.get_xdata()))
    wanted = np.degrees(np.arccos((90**2 + 60**2 - square) / (2 * 90 * 60)))
    np.testing.assert_allclose(curve.get_ydata(), wanted, atol=1e-9)
    worst = next(line for line in axes.lines if line.get_marker() == "o")
    assert worst.get_ydata() == pytest.approx([wanted[0]])
    assert worst.get_xdata() == [0]


@pytest.mark.nightly
def test_a_mechanical_advantage_without_bound_has_a_logarithmic_axis_and_its_place_is_marked():
    advantage = "kinematics.mechanical_advantage={rocker.angle: theta}"
    study = study_of(FOUR_BAR, advantage)
    result = mechdesign.kinematics(study)
    with style.context():
        figure = figure_of(study, result, "transmission")
    axes = figure.axes[1]
    assert axes.get_yscale() == "log"
    marks = [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    assert marks == pytest.approx(sorted(result.tables["toggles"]["theta"]))
    assert "rocker.angle_advantage" in result.tables["motion"]
    assert len(drawn(study, "motion").axes) == len(drawn(study_of(FOUR_BAR), "motion").axes)


@pytest.mark.slow
def test_every_assembly_has_a_panel_on_one_scale():
    figure = drawn(study_of(FOUR_BAR), "modes", all_modes=True)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert len(titles) == 2
    assert [title.endswith("(as drawn)") for title in titles] == [True, False]
    limits = {(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes}
    assert len(limits) == 1
    above, below = (max(np.max(line.get_ydata()) for line in axes.lines) for axes in figure.axes)
    assert above > below


@pytest.mark.parametrize(("place", "crosses"), [("[85, 58]", 0), ("[90, 75]", 1)])
def test_a_rough_sketch_is_shown_beside_the_assembled_one(place, crosses):
    study = study_of(FOUR_BAR.replace("[75, 55]", place))
    with style.context():
        picture = sketch_picture(study)
        figure = draw(picture)
    (axes,) = figure.axes
    marks = [line for line in axes.lines if line.get_marker() == "x"]
    assert sum(len(line.get_xdata()) for line in marks) == crosses
    assert ("crosses" in picture.title) == bool(crosses)
    if crosses:
        assert (marks[0].get_xdata()[0], marks[0].get_ydata()[0]) == (90, 75)


@pytest.mark.slow
def test_the_path_that_a_point_should_take_is_drawn_beside_its_own():
    wanted = [[10, 60], [30, 80], [50, 70]]
    study = study_of(FOUR_BAR.replace("  drives:", f"  targets: {{C: {wanted}}}\n  drives:"))
    (axes,) = drawn(study, "paths").axes
    assert any(np.array_equal(line.get_xydata(), wanted) for line in axes.lines)


@pytest.mark.parametrize("look", ["screen", "paper"])
def test_a_large_effort_has_a_unit_of_its_size(look):
    study = study_of(FOUR_BAR, "kinematics.loads=[{link: rocker, moment: 2e7}]")
    axes = drawn(study, "motion", look).axes[-1]
    assert axes.get_ylabel() == "effort [kN\N{MIDDLE DOT}m]"
    assert not axes.yaxis.offsetText.get_visible()


STROKES = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 40]
    rod: {from: A, to: B, length: 2070, points: {P: [1000, 10], Q: [900, 20], R: [500, 300], S: [400, 60]}}
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 20], B: [2100, 0]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 6}}
  outputs: [B.x, P, Q, R, S]
"""


def test_every_curve_is_drawn_and_none_is_flattened_by_the_others():
    figure = drawn(study_of(STROKES), "motion")
    names = [text.get_text() for axes in figure.axes for text in axes.get_legend().get_texts()]
    assert sorted(names) == sorted(["B.x", *(f"{point}.{c}" for point in "PQRS" for c in "xy")])
    for axes in figure.axes:
        assert not axes.get_legend().get_title().get_text()
        for line in axes.lines:
            assert np.ptp(line.get_ydata()) > 0.045 * np.ptp(axes.get_ylim())


def test_a_curve_of_two_names_is_drawn_once():
    study = study_of(FOUR_BAR.replace("C: [45, 40]", "E: [90, 0]"), "kinematics.outputs=[B, E]")
    labels = [line.get_label() for axes in drawn(study, "motion").axes for line in axes.lines]
    assert {"B.x, E.x", "B.y, E.y"} <= set(labels)


@pytest.mark.slow
@pytest.mark.parametrize("study", [FOUR_BAR, FIVE_BAR], ids=["four-bar", "five-bar"])
def test_polygons_on_paper_stay_on_the_page(study):
    rates = RATES if study == FOUR_BAR else ()
    asked = study_of(study, *rates, "kinematics.pictures=[polygons]")
    result = mechdesign.kinematics(asked)
    with style.context("paper"):
        figure = figure_of(asked, result, "polygons")
        style.encoded(figure)
        assert not [*faults(figure)]
        legend = figure.legends[0].get_window_extent()
        assert legend.x1 <= figure.bbox.x1


@pytest.mark.slow
def test_in_a_moving_picture_paths_are_seen_over_moving_plates():
    sweep = sweep_of(study_of(FOUR_BAR))
    look = next(look for look in path_looks(sweep) if look.point == "C")
    with style.context():
        figure = draw(Picture("", [drawn_plane(path_marks(sweep), sweep.extent, sweep.study, "a pose")]))
        (axes,) = figure.axes
        shown = frames_of(figure, sweep, sweep.valid[::9])
        across, up = axes.transData.transform(np.column_stack([look.path.real, look.path.imag])).round().astype(int).T
    color = 255 * np.array(to_rgb(look.color))
    for picture in shown:
        pixels = np.asarray(picture, dtype=float)[-1 - up, across]
        # Pins and bars alone cover the path.
        assert (np.abs(pixels - color).max(axis=1) < 60).mean() > 0.85


def test_axes_of_measures_have_their_names():
    """An expression has no unit that tells what it is, and a distance is no position."""
    measures = "measures: {lift: {expression: C.y - 20}, gap: {distance: [A, D]}}\n  sketch:"
    study = study_of(
        FOUR_BAR.replace("sketch:", measures),
        "kinematics.outputs=[C, lift, gap]",
        "kinematics.rates={theta: 6}",
    )
    labels = [axes.get_ylabel().replace("\n", " ") for axes in drawn(study, "motion").axes]
    assert {"position, gap [mm]", "lift", "velocity [mm/s]", "velocity of lift", "acceleration of lift"} <= {*labels}
    assert not [label for label in labels if label.startswith("value")]


def seen(figure, axes, place, color):
    """Whether pixels about a place of a panel (x, y in pixels) have a colour."""
    shown = np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255
    column, row = round(place[0]), len(shown) - round(place[1])
    return (np.abs(shown[row - 3 : row + 3, column - 3 : column + 3] - to_rgb(color)).max(axis=2) < 0.2).any()


def test_markers_at_the_ends_of_a_curve_are_whole():
    figure = drawn(study_of(FOUR_BAR, "kinematics.outputs=[C]"), "motion")
    axes = figure.axes[0]
    begin = axes.transData.transform(axes.get_lines()[0].get_xydata()[0])
    assert seen(figure, axes, begin - (4, 0), style.BLUE)  # left of the axis


@pytest.mark.slow
def test_centrodes_are_seen_above_the_links():
    study = study_of(FOUR_BAR, "kinematics.instant_centres=[[rod, ground]]")
    figure = drawn(study, "centrodes")
    (axes,) = figure.axes
    curve = next(line for line in axes.get_lines() if line.get_color() == style.VERMILION)
    names = [text.get_window_extent() for text in axes.texts]
    places = [
        place
        for place in axes.transData.transform(curve.get_xydata())
        if axes.bbox.padded(-6).contains(*place) and not any(name.padded(6).contains(*place) for name in names)
    ]
    assert len(places) > 10
    assert np.mean([seen(figure, axes, place, style.VERMILION) for place in places]) > 0.95


@pytest.mark.slow
def test_other_assemblies_have_names_and_paths_of_their_own():
    figure = drawn(study_of(FOUR_BAR), "modes", all_modes=True)
    assert len(figure.axes) == 2
    for axes in figure.axes:
        assert {text.get_text() for text in axes.texts} >= {"O", "A", "B", "C", "D"}
    ways = zip(*(axes.get_lines() for axes in figure.axes), strict=True)
    assert any(not np.allclose(one.get_xydata(), other.get_xydata()) for one, other in ways)


@pytest.mark.slow
def test_a_motion_that_ends_where_it_begins_is_drawn_in_its_only_pose() -> None:
    """Both legs lie along the line between their pivots, from which one of them gets too short for any pose."""
    legs = """
mechanism:
  links:
    ground: {A: [0, 0], B: [100, 0]}
    one: {from: A, to: P, telescopic: true}
    other: {from: B, to: P, telescopic: true}
  drives: {a: {length: one}, b: {length: other}}
  sketch: {P: [50, 40]}
kinematics: {sweep: {b: {from: 41, to: 30, number: 7}, a: 59}}
"""
    figure = drawn(mechdesign.load(text=legs), "paths")
    assert any(text.get_text() == "P" for text in figure.findobj(Text))
