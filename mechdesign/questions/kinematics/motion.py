"""One motion of a mechanism: every pose of its kinematics solved, and the columns that say how it moves.

At a change point that the motion follows, values are interpolated from poses on both sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mechdesign.mechanism import Configuration, Mechanism, Reason
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import STALLED, Linearization, regularity
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.jacobians import Jacobian, mixes
from mechdesign.mechanism.model import play
from mechdesign.mechanism.outputs import Rates, first, second
from mechdesign.mechanism.plates import CLEARANCE, Clearances
from mechdesign.mechanism.statics import balance
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.questions.columns import DRIVE, VALID, power_of_length
from mechdesign.questions.kinematics.columns import MOTION
from mechdesign.questions.kinematics.question import MotionQuestion, characteristic_length
from mechdesign.questions.kinematics.rates import moving_at
from mechdesign.questions.kinematics.targets import Error, errors, totals
from mechdesign.questions.loads import Loading
from mechdesign.questions.poses import SolvedPoses, in_study_units, pose_columns, radians, solve_poses
from mechdesign.results import Column
from mechdesign.study.poses import PoseGroup, Poses

# Below this inverse condition the determinant and the rates solved with it have lost about half of their digits.
SINGULAR = 1e-8
# Poses with a conditioning below this have lost digits.
NEAR_SINGULAR = 1e-3
# Step of the interpolation at change points (radians, or parts of the mechanism's size): its error is about 1e-12, that
# of accelerations this near to a change point about 1e-10.
CHANGE_POINT_STEP = 1e-2
STENCIL = CHANGE_POINT_STEP * np.array([-3, -2, -1, 1, 2, 3])
STENCIL_WEIGHTS = np.array([1, -6, 15, 15, -6, 1]) / 20
# Whether an output stands still as a coupling has it: 1 or 0, by pose.
RESTS = "rests"
# Whether what a cam follows lies beyond its profile: 1 or 0, by pose; followed by the name of the coupling.
OUTSIDE = "outside of cam "
# An output that moves less than this part of its input (lengths in sizes of the mechanism) stands still: at a toggle.
STANDS_STILL = 1e-12


@dataclass
class Motion:
    """The solved poses of one assembly; `arrays` holds every column but those of the poses, nan where it has no value.

    `reason` is that of `mechdesign.mechanism.Reason`, `errors` those of the targets and `sums` their `totals`; `smooth`
    are poses at a change point whose values are those of the motion that goes through it.
    """

    question: MotionQuestion
    arrays: dict[str, Floats] = field(default_factory=dict)
    reason: NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    errors: list[Error] = field(default_factory=list)
    sums: Floats = field(default_factory=lambda: np.zeros(()))
    smooth: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def valid(self) -> Flags:
        """Whether each pose is assembled and within its limits."""
        return np.equal(self.reason, 0)

    def put(self, name: str, rows: Ints, values: object) -> None:
        """Set some rows of a column."""
        if name not in self.arrays:
            self.arrays[name] = np.full(self.question.poses.count, np.nan)
        self.arrays[name][rows] = np.broadcast_to(np.asarray(values, dtype=float), rows.shape)

    def fill(self, solved: SolvedPoses) -> Linearization:
        """Take up poses that give the same coordinates; returns their loop equations."""
        study, rows, configuration = self.question.study, solved.rows, solved.configuration
        self.reason[rows] = configuration.reason
        for coordinate in self.question.watched:
            if coordinate.name in solved.names:
                # As the study gives it, not there and back through radians; also where the pose fails.
                self.put(coordinate.name, rows, self.question.poses.values[coordinate.name][rows])
            else:
                self.put(coordinate.name, rows, in_study_units(study, coordinate, configuration.value(coordinate)))
        if self.question.pairs:
            self._clearances(configuration, rows)
        linear = study.mechanism.linearize(configuration)
        assembled = configuration.valid | np.equal(configuration.reason, int(Reason.LIMIT))
        conditioning = np.where(assembled, regularity(linear), np.nan)
        self.put("conditioning", rows, conditioning)
        regular = conditioning >= STALLED
        section = self.question.section
        moving = moving_at(study, section, self.question.poses, solved, linear)
        if section.rated:
            self._rates(linear, rows, regular, moving)
        if section.instant_centres:
            # Of one drive alone every speed gives the same centres.
            one = len(study.mechanism.drives) == 1
            self._centres(linear, rows, linear.velocity([1.0]) if one else moving.velocity)
        if self.question.square or section.loads or section.mechanical_advantage or self.question.cams:
            self._statics(linear, rows, regular, moving)
        for cam in study.mechanism.cams:
            self.put(f"{OUTSIDE}{cam.coupling}", rows, cam.outside(configuration))
        if self.question.borne is not None:
            borne = self.question.borne.columns(self.question.poses, linear, rows, moving)
            for name, values in borne.items():
                self.put(name, rows, np.where(regular, values, np.nan))
        return linear

    def _clearances(self, configuration: Configuration, rows: Ints) -> None:
        mechanism = self.question.study.mechanism
        assert mechanism.description.plates is not None
        clearances = Clearances(mechanism, mechanism.description.plates, configuration)
        gaps = {name: clearances.of(pair.one, pair.other) for name, pair in self.question.pairs.items()}
        gaps[CLEARANCE] = np.minimum.reduce(np.broadcast_arrays(*gaps.values()))
        for name, gap in gaps.items():
            self.put(name, rows, gap)

    def _centres(self, linear: Linearization, rows: Ints, velocity: Rates | None) -> None:
        assert velocity is not None
        for centre in self.question.centres:
            place, motion, turn = centre.at(self.question.study.mechanism, linear.configuration, velocity)
            regular = np.isfinite(self.arrays["conditioning"][rows]) & (self.arrays["conditioning"][rows] >= STALLED)
            self.put(f"{centre.name}.x", rows, np.where(regular, place.real, np.nan))
            self.put(f"{centre.name}.y", rows, np.where(regular, place.imag, np.nan))
            self.put(f"{centre.name}.motion", rows, np.where(regular, motion, 0))
            self.put(centre.turn, rows, turn)

    def _rates(self, linear: Linearization, rows: Ints, regular: Flags, moving: Moving) -> None:
        velocity, acceleration, configuration = moving.velocity, moving.acceleration, linear.configuration
        assert velocity is not None
        assert acceleration is not None
        for output in self.question.rated.values():
            for order, value in (
                ("velocity", first(configuration, output, velocity)),
                ("acceleration", second(configuration, output, velocity, velocity, acceleration)),
            ):
                value = np.where(regular, in_study_units(self.question.study, output, value), np.nan)
                self.put(f"{output.name}_{order}", rows, value)

    def _statics(self, linear: Linearization, rows: Ints, regular: Flags, moving: Moving) -> None:
        study, listed, drives = self.question.study, self.question.listed, self.question.drives

        def put(name: str, values: Value) -> None:
            self.put(name, rows, np.where(regular, values, np.nan))

        if self.question.square:
            length = characteristic_length(study)
            arc = self.question.poses.of(np.nan if length is None else length, rows) if mixes(listed, drives) else None
            jacobian = Jacobian.of(linear, listed, arc)
            for output, line in zip(listed, jacobian.entries, strict=True):
                for drive, value in zip(drives, line, strict=True):
                    put(entry(output, drive), value)
            put("det_J", jacobian.determinant)
            put("inverse_condition", jacobian.inverse_condition)
            if len(drives) == 1 and study.mechanism.couplings:
                put(RESTS, _rests(linear, listed[0], study.mechanism))
        for name, values in statics(self.question, linear, rows, moving).items():
            put(name, values)

    def complete(self, poses: Poses, rows: Ints) -> None:
        """What is known only when all poses are there: change points, and errors; `rows` are their rows of `poses`."""
        _through_change_points(self)
        self.errors = list(errors(self.question.study, poses, self.arrays, rows))
        self.sums = totals(self.errors, poses.designs, self.valid)

    def columns(self) -> list[Column]:
        """The columns of the motion table, `valid` last."""
        question, arrays, label = self.question, self.arrays, self.question.study.units.label
        rates = question.rates
        shown = {output.name: output for output in question.outputs}
        drives = {drive.name: drive for drive in question.drives}
        columns = [column for column in self.pose_columns() if column.name in drives or column.name not in shown]
        for name, output in question.rated.items():
            if name not in drives:
                columns.append(MOTION["<output>"].column(arrays[name], label(output.quantity), output=name))
            for order in ("velocity", "acceleration"):
                rate = f"{name}_{order}"
                if rate in rates:
                    columns.append(MOTION[f"<output>_{order}"].column(arrays[rate], rates[rate], output=name))
            point, _, axis = name.rpartition(".")
            columns += [self._error(e) for e in self.errors if e.output == name or (axis == "y" and e.output == point)]
        rows = ", ".join(output.name for output in question.listed)
        lengths = [sum(c.quantity == "length" for c in side) for side in (question.listed, question.drives)]
        area = power_of_length(question.study.units, lengths[0] - lengths[1])
        words = {"outputs": rows, "as its outputs over the drives, multiplied": area}
        names = ("det_J", "inverse_condition", "conditioning")
        columns += MOTION.columns(words, **{name: arrays[name] for name in names if name in arrays})
        columns += [MOTION[s.kind].column(arrays[s.name], s.unit, **s.words) for s in question.statics]
        gap = MOTION["<a>.<b>.clearance"]
        columns += [gap.column(arrays[name], label("length"), a=pair.one.name, b=pair.other.name)
                    for name, pair in question.pairs.items()]  # fmt: skip
        columns += (
            MOTION.columns(question.study.units.labels, **{CLEARANCE: arrays[CLEARANCE]}) if question.pairs else []
        )
        return [*columns, VALID.column(self.valid)]

    def pose_columns(self) -> list[Column]:
        """The drives, and the coordinates that the study gives."""
        question, units = self.question, self.question.study.units
        columns = [
            replace(column, values=self.arrays.get(column.name, column.values))
            for column in pose_columns(question.study, question.poses)
        ]
        drives = [DRIVE.column(self.arrays[c.name], units.label(c.quantity), drive=c.name) for c in question.drives]
        named = {column.name for column in drives}
        timed = columns[:1] if question.poses.times is not None else []
        return [*timed, *drives, *(column for column in columns[len(timed) :] if column.name not in named)]

    def _error(self, error: Error) -> Column:
        study = self.question.study
        far = error.output in study.mechanism.points
        kind = MOTION["<point>_error" if far else "<output>_error"]
        words = {"point": error.output, "output": error.output}
        return kind.column(error.values, study.units.label(error.quantity), **words)


def statics(question: MotionQuestion, linear: Linearization, rows: Ints, moving: Moving) -> dict[str, Value]:
    """Efforts of the drives that balance the loads, mechanical advantages, and what cams have, by their columns.

    `rows` are the poses of `linear`.
    """
    section = question.poses.section(question.section, rows)
    columns: dict[str, Value] = {}
    if section.loads:
        forces = Forces(linear.configuration)
        Loading(question.study, section.loads, question.poses, rows).add(forces, moving)
        if question.friction is None:
            efforts = balance(linear, forces).efforts
        else:
            slipping = question.friction.solve(linear, forces, moving.velocity)
            efforts, columns = slipping.efforts, dict(slipping.columns)
        columns |= {f"{drive.name}_effort": effort for drive, effort in zip(question.drives, efforts, strict=True)}
    for name, input_name in section.mechanical_advantage.items():
        columns[f"{name}_advantage"] = _advantage(question, linear, name, input_name)
    for cam in question.cams:
        touch = cam.touch(linear.configuration)
        columns[f"{cam.coupling}_pressure_angle"] = touch.pressure_angle / question.study.units.angle_factor
        columns[f"{cam.coupling}_curvature_radius"] = touch.radius
    return columns


@quiet
def _rests(linear: Linearization, output: Coordinate, mechanism: Mechanism) -> Value:
    """Where a coupling holds its follower at rest while what it follows moves, so that an output rests with it."""
    configuration, (velocity,), (drive,) = linear.configuration, linear.by_drives, linear.structure.given
    size = {"length": mechanism.size}

    def moves(coordinate: Coordinate, rates: Rates, unit: float) -> Flags:
        rate = np.abs(first(configuration, coordinate, rates)) * unit / size.get(coordinate.quantity, 1.0)
        return np.asarray(rate >= SINGULAR)

    rests = np.zeros(configuration.shape, dtype=bool)
    for coupling in mechanism.couplings:
        parted = linear.sensitivity([play(coupling.name)])
        unit = size.get(drive.quantity, 1.0)
        followed = [moves(part, velocity, unit) for part in coupling.function.parts if part.kind != "parameter"]
        held = ~moves(coupling.follower, velocity, unit) & np.any(np.broadcast_arrays(*followed, False), axis=0)
        pushed = moves(output, parted, size.get(coupling.follower.quantity, 1.0))
        rests |= held & np.atleast_1d(pushed)[0]
    return rests


def pole(motion: Motion, linear: Linearization, column: str) -> Value:
    """What is zero where a column of `MotionQuestion.poled` goes to infinity: a rate, or the curvature of a cam."""
    question = motion.question
    name, advantages = column.removesuffix("_advantage"), question.section.mechanical_advantage
    if name in advantages:
        return _rates_of_advantage(question, linear, name, advantages[name])[0]
    if (centre := next((c for c in question.centres if column in c.columns), None)) is not None:
        return motion.arrays[centre.turn]
    cam = next(cam for cam in question.cams if column == f"{cam.coupling}_curvature_radius")
    return cam.touch(linear.configuration).pitch


@quiet
def _rates_of_advantage(
    question: MotionQuestion, linear: Linearization, output: str, input_name: str
) -> tuple[Value, Value]:
    """Rates of an output and of the input of its mechanical advantage, by a drive that moves the input."""
    mechanism, drives = question.study.mechanism, [drive.name for drive in question.drives]
    rows = Jacobian.of(linear, [mechanism.coordinate(name) for name in (output, input_name)]).entries
    k = drives.index(input_name) if input_name in drives else 0
    return rows[0][k], rows[1][k]


@quiet
def _advantage(question: MotionQuestion, linear: Linearization, output: str, input_name: str) -> Value:
    """Force of an output over that at its input: by virtual work the input's rate over the output's."""
    mechanism = question.study.mechanism
    given_out, put_in = _rates_of_advantage(question, linear, output, input_name)
    sizes = [mechanism.size if mechanism.quantity(name) == "length" else 1.0 for name in (output, input_name)]
    still = np.abs(given_out) / sizes[0] <= STANDS_STILL * np.maximum(np.abs(put_in) / sizes[1], STANDS_STILL)
    return np.where(still & (put_in != 0), np.inf, put_in / given_out)


def entry(output: Coordinate, drive: Coordinate) -> str:
    """Name of an entry of the Jacobian: ``C.x_by_theta``."""
    return f"{output.name}_by_{drive.name}"


def move(
    question: MotionQuestion,
    progress: Progress = NULL,
    jobs: int | None = 1,
    *,
    also: Callable[[SolvedPoses], object] | None = None,
) -> Motion:
    """Solve every pose; one that fails is nan, with its reason. `also` is called with the solved poses of each chunk.

    Raises
    ------
    MechanismError
        If a pose's coordinates do not determine the mechanism.
    """
    study, poses = question.study, question.poses
    motion = Motion(question, reason=np.zeros(poses.count, dtype=np.int8))
    for solved in solve_poses(study, poses, question.watched, jobs, question.curve):
        motion.fill(solved)
        if also is not None:
            also(solved)
        progress.update(len(solved.rows))
    motion.complete(poses, np.arange(poses.count))
    return motion


def pieces(question: MotionQuestion, jobs: int | None = 1) -> Iterator[tuple[SolvedPoses, Motion]]:
    """The motion of poses of one kind in pieces, with their solved poses; what is held is a few pieces."""
    study, poses = question.study, question.poses
    for solved in solve_poses(study, poses, question.watched, jobs, question.curve):
        rows = solved.rows
        some = poses.take(slice(int(rows[0]), int(rows[-1]) + 1))
        motion = Motion(replace(question, poses=some), reason=np.zeros(len(rows), dtype=np.int8))
        motion.fill(replace(solved, rows=np.arange(len(rows))))
        motion.complete(poses, rows)
        yield solved, motion


def _through_change_points(motion: Motion) -> None:
    """Set the columns of a motion at its change points, where the study follows them; note which in `smooth`.

    Where two assemblies meet, the equations of the velocities have no one solution, and those of the positions half of
    the digits; but the motion that is followed is smooth there. With S_k = f(k h) + f(-k h) from both sides

        f(0) = (15 S_1 - 6 S_2 + S_3) / 20  + O(h^6).
    """
    question = motion.question
    study, group = question.study, question.poses.groups[0]
    plan = study.mechanism.plan(group.names)
    motion.smooth = np.zeros(question.poses.count, dtype=bool)
    if plan.change_points is None or len(question.poses.groups) > 1:
        return
    rows = np.flatnonzero(motion.valid & (motion.arrays["conditioning"] < NEAR_SINGULAR))
    if not len(rows):
        return
    (name,) = group.names
    coordinate = plan.structure.given[0]
    scale = 1.0 if coordinate.quantity == "angle" else study.mechanism.size
    steps = in_study_units(study, coordinate, scale * STENCIL)
    values = (group.values[name][rows][:, None] + steps).ravel()
    slopes, bends = (
        {key: np.repeat(column[rows], len(STENCIL)) for key, column in part.items()}
        for part in (question.poses.slopes, question.poses.bends)
    )
    beside = Poses(
        (PoseGroup((name,), {name: values}, np.arange(len(values))),), len(values), True, (len(values),), slopes=slopes,
        bends=bends,
    )  # fmt: skip
    around = Motion(replace(question, poses=beside), reason=np.zeros(len(values), dtype=np.int8))
    row_of_lane = np.repeat(rows, len(STENCIL))
    for solved in solve_poses(study, beside):
        near = {angle: radians(study, c, motion.arrays[angle][row_of_lane[solved.rows]])
                for angle, c in angles_of(question.watched).items() if angle != name}  # fmt: skip
        configuration = replace(solved.configuration, near={**solved.configuration.near, **near})
        around.fill(replace(solved, configuration=configuration))
    good = around.valid.reshape(-1, len(STENCIL)).all(axis=1)
    for column, array in motion.arrays.items():
        if column in (name, "conditioning"):
            continue
        table = around.arrays[column].reshape(-1, len(STENCIL))
        array[rows[good]] = (table @ STENCIL_WEIGHTS)[good]
    motion.smooth[rows[good]] = True
