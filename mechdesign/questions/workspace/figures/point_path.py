"""The path of a point with one degree of freedom, and how fast the point is over the drive."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.marks import Axis, Coloured, Panel, Picture, Trace
from mechdesign.drawing.overlay import both_named
from mechdesign.drawing.panels import coordinate_label
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import sketched
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.questions.workspace.figures.boundary import marks_before, places_before
from mechdesign.questions.workspace.figures.drives import DASHES
from mechdesign.questions.workspace.figures.regions import coloured, pieces, places, region_picture
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.study import Study

# Speed ratios grow without bound at dead centres: colours end at this quantile.
_SHOWN_RATIOS = 0.97


@picture(WorkspaceView, "path", "speed_ratio", order=30)
def path_pictures(view: WorkspaceView) -> dict[str, Picture] | None:
    """``path``: the mechanism with the point's path, coloured by its speed ratio; ``speed_ratio`` over the drive."""
    if "path" not in view.result.tables:
        return None
    path = view.result.tables["path"]
    return {"path": _path(view.study, path, view.before), "speed_ratio": _speed(view.study, path)}


def _ends(ratio: Floats) -> tuple[float, bool]:
    """The largest value with a colour of its own, and whether a tail lies beyond it."""
    finite = ratio[np.isfinite(ratio)]
    high, top = float(np.quantile(finite, _SHOWN_RATIOS)), float(finite.max())
    return (high, True) if top > 1.5 * high or len(finite) < len(ratio) else (top, False)


def _label(path: Table) -> str:
    return style.axis_label("speed ratio", path.column("speed_ratio").unit)


def _path(study: Study, path: Table, before: Before | None) -> Picture:
    still, section, z = sketched(study.mechanism), WorkspaceSection.of(study), places(path)
    reached = np.concatenate([z, still.places, places_before(before)])
    top, tail = _ends(path["speed_ratio"])

    def speeds(axes: Axes) -> tuple[ScalarMappable, dict[str, str]]:
        norm = Normalize(0.0, top)
        for rows in pieces(path):
            axes.plot(z[rows].real, z[rows].imag, color=style.INK, linewidth=5.5, solid_capstyle="round", zorder=3.25)
            coloured(axes, z[rows], path["speed_ratio"][rows], norm, 4)
        return ScalarMappable(norm, style.COLORMAP), {"extend": "max" if tail else "neither"}

    marks = [Coloured(speeds, bar=_label(path)), *both_named(before), *marks_before(before), Posed(still)]
    title = f"path of point {section.point}, by its speed over the drive's"
    return region_picture(study, reached, [("", marks)], title)


def _speed(study: Study, path: Table) -> Picture:
    """The speed ratio over the drive."""
    drive, parts = study.mechanism.drives[0], pieces(path)
    looks = zip(style.PALETTE * len(parts), DASHES * len(parts), strict=False)
    marks = [
        Trace(path[drive][rows], path["speed_ratio"][rows], look={"color": color, "linestyle": dashes},
              label=f"piece {int(path['piece'][rows[0]])}" if len(parts) > 1 else "")
        for rows, (color, dashes) in zip(parts, looks, strict=False)
    ]  # fmt: skip
    top, tail = _ends(path["speed_ratio"])
    along = Axis(coordinate_label(study, drive), margin=0.01)
    panel = Panel(marks, along, Axis(_label(path), ends=(0.0, 1.3 * top if tail else None)), legend="beside")
    return Picture("Speed of the point over that of the drive", [panel])
