"""The four papers that mechdesign began with: their references, findings, and the cases of their numbers."""

from __future__ import annotations

from pathlib import Path

import yaml
from cases import cases

DATA = Path(__file__).parent / "papers.yaml"
OPENING = """# The four papers

mechdesign began with four papers; the code and these pages call them S1 to S4. Here are their references
as far as they are known, what was found in them, and the pages of the [verification manual](../verification/index.md)
that set their numbers beside ours. Where a printed digit is another one, these say why.
"""


def pages() -> dict[str, str]:
    """The text of the page, by its path in the folder of the site."""
    parts = [OPENING.rstrip()]
    for name, paper in yaml.safe_load(DATA.read_text(encoding="utf-8")).items():
        parts += [f"## {paper['title']}", paper["reference"], paper["text"].rstrip()]
        of_paper = [case for case in cases().values() if case.name.startswith(f"{name.lower()}_")]
        parts.append("\n".join(f"- [{case.title}](../verification/{case.name}.md)" for case in of_paper))
        parts.append("Checked besides by\n" + "\n".join(f"- `{test}`" for test in paper["tests"]))
    return {"theory/papers.md": "\n\n".join(parts) + "\n"}
