"""Regions of several pieces: which count, against formulas of the mechanisms and a flood fill on a fine grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from helpers.studies import study_of
from scipy import ndimage

import mechdesign
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.question import questions
from mechdesign.region.curves import workspace_nodes
from mechdesign.region.rays import SINGLE

FIVE_BAR = """
units: {length: dimensionless}
mechanism:
  parameters: {a: 0.25, b: 0.4, h: 0.15, low: 30, high: 200}
  links:
    ground: {A: [-h, 0], B: [h, 0]}
    left: [A, C, a]
    right: [B, D, a]
    fore_left: [C, P, b]
    fore_right: [D, P, b]
  drives: {t1: {angle: left}, t2: {angle: right}}
  limits: [{drive: t1, min: low, max: high}, {drive: t2, min: 180 - high, max: 180 - low}]
  sketch: {C: [-0.3, 0.2], D: [0.3, 0.2], P: [0, 0.48]}
workspace: {point: P, scan: {about: [0.05, 0.45]}}
"""
LEGS = """
units: {length: dimensionless}
mechanism:
  parameters: {low: 1.2, high: 1.6}
  measures: {d: C.x*C.y, across: (C.x - 0.5)*C.x}
  links:
    ground: {B1: [1, 0], B2: [-1, 0]}
    leg_1: {from: B1, to: C, telescopic: true}
    leg_2: {from: B2, to: C, telescopic: true}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}}
  limits: [{drive: l1, min: low, max: high}, {drive: l2, min: low, max: high}]
  sketch: {C: [0, 1]}
workspace: {point: C, scan: {about: [0, 0]}, assembly: same, indices: []}
"""
WIDE = "{drive: l1, min: 0.2, max: 3}, {drive: l2, min: 0.2, max: 3}"
ARM = """
units: {length: dimensionless}
mechanism:
  parameters: {low: 0.9, high: 2}
  links: {ground: {O: [0, 0], W: [1.2, 0]}, upper: [O, E, 1.5], lower: [E, P, 1]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  limits: [{distance: [W, P], min: low, max: high}]
  sketch: {E: [-1, 1], P: [-2, 1]}
workspace: {point: P, scan: {about: [0, 0]}, indices: [sigma_min]}
"""
CELLS = 1600
Inside = Callable[[np.ndarray], np.ndarray]


def five_bar(low: float = 30, high: float = 200) -> Inside:
    """Elbows out, motors within limits, one side of the singularity: legs solved here."""

    def inside(z: np.ndarray) -> np.ndarray:
        elbows, good = [], np.ones(z.shape, dtype=bool)
        for base, side, start in ((-0.15, 1, low), (0.15, -1, 180 - high)):
            k = z - base
            cosine = (0.25**2 + np.abs(k) ** 2 - 0.4**2) / (2 * 0.25 * np.abs(k))
            good &= np.abs(cosine) < 1
            angle = np.angle(k) + side * np.arccos(np.clip(cosine, -1, 1))
            good &= np.radians(high - low) > (angle - np.radians(start)) % (2 * np.pi)
            elbows.append(base + 0.25 * np.exp(1j * angle))
        return np.asarray(good & ((np.conj(z - elbows[0]) * (z - elbows[1])).imag > 0))

    return inside


def legs(low: float, high: float) -> Inside:
    def inside(z: np.ndarray) -> np.ndarray:
        one, two = np.abs(z - 1), np.abs(z + 1)
        return np.asarray((np.minimum(one, two) > low) & (np.maximum(one, two) < high) & (z.imag > 0))

    return inside


class Filled:
    """Pieces of a region on a grid of cells of a square: areas, and the piece at a place."""

    def __init__(self, inside: Inside, half: float) -> None:
        self.half, self.cell = half, 2 * half / CELLS
        x = (np.arange(CELLS) + 0.5) * self.cell - half
        good = inside(x + 1j * x[:, None])
        self.label, _ = ndimage.label(good)
        self.areas = np.bincount(self.label.ravel()) * self.cell**2
        # Cells that the boundary meets may be counted wrongly by half of their area.
        edge = good ^ ndimage.binary_erosion(good)
        self.doubt = 0.3 * np.bincount(self.label[edge], minlength=len(self.areas)) * self.cell**2

    def at(self, x: float, y: float) -> int:
        row, column = (int((v + self.half) / self.cell) for v in (y, x))
        return int(self.label[row, column])


def check(result: mechdesign.Answer, filled: Filled, number: int) -> None:
    """Every piece has the area of the flood fill's piece at its place, and the indices are of the first."""
    main, pieces = result.main, result.tables["pieces"]
    assert pieces["piece"].tolist() == list(range(1, number + 1))
    there = [filled.at(x, y) for x, y in zip(pieces["x"], pieces["y"], strict=True)]
    assert 0 not in there
    assert len(set(there)) == number
    for area, k in zip(pieces["area"], there, strict=True):
        assert abs(area - filled.areas[k]) < filled.doubt[k]
    assert (np.diff(pieces["area"][1:]) <= 1e-4 * pieces["area"].sum()).all()
    assert main["area"][0] == pytest.approx(pieces["area"][0], rel=2e-6)
    local, boundary = result.tables["local"], result.tables["boundary"]
    x, y = (boundary[name][boundary["piece"] == 1] for name in ("x", "y"))
    assert main["box_area"][0] == pytest.approx(np.ptp(x) * np.ptp(y), rel=1e-3)
    assert set(local["piece"]) == set(boundary["piece"]) == set(range(1, number + 1))
    for x, y, piece in list(zip(local["x"], local["y"], local["piece"], strict=True))[16::33]:
        # In their thin tips pieces fall into many on a grid.
        assert filled.at(x, y) not in {*there} - {there[piece - 1]}
    (warning,) = (each for each in map(str, result.warnings) if "forward singularity" not in each)
    assert f"has {number} pieces" in warning
    assert f"{pieces['area'][1:].sum():.4g}" in warning


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, 0]", "[0.05, 0.45]", "[0.7, 0.1]", "[0, -0.3]"])
def test_two_pieces_of_equal_determinant_signs(about: str) -> None:
    """Limits of the motors cut what the assembly leaves in two: seen from inside, from between, and from outside."""
    result = mechdesign.workspace(study_of(FIVE_BAR, f"workspace.scan.about={about}", "workspace.indices=[]"))
    check(result, Filled(five_bar(), 0.85), 2)
    assert result.tables["pieces"]["sketch"].tolist() == [1, 0]
    # The circle and the rectangle lie in the upper piece, too.
    assert result.main["circle_y"][0] - result.main["circle_radius"][0] > 0
    assert result.main["rectangle_y"][0] > 0.2


