"""Mechanisms of several chains, each against circles and triangles drawn by hand."""

from __future__ import annotations

import cmath
from typing import Any

import numpy as np
import pytest
from helpers.command_line import checked
from helpers.studies import study_of


def meet(a: np.ndarray | complex, r: float, b: np.ndarray | complex, s: float, side: int) -> np.ndarray:
    """Where the circles of radius r about a and s about b meet, left (+1) or right (-1) of the way from a to b."""
    span = b - a
    along = (abs(span) ** 2 + r * r - s * s) / (2 * abs(span))
    return a + span / abs(span) * (along + 1j * side * np.sqrt(r * r - along**2))


def points(mechanism: Any, pose: dict[str, object], names: str) -> list[np.ndarray]:
    solved = mechanism.solve(pose)
    assert solved.valid.all()
    return [solved[f"{name}.x"] + 1j * solved[f"{name}.y"] for name in names]


TURN = np.linspace(-180, 180, 25)
CRANK = np.exp(1j * np.radians(TURN))


def test_two_dyads_on_one_level_do_not_know_each_other() -> None:
    text = """
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], E: [-4, 0.5]}
    crank: [O, A, 1]
    rod: [A, B, 3.5]
    rocker: [D, B, 3]
    left_rod: [A, C, 4]
    left_rocker: [E, C, 2.5]
  drives: [crank]
  sketch: {A: [1, 0.5], B: [3, 3], C: [-3, 3]}
"""
    assert sum("RRR dyad" in line for line in checked(text)) == 2
    a, b, c = points(study_of(text).mechanism, {"crank": TURN}, "ABC")
    assert a == pytest.approx(CRANK)
    assert b == pytest.approx(meet(CRANK, 3.5, 4, 3, 1))
    assert c == pytest.approx(meet(CRANK, 4, -4 + 0.5j, 2.5, -1))


def test_a_dyad_hangs_on_two_dyads() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], E: [-4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {F: [2, 1]}}
    rocker: [D, B, 3]
    left_rod: [A, C, 4]
    left_rocker: {from: E, to: C, length: 2.5, points: {G: [3, 0.5]}}
    one: [F, H, 5]
    two: [G, H, 6]
  drives: [crank]
  sketch: {A: [1, 0.5], B: [3, 3], C: [-3, 3], F: [2, 2], G: [-3, 4], H: [0, 8]}
""").mechanism
    a, b, c, h = points(mechanism, {"crank": TURN}, "ABCH")
    f = a + (b - a) / 3.5 * (2 + 1j)
    g = -4 + (c + 4) / 2.5 * (3 + 0.5j)
    assert h == pytest.approx(meet(f, 5, g, 6, -1))


def test_an_open_chain_of_turning_and_sliding_links() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, A, 2]
    fore: {from: A, to: B, telescopic: true}
    hand: [B, P, 0.5]
  drives: {t1: {angle: upper}, t2: {angle: fore, from: upper}, l: {length: fore}, t3: {angle: hand, from: fore}}
  sketch: {A: [1.5, 1.3], B: [3, 1], P: [3.4, 0.7]}
""").mechanism
    assert mechanism.mobility == 4
    t1, t2, t3 = np.radians([20.0, -50.0, 35.0])
    (p,) = points(mechanism, {"t1": 20, "t2": -50, "l": TURN / 90 + 3, "t3": 35}, "P")
    fore = TURN / 90 + 3
    assert p == pytest.approx(2 * cmath.rect(1, t1) + fore * cmath.rect(1, t1 + t2) + cmath.rect(0.5, t1 + t2 + t3))
    given = {"P.x": p[3].real, "P.y": p[3].imag, "hand.angle": 5.0, "l": fore[3]}
    back = mechanism.solve(given)
    assert [float(back[name]) for name in ("t1", "t2", "t3")] == pytest.approx([20, -50, 35])


def test_an_open_branch_rides_on_a_closed_chain() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: [O, A, 1]
    rod: {from: A, to: B, length: 3.5, points: {E: [2, 1]}}
    rocker: [D, B, 3]
    arm: [E, P, 1.5]
    finger: [P, Q, 0.4]
  drives: {theta: {angle: crank}, wrist: {angle: arm, from: rod}, level: {angle: finger}}
  sketch: {A: [1, 0.5], B: [3, 3], E: [2, 2], P: [2, 3.5], Q: [2.4, 3.5]}
