"""Ways to be green by accident: each ends with 1 (not met), 2 (a mistake) or 3 (impossible), and says why."""

from __future__ import annotations

from functools import cache

import pytest

import mechdesign
from mechdesign.ground.errors import StudyError

# A crank-rocker, B.x from 50 to 104 mm. The measure `half` has no value in four of seven poses, `narrow` has none near
# the left end alone, between two poses.
STUDY = """\
mechanism:
  parameters: {r: 30, limit: 1000, length: 1 m, turn: 1 deg}
  measures: {half: sqrt(B.x - 80), narrow: sqrt(B.x - 50.01), sum: r + limit + length + turn + 0*B.x}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, r], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 60}}, outputs: [B, half, narrow, rocker.angle]}
"""
GATE = "requirements: [{result: kinematics.B.x, at_most: 1000}]\n"
BROKEN = "mechanism.limits=[{drive: theta, min: 0, max: 300}]"

NAMES = {
    "kinematics.B.z": "did you mean 'B.y'?", "kinematics.b.x": "did you mean 'B.x'?", "kinematics.B.X": "'B.X'",
    "kinematics.B": "no column 'B'", "kinematics.B.xx.max": "no column 'B.xx.max'",
    "kinematic.B.x": "no command 'kinematic'",
    "Kinematics.B.x": "no command 'Kinematics'", "B.x": "no command 'B'", "sweep.case": "no command 'sweep'",
    "kinematics.extremes.B.x.rang": "no column", "kinematics.extremes.C.x.range": "no column 'extremes.C.x.range'",
    "kinematics.motion.B.x.maximum": "has no 'maximum'", "kinematics.B.x.max.min": "no column 'B.x.max.min'",
    "kinematics": "no result 'kinematics'", "kinematics.": "no meaning", "kinematics.B.x.": "no meaning",
    "kinematics..B.x": "no meaning", "": "empty text", "kinematics.extremes": "no column", "kinematics.0": "no column",
    "kinematics.motion": "no column 'motion'", "kinematics.limits.theta": "no column", "GII": "no result 'GII'",
    "kinematics.B.x + kinematics.B.z": "no column 'B.z'", "kinematics.B.x - kinematics.B.x": "has 7 rows",
    "2*kinematics.B.x": "has 7 rows", "kinematics.B.x.max + stiffness.k_min": "results of one command",
    "kinematics.B.x.max * kinematics.B.y.max": "is no sum", "abs(kinematics.B.x.max)": "is no sum",
    "kinematics.B.x.max + kinematics.theta.max": "one unit", "kinematics.loops.kind": "words",
    "kinematics.extremes.unit": "words", "kinematics.extremes.output": "words", "kinematics.r": "no column 'r'",
    "kinematics.limit": "no column", "r": "of parameters alone", "2*r": "of parameters alone",
    "kinematics.B.x_velocity": "no column", "kinematics.B.x_error": "no column",
    "kinematics.B.x_by_theta_": "no column",
    "kinematics.loops.transmission_mn": "no column", "kinematics.extremes.max": "several units",
    "kinematics.extremes.range": "several units", "kinematics.loops.B.x.range": "no column",
    "kinematics.C.x": "no column 'C.x'", "kinematics.theta.maxi": "has no 'maxi'", "kinematics.mu.": "no meaning",
    "kinematics.B.x.MAX": "no 'MAX'", "kinematics.motion.motion.B.x": "no column", "kinematics.B,x": "kinematics",
}  # fmt: skip
LIMITS = {
    "at_mots: 5": "unknown key", "": "needs 'at_least', 'at_most' or both", "at_most: ": "needs 'at_least'",
    "at_most: null": "needs 'at_least'", "at_most: ''": "empty text",
    "at_least: 5, at_most: 1": "nothing is at least 5",
    "at_most: .nan": "finite number", "at_most: .inf": "finite number", "at_least: -.inf": "finite number",
    "at_most: nan": "unknown name 'nan'", "at_most: inf": "unknown name 'inf'", "at_most: 1e400": "finite number",
    "at_most: 1e99": "too large", "at_most: '1,5'": "decimal comma", "at_most: '5 %'": "per cent",
    "at_most: 20 N*m": "a moment, where a length", "at_most: 1000 deg": "an angle, where a length",
    "at_most: 1000 mm^2": "an area, where a length", "at_most: 1000 mm/s": "a velocity, where a length",
    "at_most: 5 parsec": "unknown unit", "at_most: [5]": "expected a number", "at_most: yes": "unknown name",
    "at_most: true": "expected a number", "at_most: x": "unknown name 'x'", "at_most: 1000, at_mots: 5": "unknown key",
    "at_most: turn": "an angle, where a length", "at_most: 1000, abs: maybe": "true or false",
    "at_most: 1000, ABS: true": "unknown key", "at_most: 1000, unassembled: alowed": "expected one of allowed",
    "at_most: 1000, unassembled: true": "expected one of allowed", "at_most: {value: 5}": "expected a number",
    "at_most: 1/0": None, "at_most: sqrt(-1)": None, "max: 5": "unknown key", "at_most: 5 mm mm": None,
}  # fmt: skip
WHERE = {
    "{thta: 60}": "no column 'thta'", "{theta: 61}": "no row of motion has theta 61",
    "{theta: 1e3}": "no row of motion",
    "{theta: 60 mm}": "a length, where an angle", "{theta: sixty}": "no row of motion", "{output: B.x}": "no column",
    "{theta: {from: 10, to: 10}}": "nothing lies between", "{theta: {from: 10}}": "a part of a motion has",
    "{theta: {from: 400 mm, to: 500 mm}}": "a length, where an angle", "{theta: {to: 10}}": "a part of a motion has",
    "{theta: {at_least: 20, at_most: 10}}": "nothing is at least 20", "[theta, 60]": "expected a mapping",
    "{B.y: {at_most: 55, at_least: 200}}": "nothing is at least 200", "{theta: null}": "nothing",
    "{theta: [0, 60]}": "not a list", "{theta: 60, B.y: 5}": "no row of motion", "theta": "expected a mapping",
    "{method: monte_carlo}": "no column 'method'", "{theta: {fom: 0, to: 60}}": "unknown key", "{row: 3}": "no column",
    "{B.y: {at_least: 1000}}": "no place of the motion", "{B.y: {from: 1000, to: 2000}}": "no place of the motion",
    "{valid: 0}": "no row of motion", "{valid: 2}": "no row of motion", "{theta: {at_least: 1000}}": "no place",
    "{theta: {from: 0, to: 360}, B.y: {at_least: 10 m}}": "no place", "{valid: {from: 0, to: 0.5}}": "no row",
    "{half: {at_least: 100}}": "no place", "{B.y: {at_least: 1 km}}": "no place", "{B.y: {at_most: -1 cm}}": "no place",
}  # fmt: skip
# Results of what has no value everywhere: each is not met, for every kind of limit.
LOST = [
    *(f"kinematics.{name}{word}" for name in ("half", "narrow")
      for word in ("", ".min", ".max", ".mean", ".range", ".rms", ".peak", ".evenness")),
    *(f"kinematics.extremes.{name}.{column}" for name in ("half", "narrow") for column in ("min", "max", "range")),
    "kinematics.half.max + kinematics.narrow.max", "kinematics.half.max - kinematics.half.max",
    "kinematics.extremes.min_at", "kinematics.extremes.narrow.max + kinematics.extremes.narrow.min",
]  # fmt: skip
LOST_LIMITS = ["at_most: 1e9", "at_least: -1e9", "at_most: 1e9, abs: true", "at_most: 1e9, unassembled: allowed"]


