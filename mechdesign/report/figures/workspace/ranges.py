"""The workspace over a range of a held coordinate: where some value of it, or every one, is reached."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from mechdesign.analyses.workspace.tables import curves
from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.workspace.regions import PALE, ROOM, coloured, outline_of, pick, sheet
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over

MOST = 6


def range_figures(study: Study, result: Result) -> dict[str, Figure]:
    """``workspace``: the region and what ends it, with the sketch; ``range``: which value decides there."""
    section = study.workspace
    assert section is not None
    (name, over), *_ = ((name, values) for name, values in section.at.items() if isinstance(values, Over))
    indices, boundary = result.tables["indices"], result.tables["boundary"]
    others = [other for other in section.at if other != name and other in indices]
    rows = [{other: float(indices[other][row]) for other in others} for row in range(len(indices))]
    shown = [(values, pick(boundary, values)) for values in rows]
    shown = [(values, table) for values, table in shown if len(table)][:MOST]
    titles = [", ".join(f"{other} = {value:g}" for other, value in values.items()) for values, _ in shown]
    unit = study.units.label(study.mechanism.quantity(name))
    ends = f"{name} from {over.from_:g} to {over.to:g} {unit}".strip()
    title = f"point {section.point} {'at every' if over.all else 'at some'} {ends}"
    tables = [table for _, table in shown]
    return {
        "workspace": _region(study, tables, titles, title),
        "range": _deciding(study, tables, titles, name, style.axis_label(name, unit)),
    }


def _places(tables: Sequence[Table]) -> Complexes:
    return np.concatenate([table["x"] + 1j * table["y"] for table in tables])


def _region(study: Study, tables: Sequence[Table], titles: Sequence[str], title: str) -> Figure:
    mechanism = study.mechanism
    sketch = [np.ravel(mechanism.sketch_configuration.point(point)) for point in mechanism.points]
    page = sheet(study, np.concatenate([_places(tables), *sketch]), titles, title, bar=False, pad=ROOM)
    seen: set[str] = set()
    for axes, table in zip(page.axes, tables, strict=True):
        axes.add_patch(PathPatch(_area(table), facecolor=PALE, linewidth=0, zorder=0.5))
        seen |= outline_of(axes, table)
        alone = len(tables) == 1
        draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=alone, drives=False, faint=not alone)
    page.legend(seen)
    return page.figure


def _deciding(study: Study, tables: Sequence[Table], titles: Sequence[str], name: str, label: str) -> Figure:
    page = sheet(study, _places(tables), titles, f"the {name} that ends the region", bar=True)
    every = np.concatenate([table[name] for table in tables])
    norm = Normalize(float(every.min()), float(every.max()))
    for axes, table in zip(page.axes, tables, strict=True):
        axes.add_patch(PathPatch(_area(table), facecolor="#F2F2F2", linewidth=0, zorder=0.5))
        for rows in curves(table):
            coloured(axes, table["x"][rows] + 1j * table["y"][rows], table[name][rows], norm)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), label)
    return page.figure


def _area(table: Table) -> Path:
    """What the curves of a boundary enclose: curves joined end to end, and holes by the even-odd rule."""
    pieces = [table["x"][rows] + 1j * table["y"][rows] for rows in curves(table)]
    vertices, codes = [], []
    for loop in loops(pieces):
        vertices.append(np.column_stack([loop.real, loop.imag]))
        codes += [Path.MOVETO, *[Path.LINETO] * (len(loop) - 2), Path.CLOSEPOLY]
    return Path(np.concatenate(vertices), codes)


def loops(pieces: Sequence[Complexes]) -> list[Complexes]:
    """Curves joined where an end of one lies at an end of another, each loop closed.

    Parameters
    ----------
    pieces : sequence of ndarray of complex
        In any order and direction; what stays open is closed by a straight line.
    """
    left = [piece for piece in pieces if len(piece) > 1]
    near = 1e-6 * max((float(np.abs(piece - piece[0]).max()) for piece in left), default=1.0)
    found = []
    while left:
        loop = left.pop(0)
        while left:
            gaps = np.abs([(piece[0] - loop[-1], piece[-1] - loop[-1]) for piece in left])
            which, end = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
            if gaps[which, end] > near and abs(loop[0] - loop[-1]) <= gaps[which, end]:
                break
            piece = left.pop(int(which))
            loop = np.concatenate([loop, piece[::-1] if end else piece])
        found.append(np.append(loop, loop[0]))
    return found
