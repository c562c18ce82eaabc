"""Wrong input from end to end, with the real analyses: one clear message, the right exit code, nothing half-written."""

from __future__ import annotations

import itertools

import pytest

FOUR_BAR = """\
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: [A, B, 90]
    rocker: [D, B, 60]
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""
ARM = """\
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], forearm: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: forearm}}
reliability:
  dimensions: {upper.length: 0.03, forearm.length: 0.03}
  poses: [{t1: 30, t2: 60}]
  outputs: [P]
  limits: {P.x: 0.05, P.y: 0.05}
"""


@pytest.mark.parametrize(
    ("old", "new", "place", "message"),
    [
        ("rod: [A, B, 90]", "rod: {from: A, to: B, lenght: 90}", "5:27", "did you mean 'length'"),
        ("rod: [A, B, 90]", "rod: 90", "5:10", "expected a link"),
        ("rod: [A, B, 90]", "rod: [A, B, 9]", "8:11", "cannot be assembled"),
        ("drives: [crank]", "drives: [crank, rocker]", "7:11", "mobility is 1 but 2 drives"),
        ("drives: [crank]", "drives: []", "7:11", "mobility is 1 but 0 drives"),
        ("  drives", "    roller: {B: [0, 0]}\n  drives", "8:11", "link 'roller' turns freely about 'B'"),
        ("  drives", "    rod2: [A, B, 90]\n  drives", "7:5", "are on link 'rod' too: the two are one rigid body"),
        ("  drives", "    brace: {from: A, to: D}\n  drives", "8:11", "rigid loop: links 'ground', 'crank' and 'b"),
        ("  drives", "    loose: [P, Q, 1]\n  drives", "7:5", "no other link shares a point of it (P, Q)"),
        ("A, B, 90", "A, B, 3*q", "5:17", "unknown name 'q'"),
        ("A, B, 90", "A, B, 90/(3-3)", "5:17", "division by zero"),
        ("A, B, 90", "A, B, __import__('os').getcwd()", "5:17", "no meaning"),
        ("A, B, 90", "A, B, .nan", "5:17", "nan"),
        ("A, B, 90", "A, B, .inf", "5:17", "inf"),
        ("A, B, 90", "A, B, -90", "5:17", "positive"),
        ("  drives", "  joints: {g: {slot: rocker, through: Z, point: A}}\n  drives", "7:39", "'Z'"),
        ("  drives", "  limits: [{distance: [O, Q], max: 3}]\n  drives", "7:27", "'Q'"),
    ],
)
def test_a_wrong_study_is_told_where_it_is_wrong(folder, invoke, old, new, place, message) -> None:
    assert old in FOUR_BAR
    (folder / "study.yaml").write_text(FOUR_BAR.replace(old, new))
    done = invoke("kinematics", "study.yaml")
    assert done.exit_code == 2, done.output
    assert f"study.yaml:{place}: mechanism." in done.stderr
    assert message in done.stderr
    assert not (folder / "results").exists()


@pytest.mark.parametrize("content", [b"", b"# nothing\n", b"\x00\x01\xff" * 100, b"a: [" * 5000])
def test_what_is_no_study_at_all(folder, invoke, content) -> None:
    (folder / "study.yaml").write_bytes(content)
    done = invoke("run", "study.yaml")
    assert done.exit_code == 2
    assert "study.yaml" in done.stderr


def test_a_yaml_bomb_is_refused_before_it_grows(folder, invoke) -> None:
    names = "abcdefghijklmnop"
    lines = ["a: &a [1, 1]"] + [f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]" for a, b in itertools.pairwise(names)]
    (folder / "study.yaml").write_text("\n".join(lines))
    done = invoke("check", "study.yaml")
    assert done.exit_code == 2
    assert "aliases" in done.stderr


def test_a_tolerance_is_not_negative(folder, invoke) -> None:
    (folder / "study.yaml").write_text(ARM.replace("upper.length: 0.03", "upper.length: -0.03"))
    done = invoke("reliability", "study.yaml")
    assert done.exit_code == 2
    assert "study.yaml:5:30: reliability.dimensions.upper.length" in done.stderr


def test_a_listed_pose_outside_the_limits_is_exit_code_three(folder, invoke) -> None:
    limited = (
        FOUR_BAR
        + "  limits: [{angle: [ground, rocker], min: 0, max: 100}]\nkinematics: {poses: [{crank: 30}, {crank: 215}]}\n"
    )
    (folder / "study.yaml").write_text(limited)
    done = invoke("kinematics", "study.yaml", "--no-plots")
    assert done.exit_code == 3
    assert "crank = 215 deg: limit" in done.stderr
    assert (folder / "results/study/kinematics/motion.csv").read_text().splitlines()[-1].endswith(",0")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("study", "command", "result", "told"),
    [
        (FOUR_BAR, "kinematics", "kinematics.rocker.angel", "did you mean 'rocker.angle'"),
        (FOUR_BAR, "kinematics", "kinematics.extremes.rocker.angel.range", "did you mean 'rocker.angle'"),
        (ARM, "reliability", "reliability.moments.sgma", "no column 'moments.sgma'"),
        (ARM, "reliability", "reliability.reliabilty", "did you mean 'reliability'"),
        (ARM, "optimize", "optimize.scroe", "did you mean 'score'"),
    ],
)
def test_a_requirement_that_names_no_column_is_told_before_anything_is_computed(
    folder, invoke, study, command, result, told
) -> None:
    if command == "optimize":
        study = study[: study.index("reliability:")] + "kinematics: {poses: [{t1: 30, t2: 60}], outputs: [P]}\n"
        study += "optimize: {variables: {upper.length: {from: 5, to: 9, step: 1e-6}}, maximize: kinematics.P.x}\n"
    elif command == "reliability":
        study += "  samples: 100000000\n"
    (folder / "study.yaml").write_text(f"{study}requirements:\n  - {{result: {result}, at_least: 1}}\n")
    place = f"study.yaml:{study.count(chr(10)) + 2}:5: requirements.0: "
    for arguments in ([command], ["run"], ["check"]):
        done = invoke(*arguments, "study.yaml", "--no-plots")
        assert done.exit_code == 2, done.output
        assert place in done.stderr
        assert told in done.stderr
    # What the study asks besides is not its mistake.
    assert not (folder / "results/study" / command).exists()


@pytest.mark.parametrize(
    ("study", "command", "requirement", "told"),
    [
        (FOUR_BAR, "kinematics", "extremes.range, where: {output: rocker.angel}", "did you mean 'rocker.angle'"),
        (FOUR_BAR, "kinematics", "rocker.angle, where: {crank: 0.25}", "there are 0 to 360, 0 the nearest"),
        (ARM, "reliability", "reliability, where: {method: monte_karlo}", "has method monte_karlo; "),
        (ARM, "reliability", "moments.sigma, where: {output: P.z}", "did you mean 'P."),
    ],
)
def test_a_requirement_of_rows_that_never_are_is_told(folder, invoke, study, command, requirement, told) -> None:
    (folder / "study.yaml").write_text(f"{study}requirements:\n  - {{result: {command}.{requirement}, at_least: 1}}\n")
    for arguments in ([command], ["run"], ["check"]):
        done = invoke(*arguments, "study.yaml", "--no-plots")
        assert done.exit_code == 2, done.output
        assert f"study.yaml:{study.count(chr(10)) + 2}:5: requirements.0: no row of " in done.stderr
        assert told in done.stderr
    assert not (folder / "results/study" / command).exists()


def test_designs_are_not_lost_to_a_requirement_of_a_row_that_never_is(folder, invoke) -> None:
    study = ARM[: ARM.index("reliability:")] + "kinematics: {poses: [{t1: 30, t2: 60}], outputs: [P]}\n"
    study += "optimize: {variables: {upper.length: {from: 5, to: 9, step: 1}}, maximize: kinematics.P.x}\n"
    study += "requirements: [{result: optimize.designs.kinematics.P.x, where: {upper.length: 20}, at_least: 1}]\n"
    (folder / "study.yaml").write_text(study)
    assert invoke("check", "study.yaml", "--no-plots").exit_code == 0
    done = invoke("optimize", "study.yaml", "--no-plots")
    assert done.exit_code == 2
    assert "no row of designs has upper.length 20; there are 5, 6, 7, 8, 9" in done.stderr
    assert len((folder / "results/study/optimize/designs.csv").read_text().splitlines()) == 6


@pytest.mark.parametrize(
    ("variable", "message"),
    [
        ("{from: 9, to: 5, step: 1}", "no value lies between 'from' and 'to'"),
        ("{from: 5, to: 9, step: 1e-12}", "the grid has 4000000000001 designs"),
        ("{from: 5, to: 9, step: 0}", "must be positive"),
    ],
)
def test_a_grid_that_cannot_be_is_told_where_it_is_asked(folder, invoke, variable, message) -> None:
    study = ARM[: ARM.index("reliability:")] + "kinematics: {poses: [{t1: 30, t2: 60}], outputs: [P]}\n"
    study += f"optimize:\n  maximize: kinematics.P.x\n  variables:\n    upper.length: {variable}\n"
    (folder / "study.yaml").write_text(study)
    done = invoke("optimize", "study.yaml")
    assert done.exit_code == 2, done.output
    assert "study.yaml:8:" in done.stderr
    assert message in done.stderr


def test_an_output_directory_that_cannot_be_written(folder, invoke) -> None:
    (folder / "study.yaml").write_text(FOUR_BAR)
    (folder / "file").write_text("in the way")
    done = invoke("kinematics", "study.yaml", "--out", "file/results")
    assert done.exit_code == 4
    assert "cannot be written" in done.stderr
