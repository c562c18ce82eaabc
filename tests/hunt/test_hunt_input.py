"""Damaged studies and odd overrides: each command ends in time, with an exit code, a message and whole files.

Shipped studies, made small enough that each question takes a fraction of a second, have some of their values, keys and
parts replaced: by huge and tiny numbers, wrong kinds and units, words that mean something elsewhere, nothing at all.
Whatever comes out, nobody reads of internal errors or sees a warning of NumPy's (in the tests each is an error).

Sizes that say how much is wanted (poses, designs, samples) stay small, as a great job may take long; with all else a
small job stays one.
"""

from __future__ import annotations

import copy
import json
import resource
import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mechdesign import load
from mechdesign.commands import COMMANDS
from mechdesign.door.cli.app import app
from mechdesign.ground.errors import StudyError
from mechdesign.questions.dynamics import motion_in_time
from mechdesign.questions.optimize import variables
from mechdesign.study import motions, template
from mechdesign.study.templates import templates
from mechdesign.study.text.document import read

CONFIGS = Path(__file__).parents[2] / "configs"
SECONDS = 5
WAITING = 60  # times as long by the clock
MOST_TOLD = 50_000  # characters of a message
MOST_MEMORY = 1_000_000  # KB that a load or an answer may take
MOST_POSES = 20_000
MOST_DESIGNS = 2_000
MOST = {"samples": 100_000, "sobol": 10_000, "evaluations": 200, "rays": 1000, "nodes": 100}
CODES = {0, 1, 2, 3}
NUMBERS = (0, -1, 1, 3, 1e308, -1e308, 1.7e308, 1e154, 1e80, 1e20, 1e-20, 1e-154, 1e-308, 5e-324, 1e9, 721, 90, -400)
SCALES = (-1.0, 0.0, 1e-3, 0.1, 0.9, 1.1, 3.0, 1e3, 1e6, 1e12, 1e150, 1e300, 1e-12, 1e-150, 1e-300)
WORDS = (
    "", " ", "~", "x", "1/0", "sqrt(-1)", "10**400", "1e400", "-1e400", ".nan", ".inf", "nan", "inf", "1e308 mm",
    "3 m", "5 deg", "5 rad/s", "2 kN*m", "7 parsec", "3 mm^-9", "1e300 km", "1e-300 nm", "3 " + "*".join(["mm"] * 100),
    "3 " + "/".join(["mm"] * 40), "9" * 400, "0." + "0" * 400 + "1", "(" * 60 + "1" + ")" * 60, "a" * 5000, "Ünïcödé",
    "\u202e", "0x1F", "1_000", "2026-11-22", "on", "*.length", "*", "ground", "A.x", "min(1", "1,5", "${HOME}", "\x00",
)  # fmt: skip
KEYS = ("x", "from", "to", "length", "points", "", ".", "0", "-1", "a.b", "A", "ground", "ü", "k" * 300, "min", "file")


class TooLongError(BaseException):
    """A command did not end in time."""


@contextmanager
def in_time(seconds: float) -> Iterator[None]:
    def late(*arguments: object) -> None:
        raise TooLongError

    # Of the processor's time, for the machine may have other work; a wait without end is that of a clock.
    timers = ((signal.SIGPROF, signal.ITIMER_PROF, seconds), (signal.SIGALRM, signal.ITIMER_REAL, WAITING * seconds))
    before = {number: signal.signal(number, late) for number, *_ in timers}
    for _, timer, end in timers:
        signal.setitimer(timer, end)
    try:
        yield
    finally:
        for number, timer, _ in timers:
            signal.setitimer(timer, 0)
            signal.signal(number, before[number])


def small(data: dict) -> dict:
    """A study whose questions take little: few poses, samples and designs."""
    for command in ("kinematics", "reliability", "stiffness"):
        for each in ((data.get(command) or {}).get("sweep") or {}).values():
            if isinstance(each, dict):
                each.pop("step", None)
                each["number"] = 7
    if data.get("reliability"):
        data["reliability"] |= {"samples": 300}
        for key in ("precision", "sobol"):
            data["reliability"].pop(key, None)
    if data.get("optimize"):
        if data["optimize"].get("method", "grid") == "grid":
            for each in data["optimize"]["variables"].values():
                each.pop("step", None)
                each["number"] = 3
        else:
            data["optimize"]["evaluations"] = 20
    return data


