"""What a quick or careless hand does on the live page, in a real browser."""

from __future__ import annotations

import math
import time

import pytest

try:
    from playwright.sync_api import expect
except ImportError:
    expect = None

pytestmark = pytest.mark.browser


@pytest.fixture
def slow(live):
    """A page whose positions take longer than a hand and its keys."""
    bar = live()
    move = bar.session.move

    def late(asked):
        time.sleep(0.06)
        return move(asked)

    bar.session.move = late
    bar.page.locator(".live-grid").fill("1")
    return bar


@pytest.mark.nightly
def test_the_end_of_a_quick_pull_at_a_cranks_pin_sets_angle_and_length(slow):
    drive = slow.page.get_by_role("spinbutton", name="theta deg")
    drive.fill("60")
    drive.blur()
    x, y = slow.middle("A")
    way = complex(math.cos(math.pi / 3), math.sin(math.pi / 3))
    target = 30 * way + 12 / slow.scale * way
    slow.page.mouse.move(x, y)
    slow.page.mouse.down()
    for k in range(1, 11):
        slow.page.mouse.move(x + 1.2 * k * way.real, y - 1.2 * k * way.imag)
        slow.page.wait_for_timeout(9)
    slow.page.wait_for_timeout(400)
    # The crank reaches the point of the grid that is nearest to the hand.
    reached = abs(complex(round(target.real), round(target.imag)))
    expect(slow.page.locator(".live-hand")).to_contain_text(f"crank.length = {reached:.2f} mm")
    slow.page.mouse.up()
    slow.answered(slow.page)
    assert slow.value("crank.length") == pytest.approx(reached, abs=0.02)


def test_within_four_pixels_of_its_circle_a_cranks_pin_turns_alone_and_says_how_its_length_is_changed(live):
    bar = live()
    x, y = bar.hold("A")
    bar.page.mouse.move(x + 3, y)
    expect(bar.page.locator(".live-hand")).to_contain_text("pull further across it for crank.length")
    assert bar.value("crank.length") == 30
    bar.page.mouse.move(x + 6, y)
    expect(bar.page.locator(".live-hand")).to_contain_text("crank.length = ")
    bar.page.mouse.up()
    bar.answered(bar.page)
    assert bar.value("crank.length") == pytest.approx(30 + 6 / bar.scale, abs=0.2)


@pytest.mark.nightly
def test_quick_presses_of_an_arrow_key_add_up_to_one_step_of_the_history(slow):
    slow.page.locator(".live-handle[data-at=D]").focus()
    for _ in range(6):
        slow.page.keyboard.press("ArrowRight")
    expect(slow.field("ground.D.x")).to_have_value("106")
    said = slow.said
    slow.page.keyboard.press("Control+z")
    expect(slow.field("ground.D.x")).to_have_value("100")
    # What was said of the drag holds no more.
    expect(said).to_have_text("Undone: ground.D.x = 100 mm")
    slow.page.keyboard.press("Control+y")
    expect(slow.field("ground.D.x")).to_have_value("106")
    expect(said).to_have_text("Redone: ground.D.x = 106 mm")
    slow.page.wait_for_timeout(1100)
    slow.page.locator(".live-handle[data-at=D]").focus()
    slow.page.keyboard.press("ArrowLeft")
    expect(slow.field("ground.D.x")).to_have_value("105")
    slow.page.keyboard.press("Control+z")
    expect(slow.field("ground.D.x")).to_have_value("106")


@pytest.mark.nightly
def test_where_a_pose_cannot_be_assembled_a_pivot_is_dragged_back(live):
    bar = live()
    # Rod and rocker reach 150 mm: with D 400 mm away no pose is left, and its ring stays where it was.
    bar.type("ground.D.x", "400")
    bar.drag("D", 10 * bar.scale, 0)
    assert bar.value("ground.D.x") == pytest.approx(110, abs=0.2)
    # At 170 mm the pin A at 60 deg is too far away, and rings of the nearest pose that can be assembled stay.
    drive = bar.page.get_by_role("spinbutton", name="theta deg")
    bar.type("ground.D.x", "170")
    drive.fill("170")
    drive.blur()
    expect(bar.page.locator(".moving-words")).to_contain_text("cannot be assembled")
    for point in "OADBP":
        assert bar.page.locator(f".live-handle[data-at={point}]").is_visible()
    x, y = bar.hold("B")
    bar.page.mouse.move(x - 10, y, steps=3)
    expect(bar.page.locator(".live-hand")).to_contain_text("rocker.length = ")
    bar.page.mouse.up()


