"""Docstrings under attributes, which say what a key of a study or an option of a command means."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import NamedTuple

_CONSTANT = re.compile(r"\|([A-Z_]+)\|")
_EXAMPLE = " Example: "


class KeyText(NamedTuple):
    """The docstring of a key: text in one line, and examples as a study writes them."""

    text: str
    examples: tuple[str, ...] = ()


@cache
def key_texts(module: str) -> Mapping[tuple[str, str], KeyText]:
    """Docstrings under the attributes of a module's classes, by class and attribute; ``|NAME|`` is a constant of it.

    They are read from the source where they are asked for: Python does not keep them, and pydantic would read them at
    every start.
    """
    texts = {}
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    for holder in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        for key, below in pairwise(holder.body):
            if not isinstance(key, ast.AnnAssign) or not isinstance(key.target, ast.Name):
                continue
            if not isinstance(below, ast.Expr) or not isinstance(below.value, ast.Constant):
                continue
            text, *examples = " ".join(str(below.value.value).split()).split(_EXAMPLE)
            text = _CONSTANT.sub(lambda name: str(getattr(sys.modules[module], name[1])), text)
            texts[holder.name, key.target.id] = KeyText(quoted(text), tuple(examples))
    return texts


def quoted(text: str) -> str:
    """A docstring with quotation marks in place of double backticks."""
    return text.replace("``", "'")
