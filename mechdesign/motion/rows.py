"""Poses at which a question is asked, by their rule: all of them, some, or places between; of one design or of many."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from mechdesign.ground.expressions import Number
from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.motion.rules import TIME, GivenRows, Rows
from mechdesign.study.text.fields import Model
from mechdesign.study.text.units import Amount

MAX_POSES = 10_000_000
_Section = TypeVar("_Section", bound=Model)


def _followed(number: float, parameters: Mapping[str, Floats], nominal: Mapping[str, float]) -> Number:
    """A number of a study: an array where it follows parameters that differ from the `nominal` ones."""
    expression = Amount.of(number).expression
    if expression is None or expression.names.isdisjoint(parameters):
        return float(number)
    return expression.evaluate({**nominal, **parameters})


@dataclass(frozen=True, eq=False)
class DesignNumbers:
    """The numbers of a study for some designs."""

    count: int = 1
    # Values that differ from the study's own design, shape (count,): parameters, and places (lengths, radians).
    parameters: Mapping[str, Floats] = field(default_factory=dict)
    places: Mapping[str, Floats] = field(default_factory=dict)
    nominal: Mapping[str, float] = field(default_factory=dict)  # every parameter of the study's own design
    changed: frozenset[str] = frozenset()  # names with values of their own, which no longer follow parameters

    def of(self, number: float) -> Floats:
        """A number of each design, shape (count,)."""
        value = _followed(number, self.parameters, self.nominal)
        return np.broadcast_to(np.asarray(value, dtype=float), self.count)

    def moves(self, number: float) -> bool:
        """Whether designs differ in a number."""
        expression = Amount.of(number).expression
        return expression is not None and not expression.names.isdisjoint(self.parameters)

    def take(self, designs: Ints) -> DesignNumbers:
        """Those of some designs."""
        parameters, places = (
            {name: values[designs] for name, values in part.items()} for part in (self.parameters, self.places)
        )
        return replace(self, count=len(designs), parameters=parameters, places=places)


OWN = DesignNumbers()
"""Those of the study's own design."""


class PoseGroup(NamedTuple):
    """Poses that give the same coordinates, as many as the mobility: their names, and the rows of the poses."""

    names: tuple[str, ...]
    rows: Ints


class PoseNumbers:
    """Numbers of a study at poses, where parameters may differ from pose to pose."""

    if TYPE_CHECKING:

        @property
        def parameters(self) -> Mapping[str, Floats]:
            """Parameters that differ from the study's own, at each pose, in the study's units."""

        @property
        def nominal(self) -> Mapping[str, float]:
            """Every parameter of the study's own design."""

        @property
        def times(self) -> Floats | None:
            """Time of each pose of a motion over time."""

    def of(self, number: float) -> Number:
        """A number of the study: an array where it follows parameters that differ."""
        return _followed(number, self.parameters, self.nominal)

    def section(self, section: _Section) -> _Section:
        """A section of the study, with arrays where its numbers follow such parameters."""
        return section.with_numbers(self.of) if self.parameters else section


