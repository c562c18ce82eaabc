"""What can go wrong, as exceptions whose message a designer understands.

Each class maps to one exit code of the command line (`exit_code`).
"""

from __future__ import annotations

import difflib
import errno
import re
import traceback
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

EXIT_CODES = {
    0: "done, every requirement met",
    1: "done, a requirement not met",
    2: "the command or the study file is wrong; nothing was computed",
    3: "the study is right, but the mechanism cannot do it: a pose that cannot be assembled, no feasible design, "
    "a reliability that no tolerances reach",
    4: "a numerical failure, or results that could not be written",
    130: "interrupted (143 by SIGTERM, 129 by SIGHUP); what was finished is whole",
}

# What became of a question or a case, in a word or two.
OUTCOMES = {
    0: "done",
    1: "requirement not met",
    2: "wrong study",
    3: "cannot be assembled",
    4: "failed",
    130: "interrupted",
}

# Most mistakes listed in one message, most misspelt names compared with the known ones, and most characters of a
# quoted text.
MAX_LISTED = 100
MAX_COMPARED = 20
MAX_ECHO = 60

_compared: ContextVar[set[str] | None] = ContextVar("names compared", default=None)
_QUOTED = re.compile(r"""(?<!\w)(?:'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*")""", re.DOTALL)
_LONG_SEGMENT = re.compile(rf"[^.]{{{MAX_ECHO + 1},}}")


@contextmanager
def few_comparisons() -> Iterator[None]:
    """Inside this context `nearest` compares `MAX_COMPARED` names only: thousands would take minutes."""
    token = _compared.set(set())
    try:
        yield
    finally:
        _compared.reset(token)


def nearest(name: str, names: Iterable[str]) -> str | None:
    """The name of `names` most similar to this one, or the only one that goes on from it; None if none is similar."""
    compared = _compared.get()
    if compared is not None:
        if len(compared) >= MAX_COMPARED and name not in compared:
            return None
        compared.add(name)
    folded = {candidate.casefold(): candidate for candidate in names}
    longer = [candidate for candidate in folded if candidate.startswith(f"{name.casefold()}.")]
    close = longer if len(longer) == 1 else difflib.get_close_matches(name.casefold(), list(folded), n=1, cutoff=0.6)
    return folded[close[0]] if close else None


