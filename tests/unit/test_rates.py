"""Rates and accelerations of the coordinates that poses give, the Jacobian's table, and what singular poses show."""

from __future__ import annotations

import re

import numpy as np
import pytest
from helpers import command_line
from helpers.studies import study_of

import mechdesign

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


def by_differences(
    study: mechdesign.Study, given: dict[str, tuple[float, float, float]], names: list[str]
) -> np.ndarray:
    """First and second derivatives of coordinates along v t + a t^2 / 2 by central differences, shape (2, names)."""
    h = 1e-4
    sides = []
    for t in (-h, 0.0, h):
        pose = study.mechanism.solve({name: x + v * t + a * t * t / 2 for name, (x, v, a) in given.items()})
        sides.append([float(pose[name]) for name in names])
    before, now, after = np.array(sides)
    return np.array([(after - before) / (2 * h), (after - 2 * now + before) / h**2])


def check_row(
    study: mechdesign.Study,
    table: mechdesign.Table,
    row: int,
    given: dict[str, tuple[float, float, float]],
    names: list[str],
) -> None:
    velocity, acceleration = by_differences(study, given, names)
    for k, name in enumerate(names):
        assert table[f"{name}_velocity"][row] == pytest.approx(velocity[k], rel=1e-6, abs=1e-6)
        assert table[f"{name}_acceleration"][row] == pytest.approx(acceleration[k], rel=1e-4, abs=1e-4)


def test_rates_of_a_path_give_those_of_the_drives() -> None:
    study = study_of(ARM)
    table = mechdesign.kinematics(study).tables["motion"]
    assert table["P.x_velocity"] == pytest.approx(2)
    assert table["P.y_acceleration"] == pytest.approx(1)
    for row, (x, y) in enumerate([(3, 12), (5, 11), (9, 9)]):
        check_row(study, table, row, {"P.x": (x, 2, 0.3), "P.y": (y, -0.5, 1)}, ["t1", "t2", "E.x", "fore.angle"])


def test_rates_of_measures_and_drives_together() -> None:
    sweep = "sweep: {far: {from: 9, to: 15, step: 3}, t1: 40}"
    rates = "rates: {far: 1.5, t1: 20}, accelerations: {t1: 7, far: -2}"
    study = study_of(ARM, f"kinematics={{{sweep}, {rates}}}")
    table = mechdesign.kinematics(study).tables["motion"]
    for row, far in enumerate([9, 12, 15]):
        check_row(study, table, row, {"far": (far, 1.5, -2), "t1": (40, 20, 7)}, ["t2", "P.x", "P.y"])


def test_rates_of_a_platform_give_those_of_its_legs() -> None:
    study = study_of(PLATFORM)
    table = mechdesign.kinematics(study).tables["motion"]
    given = {"B1.x": (3.2, 0.4, 0.1), "B1.y": (3.1, -0.2, 0.2), "platform.angle": (4, 10, -5)}
    check_row(study, table, 0, given, ["leg1", "leg2", "leg3", "B3.x", "B3.y", "leg1.length"])


def test_accelerations_are_zero_where_only_rates_are_given() -> None:
    study = study_of(ARM.replace("  accelerations: {P.x: 0.3, P.y: 1}\n", ""))
    table = mechdesign.kinematics(study).tables["motion"]
    check_row(study, table, 1, {"P.x": (5, 2, 0), "P.y": (11, -0.5, 0)}, ["t1", "t2"])


def test_drive_rates_at_poses_by_outputs_are_drive_rates() -> None:
    text = ARM.replace("{P.x: 2, P.y: -0.5}", "{t1: 5}").replace("{P.x: 0.3, P.y: 1}", "{t2: 3}")
    study = study_of(
        text.replace("path: {P: [[3, 12], [5, 11], [9, 9]]}", "poses: [{P.x: 3, P.y: 12}, {P.x: 5, P.y: 11}]")
    )
    table = mechdesign.kinematics(study).tables["motion"]
    pose = study.mechanism.solve({"P.x": 5, "P.y": 11})
    check_row(study, table, 1, {"t1": (pose["t1"], 5, 0), "t2": (pose["t2"], 0, 3)}, ["P.x", "P.y", "E.y"])
    assert "t1_velocity" not in table


@pytest.mark.parametrize("poses", ["path: {P: [[3, 12], [5, 11]]}", "sweep: {P.x: {from: 3, to: 5, step: 1}, P.y: 11}"])
@pytest.mark.parametrize("question", ["kinematics", "reliability"])
def test_drive_rates_along_a_motion_by_outputs_are_refused(poses: str, question: str) -> None:
    varied = "dimensions: {upper.length: 0.1}, " if question == "reliability" else ""
    text = f"{ARM.partition('kinematics')[0]}{question}: {{{varied}{poses}, rates: {{t1: 5}}}}\n"
    with pytest.raises(mechdesign.StudyError, match="rates of drives that do not change are not those"):
        study_of(text)


