"""A variant of a study is the study as if its file had been changed: each kind of place, expressions, the sketch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.mechanism.mechanism import drawn
from mechdesign.study.designs import variant

CONFIGS = Path(__file__).parents[2] / "configs"

SLIDER_CRANK = """
mechanism:
  parameters: {r: 40, l: 3*r, e: -20, most: 100, turn: 180}
  links:
    ground: {O: [0, 0], G: [0, e], H: [10, 60]}
    crank: [O, A, r]
    rod: {from: A, to: B, length: l, points: {P: [60, 15], Q: [20, r/4]}}
    slider: {B: [0, 0], S: [10, 5]}
    arm: {S: [0, 0], T: [30, 0]}
  joints:
    guide: {prismatic: [ground, slider], through: G, direction: 0, point: B, angle: 5}
    weld: {fixed: [slider, arm], angle: 30}
  drives: {theta: {angle: crank}}
  limits:
    - {distance: [O, B], min: 80, max: most + 60}
    - {drive: theta, min: -10, max: 200}
  sketch: {A: [0, 40], B: [110, -20]}
  measures: {mu: {angle: [rod, slider]}, far: {distance: [O, T]}}
  targets: {P.y: "e + r*sin(theta)", mu: {rows}}

kinematics:
  sweep: {theta: {from: 0, to: turn, number: 7}}
  rates: {theta: 3}
  outputs: [P, Q, T, far, mu]
reliability:
  dimensions: {r: 0.1, rod.length: 0.001*l}
  outputs: [P]
  limits: {P.x: 0.2}
  methods: analytic
""".replace("{rows}", "[1, 2, 3, 4, 5, 6, r]")

LEG = """
units: {length: m, angle: rad}
mechanism:
  links: {ground: {O: [0, 0], D: [2, 0]}, boom: {from: O, to: A, length: 1.5}, jack: {from: D, to: A, telescopic: true}}
  drives: [jack]
  limits: [{drive: jack, min: 1, max: 3}]
  sketch: {A: [1, 1.1]}
"""

MEASURED = """
mechanism:
  parameters: {h: 50}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A]
    rod: {from: A, to: B, points: [C]}
    rocker: {points: [D, B, E]}
    flag: [E, F, 20]
  joints: {weld: {fixed: [rocker, flag]}}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55], C: [40, 70], E: [90, h], F: [100, 60]}
