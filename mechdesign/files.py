"""Files that are written whole or not at all, folders of one process, and formats of pictures."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from mechdesign.errors import OutputError, StudyError

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]

# Of pictures; the first is drawn where none is asked.
FORMATS = ("png", "svg", "pdf")
# In a folder of results: who writes there, and the names of what is just changing.
_LOCK = ".mechdesign.lock"
_UNSETTLED = ".mechdesign.unsettled"


def formats_of(listed: str | None, option: str) -> str:
    """Formats of pictures as an option lists them, each once, with commas between.

    Raises
    ------
    StudyError
        If one is none of `FORMATS`.
    """
    wanted = dict.fromkeys((listed or FORMATS[0]).replace(" ", "").lower().split(","))
    for kind in wanted:
        if kind not in FORMATS:
            raise StudyError(f"{option} takes {', '.join(FORMATS)} or several with commas between, not {kind!r}")
    return ",".join(wanted)


def replace(path: Path, blocks: Iterable[bytes]) -> str:
    """Write a file block by block, put it in place when it is whole, and return its SHA-256.

    Raises
    ------
    OSError
        If it cannot be written; an older file of that name is then as it was.
    """
    for left in _temporaries(path.parent, re.escape(path.name)):
        if not _alive(int(left.name.split(".")[-2])):
            left.unlink(missing_ok=True)
    with Transaction(path.parent) as files:
        digest = files.stage(path.name, blocks)
        files.commit()
    return digest


class Transaction:
    """Files of a folder that are written aside, all of them, before the first is put in place.

    What cannot be written leaves the folder as it was. Used as a context, which clears up.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._staged: dict[str, Path] = {}

    def __enter__(self) -> Transaction:
        return self

    def __exit__(self, *_: object) -> None:
        for temporary in self._staged.values():
            with suppress(OSError):
                temporary.unlink(missing_ok=True)

    def stage(self, name: str, blocks: Iterable[bytes]) -> str:
        """Write a file aside, and return its SHA-256."""
        temporary = self._staged[name] = self.directory / f".{name}.{os.getpid()}.tmp"
        digest = hashlib.sha256()
        with temporary.open("wb") as stream:
            for block in blocks:
                stream.write(block)
                digest.update(block)
        return digest.hexdigest()

    def commit(self, stale: Iterable[str] = (), *, voucher: str | None = None) -> None:
        """Put the files in place and remove the stale ones; while it goes on there is no voucher.

        Where it is cut off, the names of what was to change stay in a file of the folder: `unsettled`.
        """
        if voucher is not None:
            stale = set(stale) - self._staged.keys()
            replace(self.directory / _UNSETTLED, [json.dumps(sorted({*stale, *self._staged})).encode()])
            for name in (voucher, *stale):
                if not (self.directory / name).is_dir():
                    (self.directory / name).unlink(missing_ok=True)
        for name in sorted(self._staged, key=lambda name: name == voucher):
            os.replace(self._staged[name], self.directory / name)
        if voucher is not None:
            settle(self.directory)


def unsettled(directory: Path) -> set[str]:
    """Names of files that a transaction was changing when it was cut off."""
    try:
        names = json.loads((directory / _UNSETTLED).read_bytes())
    except (OSError, ValueError, RecursionError):
        return set()
    return {name for name in names if proper(name)} if isinstance(names, list) else set()


def settle(directory: Path) -> None:
    """Note that a folder's files belong together."""
    (directory / _UNSETTLED).unlink(missing_ok=True)


def proper(name: object) -> bool:
    """Whether a text is the name of a file in a folder, and leads nowhere else."""
    return isinstance(name, str) and name not in {"", ".", ".."} and not {"/", os.sep, "\0"}.intersection(name)


def check_writable(directory: Path) -> None:
    """Find out before a long computation that its results could not be written; creates nothing.

    Raises
    ------
    OutputError
        If the directory, or the nearest one above it that exists, does not take files.
    """
    place = directory
    while not os.path.exists(place) and place != place.parent:
        place = place.parent
    if not place.is_dir():
        raise OutputError(f"{directory}: results cannot be written there: {place} is a file; choose another --out")
    if not os.access(place, os.W_OK | os.X_OK):
        raise OutputError(
            f"{directory}: results cannot be written there: no permission for {place}; choose another --out"
        )


@contextmanager
def owned(directory: Path) -> Iterator[None]:
    """Keep a folder, made where there is none, to this process; clears up what a killed one left in it.

    The operating system drops the lock with the process that holds it, however that ends; the file says who that is.
    Where files cannot be locked, nobody is kept out.

    Raises
    ------
    OutputError
        If another process has it, or the folder cannot be made.
    """
    made: list[Path] = []
    try:
        try:
            made += [place for place in (directory, *directory.parents) if not place.exists()]
            directory.mkdir(parents=True, exist_ok=True)
            stream = _locked(directory / _LOCK)
        except OSError as error:
            check_writable(directory)
            why = error.strerror or error
            raise OutputError(f"{directory}: results cannot be written there: {why}; choose another --out") from error
        with _held(stream, directory / _LOCK):
            for left in _temporaries(directory):
                left.unlink(missing_ok=True)
            yield
    finally:
        for place in made:
            # One that holds something stays.
            with suppress(OSError):
                place.rmdir()


def _locked(path: Path) -> TextIO:
    """The file of a lock, which no other process holds."""
    while True:
        stream = path.open("a+", encoding="utf-8")
        try:
            if fcntl is not None:
                fcntl.lockf(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            with stream:
                stream.seek(0)
                owner = stream.read().strip() or "another process"
            message = f"{path.parent}: {owner} writes there; wait until it ends, or choose another --out"
            raise OutputError(message) from None
        except OSError:
            return stream
        # Unless its owner removed it in between.
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(stream.fileno()), path.stat()):
                return stream
        stream.close()


@contextmanager
def _held(stream: TextIO, path: Path) -> Iterator[None]:
    try:
        with suppress(OSError):
            # On a full disk the owner has no name.
            os.truncate(stream.fileno(), 0)
            os.write(stream.fileno(), f"process {os.getpid()} on {platform.node()}".encode())
        yield
    finally:
        path.unlink(missing_ok=True)
        stream.close()


def _temporaries(directory: Path, name: str = ".+") -> list[Path]:
    """Files that were being written, aside from where they belong."""
    pattern = re.compile(rf"\.{name}\.\d+\.tmp")
    try:
        return [path for path in directory.iterdir() if pattern.fullmatch(path.name)]
    except OSError:
        return []


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
