"""Chunks of work on processes, any executor, or threads, in order and with bounded memory.

A long computation is a function that can be pickled, with its study and arguments, and a sequence of items: it can run
on other machines and be divided into shards. Its values do not depend on where they are computed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from functools import partial
from typing import Any, TypeVar

from mechdesign.commands import MAX_JOBS
from mechdesign.work.pool import ChunkMap, Pool

HELP_PAGE = "reference/commands"

Item = TypeVar("Item")
Value = TypeVar("Value")
# From the name of a computation, its map and the items, to the values.
Share = Callable[[str, Callable[[Iterable[Any]], Iterator[Any]], Iterable[Any]], Iterator[Any]]

_pool: ContextVar[Pool | None] = ContextVar("pool of long computations", default=None)
_division: ContextVar[Share | None] = ContextVar("who computes which chunks", default=None)


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
        of this map's own, and may be divided by `divided`. Else it runs on threads, which share memory and gain on few
        operations of some hundred thousand elements, where NumPy releases the interpreter's lock.

    Raises
    ------
    LostWorkerError
        If a chunk ends each worker that takes it.
    """
    shared, share = (_pool.get(), _division.get()) if travels else (None, None)
    pool = shared or Pool.local(worker_count(jobs), threads=not travels)
    try:
        compute = ChunkMap(pool, partial(_apart, function) if travels else function)
        yield compute if share is None else partial(share, _name(function), compute)
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
def divided(share: Share | None) -> Iterator[None]:
    """Inside, `share` decides which chunks of long computations are computed, from the name, the map and its items."""
    before = _division.set(share)
    try:
        yield
    finally:
        _division.reset(before)


class Divided(BaseException):
    """A long computation ends without its values, since other shards compute a part of them."""


@contextmanager
def apart(left: list[Divided]) -> Iterator[None]:
    """Inside, divided work does not end the computations after it, which do not depend on it; `left` collects it."""
    try:
        yield
    except Divided as error:
        left.append(error)


@contextmanager
def here() -> Iterator[None]:
    """Inside, all work runs in this process and is not divided."""
    pool, division = _pool.set(None), _division.set(None)
    try:
        yield
    finally:
        _pool.reset(pool)
        _division.reset(division)


def _apart(function: Callable[[Item], Value], item: Item) -> Value:
    with here():
        return function(item)


def _name(function: Any) -> str:
    """Name of a function with its callable arguments, the same in every process."""
    if isinstance(function, partial):
        return " ".join(map(_name, (function.func, *filter(callable, function.args))))
    kind = function if hasattr(function, "__qualname__") else type(function)
    return f"{kind.__module__}.{kind.__qualname__}"
