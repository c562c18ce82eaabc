"""Slides on elastic links, and brackets beside them, against beam formulas of textbooks and energies by hand."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from helpers.frames import posed
from helpers.stiffness import ask_stiffness, matrix
from helpers.studies import study_of
from numpy.testing import assert_allclose

import mechdesign

YOUNG, SHEAR, AREA, INERTIA = 2e5, 8e4, 20 * 40.0, 20 * 40.0**3 / 12
EI, EA, GA = YOUNG * INERTIA, YOUNG * AREA, 5 / 6 * SHEAR * AREA
SECTIONS = "sections: {beam: {E: 200 GPa, width: 20, height: 40}}"
STOCKY = "stiffness.sections.beam={E: 200 GPa, G: 80 GPa, width: 20, height: 40, shear: true}"
SPAN = 400.0
# A girder on a pin and a roller; points of its own beside its line, where nothing holds it.
GIRDER = f"""
mechanism:
  links:
    ground: {{A: [0, 0], B: [400, 0]}}
    girder: {{from: A, to: S, length: 400, points: {{T: [210, 80], U: [300, -40], V: [450, 30]}}}}
    trolley: {{W: [0, 0], H: [0, -50]}}
  joints:
    roller: {{slot: ground, through: B, point: S}}
    track: {{prismatic: [girder, trolley], through: A, point: W}}
  drives: {{t: {{slide: track}}}}
  sketch: {{S: [400, 0], W: [200, 0], H: [200, -50]}}
stiffness:
  link: trolley
  at: W
  {SECTIONS}
  elastic: {{girder: beam}}
  poses: [{{t: 100}}, {{t: 200}}, {{t: 350}}]
  loads: [[0, -1000, 0]]
"""


def supported(a: float, shear: bool = False) -> np.ndarray:
    """Lift and turn of a simply supported beam's section at distance a, under a force and a moment there."""
    b = SPAN - a
    soft = 1 / GA if shear else 0.0
    lift = a**2 * b**2 / (3 * EI * SPAN) + soft * a * b / SPAN
    turn = (a**3 + b**3) / (3 * EI * SPAN**2) + soft / SPAN
    both = a * b * (b - a) / (3 * EI * SPAN)
    return np.array([[lift, both], [both, turn]])


@pytest.mark.parametrize("shear", [False, True])
def test_a_trolley_on_a_simply_supported_girder(shear: bool) -> None:
    """F a^2 b^2 / 3EIL; the trolley cannot turn on its track, so that its moment enters there too."""
    result = ask_stiffness(GIRDER, *([STOCKY] if shear else []))
    for row, a in enumerate((100.0, 200.0, 350.0)):
        expected = np.zeros((3, 3))
        expected[0, 0], expected[1:, 1:] = a / EA, supported(a, shear)
        assert_allclose(matrix(result, "C", row), expected, rtol=1e-9, atol=1e-18)


def test_a_trolley_beyond_an_end_stands_on_a_rigid_bracket_from_it() -> None:
    """At a = L + d: the end's slope under a moment F d, L/3EI, on an arm d; likewise before the beginning, -d."""
    result = ask_stiffness(GIRDER, "stiffness.poses=[{t: 430}, {t: -30}]")
    for row in (0, 1):
        soft = matrix(result, "C", row)
        assert soft[1, 1] == pytest.approx(30.0**2 * SPAN / (3 * EI), rel=1e-9)
        assert soft[2, 2] == pytest.approx(SPAN / (3 * EI), rel=1e-9)
        assert abs(soft[1, 2]) == pytest.approx(30.0 * SPAN / (3 * EI), rel=1e-9)


def test_a_trolley_over_a_support_or_over_the_foot_of_a_bracket() -> None:
    """Parts of the beam without length, in a batch with others."""
    result = ask_stiffness(GIRDER, "stiffness.poses=[{t: 0}, {t: 150}, {t: 400}, {t: 210}]")
    for row, a in enumerate((0.0, 150.0, 400.0, 210.0)):
        expected = np.zeros((3, 3))
        expected[0, 0], expected[1:, 1:] = a / EA, supported(a)
        assert_allclose(matrix(result, "C", row), expected, rtol=1e-9, atol=1e-18)


def test_two_trolleys_pass_each_other() -> None:
    """Maxwell and Betti: the lift at one under a force at the other, whichever comes first on the girder."""
    text = GIRDER.replace("    trolley:", "    other: {X: [0, 0]}\n    trolley:")
    text = text.replace(
        "    track:", "    rail: {prismatic: [girder, other], through: [S, A], point: X}\n    track:"
    ).replace("drives: {", "drives: {s: {slide: rail}, ")
    text = text.replace("W: [200, 0],", "W: [200, 0], X: [150, 0],")
    poses = "stiffness.poses=[{t: 100, s: 80}, {t: 300, s: 250}, {t: 100, s: 300}, {t: 250, s: 100}]"
    table = ask_stiffness(text, poses).tables["displacements"]
    chosen = (table["link"] == "other") & (table["point"] == "X")
    for x, a, moved in zip(
        (320.0, 150.0, 100.0, 300.0), (100.0, 300.0, 100.0, 250.0), table["dy"][chosen], strict=True
    ):
        near, far = (x, SPAN - a) if x <= a else (SPAN - x, a)
        assert moved == pytest.approx(-1000 * far * near * (SPAN**2 - far**2 - near**2) / (6 * EI * SPAN), rel=1e-9)


