"""What a report is made of: pictures as SVG, headline figures, margins of requirements."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

import mechdesign
from mechdesign.door.report.page import vector
from mechdesign.door.report.page.headlines import headlines, shown
from mechdesign.door.report.requirements import verdict_on
from mechdesign.drawing import style
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Result, Table
from mechdesign.questions.columns import GIVEN, VALID
from mechdesign.questions.kinematics.columns import MOTION
from mechdesign.questions.reliability.columns import RELIABILITY
from mechdesign.questions.stiffness.columns import STIFFNESS
from mechdesign.questions.workspace.columns import INDICES
from mechdesign.study.schema.conditions import Requirement

X = np.linspace(0, 10, 400)


def figure(curve=np.sin, name="C.x"):
    made = style.new_figure(3.0)
    axes = made.subplots()
    axes.plot(X, curve(X), label=name)
    axes.set_xlabel("theta [deg]")
    axes.set_title(name)
    axes.legend()
    return made


@pytest.mark.slow
def test_a_curve_is_where_it_was_drawn() -> None:
    with style.context():
        made = figure()
        root = ElementTree.fromstring(vector.inline(made, "one", "a sine"))
        axes = made.axes[0]
    paths = [path.get("d", "") for path in root.iter("path")]
    steps = re.findall(r"-?\d*\.?\d+", max(paths, key=len))
    places = np.cumsum(np.array(steps, dtype=float).reshape(-1, 2), axis=0)
    height = 72 * style.new_figure(3.0).get_figheight()
    inside = axes.transData.inverted().transform(np.column_stack([places[:, 0], height - places[:, 1]]) * made.dpi / 72)
    # To a hundredth of a point, and half of that which Matplotlib leaves out where a curve is smooth.
    assert inside[[0, -1], 0] == pytest.approx([0, 10], abs=1e-3)
    assert inside[:, 1] == pytest.approx(np.sin(inside[:, 0]), abs=5e-3)


@pytest.mark.slow
def test_texts_are_texts_and_stay_it() -> None:
    hostile = "<script>'\"&</text>"
    with style.context():
        drawn = vector.inline(figure(name=hostile), "one", hostile)
    root = ElementTree.fromstring(drawn)
    texts = {text.text: text for text in root.iter("text")}
    assert {hostile, "theta [deg]"} <= texts.keys()
    assert root.get("aria-label") == hostile
    # Whatever font a reader has, a text is as long as it was laid out: some 11 letters of 10 points.
    assert 50 < float(texts["theta [deg]"].get("textLength", 0)) < 70
    assert not {"script", "style", "metadata"} & {element.tag for element in root.iter()}
    assert not [key for element in root.iter() for key in element.attrib if key == "style" or "{" in key]
    assert "http" not in drawn


@pytest.mark.slow
def test_pictures_of_one_page_share_no_names() -> None:
    with style.context():
        drawn = [vector.inline(figure(), name, "") for name in ("one", "two")]
    ids = [re.findall(r' id="([^"]+)"', each) for each in drawn]
    assert ids[0]
    assert not set(ids[0]) & set(ids[1])
    for each, own in zip(drawn, ids, strict=True):
        assert set(re.findall(r"#([\w-]+-\d+)", each)) == set(own)


@pytest.mark.slow
def test_hatches_of_one_page_are_those_of_their_pictures() -> None:
    """What is not met is hatched in a response map: the area is filled with the pattern of its own picture."""
    with style.context():
        made = style.new_figure(3.0)
        made.subplots().fill_between([0, 1], [1, 2], hatch="////", facecolor="white")
        drawn = vector.inline(made, "two", "")
    patterns = re.findall(r'<pattern[^>]* id="([^"]+)"', drawn)
    assert [name.startswith("two-") for name in patterns] == [True]
    assert re.findall(r'fill="url\(#([^)]+)\)"', drawn) == patterns


@pytest.mark.nightly
def test_what_is_large_as_lines_is_a_picture_of_pixels() -> None:
    random = np.random.default_rng(0)
    with style.context():
        made = style.new_figure(3.0)
        made.subplots().scatter(*random.random((2, 3000)), c=random.random(3000))
        drawn = vector.picture(made, "cloud", "a <cloud>")
        assert vector.picture(figure(), "sine", "").startswith("<svg")
    assert drawn.startswith('<img alt="a &lt;cloud&gt;" width="960" height="360" src="data:image/png;base64,')


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (53541.2, "53 541"), (-0.0486353, "−0.04864"), (100.0, "100"), (9.99996, "10"), (1e-9, "10⁻⁹"),
        (-2.5681e-5, "−2.568·10⁻⁵"), (2e9, "2·10⁹"), (float("nan"), "none"), (float("inf"), "infinite"),
    ],
)  # fmt: skip
def test_numbers_for_people(value: float, text: str) -> None:
    assert shown(value).replace("\N{NARROW NO-BREAK SPACE}", " ") == text


def table(name: str, **columns: tuple[list[object], str, str]) -> Table:
    return Table(name, tuple(Column(each, np.array(v), unit, meaning) for each, (v, unit, meaning) in columns.items()))


def test_headlines_name_the_extreme_row_with_its_unit_and_pose() -> None:
    nothing = float("nan")
    columns = [
        GIVEN.column([0.0, 5.0, 10.0], "deg", coordinate="theta"),
        *STIFFNESS.columns({"stiffness": "N/mm"}, k_min=[7.0, 4.0, nothing]),
    ]
    result = Result("stiffness", {"stiffness": STIFFNESS.table(columns)})
    (found,) = headlines(result)
    assert (found.label, found.value, found.unit) == ("smallest stiffness", "4", "N/mm")
    assert found.note.replace("\N{NO-BREAK SPACE}", " ") == "at theta = 5 deg"


def test_what_stands_still_but_for_rounding_has_no_largest_velocity() -> None:
    columns = [
        MOTION["<output>_velocity"].column([0.1, -0.3, 9.0], "m/s", output="P.x"),
        MOTION["<output>_velocity"].column([1e-17, 0.0, 9.0], "m/s", output="P.y"),
        VALID.column([True, True, False]),
    ]
    result = Result("kinematics", {"motion": MOTION.table(columns)})
    assert [(each.label, each.value) for each in headlines(result)] == [("largest velocity of P.x", "0.3")]


def test_a_number_without_a_unit_says_what_it_is() -> None:
    motion = [
        *MOTION.columns({"outputs": "C.x, C.y"}, conditioning=[0.9, 0.8], inverse_condition=[0.6, 0.5]),
        MOTION["<output>_velocity"].column([0.1, -0.3], "m/s", output="P.x"),
    ]
    speed, conditioning = headlines(Result("kinematics", {"motion": MOTION.table(motion)}))
    assert speed.meaning == ""
    assert "sine of the angle between two links that meet" in conditioning.meaning
    mean = Column("inverse_condition_mean", np.array([0.6]), "", "mean of sigma_min/sigma_max",
                  INDICES["<index>_mean"])  # fmt: skip
    (inverse,) = headlines(Result("workspace", {"indices": Table("indices", (mean,))}))
    assert inverse.meaning == "mean of sigma_min/sigma_max"


def test_headlines_of_every_method_with_the_interval_of_the_worst_pose() -> None:
    columns = RELIABILITY.columns(
        {"kind of interval": "99.7 %"},
        method=["analytic", "analytic", "auto", "auto"],
        failure=[0.01, 0.03, 0.02, 0.01],
        failure_low=[0.01, 0.03, 0.015, 0.01],
        failure_high=[0.01, 0.03, 0.025, 0.01],
    )
    poses = GIVEN.column([0.0, 5.0, 0.0, 5.0], "deg", coordinate="theta")
    result = Result("reliability", {"reliability": RELIABILITY.table([poses, *columns])})
    best, other = headlines(result)
    assert (best.label, best.value) == ("failure probability, auto", "0.02")
    assert best.note.startswith("99.7 % between 0.015 and 0.025; at theta")
    assert (other.label, other.value) == ("failure probability, analytic", "0.03")


def asked(extra: str = "") -> mechdesign.Study:
    """A slider-crank that turns a weight of 2 kg, and its answers."""
    return mechdesign.load(
        text=f"""
