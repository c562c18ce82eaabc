"""Statistics along a motion: closed forms, a designer's own dense table, parts of the motion, sums, designs at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from helpers.studies import IN_LINE, study_of

import mechdesign

WORDS = ("min", "max", "mean", "rms", "range", "peak", "evenness")
TURN = 2 * np.pi
# A crank-rocker with a point on its coupler, at one turn a second, under a weight.
FOUR_BAR = """
mechanism:
  parameters: {a: 30, b: 100, c: 80}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, a], rocker: [D, B, c],
          coupler: {from: A, to: B, length: b, points: {C: [60, 40]}}}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 0], B: [90, 80]}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 8}}
  rates: {theta: 60 rpm}
  loads: [{at: C, force: [0, -10]}]
  outputs: [C, rocker.angle]
"""
YOKE = """
mechanism:
  parameters: {r: 40}
  links: {ground: {O: [0, 0]}, crank: [O, A, r], yoke: {S: [0, 0], P: [25, 0]}}
  joints:
    slot: {slot: yoke, through: S, direction: 90, point: A}
    guide: {prismatic: [ground, yoke], through: O, point: S}
  drives: {theta: {angle: crank}}
  sketch: {A: [30, 30], S: [30, 0]}
"""
OPTIMIZE = "optimize: {variables: {a: {from: 20, to: 40, number: 5}}, minimize: [%s]}"


def tabulated(count: int, begin: float = 0.0, end: float = 360.0, a: float = 30.0) -> dict[str, np.ndarray]:
    """What a designer would tabulate of `FOUR_BAR`: by triangles, and by differences of fourth order."""
    b, c = 100.0, 80.0
    theta = np.radians(np.linspace(begin, end, count))

    def point(angle: np.ndarray) -> np.ndarray:
        pin = a * np.exp(1j * angle)
        line = 100.0 - pin
        along = (b * b - c * c + abs(line) ** 2) / (2 * abs(line))
        other = pin + line / abs(line) * (along + 1j * np.sqrt(b * b - along**2))
        return pin + (other - pin) / b * (60 + 40j)

    step = 1e-3
    places = [point(theta + k * step) for k in (-2, -1, 0, 1, 2)]
    velocity = TURN * (places[0] - 8 * places[1] + 8 * places[3] - places[4]) / (12 * step)
    bend = (-places[0] + 16 * places[1] - 30 * places[2] + 16 * places[3] - places[4]) / (12 * step**2)
    return {
        "theta": np.degrees(theta), "C.x": places[2].real, "C.y": places[2].imag, "C.x_velocity": velocity.real,
        "C.y_acceleration": TURN**2 * bend.imag, "theta_effort": 10 * velocity.imag / TURN,
    }  # fmt: skip


def told(values: np.ndarray) -> dict[str, float]:
    """Statistics of evenly spaced values; of many they are those of the function."""
    mean, size = (np.trapezoid(each) / (len(values) - 1) for each in (values, np.abs(values)))
    return {
        "min": values.min(), "max": values.max(), "mean": mean, "range": np.ptp(values), "peak": np.abs(values).max(),
        "rms": np.sqrt(np.trapezoid(values**2) / (len(values) - 1)), "evenness": 1 - np.ptp(values) / size,
    }  # fmt: skip


def required(text: str, *requirements: str) -> list[mechdesign.Verdict]:
    study = study_of(text + "\nrequirements:\n" + "".join(f"  - {each}\n" for each in requirements))
    return list(mechdesign.requirements(study, mechdesign.kinematics(study)))


def numbers(text: str, where: str, *results: str) -> dict[str, float]:
    """Values of results of the kinematics over a part of the motion, as requirements judge them."""
    part = f", where: {where}" if where else ""
    verdicts = required(text, *(f"{{result: kinematics.{each}{part}, at_most: 0}}" for each in results))
    return {each: verdict.worst for each, verdict in zip(results, verdicts, strict=True)}


def close(found: Mapping[str, float], expected: Mapping[str, float], tolerance: float) -> None:
    size = max(map(abs, expected.values()))
    for word, value in expected.items():
        assert found[word] == pytest.approx(value, rel=tolerance, abs=tolerance * size), word


@pytest.mark.slow
@pytest.mark.parametrize("column", ["C.x", "C.x_velocity", "C.y_acceleration", "theta_effort"])
def test_every_word_is_that_of_a_dense_table(column: str) -> None:
    found = numbers(FOUR_BAR, "", *(f"{column}.{word}" for word in WORDS))
    expected = told(tabulated(20_001)[column])
    close(found, {f"{column}.{word}": expected[word] for word in WORDS}, 2e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("begin", "end"), [(181.3, 300), (300, 61.7), (-40, 20)])
def test_a_part_of_a_turn_has_the_ends_that_are_given(begin: float, end: float) -> None:
    """Not the poses nearest to them; a range that ends before it begins goes past a whole turn."""
    where = f"{{theta: {{from: {begin}, to: {end}}}}}"
    for column in ("C.y", "theta_effort"):
        found = numbers(FOUR_BAR, where, *(f"{column}.{word}" for word in WORDS))
        dense = tabulated(20_001, begin, end + 360 * (end < begin))
        expected = told(dense[column])
        close(found, {f"{column}.{word}": expected[word] for word in WORDS}, 2e-7)


@pytest.mark.slow
def test_the_stance_of_a_foot() -> None:
    """Where the point is below a height; its ends are roots between the poses."""
    dense = tabulated(2_000_001)
    low = dense["C.y"] <= 60
    found = numbers(FOUR_BAR, "{C.y: {at_most: 6 cm}}", *(f"C.x_velocity.{word}" for word in WORDS))
    values = dense["C.x_velocity"][low]
    # It is one part of the motion, and its ends are known to half a step.
    assert np.count_nonzero(np.diff(low)) == 2
    expected = told(values)
    close(found, {f"C.x_velocity.{word}": expected[word] for word in WORDS}, 3e-6)
    # Only of the rows, or with ends at the nearest rows, it would be another number.
    coarse = tabulated(46)
    assert abs(told(coarse["C.x_velocity"][coarse["C.y"] <= 60])["mean"] / expected["mean"] - 1) > 1e-3


def test_a_part_between_two_poses_and_one_that_is_nowhere() -> None:
    inside, outside, worst = required(
        FOUR_BAR,
        "{result: kinematics.C.x.mean, where: {theta: {from: 41, to: 42}}, at_least: 0}",
        "{result: kinematics.C.x.mean, where: {C.y: {at_least: 1000}}, at_least: 0}",
        "{result: kinematics.C.x, where: {theta: {from: 41, to: 42}}, at_least: 0}",
    )
    dense = tabulated(2001, 41, 42)["C.x"]
    assert inside.worst == pytest.approx(told(dense)["mean"], rel=1e-9)
    assert (np.isnan(outside.worst), outside.met, outside.place) == (True, False, "no place of the motion")
    assert worst.worst == pytest.approx(dense.min(), rel=1e-9)
    assert worst.place == "theta 42"


@pytest.mark.slow
def test_several_ranges_hold_at_once() -> None:
    where = "{theta: {from: 20, to: 200}, C.y: {at_least: 70, at_most: 90}}"
    found = numbers(FOUR_BAR, where, "C.x.min", "C.x.max", "C.x.mean")
    dense = tabulated(1_000_001, 20, 200)
    rows = (dense["C.y"] >= 70) & (dense["C.y"] <= 90)
    # Two stretches of the motion, beside each other in the mean.
    assert np.count_nonzero(np.diff(rows)) > 2
    values = dense["C.x"][rows]
    expected = {"C.x.min": values.min(), "C.x.max": values.max(), "C.x.mean": values.mean()}
    close(found, expected, 2e-6)


def test_closed_forms_of_a_yoke() -> None:
    """Its velocity is -r w sin(theta), which is even in no sense: its mean is zero, that of its size 2/pi r w."""
    text = YOKE + "kinematics: {sweep: {theta: {from: 0, to: 360, number: 14}}, rates: {theta: 1 rad/s}, outputs: [P]}"
    found = numbers(text, "", *(f"P.x_velocity.{word}" for word in WORDS), "P.x_acceleration.peak")
    assert found["P.x_velocity.rms"] == pytest.approx(40 / np.sqrt(2), rel=1e-12)
    assert found["P.x_velocity.peak"] == pytest.approx(40, rel=1e-12)
    assert found["P.x_velocity.mean"] == pytest.approx(0, abs=1e-12)
    assert found["P.x_velocity.evenness"] == pytest.approx(1 - np.pi, rel=1e-12)
    assert found["P.x_acceleration.peak"] == pytest.approx(40, rel=1e-12)
    part = numbers(text, "{theta: {from: 30, to: 150}}", "P.x_velocity.mean", "P.x_velocity.evenness")
    mean = 40 * np.sqrt(3) / (2 * np.pi / 3)
    assert part["P.x_velocity.mean"] == pytest.approx(-mean, rel=1e-12)
    assert part["P.x_velocity.evenness"] == pytest.approx(1 - 20 / mean, rel=1e-12)


def test_what_stands_still_is_even() -> None:
    text = FOUR_BAR.replace("outputs: [C, rocker.angle]", "outputs: [theta, C]")
    assert numbers(text, "", "theta_velocity.evenness")["theta_velocity.evenness"] == 1


@pytest.mark.slow
def test_extremes_of_velocities_and_accelerations_lie_between_the_poses() -> None:
    result = mechdesign.kinematics(study_of(FOUR_BAR))
    table = result.tables["extremes"]
    rates = [f"{name}_{order}" for name in ("C.x", "C.y", "rocker.angle") for order in ("velocity", "acceleration")]
    assert table["output"].tolist() == ["C.x", "C.y", "rocker.angle", "theta_effort", *rates]
    assert table["unit"].tolist()[4:] == ["mm/s", "mm/s^2"] * 2 + ["deg/s", "deg/s^2"]
    dense = tabulated(200_001)
    for name in ("C.x_velocity", "C.y_acceleration"):
        row = table.take(table.where(output=name))
        for end, at in (("min", np.argmin(dense[name])), ("max", np.argmax(dense[name]))):
            assert row[end][0] == pytest.approx(dense[name][at], rel=1e-7)
            assert row[f"{end}_at"][0] == pytest.approx(dense["theta"][at], abs=2e-2)
        assert np.ptp(result.tables["motion"][name]) < row["range"][0] * (1 - 1e-4)


@pytest.mark.slow
def test_what_goes_to_infinity_has_no_mean() -> None:
    """A press at its dead centres, where the crank can bear any load: its advantage is infinite there."""
    text = IN_LINE + (
        "kinematics: {sweep: {crank: {from: 10, to: 350, step: 20}}, outputs: [B.x],"
        " mechanical_advantage: {B.x: crank}}"
    )
    found = numbers(text, "", *(f"B.x_advantage.{word}" for word in WORDS))
    assert found["B.x_advantage.peak"] == found["B.x_advantage.rms"] == np.inf
    assert found["B.x_advantage.evenness"] == -np.inf
    assert np.isnan(found["B.x_advantage.mean"])
    # Away from it there are all.
    theta = np.radians(np.linspace(20, 160, 200_001))
    slide = 30 * np.sin(theta) * (1 + 30 * np.cos(theta) / np.sqrt(100**2 - (30 * np.sin(theta)) ** 2))
    found = numbers(text, "{crank: {from: 20, to: 160}}", *(f"B.x_advantage.{word}" for word in WORDS))
    expected = told(-1 / slide)
    close(found, {f"B.x_advantage.{word}": expected[word] for word in WORDS}, 1e-7)


def test_listed_poses_are_what_they_are() -> None:
    text = FOUR_BAR.replace(
        "sweep: {theta: {from: 0, to: 360, step: 8}}", "poses: [{theta: 10}, {theta: 50}, {theta: 70}]"
    )
    mean, part = required(
        text,
        "{result: kinematics.C.x.mean, at_least: 0}",
        "{result: kinematics.C.x.rms, where: {theta: {from: 40, to: 90}}, at_least: 0}",
    )
    rows = [tabulated(2, angle, angle + 1)["C.x"][0] for angle in (10, 50, 70)]
    assert mean.worst == pytest.approx(np.mean(rows), rel=1e-12)
    assert part.worst == pytest.approx(np.sqrt(np.mean(np.square(rows[1:]))), rel=1e-12)
    assert mean.note == part.note == "of the asked poses only"


def test_sums_of_numbers_of_one_unit() -> None:
    names = ["C.x.range", "C.y.peak", "extremes.C.x.max"]
    each = numbers(FOUR_BAR, "", *names)
    text = "kinematics.C.x.range + 2*kinematics.C.y.peak - kinematics.extremes.C.x.max/4"
    (total,) = required(FOUR_BAR, f"{{result: {text}, at_most: 20 cm}}")
    assert total.worst == pytest.approx(each["C.x.range"] + 2 * each["C.y.peak"] - each["extremes.C.x.max"] / 4)
    assert total.unit == "mm"
    assert total.margin == pytest.approx(200 - total.worst)
    assert total.requirement == f"{text} at most 20 cm"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("requirement", "message"),
    [
        ("{result: kinematics.C.x.average, at_most: 1}", "C.x has no 'average'; it has min, max, mean, range"),
        ("{result: kinematics.C.z.mean, at_most: 1}", "no column 'C.z.mean'; did you mean 'C.[xy].mean'"),
        ("{result: kinematics.extremes.rocker.range, at_most: 1}", "; did you mean 'extremes.rocker.angle.range'"),
        ("{result: kinematics.extreme.C.x.max, at_most: 1}", "; did you mean 'extremes.C.x.max'"),
        (
            "{result: kinematics.C.x.mean + kinematics.rocker.angle.mean, at_most: 1}",
            r"several: C.x.mean \(mm\), rocker",
        ),
        (
            "{result: kinematics.C.x.mean + kinematics.C.y, at_most: 1}",
            "C.y has 46 rows; ask for kinematics.C.y.min",
        ),
        (
            "{result: kinematics.C.x.mean + stiffness.k_min.mean, at_most: 1}",
            "of one command, and .* has kinematics and",
        ),
        ("{result: kinematics.C.x.mean*kinematics.C.y.mean, at_most: 1}", "no sum: results of one unit are added"),
        ("{result: kinematics.C.x.mean, at_most: 1 s}", "C.x: '1 s' is a time"),
        ("{result: kinematics.C.x.mean, where: {theta: {from: 10}}, at_most: 1}", "has 'from' and 'to', or 'at_least'"),
        ("{result: kinematics.C.x.mean, where: {theta: {}}, at_most: 1}", "has 'from' and 'to', or 'at_least'"),
        (
            "{result: kinematics.C.x.mean, where: {theta: {from: 10, to: 20, at_most: 3}}, at_most: 1}",
            "has 'from' and 'to', or 'at_least'",
        ),
        (
            "{result: kinematics.C.x.mean, where: {theta: {from: 10, to: 10}}, at_most: 1}",
            "nothing lies between 10 and 10",
        ),
        (
            "{result: kinematics.C.x.mean, where: {C.y: {at_least: 4, at_most: 3}}, at_most: 1}",
            "nothing is at least 4 and at most 3",
        ),
        ("{result: kinematics.C.x.mean, where: {C.y: {from: 4, to: 3}}, at_most: 1}", "nothing lies from 4 to 3"),
        ("{result: kinematics.C.x.mean, where: {theta: {at_most: 3 mm}}, at_most: 1}", "theta: '3 mm' is a length"),
        ("{result: kinematics.C.x.mean, where: {thta: {at_most: 3}}, at_most: 1}", "no column 'thta'; did you mean"),
        (
            "{result: kinematics.extremes.max, where: {output: {at_most: 3}}, at_most: 1}",
            "'output' of extremes holds words",
        ),
        (
            "{result: kinematics.extremes.C.x.range, where: {theta: {from: 10, to: 20}}, at_most: 1}",
            "no column 'theta'.*name what is told of a column itself, as in kinematics.C.x.range",
        ),
    ],
)
def test_mistakes_are_told_in_words(requirement: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        required(FOUR_BAR, requirement)


GOALS = [
    "{result: kinematics.C.x.mean}",
    "{result: kinematics.C.x_velocity.rms}",
    "{result: kinematics.C.y_acceleration.peak}",
    "{result: kinematics.theta_effort.evenness}",
    "{result: kinematics.theta_effort.mean, where: {theta: {from: 300, to: 61}}}",
    "{result: kinematics.C.x.range, where: {C.y: {at_most: 60}}}",
    "{result: kinematics.C.x, where: {theta: {from: 100.5, to: 131}}}",
    "{result: kinematics.C.x.range + 2*kinematics.extremes.C.y.range}",
    "{result: kinematics.conditioning.min}",
]


def of_designs(begin: float, end: float, count: int) -> np.ndarray:
    """Goals of cranks of so many lengths, a row a design."""
    asked = OPTIMIZE.replace("from: 20, to: 40, number: 5", f"from: {begin}, to: {end}, number: {count}")
    table = mechdesign.optimize(study_of(FOUR_BAR + asked % ", ".join(GOALS))).tables["designs"]
    return np.array([values for name, values in table.to_dict().items() if name.startswith(("kinematics.", "|"))]).T


@pytest.mark.nightly
def test_goals_of_many_designs_are_those_of_each_alone() -> None:
    lengths = np.linspace(22.0, 38.0, 7)
    found = of_designs(22, 38, 7)
    assert found.shape == (7, len(GOALS))
    alone = np.concatenate([of_designs(length, length, 1) for length in lengths])
    assert found == pytest.approx(alone, rel=1e-12, abs=1e-12)
    dense = tabulated(20_001, a=lengths[2])
    fine, part = tabulated(2_000_001, a=lengths[2]), tabulated(20_001, 300, 421, a=lengths[2])
    expected = [
        told(dense["C.x"])["mean"], told(dense["C.x_velocity"])["rms"], told(dense["C.y_acceleration"])["peak"],
        told(dense["theta_effort"])["evenness"], told(part["theta_effort"])["mean"],
        np.ptp(fine["C.x"][fine["C.y"] <= 60]), tabulated(20_001, 100.5, 131, a=lengths[2])["C.x"].max(),
        np.ptp(dense["C.x"]) + 2 * np.ptp(dense["C.y"]),
    ]  # fmt: skip
    assert found[2, : len(expected)] == pytest.approx(expected, rel=5e-6)
    # And those of the command, of that design.
    bounded = [goal[:-1] + ", at_most: 0}" for goal in GOALS]
    verdicts = required(FOUR_BAR.replace("a: 30", f"a: {lengths[2]}"), *bounded)
    assert [verdict.worst for verdict in verdicts] == pytest.approx(found[2], rel=1e-10)


@pytest.mark.slow
def test_a_search_by_words_of_the_field() -> None:
    """The crank whose coupler point moves evenly: its part below a height is not there in every design."""
    section = """
