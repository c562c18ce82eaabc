"""What messages say where a first guess is wrong: the cure, the values, and nothing that the reader does not need."""

import re

import pytest
from helpers.command_line import ask

ARM = """
mechanism:
  parameters: {balance: 2, r: 100}
  links: {ground: {O: [0, 0]}, arm: [O, P, r]}
  drives: [arm]
kinematics: {sweep: {arm: {from: 0, to: 90, step: 10}}}
"""
LIMITED = ARM.replace("drives: [arm]", "drives: [arm]\n  limits: [{drive: arm, min: 100, max: 120}]")
NO_VALUE = """
mechanism:
  parameters: {r1: 5, r2: 5}
  links: {ground: {O: [0, 0]}, upper: [O, E, r1], fore: [E, P, r2]}
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [4, 3], P: [6, 8]}
  measures: {m: {expression: sqrt(0 - P.x**2)}}
kinematics: {poses: [{theta1: 30, theta2: 60}], outputs: [P, m]}
optimize:
  method: search
  evaluations: 20
  variables: {r1: {from: 1, to: 5}, r2: {from: 1, to: 2}}
  minimize: kinematics.m
  subject_to: [{result: kinematics.P.y, at_least: 0}]
"""


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("1.5 kg + balance", "an expression takes no units: write 1.5 + balance (kg)"),
        ("1500 g + balance", "an expression takes no units: write 1.5 + balance (kg)"),
        ("balance*2 + 3 cm/s", "an expression takes no units: write balance*2 + 30 (mm/s)"),
        ("1 + 2 foo", "unexpected 'foo'"),
        ("3 m" + "  m" * 1000 + "!", "units: write 3000" + "  m" * 17 + "  ... (mm)"),
    ],
)
def test_an_expression_with_units_is_shown_without_them(written: str, said: str) -> None:
    done = ask("check", "-", "--no-plots", study=ARM.replace("r: 100", f"r: {written}"))
    assert done.exit_code == 2
    assert said in done.stderr


def test_a_limit_that_is_reached_everywhere_says_the_values_and_what_is_allowed() -> None:
    done = ask("kinematics", "-", "--no-plots", study=LIMITED)
    assert done.exit_code == 3
    assert "no pose is valid: limit of drive arm: 0 to 90 deg where 100 to 120 deg is allowed\n" in done.stderr


def test_of_limits_of_two_sides_only_that_is_named_which_poses_are_beyond(tmp_path) -> None:
    both = "limits: [{distance: [O, P], min: 200}, {angle: [ground, arm], min: -10, max: 100}]"
    study = LIMITED.replace("limits: [{drive: arm, min: 100, max: 120}]", both)
    done = ask("kinematics", "-", "--no-plots", study=study)
    assert "no pose is valid: limit of distance O-P: 100 mm where at least 200 mm is allowed\n" in done.stderr
    one = study.replace("{distance: [O, P], min: 200}, ", "").replace("max: 100", "max: 75")
    done = ask("kinematics", "-", "--no-plots", "--out", tmp_path, study=one)
    words = "2 of 10 poses are not valid (2 limit); the first: arm = 80 deg: limit of angle ground-arm: 80 deg where"
    assert f"{words} -10 to 75 deg is allowed" in done.stderr


def test_a_nearest_design_that_misses_no_condition_is_not_said_to_miss_one(tmp_path) -> None:
    done = ask("optimize", "-", "--no-plots", "--out", tmp_path, study=NO_VALUE)
    assert "kinematics.m has no value (20 designs)" in done.stderr
    assert "misses" not in done.stderr


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("drives: [arm]", "drives: [arm]\n  joints: {O: {spherical: [ground, arm]}}", "planar mechanisms only"),
        ("kinematics:", "dynamics: {clearances: {O: 0.1}}\nkinematics:", "play is asked under reliability"),
    ],
)
def test_what_no_section_takes_says_where_it_is_asked(before: str, after: str, said: str) -> None:
    done = ask("check", "-", "--no-plots", study=ARM.replace(before, after))
    assert f"unknown key; {said}" in done.stderr


def test_compare_of_studies_says_that_it_takes_results(tmp_path) -> None:
    for name in ("a.yaml", "b.yaml"):
        (tmp_path / name).write_text(ARM)
    done = ask("compare", tmp_path / "a.yaml", tmp_path / "b.yaml", study="")
    assert done.exit_code == 2
    assert "compare takes folders of results" in done.stderr


