"""What a person at a terminal sees, and what Ctrl-C does, in a process of its own on a pseudo-terminal."""

import io
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mechdesign.door.cli import live_table, terminal
from mechdesign.door.cli.live_table import LiveTable, ProgressNote
from mechdesign.door.cli.outcome import Outcome
from mechdesign.door.cli.summary import summary
from mechdesign.drawing import pictures, style
from mechdesign.drawing.rendering import Gallery

from .conftest import SLIDER, answer

pty = pytest.importorskip("pty")

# The analysis takes its time in steps, tells how far it is, and gives a table that no terminal has room for.
PROGRAM = """
import sys, time
from types import ModuleType
import numpy as np
from mechdesign.door.cli.app import main
from mechdesign.ground.columns import Column
from mechdesign.ground.results import Result, Table

def kinematics(study, *, seed, jobs, progress):
    progress.start(10, "poses")
    for _ in range(10):
        time.sleep({pause})
        progress.update(1)
    columns = [Column(f"point_{{k}}.x", np.arange(100) / 7, "mm") for k in range(20)]
    return Result("kinematics", {{"motion": Table("motion", tuple(columns))}})

module = ModuleType("mechdesign.questions.kinematics.analysis")
module.kinematics = kinematics
sys.modules[module.__name__] = module
sys.argv = ["mechdesign", "kinematics", "slider.yaml", "--no-plots", *sys.argv[1:]]
main()
"""


def at_terminal(folder, pause, *arguments, interrupt_after=None):
    """Run PROGRAM on a terminal of 80 columns; returns its exit code and everything it showed."""
    (folder / "slider.yaml").write_text(SLIDER)
    ours, theirs = pty.openpty()
    environment = os.environ | {"COLUMNS": "80", "LINES": "40", "TERM": "xterm", "CI": ""}
    command = [sys.executable, "-c", PROGRAM.format(pause=pause), *arguments]
    process = subprocess.Popen(command, cwd=folder, stdout=theirs, stderr=theirs, stdin=theirs, env=environment)
    os.close(theirs)
    shown = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # Linux says so when the other end is closed.
            break
        if not part:
            break
        shown += part
        if interrupt_after is not None and interrupt_after in shown:
            process.send_signal(signal.SIGINT)
            interrupt_after = None
    os.close(ours)
    return process.wait(60), re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.decode())


def test_a_table_with_what_there_is_room_for_and_where_the_rest_is(tmp_path):
    code, shown = at_terminal(tmp_path, 0)
    assert code == 0
    lines = [line.rstrip() for line in shown.splitlines()]
    assert lines[0].split()[0] == "point_0.x"
    assert lines[1].split()[0] == "[mm]"
    assert max(map(len, lines[:26])) <= 80
    assert "... 76 more rows and" in shown
    assert "motion.csv" in shown
    assert "0.142857" in shown
    assert "0.142857142857" not in shown


