"""Errors and warnings that a user can meet: read from the source, where each is written once."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

import yaml

from mechdesign import errors
from mechdesign.errors import EXIT_CODES
from mechdesign.reference.entries import Entry

KIND = "message"
PART = 0
_PART = "a part of an error or a warning"
_WARNING = "a warning: the results are there, and this is to be known of them"
# Calls that are given a message, besides errors; and lists that messages are put on.
_GIVEN = (
    "Problem",
    "failure",
    "problem",
    "report",
    "_note",
    "note",
    "_unexpected",
    "UnknownColumnError",
    "Undetermined",
)
_LISTS = ("warnings", "problems", "notes", "told", "found")
# A name that a message is given to where the mechanism cannot do what is asked.
_FAILED = "failed"
# A name of a model that has a message first, and then the keys of which one is given.
_CHOICE = "one_of"
# Functions that give texts, in these rooms; of a single text it may be a part of a message.
_EXPLAINED = "tuple[int, str]"  # an exit code and its message
_TEXTS = ("Iterator[str]", "list[str]", "str | None", "str", "tuple[list[str], str]", _EXPLAINED)
_ROOMS = ("study", "mechanism", "analyses", "expressions", "errors")
# Fewest words of a part.
_WORDS = 5
# Shortest message: two words, outside of its places.
_SENTENCE = re.compile(r"[A-Za-z]{2,}[,;:')]* +['(]?[A-Za-z]")
_PLACE = re.compile(r"<[^<>]*>")
_ENDING = 8  # letters of one at most
_OPERATORS: Mapping[type, Callable[[float, float], float]] = {
    ast.Mult: operator.mul, ast.FloorDiv: operator.floordiv, ast.Div: operator.truediv, ast.Pow: operator.pow,
    ast.Add: operator.add, ast.Sub: operator.sub,
}  # fmt: skip
# Fewest letters of a message outside of its places by which a text is known to be that message.
_LETTERS = 10


@dataclass(frozen=True, eq=False)
class Group:
    """Messages about one subject: what is to be known of them, and what mends those that do not say it."""

    title: str
    about: str
    files: tuple[str, ...]  # beginnings of the names of the files that they stand in; the longest that fits counts
    mends: Mapping[str, str]  # by a part of the text
    places: Mapping[str, str]  # what stands at a place ``<name>``; ``=text``: the text itself; empty: left out


class Message(NamedTuple):
    """An error or a warning: its text with ``<...>`` for what differs, its group, its exit code, what mends it.

    A warning has no code, a part of a message `PART`. `source` is the text with the names of the source.
    """

    text: str
    group: Group
    code: int | None
    mend: str
    source: str

    def holds(self, words: str) -> bool:
        """Whether these words stand in it, or it in these words."""
        if words.casefold() in self.text.casefold():
            return True
        parts, end = _PLACE.split(self.source), 0
        for part in parts:
            if (start := words.find(part, end)) < 0:
                return False
            end = start + len(part)
        return sum(map(len, parts)) >= _LETTERS


@cache
def groups() -> tuple[Group, ...]:
    """What ``messages.yaml`` says, in its order."""
    said = yaml.safe_load((files("mechdesign.reference") / "messages.yaml").read_text(encoding="utf-8"))
    return tuple(
        Group(each["group"], each["about"], tuple(each["files"]), each.get("mends", {}),
              said["places"] | each.get("places", {}))
        for each in said["groups"]
    )  # fmt: skip


@cache
def messages() -> tuple[Message, ...]:
    """Every message of the package, group by group, in the order of a group's files and of the source in them."""
    found: dict[tuple[Group, str], tuple[int, int | None]] = {}
    for name, texts in _read(owned=True):
        group, begin = _owner(name)
        assert group is not None
        for text, code in texts:
            before = found.get((group, text))
            # What is an error, or a warning, is not told again as a part of one.
            if before is None or before[1] == PART:
                found[group, text] = (group.files.index(begin), code)
    told = {}
    for (group, text), (_, code) in sorted(found.items(), key=lambda item: (groups().index(item[0][0]), item[1][0])):
        mend = next((mend for part, mend in group.mends.items() if part in text), "")
        told[group, shown(text, group), code] = Message(shown(text, group), group, code, mend, text)
    return tuple(told.values())


def unread() -> list[str]:
    """Files with texts that belong to no group."""
    return [name for name, texts in _read(owned=False) if texts]


def _owner(name: str) -> tuple[Group | None, str]:
    """The group of a file, and the beginning of its name there."""
    found = [(begin, group) for group in groups() for begin in group.files if name.startswith(begin)]
    begin, group = max(found, key=lambda each: len(each[0]), default=("", None))
    return group, begin


def _read(*, owned: bool) -> Iterator[tuple[str, list[tuple[str, int | None]]]]:
    """Files that belong to a group, or that do not, with their texts and exit codes."""
    sources = dict(_sources(files("mechdesign")))
    for name, text in sources.items():
        if (_owner(name)[0] is not None) == owned:
            yield name, _Reader.read(text, sources, texts=name.startswith(_ROOMS))