@pytest.mark.nightly
def test_means_and_extremes_are_of_the_sketchs_piece() -> None:
    """As of a scan that meets nothing else."""
    text = (FIVE_BAR, "workspace.indices=[inverse_condition, resistivity]")
    one = mechdesign.workspace(study_of(*text)).main
    alone = mechdesign.workspace(study_of(*text, "workspace.scan={about: [0, 0], from: 0, to: 180}"))
    assert "pieces" not in alone.tables
    assert not alone.warnings
    for name in ("GII", "GRI", "SUI", "area", "box_area", "inverse_condition_std", "resistivity_min"):
        assert one[name][0] == pytest.approx(alone.main[name][0], rel=1e-4), name


@pytest.mark.nightly
def test_a_piece_over_angle_zero_is_one() -> None:
    """Two lenses left and right of a gap along the vertical, seen from the middle: the right one lies about angle 0."""
    limits = f"mechanism.limits=[{WIDE}, {{measure: across, min: 0.2}}]"
    text = (LEGS, limits, "mechanism.sketch.C=[-1.2, 1]", "workspace.scan.about=[0.1, 0.6]")
    result = mechdesign.workspace(study_of(*text))

    def inside(z: np.ndarray) -> np.ndarray:
        one, two = np.abs(z - 1), np.abs(z + 1)
        good = (one > 0.2) & (two > 0.2) & (one < 3) & (two < 3) & (z.imag > 0)
        return np.asarray(good & ((z.real - 0.5) * z.real > 0.2))

    check(result, Filled(inside, 3.1), 2)
    assert result.tables["pieces"]["sketch"].tolist() == [1, 0]
    assert result.tables["pieces"]["x"][0] < 0 < result.tables["pieces"]["x"][1]


