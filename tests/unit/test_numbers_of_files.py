"""Numbers of files are bounded as those of a study are, and what is far out of all proportion ends in words."""

import numpy as np
import pytest

import mechdesign

FOUR_BAR = """
mechanism:
  parameters: {T: 0.3, a: 30}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 200], fore: [E, P, 150]}
  drives: [upper, fore]
  sketch: {E: [200, 0], P: [200, 150]}
kinematics: {path: {P: {file: data.csv, spline: true}}, outputs: [P]}
"""
CAM = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], other: [D, B, 40]}
  drives: [crank]
  sketch: {A: [30, 0], B: [140, 0]}
  couplings: {c: {set: other.angle, of: crank.angle, table: data.csv}}
"""
UNUSED = "kinematics: {outputs: [B], poses: [{crank: T}, {crank: a}]}\n"
TIMED = """
kinematics: {motion: {crank: {file: data.csv}}, outputs: [B]}
optimize: {variables: {T: {choices: [1, 2]}}, minimize: kinematics.B.x.max}
"""
READERS = {
    "motion": (FOUR_BAR + TIMED, "0,0\n1,NUMBER\n2,20\n3,0\n"),
    "times": (FOUR_BAR + TIMED, "0,0\n1,9\n2,20\nNUMBER,0\n"),
    "path": (ARM, "100,100\n200,NUMBER\n250,150\n"),
    "target": (FOUR_BAR + "  targets: {rocker.angle: data.csv}\n" + UNUSED, "0,1\n30,NUMBER\n60,3\n"),
    "cam": (CAM, "0,0\n60,10\n120,NUMBER\n180,40\n360,0\n"),
    "measured": (FOUR_BAR + UNUSED + "reliability: {dimensions: {a: {measured: data.csv}}, outputs: [B.x]}",
                 "30\nNUMBER\n" + "30.1\n30.2\n" * 6),
}  # fmt: skip


@pytest.fixture
def load(tmp_path, monkeypatch):
    """A study of a reader, with a number in its file."""
    monkeypatch.chdir(tmp_path)

    def loaded(reader, number):
        text, rows = READERS[reader]
        (tmp_path / "data.csv").write_text(rows.replace("NUMBER", number))
        return mechdesign.load(text=text)

    return loaded


@pytest.mark.slow
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("number", ["1e308", "-1.7e308", "1e61"])
def test_a_number_beyond_all_size_is_told_with_its_line(load, reader, number):
    with pytest.raises(
        mechdesign.StudyError, match=r"data\.csv:\d+: the number .* is too large a number: none is beyond 1e\+60"
    ):
        load(reader, number)


@pytest.mark.parametrize("reader", ["motion", "path", "target", "cam"])
def test_a_number_below_all_size_is_zero(load, reader):
    tables = [mechdesign.kinematics(load(reader, number)).main for number in ("5e-324", "0")]
    for name in tables[0].names:
        assert np.array_equal(tables[0][name], tables[1][name], equal_nan=True)


def test_points_of_a_spline_may_not_be_apart_by_magnitudes(load, tmp_path):
    load("path", "100")
    (tmp_path / "data.csv").write_text("100,100\n200,100\n1e15,150\n")
    with pytest.raises(mechdesign.StudyError, match="no two in succession the same"):
        mechdesign.load(text=ARM)


def test_a_spline_of_any_size_is_computed(load, tmp_path):
    load("path", "100")
    (tmp_path / "data.csv").write_text("200,0\n1e59,0\n250,150\n")
    result = mechdesign.kinematics(mechdesign.load(text=ARM))
    assert result.main["valid"].tolist() == [True, False, True]


def test_a_target_far_beyond_a_turn_is_not_met_within_one(load, tmp_path):
    load("target", "2")
    (tmp_path / "data.csv").write_text("0,1\n30,2\n1e15,3\n")
    text = READERS["target"][0].replace(
        "poses: [{crank: T}, {crank: a}]", "sweep: {crank: {from: T, to: a, number: 4}}"
    )
    main = mechdesign.kinematics(mechdesign.load(text=text)).main
    # rocker.angle_error = angle - 1 - crank/30 along the first line of the table.
    angle = np.degrees(np.angle(main["B.x"] - 100 + 1j * main["B.y"]))
    assert main["rocker.angle_error"] == pytest.approx(angle - 1 - main["crank"] / 30, abs=1e-9)


@pytest.mark.slow
def test_times_of_a_motion_that_are_not_positive_are_infeasible_designs():
    study = mechdesign.load(
        text=FOUR_BAR
        + """
kinematics: {motion: {crank: [{to: 90, time: T}, {to: 0, time: 0.4}]}, outputs: [B]}
optimize: {variables: {T: {from: -1, to: 1, number: 3}}, minimize: kinematics.B.x.max}
"""
    )
    result = mechdesign.optimize(study)
    assert result.main["T"].tolist() == [1.0]
    assert "time must be positive" in " ".join(map(str, result.warnings))


def test_turns_beyond_number_are_told_where_each_counts():
    study = mechdesign.load(
        text="""
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, one: [O, A, 30], rod: [A, B, 100], other: [D, B, 30]}
  drives: [one]
  sketch: {A: [0, 30], B: [100, 30]}
  branch: follow
kinematics: {sweep: {one: {from: 0, to: 1e14, number: 5}}, outputs: [B]}
"""
    )
    with pytest.raises(mechdesign.MechdesignError, match="1,000 at most"):
        mechdesign.kinematics(study)
