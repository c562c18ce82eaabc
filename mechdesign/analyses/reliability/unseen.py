"""Where a simulation saw no failure: what it says about the probability all the same."""

from __future__ import annotations

from collections.abc import Sequence

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.reliability.engine.problem import Estimate
from mechdesign.analyses.reliability.task import Found
from mechdesign.study import Study
from mechdesign.study.poses import Poses


def unseen(study: Study, poses: Poses, found: Sequence[Found]) -> list[str]:
    """One sentence for each method whose counted failures are none, with the upper end of the interval."""
    sentences = []
    for each in found:
        none = {pose: estimate for pose, estimate in each.estimates.items() if _none(estimate)}
        if none:
            pose, widest = max(none.items(), key=lambda item: item[1].high)
            where = f"at {pose_in_words(study, poses, pose)}" if len(none) == 1 else f"at {len(none)} poses"
            sentences.append(_sentence(each.method, widest, "samples", where))
        if each.cycle is not None and _none(each.cycle):
            sentences.append(_sentence(each.method, each.cycle, "made mechanisms", "over the whole cycle"))
    return sentences


def _none(estimate: Estimate) -> bool:
    return estimate.samples > 0 and estimate.failures == 0


def _sentence(method: str, estimate: Estimate, what: str, where: str) -> str:
    return (
        f"{method}: no failure in {estimate.samples} {what} {where}: the probability of failure is below "
        f"{estimate.high:.2g}"
    )