@pytest.mark.nightly
def test_pieces_that_touch_in_the_centre_of_the_scan_are_two() -> None:
    """x y > 0 within two rings about bases on the axis: opposite quadrants meet in one point."""
    limits = f"mechanism.limits=[{WIDE}, {{measure: d, min: 0}}]"
    for about in ("[0, 0]", "[0.4, 0.7]"):
        # In any assembly both quadrants are reached, and count together.
        text = (LEGS, limits, f"workspace.scan.about={about}", "workspace.assembly=any", "mechanism.sketch.C=[0.3, 1]")
        result = mechdesign.workspace(study_of(*text))
        pieces = result.tables["pieces"]
        assert pieces["area"] == pytest.approx(np.full(2, result.main["area"][0] / 2), rel=1e-5)
        assert pieces["x"][0] > 0 > pieces["x"][1]
        assert not result.warnings


@pytest.mark.slow
def test_a_hole_that_cuts_a_ring_in_two() -> None:
    """A narrow ring about a wall's pin: the arm's hole divides it on one side, and its farthest reach on the other."""
    text = (ARM, "mechanism.parameters={low: 1.32, high: 1.45}", "mechanism.sketch={E: [0, 1.5], P: [1.2, 1.4]}")
    result = mechdesign.workspace(study_of(*text))

    def inside(z: np.ndarray) -> np.ndarray:
        wall = np.abs(z - 1.2)
        return np.asarray((np.abs(z) > 0.5) & (np.abs(z) < 2.5) & (wall > 1.32) & (wall < 1.45))

    check(result, Filled(inside, 2.6), 2)
    assert result.tables["pieces"]["sketch"].tolist() == [1, 0]
    assert result.tables["pieces"]["y"][0] > 0


@pytest.mark.slow
def test_the_largest_piece_counts_where_the_sketch_lies_in_none() -> None:
    """Drawn in the gap, right of its middle."""
    limits = f"mechanism.limits=[{WIDE}, {{measure: across, min: 0.2}}]"
    result = mechdesign.workspace(study_of(LEGS, limits, "mechanism.sketch.C=[0.25, 1]"))
    pieces = result.tables["pieces"]
    assert pieces["sketch"].tolist() == [0, 0]
    assert pieces["area"][0] > 1.1 * pieces["area"][1]
    assert pieces["x"][0] < 0 < pieces["x"][1]
    assert result.main["area"][0] == pytest.approx(pieces["area"][0], rel=2e-6)
    assert "largest" in str(result.warnings[0])


@pytest.mark.slow
def test_one_piece_makes_no_table() -> None:
    result = mechdesign.workspace(study_of(ARM, "mechanism.limits=[]"))
    assert "pieces" not in result.tables
    assert set(result.tables["local"]["piece"]) == {1}
    assert not result.warnings


def values(names: Sequence[str], changes: dict[str, np.ndarray], text: str) -> dict[str, np.ndarray]:
    entries = {f"mechanism.parameters.{name}": column for name, column in changes.items()}
    table = mechdesign.evaluate(study_of(text), entries, names)
    assert table["valid"].all()
    return {name: table[name] for name in names}


@pytest.mark.nightly
def test_optimize_judges_the_piece_that_workspace_reports() -> None:
    """Designs of one, two and three pieces in a batch, each beside a study of its own."""
    names = ("GII", "SUI", "workspace.area", "workspace.resistivity_min")
    changes = {"low": np.array([30.0, 60.0, 30.0]), "high": np.array([200.0, 170.0, 340.0])}
    together = values(names, changes, FIVE_BAR.replace("{point", "{indices: [inverse_condition, resistivity], point"))
    several = 0
    for k in range(3):
        own = [f"mechanism.parameters.{name}={float(column[k])}" for name, column in changes.items()]
        result = mechdesign.workspace(study_of(FIVE_BAR, *own, "workspace.indices=[inverse_condition, resistivity]"))
        several += "pieces" in result.tables
        for name in names:
            alone = result.main[name.removeprefix("workspace.")][0]
            assert together[name][k] == pytest.approx(alone, rel=3e-4), (name, k)
    assert several == 2


# Thin gaps and tips beside limits and determinants, some of them between the first rays of a scan.
THIN = {
    "low": np.array([30.0, 100.0, 30.0, 90.0, 74.71]),
    "high": np.array([360.0, 215.0, 195.0, 200.0, 165.1794]),
    "a": np.array([0.25, 0.25, 0.26, 0.25, 0.2535]),
    "b": np.array([0.4, 0.4, 0.4, 0.4, 0.3896]),
}


