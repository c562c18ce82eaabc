"""Where can it work? The reachable region of a point, its performance indices and its boundary."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.analyses.columns import power_of_length
from mechdesign.analyses.poses import in_study_units
from mechdesign.analyses.region.curves import Patch, patches_of_pieces
from mechdesign.analyses.region.rays import SINGLE, Effort
from mechdesign.analyses.region.regions import RAYS
from mechdesign.analyses.workspace.columns import BOUNDARY, INDICES, LOCAL, PIECES, RANGE_INDICES
from mechdesign.analyses.workspace.drawn import DrawnRegion
from mechdesign.analyses.workspace.ellipses import ellipses
from mechdesign.analyses.workspace.index import Local, determinant_power, prepare
from mechdesign.analyses.workspace.inscribed import INSCRIBED, inscribed
from mechdesign.analyses.workspace.point_path import point_path
from mechdesign.analyses.workspace.quadrature import FINEST_AREA
from mechdesign.analyses.workspace.question import (
    COLUMNS,
    OF_RANGE,
    Evaluation,
    Question,
    answer,
    areas_of_pieces,
    questions,
    split,
)
from mechdesign.analyses.workspace.ranged import Ranged
from mechdesign.analyses.workspace.singularities import causes, singular_everywhere
from mechdesign.analyses.workspace.tables import (
    beyond,
    boundary_columns,
    held_columns,
    inscribed_columns,
    left_out,
    outlines,
    piece_columns,
    poses_along,
    stacked,
    totals,
    where,
)
from mechdesign.cautions import Caution
from mechdesign.errors import AssemblyError
from mechdesign.indices import index
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study
from mechdesign.study.schema.workspace import Over
from mechdesign.work.threads import one_thread

# An error of the area beyond this part of it is told.
AREA_SURE = 1e-3
# How finely a region over a range is looked for; its margins cost a hundred times as much.
OVER_RANGE = Effort(48, 16, 96)
ROOTLESS = "no pose of the mechanism reaches the held values from the sketch; redraw the sketch at those values"


@one_thread()
def workspace(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Region that a point reaches, its indices, local ones on a grid, and its boundary; see `mechdesign.workspace`."""
    section = study.workspace
    if section is not None and study.mechanism.mobility == 1:
        return point_path(study)
    if section is not None and any(isinstance(values, Over) for values in section.at.values()):
        return _reachable(study, progress)
    asked = questions(study)
    progress.start(len(asked), "regions")
    answers: list[Evaluation] = []
    regions: list[tuple[Study, Question, list[Patch]]] = []
    shapes: list[Floats] = []
    pieces: list[list[Column]] = []
    warnings: list[Caution] = []
    for question in asked:
        if singular_everywhere(question.field):
            question = replace(question, field=replace(question.field, same_assembly=False))
            given = answer(replace(question, indices=(), wanted=("SUI", "area", "box_area")), {}, 1, SINGLE)
            nothing = {name: np.full(1, np.nan) for name in question.wanted}
            given = replace(given, values=nothing | given.values, errors=nothing | given.errors)
            words = f"every pose{where(question)} is a forward singularity: indices have no value"
            warnings.append(Caution("singular", words, "indices", len(answers)))
        else:
            given = answer(question, {}, 1, SINGLE)
            warnings += _doubts(question, given)
        answers.append(given)
        if given.panels.closes[0]:
            found, columns = _pieces(study, question, given, warnings)
            pieces.append(columns)
            counted = [patch for patch in found if patch.piece == 1 or not question.field.same_assembly]
            others = [patch for patch in found if patch not in counted]
            shapes.append(inscribed(question.field, question.about, question.scan, counted, others))
            regions.append((study, question, found))
            if not np.isfinite(shapes[-1]).all():
                warnings.append(Caution(
                    "incomplete",
                    f"the largest circle or rectangle inside the region{where(question)} was not found: where a limit "
                    "jumps (an angle's turn ends there) no slope leads along the boundary",
                    "indices",
                ))  # fmt: skip
        else:
            shapes.append(np.full(len(INSCRIBED), np.nan))
            warnings += beyond(study, question, ()) if question.field.same_assembly else []
            pieces.append(piece_columns(study, question, (), (), drawn=False))
        progress.update(1)
    if not regions:
        raise AssemblyError(_unreachable(study, asked))
    indices = INDICES.table([*_indices(study, asked, answers), *inscribed_columns(study, shapes)])
    tables = [
        indices,
        *_totals(indices, asked),
        LOCAL.table(stacked([_local(*region) for region in regions])),
        *outlines(regions),
        *_several(pieces),
    ]
    empty = sum(not given.panels.closes[0] for given in answers)
    named = {table.name: table for table in tables}
    along = poses_along(study, regions[0][1].held, named["boundary"])
    drawn = DrawnRegion(along, ellipses(regions[0][1], regions[0][2]))
    return Result("workspace", named, tuple(warnings), {"regions": len(asked), "empty": empty}, drawn=drawn)


