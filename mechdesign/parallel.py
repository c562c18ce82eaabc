"""Chunks of work on threads, processes or any executor, in order, with bounded memory; linear algebra on one thread.

Great work travels: a function that can be pickled, with the study and what is asked of it, goes once to each worker,
and chunks follow, several in a task where they are short. What comes back does not depend on who computed it.

The last digits of a long sum depend on how many threads share it.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import platform
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from functools import cache, partial
from itertools import islice
from typing import Any, TypeVar

from mechdesign.commands import MAX_JOBS
from mechdesign.courier import LOOK_AHEAD, Courier, Pool

Item = TypeVar("Item")
Value = TypeVar("Value")
# From the name of what is computed, a map, and the items of that, to values.
Share = Callable[[str, Callable[[Iterable[Any]], Iterator[Any]], Iterable[Any]], Iterator[Any]]

# Options of glibc's mallopt, from malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MEBIBYTE = 2**20
# Option of Linux's prctl, from prctl.h: the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG = 1
# Sent to a whole group of processes, workers too.
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if sys.platform != "win32" else ()
# Read by a library of linear algebra when it is loaded: SciPy's may be so in the middle of a computation.
_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_lock = threading.Lock()
_inside = 0
_outside = ExitStack()
_pool: ContextVar[Pool | None] = ContextVar("where great work goes", default=None)
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
        Whether the work is worth going to the executor of `on`, where there is one, and being divided by `divided`. The
        function, items and values are pickled there.

    Raises
    ------
    LostWorkerError
        If a chunk ends each worker that takes it.
    """
    share = _division.get() if travels else None
    if share is None:
        with _map_of(function, jobs, processes=processes, travels=travels) as compute:
            yield compute
    else:
        with _map_of(partial(_undivided, function), jobs, processes=processes, travels=travels) as compute:
            yield partial(share, _name(function), compute)


@contextmanager
def _map_of(
    function: Callable[[Item], Value], jobs: int | None, *, processes: bool, travels: bool
) -> Iterator[Callable[[Iterable[Item]], Iterator[Value]]]:
    count = worker_count(jobs)
    elsewhere = _pool.get() if travels else None
    if elsewhere is not None:
        yield Courier(elsewhere, partial(_values, function))
    elif count == 1:
        yield lambda items: map(function, items)
    elif processes and sys.platform == "linux":
        pool = Pool(lambda: _forked(count), count)
        try:
            yield Courier(pool, partial(_values, function))
        finally:
            pool.close()
    else:
        with ThreadPoolExecutor(count, thread_name_prefix="mechdesign") as threads:
            try:
                yield lambda items: _in_order(threads, function, items, LOOK_AHEAD * count)
            finally:
                threads.shutdown(wait=True, cancel_futures=True)


@contextmanager
def on(pool: Pool) -> Iterator[None]:
    """Inside, great work goes to the workers of a pool, which is closed in the end."""
    before = _pool.set(pool)
    try:
        yield
    finally:
        _pool.reset(before)
        pool.close()


@contextmanager
def divided(share: Share | None) -> Iterator[None]:
    """Inside, the values of great work are what a function gives: from its name, a map, and the items of that."""
    before = _division.set(share)
    try:
        yield
    finally:
        _division.reset(before)


class Divided(BaseException):
    """Great work ends without its values, of which others compute a part."""


@contextmanager
def apart(left: list[Divided]) -> Iterator[None]:
    """Inside, work may be divided without an end to what follows, which does not depend on it; `left` tells of it."""
    try:
        yield
    except Divided as error:
        left.append(error)


@contextmanager
def here() -> Iterator[None]:
    """Inside, no work goes elsewhere or is divided."""
    pool, division = _pool.set(None), _division.set(None)
    try:
        yield
    finally:
        _pool.reset(pool)
        _division.reset(division)


def _undivided(function: Callable[[Item], Value], item: Item) -> Value:
    with here():
        return function(item)


def _name(function: Any) -> str:
    """What a function computes, in the same words in every process."""
    if isinstance(function, partial):
        return " ".join(map(_name, (function.func, *filter(callable, function.args))))
    kind = function if hasattr(function, "__qualname__") else type(function)
    return f"{kind.__module__}.{kind.__qualname__}"


def _values(function: Callable[[Item], Value], items: list[Item]) -> list[Value]:
    keep_freed_memory()
    with one_thread():
        return [function(item) for item in items]


def _in_order(pool: Executor, function: Callable[[Item], Value], items: Iterable[Item], ahead: int) -> Iterator[Value]:
    source = iter(items)
    pending: deque[Future[Value]] = deque(pool.submit(function, item) for item in islice(source, ahead))
    while pending:
        value = pending.popleft().result()
        pending.extend(pool.submit(function, item) for item in islice(source, 1))
        yield value


def _forked(count: int) -> Executor:
    """Forked workers; a signal waits until they know what to do with it."""
    fork = multiprocessing.get_context("fork")
    others = multiprocessing.active_children()
    try:
        pool = ProcessPoolExecutor(count, mp_context=fork, initializer=_settle_in, initargs=(os.getpid(),))
        with undisturbed():
            # The first work forks all of them.
            pool.submit(os.getpid)
    except OSError:
        # Where there is no room for all, those that there are would wait for work for ever.
        for worker in set(multiprocessing.active_children()).difference(others):
            worker.kill()
        raise
    return pool


@contextmanager
def undisturbed() -> Iterator[None]:
    """Inside, an interrupt waits; also in what is forked there."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with(parent: int) -> None:
    """However the process that forked this one ends, this one ends with it."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


def _settle_in(parent: int) -> None:
    # Work inside of work stays here.
    _pool.set(None)
    _division.set(None)
    end_with(parent)
    # An interrupt is the parent's to handle: it lets the chunks under way finish.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)


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


@contextmanager
def one_thread() -> Iterator[None]:
    """Results of what is computed inside do not depend on how many threads linear algebra may use.

    The limit is that of the process, and of those forked from it. What was set before comes back with the last of
    those inside, so that they may be nested, and overlap where several threads compute.
    """
    global _inside
    with _lock:
        if not _inside:
            _limit()
        _inside += 1
    try:
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
