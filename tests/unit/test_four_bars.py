"""Four-bars and slider-cranks inside mechanisms: classes, transmission angles, links in line; against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of

import mechdesign

PARTS = ("frame", "input", "coupler", "output")


def result(text: str, *overrides: str) -> mechdesign.Answer:
    return mechdesign.kinematics(study_of(text, *overrides))


def loops(text: str) -> list[dict[str, Any]]:
    return list(result(text).tables["loops"])


def links(loop: dict[str, Any]) -> tuple[str, ...]:
    return tuple(loop[part] for part in PARTS)


def lengths_of(loop: dict[str, Any]) -> list[float]:
    return [loop[f"{part}_length"] for part in PARTS]


def four_bar(frame: float, crank: float, rod: float, rocker: float) -> str:
    """Drawn halfway through its range, rod and rocker meeting on the left of the line from crank pin to pivot."""
    reach = (max(abs(frame - crank), abs(rod - rocker)) + min(frame + crank, rod + rocker)) / 2
    cosine = (frame**2 + crank**2 - reach**2) / (2 * frame * crank)
    pin = crank * complex(cosine, np.sqrt(1 - cosine**2))
    along = (reach**2 + rod**2 - rocker**2) / (2 * reach)
    joint = pin + (frame - pin) / reach * complex(along, np.sqrt(rod**2 - along**2))
    return f"""
mechanism:
  links:
    ground: {{O: [0, 0], D: [{frame}, 0]}}
    crank: [O, A, {crank}]
    rod: [A, B, {rod}]
    rocker: [D, B, {rocker}]
  drives: [crank]
  sketch: {{A: [{pin.real}, {pin.imag}], B: [{joint.real}, {joint.imag}]}}
kinematics: {{sweep: {{crank: {{from: 0, to: 360, step: 5}}}}}}
"""


SLIDER_CRANK = """
mechanism:
  parameters: {r: 40, l: 120, e: -20}
  links:
    ground: {O: [0, 0], G: [0, e]}
    crank: [O, A, r]
    rod: [A, B, l]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G, point: B}}
  drives: [crank]
  sketch: {A: [20, 35], B: [125, -20]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 5}}}
"""
# A pin on the crank in a slot along the arm.
QUICK_RETURN = """
mechanism:
  parameters: {r: 1, d: 2}
  links: {ground: {O: [0, 0], D: [0, -d]}, crank: [O, A, r], arm: {D: [0, 0], E: [4, 0]}}
  joints: {slot: {slot: arm, through: D, point: A}}
  drives: [crank]
  sketch: {A: [r, 0.1], E: [1.8, 1.6]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 5}}}
"""
CYLINDER = """
mechanism:
  links: {ground: {O: [0, 0], D: [-3, 0]}, crank: [O, A, 1], cylinder: {from: D, to: A, telescopic: true}}
  drives: [crank]
  sketch: {A: [0.5, 0.8]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 5}}}
