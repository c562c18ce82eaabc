"""Chunks of work on threads, processes or any executor, in order and with bounded memory.

A long computation is a function that can be pickled, with its study and arguments, and a sequence of items: it can run
on other machines. Its values do not depend on where they are computed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from contextvars import ContextVar
from functools import partial
from typing import TypeVar

from mechdesign.commands import MAX_JOBS
from mechdesign.work import interrupts
from mechdesign.work.pool import ChunkMap, Pool
from mechdesign.work.processes import forked

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
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not 1 <= jobs <= MAX_JOBS:
        raise ValueError(f"jobs must be from 1 to {MAX_JOBS}, not {jobs}")
    return jobs


def map_chunks(
    function: Callable[[Item], Value],
    items: Iterable[Item],
    jobs: int | None = 1,
    *,
    processes: bool = False,
    travels: bool = False,
) -> Iterator[Value]:
    """Yield ``function(item)`` in the order of `items`, computed by `jobs` workers; see `workers`."""
    with workers(function, jobs, processes=processes, travels=travels) as compute:
        yield from compute(items)


@contextmanager
def workers(
    function: Callable[[Item], Value], jobs: int | None = 1, *, processes: bool = False, travels: bool = False
) -> Iterator[Callable[[Iterable[Item]], Iterator[Value]]]:
    """Give a map of `function` over items, in their order, whose workers live until the context ends.

    Few tasks are under way or waiting to be consumed, whatever the number of items. An exception or an interrupt (also
    of the consumer) drops the chunks not begun and waits for those under way.

    Parameters
    ----------
    jobs : int or None
        Number of workers; None uses every processor. 1 computes in the calling thread.
    processes : bool
        Workers are forked processes where the system has them, else threads. NumPy releases the interpreter's lock in
        its kernels, so threads gain on few operations of some thousand elements and share memory; many operations of
        less need processes. The function, items and values are pickled.
    travels : bool
        Whether the work is long enough to run on the executor of `on`, where there is one. The function, items and
        values are then pickled.

    Raises
    ------
    LostWorkerError
        If a chunk ends each worker that takes it.
    """
    count = worker_count(jobs)
    elsewhere = _pool.get() if travels else None
    with _local(count, processes=processes) if elsewhere is None else nullcontext(elsewhere) as pool:
        yield partial(_one_after_another, function) if pool is None else ChunkMap(pool, function)


def _local(count: int, *, processes: bool) -> AbstractContextManager[Pool | None]:
    """Workers of this machine; None where the calling thread computes alone."""
    if count == 1:
        return nullcontext()
    if processes and sys.platform == "linux":
        return closing(Pool(partial(forked, count, _settle_in), count))
    return closing(Pool(partial(ThreadPoolExecutor, count, "mechdesign"), count, threads=True))


def _one_after_another(function: Callable[[Item], Value], items: Iterable[Item]) -> Iterator[Value]:
    for item in items:
        interrupts.check()
        yield function(item)


def _settle_in() -> None:
    # Work within a task runs in this worker.
    _pool.set(None)
    # The parent handles interrupts: it lets the chunks under way finish.
    interrupts.leave_to_parent()


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
