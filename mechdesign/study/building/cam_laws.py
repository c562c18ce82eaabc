"""Laws of couplings as expressions: moves and dwells one after another, again over their sum."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import accumulate
from typing import Any

from mechdesign.ground.expressions import Expression
from mechdesign.ground.functions import Rise, Share
from mechdesign.ground.motion_laws import LAWS
from mechdesign.ground.notation import Called, Step, call_steps, constant_step
from mechdesign.mechanism.elements.couplings import Coupling
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.study.building.builder import ROOT, Builder
from mechdesign.study.building.elements import Written
from mechdesign.study.building.joints import refuse
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.units import Amount

# Numbers of turns that differ from a whole one by this part of it are whole.
WHOLE = 1e-9

Program = tuple[Step, ...]


def law_of(builder: Builder, name: str, segments: Sequence[Any], of: str, kind: Quantity) -> Expression:
    """The law of a coupling as an expression of the coordinate `of` and of parameters; see `LawSegment`.

    `kind` is the quantity of what follows.
    """

    def number(k: int, key: str, value: Amount, quantity: Quantity) -> Program:
        builder.reporter.kind((*ROOT, "couplings", name, "law", k, key), quantity)
        if value.expression is None:
            return constant_step(float(value))
        builder.parameters_in(value.expression)
        return value.expression.program

    over, first = builder.section.coordinates[of], segments[0].from_
    ends = {k: number(k, "to", segment.to, kind) for k, segment in enumerate(segments) if segment.to is not None}
    law = before = [*ends.values()][-1] if first is None else number(0, "from", first, kind)
    lengths = [number(k, way(segment), length(segment), over) for k, segment in enumerate(segments)]
    rises = _rises(segments, (("name", of),), lengths)
    for k, end in ends.items():
        law, before = _called("+", law, _moved(_called("-", end, before), rises(k))), end
    return Expression(_words(segments), law, builder.units.angle_factor)


def _called(function: Called, *arguments: Program) -> Program:
    """The program of a call; its value where it is of constants."""
    program = call_steps(function, [*arguments])
    # A number whose own mistake is reported is nan.
    known = all(isinstance(value, float) and math.isfinite(value) for argument in arguments for _, value in argument)
    return constant_step(float(Expression("", program).evaluate({}))) if known else program


def _rises(segments: Sequence[Any], along: Program, lengths: Sequence[Program]) -> Callable[[int], list[Program]]:
    """By the number of a move its rise along what is followed, and the way of a fall where that is another one.

    Numbers stand in the functions themselves, and what follows parameters in their arguments. Beyond its corners, where
    its way begins and ends, a rise goes on smoothly, as whoever integrates over time needs it.
    """
    again, begins = repeats(segments), [constant_step(0.0), *accumulate(lengths, partial(_called, "+"))]
    known = all(length(segment).expression is None for segment in segments)
    ends = [0.0, *accumulate(float(length(segment)) for segment in segments)]
    if again and not known:
        along = _called("*", _called(Share(period=1.0), _called("/", along, begins[-1])), begins[-1])

    def rises(k: int) -> list[Program]:
        law = segments[k].law
        if known:
            share = _called(Share(ends[k], ends[k + 1] - ends[k], ends[-1] if again else 0.0), along)
        else:
            share = _called(Share(), _called("/", _called("-", along, begins[k]), lengths[k]))
        # Of two that are the same `min` and `max` take the slope of the one that is named first: what follows counts.
        share = _called("min", constant_step(1.0), _called("max", share, constant_step(0.0)))
        return [_called(Rise(law, falls), share) for falls in ((False, True) if LAWS[law].falling else (False,))]

    return rises


def _moved(step: Program, rises: Sequence[Program]) -> Program:
    """The way of a move by a step."""
    if len(rises) == 1:
        return _called("*", step, rises[0])
    ends = zip(("max", "min"), rises, strict=True)
    return _called("+", *(_called("*", _called(end, step, constant_step(0.0)), rise) for end, rise in ends))


def way(segment: Any) -> str:
    """The key of how long a segment is."""
    return "over" if segment.dwell is None else "dwell"


def length(segment: Any) -> Amount:
    """How long a segment is."""
    return Amount.of(getattr(segment, way(segment)))


def repeats(segments: Sequence[Any]) -> bool:
    """Whether segments end where they begin, so that they are passed again and again."""
    begin, end = segments[0].from_, next(segment.to for segment in segments[::-1] if segment.to is not None)
    texts = [number.expression.text if number is not None and number.expression else "" for number in (begin, end)]
    return begin is None or (begin == end and texts[0] == texts[1])


def _words(segments: Sequence[Any]) -> str:
    first = segments[0].from_
    words = [] if first is None else [f"from {first:g}"]
    for segment in segments:
        move = f"to {segment.to:g} over {length(segment):g} by {segment.law}" if segment.dwell is None else ""
        words.append(move or f"dwell {segment.dwell:g}")
    whole = math.fsum(map(length, segments))
    return ", ".join([*words, f"again every {whole:g}"] if repeats(segments) else words)


def span_of(
    builder: Builder, path: KeyPath, coupling: Written[Coupling], followed: str, *, profile: bool
) -> tuple[float, float]:
    """First and last value of a coordinate over which a coupling's law is passed once.

    Of a profile a law that repeats has to close after a turn; of anything else one that does not is a doubt.
    """
    whole = math.fsum(map(length, coupling.law))
    if not repeats(coupling.law) or builder.section.coordinates[followed] != "angle":
        return 0.0, whole
    turn, unit = 2 * math.pi / builder.units.angle_factor, builder.units.label("angle")
    turns = whole / turn
    times = turns if turns > 1 and not profile else 1 / turns
    # Of a length whose own mistake is reported the sum is no number.
    if math.isfinite(times) and abs(times - round(times)) > WHOLE * times:
        words = f"the segments of the law sum to {whole:.9g} {unit}, and a turn has {turn:.9g}"
        if profile:
            refuse(builder, path, f"{words}: {_cure(whole, turn)}, or the cam is a part of a turn: give its 'range'")
        builder.reporter.doubt((*ROOT, *path), f"{words}: {_cure(whole, turn)}")
    return 0.0, turn


def _cure(whole: float, turn: float) -> str:
    return f"a dwell of {turn - whole:.6g} is missing" if whole < turn else f"{whole - turn:.6g} are too many"
