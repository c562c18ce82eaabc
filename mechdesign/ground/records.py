"""Files that no manifest of results lists, such as exports, reports and summaries: a record beside them does.

Only a file that is as its record lists it is replaced or removed.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from mechdesign.ground.errors import StudyError
from mechdesign.ground.files import check_unread, digest, flowing, foreign, giving_way, let_go, lock, replace, unlinked

_RECORD = ".mechdesign.json"  # in each folder with such files: their digests by their names


def check_replaceable(path: Path, read: Iterable[Path] = (), *, whole: bool = True) -> None:
    """Check that a file may be replaced: it is as the record of its folder lists it, or empty, and none that is `read`.

    Devices and pipes may be written to. A link to a file is not followed. Where it need not be `whole`, a file of a
    name that the record lists may be damaged.

    Raises
    ------
    StudyError
        If another file stands there.
    """
    if flowing(path):
        return
    check_unread(path, read)
    # A record of others would be replaced with the file.
    listed = _entries(path.parent)
    if not os.path.lexists(path) or _is_listed(path, listed, whole=whole):
        return
    if path.is_symlink() or path.is_dir() or path.stat().st_size:
        raise foreign(path, changed=path.name in listed)


def write_recorded(path: Path, data: bytes, *, whole: bool = True) -> None:
    """Write a file whole or not at all, in place of none or one of ours, and list it in the record of its folder.

    Raises
    ------
    StudyError
        If another file stands there, see `check_replaceable`.
    OSError, OutputError
        If it cannot be written; an older file of that name is then as it was.
    """
    check_replaceable(path, whole=whole)
    with _record(path.parent) as listed:
        # Whichever of the two a killed process leaves is listed.
        digests = digest(path), hashlib.sha256(data).hexdigest()
        listed[path.name] = [*dict.fromkeys(filter(None, digests))]
    replace(path, [data])


def remove_recorded(path: Path) -> None:
    """Remove a file that is as the record of its folder lists it; another file of that name stays.

    Raises
    ------
    OSError, OutputError
        If it cannot be removed.
    """
    with suppress(StudyError):
        if _is_listed(path, _entries(path.parent)):
            with giving_way(path):
                path.unlink()
            with _record(path.parent) as listed:
                listed.pop(path.name, None)


def _is_listed(path: Path, listed: Mapping[str, Sequence[str]], *, whole: bool = True) -> bool:
    """Whether a path is a file, not a link, of a name, and where it is to be `whole` a digest, that are listed."""
    if path.name not in listed or path.is_symlink() or not path.is_file():
        return False
    return not whole or digest(path) in listed[path.name]


def _entries(directory: Path, text: str | None = None) -> dict[str, list[str]]:
    """The digests that the record of a folder lists by the names of files; none where there is no record.

    Raises
    ------
    StudyError
        If what stands there is no record, or a link.
    """
    path = directory / _RECORD
    try:
        if path.is_symlink():
            raise foreign(path)
        content = json.loads((path.read_text(encoding="utf-8") if text is None else text) or "{}")
        files = content.get("files", {})
        if all(isinstance(digests, list) for digests in files.values()) and content.keys() <= {"tool", "files"}:
            return dict(files)
    except OSError:
        return {}
    except (ValueError, AttributeError, RecursionError):
        pass
    raise foreign(path)


@contextmanager
def _record(directory: Path) -> Iterator[dict[str, list[str]]]:
    """What the record of a folder lists, to be changed while no other process does; a record of nothing is removed."""
    path = directory / _RECORD
    while True:
        with open(path, "a+", encoding="utf-8", opener=unlinked) as stream:
            with suppress(OSError):
                lock(stream, wait=True)
            # Another process may have removed it, or put a new one in its place, in between.
            if not os.path.exists(path) or not os.path.samestat(os.fstat(stream.fileno()), path.stat()):
                continue
            stream.seek(0)
            # Whoever opens it a second time and closes it loses the lock.
            listed = _entries(directory, stream.read())
            let_go(stream)
            yield listed
            if listed:
                content = {"tool": "mechdesign", "files": listed}
                replace(path, [json.dumps(content, indent=1, sort_keys=True).encode() + b"\n"])
            else:
                path.unlink(missing_ok=True)
            return
