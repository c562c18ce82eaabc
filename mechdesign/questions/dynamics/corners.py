"""Where what acts on a motion in time is not smooth: corners of efforts, loads, measures in these, and couplings.

Corners that depend on time alone are instants, all known before. Those that depend on the motion are functions of it
whose signs change there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechdesign.ground.expressions import Corner, Expression
from mechdesign.ground.notation import Step
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.numerics.sign_changes import Resolved
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.rules import TIME
from mechdesign.questions.dynamics.instants import Instants
from mechdesign.questions.dynamics.schema import ForwardSection
from mechdesign.study import Study
from mechdesign.study.schema.loads import VELOCITY, Load, Quantity

# Parts of the duration in which corners in time are looked for first.
PARTS = 32
# An expression of time has a pole where it grows so much faster than it did twice as far away: a simple pole doubles.
POLE, NEAR_POLE = 1.7, 1e-12
# Growth below this part of a value is rounding.
GROWTH = 1e-6


class ActingExpression(NamedTuple):
    """An expression that acts on the motion, in words; of a coordinate where it is a measure's or a `coupling`'s."""

    words: str
    expression: Expression
    coordinate: Coordinate | None = None
    coupling: bool = False

    def value(self, part: Expression, instants: Instants) -> Floats:
        """Value of a part of the expression along the motion."""
        if self.coordinate is None:
            value: Value = instants.loading.value(part, instants.forces, instants.moving)
        else:
            value = part.evaluate(instants.configuration.user_values(self.coordinate))
        return np.broadcast_to(np.asarray(value, dtype=float), instants.times.shape)


@dataclass(frozen=True, eq=False)
class Threshold:
    """A corner that depends on the motion: where its argument passes a level, or one of levels with a period."""

    acting: ActingExpression
    corner: Corner
    level: float

    @property
    def key(self) -> tuple[tuple[Step, ...], float]:
        """The same of the same corner."""
        return self.corner.argument.program, self.level

    def value(self, instants: Instants, sides: Mapping[tuple[Step, ...], float]) -> Floats:
        """A function that changes its sign there; corners within the argument are kept on their sides."""
        argument = self.acting.value(self.corner.argument.held(sides), instants)
        return _of_level(argument, self.corner, self.level)


def _of_level(argument: Floats, corner: Corner, level: float) -> Floats:
    away = argument - level
    return np.asarray(np.sin(np.pi * away / corner.period)) if corner.period else away


class Corners:
    """Corners of all that acts on a motion in time."""

    def __init__(self, study: Study, loads: Iterable[Load], section: ForwardSection) -> None:
        self.study, self.end = study, float(section.duration)
        self.acting = [*_acting(study, loads, section)]
        self._thresholds: dict[tuple[tuple[Step, ...], float], Threshold] = {}
        #: What is not linear between its corners, and so may be narrow there.
        self.curved = [acting for acting in self.acting if not _straight(acting.expression)]
        #: Of each, corners where it may have peaks.
        self.peaks = [[c for c in acting.expression.corners() if c.turning] for acting in self.curved]
        #: Couplings with a table, each with its rows and their period.
        self.tables: list[tuple[ActingExpression, Corner]] = []
        self._in_time: list[Corner] = []
        for acting in self.acting:
            for corner in _corners_of(acting):
                names = corner.argument.names - study.parameters.nominal.keys()
                if names == {TIME}:
                    self._in_time.append(corner)
                elif names:
                    self._add(acting, corner)

    def _add(self, acting: ActingExpression, corner: Corner) -> None:
        """Of a table the ends are corners, and not the rows, at which it is smooth enough."""
        levels = corner.levels
        if len(levels) > 2:
            self.tables.append((acting, corner))
            levels = () if corner.period else (levels[0], levels[-1])
        for level in levels:
            threshold = Threshold(acting, corner, level)
            self._thresholds.setdefault(threshold.key, threshold)

    @property
    def thresholds(self) -> Collection[Threshold]:
        """Corners that depend on the motion."""
        return self._thresholds.values()

    @cached_property
    def instants(self) -> Floats:
        """Instants of the corners, and of the narrow peaks, that depend on time alone, within the duration."""
        parts = np.linspace(0.0, self.end, PARTS + 1)
        marks = np.array([0.0, self.end])
        for corner in self._in_time:
            for level in corner.levels or (0.0,):

                def look(times: Floats, corner: Corner = corner, level: float = level) -> Floats:
                    return _of_level(self._at(corner.argument, times), corner, level)[None]

                resolved = Resolved.of(look, np.union1d(parts, marks), np.zeros(1))
                places = resolved.touched() if corner.levels else np.empty(0)
                marks = np.union1d(marks, [*places, *(resolved.turning() if corner.turning else ())])
        return marks[1:-1]

    def pole(self, time: float) -> str:
        """What has no bound at a corner in time, in words; empty where everything has."""
        step = NEAR_POLE * self.end * np.array([4.0, 2.0, 1.0])
        for acting in self.acting:
            if acting.expression.names - self.study.parameters.nominal.keys() != {TIME}:
                continue
            for side in (-1.0, 1.0):
                values = np.abs(self._at(acting.expression, time + side * step))
                growth = np.diff(values)
                if growth[1] > max(POLE * growth[0], GROWTH * values[2]) > 0:
                    return acting.words
        return ""

    def _at(self, expression: Expression, times: Floats) -> Floats:
        """Values of an expression of time and parameters."""
        value = expression.evaluate({**self.study.parameters.nominal, TIME: times})
        return np.broadcast_to(np.asarray(value, dtype=float), times.shape)


def _acting(study: Study, loads: Iterable[Load], section: ForwardSection) -> Iterator[ActingExpression]:
    """Everything that acts: efforts, loads, measures in their expressions, couplings."""
    quantities: list[tuple[str, Quantity]] = [(f"the effort of {name}", part) for name, part in section.efforts.items()]
    for load in loads:
        between = load.between and " and ".join(load.between)
        place = load.at or (f"between {between}" if between else "")
        for _, quantity, kind in load.numbers:
            where = f"the moment on {load.link}" if kind == "moment" else f"the force at {place}"
            quantities.append((where.replace("at between", "between"), quantity))
    for words, quantity in quantities:
        if isinstance(quantity, Expression):
            yield ActingExpression(words, quantity)
    used = {name.removesuffix(VELOCITY) for _, quantity in quantities if isinstance(quantity, Expression)
            for name in quantity.names - study.parameters.nominal.keys() - {TIME}}  # fmt: skip
    for name in sorted(used):
        yield from _expressions(f"measure {name}", study.mechanism.coordinate(name))
    for coupling in study.mechanism.couplings:
        yield from _expressions(f"coupling {coupling.name}", coupling.function, coupling=True)


def _straight(expression: Expression) -> bool:
    """Whether an expression is linear between its corners."""
    sums = {"min": "+", "max": "+", "abs": "negate"}
    program = (*((kind, sums.get(str(item), item)) for kind, item in expression.program),)
    return replace(expression, program=program).is_linear()


def _expressions(words: str, coordinate: Coordinate, *, coupling: bool = False) -> Iterator[ActingExpression]:
    """A coordinate's expression, after those of its parts."""
    for part in coordinate.parts:
        yield from _expressions(words, part, coupling=coupling)
    if coordinate.expression is not None:
        yield ActingExpression(words, coordinate.expression, coordinate, coupling)


def _corners_of(acting: ActingExpression) -> list[Corner]:
    corners = acting.expression.corners()
    # An arctangent that is followed through all turns does not jump.
    turned = acting.coordinate is not None and acting.coordinate.turn and acting.expression.program[-1][1] == "atan2"
    return corners[:-1] if turned else corners