@cache
def answer():
    return mechdesign.kinematics(mechdesign.load(text=STUDY))


def gate(requirement: str) -> tuple[int, str]:
    """Exit code and words of a study with a requirement, judged on one answer for all."""
    try:
        study = mechdesign.load(text=f"{STUDY}requirements: [{requirement}]\n")
        (verdict,) = mechdesign.requirements(study, answer())
    except StudyError as error:
        return 2, str(error)
    return int(not verdict.met), str(verdict)


def test_the_study_itself_is_green():
    assert gate("{result: kinematics.B.x, at_most: 1000}")[0] == 0
    assert gate("{result: kinematics.half.max, at_most: 5, where: {theta: {from: 0, to: 60}}}")[0] == 0


@pytest.mark.parametrize("name", NAMES)
def test_names_that_no_result_has(name: str):
    code, words = gate(f'{{result: "{name}", at_most: 1e9}}')
    assert (code, NAMES[name] in words) == (2, True), words


@pytest.mark.parametrize("limit", LIMITS)
def test_limits_that_are_none(limit: str):
    code, words = gate(f"{{result: kinematics.B.x, {limit}}}")
    assert (code, (LIMITS[limit] or "") in words) == (2, True), words


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("word", ["", ".max"])
def test_rows_that_are_none(where: str, word: str):
    code, words = gate(f"{{result: kinematics.B.x{word}, at_most: 1e9, where: {where}}}")
    assert code in (1, 2), words
    assert word or WHERE[where] in words
    assert code == 2 or "worst nan" in words


