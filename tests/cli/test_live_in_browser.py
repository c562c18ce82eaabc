"""The live page as hands use it, in a real browser (Debian: chromium-headless-shell)."""

from __future__ import annotations

import json
import math
import re
import urllib.request

import pytest
from helpers.axe import violations
from helpers.live_page import FOUR_BAR

from mechdesign import kinematics, load
from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.session import Session

try:
    from playwright.sync_api import expect
except ImportError:
    expect = None

pytestmark = pytest.mark.browser


def test_a_dragged_pivot_changes_the_study_that_is_saved_and_the_command_line_gives_the_same(live):
    bar = live()
    pixels = bar.scale
    bar.drag("D", 10 * pixels, 0)
    assert bar.value("ground.D.x") == pytest.approx(110, abs=0.2)
    shown = bar.page.locator("#kinematics .numbers").inner_text()
    copy = bar.save_as("longer.yaml")
    saved = load(copy)
    assert saved.sizes["ground.D.x"] == bar.value("ground.D.x")
    assert "# the pivots" in copy.read_text()
    angles = kinematics(saved).tables["extremes"]
    most = next(row["max"] for row in angles if row["output"] == "rocker.angle")
    assert f"to {most:.4g}" in shown
    # One gesture is one entry of the history.
    bar.press("Undo")
    assert bar.value("ground.D.x") == 100
    bar.press("Redo")
    assert bar.value("ground.D.x") == saved.sizes["ground.D.x"]


def test_the_numbers_that_a_drag_changes_are_named_beside_the_hand_and_a_locked_one_stays(live):
    bar = live()
    bar.page.get_by_label("lock rod.length").check()
    x, y = bar.hold("B")
    bar.page.mouse.move(x - 20, y - 5, steps=4)
    expect(bar.page.locator(".live-hand")).to_contain_text("rocker.length = ")
    assert "rod.length" not in bar.page.locator(".live-hand").inner_text()
    bar.page.mouse.up()
    bar.answered(bar.page)
    assert bar.value("rod.length") == 90
    assert bar.value("rocker.length") != 60


@pytest.mark.nightly
def test_keys_move_a_point_by_the_grid_and_what_cannot_be_assembled_is_said(live):
    bar = live()
    bar.page.locator(".live-grid").fill("5")
    bar.page.locator(".live-handle[data-at=D]").focus()
    bar.page.keyboard.press("ArrowRight")
    expect(bar.field("ground.D.x")).to_have_value("105")
    bar.page.wait_for_timeout(50)
    bar.page.keyboard.press("Shift+ArrowRight")
    expect(bar.field("ground.D.x")).not_to_have_value("105")
    # Rod and rocker reach 150 mm from the crank's pin, 30 mm from O along the line to D.
    assert 105 < bar.value("ground.D.x") <= 180
    for _ in range(4):
        bar.page.wait_for_timeout(100)
        bar.page.keyboard.press("Shift+ArrowRight")
    expect(bar.said).to_contain_text("cannot be assembled")


@pytest.mark.nightly
def test_a_number_in_a_field_and_a_slider_do_the_same_as_a_hand(live):
    bar = live()
    bar.type("rocker.length", "70")
    bar.page.get_by_label("rocker.length, slider").fill("66")
    bar.answered(bar.page)
    assert bar.value("rocker.length") == 66
    bar.press("Undo")
    assert bar.value("rocker.length") == 70
    bar.press("Reset")
    assert bar.value("rocker.length") == 60


@pytest.mark.nightly
def test_saving_into_the_file_asks_first_and_then_nothing_is_changed_any_more(live):
    bar = live()
    bar.drag("D", 10 * bar.scale, 0)
    bar.press("Save into bar.yaml")
    bar.press("Cancel")
    assert bar.path.read_text() == FOUR_BAR
    bar.press("Save into bar.yaml")
    with bar.page.expect_navigation():
        bar.press("Save")
    bar.answered(bar.page)
    assert load(bar.path).sizes["ground.D.x"] == pytest.approx(110, abs=0.2)
    assert "# the pivots" in bar.path.read_text()
    assert bar.value("ground.D.x") == load(bar.path).sizes["ground.D.x"]
    assert bar.page.locator(".live-number.changed").count() == 0


