"""What kinematics has at solved poses: positions, rates, Jacobians, efforts, clearances."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.ground.numerics.arrays import Flags
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization
from mechdesign.mechanism.elements.couplings import play
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.jacobians import Jacobian, mixes
from mechdesign.mechanism.outputs import Rates, first, second
from mechdesign.mechanism.plates import CLEARANCE, Clearances
from mechdesign.mechanism.statics import balance
from mechdesign.motion.motion import SolvedPoses, in_study_units
from mechdesign.questions.kinematics.question import KinematicQuestion, characteristic_length
from mechdesign.questions.loads import Loading

# Below this inverse condition the determinant and the rates solved with it have lost about half of their digits.
SINGULAR = 1e-8
# Whether an output stands still as a coupling has it: 1 or 0, by pose.
RESTS = "rests"
# An output that moves less than this part of its input (lengths in sizes of the mechanism) stands still: at a toggle.
STANDS_STILL = 1e-12


def values_of(question: KinematicQuestion, solved: SolvedPoses) -> tuple[dict[str, Value], Linearization]:
    """What the question has at solved poses, and their loop equations."""
    mechanism, section, configuration = solved.motion.mechanism, question.section, solved.configuration
    arrays, linear, moving = question.positions(solved)
    regular = np.asarray(arrays["conditioning"]) >= STALLED
    if question.pairs:
        arrays |= _clearances(question, solved)
    if section.rated:
        arrays |= _rates(question, linear, regular, moving)
    if section.instant_centres:
        # Of one drive alone every speed gives the same centres.
        velocity = linear.velocity([1.0]) if len(mechanism.drives) == 1 else moving.velocity
        assert velocity is not None
        for centre in question.centres:
            place, motion, turn = centre.at(mechanism, configuration, velocity)
            x, y = (np.where(regular, part, np.nan) for part in (place.real, place.imag))
            arrays |= {f"{centre.name}.x": x, f"{centre.name}.y": y, centre.turn: turn}
            arrays[f"{centre.name}.motion"] = np.where(regular, motion, 0)
    if question.square or section.loads or section.mechanical_advantage or question.cams:
        columns = {**_of_jacobian(question, linear, solved), **statics(question, linear, solved, moving)}
        arrays |= {name: np.where(regular, values, np.nan) for name, values in columns.items()}
    return arrays, linear


def _clearances(question: KinematicQuestion, solved: SolvedPoses) -> dict[str, Value]:
    mechanism = solved.motion.mechanism
    assert mechanism.description.plates is not None
    clearances = Clearances(mechanism, mechanism.description.plates, solved.configuration)
    gaps: dict[str, Value] = {name: clearances.of(pair.one, pair.other) for name, pair in question.pairs.items()}
    return {**gaps, CLEARANCE: np.minimum.reduce(np.broadcast_arrays(*gaps.values()))}


def _rates(question: KinematicQuestion, linear: Linearization, regular: Flags, moving: Moving) -> dict[str, Value]:
    velocity, acceleration, configuration = moving.velocity, moving.acceleration, linear.configuration
    assert velocity is not None
    assert acceleration is not None
    arrays: dict[str, Value] = {}
    for output in question.rated.values():
        for order, value in (
            ("velocity", first(configuration, output, velocity)),
            ("acceleration", second(configuration, output, velocity, velocity, acceleration)),
        ):
            value = np.where(regular, in_study_units(question.motion.units, output, value), np.nan)
            arrays[f"{output.name}_{order}"] = value
    return arrays


def _of_jacobian(
    question: KinematicQuestion, linear: Linearization, solved: SolvedPoses
) -> dict[str, Value]:  # fmt: skip
    """Entries of the Jacobian, and its numbers."""
    if not question.square:
        return {}
    listed, drives, arrays = question.listed, question.drives, dict[str, Value]()
    length = characteristic_length(question.study)
    arc = solved.poses.of(np.nan if length is None else length) if mixes(listed, drives) else None
    jacobian = Jacobian.of(linear, listed, arc)
    for output, line in zip(listed, jacobian.entries, strict=True):
        arrays |= {entry(output, drive): value for drive, value in zip(drives, line, strict=True)}
    arrays |= {"det_J": jacobian.determinant, "inverse_condition": jacobian.inverse_condition}
    if len(drives) == 1 and question.study.mechanism.couplings:
        arrays[RESTS] = _rests(linear, listed[0], question.study.mechanism)
    return arrays


def statics(
    question: KinematicQuestion, linear: Linearization, solved: SolvedPoses, moving: Moving
) -> dict[str, Value]:  # fmt: skip
    """Efforts of the drives that balance the loads, mechanical advantages, and what cams have, by their columns."""
    section = solved.poses.section(question.section)
    columns: dict[str, Value] = {}
    if section.loads:
        forces = Forces(linear.configuration)
        Loading(question.study, section.loads, solved.poses).add(forces, moving)
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


def pole_of(question: KinematicQuestion, arrays: Mapping[str, Value], linear: Linearization, column: str) -> Value:
    """What is zero where a column of `KinematicQuestion.poled` goes to infinity: a rate, or the curvature of a cam."""
    name, advantages = column.removesuffix("_advantage"), question.section.mechanical_advantage
    if name in advantages:
        return _rates_of_advantage(question, linear, name, advantages[name])[0]
    if (centre := next((c for c in question.centres if column in c.columns), None)) is not None:
        return arrays[centre.turn]
    cam = next(cam for cam in question.cams if column == f"{cam.coupling}_curvature_radius")
    return cam.touch(linear.configuration).pitch


def _rates_of_advantage(
    question: KinematicQuestion, linear: Linearization, output: str, input_name: str
) -> tuple[Value, Value]:
    """Rates of an output and of the input of its mechanical advantage, by a drive that moves the input."""
    mechanism, drives = question.study.mechanism, [drive.name for drive in question.drives]
    rows = Jacobian.of(linear, [mechanism.coordinate(name) for name in (output, input_name)]).entries
    k = drives.index(input_name) if input_name in drives else 0
    return rows[0][k], rows[1][k]


def _advantage(question: KinematicQuestion, linear: Linearization, output: str, input_name: str) -> Value:
    """Force of an output over that at its input: by virtual work the input's rate over the output's."""
    mechanism = question.study.mechanism
    given_out, put_in = _rates_of_advantage(question, linear, output, input_name)
    sizes = [mechanism.size if mechanism.quantity(name) == "length" else 1.0 for name in (output, input_name)]
    still = np.abs(given_out) / sizes[0] <= STANDS_STILL * np.maximum(np.abs(put_in) / sizes[1], STANDS_STILL)
    return np.where(still & (put_in != 0), np.inf, put_in / given_out)


def entry(output: Coordinate, drive: Coordinate) -> str:
    """Name of an entry of the Jacobian: ``C.x_by_theta``."""
    return f"{output.name}_by_{drive.name}"
