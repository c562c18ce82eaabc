"""Files written whole or not at all, folders locked by one process, and formats of pictures."""

from __future__ import annotations

import glob
import hashlib
import json
import os
import platform
import re
import sys
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TextIO

from mechdesign.ground.errors import OutputError, StudyError, printable

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]

# Formats of pictures; the first is the default.
FORMATS = ("png", "svg", "pdf")
# In a folder of results: the lock of the process that writes there, and the names of files that are being replaced.
_LOCK = ".mechdesign.lock"
_UNSETTLED = ".mechdesign.unsettled"
# What Windows has no file for: letters, and names of devices, whatever their ending.
_UNFIT = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
_DEVICES = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9\u00b9\u00b2\u00b3])(\..*)?", re.IGNORECASE)


def formats_of(listed: str | None, option: str) -> str:
    """Formats of pictures that an option lists, without repetitions, separated by commas.

    Raises
    ------
    StudyError
        If one is none of `FORMATS`.
    """
    kinds = dict.fromkeys((listed or FORMATS[0]).replace(" ", "").lower().split(","))
    for kind in kinds:
        if kind not in FORMATS:
            raise StudyError(f"{option} takes {', '.join(FORMATS)} or several with commas between, not {kind!r}")
    return ",".join(kinds)


def replace(path: Path, blocks: Iterable[bytes]) -> str:
    """Write a file block by block, put it in place when it is whole, and return its SHA-256.

    Raises
    ------
    OSError, OutputError
        If it cannot be written; an older file of that name is then as it was.
    """
    for left in _temporaries(path.parent, re.escape(path.name)):
        if not _alive(int(left.name.split(".")[-2])):
            left.unlink(missing_ok=True)
    with Transaction(path.parent) as files:
        digest = files.stage(path.name, blocks)
        files.place()
    return digest


@contextmanager
def giving_way(path: Path) -> Iterator[None]:
    """Inside, a file is replaced or removed.

    Raises
    ------
    OutputError
        Where the system refuses it, as Windows does of a file that another program has open.
    """
    try:
        yield
    except PermissionError as error:
        words = "cannot be replaced: it is open in another program, or write-protected; close it there, and try again"
        raise OutputError(f"{path}: {words}") from error


class Transaction:
    """Files of a folder, all written under temporary names before the first gets its own name.

    A failed write leaves the folder unchanged, and so does a file that cannot be replaced. Used as a context, which
    removes the temporary files.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._staged: dict[str, Path] = {}
        self._aside: dict[str, Path] = {}  # files that are replaced or removed

    def __enter__(self) -> Transaction:
        return self

    def __exit__(self, *_: object) -> None:
        for temporary in (*self._staged.values(), *self._aside.values()):
            with suppress(OSError):
                temporary.unlink(missing_ok=True)

    def stage(self, name: str, blocks: Iterable[bytes]) -> str:
        """Write a file under a temporary name, and return its SHA-256."""
        temporary = self._staged[name] = self._temporary(name)
        digest = hashlib.sha256()
        with temporary.open("wb") as stream:
            for block in blocks:
                stream.write(block)
                digest.update(block)
        return digest.hexdigest()

    def place(self, last: str = "") -> None:
        """Give the files their names."""
        for name in sorted(self._staged, key=lambda name: name == last):
            with giving_way(self.directory / name):
                os.replace(self._staged[name], self.directory / name)

    def commit(self, own: Collection[str], kept: Collection[str] = (), *, voucher: str) -> None:
        """Give the files of results their names, and remove the folder's `own` files except those `kept`.

        The voucher is removed first and written last. If the process is killed meanwhile, `unsettled` lists the files.

        Raises
        ------
        StudyError
            If a file would be replaced that is not one of the folder's own; then nothing has changed.
        OutputError
            If a file cannot be replaced or removed, as it is open elsewhere; then nothing has changed, either.
        """
        check_own(self.directory, self._staged, own)
        replace(self.directory / _UNSETTLED, [json.dumps(sorted({*own, *self._staged})).encode()])
        try:
            for name in (voucher, *sorted({*own, *self._staged} - {voucher, *(set(kept) - self._staged.keys())})):
                self._set_aside(name)
            self.place(voucher)
        except (OSError, OutputError):
            self._put_back()
            settle(self.directory)
            raise
        settle(self.directory)

    def _temporary(self, name: str) -> Path:
        return self.directory / f".mechdesign.{name}.{os.getpid()}.tmp"

    def _set_aside(self, name: str) -> None:
        """Rename a file, which an open one refuses before any has been replaced."""
        path, aside = self.directory / name, self._temporary(f"{name}.old")
        if path.is_file():
            with giving_way(path):
                os.replace(path, aside)
            self._aside[name] = aside

    def _put_back(self) -> None:
        for name, temporary in self._staged.items():
            if not temporary.exists():
                (self.directory / name).unlink(missing_ok=True)
        for name, aside in reversed(self._aside.items()):
            os.replace(aside, self.directory / name)


def unsettled(directory: Path) -> set[str]:
    """Names of files that a killed transaction was replacing."""
    try:
        names = json.loads((directory / _UNSETTLED).read_bytes())
    except (OSError, ValueError, RecursionError):
        return set()
    return {name for name in names if proper(name)} if isinstance(names, list) else set()


def settle(directory: Path) -> None:
    """Mark a folder's files as belonging together."""
    (directory / _UNSETTLED).unlink(missing_ok=True)


