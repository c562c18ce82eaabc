"""Goals of designs: the same numbers as the commands give for each design, positions of wrong names, reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.family.goals import unit_of
from mechdesign.ground.errors import MechdesignError, StudyError
from mechdesign.ground.results import Table
from mechdesign.study import Study

CONFIGS = Path(__file__).parents[2] / "configs"
Designs = Mapping[str, np.ndarray]


def loaded(path: str, *changes: str) -> Study:
    return mechdesign.load(CONFIGS / path, changes)


def entry(study: Study, name: str) -> str:
    """The entry of a parameter, a length, a direction or a coordinate of a point."""
    mechanism: Any = study.resolved["mechanism"]
    owner, _, last = name.rpartition(".")
    if name in mechanism.get("parameters", {}):
        return f"mechanism.parameters.{name}"
    if owner in mechanism.get("joints", {}):
        return f"mechanism.joints.{name}"
    if owner.startswith("limits."):
        return f"mechanism.{name}"
    if last == "length":
        short = isinstance(mechanism["links"][owner], list)
        return f"mechanism.links.{owner}.{2 if short else last}"
    link, _, point = owner.partition(".")
    points = "points." * ("points" in mechanism["links"][link])
    return f"mechanism.links.{link}.{points}{point}.{'xy'.index(last)}"


def around(study: Study, names: list[str], count: int, width: float, seed: int = 0) -> Designs:
    """Designs about the study's own, its own first."""
    rng = np.random.default_rng(seed)
    nominal = {name: nominal_value(study, name) for name in names}
    shifts = {name: width * (abs(value) or 1.0) * rng.uniform(-1, 1, count) for name, value in nominal.items()}
    return {name: np.concatenate([[nominal[name]], nominal[name] + shift]) for name, shift in shifts.items()}


def nominal_value(study: Study, name: str) -> float:
    if name in study.parameters.nominal:
        return study.parameters.nominal[name]
    return study.mechanism.nominal[name] / study.parameters.factors[name]


def evaluated(study: Study, designs: Designs, results: Sequence[Any]) -> Table:
    return mechdesign.evaluate(study, {entry(study, name): values for name, values in designs.items()}, results)


def one_by_one(study: Study, designs: Designs, results: Sequence[Any]) -> np.ndarray:
    """What requirements say of each design, loaded alone; nan where they are not met whatever the number."""
    found = np.full((len(results), len(next(iter(designs.values())))), np.nan)
    conditions = [{**(each if isinstance(each, dict) else {"result": each}), "at_least": -1e12} for each in results]
    commands = dict.fromkeys(condition["result"].partition(".")[0] for condition in conditions)
    for k in range(found.shape[1]):
        changes = {entry(study, name): float(values[k]) for name, values in designs.items()}
        own = mechdesign.load(study.resolved, changes | {"requirements": conditions})
        for command in commands:
            numbers = [n for n, each in enumerate(conditions) if each["result"].startswith(f"{command}.")]
            try:
                verdicts = mechdesign.requirements(own, getattr(mechdesign, command)(own))
            except MechdesignError:
                continue
            found[numbers, k] = [verdict.worst if verdict.met else np.nan for verdict in verdicts]
    return found


def agree(study: Study, results: Sequence[Any], designs: Designs) -> Table:
    table, expected = evaluated(study, designs, results), one_by_one(study, designs, results)
    valid = table["valid"]
    assert valid.any()
    for name, own in zip(table.names, expected, strict=False):
        given = table[name][valid]
        assert given == pytest.approx(own[valid], rel=1e-9, abs=1e-9), name
        # Each result tells designs apart, or this would prove nothing.
        assert np.ptp(given) > 1e-6 * np.abs(given).max(), name
    assert (np.isnan(expected).any(axis=0) == ~valid).all()
    return table


@pytest.mark.slow
def test_values_ranges_and_errors_of_a_sweep() -> None:
    """A function generator: parameters that others follow from, targets that depend on them, angles without jumps."""
    names = ["frame", "crank.length"]
    study = loaded("gallery/function_generator.yaml")
    goals = [
        "kinematics.mu.min",
        "kinematics.follower.angle.max",
        "kinematics.follower.angle_error.peak",
        "kinematics.targets.rms",
        "kinematics.targets.follower.angle.mean",
        "kinematics.targets.max_abs",
        "kinematics.extremes.follower.angle.range",
        "kinematics.extremes.mu.min",
        "kinematics.extremes.follower.angle_error.max",
        {"result": "kinematics.mu", "where": {"crank": 100}},
    ]
    agree(study, goals, around(study, names, 6, 0.03))


