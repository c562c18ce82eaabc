"""Optimisation: the grid, normalisation, weights, conditions, goals of other questions, reasons, repeatability."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
COARSE = ("optimize.variables.l_min.step=0.5", "optimize.variables.l_a.step=0.5")


def rrr(*changes: str) -> mechdesign.Answer:
    return mechdesign.optimize(mechdesign.load(CONFIGS / "two_rrr.yaml", [*COARSE, *changes]))


# Stretched along x, where P.x is a + b.
ARM = """
mechanism:
  parameters: {R: 1, a: 1, b: 1}
  links: {ground: {O: [0, 0]}, upper: [O, E, a], fore: [E, P, b]}
  drives: [upper, fore]
  sketch: {E: [1, 0], P: [2, 0]}
  measures: {f: FORMULA}
kinematics: {poses: [{upper: 0, fore: 0}], outputs: [f]}
"""


def grid(variables: str) -> mechdesign.Table:
    asked = f"optimize={{variables: {variables}, maximize: kinematics.f}}"
    return mechdesign.optimize(study_of(ARM.replace("FORMULA", "P.x"), asked)).tables["designs"]


@pytest.mark.slow
def test_grid_with_bounds_that_depend_on_variables_above() -> None:
    variables = "{{a: {{from: R, to: {}, step: {step}}}, b: {{from: R, to: (a + R)/2, step: {step}}}}}"
    found = grid(variables.format("1.1*R", step=0.03))
    assert found["a"] == pytest.approx([1, 1.03, 1.06, 1.06, 1.09, 1.09])
    assert found["b"] == pytest.approx([1, 1, 1, 1.03, 1, 1.03])
    wide = grid(variables.format("5*R", step=0.3))
    assert len(wide) == sum(1 + k // 2 for k in range(14))
    assert wide["a"].max() == pytest.approx(4.9)


def test_grid_takes_a_last_step_that_rounding_puts_beyond_the_bound() -> None:
    assert grid("{a: {from: 1, to: 1.3, step: 0.1}}")["a"] == pytest.approx([1, 1.1, 1.2, 1.3])


def test_grid_by_number() -> None:
    assert grid("{a: {from: 1, to: 2, number: 5}}")["a"] == pytest.approx([1, 1.25, 1.5, 1.75, 2])


def test_an_empty_grid_says_so() -> None:
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", ["optimize.variables.l_a.from=9"])
    with pytest.raises(mechdesign.StudyError, match=r"optimize.variables.l_a: no value lies"):
        mechdesign.optimize(study)


def compare(values: list[float], *, smallest: bool = False, feasible: int = 9) -> tuple[np.ndarray, float]:
    """CPI of designs with these values, of which the first so many are feasible, and the number of the best."""
    # Lagrange's polynomial over the upper arm, whose lengths are 1, 2, ...; the forearm is 1.
    places = range(1, 1 + len(values))
    parts = ["*".join([repr(y), *(f"((E.x - {m})/{k - m})" for m in places if m != k)])
             for k, y in zip(places, values, strict=True)]  # fmt: skip
    asked = (
        f"optimize={{variables: {{a: {{from: 1, to: {len(values)}, step: 1}}}}, "
        f"{'minimize' if smallest else 'maximize'}: kinematics.f, "
        f"subject_to: [{{result: kinematics.E.x, at_most: {feasible + 0.5}}}]}}"
    )
    study = study_of(ARM.replace("FORMULA", f'"{" + ".join(parts)}"'), asked, "kinematics.outputs=[f, E.x]")
    tables = mechdesign.optimize(study).tables
    assert tables["designs"]["kinematics.f"] == pytest.approx(values)
    return tables["designs"]["CPI"], tables["optimum"]["a"][0] - 1


def test_normalisation_over_feasible_designs() -> None:
    for smallest, shares in ((False, [1, 0, 0.5]), (True, [0, 1, 0.5])):
        cpi, best = compare([3.0, 1.0, 2.0, 9.0], smallest=smallest, feasible=3)
        assert cpi[:3] == pytest.approx(shares)
        assert np.isnan(cpi[3])
        assert best == shares.index(1)
    assert compare([1.0] * 4, smallest=True)[0] == pytest.approx([0, 0, 0, 0])


def test_ties_go_to_the_first_design() -> None:
    asked = "optimize={variables: {a: {from: 1, to: 3, step: 1}}, maximize: kinematics.f}"
    tables = mechdesign.optimize(study_of(ARM.replace("FORMULA", '"min(E.x, 2)"'), asked)).tables
    assert tables["designs"]["kinematics.f"].tolist() == [1, 2, 2]
    assert tables["optimum"]["a"].tolist() == [2]


@pytest.mark.slow
def test_scores_are_weighted_sums_of_normalised_indices() -> None:
    tables = rrr("optimize.weights=[[2, 0, 1], {SUI: 3}]").tables
    optimum, designs = tables["optimum"], tables["designs"]
    share = {name: (designs[name] - designs[name].min()) / np.ptp(designs[name]) for name in ("GII", "GRI", "SUI")}
    assert designs["CPI"] == pytest.approx(sum(share.values()))
    score = 2 * share["GII"] + share["SUI"]
    assert optimum["score"] == pytest.approx([score.max(), 3.0])
    assert optimum["w_SUI"] == pytest.approx([1, 3])
    assert optimum["l_b"] == pytest.approx(optimum["l_min"] + 2 - optimum["l_a"])


@pytest.mark.slow
def test_conditions_leave_designs_out_and_are_counted() -> None:
    result = rrr("optimize.subject_to=[{result: workspace.area, at_least: 9}]")
    designs = result.tables["designs"]
    area = rrr("optimize.maximize=[area]", "optimize.weights=[[1]]").tables["designs"]["area"]
    assert (designs["feasible"] == (area >= 9)).all()
    assert result.counts["infeasible"] == (area < 9).sum() > 0
    assert set(designs["reason"][area < 9]) == {"not workspace.area at least 9"}
    assert any("not workspace.area at least 9" in warning for warning in map(str, result.warnings))
    # Normalised over the feasible designs only.
    assert np.nanmax(designs["CPI"]) <= 3
    assert np.isnan(designs["CPI"][area < 9]).all()


@pytest.mark.slow
def test_no_feasible_design_says_why() -> None:
    with pytest.raises(mechdesign.AssemblyError, match=r"not workspace\.area at least 1000"):
        rrr("optimize.subject_to=[{result: workspace.area, at_least: 1000}]")


@pytest.mark.slow
def test_a_design_without_workspace_is_infeasible() -> None:
    """Bases too far apart for the legs to meet."""
    changes = ("optimize.variables={R: {from: 1, to: 4, step: 1}}", "mechanism.parameters.l_max=3")
    result = mechdesign.optimize(mechdesign.load(CONFIGS / "two_rpr.yaml", changes))
    designs = result.tables["designs"]
    assert designs["feasible"].tolist() == [True, True, False, False]
    assert designs["reason"][3] == "nothing of the workspace can be reached"
    assert result.counts == {"designs": 4, "infeasible": 2}


@pytest.mark.slow
def test_a_workspace_that_follows_each_design() -> None:
    """A find: indices of a section that depends on a variable had no meaning, which was an error."""
    variables = "optimize.variables={l_min: {from: 2, to: 2.2, number: 2}}"
    follows = ("workspace.scan.about=[0*l_min, 0]", "workspace.integrate.tolerance=1e-3")
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", [variables, "optimize.weights=", *follows])
    columns = {column.name: column for column in mechdesign.optimize(study).main.columns}
    assert columns["GII"].meaning == "mean of the inverse condition number over the region"


def test_goals_of_other_questions() -> None:
    """The worst pose counts: where the arm reaches farthest is minimised, by the length of its first link."""
    changes = (
        "optimize={variables: {r1: {from: 9, to: 11, step: 1}}, minimize: [kinematics.P.x], weights: [[1]],"
        " subject_to: [{result: kinematics.P.y, at_most: 17}]}",
    )
    result = mechdesign.optimize(mechdesign.load(CONFIGS / "two_link_arm.yaml", changes))
    designs = result.tables["designs"]
    angles = np.radians([(30, 60), (45, 45), (60, 80)]).T
    reach = np.array([r1 * np.exp(1j * angles[0]) + 8 * np.exp(1j * angles[1]) for r1 in (9, 10, 11)])
    assert designs["kinematics.P.x"] == pytest.approx(reach.real.max(axis=1))
    assert designs["feasible"].tolist() == (reach.imag.max(axis=1) <= 17).tolist()
    assert designs["feasible"].tolist() == [True, True, False]
    assert result.main["r1"][0] == 9


def test_a_goal_that_no_result_has() -> None:
    changes = "optimize={variables: {r1: {from: 9, to: 11, step: 1}}, maximize: [kinematics.Q.x]}"
    with pytest.raises(mechdesign.StudyError, match=r"Q\.x"):
        mechdesign.optimize(mechdesign.load(CONFIGS / "two_link_arm.yaml", [changes]))


@pytest.mark.nightly
def test_threads_do_not_change_a_bit() -> None:
    steps = ("optimize.variables.l_min.step=0.09", "optimize.variables.l_a.step=0.06")
    study = mechdesign.load(CONFIGS / "two_rrr.yaml", steps)
    one, two = (mechdesign.optimize(study, jobs=jobs).tables["designs"] for jobs in (1, 2))
    assert len(one) > 512
    for column in one.columns:
        if column.values.dtype.kind == "f":
            assert column.values.tobytes() == two[column.name].tobytes(), column.name


FOUR_BAR = """
mechanism:
  parameters: {r: 30}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, r]
    rod: {from: A, to: B, length: 90, points: {P: [45, 20]}}
    rocker: [D, B, 60]
  drives: [crank]
  sketch: {A: [-25, 20], B: [60, 50]}
