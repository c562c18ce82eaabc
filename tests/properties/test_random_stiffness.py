"""Stiffness of random mechanisms of any topology, against finite elements and against the laws of mechanics."""

from __future__ import annotations

from random import Random
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.designs import assert_as_alone
from helpers.frames import Structure
from helpers.layouts import DUMPER, GROUND
from helpers.platforms import platform
from helpers.random_stiffness import Sprung, sprung
from helpers.stiffness import ask_stiffness, matrix
from helpers.studies import study_of
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

import mechdesign
from mechdesign.ground.errors import StudyError
from mechdesign.mechanism import Configuration
from mechdesign.motion.solving import solve_poses
from mechdesign.questions.poses import study_poses
from mechdesign.questions.stiffness.analysis import stiffness
from mechdesign.questions.stiffness.body import ask, hold
from mechdesign.questions.stiffness.force_method import load, twists_of
from mechdesign.study import Study
from mechdesign.study.designs import Designs

# What is rigid, but for rounding: whatever gives has a compliance of 1e-6 or more.
NOTHING = 1e-15


def posed(text: str) -> tuple[Study, Configuration]:
    study = study_of(text)
    (solved,) = solve_poses(study.motion(study_poses(study, "stiffness")))
    return study, solved.configuration


def agree(found: np.ndarray, expected: np.ndarray, relative: float, rounding: np.ndarray | float = 0.0) -> None:
    """Entries agree, each relative to the displacements (or loads) that belong to its row and column.

    `rounding` is what the test's own arithmetic may leave of the expected entries.
    """
    size = np.sqrt(np.abs(np.diag(expected)))
    tolerance = relative * np.outer(size, size) + relative**2 * np.abs(expected).max() + NOTHING + rounding
    assert (np.abs(found - expected) <= tolerance).all(), (found, expected)


@pytest.mark.nightly
@settings(max_examples=50)
@given(sprung())
def test_compliance_is_that_of_finite_elements(case: Sprung) -> None:
    text = case.text()
    result = ask_stiffness(text)
    assert result.tables["stiffness"]["valid"].all()
    agree(matrix(result, "C"), Structure(*posed(text)).compliance(), 1e-6)


