"""The workspace of a point with one degree of freedom: its path between the limits of motion, and indices along it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.errors import AssemblyError, Problem, StudyError
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.ground.results import Result
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.derivatives import regularity
from mechdesign.mechanism.outputs import first
from mechdesign.motion.corners import curve_of
from mechdesign.motion.curve import Curve
from mechdesign.motion.ends import Ends
from mechdesign.motion.functions import Functions
from mechdesign.motion.motion import in_study_units
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import GivenRows
from mechdesign.questions.workspace.columns import PATH, PATH_INDICES
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.study import Study

# Rows of the table of one path.
ROWS = 361
# A motion shorter than this part of the drive's range is rounding.
SHORTEST = 1e-9


@dataclass(frozen=True, eq=False)
class _Path:
    """One motion of the drive from `low` to `high` (radians or length), and what ends it."""

    study: Study
    drive: str
    low: float
    high: float
    ends: tuple[str, str] = ("", "")
    closed: bool = False

    def functions(self, outputs: Sequence[str]) -> Functions:
        """The point's coordinates and its speed by the drive along the motion, which is one row long."""
        mechanism = self.study.mechanism
        curve = _curve(self.study, self.drive, self.low, self.high)
        coordinates = [mechanism.coordinate(name) for name in outputs]

        def evaluate(line: Ints, s: Floats) -> tuple[Floats, Floats]:
            pose = curve.solve(line, s, judged=False).configuration
            linear = mechanism.linearize(pose)
            rates = linear.velocity([1.0])
            slope = [first(pose, c, rates) for c in coordinates]
            rows = [*(pose.value(c) for c in coordinates), np.hypot(slope[0], slope[1])]
            conditioning = np.broadcast_to(regularity(linear), s.shape)
            return np.stack([np.broadcast_to(row, s.shape) for row in rows]), conditioning

        sizes = [mechanism.size, mechanism.size, 0.0]
        return Functions(curve, [*outputs, _SPEED], evaluate, sizes, extremes=outputs, means=[_SPEED])


_SPEED = "speed"


def _curve(study: Study, drive: str, low: float, high: float) -> Curve:
    """The motion of a drive between two values; the whole path is wanted, however many turns its limits leave it."""
    ends = np.array([low, high]) / (study.units.angle_factor if study.mechanism.quantity(drive) == "angle" else 1.0)
    return curve_of(study.motion(Poses(GivenRows({drive: ends}))), turning=False)


def point_path(study: Study) -> Result:
    """Path of the workspace's point, its length, the box around it, and how fast the drive moves it.

    Raises
    ------
    StudyError
        If a drive that is no angle has no limits.
    AssemblyError
        If no pose within the limits can be assembled.
    """
    (drive,), point = study.mechanism.drives, WorkspaceSection.of(study).point
    outputs = (f"{point}.x", f"{point}.y")
    paths = _of_modes(study, drive, outputs)
    label, length = study.units.label(study.mechanism.quantity(drive)), study.units.label("length")
    power = "" if study.mechanism.quantity(drive) == "length" else length
    coordinate, t = study.mechanism.coordinate(drive), np.linspace(0, np.pi, ROWS)

    def shown(values: Sequence[float] | Floats) -> Floats:
        return np.asarray(in_study_units(study.units, coordinate, np.asarray(values)))

    rows: list[list[Floats]] = []
    totals: list[list[float]] = []
    for k, path in enumerate(paths):
        functions, line = path.functions(outputs), np.zeros(ROWS, dtype=np.intp)
        part = np.sin(t / 2) ** 2
        *places, ratio = functions.at(line, functions.curve.inside(line, part))
        for end, side, fold in ((0, -1, functions.curve.pieces.fold[0]), (-1, 1, functions.curve.pieces.fold[-1])):
            there = functions.at_ends(outputs, line[:1], np.array([float(end == -1)]), np.array([side]))
            for (value,), values in zip(there, places, strict=True):
                values[end] = value
            # At a dead centre the point moves and the drive does not.
            ratio[end] = np.inf if fold else ratio[end]
        (arc, error), travel = functions.integral(_SPEED, line, part), path.high - path.low
        arc, error = arc * travel, error * travel
        box = functions.extremes(outputs, np.zeros((2, 1))).value[..., 0]
        rows.append([np.full(ROWS, k), path.low + travel * part, *places, ratio, 1 / ratio, arc])
        totals.append([
            arc[-1], error, *box[0], *(box[1] - box[0]), arc[-1] / travel, ratio.min(), ratio.max(),
        ])  # fmt: skip
    piece, at, x, y, ratio, inverse, arc = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    words = study.units.labels | {
        "drive": drive, "length or angle": label, "as speed_ratio": power, "as length over the drive in radians": power,
        "as one over speed_ratio": f"1/{power}" if power else "",
    }  # fmt: skip
    names = ("length", "length_error", "box_x", "box_y", "box_width", "box_height", "speed_ratio_mean",
             "speed_ratio_min", "speed_ratio_max")  # fmt: skip
    indices = PATH_INDICES.columns(
        words, **{"from": shown([path.low for path in paths])}, to=shown([path.high for path in paths]),
        from_at=[path.ends[0] for path in paths], to_at=[path.ends[1] for path in paths],
        closed=[path.closed for path in paths], **dict(zip(names, np.transpose(totals), strict=True)),
    )  # fmt: skip
    columns = PATH.columns(words, piece=piece.astype(int), **{"<drive>": shown(at)}, x=x, y=y, speed_ratio=ratio,
                           resistivity=inverse, arc=arc)  # fmt: skip
    tables = [PATH_INDICES.table(indices), PATH.table(columns)]
    return Result("workspace", {table.name: table for table in tables}, (), {"paths": len(paths)})


