"""Reciprocal wrenches and the stiffness that they give: invariances and awkward cases; legs of a study."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from helpers.stiffness import ARM, BENT, FIVE_BAR, SLIDER, SLOTTED, ask_stiffness, matrix
from helpers.studies import study_of

from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.stiffness.bodies import NetworkEdge
from mechdesign.questions.stiffness.body import ask
from mechdesign.questions.stiffness.compliance import Held, by_wrenches
from mechdesign.questions.stiffness.elements import Beam, Hinge, SlideElement
from mechdesign.questions.stiffness.force_method import Twists, load, twists_of
from mechdesign.questions.stiffness.network import Network
from mechdesign.questions.stiffness.screws import (
    LegScrews,
    constraint_compliance,
    equivalent_springs,
    hinge_twist,
    joint_rank,
    reciprocal_wrenches,
    slide_twist,
)

LENGTH = 1.0


def at(*places: complex) -> list[np.ndarray]:
    return [hinge_twist(np.array([place])) for place in places]


def along(*directions: complex) -> list[np.ndarray]:
    return [slide_twist(np.array([direction / abs(direction)])) for direction in directions]


def chain(passive: list[np.ndarray], elastic: list[np.ndarray] = (), compliance: list[float] = ()) -> LegScrews:
    return LegScrews(passive, list(elastic), list(compliance), np.zeros(1, complex), np.zeros(1, complex))


def by_forces(*chains: LegScrews, size: int = 3) -> Held:
    """A body at the origin by the force method: every leg is one edge from the ground."""
    edges = tuple(NetworkEdge(GROUND, "body", (), f"leg {k}", "P") for k in range(len(chains)))
    loops = tuple(((k, 1), (0, -1)) for k in range(1, len(chains)))
    network = Network(edges, "body", "body", {}, {}, (), {GROUND: (), "body": ((0, 1),)}, loops)
    freedoms = [
        (k, twist, compliance)
        for k, leg in enumerate(chains)
        for twists, compliances in ((leg.passive, [None] * len(leg.passive)), (leg.elastic, leg.compliance))
        for twist, compliance in zip(twists, compliances, strict=True)
    ]
    n = len(chains[0].base)
    return load(
        Twists(
            network,
            np.stack([twist for _, twist, _ in freedoms]).transpose(2, 1, 0),
            np.tile([compliance or 0.0 for *_, compliance in freedoms], (n, 1)),
            np.array([compliance is None for *_, compliance in freedoms]),
            np.array([[float(leg == k) for leg, *_ in freedoms] for k in range(len(chains))])[None],
            np.zeros(n, complex),
            LENGTH,
        ),
        size,
    ).held


def by_legs(*chains: LegScrews, size: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness, compliance and where they are known, of legs of one rank each in all poses."""
    wrenches = []
    for leg in chains:
        rank = int(np.ravel(joint_rank(leg.passive, LENGTH))[0])
        wrenches.append(reciprocal_wrenches(leg.passive, rank, LENGTH, len(leg.base)))
    blocks = [constraint_compliance(w, leg) for w, leg in zip(wrenches, chains, strict=True)]
    return by_wrenches(wrenches, blocks, LENGTH, size)


def strut(base: complex, tip: complex, stiffness: float = np.inf) -> LegScrews:
    """A hinged leg that is elastic (or rigid) along its line only."""
    spring = ([], []) if np.isinf(stiffness) else (along(tip - base), [1 / stiffness])
    return chain(at(base, tip), *spring)


LEGS = [strut(-1 - 1j, -0.5, 3e3), strut(1 - 1.2j, 0.4 + 0.1j, 5e3), strut(0.2 - 1j, 0.7 + 0.2j, 2e3)]


