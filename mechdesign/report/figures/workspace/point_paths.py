"""The workspace of a point with one degree of freedom: its path, and how fast it goes there."""

from __future__ import annotations

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.workspace.regions import ROOM, coloured, sheet
from mechdesign.results import Result, Table
from mechdesign.study import Study

# The largest speed ratios may belong to dead centres, where they grow without bounds: this share is told apart.
_TAIL = 0.97


def path_figures(study: Study, result: Result) -> dict[str, Figure]:
    """``path``: the mechanism with the point's path, coloured by its speed ratio; ``speed_ratio`` over the drive."""
    path = result.tables["path"]
    return {"path": _path(study, path), "speed_ratio": _speed(study, path)}


def _pieces(path: Table) -> list[Ints]:
    return [np.flatnonzero(path["piece"] == piece) for piece in np.unique(path["piece"])]


def _ends(ratio: Floats) -> tuple[float, bool]:
    """The largest value to be told apart, and whether a tail lies beyond it."""
    finite = ratio[np.isfinite(ratio)]
    high, top = float(np.quantile(finite, _TAIL)), float(finite.max())
    return (high, True) if top > 1.5 * high or len(finite) < len(ratio) else (top, False)


def _label(path: Table) -> str:
    return style.axis_label("speed ratio", path.column("speed_ratio").unit)


def _path(study: Study, path: Table) -> Figure:
    mechanism, section = study.mechanism, study.workspace
    assert section is not None
    sketch = [np.ravel(mechanism.sketch_configuration.point(point)) for point in mechanism.points]
    z = path["x"] + 1j * path["y"]
    title = f"path of point {section.point}, by its speed over the drive's"
    page = sheet(study, np.concatenate([z, *sketch]), [""], title, bar=True, pad=ROOM)
    (axes,) = page.axes
    ratio = path["speed_ratio"]
    top, tail = _ends(ratio)
    norm = Normalize(0.0, top)
    for rows in _pieces(path):
        axes.plot(z[rows].real, z[rows].imag, color=style.INK, linewidth=5.5, solid_capstyle="round", zorder=3.25)
        coloured(axes, z[rows], ratio[rows], norm, 4)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), _label(path), extend="max" if tail else "neither")
    return page.figure


def _speed(study: Study, path: Table) -> Figure:
    drive = study.mechanism.drives[0]
    figure = style.new_figure(3.4)
    axes = figure.add_subplot()
    pieces = _pieces(path)
    for rows, color in zip(pieces, style.PALETTE * len(pieces), strict=False):
        axes.plot(
            path[drive][rows], path["speed_ratio"][rows], color=color, label=f"piece {int(path['piece'][rows[0]])}"
        )
    top, tail = _ends(path["speed_ratio"])
    axes.set_ylim(0, 1.3 * top if tail else None)
    axes.set_title("Speed of the point over that of the drive", loc="left")
    axes.set_xlabel(style.axis_label(drive, study.units.label(study.mechanism.quantity(drive))))
    axes.set_ylabel(_label(path))
    axes.margins(x=0.01)
    if len(pieces) > 1:
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure
