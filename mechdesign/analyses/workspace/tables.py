"""Tables of a region's boundary and of its singularities, and poses along the boundary for its picture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.analyses.region.curves import Patch
from mechdesign.analyses.region.rays import BATCH
from mechdesign.analyses.workspace.columns import BOUNDARY, HELD, INDICES, PIECES, SINGULARITIES, TOTALS
from mechdesign.analyses.workspace.inscribed import INSCRIBED
from mechdesign.analyses.workspace.question import Question, answer
from mechdesign.analyses.workspace.singularities import around, causes, inside
from mechdesign.cautions import Caution
from mechdesign.errors import AssemblyError
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.results import Column, Table
from mechdesign.study import Study

# Relative accuracy of the area that lies in the other assembly.
LOOSE = 1e-3
# So far inside the boundary (as a part of the radius) the drives are read where rounding opens the mechanism.
BESIDE = 1e-12
# Poses along all curves of one side of the boundary.
POSES = {"inner": 2, "outer": 4}
# So far inside the boundary, as a part of the way to its middle: on it rounding may open the mechanism.
INSIDE = 1e-3


def where(question: Question) -> str:
    """At which held values, for messages; nothing where none is held."""
    held = ", ".join(f"{name} = {value:g}" for name, value in question.held.items())
    return f" at {held}" if held else ""


def left_out(study: Study, question: Question, areas: Sequence[float], drawn: bool) -> Caution:
    """That the indices are of one piece, and what is left out."""
    one = "of the piece that holds the sketch" if drawn else "of the largest (the sketch lies in none)"
    many, unit = len(areas) - 1, study.units.label("area")
    left = f"{'another' if many == 1 else f'{many} others, together'} of area {sum(areas[1:]):.4g} {unit}".rstrip()
    return Caution(
        "incomplete",
        f"the region{where(question)} has {len(areas)} pieces that do not hang together: indices are {one}; "
        f"{left} {'is' if many == 1 else 'are'} left out ('assembly: any' counts all)",
        "pieces",
    )


def beyond(study: Study, question: Question, areas: Sequence[float]) -> list[Caution]:
    """That more lies in the other assembly than in the piece that is reported, with both areas; else nothing.

    It is looked for as loosely as of a design of many.
    """
    field = question.field
    if not any(name.startswith("assembly ") for _, name in field.labels):
        return []
    both = replace(field, same_assembly=False)
    every = replace(question, field=both, indices=(), wanted=("area",), rule="gauss", tolerance=LOOSE)
    try:
        other = float(answer(every, {}, 1, BATCH).values["area"][0]) - sum(areas)
    except AssemblyError:
        # In the other assembly the region has no end.
        return []
    if not other > max(areas, default=0.0):
        return []
    unit = study.units.label("area")
    inside, beyond = (f"{area:.3g} {unit}".rstrip() for area in (sum(areas[:1]), other))
    return [Caution(
        "incomplete",
        f"more of the region{where(question)} lies beyond a forward singularity, in the other assembly: about "
        f"{beyond}, and {inside} here; 'assembly: any' counts all, or redraw the sketch in the other assembly",
        "indices",
    )]  # fmt: skip


def held_columns(study: Study, question: Question, rows: int) -> list[Column]:
    """The held coordinates, the same in each row."""
    return [
        HELD.column(np.full(rows, value), study.units.label(study.mechanism.quantity(name)), held=name)
        for name, value in question.held.items()
    ]


def stacked(parts: Sequence[Sequence[Column]]) -> tuple[Column, ...]:
    """Columns of several regions below each other."""
    return tuple(
        replace(columns[0], values=np.concatenate([column.values for column in columns]))
        for columns in zip(*parts, strict=True)
    )


def boundary_columns(
    study: Study, question: Question, found: Sequence[Patch], told: Sequence[str],
    also: Callable[[Complexes, Complexes, Floats, Ints], Iterable[Column]],
) -> list[Column]:  # fmt: skip
    """Points of the boundary curve by curve, and what ends the region there.

    Parameters
    ----------
    told : sequence of str
        Each margin in words.
    also : callable
        Further columns, of points of the boundary, points beside them inside the region, the directions in which those
        lie (1 outwards, -1 inwards), and margins.
    """
    curves = [
        (patch.theta, radius, margin, side, patch.piece)
        for side in ("inner", "outer")
        for patch in found
        for radius, margin in [(patch.inner, patch.enters) if side == "inner" else (patch.outer, patch.leaves)]
        if margin >= 0
    ]
    lengths = [len(curve[0]) for curve in curves]
    theta, radius = (np.concatenate([curve[k] for curve in curves]) for k in (0, 1))
    margin, side, piece = (np.repeat([curve[k] for curve in curves], lengths) for k in (2, 3, 4))
    inwards, turn = np.where(side == "inner", 1.0, -1.0), np.exp(1j * theta)
    z = np.asarray(question.about + radius * turn)
    within = np.asarray(question.about + radius * (1 + BESIDE * inwards) * turn)
    kinds, labels = np.array([kind for kind, _ in question.field.labels]), study.units.labels
    return [
        *held_columns(study, question, len(z)),
        *BOUNDARY.columns(labels, x=z.real, y=z.imag, kind=kinds[margin]),
        *also(z, within, inwards, margin),
        *BOUNDARY.columns(labels, at=np.array(told)[margin], theta=theta / study.units.angle_factor, side=side,
                          curve=np.repeat(np.arange(len(curves)), lengths), piece=piece),
    ]  # fmt: skip


def piece_columns(
    study: Study, question: Question, found: Sequence[Patch], areas: Sequence[float], drawn: bool
) -> list[Column]:  # fmt: skip
    """Pieces of a region: the area of each, a place inside it, and whether it holds the sketch's place.

    Of an empty region it is one row, piece 0 of area 0.
    """
    number = np.arange(1, len(areas) + 1) if areas else np.zeros(1, dtype=int)
    own = [[patch for patch in found if patch.piece == k] for k in number]
    widest = [max(patches, key=lambda p: float(np.max(p.outer - p.inner)), default=None) for patches in own]
    z = np.array([complex(np.nan, np.nan) if patch is None else patch.middle(question.about) for patch in widest])
    return [
        *held_columns(study, question, len(z)),
        *PIECES.columns(study.units.labels, piece=number, area=np.array([*areas] or [0.0]), x=z.real, y=z.imag,
                        sketch=((number == 1) & drawn).astype(int)),
    ]  # fmt: skip


def singularity_columns(study: Study, question: Question, found: Sequence[Patch]) -> list[Column]:
    """Curves of singularities inside the region and around it."""
    loci = [*inside(question.field, question.about, found), *around(question.field, question.about, found)]
    lengths = [len(locus.points) for locus in loci]
    z = np.concatenate([np.zeros(0, dtype=complex), *(locus.points for locus in loci)])

    def each(values: Sequence[str]) -> NDArray[np.str_]:
        return np.repeat(np.array(values, dtype=str), lengths)

    return [
        *held_columns(study, question, len(z)),
        *SINGULARITIES.columns(
            study.units.labels, curve=np.repeat(np.arange(len(loci)), lengths),
            kind=each([locus.kind for locus in loci]), x=z.real, y=z.imag, cause=each([locus.cause for locus in loci]),
        ),
    ]  # fmt: skip


def inscribed_columns(study: Study, shapes: Sequence[Floats]) -> list[Column]:
    """The largest circle and rectangle inside each region, as `inscribed` gives them; nan where it is empty."""
    return INDICES.columns(study.units.labels, **dict(zip(INSCRIBED, np.transpose(shapes), strict=True)))


def totals(indices: Table, held: Sequence[str]) -> Table:
    """Smallest, mean and largest of each statistic of the indices over the held values, and where they are."""
    told = [column for column in indices.columns
            if column.name not in held and not column.name.endswith(("_error", "_x", "_y"))]  # fmt: skip
    values = np.array([column.values for column in told], dtype=float)
    known = ~np.isnan(values)
    least = np.argmin(np.where(known, values, np.inf), axis=1)
    most = np.argmax(np.where(known, values, -np.inf), axis=1)
    row, some = np.arange(len(told)), known.any(axis=1)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, values, 0.0).sum(axis=1) / np.where(some, known.sum(axis=1), np.nan)
    ends = {"smallest": least, "largest": most}
    return TOTALS.table([
        *TOTALS.columns({}, statistic=np.array([column.name for column in told]), smallest=values[row, least],
                        mean=mean, largest=values[row, most]),
        *(TOTALS[f"{end}_at_<held>"].column(np.where(some, indices[name][at], np.nan), indices.column(name).unit,
                                            held=name)
          for end, at in ends.items() for name in held),
        *TOTALS.columns({}, unit=np.array([column.unit for column in told]), values=np.full(len(told), len(indices)),
                        empty=np.full(len(told), int((indices["area"] == 0).sum()))),
    ])  # fmt: skip


def outlines(regions: Sequence[tuple[Study, Question, Sequence[Patch]]]) -> list[Table]:
    """Boundary and singularities of several regions."""
    boundaries = [
        boundary_columns(*region, [words for _, words in causes(region[1].field)], partial(_drives, *region[:2]))
        for region in regions
    ]
    return [
        BOUNDARY.table(stacked(boundaries)),
        SINGULARITIES.table(stacked([singularity_columns(*region) for region in regions])),
    ]


def _drives(
    study: Study, question: Question, z: Complexes, within: Complexes, inwards: Floats, margin: Ints
) -> Iterator[Column]:
    """Drives on the boundary, or just inside where rounding opens the mechanism.

    Angles lie within the drive's limits; where it has none they are continuous along each side, in the turn that is
    nearest to the sketch.
    """
    mechanism, sides = question.field.mechanism, np.flatnonzero(np.diff(inwards)) + 1
    exact, near = question.field.configuration(z, {}), question.field.configuration(within, {})
    for drive in mechanism.forward.structure.given:
        here, beside = (np.broadcast_to(c.value(drive), z.shape) for c in (exact, near))
        values = np.where(np.isfinite(here), here, beside)
        if drive.quantity == "angle" and drive.name not in mechanism.turns({}):
            drawn = float(mechanism.sketch_configuration.value(drive))
            parts = [np.unwrap(part) for part in np.split(values, sides)]
            turns = [2 * np.pi * np.round((np.mean(part) - drawn) / (2 * np.pi)) for part in parts]
            values = np.concatenate([part - turn for part, turn in zip(parts, turns, strict=True)])
        shown = np.asarray(in_study_units(study, drive, values))
        yield BOUNDARY["<drive>"].column(shown, study.units.label(drive.quantity), drive=drive.name)


def curves(table: Table) -> Iterator[Ints]:
    """Rows of each curve of a boundary or of a locus."""
    for curve in np.unique(table["curve"]):
        yield np.flatnonzero(table["curve"] == curve)


def poses_along(study: Study, held: Mapping[str, float], boundary: Table) -> Configuration:
    """Poses at places a little inside the boundary, evenly along each of its sides, shape (places,).

    Of a boundary for all values of the held coordinates, that at `held` (in the study's units) is meant; pieces that
    are left out do not count.
    """
    assert study.workspace is not None
    mechanism, point = study.mechanism, study.workspace.point
    own = np.ones(len(boundary), dtype=bool)
    for name, value in held.items():
        own &= boundary[name] == value
    if study.workspace.assembly == "same":
        own &= boundary["piece"] == 1
    places = _places(boundary.take(own)) if own.any() else np.zeros(0, dtype=complex)
    plan = mechanism.plan((f"{point}.x", f"{point}.y", *held))
    values = [radians(study, mechanism.coordinate(name), value) for name, value in held.items()]
    return plan.solve([places.real, places.imag, *values], limits=False)


def _places(boundary: Table) -> Complexes:
    found = []
    middle = complex(np.mean(boundary["x"]), np.mean(boundary["y"]))
    for side, number in POSES.items():
        own = [rows for rows in curves(boundary) if str(boundary["side"][rows[0]]) == side]
        if not own:
            continue
        pieces = [boundary["x"][rows] + 1j * boundary["y"][rows] for rows in own]
        z = np.concatenate(pieces)
        steps = np.concatenate([np.concatenate([[0.0], np.abs(np.diff(piece))]) for piece in pieces])
        along = np.cumsum(steps)
        for share in (np.arange(number) + 0.5) / number:
            k = int(np.searchsorted(along, share * along[-1]))
            found.append(z[k] + INSIDE * (middle - z[k]) * (1 if side == "outer" else -1))
    return np.array(found)
