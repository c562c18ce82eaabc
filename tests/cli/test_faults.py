"""Faults of processes and files: signals, streams that fail, full disks, two runs in one folder."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import platform
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import mechdesign
from mechdesign.door.report.writer import write_file
from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import OutputError, StudyError, explain
from mechdesign.ground.files import Transaction, owned
from mechdesign.ground.records import remove_recorded
from mechdesign.ground.results import Result, Table

from .conftest import SLIDER, answer
from .test_optimize_resume import METHODS, STUDY

if sys.platform != "linux":
    pytest.skip("processes are looked at in /proc", allow_module_level=True)

ARM = STUDY.replace("METHOD", "grid").replace("NUMBER", METHODS["grid"].replace("40", "3000"))
COMMAND = [sys.executable, "-m", "mechdesign"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.yaml").write_text(ARM)
    (tmp_path / "slider.yaml").write_text(SLIDER)
    return tmp_path


def children(pid):
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def until(condition, seconds=30.0):
    """Wait for a condition, and give what it gives."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.005)
    return found


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize(
    "number", [signal.SIGKILL, *(pytest.param(n, marks=pytest.mark.nightly) for n in (signal.SIGTERM, signal.SIGHUP))]
)
def test_workers_end_with_their_parent(here, number):
    command = [*COMMAND, "optimize", "arm.yaml", "--no-plots", "--jobs", "2", "--out", "out"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        workers = until(lambda: len(found := children(process.pid)) == 2 and found)
        time.sleep(0.3)
        process.send_signal(number)
        try:
            # Ends when nobody holds the other end.
            _, told = process.communicate(timeout=30)
            until(lambda: not any(map(alive, workers)), 5)
        finally:
            for each in filter(alive, (process.pid, *workers)):
                os.kill(each, signal.SIGKILL)
    if number == signal.SIGKILL:
        assert process.returncode == -number
    else:
        assert process.returncode == 128 + number
        assert "interrupted" in told
    assert "Traceback" not in told
    assert not [path for path in here.rglob("*") if ".tmp" in path.name]


def hears(pid):
    """Whether a process handles SIGTERM, as Python does by itself not."""
    caught = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return int(caught[1], 16) >> (signal.SIGTERM - 1) & 1


@pytest.mark.parametrize("module", ["", "_multiarray_umath", "pydantic_core"])
def test_an_interrupt_during_imports(here, module):
    """It comes while a module is loaded, which its library in the memory shows."""
    command = [*COMMAND, "kinematics", "slider.yaml", "--no-plots"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        until(lambda: hears(process.pid))
        until(lambda: process.poll() is not None or module in Path(f"/proc/{process.pid}/maps").read_text())
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30)
    assert process.returncode in (0, 130)
    assert "Traceback" not in told
    assert "rror" not in told


def test_signals_wait_before_anything_is_imported():
    """One that comes earlier ends Python itself, with a traceback."""
    text = "import sys; known = {*sys.modules}; import mechdesign.__main__; print(*sorted({*sys.modules} - known))"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["__future__", "mechdesign", "mechdesign.__main__"]


# What a command does when it is interrupted: in a call back, whose errors are dropped; in an import; in a text that is
# evaluated, which Python keeps for its end; in a finaliser; while it blocks signals and another thread lets them in; in
# the queue that work goes to.
INTERRUPTED = {
    "call back": """
        thing = type("Thing", (), {})()
        reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
        del thing
    """,
    "import": """
        pathlib.Path("slow.py").write_text("import signal; signal.raise_signal(signal.SIGINT); print('whole')")
        sys.path.insert(0, "")
        import slow
    """,
    "evaluated": """
        eval("signal.raise_signal(signal.SIGINT) or print('whole')")
    """,
    "long evaluation": """
        signal.raise_signal(signal.SIGINT)
        print("whole")
        eval("time.sleep(60)")
    """,
    "finaliser": """
        class Thing:
            def __del__(self):
                signal.raise_signal(signal.SIGINT)
                print("whole")
        Thing()
    """,
    "blocked": """
        threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        os.kill(os.getpid(), signal.SIGINT)
        whole = sum(range(1_000_000))
        print("whole")
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    """,
    "compiled": """
        import scipy.stats.qmc
        import scipy.stats._sobol
        files = scipy.stats._sobol.importlib.resources.files
        def slow(package):
            signal.raise_signal(signal.SIGINT)
            return files(package)
        scipy.stats._sobol.importlib.resources.files = slow
        scipy.stats.qmc.Sobol(2)
        print("whole")
    """,
    "queue": """
        class Queue(queue.Queue):
            def _put(self, item):
                signal.raise_signal(signal.SIGINT)
                print("whole")
        Queue().put(1)
    """,
}


@pytest.mark.parametrize("where", INTERRUPTED)
def test_an_interrupt_at_a_bad_place_comes_a_little_later(here, where):
    words = "import os, pathlib, queue, signal, sys, threading, time, weakref\nfrom mechdesign.door.cli import process"
    text = f"{words}\ndef command():\n{INTERRUPTED[where]}\n        time.sleep(60)\nprocess.run(command)"
    (here / "command.py").write_text(text)
    done = subprocess.run([sys.executable, "-m", "command"], capture_output=True, text=True, check=False, timeout=30)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")
    assert done.stdout == ("" if where == "call back" else "whole\n")


BAD = ("closed", "full", "broken")


@pytest.mark.parametrize("stream", [1, pytest.param(2, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("how", BAD)
def test_a_stream_that_cannot_be_written(here, stream, how):
    """The run goes on; only a summary that was to be kept, and is not, changes its exit code."""

    def spoil():
        if how == "closed":
            os.close(stream)
        elif how == "full":
            os.dup2(os.open("/dev/full", os.O_WRONLY), stream)
        else:
            reader, writer = os.pipe()
            os.close(reader)
            os.dup2(writer, stream)

    gate = SLIDER + "requirements: [{result: kinematics.theta, at_most: 80}]\n"
    (here / "gate.yaml").write_text(gate)
    command = [*COMMAND, "run", "slider.yaml", "gate.yaml", "--no-plots", "--junit", "junit.xml"]
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=spoil, check=False, timeout=120)
    lost = (stream, how) == (1, "full")
    assert done.returncode == (4 if lost else 1)
    assert 'tests="3"' in (here / "junit.xml").read_text()
    assert (here / "results/slider/kinematics/manifest.json").exists()
    if stream == 2:
        assert done.stdout.startswith("study,command")
    else:
        assert "requirement not met" in done.stderr
        assert "Traceback" not in done.stderr
        assert ("standard output is not whole: No space left on device" in done.stderr) == lost


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def forked(call):
    """Process that calls a function with what this one has imported, and says nothing."""
    pid = os.fork()
    if not pid:
        try:
            call()
        finally:
            os._exit(9)
    return pid


def killed_at(instant, work):
    """Do work in a process that is killed after so many files were renamed or removed."""
    steps = []

    def last(step):
        def counted(*given, **options):
            if len(steps) == instant:
                os.kill(os.getpid(), signal.SIGKILL)
            steps.append(step)
            return step(*given, **options)

        return counted

    def killed():
        os.replace, Path.unlink = last(os.replace), last(Path.unlink)
        work()

    os.waitpid(forked(killed), 0)


def table(value, columns=3):
    """A result of several tables, large enough to be cut off in."""
    names = [f"t{k}" for k in range(columns)]
    made = {name: Table(name, (Column("x", np.full(20_000, float(value))),)) for name in names}
    return Result("kinematics", made)


def test_a_kill_at_any_instant_leaves_whole_files(here, analysis, invoke):
    """Old results of other tables are there; the resumed ones are those of an undisturbed run."""
    arguments = ("kinematics", "slider.yaml", "--no-plots", "--quiet", "--out")
    analysis(lambda study, **options: table(study.seed, 5 - study.seed))
    begun = time.monotonic()
    invoke(*arguments, "new", "--seed", 2)
    took = time.monotonic() - begun
    new = contents(here / "new")
    broken = []
    # On a busy machine many come too early: then later ones are tried.
    for k, part in enumerate(np.random.default_rng(1).random(60)):
        if len(broken) >= 8 and any(broken):
            break
        shutil.rmtree(here / "out", ignore_errors=True)
        invoke(*arguments, "out", "--seed", 1)
        old = contents(here / "out")
        pid = forked(lambda: invoke(*arguments, "out", "--seed", 2))
        time.sleep(part * took * (1 + k / 8))
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        left = contents(here / "out")
        for name, data in left.items():
            assert name.startswith(".") or data in (old.get(name), new.get(name)), name
        if "manifest.json" in left:
            whole = {name: data for name, data in left.items() if not name.startswith(".")}
            assert whole in (old, new)
        broken.append({*left} - {*old})
        assert invoke(*arguments, "out", "--seed", 2).exit_code == 0
        assert contents(here / "out") == new
    assert any(broken)


@pytest.mark.nightly
@pytest.mark.parametrize("instant", [0, 1, 2, 3, 4, 6, 8, 10, 12])
def test_a_kill_between_two_files(here, analysis, invoke, monkeypatch, instant):
    """The n-th step on the way of files into place is the last one."""
    arguments = ("run", "slider.yaml", "--no-plots", "--quiet", "--resume", "--out")
    analysis(lambda study, **options: table(study.seed, 5 - study.seed))
    invoke(*arguments, "new", "--seed", 2)
    invoke(*arguments, "out", "--seed", 1)
    old, new = contents(here / "out"), contents(here / "new")
    killed_at(instant, lambda: invoke(*arguments, "out", "--seed", 2))
    left = contents(here / "out")
    assert "manifest.json" not in left or {name: left[name] for name in left if name[0] != "."} in (old, new)
    assert invoke(*arguments, "out", "--seed", 2).exit_code == 0
    assert contents(here / "out") == new


@pytest.mark.parametrize("instant", [4, 5, 6, 7, 8, 9])
def test_a_kill_among_the_pictures_leaves_files_that_are_known(here, analysis, invoke, instant):
    """The run is begun again: the tables, which no manifest vouches for while pictures come, are nobody else's."""
    arguments = ("run", "slider.yaml", "--quiet", "--out", "out")
    analysis(lambda study, **options: table(study.seed, 1))
    killed_at(instant, lambda: invoke(*arguments))
    assert (here / "out/kinematics/t0.csv").exists()
    done = invoke(*arguments)
    assert done.exit_code == 0, done.stderr
    assert contents(here / "out").keys() == {"t0.csv", "mechanism.png", "manifest.json"}


def test_a_full_disk_leaves_the_old_results(here, analysis, invoke, monkeypatch):
    analysis(lambda study, **options: table(study.seed))
    arguments = ("run", "slider.yaml", "--no-plots", "--out", "out", "--seed")
    assert invoke(*arguments, 1).exit_code == 0
    old = contents(here / "out")
    stage = Transaction.stage

    def full(self, name, blocks):
        def some():
            yield next(iter(blocks))
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        return stage(self, name, some() if name == "t1.csv" else blocks)

    monkeypatch.setattr(Transaction, "stage", full)
    done = invoke(*arguments, 2, "--junit", "junit.xml")
    assert done.exit_code == 4
    assert "results could not be written: No space left on device" in done.stderr
    assert "No space left" in (here / "junit.xml").read_text()
    assert contents(here / "out") == old


def test_a_folder_is_of_one_process(here, analysis, invoke):
    """While one run computes another is told who it is; a killed one is in nobody's way."""
    reader, writer = os.pipe()

    def slow(study, **options):
        os.write(writer, b"x")
        time.sleep(60)

    quick = table(1)
    analysis(slow)
    arguments = ("run", "slider.yaml", "--no-plots", "--out", "out")
    pid = forked(lambda: invoke(*arguments))
    os.read(reader, 1)
    (here / "out/kinematics/.mechdesign.t0.csv.99999999.tmp").write_text("half")
    analysis(lambda study, **options: quick)
    done = invoke(*arguments)
    assert done.exit_code == 4
    assert f"process {pid} on {platform.node()} writes there" in done.stderr
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    assert invoke(*arguments).exit_code == 0
    assert set(contents(here / "out")) == {"t0.csv", "t1.csv", "t2.csv", "manifest.json"}


def test_a_folder_is_free_though_the_workers_of_a_killed_run_live(tmp_path):
    """As those of an executor of the user's may, which were forked while the folder was kept."""
    reader, writer = os.pipe()

    def own():
        with owned(tmp_path):
            os.write(writer, f"{forked(lambda: time.sleep(60))}\n".encode())
            time.sleep(60)

    pid = forked(own)
    worker = int(os.read(reader, 100))
    with pytest.raises(OutputError, match=f"process {pid} on"), owned(tmp_path):
        pass
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    try:
        with owned(tmp_path):
            assert alive(worker)
    finally:
        os.kill(worker, signal.SIGKILL)


def test_no_file_is_put_in_place_of_a_device_or_a_link(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    read = []
    thread = threading.Thread(target=lambda: read.append((tmp_path / "pipe").read_bytes()), daemon=True)
    thread.start()
    write_file(tmp_path / "pipe", b"words")
    thread.join(10)
    assert read == [b"words"]
    (tmp_path / "link").symlink_to("file")
    with pytest.raises(StudyError, match="link: is a link"):
        write_file(tmp_path / "link", b"words")
    assert not (tmp_path / "file").exists()


def test_processes_that_write_beside_one_another_know_all_of_their_files(tmp_path):
    """Of two jobs with a JUnit file each in one folder none takes that of the other for a stranger's."""
    names = [f"report_{k}.xml" for k in range(3)]

    def write(name):
        for _ in range(30):
            write_file(tmp_path / name, name.encode())
        remove_recorded(tmp_path / name)
        write_file(tmp_path / name, name.encode())
        os._exit(0)

    for pid in [forked(partial(write, name)) for name in names]:
        assert os.waitpid(pid, 0)[1] == 0
    listed = json.loads((tmp_path / ".mechdesign.json").read_text())["files"]
    assert listed == {name: [hashlib.sha256(name.encode()).hexdigest()] for name in names}


@pytest.mark.parametrize(
    "damage", ["", "[]", "{}", "[" * 100_000, '{"files": {"..": "", "": "", "a\\u0000b": ""}}', "tables", "bytes"]
)
def test_a_damaged_manifest_is_no_manifest(here, analysis, invoke, damage):
    analysis(lambda study, **options: table(1))
    arguments = ("run", "slider.yaml", "--no-plots", "--resume", "--out", "out")
    invoke(*arguments)
    whole = contents(here / "out")
    path = here / "out/kinematics/manifest.json"
    if damage == "tables":
        damage = json.dumps({key: value for key, value in json.loads(path.read_text()).items() if key != "tables"})
    path.write_bytes(b"\xff" if damage == "bytes" else damage.encode())
    done = invoke(*arguments)
    if "tool" in damage:
        assert done.exit_code == 0, done.stderr
        assert "kept" not in done.stdout
        assert contents(here / "out") == whole
    else:
        # Nobody knows whose the files are.
        assert done.exit_code == 2
        assert "manifest.json: is no result of mechdesign's" in done.stderr
        assert (here / "out/kinematics/t0.csv").read_bytes() == whole["t0.csv"]


def test_folders_and_patterns(here, invoke):
    (here / "deep").mkdir()
    for name in ("b", "a", "c"):
        (here / f"deep/{name}.yaml").write_text(SLIDER)
    (here / "deep/notes.txt").write_text("none")
    (here / "deep/.gitlab-ci.yml").write_text("stages: [test]")
    (here / "deep/c.yaml").rename(here / "deep/c.yml")
    done = invoke("run", "deep", "deep/[ab].yaml", here / "deep/c.yml", "--no-plots", "--out", "out")
    assert done.exit_code == 0, done.stderr
    assert [row.split(",")[0] for row in done.stdout.splitlines()] == ["study", "a", "b", "c"]
    assert (here / "out/summary.csv").read_text() == done.stdout
    (here / "empty").mkdir()
    for nothing in ("empty", "deep/*.yamll"):
        done = invoke("run", nothing)
        assert (done.exit_code, "no studies" in done.stderr) == (2, True)


def test_failures_are_told_at_the_end_and_to_github(here, analysis, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    analysis(lambda study, **options: answer(warnings=[Caution("suspect", "50 % play, mind the gap")]))
    gate = "requirements:\n  - {result: kinematics.theta, at_least: 0}\n  - {result: kinematics.theta, at_most: 80}\n"
    (here / "gate.yaml").write_text(SLIDER + gate)
    (here / "wrong.yaml").write_text(SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]"))
    done = invoke("run", "gate.yaml", "wrong.yaml", "slider.yaml", "--no-plots", "--quiet")
    assert done.exit_code == 2
    lines = done.stderr.splitlines()
    assert any(line.startswith("::error file=wrong.yaml,line=6,col=19::mechanism.links.crank") for line in lines)
    assert any(line.startswith("::error file=gate.yaml,line=16,col=") and "theta at most 80" in line for line in lines)
    assert "::warning file=gate.yaml::gate: kinematics: 50 %25 play, mind the gap" in lines
    at = lines.index("failed: 2 of 3 questions")
    assert [line.split(":")[0].strip() for line in lines[at + 1 :]] == ["gate", "wrong"]


def test_every_command_tells_github_with_paths_from_its_workspace(here, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_WORKSPACE", str(here.parent))
    (here / "gate.yaml").write_text(SLIDER + "requirements: [{result: kinematics.theta, at_most: 80}]\n")
    (here / "wrong.yaml").write_text(SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]"))

    def told(*arguments):
        lines = invoke(*arguments, "--no-plots").stderr.splitlines()
        return [line for line in lines if line.startswith("::")]

    place = f"::error file={here.name}/"
    for command in (["run"], ["kinematics"], ["sweep", "--vary", "mechanism.parameters.r=30"]):
        (line,) = told(command[0], "gate.yaml", *command[1:])
        assert line.startswith(f"{place}gate.yaml,line=14,col=16::requirements.0: requirement: kinematics.theta")
    for command in ("run", "kinematics", "check"):
        (line,) = told(command, "wrong.yaml")
        assert line.startswith(f"{place}wrong.yaml,line=6,col=19::mechanism.links.crank.2: ")
        # An option is no file.
        (line,) = told(command, "gate.yaml", "--set", "kinematics.rate=3")
        assert line.startswith("::error::--set kinematics.rate=3: kinematics.rate: unknown key")
    lines = told("kinematics", "slider.yaml", "--set", "kinematics={poses: [{theta: 0}, {B.x: 900}]}")
    (line,) = [line for line in lines if line.startswith("::error")]
    assert line.startswith(f"{place}slider.yaml::pose B.x = 900 mm")


def test_github_is_told_of_a_file_whatever_its_name(here, invoke, monkeypatch):
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    wrong = SLIDER.replace("crank: [O, A, r]", "crank: [O, A, q]")
    for name in ("<odd>.yaml", "-odd.yaml", "--set x.yaml"):
        (here / name).write_text(wrong)
        lines = invoke("check", f"./{name}", "--no-plots").stderr.splitlines()
        assert any(line.startswith(f"::error file={name},line=6,col=19::mechanism.links.crank") for line in lines), (
            lines
        )


@pytest.mark.parametrize("arguments", [("run", "slider.yaml"), ("kinematics",), ("check", "slider.yaml")])
def test_a_working_folder_that_was_removed_is_told(here, arguments):
    (here / "gone").mkdir()
    text = "import os, sys; os.chdir('gone'); os.rmdir('../gone'); import mechdesign.__main__"
    command = [sys.executable, "-c", f"{text}; sys.argv = ['mechdesign', *{arguments!r}]; mechdesign.__main__.main()"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert done.stderr.startswith("the working folder is not there any more"), done.stderr


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["MPLCONFIGDIR", "HOME"])
def test_matplotlib_says_nothing_of_its_cache(here, name):
    nowhere = {"MPLCONFIGDIR": "", "XDG_CACHE_HOME": "", "XDG_CONFIG_HOME": "", name: "/proc/nowhere"}
    environment = os.environ | {key: value for key, value in nowhere.items() if value}
    for key in nowhere.keys() - {key for key, value in nowhere.items() if value}:
        environment.pop(key, None)
    command = [*COMMAND, "kinematics", "slider.yaml", "--out", "out"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "slider: kinematics: 3 rows in out\n")


def test_inputs_of_one_name_are_told_apart(here, invoke):
    """Results are kept by what the files hold, each of them."""
    for name in ("one", "two"):
        (here / name).mkdir()
        (here / name / "line.csv").write_text("P.x,P.y\n6,4\n5,5\n")
    text = STUDY[: STUDY.index("kinematics:")] + "kinematics:\n  path: {P.x: one/x.csv, P.y: two/x.csv}\n"
    for name in ("one", "two"):
        (here / name / "x.csv").write_text("6\n5\n")
    (here / "two_inputs.yaml").write_text(text)
    arguments = ("run", "two_inputs.yaml", "--no-plots", "--resume")
    assert invoke(*arguments).exit_code == 0
    assert "kept" in invoke(*arguments).stdout
    for name in ("one", "two"):
        (here / name / "x.csv").write_text("6\n4\n")
        assert "kept" not in invoke(*arguments).stdout


@pytest.mark.nightly
def test_a_poor_environment(here):
    """No home, no locale, few files: names of other letters stay whole on the disk."""
    (here / "größe.yaml").write_text("name: Größe → µm\n" + SLIDER.partition("\n")[2], encoding="utf-8")
    command = [*COMMAND, "run", "größe.yaml", "slider.yaml", "--out", "aus/größe", "--jobs", "4"]

    def few():
        resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64))

    done = subprocess.run(command, env={"LC_ALL": "C"}, capture_output=True, preexec_fn=few, check=False, timeout=120)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr
    manifest = json.loads((here / "aus/größe/größe/kinematics/manifest.json").read_text(encoding="utf-8"))
    assert manifest["study"]["name"] == "Größe → µm"
    assert any(name.endswith(".png") for name in manifest["files"])


ARM_IN_POSES = """
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, P, 100]}
  drives: [arm]
  sketch: {P: [100, 0]}
stiffness: {at: P, actuators: {arm: 4.0e+7}, sweep: {arm: {from: 0, to: 90, number: 90}}}
"""


def test_a_limit_of_memory(here, invoke):
    """The stiffness in nine million poses in 0.45 GB: a message, and what was there before."""
    (here / "arm.yaml").write_text(ARM_IN_POSES, encoding="utf-8")
    arguments = ("stiffness", "arm.yaml", "--no-plots", "--out", "out")
    assert invoke(*arguments).exit_code == 0
    old = contents(here / "out")

    def little():
        resource.setrlimit(resource.RLIMIT_AS, (450_000_000, 450_000_000))

    great = ["--set", "stiffness.sweep.arm.number=9000000"]
    done = subprocess.run(
        [*COMMAND, *arguments, *great],
        capture_output=True,
        text=True,
        preexec_fn=little,
        check=False,
        timeout=120,
    )
    assert done.returncode == 4
    assert done.stderr.splitlines()[-1].startswith("not enough memory for this")
    assert contents(here / "out") == old


def lacking(error):
    """An error that clearing up met after memory ran out."""
    try:
        raise error
    except Exception:
        try:
            raise ValueError("I/O operation on closed file.")
        except ValueError as second:
            return second


@pytest.mark.parametrize(
    ("error", "known"),
    [
        (lacking(MemoryError()), True),
        (lacking(KeyError("x")), False),
        (ImportError("libopenblas.so: failed to map segment from shared object"), True),
        (RuntimeError("can't start new thread"), True),
        (OSError(errno.ENOMEM, os.strerror(errno.ENOMEM)), True),
    ],
)
def test_a_lack_of_memory_is_known_whoever_meets_it(error, known):
    assert explain(error)[1].startswith("not enough memory" if known else "internal error")


@pytest.mark.nightly
def test_too_few_files_for_the_workers(here):
    """Those that were forked before there was no room do not wait for work for ever."""
    command = [*COMMAND, "optimize", "arm.yaml", "--no-plots", "--jobs", "8"]

    def few():
        resource.setrlimit(resource.RLIMIT_NOFILE, (20, 20))

    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=few, check=False, timeout=60)
    assert done.returncode == 4
    assert done.stderr.splitlines()[-1].startswith("too many files would be open at once")


def test_places_that_are_no_folders(here, invoke):
    (here / "loop").symlink_to("loop")
    for out in ("slider.yaml", "slider.yaml/deep", "loop", "loop/deep", 300 * "a"):
        done = invoke("run", "slider.yaml", "--no-plots", "--out", out)
        assert done.exit_code == 4, out
        assert "results cannot be written there" in done.stderr
        assert "internal" not in done.stderr
    assert invoke("run", "loop/slider.yaml").exit_code == 2
    assert invoke("run", "slider.yaml", "--jobs", 100_000).exit_code == 2
    assert (here / "slider.yaml").read_text() == SLIDER


def test_a_study_that_is_edited_while_it_runs(here, analysis, invoke):
    """The results are those of the text that was read, and say so."""

    def edit(study, **options):
        (here / "slider.yaml").write_text(SLIDER + "# edited\n")
        return table(1)

    analysis(edit)
    arguments = ("run", "slider.yaml", "--no-plots", "--resume", "--out", "out")
    assert invoke(*arguments).exit_code == 0
    told = json.loads((here / "out/kinematics/manifest.json").read_text())
    assert told["study"]["sha256"] == hashlib.sha256(SLIDER.encode()).hexdigest()
    assert "kept" not in invoke(*arguments).stdout
    assert "kept" in invoke(*arguments).stdout


def test_a_study_is_read_once(here, analysis, invoke):
    """The second of two, that is edited while the first is computed; and one from a pipe, which has it once."""

    def edit(study, **options):
        (here / "two.yaml").write_text(SLIDER + "stiffness: {at: B}\n")
        return table(1)

    (here / "two.yaml").write_text(SLIDER)
    analysis(edit)
    assert invoke("run", "slider.yaml", "two.yaml", "--no-plots", "--out", "out", "--jobs", 1).exit_code == 0
    told = json.loads((here / "out/two/kinematics/manifest.json").read_text())
    assert told["study"]["sha256"] == hashlib.sha256(SLIDER.encode()).hexdigest()
    os.mkfifo(here / "pipe")
    threading.Thread(target=(here / "pipe").write_text, args=[SLIDER], daemon=True).start()
    done = invoke("run", "pipe", "--no-plots")
    assert done.exit_code == 0, done.stderr


def test_an_input_that_changes_while_it_is_computed(here, invoke, monkeypatch):
    """The manifest vouches for what was read; the next run sees the change."""
    (here / "x.csv").write_text("6\n5\n")
    (here / "arm.yaml").write_text(
        STUDY[: STUDY.index("kinematics:")] + "kinematics:\n  path: {P.x: x.csv, P.y: [6, 6]}\n"
    )
    arguments = ("run", "arm.yaml", "--no-plots", "--resume", "--out", "out")
    compute = mechdesign.kinematics

    def change(study, **options):
        (here / "x.csv").write_text("6\n4\n")
        return compute(study, **options)

    monkeypatch.setattr(mechdesign, "kinematics", change)
    assert invoke(*arguments).exit_code == 0
    first = (here / "out/kinematics/motion.csv").read_text()
    inputs = json.loads((here / "out/kinematics/manifest.json").read_text())["inputs"]
    assert inputs == {"x.csv": hashlib.sha256(b"6\n5\n").hexdigest()}
    assert "kept" not in invoke(*arguments).stdout
    assert (here / "out/kinematics/motion.csv").read_text() != first
