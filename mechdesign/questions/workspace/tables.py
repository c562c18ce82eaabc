"""Tables of workspaces: indices, pieces, boundary, nodes, singularities, and the indices over all held values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.ground.columns import Column
from mechdesign.ground.indices import index
from mechdesign.ground.numerics.arrays import Ints
from mechdesign.ground.results import Table
from mechdesign.motion.motion import in_study_units
from mechdesign.questions.columns import power_of_length
from mechdesign.questions.workspace.boundary import drives_on
from mechdesign.questions.workspace.columns import (
    BOUNDARY,
    HELD,
    INDICES,
    LOCAL,
    PIECES,
    SINGULARITIES,
    TOTALS,
)
from mechdesign.questions.workspace.index import determinant_power
from mechdesign.questions.workspace.inscribed import INSCRIBED
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.question import COLUMNS, Question, split
from mechdesign.questions.workspace.reached import Reached
from mechdesign.questions.workspace.singularities import causes
from mechdesign.study import Study


def tables(study: Study, regions: Sequence[Reached]) -> Iterator[Table]:
    """The tables of regions, some of which have a place."""
    held = _stacked([_held(study, region.question, 1) for region in regions])
    indices = INDICES.table([*held, *_indices(study, regions), *_inscribed(study, regions)])
    yield indices
    if held:
        yield _totals(indices, [column.name for column in held])
    full = [region for region in regions if region.patches]
    for kind, columns in ((LOCAL, _local), (BOUNDARY, _boundary), (SINGULARITIES, _singularities)):
        yield kind.table(_stacked([columns(study, region) for region in full]))
    pieces = PIECES.table(_stacked([_pieces(study, region) for region in regions]))
    if (pieces["piece"] > 1).any():
        yield pieces


def curves(table: Table) -> Iterator[Ints]:
    """Rows of each curve of a boundary or of a locus."""
    for curve in np.unique(table["curve"]):
        yield np.flatnonzero(table["curve"] == curve)


def index_columns(study: Study, question: Question) -> dict[str, Column]:
    """The columns of the answer, without values."""
    words = study.units.labels | {"as resistivity": index("resistivity").unit(study, question.field)}
    kinds = {column.name: column for column in INDICES.columns(words, **dict.fromkeys((*COLUMNS, *INSCRIBED), ()))}
    for name in (name for name in question.columns if name not in kinds):
        local, kind = split(name)
        words = {"index": local, "meaning of the index": index(local).meaning}
        kinds[name] = INDICES[f"<index>_{kind}"].column((), index(local).unit(study, question.field), **words)
    return kinds


def _held(study: Study, question: Question, rows: int) -> list[Column]:
    """The held coordinates, the same in each row."""
    return [
        HELD.column(np.full(rows, value), study.units.label(study.mechanism.quantity(name)), held=name)
        for name, value in question.held.items()
    ]


def _stacked(parts: Sequence[Sequence[Column]]) -> tuple[Column, ...]:
    """Columns of several regions below each other."""
    return tuple(
        replace(columns[0], values=np.concatenate([column.values for column in columns]))
        for columns in zip(*parts, strict=True)
    )


def _indices(study: Study, regions: Sequence[Reached]) -> Iterator[Column]:
    """The wanted indices of each region, and their errors."""
    question, answers = regions[0].question, [region.answer for region in regions]
    kinds = index_columns(study, question)

    def column(name: str) -> Column:
        return replace(kinds[name], values=np.concatenate([evaluation.values[name] for evaluation in answers]))

    def error(name: str) -> Column:
        values = np.concatenate([evaluation.errors[name] for evaluation in answers])
        return INDICES["<statistic>_error"].column(values, kinds[name].unit, statistic=name)

    estimated = question.rule == "gauss"
    statistics = [name for name in question.columns if name not in COLUMNS]
    yield from (column(name) for name in COLUMNS)
    yield from (error(name) for name in COLUMNS[:4] if estimated)
    yield from (column(name) for name in statistics)
    yield from (error(name) for name in statistics if estimated or not name.endswith(("_mean", "_std")))


def _inscribed(study: Study, regions: Sequence[Reached]) -> list[Column]:
    """The largest circle and rectangle inside each region."""
    shapes = np.transpose([region.shapes for region in regions])
    return INDICES.columns(study.units.labels, **dict(zip(INSCRIBED, shapes, strict=True)))


def _totals(indices: Table, held: Sequence[str]) -> Table:
    """Smallest, mean and largest of each statistic of the indices over the held values, and where they are."""
    statistics = [column for column in indices.columns
                  if column.name not in held and not column.name.endswith(("_error", "_x", "_y"))]  # fmt: skip
    values = np.array([column.values for column in statistics], dtype=float)
    present = ~np.isnan(values)
    least = np.argmin(np.where(present, values, np.inf), axis=1)
    most = np.argmax(np.where(present, values, -np.inf), axis=1)
    row, some = np.arange(len(statistics)), present.any(axis=1)
    mean = np.where(present, values, 0.0).sum(axis=1) / np.where(some, present.sum(axis=1), np.nan)
    ends = {"smallest": least, "largest": most}
    return TOTALS.table([
        *TOTALS.columns({}, statistic=np.array([column.name for column in statistics]), smallest=values[row, least],
                        mean=mean, largest=values[row, most]),
        *(TOTALS[f"{end}_at_<held>"].column(np.where(some, indices[name][at], np.nan), indices.column(name).unit,
                                            held=name)
          for end, at in ends.items() for name in held),
        *TOTALS.columns({}, unit=np.array([column.unit for column in statistics]),
                        values=np.full(len(statistics), len(indices)),
                        empty=np.full(len(statistics), int((indices["area"] == 0).sum()))),
    ])  # fmt: skip


def _local(study: Study, region: Reached) -> list[Column]:
    """Local indices at the nodes of a region's patches."""
    question, field, grids = region.question, region.question.field, [patch.grid for patch in region.patches]
    z, shapes = np.concatenate([grid.ravel() for grid in grids]), [grid.shape for grid in grids]
    patch = np.repeat(np.arange(len(grids)), [rays * nodes for rays, nodes in shapes])
    ray, node = np.concatenate([np.indices(shape).reshape(2, -1) for shape in shapes], axis=1)
    local = Local.at(field, z, {})
    determinant = np.broadcast_to(local.determinant, z.shape)
    if field.same_assembly:
        # It has one sign all over a patch; at a tip where no node is off the boundary rounding would choose another.
        middle = Local.at(field, np.array([patch.middle for patch in region.patches]), {}).determinant
        determinant = np.copysign(determinant, np.broadcast_to(middle, len(grids))[patch])
    columns = [
        LOCAL["<index>"].column(np.broadcast_to(index.values(local), z.shape), index.index.unit(study, field),
                                **{"index": index.name, "meaning of the index": index.index.meaning})
        for index in question.shown
    ]  # fmt: skip
    per_area = power_of_length(study.units, determinant_power(field))
    words = study.units.labels | {"as its outputs over the drives, multiplied": per_area}
    piece = np.array([patch.piece for patch in region.patches])[patch]
    return [
        *_held(study, question, len(z)),
        *LOCAL.columns(words, x=z.real, y=z.imag),
        *columns[:2],
        *LOCAL.columns(words, det_J=determinant),
        *columns[2:],
        *LOCAL.columns(words, patch=patch, ray=ray, node=node, piece=piece),
    ]


