"""The moving mechanism of a report as a person uses it, in a real browser (Debian: chromium-headless-shell)."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.axe import violations
from helpers.pictures import figure_of

from mechdesign import load
from mechdesign.door.report.page.frames import frames
from mechdesign.door.report.page.headlines import headlines
from mechdesign.door.report.page.page import AnsweredQuestion, report
from mechdesign.door.report.page.printing import pdf
from mechdesign.door.report.page.section import section
from mechdesign.door.report.page.vector import picture
from mechdesign.door.report.requirements import requirements
from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.pictures import figures
from mechdesign.experiments.sweep import sweep
from mechdesign.questions.dynamics.analysis import dynamics
from mechdesign.questions.kinematics.analysis import kinematics
from mechdesign.questions.optimize.analysis import optimize
from mechdesign.questions.reliability.analysis import reliability
from mechdesign.questions.stiffness.analysis import stiffness
from mechdesign.questions.synthesize.analysis import synthesize
from mechdesign.questions.workspace.analysis import workspace

try:
    from playwright.sync_api import expect
except ImportError:
    expect = None

CONFIGS = Path(__file__).parents[2] / "configs"
# Of a sweep; of the first the last cannot be built.
LONGEST = "matrix={vary: {mechanism.parameters.l: [5, 4, 6]}, best: {maximize: [kinematics.extremes.B.x.max]}}"
FEW_CASES = ("matrix={vary: {mechanism.parameters.l: [5, 4, -1]}, results: [kinematics.extremes.B.x.range]}",)
PIXELS = 0.2  # of the drawing: a step of the places and of the angles that the page has

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def answers():
    """Results of a few questions, by study."""
    found = {}
    for name, command, *overrides in (
        ("gallery/slider_crank", kinematics), ("gallery/rrr_platform", kinematics), ("five_bar", workspace),
        ("gallery/four_bar", kinematics, "kinematics.sweep.crank.step=45"),
        ("gallery/straight_line_front", optimize, "optimize.evaluations=200"),
        ("gallery/offset_slider_crank", sweep, *FEW_CASES), ("best_case", sweep, LONGEST, "requirements=[]"),
        ("gallery/twin_cylinder", dynamics, "dynamics.sweep.crank.step=30"), ("gallery/five_positions", synthesize),
    ):  # fmt: skip
        study = load(CONFIGS / f"{STUDIES.get(name, name)}.yaml", overrides)
        found[Path(name).name] = study, command(study)
    return found


STUDIES = {"best_case": "gallery/offset_slider_crank"}
# Pictures that are in a study's report, beside what moves.
PICTURES = {"four_bar": ("transmission", "paths"), "five_bar": ("inscribed",)}


def drawn(study, result, names):
    """Pictures of a result as they stand in a page."""
    with style.context():
        return {name: picture(figure_of(study, result, name), f"{result.command}-{name}", name) for name in names}


@pytest.fixture(scope="module")
def reports(answers, tmp_path_factory):
    """A folder with the reports of these, with few pictures."""
    folder = tmp_path_factory.mktemp("reports")
    for name, (study, result) in answers.items():
        part, warnings = section(study, result, drawn(study, result, PICTURES.get(name, ())), "", (), plots=True)
        assert warnings == ()
        verdicts = requirements(study, result)
        (folder / f"{name}.html").write_bytes(
            report(study, [AnsweredQuestion(result.command, "done", 0, verdicts=verdicts, section=part)], below=False)
        )
    return folder


@pytest.fixture
def opened(browser, reports):
    """Open a study's report; at the end nothing was asked of the network, and nothing complained."""
    pages, complaints = [], []

    def look(name, width=1400, height=900, *, plays=False, **options):
        # A page that need not play is still from the start.
        motion = "no-preference" if plays else "reduce"
        page = browser.new_page(viewport={"width": width, "height": height}, reduced_motion=motion, **options)
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda request: complaints.append(request.url)
                if not request.url.startswith(("file://", "data:")) else None)  # fmt: skip
        page.goto((reports / f"{name}.html").as_uri())
        pages.append(page)
        return page

    yield look
    for page in pages:
        page.close()
    assert complaints == []


def rows_of(answers, name):
    return list(answers[name][1].tables["motion"])


def poses_of(answers, name):
    """Places of the poses that a page draws, in rows of the table of motion."""
    result = answers[name][1]
    marked = [number.place for number in headlines(result) if number.place is not None]
    drawn, *_ = frames(result.drawn, result.tables["motion"], marked)
    return drawn.poses.numbers.tolist()


def words(page):
    return page.locator(".moving-words").inner_text().replace("\N{NO-BREAK SPACE}", " ")


