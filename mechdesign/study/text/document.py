"""YAML text as plain data with the line and column of every key and value.

Nesting is bounded before anything is built, the expanded size of aliases while it is. Scalars follow YAML 1.2:
``1e-3`` is a number, ``on`` and ``no`` are words.
"""

from __future__ import annotations

import codecs
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import yaml

from mechdesign.ground.errors import Problem, StudyError

KeyPath = tuple[str | int, ...]

# A link written as a list has its keys at these places.
LIST_FORM = {"from": 0, "to": 1, "length": 2}
MAX_DEPTH = 40
MAX_NODES = 200_000
MAX_BYTES = 50_000_000

_Loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
# Cures by the messages of the YAML parser.
_HINTS = {
    "cannot start any token": " (indent with spaces, not tabs; put special characters in quotes)",
    "alias": " (put a word that begins with '*' in quotes, as in \"*.length\")",
    "mapping values are not allowed": " (a ':' too many here, one without a space above, or wrong indentation)",
}


class TextPlace(NamedTuple):
    """A place in a text, counted from 1; line 0 where there is no text (an override).

    `start` and `end` are those of the value there, in characters of the text from 0.
    """

    file: str
    line: int = 0
    column: int = 0
    start: int = 0
    end: int = 0

    def problem(self, message: str, key: str = "") -> Problem:
        """Build a problem that stands here."""
        return Problem(message, key, self.file, self.line, self.column)

    def failure(self, message: str) -> StudyError:
        """Build the error of a single problem that stands here."""
        return StudyError([self.problem(message)])


@dataclass
class Document:
    """Plain data (dict, list, str, int, float, bool, None) and where its keys and values stand.

    A path is the sequence of keys and indices from the root.
    """

    name: str
    data: Any
    keys: dict[KeyPath, TextPlace] = field(default_factory=dict)
    values: dict[KeyPath, TextPlace] = field(default_factory=dict)
    # Mistakes after which the rest can be read, and the parts in which further mistakes only follow from them.
    problems: list[Problem] = field(default_factory=list)
    spoiled: set[KeyPath] = field(default_factory=set)
    # Lists in which two numbers may be one with a decimal comma, and that number.
    commas: dict[KeyPath, str] = field(default_factory=dict)
    # Entries that an override has added.
    added: set[KeyPath] = field(default_factory=set)

    @classmethod
    def of(cls, data: Any, name: str = "") -> Document:
        """A document of data without a text."""
        return cls(name, data, values={(): TextPlace(name)})

    def raw(self, path: Sequence[str | int]) -> Any:
        """The data as written at a path, None if there are none."""
        return value_at(self.data, self.written(path))

    def written(self, path: Sequence[str | int]) -> KeyPath:
        """The path as the user wrote it: pydantic's may name keys that a short form leaves out."""
        data: Any = self.data
        keys: list[str | int] = []
        remaining = list(path)
        while remaining:
            segment = remaining.pop(0)
            if has(data, segment):
                keys.append(segment)
                data = data[segment]
            elif data is None or not keys:
                # An empty or missing section has no short forms.
                return (*keys, segment, *remaining)
            elif isinstance(data, list) and LIST_FORM.get(str(segment), len(data)) < len(data):
                keys.append(LIST_FORM[str(segment)])
                data = data[LIST_FORM[str(segment)]]
            elif isinstance(data, list) and segment in data:
                keys.append(data.index(segment))
                data = segment
            elif remaining or not isinstance(data, dict):
                continue
            else:
                keys.append(segment)
        return tuple(keys)


def dotted(path: Sequence[str | int]) -> str:
    """Write a path as the user would: ``mechanism.links.crank.length``."""
    return ".".join(str(segment) for segment in path)


