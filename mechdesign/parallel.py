"""Chunks of work on threads, in order, with bounded memory."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import TypeVar

Item = TypeVar("Item")
Value = TypeVar("Value")

# Enough waiting chunks that no thread idles while the consumer works; few, because they are all in memory.
_LOOK_AHEAD = 3


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


def map_chunks(function: Callable[[Item], Value], items: Iterable[Item], jobs: int | None = 1) -> Iterator[Value]:
    """Yield ``function(item)`` in the order of `items`, computed on `jobs` threads.

    At most ``3 * jobs`` chunks are under way or waiting to be consumed, whatever the number of items. NumPy releases
    the interpreter's lock in its kernels, so threads gain on chunks of some thousand elements and share memory. An
    exception or an interrupt (also of the consumer) drops the chunks not begun and waits for those under way.

    Parameters
    ----------
    jobs : int or None
        Number of threads; None uses every processor. 1 computes in the calling thread.
    """
    workers = worker_count(jobs)
    if workers == 1:
        yield from map(function, items)
        return
    source = iter(items)
    with ThreadPoolExecutor(workers, thread_name_prefix="mechdesign") as pool:
        pending: deque[Future[Value]] = deque()
        try:
            pending.extend(pool.submit(function, item) for item in islice(source, _LOOK_AHEAD * workers))
            while pending:
                value = pending.popleft().result()
                pending.extend(pool.submit(function, item) for item in islice(source, 1))
                yield value
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