def place(page, point):
    """Where the joint of a point stands in the drawing, in the study's units."""
    transform = page.locator(f".moving [data-at={point}]:has(circle)").get_attribute("transform")
    x, y = map(float, re.match(r"translate\((\S+) (\S+)\)", transform).groups())
    data = page.evaluate("() => { const d = JSON.parse(document.querySelector('.moving script').textContent);"
                         " return (d.choices || [d])[0]; }")  # fmt: skip
    return data["corner"][0] + x / data["scale"], data["corner"][1] - y / data["scale"], PIXELS / data["scale"]


@pytest.mark.parametrize(
    "name",
    ["four_bar", *(pytest.param(name, marks=pytest.mark.nightly) for name in (
        "five_bar", "straight_line_front", "best_case", "twin_cylinder", "five_positions"))],
)  # fmt: skip
def test_axe_finds_no_fault_in_a_report(opened, name):
    assert violations(opened(name)) == []


def test_slider_and_keys_bring_the_pin_to_where_the_table_has_it(opened, answers):
    page, rows, poses = opened("slider_crank"), rows_of(answers, "slider_crank"), poses_of(answers, "slider_crank")
    slider = page.get_by_role("slider", name="pose of the motion")

    def at(row):
        x, _, error = place(page, "B")
        assert x == pytest.approx(rows[row]["B.x"], abs=error)
        assert slider.input_value() == str(poses.index(row))
        assert f"crank = {rows[row]['crank']:.1f} deg" in words(page)
        assert float(page.locator("tr:has(th:text-is('B.x')) td span").first.inner_text()) == pytest.approx(
            rows[row]["B.x"], abs=1e-3)  # fmt: skip

    at(0)
    slider.fill(str(poses.index(20)))
    at(20)
    for key, row in (("ArrowRight", 21), ("End", len(rows) - 1), ("Home", 0)):
        slider.press(key)
        at(row)
    assert page.get_by_label("Velocities").is_checked() is False
    page.get_by_label("Velocities").check()
    assert page.locator(".moving svg path[d*='m']").last.is_visible()


def test_between_poses_45_degrees_apart_the_crank_keeps_its_length_and_its_angle_is_that_in_words(opened):
    page = opened("four_bar", plays=True)
    slider = page.get_by_role("slider")
    angles = set()

    def look():
        # Words and drawing at one moment: a crank of length 1 about the origin.
        at, text, x, y = page.evaluate("""() => {
            const data = JSON.parse(document.querySelector(".moving script").textContent);
            const pin = document.querySelector(".moving [data-at=A]:has(circle)").getAttribute("transform");
            const [x, y] = pin.match(/[-.0-9]+/g).map(Number);
            return [document.querySelector(".moving input").value, document.querySelector(".moving-words").textContent,
                    data.corner[0] + x / data.scale, data.corner[1] - y / data.scale];
        }""")
        angle = float(re.search(r"crank\s=\s(\S+)\sdeg", text)[1])
        assert abs(complex(x, y) - np.exp(1j * np.radians(angle))) < 0.005
        angles.add(angle)
        return int(at)

    last = int(slider.get_attribute("max"))
    assert last > 8
    for pose in range(last, -1, -4):
        slider.fill(str(pose))
        assert look() == pose
    count = len(angles)
    page.get_by_label("Speed").select_option("4")
    page.get_by_role("button", name="Play").click()
    while look() < last // 2:
        page.wait_for_timeout(20)
    assert len(angles) > count + 5


def test_a_key_number_brings_the_mechanism_to_the_pose_where_it_occurs(opened, answers):
    page, result = opened("four_bar"), answers["four_bar"][1]
    number = next(number for number in headlines(result) if number.label == "largest velocity of C.x")
    page.get_by_role("button", name="Play").click()
    page.locator("dl.numbers div", has_text=number.label).get_by_role("link").click()
    page.get_by_role("button", name="Play").wait_for()
    assert page.locator(".moving svg").first.is_visible()
    assert f"crank = {number.pose['crank']:.1f} deg" in words(page)
    cells = page.locator(".moving-numbers tr:has(th:text-is('C.x')) td span").all_inner_texts()
    assert abs(float(cells[1])) == pytest.approx(float(number.value), abs=2e-4)
    # The crank is 1 long, and turns about the origin.
    x, y, error = place(page, "A")
    assert abs(complex(x, y) - np.exp(1j * np.radians(number.pose["crank"]))) < 2 * error


@pytest.mark.parametrize("end", [40, 360])
def test_a_pose_of_another_question_is_a_link_where_the_motion_passes_it(opened, reports, end):
    sweep = f"kinematics.sweep={{crank: {{from: 0, to: {end}, step: 8}}}}"
    study = load(CONFIGS / "gallery" / "slider_crank_tolerances.yaml", [sweep, "reliability.methods=[analytic]"])
    parts = [section(study, ask(study), {}, "", (), plots=True)[0] for ask in (kinematics, reliability)]
    told = [AnsweredQuestion(part["command"], "done", 0, section=part) for part in parts]
    (reports / "both.html").write_bytes(report(study, told, below=True))
    page = opened("both")
    link = page.locator("dl.numbers div", has_text="failure probability").locator("a")
    assert link.inner_text().replace("\N{NO-BREAK SPACE}", " ") == "at crank = 60 deg"
    if end == 360:
        link.click()
        assert "crank = 60.0 deg" in words(page)
    else:
        assert link.get_attribute("href") is None


