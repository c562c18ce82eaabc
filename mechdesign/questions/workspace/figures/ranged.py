"""A region over a range of a held coordinate: what ends it, and which value does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from mechdesign.numerics.arrays import Complexes
from mechdesign.questions.workspace.figures.boundary import draw_before, places_before, sketch_places
from mechdesign.questions.workspace.figures.regions import (
    MAX_REGIONS,
    PALE,
    ROOM,
    coloured,
    lines,
    outline_of,
    places,
    sheet,
)
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.schema import Over, WorkspaceSection
from mechdesign.questions.workspace.tables import curves
from mechdesign.report.figures import style
from mechdesign.report.figures.before import Before
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.overlay import name_both
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study


@picture(WorkspaceView, "workspace", "range", order=20)
def range_figures(view: WorkspaceView) -> dict[str, Figure] | None:
    """``workspace``: the region and what ends it, with the sketch; ``range``: which value decides there."""
    study, result, before = view.study, view.result, view.before
    section = WorkspaceSection.of(study)
    if "path" in result.tables or "local" in result.tables:
        return None
    (name, over), *_ = ((name, values) for name, values in section.at.items() if isinstance(values, Over))
    indices, boundary = result.tables["indices"], result.tables["boundary"]
    others = [other for other in section.at if other != name and other in indices]
    rows = [{other: float(indices[other][row]) for other in others} for row in range(len(indices))]
    shown = [(values, boundary.take(boundary.where(**values))) for values in rows]
    shown = [(values, table) for values, table in shown if len(table)][:MAX_REGIONS]
    titles = [", ".join(f"{other} = {value:g}" for other, value in values.items()) for values, _ in shown]
    unit = study.units.label(study.mechanism.quantity(name))
    ends = f"{name} from {over.from_:g} to {over.to:g} {unit}".strip()
    title = f"point {section.point} {'at every' if over.all else 'at some'} {ends}"
    tables = [table for _, table in shown]
    return {
        "workspace": _region(study, shown, titles, title, before),
        "range": _deciding(study, tables, titles, name, style.axis_label(name, unit)),
    }


def _region(
    study: Study, shown: Sequence[tuple[Mapping[str, float], Table]], titles: Sequence[str], title: str,
    before: Before | None,
) -> Figure:  # fmt: skip
    mechanism, tables = study.mechanism, [table for _, table in shown]
    reached = np.concatenate([*map(places, tables), sketch_places(study), places_before(before)])
    page = sheet(study, reached, titles, title, bar=False, pad=ROOM)
    kinds: set[str] = set()
    for axes, (held, table) in zip(page.axes, shown, strict=True):
        draw_before(axes, before, held)
        axes.add_patch(PathPatch(_area(table), facecolor=PALE, linewidth=0, zorder=0.5))
        kinds |= outline_of(axes, table)
        alone = len(tables) == 1
        draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=alone, drives=False, faint=not alone)
    page.legend(kinds)
    name_both(page.figure, before)
    return page.figure


def _deciding(study: Study, tables: Sequence[Table], titles: Sequence[str], name: str, label: str) -> Figure:
    page = sheet(study, np.concatenate([*map(places, tables)]), titles, f"the {name} that ends the region", bar=True)
    every = np.concatenate([table[name] for table in tables])
    norm = Normalize(float(every.min()), float(every.max()))
    for axes, table in zip(page.axes, tables, strict=True):
        axes.add_patch(PathPatch(_area(table), facecolor="#F2F2F2", linewidth=0, zorder=0.5))
        for rows, line in zip(curves(table), lines(table), strict=True):
            coloured(axes, line, table[name][rows], norm)
    page.color_bar(ScalarMappable(norm, style.COLORMAP), label)
    return page.figure


def _area(table: Table) -> Path:
    """What the curves of a boundary enclose: curves joined end to end, and holes by the even-odd rule."""
    vertices, codes = [], []
    for loop in loops(lines(table)):
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
    closed = []
    while left:
        loop = left.pop(0)
        while left:
            gaps = np.abs([(piece[0] - loop[-1], piece[-1] - loop[-1]) for piece in left])
            which, end = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
            if gaps[which, end] > near and abs(loop[0] - loop[-1]) <= gaps[which, end]:
                break
            piece = left.pop(int(which))
            loop = np.concatenate([loop, piece[::-1] if end else piece])
        closed.append(np.append(loop, loop[0]))
    return closed
