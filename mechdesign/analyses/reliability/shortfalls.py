"""What methods that look about the limits fell short of: the precision asked, design points, what can be assembled."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.reliability.engine.precision import WIDTH
from mechdesign.analyses.reliability.task import Found, Task, wanted_precision
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def unreached(study: Study, poses: Poses, found: Sequence[Found], task: Task) -> list[str]:
    """A sentence where `auto` ended before the precision asked, with the worst pose and what was reached there."""
    precision = wanted_precision(task)
    short: dict[int, float] = {}
    for each in found:
        for pose in each.rungs:
            estimate = each.estimates[pose]
            # What no failure at all says is told elsewhere.
            if estimate.failures and not precision.reached(estimate.failure, estimate.low, estimate.high):
                half = 0.5 * (estimate.high - estimate.low)
                short[pose] = half / (WIDTH * estimate.failure) if precision.half_width is None else half
    if not short:
        return []
    pose = max(short, key=lambda each: short[each])
    if precision.half_width is None:
        asked, reached = (f"{100 * (part or 0.0):.3g} %" for part in (precision.relative, short[pose]))
        what = "the coefficient of variation"
    else:
        asked, reached = (f"{part:.3g}" for part in (precision.half_width, short[pose]))
        what = "half the interval"
    others = f" (the worst of {len(short)} poses)" if len(short) > 1 else ""
    return [
        f"auto: {what} is {reached} at {pose_in_words(study, poses, pose)}{others}, not the {asked} asked; "
        f"it ends at {task.most} samples, which reliability.samples sets"
    ]


def pointless(study: Study, poses: Poses, found: Sequence[Found]) -> list[str]:
    """A sentence where `form` found no design point although limits are broken."""
    unknown = [pose for each in found if each.method == "form"
               for pose, estimate in each.estimates.items() if math.isnan(estimate.failure)]  # fmt: skip
    if not unknown:
        return []
    others = f" and at {len(unknown) - 1} more poses" if len(unknown) > 1 else ""
    return [
        f"form: samples break a limit at {pose_in_words(study, poses, unknown[0])}{others}, but no design point was "
        "found: it has no probability there"
    ]


def unassembled(found: Sequence[Found]) -> list[str]:
    """A sentence for each method whose samples about the limits meet what cannot be assembled."""
    sentences = []
    for each in found:
        drawn = [
            estimate
            for pose, estimate in each.estimates.items()
            if each.used.get(pose, each.method) == "importance_sampling" and estimate.invalid
        ]
        if drawn:
            invalid, samples = sum(part.invalid for part in drawn), sum(part.samples for part in drawn)
            sentences.append(
                f"{each.method}: {invalid} of {samples} samples drawn about the limits cannot be assembled; they count "
                "as failures"
            )
    return sentences
