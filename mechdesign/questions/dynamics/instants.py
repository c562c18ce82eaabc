"""A motion in time at some instants, of which no more is computed than is looked at."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Configuration
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.forces import Forces, Moving
from mechdesign.motion.rows import instants
from mechdesign.questions.loads import Loading

if TYPE_CHECKING:
    from mechdesign.questions.dynamics.equations_of_motion import EquationsOfMotion, RatesInTime


class Instants:
    """Times of shape (n,), and positions and velocities there of shape (m, n)."""

    def __init__(self, equations: EquationsOfMotion, times: Floats, x: Floats, velocity: Floats) -> None:
        self.equations, self.times, self.x, self.velocity = equations, times, x, velocity

    @cached_property
    def linear(self) -> Linearization:
        """The poses, ready for derivatives by the chart's coordinates."""
        return self.equations.branch.chart.solve(self.x, self.equations.branch.last)

    @property
    def configuration(self) -> Configuration:
        """The poses."""
        return self.linear.configuration

    @cached_property
    def moving(self) -> Moving:
        """Velocities."""
        return Moving(self.linear.velocity([*self.velocity[self.equations.branch.chart.rows]]))

    @cached_property
    def rates(self) -> RatesInTime:
        """What the equations of motion give."""
        return self.equations.rates(self.times, self.x, self.velocity)

    @cached_property
    def forces(self) -> Forces:
        """No forces yet."""
        return Forces(self.configuration)

    @cached_property
    def loading(self) -> Loading:
        """By which expressions get their values."""
        return Loading(self.equations.study, (), instants(self.times))