@pytest.mark.slow
def test_targets_follow_the_parameters_of_each_design() -> None:
    study = loaded("gallery/function_generator.yaml")
    goals = ["kinematics.targets.rms", "kinematics.follower.angle_error.peak"]
    agree(study, goals, {"follower_0": np.array([20.0, 25.0, 30.0, 35.0])})


@pytest.mark.slow
def test_full_turns_with_derivatives_and_refined_extremes() -> None:
    """A crank-rocker, some designs of which no longer turn fully."""
    names = ["crank.length", "coupler.length", "ground.D.x", "coupler.C.y"]
    study = loaded("gallery/four_bar.yaml")
    goals = [
        "kinematics.C.y.min",
        "kinematics.C.x_velocity.max",
        "kinematics.rocker.angle_acceleration.min",
        "kinematics.extremes.rocker.angle.range",
        "kinematics.extremes.rocker.angle.time_ratio",
        "kinematics.extremes.C.x.min",
        "kinematics.extremes.C.x.max_at",
    ]
    designs = around(study, names, 12, 0.3)
    assert "a pose cannot be assembled" in agree(study, goals, designs)["reason"]


@pytest.mark.slow
@pytest.mark.parametrize("path", ["gallery/jansen.yaml", "gallery/slider_crank.yaml", "gallery/whitworth.yaml"])
def test_studies_of_the_gallery(path: str) -> None:
    names = [name for name in mechdesign.load(CONFIGS / path).mechanism.nominal if name.endswith(".length")][:3]
    study = loaded(path)
    output = mechdesign.kinematics(study).tables["extremes"]["output"].tolist()[0]
    goals = [f"kinematics.extremes.{output}.range", f"kinematics.{output}.min"]
    agree(study, goals, around(study, names, 3, 0.02))


@pytest.mark.slow
def test_groups_without_a_closed_form_start_from_their_own_sketch() -> None:
    study = mechdesign.load(CONFIGS / "gallery" / "rrr_platform.yaml")
    names = [name for name in study.mechanism.nominal if name.endswith(".length")][:2]
    study = loaded("gallery/rrr_platform.yaml", "kinematics.sweep.q1.to=75")
    goals = ["kinematics.extremes.P.x.range", "kinematics.extremes.P.y.max"]
    agree(study, goals, around(study, names, 1, 0.02))


@pytest.mark.slow
def test_jacobian_and_limits_of_listed_poses() -> None:
    study = loaded("five_bar.yaml")
    listed = [name for name in mechdesign.kinematics(study).tables["jacobian"].names if "_by_" in name]
    goals = ["kinematics.inverse_condition.min", "kinematics.det_J.min", f"kinematics.jacobian.{listed[0]}.min"]
    agree(study, goals, around(study, ["R", "lower_1.length"], 5, 0.05))


@pytest.mark.slow
@pytest.mark.parametrize("path", ["planar_3rpr.yaml", "five_bar.yaml"])
def test_stiffness(path: str) -> None:
    names = [n for n in mechdesign.load(CONFIGS / path).mechanism.nominal if n.endswith((".x", ".length"))][:4]
    study = loaded(path)
    goals = ["stiffness.k_min.min", "stiffness.C11.max", "stiffness.compliance.C12.min"]
    agree(study, goals, around(study, names, 5, 0.05))


@pytest.mark.slow
def test_what_has_no_common_tables_is_asked_of_each_design() -> None:
    """Here a tolerance is a part of what is varied, and so follows it."""
    tolerance = "reliability.dimensions.r1=0.003*r1"
    study = loaded("two_link_arm.yaml", "reliability.samples=50", tolerance)
    goals = [
        {"result": "reliability.reliability.min", "where": {"method": "analytic"}},
        {"result": "reliability.moments.sigma.max", "where": {"output": "P.x"}},
    ]
    agree(study, goals, around(study, ["r1", "forearm.length"], 3, 0.1))