def on_path(path: str, speed: str = "7 mm/s") -> mechdesign.Table:
    text = f"{ARM.partition('kinematics')[0]}kinematics: {{path: {{P: {path}}}, speed: {speed}}}\n"
    return mechdesign.kinematics(study_of(text)).tables["motion"]


def vectors(table: mechdesign.Table, order: str = "") -> np.ndarray:
    return table[f"P.x{order}"] + 1j * table[f"P.y{order}"]


def test_a_circle_at_a_speed() -> None:
    table = on_path("{circle: {center: [8, 6], radius: 2 mm, from: 90}, points: 12}", "0.7 cm/s")
    outward = np.exp(1j * np.radians(90 + 30 * np.arange(12)))
    assert vectors(table) == pytest.approx(8 + 6j + 2 * outward)
    assert vectors(table, "_velocity") == pytest.approx(7j * outward)
    assert vectors(table, "_acceleration") == pytest.approx(-49 / 2 * outward)


def test_arcs_and_lines_at_a_speed() -> None:
    table = on_path("{arc: {center: [8, 6], radius: 2, from: 90, to: -90}, points: 3}")
    assert vectors(table) == pytest.approx([8 + 8j, 10 + 6j, 8 + 4j])
    assert vectors(table, "_velocity") == pytest.approx([7, -7j, -7])
    assert vectors(table, "_acceleration") == pytest.approx([-24.5j, -24.5, 24.5j])
    table = on_path("{line: [[5, 6], [8, 10]], points: 3}")
    assert vectors(table) == pytest.approx([5 + 6j, 6.5 + 8j, 8 + 10j])
    assert vectors(table, "_velocity") == pytest.approx(7 * (0.6 + 0.8j) * np.ones(3))
    assert vectors(table, "_acceleration") == pytest.approx(np.zeros(3), abs=1e-11)


def test_a_polyline_turns_at_its_corners_and_does_not_accelerate() -> None:
    table = on_path("[[5, 6], [8, 6], [8, 10]]")
    assert vectors(table, "_velocity") == pytest.approx([7, 7j, 7j])
    assert vectors(table, "_acceleration") == pytest.approx(np.zeros(3), abs=1e-11)
    closed = on_path("[[5, 6], [8, 6], [8, 10], [5, 6]]")
    assert vectors(closed, "_velocity") == pytest.approx([7, 7j, -7 * (0.6 + 0.8j), 7])


@pytest.mark.slow
def test_a_spline_through_a_circle_is_nearly_the_circle() -> None:
    angles = np.radians(np.arange(0, 361, 15))
    places = ", ".join(f"[{8 + 2 * np.cos(a):.12f}, {6 + 2 * np.sin(a):.12f}]" for a in angles[:-1])
    for more, at in (("", angles), (", points: 9", np.radians(np.arange(0, 361, 45)))):
        table = on_path(f"{{through: [{places}, [10, 6]], spline: true{more}}}")
        assert vectors(table) == pytest.approx(8 + 6j + 2 * np.exp(1j * at), abs=1e-4)
        assert vectors(table, "_velocity") == pytest.approx(7j * np.exp(1j * at), abs=1e-3)
        assert vectors(table, "_acceleration") == pytest.approx(-24.5 * np.exp(1j * at), rel=0.02)