"""


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        # Norton, Design of Machinery, sec. 2.13: the shortest link's place names a Grashof linkage.
        ((4, 1, 3.5, 3), "crank-rocker"),
        ((1, 4, 3.5, 3), "double-crank"),
        ((4, 3.5, 1, 3), "double-rocker"),
        ((4, 3, 3.5, 1), "rocker-crank"),
        ((5, 3, 2.5, 3.5), "triple-rocker"),
        ((4, 1, 4, 1), "change point"),
        ((2, 1.1, 2.3, 1.4), "change point"),
    ],
)
def test_grashofs_classes(lengths: tuple[float, float, float, float], expected: str) -> None:
    (loop,) = loops(four_bar(*lengths))
    assert (loop["kind"], links(loop)) == ("four-bar", ("ground", "crank", "rod", "rocker"))
    assert loop["joints"] == "O A B D"
    assert lengths_of(loop) == pytest.approx(lengths)
    assert loop["class"] == expected
    shortest, p, q, longest = sorted(lengths)
    assert loop["excess"] == pytest.approx(p + q - shortest - longest, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lengths", "turns"),
    [
        ((4, 1, 3.5, 3), True),
        ((1, 4, 3.5, 3), True),
        ((4, 3.5, 1, 3), False),
        ((4, 3, 3.5, 2.2), False),
        ((5, 3, 2.5, 3.5), False),
    ],
)
def test_the_class_agrees_with_the_motion(lengths: tuple[float, float, float, float], turns: bool) -> None:
    """A crank turns fully exactly where no limit of its motion is found."""
    assert (len(result(four_bar(*lengths)).tables["limits"]) == 0) == turns
    assert (loops(four_bar(*lengths))[0]["class"] in ("crank-rocker", "double-crank")) == turns


def test_the_input_is_the_driven_link_wherever_it_is_named() -> None:
    text = four_bar(4, 1, 3.5, 3).split("kinematics")[0].replace("drives: [crank]", "drives: [rocker]")
    (loop,) = loops(text)
    assert links(loop) == ("ground", "rocker", "rod", "crank")
    assert loop["class"] == "rocker-crank"


def test_transmission_angle_of_a_crank_rocker() -> None:
    """Smallest and largest where crank and frame are in line, by the cosine law (Norton, sec. 4.10)."""
    (row,) = result(four_bar(4, 1, 2.5, 3)).tables["loops"]

    def between(span: float) -> float:
        return float(np.degrees(np.arccos((2.5**2 + 3**2 - span**2) / (2 * 2.5 * 3))))

    # The angle grows from 65.4 deg at 3 between the pivots to a right angle on the way to 5, where it is 130.5 deg.
    assert row["transmission_min"] == pytest.approx(min(between(3), 180 - between(5)), abs=1e-9)
    assert row["transmission_min_at"] == 180
    assert row["transmission_max"] == pytest.approx(90, abs=1e-9)
    across = np.degrees(np.arccos((1 + 4**2 - 2.5**2 - 3**2) / (2 * 1 * 4)))
    assert row["transmission_max_at"] == pytest.approx(across, abs=1e-7)


def test_transmission_angle_between_poses_and_at_a_limit() -> None:
    text = four_bar(4, 1, 2.5, 3)
    (row,) = result(text, "kinematics.sweep.crank={from: 3, to: 363, step: 7.2}").tables["loops"]
    assert row["transmission_min"] == pytest.approx(np.degrees(np.arccos(-(2.5**2 + 3**2 - 5**2) / 15)), abs=1e-9)
    assert row["transmission_min_at"] == pytest.approx(180, abs=1e-5)
    (row,) = result(four_bar(4, 3, 3.5, 2.2)).tables["loops"]
    assert row["transmission_min"] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("step", "begin"), [(5, 0), (7.3, 1)])
def test_a_rocker_reverses_where_crank_and_rod_are_in_line(step: float, begin: float) -> None:
    sweep = f"kinematics.sweep.crank={{from: {begin}, to: {begin + 359}, step: {step}}}"
    table = result(four_bar(4, 1, 3.5, 3), sweep).tables["toggles"]

    def at(reach: float) -> float:
        return float(np.degrees(np.arccos((reach**2 + 4**2 - 3**2) / (2 * reach * 4))))

    assert table["crank"] == pytest.approx([at(4.5), 180 + at(2.5)], abs=1e-9)
    assert list(table["state"]) == ["extended", "folded"]
    assert set(table["links"]) == {"crank rod"}
    assert set(table["joints"]) == {"O A B"}
    assert set(table["effect"]) == {"rocker reverses"}


def test_a_dead_centre_of_the_motion_is_a_toggle() -> None:
    tables = result(four_bar(4, 3, 3.5, 2.2)).tables
    toggles = tables["toggles"]
    stretched = list(toggles["links"] == "rod rocker")
    assert toggles["crank"][stretched] == pytest.approx(tables["limits"]["crank"], abs=1e-9)
    assert set(toggles["effect"][stretched]) == {"crank at its limit"}
    reach = np.abs(3 * np.exp(1j * np.radians(toggles["crank"][stretched])) - 4)
    expected = {"extended": 5.7, "folded": 1.3}
    assert reach == pytest.approx([expected[state] for state in toggles["state"][stretched]])


def test_a_parallelogram_in_line_is_a_change_point() -> None:
    table = result(four_bar(4, 1, 4, 1)).tables["toggles"]
    assert list(table["crank"]) == [0, 0, 180, 180, 360, 360]
    assert set(table["effect"]) == {"change point"}


def test_links_in_line_at_a_pose_and_at_both_ends_of_a_turn() -> None:
    table = result(SLIDER_CRANK, "mechanism.parameters.e=0").tables["toggles"]
    assert list(table["crank"]) == [0, 180, 360]
    assert list(table["state"]) == ["extended", "folded", "extended"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("r", "l", "e", "expected"),
    [
        (40, 120, -20, "crank-slider"),
        (40, 60, -20, "change point"),
        (40, 59, -20, "rocker-slider"),
        (40, 41, 0, "crank-slider"),
        (60, 41, 0, "rocker-slider"),
    ],
)
def test_a_slider_crank_turns_where_the_rod_is_longer_than_crank_and_offset(
    r: float, l: float, e: float, expected: str  # noqa: E741
) -> None:  # fmt: skip
    joint = complex(np.sqrt(3) / 2, 0.5) * r
    place = joint.real + np.sqrt(l**2 - (joint.imag - e) ** 2)
    text = SLIDER_CRANK.replace("sketch: {A: [20, 35], B: [125, -20]}", f"sketch: {{A: [{joint.real}, {joint.imag}], B: [{place}, {e}]}}")  # fmt: skip  # noqa: E501
    given = [f"mechanism.parameters.{name}={value}" for name, value in zip("rle", (r, l, e), strict=True)]
    study = study_of(text, *given)
    tables = mechdesign.kinematics(study).tables
    (loop,) = tables["loops"]
    assert (loop["kind"], links(loop)) == ("slider-crank", ("ground", "crank", "rod", "slider"))
    assert (loop["offset"], *lengths_of(loop)[1:3]) == pytest.approx((abs(e), r, l))
    assert loop["class"] == expected
    assert (len(tables["limits"]) > 0) == (expected == "rocker-slider")


def test_transmission_angle_and_strokes_of_an_offset_slider_crank() -> None:
    tables = result(SLIDER_CRANK).tables
    (row,) = tables["loops"]
    # sin of the pressure angle: (r + |e|)/l at the bottom.
    assert row["transmission_min"] == pytest.approx(np.degrees(np.arccos(60 / 120)), abs=1e-9)
    assert (row["transmission_min_at"], row["class"]) == (90, "crank-slider")
    toggles = tables["toggles"]
    reach = np.array([160, 80])
    expected = np.degrees(np.arcsin(-20 / reach)) % 360 + [0, 180]
    assert toggles["crank"] == pytest.approx(sorted(expected % 360), abs=1e-9)


@pytest.mark.parametrize(("d", "expected"), [(2, "oscillating block"), (0.6, "turning block")])
def test_inversions_with_a_slot(d: float, expected: str) -> None:
    text = QUICK_RETURN if d > 1 else QUICK_RETURN.replace("sketch: {A: [r, 0.1], E: [1.8, 1.6]}", "sketch: {A: [1, 0.1], E: [3, 2]}")  # fmt: skip  # noqa: E501
    study = study_of(text, f"mechanism.parameters.d={d}")
    tables = mechdesign.kinematics(study).tables
    (loop,) = tables["loops"]
    assert (loop["kind"], links(loop)) == ("inverted slider-crank", ("ground", "crank", "slot block", "arm"))
    assert loop["class"] == expected
    assert tables["loops"]["transmission_min"] == pytest.approx([90])
    toggles = tables["toggles"]
    if d > 1:
        # The arm reverses where the crank is square to it: sin(crank) = -r/d.
        assert toggles["crank"] == pytest.approx([210, 330], abs=1e-9)
        assert set(toggles["state"]) == {"perpendicular"}
        assert set(toggles["effect"]) == {"arm reverses"}
    else:
        assert len(toggles) == 0


def test_a_telescopic_leg_is_two_bodies() -> None:
    (loop,) = loops(CYLINDER)
    assert links(loop) == ("ground", "crank", "cylinder rod", "cylinder")
    assert (loop["kind"], loop["class"], loop["offset"]) == ("inverted slider-crank", "oscillating block", 0)
    sweep = "kinematics: {sweep: {cylinder: {from: 3, to: 3.5, number: 3}}}\n"
    (driven,) = loops(CYLINDER.split("kinematics")[0].replace("[crank]", "[cylinder]") + sweep)
    assert links(driven) == ("ground", "cylinder", "cylinder rod", "crank")


def test_a_clamp_at_the_tip_of_a_leg_holds_its_rod() -> None:
    # Leg, its rod with the plate, and a link: the pin B of the plate is apart from the leg's line.
    text = """
