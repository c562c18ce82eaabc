"""Docstrings under attributes, which say what a key of a study or an option of a command means."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Mapping
from functools import cache
from itertools import pairwise


@cache
def docstrings(module: str) -> Mapping[tuple[str, str], str]:
    """The docstrings under the attributes of a module's classes, each in one line, by class and attribute.

    They are read from the source where they are asked for: Python does not keep them.
    """
    texts = {}
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    for holder in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        for key, below in pairwise(holder.body):
            if not isinstance(key, ast.AnnAssign) or not isinstance(key.target, ast.Name):
                continue
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                texts[holder.name, key.target.id] = " ".join(str(below.value.value).split())
    return texts
