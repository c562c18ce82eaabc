"""Notebooks: what their cells show on the site, and what Jupyter opens; that they run is tested with other pages."""

from __future__ import annotations

import json
from pathlib import Path

import cells
import pytest
from matplotlib.figure import Figure

PAGES = sorted(path for path in (Path(__file__).parents[2] / "docs/notebooks").glob("*.md") if cells.is_notebook(path))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_jupyter_opens_the_code_of_the_page_without_outputs(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    notebook = json.loads(cells.jupyter(text))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert [cell["source"] for cell in code] == [part.split("```")[0].strip() for part in text.split("```python\n")[1:]]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    assert len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])
    # Words: none of what was printed, and no link that leads nowhere.
    words = "\n".join(cell["source"] for cell in notebook["cells"] if cell["cell_type"] == "markdown")
    assert words.startswith(text.split("\n", 1)[0])
    assert "```" not in words
    assert ".md)" not in words


def test_three_notebooks_are_there() -> None:
    assert [page.stem for page in PAGES] == ["four_bar", "scipy", "tolerances"]


def test_a_cell_has_the_value_of_its_last_line() -> None:
    names = {"radius": 3}
    assert cells.run("area = radius**2\narea + 1", "page", names) == 10
    assert cells.run("area = 5", "page", names) is None
    assert cells.run("", "page", names) is None
    assert names["area"] == 5


def test_pictures_and_tables_are_shown_and_numbers_are_text() -> None:
    class Table:
        def _repr_html_(self) -> str:
            return "<table></table>"

    figure = Figure()
    figure.subplots().set_title("Height < stroke")
    assert cells.shown(figure).startswith('<img alt="Height &lt; stroke" src="data:image/png;base64,')
    assert cells.shown(Table()) == "<table></table>"
    assert cells.shown(1.5) == ""


def test_what_a_cell_has_shown_stands_below_it(tmp_path: Path) -> None:
    (tmp_path / "1.html").write_text("<b>shown</b>")
    text = "# T\n\n```python\na\n```\n\n```text\n1\n```\n\n```python\nb\n```\n\nEnd.\n"
    made = cells.with_outputs(text, tmp_path)
    assert made.replace("\n\n``````{raw} html\n<b>shown</b>\n``````", "") == text
    assert made.index("b\n```") < made.index("<b>shown") < made.index("End.")
