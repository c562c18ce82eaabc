"""Progress of a long computation, told to whoever wants to know."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Receives how far a computation is; numerics call it and never ask who listens."""

    def start(self, total: int, what: str) -> None:
        """Begin a stage of `total` steps named `what`; ends the stage before it."""

    def update(self, n: int) -> None:
        """`n` more steps are done."""


class NullProgress:
    """Listens to nothing."""

    def start(self, total: int, what: str) -> None:
        """Ignore the stage."""

    def update(self, n: int) -> None:
        """Ignore the steps."""


NULL = NullProgress()
