"""The gate: the worst row counts."""

import numpy as np
import pytest

import mechdesign

ARM = """
mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: {theta: {angle: arm}}}
requirements: []
"""


def judge(tables, asked):
    """Verdicts of a study that requires so much, on an answer to how it moves that has these columns."""
    study = mechdesign.load(text=ARM, overrides={"requirements": asked})
    made = {}
    for table, given in tables.items():
        columns = [mechdesign.Column(name, np.asarray(given[name]), "deg" * (name == "theta")) for name in given]
        made[table] = mechdesign.Table(table, tuple(columns))
    return mechdesign.requirements(study, mechdesign.Answer("kinematics", made, study=study))


def request(result, **words):
    return {"result": result, **words}


def result(**columns):
    motion = {"theta": [0.0, 90.0, 180.0]} | columns
    return {"motion": motion, "extremes": {"output": ["B.x"], "range": [80.0]}}


def verdict(asked, **columns):
    (given,) = judge(result(**columns), [asked])
    return given


def test_the_smallest_row_counts_for_at_least():
    given = verdict(request("kinematics.mu", at_least=40), mu=[50.0, 39.0, 60.0])
    assert not given.met
    assert given.worst == 39
    assert given.place == "theta 90"


def test_the_largest_row_counts_for_at_most():
    assert verdict(request("kinematics.mu", at_most=60), mu=[50.0, 39.0, 60.0]).met
    assert verdict(request("kinematics.mu", at_most=59.9), mu=[50.0, 39.0, 60.0]).worst == 60


def test_both_bounds_and_the_one_that_fails_is_told():
    given = verdict(request("kinematics.mu", at_least=30, at_most=55), mu=[50.0, 39.0, 60.0])
    assert (given.met, given.worst) == (False, 60)


def test_nan_is_not_met():
    given = verdict(request("kinematics.mu", at_least=0), mu=[50.0, np.nan, 60.0])
    assert not given.met
    assert np.isnan(given.worst)


def test_absolute_value():
    assert not verdict(request("kinematics.mu", at_least=40), mu=[-50.0, 45.0, 60.0]).met
    assert verdict(request("kinematics.mu", abs=True, at_least=40), mu=[-50.0, 45.0, 60.0]).met


@pytest.mark.parametrize(
    ("where", "worst"), [({"theta": 90}, 39.0), ({"kind": "b"}, 60.0), ({"kind": "b", "theta": 180}, 60.0)]
)
def test_where_chooses_rows_by_number_and_word(where, worst):
    given = verdict(request("kinematics.mu", where=where, at_least=1), mu=[50.0, 39.0, 60.0], kind=["a", "a", "b"])
    assert given.worst == worst


@pytest.mark.parametrize(
    ("where", "told"),
    [
        ({"theta": 91}, "no row of motion has theta 91; there are 0, 90, 180"),
        ({"kind": "mont_carlo"}, "no row of motion has kind mont_carlo; did you mean 'monte_carlo'?"),
        ({"kind": "zzz"}, "no row of motion has kind zzz; there are first_order, monte_carlo"),
        ({"kind": "first_order", "theta": 180}, "no row of motion has kind first_order, theta 180 at once"),
        ({"theta": "91 deg"}, "no row of motion has theta 91"),
        ({"none": 3}, "no row of motion has none 3; there are none"),
    ],
)
def test_rows_that_never_are_are_mistakes_of_the_study(where, told):
    columns = {"kind": ["first_order", "first_order", "monte_carlo"], "none": [np.nan] * 3}
    with pytest.raises(mechdesign.StudyError) as caught:
        verdict(request("kinematics.mu", where=where, at_least=1), mu=[50.0, 39.0, 60.0], **columns)
    assert told in str(caught.value)
    assert "requirements.0" in str(caught.value)


def test_a_quantity_that_no_row_has_is_told_in_the_unit_of_the_column():
    study = mechdesign.load(
        text="mechanism: {links: {ground: {O: [0, 0]}, arm: [O, P, 100]}, drives: [arm]}\n"
        "kinematics: {poses: [{arm: 0}, {arm: 60}], outputs: [P]}\n"
        "requirements: [{result: kinematics.P.x, where: {arm: 1 rad}, at_least: 1}]\n"
    )
    with pytest.raises(mechdesign.StudyError, match=r"no row of motion has arm 57\.2957795131 deg; there are 0, 60"):
        _ = mechdesign.kinematics(study).verdicts


def test_the_nearest_of_many_rows_is_told():
    motion = {"theta": np.linspace(0, 360, 73), "mu": np.ones(73)}
    with pytest.raises(mechdesign.StudyError, match="there are 0 to 360, 35 the nearest"):
        judge({"motion": motion}, [request("kinematics.mu", where={"theta": 36}, at_least=1)])


def test_no_valid_row_is_not_met():
    asked = request("kinematics.mu", where={"valid": 1, "theta": 90}, at_least=1)
    assert not verdict(asked, mu=[50.0, np.nan, 60.0], valid=[True, False, True]).met
    empty = {name: np.zeros(0) for name in ("theta", "valid", "mu")}
    assert not judge({"motion": empty}, [asked])[0].met


def test_columns_of_other_tables_and_names_with_dots():
    assert verdict(request("kinematics.range", at_least=80)).met
    assert verdict(request("kinematics.extremes.range", at_least=80)).met
    assert verdict(request("kinematics.B.x", at_least=1), **{"B.x": [1.0, 2.0, 3.0]}).met


def test_other_commands_are_left_alone():
    assert judge(result(), [request("stiffness.k_y", at_least=1)]) == ()


def test_unknown_columns_are_mistakes_of_the_study_all_in_one_go():
    asked = [request("kinematics.muu", at_least=1), request("kinematics.output", at_least=1)]
    with pytest.raises(mechdesign.StudyError) as caught:
        judge(result(mu=[1.0, 2.0, 3.0]), asked)
    lines = str(caught.value).splitlines()
    assert "requirements.0: " in lines[0]
    assert "did you mean 'mu'" in lines[0]
    assert "words" in lines[1]


def test_requirements_of_a_study_at_a_result_in_a_notebook():
    study = mechdesign.load(
        {
            "mechanism": {
                "links": {
                    "ground": {"O": [0, 0], "D": [100, 0]},
                    "crank": ["O", "A", np.float64(30)],
                    "rod": ["A", "B", 90],
                    "rocker": ["D", "B", 60],
                },
                "drives": ["crank"],
                "sketch": {"A": np.array([0, 30]), "B": (75, 55)},
            },
            "requirements": [
                {"result": "kinematics.extremes.B.x.range", "at_most": 1000},
                {"result": "kinematics.B.y", "at_least": 100},
            ],
        }
    )
    met, missed = mechdesign.requirements(study, mechdesign.kinematics(study))
    assert met.met
    assert not missed.met
    assert missed.place.startswith("crank ")
