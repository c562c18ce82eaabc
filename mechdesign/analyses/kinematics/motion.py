"""One motion of a mechanism: every pose of its kinematics solved, and the columns that say how it moves.

At a change point that the motion follows, values are interpolated from poses on both sides.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.columns import DRIVE, VALID, power_of_length
from mechdesign.analyses.kinematics.columns import MOTION
from mechdesign.analyses.kinematics.instant_centres import Centre
from mechdesign.analyses.kinematics.rates import drive_rates, of_given
from mechdesign.analyses.kinematics.targets import Error, errors, needed
from mechdesign.analyses.poses import (
    SolvedPoses,
    expand_outputs,
    followed_angles,
    in_study_units,
    pose_columns,
    radians,
    solve_poses,
    study_poses,
)
from mechdesign.curve.motion import Curve
from mechdesign.errors import counted
from mechdesign.mechanism import Mechanism, Reason
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.coordinates import Coordinate, angles_of
from mechdesign.mechanism.derivatives import STALLED, Jacobian, Linearization, mixes, regularity
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.model import Quantity
from mechdesign.mechanism.outputs import Rates, first, second
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column
from mechdesign.study import Study
from mechdesign.study.poses import PoseGroup, Poses
from mechdesign.study.schema.checker import ORDERS
from mechdesign.study.schema.poses import KinematicsSection

# Poses with a conditioning below this have lost digits.
NEAR_SINGULAR = 1e-3
# Step of the interpolation at change points (radians, or parts of the mechanism's size): its error is about 1e-12, that
# of accelerations this near to a change point about 1e-10.
CHANGE_POINT_STEP = 1e-2
STENCIL = CHANGE_POINT_STEP * np.array([-3, -2, -1, 1, 2, 3])
STENCIL_WEIGHTS = np.array([1, -6, 15, 15, -6, 1]) / 20
# An output that moves less than this part of its input (lengths in sizes of the mechanism) stands still: at a toggle.
STANDS_STILL = 1e-12


def default_outputs(mechanism: Mechanism) -> tuple[str, ...]:
    """Every moving point, link and slide."""
    graph = mechanism.graph
    still = {point for body, point in graph.points if body == GROUND}
    points = [point for point in mechanism.points if point not in still]
    moving = [name for name in mechanism.description.links if name != GROUND and graph.bodies[name][0] != 0]
    slides = [f"{name}.{'length' if k in graph.telescopic else 'slide'}" for k, name in enumerate(graph.slides)]
    return (*points, *(f"{link}.angle" for link in moving), *slides)


def characteristic_length(study: Study) -> float | None:
    """Length that turns angles into lengths, from the section of kinematics or workspace."""
    for section in (study.kinematics, study.workspace):
        if section is not None and section.characteristic_length is not None:
            return section.characteristic_length
    return None


@dataclass(frozen=True)
class Static:
    """A drive's effort or a mechanical advantage: the name of its column, its unit, and how it is declared."""

    name: str
    unit: str
    kind: str
    words: Mapping[str, str]  # at the places of the kind