@pytest.mark.nightly
def test_optimize_finds_thin_gaps_and_tips() -> None:
    """As a study of its own that is looked at more closely."""
    names = {"workspace.area": 1e-6, "GII": 1e-5, "SUI": 1e-6}
    together = values(list(names), THIN, FIVE_BAR)
    for k in range(len(THIN["low"])):
        own = [f"mechanism.parameters.{name}={float(column[k])}" for name, column in THIN.items()]
        alone = mechdesign.workspace(study_of(FIVE_BAR, *own, "workspace.indices=[]")).main
        for name, tolerance in names.items():
            there = alone[name.removeprefix("workspace.")][0]
            assert together[name][k] == pytest.approx(there, rel=tolerance), (name, k)


def design_area(text: str, limit: str, sizes: str) -> float:
    """Area of a study's only design, in an optimisation from another one."""
    varied = ", ".join(
        f"{name}: {{from: {v}, to: {v}, number: 1}}" for name, v in (one.split("=") for one in sizes.split())
    )
    study = study_of(
        text, f"mechanism.limits=[{{measure: m, {limit}}}]", f"optimize={{variables: {{{varied}}}, minimize: area}}"
    )
    return float(mechdesign.optimize(study).tables["designs"]["area"][0])


@pytest.mark.nightly
def test_breaks_between_alike_rays_do_not_lose_a_piece() -> None:
    """A bay that opens and ends between two rays: its neighbours were no part of any piece."""
    text = """
mechanism:
  parameters: {l1: 10, l2: 12}
  links: {ground: {O: [-4, 0], Q: [4, 0]}, one: [O, A, l1], fore_1: [A, P, l2], two: [Q, B, l1], fore_2: [B, P, l2]}
  drives: {q1: {angle: one}, q2: {angle: two}}
  sketch: {A: [-10, 8], B: [10, 8], P: [0, 14]}
  measures: {m: B.x*A.x}
workspace: {point: P, indices: []}
"""
    found = design_area(text, "min: -172.592", "l1=9.564339226156775 l2=9.969322744521554")
    x = np.linspace(-21, 21, 1500)
    z, half = x + 1j * x[:, None], 4.0
    elbows = []
    with np.errstate(invalid="ignore"):
        for base, side in ((-half, 1), (half, -1)):
            k = z - base
            along = (np.abs(k) ** 2 + 9.564339226156775**2 - 9.969322744521554**2) / (2 * np.abs(k))
            elbows.append(base + k / np.abs(k) * (along + 1j * side * np.sqrt(9.564339226156775**2 - along**2)))
        one, two = elbows
        inside = (one.real * two.real > -172.592) & ((np.conj(z - one) * (z - two)).imag > 0)
    label, _ = ndimage.label(inside)
    # The sketch's piece is the largest.
    assert found == pytest.approx(np.bincount(label.ravel())[1:].max() * (x[1] - x[0]) ** 2, rel=2e-3)


@pytest.mark.slow
def test_angles_in_a_limited_expression_are_near_each_designs_own_sketch() -> None:
    """They were near those of the study's, and their turns other ones."""
    text = """
mechanism:
  parameters: {l1: 10, l2: 12}
  links: {ground: {O: [-4, 0], Q: [4, 0]}, one: [O, A, l1], fore_1: [A, P, l2], two: [Q, B, l1], fore_2: [B, P, l2]}
  drives: {q1: {angle: one}, q2: {angle: two}}
  sketch: {A: [-10, 8], B: [10, 8], P: [0, 14]}
  measures: {m: fore_1.angle - fore_2.angle}
workspace: {point: P, indices: [], assembly: any}
"""
    sizes = {"l1": 9.0195, "l2": 10.0765}
    study = study_of(text, "mechanism.limits=[{measure: m, max: -48.3471}]")
    other = study_of(
        text, "mechanism.limits=[{measure: m, max: -48.3471}]",
        *(f"mechanism.parameters.{name}={value}" for name, value in sizes.items()),
    )  # fmt: skip
    x, y = np.random.default_rng(1).uniform(-18, 18, (2, 2000))
    places = {name: np.full(2000, value) for name, value in study.parameters.places(sizes).items()}
    found, alone = (questions(each)[0].field.margins(x + 1j * y, at) for each, at in ((study, places), (other, {})))
    assert found == pytest.approx(alone, rel=1e-9, abs=1e-9, nan_ok=True)


