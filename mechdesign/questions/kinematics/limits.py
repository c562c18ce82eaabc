"""Where a motion ends, where it passes a singularity, and where two assemblies meet: also between its poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerals import numeral
from mechdesign.ground.numerics.arrays import Flags
from mechdesign.ground.results import Table
from mechdesign.mechanism.margins import Cause
from mechdesign.motion.ends import Change, MotionEnd
from mechdesign.questions.kinematics.along import KinematicAlong
from mechdesign.questions.kinematics.columns import LIMITS

# Places that a warning names.
MOST_NAMED = 4


@dataclass(frozen=True)
class LimitPlace:
    """A place along the motion of a design, in rows, at which it ends or passes a singularity; `end` of one that ends.

    `line` is the number of the motion.
    """

    line: int
    place: float
    cause: Cause
    end: MotionEnd | None = None


def limits_of(along: KinematicAlong) -> list[LimitPlace]:
    """Limits and singularities of motions, one after the other, in the order of their places."""
    limits = [LimitPlace(end.line, end.place, end.cause, end) for end in along.ends.ends]
    limits += [LimitPlace(line, place, cause) for line, place, cause in along.passages()]
    places = along.snapped(np.array([limit.place for limit in limits])).tolist()
    limits = [replace(limit, place=place) for limit, place in zip(limits, places, strict=True)]
    return sorted(limits, key=lambda limit: (limit.line, limit.place))


def limits_table(limits: Sequence[LimitPlace], along: KinematicAlong) -> Table:
    """The places at which the motions end or pass a singularity, and the outputs there.

    `kind` and `joint` are those of `mechdesign.mechanism.margins.Cause`.
    """
    study, outputs, swept = along.question.study, along.question.outputs, along.question.poses.swept
    line, place = np.array([limit.line for limit in limits], dtype=np.intp), np.array([limit.place for limit in limits])
    columns = [
        *along.place_columns(LIMITS, line, place),
        *LIMITS.columns({}, kind=np.array([limit.cause.kind for limit in limits], dtype=str),
                        joint=np.array([limit.cause.joint for limit in limits], dtype=str)),
    ]  # fmt: skip
    named = {column.name for column in columns}
    shown = [output for output in outputs if output.name != swept and output.name not in named]
    values, names = np.empty((len(shown), len(limits))), [output.name for output in shown]
    passing = np.array([limit.end is None for limit in limits], dtype=bool)
    if passing.any():
        there = along.at(line[passing], place[passing])
        for row, name in zip(values, names, strict=True):
            row[passing] = there[name]
    if not passing.all():
        values[:, ~passing] = along.at_ends([limit.end for limit in limits if limit.end is not None], names)
    for output, column in zip(shown, values, strict=True):
        columns.append(LIMITS["<output>"].column(column, study.units.label(output.quantity), output=output.name))
    return LIMITS.table(columns)


def place_in_words(along: KinematicAlong, line: int, place: float) -> str:
    """``theta = 30 deg``, or the row and the coordinates of a path."""
    motion, poses, lines, s = along.question.motion, along.question.poses, np.array([line]), np.array([place])
    if poses.swept is not None:
        return f"{poses.swept} = {numeral(along.shown(lines, s)[0])} {motion.unit_of(poses.swept)}".rstrip()
    return f"row {place:.6g} ({motion.at(poses.along(lines, s)).in_words(0)})"


def interruptions(
    limits: Sequence[LimitPlace], changes: Sequence[Change], along: KinematicAlong, line: int, valid: Flags
) -> list[Caution]:
    """What is said of a motion: where it ends between its poses, passes a singularity, or two assemblies meet."""
    own = [limit for limit in limits if limit.line == line]
    changed = [change for change in changes if change.line == line]
    return _hidden(own, along, valid) + _passed(own, along) + _change_points(changed, along)


def _hidden(limits: Sequence[LimitPlace], along: KinematicAlong, valid: Flags) -> list[Caution]:
    """A warning where a motion ends between neighbouring poses that are both valid: the motion table hides it."""
    places = [
        place_in_words(along, limit.line, limit.place)
        for limit in limits
        if limit.end is not None
        and limit.place % 1 > 0
        and valid[int(limit.place)]
        and valid[(int(limit.place) + 1) % len(valid)]
    ]
    if not places:
        return []
    words = f"the motion ends between poses that are both valid, at {_first(places)}: see the limits of kinematics"
    return [Caution("unassembled", words, "limits", pose=places[0])]


def _passed(limits: Sequence[LimitPlace], along: KinematicAlong) -> list[Caution]:
    """A warning where a motion passes a forward singularity."""
    # Forces are followed from either side of one, and find it twice.
    ways = (place_in_words(along, limit.line, limit.place) for limit in limits if limit.end is None)
    places = list(dict.fromkeys(ways))
    if not places:
        return []
    return [Caution(
        "singular",
        f"the motion passes a singularity at {_first(places)}: the drives hold nothing there, and a made mechanism may "
        "go on in another assembly; see the limits of kinematics",
        "limits", pose=places[0],
    )]  # fmt: skip


def _first(places: Sequence[str]) -> str:
    """The first of some places, and how many more there are."""
    more = f" and {len(places) - MOST_NAMED} more" if len(places) > MOST_NAMED else ""
    return "; ".join(places[:MOST_NAMED]) + more


def _change_points(changes: Sequence[Change], along: KinematicAlong) -> list[Caution]:
    """A warning for each place of a motion at which two assemblies meet, where the study keeps joints on their sides.

    `changes` are those of the motion.
    """
    if along.question.study.mechanism.description.branch == "follow":
        return []
    places: dict[str, dict[str, None]] = {}
    for line, s, cause in changes:
        place = float(along.snapped(np.array([s]))[0])
        # What is swept is known to the root of rounding only, where a smooth function is smallest.
        words = place_in_words(along, line, round(place, 6))
        places.setdefault(words, {})[cause.joint] = None
    return [
        Caution(
            "singular",
            f"change point at {place} (joints {'; '.join(joints)}): two assemblies meet there, and branch 'side' keeps "
            "each joint on its side of the line, where a made mechanism may cross it; "
            "'branch: follow' goes through smoothly",
            pose=place,
        )
        for place, joints in places.items()
    ]
