"""Where a motion ends, where it passes a singularity, and where two assemblies meet: also between its poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.analyses.kinematics.along import Along
from mechdesign.analyses.poses import pose_in_words
from mechdesign.curve.motion import End
from mechdesign.mechanism.margins import Cause
from mechdesign.numerics.arrays import Flags
from mechdesign.results import Column, Table

# Places that a warning names.
MOST_NAMED = 4


@dataclass(frozen=True)
class Limit:
    """A place along a motion, in rows, at which it ends or passes a singularity; `end` of one that ends."""

    place: float
    cause: Cause
    end: End | None = None


def limits_of(along: Along) -> list[Limit]:
    """Limits and singularities of a single motion in the order of its places."""
    found = [Limit(float(along.snapped(np.array([end.place]))[0]), end.cause, end) for end in along.curve.ends]
    found += [Limit(float(along.snapped(np.array([s]))[0]), cause) for _, s, cause in along.passages()]
    return sorted(found, key=lambda limit: limit.place)


def limits_table(limits: Sequence[Limit], along: Along) -> Table:
    """The places at which the motion ends or passes a singularity, and the outputs there.

    `kind` and `joint` are those of `mechdesign.mechanism.margins.Cause`.
    """
    study, outputs, swept = along.question.study, along.question.outputs, along.question.poses.swept
    place = np.array([limit.place for limit in limits])
    columns = [
        *along.place_columns(place, "value at the limit of motion"),
        Column("kind", np.array([limit.cause.kind for limit in limits], dtype=str), "",
               "what ends the motion, such as a dead centre, a singularity or a limit"),
        Column("joint", np.array([limit.cause.joint for limit in limits], dtype=str), "", "where"),
    ]  # fmt: skip
    passed = along.at(np.zeros(len(limits), dtype=np.intp), place) if limits else {}
    named = {column.name for column in columns}
    for output in outputs:
        if output.name == swept or output.name in named:
            continue
        values = [
            float(passed[output.name][k]) if limit.end is None else along.at_end(limit.end, output.name)
            for k, limit in enumerate(limits)
        ]
        unit, meaning = study.units.label(output.quantity), f"{output.name} at the limit"
        columns.append(Column(output.name, np.array(values, dtype=float), unit, meaning))
    return Table("limits", tuple(columns), "limits of motion and singularities found along it")


def place_in_words(along: Along, place: float) -> str:
    """``theta = 30 deg``, or the row and the coordinates of a path."""
    study, poses, line, s = along.question.study, along.question.poses, np.array([0]), np.array([place])
    if poses.swept is not None:
        unit = study.units.label(study.mechanism.quantity(poses.swept))
        return f"{poses.swept} = {along.shown(line, s)[0] + 0.0:.6g} {unit}".rstrip()
    return f"row {place:.6g} ({pose_in_words(study, poses.along(line, s), 0)})"


def hidden(limits: Sequence[Limit], along: Along, valid: Flags) -> list[str]:
    """A warning where the motion ends between neighbouring poses that are both valid: the motion table hides it."""
    count = along.question.poses.line
    places = [
        place_in_words(along, limit.place)
        for limit in limits
        if limit.end is not None
        and limit.place % 1 > 0
        and valid[int(limit.place)]
        and valid[(int(limit.place) + 1) % count]
    ]
    if not places:
        return []
    return [f"the motion ends between poses that are both valid, at {_first(places)}: see the limits"]


def passed(limits: Sequence[Limit], along: Along) -> list[str]:
    """A warning where the motion passes a forward singularity."""
    places = [place_in_words(along, limit.place) for limit in limits if limit.end is None]
    if not places:
        return []
    return [
        f"the motion passes a singularity at {_first(places)}: the drives hold nothing there, and a made mechanism may "
        "go on in another assembly; see the limits"
    ]


def _first(places: Sequence[str]) -> str:
    """The first of some places, and how many more there are."""
    more = f" and {len(places) - MOST_NAMED} more" if len(places) > MOST_NAMED else ""
    return "; ".join(places[:MOST_NAMED]) + more


def change_points(along: Along) -> list[str]:
    """A warning for each place at which two assemblies meet, where the study keeps each joint on its side."""
    if along.question.study.mechanism.description.branch == "follow":
        return []
    places: dict[str, dict[str, None]] = {}
    for _, s, cause in along.curve.changes():
        place = float(along.snapped(np.array([s]))[0])
        # What is swept is known to the root of rounding only, where a smooth function is smallest.
        words = place_in_words(along, round(place, 6))
        places.setdefault(words, {})[cause.joint] = None
    return [
        f"change point at {place} (joints {'; '.join(joints)}): two assemblies meet there, and branch 'side' keeps "
        "each joint on its side of the line, where a made mechanism may cross it"
        for place, joints in places.items()
    ]
