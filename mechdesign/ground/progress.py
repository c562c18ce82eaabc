"""Progress of a long computation, as numerics report it."""

from __future__ import annotations

from typing import Self


class Progress:
    """Receives how far a computation is, which happens inside it as a context; this one ignores it."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def start(self, total: int, stage: str) -> None:
        """Begin a stage of `total` steps named `stage`; ends the stage before it."""

    def update(self, n: int) -> None:
        """`n` more steps are done."""


NULL = Progress()