@dataclass(frozen=True, eq=False)
class Poses(PoseNumbers):
    """All poses of a question, of several designs one design's after the other's; or some of them.

    Parameters
    ----------
    picked : pair of ndarray, shape (n,), optional
        Lines and rows of some of the poses, or places between them.
    """

    rule: Rows
    own: DesignNumbers = OWN
    picked: tuple[Ints, Ints | Floats] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {part.name: getattr(self, part.name) for part in fields(self)}

    @property
    def places_along(self) -> tuple[Ints, Ints | Floats]:
        """Line and row of each pose, shape (count,)."""
        return self.picked or self._rows(np.arange(self.count))

    def _rows(self, number: Ints) -> tuple[Ints, Ints]:
        """Lines and rows by their numbers."""
        line, row = np.divmod(number, max(self.rule.grid[-1], 1))
        return line, row

    @cached_property
    def named(self) -> Mapping[str, Floats]:
        """Time along a motion over time, and every coordinate, over all poses, shape (count,)."""
        return self.rule.at(*self.places_along)

    @property
    def values(self) -> dict[str, Floats]:
        """Every coordinate over all poses, shape (count,); nan where a pose does not give it."""
        return {name: values for name, values in self.named.items() if name != TIME}

    @property
    def times(self) -> Floats | None:
        return self.named.get(TIME)

    @cached_property
    def rates(self) -> tuple[Mapping[str, Floats], Mapping[str, Floats]]:
        """First and second derivatives of what is given, by the length of a point's path or by time, shape (count,).

        In the study's units; nan where the path has no direction.
        """
        return self.rule.rates(*self.places_along)

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.picked[0]) if self.picked is not None else self.own.count * math.prod(self.rule.grid)

    @property
    def grid(self) -> tuple[int, ...]:
        """Numbers of values of each swept coordinate of a design, the last fastest; one number for lists and paths."""
        return (self.count,) if self.picked is not None else self.rule.grid

    @property
    def designs(self) -> int:
        """Number of designs, each with as many poses."""
        return 1 if self.picked is not None else self.own.count

    @property
    def listed(self) -> bool:
        """Whether a person listed these very poses, so that one that fails is an error."""
        return self.rule.listed

    @property
    def names(self) -> tuple[str, ...]:
        """Every coordinate that some pose gives, in the order of the study."""
        return self.rule.names

    @cached_property
    def groups(self) -> Sequence[PoseGroup]:
        """The poses by what they give: one group, unless listed poses give different coordinates."""
        number = self.rule.number
        if number is None:
            return [PoseGroup(self.names, np.arange(self.count))]
        own = number[self.places_along[1]]
        return [
            PoseGroup(names, rows) for k, names in enumerate(self.rule.kinds) if len(rows := np.flatnonzero(own == k))
        ]

    @property
    def line(self) -> int:
        """Poses that follow one another: those of a motion, or of a line of a grid along its last coordinate."""
        return self.grid[-1]

    @property
    def closed(self) -> bool:
        """Whether the motion goes on from the last pose to the first."""
        return self.rule.closed

    @property
    def end(self) -> int:
        """Last place of a motion or a line, in rows."""
        return self.line - 1 + self.closed

    @property
    def design(self) -> Ints:
        """The design of each pose."""
        return self.places_along[0] // max(math.prod(self.rule.grid[:-1]), 1)

    @property
    def places(self) -> dict[str, Floats]:
        """Dimensions in which designs differ from the study's own, at each pose, shape (count,); lengths, radians."""
        return {name: values[self.design] for name, values in self.own.places.items()}

    @property
    def nominal(self) -> Mapping[str, float]:
        return self.own.nominal

    @cached_property
    def parameters(self) -> dict[str, Floats]:
        return {name: values[self.design] for name, values in self.own.parameters.items()}

    @property
    def followed(self) -> bool:
        """Whether they are those of motions, a line each, of which something can be said between the poses."""
        return not self.listed and len(self.rule.grid) == 1 and self.rule.grid[-1] > 1

    @property
    def swept(self) -> str | None:
        """Time, or the one coordinate that moves along a motion; None of listed poses, and where several do."""
        if self.listed:
            return None
        if self.times is not None:
            return TIME
        moving = self.moving
        return moving[0] if len(moving) == 1 else None

    @property
    def abscissa(self) -> Floats:
        """What is swept, at each pose, or the row of the pose; shape (count,)."""
        if self.times is not None:
            return self.times
        return self.numbers if self.swept is None else self.named[self.swept]

    @cached_property
    def moving(self) -> list[str]:
        """Coordinates that change from pose to pose of a design."""
        columns = {name: values.reshape(self.designs, -1) for name, values in self.values.items()}
        return [name for name, values in columns.items() if (np.ptp(values, axis=1) > 0).any()]

    def pace(self, line: Ints, s: Floats, of: str | None = None) -> Floats:
        """How fast a motion passes places, shape (n,): change of time, of a path's length or of what is swept, a row.

        Means along the motion are by these; where several coordinates move without a path they are by rows, unless `of`
        says which of them counts.
        """
        return self.rule.pace(line, s, self.swept or of)

    @property
    def numbers(self) -> Floats:
        """The row of each pose among those of its design, shape (count,)."""
        line, row = self.places_along
        return row.astype(float) + self.rule.grid[-1] * (line % max(math.prod(self.rule.grid[:-1]), 1))

    def along(self, line: Ints, s: Ints | Floats) -> Poses:
        """Poses at places of some lines, in rows from 0 to `end`; beyond these the motion goes on straight or round."""
        return replace(self, picked=(line, s))

    def take(self, rows: Ints | slice) -> Poses:
        """Some of the poses, in their order."""
        if self.picked is not None:
            return replace(self, picked=(self.picked[0][rows], self.picked[1][rows]))
        numbers = np.arange(*rows.indices(self.count)) if isinstance(rows, slice) else rows
        return replace(self, picked=self._rows(numbers))

    def some(self, designs: Ints) -> Poses:
        """The poses of some designs."""
        return Poses(self.rule.take(designs), self.own.take(designs))


def instants(times: Floats) -> Poses:
    """Poses of which nothing but the time is known."""
    return Poses(GivenRows({TIME: times}, listed=True))


#: No poses, for what is asked of none.
NOWHERE = Poses(GivenRows({}))
