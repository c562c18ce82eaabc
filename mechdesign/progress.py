"""Progress of a long computation, as numerics report it."""

from __future__ import annotations


class Progress:
    """Receives how far a computation is; this one ignores it."""

    def start(self, total: int, what: str) -> None:
        """Begin a stage of `total` steps named `what`; ends the stage before it."""

    def update(self, n: int) -> None:
        """`n` more steps are done."""


NULL = Progress()
