"""Optimisers that ask for few points at a time, run side by side: what all of them ask is evaluated in one batch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from queue import SimpleQueue
from threading import Thread

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
    asked: SimpleQueue[tuple[int, Floats | None, BaseException | None]] = SimpleQueue()
    answers: list[SimpleQueue[Ints | None]] = [SimpleQueue() for _ in tasks]

    def run(k: int) -> None:
        def ask(points: Floats) -> Ints:
            asked.put((k, points, None))
            rows = answers[k].get()
            if rows is None:
                raise Spent
            return rows

        try:
            # The state of warnings is a thread's own.
            with np.errstate(all="ignore"):
                tasks[k](ask)
        except Spent:
            asked.put((k, None, None))
        except BaseException as error:
            asked.put((k, None, error))
        else:
            asked.put((k, None, None))

    threads = [Thread(target=run, args=(k,), daemon=True) for k in range(len(tasks))]
    for thread in threads:
        thread.start()
    running, wrong = set(range(len(tasks))), None
    waiting: dict[int, Floats] = {}
    try:
        while running:
            while len(waiting) < len(running):
                k, points, error = asked.get()
                if points is None:
                    running.discard(k)
                    wrong = wrong or error
                else:
                    waiting[k] = points
            if wrong is not None:
                raise wrong
            order = sorted(waiting)
            if order:
                rows = explorer(np.concatenate([waiting[k] for k in order]))
                ends = np.cumsum([len(waiting[k]) for k in order])[:-1]
                waiting = {}
                for k, mine in zip(order, np.split(rows, ends), strict=True):
                    answers[k].put(mine)
    finally:
        for answer in answers:
            answer.put(None)
        for thread in threads:
            thread.join()