""").mechanism
    a, b, e, p, q = points(mechanism, {"theta": TURN, "wrist": 40, "level": -10}, "ABEPQ")
    rod = (b - a) / 3.5
    assert b == pytest.approx(meet(CRANK, 3.5, 4, 3, 1))
    assert p - e == pytest.approx(1.5 * rod * cmath.rect(1, np.radians(40)))
    assert q - p == pytest.approx(np.full(25, cmath.rect(0.4, np.radians(-10))))


def test_a_five_bar_of_two_cranks() -> None:
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0], D: [3, 0]}, left: [O, A, 1], right: [D, B, 1.2], l: [A, P, 3], r: [B, P, 3.3]}
  drives: [left, right]
  sketch: {A: [0, 1], B: [3, 1], P: [1.5, 3.5]}
""").mechanism
    (p,) = points(mechanism, {"left": TURN, "right": 90 - 2 * TURN}, "P")
    other = 3 + 1.2 * np.exp(1j * np.radians(90 - 2 * TURN))
    assert p == pytest.approx(meet(CRANK, 3, other, 3.3, 1))
    # Given P, each crank lies on the side of the way from its pivot to P on which it is drawn.
    there = mechanism.solve({"P.x": p.real[11], "P.y": p.imag[11]})
    left, right = meet(0, 1, p[11], 3, 1), meet(3, 1.2, p[11], 3.3, -1) - 3
    assert [float(there["left"]), float(there["right"])] == pytest.approx(list(np.degrees(np.angle([left, right]))))


def test_a_joint_between_moving_links_is_driven() -> None:
    mechanism = study_of("""
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 3.5], rocker: [D, B, 3]}
  drives: {elbow: {angle: rod, from: crank}}
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9]}
""").mechanism
    elbow = np.linspace(-80, 60, 15)
    a, b = points(mechanism, {"elbow": elbow}, "AB")
    arm = 1 + 3.5 * np.exp(1j * np.radians(elbow))
    assert b == pytest.approx(meet(0, abs(arm), 4, 3, 1))
    assert a == pytest.approx(b / arm)


def test_three_links_on_one_pin_and_a_link_of_four() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0], E: [0, 5], G: [7, 6]}
    crank: [O, A, 1]
    plate: {A: [0, 0], B: [3.5, 0], C: [1, 1.5], F: [3, 2]}
    rocker: [D, B, 3]
    up: [C, H, 2]
    stay: [E, H, 3]
    tie: [H, K, 4]
    last: [F, K, 4.5]
  drives: [crank]
  sketch: {A: [0.5, 0.87], B: [3.3, 2.9], C: [0.5, 2.8], F: [2.1, 4], H: [1, 4.5], K: [4, 7.5]}
""").mechanism
    turn = np.linspace(20, 100, 17)
    a, b, c, f, h, k = points(mechanism, {"crank": turn}, "ABCFHK")
    plate = (b - a) / 3.5
    assert b == pytest.approx(meet(np.exp(1j * np.radians(turn)), 3.5, 4, 3, 1))
    assert c - a == pytest.approx(plate * (1 + 1.5j))
    assert f - a == pytest.approx(plate * (3 + 2j))
    assert h == pytest.approx(meet(c, 2, 5j, 3, -1))
    assert k == pytest.approx(meet(h, 4, f, 4.5, 1))


def test_a_cylinder_between_two_moving_links_drives_them() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: {from: O, to: A, length: 1.5, points: {E: [0.7, 0.3]}}
    rod: {from: A, to: B, length: 3.5, points: {F: [1, 1]}}
    rocker: [D, B, 3]
    cylinder: {from: E, to: F, telescopic: true}
  drives: [cylinder]
  sketch: {A: [0.5, 1.4], B: [3.8, 3], E: [0, 0.8], F: [1, 2.7]}
""").mechanism
    length = np.linspace(1.6, 2.0, 9)
    a, b, e, f = points(mechanism, {"cylinder": length}, "ABEF")
    for begin, end, expected in ((0 * a, a, 1.5), (a, b, 3.5), (4 + 0 * a, b, 3.0), (e, f, length)):
        assert abs(end - begin) == pytest.approx(np.broadcast_to(expected, 9))
    # A, E and F make a triangle of known sides; the angle between the two links follows from its sides.
    near, far = 0.7 + 0.3j - 1.5, 1 + 1j
    corner = np.arccos((abs(near) ** 2 + abs(far) ** 2 - length**2) / (2 * abs(near) * abs(far)))
    between = np.angle((b - a) / 3.5 / (a / 1.5))
    assert np.abs(np.angle(far / near) + between) == pytest.approx(corner)


def test_a_slide_between_moving_links_is_driven() -> None:
    mechanism = study_of("""
mechanism:
  links:
    ground: {O: [0, 0], D: [4, 0]}
    crank: {O: [0, 0], K: [1, 0.2]}
    block: {A: [0, 0], S: [0.3, -0.1]}
    rod: [A, B, 3.5]
    rocker: [D, B, 3]
  joints: {ram: {prismatic: [crank, block], through: K, direction: 20, point: S, angle: -30}}
  drives: {theta: {angle: crank}, ram: {slide: ram}}
  sketch: {K: [1, 0.2], S: [1.5, 0.4], A: [1.2, 0.3], B: [3.3, 3]}
""").mechanism
    slide = np.linspace(-0.3, 0.5, 9)
    a, b = points(mechanism, {"theta": 75, "ram": slide}, "AB")
    line = cmath.rect(1, np.radians(20))
    pin = 1 + 0.2j + slide * line - (0.3 - 0.1j) * line * cmath.rect(1, np.radians(-30))
    assert a == pytest.approx(pin * cmath.rect(1, np.radians(75)))
    assert b == pytest.approx(meet(a, 3.5, 4, 3, 1))