@pytest.mark.parametrize(
    ("passive", "rank"),
    [
        ([], 0),
        (at(1 + 2j), 1),
        (along(1 + 1j), 1),
        (at(1 + 2j, -0.3j), 2),
        (at(1 + 2j) + along(2 - 1j), 2),
        (along(1, 1j), 2),
        (along(1 + 1j, 2 + 2j), 1),  # parallel slides
        (at(0.3, 0.3), 1),  # two joints in one place
        (at(0, 1, 3), 2),  # an elbow at full stretch
        (at(0, 1 + 0.1j, 3), 3),
        (at(0, 1, 3, 1 + 1j), 3),
    ],
)
def test_wrenches_do_no_work_on_the_free_joints(passive: list[np.ndarray], rank: int) -> None:
    assert np.all(joint_rank(passive, LENGTH) == rank)
    wrenches = reciprocal_wrenches(passive, rank, LENGTH, 1)[:, :, 0]
    assert wrenches.shape == (3, 3 - rank)
    assert rank == 3 or np.linalg.matrix_rank(wrenches) == 3 - rank
    for twist in passive:
        assert twist[:, 0] @ wrenches == pytest.approx(np.zeros(3 - rank), abs=1e-12)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_rank_does_not_depend_on_the_unit_of_length(unit: float) -> None:
    bent, straight = np.array([0, 1 + 1e-3j, 3]) * unit, np.array([0, 1, 3]) * unit
    assert joint_rank(at(*bent), unit) == 3
    assert joint_rank(at(*straight), unit) == 2


def test_stiffness_is_symmetric_and_positive() -> None:
    (stiffness,), (compliance,), _ = by_legs(*LEGS)
    assert (stiffness == stiffness.T).all()
    assert np.linalg.eigvalsh(stiffness).min() > 0
    assert stiffness @ compliance == pytest.approx(np.eye(3), abs=1e-12)


def test_any_basis_of_the_wrenches_gives_the_same_stiffness() -> None:
    """W -> W R leaves K of a leg unchanged [S4, eq. 21]."""
    leg = chain(along(1 + 2j), at(0.3 + 1j, -1 + 0.5j), [1e-5, 3e-6])
    wrenches = reciprocal_wrenches(leg.passive, 1, LENGTH, 1)
    mixed = np.einsum("imn,mk->ikn", wrenches, np.array([[2.0, -1.0], [0.5, 3.0]]))
    others = [reciprocal_wrenches(strut.passive, 2, LENGTH, 1) for strut in LEGS[:1]]
    blocks = [constraint_compliance(w, strut) for w, strut in zip(others, LEGS, strict=False)]
    one, other = (
        by_wrenches([w, *others], [constraint_compliance(w, leg), *blocks], LENGTH)[0][0] for w in (wrenches, mixed)
    )
    assert other == pytest.approx(one, rel=1e-12)


def test_constraint_space_compliance_does_not_depend_on_the_frame() -> None:
    """Moved and turned with the mechanism, K transforms as a tensor of screws [S4, eqs. 26, 30]."""
    shift, turn = 0.7 - 0.4j, np.exp(0.6j)

    def moved(leg: LegScrews) -> LegScrews:
        def carry(twist: np.ndarray) -> np.ndarray:
            if twist[2, 0] == 0:
                return along(complex(twist[0, 0], twist[1, 0]) * turn)[0]
            return at(complex(-twist[1, 0], twist[0, 0]) * turn + shift)[0]

        return chain([carry(t) for t in leg.passive], [carry(t) for t in leg.elastic], list(leg.compliance))

    here, there = by_forces(*LEGS).stiffness[0], by_forces(*map(moved, LEGS)).stiffness[0]
    rotate = np.array([[turn.real, -turn.imag, 0], [turn.imag, turn.real, 0], [0, 0, 1]])
    # Wrench about the new origin of a wrench at the shifted one.
    carry = np.array([[1, 0, 0], [0, 1, 0], [-shift.imag, shift.real, 1]])
    assert there == pytest.approx(carry @ rotate @ here @ rotate.T @ carry.T, rel=1e-9)


def test_one_rigid_leg_leaves_two_compliant_ways() -> None:
    rigid = by_forces(*LEGS[:2], strut(0.2 - 1j, 0.7 + 0.2j))
    stiffer = by_forces(*LEGS[:2], strut(0.2 - 1j, 0.7 + 0.2j, 1e14))
    assert np.isnan(rigid.stiffness).all()
    assert np.linalg.matrix_rank(rigid.compliance[0], tol=1e-9 * np.abs(rigid.compliance).max()) == 2
    assert rigid.compliance[0] == pytest.approx(stiffer.compliance[0], rel=1e-9)


def test_all_rigid_legs_hold_without_any_compliance() -> None:
    answer = by_forces(*(strut(*ends) for ends in ((-1 - 1j, -0.5), (1 - 1.2j, 0.4 + 0.1j), (0.2 - 1j, 0.7 + 0.2j))))
    assert (answer.compliance == 0).all()
    assert np.isnan(answer.stiffness).all()
    assert answer.rank[0] == 3


