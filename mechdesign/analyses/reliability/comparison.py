"""Where two methods disagree about the probability of failure."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.task import Found
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def disagreements(study: Study, poses: Poses, found: Sequence[Found]) -> list[str]:
    """One sentence for each two methods that are apart by more than a factor beyond their intervals: the worst pose."""
    if not any(each.estimates for each in found):
        return []
    # What compares probabilities imports SciPy, which takes a quarter of a second; moments do without.
    from mechdesign.analyses.reliability.engine.ladder import FACTOR, disagree

    worst: dict[tuple[str, str], tuple[float, int, Estimate, Estimate]] = {}
    count: dict[tuple[str, str], int] = {}
    for pose in range(poses.count):
        estimates: dict[str, Estimate] = {}
        for each in found:
            for rung, estimate in each.rungs.get(pose, {}).items():
                estimates.setdefault(rung, estimate)
            if pose in each.estimates and not each.rungs:
                estimates[each.method] = each.estimates[pose]
        for one, other in itertools.combinations(estimates, 2):
            apart = disagree(estimates[one], estimates[other])
            if apart > FACTOR:
                count[one, other] = count.get((one, other), 0) + 1
                if apart > worst.get((one, other), (0.0,))[0]:
                    worst[one, other] = apart, pose, estimates[one], estimates[other]
    sentences = []
    for (one, other), (apart, pose, first, second) in worst.items():
        times = f"{apart:.3g} times" if apart < 1e6 else "many orders of magnitude"
        rest = f" (at {count[one, other]} of {poses.count} poses; here they are farthest)" if poses.count > 1 else ""
        sentences.append(
            f"{one} and {other} disagree at {pose_in_words(study, poses, pose)}: the probability of failure is "
            f"{first.failure:.3g} by the one and {second.failure:.3g} by the other, {times} apart{rest}"
        )
    return sentences
