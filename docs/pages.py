"""Pages that are made from the code and the shipped studies while the site is built, and examples that are run then."""

from __future__ import annotations

from pathlib import Path

import examples
import gallery
import lists
import papers
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.typing import ExtensionMetadata

ROOT = Path(__file__).parent
# What makes pages: functions that give their texts by their paths.
MAKERS = (gallery.pages, lists.pages, papers.pages)


def write(app: Sphinx) -> None:
    """Write every made page whose text is another than before, and run the examples of the others.

    Raises
    ------
    ExtensionError
        If an example does not do what its page says.
    """
    for maker in MAKERS:
        for name, text in maker().items():
            path = ROOT / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                path.write_text(text, encoding="utf-8")
    # Pictures of the pages come from what their examples have written.
    if wrong := examples.wrong(examples.pages()):
        raise ExtensionError("\n\n".join(wrong))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Sphinx's entry."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
