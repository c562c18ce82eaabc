"""Springs and dampers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element, Term

Number = TypeVar("Number", float, Value)


@dataclass(frozen=True)
class Spring(Element):
    """A spring or damper between two points of any links, or between two links."""

    between: Annotated[tuple[declared.EndName, declared.EndName], declared.Two("a list of two points or two links")]
    """Two points, which it pulls together, or two links [a, b], of which it turns b back. Example: [S, B] Example:
    [ground, rocker]
    """
    stiffness: Annotated[Term, declared.Size("stiffness", 0.0, between=True)] = 0.0
    """Force per length, or moment per radian. Example: 2 N/mm Example: 3 N*m/rad"""
    free_length: declared.NonNegativeLength = 0.0
    """Distance of the points at which the stiffness pulls with no force; 0 is allowed. Example: 60"""
    free_angle: declared.Angle = 0.0
    """Angle from the first link's x axis to the second's at which it turns with no moment. Its whole turns count, and
    those of the links from the sketch on. Example: 20 deg Example: -250 deg
    """
    preload: Annotated[Term, declared.Size("force", between=True)] = 0.0
    """Pull, or moment, at the free length or angle. Left out: 0. Example: 5 N"""
    damping: Annotated[Term, declared.Size("damping", 0.0, between=True)] = 0.0
    """Force per velocity, or moment per radian in a unit of time. Left out: 0. Example: 0.01 N*s/mm"""
    force: Annotated[Term, declared.Size("force", between=True)] = 0.0
    """Of a gas spring the force with which it pushes its points apart. Example: 400 N"""
    rise: Annotated[Term, declared.Size("stiffness", 0.0, between=True)] = 0.0
    """Of a gas spring what this force grows by per length that it is shorter than ``free_length``. Left out: 0.
    Example: 0.4 N/mm
    """
    turning: bool = False

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if given.force is not None:
            for other in given.given("stiffness", "preload", "free_angle"):
                yield f"a gas spring has 'force' and 'rise', no {other!r}"
            if (given.rise is None) != (given.free_length is None):
                yield "the 'rise' of a gas spring counts from its 'free_length'; give both or none"
        elif given.rise is not None:
            yield "'rise' belongs to the 'force' of a gas spring"
        elif not given.given("stiffness", "preload", "damping"):
            yield "a spring needs a 'stiffness', a 'preload', a 'damping' or the 'force' of a gas spring"
        elif given.stiffness is not None and len(given.given("free_length", "free_angle")) != 1:
            yield "a stiffness counts from a 'free_length' between points, or a 'free_angle' between links"

    @classmethod
    def foreign(cls, *, turning: bool) -> tuple[str, ...]:
        """Keys that it does not have between two links, or between two points."""
        return ("free_length", "force", "rise") if turning else ("free_angle",)

    def pull(self, value: Callable[[Term], Number]) -> tuple[Number, Number, Number, Number]:
        """Numbers of its pull ``constant + stiffness (x - free) + damping x'``, x the distance or the angle.

        `value` gives that of a term.
        """
        rate, free = value(self.stiffness or self.rise), value(self.free_angle or self.free_length)
        return value(self.preload) - value(self.force), rate, free, value(self.damping)