mechanism:
  links:
    ground: {{O: [0, 0]}}
    crank: [O, A, 40]
    rod: [A, B, 120]
    slider: {{points: {{B: [0, 0]}}, mass: 2}}
  joints: {{guide: {{prismatic: [ground, slider], through: O}}}}
  drives: {{theta: {{angle: crank}}}}
  sketch: {{A: [0, 40], B: [110, 0]}}
{extra}"""
    )


def test_the_first_key_numbers_are_peaks_of_effort_the_flywheel_and_what_was_asked() -> None:
    study = asked("kinematics: {outputs: [B.x], loads: [{at: B, force: [-100, 0]}], rates: {theta: 60 rpm}}")
    told = headlines(mechdesign.kinematics(study))
    assert [number.label for number in told[:4]] == [
        "largest static effort of theta",
        "range of B.x",
        "smallest transmission angle, O A B guide",
        "largest velocity of B.x",
    ]
    assert told[0].note.replace("\N{NO-BREAK SPACE}", " ").startswith("at theta = ")
    assert told[0].note.endswith("deg")
    study = asked("dynamics: {rates: {theta: 600 rpm}, flywheel: {fluctuation: 0.02}}")
    told = headlines(mechdesign.dynamics(study))
    assert told[0].label == "moment of inertia that the flywheel adds on theta"
    assert told[1].label == "peak effort of theta with weights and inertia"


def test_the_smallest_transmission_angle_is_a_key_number_with_its_pose() -> None:
    study = mechdesign.load(
        text="""
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {outputs: [rocker.angle]}
"""
    )
    told = {number.label: number for number in headlines(mechdesign.kinematics(study))}
    number = told["smallest transmission angle, O A B D"]
    # Law of cosines where the crank lies on the frame, with 70 between A and D.
    assert (number.value, number.unit) == (
        f"{np.degrees(np.arccos((90**2 + 60**2 - 70**2) / (2 * 90 * 60))):.2f}",
        "deg",
    )
    assert dict(number.pose) == {"theta": 0.0}
    assert number.at.replace("\N{NO-BREAK SPACE}", " ") == "at theta = 0 deg"


def test_headlines_know_a_column_by_its_kind_whatever_its_name_and_its_meaning() -> None:
    speed, alike = "velocity of P.x", Column("Q.x_velocity", np.array([5.0]), "m/s", "velocity of Q.x")
    kind = MOTION["<output>_velocity"]
    named = Column("speed", np.array([2.0]), "m/s", speed, kind)
    result = Result("kinematics", {"motion": MOTION.table([named, alike])})
    assert [(each.label, each.value) for each in headlines(result)] == [("largest velocity of P.x", "2")]


@pytest.mark.parametrize(
    ("values", "worst", "margin"), [([41.0, 60.0, 139.5], 139.5, 0.5), ([39.0, 60.0, 139.0], 39.0, -1.0)]
)
def test_the_margin_is_that_of_the_row_nearest_to_a_limit(values: list[float], worst: float, margin: float) -> None:
    motion = table("motion", crank=([0.0, 1.0, 2.0], "deg", "drive"), mu=(list(values), "deg", "angle"))
    verdict = verdict_on(
        Result("kinematics", {"motion": motion}),
        Requirement(result="kinematics.mu", at_least=40.0, at_most=140.0),
    )
    assert (verdict.worst, verdict.margin, verdict.unit, verdict.met) == (worst, margin, "deg", margin >= 0)