@dataclass(frozen=True, eq=False)
class MotionQuestion:
    """What a study asks of every pose.

    Parameters
    ----------
    outputs : list of Coordinate
        Outputs in the tables: those that the study names, then others that have a target.
    listed : list of Coordinate
        Rows of the Jacobian, which is wanted where it is `square`: where the study names as many of them (or of the
        outputs) as drives.
    watched : list of Coordinate
        All coordinates whose values are needed: drives, outputs, those that targets depend on, and the angles in
        expressions of these and of limits.
    of_given : bool
        Whether rates and accelerations are those of the given coordinates rather than of the drives.
    """

    study: Study
    section: KinematicsSection
    poses: Poses
    outputs: list[Coordinate]
    listed: list[Coordinate]
    square: bool
    watched: list[Coordinate]
    of_given: bool

    @property
    def drives(self) -> list[Coordinate]:
        """The mechanism's drives."""
        return [self.study.mechanism.coordinate(name) for name in self.study.mechanism.drives]

    @property
    def centres(self) -> list[Centre]:
        """Pairs of links whose instant centres are asked."""
        return [Centre(*pair) for pair in self.section.instant_centres]

    @property
    def statics(self) -> list[Static]:
        """Efforts of the drives, where there are loads, and mechanical advantages."""
        label, found = self.study.units.label, []
        for drive in self.drives if self.section.loads else ():
            unit = label("moment" if drive.quantity == "angle" else "force")
            found.append(Static(f"{drive.name}_effort", unit, "<drive>_effort", {"drive": drive.name}))
        for name, given in self.section.mechanical_advantage.items():
            units = {"length": label("length"), "angle": ""}
            above, below = (units[self.study.mechanism.quantity(each)] for each in (given, name))
            unit = "" if above == below else above or f"1/{below}"
            words = {"output": name, "input": given}
            found.append(Static(f"{name}_advantage", unit, "<output>_advantage", words))
        return found

    @property
    def orders(self) -> dict[str, tuple[Quantity, int]]:
        """Columns of velocities and accelerations, where the study gives rates: of what quantity, and which order."""
        asked = self.section.rates or self.section.accelerations or self.section.speed
        moving = {output.name: output for output in [*(self.drives if self.of_given else []), *self.outputs]}
        return {
            f"{output.name}_{word}": (output.quantity, order)
            for output in (moving.values() if asked else ())
            for order, word in ((1, "velocity"), (2, "acceleration"))
        }

    @property
    def rates(self) -> dict[str, str]:
        """Units of the columns of velocities and accelerations."""
        label = self.study.units.label
        return {
            name: label(ORDERS[quantity][order]) if quantity in ORDERS else ""
            for name, (quantity, order) in self.orders.items()
        }

    @property
    def tempo(self) -> float:
        """About how fast the mechanism moves: radians, or sizes of it, in a unit of time."""
        section, mechanism, size = self.section, self.study.mechanism, self.study.mechanism.size or 1.0
        units = {"angle": self.study.units.angle_factor, "length": 1 / size}
        found = [(section.speed or 0.0) / size]
        for rates, order in ((section.rates, 1), (section.accelerations, 2)):
            found += [
                abs(rate * units.get(mechanism.quantity(name), 1.0)) ** (1 / order) for name, rate in rates.items()
            ]
        return max(found)

    @cached_property
    def curve(self) -> Curve | None:
        """The motion that the poses are, with its angles; None of listed poses and grids."""
        if not self.poses.followed:
            return None
        mechanism = self.study.mechanism
        plan = mechanism.plan(self.poses.groups[0].names)
        return Curve(self.study, self.poses, followed_angles(mechanism, plan, self.watched))

    def lean(self, names: Collection[str]) -> MotionQuestion:
        """The question with nothing but what some columns, and the targets of errors among them, need."""
        section, unasked = self.section, dict[str, object]()
        centres = [
            pair for pair in section.instant_centres if any(name.startswith(Centre(*pair).name) for name in names)
        ]
        rates = bool(centres) or any(name.endswith(("_velocity", "_acceleration")) for name in names)
        if not rates:
            unasked |= {"rates": {}, "accelerations": {}, "speed": None}
        if not any(static.name in names for static in self.statics):
            unasked |= {"loads": (), "mechanical_advantage": {}}
        square = self.square and any(name in ("det_J", "inverse_condition") or "_by_" in name for name in names)
        errors = any(name.endswith("_error") for name in names)
        values = {*names, *(needed(self.study, self.poses) if errors else ())}
        return replace(
            self, section=section.model_copy(update={**unasked, "instant_centres": tuple(centres)}), square=square,
            watched=[coordinate for coordinate in self.watched if coordinate.name in values],
            of_given=self.of_given and rates,
        )  # fmt: skip

    @property
    def mixed(self) -> bool:
        """Whether the Jacobian mixes lengths and angles, and the study gives no length that makes them comparable."""
        return self.square and mixes(self.listed, self.drives) and characteristic_length(self.study) is None

    @property
    def absent(self) -> Mapping[str, str]:
        """Columns and tables of the Jacobian that have no values: why, and what to write for them."""
        if self.square:
            words = "J mixes lengths and angles; give kinematics.characteristic_length"
            return {"inverse_condition": words} if self.mixed else {}
        study, drives = self.study, self.study.mechanism.drives
        # One point, then angles; of outputs that are left out the last, as the end of a chain.
        named, others = self.section.outputs or (), default_outputs(study.mechanism)[::-1]
        known = {c.name: c for c in expand_outputs(study, (*named, *others)) if c.name not in drives}
        node = next((c.node for c in known.values() if c.kind in ("x", "y")), -1)
        picked = sorted(known, key=lambda name: (known[name].node != node, known[name].kind != "angle"))[: len(drives)]
        points = {name[:-2] for name in picked if name.endswith(".x") and f"{name[:-2]}.y" in picked}
        rows = dict.fromkeys(name[:-2] if name[:-2] in points else name for name in picked)
        given = f"{counted(len(self.listed), 'output')} ({', '.join(c.name for c in self.listed)})"
        words = f"{given} for {counted(len(drives), 'drive')}; name as many"
        if not named:
            words = f"no outputs are named; name as many as there are drives, {len(drives)},"
        words += f" by kinematics.jacobian: [{', '.join(rows)}]"
        return dict.fromkeys(("det_J", "inverse_condition", "jacobian"), words)


