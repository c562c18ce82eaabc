"""The motion that given efforts bring about: equations of motion of any mobility, integrated in time.

Inverse dynamics is affine in the accelerations: with q the coordinates of a chart, efforts Q = M(q) q'' + c(q, q', t).
One call without acceleration and with each unit acceleration gives c and the columns of M; M q'' = Q - c is the motion.

The state holds all positions x of the mechanism and their velocities, of which a chart's are independent. The others
are solved from these in every pose, in the assembly that the state shows: so loops close to rounding, and the motion
goes on through poses at which two assemblies meet. There the equations lose rank while the motion itself is smooth: its
rates are those of poses before and behind, interpolated. Where a chart's coordinates come near to a dead centre, others
take over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from mechdesign.curve.motion import from_sketch
from mechdesign.errors import AssemblyError, MechanismError
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value, quiet
from mechdesign.mechanism.charts import Atlas, Chart, Positions, regularity
from mechdesign.mechanism.configuration import joined
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import Bound
from mechdesign.mechanism.derivatives import STALLED, Linearization
from mechdesign.mechanism.derivatives import regularity as regularity_of_drives
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.friction import Rubbing, Rubs
from mechdesign.mechanism.outputs import Rates as Directions
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.statics import balance
from mechdesign.mechanism.stick_slip import accelerate, solved_each
from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.progress import NULL, Progress
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.schema import NOTHING, ForwardSection
from mechdesign.questions.loads import Loading
from mechdesign.questions.poses import in_study_units, radians
from mechdesign.study.poses import Poses
from mechdesign.study.schema.loads import VELOCITY

# Error of a step, as a part of a value and of the mechanism's size: energy keeps nine digits over hundreds of swings.
RELATIVE, ABSOLUTE = 1e-11, 1e-12
MAX_STEPS = 5000
MAX_BOUNCES = 1000
# Another chart takes over where its coordinates move so many times faster.
FASTER = 3.0
# Below this regularity two assemblies meet. Rates there follow from poses around, each this far from the next (radians,
# or sizes of the mechanism), by the polynomial through the nearest of them that are regular.
MEETING = 0.02
AROUND = 0.03 * np.array([-10, -9, -8, -7, -6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])
NEAREST = 8
# Places within a step at which limits and crossings are looked at.
LOOKED_AT = np.array([0.25, 0.5, 0.75, 1.0])
# A velocity below this part of the usual one is rest.
REST = 1e-6
# Where friction is, members that move against each other less than this part of the usual velocity rest; those that
# rest do not move at all while they do. The first step from rest, as a part of the usual time; and the longest at rest,
# as a part of the duration.
STILL, FIRST_STEP, LONGEST_REST = 1e-8, 1e-3, 0.05
STANDSTILL = "standstill"
# A mass matrix whose inverse condition is below this has no inertia along some motion.
NO_INERTIA = 1e-13


class Rates(NamedTuple):
    """What the equations of motion give at some poses, each of shape (..., poses); angles in radians."""

    velocity: Floats  # of all positions
    acceleration: Floats
    power: Floats  # of efforts and loads, less what dampers and friction take; and if there is friction its own
    kinetic: Floats
    potential: Floats
    efforts: Floats  # of the drives
    friction: Floats  # in its contacts, as `Accelerations` has it


class Event(NamedTuple):
    """A crossing, a limit that is reached, or a standstill, at a time."""

    name: str
    time: float
    rises: bool


class Watch(NamedTuple):
    """What is looked for within steps: where a function of poses and states changes its sign.

    Where it becomes negative some of them end a step: a limit of motion, of which this is the coordinate, and a contact
    whose members come to rest against each other, of which this is the number.
    """

    name: str
    function: Callable[[Configuration, Floats], Value]
    limit: Coordinate | None = None
    contact: int | None = None

    @property
    def stops(self) -> bool:
        """Whether it ends a step."""
        return self.limit is not None or self.contact is not None


class Stretch(NamedTuple):
    """The motion in a step up to an end, with the chart, the pose, and the signs of the contacts that it has there."""

    states: Callable[[Floats], Floats]  # at times, shape (n, times)
    end: float
    chart: Chart
    last: Configuration
    signs: Floats


@dataclass
class Course:
    """The motion at the instants asked for, shape (..., instants).

    Attributes
    ----------
    times : Floats
    x, velocity, acceleration : Floats
        All positions, as `positions` has them.
    work : Floats, shape (1 or 2, instants)
        Work of efforts and loads since the start, less what dampers, stops and friction have taken; that of friction.
    ended : str
        Why the motion ended before its time; empty if it did not.
    failed : bool
        Whether it ended because the equations have no solution further on, or for the number of steps.
    """

    positions: Positions
    times: Floats
    x: Floats
    rates: Rates
    work: Floats
    configuration: Configuration
    events: list[Event] = field(default_factory=list)
    ended: str = ""
    failed: bool = False
    steps: int = 0


class EquationsOfMotion:
    """Accelerations of a mechanism under its loads and the efforts of its drives.

    Raises
    ------
    AssemblyError
        If the start cannot be assembled, or lies outside the limits.
    MechanismError
        If the drives do not determine the start, or the mechanism has no inertia along a motion.
    """

    def __init__(self, question: ForceQuestion, section: ForwardSection, outputs: Sequence[Coordinate] = ()) -> None:
        self.question, self.section, self.study = question, section, question.study
        mechanism = self.study.mechanism
        at, linear, speeds = self._start(mechanism)
        drives = [mechanism.coordinate(name) for name in mechanism.drives]
        self.crossings = [(name, mechanism.coordinate(crossing.of)) for name, crossing in section.events.items()]
        followed = [*drives, *(coordinate for _, coordinate in self.crossings), *mechanism.counting, *outputs]
        if mechanism.windings:
            followed += mechanism.windings.values()
            begin = {drive.name: np.atleast_1d(in_study_units(self.study, drive, at.value(drive))) for drive in drives}
            wound = from_sketch(self.study, begin, {})
            at = replace(at, near={**at.near, **{name: angle[0] for name, angle in wound.items()}})
        self.drives, friction = drives, question.friction
        self.contacts: Sequence[Rubbing] = friction.contacts if friction is not None else []
        #: Signs of the contacts' velocities, 0 of those at rest.
        self.signs = np.zeros(len(self.contacts))
        #: The joint that jammed when rates were computed last.
        self.jams = ""
        self.positions = Positions(mechanism, at, followed)
        self.atlas = Atlas(self.positions)
        self.last = at
        slopes = self.slopes(linear)
        self.chart, _ = self.atlas.best(slopes)
        self.start = self.positions.start, slopes @ speeds

    def _start(self, mechanism: Mechanism) -> tuple[Configuration, Linearization, Floats]:
        """The pose at the start, its derivatives by the drives, and their velocities."""
        study, given, sketch = self.study, self.section.start, mechanism.sketch_configuration
        values, speeds = [], []
        for name in mechanism.drives:
            drive = mechanism.coordinate(name)
            value = radians(study, drive, given[name]) if name in given else sketch.value(drive)
            values.append(np.asarray(value, dtype=float))
            speeds.append(float(radians(study, drive, given.get(f"{name}{VELOCITY}", 0.0))))
        pose = mechanism.forward.solve(values)
        if not pose.valid:
            reason = mechanism.why(int(pose.reason))
            raise AssemblyError(f"the start of dynamics.forward: {reason}{self._beyond_limits(pose)}")
        linear = mechanism.linearize(pose)
        if regularity_of_drives(linear) < STALLED:
            raise AssemblyError(
                "the start of dynamics.forward is a singular pose: there velocities of the drives do not say how the "
                "mechanism moves; start beside it"
            )
        return pose, linear, np.array(speeds)

    def _beyond_limits(self, pose: Configuration) -> str:
        """Limits that a pose is beyond, with the values there."""
        study, mechanism, places = self.study, self.study.mechanism, self.study.mechanism.nominal
        parts = []
        for bound in mechanism.bounds:
            labels = [label for label, margin in bound.margins(pose, places) if float(margin) < 0]
            value = in_study_units(study, bound.coordinate, pose.value(bound.coordinate))
            unit = f" {study.units.label(bound.coordinate.quantity)}".rstrip()
            parts += [f"; {bound.coordinate.name} is {float(value):.6g}{unit}, beyond {label}" for label in labels]
        return "".join(parts)

    @quiet
    def slopes(self, linear: Linearization) -> Floats:
        """Derivatives of all positions by the given coordinates at a single pose, shape (m, mobility)."""
        return np.array([[np.ravel(first(linear.configuration, c, rates))[0] for rates in linear.by_drives]
                         for c in self.positions.coordinates], dtype=float)  # fmt: skip

    def rates(self, times: Floats, x: Floats, velocity: Floats) -> Rates:
        """Rates at poses near to `x`, shape (m, poses), with its and `velocity`'s independent parts."""
        rates, regular = self._rates(times, x, velocity)
        if len(meeting := np.flatnonzero(~(regular >= MEETING))):
            beside = self._between(times[meeting], x[:, meeting], velocity[:, meeting])
            for part, values in zip(rates, beside, strict=True):
                part[..., meeting] = values
        return rates

    def _between(self, times: Floats, x: Floats, velocity: Floats) -> list[Floats]:
        """Rates at poses where two assemblies meet, from poses before and behind each."""
        speeds = np.max(np.abs(velocity) / self.positions.scales[:, None], axis=0)
        steps = AROUND / np.where(speeds > 0, speeds, np.nan)[:, None]
        around = x[..., None] + velocity[..., None] * steps
        shape = steps.shape
        rates, regular = self._rates(
            np.repeat(times, len(AROUND)), around.reshape(len(x), -1),
            np.repeat(velocity, len(AROUND), axis=1),
        )  # fmt: skip
        weights = np.array([_weights(row) for row in regular.reshape(shape) >= MEETING / 2])
        return [np.sum(np.where(weights == 0, 0.0, part.reshape(*part.shape[:-1], *shape)) * weights, axis=-1)
                for part in rates]  # fmt: skip

    @quiet
    def _rates(self, times: Floats, x: Floats, velocity: Floats) -> tuple[Rates, Floats]:
        """Rates where the equations have full rank, and how regular they are."""
        linear, count, shape = self.chart.solve(x, self.last), len(self.chart.rows), times.shape
        configuration, section, rows = linear.configuration, self.question.section, slice(None)
        moves = linear.velocity([*velocity[self.chart.rows]])
        cases = 1 + count + len(self.contacts)
        moving = Moving(moves, linear.acceleration(moves, [*np.eye(cases)[1 : count + 1, :, None]]))
        poses = Poses((), len(times), True, shape, times=times)
        forces, energy = self.question.acting(poses, configuration, rows, moving)
        loading = Loading(self.study, section.loads, poses, rows)
        given = [loading.value(self.section.efforts.get(d.name, NOTHING), forces, moving) for d in self.drives]
        efforts = np.array([np.broadcast_to(effort, shape) for effort in given], dtype=float)
        for drive, effort in zip(self.drives, efforts, strict=True):
            forces.on_coordinate(drive, effort)
        accelerations, friction = self._accelerations(linear, forces, moving, shape)
        velocities, columns = self._of_all(moves, shape), self._of_all(moving.acceleration, (cases, *shape))
        # What the unit accelerations add are derivatives of the positions by the chart's coordinates.
        slopes = columns[:, 1 : count + 1] - columns[:, :1]
        accelerated = columns[:, 0] + np.einsum("mkp,kp->mp", slopes, accelerations)
        power = np.sum(
            [e * self.positions.rate(d, velocities) for e, d in zip(efforts, self.drives, strict=True)], axis=0
        )
        power = power - energy.lost
        if section.loads:
            loads = Forces(configuration)
            loading.add(loads, moving)
            power = power + loads.power(moves)
        kinetic, potential = (np.array(np.broadcast_to(value, shape)) for value in (energy.kinetic, energy.potential))
        powers = np.array(np.broadcast_to(power, (1, *shape)))
        if self.contacts:
            lost = np.sum(friction * self._sliding(linear, moves, shape), axis=0)
            powers = np.array([powers[0] + lost, lost])
        return Rates(velocities, accelerated, powers, kinetic, potential, efforts, friction), regularity(linear)

    def _accelerations(
        self, linear: Linearization, forces: Forces, moving: Moving, shape: tuple[int, ...]
    ) -> tuple[Floats, Floats]:
        """Accelerations of the chart's coordinates, and friction in the contacts."""
        count = len(self.chart.rows)
        if not self.contacts:
            efforts = balance(linear, forces).efforts
            table = np.array([np.broadcast_to(effort, (count + 1, *shape)) for effort in efforts])
            matrix = np.moveaxis(table[:, 1:] - table[:, :1], -1, 0)
            return solved_each(matrix, -table[:, 0].T[..., None])[..., 0].T, np.empty((0, *shape))
        mechanism, question = self.study.mechanism, self.question
        assert moving.velocity is not None
        assert moving.acceleration is not None
        rubs = Rubs(question.joints, self.contacts, linear, forces, mechanism.engaged, mechanism.size)
        offsets = self._sliding(linear, moving.acceleration, (1 + count + len(self.contacts), *shape))[:, 0]
        answer = accelerate(rubs, self.signs, self._sliding(linear, moving.velocity, shape), offsets)
        self.jams = next((self.contacts[k].joint for k in answer.jams if k >= 0), "")
        return answer.values, answer.friction

    def _sliding(self, linear: Linearization, rates: Directions, shape: tuple[int, ...]) -> Floats:
        """How fast the members of contacts move against each other."""
        return np.array([np.broadcast_to(contact.rate(linear.graph, rates), shape) for contact in self.contacts])

    def _of_all(self, rates: Directions | None, shape: tuple[int, ...]) -> Floats:
        """Derivatives of all positions, shape (m, ...)."""
        assert rates is not None
        angles = [rates.angles[frame] for frame in self.positions.rows]
        return np.array([np.broadcast_to(value, shape) for value in (*angles, *rates.slides)])

    def matrix(self, time: float, x: Floats) -> tuple[Floats, Linearization]:
        """Mass matrix of the chart's coordinates at a pose, shape (mobility, mobility), and the pose."""
        linear, count = self.chart.solve(x[:, None], self.last), len(self.chart.rows)
        still = linear.velocity([0.0] * count)
        moving = Moving(still, linear.acceleration(still, [*np.eye(count + 1)[1:, :, None]]))
        poses = Poses((), 1, True, (1,), times=np.array([time]))
        forces, _ = self.question.acting(poses, linear.configuration, slice(None), moving)
        table = np.array([np.broadcast_to(e, (count + 1, 1)) for e in balance(linear, forces).efforts])[..., 0]
        return table[:, 1:] - table[:, :1], linear


