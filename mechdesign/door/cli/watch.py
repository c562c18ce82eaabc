"""`watch`: answer the questions of a study again whenever it, or a file that it names, is saved."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from mechdesign.commands import QUESTIONS
from mechdesign.door.cli import batch, terminal
from mechdesign.door.cli.execution import PICTURES, STANDARD_INPUT, load_study
from mechdesign.door.cli.options import Options
from mechdesign.ground.errors import Interrupted, MechdesignError, StudyError, suggestion
from mechdesign.ground.work import interrupts
from mechdesign.study.text.inputs import FILES, MAX_FILE_BYTES

_LOOK = 0.2  # seconds between two checks of the files
_NAMES = re.compile(rf"[^\s,:'\"\[\]{{}}]+(?:{'|'.join(map(re.escape, FILES))})\b")


def watch(options: Options) -> int:
    """Answer a study's questions, or only some of them, now and after every change, until an interrupt.

    Mistakes are told, and end nothing. Returns 0, or 130 if it was computing when it was interrupted; a
    termination ends the process with 143 all the same.

    Raises
    ------
    StudyError
        If there is no such question, or the study is no file.
    """
    path, commands = options.path, options.commands or ()
    assert path is not None
    for command in commands:
        if command not in QUESTIONS:
            listed = ", ".join(QUESTIONS)
            raise StudyError(f"{command!r} is no question{suggestion(command, QUESTIONS)}; there are {listed}")
    if path == STANDARD_INPUT or (path.exists() and not path.is_file()):
        raise StudyError(f"{path}: is no file that could be watched")
    if not options.no_plots:
        # Once, and not at each answer.
        import_module(PICTURES)
    files = {path}
    with suppress(KeyboardInterrupt):
        while True:
            contents = contents_of(files)
            if batch.answer_all([path], options, commands) == Interrupted.exit_code:
                return Interrupted.exit_code
            files = {path, *files_named(path, options)}
            contents = contents_of(files - contents.keys()) | {file: contents[file] for file in files & contents.keys()}
            names = ", ".join(sorted(map(str, files)))
            terminal.say(
                f"{path}: answered again when one of these is saved, until Ctrl-C: {names}", quiet=options.quiet
            )
            await_change(contents)
    return 0


def await_change(contents: dict[Path, bytes | None]) -> None:
    """Return when a file has changed and is the same at the next look: an editor may still be writing."""
    now = contents
    while True:
        time.sleep(_LOOK)
        interrupts.check()
        before, now = now, contents_of(contents)
        if now == before != contents:
            return


def contents_of(files: Iterable[Path]) -> dict[Path, bytes | None]:
    """Bytes of files; None of one that is not there."""
    contents: dict[Path, bytes | None] = {}
    for file in files:
        contents[file] = None
        with suppress(OSError):
            # Reading a device or a pipe might never end.
            if file.is_file():
                with file.open("rb") as stream:
                    contents[file] = stream.read(MAX_FILE_BYTES)
    return contents


def files_named(path: Path, options: Options) -> set[Path]:
    """Files that a study names; if the study has mistakes, file names found in its text."""
    try:
        return {file for _, file, _ in load_study(path, options).inputs()}
    except MechdesignError:
        with suppress(OSError):
            return {path.parent / name for name in _NAMES.findall(path.read_text(encoding="utf-8", errors="replace"))}
        return set()
