"""Segments of a motion or of a cam's law: moves by a motion law and dwells, one after another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from mechdesign.ground.motion_laws import LAWS
from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element

_MEANINGS = {name: law.meaning for name, law in LAWS.items()}


@dataclass(frozen=True)
class LawSegment(Element):
    """Part of the law of a cam: a move ``to`` a value ``over`` a part of what is followed, or a ``dwell``."""

    one_of = ("a segment of a law is a move, {to: 30, over: 120}, or a {dwell: 60}", "to", "dwell")

    from_: declared.AnySize | None = None
    """Value at which the law begins, in its first segment only. Left out: it repeats, and begins where it ends.
    Example: 0
    """
    to: declared.AnySize | None = None
    """Value at the end of the move, of the coordinate that follows. Example: 30"""
    over: Annotated[float, declared.Size(None, 0.0, exclusive=True, fixed=True)] | None = None
    """Part of the coordinate that is followed over which it moves. Example: 120"""
    law: Annotated[str, declared.Choice(_MEANINGS, "motion law")] = "polynomial345"
    """Law of the move. Example: cycloidal"""
    dwell: Annotated[float, declared.Size(None, 0.0, exclusive=True, fixed=True)] | None = None
    """Part of the coordinate that is followed over which what follows stands still. Example: 60"""

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        return segment_faults(given, "over", "an angle or a length", 90)


def segment_faults(given: Any, way: str, noun: str, example: float) -> Iterator[str]:
    """Sentences about keys of a segment that do not go together; `way` is the key of how long its move is, a `noun`."""
    if given.to is not None and getattr(given, way) is None:
        yield f"the move to {given.to:g} needs {noun}: {{to: {given.to:g}, {way}: {example:g}}}"
    beside = [key for key in (way, "law") if key in given.model_fields_set]
    if given.dwell is not None and beside:
        yield f"a dwell has no {beside[0]!r}: write {{dwell: {given.dwell:g}}}"


def segments_faults(segments: Sequence[Any], there: str, back: str) -> Iterator[str]:
    """Sentences about segments that make no motion; `there` and `back` are examples of moves."""
    for number, segment in enumerate(segments[1:], start=2):
        if segment.from_ is not None:
            yield f"segment {number} begins where the one before it ends: 'from' is for the first one"
    moves = sum(segment.to is not None for segment in segments)
    if segments and (not moves or (segments[0].from_ is None and moves < 2)):
        yield (
            "without 'from' it is a cycle that begins where it ends, and so needs two moves or more, "
            f"[{there}, {back}]; else say where it begins, [{{from: 0, {there[1:]}]"
        )
