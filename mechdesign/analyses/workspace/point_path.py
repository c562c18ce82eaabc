"""The workspace of a point with one degree of freedom: its path between the limits of motion, and indices along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.kinematics.boundaries import Boundary, boundaries
from mechdesign.analyses.poses import in_study_units, radians
from mechdesign.errors import AssemblyError, Problem, StudyError
from mechdesign.mechanism.margins import SweepMargins
from mechdesign.mechanism.outputs import first
from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.numerics.roots import bracketed_roots
from mechdesign.results import Column, Result, Table
from mechdesign.study import Study

# Poses in which the motion is looked for, a turn; rows of the table of one path.
POSES, ROWS = 720, 361
# Gauss nodes of the arc length: doubled from the first to the last until two agree to the tolerance.
FIRST, LAST = 16, 2048
TOLERANCE = 1e-11
# The rows of a path end this far (as a part of it) before a singularity, where rates are infinite.
INSET = 1e-9
# A speed ratio this many times the usual one is infinite.
ENDLESS = 1e7


@dataclass(frozen=True, eq=False)
class Piece:
    """One motion: the drive's range (radians or length), what ends it (None where it closes), and whether it does."""

    low: float
    high: float
    ends: tuple[str, str]
    closed: bool


@dataclass(frozen=True, eq=False)
class _Path:
    """A point as a function of the place t in [0, pi] along a piece; the drive is low + (high - low)(1 - cos t)/2.

    Where the drive turns back (a dead centre) the point moves as the root of what is left of the range: smooth in t.
    """

    margins: SweepMargins
    outputs: tuple[str, str]
    piece: Piece

    def drive(self, t: Floats) -> Floats:
        t = np.clip(t, INSET, np.pi - INSET)
        return self.piece.low + (self.piece.high - self.piece.low) * np.sin(t / 2) ** 2

    def of(self, t: Floats) -> tuple[Floats, Floats]:
        """Place (2, n), and its slope by the drive (2, n)."""
        mechanism = self.margins.mechanism
        pose = self.margins.solve(self.drive(t), limits=False)
        rates = mechanism.linearize(pose).velocity([1.0])
        coordinates = [mechanism.coordinate(name) for name in self.outputs]
        place = np.stack([np.broadcast_to(pose.value(c), t.shape) for c in coordinates])
        slope = np.stack([np.broadcast_to(first(pose, c, rates), t.shape) for c in coordinates])
        return place, slope

    def speed(self, t: Floats) -> Floats:
        """Slope of the place by t."""
        t = np.clip(t, INSET, np.pi - INSET)
        return self.of(t)[1] * (0.5 * (self.piece.high - self.piece.low) * np.sin(t))