def read(content: bytes, name: str) -> Document:
    """Read a YAML document.

    Raises
    ------
    StudyError
        Where the bytes are not one YAML document of plain data and reasonable size.
    """
    if len(content) > MAX_BYTES:
        raise TextPlace(name).failure(f"is larger than {MAX_BYTES // 1_000_000} MB: not a study file")
    try:
        text = decoded(content)
    except UnicodeDecodeError:
        raise TextPlace(name).failure("is not a text file in UTF-8; an editor saves a study in that encoding") from None
    try:
        _check_events(text, name)
        builder = _Builder(name)
        builder.document.data = builder.value(yaml.compose(text, Loader=_Loader), ())
        return builder.document
    except yaml.MarkedYAMLError as error:
        raise _misread(error, name) from None
    except yaml.YAMLError as error:
        first = str(getattr(error, "reason", error)).splitlines()[0]
        raise TextPlace(name).failure(f"is not a text in YAML: {first}") from None


def decoded(content: bytes) -> str:
    """The text of a file in UTF-8, or in UTF-16 as PowerShell writes what a command prints.

    Raises
    ------
    UnicodeDecodeError
        If it is neither.
    """
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return content.decode("utf-16" if wide else "utf-8-sig")


def in_yaml(value: Any) -> str:
    """Plain data in one line of YAML: letters as they are, what is not printable as an escape, ``\\U0000200b``.

    It is JSON but for those escapes, whose pairs of surrogates are no letters in YAML.
    """
    text = json.dumps(value, ensure_ascii=False)
    return text if text.isprintable() else "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in text)


def _misread(error: yaml.MarkedYAMLError, name: str) -> StudyError:
    """What is wrong where a text is not YAML; a brace that is not closed is reported where it opens."""

    def at(mark: Any) -> TextPlace:
        return TextPlace(name, mark.line + 1, mark.column + 1) if mark else TextPlace(name)

    context, problem = str(error.context or ""), str(error.problem or "")
    begin, noticed = error.context_mark or error.problem_mark, error.problem_mark or error.context_mark
    if context.startswith("while parsing a flow") and noticed is not None:
        opening, closing = "{}" if "mapping" in context else "[]"
        message = (
            f"this {opening!r} is not closed where line {noticed.line + 1} goes on; {closing!r} or a comma is missing"
        )
        return at(begin).failure(f"is not YAML: {message}")
    if "':'" in problem and "scanning" in context:
        return at(begin).failure("is not YAML: a ':' needs a space after it, as in 'length: 90'")
    parts = [part for part in (context, problem) if part]
    hint = next((hint for words, hint in _HINTS.items() if any(words in part for part in parts)), "")
    return at(noticed).failure(f"is not YAML: {', '.join(parts)}{hint}")


def _check_events(text: str, name: str) -> None:
    """Check the events of the YAML parser before any data are built."""
    depth = documents = 0
    event: Any
    for event in yaml.parse(text, Loader=_Loader):
        here = _mark(event, name)
        if isinstance(event, yaml.DocumentStartEvent):
            documents += 1
            if documents > 1:
                raise here.failure("a second YAML document; a study file holds one")
        elif isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent) and event.tag not in (None, "!"):
            message = f"the YAML tag {event.tag!r} has no place in a study; write plain values"
            raise here.failure(message)
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        _check_depth(depth, here)
    if not documents:
        raise TextPlace(name).failure("is empty: nothing to study (`mechdesign new` prints a start)")


def _mark(part: Any, name: str) -> TextPlace:
    begin = part.start_mark
    return TextPlace(name, begin.line + 1, begin.column + 1, begin.index, part.end_mark.index)


def _check_depth(depth: int, here: TextPlace) -> None:
    if depth > MAX_DEPTH:
        raise here.failure(f"nested deeper than {MAX_DEPTH} levels; write the section flatter")


