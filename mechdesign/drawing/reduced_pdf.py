"""A figure as a PDF whose page is smaller than its layout, as a journal's column is."""

from __future__ import annotations

import io
from typing import Any, cast

from matplotlib.backends.backend_pdf import Op, PdfFile, PdfPages
from matplotlib.figure import Figure


def pdf(figure: Figure, creator: str | None, share: float) -> bytes:
    """A figure as a PDF without date or host, at a share of the size of its layout; `creator` is who made it."""
    stream = io.BytesIO()
    pages, reduced = cast(Any, PdfPages(stream)), cast(Any, _Reduced)
    pages._file = reduced(stream, {"CreationDate": None, "Creator": creator, "Producer": None}, share)
    with pages:
        figure.savefig(pages, format="pdf")
    return stream.getvalue()


class _Reduced(PdfFile):
    """A PDF with reduced pages; Matplotlib has no scale for what it draws in points."""

    def __init__(self, stream: io.BytesIO, metadata: dict[str, str | None], share: float) -> None:
        cast(Any, super()).__init__(stream, metadata)
        self._share = share

    def newPage(self, width: float, height: float) -> None:
        page, share = cast(Any, super()), self._share
        page.newPage(share * width, share * height)
        if share != 1.0:
            page.output(share, 0, 0, share, 0, 0, Op.concat_matrix)
        self.width, self.height = width, height
