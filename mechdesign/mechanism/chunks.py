"""A large batch in chunks that stay in the processor's cache, on one or more threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration, Reason, hide
from mechdesign.memory import keep_freed_memory
from mechdesign.numerics.arrays import Ints
from mechdesign.parallel import map_chunks, worker_count

# Poses of a chunk: the fastest of 4,096 to 262,144, measured. Closed forms are some fifty short operations; threads
# hand the interpreter's lock over at each and gain only on longer arrays.
CHUNK = 32768
MANY = 131072


def too_large(shape: tuple[int, ...]) -> bool:
    """Whether a batch is worth dividing."""
    return int(np.prod(shape, dtype=np.int64)) > CHUNK


Parts = tuple[Sequence[Value], Sequence[Value], Sequence[Value], Sequence[Value], NDArray[np.int8]]
# Solution of a batch in one piece, see `Plan.solve_at_once`.
AtOnce = Callable[[Sequence[Value], Mapping[str, Value], tuple[int, ...], Configuration | None], Configuration]


def solve(
    at_once: AtOnce,
    values: Sequence[Value],
    dims: Mapping[str, Value],
    shape: tuple[int, ...],
    start: Configuration | None,
    jobs: int | None,
    *,
    small: bool,
) -> Parts:
    """Nodes, rotations, slides, closures, reasons of a large batch, solved by chunks; the same, whatever `jobs`.

    `small` chunks suit iterations.
    """
    keep_freed_memory()
    count = int(np.prod(shape, dtype=np.int64))

    def flat(value: Value) -> Value:
        return value if value.ndim == 0 else np.broadcast_to(value, shape).reshape(-1)

    given = [flat(v) for v in values]
    places = {name: flat(v) for name, v in dims.items()}
    rows_of_start: Ints | None = None
    if start is not None and start.shape:
        rows_of_start = flat(np.arange(int(np.prod(start.shape))).reshape(start.shape))

    length = CHUNK if small or worker_count(jobs) == 1 else MANY

    def part(begin: int) -> Configuration:
        some = slice(begin, begin + length)
        begun = start
        if start is not None and rows_of_start is not None:
            begun = start.take(np.unravel_index(rows_of_start[some], start.shape))
        return at_once(
            [v if v.ndim == 0 else v[some] for v in given],
            {name: v if v.ndim == 0 else v[some] for name, v in places.items()},
            (min(length, count - begin),),
            begun,
        )

    first = part(0)
    reason = np.empty(count, dtype=np.int8)
    # What is the same for every pose stays a single number.
    whole: list[list[Any]] = [
        [np.empty(count, dtype=np.asarray(v).dtype) if np.ndim(v) else v for v in kind] for kind in _arrays(first)
    ]

    def put(begin: int, chunk: Configuration) -> None:
        some = slice(begin, begin + len(chunk.reason))
        reason[some] = chunk.reason
        for kind, values in zip(whole, _arrays(chunk), strict=True):
            for array, value in zip(kind, values, strict=True):
                if np.ndim(array):
                    array[some] = value

    put(0, first)
    for _ in map_chunks(lambda begin: put(begin, part(begin)), range(length, count, length), jobs):
        pass
    nodes, rotations, slides, closures = ([v.reshape(shape) if np.ndim(v) else v for v in kind] for kind in whole)
    lost = ((reason == Reason.NOT_CLOSED) | (reason == Reason.OTHER_ASSEMBLY)).reshape(shape)
    if lost.any():
        # In a chunk without a pose that is lost they were single numbers still.
        nodes, rotations, slides = (
            [v if np.ndim(v) else hide(v, lost) for v in kind] for kind in (nodes, rotations, slides)
        )
    return nodes, rotations, slides, closures, reason.reshape(shape)


def _arrays(configuration: Configuration) -> tuple[Sequence[Value], ...]:
    return configuration.nodes, configuration.rotations, configuration.slides, configuration.closures