def shown(text: str, group: Group) -> str:
    """A text of the source as a reader understands it: places have names in words."""

    def place(found: re.Match[str]) -> str:
        name = found[0][1:-1]
        if name in group.places:
            words = group.places[name]
            return words[1:] if words.startswith("=") else f"<{words}>" if words else ""
        # One of several texts: an ending in the plural, a text at greater length by itself.
        several = name.split("|")
        if not name[:1].isalpha() or (len(several) > 1 and max(map(len, several)) <= _ENDING):
            return several[-1] if len(several) > 1 else name
        return f"<{' or '.join(several)}>"

    return " ".join(_PLACE.sub(place, text).split()).strip(" ;,:")


def find_messages(words: str) -> list[Entry]:
    """Entries of the messages in which these words stand, or that these words are."""
    found = [
        Entry(told.text, KIND, ". ".join(filter(None, (f"{told.group.title}; {meaning(told.code)}", told.mend))))
        for told in messages() if told.holds(words)
    ]  # fmt: skip
    # What is between quotes in what is said of a group may be any part of a message.
    said = [group for group in groups() if any(part in words for part in re.findall('"(.+?)"', group.about))]
    return found or [Entry(f"{group.title}: ...", KIND, group.about) for group in said]


def meaning(code: int | None) -> str:
    """What an error with an exit code means, or a warning."""
    if code is None or code == PART:
        return _WARNING if code is None else _PART
    return f"exit code {code}: {EXIT_CODES[code]}"


def _sources(folder: Traversable, prefix: str = "") -> Iterator[tuple[str, str]]:
    for each in sorted(folder.iterdir(), key=lambda item: item.name):
        if each.is_dir():
            yield from _sources(each, f"{prefix}{each.name}/")
        elif each.name.endswith(".py"):
            yield f"{prefix}{each.name}", each.read_text(encoding="utf-8")


@cache
def _tree(source: str) -> ast.Module:
    return ast.parse(source)


def _constants(tree: ast.Module, sources: Mapping[str, str], *, imported: bool = True) -> dict[str, float]:
    """Numbers that have a name in a file, or in one that it imports the name from."""
    found: dict[str, float] = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            value = _number(node.value, found)
            if value is not None:
                found[node.targets[0].id] = value
        elif isinstance(node, ast.ImportFrom) and imported and (node.module or "").startswith("mechdesign."):
            path = (node.module or "").removeprefix("mechdesign.").replace(".", "/")
            names = [each.name for each in node.names if each.name.isupper()]
            source = sources.get(f"{path}.py") or sources.get(f"{path}/__init__.py")
            if names and source is not None:
                there = _constants(_tree(source), sources, imported=False)
                found |= {name: there[name] for name in names if name in there}
    return found


