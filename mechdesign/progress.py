"""Progress of a long computation, told to whoever wants to know."""

from __future__ import annotations


class Progress:
    """Receives how far a computation is; numerics call it and never ask who listens. This one listens to nothing."""

    def start(self, total: int, what: str) -> None:
        """Begin a stage of `total` steps named `what`; ends the stage before it."""

    def update(self, n: int) -> None:
        """`n` more steps are done."""


NULL = Progress()
