"""The calls in the source that make errors and warnings, and what their arguments may read."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

from mechdesign import errors

PLACE = "\N{HORIZONTAL ELLIPSIS}"  # what differs from one message to the other
# What makes a message beside errors and `Caution`: calls with it among their arguments, functions that return it.
MAKERS = ("Problem", "failure", "problem", "report", "Misfit", "note", "_note", "Undetermined")
RETURNING = {"explain": 4, "judge_failures": 3}
FOREIGN = ("KeyError", "TypeError", "AttributeError", "ImportError", "ValueError")


class Made(NamedTuple):
    """An argument that is a message, the names around it, its exit code (None of a warning), the kind of warning."""

    argument: ast.expr
    scope: Scope
    code: int | None
    kind: str = ""


class Scope(NamedTuple):
    """The file of a function, and what the names in it are given."""

    file: str
    names: Mapping[str, Sequence[ast.expr]]


def _name(node: ast.AST) -> str:
    """The last name of ``a.b.c``."""
    return str(getattr(node, "attr", getattr(node, "id", "")))


def _made(call: ast.Call, scope: Scope) -> Iterator[Made]:
    """Messages among the arguments of a call."""
    name = _name(call.func)
    if name == "Caution" and call.args:
        kind = call.args[0].value if isinstance(call.args[0], ast.Constant) else ""
        yield Made(call.args[1], scope, None, str(kind))
    elif name == "doubt":
        yield from (Made(each, scope, None, "suspect") for each in call.args)
    elif name in MAKERS or (name.endswith("Error") and name not in FOREIGN):
        code = getattr(getattr(errors, name, None), "exit_code", 2)
        yield from (Made(each, scope, code) for each in call.args[: None if name in MAKERS else 1])
    yield from (Made(keyword.value, scope, 3) for keyword in call.keywords if keyword.arg == "failed")


def _given(nodes: Iterable[ast.AST]) -> dict[str, list[ast.expr]]:
    """What names are given among some statements."""
    found: dict[str, list[ast.expr]] = {}
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
            targets = target.elts if isinstance(target, ast.Tuple) else [target]
            apart = value.elts if isinstance(value, ast.Tuple) and len(value.elts) == len(targets) > 1 else None
            for each, own in zip(targets, apart or [value] * len(targets), strict=True):
                found.setdefault(_name(each), []).append(own)
    return found


def _returned(function: ast.FunctionDef) -> Iterator[ast.expr]:
    for node in ast.walk(function):
        if isinstance(node, ast.Return | ast.Yield) and node.value is not None:
            yield node.value


class Reader:
    """Reads the messages of a package's files; names and functions are looked up where they are given and defined."""

    def __init__(self, trees: Mapping[str, ast.Module]) -> None:
        self.trees = trees
        self._functions: dict[str, dict[str, list[ast.FunctionDef]]] = {}
        self._constants: dict[str, list[ast.expr]] = {}
        self._texts: dict[tuple[str, str], list[tuple[str, bool]]] = {}
        for file, tree in trees.items():
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef):
                    self._functions.setdefault(node.name, {}).setdefault(file, []).append(node)
                elif isinstance(node, ast.Module | ast.ClassDef):
                    for name, values in _given(node.body).items():
                        self._constants.setdefault(name, []).extend(values)

    def made(self, file: str, node: ast.AST | None = None, scope: Scope | None = None) -> Iterator[Made]:
        """Messages of a file, or below a node of it, in the order of the source."""
        scope = scope or Scope(file, {})
        for child in ast.iter_child_nodes(node or self.trees[file]):
            inner = scope
            if isinstance(child, ast.FunctionDef):
                inner = Scope(file, _given(ast.walk(child)))
                if child.name in RETURNING:
                    yield from (Made(value, inner, RETURNING[child.name]) for value in _returned(child))
            elif isinstance(child, ast.Call):
                yield from _made(child, scope)
            yield from self.made(file, child, inner)

    def texts(self, node: ast.expr, scope: Scope, seen: frozenset[str] = frozenset()) -> Iterator[tuple[str, bool]]:
        """What an expression may read, `PLACE` for what differs; and, as parts, what may stand in its places."""
        inner: Sequence[ast.expr] = ()
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value.replace("{}", PLACE), False
        elif isinstance(node, ast.JoinedStr):
            words = (str(value.value) if isinstance(value, ast.Constant) else PLACE for value in node.values)
            yield re.sub(f"{PLACE}+", PLACE, "".join(words)), False
            places = [value.value for value in node.values if isinstance(value, ast.FormattedValue)]
            yield from ((text, True) for place in places for text, _ in self.texts(place, scope, seen))
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
            sides = [[*self.texts(each, scope, seen)] for each in (node.left, node.right)]
            whole = [[text for text, part in side if not part] or [PLACE] for side in sides]
            yield from ((left + right, False) for left, right in product(*whole))
            yield from ((text, part) for side in sides for text, part in side if part)
        elif isinstance(node, ast.IfExp):
            inner = node.body, node.orelse
        elif isinstance(node, ast.BoolOp):
            inner = node.values
        elif isinstance(node, ast.List | ast.Tuple):
            inner = node.elts
        elif isinstance(node, ast.Dict):
            inner = node.values
        elif isinstance(node, ast.ListComp | ast.GeneratorExp):
            inner = (node.elt,)
        elif isinstance(node, ast.Subscript):
            inner = (node.value,)
        elif isinstance(node, ast.Name | ast.Attribute) and _name(node) not in seen:
            seen |= {_name(node)}
            inner = scope.names.get(_name(node), ()) or self._constants.get(_name(node), ())
        elif isinstance(node, ast.Call) and _name(node.func) == "join":
            inner = node.args
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "items":
            inner = (node.func.value,)
        elif isinstance(node, ast.Call):
            yield from self._of_function(_name(node.func), scope.file)
        for each in inner:
            yield from self.texts(each, scope, seen)

    def _of_function(self, name: str, file: str) -> Sequence[tuple[str, bool]]:
        """What a function returns: the one of the file where it is called, or else the only one of that name."""
        homes = self._functions.get(name, {})
        home = file if file in homes else next(iter(homes), "") if len(homes) == 1 else ""
        if home and (home, name) not in self._texts:
            found = self._texts[home, name] = []
            for function in homes[home]:
                scope = Scope(home, _given(ast.walk(function)))
                found += [text for value in _returned(function) for text in self.texts(value, scope)]
        return self._texts.get((home, name), ())