def _pieces(
    study: Study, question: Question, given: Evaluation, warnings: list[Caution]
) -> tuple[list[Patch], list[Column]]:
    """Patches and pieces of a region, and a warning where pieces, or more than the piece beyond it, are left out."""
    assert given.pieces is not None
    found = patches_of_pieces(given.pieces, question.rays or RAYS)
    areas, drawn = areas_of_pieces(question, given), bool(given.pieces.drawn[0])
    if len(areas) > 1 and question.field.same_assembly:
        warnings.append(left_out(study, question, areas, drawn))
    if question.field.same_assembly and not isinstance(question.field, Ranged):
        warnings += beyond(study, question, areas)
    return found, piece_columns(study, question, found, areas, drawn)


def _totals(indices: Table, asked: Sequence[Question]) -> Iterator[Table]:
    """The table over all held values, where a coordinate is held."""
    if asked[0].held:
        yield totals(indices, list(asked[0].held))


def _several(pieces: Sequence[Sequence[Column]]) -> Iterator[Table]:
    """The table of pieces, where a region has several."""
    table = PIECES.table(stacked(pieces))
    if (table["piece"] > 1).any():
        yield table


def _unreachable(study: Study, asked: Sequence[Question]) -> str:
    assert study.workspace is not None
    field, about = asked[0].field, asked[0].about
    there = " at" * bool(asked[0].held) + ";".join(where(question).removeprefix(" at") for question in asked)
    if field.rootless:
        return f"point {study.workspace.point} reaches nothing{there}: {ROOTLESS}"
    assembly = " in the sketch's assembly" if field.same_assembly else ""
    return (
        f"point {study.workspace.point} reaches nothing{there} on the scan about ({about.real:g}, {about.imag:g}): "
        f"its links cannot close there{assembly}, or a limit forbids it"
    )


def _doubts(question: Question, given: Evaluation) -> Iterator[Caution]:
    there = where(question)
    if not given.panels.closes[0]:
        assembly = " in the sketch's assembly" if question.field.same_assembly else ""
        words = f"nothing is reachable{there}" + (f": {ROOTLESS}" if question.field.rootless else assembly)
        yield Caution("unassembled", words, "indices")
        return
    area, error = given.values["area"][0], given.errors["area"][0]
    if error > AREA_SURE * area:
        yield Caution(
            "unconverged",
            f"the area{there} is only known to {error:.2g}: a raster of places that are reached shows more than the "
            "integral has found",
            "indices",
        )
    for name in ("GII", "GRI"):
        error, value = given.errors[name][0], given.values[name][0]
        if question.rule == "gauss" and not error <= 2 * question.tolerance * abs(value):
            words = f"{name}{there} is only known to {error:.1g}, not to the tolerance asked for"
            yield Caution("unconverged", words, "indices")


def _indices(study: Study, asked: Sequence[Question], answers: Sequence[Evaluation]) -> Iterator[Column]:
    yield from stacked([held_columns(study, question, 1) for question in asked])
    kinds = index_columns(study, asked[0])

    def column(name: str) -> Column:
        return replace(kinds[name], values=np.concatenate([given.values[name] for given in answers]))

    def error(name: str) -> Column:
        values = np.concatenate([given.errors[name] for given in answers])
        return INDICES["<statistic>_error"].column(values, kinds[name].unit, statistic=name)

    estimated = asked[0].rule == "gauss"
    statistics = [name for name in asked[0].wanted if name not in COLUMNS]
    yield from (column(name) for name in COLUMNS)
    yield from (error(name) for name in COLUMNS[:4] if estimated)
    yield from (column(name) for name in statistics)
    yield from (error(name) for name in statistics if estimated or not name.endswith(("_mean", "_std")))


def index_columns(study: Study, question: Question) -> dict[str, Column]:
    """The columns of the answer, without values."""
    words = study.units.labels | {"as resistivity": index("resistivity").unit(study, question.field)}
    found = {column.name: column for column in INDICES.columns(words, **dict.fromkeys(COLUMNS, ()))}
    for name in (name for name in question.wanted if name not in COLUMNS):
        local, kind = split(name)
        words = {"index": local, "meaning of the index": index(local).meaning}
        found[name] = INDICES[f"<index>_{kind}"].column((), index(local).unit(study, question.field), **words)
    return found


