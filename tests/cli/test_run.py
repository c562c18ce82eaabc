"""`run`: every question of several studies, one summary, JUnit, resume."""

import csv
import io
import json
from xml.etree import ElementTree

import pytest
from junitparser import JUnitXml

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import AssemblyError

from .conftest import GAP, SLIDER, answer

STIFF = """\
stiffness:
  link: rod
  at: B
  sections: {beam: {E: 200 GPa, area: 100, inertia: 1000}}
  elastic: {rod: beam}
"""
WRONG = SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]")


@pytest.fixture
def studies(folder, analysis):
    analysis(lambda study, **options: answer("stiffness"), "stiffness")
    (folder / "both.yaml").write_text(SLIDER + STIFF)
    (folder / "wrong.yaml").write_text(WRONG)
    return folder


def summary(done):
    return [tuple(row.values())[:4] for row in csv.DictReader(io.StringIO(done.stdout))]


def skipped(report):
    """Cases of a JUnit report that were not answered."""
    return [f"{case.classname}: {case.name}" for suite in report for case in suite if case.is_skipped]


def test_every_question_a_study_asks_gets_a_folder(studies, invoke):
    done = invoke("run", "both.yaml", "--no-plots")
    assert done.exit_code == 0
    assert summary(done) == [("both", "kinematics", "done", "0"), ("both", "stiffness", "done", "0")]
    for command in ("kinematics", "stiffness"):
        assert (studies / "results/both" / command / "manifest.json").exists()


def test_out_of_one_study_and_of_several(studies, invoke):
    invoke("run", "slider.yaml", "--no-plots", "--out", "one")
    assert (studies / "one/kinematics/motion.csv").exists()
    invoke("run", "slider.yaml", "both.yaml", "--no-plots", "--out", "several")
    assert (studies / "several/slider/kinematics/motion.csv").exists()
    assert (studies / "several/both/stiffness/motion.csv").exists()


def test_a_study_that_asks_nothing_is_asked_how_it_moves(studies, invoke):
    (studies / "bare.yaml").write_text(SLIDER[: SLIDER.index("kinematics:")])
    assert summary(invoke("run", "bare.yaml", "--no-plots")) == [("bare", "kinematics", "done", "0")]


def test_a_requirement_is_a_question(studies, invoke):
    bare = SLIDER + "requirements: [{result: stiffness.theta, at_most: 80}]\n"
    (studies / "gate.yaml").write_text(bare)
    done = invoke("run", "gate.yaml", "--no-plots")
    assert done.exit_code == 1
    assert summary(done)[1] == ("gate", "stiffness", "requirement not met", "1")


def test_a_wrong_study_does_not_stop_the_others(studies, invoke):
    done = invoke("run", "wrong.yaml", "slider.yaml", "--no-plots")
    assert done.exit_code == 2
    assert summary(done) == [("wrong", "check", "wrong study", "2"), ("slider", "kinematics", "done", "0")]
    assert "wrong.yaml:6:19: mechanism.links.crank" in done.stderr


def test_fail_fast_stops_at_the_first_failure(studies, invoke):
    done = invoke("run", "slider.yaml", "wrong.yaml", "both.yaml", "--no-plots", "--fail-fast")
    assert done.exit_code == 2
    assert not (studies / "results").exists()


def test_a_question_that_fails_does_not_stop_the_next(studies, analysis, invoke):
    def fail(study, **options):
        raise AssemblyError("cannot reach")

    analysis(fail)
    done = invoke("run", "both.yaml", "--no-plots")
    assert done.exit_code == 3
    assert [row[3] for row in summary(done)] == ["3", "0"]