@pytest.mark.parametrize("name", ["slider_crank", "straight_line_front", "best_case"])
def test_it_moves_when_the_page_opens_and_stops_by_a_key(opened, name):
    page = opened(name, plays=True)
    slider = page.locator(".stage").get_by_role("slider")
    expect(slider).to_have_value(re.compile(r"[4-9]|\d\d"))
    page.get_by_role("button", name="Pause").press("Enter")
    page.get_by_role("button", name="Play").wait_for()
    stopped = slider.input_value()
    page.wait_for_timeout(150)
    assert slider.input_value() == stopped


def test_of_a_workspace_it_goes_through_the_region_until_the_reader_moves_it(opened):
    page = opened("five_bar", plays=True)
    begin = place(page, "C")
    page.wait_for_timeout(100)
    assert 0 < abs(place(page, "C")[0] - begin[0]) < 100
    page.locator(".moving-map").press("ArrowUp")
    page.get_by_role("button", name="Play").wait_for()
    still = words(page)
    page.wait_for_timeout(150)
    assert words(page) == still


def test_who_wants_no_motion_sees_a_still_linkage_and_steps_on_request(opened):
    page = opened("slider_crank")
    page.wait_for_timeout(150)
    assert page.get_by_role("slider").input_value() == "0"
    page.get_by_role("button", name="Play").click()
    page.wait_for_timeout(300)
    assert page.get_by_role("slider").input_value() == "0"
    expect(page.get_by_role("slider")).not_to_have_value("0")
    # Of 24 steps a round.
    assert float(re.search(r"crank = (\S+) deg", words(page))[1]) % 15 == 0


def test_a_click_in_the_curves_chooses_the_pose(opened, answers):
    page, rows, poses = opened("slider_crank"), rows_of(answers, "slider_crank"), poses_of(answers, "slider_crank")
    curves = page.locator(".moving-beside svg")
    box = curves.bounding_box()
    curves.click(position={"x": 0.5 * box["width"], "y": 0.3 * box["height"]})
    row = int(poses[int(page.get_by_role("slider").input_value())])
    cursor = float(curves.locator(".moving-cursor").first.get_attribute("x1"))
    wide = float(curves.get_attribute("viewBox").split()[2])
    assert cursor == pytest.approx(0.5 * wide, abs=0.01 * wide)
    assert 0 < row < len(rows) - 1
    assert place(page, "B")[0] == pytest.approx(rows[row]["B.x"], abs=place(page, "B")[2])


def test_poses_that_cannot_be_assembled_are_said_and_not_drawn(opened, answers):
    page, rows = opened("rrr_platform"), rows_of(answers, "rrr_platform")
    bad = poses_of(answers, "rrr_platform").index(next(k for k, row in enumerate(rows) if not row["valid"]))
    page.get_by_role("slider").fill(str(bad))
    assert "cannot be assembled here" in words(page)
    assert page.locator(".moving [data-at=P]:has(circle)").is_hidden()
    page.get_by_role("slider").fill(str(bad - 1))
    assert page.locator(".moving [data-at=P]:has(circle)").is_visible()


def test_in_a_workspace_the_mechanism_follows_pointer_and_keys(opened):
    page = opened("five_bar")
    drawing = page.locator(".moving-map")
    box = drawing.bounding_box()
    for share in (0.4, 0.5, 0.6):
        drawing.hover(position={"x": share * box["width"], "y": 0.3 * box["height"]})
        pin, box = page.locator(".moving [data-at=C]:has(circle)").bounding_box(), drawing.bounding_box()
        gap = complex(pin["x"] + pin["width"] / 2 - box["x"], pin["y"] + pin["height"] / 2 - box["y"])
        assert abs(gap - complex(share * box["width"], 0.3 * box["height"])) < 0.02 * box["width"]
    before = place(page, "C")
    drawing.press("ArrowLeft")
    after = place(page, "C")
    assert after[0] < before[0]
    assert f"C.x = {after[0]:.1f}"[:-2] in words(page)


def test_an_index_says_what_it_is(opened):
    page = opened("five_bar")
    meaning = "smallest over largest singular value of the Jacobian"
    number = page.locator("dl.numbers div", has_text="mean inverse_condition")
    assert f"mean over the region: {meaning}" in number.inner_text()
    assert meaning in page.locator(".moving-numbers th", has_text="inverse_condition").inner_text()