def motion_question(study: Study, poses: Poses | None = None) -> MotionQuestion:
    """Read a study's questions about its motion, at its own poses or at some others.

    Raises
    ------
    MechanismError
        If an output does not exist.
    StudyError
        If no poses are given and none can be assumed.
    """
    section = study.kinematics or KinematicsSection()
    mechanism, poses = study.mechanism, study_poses(study, "kinematics") if poses is None else poses
    outputs = expand_outputs(study, section.outputs or default_outputs(mechanism))
    listed = outputs if section.jacobian is None else expand_outputs(study, section.jacobian)
    shown = {output.name: output for output in outputs}
    for target in study.targets.values():
        shown |= {name: mechanism.coordinate(name) for name in target.coordinates if name not in shown}
    names = dict.fromkeys([*mechanism.drives, *shown, *needed(study, poses)])
    watched = {name: mechanism.coordinate(name) for name in names}
    return MotionQuestion(
        study,
        section,
        poses,
        list(shown.values()),
        listed,
        (section.outputs or section.jacobian) is not None and len(listed) == len(mechanism.drives),
        list((watched | angles_of([*watched.values(), *mechanism.counting])).values()),
        of_given(study, section),
    )


@dataclass
class Motion:
    """The solved poses of one assembly; `arrays` holds every column but those of the poses, nan where it has no value.

    `reason` is that of `mechdesign.mechanism.Reason`, `errors` those of the targets; `smooth` are poses at a change
    point whose values are those of the motion that goes through it.
    """

    question: MotionQuestion
    arrays: dict[str, Floats] = field(default_factory=dict)
    reason: NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    errors: list[Error] = field(default_factory=list)
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
        given = self.question.poses.values
        self.reason[rows] = configuration.reason
        for coordinate in self.question.watched:
            if coordinate.name in solved.given:
                # As the study gives it, not there and back through radians; also where the pose fails.
                self.put(coordinate.name, rows, given[coordinate.name][rows])
            else:
                self.put(coordinate.name, rows, in_study_units(study, coordinate, configuration.value(coordinate)))
        linear = study.mechanism.linearize(configuration)
        assembled = configuration.valid | np.equal(configuration.reason, int(Reason.LIMIT))
        conditioning = np.where(assembled, regularity(linear), np.nan)
        self.put("conditioning", rows, conditioning)
        regular = conditioning >= STALLED
        section = self.question.section
        velocity = None
        if section.rates or section.accelerations or section.speed:
            velocity = self._rates(linear, solved, regular)
        if section.instant_centres:
            # Of one drive alone every speed gives the same centres.
            self._centres(linear, rows, linear.velocity([1.0]) if len(study.mechanism.drives) == 1 else velocity)
        if self.question.square or section.loads or section.mechanical_advantage:
            self._statics(linear, rows, regular)
        return linear

    def _centres(self, linear: Linearization, rows: Ints, velocity: Rates | None) -> None:
        assert velocity is not None
        for centre in self.question.centres:
            place, motion = centre.at(self.question.study.mechanism, linear.configuration, velocity)
            known = np.isfinite(self.arrays["conditioning"][rows]) & (self.arrays["conditioning"][rows] >= STALLED)
            self.put(f"{centre.name}.x", rows, np.where(known, place.real, np.nan))
            self.put(f"{centre.name}.y", rows, np.where(known, place.imag, np.nan))
            self.put(f"{centre.name}.motion", rows, np.where(known, motion, 0))

    def _rates(self, linear: Linearization, solved: SolvedPoses, regular: Flags) -> Rates:
        drives = drive_rates(self.question.study, self.question.section, self.question.poses, solved, linear)
        velocity = linear.velocity(drives.velocities)
        acceleration = linear.acceleration(velocity, drives.accelerations)
        configuration = linear.configuration
        found = {o.name: o for o in [*(self.question.drives if self.question.of_given else []), *self.question.outputs]}
        for output in found.values():
            for order, value in (
                ("velocity", first(configuration, output, velocity)),
                ("acceleration", second(configuration, output, velocity, velocity, acceleration)),
            ):
                value = np.where(regular, in_study_units(self.question.study, output, value), np.nan)
                self.put(f"{output.name}_{order}", solved.rows, value)
        return velocity

    def _statics(self, linear: Linearization, rows: Ints, regular: Flags) -> None:
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
        for name, values in statics(self.question, linear, rows).items():
            put(name, values)

    def complete(self, poses: Poses, rows: Ints) -> None:
        """What is known only when all poses are there: change points, and errors; `rows` are their rows of `poses`."""
        _through_change_points(self)
        self.errors = list(errors(self.question.study, poses, self.arrays, rows))

    def columns(self) -> list[Column]:
        """The columns of the motion table, `valid` last."""
        question, arrays, label = self.question, self.arrays, self.question.study.units.label
        rates = question.rates
        shown = {output.name: output for output in question.outputs}
        drives = {drive.name: drive for drive in question.drives}
        columns = [column for column in self.pose_columns() if column.name in drives or column.name not in shown]
        for name, output in ((drives if question.of_given else {}) | shown).items():
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
        return [*columns, VALID.column(self.valid)]

    def pose_columns(self) -> list[Column]:
        """The drives, and the coordinates that the study gives."""
        question, units = self.question, self.question.study.units
        columns = [DRIVE.column(self.arrays[c.name], units.label(c.quantity), drive=c.name) for c in question.drives]
        named = {column.name for column in columns}
        for column in pose_columns(question.study, question.poses):
            if column.name not in named:
                columns.append(replace(column, values=self.arrays.get(column.name, column.values)))
        return columns

    def _error(self, error: Error) -> Column:
        study = self.question.study
        far = error.output in study.mechanism.points
        kind = MOTION["<point>_error" if far else "<output>_error"]
        words = {"point": error.output, "output": error.output}
        return kind.column(error.values, study.units.label(error.quantity), **words)


