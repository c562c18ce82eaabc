"""Design variables over whole numbers, choices and entries of the study: designs, tables, files, mistakes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

PRESS = """\
mechanism:
  parameters: {r: 40, l: 110, d: 10, n: 5}
  links:
    ground: {O: [0, 0], G: [0, 15]}
    crank: [O, A, r]
    rod: [A, B, l]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 26], B: [140, 15]}
kinematics:
  sweep: {theta: {from: 30, to: 150, number: n}}  # poses
stiffness:
  sweep: {theta: {from: 30, to: 150, step: 30}}
  link: rod
  at: B
  sections:
    bar: {E: 200 GPa, diameter: d}
    tube: {E: 200 GPa, diameter: 2*d, inner_diameter: 2*d - 3}
  elastic: {crank: bar, rod: bar}
  actuators: {theta: 1e5 N*m/rad}
optimize:
  variables:
    d: {choices: [12, 8 mm, 10]}
    l: {from: 8.5*d, to: 130, integer: true, step: 15}
    stiffness.elastic.rod: {choices: [bar, tube]}
  maximize: stiffness.k_min
  minimize: l
"""


def press(variables: str = "", *changes: str) -> mechdesign.Study:
    """The press, or with these variables in place of its own, and the stiffness alone as goal."""
    other = [f"optimize.variables={{{variables}}}", "optimize.minimize="] if variables else []
    return study_of(PRESS, *other, *changes)


REQUIRED = "requirements=[{result: stiffness.k_min, at_least: 0}]"


def softest(study: mechdesign.Study) -> float:
    """The smallest stiffness of the motion, between its poses too, of a study that is `REQUIRED`."""
    (verdict,) = mechdesign.requirements(study, mechdesign.stiffness(study))
    return verdict.worst


def designs_of(result: mechdesign.Answer) -> list[tuple[object, ...]]:
    table = result.tables["designs"]
    return [*zip(*(table[name].tolist() for name in ("d", "l", "stiffness.elastic.rod")), strict=True)]


# The lengths from the first whole number not below 8.5 d on.
BRUTE = [
    (float(d), float(length), rod) for d, low in ((12, 102), (8, 68), (10, 85)) for length in range(low, 131, 15)
    for rod in ("bar", "tube")
]  # fmt: skip


def test_a_grid_has_every_choice_and_whole_number_and_bounds_that_follow_from_a_choice() -> None:
    study = press()
    assert study.warnings == ()
    assert designs_of(mechdesign.optimize(study)) == BRUTE


@pytest.mark.slow
def test_goals_of_designs_are_those_of_studies_with_these_entries() -> None:
    table = mechdesign.optimize(press()).tables["designs"]
    for row in list(table)[:6:5]:
        alone = study_of(
            PRESS, f"mechanism.parameters.d={row['d']}", f"mechanism.parameters.l={row['l']}",
            f"stiffness.elastic.rod={row['stiffness.elastic.rod']}", REQUIRED,
        )  # fmt: skip
        assert row["stiffness.k_min"] == pytest.approx(softest(alone), rel=1e-9)


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["search", "pareto"])
def test_search_and_front_find_the_optimum_of_the_grid_and_evaluate_each_design_once(method: str) -> None:
    asked = mechdesign.optimize(press("", f"optimize.method={method}", "optimize.weights=[[1, 1]]"))
    gridded = mechdesign.optimize(press())
    assert sorted(designs_of(asked)) == sorted(BRUTE)
    for name in ("d", "l", "stiffness.elastic.rod", "score"):
        # Of a front the optima for weights stand behind its knee and its ends.
        assert asked.tables["optimum"][name][-1:].tolist() == gridded.tables["optimum"][name].tolist()


@pytest.mark.slow
def test_a_front_names_the_choices() -> None:
    table = mechdesign.optimize(press("", "optimize.method=pareto")).tables["pareto"]
    values = np.array([(-row["stiffness.k_min"], row["l"]) for row in mechdesign.optimize(press()).tables["designs"]])
    best = {
        design for design, own in zip(BRUTE, values, strict=True)
        if not ((values <= own).all(axis=1) & (values < own).any(axis=1)).any()
    }  # fmt: skip
    assert {(row["d"], row["l"], row["stiffness.elastic.rod"]) for row in table} == best


@pytest.mark.slow
def test_the_answer_does_not_depend_on_jobs() -> None:
    one, two = (mechdesign.optimize(press("", "optimize.method=search"), jobs=jobs) for jobs in (1, 2))
    assert designs_of(one) == designs_of(two)
    assert one.tables["designs"]["stiffness.k_min"].tolist() == two.tables["designs"]["stiffness.k_min"].tolist()


def test_the_optimum_is_written_with_its_choices_and_gives_the_same_goal_again() -> None:
    result = mechdesign.optimize(study_of(PRESS + "matrix: {vary: {mechanism.parameters.r: [40, 41]}}\n"))
    row = next(iter(result.tables["optimum"]))
    again = mechdesign.load(text=result.files["optimum.yaml"])
    assert again.resolved["stiffness"]["elastic"] == {"crank": "bar", "rod": row["stiffness.elastic.rod"]}
    assert again.parameters.nominal["d"] == row["d"]
    required = mechdesign.load(text=result.files["optimum.yaml"], overrides=[REQUIRED])
    assert softest(required) == pytest.approx(row["stiffness.k_min"], rel=1e-9)
    assert again.matrix is not None
    assert "# poses" in result.files["optimum.yaml"]


def values_of(name: str, variables: str) -> list[float]:
    """The values of a variable over the designs."""
    return mechdesign.optimize(press(variables)).tables["designs"][name].tolist()


@pytest.mark.slow
def test_a_range_of_whole_numbers_begins_and_ends_between_its_bounds() -> None:
    assert values_of("n", "n: {from: d/4, to: 2*d - 10.1, integer: true}") == [3, 4, 5, 6, 7, 8, 9]
    assert values_of("n", "n: {from: 3*0.1*10, to: 10, integer: true, step: 4}") == [3, 7]
    with pytest.raises(mechdesign.StudyError, match=r"optimize\.variables\.n: no value lies"):
        values_of("n", "n: {from: 2.2, to: 2.8, integer: true}")


def test_parameters_and_dimensions_may_be_named_as_entries() -> None:
    named = "mechanism.parameters.d: {choices: [8, 10]}, mechanism.links.rod.length: {from: 10*d, to: 100, step: 10}"
    study = press(named)
    assert study.optimize is not None
    assert [*study.optimize.variables] == ["d", "rod.length"]
    assert values_of("rod.length", named) == [80, 90, 100, 100]


@pytest.mark.slow
def test_choices_of_structures_places_of_the_sketch_and_numbers_that_are_read_once() -> None:
    named = (
        "mechanism.sketch.B: {choices: [[140, 15], [-80, 15]]}, n: {choices: [3, 4]}, "
        "kinematics.sweep.theta.to: {from: 100, to: 150, step: 50}"
    )
    study = press(named, "optimize.maximize=kinematics.B.x")
    found = list(mechdesign.optimize(study).tables["designs"])
    assert len(found) == 8
    for row in found:
        sketch, last = row["mechanism.sketch.B"], row["kinematics.sweep.theta.to"]
        alone = study_of(PRESS, f"mechanism.sketch.B={sketch}", f"kinematics.sweep.theta.to={last}",
                         f"mechanism.parameters.n={row['n']:g}")  # fmt: skip
        assert row["kinematics.B.x"] == pytest.approx(mechdesign.kinematics(alone).main["B.x"].min(), rel=1e-12)
    assert {row["kinematics.B.x"] > 0 for row in found} == {True, False}


@pytest.mark.parametrize(
    "entry",
    [
        "stiffness.sections.tube.E: {from: 70 GPa, to: 210 GPa, number: 2}",
        "stiffness.sweep.theta.step: {choices: [30, 40]}",
        # The study has no such number; the next is whole and read once.
        "stiffness.characteristic_length: {choices: [50, 80]}",
        "kinematics.sweep.theta.number: {choices: [2, 3]}",
    ],
)
def test_numbers_of_entries_give_what_studies_with_these_numbers_give(entry: str) -> None:
    study = press(f"{entry}, stiffness.elastic.rod: {{choices: [bar, tube]}}")
    name = entry.partition(":")[0]
    for row in list(mechdesign.optimize(study).tables["designs"]):
        rod = f"stiffness.elastic.rod={row['stiffness.elastic.rod']}"
        alone = study_of(PRESS, f"{name}={row[name]:g}", rod, REQUIRED)
        assert row["stiffness.k_min"] == pytest.approx(softest(alone), rel=1e-9)


def test_tolerance_classes_are_choices() -> None:
    section = "{sweep: {theta: {from: 30, to: 150, step: 30}}, dimensions: {rod.length: h7}, limits: {B.x: 0.05}}"
    study = press(
        "reliability.dimensions.rod.length: {choices: [h7, h9]}", f"reliability={section}",
        "reliability.methods=[analytic]", "optimize.maximize=reliability.reliability",
    )  # fmt: skip
    tables = mechdesign.optimize(study).tables
    assert tables["designs"]["reliability.dimensions.rod.length"].tolist() == ["h7", "h9"]
    assert tables["optimum"]["reliability.dimensions.rod.length"].tolist() == ["h7"]
    # A choice has no step, and no bound that it lies at.
    assert len(tables["sensitivity"]) == 0
    assert tables["optimum"]["active"].tolist() == [""]


@pytest.mark.slow
def test_sensitivities_are_of_ranges_and_whole_numbers_move_by_whole_steps() -> None:
    tables = mechdesign.optimize(press()).tables
    assert tables["sensitivity"]["variable"].tolist() == ["l"]
    assert tables["sensitivity"]["step"].tolist() == [15]
    scores = dict(zip(designs_of(mechdesign.optimize(press())), tables["designs"]["CPI"], strict=True))
    d, length, rod = (tables["optimum"][name][0] for name in ("d", "l", "stiffness.elastic.rod"))
    expected = scores[d, length + 15, rod] - scores[d, length, rod]
    assert tables["sensitivity"]["score_up"][0] == pytest.approx(expected)


@pytest.mark.slow
def test_a_choice_that_fails_only_together_with_another_is_an_infeasible_design() -> None:
    named = "stiffness.sections.tube.inner_diameter: {choices: [15, 21]}, stiffness.sections.tube.diameter: "
    changes = "stiffness.elastic.rod=tube", "stiffness.sections.tube={E: 2e5, diameter: 24, inner_diameter: 15}"
    study = press(f"{named}{{choices: [20, 24]}}", *changes)
    assert study.warnings == ()
    table = mechdesign.optimize(study).tables["designs"]
    assert [bool(each) for each in table["feasible"]] == [True, True, False, True]
    assert "the inner diameter" in table["reason"][2]


def test_the_nearest_of_designs_that_miss_a_condition_names_its_choices() -> None:
    condition = "optimize.subject_to=[{result: stiffness.k_min, at_least: 1e6}]"
    with pytest.raises(
        mechdesign.AssemblyError, match=r"the nearest, d = 12, l = 117, stiffness\.elastic\.rod = bar, misses"
    ):
        mechdesign.optimize(press("", condition))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ("d: {choices: [8, 10], step: 2}", "choices are the values themselves; leave out 'step'"),
        ("d: {choices: [8], integer: true}", "leave out 'integer'"),
        ("d: {choices: [8], from: 2, to: 3}", "leave out 'from'"),
        ("d: {choices: []}", "expected a list of values"),
        ("d: {choices: [8, 8 mm]}", "'8 mm' is listed twice"),
        ("d: {choices: [8, thick]}", "d is a number, and 'thick' is none"),
        ("l: {choices: [100, 9 N]}", "is a force, where a length is expected"),
        ("d: {from: 8}", "a variable has a range"),
        ("n: {from: 3, to: 9, integer: true, step: 1.5}", "a step of whole numbers is whole, not 1.5"),
        ("n: {from: 3, to: 9, integer: true, number: 3}", "leave out 'number'"),
        ("stiffness.elastic.rot: {choices: [bar]}", "no stiffness.elastic.rot; did you mean 'rod'"),
        ("stiffness.elastic.rod: {choices: [bar, tub]}", "there is no section 'tub'; did you mean 'tube'"),
        ("stiffness.elastic.rod: {choices: [6, '6']}", "two choices read the same"),
        ("d: {choices: [8]}, mechanism.parameters.d: {choices: [9]}", "the same entry; vary one of them"),
        ("stiffness.elastic: {choices: [{}]}, stiffness.elastic.rod: {choices: [bar]}", "or hold, the same entry"),
        ("mechanism.parameters: {choices: [{d: 8}]}", "holds every parameter"),
        ("optimize.method: {choices: [grid]}", "there is no parameter, dimension or entry 'optimize.method'"),
        ("stiffness.sections.bar.E: {choices: [200 GPa, 70 mm]}", "'70 mm' is a length, where a stress is expected"),
        ("stiffness.elastic.rod: {choices: [bar, tube]}, l: {from: d + stiffness, to: 9, step: 1}", "no parameter or"),
    ],
)
def test_wrong_variables_are_told_at_their_place(variables: str, message: str) -> None:
    text = PRESS.partition("  variables:")[0] + f"  variables: {{{variables}}}\n  maximize: stiffness.k_min\n"
    with pytest.raises(mechdesign.StudyError) as raised:
        mechdesign.optimize(mechdesign.load(text=text))
    assert message in str(raised.value)
    assert {problem.line for problem in raised.value.problems} == {23}


@pytest.mark.nightly
@pytest.mark.parametrize(
    "variables",
    [
        "stiffness.elastic.rod: {choices: [bar, tube]}",
        "stiffness.elastic.rod: {choices: [bar, tube]}, stiffness.elastic.crank: {choices: [bar, tube]}",
        "d: {choices: [8, 10, 12]}, stiffness.elastic.rod: {choices: [bar, tube]}, l: {from: 90, to: 130, step: 20}",
    ],
)
@pytest.mark.parametrize("method", ["grid", "search", "pareto"])
def test_pictures_name_the_choices(variables: str, method: str) -> None:
    study = press(variables, f"optimize.method={method}", "optimize.minimize=kinematics.B.x")
    result = mechdesign.optimize(study)
    words = {
        text.get_text() for name in result.figures for axes in result.figure(name).axes
        for text in (*axes.get_xticklabels(), *axes.get_yticklabels(), *axes.texts)
    }  # fmt: skip
    assert {"bar", "tube"} <= words


@pytest.mark.slow
def test_every_combination_of_words_is_one_design() -> None:
    links = ("crank", "rod")
    named = ", ".join(f"stiffness.elastic.{link}: {{choices: [bar, tube]}}" for link in links)
    table = mechdesign.optimize(press(named)).tables["designs"]
    pairs = [*zip(*(table[f"stiffness.elastic.{link}"].tolist() for link in links), strict=True)]
    assert pairs == [*product(("bar", "tube"), repeat=2)]
    assert len({*table["stiffness.k_min"].tolist()}) == 4
