"""The answer about a motion in time: its tables, and the forces along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.columns import Column
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Floats, evenly
from mechdesign.ground.numerics.sign_changes import Resolved
from mechdesign.ground.progress import Progress
from mechdesign.ground.results import Result, Scope, Table
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.motion import SolvedPoses, in_study_units
from mechdesign.motion.passage import MAX_SHOWN_POSES
from mechdesign.motion.question import Mark, PoseValues, unfilled
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import TIME, GivenRows
from mechdesign.questions.columns import DRIVE, TIMED, VALID
from mechdesign.questions.dynamics import lift_off
from mechdesign.questions.dynamics.assumed import assumed
from mechdesign.questions.dynamics.columns import EVENTS, FORWARD
from mechdesign.questions.dynamics.equations_of_motion import EquationsOfMotion
from mechdesign.questions.dynamics.motion_in_time import IntegratedPoses, Integration
from mechdesign.questions.dynamics.question import DynamicQuestion, ForceQuestion
from mechdesign.questions.dynamics.schema import DynamicsSection
from mechdesign.questions.dynamics.state_in_time import STANDSTILL
from mechdesign.questions.dynamics.tables import dynamics_table, extremes_table, joint_table, question_of
from mechdesign.questions.kinematics.moved import full
from mechdesign.questions.outputs import expand_outputs
from mechdesign.questions.poses import Shown
from mechdesign.study import Study
from mechdesign.study.schema.checker import ORDERS

# Energies that differ from the work of what acts by more than this part of the largest are wrong.
ENERGY = 1e-6


def forward(study: Study, progress: Progress) -> tuple[Result, PoseValues, Shown]:
    """The motion that the efforts of `dynamics.forward` bring about, the forces along it, and what pictures show.

    Raises
    ------
    AssemblyError
        If the start cannot be assembled, is outside the limits or singular.
    MechanismError
        If the mechanism has no inertia along a motion.
    """
    section = DynamicsSection.of(study)
    assert section.forward is not None
    outputs = expand_outputs(study, section.outputs or ())
    equations = EquationsOfMotion(ForceQuestion.of(study, moves=True), section.forward, outputs)
    integration = Integration(equations)
    course = integration.run(progress)
    motion, shown = _forces(integration, course)
    names = [static.name for static in question_of(motion).statics]
    tables = {
        "forward": _forward_table(motion, course, outputs), "events": _events_table(integration),
        "dynamics": dynamics_table(motion), "joint_forces": joint_table(motion),
        "extremes": extremes_table(motion, None, names),
    }  # fmt: skip
    scope, warnings = _scope(integration), [*_cautions(integration, course)]
    tables = {name: replace(table, scope=replace(scope, poses_only=name != "events")) for name, table in tables.items()}
    warnings += [*_lift_offs(integration, motion), *assumed(study)]
    counts = {"instants": len(course.times), "steps": integration.steps}
    return Result("dynamics", tables, warnings, counts), motion, shown


def _at(study: Study, time: float) -> str:
    return f"{numeral(time)} {study.units.label('time')}"


def _scope(integration: Integration) -> Scope:
    """What tables say of the motion that was asked: a part of it is missing, or it has its own end before its time."""
    ending, study = integration.ending, integration.equations.study
    if ending is None:
        return Scope()
    until = _at(study, integration.reached)
    if ending.place:
        return Scope(until=f"until {ending.place} at {until}")
    return Scope(missing=f"no motion from {until} to {_at(study, integration.end)}: {ending.words.format(time=until)}")


def _cautions(integration: Integration, course: IntegratedPoses) -> Iterator[Caution]:
    """Warnings of a motion that ended before its time, jumps, or has energies that are not those of the work done."""
    study = integration.equations.study
    if (ending := integration.ending) is not None:
        kind = {"limit": "incomplete", "rest": "incomplete", "jams": "jammed"}.get(ending.kind, "unconverged")
        ended = "ended" if kind == "incomplete" else "ended early"
        words = ending.words.format(time=_at(study, integration.reached))
        yield Caution(kind, f"the motion in time {ended}: {words}", "forward")
    for words in dict.fromkeys(words for words, _ in integration.jumps):
        times = [time for name, time in integration.jumps if name == words]
        yield Caution(
            "singular", f"the law of {words} has a corner, at which velocities jump, {len(times)} times, first at "
            f"{_at(study, times[0])}: the motion is that of a rounded corner, and forces there have no bound", "forward"
        )  # fmt: skip
    rates, (work, *_) = course.rates, course.work
    gained = rates.kinetic + rates.potential - work
    off, size = np.abs(gained - gained[0]), max(float(np.ptp(part)) for part in (rates.kinetic, rates.potential, work))
    wrong = off > ENERGY * max(size, float(rates.kinetic.max()))
    if wrong.any():
        row = int(wrong.argmax())
        message = (
            f"energies do not change by the work of what acts: from {_at(study, course.times[row])} on they are off, "
            f"at last by {off[-1] / size:.3g} of the largest change; what acts may be narrower there than the steps"
        )
        yield Caution("unconverged", message, "forward", row)


def _lift_offs(integration: Integration, rows: PoseValues) -> Iterator[Caution]:
    """Warnings of followers that lift off their cams, at rows, or only between them."""
    contacts = lift_off.contacts(integration.equations.question)
    for coupling, remark, where in lift_off.lifted(rows):
        if (caution := Mark.of(where).caution(remark, rows.question)) is not None:
            yield caution
            del contacts[coupling]
    if not contacts or not integration.time:
        return
    least = lift_off.PRESSED * integration.equations.question.size

    def pressed(times: Floats) -> Floats:
        order = np.argsort(times)
        motion, _ = _forces(integration, integration.at(times[order]))
        return np.array([motion.arrays[normal] + least for normal in contacts.values()])[:, np.argsort(order)]

    ends = np.unique([stretch.end for stretch in integration.stretches])
    changes = Resolved.of(pressed, ends, np.zeros(len(contacts))).changes(np.ones(len(contacts)))
    for k, coupling in enumerate(contacts):
        times = [change.place for change in changes if change.function == k and change.sign < 0]
        if times:
            words = lift_off.lifts(coupling, "between the instants").words
            first = _at(integration.equations.study, times[0])
            yield Caution("cam", f"{words}; {len(times)} times, first at {first}", "joint_forces")


def _forces(integration: Integration, course: IntegratedPoses) -> tuple[PoseValues, Shown]:
    """Forces along the motion: those of any motion over time, at the poses that were integrated."""
    study, positions = integration.equations.study, integration.positions
    mechanism, count = study.mechanism, len(course.times)
    drives = [mechanism.coordinate(name) for name in mechanism.drives]

    def of(drive: Coordinate, value: Value) -> Floats:
        return np.array(np.broadcast_to(in_study_units(study.units, drive, value), (count,)), dtype=float)

    rows = np.arange(count)
    values = {drive.name: of(drive, course.configuration.value(drive)) for drive in drives}
    first, second = (
        {drive.name: of(drive, positions.rate(drive, part)) for drive in drives}
        for part in (course.rates.velocity, course.rates.acceleration)
    )
    poses = Poses(GivenRows({TIME: course.times, **values}, derivatives=(first, second)))
    question = DynamicQuestion.of(study, poses)
    if len(course.rates.friction):
        question = replace(question, forces=replace(question.acting, rubbing=course.rates.friction))
    motion, solved = unfilled(question), SolvedPoses(question.motion, rows, course.configuration)
    mechanism.forward.judge(replace(course.configuration, reason=motion.reason))
    motion.put(rows, full(question.moved(solved)[0], rows.shape))
    # Efforts are known, also where the drives are singular.
    for drive, effort in zip(drives, course.rates.efforts, strict=True):
        motion.arrays[f"{drive.name}_effort"][:] = effort
        speed = positions.rate(drive, course.rates.velocity)
        motion.arrays[f"{drive.name}_power"][:] = effort * speed
    some = evenly(count, MAX_SHOWN_POSES)
    return motion, Shown(study, poses, rows[some], course.configuration.take(rows[some]))


def _forward_table(motion: PoseValues, course: IntegratedPoses, outputs: list[Coordinate]) -> Table:
    study, poses, label = motion.question.study, motion.question.poses, motion.question.study.units.label
    columns: list[Column] = [TIMED.column(course.times, label("time"))]
    for k, drive in enumerate(motion.question.drives):
        units = [label(kind) for kind in ORDERS[drive.quantity]]
        columns.append(DRIVE.column(poses.values[drive.name], units[0], drive=drive.name))
        for word, values, unit in (
            ("velocity", poses.rates[0][drive.name], units[1]), ("acceleration", poses.rates[1][drive.name], units[2]),
            ("effort", course.rates.efforts[k], label("moment" if drive.quantity == "angle" else "force")),
        ):  # fmt: skip
            columns.append(FORWARD[f"<drive>_{word}"].column(values, unit, drive=drive.name))
    for output in outputs:
        value = np.broadcast_to(
            in_study_units(study.units, output, course.configuration.value(output)), course.times.shape
        )
        columns.append(FORWARD["<output>"].column(value, label(output.quantity), output=output.name))
    energies = {
        "kinetic_energy": course.rates.kinetic,
        "potential_energy": course.rates.potential,
        "work": course.work[0],
    }
    if len(course.work) > 1:
        energies["friction_work"] = course.work[1]
    columns += FORWARD.columns(study.units.labels, **energies)
    return FORWARD.table([*columns, VALID.column(motion.valid)])


def _events_table(integration: Integration) -> Table:
    """A row each event; those that are asked and do not happen have one without a time."""
    study, events = integration.equations.study, sorted(integration.events, key=lambda event: event.time)
    watched = [*integration.section.events, *([STANDSTILL] if study.mechanism.description.friction else [])]
    happened = {event.name for event in events}
    rows = [(event.name, event.time, "up" if event.rises else "down") for event in events]
    rows += [(name, np.nan, "") for name in watched if name not in happened]
    names, times, ways = zip(*rows, strict=True) if rows else ((), (), ())
    columns = EVENTS.columns(
        study.units.labels, event=np.array(names, dtype=str), time=np.array(times, dtype=float),
        direction=np.array(ways, dtype=str),
    )  # fmt: skip
    return EVENTS.table(columns)
