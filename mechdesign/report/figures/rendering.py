"""Figures to PNG bytes, on two processes where that is possible."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection

Drawing = Callable[[], bytes]

# Fewer pictures are drawn sooner than a process is forked and its bytes are read.
FEWEST = 3


def render(drawings: Mapping[str, Drawing]) -> dict[str, bytes]:
    """Call every drawing; on Linux half of them in a forked child, for Matplotlib draws on one processor only.

    The bytes do not depend on where they are drawn. A child that fails is made up for in this process, which then
    raises what went wrong.
    """
    names = list(drawings)
    if sys.platform != "linux" or len(names) < FEWEST:
        return {name: draw() for name, draw in drawings.items()}
    theirs = {name: drawings[name] for name in names[1::2]}
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_draw, args=(theirs, sender), daemon=True)
    child.start()
    sender.close()
    try:
        mine = {name: drawings[name]() for name in names[::2]}
        try:
            done: dict[str, bytes] = receiver.recv()
        except EOFError:
            done = {}
        child.join()
    finally:
        child.kill()
        receiver.close()
    found = mine | done
    return {name: found[name] if name in found else drawings[name]() for name in names}


def _draw(drawings: Mapping[str, Drawing], sender: Connection) -> None:
    # An interrupt is the parent's to handle: it ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    done = {}
    for name, draw in drawings.items():
        try:
            done[name] = draw()
        except Exception:
            break
    sender.send(done)
    sender.close()