def _local(study: Study, question: Question, found: Sequence[Patch]) -> list[Column]:
    grids = [patch.grid(question.about) for patch in found]
    z = np.concatenate([grid.ravel() for grid in grids])
    local = Local.at(question.field, z, {})
    names = dict.fromkeys(("inverse_condition", "resistivity", *(each.name for each in question.indices)))
    node = np.concatenate([np.tile(np.arange(grid.shape[1]), len(grid)) for grid in grids])
    ray = np.concatenate([np.repeat(np.arange(len(grid)), grid.shape[1]) for grid in grids])
    patch = np.repeat(np.arange(len(grids)), [grid.size for grid in grids])
    per_area = power_of_length(study.units, determinant_power(question.field))
    determinant = np.broadcast_to(local.determinant, z.shape)
    if question.field.same_assembly:
        # It has one sign all over a patch; at a tip where no node is off the boundary rounding would choose another.
        middle = Local.at(question.field, np.array([patch.middle(question.about) for patch in found]), {}).determinant
        determinant = np.copysign(determinant, np.broadcast_to(middle, len(found))[patch])
    columns = [
        LOCAL["<index>"].column(np.broadcast_to(each.values(local), z.shape), each.index.unit(study, question.field),
                                **{"index": each.name, "meaning of the index": each.index.meaning})
        for each in prepare(study, list(names))
    ]  # fmt: skip
    words = study.units.labels | {"as its outputs over the drives, multiplied": per_area}
    return [
        *held_columns(study, question, len(z)),
        *LOCAL.columns(words, x=z.real, y=z.imag),
        *columns[:2],
        *LOCAL.columns(words, det_J=determinant),
        *columns[2:],
        *LOCAL.columns(words, patch=patch, ray=ray, node=node,
                       piece=np.repeat([patch.piece for patch in found], [grid.size for grid in grids])),
    ]  # fmt: skip


def _reachable(study: Study, progress: Progress) -> Result:
    """Region of a point over a range of a held coordinate: area, the rectangle around it, and its boundary."""
    section = study.workspace
    assert section is not None
    name, over = next((name, value) for name, value in section.at.items() if isinstance(value, Over))
    asked = questions(study, wanted=OF_RANGE)
    progress.start(len(asked), "regions")
    answers: list[Evaluation] = []
    boundaries: list[list[Column]] = []
    pieces: list[list[Column]] = []
    warnings: list[Caution] = []
    for question in asked:
        given = answer(question, {}, 1, OVER_RANGE)
        answers.append(given)
        if given.panels.closes[0]:
            found, columns = _pieces(study, question, given, warnings)
            pieces.append(columns)
            boundaries.append(_outline(study, question, name, found))
        else:
            pieces.append(piece_columns(study, question, (), (), drawn=False))
        progress.update(1)
    if not boundaries:
        held = "".join(f", {key} = {value:g}" for key, value in asked[0].held.items())
        raise AssemblyError(
            f"point {section.point} reaches nothing over the range of {name} from {over.from_:g} to {over.to:g}{held}"
        )
    values = {key: np.concatenate([given.values[key] for given in answers]) for key in OF_RANGE}
    area, error = values["area"], np.concatenate([given.errors["area"] for given in answers])
    coordinates = stacked([held_columns(study, question, 1) for question in asked])
    columns = RANGE_INDICES.columns(study.units.labels, **values, area_error=error)
    indices = RANGE_INDICES.table([*coordinates, *columns], held=name)
    tables = [
        indices,
        *_totals(indices, asked),
        BOUNDARY.table(stacked(boundaries)),
        *_several(pieces),
    ]
    late = (area > 0) & (error > FINEST_AREA * area)
    if late.any():
        known = (error[late] / area[late]).max()
        warnings.append(Caution(
            "unconverged",
            f"the area is known to {known:.1g} of itself only (area_error): over the range of {name} the boundary "
            "is too rough for more",
            "indices", int(late.argmax()),
        ))  # fmt: skip
    counts = {"regions": len(asked), "empty": len(asked) - len(boundaries)}
    return Result("workspace", {table.name: table for table in tables}, tuple(warnings), counts)


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
        yield BOUNDARY["<coordinate>"].column(shown, study.units.label(coordinate.quantity), coordinate=name)

    return [column for column in boundary_columns(study, question, found, told, deciding) if column.name != "theta"]
