"""Chunks of work on threads or processes, in order, with bounded memory."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import platform
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import islice
from typing import Any, TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")

# Enough waiting chunks that no thread idles while the consumer works; few, because they are all in memory.
_LOOK_AHEAD = 3
# Options of glibc's mallopt, from malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MEBIBYTE = 2**20


def worker_count(jobs: int | None) -> int:
    """Number of threads: `jobs`, or the processors this process may use.

    Raises
    ------
    ValueError
        If `jobs` is less than 1.
    """
    if jobs is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if jobs < 1:
        raise ValueError(f"jobs must be at least 1, not {jobs}")
    return jobs


def map_chunks(
    function: Callable[[Item], Value], items: Iterable[Item], jobs: int | None = 1, *, processes: bool = False
) -> Iterator[Value]:
    """Yield ``function(item)`` in the order of `items`, computed by `jobs` workers; see `workers`."""
    with workers(function, jobs, processes=processes) as compute:
        yield from compute(items)


@contextmanager
def workers(
    function: Callable[[Item], Value], jobs: int | None = 1, *, processes: bool = False
) -> Iterator[Callable[[Iterable[Item]], Iterator[Value]]]:
    """Give a map of `function` over items, in their order, whose workers live until the context ends.

    At most ``3 * jobs`` chunks are under way or waiting to be consumed, whatever the number of items. An exception or
    an interrupt (also of the consumer) drops the chunks not begun and waits for those under way.

    Parameters
    ----------
    jobs : int or None
        Number of workers; None uses every processor. 1 computes in the calling thread.
    processes : bool
        Workers are forked processes where the system has them, else threads. NumPy releases the interpreter's lock in
        its kernels, so threads gain on few operations of some thousand elements and share memory; many operations of
        less need processes, whose items and values are pickled.
    """
    count = worker_count(jobs)
    if count == 1:
        yield lambda items: map(function, items)
        return
    pool: Executor
    call: Callable[[Item], Value]
    if processes and sys.platform == "linux":
        fork = multiprocessing.get_context("fork")
        pool = ProcessPoolExecutor(count, mp_context=fork, initializer=_adopt, initargs=(function,))
        call = _call
    else:
        pool = ThreadPoolExecutor(count, thread_name_prefix="mechdesign")
        call = function
    with pool:
        try:
            yield lambda items: _in_order(pool, call, items, _LOOK_AHEAD * count)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _in_order(pool: Executor, call: Callable[[Item], Value], items: Iterable[Item], ahead: int) -> Iterator[Value]:
    source = iter(items)
    pending: deque[Future[Value]] = deque(pool.submit(call, item) for item in islice(source, ahead))
    while pending:
        value = pending.popleft().result()
        pending.extend(pool.submit(call, item) for item in islice(source, 1))
        yield value


# The function of a forked worker: inherited, not pickled, so that it may close over a whole study.
_adopted: Callable[[Any], Any] | None = None


def _adopt(function: Callable[[Any], Any]) -> None:
    global _adopted
    _adopted = function
    # An interrupt is the parent's to handle: it lets the chunks under way finish.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _call(item: Any) -> Any:
    assert _adopted is not None
    return _adopted(item)


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
