"""Regions between limits of 2 to 180 degrees and stretched or folded legs, against the first leg's two angles."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from helpers.joint_plane import told
from helpers.legs import KINDS
from helpers.regions import EFFORTS, INDICES, asked, compare, drawn_clearly
from helpers.studies import study_of

import mechdesign

Seeds = Callable[[int], Iterator[int]]


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
        compare(KINDS[kind].of(seed), assembly, effort)


@pytest.mark.nightly
@pytest.mark.parametrize("assembly", ["same", "any"])
@pytest.mark.parametrize("kind", KINDS)
def test_designs_of_many_have_the_numbers_of_single_ones(seeds: Seeds, kind: str, assembly: str) -> None:
    names = INDICES[:2]
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
            case = (kind, assembly, seed, found, values, errors, of_many)
            assert (np.abs(found - values) <= 2 * (errors + of_many)).all(), case


@pytest.mark.parametrize(("kind", "assembly"), [
    ("3-RRR", "same"),
    *(pytest.param(kind, assembly, marks=pytest.mark.nightly)
      for kind in KINDS for assembly in ("same", "any") if (kind, assembly) != ("3-RRR", "same")),
])  # fmt: skip
def test_turned_moved_scaled_mirrored_or_seen_from_elsewhere_nothing_changes(
    seeds: Seeds, kind: str, assembly: str
) -> None:
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
        values, errors = asked(text, effort, INDICES)
        for way, (other, scale, changes) in others.items():
            powers = scale ** np.array([2.0, 0.0, -2.0])
            found, doubt = asked(other.text(assembly), effort, INDICES, *changes) / powers
            slack = 2 * (errors + doubt) + 1e-9 * values
            assert (np.abs(found - values) <= slack).all(), (kind, assembly, seed, way, found, values, errors, doubt)
