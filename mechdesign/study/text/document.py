"""YAML text as plain data with the line and column of every key and value.

The reader is built on libyaml's events, so that it can stop early: nesting, aliases and the expanded size are bounded
before anything is built. Scalars follow YAML 1.2: ``1e-3`` is a number, ``on`` and ``no`` are words.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import yaml

from mechdesign.errors import Problem, StudyError

KeyPath = tuple[str | int, ...]

MAX_DEPTH = 40
MAX_NODES = 200_000
MAX_BYTES = 50_000_000
MAX_ALIASES = 1000

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_WORDS = {"": None, "~": None, "null": None, "Null": None, "NULL": None}
_WORDS_BOOLEAN = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}


@dataclass(frozen=True)
class Mark:
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


@dataclass
class Document:
    """Plain data (dict, list, str, int, float, bool, None) and where its keys and values stand.

    A path is the sequence of keys and indices from the root.
    """

    name: str
    data: Any
    keys: dict[KeyPath, Mark] = field(default_factory=dict)
    values: dict[KeyPath, Mark] = field(default_factory=dict)
    # Mistakes of writing that leave the rest readable, and the parts where complaints would only repeat them.
    problems: list[Problem] = field(default_factory=list)
    spoiled: set[KeyPath] = field(default_factory=set)
    # Entries that the text does not have: an override made them.
    added: set[KeyPath] = field(default_factory=set)


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
        raise StudyError([Mark(name).problem(f"is larger than {MAX_BYTES // 1_000_000} MB: not a study file")])
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise StudyError([Mark(name).problem("is not a text file in UTF-8: not a study file")]) from None
    try:
        return _Builder(name).build(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        here = Mark(name, mark.line + 1, mark.column + 1) if mark else Mark(name)
        parts = [str(part) for part in (error.context, error.problem) if part]
        raise StudyError([here.problem(f"is not YAML: {', '.join(parts)}{_hint(parts)}")]) from None
    except yaml.YAMLError as error:
        first = str(getattr(error, "reason", error)).splitlines()[0]
        raise StudyError([Mark(name).problem(f"is not a text in YAML: {first}")]) from None


def _hint(parts: Sequence[str]) -> str:
    text = " ".join(parts)
    if "cannot start any token" in text:
        return " (indent with spaces, not tabs; put special characters in quotes)"
    if "alias" in text:
        return " (put a word that begins with '*' in quotes, as in \"*.length\")"
    if "mapping values are not allowed" in text:
        return " (a ':' too many on the line, or wrong indentation)"
    return ""


@dataclass
class _Node:
    """One node of the YAML tree; aliases share nodes until they are expanded."""

    mark: Mark
    scalar: str | None = None
    plain: bool = False
    in_flow: bool = False
    items: list[_Node] | None = None
    pairs: list[tuple[_Node, _Node]] | None = None


class _Builder:
    def __init__(self, name: str) -> None:
        self.name = name
        self.anchors: dict[str, _Node] = {}
        self.aliases = 0
        self.nodes = 0
        self.document = Document(name, None)

    def build(self, text: str) -> Document:
        loader = _Loader(text)
        try:
            events = self._events(loader)
            next(events)
            if isinstance(next(events), yaml.StreamEndEvent):
                raise StudyError(
                    [Mark(self.name).problem("is empty: nothing to study (`mechdesign new` prints a start)")]
                )
            root = self._node(next(events), events, 0, False)
            next(events)
            extra = next(events)
            if not isinstance(extra, yaml.StreamEndEvent):
                raise StudyError([self._mark(extra).problem("a second YAML document; a study file holds one")])
        finally:
            loader.dispose()
        self.document.data = self._expand(root, (), 0)
        return self.document

    @staticmethod
    def _events(loader: Any) -> Iterator[Any]:
        while loader.check_event():
            yield loader.get_event()

    def _mark(self, event: Any) -> Mark:
        begin, end = event.start_mark, event.end_mark
        return Mark(self.name, begin.line + 1, begin.column + 1, begin.index, end.index)

    def _node(self, event: Any, events: Iterator[Any], depth: int, in_flow: bool) -> _Node:
        mark = self._mark(event)
        if depth > MAX_DEPTH:
            raise StudyError([mark.problem(f"nested deeper than {MAX_DEPTH} levels")])
        if isinstance(event, yaml.AliasEvent):
            self.aliases += 1
            if self.aliases > MAX_ALIASES or event.anchor not in self.anchors:
                what = f"undefined alias *{event.anchor}" if self.aliases <= MAX_ALIASES else "too many aliases"
                raise StudyError([mark.problem(f"{what}; quote a word that begins with '*', as in \"*.length\"")])
            return self.anchors[event.anchor]
        if event.tag is not None and event.tag != "!":
            raise StudyError([mark.problem(f"the YAML tag {event.tag!r} has no place in a study; write plain values")])
        node = _Node(mark, in_flow=in_flow)
        if isinstance(event, yaml.ScalarEvent):
            node.scalar, node.plain = event.value, event.style in (None, "")
        else:
            inside = in_flow or bool(event.flow_style)
            children: list[_Node] = []
            while not isinstance(child := next(events), yaml.CollectionEndEvent):
                children.append(self._node(child, events, depth + 1, inside))
            node.mark = replace(node.mark, end=self._mark(child).end)
            if isinstance(event, yaml.SequenceStartEvent):
                node.items = children
            else:
                node.pairs = list(zip(children[::2], children[1::2], strict=True))
        if event.anchor is not None:
            self.anchors[event.anchor] = node
        return node

    def _expand(self, node: _Node, path: KeyPath, depth: int) -> Any:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise StudyError([node.mark.problem(f"more than {MAX_NODES} values once its aliases are expanded")])
        self.document.values[path] = node.mark
        if node.items is not None:
            self._check_split(node.items, path)
            return [self._expand(item, (*path, index), depth + 1) for index, item in enumerate(node.items)]
        if node.pairs is not None:
            self._check_split([scalar for pair in node.pairs for scalar in pair], path)
            return self._expand_mapping(node.pairs, path, depth)
        return self._scalar(node, path)

    def _expand_mapping(self, pairs: list[tuple[_Node, _Node]], path: KeyPath, depth: int) -> dict[str, Any]:
        mapping: dict[str, Any] = {}
        for key_node, value_node in pairs:
            if key_node.scalar is None:
                self.document.problems.append(key_node.mark.problem("a key must be a word", dotted(path)))
                continue
            here: KeyPath = (*path, key_node.scalar)
            if key_node.scalar in mapping:
                first = self.document.keys[here]
                message = f"duplicate key; {key_node.scalar!r} is given in line {first.line} already"
                self.document.problems.append(key_node.mark.problem(message, dotted(here)))
                continue
            self.document.keys[here] = key_node.mark
            mapping[key_node.scalar] = self._expand(value_node, here, depth + 1)
        return mapping

    def _check_split(self, nodes: list[_Node], path: KeyPath) -> None:
        """Find ``{to: min(a, b)}``, which YAML splits at the comma into two entries."""
        if path in self.document.spoiled:
            return
        for node in nodes:
            text = node.scalar
            if text is None or not (node.plain and node.in_flow) or text.count("(") == text.count(")"):
                continue
            message = (
                f"{text!r} is cut off: inside braces and brackets a comma ends a value; put the expression in quotes"
            )
            self.document.problems.append(node.mark.problem(f'{message}, as in "min(a, b)"', dotted(path)))
            self.document.spoiled.add(path)
            return

    def _scalar(self, node: _Node, path: KeyPath) -> Any:
        text = node.scalar or ""
        if not node.plain:
            return text
        if text in _WORDS:
            return None
        if text in _WORDS_BOOLEAN:
            return _WORDS_BOOLEAN[text]
        if _INTEGER.fullmatch(text) and len(text) < 300:
            return int(text)
        if _FLOAT.fullmatch(text):
            return float(text)
        if _NOT_FINITE.fullmatch(text):
            return float(text.replace(".", ""))
        return text


def parse_value(text: str, name: str) -> Document:
    """Read the value of an override, which may be empty."""
    # What the terminal could not decode is told as not UTF-8, as it would be in a file.
    return read(text.encode(errors="surrogateescape"), name) if text.strip() else Document(name, None)


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


def leaves(data: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Any]]:
    """Every value of data that is neither a mapping nor a list, with its path."""
    if isinstance(data, Mapping | list):
        for key, value in data.items() if isinstance(data, Mapping) else enumerate(data):
            yield from leaves(value, (*path, key))
    else:
        yield path, data
