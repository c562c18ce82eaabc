"""`load`, as Python and notebooks call it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mechdesign.door.api.shown import ShownStudy
from mechdesign.ground.errors import StudyError
from mechdesign.study.loading import load_bytes, load_data, read_file
from mechdesign.study.text.inputs import Folder


def load(
    source: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    overrides: Sequence[str] | Mapping[str, Any] = (),
    seed: int | None = None,
    *,
    text: str | bytes | None = None,
    allow_files: bool = False,
) -> ShownStudy:
    """Load a study from a file, a mapping or a text in YAML.

    Parameters
    ----------
    source : path or mapping
        The study file, or the study as plain data; NumPy's numbers and arrays are taken as numbers and lists.
    overrides : sequence of str, or mapping
        ``"a.b.c=value"``, or values by their dotted names; applied in their order, before the study is checked.
    seed : int, optional
        In place of the study's own.
    text : str or bytes
        The study in YAML, in place of `source`. Files that it names are looked for in the working directory, as are
        those of a mapping.
    allow_files : bool
        Whether files that the study names may lie outside its folder.

    Returns
    -------
    ShownStudy
        What it says, in its own units; in a notebook it shows its mechanism.

    Raises
    ------
    StudyError
        With every mistake found, each as ``file:line:column: key path: what, and what would mend it``.

    Examples
    --------
    >>> import mechdesign
    >>> study = mechdesign.load(text='''
    ... mechanism:
    ...   links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
    ...   drives: [crank]
    ...   sketch: {A: [0, 30], B: [75, 55]}
    ... ''')
    >>> study.mechanism.mobility
    1
    """
    named = isinstance(source, str) and "\n" not in source
    if (source is None) == (text is None) or not (source is None or named or isinstance(source, os.PathLike | Mapping)):
        raise StudyError("give a study as one of a file's name, a mapping, or text=... in YAML")
    if text is not None:
        content = text.encode(errors="surrogateescape") if isinstance(text, str) else text
        study = load_bytes(content, None, overrides, seed, Folder(anywhere=allow_files))
    elif isinstance(source, Mapping):
        study = load_data(source, overrides, seed, Folder(anywhere=allow_files))
    else:
        assert source is not None
        file = Path(source)
        study = load_bytes(read_file(file), file, overrides, seed, Folder(file.parent, allow_files))
    return ShownStudy.of(study)
