"""The mechanism in the report: what the script is given is the motion of the tables, part by part."""

import dataclasses
import json
from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.gallery import FOLDER, result_of, study_named
from helpers.studies import study_of
from helpers.tracks import decoded

import mechdesign
from mechdesign import load
from mechdesign.door.report.page.frames import frames
from mechdesign.door.report.page.moving import moving
from mechdesign.door.report.page.tracks import PLACES, ROWS, TURNS, ShownNumbers, joined
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Table
from mechdesign.ground.table_text import readable
from mechdesign.questions.workspace.analysis import workspace


def places(data, point):
    """Places of a point in the drawing, whose y axis points down."""
    return decoded(data["x"][point], data["poses"], PLACES) + 1j * decoded(data["y"][point], data["poses"], PLACES)


def in_study(data, z):
    """Places of the drawing in the study's units."""
    return complex(*data["corner"]) + z.conj() / data["scale"]


@cache
def shown(name, *overrides):
    result = result_of(name, *overrides)
    return moving(study_named(name, *overrides), result), result


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["four_bar", "excavator", "rrr_platform", "jansen"])
def test_points_are_where_the_table_of_motion_has_them_within_half_a_step(name):
    part, result = shown(name)
    data, table = part.data, result.tables["motion"]
    error = 0.5 / PLACES / data["scale"]
    points = [column[:-2] for column in table.names if column.endswith(".x")]
    drawn, *_ = frames(result.drawn, table, ())
    rows = np.searchsorted(drawn.poses.numbers, np.arange(len(table)))
    for point in points:
        found = in_study(data, places(data, point))[rows]
        for axis, values in (("x", found.real), ("y", found.imag)):
            valid = table["valid"] == 1
            assert np.abs(values - table[f"{point}.{axis}"])[valid].max() <= 1.001 * error
            assert np.isnan(values[~valid]).all()
    assert points


def number(part, name):
    """A number beside the drawing, pose by pose."""
    decimals, steps = part.data["numbers"][dict(part.rows)[name][0].number]
    return decoded(steps, part.data["poses"], 10**decimals), 0.51 * 10**-decimals


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["four_bar", *(pytest.param(name, marks=pytest.mark.nightly) for name in ("slider_crank", "jansen", "whitworth"))],
)
def test_at_steps_of_45_degrees_pins_and_numbers_are_where_the_solver_has_them_between(name):
    step = 45 / 128
    part, _ = shown(name, "kinematics.sweep.crank.step=45")
    _, fine = shown(name, f"kinematics.sweep.crank.step={step}")
    table, data, size = fine.tables["motion"], part.data, study_named(name).mechanism.size
    rows = decoded(data["rows"], data["poses"], ROWS)
    crank = table["crank"][0] + np.sign(np.diff(table["crank"])[0]) * 45 * rows
    outputs = [column for column in table.names if column[-2:] in (".x", ".y")]
    assert outputs
    for output in outputs:
        # Straight from one pose to the next, as the script moves it.
        place = in_study(data, places(data, output[:-2]))
        turned = place.real if output[-1] == "x" else place.imag
        drawn = np.interp(table["crank"], *(np.flip(part) if crank[0] > crank[-1] else part
                                            for part in (crank, turned)))  # fmt: skip
        assert np.abs(drawn - table[output]).max() < 1e-3 * size + 1 / PLACES / data["scale"]
        values, rounding = number(part, output)
        assert values == pytest.approx(np.interp(crank, table["crank"], table[output]), abs=1.1 * rounding)


@pytest.mark.slow
def test_few_poses_become_no_more_than_a_drawing_needs():
    part, _ = shown("four_bar", "kinematics.sweep.crank.step=45")
    assert 9 < part.data["poses"] <= 130


def moved(data, group, places_of_parts):
    """Places of a part's own frame in the drawing, pose by pose; shape (places, poses)."""
    turn = np.exp(1j * np.radians(decoded(data["turn"][group.get("data-turn")], data["poses"], TURNS)))
    return places(data, group.get("data-at")) + turn * np.asarray(places_of_parts)[:, None]


def corners(path):
    return [complex(*map(float, step.split())) for step in path.get("d").lstrip("M").rstrip("z").split("L")]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four_bar", "jansen", "oldham", "whitworth"])
def test_a_rigid_part_stays_with_the_points_of_its_link(name):
    part, _ = shown(name)
    links = study_named(name).mechanism.description.links
    root = ElementTree.fromstring(part.drawing)
    met = 0
    for group in root.iterfind("./g[@data-turn]"):
        link = links[group.get("data-turn")]
        points = [*(link.ends or ()), *link.points]
        outline = group.find("path")
        if outline is None or len(points) < 2:
            continue
        ends = moved(part.data, group, corners(outline))
        for corner in ends[:, :] if outline.get("d").endswith("z") else ():
            assert min(np.abs(corner - places(part.data, point)).max() for point in points) < 0.15
            met += 1
        if not outline.get("d").endswith("z"):
            # The points of a bar lie on its line, wherever guides make it longer.
            along = (ends[1] - ends[0]) / np.abs(ends[1] - ends[0])
            for point in points:
                assert np.abs(((places(part.data, point) - ends[0]) * along.conj()).imag).max() < 0.15
                met += 1
    assert met