class _Builder:
    """Data and marks of a tree of YAML nodes, in which aliases are the nodes that they stand for."""

    def __init__(self, name: str) -> None:
        self.nodes = 0
        self.document = Document(name, None)

    def value(self, node: Any, path: KeyPath) -> Any:
        here = _mark(node, self.document.name)
        _check_depth(len(path), here)
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise here.failure(
                f"more than {MAX_NODES} values once its aliases are expanded; put the numbers into a file"
            )
        self.document.values[path] = here
        if isinstance(node, yaml.ScalarNode):
            return _scalar(node)
        if isinstance(node, yaml.SequenceNode):
            self._check_split(node, node.value, path)
            self._check_commas(node, path)
            return [self.value(item, (*path, index)) for index, item in enumerate(node.value)]
        self._check_split(node, [entry for pair in node.value for entry in pair], path)
        mapping: dict[str, Any] = {}
        for key, item in node.value:
            if not isinstance(key, yaml.ScalarNode):
                self._note(key, "a key must be a word", path)
                continue
            inner: KeyPath = (*path, key.value)
            if node.flow_style and not key.style and item.start_mark.index == item.end_mark.index:
                self._check_lone_key(key, path, list(mapping.values())[-1:])
            if key.value in mapping:
                line = self.document.keys[inner].line
                self._note(key, f"duplicate key; {key.value!r} is given in line {line} already", inner)
                continue
            self.document.keys[inner] = _mark(key, self.document.name)
            mapping[key.value] = self.value(item, inner)
        return mapping

    def _note(self, node: yaml.Node, message: str, path: KeyPath) -> None:
        self.document.problems.append(_mark(node, self.document.name).problem(message, dotted(path)))

    def _check_commas(self, node: Any, path: KeyPath) -> None:
        """Keep ``90,5`` in ``[A, B, 90,5]``: whole numbers with a bare comma between, where others have a space."""
        pairs = list(pairwise(node.value)) if node.flow_style else []
        near = [two.start_mark.index - one.end_mark.index == 1 for one, two in pairs]
        for (one, two), joined in zip(pairs, near, strict=True):
            if joined and not all(near) and all(_INTEGER.fullmatch(str(item.value)) for item in (one, two)):
                self.document.commas[path] = f"{one.value}.{two.value}"

    def _check_lone_key(self, key: Any, path: KeyPath, before: Sequence[Any]) -> None:
        """Find ``{length:90}`` and ``{length: 90,5}``, whose last word is a key without a value to YAML."""
        name, _, value = key.value.partition(":")
        if name and value:
            self._note(key, f"a ':' needs a space after it: '{name}: {value}'", path)
        elif key.value[:1].isdigit() and before and isinstance(before[0], int):
            self._note(key, f"a decimal is written with a point: {before[0]}.{key.value}", path)
        else:
            return
        self.document.spoiled.add(path)

    def _check_split(self, holder: Any, entries: Sequence[Any], path: KeyPath) -> None:
        """Find ``{to: min(a, b)}``, which YAML splits at the comma into two entries."""
        for node in entries if holder.flow_style else ():
            text = node.value
            if isinstance(text, str) and not node.style and text.count("(") != text.count(")"):
                message = (
                    f"{text!r} is cut off: inside braces and brackets a comma ends a value; put the expression "
                    'in quotes, as in "min(a, b)"'
                )
                self._note(node, message, path)
                self.document.spoiled.add(path)
                return


def _scalar(node: yaml.ScalarNode) -> Any:
    text = node.value
    if node.style:
        return text
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text) and len(text) < 300:
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def plain(data: Any) -> Any:
    """Copy data down to its plain leaves, so that nothing shares a list or a mapping with it."""
    if isinstance(data, Mapping):
        return {key: plain(value) for key, value in data.items()}
    return [plain(item) for item in data] if isinstance(data, list) else data


def has(data: Any, key: Any) -> bool:
    """Whether a mapping has a key, or a list an index."""
    if isinstance(data, list):
        return isinstance(key, int) and 0 <= key < len(data)
    return isinstance(data, Mapping) and key in data


def value_at(data: Any, path: KeyPath) -> Any:
    """The value at a path of data; None where there is none."""
    for key in path:
        data = data[key] if has(data, key) else None
    return data


def leaves(data: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Every value of data that is neither a mapping nor a list, with its path."""
    if isinstance(data, Mapping | list):
        for key, value in data.items() if isinstance(data, Mapping) else enumerate(data):
            yield from leaves(value, (*path, key))
    else:
        yield path, data
