"""Regions between limits of 2 to 180 degrees and stretched or folded legs, against the first leg's two angles."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from helpers.legs import KINDS, Robot, told
from helpers.studies import study_of

import mechdesign
from mechdesign.errors import StudyError
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH, SINGLE

Seeds = Callable[[int], Iterator[int]]
# A design alone, and one of many.
EFFORTS = {"alone": (SINGLE, 1e-5), "of many": (BATCH, 1e-4)}
# Rows of crank angles, samples and parts of the intervals, until two of them agree.
GRIDS = [(200, 400, 2), (330, 560, 3), (1900, 500, 4), (3100, 700, 4)]
AGREEMENT = 1e-4
INDICES = ("area", "GII", "GRI")


def columns(kind: str, assembly: str) -> tuple[str, ...]:
    """What is compared: in any assembly indices are those of one of several modes, which an arm's do not notice."""
    return INDICES if assembly == "same" or kind == "arm" else INDICES[:1]


def truths(robot: Robot, assembly: str, number: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """True numbers and how far they are from those of the grids before, closer and closer."""
    before: list[np.ndarray] = []
    for grid in GRIDS:
        integrals = robot.integrals(assembly == "same", *grid, number > 1)
        if integrals is None:
            return
        if before:
            yield integrals[:number], np.ptp([*before, integrals], axis=0)
        before = [integrals]


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


def compare(kind: str, assembly: str, seed: int, effort: str) -> None:
    """Within twice the error that is told of the true numbers, where these agree to 1e-4."""
    robot, names = KINDS[kind].of(seed), columns(kind, assembly)
    text = robot.text(assembly)
    if not drawn_clearly(text):
        return
    (values, errors), found = asked(text, effort, names), ""
    for true, doubt in truths(robot, assembly, len(names)):
        wrong = np.isfinite(values) & ~(np.abs(values - true) <= 2 * errors + 2 * doubt)
        found = f"{kind} {assembly} {seed} {effort}: {names} {values} with {errors}, true {true} with {doubt}"
        if not wrong.any():
            return
    assert not found or (doubt > AGREEMENT * true)[wrong].all(), found


@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize(("kind", "assembly", "cases"), [
    ("arm", "any", 1), ("five_bar", "same", 1), ("3-RRR", "same", 1), ("arm", "same", 1),
    pytest.param("five_bar", "any", 2, marks=pytest.mark.nightly),
    pytest.param("3-RRR", "any", 2, marks=pytest.mark.nightly),
])  # fmt: skip
def test_areas_and_indices_with_narrow_and_wide_limits(
    seeds: Seeds, kind: str, assembly: str, cases: int, effort: str
) -> None:
    for seed in seeds(cases):
        compare(kind, assembly, seed, effort)


# Spikes beyond the farthest cell, bumps between samples, notches between rays and other elbows were lost in these.
@pytest.mark.parametrize(("kind", "assembly", "seed"), [("five_bar", "same", 15), ("five_bar", "same", 25),
                         ("3-RRR", "same", 19), ("arm", "any", 11), ("arm", "any", 27)])  # fmt: skip
def test_regions_that_were_lost(kind: str, assembly: str, seed: int) -> None:
    compare(kind, assembly, seed, "of many")


@pytest.mark.nightly
@pytest.mark.parametrize("assembly", ["same", "any"])
@pytest.mark.parametrize("kind", KINDS)
def test_designs_of_many_have_the_numbers_of_single_ones(seeds: Seeds, kind: str, assembly: str) -> None:
    names = columns(kind, assembly)[:2]
    for seed in seeds(1):
        robot = KINDS[kind].of(seed)
        text = robot.text(assembly)
        if not drawn_clearly(text):
            continue
        crank = robot.cranks[0]
        variable = f"crank: {{from: {crank:.17g}, to: {1.003 * crank:.17g}, number: 2}}"
        optimize = f"optimize: {{variables: {{{variable}}}, maximize: [{', '.join(names)}]}}"
        designs = mechdesign.optimize(study_of(text + optimize)).tables["designs"]
        for row, length in enumerate(designs["crank"]):
            change = f"mechanism.parameters.crank={length:.17g}"
            (values, errors), (_, of_many) = (asked(text, effort, names, change) for effort in EFFORTS)
            found = np.array([float(designs[name][row]) for name in names])
            assert (np.abs(found - values) <= 2 * (errors + of_many)).all(), (
                kind,
                seed,
                found,
                values,
                errors,
                of_many,
            )


@pytest.mark.parametrize(("kind", "assembly"), [
    ("3-RRR", "same"),
    *(pytest.param(kind, assembly, marks=pytest.mark.nightly)
      for kind in KINDS for assembly in ("same", "any") if (kind, assembly) != ("3-RRR", "same")),
])  # fmt: skip
def test_turned_moved_scaled_mirrored_or_seen_from_elsewhere_nothing_changes(
    seeds: Seeds, kind: str, assembly: str
) -> None:
    names = columns(kind, assembly)
    for seed in seeds(1):
        rng, robot = np.random.default_rng(seed), KINDS[kind].of(seed)
        text = robot.text(assembly)
        if not drawn_clearly(text):
            continue
        effort = list(EFFORTS)[seed % 2]
        about = told(robot.point + 150 * complex(*rng.uniform(-1, 1, 2)))
        turn = np.exp(1j * rng.uniform(-3, 3))
        others = {
            "turned": (robot.moved(turn, 0j, False), 1.0, ()), "moved": (robot.moved(1.0, 300 - 200j, False), 1.0, ()),
            "scaled": (robot.moved(10.0, 0j, False), 10.0, ()), "mirrored": (robot.moved(1.0, 0j, True), 1.0, ()),
            "elsewhere": (robot, 1.0, (f"workspace.scan.about={about}",)),
            "from the sketch": (robot, 1.0, (f"workspace.scan.about={told(robot.point)}",)),
        }  # fmt: skip
        values, errors = asked(text, effort, names)
        for way, (other, scale, changes) in others.items():
            powers = scale ** np.array([2.0, 0.0, -2.0])[: len(names)]
            found, doubt = asked(other.text(assembly), effort, names, *changes) / powers
            slack = 2 * (errors + doubt) + 1e-9 * values
            assert (np.abs(found - values) <= slack).all(), (kind, assembly, seed, way, found, values, errors, doubt)


@pytest.mark.parametrize("effort", EFFORTS)
@pytest.mark.parametrize("width", [0.5, *(pytest.param(width, marks=pytest.mark.nightly) for width in (2.0, 8.0))])
@pytest.mark.parametrize(("shoulder", "elbow"), [(20, 90), (-70, -120)])
def test_an_arm_whose_shoulder_hardly_turns(shoulder: float, elbow: float, width: float, effort: str) -> None:
    """The crescent that the forearm sweeps: A = 2 w l1 l2, and the mean of 1/|det J| is w pi/A."""
    upper = 100 * np.exp(1j * np.radians(shoulder))
    hand = upper + 70 * np.exp(1j * np.radians(shoulder + elbow))
    text = f"""
units: {{length: mm}}
mechanism:
  links: {{ground: {{O: [0, 0]}}, upper: [O, A, 100], fore: [A, P, 70]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{drive: q1, min: {shoulder - 0.5 * width}, max: {shoulder + 0.5 * width}}}]
  sketch: {{A: {told(upper)}, P: {told(hand)}}}
workspace: {{point: P, indices: [resistivity]}}
"""
    (area, mean), (error, doubt) = asked(text, effort, ("area", "GRI"))
    true = 2 * np.radians(width) * 7000
    assert abs(area - true) <= 2 * error
    assert abs(mean - np.radians(width) * np.pi / true) <= 2 * doubt