@pytest.mark.slow
@pytest.mark.parametrize(("name", "pin", "owner"), [("whitworth", "A", "arm"), ("scotch_yoke", "A", "yoke")])
def test_a_pin_stays_in_its_slot(name, pin, owner):
    part, _ = shown(name)
    root = ElementTree.fromstring(part.drawing)
    (slot,) = (group for group in root.iterfind(f"./g[@data-turn='{owner}']")
               if group.find("path") is not None and group.find("path").get("stroke") == "#ffffff")  # fmt: skip
    begin, end = moved(part.data, slot, corners(slot.find("path")))
    share = (places(part.data, pin) - begin) / (end - begin)
    assert np.abs(share.imag * np.abs(end - begin)).max() < 0.15
    assert share.real.min() > 0
    assert share.real.max() < 1


@pytest.mark.parametrize("name", ["scotch_yoke", "oldham"])
def test_names_of_points_do_not_overlap_in_the_first_pose(name):
    part, _ = shown(name)
    boxes = []
    for group in ElementTree.fromstring(part.drawing).iterfind("./g[@data-at]"):
        text = group.find("text")
        if text is not None and group.get("data-turn") is None:
            size = float(text.get("font-size"))
            middle = places(part.data, group.get("data-at"))[0] + complex(float(text.get("x", 0)), float(text.get("y")))
            boxes.append((middle, 0.6 * size * len(text.text), size))
    assert len(boxes) > 3
    for k, (place, wide, high) in enumerate(boxes):
        for other, other_wide, _ in boxes[:k]:
            apart = place - other
            assert abs(apart.real) >= (wide + other_wide) / 2 or abs(apart.imag) >= high


def test_numbers_and_velocities_are_those_of_the_table():
    part, result = shown("four_bar")
    data, table = part.data, result.tables["motion"]
    cells, places_along = dict(part.rows), decoded(data["rows"], data["poses"], ROWS)
    rows = np.searchsorted(places_along, np.arange(len(table)))
    assert part.headings == ["value", "velocity", "acceleration"]
    for row, cell, column in (("C.x", 0, "C.x"), ("C.y", 1, "C.y_velocity"), ("mu", 2, "mu_acceleration")):
        decimals, steps = data["numbers"][cells[row][cell].number]
        values = decoded(steps, data["poses"], 10**decimals)[rows]
        assert values == pytest.approx(table[column], abs=0.51 * 10**-decimals)
        assert float(cells[row][cell].text) == pytest.approx(table[column][0], abs=0.51 * 10**-decimals)
        assert cells[row][cell].unit.replace("²", "^2") == table.column(column).unit
    ((length, words), layer) = data["arrows"][0]["key"], data["arrows"][0]["layers"][0]
    assert not layer["on"]
    vx, vy = (way[rows] for way in way_of(data, "Velocities", "C"))
    scale = np.hypot(vx, vy).max() / np.hypot(table["C.x_velocity"], table["C.y_velocity"]).max()
    assert vx == pytest.approx(scale * table["C.x_velocity"], abs=1 / PLACES)
    assert vy == pytest.approx(-scale * table["C.y_velocity"], abs=1 / PLACES)
    assert length == pytest.approx(scale * float(words.split()[0]), rel=2e-3)


def way_of(data, title, words):
    """Components of an arrow of a drawing, whose y axis points down."""
    layers = [layer for group in data["arrows"] for layer in group["layers"] if layer["title"] == title]
    (parts,) = [way for layer in layers for name, _, way in layer["shafts"] if name == words]
    return [decoded(steps, data["poses"], PLACES) for steps in parts]


CRANK = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: {from: O, to: A, length: 100, mass: 2, center: [50, 0], inertia: 100}
  drives: {theta: {angle: crank}}