def _number(node: ast.expr, known: Mapping[str, float]) -> float | None:
    """The number that an expression of numbers is."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
        return node.value
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        left, right = _number(node.left, known), _number(node.right, known)
        return None if left is None or right is None else _OPERATORS[type(node.op)](left, right)
    return None


class _Reader(ast.NodeVisitor):
    """Gathers the messages of a file; a name that is given for a message is looked up in the function around it."""

    def __init__(self, rooms: bool, constants: Mapping[str, float]) -> None:
        self.found: list[tuple[str, int | None]] = []
        self.names: dict[str, list[ast.expr]] = {}
        self.functions: dict[str, list[ast.expr]] = {}
        # What functions give that are read for their texts.
        self.given = _TEXTS if rooms else ()
        self.texts = ""
        self.constants = constants

    @staticmethod
    def read(source: str, sources: Mapping[str, str], *, texts: bool) -> list[tuple[str, int | None]]:
        """Messages of a file and their exit codes; with `texts` also what its functions return."""
        tree = _tree(source)
        reader = _Reader(texts, _constants(tree, sources))
        for function in (each for each in tree.body if isinstance(each, ast.FunctionDef)):
            returned = (each.value for each in ast.walk(function) if isinstance(each, ast.Return))
            reader.functions[function.name] = [value for value in returned if value is not None]
        reader.visit(tree)
        return reader.found

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outer = self.names, self.texts
        self.names = {}
        gives = ast.unparse(node.returns) if node.returns is not None else ""
        self.texts = gives if gives in self.given and not node.name.startswith("__") else ""
        for each in ast.walk(node):
            if isinstance(each, ast.Assign) and len(each.targets) == 1 and isinstance(each.targets[0], ast.Name):
                self.names.setdefault(each.targets[0].id, []).append(each.value)
        self.generic_visit(node)
        self.names, self.texts = outer

    def visit_Call(self, node: ast.Call) -> None:
        name = _last(node.func)
        owner = _last(node.func.value) if isinstance(node.func, ast.Attribute) else ""
        kind = getattr(errors, name, None)
        told = isinstance(kind, type) and issubclass(kind, errors.MechdesignError)
        if name in _GIVEN or told or name.endswith("Error"):
            if name not in ("KeyError", "TypeError", "AttributeError", "ImportError", "ValueError"):
                self._add(node.args, getattr(getattr(errors, name, None), "exit_code", 2))
        elif name == "doubt":
            self._add(node.args, None)
        elif name == "Caution":
            self._add(node.args[1:2], None)
        elif name in ("append", "extend") and (owner in _LISTS or self.texts):
            # What is kept as several values together is no text yet.
            given = [each for each in node.args if not isinstance(each, ast.Tuple)]
            for each in given:
                given = [*given, *each.args] if isinstance(each, ast.Call) and owner in _LISTS else given
            self._add(given, 2 if owner == "problems" else None)
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if isinstance(node.value, ast.List) and _last(node.targets[0]) in _LISTS:
            self._add([node.value], None)
        if _last(node.targets[0]) == _CHOICE and isinstance(node.value, ast.Tuple):
            self._add(node.value.elts[:1], 2)
        if _last(node.targets[0]) == _FAILED and isinstance(node.value, ast.JoinedStr | ast.BinOp):
            self._add([node.value], 3)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if _last(node.target) in _LISTS:
            self._add([node.value], None)
        self.generic_visit(node)

    def visit_Yield(self, node: ast.Yield) -> None:
        self._give(node.value)
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        self._give(node.value)
        self.generic_visit(node)

    def _give(self, value: ast.expr | None) -> None:
        if not self.texts or value is None:
            return
        if self.texts == _EXPLAINED or (self.texts.startswith("tuple") and isinstance(value, ast.Tuple)):
            first, text = value.elts if isinstance(value, ast.Tuple) else (None, value)
            code = first.value if isinstance(first, ast.Constant) else 3
            self._add([text], code if isinstance(code, int) else 3)
            if isinstance(first, ast.List):
                self._add([first], None)
            return
        self._add([value], PART if self.texts == "str" else None)

    def _add(self, given: Iterable[ast.expr], code: int | None) -> None:
        for each in given:
            for text in self._written(each):
                plain = _PLACE.sub("", text)
                if _SENTENCE.search(plain) and (code != PART or len(re.findall(r"[A-Za-z']{2,}", plain)) >= _WORDS):
                    self.found.append((text.strip(" ;"), code))

    def _written(self, node: ast.expr, *, known: bool = True) -> Iterator[str]:
        """What an expression may read, ``<...>`` for what is not written there; names are looked up once."""
        if isinstance(node, ast.Name) and known:
            for value in self.names.get(node.id, ()):
                yield from self._written(value, known=False)
        elif isinstance(node, ast.Call) and known:
            for value in self.functions.get(_last(node.func), ()):
                yield from self._written(value, known=False)
        elif isinstance(node, ast.IfExp):
            yield from self._written(node.body, known=known)
            yield from self._written(node.orelse, known=known)
        elif isinstance(node, ast.ListComp | ast.GeneratorExp):
            yield from self._written(node.elt, known=known)
        elif isinstance(node, ast.List | ast.Tuple):
            for part in node.elts:
                yield from self._written(part, known=known)
        elif isinstance(node, ast.Constant | ast.JoinedStr | ast.BinOp):
            yield _text(node, self.names, self.constants)


def _text(node: ast.expr, names: Mapping[str, Sequence[ast.expr]], constants: Mapping[str, float]) -> str:
    """What an expression reads; texts and numbers that have a name of their own are put in where there is but one."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part, names, constants) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        number = _number(node.value, constants)
        if number is not None:
            return f"{number:,}" if isinstance(number, int) else f"{number:g}"
        # What is added there are numbers.
        summed = isinstance(node.value, ast.BinOp) and isinstance(node.value.op, ast.Add)
        return f"<{_place(node.value)}>" if summed else _text(node.value, names, constants)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _text(node.left, names, constants) + _text(node.right, names, constants)
    if isinstance(node, ast.Name) and [type(value) for value in names.get(node.id, ())] == [ast.JoinedStr]:
        return _text(names[node.id][0], {}, constants)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult) and isinstance(node.left, ast.Constant):
        return node.left.value if isinstance(node.left.value, str) else f"<{_place(node)}>"
    return f"<{_place(node)}>"


def _place(node: ast.expr) -> str:
    """What stands at a place of a message, by the name that the source gives it."""
    if isinstance(node, ast.Call):
        parts: Sequence[ast.expr] = node.args
        words = [part.value for part in parts if isinstance(part, ast.Constant) and isinstance(part.value, str)]
        if _last(node.func) == "counted" and words:
            return f"number of {words[-1]}s"
        if _last(node.func) == "suggestion":
            return "suggestion"
        owner = [node.func.value] if isinstance(node.func, ast.Attribute) else [node.func]
        return _place([*parts, *owner][0])
    if isinstance(node, ast.IfExp):
        kinds = [_text(part, {}, {}) for part in (node.body, node.orelse)]
        return "|".join(re.sub("[<>]", "", kind) for kind in kinds if kind)
    if isinstance(node, ast.Subscript):
        return _place(node.value)
    return _last(node).strip("_").replace("_", " ")


def _last(node: ast.AST) -> str:
    """The last name of ``a.b.c``; of other expressions something like it."""
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.Name):
        return node.id
    inner = next((each for each in ast.walk(node) if isinstance(each, ast.Name | ast.Attribute)), None)
    return _last(inner) if inner is not None else "..."
