"""Extremes of a motion: the same whatever its steps are, between its poses, at its ends and at its limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.optimize import minimize_scalar

import mechdesign

GALLERY = Path(__file__).parents[2] / "configs" / "gallery"
SLIDER = """\
mechanism:
  links: {ground: {O: [0, 0], G: [0, -20]}, crank: [O, A, 40], rod: [A, B, 120], slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [110, -20]}
"""
# The crank swings between limits: 70 + 50 does not reach over 100 + 60, and 100 - 60 is less than 70 + 50.
ROCKER = """\
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 60], rod: [A, B, 70], rocker: [D, B, 50]}
  drives: [crank]
  sketch: {A: [60, 0], B: [94, 50]}
"""


def extremes(text: str, *changes: str) -> dict[str, dict[str, float]]:
    table = mechdesign.kinematics(study_of(text, *changes)).tables["extremes"]
    return by_name(table)


def by_name(table: mechdesign.Table) -> dict[str, dict[str, float]]:
    names = [name for name in table.names if name not in ("output", "unit")]
    return {str(output): {name: float(table[name][k]) for name in names} for k, output in enumerate(table["output"])}


@pytest.mark.slow
@pytest.mark.parametrize("first", [0, -170, 7])
@pytest.mark.parametrize("step", [5, 24, 40, 60])
def test_the_stroke_of_a_slider_crank(first: int, step: int) -> None:
    row = extremes(SLIDER, f"kinematics={{sweep: {{theta: {{from: {first}, to: {first + 360}, step: {step}}}}}}}")[
        "B.x"
    ]
    far, near = np.sqrt(160**2 - 20**2), np.sqrt(80**2 - 20**2)
    stretched, folded = 360 - np.degrees(np.arcsin(20 / 160)), 180 - np.degrees(np.arcsin(20 / 80))
    assert (row["max"], row["min"]) == pytest.approx((far, near), rel=1e-12)
    assert (row["max_at"] - stretched) % 360 == pytest.approx(0, abs=1e-9) or row["max_at"] % 360 == pytest.approx(
        stretched
    )
    assert row["min_at"] % 360 == pytest.approx(folded, rel=1e-11)
    part = stretched - folded
    assert row["time_ratio"] == pytest.approx(part / (360 - part), rel=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("step", [5, 15, 30])
def test_a_rocker_between_its_limits(step: int) -> None:
    # At the limits rod and rocker are in line: the law of cosines gives the crank there.
    limit = np.degrees(np.arccos((60**2 + 100**2 - 120**2) / (2 * 60 * 100)))
    found = extremes(ROCKER, f"kinematics={{sweep: {{crank: {{from: -180, to: 180, step: {step}}}}}}}")
    crank = found["crank.angle"]
    assert (crank["min"], crank["max"]) == pytest.approx((-limit, limit), rel=1e-10)
    assert crank["range"] == pytest.approx(2 * limit, rel=1e-10)
    ends = [60 * np.exp(1j * np.radians(angle)) for angle in (-limit, limit)]
    beyond = [100 + (end - 100) * 50 / 120 for end in ends]
    at = np.radians(np.linspace(-limit, limit, 200_001)[1:-1])
    a = 60 * np.exp(1j * at)
    d = np.abs(a - 100)
    x = (d * d + 50**2 - 70**2) / (2 * d)
    b = 100 + (a - 100) / d * (x - 1j * np.sqrt(50**2 - x**2))
    every = np.concatenate([b, beyond])
    assert (found["B.x"]["min"], found["B.x"]["max"]) == pytest.approx((every.real.min(), every.real.max()), rel=1e-8)
    assert (found["B.y"]["min"], found["B.y"]["max"]) == pytest.approx((every.imag.min(), every.imag.max()), rel=1e-8)
    assert np.isnan(crank["time_ratio"])


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "drive", "steps"),
    [
        ("shaper", "crank", (5, 30)), ("whitworth", "crank", (5, 30)), ("jansen", "crank", (5, 20)),
        ("klann", "crank", (5, 24)), ("stephenson", "crank", (1, 10)), ("stephenson_ii", "turn", (1, 10)),
    ],
)  # fmt: skip
def test_extremes_do_not_depend_on_the_step(name: str, drive: str, steps: tuple[int, int]) -> None:
    fine, coarse = (
        by_name(
            mechdesign.kinematics(
                mechdesign.load(GALLERY / f"{name}.yaml", [f"kinematics.sweep.{drive}.step={step}"])
            ).tables["extremes"]
        )
        for step in steps
    )
    for output, row in fine.items():
        for end in ("min", "max"):
            assert coarse[output][end] == pytest.approx(row[end], rel=1e-9, abs=1e-9), output


@pytest.mark.slow
def test_a_second_peak_beside_the_end_of_the_sweep() -> None:
    # y = cos(2 t) + cos(t) / 8 of a cardan arm: 1.125 at 0, a second peak of 0.875 at 180.
    text = SLIDER + "  measures: {wave: cos(2*(theta - 173)) + cos(theta - 173)/8}\n"
    for step in (5, 24, 30):
        change = f"kinematics={{sweep: {{theta: {{from: 0, to: 360, step: {step}}}}}, outputs: [wave]}}"
        row = extremes(text, change)["wave"]
        assert (row["max"], row["max_at"]) == pytest.approx((1.125, 173), rel=1e-9)
        # The slope is zero where cos t = -1/32.
        assert row["min"] == pytest.approx(2 / 32**2 - 1 - 1 / (8 * 32), rel=1e-12)


@pytest.mark.slow
def test_the_peak_torque_lies_between_the_rows() -> None:
    # By virtual work the effort is 500 times the slope of B.x = 40 cos t + sqrt(120^2 - (40 sin t + 20)^2).
    def slope(degrees: float) -> float:
        t = np.radians(degrees)
        high = 40 * np.sin(t) + 20
        return float(-40 * np.sin(t) - high * 40 * np.cos(t) / np.sqrt(120**2 - high**2))

    low, high = (minimize_scalar(lambda t, s=s: s * slope(t), bounds=b, method="bounded", options={"xatol": 1e-6})
                 for s, b in ((1, (20, 120)), (-1, (240, 340))))  # fmt: skip
    for step in (5, 24, 40):
        row = extremes(
            SLIDER,
            "kinematics={outputs: [B.x], loads: [{at: B, force: [-500, 0]}], "
            f"sweep: {{theta: {{from: 0, to: 360, step: {step}}}}}}}",
        )["theta_effort"]
        assert (row["min"], row["max"]) == pytest.approx((500 * low.fun, -500 * high.fun), rel=1e-11)
        assert (row["min_at"], row["max_at"]) == pytest.approx((low.x, high.x), abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("step", [5, 30, 36])
def test_an_advantage_is_infinite_at_a_dead_centre_and_an_effort_where_the_drive_holds_nothing(step: int) -> None:
    rows = extremes(
        SLIDER,
        f"kinematics={{mechanical_advantage: {{B.x: theta}}, sweep: {{theta: {{from: 0, to: 360, step: {step}}}}}}}",
    )
    row = rows["B.x_advantage"]
    stretched, folded = 360 - np.degrees(np.arcsin(20 / 160)), 180 - np.degrees(np.arcsin(20 / 80))
    assert (row["min"], row["max"]) == (-np.inf, np.inf)
    for end in ("min_at", "max_at"):
        assert min(abs(row[end] - stretched), abs(row[end] - folded)) < 1e-6
    limit = np.degrees(np.arccos((60**2 + 100**2 - 120**2) / (2 * 60 * 100)))
    row = extremes(
        ROCKER,
        f"kinematics={{loads: [{{link: rocker, moment: 3}}], sweep: {{crank: {{from: -180, to: 180, step: {step}}}}}}}",
    )["crank_effort"]
    assert np.isinf([row["min"], row["max"]]).any()
    infinite = "min" if np.isinf(row["min"]) else "max"
    assert abs(row[f"{infinite}_at"]) == pytest.approx(limit, abs=1e-6)


@pytest.mark.slow
def test_designs_that_reach_a_limit_are_answered_with_the_others() -> None:
    text = ROCKER.replace("A: [60, 0], B: [94, 50]", "A: [52, 30], B: [100, 50]")
    text += "kinematics: {sweep: {crank: {from: 0, to: 60, step: 10}}, outputs: [B.x]}\n"
    goals = ("max", "min")
    asked = ", ".join(f"{{result: kinematics.B.x.{end}, unassembled: allowed}}" for end in goals)
    lengths = (70, 80, 95)
    variables = f"variables: {{rod.length: {{choices: {list(lengths)}}}}}"
    designs = mechdesign.optimize(study_of(f"{text}optimize: {{{variables}, maximize: [{asked}]}}\n")).tables["designs"]
    assert designs["rod.length"].tolist() == list(lengths)
    for k, length in enumerate(lengths):
        row = extremes(text, f"mechanism.links.rod.2={length}")["B.x"]
        found = [designs[f"kinematics.B.x.{end}"][k] for end in goals]
        assert found == pytest.approx([row[end] for end in goals], rel=1e-9)


@pytest.mark.slow
def test_an_open_sketch_is_told_under_follow_as_under_side() -> None:
    texts = []
    for branch in ("side", "follow"):
        with pytest.raises(mechdesign.StudyError) as caught:
            study_of(
                ROCKER.replace("[A, B, 70]", "[A, B, 20]").replace("[D, B, 50]", "[D, B, 5]"),
                f"mechanism.branch={branch}",
            )
        texts.append(str(caught.value))
    assert texts[0] == texts[1]
    assert "the sketch cannot be assembled" in texts[0]


def test_what_stands_still_through_change_points_has_no_range() -> None:
    found = by_name(mechdesign.kinematics(mechdesign.load(GALLERY / "parallelogram.yaml")).tables["extremes"])
    assert found["rod.angle"]["range"] == 0
    assert found["M.x"]["range"] == pytest.approx(600, abs=1e-9)
