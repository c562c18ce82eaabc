"""The command line where processes are not forked, signals are few and open files stay, as on Windows: the same bytes.

What such systems lack is taken from Python in every process of a command, those that it starts, too.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .conftest import SLIDER

psutil = pytest.importorskip("psutil")

LACKING = """
import builtins, ctypes, io, multiprocessing, os, re, signal, sys

for module, names in {
    os: ("fork", "forkpty", "O_NOFOLLOW", "O_NONBLOCK", "sched_getaffinity", "sysconf", "getuid", "geteuid", "killpg"),
    signal: ("SIGHUP", "SIGALRM", "setitimer", "pthread_sigmask", "pthread_kill"),
}.items():
    for name in names:
        delattr(module, name)
for name in ("fcntl", "grp", "pwd", "resource", "termios"):
    sys.modules[name] = None
FORBIDDEN = re.compile(r'(?i)(con|prn|aux|nul|com\\d|lpt\\d)(\\..*)?|.*[<>:"|?*\\\\].*|.*[. ]')


def is_open(path):
    for number in os.listdir("/proc/self/fd"):
        try:
            if os.path.samestat(os.fstat(int(number)), os.stat(path)):
                return True
        except OSError:
            pass
    return False


# An open file is neither replaced nor removed, and some names are none.
def careful(call, count):
    def inner(*paths, **further):
        if any(isinstance(path, (str, os.PathLike)) and is_open(path) for path in paths[:count]):
            raise PermissionError(13, "The process cannot access the file", str(paths[0]))
        return named(call, count - 1)(*paths, **further)
    return inner


def named(call, number=0):
    def inner(*given, **further):
        if isinstance(given[number], (str, os.PathLike)) and FORBIDDEN.fullmatch(os.path.basename(given[number])):
            raise OSError(22, "The filename, directory name, or volume label syntax is incorrect", str(given[number]))
        return call(*given, **further)
    return inner


os.replace, os.unlink, os.remove = careful(os.replace, 2), careful(os.unlink, 1), careful(os.remove, 1)
os.mkdir, io.open = named(os.mkdir), named(io.open)
builtins.open = io.open


class Library(ctypes.CDLL):
    def __getattr__(self, name):
        if name == "prctl":
            raise AttributeError(name)
        return super().__getattr__(name)


ctypes.CDLL = Library
multiprocessing.set_start_method("spawn")

# Workers begin with the first work, however short it is.
from mechdesign.ground.work import pool

pool._FRESH = 1e-9
"""
ARM = """
mechanism:
  parameters: {l: 90}
  links: {ground: {O: [0, 0]}, upper: [O, A, 120], lower: [A, P, l]}
  drives: {shoulder: {angle: upper}, elbow: {angle: lower}}
  sketch: {A: [100, 60], P: [150, 140]}
kinematics:
  sweep: {shoulder: {from: 0, to: 90, number: 4}, elbow: {from: 10, to: 90, number: 5}}
reliability:
  poses: [{shoulder: 30, elbow: 60}, {shoulder: 20, elbow: 80}]
  outputs: [P.x, P.y]
  dimensions: {upper.length: {sigma: 0.05}, lower.length: {sigma: 0.05}}
  limits: {P.x: 0.15, P.y: 0.15}
  methods: [analytic, monte_carlo]
  samples: 90000
  sobol: 0
optimize:
  variables: {l: {from: 60, to: 110, step: 5}}
  method: grid
  maximize: [kinematics.P.x.max]
matrix: {vary: {mechanism.parameters.l: [70, 80, 90, 100]}, results: [reliability.moments.sigma.max]}
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    long = ARM[: ARM.index("kinematics:")] + ARM[ARM.index("reliability:") : ARM.index("optimize:")]
    long = long.replace("90000", "2000000000")
    for name, text in {"arm": ARM, "long": long, "longer": long, "slider": SLIDER}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    (tmp_path / "lacking").mkdir()
    (tmp_path / "lacking/sitecustomize.py").write_text(LACKING)
    return tmp_path


def begin(*arguments):
    """Begin a command on such a system; it leads a group of processes, as one on a terminal."""
    paths = [str(Path("lacking").absolute()), *filter(None, [os.environ.get("PYTHONPATH")])]
    script = [] if arguments[0].endswith(".py") else ["-m", "mechdesign"]
    return subprocess.Popen(
        [sys.executable, *script, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)}, start_new_session=True,
    )  # fmt: skip


