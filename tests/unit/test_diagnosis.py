"""Wrong and odd mechanisms: the message names the links and joints, and what would mend them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of

import mechdesign

GROUND = "ground: {O: [0, 0], D: [100, 0], M: [50, 0]}"
FOUR_BAR = "crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]"
SKETCH = "{A: [0, 30], B: [75, 55]}"
CRANKS = "crank: [O, A, 30], crank2: [D, B, 30], crank3: [M, C, %s], coupler: {A: [0, 0], B: [100, 0], C: [50, 0]}"
RAISED = "{A: [10, 28], B: [110, 28], C: [60, 28]}"
# Four pins with all six bars between them, on two links of a four-bar.
FULL = "crank: [O, A, 40], b: [D, B, 45], l: [A, B], m: [A, C], n: [B, C], o: [A, E], p: [B, E], q: [C, E]"
FULL_SKETCH = "{A: [0, 40], B: [105, 45], C: [30, 100], E: [70, 110], F: [40, 100]}"


def study(
    links: str, drives: str = "[crank]", sketch: str = SKETCH, joints: str = "{}", ground: str = GROUND, more: str = ""
) -> str:
    parts = {"links": f"{{{ground}, {links}}}", "joints": joints, "drives": drives, "sketch": sketch}
    return "mechanism:\n" + "".join(f"  {key}: {part}\n" for key, part in parts.items()) + more


def told(*arguments: str, **named: str) -> str:
    """What is said of a wrong mechanism."""
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(study(*arguments, **named))
    return str(caught.value)


def described(*arguments: str, **named: str) -> list[str]:
    return checked(study(*arguments, **named))


@pytest.mark.parametrize("drives", ["[crank]", "[]"])
def test_a_third_equal_crank_repeats_the_others(drives: str) -> None:
    message = told(CRANKS % 30, drives, RAISED)
    assert "mechanism.links.crank3: the count gives mobility 0, yet with these dimensions it moves with 1" in message
    assert "link 'crank3' repeats what the other links impose: leave it out" in message
    assert ("then give 1 drive instead of 0" in message) == (drives == "[]")


def test_without_what_repeats_the_chain_moves() -> None:
    mechanism = study_of(study(CRANKS.replace("crank3: [M, C, %s], ", ""), "[crank]", RAISED)).mechanism
    assert mechanism.solve({"crank": 40})["crank2.angle"] == pytest.approx(40)


def test_two_links_too_many_are_both_named() -> None:
    links = CRANKS.replace("C: [50, 0]", "C: [50, 0], E: [70, 0]") % 30 + ", crank4: [N, E, 30]"
    message = told(links, "[crank]", RAISED, ground=GROUND[:-1] + ", N: [70, 0]}")
    assert "links 'crank4' and 'crank3' repeat" in message


def test_a_driven_link_is_not_the_one_to_leave_out() -> None:
    assert "link 'crank2' repeats" in told(CRANKS % 30, "[crank3]", RAISED)


@pytest.mark.slow
def test_a_third_crank_of_another_length_makes_it_rigid() -> None:
    message = told(CRANKS % 35, "[crank]", RAISED)
    assert "the mobility is 0 but 1 drive is given: it is rigid" in message
    assert "over-constrained" not in message


def test_a_motion_that_is_only_infinitesimal_is_none() -> None:
    # Two bars stretched between their pivots: their pin gives way to the first order only.
    message = told("crank: [O, A, 50], b: [D, A, 50]", "[crank]", "{A: [50, 0.1]}")
    assert "it is rigid" in message


@pytest.mark.slow
def test_a_stretched_part_beside_one_that_moves_stays_rigid() -> None:
    # a and b, measured from the sketch, lie on one line; the leg moves truly.
    message = told(
        "a: [O, A], b: [A, N], leg: {from: N, to: P, telescopic: true}", "[]", "{A: [10, 20], P: [10, 10]}",
        ground="ground: {O: [0, 30], N: [30, 0]}",
    )  # fmt: skip
    assert "the mobility is 2 but 0 drives are given: add 2 drives, for example {angle: leg}, 'leg'" in message


def test_a_change_point_hides_no_motion() -> None:
    # The cranks lie on the line of their pivots, where the parallelogram could go over into its other form.
    message = told(CRANKS % 30, "[crank]", "{A: [30, 0], B: [130, 0], C: [80, 0]}")
    assert "the count gives mobility 0, yet with these dimensions it moves with 1 degree of freedom" in message


def test_a_second_guide_is_a_joint_too_many() -> None:
    message = told(
        "block: {A: [0, 0], B: [0, 10]}", "[g]", "{A: [5, 0], B: [5, 10]}",
        "{g: {prismatic: [ground, block], through: O, point: A}, "
        "h: {prismatic: [ground, block], through: N, point: B}}", ground=GROUND[:-1] + ", N: [0, 10]}",
    )  # fmt: skip
    assert "mechanism.joints.h: the count gives mobility 0" in message
    assert "joint 'h' repeats" in message


@pytest.mark.slow
@pytest.mark.parametrize("drawn", ["[10, 28]", "[11, 27]", "[10, 28.284271247461902]"])
def test_an_over_constrained_part_is_found_where_the_count_agrees(drawn: str) -> None:
    # The chain c1-c2-c3 is placed by its own drive, so that every link seems to be.
    links = CRANKS % 30 + ", c1: [B, E, 40], c2: [E, F, 40], c3: [W, F, 30]"
    sketch = RAISED.replace("[10, 28]", drawn)[:-1] + ", E: [140, 50], F: [190, 30]}"
    message = told(links, "[c3]", sketch, ground=GROUND[:-1] + ", W: [200, 0]}")
    assert "the count gives mobility 1, yet with these dimensions it moves with 2 degrees of freedom" in message


@pytest.mark.slow
def test_a_part_that_floats_and_holds_itself_too_often() -> None:
    # The count of equations for each link and pin is right; that within the floating part is not.
    assert "mechanism.links.q: the count gives mobility 0, yet" in told(
        FULL, "[crank]", FULL_SKETCH.replace(", F: [40, 100]", "")
    )
    message = told(FULL.replace("q: [C, E]", "q: [C, E, 80]") + ", r: [C, F, 10]", "[crank]", FULL_SKETCH)
    assert "links 'l', 'm', 'n', 'o', 'p' and 'q' hold each other more often than it takes" in message
    assert "link 'r' turns freely about 'C'" in message


def test_a_brace_makes_a_rigid_loop_of_three() -> None:
    message = told(FOUR_BAR + ", brace: {from: A, to: D}")
    assert "A rigid loop: links 'ground', 'crank' and 'brace'; leave one" in message


def test_a_truss_without_drives_is_a_structure_and_stays() -> None:
    assert "mobility: 0, loops: 1, drives: none" in described("a: [O, A, 80], b: [D, A, 70]", "[]", "{A: [50, 50]}")


@pytest.mark.slow
@pytest.mark.parametrize("roller", ["{B: [0, 0]}", "{B: [0, 0], Q: [5, 0]}"])
def test_a_roller_turns_idly(roller: str) -> None:
    message = told(f"{FOUR_BAR}, roller: {roller}")
    assert "mechanism.drives: the mobility is 2 but 1 drive is given: with 'crank' held, link 'roller' turns" in message
    assert "freely about 'B'" in message
    assert "'roller', clamp it to 'rod' or 'rocker', or leave it out" in message


def test_idle_slides_and_legs_are_named() -> None:
    links = "crank: [O, A, 10], s1: {S: [0, 0]}, s2: {T: [0, 0]}, leg: {from: A, to: B, telescopic: true}"
    joints = "{g: {prismatic: [ground, s1]}, h: {prismatic: [s1, s2], direction: 90}}"
    message = told(links, "[crank]", "{A: [1, 1], B: [5, 5], S: [5, 0], T: [5, 5]}", joints)
    for text in (
        "joint 'g' slides freely",
        "joint 'h' slides",
        "link 'leg' turns freely about 'A'",
        "leg 'leg' slides",
    ):
        assert text in message


def test_one_part_fixed_twice_and_another_free() -> None:
    message = told(f"{FOUR_BAR}, arm: [B, Q, 20]", "[crank, rocker]")
    assert "'crank' and 'rocker' fix links 'crank', 'rod' and 'rocker' twice over" in message
    assert "with the drives held, link 'arm' turns freely about 'B'" in message


def test_what_slides_only_and_is_held_twice() -> None:
    links, joints = (
        "l: [O, A, 20], s: {S: [0, 0]}, t: {T: [0, 0]}, r: [S, T]",
        ("{j: {prismatic: [l, s], direction: 90, point: S}, k: {prismatic: [s, t], point: T}}"),
    )
    message = told(links, "[l, k]", "{A: [10, 10], S: [10, 0], T: [20, 30]}", joints)
    assert (
        "'k' fixes links 's' and 'r' and joint 'k' twice over; with the drives held, joint 'j' slides freely" in message
    )


def test_given_outputs_that_say_the_same() -> None:
    mechanism = study_of(study("arm: [O, P, 10], other: [D, Q, 5]", "[arm, other]", "{}")).mechanism
    with pytest.raises(
        mechdesign.MechanismError, match=r"'P\.x' and 'P\.y' fix link 'arm' twice over.*'other' turns freely"
    ):
        mechanism.solve({"P.x": 3, "P.y": 4})
    with pytest.raises(mechdesign.MechanismError, match=r"'D\.x' never changes: point 'D' is fixed"):
        mechanism.solve({"D.x": 3, "arm": 4})


def test_drives_of_what_is_clamped() -> None:
    clamp = "{w: {fixed: [ground, crank], angle: 90}}"
    assert "mechanism.drives.0: 'crank' never changes" in told("crank: [O, A, 30]", "[crank]", "{}", clamp)
    links, clamp = "crank: [O, A, 30], b: [A, B, 30]", "{w: {fixed: [b, crank], angle: 90}}"
    assert "mechanism.drives.x: 'x' never changes" in told(links, "{x: {angle: crank, from: b}}", SKETCH, clamp)


def test_any_of_too_many_drives_could_go() -> None:
    assert "remove 1 drive (one of 'crank' or 'rocker'" in told(FOUR_BAR, "[crank, rocker]")


def test_a_misspelt_pin_shows_as_two_loose_ends() -> None:
    message = told(FOUR_BAR.replace("[A, B", "[AA, B"))
    assert "Points 'A' ('crank') and 'AA' ('rod') are on one link each" in message


@pytest.mark.parametrize(
    ("link", "message"),
    [
        ("twin: [A, B, 90]", "'A' and 'B' are on link 'rod' too: the two are one rigid body"),
        ("twin: {A: [1, 2], C: [9, 9], B: [1, 92]}", "'A' and 'B' are on link 'rod' too: the two are one rigid body"),
        ("twin: [A, B, 80]", "'A' and 'B' are on link 'rod' too, but 90 apart there and 80 here"),
        ("twin: [O, D, 100]", "'O' and 'D' are on link 'ground' too: the two are one rigid body; leave it out"),
    ],
)
def test_links_that_share_two_points(link: str, message: str) -> None:
    assert f"mechanism.links.twin: {message}" in told(f"{FOUR_BAR}, {link}")


def test_a_slider_that_is_pinned_to_its_guide() -> None:
    guide = "{g: {prismatic: [arm, block], through: D, point: A}}"
    message = told("crank: [O, A, 30], arm: {D: [0, 0], A: [90, 0]}, block: {A: [0, 0]}", joints=guide)
    assert "mechanism.joints.g: point 'A' is on link 'arm' too, so that it cannot slide" in message
    slot = "{g: {slot: arm, through: D, point: A}}"
    assert "'A' is on link 'arm' too" in told("crank: [O, A, 30], arm: {D: [0, 0], A: [90, 0]}", joints=slot)


def test_links_that_cannot_meet_tell_how_far_and_where_they_could() -> None:
    message = told("crank: [O, A, 30], rod: [A, B, 30], rocker: [D, B, 60]", sketch="{A: [0, 30], B: [30, 40]}")
    assert "(crank = 90): links rod (30) and rocker (60) cannot meet at B: A and D are 104.4 apart" in message
    assert "the links reach only 90" in message
    low, high = map(float, re.findall(r"crank between (\S+) and (\S+);", message)[0])
    # Law of cosines at the pivot O, the joints A and D 90 apart.
    limit = np.degrees(np.arccos((30**2 + 100**2 - 90**2) / (2 * 30 * 100)))
    assert (low, high) == pytest.approx((-limit, limit), rel=1e-4)


def test_links_that_are_too_unlike() -> None:
    message = told("crank: [O, A, 30], rod: [A, B, 200], rocker: [D, B, 6]")
    assert "A and D are 104.4 apart, the links span no less than 194; check the lengths" in message


def test_a_slide_out_of_reach() -> None:
    links, joints = "crank: [O, A, 40], rod: [A, B, 70], slider: {B: [0, 0]}", "{guide: {prismatic: [ground, slider]," \
        " through: G}}"  # fmt: skip
    message = told(links, "[crank]", "{A: [0, 40], B: [110, -60]}", joints, "ground: {O: [0, 0], G: [0, -60]}")
    assert "link rod (70) is too short to reach its slide: the line of 'guide' passes A at a distance of 100" in message
    # The line is in reach while the crank's pin is at most 70 - 60 above the pivot.
    assert "between -194.48 and 14.478" in message


def test_a_turning_slide_too_near() -> None:
    message = told(
        "crank: [O, A, 10], arm: {D: [0, 0], Q: [0, 40]}, block: {A: [0, 0]}", "[crank]", "{A: [0, 10], Q: [20, 20]}",
        "{g: {prismatic: [arm, block], through: Q, point: A}}", "ground: {O: [0, 0], D: [20, 0]}",
    )  # fmt: skip
    assert "slide 'g' cannot close: its joints D and A are 22.361 apart, nearer than the 40" in message


def test_parallel_slides_hold_nothing() -> None:
    joints = "{h: {prismatic: [ground, yoke], through: D, point: Y}, g: {slot: yoke, through: Y, point: A}}"
    message = told("crank: [O, A, 10], yoke: {Y: [0, 0]}", "[crank]", "{A: [0, 10], Y: [20, 20]}", joints)
    assert "the slides 'h' and 'g' are parallel" in message


def test_a_link_whose_joints_are_at_one_place() -> None:
    message = told("crank: [O, A, 30], rod: {A: [0, 0], B: [0, 0]}, rocker: [D, B, 60]")
    assert "the joints on link rod (0) are at one place; put them apart" in message


STEPHENSON = (
    "crank: [O, A, 30], t: {A: [0, 0], B: [90, 0], C: [45, 40]}, rocker: [D, B, 60], l: [C, E, %s], out: [F, E, %s]"
)
FIXED = "ground: {O: [0, 0], D: [100, 0], F: [150, 0]}"


def test_a_group_without_a_closed_form_that_cannot_close() -> None:
    drawn = "{A: [0, 30], B: [75, 55], C: [20, 70], E: [150, 20]}"
    message = told(STEPHENSON % (10, 20), "[out]", drawn, ground=FIXED)
    assert "(out = 90): links crank, t, rocker, l do not meet (joints A, B, C, D, E, O), at best" in message


def test_a_sketch_far_off_is_told_where_the_mechanism_closes() -> None:
    drawn = "{A: [0, -30], B: [-75, 55], C: [-20, -70], E: [120, 90]}"
    message = told(STEPHENSON % (100, 100), "[out]", drawn, ground=FIXED)
    better = re.findall(r"it closes at (\{.*\})", message)[0]
    mechanism = study_of(study(STEPHENSON % (100, 100), "[out]", better, ground=FIXED)).mechanism
    assert mechanism.solve({"out": 108})["out.angle"] == pytest.approx(108)


@pytest.mark.parametrize(
    ("links", "joints", "sketch", "name"),
    [
        ("rod: [A, B, 90], rocker: [D, B, 60]", "{}", SKETCH, "RRR dyad rocker-rod at D, B, A: "),
        ("rod: [A, B, 90], slider: {B: [0, 0]}", "{g: {prismatic: [ground, slider], through: D}}", "{A: [0, 30], "
         "B: [75, 0]}", "RRP dyad rod-slider at A, B along g: rod.angle, g.slide (larger g.slide)"),
        ("rod: [A, B, 90]", "{g: {slot: ground, through: D, point: B}}", "{A: [0, 30], B: [75, 0]}",
         "RRP dyad rod at A, B along g: "),
        ("arm: {D: [0, 0]}, block: {A: [0, 0]}", "{g: {prismatic: [arm, block], through: D}}", "{A: [0, 30]}",
         "RPR dyad arm-block at D, A along g: arm.angle, block.angle, g.slide (larger g.slide)"),
        ("yoke: {Y: [0, 0]}, s: {A: [0, 0]}", "{h: {prismatic: [ground, yoke], through: D, point: Y}, "
         "g: {prismatic: [yoke, s], through: Y, direction: 90, point: A}}", "{A: [0, 30], Y: [0, 0]}",
         "RPP dyad s-yoke at A along g, h: "),
        ("y: {Y: [0, 0]}", "{h: {slot: crank, through: A, point: Y}, "
         "g: {prismatic: [ground, y], through: D, point: Y, direction: 90}}",
         "{A: [25, 15], Y: [100, 60]}", "PRP dyad y at Y along "),
    ],
)  # fmt: skip
def test_check_names_dyads_by_their_joints_in_order(links: str, joints: str, sketch: str, name: str) -> None:
    lines = described("crank: [O, A, 30], " + links, "[crank]", sketch, joints)
    assert any(name in line for line in lines), lines


def test_check_tells_what_the_drives_place_measures_limits_and_branch() -> None:
    more = "  measures: {mu: {angle: [rod, rocker]}, gap: {distance: [A, D]}, lead: 'B.x - A.x'}\n"
    more += "  limits: [{angle: [rod, rocker], min: 30, max: 150}, {drive: crank, min: -400, max: 400}]\n"
    lines = described(FOUR_BAR, more=more)
    for line in (
        "placed by the drives: crank",
        "  1. RRR dyad rocker-rod at D, B, A: rod.angle, rocker.angle (B left of D-A)",
        "branch: side",
        "measure: mu, angle from rod to rocker",
        "measure: gap, distance of A and D",
        "measure: lead = B.x - A.x",
        "limit: angle rod-rocker from 30 to 150",
        "limit: drive crank from -400 to 400",
    ):
        assert line in lines, lines
    assert not any("singular" in line for line in lines)


def test_check_tells_of_a_singular_sketch() -> None:
    # At 90 deg rod and rocker are stretched between the crank's pin and the other pivot.
    lines = described("crank: [O, A, 30], rod: [A, B, 90], rocker: [O, B, 60]", sketch=SKETCH)
    assert any("warning: the sketch is at a singular position" in line for line in lines), lines