def test_over_constrained_legs_still_sum() -> None:
    legs = [*LEGS, strut(-0.3 + 2j, 0.1 + 1j, 4e3), strut(2, 1 + 0.3j, 1e3)]
    answer = by_forces(*legs)
    single = np.zeros((3, 3))
    for leg in legs:
        single += by_forces(leg).stiffness[0]
    assert answer.rank[0] == 3
    assert answer.stiffness[0] == pytest.approx(single, rel=1e-9)
    assert answer.compliance[0] @ single == pytest.approx(np.eye(3), abs=1e-10)


def test_redundant_rigid_legs_are_no_contradiction() -> None:
    """Two rigid struts on one line and two soft ones: the multipliers are not unique, the twist is."""
    double = [strut(-1, 0.5), strut(-2, 0.5), LEGS[0], LEGS[1]]
    assert by_forces(*double).compliance[0] == pytest.approx(by_forces(*double[1:]).compliance[0], rel=1e-9)


def test_stiffnesses_far_apart_keep_their_digits() -> None:
    soft, hard = 1e-3, 1e15
    answer = by_forces(strut(-1j, 0.2, soft), strut(1 - 1j, 1, hard), strut(-1 + 0.5j, 0.5j, hard))
    far = by_forces(strut(-1j, 0.2, 1.0), strut(1 - 1j, 1), strut(-1 + 0.5j, 0.5j))
    assert answer.compliance[0] * soft == pytest.approx(far.compliance[0], rel=1e-9, abs=1e-12)


def test_concurrent_legs_leave_the_turn_about_their_point_free() -> None:
    centre = 0.4 + 0.8j
    answer = by_forces(*(strut(base, (base + centre) / 2, 1e3) for base in (-1, 1 - 0.5j, 2j)))
    assert answer.rank[0] == 2
    assert np.isnan(answer.compliance).all()
    assert np.isfinite(answer.stiffness).all()
    assert answer.free[0] == pytest.approx([centre.imag, -centre.real, 1.0])
    assert answer.stiffness[0] @ answer.free[0] == pytest.approx(np.zeros(3), abs=1e-9)


def test_parallel_legs_leave_a_translation_free() -> None:
    answer = by_forces(*(strut(x - 1j, x, 1e3) for x in (-1.0, 0.2, 0.9)))
    assert answer.rank[0] == 2
    assert answer.free[0] * np.sign(answer.free[0, 0]) == pytest.approx([1, 0, 0])


def test_under_constrained_with_a_rigid_leg_has_neither_matrix() -> None:
    answer = by_forces(strut(-1j, 0), strut(1 - 1j, 1, 1e3))
    assert answer.rank[0] == 2
    assert np.isnan(answer.stiffness).all()
    assert np.isnan(answer.compliance).all()


def test_a_leg_rigid_in_its_links_turns_about_its_motor() -> None:
    """Driven R, passive P: C_c is singular; one spring is rigid through the motor, the other twice the arm away."""
    motor = 2e3
    leg = LegScrews(along(1), at(-0.5), [1 / motor], np.array([-0.5 + 0j]), np.zeros(1, complex))
    wrenches = reciprocal_wrenches(leg.passive, 1, LENGTH, 1)
    outer, inner = equivalent_springs(wrenches, leg, LENGTH)
    assert outer.place[0] == pytest.approx(0.5)
    assert outer.stiffness[0] == pytest.approx(motor / 1.0**2)
    assert inner.place[0] == pytest.approx(-0.5)
    assert np.isinf(inner.stiffness[0])


def test_two_wrenches_through_a_pin_give_its_principal_springs() -> None:
    pin = 0.3 + 0.2j
    leg = LegScrews(
        at(pin), along(np.exp(0.4j), 1j * np.exp(0.4j)), [1e-4, 1e-3], np.zeros(1, complex), np.array([pin])
    )
    wrenches = reciprocal_wrenches(leg.passive, 1, LENGTH, 1)
    stiff, soft = equivalent_springs(wrenches, leg, LENGTH)
    assert [stiff.stiffness[0], soft.stiffness[0]] == pytest.approx([1e4, 1e3])
    assert [stiff.angle[0], soft.angle[0]] == pytest.approx([0.4, 0.4 + np.pi / 2])
    assert stiff.place[0] == pytest.approx(pin)


