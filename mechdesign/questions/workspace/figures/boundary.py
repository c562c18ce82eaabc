"""What bounds a region: with the mechanism along it, the study before, the largest shapes inside, and the drives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Patch, Rectangle

from mechdesign.drawing import style
from mechdesign.drawing.before import Before
from mechdesign.drawing.drawing import Posed, write
from mechdesign.drawing.labels import Label
from mechdesign.drawing.marks import Late, Own, PanelMark, Picture
from mechdesign.drawing.overlay import both_named, line_mark, posed_before
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Scene, pose, sketched
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.ground.results import Table
from mechdesign.mechanism import Configuration
from mechdesign.questions.workspace.drawn import DrawnRegion
from mechdesign.questions.workspace.figures.regions import (
    HeldRegion,
    fill,
    left_out,
    lines,
    pieces,
    places,
    region_marks,
    region_picture,
    some,
)
from mechdesign.questions.workspace.figures.view import WorkspaceView
from mechdesign.questions.workspace.inscribed import INSCRIBED, crossed
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.region.regions import regions
from mechdesign.study import Study

_NEAR_SHAPE = 3.0  # points from an inscribed shape to its size in words


def workspace_picture(
    study: Study, drawn: DrawnRegion, region: HeldRegion, title: str = "", before: Before | None = None,
    more: Sequence[PanelMark] = (),
) -> Picture:  # fmt: skip
    """The region, its boundary by what ends it, and the mechanism with its point at places along it [S1, Fig. 6]."""
    section, mechanism = WorkspaceSection.of(study), study.mechanism
    everywhere = np.concatenate([region.places(), *Scene(mechanism, drawn.along).points.values(),
                                 sketched(mechanism).places, places_before(before)])  # fmt: skip
    where = f" at {region.title}" if region.title else ""
    title = title or f"workspace of point {section.point}{where}, the mechanism along its boundary"

    marks = [Own(partial(fill, local=region.local)), *region_marks(region), *more, *both_named(before),
             *marks_before(before)]  # fmt: skip
    marks += [Posed(still, faint=True) for still in Scene(mechanism, drawn.along).some(range(len(drawn.along.reason)))]
    return region_picture(study, everywhere, [("", [*marks, Posed(sketched(mechanism), drives=False)])], title)


@picture(WorkspaceView, "workspace", order=10)
def boundary_picture(view: WorkspaceView) -> Picture | None:
    """The region with its boundary; of several values of the held coordinates the regions side by side."""
    if not view.regions:
        return None
    if len(view.regions) == 1:
        return workspace_picture(view.study, view.drawn, view.regions[0], before=view.before)
    title = f"the mechanism where it is best conditioned{left_out(view.regions)}"
    return regions_picture(
        [(region.title, view.study, region, ()) for region in some(view.regions)], title, view.before
    )


def regions_picture(
    parts: Sequence[tuple[str, Study, HeldRegion, Sequence[PanelMark]]], title: str, before: Before | None = None
) -> Picture:  # fmt: skip
    """Regions of some studies side by side on one scale, each under its words with the mechanism in a pose there."""
    study, poses = parts[0][1], [_pose_inside(own, region) for _, own, region, _ in parts]
    reached = np.concatenate([np.ravel(pose.point(point)) for pose in poses for point in study.mechanism.points])
    everywhere = np.concatenate([*(region.places() for _, _, region, _ in parts), reached[np.isfinite(reached)],
                                 places_before(before)])  # fmt: skip
    panels = []
    for (words, own, region, more), configuration in zip(parts, poses, strict=True):
        marks = [Own(partial(fill, local=region.local)), *region_marks(region), *more, *both_named(before)]
        inside = Posed(pose(own.mechanism, configuration), faint=True)
        panels.append((words, [*marks, inside, *marks_before(before, region.held)]))
    title = f"workspace of point {WorkspaceSection.of(study).point}, {title}"
    return region_picture(study, everywhere, panels, title)


def _pose_inside(study: Study, region: HeldRegion) -> Configuration:
    """The pose at the node of a region where the Jacobian is conditioned best."""
    return solved_inside(study, region, [int(np.argmax(np.nan_to_num(region.local["inverse_condition"], nan=-1.0)))])


def solved_inside(study: Study, region: HeldRegion, rows: Sequence[int] | slice = slice(None)) -> Configuration:
    """Poses with the point at some nodes of a region's grid, not judged by the limits."""
    field = next(own.field for own in regions(study) if own.held == region.held)
    return field.poses(places(region.local)[rows])


