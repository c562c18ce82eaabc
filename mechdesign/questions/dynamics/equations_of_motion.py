"""The equations of motion of a mechanism of any mobility under given efforts.

Inverse dynamics is affine in the accelerations: with q the coordinates of a chart, efforts Q = M(q) q'' + c(q, q', t).
One call without acceleration and with each unit acceleration gives c and the columns of M; M q'' = Q - c is the motion.

Where two assemblies meet the equations lose rank while the motion itself is smooth: its rates are those of poses before
and behind, interpolated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mechdesign.ground.errors import AssemblyError, MechanismError
from mechdesign.ground.expressions import Expression
from mechdesign.ground.notation import Step
from mechdesign.ground.numerics.arrays import Flags, Floats
from mechdesign.ground.numerics.linear import solved
from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.charts import Chart, ChartPositions, Charts, Sides, regularity
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import STALLED, Linearization
from mechdesign.mechanism.derivatives import regularity as regularity_of_drives
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.mechanism.friction import Rubbing, Rubs
from mechdesign.mechanism.outputs import Rates as Directions
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.statics import balance
from mechdesign.mechanism.stick_slip import accelerate
from mechdesign.motion.curve import from_sketch
from mechdesign.motion.failures import passed_limits
from mechdesign.motion.motion import in_study_units, radians
from mechdesign.motion.rows import Poses, instants
from mechdesign.motion.rules import GivenRows
from mechdesign.questions.dynamics.question import ForceQuestion
from mechdesign.questions.dynamics.schema import NOTHING, ForwardSection
from mechdesign.questions.loads import Loading
from mechdesign.study.schema.loads import VELOCITY, Load, Quantity

# Below this regularity two assemblies meet. Rates there follow from poses around, each this far from the next (radians,
# or sizes of the mechanism), by the polynomial through the nearest of them that are regular.
MEETING = 0.02
AROUND = 0.03 * np.array([-10, -9, -8, -7, -6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])
NEAREST = 8
# A mass matrix whose inverse condition is below this has no inertia along some motion.
NO_INERTIA = 1e-13


class RatesInTime(NamedTuple):
    """What the equations of motion give at some poses, each of shape (..., poses); angles in radians."""

    velocity: Floats  # of all positions
    acceleration: Floats
    power: Floats  # of efforts and loads, less what dampers and friction take; and if there is friction its own
    kinetic: Floats
    potential: Floats
    efforts: Floats  # of the drives
    friction: Floats  # in its contacts, as `Accelerations` has it
    slack: Floats  # of contacts at rest, likewise


class Branch(NamedTuple):
    """By which the equations are solved while nothing changes.

    Attributes
    ----------
    chart, last : Chart, Configuration
        Coordinates, and the pose that they were chosen in.
    signs : Floats, shape (contacts,)
        Of the contacts' velocities, 0 of those at rest.
    sides : Sides
        On which efforts, loads and couplings are kept, by the programs of corners; see `Expression.held`.
    window : tuple of float
        The instants between which it is. At its ends, which may be corners, what acts has the values of this side.
    """

    chart: Chart
    last: Configuration
    signs: Floats
    sides: Sides
    window: tuple[float, float]


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
            begin = {
                drive.name: np.atleast_1d(in_study_units(self.study.units, drive, at.value(drive))) for drive in drives
            }
            wound = from_sketch(self.study.motion(Poses(GivenRows(begin))))
            at = replace(at, near={**at.near, **{name: angle[0] for name, angle in wound.items()}})
        self.drives, friction = drives, question.friction
        self.contacts: Sequence[Rubbing] = friction.contacts if friction is not None else []
        #: The joint that jammed when rates were computed last.
        self.jams = ""
        self.positions = ChartPositions(mechanism, at, followed)
        self.atlas = Charts(self.positions)
        slopes = self.slopes(linear)
        chart, _ = self.atlas.best(slopes, ())
        self.branch = Branch(chart, at, np.zeros(len(self.contacts)), (), (-np.inf, np.inf))
        self.start = self.positions.start, slopes @ speeds

    @property
    def branch(self) -> Branch:
        """By which they are solved now."""
        return self._branch

    @branch.setter
    def branch(self, branch: Branch) -> None:
        before = getattr(self, "_branch", None)
        self._branch = branch
        if before is None or branch.sides != before.sides:
            self._hold(dict(branch.sides))

    def _hold(self, sides: Mapping[tuple[Step, ...], float]) -> None:
        """Keep efforts and loads on their sides."""
        section = self.question.section

        def held(quantity: Quantity) -> Quantity:
            return quantity.held(sides) if isinstance(quantity, Expression) else quantity

        def loaded(load: Load) -> Load:
            moment = None if load.moment is None else held(load.moment)
            return load.model_copy(update={"moment": moment, "force": load.force and (*map(held, load.force),)})

        self.efforts = {name: held(effort) for name, effort in self.section.efforts.items()}
        loads = (*map(loaded, section.loads),)
        self.acting = replace(self.question, section=section.model_copy(update={"loads": loads}))

    def _start(self, mechanism: Mechanism) -> tuple[Configuration, Linearization, Floats]:
        """The pose at the start, its derivatives by the drives, and their velocities."""
        study, given, sketch = self.study, self.section.start, mechanism.sketch_configuration
        values, speeds = [], []
        for name in mechanism.drives:
            drive = mechanism.coordinate(name)
            value = radians(study.units, drive, given[name]) if name in given else sketch.value(drive)
            values.append(np.asarray(value, dtype=float))
            speeds.append(float(radians(study.units, drive, given.get(f"{name}{VELOCITY}", 0.0))))
        pose = mechanism.forward.solve(values)
        if not pose.valid:
            why = "; ".join(passed_limits(mechanism, study.units, pose)) or mechanism.why(int(pose.reason))
            raise AssemblyError(f"the start of dynamics.forward: {why}")
        linear = mechanism.linearize(pose)
        if regularity_of_drives(linear) < STALLED:
            raise AssemblyError(
                "the start of dynamics.forward is a singular pose: there velocities of the drives do not say how the "
                "mechanism moves; start beside it"
            )
        return pose, linear, np.array(speeds)

    def slopes(self, linear: Linearization) -> Floats:
        """Derivatives of all positions by the given coordinates at a single pose, shape (m, mobility)."""
        return np.array([[np.ravel(first(linear.configuration, c, rates))[0] for rates in linear.by_drives]
                         for c in self.positions.coordinates], dtype=float)  # fmt: skip

    def rates(self, times: Floats, x: Floats, velocity: Floats) -> RatesInTime:
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

    def _rates(self, times: Floats, x: Floats, velocity: Floats) -> tuple[RatesInTime, Floats]:
        """Rates where the equations have full rank, and how regular they are."""
        chart, last, _, _, window = self.branch
        times = np.clip(times, *window)
        linear, count, shape = chart.solve(x, last), len(chart.rows), times.shape
        configuration, section = linear.configuration, self.acting.section
        moves = linear.velocity([*velocity[chart.rows]])
        cases = 1 + count + len(self.contacts)
        moving = Moving(moves, linear.acceleration(moves, [*np.eye(cases)[1 : count + 1, :, None]]))
        poses = instants(times)
        forces, energy = self.acting.acting(poses, configuration, moving)
        loading = Loading(self.study, section.loads, poses)
        given = [loading.value(self.efforts.get(d.name, NOTHING), forces, moving) for d in self.drives]
        efforts = np.array([np.broadcast_to(effort, shape) for effort in given], dtype=float)
        for drive, effort in zip(self.drives, efforts, strict=True):
            forces.on_coordinate(drive, effort)
        accelerations, friction, slack = self._accelerations(linear, forces, moving, shape)
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
        return RatesInTime(velocities, accelerated, powers, kinetic, potential, efforts, friction, slack), regularity(
            linear
        )

    def _accelerations(
        self, linear: Linearization, forces: Forces, moving: Moving, shape: tuple[int, ...]
    ) -> tuple[Floats, Floats, Floats]:
        """Accelerations of the chart's coordinates, friction in the contacts, and the slack of those at rest."""
        count = len(self.branch.chart.rows)
        if not self.contacts:
            efforts = balance(linear, forces).efforts
            table = np.array([np.broadcast_to(effort, (count + 1, *shape)) for effort in efforts])
            matrix = np.moveaxis(table[:, 1:] - table[:, :1], -1, 0)
            return (
                solved(matrix, -table[:, 0].T[..., None])[0][..., 0].T,
                np.empty((0, *shape)),
                np.empty((0, *shape)),
            )
        mechanism, question = self.study.mechanism, self.question
        assert moving.velocity is not None
        assert moving.acceleration is not None
        rubs = Rubs(question.joints, self.contacts, linear, forces, mechanism.engaged, mechanism.size)
        offsets = self._sliding(linear, moving.acceleration, (1 + count + len(self.contacts), *shape))[:, 0]
        answer = accelerate(rubs, self.branch.signs, self._sliding(linear, moving.velocity, shape), offsets)
        self.jams = next((self.contacts[k].joint for k in answer.jams if k >= 0), "")
        return answer.values, answer.friction, answer.slack

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
        linear, count = self.branch.chart.solve(x[:, None], self.branch.last), len(self.branch.chart.rows)
        still = linear.velocity([0.0] * count)
        moving = Moving(still, linear.acceleration(still, [*np.eye(count + 1)[1:, :, None]]))
        forces, _ = self.acting.acting(instants(np.array([time])), linear.configuration, moving)
        table = np.array([np.broadcast_to(e, (count + 1, 1)) for e in balance(linear, forces).efforts])[..., 0]
        return table[:, 1:] - table[:, :1], linear

    def check_inertia(self) -> None:
        """Check that there is inertia along every motion at the start."""
        matrix, _ = self.matrix(0.0, self.start[0])
        scales = self.positions.scales[self.branch.chart.rows]
        scaled = matrix * scales[:, None] * scales
        values = np.linalg.eigvalsh((scaled + scaled.T) / 2)
        if not values[0] > NO_INERTIA * max(values[-1], 0.0):
            raise MechanismError(
                "the mechanism has no inertia along a motion that its drives allow, and so no motion in time; give its "
                "links a mass",
                "dynamics.forward",
            )


def _weights(regular: Flags) -> Floats:
    """Weights of the poses `AROUND` one in what the polynomial through the nearest regular ones is there."""
    good = np.flatnonzero(regular)
    good = good[np.argsort(np.abs(AROUND[good]), kind="stable")[:NEAREST]]
    if len(good) < NEAREST:
        return np.full(len(AROUND), np.nan)
    places, weights = AROUND[good], np.zeros(len(AROUND))
    weights[good] = [np.prod([b / (b - a) for b in np.delete(places, k)]) for k, a in enumerate(places)]
    return weights
