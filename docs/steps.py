"""What a build of the site is doing, a line for each step as it ends, with the seconds that it took."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

from sphinx.util.logging import getLogger

_log = getLogger(__name__)
_SHORT = 0.1  # seconds that are not worth a line


@contextmanager
def step(words: str) -> Iterator[None]:
    """Say how long what is done inside took, if it was not done at once."""
    begin = perf_counter()
    yield
    seconds = perf_counter() - begin
    if seconds >= _SHORT:
        _log.info("%6.1f s  %s", seconds, words)