def test_one_cursor_goes_through_every_picture(opened):
    page = opened("four_bar")
    page.get_by_role("slider").press("Home")
    link = page.locator(".required a[data-pose]")
    assert link.inner_text() == "crank 0"

    def cursors():
        return page.evaluate("""() => [...document.querySelectorAll("svg[data-axes]")].flatMap(svg =>
            JSON.parse(svg.dataset.axes).filter(axes => axes[0] === "crank [deg]").map((axes, k) => {
                const at = Number(svg.querySelectorAll(".moving-cursor")[k].getAttribute("x1"));
                return axes[5] + (axes[6] - axes[5]) * (at - axes[1]) / (axes[2] - axes[1]);
            }))""")  # fmt: skip

    def dots():
        return page.evaluate("""() => [...document.querySelectorAll(".moving-dot")].map(dot => {
            const axes = JSON.parse(dot.closest("svg").dataset.axes)[0];
            const [left, right, top, bottom, west, east, south, north] = axes.slice(1);
            const at = name => Number(dot.getAttribute(name));
            return [west + (east - west) * (at("cx") - left) / (right - left),
                    south + (north - south) * (bottom - at("cy")) / (bottom - top)];
        })""")  # fmt: skip

    page.get_by_role("radio", name="transmission").check()
    transmission = page.locator("#kinematics .pictures svg[aria-label=transmission]")
    box = transmission.bounding_box()
    transmission.hover(position={"x": 0.6 * box["width"], "y": 0.4 * box["height"]})
    angle = float(re.search(r"crank = (\S+) deg", words(page))[1])
    found = cursors()
    assert len(found) > 3
    assert found == pytest.approx([angle] * len(found), abs=0.4)
    assert 150 < angle < 300
    # The coupler point in the picture of the paths is where the moving mechanism has it.
    (dot,), (x, y, error) = dots(), place(page, "C")
    assert abs(complex(*dot) - complex(x, y)) < 2 * error
    link.click()
    assert cursors() == pytest.approx([0.0] * len(found), abs=0.4)


def test_a_drag_on_the_linkage_moves_its_nearest_point(opened):
    page = opened("four_bar")
    pin = page.locator(".moving [data-at=A]:has(circle)").bounding_box()
    drawing = page.locator(".moving svg").first.bounding_box()
    data = page.evaluate("() => JSON.parse(document.querySelector('.moving script').textContent)")
    page.mouse.move(pin["x"] + pin["width"] / 2, pin["y"] + pin["height"] / 2)
    page.mouse.down()
    # To where the crank, 1 long about the origin, points up.
    scale = drawing["width"] / page.evaluate("() => document.querySelector('.moving svg').viewBox.baseVal.width")
    up = (data["corner"][1] - 1) * data["scale"] * scale
    page.mouse.move(drawing["x"] - data["corner"][0] * data["scale"] * scale, drawing["y"] + up, steps=4)
    page.mouse.up()
    assert float(re.search(r"crank = (\S+) deg", words(page))[1]) == pytest.approx(90, abs=3)


def test_between_rows_of_the_table_pins_are_where_the_solver_has_them(opened, answers):
    page, poses = opened("four_bar"), poses_of(answers, "four_bar")
    slider, angles = page.get_by_role("slider"), [45 * each for each in poses[1::5]]
    assert any(each % 45 for each in angles)
    fine = load(
        CONFIGS / "gallery" / "four_bar.yaml",
        ["kinematics.sweep=null", f"kinematics.poses={json.dumps([{'crank': each} for each in angles])}"],
    )
    rows = list(kinematics(fine).tables["motion"])
    for number, row in zip(range(1, len(poses), 5), rows, strict=True):
        slider.fill(str(number))
        x, y, error = place(page, "C")
        assert abs(complex(x, y) - complex(row["C.x"], row["C.y"])) < error
    rows = rows_of(answers, "four_bar")
    assert len(rows) == 9
    for number, row in enumerate(rows):
        slider.fill(str(poses.index(number)))
        x, y, error = place(page, "C")
        assert abs(complex(x, y) - complex(row["C.x"], row["C.y"])) < error


