"""Rates and accelerations of the coordinates that poses give, the Jacobian's table, and what singular poses show."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

from mechdesign.analyses.kinematics.analysis import kinematics
from mechdesign.errors import StudyError
from mechdesign.results import Table
from mechdesign.study import Study

ARM = """\
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 10], fore: [E, P, 8]}
  drives: {t1: {angle: upper}, t2: {angle: fore}}
  sketch: {E: [8, 5], P: [13, 11]}
  measures: {far: {distance: [O, P]}, bend: {angle: [upper, fore]}}
kinematics:
  path: {P: [[3, 12], [5, 11], [9, 9]]}
  rates: {P.x: 2, P.y: -0.5}
  accelerations: {P.x: 0.3, P.y: 1}
"""
PLATFORM = """
mechanism:
  links:
    ground: {A1: [0, 0], A2: [10, 0], A3: [5, 9]}
    leg1: {from: A1, to: B1, telescopic: true}
    leg2: {from: A2, to: B2, telescopic: true}
    leg3: {from: A3, to: B3, telescopic: true}
    platform: {B1: [0, 0], B2: [3, 0], B3: [1.5, 2.5]}
  drives: [leg1, leg2, leg3]
  sketch: {B1: [3.4, 3], B2: [6.4, 3], B3: [4.9, 5.5]}
kinematics:
  poses: [{B1.x: 3.2, B1.y: 3.1, platform.angle: 4}]
  rates: {B1.x: 0.4, B1.y: -0.2, platform.angle: 10}
  accelerations: {B1.x: 0.1, B1.y: 0.2, platform.angle: -5}
  outputs: [B3, leg1.length]
