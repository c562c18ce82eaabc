"""How processes start, told without importing what starts them, which costs a hundredth of a second."""

from __future__ import annotations

import sys


def start_method() -> str | None:
    """The way that was chosen for this process; else they are forked on Linux, where that is quick and safe.

    None is the system's own.
    """
    module = sys.modules.get("multiprocessing")
    chosen: str | None = None if module is None else module.get_start_method(allow_none=True)
    return chosen or ("fork" if sys.platform == "linux" else None)


def inherit() -> bool:
    """Whether new processes have what this one has in its memory, and begin in no time."""
    return start_method() == "fork"
