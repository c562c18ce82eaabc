"""Studies to begin with: `new` prints a template, `import` makes one of another tool's file."""

from __future__ import annotations

import os

from mechdesign.door.cli.options import Options
from mechdesign.door.cli.terminal import emit, emit_words, say
from mechdesign.door.reference import studies, text_of
from mechdesign.ground.errors import OutputError, StudyError, suggestion
from mechdesign.ground.files import replace
from mechdesign.study import template
from mechdesign.study.importing.conversion import conversion
from mechdesign.study.templates import BUILT_IN, templates


def new(options: Options) -> int:
    """Print a commented study to start from, or one that is shipped.

    Raises
    ------
    StudyError
        If there is none of that name.
    """
    name = options.template or BUILT_IN
    text = template(name) if name in templates() else text_of(name)
    if text is None:
        near = suggestion(name, (*templates(), *studies()))
        raise StudyError(
            f"there is no template or shipped study {name!r}{near}; templates are {', '.join(templates())}; "
            "mechdesign docs WORD finds the shipped studies that have a word"
        )
    emit(text)
    return 0


def import_study(options: Options) -> int:
    """Convert a source; a study that is there already is kept.

    Raises
    ------
    StudyError
        If it cannot be converted, or the file is there already.
    OutputError
        If it cannot be written.
    """
    out = options.out
    if out is not None and os.path.lexists(out):
        raise StudyError(f"{out} is there already; give --out another name")
    text, undecided = conversion(options.source, drives=options.drive or (), unit=options.unit, scale=options.scale)
    for reason in undecided:
        say(f"to move before it runs: {reason}")
    if out is None:
        emit(text)
        return 0
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        replace(out, [text.encode()])
    except OSError as error:
        raise OutputError(f"{out}: could not be written: {error.strerror or error}") from error
    emit_words(f"{out}: written{'' if undecided else f'; mechdesign kinematics {out} runs it'}\n")
    return 0
