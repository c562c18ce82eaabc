"""Figures to PNG bytes, on two processes where that is possible; one that fails costs no other."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import ParamSpec

from matplotlib.figure import Figure

from mechdesign.errors import explain

Drawing = Callable[[], bytes]
Arguments = ParamSpec("Arguments")

# Fewer pictures are drawn sooner than a process is forked and its bytes are read.
FEWEST = 3


class Gallery(dict[str, Figure]):
    """Figures of a result by the names of their files, and why others could not be made."""

    def __init__(self) -> None:
        super().__init__()
        self.failed: dict[str, str] = {}

    def add(
        self,
        name: str,
        make: Callable[Arguments, Figure | Mapping[str, Figure] | None],
        *arguments: Arguments.args,
        **options: Arguments.kwargs,
    ) -> None:
        """Put in what a function makes: a figure under this name, several under their own, or none."""
        try:
            made = make(*arguments, **options)
        except Exception as error:
            self.failed[name] = explain(error)[1]
            return
        if isinstance(made, Figure):
            self[name] = made
        elif made is not None:
            self.update(made)
        if isinstance(made, Gallery):
            self.failed |= made.failed


def render(drawings: Mapping[str, Drawing]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Call every drawing; on Linux half of them in a forked child, for Matplotlib draws on one processor only.

    The bytes do not depend on where they are drawn. What a child that was killed left out is drawn in this process.

    Returns
    -------
    pictures, failed : dict
        Bytes, or why there are none, by name.
    """
    names = list(drawings)
    if sys.platform != "linux" or len(names) < FEWEST:
        found = _drawn(drawings)
    else:
        found = _on_two(drawings)
        found |= _drawn({name: drawings[name] for name in names if name not in found})
    pictures = {name: drawn for name in names if isinstance(drawn := found[name], bytes)}
    return pictures, {name: why for name in names if isinstance(why := found[name], str)}


def _on_two(drawings: Mapping[str, Drawing]) -> dict[str, bytes | str]:
    names = list(drawings)
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    theirs = {name: drawings[name] for name in names[1::2]}
    child = context.Process(target=_draw, args=(theirs, sender), daemon=True)
    child.start()
    sender.close()
    try:
        mine = _drawn({name: drawings[name] for name in names[::2]})
        try:
            done: dict[str, bytes | str] = receiver.recv()
        except EOFError:
            done = {}
        child.join()
    finally:
        child.kill()
        receiver.close()
    return mine | done


def _drawn(drawings: Mapping[str, Drawing]) -> dict[str, bytes | str]:
    """Bytes of each drawing, or in words why there are none."""
    found: dict[str, bytes | str] = {}
    for name, draw in drawings.items():
        try:
            found[name] = draw()
        except Exception as error:
            found[name] = explain(error)[1]
    return found


def _draw(drawings: Mapping[str, Drawing], sender: Connection) -> None:
    # An interrupt is the parent's to handle: it ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sender.send(_drawn(drawings))
    sender.close()