def point_path(study: Study) -> Result:
    """Path of the workspace's point, its length, the box around it, and how fast the drive moves it.

    Raises
    ------
    StudyError
        If a drive that is no angle has no limits.
    AssemblyError
        If no pose within the limits can be assembled.
    """
    assert study.workspace is not None
    (drive,) = study.mechanism.drives
    outputs = (f"{study.workspace.point}.x", f"{study.workspace.point}.y")
    margins, pieces = _pieces(study, drive)
    paths = [_Path(margins, outputs, piece) for piece in pieces]
    label, length = study.units.label(study.mechanism.quantity(drive)), study.units.label("length")
    power = "" if study.mechanism.quantity(drive) == "length" else length

    def shown(values: Floats) -> Floats:
        return np.asarray(in_study_units(study, margins.coordinate, values))

    turns = [_turns(path) for path in paths]
    arcs = [_length(path, np.concatenate(at)) for path, at in zip(paths, turns, strict=True)]
    boxes = [_box(path, at) for path, at in zip(paths, turns, strict=True)]
    rows: list[list[Floats]] = []
    for k, path in enumerate(paths):
        t = np.linspace(0, np.pi, ROWS)
        place, slope = path.of(t)
        ratio = np.hypot(*slope)
        # At a dead centre the point moves and the drive does not; rounding leaves a large number of it.
        ratio = np.where(ratio < ENDLESS * np.nanmedian(ratio), ratio, np.inf) if ratio.any() else ratio
        with np.errstate(divide="ignore"):
            inverse = 1 / ratio
        rows.append(
            [np.full(ROWS, k), path.drive(t), *place, ratio, inverse, _along(path, np.concatenate(turns[k]), t)]
        )
    piece, at, x, y, ratio, inverse, arc = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    means = np.array([arc / (p.high - p.low) for (arc, _), p in zip(arcs, pieces, strict=True)])
    ends = [p.ends for p in pieces]
    indices = (
        Column("from", shown(np.array([p.low for p in pieces])), label, f"{drive} where the motion begins"),
        Column("to", shown(np.array([p.high for p in pieces])), label, f"{drive} where it ends"),
        Column("from_at", np.array([e[0] for e in ends], dtype=str), "", "what ends the motion there"),
        Column("to_at", np.array([e[1] for e in ends], dtype=str), "", "what ends the motion there"),
        Column("closed", np.array([p.closed for p in pieces]), "", "1 where the path closes after a turn"),
        Column("length", np.array([a for a, _ in arcs]), length, "length of the path"),
        Column("length_error", np.array([e for _, e in arcs]), length, "estimated error of length"),
        Column("box_x", np.array([b[0] for b in boxes]), length, "left side of the rectangle around the path"),
        Column("box_y", np.array([b[1] for b in boxes]), length, "lower side of the rectangle around the path"),
        Column("box_width", np.array([b[2] for b in boxes]), length, "width of the rectangle around the path"),
        Column("box_height", np.array([b[3] for b in boxes]), length, "height of the rectangle around the path"),
        Column("speed_ratio_mean", means, power, "length of the path over the drive's travel"),
        Column("speed_ratio_min", np.array([r[4].min() for r in rows]), power, "smallest speed ratio of the rows"),
        Column("speed_ratio_max", np.array([r[4].max() for r in rows]), power, "largest speed ratio of the rows"),
    )
    path_columns = (
        Column("piece", piece.astype(int), "", "row of the indices"),
        Column(drive, shown(at), label, "drive"),
        *shared(study.units, x=x, y=y),
        Column("speed_ratio", ratio, power, "speed of the point over the drive's rate, per radian"),
        Column("resistivity", inverse, f"1/{power}" if power else "", "1/speed_ratio"),
        Column("arc", arc, length, "length of the path from its beginning"),
    )
    tables = [
        Table("indices", indices, "the path as a whole"),
        Table("path", path_columns, "the point's path, from limit to limit of the motion"),
    ]
    return Result("workspace", {table.name: table for table in tables}, (), {"paths": len(pieces)})


def _pieces(study: Study, drive: str) -> tuple[SweepMargins, list[Piece]]:
    """The motions of the mechanism: that of the sketch, or of every range in which it can be assembled."""
    mechanism, unit = study.mechanism, study.units.angle_factor
    coordinate = mechanism.coordinate(drive)
    drawn = float(mechanism.sketch_configuration.value(coordinate))
    turning = coordinate.quantity == "angle"
    if turning:
        low, high, number = drawn - 2 * np.pi, drawn + 2 * np.pi, 2 * POSES + 1
    else:
        low, high = _range(study, drive)
        number = POSES + 1
    place = np.linspace(low, high, number) / (unit if turning else 1.0)
    # The whole path is wanted, however many turns the limits leave the drive.
    near = {name: np.full(number, value) for name, value in mechanism.drawn_angles().items()}
    margins = SweepMargins(mechanism, {drive: radians(study, coordinate, place)}, drive, near, counted=False)
    valid = margins.solve(margins.at).valid
    ends = boundaries(margins, valid)[0]
    if not valid.any() and not ends:
        raise AssemblyError(f"no position of drive {drive} can be assembled within the limits")
    if not ends and turning:
        return margins, [Piece(drawn - np.pi, drawn + np.pi, ("", ""), True)]
    pieces = list(_between(margins, ends, low, high, drive))
    if turning:
        # Once round only: each is met twice.
        pieces = [p for p in pieces if drawn - 2 * np.pi < p.low <= drawn and p.high < drawn + 2 * np.pi]
    own = [p for p in pieces if p.low <= drawn <= p.high]
    wanted = study.workspace is not None and study.workspace.assembly == "same"
    return margins, own[:1] if own and wanted else pieces