def statics(question: MotionQuestion, linear: Linearization, rows: Ints) -> dict[str, Value]:
    """Efforts of the drives by virtual work, and mechanical advantages, by their columns; unknown where it stalls.

    `rows` are the poses of `linear`.
    """
    mechanism, drives = question.study.mechanism, question.drives
    section = question.poses.section(question.section, rows)
    work: dict[str, Value] = {}
    for load in section.loads:
        if load.at is not None and load.force is not None:
            for axis, force in zip("xy", load.force, strict=True):
                work[f"{load.at}.{axis}"] = work.get(f"{load.at}.{axis}", 0.0) + force
        if load.link is not None and load.moment is not None:
            work[f"{load.link}.angle"] = work.get(f"{load.link}.angle", 0.0) + load.moment
    found: dict[str, Value] = {}
    if work:
        moved = Jacobian.of(linear, [mechanism.coordinate(name) for name in work]).entries
        for k, drive in enumerate(drives):
            found[f"{drive.name}_effort"] = -sum(f * line[k] for f, line in zip(work.values(), moved, strict=True))
    for name, given in section.mechanical_advantage.items():
        found[f"{name}_advantage"] = _advantage(question, linear, name, given)
    return found


@quiet
def rates_of_advantage(question: MotionQuestion, linear: Linearization, output: str, given: str) -> tuple[Value, Value]:
    """Rates of an output and of the input of its mechanical advantage, by a drive that moves the input."""
    mechanism, drives = question.study.mechanism, [drive.name for drive in question.drives]
    rows = Jacobian.of(linear, [mechanism.coordinate(name) for name in (output, given)]).entries
    k = drives.index(given) if given in drives else 0
    return rows[0][k], rows[1][k]


@quiet
def _advantage(question: MotionQuestion, linear: Linearization, output: str, given: str) -> Value:
    """Force of an output over that at its input: by virtual work the input's rate over the output's."""
    mechanism = question.study.mechanism
    given_out, put_in = rates_of_advantage(question, linear, output, given)
    sizes = [mechanism.size if mechanism.quantity(name) == "length" else 1.0 for name in (output, given)]
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
    beside = Poses((PoseGroup((name,), {name: values}, np.arange(len(values))),), len(values), True, (len(values),))
    around = Motion(replace(question, poses=beside), reason=np.zeros(len(values), dtype=np.int8))
    each = np.repeat(rows, len(STENCIL))
    for solved in solve_poses(study, beside):
        near = {angle: radians(study, c, motion.arrays[angle][each[solved.rows]])
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