def test_a_shard_of_something_else_says_only_what_differs(tmp_path) -> None:
    matrix = "matrix: {vary: {mechanism.parameters.r: [80, 100]}, results: [kinematics.P.y.max]}\n"
    for shard, r in (("1/2", 80), ("2/2", 90)):
        study = ARM + matrix.replace("[80,", f"[{r},")
        assert ask("sweep", "-", "--no-plots", "--out", tmp_path, "--shard", shard, study=study).exit_code == 0
    done = ask("merge", "-", "--no-plots", "--out", tmp_path, study=ARM + matrix)
    (line,) = [line for line in done.stderr.splitlines() if "shard_2_of_2" in line]
    assert line.endswith("something else: matrix.vary.mechanism.parameters.r is [90, 100], here [80, 100]")


def test_exports_list_all_names_only_where_none_is_nearly_right() -> None:
    near = ask("export", "-", "--to", "mechanism.dxff", study=ARM).stderr
    assert near.strip() == "--to: there is no 'mechanism.dxff' to export; did you mean 'mechanism.dxf'?"
    far = ask("export", "-", "--to", "gcode", study=ARM).stderr
    assert "what there is: " in far
    assert "parts.dxf" in far


TOLERANCES = (
    ARM.replace("step: 10", "step: STEP")
    + """
reliability:
  dimensions: {r: {tolerance: 0.3}}
  limits: {P.x: 0.2}
  methods: [analytic, monte_carlo]
  samples: 2000
"""
)


def test_a_reliability_with_limits_ends_with_the_probability_of_failure_of_each_pose(tmp_path) -> None:
    """Of a radius with the deviation 0.1 the error of x at 0 deg is beyond 0.2 at 2 sigma: 0.0455."""
    study = TOLERANCES.replace("STEP", "45")
    done = ask("reliability", "-", "--no-plots", "--out", tmp_path, study=study)
    *lines, whole = done.stderr.splitlines()[-4:]
    assert "over all poses together: probability of failure" in whole
    for line, pose in zip(lines, ("arm = 0 deg", "arm = 45 deg", "arm = 90 deg"), strict=True):
        assert f"reliability: at {pose}: probability of failure " in line
        assert line.endswith(", Monte Carlo")
    failure, low, high = map(float, re.findall(r"[\d.]+", lines[0].partition("failure")[2].replace("99.7 %", "")))
    assert low < 0.0455 < high
    assert low < failure < high
    assert "below " in lines[2]
    without = study.partition("  limits:")[0] + "  samples: 100\n"
    done = ask("reliability", "-", "--no-plots", "--out", tmp_path / "without", study=without)
    assert "probability" not in done.stderr


def test_of_many_poses_the_worst_have_a_line(tmp_path) -> None:
    done = ask("reliability", "-", "--no-plots", "--out", tmp_path, study=TOLERANCES.replace("STEP", "5"))
    lines = [line for line in done.stderr.splitlines() if "probability of failure" in line and "at arm" in line]
    assert len(lines) == 5
    assert "arm = 0 deg" in lines[0]
    assert "at 14 more poses it is smaller" in done.stderr


def test_a_reliability_that_is_kept_ends_with_the_same_words(tmp_path) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(TOLERANCES.replace("STEP", "45").replace("kinematics:", "kinematics:", 1))
    asked = ("run", file, "--no-plots", "--out", tmp_path / "out")
    first, again = ask(*asked, study=""), ask(*asked, "--resume", study="")
    words = [
        [line for line in done.stderr.splitlines() if ": probability of failure" in line] for done in (first, again)
    ]
    assert again.exit_code == 0
    assert words[0] == words[1]
    assert len(words[0]) == 4


def test_a_link_without_its_dimension_is_known_by_what_goes_on_from_it():
    study = ARM.replace("drives: [arm]", "drives: {theta: {angle: arm}}").replace("sweep: {arm:", "sweep: {theta:")
    done = ask("reliability", "-", study=study + "reliability: {dimensions: {arm: 0.1}}\n")
    assert "'arm'; did you mean 'arm.length'?" in done.stderr
