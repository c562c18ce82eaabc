"""Executors by name, as `--executor` takes them: of dask, or those that a function of a module returns."""

from __future__ import annotations

import importlib
import logging
import os
import signal
import sys
import time
from concurrent.futures import CancelledError, Executor, Future, wait
from itertools import chain
from typing import Any

from mechdesign.ground.errors import StudyError, counted
from mechdesign.ground.work import interrupts
from mechdesign.ground.work.chunks import worker_count
from mechdesign.ground.work.pool import LOOK, LostWorkerError, Pool

LOCAL = "local"
# Seconds after which a scheduler that does not answer is given up, and one without workers.
_ANSWERS = 5
_NO_WORKERS = 60


def named(name: str, jobs: int | None) -> Pool:
    """Workers of ``dask:ADDRESS``, of ``dask:local``, or of the executor that ``module:factory`` gives.

    Parameters
    ----------
    jobs : int or None
        Number of workers, where the executor has no number of its own; None: one for each processor.

    Raises
    ------
    StudyError
        If there is no such executor, or its scheduler does not answer.
    """
    kind, colon, rest = name.partition(":")
    if not kind or not colon or not rest:
        raise StudyError(f"--executor takes dask:ADDRESS, dask:{LOCAL} or module:factory, not {name!r}")
    return _Dask(name, rest, jobs) if kind == "dask" else _of_module(name, kind, rest, jobs)


def _of_module(name: str, module: str, factory: str, jobs: int | None) -> Pool:
    # A module in the working directory is found, as with `python -m`.
    sys.path.insert(0, os.getcwd())
    try:
        make = getattr(importlib.import_module(module), factory)
    except (ImportError, AttributeError) as error:
        raise StudyError(f"--executor {name}: {error}") from None
    except Exception as error:
        raise StudyError(f"--executor {name}: {type(error).__name__}: {error}") from None
    finally:
        sys.path.pop(0)

    def open_() -> Executor:
        try:
            executor = make()
        except (Exception, SystemExit) as error:
            raise StudyError(f"--executor {name}: {type(error).__name__}: {error}") from None
        if not isinstance(executor, Executor):
            kind = type(executor).__name__
            raise StudyError(f"--executor {name} gives no concurrent.futures.Executor, but {kind!r}")
        return executor

    first = open_()
    # Executors of the standard library have the number of their workers.
    width = worker_count(jobs if jobs is not None else getattr(first, "_max_workers", None) or None)
    opened = chain([first], iter(open_, None))
    return Pool(lambda: next(opened), width)


class _Dask(Pool):
    """Workers of a dask scheduler, which replaces lost ones itself, at an address or started here."""

    threads = False

    def __init__(self, name: str, address: str, jobs: int | None) -> None:
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError:
            message = "needs dask, which is not installed: pip install 'mechdesign[cluster]'"
            raise StudyError(f"--executor {name} {message}") from None
        self._name, self._cluster = name, None
        # Errors of dask are reported as messages here, instead of its log with tracebacks.
        for handler in logging.getLogger("distributed").handlers:
            handler.setLevel(logging.CRITICAL + 1)
        try:
            if address == LOCAL:
                self._cluster = distributed.LocalCluster(
                    n_workers=worker_count(jobs), threads_per_worker=1, dashboard_address="127.0.0.1:0",
                    silence_logs=50, preload=[__name__],
                )  # fmt: skip
            self._client: Any = distributed.Client(self._cluster or address, timeout=_ANSWERS, set_as_default=False)
        except (OSError, ValueError, RuntimeError) as error:
            self._end()
            if address == LOCAL:
                raise StudyError(f"--executor {name}: no cluster starts: {error}") from None
            raise StudyError(
                f"--executor {name}: no scheduler answers there: {error}; start 'dask scheduler'"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=_NO_WORKERS)
        except TimeoutError:
            self.close()
            message = f"the scheduler has no workers after {counted(_NO_WORKERS, 'second')}; start some"
            raise StudyError(f"--executor {name}: {message}") from None
        self.executor = self._client.get_executor(pure=False)

    @property
    def width(self) -> int:
        """Number of threads of the workers, which come and go."""
        return max(1, self._count())

    def _count(self) -> int:
        try:
            return int(sum(self._client.nthreads().values()))
        except Exception as error:
            raise self._gone() from error

    def _gone(self) -> LostWorkerError:
        return LostWorkerError(
            f"--executor {self._name}: the scheduler does not answer any more; start it again, and run with --resume"
        )

    def outcome(self, future: Future[Any]) -> Any:
        """Wait for the value of a task, but not for ever on a scheduler without workers."""
        since = time.monotonic()
        while not wait([future], LOOK).done:
            interrupts.check()
            if self._count():
                since = time.monotonic()
            elif time.monotonic() - since > _NO_WORKERS:
                words = f"the scheduler has had no workers for {counted(_NO_WORKERS, 'second')}"
                why = "the work may have ended them, as where memory runs out or mechdesign is not installed"
                raise LostWorkerError(f"--executor {self._name}: {words}; {why}")
        try:
            return future.result()
        except CancelledError as error:
            raise self._gone() from error

    def renew(self) -> None:
        """Nothing to do: the scheduler replaces lost workers."""

    def close(self) -> None:
        """Drop the tasks and leave the scheduler; one that was started here ends."""
        self._client.close()
        self._end()

    def _end(self) -> None:
        if self._cluster is not None:
            self._cluster.close()


def dask_setup(worker: object) -> None:
    """In a worker of a scheduler started here: leave interrupts to the command."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
