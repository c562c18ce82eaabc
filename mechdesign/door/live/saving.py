"""What a hand has changed of a study: as what `--set` takes, in its file, or in another of its folder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

from mechdesign.ground.errors import StudyError
from mechdesign.ground.files import flowing, proper, replace
from mechdesign.questions.synthesize.analysis import FOUND
from mechdesign.study import Study
from mechdesign.study.loading import load_bytes
from mechdesign.study.text.document import KeyPath, dotted, in_yaml, leaves, plain
from mechdesign.study.variants import edited, in_text

_NOWHERE = frozenset('\\:*?"<>|')  # characters that some systems do not have in names of files
_WRITABLE = 0o222
_LONG = 1e9  # from which whole numbers keep their point, or their power of ten
_CHANGED = "# Changed by hand; before that:\n"


def file_names(study: Study) -> dict[str, str]:
    """The study's file where it has one, and what a copy of it is called first."""
    path = study.path
    if path is None or not path.exists():
        return {"file": "", "copy": "" if path is None else path.name}
    return {"file": path.name, "copy": f"{path.stem}_changed{path.suffix}"}


def overrides(study: Study, changed: Study) -> list[str]:
    """What is otherwise in a changed study, as `--set` takes it, by the entries of the study."""
    now, data = dict(leaves(plain(study.resolved))), _short(changed.resolved)
    entries = dict[KeyPath, Any]()
    for keys, value in leaves(data):
        # What has parts now and had none is given whole.
        whole = next((keys[:k] for k in range(1, len(keys)) if keys[:k] in now), None)
        if whole is not None:
            entries[whole] = reduce(getitem, whole, data)
        elif keys not in now or now[keys] != value:
            entries[keys] = value
    return [f"{dotted(keys)}={in_yaml(value)}" for keys, value in entries.items()]


def save(study: Study, changed: Study, name: str, *, own: bool, replacing: bool) -> dict[str, Any]:
    """Write a changed study; ``exists`` in place of ``saved`` where a file would be replaced unasked.

    `own` says whether the study was read from the file of its name.

    Raises
    ------
    StudyError
        If the study is no file, the name is none of its folder, the file cannot be written, or was changed meanwhile.
    """
    if study.path is None:
        raise StudyError("the study is no file; copy the changes as --set")
    name = name or study.path.name
    path = study.path.parent / name
    plain = proper(name) and name.isprintable() and not name.startswith(".") and not _NOWHERE.intersection(name)
    if not plain or path.suffix not in (".yaml", ".yml"):
        raise StudyError(f"{name!r} is no plain name of a file that ends in .yaml")
    try:
        return _written(study, changed, path, own=own and path == study.path, replacing=replacing)
    except OSError as error:
        raise StudyError(f"{name}: {error.strerror}; nothing was written") from None


def _written(study: Study, changed: Study, path: Path, *, own: bool, replacing: bool) -> dict[str, Any]:
    name = path.name
    if path.is_symlink() or path.is_dir() or flowing(path):
        raise StudyError(f"{name} is a link, a folder or a device, and is not replaced; save a copy by another name")
    mode = path.stat().st_mode if path.exists() else None
    if mode is not None:
        if not mode & _WRITABLE:
            raise StudyError(f"{name} may not be written; save a copy by another name")
        if own and path.read_bytes() != study.text:
            raise StudyError(f"{name} was changed since it was read here; nothing was written")
        if not replacing:
            return {"exists": name}
    data = _short(changed.resolved)
    text = in_text(study, data)
    if text.startswith(f"# {FOUND}") and data != plain(study.resolved):
        text = f"{_CHANGED}{text}"
    again = load_bytes(text.encode(), path, (), None, study.folder)
    if any(not math.isclose(value, again.sizes[key], rel_tol=1e-12, abs_tol=1e-300)
           for key, value in changed.sizes.items()):  # fmt: skip
        raise StudyError("the changed study could not be written so that it reads the same; nothing was written")
    replace(path, [text.encode()])
    if mode is not None:
        path.chmod(mode)
    return {"saved": name, "comments": edited(study, data) is not None}


def _short(data: Any) -> Any:
    """Plain data with whole numbers as a hand writes them, without a point."""
    if isinstance(data, Mapping):
        return {key: _short(value) for key, value in data.items()}
    if isinstance(data, float) and data.is_integer() and abs(data) < _LONG:
        return int(data)
    return [*map(_short, data)] if isinstance(data, list) else data