def proper(name: object) -> bool:
    """Whether a text is a plain file name, not a path to elsewhere."""
    return isinstance(name, str) and name not in {"", ".", ".."} and not _UNFIT.search(name)


def portable(name: str) -> str:
    """The name of a folder that every system takes, the same on all of them."""
    name = _UNFIT.sub("_", printable(name, lambda _: "'_'")).rstrip(". ")
    return f"_{name}" if not name or _DEVICES.fullmatch(name) else name


def way(path: Path, start: Path) -> str:
    """The way to a path from a folder; the whole path where there is none, as from one drive of Windows to another."""
    try:
        return Path(os.path.relpath(path, start)).as_posix()
    except ValueError:
        return Path(os.path.abspath(path)).as_posix()


def file_names(directory: Path) -> list[str]:
    """Names of the files in a folder, sorted; none where it does not exist or cannot be read: writing says why."""
    try:
        return sorted(path.name for path in directory.iterdir())
    except OSError:
        return []


def check_own(directory: Path, names: Iterable[str], own: Collection[str], read: Iterable[Path] = ()) -> None:
    """Check that results would replace only the folder's own files, and none that is `read`.

    `names` are patterns. A symbolic link is never the folder's own, and is not followed.

    Raises
    ------
    StudyError
        If there is such a file; it is named.
    """
    patterns, read = [*names, *map(glob.escape, own)], [*read]
    for name in file_names(directory):
        if any(map(partial(fnmatchcase, name), patterns)) or _taken_for(directory / name, patterns):
            check_unread(directory / name, read)
            if name not in own or (directory / name).is_symlink():
                raise foreign(directory / name)


def _taken_for(path: Path, patterns: Iterable[str]) -> bool:
    """Whether a file of another case is taken for one of these names, as on Windows and macOS."""
    name, other = path.name.casefold(), path.with_name(path.name.swapcase())
    alike = any(fnmatchcase(name, pattern.casefold()) for pattern in patterns)
    return alike and other.exists() and other.samefile(path)


def check_unread(path: Path, read: Iterable[Path]) -> None:
    """Check that a file is none of those that are `read`.

    Raises
    ------
    StudyError
        If it is one of them.
    """
    if os.path.exists(path) and any(os.path.exists(file) and path.samefile(file) for file in read):
        raise StudyError(f"{path}: is read here, and a result would take its place; choose another --out")


def flowing(path: Path) -> bool:
    """Whether a path is a device or a pipe, or a link to one."""
    return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)


def digest(path: Path) -> str:
    """SHA-256 of a file; empty where it cannot be read."""
    try:
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ""


def foreign(path: Path, *, changed: bool = False) -> StudyError:
    """The error where a file of others would be replaced."""
    kind = "a link" if path.is_symlink() else "no result of mechdesign's"
    kind += ", or was changed since it was written" * changed
    return StudyError(f"{path}: is {kind}, and would be replaced; move it away, or write the results elsewhere")


def check_writable(directory: Path) -> None:
    """Check before a long computation that its results can be written; creates nothing.

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
    """Lock a folder for this process, creating it if needed; removes what a killed process left in it.

    The operating system releases the lock when the process ends; the lock file names the process. Where files cannot
    be locked, other processes are not kept out.

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
            # A folder with files stays.
            with suppress(OSError):
                place.rmdir()


def _locked(path: Path) -> TextIO:
    """The open lock file, locked by this process."""
    while True:
        stream = open(path, "a+", encoding="utf-8", opener=unlinked)  # noqa: SIM115
        try:
            lock(stream, wait=False)
        except BlockingIOError:
            with stream:
                stream.seek(0)
                owner = stream.read().strip() or "another process"
            message = f"{path.parent}: {owner} writes there; wait until it ends, or choose another --out"
            raise OutputError(message) from None
        except OSError:
            return stream
        # Its owner may have removed it in between.
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(stream.fileno()), path.stat()):
                return stream
        stream.close()


def lock(stream: TextIO, *, wait: bool) -> None:
    """Lock an open file for this process, where files can be locked.

    Raises
    ------
    BlockingIOError
        If another process has it, and this one does not `wait`.
    OSError
        If it cannot be locked.
    """
    if fcntl is not None:
        fcntl.lockf(stream, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def let_go(stream: TextIO) -> None:
    """Close a file before it is replaced or removed where files cannot be locked: Windows does so with no open one."""
    if fcntl is None:
        stream.close()


def unlinked(path: str, flags: int) -> int:
    """Opener of a file that follows no link."""
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


@contextmanager
def _held(stream: TextIO, path: Path) -> Iterator[None]:
    try:
        with suppress(OSError):
            # On a full disk the lock file stays empty.
            os.truncate(stream.fileno(), 0)
            os.write(stream.fileno(), f"process {os.getpid()} on {platform.node()}".encode())
        yield
    finally:
        let_go(stream)
        with suppress(PermissionError):
            path.unlink(missing_ok=True)
        stream.close()


def _temporaries(directory: Path, name: str = ".+") -> list[Path]:
    """Temporary files of unfinished writes."""
    pattern = re.compile(rf"\.mechdesign\.{name}\.\d+\.tmp")
    try:
        return [path for path in directory.iterdir() if pattern.fullmatch(path.name)]
    except OSError:
        return []


def _alive(pid: int) -> bool:
    if sys.platform == "win32":
        # Signal 0 would be Ctrl-C there; what a killed process left is removed once its folder is `owned`.
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