@pytest.mark.nightly
def test_a_saved_file_makes_the_page_anew_and_a_mistake_is_told_while_the_last_answer_stays(live):
    bar = live()
    bar.edit(FOUR_BAR.replace("[D, B, 60]", "[D, B, x60]"))
    expect(bar.page.locator(".live-message")).to_contain_text("bar.yaml:6:")
    assert bar.page.locator("#kinematics .numbers").count() == 1
    bar.drag("D", 5 * bar.scale, 0)
    assert bar.value("ground.D.x") == pytest.approx(105, abs=0.2)
    bar.page.get_by_role("slider", name="pose of the motion").fill("40")
    bar.edit(FOUR_BAR.replace("[D, B, 60]", "[D, B, 64]"))
    expect(bar.field("rocker.length")).to_have_value("64")
    bar.answered(bar.page)
    # What the hand has changed stays, as does the pose, and nothing is wrong any more.
    assert abs(int(bar.page.get_by_role("slider", name="pose of the motion").input_value()) - 40) <= 1
    assert bar.value("ground.D.x") == pytest.approx(105, abs=0.2)
    assert not bar.page.locator(".live-message").is_visible()


@pytest.mark.nightly
def test_a_finger_drags_on_a_narrow_dark_screen_and_nothing_leaves_the_page(live):
    bar = live(viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True, color_scheme="dark")
    bar.touch("D", 10)()
    bar.page.wait_for_selector(".live-number.changed")
    bar.answered(bar.page)
    assert bar.value("ground.D.x") > 101
    assert bar.page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.nightly
def test_two_pages_do_not_disturb_each_other(live, browser):
    bar = live()
    other = bar.open(browser)
    bar.drag("D", 10 * bar.scale, 0)
    assert bar.value("ground.D.x") == pytest.approx(110, abs=0.2)
    assert other.locator("[data-name='ground.D.x'] [role=spinbutton]").input_value() == "100"
    assert len(bar.server.waiting) == 2
    other.close()


@pytest.mark.nightly
def test_a_server_that_has_ended_is_told_and_what_was_changed_stays(live):
    bar = live()
    bar.drag("D", 10 * bar.scale, 0)
    port = bar.server.server_port
    bar.server.close()
    bar.press("Undo")
    expect(bar.page.locator(".live-message")).to_contain_text("does not answer")
    assert bar.value("ground.D.x") == 100
    # What the browser says of the server that is gone.
    bar.complaints.clear()
    bar.session.ended = False
    again = LiveServer(bar.session, port)
    again.token = bar.server.token
    again.start()
    bar.server = again
    bar.page.wait_for_selector(".live-message", state="hidden", timeout=30_000)
    bar.drag("D", 10 * bar.scale, 0)
    assert bar.value("ground.D.x") == pytest.approx(110, abs=0.2)
    bar.complaints.clear()


ARM = """\
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, A, 100], lower: [A, P, 80]}
  drives: {q1: {angle: upper}, q2: {angle: lower}}
  sketch: {A: [100, 0], P: [100, 80]}
workspace: {point: P}
"""


@pytest.mark.nightly
def test_a_robot_shows_its_workspace_and_follows_a_drive_that_stands_still(live):
    arm = live(ARM)
    arm.page.wait_for_selector("#workspace .live-pictures svg, #workspace .live-pictures img", timeout=60_000)
    area = arm.page.locator("#workspace .numbers").inner_text()
    # A ring between 20 and 180 mm: 100530 mm2.
    assert "100\N{NARROW NO-BREAK SPACE}5" in area.replace("\N{NO-BREAK SPACE}", "\N{NARROW NO-BREAK SPACE}")
    arm.type("q2_here", "0")
    assert arm.page.locator("#workspace .numbers").inner_text() == area
    # The study has no such entry.
    arm.press("Copy as --set")
    assert "q2" not in arm.said.inner_text()
    arm.drag("A", 10 * arm.scale, 0)
    assert arm.value("upper.length") != 100


TASK = """\
units: {length: mm, angle: deg}
synthesis:
  body:
    - {x: 0, y: 0, angle: 0}
    - {x: 19, y: 13, angle: 20}
    - {x: 46, y: 21, angle: 45}
    - {x: 67, y: 18, angle: 65}
    - {x: 89, y: -2, angle: 75}
"""