def _weights(regular: Flags) -> Floats:
    """Weights of the poses `AROUND` one in what the polynomial through the nearest regular ones is there."""
    good = np.flatnonzero(regular)
    good = good[np.argsort(np.abs(AROUND[good]), kind="stable")[:NEAREST]]
    if len(good) < NEAREST:
        return np.full(len(AROUND), np.nan)
    places, weights = AROUND[good], np.zeros(len(AROUND))
    weights[good] = [np.prod([b / (b - a) for b in np.delete(places, k)]) for k, a in enumerate(places)]
    return weights


def _beyond(coordinate: Coordinate, value: Value, pose: Configuration, _: Floats) -> Value:
    """By how much a coordinate is beyond a value."""
    return pose.value(coordinate) - value


def _margin(bound: Bound, places: Mapping[str, Value], k: int, pose: Configuration, _: Floats) -> Value:
    """Margin of a limit by its number."""
    return bound.margins(pose, places)[k][1]


class Integration:
    """One motion from its start to its end."""

    def __init__(self, equations: EquationsOfMotion) -> None:
        self.equations, self.positions = equations, equations.positions
        self.section, self.mechanism = equations.section, equations.study.mechanism
        self.end = float(self.section.duration)
        self.count = len(self.positions.scales)
        x, velocity = equations.start
        self._check_inertia(x)
        works = 2 if equations.contacts else 1
        self.begin = np.concatenate([x, velocity, np.zeros(works)])
        equations.signs = np.sign(self._sliding(velocity))
        self.scales = self._scales(x, velocity, works)
        self.events: list[Event] = []
        self._stretches = [self._stretch(lambda times: np.repeat(self.begin[:, None], len(times), axis=1), 0.0)]
        self._ended = ""

    def _check_inertia(self, x: Floats) -> None:
        matrix, _ = self.equations.matrix(0.0, x)
        scales = self.positions.scales[self.equations.chart.rows]
        scaled = matrix * scales[:, None] * scales
        values = np.linalg.eigvalsh((scaled + scaled.T) / 2)
        if not values[0] > NO_INERTIA * max(values[-1], 0.0):
            raise MechanismError(
                "the mechanism has no inertia along a motion that its drives allow, and so no motion in time; give its "
                "links a mass",
                "dynamics.forward",
            )

    def _sliding(self, velocity: Floats) -> Floats:
        """How fast the members of contacts move against each other, in radians or sizes of the mechanism."""
        positions = self.positions
        speeds = [
            positions.between(contact.on, contact.by, velocity) if contact.slide is None
            else velocity[len(positions.rows) + contact.slide] / positions.size
            for contact in self.equations.contacts
        ]  # fmt: skip
        return np.array(speeds).reshape(len(speeds), *velocity.shape[1:])

    def _scales(self, x: Floats, velocity: Floats, works: int) -> Floats:
        """Sizes of positions, velocities and work, of which errors are parts."""
        rates = self.equations.rates(np.zeros(1), x[:, None], velocity[:, None])
        fast = np.max(np.abs(velocity) / self.positions.scales)
        gain = np.sqrt(np.max(np.abs(rates.acceleration[:, 0]) / self.positions.scales))
        pace = max(fast, gain) if np.isfinite(gain) and max(fast, gain) > 0 else 1.0 / self.end
        matrix, _ = self.equations.matrix(0.0, x)
        rows = self.positions.scales[self.equations.chart.rows]
        self.pace = pace
        energy = float(np.max(np.abs(matrix) * rows[:, None] * rows)) * pace**2
        return np.concatenate([self.positions.scales, self.positions.scales * pace, np.full(works, energy)])

    def _function(self, time: float, state: Any) -> Any:
        """Derivative of the state: positions, velocities, work."""
        x, velocity, _ = self._parts_of(state[:, None])
        rates = self.equations.rates(np.array([time]), x, velocity)
        return np.concatenate([rates.velocity[:, 0], rates.acceleration[:, 0], rates.power[:, 0]])

    def _parts_of(self, states: Floats) -> tuple[Floats, Floats, Floats]:
        """Positions, velocities and works."""
        return states[: self.count], states[self.count : 2 * self.count], states[2 * self.count :]

    def _solver(self, time: float, state: Floats) -> DOP853:
        tolerance: Any = ABSOLUTE * self.scales  # one each, which the types of SciPy do not know
        steps: dict[str, Any] = {}
        if not self.equations.signs.all() and time < self.end:
            # What begins to slide does so within the first step; a load that moves what rests is not stepped over.
            steps = {"first_step": min(FIRST_STEP / self.pace, self.end - time), "max_step": LONGEST_REST * self.end}
        return DOP853(self._function, time, state, self.end, rtol=RELATIVE, atol=tolerance, **steps)

    def run(self, progress: Progress = NULL) -> Course:
        """Integrate; rows are evenly spread over the duration, or what the motion has reached of it."""
        count, seen = self.section.rows, 0
        progress.start(count, "instants")
        with np.errstate(all="ignore"):
            solver = self._solver(0.0, self.begin)
            failed, steps, bounces, reached = False, 0, 0, 0.0
            watches = bool(self.equations.contacts or list(self._watched()))
            while solver.status == "running":
                begin, steps = solver.t, steps + 1
                if steps > MAX_STEPS or not np.isfinite(solver.f).all() or solver.step() is not None:
                    failed = True
                    self._ended = f"{self._failure(steps, solver)} at {reached:.6g}"
                    break
                states = solver.dense_output()
                stop, reached = self._stop(states, begin, solver.t) if watches else (None, solver.t)
                self._stretches.append(self._stretch(states, reached))
                progress.update(int(count * reached / self.end) - seen)
                seen = int(count * reached / self.end)
                if stop is None:
                    self._release(solver.y)
                    solver = self._switched(solver)
                    continue
                state = states(reached)
                if stop.contact is not None:
                    solver = self._solver(reached, self._rested(stop.contact, reached, state))
                    continue
                after = self._bounced(stop, reached, state)
                bounces += 1
                if after is None or bounces > MAX_BOUNCES:
                    self._ended = self._ended or f"after {MAX_BOUNCES} bounces"
                    break
                solver = self._solver(reached, after)
            return self._course(np.linspace(0.0, reached, count) if reached else np.zeros(1), failed, steps)

    def _stretch(self, states: Callable[[Floats], Floats], until: float) -> Stretch:
        return Stretch(states, until, self.equations.chart, self.equations.last, self.equations.signs)

    def _failure(self, steps: int, solver: DOP853) -> str:
        """Why the motion ends before its time."""
        if steps > MAX_STEPS:
            return f"{MAX_STEPS} steps are not enough"
        x, velocity, _ = self._parts_of(solver.y[:, None])
        efforts = self.equations.rates(np.array([solver.t]), x, velocity).efforts[:, 0]
        if self.equations.jams:
            return f"friction in {self.equations.jams} jams the mechanism, no acceleration agrees with it,"
        for drive, effort in zip(self.equations.drives, efforts, strict=True):
            if not np.isfinite(effort):
                return f"the effort of {drive.name} is not finite"
        return "the motion cannot go on"

    def _release(self, state: Floats) -> None:
        """Let contacts that were at rest slide, once they move."""
        speeds, signs = self._sliding(self._parts_of(state)[1]), self.equations.signs
        self.equations.signs = np.where((signs == 0) & (np.abs(speeds) > STILL * self.pace), np.sign(speeds), signs)

    def _rested(self, contact: int, time: float, state: Floats) -> Floats:
        """The state at which a contact, and perhaps others with it, comes to rest."""
        equations = self.equations
        x, velocity, works = self._parts_of(state)
        linear = equations.chart.solve(x[:, None], equations.last)
        exact = self.positions.of(linear.configuration)[:, 0]
        velocity = equations.slopes(linear) @ velocity[equations.chart.rows]
        if np.abs(velocity / self.positions.scales).max() <= STILL * self.pace:
            velocity = np.zeros_like(velocity)
        speeds = self._sliding(velocity)
        speeds[contact] = 0.0
        equations.signs = np.where(np.abs(speeds) > STILL * self.pace, np.sign(speeds), 0.0)
        rates = equations.rates(np.array([time]), exact[:, None], velocity[:, None])
        # What begins to slide at once does so on the way that it is accelerated.
        begins = self._sliding(rates.acceleration[:, 0])
        begins = np.where(np.abs(begins) > STILL * self.pace**2, np.sign(begins), 0.0)
        equations.signs = np.where(equations.signs == 0, begins, equations.signs)
        slow = np.abs(rates.acceleration[:, 0] / self.positions.scales).max() <= STILL * self.pace**2
        if slow and not velocity.any():
            self.events.append(Event(STANDSTILL, time, rises=False))
        return np.concatenate([exact, velocity, works])

    def _course(self, times: Floats, failed: bool, steps: int) -> Course:
        """The motion at some times."""
        equations = self.equations
        numbers = np.searchsorted([stretch.end for stretch in self._stretches], times)
        parts = []
        for number in np.unique(numbers):
            states, _, equations.chart, equations.last, equations.signs = self._stretches[number]
            inside = times[numbers == number]
            x, velocity, work = self._parts_of(states(inside))
            poses = equations.chart.solve(x, equations.last).configuration
            parts.append((x, work, equations.rates(inside, x, velocity), poses))
        x, work = (np.concatenate([part[k] for part in parts], axis=-1) for k in (0, 1))
        rates = Rates(*(np.concatenate(values, axis=-1) for values in zip(*(part[2] for part in parts), strict=True)))
        vectors = self.mechanism.geometry.nominal
        whole = joined([part[3] for part in parts], times.shape, vectors, {})
        near = self.positions.near(x)
        whole = replace(whole, near=near, counted=frozenset(near))
        events = sorted(self.events, key=lambda event: event.time)
        return Course(self.positions, times, x, rates, work, whole, events, self._ended, failed, steps)

    def _switched(self, solver: DOP853) -> DOP853:
        """The solver with another chart, where its coordinates move much faster than those of this one."""
        equations = self.equations
        x, velocity, works = self._parts_of(solver.y)
        linear = equations.chart.solve(x[:, None], equations.last)
        if not regularity(linear)[0] >= MEETING:
            return solver
        equations.last = linear.configuration.take(0)
        if solver.status != "running":
            return solver
        slopes, rows = equations.slopes(linear), equations.chart.rows
        chart, volume = equations.atlas.best(slopes)
        if chart is equations.chart or volume * np.prod(self.positions.scales[rows]) < FASTER:
            return solver
        exact = self.positions.of(linear.configuration)[:, 0]
        velocity = slopes @ velocity[rows]
        equations.chart = chart
        return self._solver(solver.t, np.concatenate([exact, velocity, works]))

    def _watched(self) -> Iterator[Watch]:
        """Crossings, limits, and contacts that slide."""
        for name, coordinate in self.equations.crossings:
            value = radians(self.equations.study, coordinate, float(self.section.events[name].value))
            yield Watch(name, partial(_beyond, coordinate, value))
        places = self.mechanism.nominal
        for bound in self.mechanism.bounds:
            for k, (label, _) in enumerate(bound.margins(self.equations.last, places)):
                yield Watch(label, partial(_margin, bound, places, k), limit=bound.coordinate)
        for k, contact in enumerate(self.equations.contacts):
            if self.equations.signs[k]:
                yield Watch(contact.joint, partial(self._ahead, k), contact=k)

    def _ahead(self, contact: int, _: Configuration, states: Floats) -> Floats:
        """How fast a contact slides on the way that it slides."""
        speed: Floats = self.equations.signs[contact] * self._sliding(self._parts_of(states)[1])[contact]
        return speed

    def _stop(
        self, dense: Callable[[Floats], Floats], begin: float, end: float
    ) -> tuple[Watch | None, float]:  # fmt: skip
        """What ends a step first, if anything, and when; crossings up to there are noted."""
        times = begin + np.append(0.0, LOOKED_AT) * (end - begin)
        states = dense(times)
        poses = self._pose(states)
        stop, until, crossings = None, end, list[Event]()
        for watch in self._watched():
            values = np.broadcast_to(watch.function(poses, states), times.shape)
            for k in range(len(times) - 1):
                one, other = float(values[k]), float(values[k + 1])
                if watch.stops and other < 0:
                    # A limit that was just left counts as inside.
                    time = float(times[k]) if one <= 0 else self._root(dense, watch, times[k], times[k + 1])
                    if stop is None or time < until:
                        stop, until = watch, time
                    break
                if not watch.stops and one * other <= 0 and one != 0:
                    crossings.append(Event(watch.name, self._root(dense, watch, times[k], times[k + 1]), other > one))
        self.events += [event for event in crossings if event.time <= until]
        if stop is not None and stop.limit is not None:
            self.events.append(Event(stop.name, until, rises=False))
        return stop, until

    def _root(self, dense: Callable[[Floats], Floats], watch: Watch, begin: float, end: float) -> float:
        def at(time: float) -> float:
            states = dense(np.array([time]))
            return float(np.ravel(watch.function(self._pose(states), states))[0])

        return float(brentq(at, begin, end, xtol=1e-14 * self.end, rtol=1e-14))

    def _pose(self, states: Floats) -> Configuration:
        return self.equations.chart.solve(states[: self.count], self.equations.last).configuration

    def _bounced(self, stop: Watch, time: float, state: Floats) -> Floats | None:
        """The state behind a stop; None where the motion ends there.

        An impulse along the limit's coordinate g changes velocities by -(1 + e) M^-1 g (g v) / (g M^-1 g).
        """
        name, coordinate = stop.name, stop.limit
        assert coordinate is not None
        if self.section.restitution is None:
            self._ended = f"limit {name} is reached at {time:.6g}"
            return None
        x, velocity, works = self._parts_of(state)
        matrix, linear = self.equations.matrix(time, x)
        rows = self.equations.chart.rows
        along = np.array([np.ravel(first(linear.configuration, coordinate, part))[0] for part in linear.by_drives])
        velocity = velocity[rows]
        speed = float(along @ velocity)
        scale = self.positions.size if coordinate.quantity == "length" else 1.0
        if not self.section.restitution * abs(speed) > REST * self.pace * scale:
            self._ended = f"the mechanism rests at limit {name} from {time:.6g} on"
            return None
        impulse = np.linalg.solve(matrix, along)
        after = velocity - (1 + self.section.restitution) * impulse * speed / (along @ impulse)
        lost = 0.5 * (after @ matrix @ after - velocity @ matrix @ velocity)
        exact = self.positions.of(linear.configuration)[:, 0]
        velocity = self.equations.slopes(linear) @ after
        self.equations.signs = np.sign(self._sliding(velocity))
        return np.concatenate([exact, velocity, works[:1] + lost, works[1:]])
