"""The live page of a study in a frame of a notebook."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.task import session_of
from mechdesign.study import Study


class LiveFrame:
    """Shows the page of a study, which is served until `close` or the end of this process."""

    def __init__(self, study: Study, load: Callable[[], Study] | None, height: int) -> None:
        self._server, self._height = LiveServer(session_of(study, load), framed=True), height
        self._server.start()

    @property
    def url(self) -> str:
        """The address of the page, for this machine alone."""
        return self._server.url

    def close(self) -> None:
        """Serve no more."""
        self._server.close()

    def __repr__(self) -> str:
        return f"<live page at {self.url}>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{escape(self.url)}" title="the study, live" width="100%" height="{self._height}" '
            'style="border: 0" allow="clipboard-write"></iframe>'
        )
