"""Numbers of regions and the errors that are told of them, against a model's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from helpers.joint_plane import Robot
from helpers.studies import study_of
from mechdesign.ground.errors import StudyError
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH, SINGLE

# A design alone, and one of many.
EFFORTS = {"alone": (SINGLE, 1e-5), "of many": (BATCH, 1e-4)}
# Rows of crank angles, samples and parts of the intervals, until two of them agree.
GRIDS = [(600, 16, 1), (1500, 24, 2), (5300, 32, 4), (14300, 40, 7)]
AGREEMENT = 1e-4
INDICES = ("area", "GII", "GRI")


def truths(robot: Robot, assembly: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """True numbers and how far they are from those of the grid before, closer and closer."""
    before = None
    for grid in GRIDS:
        integrals = robot.integrals(assembly == "same", *grid)
        if before is not None and integrals is not None:
            yield integrals, np.abs(integrals - before)
        before = integrals


@np.errstate(all="ignore")
def asked(text: str, effort: str, names: tuple[str, ...], *changes: str) -> np.ndarray:
    """Numbers of a region and the errors that are told of them, shape (2, numbers)."""
    closeness, tolerance = EFFORTS[effort]
    found = answer(questions(study_of(text, *changes), tolerance, names)[0], {}, 1, closeness)
    return np.array([[float(table[name][0]) for name in names] for table in (found.values, found.errors)])


def drawn_clearly(text: str) -> bool:
    """Whether the sketch shows the assembly; one that lies on a singularity is refused."""
    try:
        questions(study_of(text), 1e-4, INDICES[:1])
    except StudyError as error:
        return "draw it clearly" not in str(error)
    return True


def compare(robot: Robot, assembly: str, effort: str) -> None:
    """Within twice the error that is told of the true numbers, where these agree to 1e-4."""
    text = robot.text(assembly)
    if not drawn_clearly(text):
        return
    (values, errors), found = asked(text, effort, INDICES), ""
    for true, doubt in truths(robot, assembly):
        wrong = np.isfinite(values) & ~(np.abs(values - true) <= 2 * errors + 2 * doubt)
        found = f"{robot} {assembly} {effort}: {INDICES} {values} with {errors}, true {true} with {doubt}"
        if not wrong.any() and (doubt <= AGREEMENT * true).all():
            return
    assert not found or (doubt > AGREEMENT * true)[wrong].all(), found
