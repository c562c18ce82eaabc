"""Chunks of work on threads or processes, in order, with bounded memory; and linear algebra on one thread.

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
from functools import cache
from itertools import islice
from typing import Any, TypeVar

from mechdesign.commands import MAX_JOBS

Item = TypeVar("Item")
Value = TypeVar("Value")

# Enough waiting chunks that no thread idles while the consumer works; few, because they are all in memory.
_LOOK_AHEAD = 3
# Options of glibc's mallopt, from malloc.h.
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MEBIBYTE = 2**20
# Option of Linux's prctl, from prctl.h: the signal that a process gets when its parent ends.
_PR_SET_PDEATHSIG = 1
# Sent to a whole group of processes, workers too.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if sys.platform != "win32" else ()
# Read by a library of linear algebra when it is loaded: SciPy's may be so in the middle of a computation.
_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")

_lock = threading.Lock()
_inside = 0
_outside = ExitStack()


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
        pool = ProcessPoolExecutor(count, mp_context=fork, initializer=_adopt, initargs=(function, os.getpid()))
        call = _call
    else:
        pool = ThreadPoolExecutor(count, thread_name_prefix="mechdesign")
        call = function
    with pool:
        try:
            if call is _call:
                _fork_all(pool)
            yield lambda items: _in_order(pool, call, items, _LOOK_AHEAD * count)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _fork_all(pool: Executor) -> None:
    """Fork the workers, which the first work does; a signal waits until they know what to do with it."""
    with undisturbed():
        pool.submit(os.getpid)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Inside, an interrupt waits; also in what is forked there."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with(parent: int) -> None:
    """However the process that forked this one ends, this one ends with it."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


def _in_order(pool: Executor, call: Callable[[Item], Value], items: Iterable[Item], ahead: int) -> Iterator[Value]:
    source = iter(items)
    pending: deque[Future[Value]] = deque(pool.submit(call, item) for item in islice(source, ahead))
    while pending:
        value = pending.popleft().result()
        pending.extend(pool.submit(call, item) for item in islice(source, 1))
        yield value


# The function of a forked worker: inherited, not pickled, so that it may close over a whole study.
_adopted: Callable[[Any], Any] | None = None


def _adopt(function: Callable[[Any], Any], parent: int) -> None:
    global _adopted
    _adopted = function
    end_with(parent)
    # An interrupt is the parent's to handle: it lets the chunks under way finish.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)


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
