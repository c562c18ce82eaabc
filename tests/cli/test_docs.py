"""`mechdesign docs`: words in the terminal, and where a wrong study leads to."""

import pytest
import typer.main

from mechdesign.door.cli.app import app
from mechdesign.door.cli.docs import commands
from mechdesign.door.reference import entries, find


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("pin", "normal_in_disc: "),
        ("GII", "global isotropy index"),
        ("--junit", "stands in: sweep, run"),
        ("kinematics", "takes: mechdesign kinematics STUDY [OPTIONS]"),
        ("130", "interrupted"),
        ("reliability.clearances", "    radial: Mean radial clearance"),
        ("thou", "0.001 * inch"),
        ("torque", "<drive>_effort"),
        ("stroke", "kinematics.extremes.B.x.range"),
        ("inverse_condition_min", "0 wherever the region ends at a singularity"),
    ],
)
def test_a_word_is_told(word, told, invoke):
    done = invoke("docs", word)
    assert done.exit_code == 0
    assert told in done.stdout
    assert "\x1b" not in done.stdout


@pytest.mark.parametrize(("word", "told"), [
    ("counterweight", "docs/howto/moving_torque.md (page)"), ("balancing", "a counterweight balances"),
    ("planetary", "configs/gallery/planetary.yaml (shipped study)"), ("gears", "docs/howto/gears_and_cams.md (page)"),
    ("transmission angle", "docs/theory/kinematics.md (page)"),
    ("synthesis", "docs/theory/synthesis.md (page)"), ("body guidance", "docs/howto/body_positions.md (page)"),
    ("path problems", "docs/theory/path_problems.md (page)"),
])  # fmt: skip
def test_a_word_of_a_page_leads_to_the_page_with_a_sentence_of_it(word, told, invoke):
    done = invoke("docs", word)
    assert (done.exit_code, done.stderr) == (0, "")
    assert told in done.stdout
    assert word.removesuffix("s").removesuffix("ing") in done.stdout.casefold()


@pytest.mark.parametrize("word", ["spatial", "3D", "3d", "ball joint", "ball joints", "spherical"])
def test_a_word_that_is_out_of_scope_says_so_and_where_to_go(word, invoke):
    done = invoke("docs", word)
    assert done.exit_code == 0
    assert "planar mechanisms only" in done.stdout
    assert "MuJoCo" in done.stdout
    assert "docs/theory/limits.md" in done.stdout


@pytest.mark.parametrize(("words", "told", "not_told"), [
    (["ball", "joint"], "ball joint (out of scope)", "unit ball"),
    (["transmission", "angle"], "loops.csv", "units.angle"),
    (["hole"], "mechanism.plates.pin", "whole turns"),
    (["CAD"], "docs/howto/import.md", "matches"),
    (["four bar"], "loops.csv (table)", "did you mean"),
    (["gear ratio"], "docs/howto/gears_and_cams.md (page)", "did you mean"),
    (["motor torque"], "docs/howto/moving_torque.md (page)", "did you mean"),
])  # fmt: skip
def test_a_term_of_several_words_is_one_term_and_words_begin_where_the_term_does(words, told, not_told, invoke):
    done = invoke("docs", *words)
    assert (done.exit_code, done.stderr) == (0, "")
    assert told in done.stdout
    assert not_told not in done.stdout


def test_a_word_of_two_kinds_of_reasons_stands_once(invoke):
    assert invoke("docs", "limit").stdout.count("limit (why a pose fails)") == 1


def test_every_command_and_option_is_found_with_what_it_does():
    group = typer.main.get_command(app).commands
    known = entries(commands(group))
    for name, command in group.items():
        assert "command" in {entry.kind for entry in find(known, name)}
        for option in (given for given in command.params if given.param_type_name == "option"):
            told = [entry.text for entry in find(known, option.opts[0]) if name in entry.where]
            assert told == [option.help]


def test_without_a_word_there_is_an_overview(invoke):
    lines = invoke("docs").stdout.splitlines()
    assert "study: name, units, seed, mechanism, kinematics" in "\n".join(lines)
    assert any(line.startswith("function: sqrt") for line in lines)


@pytest.mark.nightly
def test_several_words_and_one_that_nobody_knows(invoke):
    assert invoke("docs", "sweep", "GRI").stdout.count("GRI (") == 1
    done = invoke("docs", "sweep", "clearence")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "the reference has no 'clearence'; did you mean 'clearance'?" in done.stderr


ARM = """\
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 30], lower: [E, P, 20]}
  drives: [upper, lower]
  sketch: {E: [0, 30], P: [20, 30]}
"""


def test_why_a_pose_fails_is_to_be_looked_up(tmp_path, monkeypatch, invoke):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.yaml").write_text(ARM)
    change = "kinematics={poses: [{P.x: 10, P.y: 20}, {P.x: 60, P.y: 0}]}"
    done = invoke("kinematics", "arm.yaml", "--no-plots", "--set", change)
    assert done.exit_code == 3, done.stderr
    assert "(mechdesign docs 'cannot be assembled')" in done.stderr
    assert "change a length or the pose" in invoke("docs", "cannot be assembled").stdout


def test_a_wrong_study_names_the_words_to_look_up_once(folder, invoke):
    text = (folder / "slider.yaml").read_text().replace("through: G}", "through: G, angel: 3}")
    (folder / "wrong.yaml").write_text(text + "  sweeep: 3\n  rates: {theta: fast}\n")
    done = invoke("kinematics", "wrong.yaml")
    assert done.exit_code == 2
    assert done.stderr.splitlines()[-1] == "(mechdesign docs mechanism.joints kinematics kinematics.rates)"
    assert done.stderr.count("mechdesign docs") == 1
