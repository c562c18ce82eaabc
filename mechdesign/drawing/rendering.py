"""Figures to bytes, in two processes where they inherit them; a figure that fails does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from functools import partial
from typing import ParamSpec

from matplotlib.figure import Figure

from mechdesign.drawing import style
from mechdesign.drawing.layout import draw
from mechdesign.drawing.marks import Picture
from mechdesign.ground.errors import explain
from mechdesign.ground.work.chunks import worker_count
from mechdesign.ground.work.pool import ChunkMap, LostWorkerError, Pool
from mechdesign.ground.work.start import inherit

# Draws one picture: the bytes of its files by their names.
Drawing = Callable[[], dict[str, bytes]]
Arguments = ParamSpec("Arguments")

# What a function that is declared as a picture gives.
Made = Figure | Picture | Mapping[str, Figure | Picture] | None


class Gallery(dict[str, Figure]):
    """Figures of a result by the names of their files, and why others failed."""

    def __init__(self) -> None:
        super().__init__()
        self.failed: dict[str, str] = {}

    def add(
        self,
        name: str,
        make: Callable[Arguments, Made],
        *arguments: Arguments.args,
        **options: Arguments.kwargs,
    ) -> None:
        """Add what a function draws or declares under this name, or several pictures under their own names, or none."""
        try:
            made = make(*arguments, **options)
            shown = {name: made} if isinstance(made, (Figure, Picture)) else made or {}
            drawn = {name: draw(own) if isinstance(own, Picture) else own for name, own in shown.items()}
            for figure in drawn.values():
                style.name_powers(figure.axes)
        except Exception as error:
            self.failed[name] = explain(error)[1]
            return
        self.update(drawn)
        if isinstance(made, Gallery):
            self.failed |= made.failed


# Drawings in progress: a forked process inherits them, since figures cannot be sent to it.
_here: dict[int, Mapping[str, Drawing]] = {}


def _draw(key: int, name: str) -> dict[str, bytes] | str:
    try:
        return _here[key][name]()
    except Exception as error:
        return explain(error)[1]


def render(drawings: Mapping[str, Drawing], jobs: int | None = None) -> tuple[dict[str, bytes], dict[str, str]]:
    """Call every drawing, in two processes where they inherit what is drawn, if two `jobs` may be done at a time.

    Matplotlib draws on one processor only. The bytes do not depend on where they are drawn. What a process that was
    killed left out is drawn in this one.

    Returns
    -------
    files : dict
        Bytes by their names.
    failed : dict
        Why there are none, by the names of drawings.
    """

    names = list(drawings)
    outcomes: dict[str, dict[str, bytes] | str] = {}
    key = id(drawings)
    _here[key] = drawings
    try:
        count = min(2, worker_count(jobs)) if inherit() else 1
        with suppress(LostWorkerError), closing(Pool.local(count)) as pool:
            for name, drawn in zip(names, ChunkMap(pool, partial(_draw, key))(names), strict=True):
                outcomes[name] = drawn
        outcomes |= {name: _draw(key, name) for name in names if name not in outcomes}
    finally:
        del _here[key]
    files = {file: data for name in names if isinstance(drawn := outcomes[name], dict) for file, data in drawn.items()}
    return files, {name: why for name in names if isinstance(why := outcomes[name], str)}