@pytest.mark.nightly
@settings(max_examples=50)
@given(sprung(coupled=True))
def test_compliance_with_a_coupling_is_that_of_finite_elements(case: Sprung) -> None:
    text = case.text()
    agree(matrix(ask_stiffness(text), "C"), Structure(*posed(text)).compliance(), 1e-6)


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung())
def test_displacements_of_all_points_are_those_of_finite_elements(case: Sprung) -> None:
    load_case = [30.0, -20.0, 8.0 if case.link else 0.0]
    text = case.text(loads=[load_case])
    table = ask_stiffness(text).tables["displacements"]
    structure = Structure(*posed(text))
    moved, _ = structure.frame.respond(structure.asked, np.array([load_case]).T)
    # Of a rigid body the finite elements leave rounding in proportion to the load; what gives moves 1e-6 of it or more.
    largest, rounding = np.abs(moved).max(), 1e-12 * np.linalg.norm(load_case)
    bodies = [body for body in case.layout.bodies.values() if body.name != GROUND]
    assert len(table) == sum(len(body.points) + bool(body.to) for body in bodies)
    for link, point, dx, dy in zip(*(table[name] for name in ("link", "point", "dx", "dy")), strict=True):
        node = structure.nodes[link, point]
        assert complex(dx, dy) == pytest.approx(
            complex(*moved[3 * node : 3 * node + 2, 0]), abs=1e-6 * largest + rounding
        )


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung(), st.integers(0, 2**32 - 1))
def test_ends_of_pins_and_turns_of_links_in_a_reliability_are_those_of_finite_elements(case: Sprung, seed: int) -> None:
    """Every end of every pin, the pin itself, and the angle of every link that has a line; most pins give."""
    layout, rng = case.layout, Random(seed)
    clamps = [{clamp.first, clamp.second} for clamp in layout.clamps.values()]
    pins = [
        point for point in layout.places if len(layout.owners(point)) > 1 and set(layout.owners(point)) not in clamps
    ]
    case.bearings |= {pin: {"radial": 10 ** rng.uniform(3, 5)} for pin in pins if rng.random() < 0.6}
    ends = {f"{link}.{point}": (link, point) for point in layout.places for link in layout.owners(point)}
    if rng.random() < 0.4:
        case.link, case.at = "", rng.choice([end for end, (link, _) in ends.items() if link != GROUND])
    text = case.text()
    angles = [f"{link}.angle" for link in layout.bodies if link != GROUND]
    section = {
        "poses": [layout.pose(layout.drives)], "dimensions": {"load.fx": 1.0, "load.fy": 1.0}, "load": [0, 0, 0],
        "outputs": [*ends, *layout.places, *angles], "methods": "analytic",
    }  # fmt: skip
    result = mechdesign.reliability(study_of(text + yaml.dump({"reliability": section}, Dumper=DUMPER)))
    table, structure = result.tables["contributions"], Structure(*posed(text))
    unknown = "".join(warning for warning in map(str, result.warnings) if "not known" in warning)
    moved = structure.frame.respond(structure.asked, np.eye(3)[:, :2])[0]
    places = moved[0::3] + 1j * moved[1::3]

    def expected(output: str) -> np.ndarray:
        name, _, part = output.rpartition(".")
        if part == "angle":
            link = structure.description.links[name]
            corners = list(link.ends or link.points)
            nodes = [structure.nodes[name, corner] for corner in corners]
            if len(corners) != 2:
                return moved[3 * nodes[0] + 2]
            span = structure.place(corners[1]) - structure.place(corners[0])
            return np.imag((places[nodes[1]] - places[nodes[0]]) / span)
        node = structure.nodes[ends[name]] if name in ends else structure.pins[name]
        if (GROUND, name) in structure.nodes:
            node = structure.nodes[GROUND, name]
        elif name == case.at and case.link:
            node = structure.nodes[case.link, name]
        return np.real(places[node]) if part == "x" else np.imag(places[node])

    tolerance = 1e-6 * np.abs(moved).max() + 1e-12
    for output, source, slope in zip(table["output"], table["source"], table["sensitivity"], strict=True):
        if f" {output}" not in unknown:
            at = expected(str(output))[["load.fx", "load.fy"].index(source)]
            assert slope == pytest.approx(at, abs=tolerance), (output, source)


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung())
def test_every_part_is_in_equilibrium_and_pins_bear_no_moment(case: Sprung) -> None:
    """Forces of the joints on each link, pin and block, and the load on what is asked, add up to nothing."""
    loads = [[30.0, -20.0, 8.0 if case.link else 0.0], [-1.0, 2.0, 0.0]]
    table = ask_stiffness(case.text(loads=loads)).tables["forces"]
    layout = case.layout
    places = layout.places | {guide.name: layout.places[guide.point] for guide in layout.guides.values()}
    places |= {body.name: layout.places[body.to] for body in layout.bodies.values() if body.to}
    parts = {str(name) for column in ("on", "by") for name in table[column]}
    loaded = "asked" if "asked" in parts else case.link
    for number, applied in enumerate(loads, 1):
        total = {part: np.zeros(3) for part in parts}
        shares = dict.fromkeys(parts, 0.0)

        def act(part: str, fx: float, fy: float, mz: float, at: complex, total: dict = total) -> None:
            total[part] += [fx, fy, mz + at.real * fy - at.imag * fx]

        if loaded in parts:
            act(loaded, *applied, layout.places[case.at])
        for row in table:
            if row["load"] != number:
                continue
            name, force = str(row["joint"]), np.array([row["fx"], row["fy"], row["mz"]])
            at = places.get(name, 0j)
            act(str(row["on"]), *force, at)
            act(str(row["by"]), *-force, at)
            for part in (row["on"], row["by"]):
                shares[str(part)] = max(shares[str(part)], np.abs(force).max())
            if name in layout.drives:
                assert np.abs(force[:2]).max() < 1e-9 * np.abs(applied).max()
        for part in parts - {GROUND}:
            assert total[part] == pytest.approx(np.zeros(3), abs=1e-8 * (1 + shares[part])), part


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung())
def test_stiffness_is_symmetric_positive_and_the_inverse_of_compliance(case: Sprung) -> None:
    result = ask_stiffness(case.text())
    stiff, soft = matrix(result, "K"), matrix(result, "C")
    assert (np.linalg.eigvalsh(soft) >= -1e-12 * np.abs(soft).max()).all()
    if np.isfinite(stiff).all():
        assert (np.linalg.eigvalsh(stiff) > -1e-12 * np.abs(stiff).max()).all()
        assert soft @ stiff @ soft == pytest.approx(soft, rel=1e-6, abs=1e-7 * np.abs(soft).max())
    else:
        assert np.linalg.eigvalsh(soft)[0] <= 1e-11 * np.abs(soft).max()


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung(), st.randoms(use_true_random=False))
def test_names_and_order_do_not_matter(case: Sprung, rng) -> None:
    layout = case.layout
    names = [*layout.places, *layout.bodies, *layout.guides, *layout.clamps, *layout.drives]
    others = [f"{name[0]}_{k}" for k, name in enumerate(names)]
    rng.shuffle(others)
    renamed = {name: other for name, other in zip(names, others, strict=True) if name != GROUND}
    plain, other = (ask_stiffness(text) for text in (case.text(), case.text(rng=rng, names=renamed)))
    assert plain.tables["stiffness"]["method"] == other.tables["stiffness"]["method"]
    agree(matrix(other, "C"), matrix(plain, "C"), 1e-8)


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung(), st.floats(-3, 3), st.complex_numbers(max_magnitude=5, allow_nan=False))
def test_a_rigid_motion_of_the_whole_turns_the_matrices(case: Sprung, angle: float, shift: complex) -> None:
    factor = complex(np.exp(1j * angle))
    moved = case.text(case.layout.moved(factor, shift))
    size = 3 if case.link else 2
    turn = np.eye(3)
    turn[:2, :2] = [[factor.real, -factor.imag], [factor.imag, factor.real]]
    turn = turn[:size, :size]
    agree(matrix(ask_stiffness(moved), "C"), turn @ matrix(ask_stiffness(case.text()), "C") @ turn.T, 1e-8)