@picture(WorkspaceView, "inscribed", order=50)
def inscribed_picture(view: WorkspaceView) -> Picture | None:
    """The regions with the shapes that their row of indices gives; None where it gives none."""
    study, table = view.study, view.result.tables["indices"]
    if not view.regions or INSCRIBED[0] not in table:
        return None
    shown, panels = some(view.regions), []
    for region in shown:
        shapes = _inscribed(table, region, study.units.label("length"))
        marks = [Own(partial(fill, local=region.local)), *region_marks(region), Own(partial(_draw_shapes, shapes))]
        # In small panels the sizes would lie over each other.
        names = [size for _, size in shapes]
        if len(shown) == 1:
            marks.append(Late(partial(write, labels=names)))
            names = []
        panels.append(("\n".join([region.title, *(size.text for size in names)]), marks))
    places = np.concatenate([region.places() for region in shown])
    title = f"largest circle and rectangle in the workspace{left_out(view.regions)}"
    return region_picture(study, places, panels, title)


def _draw_shapes(shapes: Sequence[tuple[Patch, Label]], axes: Axes) -> None:
    for shape, size in shapes:
        shape.set(edgecolor=size.color, facecolor="none", linewidth=1.6, zorder=4)
        axes.add_patch(shape)


def _inscribed(table: Table, region: HeldRegion, unit: str) -> list[tuple[Patch, Label]]:
    """The shapes of a region that were found, each with its size in words.

    Those that a singularity crosses are dotted.
    """
    x, y, radius, middle_x, middle_y, width, height = (float(table[name][region.row]) for name in INSCRIBED)
    corner, steps = complex(middle_x - width / 2, middle_y - height / 2), (0.5, 0.25, 0.75)
    edges = [corner + share * width + 1j * up for up in (0.0, height) for share in steps]
    shapes: dict[str, tuple[Patch, list[complex], str, str]] = {
        "circle": (Circle((x, y), radius), [complex(x, y + share * radius) for share in (0.0, 0.5, -0.5)], style.BLUE,
                   f"r = {radius:.4g} {unit}"),
        "rectangle": (Rectangle((corner.real, corner.imag), width, height), edges, style.GREEN,
                      f"{width:.4g} x {height:.4g} {unit}"),
    }  # fmt: skip
    singular = places(region.singularities) if region.singularities is not None else np.zeros(0, dtype=complex)
    cut = crossed(np.array([x, y, radius, middle_x, middle_y, width, height]), singular)
    made = []
    for name, (shape, anchors, color, words) in shapes.items():
        if np.isfinite(anchors).all():
            shape.set_linestyle(":" if name in cut else "-")
            text = words.strip() + ", a singularity inside" * (name in cut)
            made.append((shape, Label(text, anchors, color, _NEAR_SHAPE, math.pi / 2, 9.0)))
    return made


def marks_before(before: Before | None, held: Mapping[str, float] | None = None) -> list[PanelMark]:
    """The boundary or the path of the study before; where nothing is held, its mechanism in its sketch pose."""
    if before is None:
        return []
    lines: list[PanelMark] = [*map(line_mark, _lines(before, held))]
    return lines if held else [*lines, posed_before(sketched(before.study.mechanism))]


def places_before(before: Before | None) -> Complexes:
    """All points of what is drawn of the study before."""
    curves = [*_lines(before), sketched(before.study.mechanism).places] if before is not None else []
    return np.concatenate([np.empty(0, dtype=complex), *curves])


def _lines(before: Before, held: Mapping[str, float] | None = None) -> list[Complexes]:
    """Curves that end its region, for values of held coordinates if they are given; its path."""
    tables = before.result.tables
    if "path" in tables:
        z = places(tables["path"])
        return [z[rows] for rows in pieces(tables["path"])]
    if "boundary" not in tables:
        return []
    edge = tables["boundary"]
    return lines(edge.take(edge.where(**{name: value for name, value in (held or {}).items() if name in edge})))