ERRORS = """
reliability:
  dimensions: {r: 0.1, "*.length": 0.05, rod.P.x: 0.02, guide.direction: 0.2, guide.angle: 0.1, crank: 0.3}
  clearances: {A: {radial: 0.05, link: rod}, B: {radial: 0.02, link: rod, effect: length}}
  poses: [{crank: 20}, {crank: 130}]
  rates: {crank: 2}
  outputs: [P, S]
  limits: {P.x: 0.3, S: {radius: 0.4}}
  methods: analytic
"""


@pytest.mark.slow
def test_first_order_errors_of_many_designs() -> None:
    """Parameters, lengths, points, directions, pins; positions, velocities and accelerations."""
    names = ["ground.G.y", "rod.P.y", "guide.direction", "guide.angle", "slider.S.x", "crank.length"]
    study = study_of(SLIDE + ERRORS, "mechanism.links.crank=[O, A, 40]")
    goals = [
        {"result": "reliability.moments.sigma.max", "where": {"order": "velocity"}},
        {"result": "reliability.worst_case.max", "where": {"order": "position"}},
        {"result": "reliability.sigma.min", "where": {"order": "acceleration", "output": "P.y"}},
        "reliability.contributions.guide.direction.share.min",
        {"result": "reliability.contributions.sensitivity.max", "where": {"source": "rod.P.x"}},
        "reliability.failure.max",
    ]
    agree(study, goals, around(study, names, 5, 0.1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "names"),
    [
        ("toggle.yaml", ["L", "ground.O4.x", "slider.S.y"]),
        ("five_bar.yaml", ["ground.B1.x", "lower_1.length", "upper_2.length"]),
    ],
)
def test_first_order_errors_of_the_configurations(path: str, names: list[str]) -> None:
    study = loaded(path, "reliability.methods=analytic")
    results = [{"result": "reliability.sigma.max", "where": {"order": "position"}}]
    agree(study, results, around(study, names, 4, 0.05))


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        (),
        ("kinematics.sweep.crank={from: -47, to: 130, number: 9}",),
        ("kinematics.sweep=", "kinematics.poses=[{crank: 20}, {crank: 70}]"),
    ],
)
def test_transmission_angles_of_the_loops(changes: tuple[str, ...]) -> None:
    """Also where a design does not turn fully, and its smallest angle lies at a limit of motion."""
    study = loaded("gallery/four_bar.yaml", *changes)
    designs = {"coupler.length": np.array([3.5, 3.3, 3.7, 2.2]), "crank.length": np.array([1, 0.9, 1.1, 1.25])}
    ends = [f"kinematics.loops.transmission_{end}" for end in ("min", "max")]
    results = ends if "kinematics.sweep=" in changes else ends[:1]
    table = agree(study, results, designs)
    parts = one_by_one(study, designs, [{"result": name, "unassembled": "allowed"} for name in results])
    for name, part in zip(results, parts, strict=True):
        assert table[name] == pytest.approx(part, rel=1e-9)


@pytest.mark.slow
def test_workspaces_where_the_section_depends_on_a_variable() -> None:
    """Request of each design then, with the same numbers as all at once."""
    study, other = (loaded("two_rrr.yaml", f"workspace.scan.about=[{x}, 0]") for x in ("0", "0*l_min"))
    results = ["GII", "workspace.area", "sigma_min_mean"]
    designs = {"l_min": np.array([1.5, 2.0, 40.0])}
    together, alone = (evaluated(each, designs, results) for each in (study, other))
    assert together["reason"].tolist() == alone["reason"].tolist()
    assert together["valid"][0]
    for name in results:
        # Where a mechanism is solved in a batch or alone, its numbers differ by rounding.
        assert alone[name] == pytest.approx(together[name], rel=1e-7, nan_ok=True)
        assert np.ptp(together[name][:2]) > 0


@pytest.mark.slow
def test_stiffness_as_an_index_of_the_workspace() -> None:
    study = loaded("five_bar.yaml", "workspace={point: C, integrate: {tolerance: 1e-2}}")
    result = "workspace.k_min_mean"
    table = evaluated(study, {"lower_1.length": np.array([100.0, 104.0])}, [result])
    assert table["valid"].all()
    assert table[result][0] != table[result][1]