units: {length: m}
mechanism:
  links:
    ground: {A: [-0.6, 0], D: [0.6, 0]}
    leg: {from: A, to: E, telescopic: true}
    plate: {E: [-0.2, 0], B: [0.2, 0]}
    link: [D, B, "hypot(0.4, 1)"]
  joints: {clamp: {fixed: [leg, plate], point: E}}
  drives: {theta: {angle: leg}}
  sketch: {E: [-0.2, 1], B: [0.2, 1]}
kinematics: {sweep: {theta: {from: 60, to: 75, step: 5}}}
"""
    (loop,) = loops(text)
    assert links(loop) == ("ground", "leg", "leg rod", "link")
    assert loop["joints"] == "A leg B D"
    # Of B from the leg's line, which leads from A by (0.4, 1).
    assert loop["offset"] == pytest.approx(0.4 / np.hypot(0.4, 1))


def test_clamped_links_are_one_body() -> None:
    text = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: [A, B, 3.5]
    lower: [D, E, 1]
    upper: [E, B, 2]
  joints: {weld: {fixed: [lower, upper], point: E, angle: 0}}
  drives: [crank]
  sketch: {A: [0, 1], B: [3, 2.8], E: [3.6, 1]}
"""
    (loop,) = loops(text)
    assert links(loop) == ("ground", "crank", "rod", "lower")
    assert lengths_of(loop) == pytest.approx((4, 1, 3.5, 3))