def moderate(data: object) -> object:
    """A damaged study that asks for no more than `MOST` of anything."""
    if isinstance(data, list):
        return [moderate(each) for each in data]
    if not isinstance(data, dict):
        return data
    return {
        key: min(value, MOST[key]) if key in MOST and type(value) in (int, float) else moderate(value)
        for key, value in data.items()
    }


@pytest.fixture
def moderately(monkeypatch):
    monkeypatch.setattr(motions, "MAX_POSES", MOST_POSES)
    monkeypatch.setattr(variables, "MAX_DESIGNS", MOST_DESIGNS)
    monkeypatch.setattr(motion_in_time, "MAX_SECONDS", SECONDS / 5)


def studies() -> dict[str, dict]:
    found = {name: small(read(template(name).encode(), name).data) for name in templates()}
    for path in sorted(CONFIGS.rglob("*.yaml")):
        data = read(path.read_bytes(), path.name).data
        if not any(word in json.dumps(data) for word in (".csv", "rare", "importance")):
            found[path.stem] = small(data)
    return found


STUDIES = studies()


def spots(data: object, path: tuple = ()) -> Iterator[tuple]:
    """Paths of all entries of nested data."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from spots(value, (*path, key))


def at(data: object, path: tuple) -> object:
    for key in path:
        data = data[key]
    return data


def pick(rng: np.random.Generator, known: object) -> object:
    known = list(known)
    return known[rng.integers(len(known))]


def value(rng: np.random.Generator, data: dict, depth: int = 0) -> object:
    """Anything that may stand in a study, or may not."""
    kind = rng.integers(8 if depth < 2 else 5)
    if kind in (0, 1):
        return pick(rng, NUMBERS)
    if kind == 2:
        return pick(rng, WORDS)
    if kind == 3:
        return pick(rng, (None, True, False, [], {}))
    if kind in (4, 5):
        return copy.deepcopy(at(data, pick(rng, spots(data))))
    if kind == 6:
        return [value(rng, data, depth + 1) for _ in range(rng.integers(4))]
    return {pick(rng, KEYS): value(rng, data, depth + 1) for _ in range(rng.integers(3))}


def damage(rng: np.random.Generator, data: dict) -> str:
    """Change one entry; says which."""
    numbers = [path for path in spots(data) if type(at(data, path)) in (int, float)]
    if numbers and rng.random() < 0.5:
        path = pick(rng, numbers)
        new = at(data, path) * pick(rng, SCALES) if rng.random() < 0.6 else pick(rng, NUMBERS)
        at(data, path[:-1])[path[-1]] = new
        return f"{path} = {new!r}"
    path = pick(rng, spots(data))
    holder, key = at(data, path[:-1]), path[-1]
    kind = rng.integers(5)
    if kind == 0:
        del holder[key]
        return f"{path} removed"
    if kind == 1 and isinstance(holder, dict):
        name = pick(rng, (*KEYS, *(each[-1] for each in spots(data))))
        holder[str(name)] = holder.pop(key)
        return f"{path} renamed {name!r}"
    if kind == 2 and isinstance(holder, list):
        holder.append(copy.deepcopy(holder[key]))
        return f"{path} twice"
    new = value(rng, data)
    holder[key] = new
    return f"{path} = {new!r}"


def odd_override(rng: np.random.Generator, data: dict) -> str:
    """An override that means something, nearly."""
    path = [str(key) for key in pick(rng, spots(data))]
    place = int(rng.integers(len(path)))
    kind = rng.integers(6)
    if kind == 0:
        path[place] = str(pick(rng, KEYS))
    elif kind == 1:
        path.insert(place, str(pick(rng, KEYS)))
    elif kind == 2:
        path.append(str(pick(rng, KEYS)))
    elif kind == 3:
        path = path[:place]
    new = value(rng, data)
    text = json.dumps(new) if isinstance(new, dict | list) else "" if new is None else str(new)
    return ".".join(path) + str(pick(rng, ("=", "=", "=", "=", " = ", "==", "", ":"))) + text


def written(data: dict) -> str:
    """As YAML, in which numbers and words stand as a person writes them."""
    return json.dumps(data, ensure_ascii=False).replace("Infinity", ".inf").replace("NaN", ".nan")


def memory() -> int:
    """The most that this process has had, KB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def ask(folder: Path, text: str, arguments: list[str], about: str) -> str:
    """Run a command on a study, hold its outcome against what nobody should see, and give what it said."""
    (folder / "study.yaml").write_text(text, encoding="utf-8", errors="surrogatepass")
    out = folder / "out"
    before = memory()
    try:
        with in_time(SECONDS):
            done = CliRunner().invoke(
                app, [*arguments[:1], str(folder / "study.yaml"), *arguments[1:], "--out", str(out)]
            )
    except TooLongError:
        pytest.fail(f"{about}: more than {SECONDS} s")
    told = f"{about}: exit code {done.exit_code}\n{done.stderr[-3000:]}"
    assert not isinstance(done.exception, TooLongError), f"{told}\nmore than {SECONDS} s"
    assert done.exit_code in CODES, told
    for word in ("internal error", "Traceback", "Warning"):
        assert word not in done.stderr, told
    if done.exit_code:
        assert done.stderr.strip(), told
    assert memory() - before < MOST_MEMORY, f"{told}\n{memory() - before} KB"
    left = [path.name for path in folder.rglob("*") if path.name.endswith(".tmp")]
    assert not left, told
    for manifest in out.rglob("manifest.json"):
        files = {path.name for path in manifest.parent.iterdir()} - {"manifest.json"}
        assert files == set(json.loads(manifest.read_text())["files"]), told
    return done.stderr