def test_forces_move_with_the_linkage_and_can_be_hidden(opened, answers):
    page = opened("twin_cylinder")
    table = answers["twin_cylinder"][1].tables["joint_forces"]

    def arrow(words):
        found = page.locator(f"path:has(title:text-is('{words}'))").first
        steps = re.findall(r"-?[\d.]+", found.get_attribute("d"))
        begin, end = complex(*map(float, steps[:2])), complex(*map(float, steps[-2:]))
        return begin, end - begin

    slider = page.locator(".moving input[type=range]")
    slider.evaluate("e => { e.value = 0; e.dispatchEvent(new Event('input')); }")
    begin, first = arrow("Joint forces: O on crank")
    row = (table["joint"] == "O") & (table["crank"] == 0)
    force = complex(table["fx"][row][0], -table["fy"][row][0])
    assert np.angle(first / force) == pytest.approx(0, abs=0.01)
    slider.evaluate("e => { e.value = 5; e.dispatchEvent(new Event('input')); }")
    begin_later, later = arrow("Joint forces: O on crank")
    assert begin_later == begin
    assert abs(later - first) > 1
    box = page.get_by_label("Joint forces")
    assert box.is_checked()
    box.uncheck()
    assert page.locator("g.moving-off:has(title:text-is('Joint forces: O on crank'))").count() == 1


def test_one_map_is_chosen_by_its_index(opened):
    page = opened("five_bar")
    shown, legend = page.locator(".moving-region"), page.locator(".moving-legend:not(.moving-off)")
    assert "inverse condition" in legend.inner_html()
    boxes = page.get_by_role("radio")
    assert boxes.count() == 5
    page.get_by_role("radio", name="sigma min").check()
    assert page.locator(shown.get_attribute("href")).locator("image").count() == 1
    assert "sigma_min" in shown.get_attribute("href")
    assert "sigma min" in legend.inner_html()


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_the_first_screen_has_mechanism_verdicts_and_key_numbers(opened, name):
    page = opened(name, 1280, height=800)
    assert page.locator("#answers dl.numbers > div").count() == 5
    pieces = [".moving svg", ".moving-words", ".status", "#answers dl.numbers", "#requirements tbody tr >> nth=0"]
    for piece in pieces if name == "four_bar" else pieces[:-1]:
        box = page.locator(piece).first.bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= 800, piece


def test_on_a_dark_screen_pictures_are_dark_and_their_letters_light(opened):
    page = opened("four_bar", color_scheme="dark")
    colors = page.evaluate("""() => {
        const bright = color => color.match(/[.0-9]+/g).slice(0, 3).reduce((sum, each) => sum + Number(each), 0) / 3;
        const text = document.querySelector(".pictures svg text"), ground = document.querySelector(".moving svg rect");
        return [bright(getComputedStyle(text).fill), bright(getComputedStyle(ground).fill),
                bright(getComputedStyle(text.closest("figure")).backgroundColor)];
    }""")
    assert colors[0] > 200
    assert max(colors[1:]) < 60
    # What a colour of a map means stays.
    given, seen = (
        opened("five_bar", color_scheme="dark")
        .locator(".moving-legend rect")
        .first.evaluate("each => [each.getAttribute('fill'), getComputedStyle(each).fill]")
    )
    assert [int(given[k : k + 2], 16) for k in (1, 3, 5)] == [*map(int, re.findall(r"\d+", seen))]


def test_on_a_phone_letters_can_be_read_and_what_is_at_the_side_is_said(opened):
    page = opened("four_bar", 390)
    chart = page.locator(".moving-beside")
    assert (
        page.evaluate("""() => Math.min(...[...document.querySelectorAll(".pictures svg text")].filter(text =>
        text.ownerSVGElement.clientWidth).map(text =>
        parseFloat(text.getAttribute("font-size") || 10) * text.ownerSVGElement.clientWidth
        / text.ownerSVGElement.viewBox.baseVal.width))""")
        > 6.5
    )
    assert "more to the side" in chart.evaluate("each => getComputedStyle(each, '::before').content")
    chart.evaluate("each => { each.scrollLeft = each.scrollWidth; }")
    expect(chart).not_to_have_class(re.compile("more"))
    # The linkage stays in sight while the charts are read.
    chart.scroll_into_view_if_needed()
    assert page.locator(".moving svg").first.bounding_box()["y"] >= 0


def test_it_is_printed_on_few_pages(browser, reports):
    printed = pdf(reports / "four_bar.html")
    assert printed.startswith(b"%PDF")
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 5
    assert pdf(reports / "four_bar.html") == printed


