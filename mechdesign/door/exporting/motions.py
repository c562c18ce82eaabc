"""Motions as tables: curves of points along the motion, and the drives over time for a controller."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from mechdesign.door.exporting.exports import Content, export
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.door.report.tables import to_csv
from mechdesign.drawing.sweep import ranks
from mechdesign.ground.columns import Column
from mechdesign.ground.errors import AssemblyError, StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.progress import NULL
from mechdesign.ground.results import Table
from mechdesign.motion.motion import in_study_units
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import PathRows
from mechdesign.motion.solving import curve_with
from mechdesign.questions.columns import DRIVE, GIVEN, TIMED
from mechdesign.questions.dynamics.forward import forward
from mechdesign.questions.dynamics.schema import MAX_ROWS
from mechdesign.questions.kinematics.rates import drive_rates
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.poses import pose_in_words, study_poses
from mechdesign.study import Study
from mechdesign.study.schema.poses import MotionSection
from mechdesign.study.text.units import QuantityError, Units

# Rate of a controller where none is asked for, and the most rows that it gets.
RATE = "1 kHz"
MOST_INSTANTS = 1_000_000
# Steps of Newton's method from times to places along a path, and the looks a row that it begins from.
STEPS, LOOKS = 4, 16
# A part of a step of time that is rounding.
ROUNDING = 1e-9
# Derivatives of the drives in the table of the forward motion, and in that of a controller.
ORDERS = ("velocity", "acceleration")


@export("curve.csv", "places of points and outputs, closely along the motion", order=60)
def curve_csv(view: PosedStudy) -> Content:
    """A row a pose: the part of the motion, what the poses give, and outputs and coupler points."""
    study, mechanism, track = view.study, view.mechanism, view.track
    parts = np.concatenate([[1], 1 + np.cumsum(~track.follows)]) if len(track.places) else np.empty(0)
    columns = [Column("part", parts.astype(int))]
    given = () if view.question is None else view.question.poses.names
    if view.question is not None and view.question.poses.times is not None:
        along = view.question.poses.along(np.zeros(len(parts), dtype=np.intp), track.places)
        assert along.times is not None
        columns.append(TIMED.column(along.times, study.units.label("time")))
    chosen = study.kinematics.outputs if study.kinematics is not None else None
    points = [point for point, rank in ranks(study).items() if rank == 2]
    outputs = expand_outputs(study, (*(chosen or default_outputs(mechanism)), *points))
    names = dict.fromkeys([*given, *(output.name for output in outputs)])
    for coordinate in map(mechanism.coordinate, names):
        values = np.broadcast_to(
            in_study_units(study.units, coordinate, track.configuration.value(coordinate)), parts.shape
        )
        label = study.units.label(coordinate.quantity)
        columns.append(GIVEN.column(np.broadcast_to(values, parts.shape), label, coordinate=coordinate.name))
    return Content(to_csv(Table("curve", tuple(columns))), view.unmoved)


@export("motion.csv", "drives over time at the rate of a controller", order=61, options=("rate",))
def motion_csv(view: PosedStudy) -> Content:
    """A row an instant: time, and position, velocity and acceleration of each drive."""
    step = step_of(view.rate or RATE, view.study.units)
    sections = (view.study.kinematics, view.study.dynamics)
    section = next((part for part in sections if part is not None and part.rated), None)
    if section is not None:
        table = Timed(view.study, section).table(step)
    elif view.study.dynamics is not None and view.study.dynamics.forward is not None:
        table = _forward(view.study, step)
    else:
        drive = view.mechanism.drives[0]
        raise StudyError(
            "the motion has no time: give kinematics 'rates' of what the poses sweep, such as "
            f"{{{drive}: {'60 rpm' if view.mechanism.quantity(drive) == 'angle' else '100 mm/s'}}}, a 'speed' along a "
            "path, or a 'motion'; or dynamics a 'forward'"
        )
    return Content(to_csv(table))


# A rate with the prefix of its unit.
_RATE = re.compile(r"((?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*([kKmMG]?)[hH][zZ]")
_PREFIXES = {"": 1.0, "k": 1e3, "K": 1e3, "m": 1e-3, "M": 1e6, "G": 1e9}


def step_of(text: str, units: Units) -> float:
    """Step of time in the study's unit, of a rate such as ``1 kHz`` or a step such as ``2 ms``.

    Raises
    ------
    StudyError
        If the text is neither, or not positive.
    """
    rate = _RATE.fullmatch(text.strip())
    try:
        if rate is not None and (hertz := float(rate[1]) * _PREFIXES[rate[2]]) > 0:
            return units.convert(f"{1.0 / hertz!r} s", "time")
        step = units.convert(text, "time")
    except QuantityError:
        step = 0.0
    if not 0 < step < np.inf:
        raise StudyError(f"--rate is a rate such as '1 kHz', or a step of time such as '2 ms', not {text!r}")
    return step


def _instants(end: float, step: float) -> Floats:
    """Instants from 0 to the end.

    Raises
    ------
    StudyError
        If they are too many.
    """
    count = int(end / step * (1 + ROUNDING)) + 1
    if count > MOST_INSTANTS:
        raise StudyError(f"{count} instants; at most {MOST_INSTANTS} are possible: ask for a lower --rate")
    return np.asarray(step * np.arange(count), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Timed:
    """The motion of a section with rates, as a function of time."""

    study: Study
    section: MotionSection

    def table(self, step: float) -> Table:
        """Time, and each drive's position, velocity and acceleration."""
        study, mechanism = self.study, self.study.mechanism
        poses = study_poses(study, self.section.command)
        if not poses.followed:
            raise StudyError(
                "listed poses and grids are no motion: give a 'sweep' of one coordinate, a path or a motion"
            )
        drives = [mechanism.coordinate(name) for name in mechanism.drives]
        curve = curve_with(study.motion(poses), drives)
        times = _instants(float(self._clock(poses, np.array([float(poses.end)]))[0]), step)
        line, places = np.zeros(len(times), dtype=np.intp), self._places(poses, times)
        solved = curve.solve(line, places)
        along, configuration = solved.poses, solved.configuration
        if not configuration.valid.all():
            row = int(np.argmin(configuration.valid))
            raise AssemblyError(
                f"at {times[row]:.6g} {study.units.label('time')} ({pose_in_words(study, along, row)}) the motion has "
                "no valid pose; a controller needs all of them"
            )
        rates = drive_rates(self.section, solved, mechanism.linearize(configuration))
        columns = [TIMED.column(times, study.units.label("time"))]
        for k, drive in enumerate(drives):
            values = [along.values[drive.name] if drive.name in along.names
                      else in_study_units(study.units, drive, configuration.value(drive))]  # fmt: skip
            values += [in_study_units(study.units, drive, part[k]) for part in (rates.velocities, rates.accelerations)]
            names = (drive.name, *(f"{drive.name}_{word}" for word in ORDERS))
            columns += [
                DRIVE.column(np.array(np.broadcast_to(value, times.shape), dtype=float), drive=name)
                for name, value in zip(names, values, strict=True)
            ]
        return Table("motion", tuple(columns))

    def _places(self, poses: Poses, times: Floats) -> Floats:
        """Places along the motion, in rows, at instants."""
        rows = np.linspace(0.0, poses.end, poses.end * LOOKS + 1)
        clock = self._clock(poses, rows)
        places = np.interp(times, clock, rows)
        if not poses.rule.timed and self.section.speed is not None:
            for _ in range(STEPS):
                pace = poses.pace(np.zeros(len(times), dtype=np.intp), places) / self.section.speed
                away = (self._clock(poses, places) - times) / np.where(pace > 0, pace, np.inf)
                places = np.clip(places - away, 0.0, poses.end)
        return places

    def _clock(self, poses: Poses, places: Floats) -> Floats:
        """Time at places along the motion."""
        line = np.zeros(len(places), dtype=np.intp)
        if (timed := poses.along(line, places).times) is not None:
            return timed
        if self.section.speed is not None and isinstance(poses.rule, PathRows):
            return poses.rule.way(line, places) / self.section.speed
        swept, rates = poses.swept, self.section.rates
        if any(self.section.accelerations.values()):
            raise StudyError("'accelerations' are those of single poses: give a 'motion' over time instead")
        if swept is None or not rates.get(swept) or any(rate for name, rate in rates.items() if name != swept):
            rated = " and ".join(name for name, rate in rates.items() if rate) or "nothing"
            moved = swept or " and ".join(poses.moving) or "nothing"
            raise StudyError(
                f"'rates' move {rated}, while the poses move {moved}: give a rate of the one coordinate that is "
                "swept, or a 'motion' over time"
            )
        values = poses.along(line, places).values[swept]
        clock = (values - poses.values[swept][0]) / rates[swept]
        if np.any(np.diff(clock) < 0) or clock[-1] < 0:
            raise StudyError(f"the sweep of {swept!r} runs against its rate: turn one of them round")
        return np.asarray(clock)


def _forward(study: Study, step: float) -> Table:
    """The motion in time under given efforts, at the instants of the controller."""
    section = study.dynamics
    assert section is not None
    assert section.forward is not None
    times = _instants(section.forward.duration, step)
    if not 2 <= len(times) <= MAX_ROWS:
        raise StudyError(f"{len(times)} instants; from 2 to {MAX_ROWS} are possible: ask for another --rate")
    sampled = section.forward.model_copy(update={"rows": len(times), "duration": float(times[-1])})
    moving = study.with_sections(dynamics=section.model_copy(update={"forward": sampled}))
    table = forward(moving, NULL)[0].tables["forward"]
    names = [(drive, *(f"{drive}_{word}" for word in ORDERS)) for drive in study.mechanism.drives]
    return Table("motion", tuple(table.column(name) for name in ("time", *sum(names, ()))))
