"""What is looked for within each step of a motion in time: functions that change their signs there."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from mechdesign.ground.numerics import chebyshev
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.core import Bound
from mechdesign.motion.motion import radians
from mechdesign.questions.dynamics.corners import Corners
from mechdesign.questions.dynamics.equations_of_motion import EquationsOfMotion
from mechdesign.questions.dynamics.instants import Instants

# A step passes at most so many rows of a coupling's table, so that none of its lobes is stepped over.
ROWS_PASSED = 2
# What acts is known where the error of its series in a step is less than this part of its size.
KNOWN = 1e-3


class Watch(NamedTuple):
    """A function whose sign is followed, and what a change of it is.

    Of an ``event`` it is a crossing. At others the step ends: at a ``limit`` of motion, at a ``contact`` that comes to
    rest or begins to slide (``hold``) where the function becomes negative, at a ``corner`` where it changes at all.
    `key` is the name or number of what it is about.
    """

    kind: Literal["event", "limit", "contact", "hold", "corner"]
    key: Hashable
    function: Callable[[Instants], Value]
    name: str = ""
    coordinate: Coordinate | None = None


class Watches:
    """The watches of a motion in time; `sliding` gives how fast contacts slide from velocities."""

    def __init__(self, equations: EquationsOfMotion, corners: Corners, sliding: Callable[[Floats], Floats]) -> None:
        self.equations, self.corners, self._sliding = equations, corners, sliding
        self._lasting = [*self._events(), *self._limits()]
        # How large what acts was.
        self._sizes = [0.0] * len(corners.curved)

    def __iter__(self) -> Iterator[Watch]:
        branch = self.equations.branch
        yield from self._lasting
        sides = dict(branch.sides)
        for threshold in self.corners.thresholds:
            yield Watch("corner", threshold.key, partial(threshold.value, sides=sides))
        for k, sign in enumerate(branch.signs.tolist()):
            if sign:
                yield Watch("contact", k, partial(self._ahead, k, sign))
            else:
                yield Watch("hold", k, partial(_slack, k))

    def rows_of_tables(self, instants: Instants) -> tuple[float, float]:
        """How many times longer a step may be by the rows of tables that it passes, and until when it may go.

        The end of a step that passes too many is the last of its instants before the first of these rows.
        """
        until, longer = np.inf, np.inf
        for acting, corner in self.corners.tables:
            argument, first = acting.value(corner.argument, instants), corner.levels[0]
            turns = np.floor((argument - first) / corner.period) if corner.period else np.zeros(len(argument))
            rows = np.searchsorted(corner.levels, argument - turns * corner.period) + turns * (len(corner.levels) - 1)
            passed = float(np.ptp(rows))
            longer = min(longer, ROWS_PASSED / max(passed, 1.0))
            if passed > ROWS_PASSED:
                until = min(until, float(instants.times[max(int((rows != rows[0]).argmax()) - 1, 0)]))
        return longer, until

    def curved(self, look: Callable[[Floats], Instants], nodes: Instants, begin: float, end: float) -> float | None:
        """Before when a step has more of what acts in it than its nodes tell; None where they tell all.

        `look` gives the motion at other instants of the step.
        """
        sides, curved = dict(self.equations.branch.sides), None
        for k, acting in enumerate(self.corners.curved):
            held = acting.expression.held(sides)
            values = np.nan_to_num(acting.value(held, nodes))
            size = self._sizes[k] = max(self._sizes[k], float(np.abs(values).max()))
            series = chebyshev.series(values)
            if chebyshev.remainder(series) > KNOWN * size:
                return end
            for corner in self.corners.peaks[k]:
                argument = np.nan_to_num(acting.value(corner.argument.held(sides), nodes))
                _, x, _ = chebyshev.turning_points(chebyshev.series(argument)[None])
                if not len(x):
                    continue
                times = (begin + end) / 2 + x * (end - begin) / 2
                peaks = np.nan_to_num(acting.value(held, look(times)))
                off = np.abs(peaks - chebyshev.value(np.repeat(series[None], len(x), axis=0), x))
                if (off > KNOWN * max(size, float(np.abs(peaks).max()))).any():
                    curved = min(times.min(), end if curved is None else curved)
        return curved

    def _events(self) -> Iterator[Watch]:
        section, study = self.equations.section, self.equations.study
        for name, coordinate in self.equations.crossings:
            value = radians(study.units, coordinate, float(section.events[name].value))
            yield Watch("event", name, partial(_beyond, coordinate, value))

    def _limits(self) -> Iterator[Watch]:
        mechanism = self.equations.study.mechanism
        for number, bound in enumerate(mechanism.bounds):
            for k, (label, _) in enumerate(bound.margins(self.equations.branch.last, mechanism.nominal)):
                margin = partial(_margin, bound, mechanism.nominal, k)
                yield Watch("limit", (number, k), margin, label, bound.coordinate)

    def _ahead(self, contact: int, sign: float, instants: Instants) -> Floats:
        """How fast a contact slides on the way that it slides."""
        return np.asarray(sign * self._sliding(instants.velocity)[contact])


def _beyond(coordinate: Coordinate, value: Value, instants: Instants) -> Value:
    """By how much a coordinate is beyond a value."""
    return instants.configuration.value(coordinate) - value


def _margin(bound: Bound, places: Mapping[str, Value], k: int, instants: Instants) -> Value:
    """Margin of a limit by its number."""
    return [margin for _, margin in bound.margins(instants.configuration, places, smooth=True)][k]


def _slack(contact: int, instants: Instants) -> Floats:
    """What is left of the friction of a contact at rest."""
    return np.asarray(instants.rates.slack[contact])