def test_a_click_on_a_front_shows_that_linkage_moving(opened, answers):
    page, table = opened("straight_line_front"), answers["straight_line_front"][1].tables["pareto"]
    picture, slider = page.locator(".moving-beside svg"), page.get_by_role("slider", name="pose of the motion")
    assert "knee" in words(page)
    data = json.loads(page.locator(".moving script").text_content())
    (x, y), k = data["front"][0], 0
    wide = float(picture.get_attribute("viewBox").split()[2])
    box = picture.bounding_box()

    def look():
        row = data["choices"][k]["number"] - 1
        assert words(page).startswith(f"design {row + 1} of {len(table)} on the front")
        chosen = page.locator(".moving-chosen")
        assert [float(chosen.get_attribute(key)) for key in ("cx", "cy")] == [x[k], y[k]]
        # The rocker is as long as that of the design, and P is twice as far from A as B.
        scale, size = data["choices"][0]["scale"], table["l3"][row]
        pins = {}
        for point in ("A", "B", "D", "P"):
            place = page.locator(f".moving-design [data-at={point}]:has(circle)").first.get_attribute("transform")
            pins[point] = complex(*map(float, re.match(r"translate\((\S+) (\S+)\)", place).groups())) / scale
        assert abs(pins["B"] - pins["D"]) == pytest.approx(size, abs=2 * PIXELS / scale)
        assert abs(pins["P"] - pins["A"]) == pytest.approx(2 * size, abs=2 * PIXELS / scale)
        assert float(page.locator(".moving-numbers tr:has(th:text-is('l3')) td span").inner_text()) == pytest.approx(
            size, abs=1e-3)  # fmt: skip
        return pins["P"]

    shown = {data["choices"][k]["number"]}
    for k, share in ((0, 0.4), (len(x) - 1, 0.8)):
        scale = box["width"] / wide
        picture.click(position={"x": scale * x[k], "y": scale * y[k]})
        first = look()
        slider.fill(str(share * float(slider.get_attribute("max"))))
        assert abs(look() - first) > 0.1
        shown.add(data["choices"][k]["number"])
    assert len(shown) > 1
    picture.press("ArrowLeft")
    k -= 1
    look()
    page.locator("dl.numbers div", has_text="best kinematics.P.y_error").get_by_role("link").click()
    k = 0
    look()
    page.get_by_role("button", name="Play").click()
    expect(slider).not_to_have_value(slider.input_value())
    page.get_by_role("button", name="Pause").click()


def test_linkages_of_a_synthesis_move_side_by_side_and_a_click_enlarges_one(opened, answers):
    page, table = opened("five_positions", plays=True), answers["five_positions"][1].tables["solutions"]
    tiles, picture = page.locator(".moving-grid button"), page.locator(".moving-beside svg")
    expect(tiles).to_have_count(len(table))
    assert "error 0 mm" in tiles.first.inner_text()
    assert "branch" in tiles.nth(3).inner_text()

    def pin(drawing):
        transform = drawing.locator("[data-at=A]:has(circle)").first.get_attribute("transform")
        return complex(*map(float, re.match(r"translate\((\S+) (\S+)\)", transform).groups()))

    before = [pin(tiles.nth(k)) for k in range(len(table))]
    page.wait_for_timeout(400)
    assert all(abs(pin(tiles.nth(k)) - before[k]) > PIXELS for k in range(2))
    page.get_by_role("button", name="Pause").click()
    data = json.loads(page.locator(".moving script").text_content())["choices"]

    def look(k):
        assert words(page).startswith(f"solution {k + 1}, four-bar")
        assert tiles.nth(k).get_attribute("aria-pressed") == "true"
        drawing = page.locator(".moving-drawing")
        assert drawing.get_attribute("viewBox") == data[k]["view"]
        pivot = complex(*(table[f"ground.O.{axis}"][k] for axis in "xy")) - complex(*data[k]["corner"])
        crank = abs(pin(drawing) / data[k]["scale"] - pivot.conjugate())
        assert crank == pytest.approx(table["crank.length"][k], abs=2 * PIXELS / data[k]["scale"])

    look(0)
    tiles.nth(2).click()
    look(2)
    (x, y), box = json.loads(page.locator(".moving script").text_content())["front"][0], picture.bounding_box()
    scale = box["width"] / float(picture.get_attribute("viewBox").split()[2])
    picture.click(position={"x": scale * x[1], "y": scale * y[1]})
    look(1)


def test_of_several_pictures_the_chosen_one_is_on_the_screen_and_all_are_on_paper(opened):
    page = opened("four_bar")
    figures = page.locator("#kinematics .pictures figure:not([hidden])")
    count = figures.count()
    assert count == 4
    names = page.get_by_role("radio").all()
    assert [name.is_checked() for name in names] == [True, False, False, False]

    def seen():
        return [k for k in range(count) if figures.nth(k).is_visible()]

    assert seen() == [0]
    names[0].press("ArrowRight")
    assert seen() == [1]
    page.emulate_media(media="print")
    # A chart that the reader did not ask for is not printed.
    assert seen() == [0, 1, 2]