def test_two_slides_leave_a_rotational_spring() -> None:
    leg = LegScrews(along(1, 1j), at(0.4), [1 / 500.0], np.zeros(1, complex), np.array([0.7 + 0j]))
    (spring,) = equivalent_springs(reciprocal_wrenches(leg.passive, 2, LENGTH, 1), leg, LENGTH)
    assert spring.stiffness[0] == pytest.approx(500.0)
    assert np.isnan(spring.angle[0])
    assert spring.place[0] == pytest.approx(0.7)


@pytest.mark.parametrize("legs", [LEGS, [*LEGS[:2], strut(0.2 - 1j, 0.7 + 0.2j)]], ids=["elastic", "one rigid"])
def test_reciprocal_wrenches_and_force_method_agree(legs: list[LegScrews]) -> None:
    stiffness, compliance, known = by_legs(*legs)
    other = by_forces(*legs)
    assert known.all()
    assert compliance[0] == pytest.approx(other.compliance[0], rel=1e-9, abs=1e-15)
    assert stiffness[0] == pytest.approx(other.stiffness[0], rel=1e-9, nan_ok=True)


@pytest.mark.parametrize("solve", [by_legs, by_forces])
def test_poses_of_a_batch_do_not_mix(solve: Callable[..., Any]) -> None:
    """Regular and concurrent legs in one batch."""
    tips = np.array([-0.5 + 0j, -0.5 + 0j])
    bases = [np.array([-1 - 1j, -1 - 1j]), np.array([1 - 1.2j, 1 - 1.2j]), np.array([0.2 - 1j, -1.3 - 0.4j])]
    ends = [tips, np.array([0.4 + 0.1j, -0.5]), np.array([0.7 + 0.2j, -0.5])]
    legs = []
    for base, end in zip(bases, ends, strict=True):
        direction = (end - base) / abs(end - base)
        legs.append(LegScrews([hinge_twist(base), hinge_twist(end)], [slide_twist(direction)], [1e-3], base, end))
    both, alone = solve(*legs), solve(*(leg.take(np.array([0])) for leg in legs))
    if isinstance(both, Held):
        assert both.rank.tolist() == [3, 2]
        assert both.compliance[0].tolist() == alone.compliance[0].tolist()
    else:
        assert both[2].tolist() == [True, False]
        assert both[1][0].tolist() == alone[1][0].tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [FIVE_BAR, ARM, SLIDER, BENT, SLOTTED], ids=["five_bar", "arm", "slider", "bent", "slot"]
)
@pytest.mark.parametrize("share", [0.1, 1.0, 10.0])
def test_the_force_method_gives_what_serial_legs_give(text: str, share: float) -> None:
    """Whatever length rotations are counted by."""
    study = study_of(text)
    asked = ask(study)
    assert asked.legs is not None
    pose = study.mechanism.solve({name: [value] for name, value in study.stiffness.poses[0].items()}).configuration
    held = load(twists_of(asked.network, asked.section, pose, share * asked.length(pose)), asked.size).held
    result = ask_stiffness(text)
    for letter, found in (("K", held.stiffness[0]), ("C", held.compliance[0])):
        expected = matrix(result, letter)
        scale = np.nanmax(np.abs(expected), initial=1e-300)
        assert found == pytest.approx(expected, rel=1e-10, abs=1e-12 * scale, nan_ok=True)


def test_leg_elements_in_order_from_the_base() -> None:
    links = study_of(SLIDER).mechanism.description.links
    upper, lower = Beam(links["crank"], "O", "A", "beam"), Beam(links["rod"], "A", "B", "beam")
    crank, guide = ask(study_of(SLIDER)).legs
    assert (crank.name, guide.name) == ("crank+rod", "guide")
    assert crank.elements == (Hinge("O", "crank"), upper, Hinge("A"), lower, Hinge("B"))
    assert [type(element) for element in guide.elements] == [SlideElement]
    # A rigid drive is no element.
    crank, _ = ask(study_of(SLIDER, "stiffness.actuators={}")).legs
    assert crank.elements[0] == upper
    _, lever = sorted(ask(study_of(SLOTTED)).legs, key=lambda leg: leg.name == "lever")
    assert [type(element) for element in lever.elements] == [Hinge, Beam, SlideElement, Hinge]


def test_a_link_of_several_points_is_one_beam_along_them() -> None:
    bracket, _ = ask(study_of(BENT)).legs
    link = study_of(BENT).mechanism.description.links["bracket"]
    assert link.corners == ("O", "M", "A", "X")
    assert [element for element in bracket.elements if isinstance(element, Beam)] == [Beam(link, "O", "A", "beam")]