@pytest.mark.slow
def test_numbers_of_the_section_that_depend_on_a_variable() -> None:
    study = loaded("gallery/function_generator.yaml")
    designs = {"crank_turn": np.array([50.0, 60.0, 66.0])}
    agree(study, ["kinematics.targets.rms"], designs)


TELESCOPE = """
mechanism:
  parameters: {w: 100}
  links: {ground: {O: [0, 0], D: [w, 0]}, boom: {from: O, to: A, length: 70, points: {T: [90, 5]}},
          jack: {from: D, to: A, telescopic: true}, wheel: {A: [0, 0], R: [10, 0]}}
  joints: {weld: {fixed: [boom, wheel], angle: 20}}
  drives: [jack]
  limits: [{drive: jack, min: 60, max: 120}]
  sketch: {A: [40, 55], T: [50, 70]}
kinematics: {sweep: {jack: {from: 65, to: 110, number: 4}}, outputs: [R, T]}
"""
SLIDE = """
mechanism:
  parameters: {r: 40}
  links: {ground: {O: [0, 0], G: [0, -20]}, crank: [O, A, r], rod: {from: A, to: B, length: 120, points: {P: [60, 15]}},
          slider: {B: [0, 0], S: [3, 4]}}
  joints: {guide: {prismatic: [ground, slider], through: G, direction: 0, point: B, angle: 0}}
  drives: [crank]
  sketch: {A: [0, 40], B: [110, -20]}
kinematics: {sweep: {crank: {from: 0, to: 300, number: 6}}, outputs: [P, S]}
"""


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("text", "name", "value", "output"),
    [
        (TELESCOPE, "w", 104.0, "T.x"),
        (TELESCOPE, "ground.D.x", 104.0, "T.x"),
        (TELESCOPE, "ground.O.y", 3.0, "T.x"),
        (TELESCOPE, "boom.length", 72.0, "T.x"),
        (TELESCOPE, "boom.T.y", 9.0, "T.x"),
        (TELESCOPE, "weld.angle", 50.0, "R.x"),
        (SLIDE, "r", 42.0, "P.x"),
        (SLIDE, "rod.P.x", 50.0, "P.x"),
        (SLIDE, "guide.direction", 10.0, "P.x"),
        (SLIDE, "guide.angle", 10.0, "S.x"),
        (SLIDE, "slider.S.x", 5.0, "S.x"),
        (SLIDE, "ground.G.y", -30.0, "P.x"),
    ],
)
def test_each_kind_of_variable_changes_the_geometry_that_is_evaluated(
    text: str, name: str, value: float, output: str
) -> None:
    study = study_of(text)
    result = f"kinematics.extremes.{output}.max"
    given = agree(study, [result], {name: np.array([nominal_value(study, name), value])})[result]
    assert abs(given[1] - given[0]) > 1e-3 * abs(given[0])


def test_a_limit_that_is_varied_makes_designs_infeasible() -> None:
    study = study_of(TELESCOPE, "kinematics.sweep=", "kinematics.poses=[{jack: 65}, {jack: 110}]")
    table = evaluated(study, {"limits.0.max": np.array([120.0, 100.0, 50.0])}, ["kinematics.T.x.min"])
    reasons = ["", "a pose is outside the limits", "limits.0: the maximum is below the minimum"]
    assert table["reason"].tolist() == reasons


