"""Chunks of work on processes, any executor, or threads, in order and with bounded memory.

A long computation is a function that can be pickled, with its study and arguments, and a sequence of items: it can run
on other machines. Its values do not depend on where they are computed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from functools import partial
from typing import TypeVar

from mechdesign.commands import MAX_JOBS
from mechdesign.ground.work.pool import ChunkMap, Pool

# An executor of Windows has no more processes.
_MOST = 61 if sys.platform == "win32" else MAX_JOBS

Item = TypeVar("Item")
Value = TypeVar("Value")

_pool: ContextVar[Pool | None] = ContextVar("pool of long computations", default=None)


def worker_count(jobs: int | None) -> int:
    """Number of threads: `jobs`, or the processors this process may use.

    Raises
    ------
    ValueError
        If `jobs` is less than 1 or more than `MAX_JOBS`.
    """
    if jobs is None:
        available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return min(available, _MOST)
    if not 1 <= jobs <= MAX_JOBS:
        raise ValueError(f"jobs must be from 1 to {MAX_JOBS}, not {jobs}")
    return min(jobs, _MOST)


def map_chunks(
    function: Callable[[Item], Value], items: Iterable[Item], jobs: int | None = 1, *, travels: bool = False
) -> Iterator[Value]:
    """Yield ``function(item)`` in the order of `items`, computed by `jobs` workers; see `workers`."""
    with workers(function, jobs, travels=travels) as compute:
        yield from compute(items)


@contextmanager
def workers(
    function: Callable[[Item], Value], jobs: int | None = 1, *, travels: bool = False
) -> Iterator[Callable[[Iterable[Item]], Iterator[Value]]]:
    """Give a map of `function` over items, in their order.

    Few tasks are under way or waiting to be consumed, whatever the number of items. An exception or an interrupt (also
    of the consumer) drops what is not finished.

    Parameters
    ----------
    jobs : int or None
        Number of workers; None uses every processor. 1 computes in the calling thread.
    travels : bool
        Whether the work may be pickled: the function, items and values. It runs on the pool of `on`, or on processes
        of this map's own. Else it runs on threads, which share memory and gain on few operations of some hundred
        thousand elements, where NumPy releases the interpreter's lock.

    Raises
    ------
    LostWorkerError
        If a chunk ends each worker that takes it.
    """
    shared = _pool.get() if travels else None
    pool = shared or Pool.local(worker_count(jobs), threads=not travels)
    try:
        yield ChunkMap(pool, partial(_apart, function) if travels else function)
    finally:
        if pool is not shared:
            pool.close()


def spread(jobs: int | None) -> AbstractContextManager[None]:
    """Context whose long computations run on the same processes, or where they run already."""
    return on(Pool.local(worker_count(jobs))) if _pool.get() is None else nullcontext()


@contextmanager
def on(pool: Pool) -> Iterator[None]:
    """Inside, long computations run on the workers of a pool, which is closed at the end."""
    before = _pool.set(pool)
    try:
        yield
    finally:
        _pool.reset(before)
        pool.close()


@contextmanager
def here() -> Iterator[None]:
    """Inside, all work runs in this process."""
    pool = _pool.set(None)
    try:
        yield
    finally:
        _pool.reset(pool)


def _apart(function: Callable[[Item], Value], item: Item) -> Value:
    with here():
        return function(item)
