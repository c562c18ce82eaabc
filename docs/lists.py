"""Pages of the reference, from `mechdesign.door.reference`: keys, tables, indices, words, exit codes, warnings.

What `mechdesign docs WORD` prints in a terminal stands here, a page a subject.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path

import yaml
from markup import table

from mechdesign.door.reference import Entry, entries, tables
from mechdesign.ground.cautions import KINDS
from mechdesign.ground.results import TableKind
from mechdesign.mechanism.configuration import REASONS

# Sections of the study with a page each, in the order of the format; keys that stand alone share one.
ALONE = "study_file"
# Lists with pages: title, what is said before, kinds of entries.
LISTS = {
    "indices": (
        "Indices and results of workspaces",
        "Local indices are asked for by `workspace.indices`; each has statistics over the region, such as "
        "`sigma_min_mean`. The results below are there for every workspace. All of them can be goals of `optimize` "
        "and be judged by `requirements`.",
        ("local index", "result of workspace"),
    ),
    "words": (
        "Words, functions and units",
        "Words that a key chooses out of a list, and what numbers and expressions are made of.",
        (),
    ),
    "exit_codes": ("Exit codes", "What a command ends with; of several questions the largest.", ("exit code",)),
}
DOCS = Path(__file__).parent
LINE = 80  # characters of a line of an example
_APART = ("key", "table", "column", "local index", "result of workspace", "exit code")
_SPECIAL = re.compile(r"([\\*_<>\[\]$|#])")
_CODE = re.compile(r"(`[^`]+`)")


def markdown(text: str) -> str:
    """A plain text as Markdown that shows it as it is; what is between backticks stays code."""
    parts = _CODE.split(text)
    return "".join(part if k % 2 else _SPECIAL.sub(r"\\\1", part) for k, part in enumerate(parts))


def code(text: str) -> str:
    """A text in the type of code."""
    fence = "``" if "`" in text else "`"
    return f"{fence}{text}{fence}"


def _told(entry: Entry) -> Iterator[str]:
    """What is said of an entry, paragraph by paragraph."""
    yield markdown(entry.text)
    facts = {
        "Takes": code(entry.takes) if entry.takes else "",
        "Mapping": markdown(entry.mapping),
        "Unit": markdown(entry.unit),
        "Formula": code(entry.formula) if entry.formula else "",
        "Source": markdown(entry.source),
        "Left out": code(entry.default) if entry.default else "",
        "Stands in": ", ".join(map(code, entry.where)),
    }
    lines = [f"- {what}: {text}" for what, text in facts.items() if text]
    lines += [f"- {code(word)}: {markdown(text)}" for word, text in entry.words]
    if lines:
        yield "\n".join(lines)
    if entry.examples:
        yield f"```yaml\n{in_place(entry)}\n```"


@cache
def _examples() -> dict[str, tuple[str, ...]]:
    return {entry.word: entry.examples for entry in entries() if entry.kind == "key"}


def in_place(entry: Entry) -> str:
    """The examples of a key where they stand in a study, each further one as a comment."""
    *above, last = entry.word.split(".")
    lines: list[str] = []
    indent = dash = ""
    for k, part in enumerate(above):
        name = _example_name(".".join(above[:k]), [*above, last][k + 1]) if part == "*" else part
        if not name:
            dash = "- "
            continue
        lines.append(f"{indent}{dash}{name}:")
        indent, dash = indent + " " * (2 + len(dash)), ""
    first, *others = entry.examples
    lines += _written(f"{indent}{dash}{last}:", first, indent + " " * (2 + len(dash)))
    return "\n".join([*lines, *(f"{indent}{' ' * len(dash)}# or {last}: {example}" for example in others)])


def _example_name(path: str, inner: str) -> str:
    """A name that stands in a mapping of names, out of its examples; empty of a list."""
    for given in map(yaml.safe_load, _examples()[path]):
        if isinstance(given, dict):
            names = [name for name in given if name != "ground"]
            fitting = [name for name in names if isinstance(given[name], dict) and inner in given[name]]
            return str([*fitting, *names][0])
    return ""


def _written(key: str, example: str, indent: str) -> list[str]:
    """A key with its example, whose entries have lines of their own where one line would be long."""
    if len(key) + len(example) < LINE or example[0] not in "{[":
        return [f"{key} {example}"]
    parts, depth, begin = [], 0, 1
    for k, letter in enumerate(example):
        depth += (letter in "{[") - (letter in "}]")
        if (letter == "," and depth == 1) or depth == 0:
            parts.append(example[begin:k].strip())
            begin = k + 1
    return [key, *(f"{indent}{'- ' if example[0] == '[' else ''}{part}" for part in parts)]


def _page(title: str, parts: Iterable[str]) -> str:
    return "\n\n".join([f"# {title}", *parts]) + "\n"


def section(group: list[Entry]) -> str:
    """The page of a section of the study: the section, then every key in it."""
    first, *keys = group
    parts = [*_told(first)]
    for entry in keys:
        path = entry.word.partition(".")[2]
        parts += [f"{'###' if '.' in path.removeprefix('*.') else '##'} {code(path)}", *_told(entry)]
    return _page(code(first.word), parts)


def listed(title: str, before: str, chosen: Iterable[Entry]) -> str:
    """The page of a list: a part a kind, its words in the order of the source."""
    parts = [before]
    for kind, words in groupby(chosen, key=lambda entry: entry.kind):
        parts.append(f"## {kind[0].upper()}{kind[1:]}")
        alike = list(words)
        where = alike[0].where
        if where and all(entry.where == where for entry in alike):
            parts.append(f"Stands in {', '.join(map(code, where))}.")
            alike = [replace(entry, where=()) for entry in alike]
        for entry in alike:
            text, *facts = _told(entry)
            parts += [f"**{code(entry.word)}**: {text}", *facts]
    return _page(title, parts)


def table_page(command: str, kinds: Iterable[TableKind]) -> str:
    """The page of a command's tables, with every column."""
    parts = [
        f"What `mechdesign {command}` writes. `<names>` stand for those of a study. Lengths, angles, times and forces "
        "are in the study's units; an empty cell or `nan` has no value."
    ]
    for kind in kinds:
        rows = [[code(column.name), markdown(column.meaning), markdown(column.unit.replace("_", " ")),
                 code(column.formula) if column.formula else ""] for column in kind.kinds]  # fmt: skip
        parts += [
            f"## {kind.name}.csv",
            f"{markdown(kind.meaning[0].upper() + kind.meaning[1:])}.",
            table(["column", "meaning", "unit", "formula"], *rows),
        ]
    return _page(f"Tables of {command}", parts)