def test_interrupt_ends_the_run_and_what_was_finished_is_whole(studies, analysis, invoke):
    def interrupt(study, **options):
        raise KeyboardInterrupt

    analysis(interrupt, "stiffness")
    done = invoke("run", "both.yaml", "slider.yaml", "--no-plots", "--junit", "report.xml", "--jobs", 1)
    assert done.exit_code == 130
    assert "2 of 2 studies were not answered" in done.stderr
    assert summary(done) == [("both", "kinematics", "done", "0")]
    assert (studies / "results/both/kinematics/manifest.json").exists()
    assert not (studies / "results/both/stiffness").exists()
    assert not (studies / "results/slider").exists()
    report = JUnitXml.fromfile("report.xml")
    assert report.errors == 1
    assert skipped(report) == ["mechdesign.both: stiffness", "mechdesign.slider: kinematics"]


def test_what_the_first_failure_leaves_is_in_junit(studies, analysis, invoke):
    analysis(lambda study, **options: answer(failed="cannot be assembled"))
    asked = ["run", "both.yaml", "slider.yaml", "--no-plots", "--junit", "report.xml", "--jobs", 1, "--fail-fast"]
    assert invoke(*asked).exit_code == 3
    assert skipped(JUnitXml.fromfile("report.xml")) == ["mechdesign.both: stiffness", "mechdesign.slider: kinematics"]
    # Studies are read before the first question.
    assert invoke("run", "wrong.yaml", *asked[1:]).exit_code == 2
    assert skipped(JUnitXml.fromfile("report.xml")) == ["mechdesign.both: check", "mechdesign.slider: check"]


def test_a_folder_without_studies_is_an_error_of_its_own(studies, invoke):
    (studies / "empty").mkdir()
    done = invoke("run", "empty", "slider.yaml", "--no-plots", "--junit", "report.xml")
    assert done.exit_code == 2
    assert summary(done) == [("empty", "check", "wrong study", "2"), ("slider", "kinematics", "done", "0")]
    assert JUnitXml.fromfile("report.xml").errors == 1


@pytest.mark.parametrize("command", ["run", "merge", "check"])
def test_a_gate_without_a_study_does_not_pass(folder, analysis, invoke, command):
    """Where the file was renamed, or the variable with its name is not set."""
    (folder / "slider.yaml").rename(folder / "renamed.yaml")
    for arguments, words in (
        ((), "no study is named, and there is no study.yaml here"),
        (("",), "an argument is empty"),
        (("renamed.yaml", "--set", ""), "an argument is empty"),
        ((" ",), "No such file"),
        (("*.yml",), "there are no studies"),
    ):
        done = invoke(command, *arguments, "--no-plots")
        assert (done.exit_code, words in done.stderr) == (2, True), (arguments, done.stderr)
        assert not (folder / "results").exists()
    (folder / "renamed.yaml").rename(folder / "study.yaml")
    done = invoke(command, "--no-plots")
    assert done.exit_code == (2 if command == "merge" else 0), done.stderr
    assert "study: study.yaml" in done.stderr


def test_a_run_without_a_study_is_in_the_junit_file(folder, invoke):
    assert invoke("run", "--junit", "report.xml", "--no-plots").exit_code == 2
    assert JUnitXml.fromfile("report.xml").errors == 1


def test_two_studies_of_one_name_do_not_overwrite_each_other(studies, invoke):
    (studies / "deep").mkdir()
    (studies / "deep/slider.yaml").write_text(SLIDER)
    done = invoke("run", "slider.yaml", "deep/slider.yaml", "--no-plots")
    assert done.exit_code == 2
    assert "would overwrite" in done.stderr


def test_json_summary(studies, invoke):
    rows = json.loads(invoke("run", "both.yaml", "--no-plots", "--json").stdout)
    assert [row["command"] for row in rows] == ["kinematics", "stiffness"]


def test_junit_has_a_case_for_each_question_and_requirement(studies, invoke):
    gate = "requirements:\n  - {result: kinematics.theta, at_least: 0}\n  - {result: kinematics.theta, at_most: 80}\n"
    (studies / "gate.yaml").write_text(SLIDER + gate)
    done = invoke("run", "gate.yaml", "wrong.yaml", "--no-plots", "--junit", "ci/report.xml")
    assert done.exit_code == 2
    report = JUnitXml.fromfile(str(studies / "ci/report.xml"))
    assert (report.tests, report.failures, report.errors) == (4, 1, 1)
    names = [case.name for suite in report for case in suite]
    assert "kinematics" in names
    assert any("kinematics.theta at most 80" in name for name in names)