"""


def places_in(study: mechdesign.Study) -> Mapping[str, float]:
    return study.mechanism.nominal


def alike(study: mechdesign.Study, other: mechdesign.Study, commands: tuple[str, ...] = ("kinematics",)) -> None:
    """Places, sections, parameters and every number that follows from them."""
    assert places_in(study) == pytest.approx(places_in(other), rel=1e-14, abs=1e-14)
    assert study.parameters.nominal == pytest.approx(other.parameters.nominal, rel=1e-14)
    assert study.parameters.dependent.keys() == other.parameters.dependent.keys()
    for section in ("kinematics", "workspace", "reliability", "stiffness"):
        assert getattr(study, section) == getattr(other, section)
    for command in commands:
        one, two = (getattr(mechdesign, command)(each) for each in (study, other))
        assert one.tables.keys() == two.tables.keys()
        for name, table in one.tables.items():
            assert table.names == two.tables[name].names
            for column in table.columns:
                same = two.tables[name][column.name]
                if column.values.dtype.kind == "f":
                    assert column.values == pytest.approx(same, rel=1e-9, abs=1e-9, nan_ok=True), (name, column.name)
                else:
                    assert (column.values == same).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "override"),
    [
        ({"crank.length": 38.0}, "mechanism.links.crank=[O, A, 38]"),
        ({"rod.length": 125.0}, "mechanism.links.rod.length=125"),
        ({"rod.P.x": 55.0}, "mechanism.links.rod.points.P=[55, 15]"),
        ({"rod.Q.y": 12.0}, "mechanism.links.rod.points.Q=[20, 12]"),
        ({"slider.S.x": 8.0}, "mechanism.links.slider.S=[8, 5]"),
        ({"ground.G.y": -15.0}, "mechanism.links.ground.G=[0, -15]"),
        ({"ground.O.x": 2.0}, "mechanism.links.ground.O=[2, 0]"),
        ({"guide.direction": 4.0}, "mechanism.joints.guide.direction=4"),
        ({"guide.angle": 9.0}, "mechanism.joints.guide.angle=9"),
        ({"weld.angle": 45.0}, "mechanism.joints.weld.angle=45"),
        ({"limits.0.max": 130.0}, "mechanism.limits.0.max=130"),
        ({"limits.1.max": 100.0}, "mechanism.limits.1.max=100"),
        ({"e": -12.0}, "mechanism.parameters.e=-12"),
        ({"r": 42.0}, "mechanism.parameters.r=42"),
        ({"l": 130.0}, "mechanism.parameters.l=130"),
        ({"most": 70.0}, "mechanism.parameters.most=70"),
        ({"turn": 90.0}, "mechanism.parameters.turn=90"),
    ],
)
def test_each_kind_of_place_against_the_changed_file(changed: dict[str, float], override: str) -> None:
    nominal, reloaded = study_of(SLIDER_CRANK), study_of(SLIDER_CRANK, override)
    found = variant(nominal, changed)
    alike(found, reloaded, ("kinematics", "reliability"))
    # What is evaluated did change.
    before = mechdesign.kinematics(nominal).tables
    after = mechdesign.kinematics(found).tables
    assert any(
        column.values.shape != after[name][column.name].shape
        or not np.array_equal(column.values, after[name][column.name], equal_nan=column.values.dtype.kind == "f")
        for name, table in before.items()
        for column in table.columns
    )
    # Its data is that of a study of its own.
    alike(variant(found, {}), reloaded, ())


@pytest.mark.slow
def test_several_at_once_and_a_variant_of_a_variant() -> None:
    reloaded = study_of(SLIDER_CRANK, "mechanism.parameters.e=-10", "mechanism.links.rod.length=118")
    both = variant(study_of(SLIDER_CRANK), {"e": -10.0, "rod.length": 118.0})
    alike(both, reloaded)
    alike(variant(variant(study_of(SLIDER_CRANK), {"rod.length": 118.0}), {"e": -10.0}), reloaded)
    # A place that was set by itself is a number from then on.
    assert places_in(variant(both, {"l": 200.0}))["rod.length"] == 118


@pytest.mark.slow
@pytest.mark.parametrize("value", [1.2, 1.8])
def test_a_telescopic_leg_and_its_limits(value: float) -> None:
    alike(variant(study_of(LEG), {"limits.0.min": value}), study_of(LEG, f"mechanism.limits.0.min={value}"))
    alike(variant(study_of(LEG), {"boom.length": value}), study_of(LEG, f"mechanism.links.boom.length={value}"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "override"),
    [
        ({"ground.D.x": 104.0}, "mechanism.links.ground.D=[104, 0]"),
        ({"h": 54.0}, "mechanism.parameters.h=54"),
        ({"crank.length": 28.0}, "mechanism.links.crank=[O, A, 28]"),
    ],
)
def test_what_is_measured_from_the_sketch_is_measured_anew(changed: dict[str, float], override: str) -> None:
    alike(variant(study_of(MEASURED), changed), study_of(MEASURED, override))


def test_a_measured_point_that_is_set() -> None:
    study = study_of(MEASURED)
    found = variant(study, {"rod.C.y": 40.0})
    assert {name for name, value in places_in(found).items() if value != places_in(study)[name]} == {"rod.C.y"}
    assert found.resolved["mechanism"]["links"]["rod"]["points"]["C"][1] == 40
    alike(found, _from_data(found))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["planar_3rpr", "five_bar", "planar_rp_rr", "two_rrr"])
def test_configurations_with_every_length_changed(name: str) -> None:
    """Every point and length by a little: all forms of solution, workspaces included."""
    study = mechdesign.load(CONFIGS / f"{name}.yaml")
    rng = np.random.default_rng(3)
    points = [place for place in study.mechanism.nominal if place.rpartition(".")[2] in ("x", "y", "length")]
    changed = {place: study.mechanism.nominal[place] * (1 + 0.01 * rng.uniform(-1, 1)) for place in points}
    found = variant(study, changed)
    alike(found, _from_data(found))


def _from_data(study: mechdesign.Study) -> mechdesign.Study:
    import yaml

    return study_of(yaml.safe_dump(study.resolved, sort_keys=False))


@pytest.mark.slow
def test_groups_without_a_closed_form() -> None:
    study = mechdesign.load(CONFIGS / "gallery" / "rrr_platform.yaml")
    changed = {place: 1.02 * value for place, value in study.mechanism.nominal.items() if place.endswith(".length")}
    assert changed
    found = variant(study, changed)
    alike(found, _from_data(found))


def test_numbers_that_make_no_mechanism() -> None:
    study = study_of(SLIDER_CRANK)
    for changed, message in (
        ({"crank.length": -1.0}, "crank.length is not positive"),
        ({"limits.0.min": 500.0}, "limits.0: the maximum is below the minimum"),
        ({"r": np.nan}, "r has no finite value"),
        ({"limits.0.min": -1.0}, "never negative"),
    ):
        with pytest.raises(mechdesign.StudyError, match=message):
            variant(study, changed)
    with pytest.raises(mechdesign.StudyError, match="nose: is neither a parameter nor a dimension"):
        variant(study, {"nose": 1.0})


WEDGE = """
mechanism:
  parameters: {slope: 20}
  links: {ground: {O: [0, 0], G: [30, 0]}, wedge: {W: [0, 0]}, follower: {F: [0, 0]}}
  joints:
    floor: {prismatic: [ground, wedge], through: O, direction: 0, point: W}
    incline: {prismatic: [wedge, follower], through: W, direction: slope, point: F, angle: -slope}
    guide: {prismatic: [ground, follower], through: G, direction: 90, point: F, angle: -90}
  drives: [floor]
  sketch: {W: [0, 0], F: [30, 11]}
