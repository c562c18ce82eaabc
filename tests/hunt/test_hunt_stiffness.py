"""Compliances and displacements of random mechanisms against frames of finite elements built from the studies' words.

Slots and prismatic joints on elastic links at any place, points beside their lines, telescopic legs, compound pins,
bearings and motors; what stands on serial legs by both solvers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from random import Random

import numpy as np
import pytest
from helpers.frames import Structure
from helpers.layouts import GROUND
from helpers.maker import DRIVEN, DYADS, TRIADS, Maker
from helpers.platforms import platform
from helpers.random_mechanisms import Made
from helpers.random_stiffness import Sprung
from helpers.studies import study_of

from mechdesign.ground.errors import StudyError
from mechdesign.mechanism import Configuration
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.poses import study_poses
from mechdesign.questions.stiffness.analysis import stiffness
from mechdesign.questions.stiffness.body import ask, hold
from mechdesign.questions.stiffness.force_method import load, twists_of
from mechdesign.study import Study

Seeds = Callable[[int], Iterator[int]]
# Groups with a slide, of which there should be more than chance brings.
SLIDING = ["carriage", "ram", "slotted", "trammel", "stroke"], ["RRP", "RPR", "PRP", "RPP", "PPR", "RS", "SR", "PS"]
# Of the largest entry; and what rounding leaves of what is rigid: what gives at all has compliances of 1e-6 or more.
AGREE, NOTHING = 1e-9, 1e-13
LOAD = 30.0


def drawn(seed: int) -> Sprung:
    """A random mechanism with something elastic."""
    rng = Random(seed)
    driven, dyads = SLIDING if rng.random() < 0.5 else (sorted(DRIVEN), sorted(DYADS))
    groups = rng.choices(driven, k=rng.randint(1, 2)) + rng.choices(dyads, k=rng.randint(1, 4))
    if rng.random() < 0.2:
        groups.insert(rng.randint(1, len(groups)), rng.choice(sorted(TRIADS)))
    maker = Maker(rng.getrandbits(32))
    for group in groups:
        maker.add((DRIVEN | DYADS | TRIADS)[group])
    if not maker.layout.drives:
        maker.add(DRIVEN["crank"])
    return Sprung(Made(maker.finish(anyhow=rng.random() < 0.5), maker), Random(rng.getrandbits(32)))


def posed(text: str) -> tuple[Study, Configuration]:
    study = study_of(text)
    (solved,) = solve_poses(study.motion(study_poses(study, "stiffness")))
    return study, solved.configuration


def same(found: np.ndarray, expected: np.ndarray) -> bool:
    return bool(np.abs(found - expected).max() <= AGREE * np.abs(expected).max() + NOTHING)


def test_random_mechanisms_against_frames(seeds: Seeds) -> None:
    for seed in seeds(13):
        case = drawn(seed)
        applied = [LOAD, -20.0, 8.0 if case.link else 0.0]
        study, configuration = posed(case.text(loads=[applied]))
        tables, structure = stiffness(study).tables, Structure(study, configuration)
        expected = structure.compliance()
        soft = tables["compliance"]
        found = [soft[f"C{i + 1}{j + 1}"][0] for i in range(len(expected)) for j in range(i, len(expected))]
        assert same(np.array(found), expected[np.triu_indices(len(expected))]), seed
        moved, _ = structure.frame.respond(structure.asked, np.array([applied]).T)
        places = tables["displacements"]
        nodes = [structure.nodes[pair] for pair in zip(places["link"], places["point"], strict=True)]
        for axis, name in enumerate(("dx", "dy")):
            # A unit of the load, as the compliances: where all is rigid the frame leaves rounding of its stiffest bars.
            assert same(places[name] / LOAD, moved[[3 * node + axis for node in nodes], 0] / LOAD), seed
        assert {str(link) for link in places["link"]} == set(case.layout.bodies) - {GROUND}


def test_serial_legs_and_forces_against_frames(seeds: Seeds) -> None:
    for seed in seeds(20):
        try:
            study, configuration = posed(platform(Random(seed)))
        except StudyError as error:
            # Refused, and rightly: the drawing leaves open which assembly is meant.
            if "divides the two assemblies" in str(error):
                continue
            raise
        asked = ask(study)
        assert asked.legs is not None
        serial, _ = hold(asked, configuration)
        other = load(twists_of(asked.network, asked.section, configuration, asked.length(configuration)), 3).held
        expected = Structure(study, configuration).compliance()
        if other.margin > 1e-3:
            assert same(serial.compliance[0], expected), seed
            assert same(other.compliance[0], expected), seed


KEPT = {
    "a trolley near the end of a girder was 120 times too soft": """
mechanism:
  links:
    ground: {A: [0, 0], B: [400, 0]}
    girder: {from: A, to: S, length: 400}
    trolley: {W: [0, 0]}
  joints: {roller: {slot: ground, through: B, point: S}, track: {prismatic: [girder, trolley], through: A, point: W}}
  drives: {t: {slide: track}}
  sketch: {S: [400, 0], W: [200, 0]}
stiffness:
  link: trolley
  at: W
  sections: {beam: {E: 200 GPa, width: 20, height: 40}}
  elastic: {girder: beam}
  poses: [{t: 350}]
""",
    "a lug a hair beside a boom's line made it 2.4 times softer": """
mechanism:
  links:
    ground: {O: [0, 0], D: [-100, -300]}
    boom: {from: O, to: T, length: 600, points: {M: [250, 1e-6]}}
    strut: {from: D, to: M, telescopic: true}
  drives: [strut]
  sketch: {T: [600, 0], M: [250, 0]}
stiffness:
  link: boom
  at: T
  sections: {beam: {E: 200 GPa, width: 20, height: 40}}
  elastic: {boom: beam, strut: beam}
  poses: [{boom.angle: 0}]
""",
}


@pytest.mark.parametrize("name", KEPT)
def test_finds_stay_mended(name: str) -> None:
    study, configuration = posed(KEPT[name])
    soft, expected = stiffness(study).tables["compliance"], Structure(study, configuration).compliance()
    found = [soft[f"C{i + 1}{j + 1}"][0] for i in range(3) for j in range(i, 3)]
    assert np.array(found) == pytest.approx(expected[np.triu_indices(3)], rel=1e-6, abs=1e-9 * np.abs(expected).max())