def test_names_cannot_spoil_junit_or_summary(studies, analysis, invoke):
    analysis(lambda study, **options: answer(warnings=[Caution("suspect", "\x1b[2J\x00")]))
    names = ["=1+1\n\x1b]0;x\x07.yaml", "\u202e<b>&.yaml"]
    for name in names:
        (studies / name).write_text(SLIDER)
    (studies / "wrong.yaml").write_text(WRONG.replace("q]", '"\\x01\\ufffe]]>"]'))
    done = invoke("run", *names, "wrong.yaml", "--no-plots", "--junit", "report.xml")
    assert [suite.name for suite in JUnitXml.fromfile("report.xml")][:2] == [
        "=1+1__]0;x_", "__b_&",
    ]  # fmt: skip
    assert [row[0] for row in summary(done)] == ["'=1+1__]0;x_", "__b_&", "wrong"]
    assert all(line.isprintable() for line in (*done.stderr.splitlines(), *done.stdout.splitlines()))


def test_names_cannot_spoil_json_pages_or_annotations(studies, analysis, invoke, monkeypatch):
    """Readers of JSON get the name as it is; none of it turns or hides the letters beside it, or begins a line."""
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    analysis(lambda study, **options: answer(warnings=[GAP]))
    hostile = "a\u202eb\x1b[31m\x07\u2028\u200f</script>\U000e0041"
    file = "x\n::error::\u202ey.yaml"
    gate = "requirements: [{result: kinematics.theta, at_most: 80}]\n"
    head = f"name: {json.dumps(hostile, ensure_ascii=False)}\n".replace("\U000e0041", "\\U000e0041")
    (studies / file).write_text(head + SLIDER.partition("\n")[2] + gate)
    done = invoke("run", file, "wrong.yaml", "--report", "--json", "--no-plots")
    assert {row["study"] for row in json.loads(done.stdout)} == {"x___error___y", "wrong"}
    told = [*done.stderr.splitlines(), *done.stdout.splitlines()]
    assert all(line.isprintable() and not line.startswith("::error::") for line in told)
    assert sum(line.startswith("::error file=") for line in told) == 2
    written = [path for path in studies.rglob("*") if path.suffix in (".json", ".html", ".csv")]
    assert {path.name for path in written} >= {
        "manifest.json",
        "report.json",
        "report.html",
        "index.html",
        "motion.csv",
    }
    for path in written:
        lines = path.read_text(encoding="utf-8").replace("\xa0", " ").split("\n")
        assert [line for line in lines if not line.isprintable()] == [], path
        if path.name == "manifest.json":
            assert json.loads(path.read_text(encoding="utf-8"))["study"]["name"] == hostile


def test_junit_has_what_the_schema_of_jenkins_allows(studies, analysis, invoke):
    """The attributes of junit-10.xsd of its xunit plugin, which refuses a file with others."""
    analysis(lambda study, **options: answer(warnings=[GAP]))
    invoke("run", "slider.yaml", "wrong.yaml", "--no-plots", "--junit", "report.xml")
    allowed = {
        "testsuites": {"name", "time", "tests", "failures", "errors"},
        "testsuite": {"name", "time", "tests", "failures", "errors", "skipped"},
        "testcase": {"name", "time", "classname"},
        "failure": {"type", "message"},
        "error": {"type", "message"},
        "system-out": set(),
    }
    found = [*ElementTree.parse("report.xml").iter()]
    assert {each.tag for each in found} == {"testsuites", "testsuite", "testcase", "error", "system-out"}
    for each in found:
        assert {*each.keys()} <= allowed[each.tag], each.tag