def printable(text: str, escape: Callable[[str], str] = ascii) -> str:
    """A text in one line, safe in a terminal, an XML or a CSV file.

    Control, direction and unassigned characters are written as escapes, such as ``\\x1b``; `escape` returns one
    between quotation marks.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else escape(c)[1:-1] for c in text)


def printable_lines(text: str, escape: Callable[[str], str] = ascii) -> str:
    """As `printable`, line by line."""
    return "\n".join(printable(line, escape) for line in text.split("\n"))


def cut(text: str, most: int = MAX_ECHO) -> str:
    """A text shortened to at most `most` characters."""
    return text if len(text) <= most else text[: most - 3] + "..."


def _brief(message: str) -> str:
    """A message in one line, with long quotations shortened."""

    def shorter(match: re.Match[str]) -> str:
        text = match[0]
        return text if len(text) <= MAX_ECHO + 2 else cut(text[:-1], MAX_ECHO + 1) + text[-1]

    return printable(_QUOTED.sub(shorter, message))


def suggestion(name: str, names: Iterable[str]) -> str:
    """``; did you mean 'x'?`` if one of the names is similar to this one, else an empty text."""
    near = nearest(name, names)
    return f"; did you mean {near!r}?" if near is not None else ""


def counted(number: int, noun: str) -> str:
    """``1 drive``, ``2 drives``."""
    return f"{number} {noun}{'s' * (number != 1)}"


class MechdesignError(Exception):
    """Base of every error that mechdesign raises on purpose.

    >>> import mechdesign
    >>> issubclass(mechdesign.StudyError, mechdesign.MechdesignError)
    True
    """

    exit_code = 4


@dataclass(frozen=True)
class Problem:
    """One mistake in a study: where it stands and what would mend it."""

    message: str  #: what is wrong, and what to write instead
    key: str = ""  #: path of the key, with points between its words
    file: str = ""
    line: int = 0  #: from 1; 0 where the study is not a text
    column: int = 0  #: from 1

    def __str__(self) -> str:
        place = printable(self.file)
        if self.line:
            place += f":{self.line}:{self.column}"
        key = printable(_LONG_SEGMENT.sub(lambda match: cut(match[0]), self.key))
        return ": ".join(part for part in (place, key, _brief(self.message)) if part)


class StudyError(MechdesignError):
    """The study file or a command's arguments are wrong; nothing was computed. `problems` has each mistake.

    >>> import mechdesign
    >>> try:
    ...     mechdesign.load(text="mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, r]}, drives: [arm]}")
    ... except mechdesign.StudyError as error:
    ...     print(error.problems[0].key, "in column", error.problems[0].column)
    mechanism.links.arm.2 in column 54
    """

    exit_code = 2

    def __init__(self, problems: Sequence[Problem] | str) -> None:
        self.problems = (Problem(problems),) if isinstance(problems, str) else tuple(problems)
        listed = [str(problem) for problem in self.problems[:MAX_LISTED]]
        more = len(self.problems) - len(listed)
        super().__init__("\n".join([*listed, *([f"and {more} more"] if more else [])]))


class MechanismError(MechdesignError):
    """The mechanism's description contradicts itself, or what is given does not determine a pose of it.

    >>> import mechdesign
    >>> study = mechdesign.load(text="mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}")
    >>> try:
    ...     study.mechanism.solve({"P.x": 60, "P.y": 80})
    ... except mechdesign.MechanismError as error:
    ...     print(error)
    a pose gives 1 coordinate (the mobility), not 2: P.x, P.y
    """

    exit_code = 2

    def __init__(self, message: str, key: str = "mechanism") -> None:
        self.key = key
        super().__init__(message)


class AssemblyError(MechdesignError):
    """The study is right, but the mechanism cannot do what is asked (a pose, a design).

    >>> import mechdesign
    >>> arm = "mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}"
    >>> try:
    ...     mechdesign.kinematics(mechdesign.load(text=arm, overrides={"kinematics.poses": [{"P.x": 120}]}))
    ... except mechdesign.AssemblyError as error:
    ...     print(error)
    no pose is valid; P.x = 120 mm: cannot be assembled
    """

    exit_code = 3

    def __init__(self, message: str, result: Any = None) -> None:
        #: Of an optimisation without a feasible design the `Result` of the one closest to feasible.
        self.result = result
        super().__init__(message)


class OutputError(MechdesignError):
    """Results could not be written.

    >>> import mechdesign
    >>> study = mechdesign.load(text="mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}")
    >>> try:
    ...     mechdesign.kinematics(study).save(mechdesign.__file__)
    ... except mechdesign.OutputError as error:
    ...     print(str(error).rpartition(": ")[2].rpartition("/")[2])
    __init__.py is a file; choose another --out
    """


class Interrupted(KeyboardInterrupt):
    """A long computation was interrupted; what was finished of it is a result.

    Not a `MechdesignError`: who expects those does not expect to be interrupted.
    """

    exit_code = 130

    def __init__(self, result: Any) -> None:
        #: The `Result` of what was finished.
        self.result = result
        super().__init__(result.interrupted)


# Messages of libraries that run out of memory while they are loaded or start a thread.
_NO_MEMORY = ("failed to map segment", "Cannot allocate memory", "can't start new thread")


def _out_of_memory(error: BaseException | None) -> bool:
    """Whether lack of memory caused an error, directly or through another error."""
    while error is not None:
        if isinstance(error, MemoryError) or any(text in str(error) for text in _NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def explain(error: Exception) -> tuple[int, str]:
    """Exit code and message of an exception; an unexpected one asks the user to report it."""
    if isinstance(error, MechdesignError):
        return error.exit_code, printable_lines(str(error))
    if _out_of_memory(error):
        return 4, "not enough memory for this; ask for fewer poses or samples at a time, or use --jobs 1"
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        return 4, "too many files would be open at once; allow more, e.g. with `ulimit -n 1024`, or use --jobs 1"
    frames = [
        frame for frame in traceback.extract_tb(error.__traceback__) if "mechdesign" in Path(frame.filename).parts
    ]
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    detail = printable(" ".join(str(error).split()))
    return 4, f"internal error: {type(error).__name__}: {detail}{place}; please report it, with the study"