def ended(process):
    """Exit code, output and messages of a command, within a minute or two."""
    try:
        return *process.communicate(timeout=120), process.returncode
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)


def workers(process, busy=0.0):
    """Processes of Python that a command has started, once there are two, the busiest last, for so many seconds."""
    end = time.monotonic() + 100
    while time.monotonic() < end and process.poll() is None:
        there = [each for each in psutil.Process(process.pid).children() if "spawn_main" in " ".join(each.cmdline())]
        there.sort(key=lambda each: each.cpu_times().user)
        if len(there) == 2 and there[-1].cpu_times().user > busy:
            return there
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    raise AssertionError(process.communicate())


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "command",
    [
        ("kinematics", "slider.yaml", "--report"),
        pytest.param(("reliability", "arm.yaml", "--no-plots"), marks=pytest.mark.nightly),
        ("optimize", "arm.yaml", "--no-plots"),
        pytest.param(("sweep", "arm.yaml", "--no-plots"), marks=pytest.mark.nightly),
        ("run", "arm.yaml", "slider.yaml", "--no-plots"),
    ],
)
def test_the_same_bytes(here, invoke, command):
    output, told, code = ended(begin(*command, "--jobs", 2, "--out", "out"))
    Path("out").rename("there")
    done = invoke(*command, "--jobs", 1, "--out", "out")
    # How far it is, a slow machine is told.
    told = "".join(line for line in told.splitlines(keepends=True) if "Ctrl-C ends it" not in line)
    assert (code, output, told) == (0, done.stdout, done.stderr)
    assert contents(here / "there") == contents(here / "out")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("command", "told"),
    [
        (("reliability", "long.yaml"), "long: reliability: interrupted"),
        (("run", "long.yaml", "longer.yaml"), "interrupted; what was finished is whole"),
    ],
)
def test_ctrl_c(here, command, told):
    """It comes to all processes of a terminal; what was simulated is kept."""
    with begin(*command, "--no-plots", "--jobs", 2, "--out", "out") as process:
        there = workers(process, 2.0)
        os.killpg(process.pid, signal.SIGINT)
        begun = time.monotonic()
        _, said, code = ended(process)
    assert code == 130
    assert time.monotonic() - begun < 20
    assert told in said
    assert "Traceback" not in said
    assert list((here / "out").rglob("moments.csv"))
    assert not any(each.is_running() for each in there)


@pytest.mark.nightly
def test_a_script_without_a_guard(here):
    """New processes do not run it again."""
    (here / "script.py").write_text("""
import mechdesign
study = mechdesign.load("arm.yaml")
one, two = (mechdesign.reliability(study, jobs=jobs).tables["reliability"]["failure"] for jobs in (1, 2))
print(*(one == two))
""")
    output, told, code = ended(begin("script.py"))
    assert (output, told, code) == ("True True True True\n", "", 0)


@pytest.mark.nightly
def test_a_worker_that_dies(here, invoke):
    """Its chunks are computed again."""
    command = ("reliability", "arm.yaml", "--set", "reliability.samples=1000000", "--no-plots", "--jobs")
    with begin(*command, 2, "--out", "there") as process:
        workers(process, 0.1)[0].kill()
        assert ended(process)[2] == 0
    assert invoke(*command, 1, "--out", "here").exit_code == 0
    assert contents(here / "there") == contents(here / "here")


def test_a_process_that_dies_costs_its_study(here):
    with begin("run", "long.yaml", "slider.yaml", "--no-plots", "--jobs", 2, "--out", "out") as process:
        workers(process, 2.0)[-1].kill()
        output, told, code = ended(process)
    assert code == 4, told
    assert "long: run: the process that computed it was killed" in told
    assert "slider,kinematics,done" in output


def test_workers_end_with_a_command_that_is_killed(here):
    with begin("reliability", "long.yaml", "--no-plots", "--jobs", 2) as process:
        there = workers(process, 0.1)
        process.kill()
        psutil.wait_procs(there, timeout=10)
        assert not any(each.is_running() for each in there)
        ended(process)