@pytest.mark.nightly
def test_a_pivot_that_was_let_go_outside_the_drawing_is_brought_back_into_it(live):
    bar = live()
    frame = bar.page.locator("#kinematics-moving svg").first.bounding_box()
    _, y = bar.middle("D")
    bar.drag("D", 0, frame["y"] + frame["height"] + 30 - y)
    bar.page.wait_for_timeout(400)
    bar.answered(bar.page)
    frame = bar.page.locator("#kinematics-moving svg").first.bounding_box()
    _, y = bar.middle("D")
    assert frame["y"] < y < frame["y"] + frame["height"]


@pytest.mark.nightly
def test_what_was_saved_is_said_until_the_next_change_and_a_refused_save_leaves_the_mistake_told(live):
    bar = live()
    bar.type("rocker.length", "64")
    bar.press("Save into bar.yaml")
    with bar.page.expect_navigation():
        bar.press("Save")
    bar.answered(bar.page)
    said = bar.said
    expect(said).to_have_text("Saved into bar.yaml.")
    bar.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    bar.type("rocker.length", "66")
    expect(said).to_have_text("")
    bar.press("Copy as --set")
    expect(said).to_have_text("Copied one change as --set.")
    assert "rocker" in bar.page.evaluate("navigator.clipboard.readText()")
    bar.edit(bar.path.read_text().replace("[O, A, 30]", "[O, A, x30]"))
    message = bar.page.locator(".live-message")
    expect(message).to_contain_text("bar.yaml:")
    bar.press("Save into bar.yaml")
    bar.press("Save")
    expect(message).to_contain_text("Not saved: ")
    expect(message).to_contain_text("bar.yaml:")


@pytest.mark.nightly
def test_beside_a_finger_the_numbers_stand_above_left_and_cover_no_ring(live):
    bar = live(viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True)
    x, y = bar.middle("D")
    let_go = bar.touch("D", 10)
    expect(bar.page.locator(".live-hand")).to_contain_text("ground.D.x")
    box = bar.page.locator(".live-hand").bounding_box()
    right, bottom = box["x"] + box["width"], box["y"] + box["height"]
    assert right < x + 10 or box["x"] > x + 10
    assert bottom < y
    for point in "OABP":
        a, b = bar.middle(point)
        assert not (box["x"] < a < right and box["y"] < b < bottom)
    let_go()


@pytest.mark.nightly
def test_a_comma_stands_before_decimals_and_what_is_no_number_is_refused_with_a_message(live):
    bar = live()
    drawn, said = bar.field("ground.D.y"), bar.said
    drawn.select_text()
    drawn.press_sequentially("3,5")
    drawn.blur()
    bar.answered(bar.page)
    assert bar.value("ground.D.y") == 3.5
    drawn.press("ArrowUp")
    drawn.press("Shift+ArrowUp")
    assert bar.value("ground.D.y") == 14.5
    drawn.fill("1.234,5")
    drawn.blur()
    expect(said).to_have_text("1.234,5 is no number: write it as 3.5 or 3,5")
    assert bar.value("ground.D.y") == 14.5
    grid = bar.page.get_by_label("Grid")
    grid.fill("2,5")
    bar.page.locator(".live-handle[data-at=D]").focus()
    bar.page.keyboard.press("ArrowRight")
    expect(bar.field("ground.D.x")).to_have_value("102.5")
    grid.press("ArrowDown")
    grid.press("Shift+ArrowDown")
    expect(grid).to_have_value("0")
