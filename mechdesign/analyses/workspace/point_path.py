"""The workspace of a point with one degree of freedom: its path between the limits of motion, and indices along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.analyses.columns import shared
from mechdesign.analyses.kinematics.boundaries import boundaries
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
# Gauss nodes of the arc length between two rows; that of the second rule tells the error.
NODES, FEWER = 8, 6
# The rows of a path end this far (as a part of it) before a singularity, where rates are infinite.
INSET = 1e-9
# A speed ratio this many times the usual one is infinite.
ENDLESS = 1e7


@dataclass(frozen=True, eq=False)
class _Path:
    """A point as a function of the place t in [0, pi] along one motion, of which the drive is (radians or length)

        low + (high - low) (1 - cos t)/2

    Where the drive turns back (a dead centre) the point moves as the root of what is left of the range: smooth in t.
    `ends` says what ends the motion.
    """

    margins: SweepMargins
    outputs: tuple[str, str]
    low: float
    high: float
    ends: tuple[str, str] = ("", "")
    closed: bool = False

    def drive(self, t: Floats) -> Floats:
        t = np.clip(t, INSET, np.pi - INSET)
        return self.low + (self.high - self.low) * np.sin(t / 2) ** 2

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
        return self.of(t)[1] * (0.5 * (self.high - self.low) * np.sin(t))


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
    paths = _paths(study, drive, outputs)
    label, length = study.units.label(study.mechanism.quantity(drive)), study.units.label("length")
    power = "" if study.mechanism.quantity(drive) == "length" else length
    coordinate, t = study.mechanism.coordinate(drive), np.linspace(0, np.pi, ROWS)

    def shown(values: Sequence[float] | Floats) -> Floats:
        return np.asarray(in_study_units(study, coordinate, np.asarray(values)))

    rows: list[list[Floats]] = []
    totals: list[list[float]] = []
    for k, path in enumerate(paths):
        place, slope = path.of(t)
        ratio = np.hypot(*slope)
        # At a dead centre the point moves and the drive does not; rounding leaves a large number of it.
        ratio = np.where(ratio < ENDLESS * np.nanmedian(ratio), ratio, np.inf) if ratio.any() else ratio
        turns = _turns(path, t)
        arc, error = _along(path, np.concatenate(turns), t)
        box = [path.of(np.concatenate([t[[0, -1]], at]))[0][axis] for axis, at in enumerate(turns)]
        with np.errstate(divide="ignore"):
            rows.append([np.full(ROWS, k), path.drive(t), *place, ratio, 1 / ratio, arc])
        totals.append([
            arc[-1], error, *(side.min() for side in box), *(np.ptp(side) for side in box),
            arc[-1] / (path.high - path.low), ratio.min(), ratio.max(),
        ])  # fmt: skip
    piece, at, x, y, ratio, inverse, arc = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    told = (
        ("length", length, "length of the path"),
        ("length_error", length, "estimated error of length"),
        ("box_x", length, "left side of the rectangle around the path"),
        ("box_y", length, "lower side of the rectangle around the path"),
        ("box_width", length, "width of the rectangle around the path"),
        ("box_height", length, "height of the rectangle around the path"),
        ("speed_ratio_mean", power, "length of the path over the drive's travel"),
        ("speed_ratio_min", power, "smallest speed ratio of the rows"),
        ("speed_ratio_max", power, "largest speed ratio of the rows"),
    )
    indices = (
        Column("from", shown([path.low for path in paths]), label, f"{drive} where the motion begins"),
        Column("to", shown([path.high for path in paths]), label, f"{drive} where it ends"),
        Column("from_at", np.array([path.ends[0] for path in paths]), "", "what ends the motion there"),
        Column("to_at", np.array([path.ends[1] for path in paths]), "", "what ends the motion there"),
        Column("closed", np.array([path.closed for path in paths]), "", "1 where the path closes after a turn"),
        *(Column(name, values, unit, meaning)
          for (name, unit, meaning), values in zip(told, np.transpose(totals), strict=True)),
    )  # fmt: skip
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
    return Result("workspace", {table.name: table for table in tables}, (), {"paths": len(paths)})


def _paths(study: Study, drive: str, outputs: tuple[str, str]) -> list[_Path]:
    """The motions of the mechanism: that of the sketch, or of every range in which it can be assembled."""
    mechanism, unit = study.mechanism, study.units.angle_factor
    coordinate = mechanism.coordinate(drive)
    drawn = float(mechanism.sketch_configuration.value(coordinate))
    turning = coordinate.quantity == "angle"
    low, high = (drawn - 2 * np.pi, drawn + 2 * np.pi) if turning else _range(study, drive)
    number = (2 if turning else 1) * POSES + 1
    place = np.linspace(low, high, number) / (unit if turning else 1.0)
    # The whole path is wanted, however many turns the limits leave the drive.
    near = {name: np.full(number, value) for name, value in mechanism.drawn_angles().items()}
    margins = SweepMargins(mechanism, {drive: radians(study, coordinate, place)}, drive, near, counted=False)
    valid = margins.solve(margins.at).valid
    ends = boundaries(margins, valid)[0]
    if not valid.any() and not ends:
        raise AssemblyError(f"no position of drive {drive} can be assembled within the limits")
    if not ends and turning:
        return [_Path(margins, outputs, drawn - np.pi, drawn + np.pi, closed=True)]
    # Stretches between neighbouring ends whose middle is valid.
    end = f"end of the range of {drive}"
    marks = [(low, end), *((end.place, f"{end.cause.kind}: {end.cause.joint}") for end in ends), (high, end)]
    paths = [
        _Path(margins, outputs, a, b, (cause_a, cause_b))
        for (a, cause_a), (b, cause_b) in pairwise(sorted(marks, key=lambda mark: mark[0]))
        if b - a > INSET * (high - low) and margins.solve(np.array([0.5 * (a + b)])).valid.all()
    ]
    if turning:
        # Once round only: each is met twice.
        paths = [p for p in paths if drawn - 2 * np.pi < p.low <= drawn and p.high < drawn + 2 * np.pi]
    own = [p for p in paths if p.low <= drawn <= p.high]
    wanted = study.workspace is not None and study.workspace.assembly == "same"
    return own[:1] if own and wanted else paths


def _range(study: Study, drive: str) -> tuple[float, float]:
    """The limits of a drive that is no angle."""
    bounds = [b.ends(study.mechanism.nominal) for b in study.mechanism.bounds if b.coordinate.name == drive]
    lows, highs = ([float(ends[k]) for ends in bounds if ends[k] is not None] for k in (0, 1))
    if not lows or not highs:
        message = f"the path of a point needs the range of drive {drive}: give it limits, {{drive: {drive}, min, max}}"
        raise StudyError((Problem(message, "mechanism.limits", str(study.path or "")),))
    return max(lows), min(highs)


def _turns(path: _Path, t: Floats) -> list[Floats]:
    """Places where the velocity is along an axis: those where it is along y, and along x."""
    found = []
    for axis, speed in enumerate(path.speed(t)):
        cell = np.flatnonzero(speed[1:] * speed[:-1] < 0)

        def slope(which: Ints, at: Floats, axis: int = axis) -> Floats:
            part: Floats = path.speed(at)[axis]
            return part

        nan = np.full(len(cell), np.nan)
        ends = (t[cell], speed[cell], t[cell + 1], speed[cell + 1])
        found.append(bracketed_roots(slope, *ends, nan, nan, np.full(len(cell), 1e-13)))
    return found


def _along(path: _Path, turns: Floats, t: Floats) -> tuple[Floats, float]:
    """Length up to each place, and the error of the whole; at the turns the point may go back."""
    every = np.unique(np.concatenate([t, turns]))
    half = 0.5 * np.diff(every)
    parts = []
    for number in (NODES, FEWER):
        nodes, weights = np.polynomial.legendre.leggauss(number)
        at = (every[:-1] + half)[:, None] + half[:, None] * nodes
        parts.append((np.hypot(*path.speed(at.ravel())).reshape(at.shape) @ weights) * half)
    arc = np.concatenate([[0.0], np.cumsum(parts[0])])[np.searchsorted(every, t)]
    return arc, float(np.abs(parts[0] - parts[1]).sum())