def test_forces_in_the_girder_act_on_the_first_link_by_the_second() -> None:
    """Statics of a simply supported beam: the trolley presses the girder down, the girder its supports."""
    table = ask_stiffness(GIRDER).tables["forces"]
    rows = {
        (joint, on, by, load): (fx, fy, mz)
        for joint, on, by, load, fx, fy, mz in zip(
            *(table[name][:4] for name in ("joint", "on", "by", "load", "fx", "fy", "mz")), strict=True
        )
    }
    assert set(rows) == {
        ("roller", "ground", "slot:roller", 1), ("track", "girder", "trolley", 1), ("A", "ground", "girder", 1),
        ("S", "girder", "slot:roller", 1),
    }  # fmt: skip
    found = {joint: force for (joint, *_), force in rows.items()}
    for joint, fy in {"track": -1000, "A": -750, "roller": -250, "S": 250}.items():
        assert found[joint] == pytest.approx((0, fy, 0), abs=1e-7)


def lever(a: float) -> str:
    """A lever at 40 deg on a fixed pin, a rigid crank's pin in its slot at distance a, loaded at its end."""
    along = cmath.rect(1, math.radians(40))
    pin, tip = a * along, 450 * along
    return f"""
mechanism:
  links:
    ground: {{Q: [0, 0], O: [100, 250]}}
    crank: [O, P]
    lever: {{from: Q, to: T, length: 450}}
  joints: {{slit: {{slot: lever, through: Q, point: P}}}}
  drives: [crank]
  sketch: {{P: [{pin.real!r}, {pin.imag!r}], T: [{tip.real!r}, {tip.imag!r}]}}
stiffness:
  link: lever
  at: T
  {SECTIONS}
  elastic: {{lever: beam}}
  poses: [{{crank: {math.degrees(cmath.phase(pin - (100 + 250j)))!r}}}]
"""


@pytest.mark.parametrize("shear", [False, True])
@pytest.mark.parametrize("a", [300.0, 120.0])
def test_a_quick_return_lever(shear: bool, a: float) -> None:
    """F b^2 (a + b) / 3EI at the end across the lever; along it the pivot holds it by a + b."""
    c, s = math.cos(math.radians(40)), math.sin(math.radians(40))
    soft = matrix(ask_stiffness(lever(a), *([STOCKY] if shear else [])), "C")
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    b, give = 450 - a, 1 / GA if shear else 0.0
    expected = np.zeros((3, 3))
    expected[0, 0] = 450 / EA
    expected[1, 1] = b**2 * 450 / (3 * EI) + give * (b + b**2 / a)
    expected[1, 2] = expected[2, 1] = b * (2 * a + 3 * b) / (6 * EI) + give * b / a
    expected[2, 2] = (a / 3 + b) / EI + give / a
    assert_allclose(turn @ soft @ turn.T, expected, rtol=1e-8, atol=1e-16)


def test_a_slider_on_a_coupler_that_moves() -> None:
    """The girder is the inclined coupler of a four-bar whose crank is held: a pin at one end, a strut at the other.

    Across it the strut bears F a / L, and so along itself more, which stretches the strut and the girder.
    """
    text = f"""
mechanism:
  links:
    ground: {{O: [0, 0], D: [380, -60]}}
    crank: [O, A, 120]
    girder: [A, B, 400]
    strut: [D, B, 260]
    block: {{W: [0, 0]}}
  joints: {{track: {{prismatic: [girder, block], through: A, point: W}}}}
  drives: {{crank: {{angle: crank}}, t: {{slide: track}}}}
  sketch: {{A: [60, 104], B: [440, 195], W: [200, 130]}}
stiffness:
  link: block
  at: W
  {SECTIONS}
  elastic: {{girder: beam, strut: beam}}
  poses: [{{crank: 60, t: 50}}, {{crank: 110, t: 260}}]
"""
    study = study_of(text)
    result = ask_stiffness(text)
    for row, (crank, a) in enumerate(((60, 50.0), (110, 260.0))):
        pose = study.mechanism.solve({"crank": crank, "t": a})
        start, end = (complex(float(pose[f"{p}.x"]), float(pose[f"{p}.y"])) for p in "AB")
        along, strut = (end - start) / 400, (end - (380 - 60j)) / 260
        across = (strut * along.conjugate()).imag
        # A force 1 across the girder at a: the strut pushes with p.
        push = a / SPAN / across
        pull = push * (strut * along.conjugate()).real
        energy = a**2 * (SPAN - a) ** 2 / (3 * EI * SPAN) + pull**2 * SPAN / EA + push**2 * 260 / EA
        normal = np.array([-along.imag, along.real])
        assert normal @ matrix(result, "C", row)[:2, :2] @ normal == pytest.approx(energy, rel=1e-9)