@pytest.mark.parametrize("result", LOST)
@pytest.mark.parametrize("limit", LOST_LIMITS)
def test_what_has_no_value_somewhere_meets_nothing(result: str, limit: str):
    code, words = gate(f"{{result: {result}, {limit}}}")
    assert (code, "no value" in words) == (1, True), words


# By the command's arguments behind the study: exit code and a part of the reason.
COMMANDS: dict[str, tuple[list[str], int, str]] = {
    "a limit cuts poses off": (["kinematics", "--set", BROKEN], 1, "1 of 7 poses are not valid"),
    "and their extremes": (
        ["kinematics", "--set", BROKEN, "--set", "requirements.0.result=kinematics.extremes.B.x.max"], 1, "is missing",
    ),
    "a limit lies between two poses": (
        ["kinematics", "--set", "mechanism.limits=[{distance: [O, B], max: 119.6}]"],
        1, "4.51 % of the motion is missing",
    ),
    "it cannot be assembled": (["kinematics", "--set", "mechanism.parameters.r=600"], 3, "no pose is valid"),
    "some poses cannot be assembled": (["kinematics", "--set", "mechanism.parameters.r=60"], 1, "not valid"),
    "a listed pose is out of reach": (
        ["kinematics", "--set", "kinematics.sweep=", "--set", "kinematics.poses=[{theta: 0}, {B.x: 500}]"],
        3, "not valid",
    ),
    "warnings are strict": (["kinematics", "--strict"], 1, "half has no value in 4 of 7 poses"),
    "a kind of warning fails": (["kinematics", "--set", "fail_on=undefined"], 1, "kind undefined at most 0: NOT MET"),
    "a kind of warning is misspelt": (["kinematics", "--set", "fail_on=undefind"], 2, "expected one of"),
    "requirements are misspelt": (["kinematics", "--set", "requirments.0.at_most=5"], 2, "unknown key"),
    "a requirement is not there": (["kinematics", "--set", "requirements.3.at_most=5"], 2, "is a list of 1"),
    "requirements are no list": (["kinematics", "--set", "requirements=kinematics.B.x"], 2, "expected a list"),
    "check finds a name": (["check", "--set", "requirements.0.result=kinematics.B.z"], 2, "did you mean 'B.y'?"),
    "a limit of a case": (["sweep", "--vary", "requirements.0.at_most=1000,1"], 1, "at most 1: NOT MET, worst 104"),
    "a limit of a case beside another entry": (
        ["sweep", "--vary", "requirements.0.at_most=1000,1", "--vary", "mechanism.parameters.r=20,30"],
        1, "2 of 4 cases",
    ),
    "limits at random": (
        ["sweep", "--vary", "requirements.0.at_most=1:200", "--method", "latin_hypercube", "--samples", "8"],
        1, "NOT MET",
    ),
    "a limit of a case in another unit": (["sweep", "--vary", "requirements.0.at_most=1 m,1 cm"], 1, "worst 10.4 cm"),
    "a limit of a case of another kind": (["sweep", "--vary", "requirements.0.at_most=1000,9 deg"], 2, "an angle"),
    "a range of limits of another kind": (["sweep", "--vary", "requirements.0.at_most=1 deg:9 deg:1 deg"],
    2, "an angle"),
    "a limit that a parameter sets": (
        ["sweep", "--vary", "mechanism.parameters.limit=1000,1", "--set", "requirements.0.at_most=limit"],
        1, "at most 1:",
    ),
    "a limit that a parameter sets in one case": (
        ["sweep", "--vary", "requirements.0.at_most=limit,1*length", "--vary", "mechanism.parameters.limit=1000,1"], 1,
        "NOT MET",
    ),
    "rows of a case": (
        ["sweep", "--set", "requirements.0={result: kinematics.B.x, at_most: 60, where: {theta: 180}}", "--vary",
         "requirements.0.where.theta=180,0"], 1, "(theta 0) at most 60: NOT MET",
    ),
    "rows of a case that are none": (
        ["sweep", "--set", "requirements.0={result: kinematics.B.x, at_most: 60, where: {theta: 180}}", "--vary",
         "requirements.0.where.theta=180,1"], 3, "no row of motion has theta 1",
    ),
    "absolute values of a case": (
        ["sweep", "--set", "requirements.0={result: kinematics.narrow, at_most: 1}", "--vary",
         "requirements.0.abs=false,true"], 1, "2 of 2 cases",
    ),
    "another lower limit in a case": (["sweep", "--vary", "requirements.0.at_least=0,500"], 1, "at least 500"),
    "poses that one case allows": (
        ["sweep", "--set", BROKEN, "--set", "requirements.0.unassembled=allowed", "--vary",
         "requirements.0.unassembled=allowed,null"], 1, "1 of 2 cases",
    ),
    "warnings that one case forbids": (["sweep", "--vary", "fail_on=[],[undefined]"], 1, "half has no value in 4 of 7"),
    "a kind of warning of a case": (["sweep", "--vary", "fail_on=undefined,undefind"], 2, "expected one of"),
    "an entry of a requirement that is none": (["sweep", "--vary", "requirements.0.at_mots=0,5"], 2, "at_most"),
    "a requirement that is none": (["sweep", "--vary", "requirements.1.at_most=0,5"], 2, "is a list of 1"),
    "other results in a case": (
        ["sweep", "--vary", "requirements.0.result=kinematics.B.x,kinematics.B.y"], 3, "judged on the results",
    ),
    "other requirements in a case": (
        ["sweep", "--vary",
        "requirements=[{result: kinematics.B.x, at_most: 1000}],[{result: kinematics.B.x, at_most: 1}]"],
        1, "1 of 2 cases",
    ),
    "no requirements in a case": (
        ["sweep", "--vary", "requirements=[{result: kinematics.B.x, at_most: 1000}],[]"], 3, "judged on the results",
    ),
    "other units in a case": (["sweep", "--vary", "units.length=mm,m"], 2, "units of the study"),
    "a case without a value": (
        ["sweep", "--set", "requirements.0.result=kinematics.extremes.narrow.max", "--vary",
         "mechanism.parameters.r=20,30"], 1, "no value on 1.3 % of the motion",
    ),
    "a range of a case without a value": (
        ["sweep", "--set", "requirements.0.result=kinematics.narrow.range", "--vary", "mechanism.parameters.r=20,30"],
        1,
        "no value on 1.3 % of the motion",
    ),
    "a case that is no mechanism": (["sweep", "--vary", "mechanism.parameters.r=30,-1"], 3, "must be positive"),
    "a case that does not turn": (["sweep", "--vary", "mechanism.parameters.r=30,60"], 1, "not valid"),
    "a result of cases that is none": (
        ["sweep", "--vary", "mechanism.parameters.r=20,30", "--results", "kinematics.B.z.max"], 2, "'B.y'",
    ),
    "a goal of cases that is none": (
        ["sweep", "--vary", "mechanism.parameters.r=20,30", "--maximize", "kinematics.B.z.max"], 2, "'B.y'",
    ),
    "designs without a value": (
        ["optimize", "--set",
        "optimize={variables: {r: {from: 30, to: 32, step: 1}}, maximize: kinematics.extremes.narrow.max}",
         "--set", "requirements=[]"], 3, "has no value",
    ),
    "a condition without a value": (
        ["optimize", "--set", "optimize={variables: {r: {from: 30, to: 32, step: 1}}, maximize: r, subject_to: "
         "[{result: kinematics.narrow.range, at_most: 1e9}]}", "--set", "requirements=[]"], 3, "has no value",
    ),
}  # fmt: skip
QUICK = ("a limit of a case", "a limit lies between two poses", "warnings are strict", "rows of a case that are none")


