"""Writing a study that a hand has changed: into its file, or into another in its folder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mechdesign.ground.errors import StudyError
from mechdesign.ground.files import flowing, proper, replace
from mechdesign.study import Study
from mechdesign.study.designs import variant
from mechdesign.study.loading import load_bytes
from mechdesign.study.variants import changed_data, edited, in_text

_NOWHERE = frozenset('\\:*?"<>|')  # characters that some systems do not have in names of files
_WRITABLE = 0o222


def save(study: Study, changes: Mapping[str, float], name: str, *, replacing: bool) -> dict[str, Any]:
    """Write a study with changed numbers; ``exists`` in place of ``saved`` where a file would be replaced unasked.

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
        return _written(study, changes, path, replacing=replacing)
    except OSError as error:
        raise StudyError(f"{name}: {error.strerror}; nothing was written") from None


def _written(study: Study, changes: Mapping[str, float], path: Path, *, replacing: bool) -> dict[str, Any]:
    name = path.name
    if path.is_symlink() or path.is_dir() or flowing(path):
        raise StudyError(f"{name} is a link, a folder or a device, and is not replaced; save a copy by another name")
    mode = path.stat().st_mode if path.exists() else None
    if mode is not None:
        if not mode & _WRITABLE:
            raise StudyError(f"{name} may not be written; save a copy by another name")
        if path == study.path and path.read_bytes() != study.text:
            raise StudyError(f"{name} was changed since it was read here; nothing was written")
        if not replacing:
            return {"exists": name}
    data = changed_data(study, changes)
    text = in_text(study, data).encode()
    again = load_bytes(text, path, (), None, study.folder)
    if any(not math.isclose(value, again.sizes[key], rel_tol=1e-12, abs_tol=1e-300)
           for key, value in variant(study, changes).sizes.items()):  # fmt: skip
        raise StudyError("the changed study could not be written so that it reads the same; nothing was written")
    replace(path, [text])
    if mode is not None:
        path.chmod(mode)
    return {"saved": name, "comments": edited(study, data) is not None}