def _of_modes(study: Study, drive: str, outputs: tuple[str, str]) -> list[_Path]:
    """The motions in the sketch's assembly mode, and with ``assembly: any`` in every other that has one."""
    own = _paths(study, drive, outputs)
    if WorkspaceSection.of(study).assembly == "same":
        return own
    others: list[_Path] = []
    for mode in assemblies(study.mechanism, (drive,)):
        if not mode.drawn:
            with suppress(AssemblyError):
                others += _paths(replace(study, mechanism=mode.mechanism), drive, outputs)
    return [*own, *others]


def _paths(study: Study, drive: str, outputs: tuple[str, str]) -> list[_Path]:
    """The motions of an assembly mode: that of the sketch, or of every range in which it can be assembled."""
    mechanism = study.mechanism
    coordinate = mechanism.coordinate(drive)
    drawn = float(mechanism.sketch_configuration.value(coordinate))
    turning = coordinate.quantity == "angle"
    low, high = (drawn - 2 * np.pi, drawn + 2 * np.pi) if turning else _range(study, drive)
    curve = _curve(study, drive, low, high)
    pieces = curve.pieces
    if not len(pieces.line):
        raise AssemblyError(f"no position of drive {drive} can be assembled within the limits")
    ends = Ends(curve).ends
    if not ends and turning:
        return [_Path(study, drive, drawn - np.pi, drawn + np.pi, closed=True)]
    # Stretches of the motion between its ends.
    end = f"end of the range of {drive}"
    causes = {mark.place: f"{mark.cause.kind}: {mark.cause.joint}" for mark in ends}
    breaks = np.flatnonzero(np.append(True, ~pieces.joined_to_next | np.isin(pieces.end[:-1], list(causes))))
    stretches = zip(pieces.begin[breaks], pieces.end[np.append(breaks[1:] - 1, -1)], strict=True)
    paths = [
        _Path(study, drive, low + (high - low) * a, low + (high - low) * b, (causes.get(a, end), causes.get(b, end)))
        for a, b in stretches
        if b - a > SHORTEST
    ]
    if turning:
        # Once round only: each is met twice.
        paths = [p for p in paths if drawn - 2 * np.pi < p.low <= drawn and p.high < drawn + 2 * np.pi]
    own = [p for p in paths if p.low <= drawn <= p.high]
    same_assembly = study.workspace is not None and study.workspace.assembly == "same"
    return own[:1] if own and same_assembly else paths


def _range(study: Study, drive: str) -> tuple[float, float]:
    """The limits of a drive that is no angle."""
    bounds = [b.ends(study.mechanism.nominal) for b in study.mechanism.bounds if b.coordinate.name == drive]
    lows, highs = ([float(end) for ends in bounds if (end := ends[k]) is not None] for k in (0, 1))
    if not lows or not highs:
        message = f"the path of a point needs the range of drive {drive}: give it limits, {{drive: {drive}, min, max}}"
        raise StudyError((Problem(message, "mechanism.limits", str(study.path or "")),))
    return max(lows), min(highs)