def boom(height: float, foot: float = 250.0) -> str:
    """A boom on a fixed pin, held at a lug `height` beside its line by a rigid strut, loaded at its end."""
    return f"""
mechanism:
  links:
    ground: {{O: [0, 0], D: [-100, -300]}}
    boom: {{from: O, to: T, length: 600, points: {{M: [{foot!r}, {height!r}]}}}}
    strut: {{from: D, to: M, telescopic: true}}
  drives: [strut]
  sketch: {{T: [600, 0], M: [{foot!r}, {height!r}]}}
stiffness:
  link: boom
  at: T
  {SECTIONS}
  elastic: {{boom: beam}}
  poses: [{{boom.angle: 0}}]
"""


def by_energy(height: float, foot: float) -> float:
    """Twice the energy of the boom under a force 1 down at its end, from its bending moments and axial forces."""
    lug = foot + 1j * height
    line = (lug - (-100 - 300j)) / abs(lug - (-100 - 300j))
    # Moments about O: the strut pushes along its line.
    push = 600 / (lug.conjugate() * line).imag
    welded = min(max(foot, 0.0), 600.0)
    x, weights = np.polynomial.legendre.leggauss(8)
    total = 0.0
    for low, high, held in ((0.0, welded, True), (welded, 600.0, False)):
        at = (low + high) / 2 + (high - low) / 2 * x
        arm = lug - at
        moment = (600 - at) - (push * (arm.conjugate() * line).imag if held else 0.0)
        axial = -push * line.real if held else 0.0
        total += (high - low) / 2 * float(weights @ (moment**2 / EI + axial**2 / EA))
    return total


@pytest.mark.parametrize(
    ("height", "foot"), [(0.0, 250.0), (1e-6, 250.0), (1.0, 250.0), (80.0, 250.0), (-80.0, 400.0), (50.0, 700.0)]
)
def test_a_lug_is_a_rigid_bracket_from_its_foot_on_the_boom(height: float, foot: float) -> None:
    assert matrix(ask_stiffness(boom(height, foot)), "C")[1, 1] == pytest.approx(by_energy(height, foot), rel=1e-9)


def test_forces_along_a_prop_have_the_signs_of_the_columns() -> None:
    """The strut pushes the lug up and the ground back; its rod, held by the boom, pushes its first part likewise."""
    lug = 250 + 80j
    line = (lug - (-100 - 300j)) / abs(lug - (-100 - 300j))
    push = 1000 * 600 / (lug.conjugate() * line).imag
    table = ask_stiffness(boom(80.0), "stiffness.loads=[[0, -1000, 0]]").tables["forces"]
    found = {(row["joint"], row["on"], row["by"]): complex(row["fx"], row["fy"]) for row in table}
    expected = {
        ("D", "ground", "strut"): -push * line, ("strut", "strut", "strut"): -push * line,
        ("M", "boom", "strut"): push * line, ("O", "ground", "boom"): push * line - 1000j,
    }  # fmt: skip
    assert {key: found[key] for key in expected} == {key: pytest.approx(force) for key, force in expected.items()}


def test_a_lug_beside_the_line_is_continuous_with_one_on_it() -> None:
    on, beside, apart = (matrix(ask_stiffness(boom(height)), "C") for height in (0.0, 1e-6, 1.0))
    assert_allclose(beside, on, rtol=1e-7, atol=1e-8 * np.abs(on).max())
    assert_allclose(apart, on, rtol=0.02, atol=1e-3 * np.abs(on).max())


@pytest.mark.slow
@pytest.mark.parametrize("turned", [-3.0, 1.0])
def test_a_platform_whose_pins_slide_in_slots_rides_on_their_beams(turned: float) -> None:
    """A platform on two levers in whose slots its pins slide, and a strut: serial legs."""
    study = study_of(f"""
mechanism:
  links:
    ground: {{A: [0, 0], B: [500, 0], D: [250, 400]}}
    one: {{from: A, to: A2, length: 300, points: {{K: [20, 40]}}}}
    two: {{from: B, to: B2, length: 180}}
    strut: [D, F, 220]
    plate: {{E: [0, 0], G: [200, 20], F: [100, 60]}}
  joints:
    first: {{slot: one, through: K, direction: 5, point: E}}
    second: {{slot: two, through: B, point: G}}
  drives: {{a: {{angle: one}}, b: {{angle: two}}}}
  sketch: {{E: [120, 190], G: [330, 190], F: [220, 200], A2: [170, 240], B2: [350, 100], K: [10, 40]}}
stiffness:
  link: plate
  at: F
  {SECTIONS}
  elastic: {{one: beam, two: beam, strut: beam}}
  actuators: {{a: 1e8 N*mm/rad, b: 2e8 N*mm/rad}}
  poses: [{{a: {55 + turned}, b: {140 + turned}}}]
""")
    result = mechdesign.stiffness(study)
    assert result.tables["stiffness"]["method"].tolist() == ["serial legs"]
    expected = posed(study).compliance()
    assert_allclose(matrix(result, "C"), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
