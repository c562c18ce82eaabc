"""The workspace of a point over a range of a held coordinate: where some value of it, or every one, is reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.region.curves import Patch, patches_of_pieces
from mechdesign.analyses.region.panels import Effort, Panels, find_panels
from mechdesign.analyses.region.pieces import Pieces
from mechdesign.analyses.region.rays import Designs
from mechdesign.analyses.workspace.bounding import bounding_box
from mechdesign.analyses.workspace.quadrature import FINEST_AREA, Integral, integrate
from mechdesign.analyses.workspace.question import Question, questions
from mechdesign.analyses.workspace.ranged import Every, Ranged, Some, SomeDesigns
from mechdesign.analyses.workspace.singularities import causes
from mechdesign.analyses.workspace.tables import held_columns, left_out, piece_columns, stacked
from mechdesign.errors import AssemblyError, Problem, StudyError
from mechdesign.progress import Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over

EFFORT = Effort(48, 16, 96)
# Rays of the table of the boundary, and the tolerance of means of which the area gets a tenth.
RAYS, AREA = 181, 1e-5


def reachable(study: Study, progress: Progress) -> Result:
    """Region of a point over a range of a held coordinate: area, the rectangle around it, and its boundary.

    Raises
    ------
    StudyError
        If the section lacks what cannot be assumed, or the inverse problem has no closed form.
    AssemblyError
        If nothing can be reached, or the region has no end.
    """
    section = study.workspace
    assert section is not None
    name, over = next((name, value) for name, value in section.at.items() if isinstance(value, Over))
    asked = list(_questions(study, name, over))
    progress.start(len(asked), "regions")
    rows: list[tuple[Question, float, float, float]] = []
    outlines: list[list[Column]] = []
    pieces: list[list[Column]] = []
    warnings: list[str] = []
    several = False
    for question in asked:
        whole = (Designs if over.all else SomeDesigns)(question.field, {}, 1, question.about)
        panels = find_panels(whole, question.scan, EFFORT)
        found = Pieces.of(whole, panels, question.scan, EFFORT.samples)
        area = error = box = 0.0
        if panels.closes[0]:
            designs, part = found.only(0) if question.field.same_assembly else (whole, panels)
            integral = _integral(designs, part, question)
            area, error = float(integral.area[0]), float(integral.area_error[0])
            box = float(bounding_box(designs, part, integral.boundary, EFFORT.samples)[0])
            areas = [area]
            if found.number[0] > 1:
                areas = [float(_integral(*piece, question, area).area[0]) for piece in found.all()]
            if not over.all:
                # Of all pieces together; where every value is to be reached single values show too much.
                error = max(error, float(panels.seen[0]) - sum(areas))
            shown = patches_of_pieces(found, question.rays or RAYS, EFFORT.samples)
            outlines.append(_outline(study, question, name, shown))
            drawn = bool(found.drawn[0])
            pieces.append(piece_columns(study, question, shown, areas, drawn))
            several |= len(areas) > 1
            if len(areas) > 1 and question.field.same_assembly:
                warnings.append(left_out(study, question, areas, drawn))
        rows.append((question, area, error, box))
        progress.update(1)
    if not outlines:
        held = "".join(f", {key} = {value:g}" for key, value in asked[0].held.items())
        raise AssemblyError(
            f"point {section.point} reaches nothing over the range of {name} from {over.from_:g} to {over.to:g}{held}"
        )
    square = study.units.label("area")
    with np.errstate(invalid="ignore"):
        use = np.array([area / box if box else np.nan for _, area, _, box in rows])
    indices = (
        *stacked([held_columns(study, question, 1) for question in asked]),
        *shared(study.units, SUI=use, area=[row[1] for row in rows], box_area=[row[3] for row in rows]),
        Column("area_error", np.array([row[2] for row in rows]), square, "estimated error of area"),
    )
    tables = [
        Table("indices", indices, f"the region over the range of {name}"),
        Table("boundary", stacked(outlines), "boundary of the region, curve by curve"),
    ]
    empty = sum(row[1] == 0 for row in rows)
    late = [error / area for _, area, error, _ in rows if error > FINEST_AREA * area]
    if several:
        tables.append(Table("pieces", stacked(pieces), "pieces of the region that do not hang together"))
    if late:
        warnings.append(
            f"the area is known to {max(late):.1g} of itself only (area_error): over the range of {name} the boundary "
            "is too rough for more"
        )
    return Result(
        "workspace", {table.name: table for table in tables}, tuple(warnings), {"regions": len(asked), "empty": empty}
    )


def _integral(designs: Designs, panels: Panels, question: Question, whole: float = 0.0) -> Integral:
    """The area, and the boundary that was met; of a piece of a region of area `whole`."""
    none = np.zeros((0, 1), dtype=bool)
    return integrate(designs, panels, AREA, EFFORT.samples, question.scan, (), none, whole)


def _questions(study: Study, name: str, over: Over) -> Iterator[Question]:
    """One question a value of the other held coordinates."""
    assert study.workspace is not None
    # Only the area is asked, in which angles and lengths do not mix.
    update = {"at": {**study.workspace.at, name: (over.from_,)}, "indices": (),
              "characteristic_length": study.workspace.characteristic_length or 1.0}  # fmt: skip
    coordinate = study.mechanism.coordinate(name)
    low, high = (float(np.asarray(radians(study, coordinate, np.asarray(v)))) for v in (over.from_, over.to))
    for question in questions(replace(study, workspace=study.workspace.model_copy(update=update)), wanted=()):
        base = question.field
        if base.plan.iterative:
            message = (
                f"over a range of {name} the inverse problem must have a closed form, which it has not here; "
                f"ask for single values: at: {{{name}: [...]}}"
            )
            raise StudyError((Problem(message, f"workspace.at.{name}", str(study.path or "")),))
        common = base.mechanism, base.plan, base.held, base.same_assembly, base.length
        field = (Every if over.all else Some)(*common, list(study.workspace.at).index(name), low, high)
        yield replace(question, field=field, held={k: v for k, v in question.held.items() if k != name})


def _outline(study: Study, question: Question, name: str, found: Sequence[Patch]) -> list[Column]:
    """Points of the boundary, the value of the range at which each is reached, and what ends the region there."""
    over = question.field
    assert isinstance(over, Ranged)
    curves = [
        (patch.theta, radius, side, margin, patch.piece)
        for side, names in (("inner", ("inner", "enters")), ("outer", ("outer", "leaves")))
        for patch in found
        for radius, margin in [(getattr(patch, names[0]), getattr(patch, names[1]))]
        if margin >= 0
    ]
    lengths = [len(curve[0]) for curve in curves]
    z = np.concatenate([question.about + curve[1] * np.exp(1j * curve[0]) for curve in curves])
    row = np.repeat([over.extreme(curve[3]) for curve in curves], lengths)
    value = np.take_along_axis(over.deciding(z)[1], row[None], axis=0)[0]
    single = [words for _, words in causes(over.sliced)]
    told = [*single * 3, *(f"{a} and {b}" for a in single for b in single)]
    which = [curve[3] for curve in curves]
    kinds = ["limit" if question.field.labels[k][0] == "limit" else "singularity" for k in which]
    coordinate = study.mechanism.coordinate(name)
    shown = np.asarray(in_study_units(study, coordinate, value))
    return [
        *held_columns(study, question, len(z)),
        *shared(study.units, x=z.real, y=z.imag, kind=np.repeat(kinds, lengths)),
        Column(name, shown, study.units.label(coordinate.quantity), "value of the range that decides there"),
        *shared(
            study.units,
            at=np.repeat([told[k] for k in which], lengths),
            side=np.repeat([curve[2] for curve in curves], lengths),
            curve=np.repeat(np.arange(len(curves)), lengths),
            piece=np.repeat([curve[4] for curve in curves], lengths),
        ),
    ]