"""


def by_differences(study: Study, given: dict[str, tuple[float, float, float]], names: list[str]) -> np.ndarray:
    """First and second derivatives of coordinates along v t + a t^2 / 2 by central differences, shape (2, names)."""
    h = 1e-4
    sides = []
    for t in (-h, 0.0, h):
        pose = study.mechanism.solve({name: x + v * t + a * t * t / 2 for name, (x, v, a) in given.items()})
        sides.append([float(pose[name]) for name in names])
    before, now, after = np.array(sides)
    return np.array([(after - before) / (2 * h), (after - 2 * now + before) / h**2])


def check_row(
    study: Study, table: Table, row: int, given: dict[str, tuple[float, float, float]], names: list[str]
) -> None:
    velocity, acceleration = by_differences(study, given, names)
    for k, name in enumerate(names):
        assert table[f"{name}_velocity"][row] == pytest.approx(velocity[k], rel=1e-6, abs=1e-6)
        assert table[f"{name}_acceleration"][row] == pytest.approx(acceleration[k], rel=1e-4, abs=1e-4)


def test_rates_of_a_path_give_those_of_the_drives() -> None:
    study = study_of(ARM)
    table = kinematics(study).tables["motion"]
    assert table["P.x_velocity"] == pytest.approx(2)
    assert table["P.y_acceleration"] == pytest.approx(1)
    for row, (x, y) in enumerate([(3, 12), (5, 11), (9, 9)]):
        check_row(study, table, row, {"P.x": (x, 2, 0.3), "P.y": (y, -0.5, 1)}, ["t1", "t2", "E.x", "fore.angle"])


def test_rates_of_measures_and_drives_together() -> None:
    sweep = "sweep: {far: {from: 9, to: 15, step: 3}, t1: 40}"
    rates = "rates: {far: 1.5, t1: 20}, accelerations: {t1: 7, far: -2}"
    study = study_of(ARM, f"kinematics={{{sweep}, {rates}}}")
    table = kinematics(study).tables["motion"]
    for row, far in enumerate([9, 12, 15]):
        check_row(study, table, row, {"far": (far, 1.5, -2), "t1": (40, 20, 7)}, ["t2", "P.x", "P.y"])


def test_rates_of_a_platform_give_those_of_its_legs() -> None:
    study = study_of(PLATFORM)
    table = kinematics(study).tables["motion"]
    given = {"B1.x": (3.2, 0.4, 0.1), "B1.y": (3.1, -0.2, 0.2), "platform.angle": (4, 10, -5)}
    check_row(study, table, 0, given, ["leg1", "leg2", "leg3", "B3.x", "B3.y", "leg1.length"])


def test_accelerations_are_zero_where_only_rates_are_given() -> None:
    study = study_of(ARM.replace("  accelerations: {P.x: 0.3, P.y: 1}\n", ""))
    table = kinematics(study).tables["motion"]
    check_row(study, table, 1, {"P.x": (5, 2, 0), "P.y": (11, -0.5, 0)}, ["t1", "t2"])


def test_drive_rates_on_an_inverse_path_are_drive_rates() -> None:
    study = study_of(ARM.replace("{P.x: 2, P.y: -0.5}", "{t1: 5}").replace("{P.x: 0.3, P.y: 1}", "{t2: 3}"))
    table = kinematics(study).tables["motion"]
    pose = study.mechanism.solve({"P.x": 5, "P.y": 11})
    check_row(study, table, 1, {"t1": (pose["t1"], 5, 0), "t2": (pose["t2"], 0, 3)}, ["P.x", "P.y", "E.y"])
    assert "t1_velocity" not in table


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("{P.x: 2, P.y: -0.5}", "{P.x: 2}"), "8:3: kinematics.rates: P.y missing: rates are those of all coordinates"),
        (
            ("{P.x: 2, P.y: -0.5}", "{P.x: 2, P.y: 1, E.x: 3}"),
            "8:27: kinematics.rates.E.x: 'E.x' is not among what the",
        ),
        (("{P.x: 2, P.y: -0.5}", "{t1: 2, t2: 1}"), "8:11: kinematics.rates.t1: 't1' is not among what the poses give"),
        (
            ("{P.x: 0.3, P.y: 1}", "{t1: 0.3}"),
            "9:19: kinematics.accelerations.t1: 't1' is not among what the poses give",
        ),
        (("{P.x: 2, P.y: -0.5}", "{P.x: 2 rad/s, P.y: 1}"), "is an angular velocity, where a velocity is expected"),
        (
            ("path: {P: [[3, 12], [5, 11], [9, 9]]}", "sweep: {t1: 1, t2: 3}"),
            "'P.x' is not a drive: rates are those of t1",
        ),
        (
            ("path: {P: [[3, 12], [5, 11], [9, 9]]}", "poses: [{P.x: 3, P.y: 12}, {t1: 1, t2: 3}]"),
            "'P.x' is not a drive: rates are those of t1, t2 where poses give different coordinates",
        ),
    ],
)
def test_wrong_rates(change: tuple[str, str], message: str) -> None:
    with pytest.raises(StudyError) as caught:
        study_of(ARM.replace(*change))
    assert message in str(caught.value)


def test_where_the_drives_cannot_give_the_rates_they_are_nan() -> None:
    # Stretched, the arm cannot move outwards.
    result = kinematics(study_of(ARM, "kinematics.path={P: [[18, 0], [17, 0]]}"))
    table = result.tables["motion"]
    assert np.isnan(table["t1_velocity"]).tolist() == [True, False]
    assert np.isnan(table["E.x_acceleration"]).tolist() == [True, False]
    assert table["conditioning"] == pytest.approx(1)  # of the drives, which stand well
    assert any("1 pose lies where no drive rates give what is asked" in warning for warning in result.warnings)


def test_the_table_of_the_jacobian() -> None:
    study = study_of(ARM, "kinematics={poses: [{t1: 30, t2: 75}], outputs: [P]}")
    table = kinematics(study).tables["jacobian"]
    assert table.names == ("t1", "t2", "P.x_by_t1", "P.x_by_t2", "P.y_by_t1", "P.y_by_t2", "valid")
    t1, t2 = np.radians([30, 75])
    wanted = [-10 * np.sin(t1), -8 * np.sin(t2), 10 * np.cos(t1), 8 * np.cos(t2)]
    assert [table[name][0] for name in table.names[2:6]] == pytest.approx(wanted)
    assert [column.unit for column in table.columns[2:6]] == ["mm/rad"] * 4
    mixed = kinematics(study_of(ARM, "kinematics={poses: [{P.x: 3, P.y: 12}], outputs: [P.x, bend]}")).tables[
        "jacobian"
    ]
    assert mixed.names[:4] == ("t1", "t2", "P.x", "P.y")
    assert mixed["bend_by_t2"] == pytest.approx(1)
    assert [column.unit for column in mixed.columns[4:8]] == ["mm/rad", "mm/rad", "", ""]


def test_units_of_the_jacobian_of_legs() -> None:
    outputs = "kinematics.outputs=[B1, platform.angle]"
    table = kinematics(study_of(PLATFORM, outputs)).tables["jacobian"]
    units = {column.name: column.unit for column in table.columns}
    assert (units["B1.x_by_leg1"], units["platform.angle_by_leg3"]) == ("", "rad/mm")


def test_no_jacobian_where_outputs_and_drives_differ_in_number() -> None:
    assert "jacobian" not in kinematics(study_of(ARM)).tables
    assert "jacobian" not in kinematics(study_of(ARM, "kinematics.outputs=[P.x]")).tables


PARALLELOGRAM = """
mechanism:
  links: {ground: {O: [0, 0], D: [4, 0]}, crank: [O, A, 1], rod: [A, B, 4], rocker: [D, B, 1]}
  drives: [crank]
  sketch: {A: [0, 1], B: [4, 1]}
kinematics:
  sweep: {crank: {from: 0, to: 360, step: 45}}
  rates: {crank: 1 rad/s}
  outputs: [B.y]
  loads: [{at: B, force: [0, 1]}]
"""


def test_numbers_at_a_singularity_are_nan_and_told() -> None:
    result = kinematics(study_of(PARALLELOGRAM))
    table = result.tables["motion"]
    singular = table["crank"] % 180 == 0
    assert (table["conditioning"] < 1e-6).tolist() == singular.tolist()
    assert table["conditioning"][~singular] == pytest.approx(abs(np.sin(np.radians(table["crank"][~singular]))))
    for name in ("B.y_velocity", "B.y_acceleration", "det_J", "inverse_condition", "crank_effort"):
        assert np.isnan(table[name]).tolist() == singular.tolist()
    assert np.isnan(result.tables["jacobian"]["B.y_by_crank"]).tolist() == singular.tolist()
    assert np.isfinite(table["B.y"]).all()
    assert table["valid"].all()
    assert any("3 poses lie at a dead centre or change point" in warning for warning in result.warnings)


def test_conditioning_stands_in_every_motion() -> None:
    table = kinematics(study_of(ARM)).tables["motion"]
    assert table["conditioning"] == pytest.approx(1)
    failed = kinematics(study_of(ARM, "kinematics.path={P: [[3, 12], [30, 0]]}")).tables["motion"]
    assert np.isnan(failed["conditioning"]).tolist() == [False, True]