def test_designs_that_make_no_mechanism_are_told_and_leave_the_others_alone() -> None:
    designs = {"r": np.array([40.0, -1.0, np.nan, 500.0, 41.0])}
    table = evaluated(study_of(SLIDE), designs, ["kinematics.P.x.min"])
    assert table["reason"].tolist() == [
        "",
        "crank.length is not positive",
        "r has no finite value",
        "a pose cannot be assembled",
        "",
    ]
    assert np.isnan(table["kinematics.P.x.min"]).tolist() == [False, True, True, True, False]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("goals", "message"),
    [
        ("maximize: [kinematics.Q.x]", r"optimize\.maximize\.0: .*no column 'Q\.x'"),
        ("minimize: [kinematics.P.x, kinematics.extremes.span]", r"optimize\.minimize\.1: .*extremes\.span"),
        ("maximize: [kinematics.extremes.output]", r"optimize\.maximize\.0: .*holds words"),
        ("maximize: [optimize.score]", r"cannot judge itself"),
        (
            "maximize: [kinematics.P.x], subject_to: [{result: kinematics.P.y, at_least: 0, where: {thta: 1}}]",
            r"optimize\.subject_to\.0: where: no column 'thta'",
        ),
    ],
)
def test_names_that_no_result_has_are_told_before_anything_is_computed(goals: str, message: str) -> None:
    study = study_of(SLIDE + f"optimize: {{variables: {{r: {{from: 39, to: 40, number: 2}}}}, {goals}}}")
    with pytest.raises(StudyError, match=message):
        mechdesign.optimize(study)


def test_a_wrong_name_is_told_with_its_place_in_the_file(tmp_path: Path) -> None:
    section = "optimize:\n  variables: {r: {from: 1, to: 2, number: 2}}\n  maximize:\n"
    section += "    - kinematics.P.x\n    - kinematics.W.x\n"
    file = tmp_path / "wrong.yaml"
    file.write_text(SLIDE + section, encoding="utf-8")
    study = mechdesign.load(file)
    line = SLIDE.count("\n") + 5
    with pytest.raises(StudyError, match=rf"wrong\.yaml:{line}:7: optimize\.maximize\.1: .*no column 'W\.x'"):
        mechdesign.optimize(study)
    # As an override gives it.
    study = mechdesign.load(file, ["optimize.maximize=[kinematics.V.x]"])
    with pytest.raises(StudyError, match=r"--set optimize\.maximize=.*no column 'V\.x'"):
        mechdesign.optimize(study)


@pytest.mark.slow
def test_blocks_do_not_change_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    from mechdesign.questions import poses

    study = loaded("gallery/four_bar.yaml")
    results = ["kinematics.extremes.C.y.range", "kinematics.C.x.min"]
    designs = around(study, ["crank.length", "coupler.C.x"], 9, 0.1)
    whole = evaluated(study, designs, results)
    monkeypatch.setattr(poses, "POSES_AT_ONCE", 150)
    parts = evaluated(study, designs, results)
    assert all(parts[name].tobytes() == whole[name].tobytes() for name in results)


def test_a_whole_number_that_a_variable_decides() -> None:
    """The number of poses follows a variable: designs of one number are evaluated together."""
    study = study_of("""
mechanism:
  parameters: {n: 5, r: 40}
  links: {ground: {O: [0, 0]}, arm: [O, P, r]}
  drives: [arm]
kinematics: {sweep: {arm: {from: 0, to: 80, number: n}}, outputs: [P]}
""")
    designs = {"n": np.array([3.0, 5.0, 3.0, 2.5]), "r": np.array([10.0, 20.0, 30.0, 40.0])}
    table = evaluated(study, designs, ["kinematics.P.x.min"])
    np.testing.assert_allclose(table["kinematics.P.x.min"][:3], np.array([10, 20, 30]) * np.cos(np.radians(80)))
    assert table["reason"].tolist() == ["", "", "", "kinematics.sweep.arm.number: expected a whole number, not ..."]


SWUNG = """\
mechanism:
  parameters: {a: 30, b: 100, c: 80, y: 0}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], coupler: [A, B, b], rocker: [D, B, c]}
  drives: [crank]
  sketch: {A: [30, 0], B: [90, 80]}
kinematics: {sweep: {crank: {from: 0, to: 350, step: 10}}, outputs: [B.x, rocker.angle]}
optimize:
  method: grid
  variables: {a: {from: 20, to: 40, number: 5}}
  minimize: GOAL
"""