def commands(data: dict) -> list[str]:
    return ["check", *(command for command in COMMANDS if command in data)]


def damaged(seed: int) -> tuple[str, list[str], str]:
    """A damaged study as YAML, the arguments of a command for it, and what it is."""
    rng = np.random.default_rng(seed)
    name = pick(rng, STUDIES)
    data = copy.deepcopy(STUDIES[name])
    changes = [damage(rng, data) for _ in range(rng.integers(1, 4))]
    command = pick(rng, commands(data))
    plots = [] if rng.random() < 0.1 else ["--no-plots"]
    return written(moderate(data)), [command, "--jobs", "1", *plots], f"seed {seed}: {command} {name}: {changes}"


def overridden(seed: int) -> tuple[str, list[str], str]:
    """The same of a whole study with odd overrides."""
    rng = np.random.default_rng([7, seed])
    name = pick(rng, STUDIES)
    data = STUDIES[name]
    overrides = [odd_override(rng, data) for _ in range(rng.integers(1, 3))]
    command = pick(rng, commands(data))
    sets = [part for override in overrides for part in ("--set", override)]
    arguments = [command, "--jobs", "1", "--no-plots", *sets]
    return written(data), arguments, f"seed {seed}: {command} {name}: {overrides}"


@pytest.mark.usefixtures("moderately")
@pytest.mark.parametrize("make", [damaged, overridden])
def test_answers(seeds, tmp_path, make):
    for seed in seeds(20):
        text, arguments, about = make(seed)
        folder = tmp_path / str(seed)
        folder.mkdir()
        ask(folder, text, arguments, about)
        shutil.rmtree(folder)


MARKS = (
    "{", "}", "[", "]", ":", ",", "-", "&a ", "*a", "!!python/object/apply:os.system ", "!x ", "|", ">", "'", '"', "#",
    "\n", "\t", " ", "\x00", "\x1b", "\u202e", "\u2028", "\ufeff", "<<: ", "? ", "---\n", "...\n", "%YAML 9.9\n", "²",
)  # fmt: skip


