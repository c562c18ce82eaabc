"""The workspace of a point over a range of a held coordinate: where some value of it, or every one, is reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.region.curves import Patch, patches_of_pieces
from mechdesign.analyses.region.panels import Effort
from mechdesign.analyses.region.rays import Designs
from mechdesign.analyses.workspace.quadrature import FINEST_AREA
from mechdesign.analyses.workspace.question import Evaluation, Question, answer, areas_of_pieces, questions
from mechdesign.analyses.workspace.ranged import Every, Ranged, Some, SomeDesigns
from mechdesign.analyses.workspace.singularities import causes
from mechdesign.analyses.workspace.tables import boundary_columns, held_columns, left_out, piece_columns, stacked
from mechdesign.errors import AssemblyError, Problem, StudyError
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.progress import Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over

EFFORT = Effort(48, 16, 96)
WANTED = ("SUI", "area", "box_area")
# Rays of the table of the boundary.
RAYS = 181


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
    answers: list[Evaluation] = []
    outlines: list[list[Column]] = []
    pieces: list[list[Column]] = []
    warnings: list[str] = []
    several = False
    for question in asked:
        given = answer(question, {}, 1, EFFORT)
        answers.append(given)
        if given.panels.closes[0]:
            assert given.pieces is not None
            areas, drawn = areas_of_pieces(question, given, EFFORT), bool(given.pieces.drawn[0])
            shown = patches_of_pieces(given.pieces, question.rays or RAYS, EFFORT.samples)
            outlines.append(_outline(study, question, name, shown))
            pieces.append(piece_columns(study, question, shown, areas, drawn))
            several |= len(areas) > 1
            if len(areas) > 1 and question.field.same_assembly:
                warnings.append(left_out(study, question, areas, drawn))
        progress.update(1)
    if not outlines:
        held = "".join(f", {key} = {value:g}" for key, value in asked[0].held.items())
        raise AssemblyError(
            f"point {section.point} reaches nothing over the range of {name} from {over.from_:g} to {over.to:g}{held}"
        )
    square = study.units.label("area")
    values = {key: np.concatenate([given.values[key] for given in answers]) for key in WANTED}
    area, error = values["area"], np.concatenate([given.errors["area"] for given in answers])
    indices = (
        *stacked([held_columns(study, question, 1) for question in asked]),
        *shared(study.units, **values),
        Column("area_error", error, square, "estimated error of area"),
    )
    tables = [
        Table("indices", indices, f"the region over the range of {name}"),
        Table("boundary", stacked(outlines), "boundary of the region, curve by curve"),
    ]
    if several:
        tables.append(Table("pieces", stacked(pieces), "pieces of the region that do not hang together"))
    late = (area > 0) & (error > FINEST_AREA * area)
    if late.any():
        known = (error[late] / area[late]).max()
        warnings.append(
            f"the area is known to {known:.1g} of itself only (area_error): over the range of {name} the boundary "
            "is too rough for more"
        )
    counts = {"regions": len(asked), "empty": len(asked) - len(outlines)}
    return Result("workspace", {table.name: table for table in tables}, tuple(warnings), counts)


def _questions(study: Study, name: str, over: Over) -> Iterator[Question]:
    """One question a value of the other held coordinates."""
    assert study.workspace is not None
    # Only the area is asked, in which angles and lengths do not mix.
    update = {"at": {**study.workspace.at, name: (over.from_,)}, "indices": (),
              "characteristic_length": study.workspace.characteristic_length or 1.0}  # fmt: skip
    coordinate = study.mechanism.coordinate(name)
    low, high = (float(np.asarray(radians(study, coordinate, np.asarray(v)))) for v in (over.from_, over.to))
    for question in questions(replace(study, workspace=study.workspace.model_copy(update=update)), wanted=WANTED):
        base = question.field
        if base.plan.iterative:
            message = (
                f"over a range of {name} the inverse problem must have a closed form, which it has not here; "
                f"ask for single values: at: {{{name}: [...]}}"
            )
            raise StudyError((Problem(message, f"workspace.at.{name}", str(study.path or "")),))
        common = base.mechanism, base.plan, base.held, base.same_assembly, base.length
        field = (Every if over.all else Some)(*common, list(study.workspace.at).index(name), low, high)
        held = {k: v for k, v in question.held.items() if k != name}
        yield replace(question, field=field, held=held, rays_through=Designs if over.all else SomeDesigns)


def _outline(study: Study, question: Question, name: str, found: Sequence[Patch]) -> list[Column]:
    """Points of the boundary, the value of the range at which each is reached, and what ends the region there."""
    over = question.field
    assert isinstance(over, Ranged)
    single = [words for _, words in causes(over.sliced)]
    told = [*single * 3, *(f"{a} and {b}" for a in single for b in single)]
    coordinate = study.mechanism.coordinate(name)

    def deciding(z: Complexes, within: Complexes, inwards: Floats, margin: Ints) -> Iterator[Column]:
        row = np.array([over.extreme(label) for label in range(len(over.labels))])[margin]
        value = np.take_along_axis(over.deciding(z)[1], row[None], axis=0)[0]
        shown = np.asarray(in_study_units(study, coordinate, value))
        yield Column(name, shown, study.units.label(coordinate.quantity), "value of the range that decides there")

    return [column for column in boundary_columns(study, question, found, told, deciding) if column.name != "theta"]