kinematics: {poses: [{floor: 0}, {floor: 10}], outputs: [F]}
"""


def test_a_closed_chain_of_slides_whose_angles_contradict() -> None:
    found = variant(study_of(WEDGE), {"slope": 30.0})
    assert mechdesign.kinematics(found).main["F.y"] == pytest.approx(np.array([30, 20]) * np.tan(np.radians(30)))
    with pytest.raises(mechdesign.StudyError, match="contradict"):
        variant(study_of(WEDGE), {"incline.direction": 30.0})


def test_dimensions_with_which_the_drawn_pose_cannot_be_assembled() -> None:
    """A long crank: the four-bar moves elsewhere, and its links are those of the variant."""
    study = mechdesign.load(CONFIGS / "gallery" / "four_bar.yaml")
    changed = {"crank.length": 2.0, "coupler.length": 0.4}
    assert not drawn(study.mechanism, changed).valid
    found = variant(study, changed)
    tables = mechdesign.kinematics(found).tables
    assert 0 < tables["motion"]["valid"].sum() < len(tables["motion"])
    loop = next(iter(tables["loops"]))
    assert [loop[f"{part}_length"] for part in ("frame", "input", "coupler", "output")] == pytest.approx([4, 2, 0.4, 3])


@pytest.mark.slow
def test_a_variant_without_a_closed_form_that_closes_at_a_pose_but_not_at_the_sketchs() -> None:
    sketch = ("mechanism.sketch={A1: [-87.54, -30.3], A2: [57.55, -106.76], A3: [124.76, 149.83], "
              "C1: [31.43, -45.96], C2: [129.09, -10.42], C3: [49.48, 56.38]}")  # fmt: skip
    study = mechdesign.load(CONFIGS / "gallery" / "rrr_orientations.yaml", [sketch])
    asked, short = {"P.x": 0.0, "P.y": 0.0, "platform.angle": 0.0}, {f"crank_{k}.length": 80.0 for k in (1, 2, 3)}
    there = study.mechanism.solve(asked, short)
    alone = variant(study, {"crank": 80.0}).mechanism
    assert alone.solve({name: float(there[name]) for name in alone.drives})["P.x"] == pytest.approx(0, abs=1e-9)
