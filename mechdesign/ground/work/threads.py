"""Settings under which all is computed: linear algebra on one thread, no words of NumPy, freed memory kept for reuse.

The last digits of a long sum depend on how many threads share it.
"""

from __future__ import annotations

import ctypes
import os
import platform
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache

# Options of glibc's mallopt, from malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MEBIBYTE = 2**20
# Variables that a library of linear algebra reads when it is loaded, SciPy's perhaps in the middle of a computation.
_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_lock = threading.Lock()
_inside = 0
_outside = ExitStack()


@cache
def keep_freed_memory() -> None:
    """Let the C library keep up to 256 MiB of freed blocks; does nothing where it is not glibc.

    A chunk's temporaries are of some hundred kilobytes. By default every one of them is mapped anew and returned on
    release, so that each of its pages faults in its first write: that took half the time of a Monte Carlo run.
    """
    if sys.platform != "linux" or platform.libc_ver()[0] != "glibc":
        return
    mallopt = ctypes.CDLL(None).mallopt
    mallopt(_MMAP_THRESHOLD, 64 * _MEBIBYTE)
    mallopt(_TRIM_THRESHOLD, 256 * _MEBIBYTE)


@contextmanager
def one_thread() -> Iterator[None]:
    """Inside, linear algebra uses one thread, so that results do not depend on the number of threads.

    The limit holds for the process and those forked from it. The former settings come back when the last block ends:
    blocks may be nested, and overlap in several threads.

    NumPy does not warn there: what has no value, or too large a one, is nan or infinite, and results say so themselves.
    """
    from numpy import errstate

    global _inside
    with _lock:
        if not _inside:
            _limit()
        _inside += 1
    try:
        with errstate(all="ignore"):
            yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside:
                _outside.close()


def _limit() -> None:
    from threadpoolctl import threadpool_limits

    _outside.callback(_restore, {name: os.environ.get(name) for name in _VARIABLES})
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))
    _outside.enter_context(threadpool_limits(1, user_api="blas"))


def _restore(values: dict[str, str | None]) -> None:
    for name, value in values.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
