"""Cells of pages: blocks of Python, of which a notebook shows the last line's value; a notebook as Jupyter opens it."""

from __future__ import annotations

import ast
import base64
import io
import itertools
import json
import os
import re
from html import escape
from pathlib import Path
from typing import Any

# Cells of a page run beside others, where no window can be opened.
os.environ["MPLBACKEND"] = "agg"

from matplotlib.figure import Figure
from PIL import Image

FENCE = re.compile(r"(?ms)^(?P<fence>`{3,})(?P<kind>[^\n]*)\n(?P<body>.*?)^(?P=fence)[ ]*$")
# Pages that are notebooks.
FOLDER = "notebooks"
_COLOURS = 64  # of a picture: a quarter of its bytes
_LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)[^)]*\)")


def is_notebook(path: Path) -> bool:
    """Whether a page is one whose cells show values."""
    return path.parent.name == FOLDER and path.stem != "index"


def run(body: str, name: str, names: dict[str, Any]) -> Any:
    """Run a cell among the names of those before it; the value of its last line, None if that has none."""
    tree = ast.parse(body, name)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec"), names)
    return eval(compile(ast.Expression(last.value), name, "eval"), names) if isinstance(last, ast.Expr) else None


def shown(value: Any) -> str:
    """A value as a notebook shows it, in HTML: a picture, a table, an answer; empty for what is text alone."""
    if isinstance(value, Figure):
        drawn, small = io.BytesIO(), io.BytesIO()
        value.savefig(drawn, format="png")
        Image.open(drawn).convert("RGB").quantize(_COLOURS).save(small, format="png", optimize=True)
        words_of = (*value.texts, *(axes.title for axes in value.axes), *(axes.yaxis.label for axes in value.axes))
        alt = escape(next(filter(None, (text.get_text() for text in words_of)), ""))
        return f'<img alt="{alt}" src="data:image/png;base64,{base64.b64encode(small.getvalue()).decode()}">'
    html = getattr(value, "_repr_html_", lambda: None)()
    return html or ""


def with_outputs(text: str, folder: Path) -> str:
    """The text of a notebook's page with what its cells have shown, which stands in a folder by their numbers."""
    numbers = itertools.count()

    def cell(block: re.Match[str]) -> str:
        file = folder / f"{next(numbers)}.html" if block["kind"].strip() == "python" else None
        if file is None or not file.exists():
            return block[0]
        return f"{block[0]}\n\n``````{{raw}} html\n{file.read_text(encoding='utf-8')}\n``````"

    return FENCE.sub(cell, text)


def jupyter(text: str) -> str:
    """A notebook for Jupyter, without outputs, of a page; its links to other pages are words."""
    cells: list[dict[str, Any]] = []

    def add(kind: str, source: str, **more: Any) -> None:
        if source.strip():
            cells.append(
                {"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}, "source": source.strip(), **more}
            )

    at = 0
    for block in FENCE.finditer(text):
        if block["kind"].strip() in ("python", "text"):
            add("markdown", _LINK.sub(r"\1", text[at : block.start()]))
            at = block.end()
        if block["kind"].strip() == "python":
            add("code", block["body"], execution_count=None, outputs=[])
    add("markdown", _LINK.sub(r"\1", text[at:]))
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    content = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