def messages_page() -> str:
    """The page of kinds of warnings, and of reasons why poses fail."""
    parts = [
        "An error of a study begins with the file, the line, the column and the key; `mechdesign docs KEY` has what "
        "the key takes and an example. One of an option begins with it; `mechdesign COMMAND --help` lists them. "
        "Exit codes are those of [](exit_codes.md): with 2 nothing was computed.",
    ]
    kinds = (f"- {code(kind)}: {caution.meaning}. See [](../../{caution.page}.md)." for kind, caution in KINDS.items())
    parts += ["## Kinds of warnings", "What `fail_on` lists, and the page that tells more.", "\n".join(kinds)]
    reasons = (f"- {code(reason)}: {cure}" for reason, cure in REASONS.items())
    parts += [
        "## Poses that fail",
        "A listed pose that fails ends with exit code 3, one of a sweep is a warning. The reasons:",
        "\n".join(reasons),
    ]
    return _page("Errors and warnings", parts)


@cache
def pages() -> dict[str, str]:
    """The texts of all pages by their paths in the folder of the site."""
    every = entries()
    keys = [entry for entry in every if entry.kind == "key"]
    sections = {name: list(group) for name, group in groupby(keys, key=lambda entry: entry.word.partition(".")[0])}
    alone = [name for name, group in sections.items() if len(group) == 1]
    text: dict[str, str] = {
        f"reference/study/{name}.md": section(group) for name, group in sections.items() if name not in alone
    }
    single = [part for name in alone for part in (f"## {code(name)}", *_told(sections[name][0]))]
    text[f"reference/study/{ALONE}.md"] = _page("Keys without a section", single)
    names = "\n".join([ALONE, *(name for name in sections if name not in alone)])
    text["reference/study/index.md"] = _page("The study file", [
        "Every key, with what it takes, its unit, what is taken where it is left out, and an example. In a path `*` "
        "stands for a name of yours or a place in a list: `mechanism.joints.*.angle`.",
        f"```{{toctree}}\n:maxdepth: 1\n\n{names}\n```",
    ])  # fmt: skip
    commands = {name: [kind for _, kind in group] for name, group in groupby(tables(), key=lambda pair: pair[0])}
    text |= {f"reference/tables/{name}.md": table_page(name, group) for name, group in commands.items()}
    listing = "\n".join(commands)
    text["reference/tables/index.md"] = _page("Tables and columns", [
        "Every table that a command writes. The `manifest.json` of a run has the meaning and the unit of every column.",
        f"```{{toctree}}\n:maxdepth: 1\n\n{listing}\n```",
    ])  # fmt: skip
    for name, (title, before, kinds) in LISTS.items():
        group = [entry for entry in every if (entry.kind in kinds if kinds else entry.kind not in _APART)]
        text[f"reference/lists/{name}.md"] = listed(title, before, group)
    text["reference/lists/messages.md"] = messages_page()
    return text