optimize:
  variables: {a: {from: 20, to: 40, number: 9}}
  maximize: {result: kinematics.C.x_velocity.evenness, where: {C.y: {at_most: 45}}}
  subject_to: [{result: kinematics.theta_effort.rms, at_most: 0.3 N*m}]
"""
    result = mechdesign.optimize(study_of(FOUR_BAR + section))
    designs = result.tables["designs"]
    column = designs["kinematics.C.x_velocity.evenness (C.y at most 45)"]
    feasible = np.zeros(9, dtype=bool)
    for k, a in enumerate(designs["a"]):
        dense = tabulated(200_001, a=a)
        low = dense["C.y"] <= 45
        feasible[k] = low.any() and told(dense["theta_effort"])["rms"] <= 300
        if low.any():
            assert column[k] == pytest.approx(told(dense["C.x_velocity"][low])["evenness"], rel=1e-3)
    assert 0 < feasible.sum() < 9
    assert (designs["reason"] == "").tolist() == feasible.tolist()


@pytest.mark.slow
def test_results_of_a_matrix() -> None:
    section = """
matrix:
  vary: {mechanism.parameters.a: [25, 30]}
  results: [kinematics.C.x_velocity.rms, {result: kinematics.C.x.mean, where: {theta: {from: 100, to: 200}}},
            kinematics.C.x.range + kinematics.C.y.range, kinematics.C.y.min]