def test_loops_of_a_watt_linkage_and_their_inputs() -> None:
    """The second loop has no ground: its frame is the first named of its links, its input what is known first."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {A: [0, 0], B: [3.5, 0], C: [2, 1.5]}
    rocker: {D: [0, 0], B: [3, 0], E: [2.5, -2]}
    link_1: [C, F, 2.5]
    link_2: [E, F, 3]
  drives: [crank]
  sketch: {A: [0, 1], B: [3.2, 2.9], C: [1.2, 3.4], E: [5.3, 2.5], F: [3.3, 4.8]}
kinematics: {sweep: {crank: {from: 0, to: 360, step: 5}}}
"""
    first, second = loops(text)
    assert links(first) == ("ground", "crank", "rod", "rocker")
    assert links(second) == ("rod", "rocker", "link_2", "link_1")
    assert lengths_of(second) == pytest.approx((np.hypot(1.5, 1.5), np.hypot(0.5, 2), 3, 2.5))


def test_a_compound_pin_belongs_to_each_of_its_loops() -> None:
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0], E: [-4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3],
          rod_2: [A, C, 3.5], rocker_2: [E, C, 3]}
  drives: [crank]
  sketch: {A: [0, 1], B: [3, 2.9], C: [-3, 2.9]}
"""
    found = loops(text)
    assert {links(loop) for loop in found} == {
        ("ground", "crank", "rod", "rocker"), ("ground", "crank", "rod_2", "rocker_2"),
    }  # fmt: skip


@pytest.mark.parametrize(
    "text",
    [
        """
mechanism:
  links: {ground: {O: [0, 0]}, arm: [O, P, 1]}
  drives: [arm]
kinematics: {sweep: {arm: {from: 0, to: 90, step: 5}}}
""",
        """