def test_a_task_opens_with_its_linkages_and_one_that_is_taken_over_is_dragged_and_saved(live):
    task = live(TASK)
    page = task.page
    page.wait_for_selector(".moving-grid button")
    box = page.locator(".live-handle[aria-label^='position 3']").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 + 4, box["y"] + box["height"] / 2, steps=3)
    expect(page.locator(".live-hand")).to_contain_text("position 3: 4")
    page.mouse.up()
    page.wait_for_selector("#synthesize .live-answer[aria-busy=true]")
    task.answered(page)
    moved = task.value("synthesis.body.2.x")
    assert 46 < moved < 60
    # A key turns the body, and undo takes that back.
    page.get_by_role("button", name="angle of position 3").press("ArrowLeft")
    assert task.value("synthesis.body.2.angle") == 46
    task.press("Undo")
    assert task.value("synthesis.body.2.angle") == 45
    page.wait_for_timeout(500)
    task.answered(page)
    page.locator(".moving-grid button").first.press("Enter")
    page.wait_for_selector("#kinematics .live-answer:not([aria-busy])", timeout=30_000)
    # The saved linkage passes the place that the hand gave.
    motion = kinematics(load(task.save_as("mine.yaml"))).tables["motion"]
    assert motion["P.x"][2] == pytest.approx(moved, abs=1e-4)
    page.get_by_role("link", name="the linkages of the task").click()
    page.wait_for_selector(".moving-grid button")
    assert task.value("synthesis.body.2.x") == moved


def test_axe_finds_no_fault_in_the_pages(live):
    bar = live()
    assert violations(bar.page) == []
    bar.press("Save as")
    assert violations(bar.page) == []


@pytest.mark.nightly
@pytest.mark.parametrize("text", [FOUR_BAR, TASK, ARM], ids=["four-bar", "task", "arm"])
def test_axe_finds_no_fault_in_narrow_dark_pages(live, text):
    page = live(text, viewport={"width": 390, "height": 800}, color_scheme="dark").page
    page.wait_for_selector("[aria-busy=true]", state="detached", timeout=60_000)
    assert violations(page) == []


@pytest.mark.nightly
def test_undo_goes_on_after_the_file_was_changed_in_an_editor_and_says_what_it_lost(live):
    bar = live()
    bar.drag("D", 10 * bar.scale, 0)
    moved = bar.value("ground.D.x")
    bar.type("rocker.length", "66")
    undo = bar.page.get_by_role("button", name="Undo")
    edited = FOUR_BAR.replace("[O, A, 30]", "[O, A, 33]")
    bar.edit(edited)
    expect(bar.field("crank.length")).to_have_value("33")
    assert (bar.value("ground.D.x"), bar.value("rocker.length")) == (moved, 66)
    undo.click()
    assert (bar.value("ground.D.x"), bar.value("rocker.length")) == (moved, 60)
    undo.click()
    assert (bar.value("ground.D.x"), bar.value("crank.length")) == (100, 33)
    assert undo.is_disabled()
    bar.press("Redo")
    bar.press("Redo")
    bar.edit(edited.replace("rocker: [D, B, 60]", "arm: [D, B, 60]").replace("rocker.", "arm."))
    expect(bar.said).to_contain_text("Undo goes on without rocker.length")
    assert bar.value("ground.D.x") == moved


@pytest.mark.nightly
def test_a_cranks_pin_turns_the_crank_and_a_button_shows_the_other_assembly(live):
    bar = live()
    pixels = bar.scale
    x, y = bar.hold("A")
    for angle in range(10, 61, 10):
        turned = math.radians(angle)
        bar.page.mouse.move(x + 30 * pixels * (math.cos(turned) - 1), y - 30 * pixels * math.sin(turned))
        expect(bar.page.locator(".live-hand")).to_contain_text(re.compile(rf"theta\W+=\W+{angle}\.|{angle - 1}\.[5-9]"))
    bar.page.mouse.up()
    bar.answered(bar.page)
    assert bar.value("crank.length") == 30
    bar.press("Other assembly")
    expect(bar.said).to_contain_text("assembly 2 of 2")
    bar.answered(bar.page)
    _, below = bar.middle("B")
    _, pivot = bar.middle("D")
    assert below > pivot
    bar.press("Copy as --set")
    expect(bar.said).to_contain_text("mechanism.sketch.B.1=-40.6")


@pytest.mark.nightly
def test_what_is_drawn_without_numbers_says_that_arrows_wait_for_the_hand_to_rest(live):
    bar = live()
    bar.page.get_by_label("Velocities").check()
    x, y = bar.hold("B")
    bar.page.mouse.move(x - 10, y, steps=3)
    expect(bar.page.get_by_label("Velocities")).to_be_disabled()
    bar.page.mouse.up()
    bar.answered(bar.page)
    expect(bar.page.get_by_label("Velocities")).to_be_checked()
    expect(bar.page.get_by_label("Velocities")).to_be_enabled()


