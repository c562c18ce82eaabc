"""The command `import`: a study of another tool's file, on stdout or in a file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from mechdesign.cli.terminal import emit, emit_words, say
from mechdesign.errors import OutputError, StudyError
from mechdesign.files import replace
from mechdesign.importing.conversion import conversion


def import_study(
    source: str, out: Path | None, drives: Sequence[str], unit: str | None, scale: float | None
) -> None:  # fmt: skip
    """Convert a source; a study that is there already is kept.

    Raises
    ------
    StudyError
        If it cannot be converted, or the file is there already.
    OutputError
        If it cannot be written.
    """
    if out is not None and os.path.lexists(out):
        raise StudyError(f"{out} is there already; give --out another name")
    text, undecided = conversion(source, drives=drives, unit=unit, scale=scale)
    for reason in undecided:
        say(f"to move before it runs: {reason}")
    if out is None:
        emit(text)
        return
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        replace(out, [text.encode()])
    except OSError as error:
        raise OutputError(f"{out}: could not be written: {error.strerror or error}") from error
    emit_words(f"{out}: written{'' if undecided else f'; mechdesign kinematics {out} runs it'}\n")