mechanism:
  links: {ground: {O: [0, 0], E: [4, 0]}, a: [O, A, 2], b: [E, B, 2], c: [A, C, 3], d: [B, C, 3]}
  drives: [a, b]
  sketch: {A: [0, 2], B: [4, 2], C: [2, 4]}
kinematics: {sweep: {a: {from: 80, to: 100, step: 5}, b: 90}}
""",
    ],
    ids=["arm", "five-bar"],
)
def test_other_chains_have_none(text: str) -> None:
    found = result(text)
    assert not any(line.startswith("four-bar") for line in checked(text))
    assert "loops" not in found.tables
    assert "toggles" not in found.tables


def test_listed_poses_give_the_row() -> None:
    found = result(four_bar(4, 1, 2.5, 3).split("kinematics")[0] + "kinematics: {poses: [{crank: 90}, {crank: 180}]}")
    (row,) = found.tables["loops"]
    assert row["transmission_min_at"] == 1
    assert "toggles" not in found.tables


def test_loops_in_words() -> None:
    lines = checked(four_bar(4, 1, 3.5, 3))
    assert "four-bar ground-crank-rod-rocker (O A B D): crank-rocker, s + l 5 < p + q 6.5" in lines
    (line,) = (line for line in checked(SLIDER_CRANK) if line.startswith("slider-crank"))
    assert line.endswith("crank-slider, crank + offset 60 < rod 120")


def test_an_invariant_name_for_every_order_of_links() -> None:
    """The same linkage with its links named in another order is the same loop."""
    text = four_bar(4, 1, 3.5, 3)
    other = text.replace("crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]", "rocker: [B, D, 3], rod: [B, A, 3.5], crank: [O, A, 1]")  # fmt: skip  # noqa: E501
    (one,), (two,) = loops(text), loops(other)
    assert (links(one), one["class"]) == (links(two), two["class"])
    assert lengths_of(one) == pytest.approx(lengths_of(two))


def test_transmission_angle_of_a_cylinder_that_drives_is_between_its_line_and_the_lever() -> None:
    answer = result("""
mechanism:
  links:
    ground: {O: [0, 0], G: [300, 0]}
    boom: [O, B, 250]
    cylinder: {from: G, to: B, telescopic: true}
  drives: [cylinder]
  sketch: {B: [0, 250]}
kinematics: {sweep: {cylinder: {from: 200, to: 500, step: 10}}}
""")
    # The law of cosines in the triangle O B G.
    for end, length in (("max", 200), ("min", 500)):
        cosine = (250**2 + length**2 - 300**2) / (2 * 250 * length)
        angle = float(answer.tables["loops"][f"transmission_{end}"][0])
        assert angle == pytest.approx(np.degrees(np.arccos(cosine)), abs=1e-9)
    assert len(answer.tables["toggles"]) == 0


@pytest.mark.slow
def test_one_crank_moves_many_rockers() -> None:
    """Each rod and rocker makes one four-bar with the crank, and two of them none with each other."""
    count = 60
    turns = np.exp(2j * np.pi * np.arange(count) / count)
    bases, ends = 300 * turns, 300 * turns + 120j * turns
    ground = ", ".join(f"D{k}: [{z.real:.9f}, {z.imag:.9f}]" for k, z in enumerate(bases))
    drawn = ", ".join(f"B{k}: [{z.real:.9f}, {z.imag:.9f}]" for k, z in enumerate(ends))
    links = "\n".join(f"    rod_{k}: [A, B{k}, 310]\n    rocker_{k}: [D{k}, B{k}, 150]" for k in range(count))
    study = study_of(f"""
mechanism:
  links:
    ground: {{O: [0, 0], {ground}}}
    crank: [O, A, 50]
{links}
  drives: {{q: {{angle: crank}}}}
  sketch: {{A: [50, 0], {drawn}}}
kinematics: {{outputs: [B7], sweep: {{q: {{from: 0, to: 360, step: 30}}}}}}
""")
    table = mechdesign.kinematics(study).tables["loops"]
    assert len(table) == count
    # Grashof: 50 + 310 < 300 + 150.
    assert set(table["class"]) == {"crank-rocker"}
