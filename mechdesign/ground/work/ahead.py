"""A process that imports what a later step needs while this process computes what the step is about."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import partial
from importlib import import_module
from typing import ParamSpec, TypeVar

from mechdesign.ground.work.pool import LostWorkerError, Pool

Arguments = ParamSpec("Arguments")
Value = TypeVar("Value")

_ready: ContextVar[Pool | None] = ContextVar("process that has imported a module", default=None)


@contextmanager
def importing(module: str, jobs: int) -> Iterator[None]:
    """Inside, a process imports a module, and then does what `call` is given.

    There is none where it would gain nothing: of one job, where the module is here already, and where the system has
    no room for it. At the end it is killed: what it has not done nobody waits for.
    """
    if jobs == 1 or module in sys.modules:
        yield
        return
    from mechdesign.ground.work.processes import Processes

    try:
        process = Processes(1)
    except OSError:
        yield
        return
    process.submit(_import, module)
    before = _ready.set(Pool(lambda: process, 1))
    try:
        yield
    finally:
        _ready.reset(before)
        process.kill()
        process.shutdown()


def _import(module: str) -> None:
    import_module(module)
    # What was imported is no garbage, among which a collection would look for some; a figure makes many small things.
    gc.freeze()
    gc.set_threshold(200_000, 20, 20)
    gc.enable()


def call(function: Callable[Arguments, Value], *arguments: Arguments.args, **options: Arguments.kwargs) -> Value:
    """The value of a function, called in the process of `importing`; here where there is none, or where it was lost.

    There the function, its arguments and its value are pickled.
    """
    pool = _ready.get()
    if pool is not None and pool.executor is not None:
        with suppress(BrokenExecutor, LostWorkerError):
            value: Value = pool.outcome(pool.executor.submit(partial(function, *arguments, **options)))
            return value
    return function(*arguments, **options)
