"""Errors and warnings that a user can meet, read from the source: each is written once, in the call that makes it.

A module, or the package around it, names in `HELP_PAGE` the page of the documentation that tells more of its messages.
"""

from __future__ import annotations

import ast
import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

from mechdesign import errors
from mechdesign.cautions import KINDS
from mechdesign.errors import EXIT_CODES
from mechdesign.mechanism.configuration import REASONS
from mechdesign.reference.entries import Entry

KIND = "message"
PLACE = "\N{HORIZONTAL ELLIPSIS}"  # what differs from one message to the other
PART = 0  # in place of an exit code: a text that a message is made of
# What makes an error of a study, beside the classes of errors.
MAKERS = ("Problem", "failure", "problem", "report", "Misfit", "note", "_note", "Undetermined")
FOREIGN = ("KeyError", "TypeError", "AttributeError", "ImportError", "ValueError")
# A message has two words or more outside of its places, a part more; letters by which a message is recognised.
_SENTENCE = re.compile(r"[A-Za-z]{2,}[,;:')]* +['(]?[A-Za-z]")
_WORDS_OF_PART = 4
_LETTERS = 10


class Message(NamedTuple):
    """An error with its exit code or a warning with its kind, and the page of the documentation that tells more."""

    text: str
    page: str
    code: int | None  # None of a warning
    kind: str = ""

    @property
    def meaning(self) -> str:
        """What an error with its exit code means, or a warning of its kind."""
        if self.code == PART:
            return "an error or a warning, or a part of one"
        if self.code is None:
            return f"a warning of kind {self.kind}: {KINDS[self.kind].meaning}" if self.kind else "a warning"
        return f"exit code {self.code}: {EXIT_CODES[self.code]}"

    def holds(self, words: str) -> bool:
        """Whether these words stand in it, or it in these words."""
        if any(words.casefold() in text.casefold() for text in (self.text, self.text.replace(PLACE, ""))):
            return True
        parts, end = self.text.split(PLACE), 0
        for part in parts:
            if (start := words.find(part, end)) < 0:
                return False
            end = start + len(part)
        return sum(map(len, parts)) >= _LETTERS


@cache
def messages() -> tuple[Message, ...]:
    """Every message of the package, page by page, in the order of the source."""
    by_text: dict[tuple[str, str], Message] = {}
    for page, tree in _modules(files("mechdesign")):
        for message in _read(page, tree):
            earlier = by_text.get((page, message.text))
            if earlier is None or earlier.code == PART:
                by_text[page, message.text] = message
    return tuple(
        sorted(by_text.values(), key=lambda message: (not message.page.startswith("reference/"), message.page))
    )


def find_messages(words: str) -> list[Entry]:
    """Entries of messages that contain these words or are these words, and of reasons why a pose fails."""
    matches = [
        Entry(message.text, KIND, f"{message.meaning}; see the page {message.page} of the documentation")
        for message in messages() if message.holds(words)
    ]  # fmt: skip
    reasons = [
        Entry(reason, KIND, f"why a pose fails: {cure}")
        for reason, cure in REASONS.items() if words == reason or (reason in words and not matches)
    ]  # fmt: skip
    return [*reasons, *matches]


def _modules(folder: Traversable, page: str = "") -> Iterator[tuple[str, ast.Module]]:
    """Every module below a folder, with its page."""
    inside = sorted(folder.iterdir(), key=lambda item: item.name)
    trees = {child.name: ast.parse(child.read_text(encoding="utf-8")) for child in inside if child.name.endswith(".py")}
    if "__init__.py" in trees:
        page = _help_page(trees["__init__.py"]) or page
    for tree in trees.values():
        yield _help_page(tree) or page, tree
    for child in inside:
        if child.is_dir():
            yield from _modules(child, page)


def _help_page(tree: ast.Module) -> str:
    pages = _given(tree.body).get("HELP_PAGE")
    return str(ast.literal_eval(pages[0])) if pages else ""


def _read(page: str, tree: ast.Module) -> Iterator[Message]:
    """Messages of a module; where it has a page also further texts in its functions, as parts."""
    constants = _given(tree.body)
    for node in _statements(tree):
        if isinstance(node, ast.Assign) and _name(node.targets[0]) == "one_of":
            yield from _sentences(node.value, page, 2)
        elif isinstance(node, ast.FunctionDef):
            nodes = [*ast.walk(node)]
            made = [found for call in nodes if isinstance(call, ast.Call) and (found := _made(call))[2]]
            names = {**constants, **_given(nodes)} if made else {}
            for code, kind, arguments in made:
                for argument in arguments:
                    inside = dict.fromkeys(_name(part) for part in ast.walk(argument))
                    for value in (argument, *(value for name in inside for value in names.get(name, ()))):
                        yield from _sentences(value, page, code, kind)
            for statement in node.body if page else ():
                for message in _sentences(statement, page, PART):
                    if len(re.findall(r"[A-Za-z']{2,}", message.text)) >= _WORDS_OF_PART:
                        yield message


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Every statement of a module, in the order of `ast.walk`, which would go through the expressions too."""
    nodes: deque[ast.AST] = deque([tree])
    while nodes:
        yield (node := nodes.popleft())
        nodes.extend(child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.expr))


def _made(call: ast.Call) -> tuple[int | None, str, Sequence[ast.expr]]:
    """Exit code, kind, and the arguments of a call that are messages."""
    name = _name(call.func)
    if name == "Caution" and call.args:
        return None, str(getattr(call.args[0], "value", "")), call.args[1:2]
    if name == "doubt":
        return None, "suspect", call.args
    if name in MAKERS:
        return 2, "", call.args
    if name.endswith("Error") and name not in FOREIGN:
        return getattr(getattr(errors, name, None), "exit_code", 2), "", call.args[:1]
    return 3, "", [keyword.value for keyword in call.keywords if keyword.arg == "failed"]


def _name(node: ast.AST) -> str:
    """The last name of ``a.b.c``."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def _given(nodes: Iterable[ast.AST]) -> Mapping[str, list[ast.expr]]:
    """What names are given among some statements."""
    values: dict[str, list[ast.expr]] = {}
    for node in nodes:
        pairs: list[tuple[ast.expr, ast.expr]] = []
        if isinstance(node, ast.Assign):
            pairs = [(target, node.value) for target in node.targets]
        elif isinstance(node, ast.AugAssign | ast.NamedExpr):
            pairs = [(node.target, node.value)]
        elif isinstance(node, ast.For | ast.comprehension):
            pairs = [(node.target, node.iter)]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "append":
            pairs = [(node.func.value, node.args[0])]
        for target, value in pairs:
            for name_node in target.elts if isinstance(target, ast.Tuple) else [target]:
                values.setdefault(_name(name_node), []).append(value)
    return values


def _sentences(node: ast.AST, page: str, code: int | None, kind: str = "") -> Iterator[Message]:
    """Sentences among the texts of an expression or a statement, `PLACE` for what differs; docstrings are none."""
    inner: Iterable[ast.AST] = ast.iter_child_nodes(node)
    text = ""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        text = node.value.replace("{}", PLACE)
    elif isinstance(node, ast.JoinedStr):
        words = (str(part.value) if isinstance(part, ast.Constant) else PLACE for part in node.values)
        text = re.sub(f"{PLACE}+", PLACE, "".join(words))
        inner = [part.value for part in node.values if isinstance(part, ast.FormattedValue)]
    if _SENTENCE.search(text.replace(PLACE, "")):
        yield Message(" ".join(text.split()).strip(" ;,:"), page, code, kind)
    for child in inner:
        yield from _sentences(child, page, code, kind)