def about(arm: complex) -> np.ndarray:
    """T of a point `arm` away: twist there = T^-1 twist here, K there = T^T K here T  [S4]."""
    return np.array([[1, 0, arm.imag], [0, 1, -arm.real], [0, 0, 1]])


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung())
def test_another_point_of_the_same_body_is_the_same_matrix_seen_from_there(case: Sprung) -> None:
    body = case.layout.bodies.get(case.link)
    assume(body is not None and case.link not in case.elastic and not body.to and len(body.points) > 1)
    here = ask_stiffness(case.text())
    reach = max(abs(place) for place in case.layout.places.values())
    for point in body.points:
        there = ask_stiffness(case.text(at=point))
        transform = about(case.layout.places[point] - case.layout.places[case.at])
        inverse = about(case.layout.places[case.at] - case.layout.places[point])
        # What is rigid there is carried from what cancels here, by arms that are as exact as the places of the points.
        arms = np.abs(inverse) + np.abs(about(complex(reach, reach)))
        cancels = 1e-15 * arms @ np.abs(matrix(here, "C")) @ arms.T
        agree(matrix(there, "C"), inverse @ matrix(here, "C") @ inverse.T, 1e-9, cancels)
        if np.isfinite(matrix(here, "K")).all():
            agree(matrix(there, "K"), transform.T @ matrix(here, "K") @ transform, 1e-6)


@pytest.mark.nightly
@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_on_serial_legs_reciprocal_wrenches_forces_and_finite_elements_agree(seed: int) -> None:
    try:
        study, configuration = posed(platform(Random(seed)))
    except StudyError:
        # Drawn by chance where two assemblies meet.
        reject()
    asked = ask(study)
    assert asked.legs is not None
    serial, _ = hold(asked, configuration)
    twists = twists_of(asked.network, asked.section, configuration, asked.length(configuration))
    other = load(twists, 3).held
    assume(other.margin > 1e-2)
    assert serial.rank == other.rank == 3
    agree(other.compliance[0], serial.compliance[0], 1e-8)
    agree(Structure(study, configuration).compliance(), serial.compliance[0], 1e-6)
    assert np.isnan(serial.stiffness).all() == np.isnan(other.stiffness).all()
    if np.isfinite(serial.stiffness).all():
        agree(other.stiffness[0], serial.stiffness[0], 1e-6)


@pytest.mark.nightly
@settings(max_examples=25)
@given(sprung(), st.integers(0, 2**32 - 1))
def test_many_designs_at_once_are_those_one_by_one(case: Sprung, seed: int) -> None:
    """Every number of the section is a parameter of its own, and lengths of links differ, too.

    But for the condition of the mechanism drawn, which magnifies the last digit of a number. Not the eigen-stiffnesses:
    twists of two that are alike, such as rigid ones, are any in their plane.
    """
    load = [30.0, -20.0, 8.0] if case.link else [30.0, -20.0]
    data = yaml.safe_load(case.text(loads=[load], direction=25.0))
    section, rng = data["stiffness"], np.random.default_rng(seed)
    parameters: dict[str, float] = {}

    def named(part: Any) -> Any:
        if isinstance(part, dict):
            return {key: named(value) for key, value in part.items()}
        if isinstance(part, list):
            return [named(value) for value in part]
        if isinstance(part, bool) or not isinstance(part, int | float):
            return part
        name = f"n{len(parameters)}"
        parameters[name] = part
        return name

    for key in ("sections", "actuators", "bearings", "loads", "direction"):
        section[key] = named(section[key])
    data["mechanism"]["parameters"] = {**data["mechanism"].get("parameters", {}), **parameters}
    study = study_of(yaml.dump(data))
    values = {name: value * rng.uniform(0.9, 1.1, 4) for name, value in parameters.items()}
    lengths = [name for name in study.mechanism.nominal if name.endswith(".length")]
    values |= {name: study.mechanism.nominal[name] * rng.uniform(0.99, 1.01, 4) for name in lengths}
    designs = Designs(study, values)
    # What is measured from the sketch is read anew.
    assume(designs.alike)
    assert_as_alone(designs, stiffness, 1e-9, rounding=1e-13)
