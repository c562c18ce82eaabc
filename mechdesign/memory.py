"""Keeping freed memory for the next temporary array instead of giving it back to the system."""

from __future__ import annotations

import ctypes
import platform
from functools import cache

# Options of glibc's mallopt, from malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MEBIBYTE = 2**20


@cache
def keep_freed_memory() -> None:
    """Let the C library keep up to 256 MiB of freed blocks; does nothing where it is not glibc.

    A chunk's temporaries are of some hundred kilobytes. By default every one of them is mapped anew and returned on
    release, so that each of its pages faults in its first write: that took half the time of a Monte Carlo run.
    """
    if platform.libc_ver()[0] != "glibc":
        return
    mallopt = ctypes.CDLL(None).mallopt
    mallopt(_MMAP_THRESHOLD, 64 * _MEBIBYTE)
    mallopt(_TRIM_THRESHOLD, 256 * _MEBIBYTE)