def test_any_number_is_drawn_over_any_other_and_its_dot_follows_the_pose(opened, answers):
    page, rows, poses = opened("four_bar"), rows_of(answers, "four_bar"), poses_of(answers, "four_bar")
    page.get_by_role("radio", name="any over any").check()
    page.get_by_label("output upwards").select_option(label="velocity of rocker.angle [deg/s]")
    page.get_by_label("output across").select_option(label="C.y [cm]")
    chart = page.locator(".moving-chart svg")
    assert chart.get_attribute("aria-label") == "velocity of rocker.angle [deg/s] over C.y [cm]"

    def dot():
        # The place of the dot by the numbers along the axes.
        return chart.evaluate("""svg => {
            const texts = [...svg.querySelectorAll("text")], dot = svg.querySelector(".moving-here");
            const number = text => Number(text.textContent.replace("\u2212", "-"));
            const along = (anchor, key) => {
                const marks = texts.filter(text =>
                    text.getAttribute("text-anchor") === anchor && isFinite(number(text)));
                const a = marks[0], b = marks.at(-1), [at, to] = [a, b].map(mark => Number(mark.getAttribute(key)));
                const place = Number(dot.getAttribute(key === "x" ? "cx" : "cy")) + (key === "y" ? 3.5 : 0);
                return number(a) + (number(b) - number(a)) * (place - at) / (to - at);
            };
            return [along("middle", "x"), along("end", "y")];
        }""")

    slider = page.locator(".stage").get_by_role("slider")
    for row in (0, 3, 6):
        slider.fill(str(poses.index(row)))
        x, y = dot()
        assert x == pytest.approx(rows[row]["C.y"], abs=0.01)
        assert y == pytest.approx(rows[row]["rocker.angle_velocity"], abs=0.2)
    # A click on the curve brings the mechanism to that pose.
    slider.fill("0")
    chart.scroll_into_view_if_needed()
    circle = chart.locator(".moving-here").bounding_box()
    slider.fill(str(poses.index(4)))
    page.mouse.click(circle["x"] + circle["width"] / 2, circle["y"] + circle["height"] / 2)
    assert abs(float(slider.input_value())) <= 1


def test_the_best_case_of_a_sweep_moves_and_says_which_it_is(opened, answers):
    page, table = opened("best_case"), answers["best_case"][1].main
    best = int(np.flatnonzero(table["rank"] == 1)[0])
    assert best == 2
    assert words(page).startswith("case 3 (l 6): crank = ")
    length = pin_to_pin(page, "A", "B")
    page.locator(".stage").get_by_role("slider").fill("20")
    assert length == pytest.approx(6, abs=0.01)
    assert pin_to_pin(page, "A", "B") == pytest.approx(6, abs=0.01)


def pin_to_pin(page, one, other):
    return abs(complex(*place(page, one)[:2]) - complex(*place(page, other)[:2]))


def test_before_and_after_move_together(opened, reports):
    path = CONFIGS / "gallery" / "four_bar.yaml"
    study, earlier = load(path, ["mechanism.links.rocker.2=3.5"]), load(path)
    result = kinematics(study)
    before = Before.of(study, result, earlier, kinematics(earlier))
    part, warnings = section(study, result, {}, "", (), before, plots=True)
    assert warnings == ()
    (reports / "changed.html").write_bytes(
        report(study, [AnsweredQuestion("kinematics", "done", 0, section=part)], below=False)
    )
    page = opened("changed")
    rows, then = ([*asked.tables["motion"]] for asked in (result, before.result))
    scale = part["moving"]["data"]["scale"]

    def pin(layer):
        found = page.locator(f".moving {layer}[data-at=C]:has(circle)").first.get_attribute("transform")
        return complex(*map(float, re.match(r"translate\((\S+) (\S+)\)", found).groups()))

    slider = page.locator(".stage").get_by_role("slider")
    for share in (0.0, 0.3, 0.8):
        slider.fill(str(round(share * float(slider.get_attribute("max")))))
        angle = float(re.search(r"crank = (\S+) deg", words(page))[1])
        places = [complex(np.interp(angle, [row["crank"] for row in table], [row["C.x"] for row in table]),
                          np.interp(angle, [row["crank"] for row in table], [row["C.y"] for row in table]))
                  for table in (rows, then)]  # fmt: skip
        apart = (pin("svg > ") - pin(".moving-before > ")) / scale
        assert abs(apart.conjugate() - (places[0] - places[1])) < 0.02
        assert abs(apart) > 0.05
    page.get_by_label("Before").uncheck()
    assert page.locator(".moving-before [data-at=C]:has(circle)").first.is_hidden()


@pytest.mark.nightly
def test_five_questions_are_printed_on_six_pages_and_half_as_long_as_with_all_pictures(opened, reports, tmp_path):
    study = load(CONFIGS / "five_bar.yaml", ["reliability.samples=2000"])
    told = []
    for ask in (kinematics, workspace, optimize, reliability, stiffness):
        result = ask(study)
        with style.context():
            names = [*figures(study, result)]
        part, _ = section(study, result, drawn(study, result, names), "", (), plots=True)
        told.append(AnsweredQuestion(result.command, "done", 0, verdicts=requirements(study, result), section=part))
    (reports / "five.html").write_bytes(report(study, told, below=True))
    assert 4 <= len(re.findall(rb"/Type\s*/Page\b", pdf(reports / "five.html"))) <= 6
    page = opened("five")
    assert page.locator(".choice").count() == 5
    tall = page.evaluate("document.documentElement.scrollHeight")
    page.evaluate("document.querySelectorAll('.away').forEach(figure => figure.classList.remove('away'))")
    assert tall < 0.6 * page.evaluate("document.documentElement.scrollHeight")


