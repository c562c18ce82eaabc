"""Pages that are made from the code and the shipped studies while the site is built; none of them is in the repository."""

from __future__ import annotations

from pathlib import Path

import gallery
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

ROOT = Path(__file__).parent
# What makes pages: functions that give their texts by their paths.
MAKERS = (gallery.pages,)


def write(app: Sphinx) -> None:
    """Write every page whose text is another than before, so that the builder reads only those again."""
    for maker in MAKERS:
        for name, text in maker().items():
            path = ROOT / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> ExtensionMetadata:
    """Sphinx's entry."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