SECTORS = """
mechanism:
  parameters: {l1: 10, l2: 6}
  links: {ground: {O: [0, 0]}, upper: [O, A, l1], fore: [A, P, l2]}
  drives: {q1: {angle: upper}, q2: {angle: fore, from: upper}}
  sketch: {A: [5, 4], P: [5, 11]}
  measures: {m: cos(3*q1)}
workspace: {point: P, indices: []}
"""


@pytest.mark.nightly
def test_an_expression_that_turns_often_along_a_ray() -> None:
    """Three sectors of an arm, of which the sketch's counts."""
    text = SECTORS.replace("A: [5, 4], P: [5, 11]", "A: [8, 6], P: [8, 12]")
    found = design_area(text, "min: -0.622222", "l1=6.585 l2=7.825")
    # Each degree of the upper link sweeps as much.
    assert found == pytest.approx(4 * np.pi * 6.585 * 7.825 * np.arccos(-0.622222) / (3 * np.pi), rel=1e-4)


@pytest.mark.nightly
@pytest.mark.parametrize("hand", ["[5, 11]", "[3, 8]"])
@pytest.mark.parametrize(
    ("measure", "limit", "sizes", "angle"),
    [
        ("cos(3*q1)", "min: -0.622222", (7.3814, 7.6676), 2 * np.arccos(-0.622222) / 3),
        ("sin(q1)*l2", "min: 1.75663, max: 4.08739", (6.195, 6.177),
         np.arcsin(4.08739 / 6.177) - np.arcsin(1.75663 / 6.177)),
    ],
    ids=["three sectors", "two sectors"],
)  # fmt: skip
def test_sectors_that_nearly_meet_beside_a_pin(
    measure: str, limit: str, sizes: tuple[float, float], angle: float, hand: str
) -> None:
    """Beside the shoulder the links turn within less than there is between two samples, and between two rays."""
    text = SECTORS.replace("cos(3*q1)", measure).replace("[5, 11]", hand)
    exact = 2 * sizes[0] * sizes[1] * angle
    assert design_area(text, limit, "l1={} l2={}".format(*sizes)) == pytest.approx(exact, rel=1e-7)
    own = [f"mechanism.parameters.{name}={size}" for name, size in zip(("l1", "l2"), sizes, strict=True)]
    alone = study_of(text, *own, f"mechanism.limits=[{{measure: m, {limit}}}]")
    question = questions(alone, 1e-5, ("area",))[0]
    assert answer(question, {}, 1, SINGLE).values["area"][0] == pytest.approx(exact, rel=1e-7)


@pytest.mark.slow
def test_a_gap_beside_where_the_arm_is_folded() -> None:
    """A band of 12 degrees is left out: of a ray only what lies between its first two samples."""
    sizes = 7.2289861088316592, 7.2385926641287055
    text = SECTORS.replace("cos(3*q1)", "sin(q1)*l2").replace("[5, 4]", "[-4.856582373667923, -5.354609958667311]")
    text = text.replace("[5, 11]", "[2.010778432041187, -7.642967299946909]")
    low, high = -7.1967862454709373, -2.6680108679076726
    found = design_area(text, f"min: {low}, max: {high}", "l1={} l2={}".format(*sizes))
    exact = 2 * sizes[0] * sizes[1] * (np.arcsin(high / sizes[1]) - np.arcsin(low / sizes[1]))
    assert found == pytest.approx(exact, rel=1e-6)


@pytest.mark.nightly
def test_a_design_is_the_same_alone_and_in_a_batch() -> None:
    names = ("workspace.area", "GII", "SUI")
    together = values(names, THIN, FIVE_BAR)
    for k in range(len(THIN["low"])):
        alone = values(names, {name: column[k : k + 1] for name, column in THIN.items()}, FIVE_BAR)
        for name in names:
            assert together[name][k] == pytest.approx(alone[name][0], rel=1e-9), (name, k)


@pytest.mark.nightly
def test_poses_all_over_the_workspace_are_of_the_same_piece() -> None:
    poses = workspace_nodes(study_of(FIVE_BAR))
    filled = Filled(five_bar(), 0.85)
    z = poses.values["P.x"] + 1j * poses.values["P.y"]
    assert filled.at(0, -0.25) not in {0, *(filled.at(p.real, p.imag) for p in z)}


