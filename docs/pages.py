"""Pages that are made from the code and the shipped studies while the site is built, and examples that are run then."""

from __future__ import annotations

import shutil
from pathlib import Path

import benchmarks
import cells
import examples
import gallery
import limits
import lists
import papers
import path_problems
import verification
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.typing import ExtensionMetadata
from steps import step

ROOT = Path(__file__).parent
# What makes pages: functions that give their texts by their paths.
MAKERS = (
    gallery.with_thumbnails, lists.pages, papers.pages, path_problems.pages, verification.pages, benchmarks.pages,
    limits.pages,
)  # fmt: skip
# Reports that pages show, by their names in the folder `_static`: what an example has written.
REPORTS = {"first_four_bar.html": "tutorials/first_four_bar/results/study/kinematics/report.html"}


def write(app: Sphinx) -> None:
    """Write every made page whose text is another than before, and run the examples of the others.

    Raises
    ------
    ExtensionError
        If an example does not do what its page says.
    """
    for maker in MAKERS:
        with step(f"pages of {maker.__module__}"):
            texts = maker()
        for name, text in texts.items():
            path = ROOT / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                path.write_text(text, encoding="utf-8")
    # Pictures of the pages come from what their examples have written.
    if wrong := examples.wrong(examples.pages()):
        raise ExtensionError("\n\n".join(wrong))
    for name, report in REPORTS.items():
        shutil.copyfile(examples.RUN / report, ROOT / "_static" / name)


def show_cells(app: Sphinx, name: str, source: list[str]) -> None:
    """Put what the cells of a notebook have shown below them, and the notebook for Jupyter below its heading."""
    page = ROOT / f"{name}.md"
    if cells.is_notebook(page):
        heading, text = source[0].split("\n", 1)
        run = examples.RUN / name
        file = f"../_run/{name}/{page.stem}.ipynb"
        source[0] = f"{heading}\n\n{{download}}`As a notebook for Jupyter <{file}>`\n{cells.with_outputs(text, run)}"


def setup(app: Sphinx) -> ExtensionMetadata:
    """Sphinx's entry."""
    app.connect("builder-inited", write)
    app.connect("source-read", show_cells)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