"""
MOTION = "{sweep: {theta: {from: 0, to: 360, step: 30}}, rates: {theta: 60 rpm}}"


def test_forces_move_with_the_linkage_and_are_right_between_the_rows():
    study = study_of(CRANK + f"dynamics: {MOTION}")
    part = moving(study, mechdesign.dynamics(study))
    data = part.data
    theta = np.radians(number(part, "theta")[0])
    # 2 kg at 50 mm turn at 2 pi rad/s: 3.95 N toward O; the pin pulls the crank so, and the frame is pulled away.
    force = 2 * 0.05 * (2 * np.pi) ** 2
    (group,) = (group for group in data["arrows"] if group["key"][1].endswith(" N"))
    length, words = group["key"]
    scale = length / float(words.split()[0])
    for title, name, sign in (
        ("Joint forces", "O on crank", -1),
        ("Inertia", "inertia", 1),
        ("Shaking force", "on the frame", 1),
    ):
        x, y = way_of(data, title, name)
        assert x == pytest.approx(sign * scale * force * np.cos(theta), abs=0.1)
        assert y == pytest.approx(-sign * scale * force * np.sin(theta), abs=0.1)
    (at,) = (at for layer in group["layers"] if layer["title"] == "Inertia" for _, at, _ in layer["shafts"])
    center = in_study(data, decoded(at[0], data["poses"], PLACES) + 1j * decoded(at[1], data["poses"], PLACES))
    assert center == pytest.approx(50 * np.exp(1j * theta), abs=0.1)
    # Between the poses it draws the arrow's tip is as near to its way as a pin is to its path.
    middle = np.exp(1j * (theta[1:] + theta[:-1]) / 2)
    x, y = way_of(data, "Inertia", "inertia")
    tip = x - 1j * y
    assert np.abs((tip[1:] + tip[:-1]) / 2 - scale * force * middle).max() < 0.6


def test_one_linkage_has_the_forces_of_dynamics_along_the_motion_of_kinematics():
    study = study_of(CRANK + f"kinematics: {MOTION}\ndynamics: {{gravity: [0, -9.81 m/s^2]}}")
    first, second = (
        dataclasses.asdict(moving(study, ask(study))) for ask in (mechdesign.kinematics, mechdesign.dynamics)
    )
    both = joined(first, second)
    assert first["data"]["course"] == second["data"]["course"]
    data = both["data"]
    theta = np.radians(
        decoded(data["numbers"][data["given"][0][2]][1], data["poses"], 10.0 ** data["numbers"][data["given"][0][2]][0])
    )
    x, y = way_of(data, "Weights", "weight")
    assert x == pytest.approx(0, abs=0.1)
    assert y == pytest.approx(y[0])
    assert y[0] > 5
    # m g r cos(theta), whatever the speed.
    (cell,) = (cells[0] for name, cells in both["rows"] if name == "theta_effort")
    decimals, steps = data["numbers"][cell["number"]]
    effort = decoded(steps, data["poses"], 10**decimals)
    assert effort == pytest.approx(2 * 9.81 * 50 * np.cos(theta), abs=2)
    assert sum(layer["title"] == "Velocities" for group in data["arrows"] for layer in group["layers"]) == 1


def test_time_goes_as_the_rates_have_it():
    # A crank at 1 rad/s takes 2 pi seconds; Jansen's turns against its sweep, at 60 rpm.
    crank, _ = shown("four_bar")
    assert crank.data["seconds"] == pytest.approx(2 * np.pi, abs=1e-3)
    assert not crank.data["backwards"]
    leg, _ = shown("jansen")
    assert leg.data["backwards"]
    assert "at the study's rates 1 s" in leg.data["pace"]
    for part in (crank, leg):
        times, (turned, rounding) = decoded(part.data["times"], part.data["poses"] + 1)[:-1], number(part, "crank")
        assert times / 10000 * 360 == pytest.approx(turned, abs=rounding + 0.02)


@pytest.mark.nightly
def test_poses_that_cannot_be_assembled_are_said():
    part, result = shown("rrr_platform")
    bad = np.flatnonzero(result.tables["motion"]["valid"] == 0)
    first, last = np.searchsorted(frames(result.drawn, result.tables["motion"], ())[0].poses.numbers, bad[[0, -1]])
    ((begin, end, why),) = part.data["gaps"]
    assert (begin <= first, end >= last, why) == (True, True, "cannot be assembled here")
    # To the limit, which lies between two poses of the table.
    rows = decoded(part.data["rows"], part.data["poses"], ROWS)
    assert bad[0] - 1 < rows[begin - 1] < rows[begin] <= bad[0]


@pytest.mark.slow
def test_a_motion_of_361_poses_is_small_and_the_same_again():
    part, _ = shown("jansen", "kinematics.sweep.crank.step=1")
    again, _ = shown.__wrapped__("jansen", "kinematics.sweep.crank.step=1")
    assert part == again
    assert len(part.drawing) + len(part.beside) + len(json.dumps(part.data)) < 200_000


@pytest.mark.nightly
def test_in_a_workspace_every_pose_keeps_the_links_and_has_its_numbers_from_the_table():
    study = load(FOLDER.parent / "five_bar.yaml")
    result = workspace(study)
    part = moving(study, result)
    (data,) = part.data["choices"]
    assert data["poses"] > 900
    for link in study.mechanism.description.links.values():
        if link.ends:
            one, two = (places(data, end) for end in link.ends)
            lengths = np.abs(one - two)
            assert np.ptp(lengths) < 3 / PLACES
    local, cells = result.tables["local"], dict(part.rows)
    found = in_study(data, places(data, "C"))
    # At the tips of a region several nodes lie within a step of the places.
    far = np.abs((local["x"] + 1j * local["y"])[:, None] - found)
    for name in ("inverse_condition", "sigma_min"):
        decimals, steps = data["numbers"][cells[name][0].number]
        values = decoded(steps, data["poses"], 10**decimals)
        off = np.where(far < 1 / PLACES / data["scale"], np.abs(local[name][:, None] - values), np.inf).min(axis=0)
        assert off.max() <= 0.51 * 10**-decimals


def test_listed_poses_do_not_move():
    study = study_named("path_synthesis")
    assert moving(study, result_of("path_synthesis")) is None


@pytest.mark.slow
def test_a_design_that_is_judged_by_its_stiffness_alone_does_not_move() -> None:
    study = study_of("""
