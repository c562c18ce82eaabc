"""Workers of any executor of `concurrent.futures`, and an ordered map on them that survives the loss of workers.

A task is a function and some items. Other processes get the function pickled, and each worker unpickles it once.
"""

from __future__ import annotations

import math
import pickle
import platform
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, wait
from functools import cache, cached_property, lru_cache, partial
from itertools import islice
from operator import length_hint
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar, cast

from mechdesign.ground.errors import MechdesignError
from mechdesign.ground.versions import VERSION, installed
from mechdesign.ground.work import interrupts
from mechdesign.ground.work.start import inherit
from mechdesign.ground.work.threads import keep_freed_memory, one_thread

if TYPE_CHECKING:
    from mechdesign.ground.work.processes import Processes

Item = TypeVar("Item")
Value = TypeVar("Value")

# Tasks of each worker that are under way or waiting: enough that no worker idles, few because all are in memory.
LOOK_AHEAD = 3
LOOK = 0.2  # seconds between two checks for an interrupt
# Length of a task in seconds, and the largest factor by which its number of chunks grows from task to task.
_SECONDS = 1.0
_GROWTH = 8
# Seconds of work that this process does alone, before others begin: about what it costs to begin them.
_FORKED, _FRESH = 0.03, 0.5
# Part of the work to come that counts as if this process had done it: where much is left, others begin sooner.
_TO_COME = 0.1


class LostWorkerError(MechdesignError):
    """A chunk of work ends every worker that computes it, or no worker is left."""


class Pool:
    """`width` workers of an executor; `open_` gives the executor, and a new one where workers were lost.

    The executor is opened once this process has worked alone for `patience` seconds. Threads of this process share its
    functions and memory: nothing is pickled for them, and a task is a single chunk.
    """

    executor: Executor | None = None

    def __init__(
        self, open_: Callable[[], Executor], width: int, patience: float = 0.0, *, threads: bool = False
    ) -> None:
        self._open, self._width, self._patience, self.threads = open_, width, patience, threads
        self.work(0.0)

    @staticmethod
    def local(count: int, *, threads: bool = False) -> Pool:
        """Processes or threads of this machine; a single one is this process."""
        patience = math.inf if count == 1 else 0.0 if threads else _FORKED if inherit() else _FRESH
        return Pool(partial(_opened, count, threads=threads), count, patience, threads=threads)

    @property
    def width(self) -> int:
        """Number of workers."""
        return self._width

    @property
    def processes(self) -> Processes | None:
        """The executor, if it is of processes that this one has begun."""
        from mechdesign.ground.work.processes import Processes

        return self.executor if isinstance(self.executor, Processes) else None

    def work(self, seconds: float) -> None:
        """This process has worked alone, or would have to; open the executor if that is enough."""
        self._patience -= seconds
        if self._patience <= 0:
            self.executor = self._open()

    def renew(self) -> None:
        """Take other workers, once some were lost."""
        self.close()
        self.executor = self._open()

    def outcome(self, future: Future[Any]) -> Any:
        """Wait for the value of a task.

        Raises
        ------
        LostWorkerError
            If the executor dropped it.
        """
        while not future.done():
            wait([future], LOOK)
            interrupts.check()
        try:
            return future.result()
        except (CancelledError, ConnectionError) as error:
            raise LostWorkerError(f"the executor lost the work: {type(error).__name__} {error}".rstrip()) from error

    def drop(self, tasks: Sequence[Future[Any]]) -> None:
        """Let go of tasks: processes of this machine that are at one are killed, others finish it."""
        if all(task.done() for task in tasks):
            return
        if self.processes is not None:
            self.processes.kill()
            return
        for task in tasks:
            task.cancel()

    def close(self) -> None:
        """Drop the tasks not begun and wait for those under way."""
        if self.executor is None:
            return
        try:
            self.executor.shutdown(wait=True, cancel_futures=True)
        except TypeError:
            # The executor of dask does not know `cancel_futures`.
            self.executor.shutdown(wait=False)


def _opened(count: int, *, threads: bool) -> Executor:
    """An executor of this machine. What starts processes is imported here: many commands start none."""
    if threads:
        from concurrent.futures import ThreadPoolExecutor

        return ThreadPoolExecutor(count, "mechdesign")
    from mechdesign.ground.work.processes import Processes

    return Processes(count)


class _Task(NamedTuple):
    """Chunks that are computed together: the number of the first one, and their items."""

    first: int
    items: list[Any]
    future: Future[Any]


