"""What the pages show is run: files that they write, commands with their output, Python, in a folder a page.

In a page
- a block of YAML with a caption is a file of that name; a caption "NAME, continued" adds to it; it must pass `check`;
- a block of YAML without one is a part of a study: laid over the page's last file, it must pass `check`;
- a `console` block holds commands after `$ `, each with what a terminal shows but how far it is; a line `...` stands
  for any lines, and numbers agree to six digits;
- a `python` block runs with those before it; what it prints, and in a notebook the value of its last line if
  that is text, stands in the `text` block that follows, if there is one.

    python docs/examples.py [PAGE...]     writes what the commands print now into the pages
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import pty
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from cells import FENCE, is_notebook, jupyter, shown
from cells import run as run_cell
from forking import PICTURES, forked
from steps import step

import mechdesign
from mechdesign.ground.errors import MechdesignError

ROOT = Path(__file__).parent
FOLDERS = ("tutorials", "notebooks", "howto", "theory", "reference", "contributing")
# Made pages, whose examples are parts of a study; tests/unit/test_reference.py reads them.
PARTS = ROOT / "reference" / "study"
# Where the examples of a page were run: its pictures come from there.
RUN = ROOT / "_run"
ANY = "..."
# Two numbers are the same to six digits.
DIGITS = 1e-6
ROUNDING = 1e-10
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w])")
# Python of one page at a time: the folder it runs in and what it prints are those of the whole process.
_PYTHON = threading.Lock()
_PICTURE = re.compile(r"(\w+)\.png")
# How far a command is that takes long: on a busy machine another one does.
_COURSE = re.compile(r": \d+ of \d+ [\w ]+ after \d+ s\b")
_CAPTION = re.compile(r":caption: (?P<name>\S+?)(?P<more>, continued)?\n")


@dataclass
class Page:
    """A page of the site as its examples go: its folder, its program, its files, what is wrong with it."""

    path: Path
    folder: Path
    tools: Path
    pictures: frozenset[str]
    study: str = ""
    names: dict[str, Any] = field(default_factory=dict)
    printed: str = ""
    cells: int = 0
    wrong: list[str] = field(default_factory=list)

    def fail(self, where: int, words: str) -> None:
        """Note what is wrong at a place of the text."""
        line = self.path.read_text(encoding="utf-8").count("\n", 0, where) + 1
        self.wrong.append(f"{self.path.relative_to(ROOT)}:{line}: {words}")


def merged(base: Any, part: Any) -> Any:
    """A part of a study laid over another: mappings key by key, anything else as a whole."""
    if isinstance(base, dict) and isinstance(part, dict):
        return base | {key: merged(base[key], value) if key in base else value for key, value in part.items()}
    return part


def terminal(command: str, folder: Path, tools: Path, pictures: Iterable[str]) -> str:
    """What a terminal shows of a command: first what goes to standard output, then the messages.

    `tools` is the folder of the program `mechdesign`; of its pictures those named are drawn.
    """
    ours, theirs = pty.openpty()
    settings = os.environ | {"TERM": "dumb", "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "NO_COLOR": "1"}
    settings[PICTURES] = " ".join(pictures)
    with subprocess.Popen(
        command, shell=True, cwd=folder, env=settings, stdin=subprocess.DEVNULL, stdout=theirs, stderr=subprocess.PIPE
    ) as process:
        os.close(theirs)
        with ThreadPoolExecutor(1) as pool:
            shown = pool.submit(_read, ours)
            assert process.stderr is not None
            messages = process.stderr.read()
            text = shown.result().replace(b"\r\n", b"\n") + messages
    os.close(ours)
    lines = [line for line in text.decode().splitlines() if not _COURSE.search(line)]
    lines += [f"(exit code {process.returncode})"] if process.returncode else []
    return "".join(f"{line.rstrip()}\n" for line in lines)


def _read(terminal: int) -> bytes:
    blocks = []
    # A terminal whose other end is closed is an error to read from, on Linux.
    with contextlib.suppress(OSError):
        while block := os.read(terminal, 65536):
            blocks.append(block)
    return b"".join(blocks)


def agree(written: str, shown: str) -> bool:
    """Whether an output is the one in the page, whose lines `...` stand for any lines; numbers agree to six digits."""
    lines = shown.splitlines()
    first, *others = _split(written.splitlines())
    if not _same(first, lines[: len(first)]) or (not others and len(lines) != len(first)):
        return False
    at = len(first)
    for number, part in enumerate(others, 1):
        last = len(lines) - len(part)
        starts = range(at, last + 1) if number < len(others) else range(max(last, at), last + 1)
        start = next((start for start in starts if _same(part, lines[start : start + len(part)])), None)
        if start is None:
            return False
        at = start + len(part)
    return True


def _split(written: Iterable[str]) -> Iterator[list[str]]:
    """The runs of lines between those that stand for any lines."""
    part: list[str] = []
    for line in written:
        if line.strip() == ANY:
            yield part
            part = []
        else:
            part.append(line)
    yield part


def _same(written: Sequence[str], shown: Sequence[str]) -> bool:
    """Whether lines are the same: words to the letter, numbers to six digits, as machines differ in the last ones.

    Numbers below `ROUNDING` are what rounding leaves, another on every machine. Columns are as wide as their numbers.
    """
    words = [[_NUMBER.sub("", line).split() for line in lines] for lines in (written, shown)]
    if words[0] != words[1]:
        return False
    numbers = [_NUMBER.findall("\n".join(lines)) for lines in (written, shown)]
    if len(numbers[0]) != len(numbers[1]):
        return False
    pairs = zip(*numbers, strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=DIGITS, abs_tol=ROUNDING) for a, b in pairs)


def _commands(body: str) -> Iterator[tuple[str, str]]:
    """The commands of a console block, each with the output in the page."""
    for part in re.split(r"(?m)^\$ ", body)[1:]:
        lines = part.split("\n")
        count = 1
        while lines[count - 1].endswith("\\"):
            count += 1
        yield "\n".join(lines[:count]), "\n".join(lines[count:])


def _console(page: Page, body: str, where: int) -> str:
    parts = []
    for command, written in _commands(body):
        shown = terminal(command, page.folder, page.tools, page.pictures)
        if not agree(written, shown):
            page.fail(where, f"$ {command}\nshows\n{shown}where the page has\n{written}")
            written = shown
        parts.append(f"$ {command}\n{written}")
    return "".join(parts)


def _yaml(page: Page, body: str, where: int) -> None:
    caption = _CAPTION.match(body)
    text = body[caption.end() :].lstrip("\n") if caption else body
    try:
        if caption:
            file = page.folder / caption["name"]
            page.study = (page.study if caption["more"] else "") + text
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(page.study, encoding="utf-8")
            if file.suffix == ".yaml" and re.search(r"(?m)^(mechanism|synthesis):", page.study):
                mechdesign.load(file)
        else:
            study = merged(yaml.safe_load(page.study) or {}, yaml.safe_load(text))
            part = page.folder / "part.yaml"
            part.write_text(yaml.safe_dump(study, sort_keys=False), encoding="utf-8")
            mechdesign.load(part)
    except (MechdesignError, yaml.YAMLError) as error:
        page.fail(where, str(error))


def _python(page: Page, body: str, where: int) -> None:
    if is_notebook(page.path) and page.printed:
        page.fail(where, f"the cell before prints what the page does not show:\n{page.printed}")
    stream = io.StringIO()
    with _PYTHON:
        before = Path.cwd()
        try:
            os.chdir(page.folder)
            with contextlib.redirect_stdout(stream):
                value = run_cell(body, str(page.path), page.names)
                if is_notebook(page.path):
                    _show(page, value)
        except Exception as error:
            page.fail(where, f"{type(error).__name__}: {error}")
        finally:
            os.chdir(before)
    page.printed = stream.getvalue()


def _show(page: Page, value: Any) -> None:
    """Keep what a cell of a notebook shows for the site; of what is text alone the page has it."""
    if html := shown(value):
        (page.folder / f"{page.cells}.html").write_text(html, encoding="utf-8")
    elif value is not None:
        print(repr(value))
    page.cells += 1


def run(tools: Path, path: Path, base: Path = RUN) -> tuple[str, list[str]]:
    """The text of a page as it would be true, and what is wrong with it as it is; it is run in a folder of `base`."""
    folder = base / path.relative_to(ROOT).with_suffix("")
    # What an earlier run has left could make a page true that is not.
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    text = path.read_text(encoding="utf-8")
    page = Page(path, folder, tools, frozenset(_PICTURE.findall(text)))

    def block(match: re.Match[str]) -> str:
        kind, body = match["kind"].strip(), match["body"]
        if kind == "console":
            body = _console(page, body, match.start())
        elif kind in ("yaml", "{code-block} yaml"):
            _yaml(page, body, match.start())
        elif kind == "python":
            _python(page, body, match.start())
        elif kind == "text" and page.printed:
            if not agree(body, page.printed):
                page.fail(match.start(), f"prints\n{page.printed}where the page has\n{body}")
                body = page.printed
            page.printed = ""
        return f"{match['fence']}{match['kind']}\n{body}{match['fence']}"

    if is_notebook(path):
        (folder / f"{path.stem}.ipynb").write_text(jupyter(text), encoding="utf-8")
    with step(f"examples of {path.relative_to(ROOT)}"):
        return FENCE.sub(block, text), page.wrong


def pages(names: Iterable[str] = ()) -> list[Path]:
    """Pages with examples: those named, or all; made parts of pages, whose names begin with "_", have none."""
    return [Path(name).resolve() for name in names] or [
        *sorted(ROOT.glob("[!_]*.md")),
        *(path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("[!_]*.md"))
          if PARTS not in path.parents),
    ]  # fmt: skip


def wrong(paths: Iterable[Path]) -> list[str]:
    """Run the examples of these pages; what is wrong with them, in words."""
    with forked() as tools, ThreadPoolExecutor(os.cpu_count()) as pool:
        return [words for _, faults in pool.map(partial(run, tools), paths) for words in faults]


def main() -> None:
    """Write into the pages what their commands print now."""
    with forked() as tools:
        for path in pages(sys.argv[1:]):
            text, faults = run(tools, path)
            path.write_text(text, encoding="utf-8")
            print(*faults, sep="\n")


if __name__ == "__main__":
    main()