def test_a_long_name_leaves_room_for_what_became_of_it(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    terminal.show(summary([Outcome("long " * 20, "kinematics", Path(), 1, 0)]), as_json=False)
    assert "requirement not met" in capsys.readouterr().out


class Screen(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


@pytest.fixture
def screen(monkeypatch):
    """Standard error is a terminal of 400 columns, on which tables appear at once."""
    settings = {"COLUMNS": "400", "LINES": "24", "TERM": "xterm", "CI": ""}
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(terminal, "DELAY", -1.0)

    def begin():
        # Not sooner, as the stream is pytest's at first.
        monkeypatch.setattr(sys, "stderr", Screen())
        return sys.stderr

    return begin


def test_the_table_of_what_is_under_way_has_room_for_it(screen):
    shown = screen()
    with LiveTable(quiet=False) as live_table:
        live_table.start(["long " * 30, "b"])
        live_table.advance(0, ProgressNote("reliability", "samples", 1, 4))
        live_table._refreshed = 0.0
        live_table.done(1, "kinematics", "requirement not met", failed=True)
    words = ("kinematics", "requirement not met", "reliability", "samples", "25%", "0 of 2 studies", "1 failed")
    assert [word for word in words if word not in shown.getvalue()] == []


def test_a_table_that_has_ended_may_begin_again(screen):
    """As where the files of a long answer are written."""
    screen()
    live_table = LiveTable(quiet=False)
    for _ in range(2):
        with live_table:
            live_table.start(["a"])
            live_table.advance(0, ProgressNote("sweep", "cases", 1, 4))


def test_the_table_fits_on_the_screen(screen):
    """Whatever has been answered, rows under way are seen, and failures as long as there is room."""
    shown = screen()
    with LiveTable(quiet=False) as live_table:
        live_table.start([f"study {k}" for k in range(100)])
        for k in range(98):
            live_table.done(k, "kinematics", "failed" if k % 4 else "done", failed=bool(k % 4))
        for k in (98, 99):
            live_table._refreshed = 0.0
            live_table.advance(k, ProgressNote("optimize", "designs", k, 200))
    last = shown.getvalue().rpartition("0 of 100 studies")[2]
    assert all(word in last for word in ("73 failed", "study 97", "study 98", "study 99", "49%"))
    assert "study 1 " not in last
    assert last.count("kinematics") + last.count("optimize") <= 23


@pytest.mark.nightly
def test_no_bar_for_what_is_quick_and_one_for_what_is_not(tmp_path):
    _, quick = at_terminal(tmp_path, 0)
    assert "%" not in quick
    code, slow = at_terminal(tmp_path, 0.15)
    assert code == 0
    assert "poses" in slow
    assert "%" in slow
    _, quiet = at_terminal(tmp_path, 0.15, "--quiet")
    assert "%" not in quiet


def test_interrupt_is_130_and_writes_nothing(tmp_path):
    begun = time.monotonic()
    code, shown = at_terminal(tmp_path, 1.5, interrupt_after=b"%")
    assert code == 130
    assert time.monotonic() - begun < 10
    assert "interrupted" in shown
    assert "Traceback" not in shown
    assert not (tmp_path / "results").exists()


def test_a_reader_that_has_had_enough_is_no_error(tmp_path):
    (tmp_path / "slider.yaml").write_text(SLIDER)
    source = PROGRAM.format(pause=0).replace("np.arange(100)", "np.arange(20000)")
    process = subprocess.Popen(
        [sys.executable, "-c", source], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.stdout.close()
    assert process.stderr is not None
    talk = process.stderr.read().decode()
    process.stderr.close()
    assert process.wait(60) == 0, talk
    assert "Error" not in talk


def test_a_great_job_is_announced_without_a_bar(folder, analysis, invoke):
    def great(study, *, progress, **options):
        progress.start(999_999, "poses")
        progress.start(3_000_000, "samples")
        return answer()

    analysis(great)
    arguments = ("kinematics", "slider.yaml", "--no-plots")
    assert invoke(*arguments).stderr.splitlines()[0] == "3000000 samples to compute; Ctrl-C ends it"
    assert invoke(*arguments, "--quiet").stderr == ""


def test_a_long_search_announces_its_designs_and_shows_how_far_it_is_in_a_file(folder, analysis, invoke, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(live_table.time, "monotonic", lambda: now[0])

    def long(study, *, progress, **options):
        progress.start(20_000, "designs")
        for _ in range(8):
            now[0] += 9.0
            progress.update(100)
        return answer()

    analysis(long, "optimize")
    lines = invoke("optimize", "slider.yaml", "--no-plots").stderr.splitlines()
    ending = "Ctrl-C ends it, and --resume goes on: what is finished is kept every 30 s"
    assert lines[:4] == [
        f"20000 designs to compute; {ending}",
        f"slider: optimize: 200 of 20000 designs after 18 s; {ending}",
        "slider: optimize: 600 of 20000 designs after 54 s",
        "slider: optimize: 3 rows in results/slider/optimize",
    ]
    assert invoke("optimize", "slider.yaml", "--no-plots", "--quiet").stderr == ""


def one_picture(*given):
    """In place of all pictures of a motion, which take a second."""
    gallery = Gallery()
    gallery["paths"] = style.new_figure(1.0)
    return gallery


@pytest.mark.nightly
def test_a_command_ends_with_the_picture_or_page_to_open(folder, invoke, monkeypatch):
    monkeypatch.setattr(pictures, "figures", one_picture)
    monkeypatch.setattr(terminal, "is_terminal", lambda: True)
    (folder / "swing it.yaml").write_text(SLIDER)
    swing = "results/swing it"
    asked = {
        ("kinematics", "swing it.yaml"): f"open '{swing}/kinematics/paths.png'",
        ("kinematics", "swing it.yaml", "--format", "svg", "--out", "x"): "open x/paths.svg",
        ("kinematics", "swing it.yaml", "--report", "--out", "x"): "open x/report.html",
        ("run", "swing it.yaml"): f"open '{swing}/kinematics/paths.png'",
        ("run", "swing it.yaml", "--resume"): f"open '{swing}/kinematics/paths.png'",
        ("run", "swing it.yaml", "slider.yaml", "--report"): "open results/index.html",
        ("check", "swing it.yaml"): f"open '{swing}/check/mechanism.png'",
    }
    for arguments, last in asked.items():
        assert invoke(*arguments).stderr.splitlines()[-1] == last
    for arguments in (("--no-plots",), ("--quiet",), ("--json",)):
        assert "open " not in invoke("kinematics", "slider.yaml", *arguments).stderr
    monkeypatch.setattr(terminal, "is_terminal", lambda: False)
    assert "open " not in invoke("kinematics", "slider.yaml").stderr


def test_verdicts_have_colour_on_a_terminal_and_are_never_cut(monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    place = "a long place " * 10
    words = f"s: run: requirement: range at least 65: NOT MET, worst 60.2 at {place}\ns: x at most 1: met, worst 0\n"
    painted = words.replace("NOT MET", "\x1b[1;31mNOT MET\x1b[0m").replace(": met", ": \x1b[32mmet\x1b[0m")
    live_table = LiveTable(quiet=True)
    for stream, told in ((Screen(), painted), (io.StringIO(), words)):
        live_table._stream = stream
        live_table.say(words)
        monkeypatch.setattr(sys, "stderr", stream)
        terminal.say(words.rstrip("\n"))
        assert stream.getvalue() == told * 2
    monkeypatch.setattr(terminal, "DELAY", -1.0)
    monkeypatch.setenv("CI", "")
    monkeypatch.setattr(sys, "stderr", Screen())
    with LiveTable(quiet=False) as live_table:
        live_table.start(["s"])
        live_table.show()
        live_table.say(words)
    assert f"NOT MET\x1b[0m, worst 60.2 at {place.rstrip()}" in sys.stderr.getvalue()
    monkeypatch.setenv("NO_COLOR", "1")
    assert terminal.coloured(words, Screen()) == words


@pytest.mark.parametrize("width", [60, 80])
def test_no_line_is_broken_inside_a_word(width, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    words = "s: run: requirement: kinematics.extremes.rocker.angle.range at least 65: NOT MET, worst 60.2 at theta 5"
    for before in range(width):
        text = f"{'x' * before} {words}"
        shown = terminal.readable(text, Screen())
        assert "\x1b[1;31m" in shown
        lines = re.sub("\x1b.*?m", "", shown).split("\n")
        assert max(map(len, lines)) <= width
        assert " ".join(line.strip() for line in lines) == text.strip()
    assert terminal.folded(words, io.StringIO()) == words


def test_a_sweep_shows_what_varies_and_the_verdict_first_in_80_columns(folder, invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(terminal, "is_terminal", lambda: True)
    judged = SLIDER + "requirements: [{result: kinematics.extremes.B.x.max, at_most: 200}]\n"
    (folder / "slider.yaml").write_text(judged.replace("step: 45}}", "step: 45}}\n  outputs: [B.x, rod.angle]"))
    asked = "kinematics.extremes.B.x.range,kinematics.rod.angle.peak"
    varied = ("--vary", "mechanism.parameters.r=38,40", "--vary", "mechanism.links.rod.2=110,120")
    shown = invoke("sweep", "slider.yaml", *varied, "--results", asked, "--no-plots").stdout
    table = shown.splitlines()[:8]
    head = [line.split() for line in table]
    assert max(map(len, table)) <= 80
    assert head[:3] == [
        ["kinematics.", "kinematics.rod."],
        ["r", "links.rod.2", "extremes.B.x.range", "angle.peak"],
        ["case", "[mm]", "[mm]", "verdict", "[mm]", "[deg]"],
    ]
    assert [line[:4] for line in head[3:7]] == [
        ["1", "38", "110", "met"], ["2", "38", "120", "met"], ["3", "40", "110", "met"], ["4", "40", "120", "met"]
    ]  # fmt: skip


def test_run_says_the_rows_and_the_folder_of_an_answer_once(folder, analysis, invoke, monkeypatch):
    piped = invoke("run", "slider.yaml", "--no-plots")
    assert "slider: kinematics: 3 rows in results/slider/kinematics" in piped.stderr
    monkeypatch.setattr(terminal, "is_terminal", lambda: True)
    shown = invoke("run", "slider.yaml", "--no-plots")
    assert "3 rows" not in shown.stderr
    assert shown.stderr.splitlines()[-1] == "results in results/slider"
    assert [line.split()[:3] for line in shown.stdout.splitlines()[:2]] == [
        ["study", "command", "outcome"], ["slider", "kinematics", "done"]
    ]  # fmt: skip


def test_what_does_not_fit_is_listed_without_a_break_in_a_word(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(terminal, "is_terminal", lambda: True)
    rest = Path("a-folder-with-a-long-name") / "motion-of-the-crank-and-the-rod.csv"
    terminal.show(summary([Outcome("s", "kinematics", Path(), 1, 0)]), as_json=False, rest=rest)
    assert str(rest) in capsys.readouterr().out.splitlines()


def test_a_wrong_option_is_told_in_lines_that_break_between_words(tmp_path):
    code, shown = at_terminal(tmp_path, 0.0, "--no-plotz", "an_argument_that_no_command_takes_after_the_study")
    assert code == 2
    lines = shown.replace("\r", "").strip().splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert lines[0].startswith("mechdesign kinematics: no such option: --no-plotz")
    assert "--no-plots" in " ".join(lines)
    assert lines[-1] == "mechdesign kinematics -h says what it takes"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nope"], "mechdesign: no such command 'nope'"),
        (["watch"], "mechdesign watch: missing argument"),
        (["kinematics", "slider.yaml", "--jobs", "x"], "mechdesign kinematics: invalid value for '--jobs'"),
        (["--nope"], "mechdesign: no such option: --nope"),
    ],
    ids=["command", "argument", "number", "option"],
)
def test_a_wrong_command_line_is_told_without_usage_lines(arguments, words, invoke):
    done = invoke(*arguments)
    assert done.exit_code == 2
    assert done.stderr.startswith(words)
    assert "Usage" not in done.stderr
    assert len(done.stderr.splitlines()) == 2