def test_what_is_listed_beside_a_path_moves_with_it() -> None:
    text = PLATFORM.partition("kinematics")[0] + (
        "kinematics:\n  path: {B1: {line: [[3, 3], [4, 3]], points: 3}, platform.angle: [0, 4, 10]}\n  speed: 2\n"
        "  outputs: [platform.angle, B1]\n"
    )
    table = mechdesign.kinematics(study_of(text)).tables["motion"]
    assert table["platform.angle_velocity"] == pytest.approx([16, 24, 24])
    assert table["B1.x_velocity"] == pytest.approx([2, 2, 2])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{speed: 3, sweep: {t1: 3, t2: 4}}", "a speed is that of a point along its 'path'"),
        ("{speed: 3, path: {t1: [3, 4], t2: 4}}", "one point along its path, and this path is that of no point"),
        ("{speed: 3, path: {P: [[3, 12], [5, 11]]}, rates: {t1: 3}}", "'speed' and 'rates' are both given"),
        ("{speed: 3, path: {P: [[3, 12]]}}", "the path's point does not move: it has no direction"),
        ("{speed: 3 deg/s, path: {P: [[3, 12]]}}", "'3 deg/s' is an angular velocity, where a velocity is expected"),
        ("{speed: -3, path: {P: [[3, 12]]}}", "must be positive, not -3"),
        (
            "{path: {t1: {circle: {center: [0, 1], radius: 1}}, t2: 3}}",
            "'t1' is no point: a circle is the path of a point",
        ),
        ("{path: {P: {circle: {center: [0, 1]}}}}", "kinematics.path.P.circle.radius: is missing"),
        ("{path: {P: {circle: {center: [0, 1], radius: 1}, line: [[0, 0], [1, 1]]}}}", "circle and line are given"),
        ("{path: {P: {points: 3}}}", "a path is one of through, file, circle, arc, line"),
        ("{path: {P: {through: [[3, 12], [5, 11]], points: 3}}}", "'points' goes with a spline"),
        ("{path: {P: {through: [[3, 12], [5, 11]], spline: true}}}", "the spline of 'P' needs three points or more"),
        ("{path: {P: {line: [[3, 12], [3, 12]]}}}", "the line of 'P' needs two different places"),
        ("{path: {P: {line: [[3, 12], [3, 13]], spline: true}}}", "'line' is smooth already"),
        ("{path: {P: {arc: {center: [0, 1], radius: 1, from: 3, to: 3}}}}", "an arc needs two different angles"),
    ],
)
def test_wrong_paths_and_speeds(section: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(f"{ARM.partition('kinematics')[0]}kinematics: {section}\n")
    assert message in str(caught.value)


@pytest.mark.slow
def test_rates_that_lead_away_from_the_motion_are_told() -> None:
    told = "1 of 2 steps of the motion do not go where the rates of P.x, P.y lead"
    assert any(
        told in warning
        for warning in map(
            str, mechdesign.kinematics(study_of(ARM, "kinematics.path={P: [[3, 12], [5, 11.5], [9, 9]]}")).warnings
        )
    )
    along = [
        *map(str, mechdesign.kinematics(study_of(ARM, "kinematics.path={P: [[3, 12], [5, 11.5], [1, 12.5]]}")).warnings)
    ]
    assert not any("lead" in warning for warning in along)


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
    with pytest.raises(mechdesign.StudyError) as caught:
        study_of(ARM.replace(*change))
    assert message in str(caught.value)


def test_where_the_drives_cannot_give_the_rates_they_are_nan() -> None:
    # Stretched, the arm cannot move outwards.
    result = mechdesign.kinematics(study_of(ARM, "kinematics.path={P: [[18, 0], [17, 0]]}"))
    table = result.tables["motion"]
    assert np.isnan(table["t1_velocity"]).tolist() == [True, False]
    assert np.isnan(table["E.x_acceleration"]).tolist() == [True, False]
    assert table["conditioning"] == pytest.approx(1)  # of the drives, which stand well
    assert any(
        "1 pose lies where no drive rates give what is asked" in warning for warning in map(str, result.warnings)
    )


def test_the_table_of_the_jacobian() -> None:
    study = study_of(ARM, "kinematics={poses: [{t1: 30, t2: 75}], outputs: [P]}")
    table = mechdesign.kinematics(study).tables["jacobian"]
    assert table.names == ("t1", "t2", "P.x_by_t1", "P.x_by_t2", "P.y_by_t1", "P.y_by_t2", "valid")
    t1, t2 = np.radians([30, 75])
    wanted = [-10 * np.sin(t1), -8 * np.sin(t2), 10 * np.cos(t1), 8 * np.cos(t2)]
    assert [table[name][0] for name in table.names[2:6]] == pytest.approx(wanted)
    assert [column.unit for column in table.columns[2:6]] == ["mm/rad"] * 4
    mixed = mechdesign.kinematics(
        study_of(ARM, "kinematics={poses: [{P.x: 3, P.y: 12}], outputs: [P.x, bend]}")
    ).tables["jacobian"]
    assert mixed.names[:4] == ("t1", "t2", "P.x", "P.y")
    assert mixed["bend_by_t2"] == pytest.approx(1)
    assert [column.unit for column in mixed.columns[4:8]] == ["mm/rad", "mm/rad", "", ""]


def test_units_of_the_jacobian_of_legs() -> None:
    outputs = "kinematics.outputs=[B1, platform.angle]"
    table = mechdesign.kinematics(study_of(PLATFORM, outputs)).tables["jacobian"]
    units = {column.name: column.unit for column in table.columns}
    assert (units["B1.x_by_leg1"], units["platform.angle_by_leg3"]) == ("", "rad/mm")


@pytest.mark.slow
def test_no_jacobian_where_outputs_and_drives_differ_in_number() -> None:
    assert "jacobian" not in mechdesign.kinematics(study_of(ARM)).tables
    assert "jacobian" not in mechdesign.kinematics(study_of(ARM, "kinematics.outputs=[P.x]")).tables


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
    result = mechdesign.kinematics(study_of(PARALLELOGRAM))
    table = result.tables["motion"]
    singular = table["crank"] % 180 == 0
    assert (table["conditioning"] < 1e-6).tolist() == singular.tolist()
    assert table["conditioning"][~singular] == pytest.approx(abs(np.sin(np.radians(table["crank"][~singular]))))
    for name in ("B.y_velocity", "B.y_acceleration", "det_J", "inverse_condition", "crank_effort"):
        assert np.isnan(table[name]).tolist() == singular.tolist()
    assert np.isnan(result.tables["jacobian"]["B.y_by_crank"]).tolist() == singular.tolist()
    assert np.isfinite(table["B.y"]).all()
    assert table["valid"].all()
    assert any("3 poses lie at a dead centre or change point" in warning for warning in map(str, result.warnings))


@pytest.mark.slow
def test_conditioning_stands_in_every_motion() -> None:
    table = mechdesign.kinematics(study_of(ARM)).tables["motion"]
    assert table["conditioning"] == pytest.approx(1)
    failed = mechdesign.kinematics(study_of(ARM, "kinematics.path={P: [[3, 12], [30, 0]]}")).tables["motion"]
    assert np.isnan(failed["conditioning"]).tolist() == [False, True]


def test_conditioning_is_the_sine_of_the_angle_between_links_that_meet() -> None:
    """Whatever their lengths."""
    text = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
"""
    table = mechdesign.kinematics(study_of(text)).tables["motion"]
    between = np.radians(table["rod.angle"] - table["rocker.angle"])
    assert table["conditioning"] == pytest.approx(np.abs(np.sin(between)), rel=1e-12)


def test_outputs_of_the_jacobian_are_named_apart_from_those_shown() -> None:
    poses = "kinematics={poses: [{t1: 30, t2: 75}], outputs: [P, fore.angle, bend], jacobian: [P]}"
    tables = mechdesign.kinematics(study_of(ARM, poses)).tables
    assert tables["jacobian"].names == ("t1", "t2", "P.x_by_t1", "P.x_by_t2", "P.y_by_t1", "P.y_by_t2", "valid")
    assert {"fore.angle", "bend"} < set(tables["motion"].names)
    # |P_t1 x P_t2| = 10 * 8 * sin(75 - 30).
    assert tables["motion"]["det_J"] == pytest.approx(80 * np.sin(np.radians(45)))
    assert (
        "det_J"
        in mechdesign.kinematics(study_of(ARM, "kinematics={poses: [{t1: 3, t2: 7}], jacobian: [P]}")).tables["motion"]
    )
    with pytest.raises(mechdesign.StudyError, match=r"kinematics\.jacobian: 1 output \(P\.x\) for 2 drives"):
        study_of(ARM, "kinematics={poses: [{t1: 30, t2: 75}], outputs: [P], jacobian: [P.x]}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "place"),
    [
        ("requirements=[{result: kinematics.inverse_condition, at_least: 0}]", r"requirements\.0"),
        ("optimize={variables: {upper.length: {from: 9, to: 11, number: 2}}, maximize: [kinematics.inverse_condition]}",
         r"optimize\.maximize\.0"),
        ("optimize={variables: {upper.length: {from: 9, to: 11, number: 2}}, maximize: [kinematics.P.x],"
         " subject_to: [{result: kinematics.motion.inverse_condition, at_least: 0}]}", r"optimize\.subject_to\.0"),
    ],
)  # fmt: skip
def test_why_there_is_no_condition_number_is_told(asked: str, place: str) -> None:
    kinematic = "kinematics={poses: [{t1: 30, t2: 75}], outputs: [P, fore.angle]}"
    message = (
        rf"{place}: kinematics has no inverse_condition: 3 outputs \(P\.x, P\.y, fore\.angle\) for 2 drives; "
        r"name as many by kinematics\.jacobian: \[P\]"
    )

    def checked(*changes: str) -> str:
        overrides = [f"--set={change}" for change in (kinematic, asked, *changes)]
        said = command_line.ask("check", "-", *overrides, study=ARM)
        assert said.exit_code == (2 if "no inverse_condition" in said.output else 0)
        return " ".join(said.output.split())

    assert re.search(message, checked())
    # With as many outputs as drives, but of lengths and angles.
    mixed = ["kinematics.jacobian=[P.x, bend]"]
    assert re.search(rf"{place}: .*no inverse_condition: J mixes lengths and angles; give kinem", checked(*mixed))
    assert "no inverse_condition" not in checked(*mixed, "kinematics.characteristic_length=5")
