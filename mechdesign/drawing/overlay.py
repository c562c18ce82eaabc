"""A mechanism before a change in grey dashes under the one after it, and a legend that names both."""

from __future__ import annotations

from typing import Any

from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import PanelMark, Trace
from mechdesign.drawing.scene import Still
from mechdesign.drawing.sweep import Sweep, ranks
from mechdesign.ground.errors import printable
from mechdesign.ground.numerics.arrays import Complexes

COLOR = "#666666"
DASHES = (0, (4, 2))
_ORDER = 2.45  # below the paths of the study now


def line_mark(places: Complexes, width: float = 1.8) -> Trace:
    """A curve of the study before."""
    look = {"color": COLOR, "linestyle": DASHES, "linewidth": width, "zorder": _ORDER}
    return Trace(places.real, places.imag, look=look)


def posed_before(still: Still | None) -> Posed:
    """The mechanism before, in a pose."""
    return Posed(still, ghost=True, look={"linestyle": DASHES, "alpha": 0.9})


def sweep_marks(sweep: Sweep) -> list[PanelMark]:
    """The mechanism before in its first pose, and the paths of its points."""
    ranked = ranks(sweep.study)
    paths = [line_mark(path, 1.5 if ranked[point] == 2 else 0.8) for point, path in sweep.traces.items()]
    return [*paths, *([posed_before(sweep.first)] if len(sweep.valid) else [])]


def both_named(before: Before | None) -> list[Trace]:
    """What a legend shows of the study now and of that before; nothing without one."""
    if before is None:
        return []
    # As they are: a dollar would begin a formula.
    names = [printable(name).replace("$", r"\$") for name in before.names]
    looks: tuple[dict[str, Any], ...] = ({"color": style.INK}, {"color": COLOR, "linestyle": DASHES})
    return [Trace([], [], label=f"{name} ({when})", look=look)
            for name, when, look in zip(names, ("now", "before"), looks, strict=True)]  # fmt: skip
