"""Optimisers that ask for few points at a time, run side by side: what all of them ask is evaluated in one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

import numpy as np

from mechdesign.analyses.optimize.explorer import Explorer, Spent
from mechdesign.numerics.arrays import Floats, Ints

Ask = Callable[[Floats], Ints]


def side_by_side(explorer: Explorer, tasks: Sequence[Callable[[Ask], None]]) -> None:
    """Run tasks that ask for points and get their rows of `explorer.known`.

    A batch is evaluated when every task that still runs waits for its points, in the order of the tasks, so that the
    result does not depend on which of them came first. `explorer.known` does not change while a task computes.

    Raises
    ------
    Spent
        If the evaluations are used up; all tasks have ended then.
    """
    # Points that a task asks for, None at its end; and their rows, None where there are no more.
    asked: SimpleQueue[tuple[int, Floats | None]] = SimpleQueue()
    answers: list[SimpleQueue[Ints | None]] = [SimpleQueue() for _ in tasks]

    def run(k: int) -> None:
        def ask(points: Floats) -> Ints:
            asked.put((k, points))
            rows = answers[k].get()
            if rows is None:
                raise Spent
            return rows

        try:
            # The state of warnings is a thread's own.
            with np.errstate(all="ignore"):
                tasks[k](ask)
        finally:
            asked.put((k, None))

    with ThreadPoolExecutor(max(len(tasks), 1)) as pool:
        running = {k: pool.submit(run, k) for k in range(len(tasks))}
        waiting: dict[int, Floats] = {}
        try:
            while running:
                while len(waiting) < len(running):
                    k, points = asked.get()
                    if points is None:
                        running.pop(k).result()
                    else:
                        waiting[k] = points
                order = sorted(waiting)
                if order:
                    rows = explorer(np.concatenate([waiting[k] for k in order]))
                    ends = np.cumsum([len(waiting.pop(k)) for k in order])
                    for k, mine in zip(order, np.split(rows, ends[:-1]), strict=True):
                        answers[k].put(mine)
        finally:
            for answer in answers:
                answer.put(None)