@pytest.mark.nightly
@pytest.mark.parametrize(("motion", "moves"), [("reduce", False), ("no-preference", True)])
def test_pages_move_by_themselves_only_for_who_wants_motion(live, motion, moves):
    for text in (FOUR_BAR, TASK):
        page = live(text, reduced_motion=motion).page
        page.wait_for_selector("[aria-busy=true]", state="detached", timeout=60_000)
        slider = page.get_by_role("slider", name="pose of the motion")
        before = slider.input_value()
        page.wait_for_timeout(600)
        assert (slider.input_value() != before) is moves


@pytest.mark.nightly
def test_dead_centres_are_marked_along_the_motion_and_lead_there(live):
    bar = live()
    marks = bar.page.locator("datalist option").evaluate_all("options => options.map(option => Number(option.value))")
    assert len(marks) == 2
    bar.page.locator(".live-dead a").first.click()
    assert abs(float(bar.page.locator(".moving-controls input[type=range]").input_value()) - marks[0]) <= 1
    # Crank and rod are in line: A is 30 mm from O towards B, which is 120 mm away and 60 from D.
    angle = 29.926
    drive = bar.page.get_by_role("spinbutton", name="theta deg")
    assert f"theta = {angle:.1f}" in bar.page.locator(".moving-words").inner_text().replace("\xa0", " ")

    drive.fill("120")
    drive.blur()
    assert "theta = 120.0" in bar.page.locator(".moving-words").inner_text().replace("\xa0", " ")


def test_what_cannot_be_live(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    from mechdesign.door.cli.app import app

    monkeypatch.chdir(tmp_path)
    links = "{ground: {O: [0, 0], D: [100, 0]}, a: [O, A, 60], b: [D, A, 80]}"
    (tmp_path / "truss.yaml").write_text(f"mechanism: {{links: {links}, sketch: {{A: [36, 48]}}, drives: []}}\n")
    for words, arguments in (
        ("no file that could be saved", ["-"]),
        ("nothing is driven", ["truss.yaml"]),
    ):
        done = CliRunner().invoke(app, ["live", *arguments, "--no-browser"])
        assert done.exit_code == 2
        assert words in done.stderr


def test_the_server_answers_a_plain_client_within_one_connection(tmp_path):
    path = tmp_path / "bar.yaml"
    path.write_text(FOUR_BAR)
    server = LiveServer(Session(load(path)))
    server.start()
    try:
        body = {"version": 1, "page": "p", "turn": 1, "changes": {}, "poses": 1, "rows": "", "sheet": [0, 0, 1, 9, 9]}
        request = urllib.request.Request(f"{server.url}move", json.dumps(body).encode())
        with urllib.request.urlopen(request, timeout=20) as answer:
            assert json.load(answer)["names"] == []
    finally:
        assert server.close() == 0


def test_what_a_hand_has_changed_of_a_linkage_is_there_again_when_it_is_clicked_again(live):
    task = live(TASK)
    page = task.page
    page.locator(".moving-grid button").first.click()
    page.wait_for_selector("#kinematics .live-answer:not([aria-busy])", timeout=30_000)
    task.drag("A", 30, 20)
    names = page.locator(".live-number.changed").evaluate_all("rows => rows.map(row => row.dataset.name)")
    changed = {name: task.value(name) for name in names}
    assert changed
    page.get_by_role("link", name="the linkages of the task").click()
    page.wait_for_selector(".moving-grid button")
    assert [tile.endswith("changed") for tile in page.locator(".moving-grid button").all_inner_texts()].index(True) == 0
    page.locator(".moving-grid button").first.click()
    page.wait_for_selector("#kinematics .live-answer:not([aria-busy])", timeout=30_000)
    assert {name: task.value(name) for name in names} == changed
    expect(page.get_by_role("button", name="Undo")).to_be_enabled()


def test_locks_grid_and_curves_outlast_a_new_version_of_the_file_and_what_it_has_otherwise_is_told(live):
    bar = live()
    page, curves = bar.page, bar.page.locator("[data-chart] select")
    page.get_by_label("lock rod.length").check()
    page.locator(".live-grid").fill("5")
    curves.nth(0).select_option(index=2)
    bar.type("rocker.length", "50")
    bar.edit(bar.path.read_text().replace("[D, B, 60]", "[D, B, 62]"))
    expect(bar.said).to_contain_text("The file has rocker.length 62, yours 50 stays.")
    assert bar.value("rocker.length") == 50
    assert page.get_by_label("lock rod.length").is_checked()
    assert page.locator(".live-grid").input_value() == "5"
    assert curves.nth(0).input_value() == "2"