def _boundary(study: Study, region: Reached) -> list[Column]:
    """Points of the boundary curve by curve, first those where rays enter the region, the drives, and what ends it."""
    question, field, labels, label = region.question, region.question.field, study.units.labels, study.units.label
    edges = [(patch, edge) for patch in region.patches for edge in patch.edges]
    edges.sort(key=lambda both: both[1].side)
    theta, radius, z = (np.concatenate(parts) for parts in zip(
        *((p.theta, e.radius, e.places) for p, e in edges), strict=True))  # fmt: skip
    curve = np.repeat(np.arange(len(edges)), [len(patch.theta) for patch, _ in edges])
    margin, side, piece = (np.array(column)[curve] for column in zip(
        *((e.margin, e.side, p.piece) for p, e in edges), strict=True))  # fmt: skip
    kinds, words = [kind for kind, _ in field.labels], [at for _, at in causes(field)]
    return [
        *_held(study, question, len(z)),
        *BOUNDARY.columns(labels, x=z.real, y=z.imag, kind=np.array(kinds)[margin]),
        *(BOUNDARY["<drive>"].column(
            np.asarray(in_study_units(study.units, c, values)), label(c.quantity), drive=c.name
          ) for c, values in drives_on(field, margin, question.about, theta, radius, side)),
        *BOUNDARY.columns(labels, at=np.array(words)[margin], theta=theta / study.units.angle_factor, side=side,
                          curve=curve, piece=piece),
    ]  # fmt: skip


def _pieces(study: Study, region: Reached) -> list[Column]:
    """Pieces of a region: the area of each, a place inside it, and whether it holds the sketch's place.

    Of an empty region it is one row, piece 0 of area 0.
    """
    areas, pieces = region.areas, region.answer.pieces
    number = np.arange(1, len(areas) + 1) if areas else np.zeros(1, dtype=int)
    drawn = bool(areas) and pieces is not None and bool(pieces.drawn[0])
    own = [[patch for patch in region.patches if patch.piece == k] for k in number]
    widest = [max(patches, key=lambda patch: patch.width, default=None) for patches in own]
    z = np.array([complex(np.nan, np.nan) if patch is None else patch.middle for patch in widest])
    return [
        *_held(study, region.question, len(z)),
        *PIECES.columns(study.units.labels, piece=number, area=np.array([*areas] or [0.0]), x=z.real, y=z.imag,
                        sketch=((number == 1) & drawn).astype(int)),
    ]  # fmt: skip


def _singularities(study: Study, region: Reached) -> list[Column]:
    """Curves of singularities inside the region and around it."""
    loci = region.loci
    lengths = [len(locus.points) for locus in loci]
    z = np.concatenate([np.zeros(0, dtype=complex), *(locus.points for locus in loci)])

    def per_point(values: Sequence[str]) -> NDArray[np.str_]:
        return np.repeat(np.array(values, dtype=str), lengths)

    return [
        *_held(study, region.question, len(z)),
        *SINGULARITIES.columns(
            study.units.labels, curve=np.repeat(np.arange(len(loci)), lengths),
            kind=per_point([locus.kind for locus in loci]), x=z.real, y=z.imag,
            cause=per_point([locus.cause for locus in loci]),
        ),
    ]  # fmt: skip
