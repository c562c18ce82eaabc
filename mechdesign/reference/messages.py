"""Errors and warnings that a user can meet: read from the source, where each is written once."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

from mechdesign import errors
from mechdesign.errors import EXIT_CODES
from mechdesign.reference.entries import Entry

KIND = "message"
# What the files whose names begin so speak of, in the order of the page; the longest that fits counts.
SUBJECTS = {
    "study": "study file",
    "study/text/units": "units",
    "expressions": "expressions",
    "mechanism": "mechanism",
    "study/building": "mechanism",
    "study/schema/checker": "mechanism",
    "study/poses": "poses",
    "study/schema/p": "poses",
    "analyses/poses": "poses",
    "analyses/kinematics": "kinematics",
    "study/schema/targets": "targets",
    "analyses/workspace": "workspace",
    "analyses/region": "workspace",
    "study/schema/workspace": "workspace",
    "analyses/optimize": "optimize",
    "study/schema/optimize": "optimize",
    "analyses/reliability": "reliability",
    "study/schema/reliability": "reliability",
    "study/schema/variation": "reliability",
    "study/schema/methods": "reliability",
    "study/schema/iso_tolerances": "tolerances and fits (ISO 286-1)",
    "analyses/stiffness": "stiffness",
    "study/schema/stiffness": "stiffness",
    "report/requirements": "requirements",
    "": "commands, options and files",
}
PART = 0
_PART = "a part of an error or a warning"
_WARNING = "a warning: the results are there, and this is to be known of them"
# Calls that are given a message, besides errors; and lists that messages are put on.
_GIVEN = ("Problem", "failure", "problem", "report", "_unexpected", "UnknownColumnError", "Undetermined")
_LISTS = ("warnings", "problems", "notes", "told", "found")
# Functions that give texts, in these rooms; of a single text it may be a part of a message.
_TEXTS = ("Iterator[str]", "list[str]", "str | None", "str")
_ROOMS = ("study", "mechanism", "analyses", "expressions", "errors")
# Fewest words of a part.
_WORDS = 5
# Shortest message: two words, outside of its places.
_SENTENCE = re.compile(r"[A-Za-z]{2,}[,;:')]* +['(]?[A-Za-z]")
_PLACE = re.compile(r"<[^<>]*>")
# Fewest letters of a message outside of its places by which a text is known to be that message.
_LETTERS = 12


class Message(NamedTuple):
    """An error or a warning: its text with ``<...>`` for what differs, its subject, its exit code.

    A warning has no code, a part of a message `PART`.
    """

    text: str
    subject: str
    code: int | None

    def holds(self, words: str) -> bool:
        """Whether these words stand in it, or it in these words."""
        parts = _PLACE.split(self.text)
        if words.casefold() in self.text.casefold():
            return True
        pattern = ".*".join(map(re.escape, parts))
        return sum(map(len, parts)) >= _LETTERS and re.search(pattern, words) is not None


@cache
def messages() -> tuple[Message, ...]:
    """Every message of the package, by what it speaks of and in the order of the source."""
    found: dict[Message, None] = {}
    for name, source in _sources(files("mechdesign")):
        subject = SUBJECTS[max((begin for begin in SUBJECTS if name.startswith(begin)), key=len)]
        for text, code in _Reader.read(source, texts=name.startswith(_ROOMS)):
            found[Message(text, subject, code)] = None
    order = list(dict.fromkeys(SUBJECTS.values()))
    return tuple(sorted(found, key=lambda message: order.index(message.subject)))


def find_messages(words: str) -> list[Entry]:
    """Entries of the messages in which these words stand, or that these words are."""
    return [Entry(told.text, KIND, f"{told.subject}; {meaning(told.code)}") for told in messages() if told.holds(words)]


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


class _Reader(ast.NodeVisitor):
    """Gathers the messages of a file; a name that is given for a message is looked up in the function around it."""

    def __init__(self, rooms: bool) -> None:
        self.found: list[tuple[str, int | None]] = []
        self.names: dict[str, list[ast.expr]] = {}
        # What functions give that are read for their texts.
        self.given = _TEXTS if rooms else ()
        self.texts = ""

    @staticmethod
    def read(source: str, *, texts: bool) -> list[tuple[str, int | None]]:
        """Messages of a file and their exit codes; with `texts` also what its functions return."""
        reader = _Reader(texts)
        reader.visit(ast.parse(source))
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
        if name in _GIVEN or isinstance(getattr(errors, name, None), type) or name.endswith("Error"):
            if name not in ("KeyError", "TypeError", "AttributeError", "ImportError", "ValueError"):
                self._add(node.args, getattr(getattr(errors, name, None), "exit_code", 2))
        elif name in ("append", "extend") and (owner in _LISTS or self.texts):
            self._add(node.args, 2 if owner == "problems" else None)
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if isinstance(node.value, ast.List) and _last(node.targets[0]) in _LISTS:
            self._add([node.value], None)
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
        if self.texts and value is not None:
            self._add([value], PART if self.texts == "str" else None)

    def _add(self, given: Iterable[ast.expr], code: int | None) -> None:
        for each in given:
            for text in self._written(each):
                plain = _PLACE.sub("", text)
                if _SENTENCE.search(plain) and (code != PART or len(re.findall(r"[A-Za-z']{2,}", plain)) >= _WORDS):
                    self.found.append((text.strip(" ;"), code))

    def _written(self, node: ast.expr, *, known: bool = True) -> Iterator[str]:
        """What an expression may read, ``<...>`` for what is not written there; a name's values are looked up once."""
        if isinstance(node, ast.Name) and known:
            for value in self.names.get(node.id, ()):
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
            yield _text(node)


def _text(node: ast.expr) -> str:
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return _text(node.value)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _text(node.left) + _text(node.right)
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
        owner = [node.func.value] if isinstance(node.func, ast.Attribute) else [node.func]
        return _place([*parts, *owner][0])
    if isinstance(node, ast.IfExp):
        kinds = [_text(part) for part in (node.body, node.orelse)]
        return "|".join(kind.strip("<>") for kind in kinds if kind)
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