mechanism:
  parameters: {r: 100}
  links: {ground: {O: [0, 0]}, arm: [O, P, r]}
  drives: [arm]
stiffness: {at: P, actuators: {arm: 1000 N*m/rad}, poses: [{arm: 0}]}
optimize: {variables: {r: {from: 80, to: 120, step: 20}}, maximize: [stiffness.k_y.min]}
""")
    assert moving(study, mechdesign.optimize(study)) is None


def test_a_page_runs_over_the_time_of_the_motion() -> None:
    for factor, seconds in ((1, 5.0), (4, 3.2)):
        cycle = f"{{to: 90, time: {0.3 * factor}}}, {{dwell: {0.1 * factor}}}, {{to: 0, time: {0.4 * factor}}}"
        study = mechdesign.load(
            text=f"""
mechanism:
  links: {{ground: {{O: [0, 0], D: [100, 0]}}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0, 30], B: [75, 55]}}
kinematics: {{motion: {{theta: [{cycle}]}}, outputs: [B]}}
"""
        )
        page = moving(study, mechdesign.kinematics(study))
        assert page is not None
        assert "in the study's motion" in page.data["pace"]
        # A motion too short to be watched is slowed down, and the page says so.
        assert page.data["seconds"] == seconds


def test_numbers_at_a_pose_are_written_as_key_numbers_are() -> None:
    # Unlike a part in ten thousand of a 1/mm^2, one in a thousand million has a power of ten; what is rounding is 0.
    table = Table("local", [
        Column("resistivity", np.array([1.449e-4, 2e-4]), "1/mm^2"), Column("tiny", np.array([1.449e-9, 2e-9]), "1/mm"),
        Column("efficiency", np.array([6.7e-15, 2.5e-14]), ""),
    ])  # fmt: skip
    numbers = ShownNumbers(table, np.arange(2), 0, (0.0, ""))
    cells = [numbers.cell(column) for column in table.columns]
    assert [(cell.text, cell.unit) for cell in cells[:2]] == [
        ("0.0001449", "1/mm\N{SUPERSCRIPT TWO}"),
        ("1.449", "\N{MIDDLE DOT}10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT NINE} 1/mm"),
    ]
    assert (float(cells[2].text), cells[2].unit) == (0.0, "")
    assert [column.cells for column in readable(table.columns, table.columns)][2] == ["0", "0"]


def test_targets_and_paths_of_points_lie_on_the_plates_and_below_the_pins():
    text = """\
mechanism:
  links: {ground: {O: [0, 0]}, arm: {O: [0, 0], Q: [40, 0], P: [30, 25]}}
  drives: [arm]
  targets: {P: [[30, 25], [0, 40], [-30, -25]]}
kinematics: {path: {arm: [0, 60, 180]}, outputs: [P]}
"""
    study = load(text=text)
    part = moving(study, mechdesign.kinematics(study), handled=True)
    root = ElementTree.fromstring(part.drawing)
    (goals,) = (path for path in root if path.get("class") == "moving-goals")
    dots = [complex(*map(float, dot.removesuffix("h0").split())) for dot in goals.get("d").split("M")[1:]]
    corner, scale = complex(*part.data["corner"]), part.data["scale"]
    assert [corner + dot.conjugate() / scale for dot in dots] == pytest.approx([30 + 25j, 40j, -30 - 25j], abs=0.05)
    order = list(root)
    plates = [k for k, part in enumerate(order) if any(inner.get("d", "").endswith("z") for inner in part)]
    traces = [k for k, part in enumerate(order) if part.get("class") == "moving-trace"]
    pins = [k for k, part in enumerate(order) if any(inner.tag == "circle" for inner in part)]
    assert max(plates) < min(traces) < max(traces) < order.index(goals) < min(pins)
