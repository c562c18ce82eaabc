"""How each method is drawn, the same in every picture, and what its rows of a table are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.drawing import style
from mechdesign.ground.results import Table
from mechdesign.motion.rows import Poses
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.question import OF_DYNAMICS, ORDERS
from mechdesign.questions.reliability.schema.methods import METHODS, Method
from mechdesign.study import Study


def look(name: str) -> Method:
    """A method with its colour as Matplotlib knows it; what is sampled is drawn as dots, without a line."""
    return replace(METHODS[name], color=getattr(style, METHODS[name].color))


def followed_in_words(study: Study, poses: Poses, pose: int) -> str:
    """The pose whose samples are shown, in words, and that it fails most unless the study chose it."""
    chosen = study.reliability is not None and study.reliability.shown is not None
    return "the pose that fails most, " * (poses.count > 1 and not chosen) + pose_in_words(study, poses, pose)


def methods(table: Table) -> list[str]:
    """Methods of a table, in the order in which they are drawn: what is computed below what is sampled."""
    present = set(table["method"].tolist())
    return sorted((name for name in METHODS if name in present), key=lambda name: METHODS[name].sampled)


def best_probability(table: Table) -> str:
    """The method whose probabilities stand where there is room for one only."""
    return max(methods(table), key=lambda name: METHODS[name].accuracy)


def best_moments(table: Table) -> str:
    """The method whose moments stand where there is room for one only; those that end early have fewer samples."""

    def rank(name: str) -> tuple[bool, bool, int]:
        method = METHODS[name]
        return method.errors, not method.precise, method.accuracy

    return max(methods(table), key=rank)


def channels(table: Table) -> list[tuple[str, str, str]]:
    """Output, order and unit of each quantity of a table, positions first."""
    quantities = dict.fromkeys(
        zip(table["output"].tolist(), table["order"].tolist(), table["unit"].tolist(), strict=True)
    )
    return sorted(quantities, key=lambda channel: ORDERS.index(channel[1]))


def heading(output: str, order: str) -> str:
    """An output by its name, its velocity as such."""
    return output if order in ("position", OF_DYNAMICS) else f"{output} {order}"


def apart(limits: tuple[float, float], low: float, high: float) -> tuple[list[float], list[float]]:
    """Finite limits between two ends, and those beyond them."""
    finite = [limit for limit in limits if np.isfinite(limit)]
    return [limit for limit in finite if low < limit < high], [limit for limit in finite if not low < limit < high]