@pytest.mark.slow
def test_goals_of_chosen_rows():
    """The rocker's swing by the triangles of its two dead centres; its pin's travel beside it."""
    choice = "{result: kinematics.extremes.range, where: {output: %s}}"
    text = SWUNG.replace("GOAL", f"[{choice % 'rocker.angle'}, {choice % 'B.x'}]")
    result = mechdesign.optimize(study_of(text))
    designs = result.tables["designs"]
    a, b, c, d = designs["a"], 100, 80, 100
    ends = [np.arccos((c**2 + d**2 - (b + side * a) ** 2) / (2 * c * d)) for side in (1, -1)]
    assert designs["kinematics.extremes.range (output rocker.angle)"] == pytest.approx(np.degrees(ends[0] - ends[1]))
    travel = c * np.abs(np.cos(ends[0]) - np.cos(ends[1]))
    assert designs["kinematics.extremes.range (output B.x)"] == pytest.approx(travel)
    weighted = study_of(text, "optimize.weights=[{kinematics.extremes.range (output B.x): 1}]")
    assert mechdesign.optimize(weighted).main["w_kinematics.extremes.range (output rocker.angle)"][0] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ("[kinematics.extremes.range]", r"minimize\.0: .* units: B\.x \(mm\), rocker\.angle \(deg\).*'where'"),
        ("{result: kinematics.extremes.max, where: {output: B.y}}", r"minimize\.0: no row .* output B\.y; did you"),
        ("{result: kinematics.extremes.max, where: {outptu: B.x}}", r"minimize\.0: where: no column 'outptu'; did"),
        ("[B.x, {result: kinematics.B.x, were: {}}]", r"minimize\.1\.were: unknown key; did you mean 'where'"),
    ],
)  # fmt: skip
def test_goals_whose_rows_cannot_be_told(wanted, told):
    with pytest.raises(StudyError, match=told):
        mechdesign.optimize(study_of(SWUNG.replace("GOAL", wanted)))


def test_conditions_do_not_compare_millimetres_with_degrees():
    condition = "{result: kinematics.extremes.range, at_most: 9}"
    changes = ("optimize.minimize=[kinematics.B.x]", f"optimize.subject_to=[{condition}]")
    with pytest.raises(StudyError, match=r"subject_to\.0: .* several units"):
        mechdesign.optimize(study_of(SWUNG, *changes))


@pytest.mark.slow
def test_listed_poses_that_follow_the_variables_are_solved_together():
    """With one design's poses and dimensions after the other's, as one by one."""
    poses = "[{A.y: a/2}, {A.y: 5}, {A.y: y + 2}]"
    study = study_of(SWUNG.replace("GOAL", "kinematics.B.x"), f"kinematics={{poses: {poses}, outputs: [B]}}",
                     "optimize.variables.y={from: -3, to: 9, number: 2}")  # fmt: skip
    designs = {"a": np.array([20.0, 30.0, 25.0, 9.0]), "y": np.array([1.0, 4.0, -20.0, 9.0])}
    agree(study, ["kinematics.B.x.max", "kinematics.B.y.min"], designs)


FOUR_BAR = """
mechanism:
  parameters: {l1: 30, l2: 90, l3: 60, k: 2}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, l1]
    rod: {from: A, to: B, length: l2, points: {C: [k*l1, 10]}}
    rocker: [D, B, l3 + 1]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  measures: {mu: {angle: [rod, rocker]}, total: l1 + l2}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 30}}, outputs: [C, mu, total]}
"""


@pytest.mark.slow
def test_expressions_over_parameters_are_goals_and_conditions() -> None:
    section = """
optimize:
  variables: {l1: {from: 20, to: 40, number: 5}, l2: {from: 80, to: 110, number: 4}}
  maximize: [kinematics.mu]
  minimize: [l1 + l2, "max(l1, l2)", l1]
  subject_to: [{result: l1 + l2, at_most: 140}, {result: l1 - l2, abs: true, at_least: 50}]
  weights: [{kinematics.mu: 3, l1 + l2: 1}, {"max(l1, l2)": 1}]
"""
    result = mechdesign.optimize(study_of(FOUR_BAR + section))
    designs, optimum = result.tables["designs"], result.tables["optimum"]
    l1, l2 = np.meshgrid(np.linspace(20, 40, 5), np.linspace(80, 110, 4), indexing="ij")
    kept = (l1 + l2 <= 140) & (l2 - l1 >= 50)
    assert designs["l1 + l2"] == pytest.approx((l1 + l2).ravel())
    assert designs["feasible"].tolist() == kept.ravel().tolist()
    assert designs.names.count("l1") == 1
    mu = designs["kinematics.mu"].reshape(l1.shape)

    def best(*goals: tuple[np.ndarray, int, float]) -> tuple[float, float]:
        score = sum(w * s * (v - v[kept].min()) / np.ptp(v[kept]) for v, s, w in goals)
        winner = int(np.argmax(np.where(kept, score, -np.inf)))
        return l1.flat[winner], l2.flat[winner]

    assert (optimum["l1"][0], optimum["l2"][0]) == best((mu, 1, 3.0), (l1 + l2, -1, 1.0))
    assert (optimum["l1"][1], optimum["l2"][1]) == best((np.maximum(l1, l2), -1, 1.0))
    assert "l1 + l2: 1" not in result.files["optimum.yaml"].partition("optimize:")[0]


