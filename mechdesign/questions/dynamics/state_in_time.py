"""A motion in time at its present instant: its state, and what happened before."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.dynamics.equations_of_motion import EquationsOfMotion
from mechdesign.questions.dynamics.instants import Instants

STANDSTILL = "standstill"


class EventInTime(NamedTuple):
    """A crossing, a limit that is reached, or a standstill, at a time."""

    name: str
    time: float
    rises: bool


class EndOfRun(NamedTuple):
    """Why a motion ends before its time.

    A ``limit`` of the study, and a ``rest`` at it, belong to the motion, and so does friction that ``jams`` it: it is
    whole. Where something has ``no value``, or where steps or time are ``spent``, the rest of it is missing.

    Attributes
    ----------
    words : str
        In words, with ``{time}`` in place of the time.
    place : str
        Where a whole motion ends, in words.
    """

    kind: Literal["limit", "rest", "jams", "no value", "spent"]
    words: str
    place: str = ""


class MotionInTime:
    """The state of a motion, positions, velocities and works, and the equations by which it goes on.

    Attributes
    ----------
    scales : Floats
        Sizes of the numbers of the state, of which errors are parts.
    pace : float
        The usual velocity, in sizes of positions.
    ending : EndOfRun, optional
        Why it ended before its time.
    jumps : list of tuple of str and float
        Laws of couplings with a corner at which velocities jumped, in words, and when.
    """

    def __init__(self, equations: EquationsOfMotion) -> None:
        self.equations, self.positions = equations, equations.positions
        self.section, self.mechanism = equations.section, equations.study.mechanism
        self.end = float(self.section.duration)
        self.count = len(self.positions.scales)
        x, velocity = equations.start
        equations.check_inertia()
        works = 2 if equations.contacts else 1
        self.time, self.state = 0.0, np.concatenate([x, velocity, np.zeros(works)])
        equations.branch = equations.branch._replace(signs=np.sign(self.sliding(velocity)))
        self.pace, self.scales = self._sizes_of_state(x, velocity, works)
        self.events: list[EventInTime] = []
        self.ending: EndOfRun | None = None
        self.jumps: list[tuple[str, float]] = []

    def sliding(self, velocity: Floats) -> Floats:
        """How fast the members of contacts move against each other, in radians or sizes of the mechanism."""
        positions = self.positions
        speeds = [
            positions.between(contact.on, contact.by, velocity) if contact.slide is None
            else velocity[len(positions.rows) + contact.slide] / positions.size
            for contact in self.equations.contacts
        ]  # fmt: skip
        return np.array(speeds).reshape(len(speeds), *velocity.shape[1:])

    def _sizes_of_state(self, x: Floats, velocity: Floats, works: int) -> tuple[float, Floats]:
        """The usual velocity, and the sizes of positions, velocities and work."""
        rates = self.equations.rates(np.zeros(1), x[:, None], velocity[:, None])
        fast = np.max(np.abs(velocity) / self.positions.scales)
        gain = np.sqrt(np.max(np.abs(rates.acceleration[:, 0]) / self.positions.scales))
        pace = max(fast, gain) if np.isfinite(gain) and max(fast, gain) > 0 else 1.0 / self.end
        matrix, _ = self.equations.matrix(0.0, x)
        rows = self.positions.scales[self.equations.branch.chart.rows]
        energy = float(np.max(np.abs(matrix) * rows[:, None] * rows)) * pace**2
        return pace, np.concatenate([self.positions.scales, self.positions.scales * pace, np.full(works, energy)])

    def parts_of(self, states: Floats) -> tuple[Floats, Floats, Floats]:
        """Positions, velocities and works."""
        return states[: self.count], states[self.count : 2 * self.count], states[2 * self.count :]

    def instants(self, times: Floats, states: Floats) -> Instants:
        """The motion at some instants."""
        x, velocity, _ = self.parts_of(states)
        return Instants(self.equations, times, x, velocity)

    def stands_still(self) -> None:
        """Note that friction holds the whole mechanism from now on."""
        self.events.append(EventInTime(STANDSTILL, self.time, rises=False))