def _between(margins: SweepMargins, ends: list[Boundary], low: float, high: float, drive: str) -> Iterator[Piece]:
    """Stretches between neighbouring ends whose middle is valid."""
    told = [(end.place, f"{end.cause.kind}: {end.cause.joint}") for end in ends]
    marks = [(low, f"end of the range of {drive}"), *told, (high, f"end of the range of {drive}")]
    marks.sort(key=lambda mark: mark[0])
    for (a, cause_a), (b, cause_b) in pairwise(marks):
        if b - a > INSET * (high - low) and margins.solve(np.array([0.5 * (a + b)])).valid.all():
            yield Piece(a, b, (cause_a, cause_b), False)


def _range(study: Study, drive: str) -> tuple[float, float]:
    """The limits of a drive that is no angle."""
    terms = study.mechanism.nominal

    def number(term: float | str | None) -> float | None:
        return terms[term] if isinstance(term, str) else term

    bounds = [b for b in study.mechanism.bounds if b.coordinate.name == drive]
    lows = [v for b in bounds if (v := number(b.minimum)) is not None]
    highs = [v for b in bounds if (v := number(b.maximum)) is not None]
    if not lows or not highs:
        message = f"the path of a point needs the range of drive {drive}: give it limits, {{drive: {drive}, min, max}}"
        raise StudyError((Problem(message, "mechanism.limits", str(study.path or "")),))
    return max(lows), min(highs)


def _turns(path: _Path) -> tuple[Floats, Floats]:
    """Places where the velocity is along an axis: those where it is along y, and along x."""
    t = np.linspace(0, np.pi, ROWS)
    speed = path.speed(t)
    found = []
    for axis in (0, 1):
        cell = np.flatnonzero(speed[axis, 1:] * speed[axis, :-1] < 0)

        def slope(which: Ints, at: Floats, axis: int = axis) -> Floats:
            part: Floats = path.speed(at)[axis]
            return part

        nan = np.full(len(cell), np.nan)
        ends = (t[cell], speed[axis, cell], t[cell + 1], speed[axis, cell + 1])
        found.append(bracketed_roots(slope, *ends, nan, nan, np.full(len(cell), 1e-13)) if len(cell) else nan)
    return found[0], found[1]


def _length(path: _Path, turns: Floats) -> tuple[float, float]:
    """Length of a path and its error, by Gauss-Legendre rules of doubled order between the turns: it may go back."""
    total = doubt = 0.0
    for low, high in pairwise([0.0, *np.unique(turns).tolist(), np.pi]):
        number, before, error = FIRST, np.inf, np.inf
        while True:
            nodes, weights = np.polynomial.legendre.leggauss(number)
            speed = np.hypot(*path.speed(low + 0.5 * (high - low) * (nodes + 1)))
            value = float(weights @ speed) * 0.5 * (high - low)
            error = abs(value - before)
            if error <= TOLERANCE * abs(value) or number >= LAST:
                break
            number, before = 2 * number, value
        total, doubt = total + value, doubt + error
    return total, doubt


def _along(path: _Path, turns: Floats, t: Floats) -> Floats:
    """Length up to each place."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    every = np.unique(np.concatenate([t, turns]))
    half = 0.5 * np.diff(every)
    at = (every[:-1] + half)[:, None] + half[:, None] * nodes
    parts = (np.hypot(*path.speed(at.ravel())).reshape(at.shape) @ weights) * half
    return np.concatenate([[0.0], np.cumsum(parts)])[np.searchsorted(every, t)]


def _box(path: _Path, turns: tuple[Floats, Floats]) -> tuple[float, float, float, float]:
    """Left and lower side, width and height of the rectangle around a path."""
    ends = np.array([0.0, np.pi])
    x, y = (path.of(np.concatenate([ends, at]))[0][axis] for axis, at in enumerate(turns))
    return float(x.min()), float(y.min()), float(np.ptp(x)), float(np.ptp(y))