def test_a_column_sorts_a_table_by_a_click_and_by_a_key(opened):
    page = opened("offset_slider_crank")
    table = page.locator("table.sorted").first
    cases = table.locator("tbody tr td:first-child")
    assert cases.all_inner_texts() == ["1", "2", "3"]
    head = table.locator("th", has_text=re.compile(r"^l\b"))
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    assert cases.all_inner_texts() == ["3", "2", "1"]
    # A case without a number comes last, whichever way.
    stroke = table.locator("th", has_text="B.x.range")
    for order in ("ascending", "descending"):
        stroke.get_by_role("button").press("Enter")
        assert stroke.get_attribute("aria-sort") == order
        assert head.get_attribute("aria-sort") is None
        assert cases.all_inner_texts()[-1] == "3"
    stroke.get_by_role("button").press("Enter")
    assert cases.all_inner_texts() == ["1", "2", "3"]


@pytest.mark.parametrize("width", [400, pytest.param(1400, marks=pytest.mark.nightly)])
def test_nothing_is_wider_than_the_screen(opened, width):
    for name in ("slider_crank", "five_bar", "straight_line_front", "offset_slider_crank"):
        page = opened(name, width)
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.nightly
def test_without_script_and_in_print_it_is_a_still_drawing(opened):
    page = opened("slider_crank", java_script_enabled=False)
    assert page.locator(".moving [data-at=B]:has(circle)").is_visible()
    assert page.get_by_role("button", name="Play").count() == 0
    page = opened("slider_crank")
    page.emulate_media(media="print")
    assert page.locator(".moving-controls").is_hidden()
    assert page.locator(".moving [data-at=B]:has(circle)").is_visible()


def test_no_key_number_is_broken_between_two_lines(opened):
    for width in (1400, 390):
        page = opened("straight_line_front", width)
        lines = page.evaluate("""() => [...document.querySelectorAll(".numbers .note")].flatMap(note => {
            const walk = document.createTreeWalker(note, NodeFilter.SHOW_TEXT), lines = [];
            for (let text; (text = walk.nextNode());) for (const value of text.data.matchAll(/=\\u00a0[^,;]+/g)) {
                const range = document.createRange();
                range.setStart(text, value.index); range.setEnd(text, value.index + value[0].trimEnd().length);
                lines.push(new Set([...range.getClientRects()].map(box => Math.round(box.top))).size);
            }
            return lines;
        })""")
        assert len(lines) > 5
        assert set(lines) == {1}


def test_on_paper_letters_can_be_read(opened):
    page = opened("four_bar", 703)  # pixels between the margins of A4
    page.emulate_media(media="print")
    points = page.evaluate("""() => [...document.querySelectorAll(".pictures svg")].filter(svg => svg.clientWidth)
        .map(svg => 7.5 * svg.clientWidth / svg.viewBox.baseVal.width)""")
    assert len(points) == 3
    assert min(points) > 4.4


def test_on_paper_nothing_of_the_mechanism_lies_over_another(browser, answers, tmp_path):
    study, result = answers["offset_slider_crank"]
    with style.context():
        drawing = picture(figure_of(*answers["slider_crank"], "paths"), "mechanism", "mechanism")
    part, _ = section(study, result, {}, drawing, (), plots=True)
    (tmp_path / "page.html").write_bytes(
        report(study, [AnsweredQuestion(result.command, "done", 0, section=part)], below=False)
    )
    page = browser.new_page(viewport={"width": 703, "height": 900})
    page.goto((tmp_path / "page.html").as_uri())
    page.emulate_media(media="print")
    parts = page.locator("#mechanism .lists > *, #mechanism .picture, #mechanism table")
    boxes = [part.bounding_box() for part in parts.all()]
    assert len(boxes) > 3
    (figure, *rest) = boxes
    assert all(box["x"] + box["width"] <= figure["x"] for box in rest)
    lists = page.locator("#mechanism .lists > *").all()
    for upper, lower in itertools.pairwise(each.bounding_box() for each in lists):
        assert upper["y"] + upper["height"] <= lower["y"] + 1
    page.close()


def test_on_a_phone_limit_and_what_is_reached_share_a_line(opened):
    row = opened("slider_crank", 390).locator(".required tbody tr").first
    limit, reached = (row.locator(f"[data-head={head}]").bounding_box() for head in ("limit", "reached"))
    assert limit["y"] == reached["y"]
    assert limit["x"] + limit["width"] < reached["x"]