def test_junit_shows_warnings_and_log_lines_name_their_study(studies, analysis, invoke):
    analysis(lambda study, **options: answer(warnings=[GAP]))
    done = invoke("run", "slider.yaml", "both.yaml", "--no-plots", "--junit", "report.xml")
    assert [line.partition(": ")[0] for line in done.stderr.splitlines()] == ["slider"] * 2 + ["both"] * 3
    assert "slider: kinematics: warning: mind the gap [suspect]" in done.stderr.splitlines()
    outputs = [case.system_out for suite in JUnitXml.fromfile("report.xml") for case in suite]
    assert outputs == ["warning: mind the gap", "warning: mind the gap", None]


@pytest.mark.nightly
@pytest.mark.parametrize("spoil", ["nothing", "file", "study", "seed", "override", "plots"])
def test_resume_computes_again_only_what_is_not_whole_and_the_same(studies, analysis, invoke, spoil):
    computed = []
    analysis(lambda study, **options: computed.append(study) or answer())
    arguments = ["run", "slider.yaml", "--no-plots", "--resume"]
    invoke(*arguments)
    if spoil == "file":
        (studies / "results/slider/kinematics/motion.csv").write_text("theta\n")
    elif spoil == "study":
        (studies / "slider.yaml").write_text(SLIDER + "# changed\n")
    elif spoil == "seed":
        arguments += ["--seed", "7"]
    elif spoil == "override":
        arguments += ["--set", "mechanism.parameters.r=39"]
    elif spoil == "plots":
        arguments.remove("--no-plots")
    done = invoke(*arguments)
    assert done.exit_code == 0, done.output
    assert len(computed) == (1 if spoil == "nothing" else 2)
    assert ("kept" in done.stdout) == (spoil == "nothing")


def test_resume_keeps_the_verdict(studies, analysis, invoke):
    (studies / "slider.yaml").write_text(SLIDER + "requirements: [{result: kinematics.theta, at_most: 80}]\n")
    assert [invoke("run", "slider.yaml", "--no-plots", "--resume").exit_code for _ in range(2)] == [1, 1]


def test_check_says_joints_mobility_and_every_mistake(studies, invoke):
    done = invoke("check", "slider.yaml", "--no-plots")
    assert done.exit_code == 0
    assert "mobility: 1" in done.stdout
    assert "revolute" in done.stdout
    done = invoke("check", "slider.yaml", "wrong.yaml", "--no-plots")
    assert done.exit_code == 2
    assert "mobility: 1" in done.stdout
    assert "wrong.yaml:6:19: mechanism.links.crank" in done.stderr
    assert not (studies / "results").exists()


def test_new_prints_a_study_that_passes_the_check(studies, invoke):
    text = invoke("new").stdout
    (studies / "study.yaml").write_text(text)
    assert invoke("check").exit_code == 0
    unknown = invoke("new", "two_link_amr")
    assert unknown.exit_code == 2
    assert "two_link_arm" in unknown.stderr


def test_schema_is_json(invoke):
    assert "properties" in json.loads(invoke("schema").stdout)


def test_an_allocation_that_is_not_reached_is_no_assembly_that_fails(folder, invoke):
    # A pin's clearance that is held moves P by up to 0.5 mm, and 0.05 mm are allowed.
    (folder / "arm.yaml").write_text("""\
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, P, 100]}
  drives: [arm]
  sketch: {P: [100, 0]}
reliability:
  poses: [{arm: 0}]
  dimensions: {arm.length: 0.1}
  clearances: {O: {radial: 0.5}}
  limits: {P.x: 0.05}
  methods: analytic
  allocate: {reliability: 0.99, cost: {arm.length: 1}}
""")
    done = invoke("run", "arm.yaml", "--no-plots")
    assert summary(done) == [("arm", "reliability", "not reached", "3")]
    assert "name O in 'cost' to have it allocated too" in done.stderr
