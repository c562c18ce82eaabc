"""Studies and answers as HTML for a notebook's cell: small, without script, every text escaped by the template."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader

from mechdesign.commands import QUESTIONS
from mechdesign.door.report.page.headlines import headlines
from mechdesign.door.report.page.pages import harmless
from mechdesign.door.report.requirements import Verdict
from mechdesign.ground.errors import counted
from mechdesign.ground.numerals import printed
from mechdesign.ground.results import Result, Table
from mechdesign.ground.table_text import readable
from mechdesign.mechanism.describe import LinkWords, drives_in_words, links_in_words
from mechdesign.mechanism.diagnosis import joints_in_words
from mechdesign.questions.synthesize.words import task
from mechdesign.study import Study

# Of the main table, shown in a cell.
ROWS = 6
COLUMNS = 8
_UNIT = "unit"  # column that says the unit of each row
_DIGITS = 6  # significant digits of its numbers
_ENTRIES = 40  # of a list, such as links or warnings
_LETTERS = 200  # of a text in it
# Bytes of a PNG that stands in the page; a larger one is left to `Answer.figure`.
_MAX_PICTURE = 80_000


class _Beginning(NamedTuple):
    """The first rows and columns of a table, as texts."""

    heads: Sequence[tuple[str, str, str, bool]]  # name, unit, meaning, and whether it holds numbers
    rows: Sequence[Sequence[str]]
    left: Sequence[str]  # what is left out, in words


def study_html(study: Study, picture: bytes | None) -> str:
    """A study: its drawing, a PNG if it has one, and what it says in words."""
    description = study.mechanism.description
    facts = (
        {"task": [*task(study)]}
        if study.is_task
        else {
            "links": [_link(link, study.units.label("length")) for link in links_in_words(description)],
            "joints": joints_in_words(description, study.mechanism.graph),
            "drives": drives_in_words(description),
            "mobility": [str(study.mechanism.mobility)],
        }
    )
    facts |= {"questions": list(study.questions), "changed": list(study.overrides)}
    return _render("study.html.j2", name=study.name, facts=facts, warnings=[*study.cautions], picture=_inline(picture))


def answer_html(
    study: Study, answer: Result, verdicts: Sequence[Verdict] | str, figures: Sequence[str], picture: bytes | None
) -> str:
    """An answer: what was asked, whether it will do, its first picture, how its main table begins, what else it has.

    Parameters
    ----------
    verdicts : sequence of Verdict, or str
        Or why there are none.
    figures : sequence of str
        Names of its pictures.
    picture : bytes
        The first of them, a PNG.
    """
    judged = () if isinstance(verdicts, str) else verdicts
    # Of very many those that are not met are never left out.
    shown = judged if len(judged) <= _ENTRIES else sorted(judged, key=lambda verdict: verdict.met)[:_ENTRIES]
    main, *others = answer.tables.values() or (None,)
    return _render(
        "answer.html.j2",
        command=answer.command,
        study=study.name,
        question=QUESTIONS[answer.command].question,
        counts=[f"{noun}: {count:,}" for noun, count in answer.counts.items()],
        wrong=[text for text in (answer.interrupted, answer.failed) if text],
        said=answer.notes,
        verdicts=shown,
        met=sum(verdict.met for verdict in judged),
        required=len(judged),
        unjudged=verdicts if isinstance(verdicts, str) else "",
        headlines=headlines(answer.seen),
        warnings=answer.warnings,
        picture=_inline(picture),
        table=main,
        beginning=None if main is None else _beginning(main, study.size),
        others=others,
        also={"pictures": figures, "files": list(answer.files)},
    )


def _render(template: str, **said: object) -> str:
    return _environment().get_template(template).render(said)


@cache
def _environment() -> Environment:
    made = Environment(
        loader=PackageLoader("mechdesign.door.api"),
        autoescape=True,
        finalize=harmless,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {"few": _few, "short": _short, "printed": printed}
    return made


def _few(texts: Sequence[object]) -> list[object]:
    """The first of a list, and how many more there are."""
    more = len(texts) - _ENTRIES
    return [*texts[:_ENTRIES], *([f"and {more} more"] if more > 0 else [])]


def _short(text: object) -> str:
    letters = str(text)
    return letters if len(letters) <= _LETTERS else f"{letters[: _LETTERS - 1]}…"


def _inline(picture: bytes | None) -> str:
    """A PNG as the address of an image; nothing where there is none, or one too large for a cell."""
    if picture is None or len(picture) > _MAX_PICTURE:
        return ""
    return f"data:image/png;base64,{base64.b64encode(picture).decode()}"


def _link(link: LinkWords, unit: str) -> str:
    length = "; telescopic" if link.telescopic else ""
    if link.length is not None:
        length = f"; {link.length:.{_DIGITS}g} {unit}".rstrip()
    return f"{link.name} ({', '.join(link.points)}{length})"


def _beginning(table: Table, size: tuple[float, str]) -> _Beginning:
    # The units of rows of several quantities are never left out.
    first = [column for column in table.columns if column.name != _UNIT][: COLUMNS - (_UNIT in table)]
    columns = [column for column in table.columns if column in first or column.name == _UNIT]
    first_rows = table.take(np.arange(min(ROWS, len(table))))
    shown = Table(table.name, tuple(first_rows.column(column.name) for column in columns))
    left = []
    if len(table) > ROWS:
        left.append(counted(len(table) - ROWS, "more row"))
    if more := [column.name for column in table.columns if column not in columns]:
        left.append(f"{counted(len(more), 'more column')} ({', '.join(more)})")
    read = readable(table.seen.columns, shown.columns, size)
    heads = [(column.name, printed(column.unit), column.meaning, column.numeric) for column in read]
    return _Beginning(heads, [*zip(*(column.cells for column in read), strict=True)], left)