@pytest.mark.parametrize(
    ("expression", "unit"),
    [("l1", "mm"), ("2*l1 - l2/3 + 5", "mm"), ("l3", "mm"), ("l1/l2", ""), ("l1 + k", ""), ("k", ""), ("l1*l2", "")],
)
def test_the_unit_of_an_expression_is_given_where_it_is_known(expression: str, unit: str) -> None:
    assert unit_of(study_of(FOUR_BAR), expression) == unit


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["search", "pareto"])
def test_expressions_alone_are_searched(method: str) -> None:
    section = f"""
optimize:
  method: {method}
  evaluations: 1000
  variables: {{l1: {{from: 10, to: 90}}, l2: {{from: 10, to: 90}}}}
  minimize: ["hypot(l1, l2)"{', "abs(l1 - 60)"' * (method == "pareto")}]
  subject_to: [{{result: l1 + l2, at_least: 100}}]
"""
    result = mechdesign.optimize(study_of(FOUR_BAR + section))
    # Nearest to the origin on the line l1 + l2 = 100.
    if method == "search":
        assert result.tables["optimum"]["hypot(l1, l2)"] == pytest.approx(50 * np.sqrt(2), rel=1e-6)
        return
    front = result.tables["pareto"]
    assert front["hypot(l1, l2)"].min() == pytest.approx(50 * np.sqrt(2), rel=1e-3)
    # Between the ends every design lies on the line.
    assert front["l1"] + front["l2"] == pytest.approx(np.full(len(front), 100), rel=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("minimize=[l1 + kinematics.mu]", r"minimize\.0: 'kinematics\.mu' in .* is not a parameter.*; a measure takes"),
        ("minimize=[l1 + l12]", r"minimize\.0: 'l12' in .* is not a parameter.*did you mean 'l2'"),
        ("minimize=[l3*k]", r"minimize\.0: 'l3\*k' is the same for every design"),
        ("minimize=[{result: 2*l1, where: {theta: 3}}]", r"'2\*l1' is one number .* leave out 'where'"),
        ("minimize=[l11]", r"there is no result 'l11'; did you mean 'l1'"),
        ("minimize=[5]", r"expected a result, such as GII"),
        (
            "subject_to=[{result: l1 + l2, at_most: 2*l1 - k}]",
            r"at_most: '2\*l1 - k' changes with .* \{result: l1 \+ l2 - \(2\*l1 - k\), at_most: 0\}",
        ),
        ("subject_to=[{result: kinematics.mu, at_least: l1}]", r"at_least: 'l1' changes with .*a measure may take"),
    ],
)
def test_wrong_expressions_are_told(change: str, message: str) -> None:
    section = "optimize: {variables: {l1: {from: 20, to: 40, number: 5}}, minimize: [l1]}"
    with pytest.raises(StudyError, match=message):
        study_of(FOUR_BAR + section, f"optimize.{change}")


def test_a_requirement_on_an_expression_is_one_on_a_measure() -> None:
    with pytest.raises(StudyError, match=r"give it as a measure, mechanism\.measures: \{NAME: l1 \+ l2\}"):
        study_of(FOUR_BAR + "requirements: [{result: l1 + l2, at_most: 110}]")
    study = study_of(FOUR_BAR + "requirements: [{result: kinematics.total, at_most: 110}]")
    (verdict,) = mechdesign.requirements(study, mechdesign.kinematics(study))
    assert (verdict.met, verdict.worst) == (False, 120)
