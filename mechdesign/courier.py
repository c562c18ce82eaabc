"""Work that travels to the workers of any executor, and comes back in order; workers may be lost on the way.

A task is a function, pickled, and some items. A short function goes along with every task; a long one goes once to each
worker, which keeps it by its digest.
"""

from __future__ import annotations

import pickle
import platform
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from itertools import islice
from operator import length_hint
from typing import Any, Generic, TypeVar, cast

from mechdesign.errors import MechdesignError

Item = TypeVar("Item")
Value = TypeVar("Value")

# Tasks a worker that are under way or waiting: enough that none idles while the consumer works; few, because they are
# all in memory.
LOOK_AHEAD = 3
# Length of a task, in seconds, and how many times as many chunks as the one before it has at most.
_SECONDS = 1.0
_GROWTH = 8
# Bytes of a function that go along with every task, and longer functions that a worker keeps.
_SHORT = 20_000
_MOST_KEPT = 4


class LostWorkerError(MechdesignError):
    """A chunk of work ends each worker that takes it, or there is nobody left to take it."""


class Pool:
    """`width` workers of an executor; `open_` gives one, and another where workers were lost."""

    losses = 1  #: times that workers are lost before chunks go one by one

    def __init__(self, open_: Callable[[], Executor], width: int) -> None:
        self._open, self._width = open_, width
        self.executor = open_()

    @property
    def width(self) -> int:
        """Number of workers."""
        return self._width

    def renew(self) -> None:
        """Take other workers, once some were lost."""
        self.close()
        self.executor = self._open()

    def outcome(self, future: Future[Any]) -> Any:
        """What a task gives, once it is there.

        Raises
        ------
        LostWorkerError
            If the executor dropped it.
        """
        try:
            return future.result()
        except (CancelledError, ConnectionError) as error:
            raise LostWorkerError(f"the executor lost the work: {type(error).__name__} {error}".rstrip()) from error

    def close(self) -> None:
        """Drop the tasks not begun and wait for those under way."""
        try:
            self.executor.shutdown(wait=True, cancel_futures=True)
        except TypeError:
            # Dask's does not know the second.
            self.executor.shutdown(wait=False)


@dataclass(eq=False)
class _Task:
    """Chunks that are computed together: the number of the first one, and their items."""

    first: int
    items: list[Any]
    future: Future[Any]

    @property
    def lost(self) -> bool:
        """Whether there will be no outcome."""
        if not self.future.done():
            # Of a pool that was lost.
            return True
        return self.future.cancelled() or _is_loss(self.future.exception())


class Courier(Generic[Item, Value]):
    """An ordered map on the workers of a pool: `function` takes a list of items and gives a list of values.

    At most ``3 * width`` tasks are under way or waiting to be consumed; chunks are put together so that a task takes
    about a second. Chunks of lost workers are computed again.

    Raises
    ------
    LostWorkerError
        If a chunk ends each worker that takes it, or the executor takes no work or gives something else for it.
    """

    def __init__(self, pool: Pool, function: Callable[[list[Item]], list[Value]]) -> None:
        self._pool = pool
        self._content = pickle.dumps(function, protocol=5)
        self._digest = blake2b(self._content, digest_size=16).digest()
        # Of the next task, as far as there are enough for all workers.
        self._chunks = 1
        self._sent = 0

    def __call__(self, items: Iterable[Item]) -> Iterator[Value]:
        source, left = iter(items), length_hint(items)
        tasks: deque[_Task] = deque()
        done = losses = 0
        try:
            while True:
                while len(tasks) < (ahead := LOOK_AHEAD * self._pool.width):
                    # The last tasks are short: no worker waits long for another.
                    shared = -(-left // ahead) if left > 0 else self._chunks
                    own = [*islice(source, min(self._chunks, shared))]
                    if not own:
                        break
                    left -= len(own)
                    first = tasks[-1].first + len(tasks[-1].items) if tasks else done
                    tasks.append(_Task(first, own, self._send(own)))
                if not tasks:
                    return
                try:
                    values = self._values(tasks[0])
                except Exception as error:
                    if not _is_loss(error):
                        raise
                    losses += 1
                    self._pool.renew()
                    while losses > self._pool.losses and tasks:
                        yield from self._one_by_one(tasks[0])
                        done = tasks[0].first + len(tasks[0].items)
                        tasks.popleft()
                    losses %= self._pool.losses + 1
                    for task in tasks:
                        if task.lost:
                            task.future = self._send(task.items)
                else:
                    done = tasks.popleft().first + len(values)
                    yield from values
        finally:
            for task in tasks:
                task.future.cancel()

    def _send(self, items: list[Item]) -> Future[Any]:
        # As many tasks as there are workers bring a long function along; who has not got it asks for it.
        self._sent += 1
        brought = self._sent <= self._pool.width or len(self._content) <= _SHORT
        return self._submit(items, self._content if brought else None)

    def _submit(self, items: list[Item], content: bytes | None) -> Future[Any]:
        try:
            return self._pool.executor.submit(_perform, _version(), self._digest, content, items)
        except BrokenExecutor as error:
            future: Future[Any] = Future()
            future.set_exception(error)
            return future
        except Exception as error:
            raise LostWorkerError(f"the executor takes no work: {type(error).__name__}: {error}") from error

    def _values(self, task: _Task) -> list[Value]:
        found = self._pool.outcome(task.future)
        if found is None:
            task.future = self._submit(task.items, self._content)
            found = self._pool.outcome(task.future)
        if not isinstance(found, tuple) or len(found) != 2 or len(found[0]) != len(task.items):
            raise LostWorkerError("the executor gives something else than the values of the work that it took")
        values, seconds = found
        self._chunks = max(1, min(int(_SECONDS * len(values) / max(seconds, 1e-9)), _GROWTH * self._chunks))
        return cast(list[Value], values)

    def _one_by_one(self, task: _Task) -> Iterator[Value]:
        """Values of a task that workers may be lost by: each chunk by itself, with nothing else under way."""
        if not task.lost:
            yield from self._values(task)
            return
        for number, item in enumerate(task.items, task.first + 1):
            try:
                yield from self._values(_Task(number, [item], self._submit([item], self._content)))
            except Exception as error:
                if not _is_loss(error):
                    raise
                raise LostWorkerError(
                    f"chunk {number} of the work ends each process that computes it, as where memory runs out; give it "
                    "more memory, or use fewer --jobs"
                ) from None


def _is_loss(error: BaseException | None) -> bool:
    """Whether an error says that a worker was lost: the pool's, or dask's, which has tried several."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


@cache
def _version() -> str:
    """What decides values, besides the work."""
    from importlib.metadata import version

    python = ".".join(platform.python_version_tuple()[:2])
    return ", ".join([f"Python {python}", *(f"{name} {version(name)}" for name in ("mechdesign", "numpy", "scipy"))])


# In a worker: the functions that it got, by their digests.
_functions: dict[bytes, Callable[[list[Any]], list[Any]]] = {}


def _perform(version: str, digest: bytes, content: bytes | None, items: list[Any]) -> tuple[list[Any], float] | None:
    """In a worker: the values of a function and how long they took, in seconds; None where it is not known here."""
    if version != _version():
        raise MechdesignError(f"a worker has {_version()}, not {version}; install the same there")
    function = _functions.get(digest)
    if function is None:
        if content is None:
            return None
        function = _functions[digest] = pickle.loads(content)
        while len(_functions) > _MOST_KEPT:
            _functions.pop(next(iter(_functions)), None)
    begun = time.perf_counter()
    values = function(items)
    return values, time.perf_counter() - begun