kinematics: {poses: [{crank: 20}, {crank: 60}], outputs: [P]}
optimize: {variables: {r: {from: 30, to: 60, step: 30}}, maximize: kinematics.P.y}
"""
# Three legs, of which the sketch stretches one: with shorter cranks it does not close where they are drawn.
PLATFORM = (
    "mechanism.sketch={A1: [-87.54, -30.3], A2: [57.55, -106.76], A3: [124.76, 149.83], "
    "C1: [31.43, -45.96], C2: [129.09, -10.42], C3: [49.48, 56.38]}",
    "optimize={variables: {crank: {from: 80, to: 160, step: 80}}, maximize: [kinematics.inverse_condition]}",
)


@pytest.mark.slow
def test_design_of_dyads_that_closes_at_the_poses_asked_but_not_at_the_sketchs() -> None:
    with pytest.raises(mechdesign.StudyError, match="the sketch cannot be assembled"):
        study_of(FOUR_BAR.replace("r: 30", "r: 60"))
    designs = mechdesign.optimize(study_of(FOUR_BAR)).tables["designs"]
    alone = mechdesign.kinematics(study_of(FOUR_BAR, "mechanism.parameters.r=60"))
    poses = mechdesign.kinematics(study_of(FOUR_BAR, "mechanism.parameters.r=60", "mechanism.sketch.A=[40, 45]"))
    assert designs["feasible"].all()
    assert designs["kinematics.P.y"][1] == pytest.approx(poses.tables["motion"]["P.y"].min())
    assert alone.tables["motion"]["P.y"] == pytest.approx(poses.tables["motion"]["P.y"])


@pytest.mark.slow
def test_design_without_closed_form_that_closes_at_the_poses_asked_but_not_at_the_sketchs() -> None:
    drawn = mechdesign.load(CONFIGS / "gallery" / "rrr_orientations.yaml", PLATFORM)
    asked, short = {"P.x": 0.0, "P.y": 0.0, "platform.angle": 0.0}, {f"crank_{k}.length": 80.0 for k in (1, 2, 3)}
    there = drawn.mechanism.solve(asked, short)
    drives = ", ".join(f"{name}: {float(there[name])!r}" for name in drawn.mechanism.drives)
    with pytest.raises(mechdesign.StudyError, match="the sketch cannot be assembled"):
        mechdesign.load(CONFIGS / "gallery" / "rrr_orientations.yaml", [*PLATFORM, "mechanism.parameters.crank=80"])
    by_drives, by_pose = (
        mechdesign.optimize(
            mechdesign.load(
                CONFIGS / "gallery" / "rrr_orientations.yaml",
                [*PLATFORM, f"kinematics={{outputs: [P, platform.angle], poses: [{{{pose}}}]}}",
                 "kinematics.characteristic_length=60"],
            )
        )
        for pose in (drives, ", ".join(f"{name}: {value}" for name, value in asked.items()))
    )  # fmt: skip
    name = "kinematics.inverse_condition"
    assert by_drives.tables["designs"]["feasible"][0]
    assert by_drives.tables["designs"][name][0] == pytest.approx(by_pose.tables["designs"][name][0])


def test_goals_have_the_units_of_their_results() -> None:
    changes = (
        "stiffness={at: P, actuators: {upper: 1e5, fore: 1e5}, poses: [{upper: 30, fore: 60}]}",
        "optimize={variables: {a: {choices: [1, 2]}}, minimize: [stiffness.k_min, kinematics.P.x, 2*a]}",
    )
    table = mechdesign.optimize(study_of(ARM.replace("FORMULA", "P.x").replace("[f]", "[P]"), *changes)).main
    units = [table.column(name).unit for name in ("stiffness.k_min", "kinematics.P.x", "2*a")]
    assert units == ["N/mm", "mm", "mm"]