# A five-bar whose cranks reach to the middle between the motors and whose limits touch where the legs are folded: with
# the elbows inwards the determinant touches zero along a whole circle.
FOLDED = """
units: {length: m}
mechanism:
  links:
    ground: {A: [0.1, 0], B: [-0.1, 0]}
    one: [A, C, 0.1]
    upper_one: [C, P, 0.215]
    two: [B, D, 0.1]
    upper_two: [D, P, 0.215]
  drives: {t1: {angle: one}, t2: {angle: two}}
  limits: [{distance: [A, P], min: 0.115, max: 0.315}, {distance: [B, P], min: 0.115, max: 0.315}]
  sketch: {C: [-0.05, 0.05], D: [0.05, 0.05], P: [0, 0.18]}
workspace: {point: P, indices: []}
"""


@pytest.mark.nightly
@pytest.mark.parametrize("about", ["[0, -0.18]", "[0, -0.157]", "[3, 1]", "[90, 0]"])
def test_a_determinant_that_touches_zero_on_a_circle_divides_nothing(about: str) -> None:
    """The two rings' common part below the motors, from anywhere: by a fine grid."""
    result = mechdesign.workspace(study_of(FOLDED, f"workspace.scan.about={about}"))
    x = (np.arange(2000) + 0.5) * 0.7 / 2000 - 0.35
    z = x + 1j * x[:, None]
    one, two = np.abs(z - 0.1), np.abs(z + 0.1)
    good = (one > 0.115) & (two > 0.115) & (one < 0.315) & (two < 0.315) & (z.imag < 0)
    assert result.main["area"][0] == pytest.approx(good.sum() * (0.7 / 2000) ** 2, rel=3e-3)
    assert "pieces" not in result.tables


def test_an_empty_region_says_where() -> None:
    with pytest.raises(mechdesign.AssemblyError, match=r"point P reaches nothing on the scan about \(0, 0\)"):
        mechdesign.workspace(study_of(FOLDED, "workspace.scan={about: [0, 0], from: 0, to: 180}"))


TOO_WIDE = [
    ("workspace.scan={about: [0, 0], from: 0, to: 3600}",),
    ("units.angle=rad", "workspace.scan={about: [0, 0], from: 1, to: 7.3}"),
]


@pytest.mark.nightly
@pytest.mark.parametrize("changes", TOO_WIDE)
def test_a_scan_is_a_turn_at_most(changes: tuple[str, ...]) -> None:
    with pytest.raises(mechdesign.StudyError, match="more than a turn beyond 'from'"):
        study_of(FOLDED, *changes)
    area = [mechdesign.workspace(study_of(FOLDED, "units.angle=rad", f"workspace.scan={scan}")).main["area"][0]
            for scan in ("{about: [0, -0.18]}", "{about: [0, -0.18], from: 0, to: 6.2832}")]  # fmt: skip
    assert area[1] == pytest.approx(area[0], rel=1e-6)


@pytest.mark.nightly
def test_more_beyond_the_assembly_is_told_with_both_areas() -> None:
    # Two legs of up to 2 reach a lens, and the assembly ends on its middle line; a limit leaves a strip on one side.
    below = 4 * np.pi / 3 - np.sqrt(3)
    top = 0.2
    here = top * np.sqrt(4 - top**2) + 4 * np.arcsin(top / 2) - 2 * top
    assert here < below
    text = LEGS.replace("low: 1.2, high: 1.6", "low: 0, high: 2").replace(
        "  sketch: {C: [0, 1]}", "  sketch: {C: [0, 0.1]}"
    ).replace("across: (C.x - 0.5)*C.x}", "height: C.y}").replace(
        "max: high}]", "max: high}, {measure: height, min: -5, max: 0.2}]"
    )  # fmt: skip
    small = mechdesign.workspace(study_of(text))
    assert small.tables["indices"]["area"] == pytest.approx(here, rel=1e-5)
    (told,) = (warning for warning in map(str, small.warnings) if "forward singularity" in warning)
    assert f"about {below:.3g}, and {here:.3g} here; 'assembly: any' counts all" in told
    for change in ("workspace.assembly=any", "mechanism.sketch.C=[0, -0.1]"):
        assert not [
            w for w in map(str, mechdesign.workspace(study_of(text, change)).warnings) if "forward singularity" in w
        ]