"""
    table = mechdesign.sweep(study_of(FOUR_BAR + section)).main
    for k, a in enumerate((25.0, 30.0)):
        dense = tabulated(20_001, a=a)
        assert table["kinematics.C.x_velocity.rms"][k] == pytest.approx(told(dense["C.x_velocity"])["rms"], rel=1e-7)
        mean = told(tabulated(20_001, 100, 200, a=a)["C.x"])["mean"]
        assert table["kinematics.C.x.mean (theta from 100 to 200)"][k] == pytest.approx(mean, rel=1e-7)
        total = np.ptp(dense["C.x"]) + np.ptp(dense["C.y"])
        assert table["kinematics.C.x.range + kinematics.C.y.range"][k] == pytest.approx(total, rel=1e-7)
        assert table["kinematics.C.y.min"][k] == pytest.approx(dense["C.y"].min(), rel=1e-7)
    assert table.column("kinematics.C.x_velocity.rms").unit == "mm/s"


@pytest.mark.parametrize(("begin", "end"), [(300, 60), (-60, 60), (300, 420)])
def test_a_range_of_angles_wraps(begin: float, end: float) -> None:
    """The crank's pin is right of 15 there, and farthest right at 0 degrees; elsewhere it is left of it."""
    part = f"{{theta: {{from: {begin}, to: {end}}}}}"
    text = FOUR_BAR.replace("outputs: [C,", "outputs: [A.x, C,")
    found = numbers(text, part, "A.x.min", "A.x.max", "A.x.mean")
    assert found["A.x.min"] == pytest.approx(15)
    assert found["A.x.max"] == pytest.approx(30)
    assert found["A.x.mean"] == pytest.approx(30 * np.sin(np.pi / 3) / (np.pi / 3))


@pytest.mark.slow
def test_columns_and_units_of_goals() -> None:
    study = study_of(FOUR_BAR + OPTIMIZE % ", ".join(GOALS[:4]))
    assert study.optimize is not None
    designs = mechdesign.optimize(study).tables["designs"]
    units = [designs.column(name).unit for name in designs.names if name.startswith("kinematics.")]
    assert units == ["mm", "mm/s", "mm/s^2", ""]
