"""`mechdesign docs`: the reference in the terminal, and the hint to it below error messages."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import typer

from mechdesign.door.cli.terminal import colours, emit, emit_words
from mechdesign.door.reference import PAGE, SHIPPED, Entry, below, entries, find, holding, near, pages, place, text_of
from mechdesign.ground.errors import AssemblyError, StudyError, explain
from mechdesign.mechanism.configuration import REASONS

_INDENT = "  "
# Most keys named in the hint below a study's mistakes.
_NAMED = 3
_OVERVIEW = (
    "mechdesign docs WORD... tells what a word means: a key of the study by its path (kinematics.sweep) or its last "
    "part (sweep), a column, a command, an option, one of the words below, or a text to look for (in quotes); and "
    "which pages and studies are about it."
)


def show(words: Sequence[str], group: Mapping[str, Any]) -> None:
    """Print what words mean; without any an overview.

    Raises
    ------
    StudyError
        If a word is not known; the message names the nearest.
    """
    if len(words) == 1 and "/" in words[0] and (text := text_of(words[0])) is not None:
        emit(text)
        return
    index = entries(commands(group))
    phrase = " ".join(words)
    # Words of one term of the field are not explained apart.
    asked = [phrase] if len(words) > 1 and (find(index, phrase) or holding(index, phrase)) else words
    matches = [(word, _found(index, word)) for word in asked]
    for word, hits in matches:
        if not hits:
            close = near(index, word)
            cure = f"; did you mean {close!r}?" if close else "; 'mechdesign docs' lists what there is"
            raise StudyError(f"the reference has no {word!r}{cure}")
    texts = [_lines(index, hits) for _, hits in matches] or [_overview(index)]
    texts += [_printing([hit for _, hits in matches for hit in hits])]
    emit_words("\n".join(line for text in texts for line in text).rstrip("\n") + "\n")


def _printing(hits: Sequence[Entry]) -> Iterator[str]:
    """How pages and studies among the entries are read where there is nothing but the package."""
    for kind, command in ((PAGE, "docs"), (SHIPPED, "new")):
        if first := next((hit.word for hit in hits if hit.kind == kind), ""):
            yield f"(mechdesign {command} {first} prints the {kind})"


def _found(index: Sequence[Entry], word: str) -> list[Entry]:
    """Entries of a word; those whose texts hold it, where it is none but a reason why a pose fails; pages about it."""
    hits = find(index, word)
    if not any(hit.word not in REASONS for hit in hits):
        hits = [*hits, *holding(index, word)]
    return [*hits, *pages(word, subjects=bool(hits))]


def explained(error: Exception) -> tuple[int, str]:
    """Exit code and message of an exception, with the command that explains the keys or words in it."""
    code, message = explain(error)
    if isinstance(error, AssemblyError):
        return code, f"{message}\n{look_up(message)}".rstrip("\n")
    keys = [problem.key for problem in error.problems] if isinstance(error, StudyError) else []
    words = list(dict.fromkeys(filter(None, map(place, keys))))[:_NAMED]
    return code, f"{message}\n(mechdesign docs {' '.join(words)})" if words else message


def look_up(message: str) -> str:
    """The command that explains why a pose fails, by the reason in a message."""
    reason = next((reason for reason in REASONS if reason in message), "")
    return f"(mechdesign docs {reason!r})" if reason else ""


def commands(group: Mapping[str, Any]) -> Iterator[Entry]:
    """Entries of commands and their options, as Typer has them."""
    options: dict[tuple[str, str], Entry] = {}
    for name, command in group.items():
        for item in command.params:
            flags = [*item.opts, *item.secondary_opts] if item.param_type_name == "option" else []
            for flag in flags:
                before = options[flag, item.help].where if (flag, item.help) in options else ()
                takes = "" if item.is_flag else f"{flag} {item.metavar or item.type.name.upper()}"
                options[flag, item.help] = Entry(flag, "option", item.help, takes=takes, where=(*before, name))
        arguments = [param.metavar for param in command.params if param.param_type_name == "argument"]
        some = ["[OPTIONS]"] * (len(command.params) > len(arguments))
        usage = " ".join(["mechdesign", name, *arguments, *some])
        yield Entry(name, "command", " ".join(command.help.split()), takes=usage)
    yield from options.values()


def _lines(index: Sequence[Entry], hits: Sequence[Entry]) -> Iterator[str]:
    """Lines of the entries; those with equal explanations share one, and a single key lists the keys below it."""
    alike: dict[Entry, list[Entry]] = {}
    for hit in hits:
        alike.setdefault(replace(hit, word=""), []).append(hit)
    for entry, same in alike.items():
        bold = colours(sys.stdout)
        for word in dict.fromkeys(twin.word for twin in same):
            yield f"{typer.style(word, bold=True) if bold else word} ({entry.kind})"
        yield from (_INDENT + line for line in _body(entry, same[0].last))
        keys = below(index, same[0]) if len([twin for twin in alike if twin.kind == entry.kind]) == 1 else []
        if keys:
            yield f"{_INDENT}keys:"
            yield from (f"{2 * _INDENT}{key.last}: {key.text}" for key in keys)
        yield ""


def _body(entry: Entry, name: str) -> Iterator[str]:
    yield entry.text
    facts = {
        "takes": entry.takes,
        "mapping": entry.mapping,
        "unit": entry.unit,
        "formula": entry.formula,
        "source": entry.source,
        "left out": entry.default,
        "stands in": ", ".join(entry.where),
    }
    yield from (f"{label}: {text}" for label, text in facts.items() if text)
    yield from (f"{_INDENT}{word}: {meaning}" for word, meaning in entry.words)
    yield from (f"example: {name}: {example}" for example in entry.examples)


def _overview(index: Sequence[Entry]) -> Iterator[str]:
    yield _OVERVIEW
    yield ""
    sections = [entry for entry in index if entry.kind == "key" and "." not in entry.word]
    yield f"study: {', '.join(entry.word for entry in sections)}"
    for section in sections:
        if keys := below(index, section):
            yield f"{section.word}: {', '.join(key.last for key in keys)}"
    yield ""
    kinds: dict[str, list[str]] = {}
    for entry in index:
        kinds.setdefault(entry.kind, []).append(entry.word)
    for kind, words in kinds.items():
        if kind != "key":
            yield f"{kind}: {', '.join(dict.fromkeys(words))}"