@pytest.mark.parametrize(
    "way", [way if way in QUICK else pytest.param(way, marks=pytest.mark.nightly) for way in COMMANDS]
)
def test_the_command_line_is_not_green(way: str, folder, invoke):
    (command, *arguments), code, reason = COMMANDS[way]
    (folder / "bar.yaml").write_text(STUDY + GATE)
    plain = ["--quiet"] if command == "check" else ["--quiet", "--no-plots"]
    done = invoke(command, "bar.yaml", *plain, *arguments)
    assert (done.exit_code, reason in done.output) == (code, True), done.output


# Files of cases: their text, exit code and a part of the reason.
CASES = {
    "requirements.0.at_most\n1000\n1\n": (1, "1 of 2 cases"),
    "requirements.0.at_most\n1 m\n1 cm\n": (1, "worst 10.4 cm"),
    "requirements.0.at_most\n1000\n9 deg\n": (2, "an angle"), "requirements.0.at_most\n": (2, "no cases"), "": (2, ""),
    "label\na\n": (2, "does not name each entry"), "requirements.0.at_mots\n5\n": (2, "at_most"),
    "requirements.0.at_most,mechanism.parameters.r\n5\n": (2, "1 values for 2 names"),
    "label,requirements.0.at_most\nwide,1000\nnarrow,1\n": (1, "case 2 (narrow: requirements.0.at_most 1)"),
    "requirements.0.at_most,requirements.0.at_most\n1000,1\n": (2, "names one twice"),
    "requirements.0.at_most\n1000\n\n# 1\n1\n": (1, "1 of 2 cases"),
    "requirements.0.at_most\n1000,1\n": (2, "2 values"),
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("text", CASES)
def test_files_of_cases_are_not_green(text: str, folder, invoke):
    (folder / "bar.yaml").write_text(STUDY + GATE)
    (folder / "cases.csv").write_text(text)
    done = invoke("sweep", "bar.yaml", "--cases", "cases.csv", "--quiet", "--no-plots")
    code, reason = CASES[text]
    assert (done.exit_code, reason in done.output) == (code, True), done.output


UNMET = ["--set", "requirements.0.at_most=1"]
# Commands one after the other, "edit" in the place of a hand that turns the verdict in a manifest; then the exit code
# and a part of the reason of the last.
SEQUENCES: dict[str, tuple[list[list[str] | str], int, str]] = {
    "no study here": ([["run"]], 2, "no study is named"),
    "an empty name": ([["run", ""]], 2, "empty"),
    "a file of another name": ([["run", "bra.yaml"]], 2, "cannot be read"),
    "one of two files": ([["run", "bar.yaml", "bra.yaml"]], 2, "cannot be read"),
    "a merge of nothing": ([["merge", "bar.yaml"]], 2, "there are no shards"),
    "a merge of one shard of two": (
        [["sweep", "bar.yaml", "--vary", "requirements.0.at_most=1000,1", "--shard", "1/2"], ["merge", "bar.yaml"]], 2,
        "shards are missing: 2/2",
    ),
    "a merge of shards whose limits differ": (
        [["sweep", "bar.yaml", "--vary", "requirements.0.at_most=1000,1", "--shard", "1/2"],
         ["sweep", "bar.yaml", "--vary", "requirements.0.at_most=1000,1", "--shard", "2/2"], ["merge", "bar.yaml"]], 1,
        "1 of 2 cases do not meet it",
    ),
    "results kept from a wider limit": ([["run", "bar.yaml"], ["run", "bar.yaml", "--resume", *UNMET]], 1, "NOT MET"),
    "results kept that miss it": ([["run", "bar.yaml", *UNMET], ["run", "bar.yaml", "--resume", *UNMET]], 1, "NOT MET"),
    "an edited verdict that is kept": (
        [["run", "bar.yaml", *UNMET], "edit", ["run", "bar.yaml", "--resume", *UNMET]], 1, "NOT MET",
    ),
    "verified results that miss it": (
        [["run", "bar.yaml", *UNMET], ["run", "--verify", "results/bar"]], 1, "NOT MET, worst 104",
    ),
    "an edited verdict that is verified": (
        [["run", "bar.yaml", *UNMET], "edit", ["run", "--verify", "results/bar"]], 1, "NOT MET, worst 104",
    ),
    "nothing to verify": ([["run", "--verify", "results/bar"]], 2, "no such folder"),
    "nothing to compare": ([["run", "bar.yaml"], ["compare", "results/bar", "results/bra"]], 2, "no such folder"),
    "a junit file of what is not met": (
        [["run", "bar.yaml", "--junit", "junit.xml", *UNMET]], 1, "at most 1: NOT MET, worst 104",
    ),
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("way", SEQUENCES)
def test_what_is_left_on_the_disk_is_not_green(way: str, folder, invoke):
    (folder / "bar.yaml").write_text(STUDY + GATE)
    steps, code, reason = SEQUENCES[way]
    done = None
    for step in steps:
        if isinstance(step, str):
            manifest = folder / "results/bar/kinematics/manifest.json"
            manifest.write_text(manifest.read_text().replace('"met": false', '"met": true'))
        else:
            plain = [] if step[0] in ("merge", "compare") or "--verify" in step else ["--no-plots"]
            done = invoke(*step, *plain)
    assert done is not None
    assert (done.exit_code, reason in done.output) == (code, True), done.output


# Texts of a study that judge nothing, and a part of the reason.
TEXTS = {
    STUDY + "Requirements: [{result: kinematics.B.x, at_most: 1}]\n": "unknown key",
    STUDY + GATE + "requirements: []\n": "duplicate key",
    STUDY + GATE + "\t- {result: kinematics.B.x, at_most: 1}\n": "is not YAML",
    STUDY + "---\n" + GATE: "a second YAML document",
    STUDY + "requirements:\n- result: kinematics.B.x\nat_most: 1\n": "needs 'at_least'",
    STUDY + "requirements: [{result: kinematics.B.x, at_most: 1, at_most: 1000}]\n": "duplicate key",
    STUDY + "  requirements: [{result: kinematics.B.x, at_most: 1}]\n": "YAML",
    "": "is empty",
}


@pytest.mark.parametrize("text", TEXTS)
def test_texts_that_judge_nothing_are_mistakes(text: str):
    with pytest.raises(StudyError) as error:
        mechdesign.load(text=text)
    assert TEXTS[text] in str(error.value)


def test_a_list_of_requirements_that_are_all_commented_out_is_warned_of():
    study = mechdesign.load(text=STUDY + "requirements:\n#- {result: kinematics.B.x, at_most: 1}\n")
    assert [str(warning) for warning in study.cautions] == ["requirements: lists nothing, so that no result is judged"]