class ChunkMap(Generic[Item, Value]):
    """An ordered map of a function over items on the workers of a pool.

    At most ``3 * width`` tasks are under way or waiting to be consumed; a task has as many chunks as take about a
    second. Chunks of lost workers are computed again, one by one with no other work under way.

    Raises
    ------
    LostWorkerError
        If a chunk ends every worker that computes it, or the executor refuses work or returns something else.
    """

    def __init__(self, pool: Pool, function: Callable[[Item], Value]) -> None:
        self._pool, self._function = pool, function
        # Number of chunks of the next task.
        self._chunks = 1

    @cached_property
    def _work(self) -> Callable[[list[Item]], tuple[list[Value], float]]:
        if self._pool.threads:
            return partial(_timed, self._function)
        version = None if self._pool.processes is not None else _version()
        return partial(_perform, version, pickle.dumps(self._function, protocol=5))

    def __call__(self, items: Iterable[Item]) -> Iterator[Value]:
        source, begun = iter(items), 0
        while self._pool.executor is None:
            interrupts.check()
            if not (own := [*islice(source, 1)]):
                return
            values, seconds = _timed(self._function, own)
            yield from values
            if (left := length_hint(source, 2)) > 1:
                # The first chunk may have imported much, and says nothing of those that are left.
                self._pool.work(seconds * (1.0 + _TO_COME * left) if begun else seconds)
            begun += 1
        left, tasks = length_hint(source), deque[_Task]()
        try:
            while True:
                while len(tasks) < (ahead := LOOK_AHEAD * self._pool.width):
                    # The last tasks are short, so that all workers finish together.
                    shared = -(-left // ahead) if left > 0 else self._chunks
                    own = [*islice(source, min(self._chunks, shared))]
                    if not own:
                        break
                    tasks.append(_Task(begun, own, self._submit(own)))
                    begun += len(own)
                    left -= len(own)
                if not tasks:
                    return
                try:
                    values = self._values(tasks[0])
                except Exception as error:
                    if not _is_loss(error):
                        raise
                    self._pool.renew()
                    while tasks:
                        yield from self._again(tasks[0])
                        tasks.popleft()
                else:
                    tasks.popleft()
                    yield from values
        finally:
            self._pool.drop([task.future for task in tasks])

    def _submit(self, items: list[Item]) -> Future[Any]:
        assert self._pool.executor is not None
        try:
            return self._pool.executor.submit(self._work, items)
        except BrokenExecutor as error:
            future: Future[Any] = Future()
            future.set_exception(error)
            return future
        except Exception as error:
            raise LostWorkerError(f"the executor takes no work: {type(error).__name__}: {error}") from error

    def _values(self, task: _Task) -> list[Value]:
        outcome = self._pool.outcome(task.future)
        if not isinstance(outcome, tuple) or len(outcome) != 2 or len(outcome[0]) != len(task.items):
            raise LostWorkerError("the executor gives something else than the values of the work that it took")
        values, seconds = outcome
        if not self._pool.threads:
            self._chunks = max(1, min(int(_SECONDS * len(values) / max(seconds, 1e-9)), _GROWTH * self._chunks))
        return cast(list[Value], values)

    def _again(self, task: _Task) -> Iterator[Value]:
        """Values of a task that was under way when workers were lost, and may have ended one."""
        future = task.future
        if future.done() and not future.cancelled() and not _is_loss(future.exception()):
            yield from self._values(task)
            return
        for number, item in enumerate(task.items, task.first + 1):
            try:
                yield from self._values(_Task(number, [item], self._submit([item])))
            except Exception as error:
                if not _is_loss(error):
                    raise
                raise LostWorkerError(
                    f"chunk {number} of the work ends each process that computes it, as where memory runs out; give it "
                    "more memory, or use fewer --jobs"
                ) from None


def _is_loss(error: BaseException | None) -> bool:
    """Whether an error is that of a lost worker: the pool's, or that of dask, which has tried several."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


@cache
def _version() -> str:
    """Versions on which values depend besides the work itself."""
    python = ".".join(platform.python_version_tuple()[:2])
    return f"Python {python}, mechdesign {VERSION}, numpy {installed('numpy')}, scipy {installed('scipy')}"


@lru_cache(maxsize=4)
def _function(content: bytes) -> Callable[[Any], Any]:
    """In a worker: the function of a task, which it keeps for the next ones."""
    function: Callable[[Any], Any] = pickle.loads(content)
    return function


def _perform(version: str | None, content: bytes, items: list[Any]) -> tuple[list[Any], float]:
    """In a worker: the values of a pickled function, and how long they took, in seconds; None is the same version."""
    if version is not None and version != _version():
        raise MechdesignError(f"a worker has {_version()}, not {version}; install the same there")
    keep_freed_memory()
    return _timed(_function(content), items)


def _timed(function: Callable[[Any], Any], items: list[Any]) -> tuple[list[Any], float]:
    begun = time.perf_counter()
    with one_thread():
        return [function(item) for item in items], time.perf_counter() - begun
