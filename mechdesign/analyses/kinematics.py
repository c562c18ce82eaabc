"""How does it move? Positions, velocities, accelerations, Jacobians, drive efforts, extremes and limits of motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mechdesign.analyses.extremes import extremes
from mechdesign.analyses.jacobians import determinant, homogeneous, inverse_condition, mixes
from mechdesign.analyses.motion_limits import change_points, limits_of_motion
from mechdesign.analyses.poses import (
    SolvedPoses,
    expand_outputs,
    in_study_units,
    judge_failures,
    pose_columns,
    pose_in_words,
    radians,
    solve_poses,
)
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization, regularity
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.outputs import first, second
from mechdesign.progress import NULL, Progress
from mechdesign.results import Column, Result, Table
from mechdesign.study import Poses, Study
from mechdesign.study.sections import KinematicsSection

# Below this inverse condition the determinant and what is solved with it have lost about half of their digits.
SINGULAR = 1e-8
# At a dead centre the angle between links is known to the root of rounding only; below this sine it is at one.
STALLED = 1e-6

Array = NDArray[np.float64]


def default_outputs(mechanism: Mechanism) -> tuple[str, ...]:
    """Every moving point, link and slide."""
    graph = mechanism.graph
    still = {point for body, point in graph.points if body == GROUND}
    points = [point for point in mechanism.points if point not in still]
    moving = [name for name in mechanism.description.links if name != GROUND and graph.bodies[name][0] != 0]
    slides = [f"{name}.{'length' if k in graph.telescopic else 'slide'}" for k, name in enumerate(graph.slides)]
    return (*points, *(f"{link}.angle" for link in moving), *slides)


@dataclass
class _Motion:
    """Columns of the motion table, filled group by group."""

    study: Study
    section: KinematicsSection
    outputs: list[Coordinate]
    square: bool
    poses: Poses
    arrays: dict[str, Array] = field(default_factory=dict)

    def put(self, name: str, rows: NDArray[np.intp], values: object) -> None:
        if name not in self.arrays:
            self.arrays[name] = np.full(self.poses.count, np.nan)
        self.arrays[name][rows] = np.broadcast_to(np.asarray(values, dtype=float), rows.shape)

    def fill(self, solved: SolvedPoses) -> None:
        study, mechanism, rows = self.study, self.study.mechanism, solved.rows
        configuration = solved.configuration
        lost = ~np.isfinite(np.real(configuration.nodes[-1] + 0 * configuration.reason))
        linear = mechanism.linearize(configuration)
        for name, value in zip(mechanism.drives, solved.drives, strict=True):
            coordinate = mechanism.coordinate(name)
            self.put(f"drive {name}", rows, np.where(lost, np.nan, in_study_units(study, coordinate, value)))
            if name in solved.given:
                # As the study gives it, not there and back through radians; also where the pose fails.
                self.put(f"drive {name}", rows, self.poses.values[name][rows])
        for output in self.outputs:
            value = in_study_units(study, output, configuration.value(output))
            if output.name in solved.given:
                # A pose that fails still says where it was asked for.
                value = np.where(lost, self.poses.values[output.name][rows], value)
            self.put(output.name, rows, value)
        if self.section.rates or self.section.accelerations:
            self._rates(linear, rows)
        self.put("regularity", rows, regularity(linear))
        if self.square or self.section.loads:
            self._statics(linear, rows)

    def _rates(self, linear: Linearization, rows: NDArray[np.intp]) -> None:
        study, mechanism = self.study, self.study.mechanism
        rates, accelerations = (
            [radians(study, mechanism.coordinate(name), given.get(name, 0.0)) for name in mechanism.drives]
            for given in (self.section.rates, self.section.accelerations)
        )
        velocity = linear.velocity(rates)
        acceleration = linear.acceleration(velocity, accelerations)
        configuration = linear.configuration
        for output in self.outputs:
            speed = first(configuration, output, velocity)
            bend = second(configuration, output, velocity, acceleration)
            self.put(f"{output.name}_velocity", rows, in_study_units(study, output, speed))
            self.put(f"{output.name}_acceleration", rows, in_study_units(study, output, bend))

    def _statics(self, linear: Linearization, rows: NDArray[np.intp]) -> None:
        mechanism, configuration = self.study.mechanism, linear.configuration
        rates = linear.drives()
        full = (len(mechanism.drives), *configuration.shape)
        if self.square:
            jacobian = np.stack([np.broadcast_to(first(configuration, c, rates), full) for c in self.outputs])
            jacobian = np.moveaxis(jacobian, (0, 1), (-2, -1))
            self.put("det_J", rows, determinant(jacobian))
            drives = [mechanism.coordinate(name) for name in mechanism.drives]
            if mixes(self.outputs, drives):
                length = characteristic_length(self.study)
                jacobian = homogeneous(jacobian, self.outputs, drives, np.nan if length is None else length)
            self.put("inverse_condition", rows, inverse_condition(jacobian))
        if self.section.loads:
            work = np.zeros(full)
            for load in self.section.loads:
                if load.at is not None and load.force is not None:
                    for axis, force in zip("xy", load.force, strict=True):
                        work = work + force * first(configuration, mechanism.coordinate(f"{load.at}.{axis}"), rates)
                if load.link is not None and load.moment is not None:
                    work = work + load.moment * first(configuration, mechanism.coordinate(f"{load.link}.angle"), rates)
            for name, effort in zip(mechanism.drives, work, strict=True):
                self.put(f"{name}_effort", rows, -effort)


def characteristic_length(study: Study) -> float | None:
    """Length that turns angles into lengths, from the section of kinematics or workspace."""
    for section in (study.kinematics, study.workspace):
        if section is not None and section.characteristic_length is not None:
            return section.characteristic_length
    return None


def kinematics(study: Study, *, seed: int | None = None, jobs: int | None = 1, progress: Progress = NULL) -> Result:
    """Solve every pose of the study's kinematics.

    Parameters
    ----------
    study : Study
    seed, jobs : ignored
        Kinematics draws no random numbers and is fast enough on one thread.

    Returns
    -------
    Result
        Tables ``motion``, ``extremes`` and, for a sweep of one coordinate, ``limits``.

    Raises
    ------
    AssemblyError
        If no pose at all can be assembled.
    MechanismError
        If a pose's coordinates do not determine the mechanism, or an output does not exist.
    """
    section = study.kinematics or KinematicsSection()
    mechanism = study.mechanism
    poses = study.poses("kinematics")
    outputs = expand_outputs(study, section.outputs or default_outputs(mechanism))
    square = section.outputs is not None and len(outputs) == len(mechanism.drives)
    motion = _Motion(study, section, outputs, square, poses)
    progress.start(poses.count, "poses")
    reason = np.zeros(poses.count, dtype=np.int8)
    for solved in solve_poses(study, poses):
        reason[solved.rows] = solved.configuration.reason
        motion.fill(solved)
        progress.update(len(solved.rows))
    warnings, failed = judge_failures(study, poses, reason)
    arrays = motion.arrays
    if not poses.listed:
        for output in outputs:
            if output.quantity == "angle":
                arrays[output.name] = continuous(arrays[output.name], study, poses.grid)
        for name in mechanism.drives:
            if mechanism.quantity(name) == "angle" and name not in poses.names:
                arrays[f"drive {name}"] = continuous(arrays[f"drive {name}"], study, poses.grid)
    warnings += _conditioning(study, motion, reason) + _stalled(motion, reason)
    columns = _columns(motion, outputs)
    columns.append(Column("valid", reason == 0, meaning="1 where the pose is assembled and within its limits"))
    tables = {"motion": Table("motion", tuple(columns), "positions, velocities and accelerations per pose")}
    by_name = {column.name: column for column in columns}
    named = [by_name[output.name] for output in outputs]
    moving = [name for name in poses.names if np.ptp(poses.values[name]) > 0]
    swept = moving[0] if not poses.listed and len(moving) == 1 else None
    tables["extremes"] = extremes(study, named, poses, swept, reason)
    if swept is not None:
        tables["limits"] = limits_of_motion(study, poses.groups[0], swept, reason)
        warnings += change_points(study, poses.groups[0], swept, reason)
    counts = {"poses": poses.count, "invalid": int(np.count_nonzero(reason))}
    return Result("kinematics", tables, warnings, counts, failed)


def continuous(angles: Array, study: Study, grid: Sequence[int]) -> Array:
    """Angles without jumps along a grid of poses, the last axis first; nan are stepped over."""
    turn = 2 * np.pi / study.units.angle_factor
    table = angles.reshape(grid).copy()
    for line in table.reshape(-1, grid[-1]):
        known = np.flatnonzero(np.isfinite(line))
        line[known] = np.unwrap(line[known], period=turn)
    for axis in range(len(grid) - 2, -1, -1):
        for stack in table.reshape(-1, grid[axis], math.prod(grid[axis + 1 :])):
            for before, block in pairwise(stack):
                jump = (block - before)[np.isfinite(block - before)][:1]
                block -= turn * np.round(jump / turn).sum()
    return table.reshape(-1)


def _conditioning(study: Study, motion: _Motion, reason: NDArray[np.int8]) -> list[str]:
    if "inverse_condition" not in motion.arrays:
        return []
    values = motion.arrays["inverse_condition"]
    good = reason == 0
    if good.any() and np.isnan(values[good]).all() and characteristic_length(study) is None:
        return ["J mixes lengths and angles: inverse_condition is nan; give kinematics.characteristic_length"]
    near = good & ~(values >= SINGULAR)
    if near.any():
        count = np.count_nonzero(near)
        poses = "1 pose is" if count == 1 else f"{count} poses are"
        return [f"{poses} at or near a singularity (inverse condition below {SINGULAR:g})"]
    return []


def _stalled(motion: _Motion, reason: NDArray[np.int8]) -> list[str]:
    rows = np.flatnonzero((reason == 0) & ~(motion.arrays["regularity"] >= STALLED))
    if not len(rows):
        return []
    poses = f"{len(rows)} poses lie" if len(rows) > 1 else "1 pose lies"
    return [
        f"{poses} at a dead centre or change point, where the drives do not move the mechanism in one way: velocities, "
        f"accelerations and efforts mean nothing there; the first: {pose_in_words(motion.study, motion.poses, rows[0])}"
    ]


def _columns(motion: _Motion, outputs: list[Coordinate]) -> list[Column]:
    study, mechanism, arrays = motion.study, motion.study.mechanism, motion.arrays
    units = study.units
    columns: list[Column] = []
    for name in mechanism.drives:
        columns.append(Column(name, arrays[f"drive {name}"], units.label(mechanism.quantity(name)), "drive"))
    shown = {*mechanism.drives, *(output.name for output in outputs)}
    columns += [column for column in pose_columns(study, motion.poses) if column.name not in shown]
    rates = {"length": ("velocity", "acceleration"), "angle": ("angular_velocity", "angular_acceleration")}
    for output in outputs:
        if output.name not in mechanism.drives:
            columns.append(
                Column(output.name, arrays[output.name], units.label(output.quantity), f"value of {output.name}")
            )
        for order, kind in zip(("velocity", "acceleration"), rates.get(output.quantity, ("none", "none")), strict=True):
            name = f"{output.name}_{order}"
            if name in arrays:
                columns.append(Column(name, arrays[name], units.label(kind), f"{order} of {output.name}"))
    for name, meaning in (
        ("det_J", "determinant of the Jacobian, outputs by drives, per radian"),
        ("inverse_condition", "smallest over largest singular value of the Jacobian"),
    ):
        if name in arrays:
            columns.append(Column(name, arrays[name], "", meaning))
    for name in mechanism.drives:
        if f"{name}_effort" in arrays:
            unit = units.label("moment" if mechanism.quantity(name) == "angle" else "force")
            columns.append(
                Column(f"{name}_effort", arrays[f"{name}_effort"], unit, "drive effort that balances the loads")
            )
    return columns