def scrambled(rng: np.random.Generator, text: str) -> bytes:
    """A text with some places cut, doubled, exchanged or overwritten."""
    for _ in range(rng.integers(1, 4)):
        start, end = sorted(int(place) for place in rng.integers(len(text) + 1, size=2))
        end = min(end, start + int(rng.integers(1, 80)))
        kind = rng.integers(5)
        part = text[start:end]
        new = ("", part * int(rng.integers(2, 50)), str(pick(rng, MARKS)), str(pick(rng, WORDS)), part[::-1])[kind]
        text = text[:start] + new + text[end if kind else min(end, start + 3) :]
    content = bytearray(text.encode(errors="surrogatepass"))
    if rng.random() < 0.1 and content:
        content[rng.integers(len(content))] = rng.integers(256)
    return bytes(content)


def text_of(seed: int) -> tuple[bytes, str]:
    """A damaged or scrambled text of a study, and which study it was."""
    rng = np.random.default_rng([11, seed])
    name = pick(rng, STUDIES)
    data = copy.deepcopy(STUDIES[name])
    content = written(data).encode(errors="surrogatepass")
    if rng.random() < 0.6:
        for _ in range(rng.integers(1, 6)):
            damage(rng, data)
        content = written(data).encode(errors="surrogatepass")
    if rng.random() < 0.5:
        content = scrambled(rng, content.decode(errors="surrogatepass"))
    return content, name


def test_loads(seeds):
    """Whatever a text holds, it is a study or a `StudyError`: in time, without much memory, in a short message."""
    for seed in seeds(400):
        content, name = text_of(seed)
        before = memory()
        try:
            with in_time(SECONDS):
                load(text=content)
        except StudyError as error:
            told = str(error)
            assert told.isprintable() or "\n" in told, f"seed {seed}: {told!r}"
            assert len(told) < MOST_TOLD, f"seed {seed}: {len(told)} characters: {told[:500]}"
        except TooLongError:
            pytest.fail(f"seed {seed}: {name}: more than {SECONDS} s")
        except Exception as error:
            raise AssertionError(f"seed {seed}: {name}") from error
        assert memory() - before < MOST_MEMORY, f"seed {seed}: {name}: {memory() - before} KB"


# What was found, each as a shipped study, a command and overrides, and the code it ends with.
FINDS = [
    ("whitworth", "kinematics", ["mechanism.parameters.r=1e308"], 2),
    ("two_link_arm_uniform", "reliability", ["mechanism.sketch.E.1=1e308"], 2),
    ("one_in_a_billion", "kinematics", ["mechanism.parameters.r1=1e-308"], 2),
    ("five_bar", "reliability", ["reliability.dimensions={'*.length': 1e99}"], 2),
    ("five_bar", "reliability", ["reliability.dimensions={'*': 1e3}"], None),
    ("bored_in_one_setting", "reliability", ["reliability.dimensions={'*.x': 1e12}"], None),
    (
        "five_bar",
        "check",
        [
            "mechanism.limits=[{measure: x, min: 3}]",
            "mechanism.measures.x=A1.x",
            "mechanism.limits.0.min=3 " + " ".join(["m"] * 110),
        ],
        2,
    ),
    ("four_bar", "kinematics", ["mechanism.links.ground.O.0=3 m" + "  m" * 1000 + "!"], 2),
    ("four_bar", "kinematics", ["mechanism.links.ground.D.²=3"], 2),
    ("four_bar", "kinematics", ["name=\udcff"], 2),
    ("four_bar", "kinematics", ["kinematics.sweeep="], 2),
    ("four_bar", "kinematics", ["mechanism.parameters.nosuch=99"], 2),
    ("four_bar", "kinematics", ["x" * 100_000 + "=1"], 2),
    ("two_rpr_printed", "kinematics", ["kinematics.path.C.1.0=5e-324"], None),
    (
        "one_in_a_billion",
        "reliability",
        ["mechanism.links.ground.O.1=0.0", "reliability.limits={P.y: 1e-301}"],
        None,
    ),
]


@pytest.mark.parametrize(("name", "command", "overrides", "code"), FINDS)
def test_finds(tmp_path, name, command, overrides, code):
    sets = [part for override in overrides for part in ("--set", override)]
    arguments = [command, "--jobs", "1", "--no-plots", *sets]
    told = ask(tmp_path, written(STUDIES[name]), arguments, f"{command} {name}")
    if code is not None:
        assert told
        assert not (tmp_path / "out").exists()
        assert len(told) < 2000
