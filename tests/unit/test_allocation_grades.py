"""Tolerances allocated in standard grades, and to a Cpk: against the enumeration of all choices, and closed forms."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of
from helpers.tolerances import HALVES

import mechdesign

NAMES = [f"IT{number}" for number in range(5, 13)]
# An error that is the sum of a, b and c, and that of the motor.
SUM = """
mechanism:
  parameters: {a: 40, b: 60, c: 100}
  links: {ground: {O: [0, 0], G: [a + b - c, 0]}, slider: {B: [0, 0]}}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {travel: {slide: guide}}
  sketch: {B: [30, 0]}
reliability:
  dimensions: {a: 0.05, b: 0.05, c: 0.05, travel: 0.02}
  poses: [{travel: 10}]
  outputs: [B.x]
  limits: {B.x: 0.12}
  methods: [analytic, monte_carlo]
  samples: 20000
  sobol: 0
"""
PLANE = """
mechanism:
  parameters: {one: 100, two: 60}
  links: {ground: {O: [0, 0]}, upper: [O, E, one], fore: {from: E, to: P, length: two}, tool: {P: [0, 0], T: [40, 0]}}
  joints: {wrist: {fixed: [fore, tool], angle: 20}}
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [80, 60], P: [120, 20]}
reliability:
  dimensions: {one: 0.05, two: 0.05, tool.T.x: 0.05, theta1: 0.005, wrist.angle: 0.01}
  poses: [{theta1: 30, theta2: 70}, {theta1: 60, theta2: 150}, {theta1: 0, theta2: 100}]
  methods: [analytic]
  samples: 20000
  sobol: 0
"""


def ask(text: str, *overrides: str) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(text, *overrides))


def chosen(result: mechdesign.Answer) -> dict[str, str]:
    table = result.tables["allocation"]
    return dict(zip(table["source"].tolist(), table["grade"].tolist(), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["reliability: 0.999", "cpk: 1.0", "cpk: 1.67"])
@pytest.mark.parametrize("limit", [0.08, 0.12, 0.2])
def test_a_sum_has_the_cheapest_of_all_choices(asked: str, limit: float) -> None:
    result = ask(
        SUM, f"reliability.allocate={{{asked}, grades: true, cost: {{a: 1, b: 0.7, c: 2}}}}",
        f"reliability.limits={{B.x: {limit}}}",
    )  # fmt: skip
    level = 3.2905267314919255 if asked.startswith("rel") else 3 * float(asked[5:])
    costs = {}
    for choice in itertools.product(range(8), repeat=3):
        halves = np.array([HALVES[size][k] for size, k in zip((40, 60, 100), choice, strict=True)])
        if np.sqrt(np.sum(halves**2) + 0.02**2) / 3 * level <= limit:
            costs[choice] = float(np.sum([1, 0.7, 2] / halves))
    best = min(costs, key=lambda choice: costs[choice])
    assert [chosen(result)[name] for name in "abc"] == [NAMES[k] for k in best]
    assert chosen(result)["travel"] == ""
    table = result.tables["allocation"]
    assert np.nansum(table["cost_allocated"]) == pytest.approx(costs[best])
    assert table["allocated"][:3] == pytest.approx(
        [HALVES[size][k] for size, k in zip((40, 60, 100), best, strict=True)]
    )
    assert result.tables["confirmation"]["met"].all()
    assert any(
        "held as given, for grades are of lengths with a tolerance: travel" in note
        for note in map(str, result.warnings)
    )


@pytest.mark.nightly
@pytest.mark.parametrize(("asked", "limits"), [
    ("reliability: 0.9973", "P.x: 0.08, T.y: 0.1"),
    ("reliability: 0.9973", "T: {radius: 0.12}"),
    ("reliability: 0.9973", "T.x: 0.08, T.y: 0.1, P.x: 0.08"),
    ("cpk: 1.33", "P.x: 0.08, T.y: 0.1"),
    ("cpk: 1.33", "T.x: 0.08, T.y: 0.1, P.x: 0.08"),
])  # fmt: skip
def test_a_mechanism_has_the_cheapest_of_all_choices_that_reach_it_exactly(asked: str, limits: str) -> None:
    grades = ["IT6", "IT7", "IT8", "IT9", "IT10"]
    prices = {"one": 1.0, "two": 2.0, "tool.T.x": 0.5}
    result = ask(
        PLANE, f"reliability.limits={{{limits}}}",
        f"reliability.allocate={{{asked}, grades: [{', '.join(grades)}], cost: {prices}}}".replace("'", ""),
    )  # fmt: skip
    assert not result.failed
    sizes = {"one": 100, "two": 60, "tool.T.x": 40}
    costs = {}
    for choice in itertools.product(grades, repeat=3):
        halves = {name: HALVES[sizes[name]][NAMES.index(grade)] for name, grade in zip(prices, choice, strict=True)}
        dimensions = {**halves, "theta1": 0.005, "wrist.angle": 0.01}
        written = ", ".join(f"{name}: {half}" for name, half in dimensions.items())
        table = ask(PLANE, f"reliability.limits={{{limits}}}", f"reliability.dimensions={{{written}}}").tables
        value = float(asked.partition(":")[2])
        good = (table["capability"]["cpk"] >= value).all() if "cpk" in asked else (
            table["reliability"]["reliability"] >= value).all()  # fmt: skip
        if good:
            costs[choice] = sum(prices[name] / half for name, half in halves.items())
    best = min(costs, key=lambda choice: costs[choice])
    assert tuple(chosen(result)[name] for name in prices) == best


def test_eight_lengths_in_eight_grades_are_the_cheapest_of_all() -> None:
    """Of a sum the squares are added: dynamic programming over them finds the optimum."""
    sizes = [40.0, 60.0, 100.0, 41.0, 61.0, 101.0, 42.0, 62.0]
    prices = [1.0, 0.3, 2.0, 0.8, 1.7, 0.9, 1.1, 0.6]
    names = "abcdefgh"
    parameters = ", ".join(f"{name}: {size}" for name, size in zip(names, sizes, strict=True))
    text = SUM.replace("a: 40, b: 60, c: 100", parameters).replace("a + b - c", " + ".join(names) + " - 400")
    text = text.replace("a: 0.05, b: 0.05, c: 0.05, travel: 0.02", ", ".join(f"{name}: 0.05" for name in names))
    cost = ", ".join(f"{name}: {price}" for name, price in zip(names, prices, strict=True))
    result = ask(text, f"reliability.allocate={{cpk: 1.33, grades: true, cost: {{{cost}}}}}")
    # Squares of half the tolerances in units of a quarter of a square micrometre.
    most = int((0.12 / 1.33) ** 2 * 4e6)
    best = np.zeros(most + 1)
    for size, price in zip(sizes, prices, strict=True):
        halves = np.array(HALVES[int(round(size, -1) if size < 50 else (60 if size < 80 else 100))])
        steps = np.rint(halves**2 * 4e6).astype(int)
        options = np.full((8, most + 1), np.inf)
        for row, step, half in zip(options, steps, halves, strict=True):
            if step <= most:
                row[step:] = best[: most + 1 - step] + price / half
        best = options.min(axis=0)
    assert np.sum(result.tables["allocation"]["cost_allocated"]) == pytest.approx(best[-1])
    assert not any("not all choices" in note for note in map(str, result.warnings))


def test_the_study_that_is_written_has_the_classes(tmp_path: Path) -> None:
    (tmp_path / "sum.yaml").write_text(SUM + "  allocate: {cpk: 1.33, grades: true}\n")
    result = mechdesign.reliability(mechdesign.load(tmp_path / "sum.yaml"))
    found = chosen(result)
    text = result.files["allocated.yaml"]
    again = mechdesign.load(text=text)
    for name in "abc":
        assert f'{name}: "{found[name].replace("IT", "js")}",' in text
    table = mechdesign.reliability(again).tables["capability"]
    analytic = table["method"] == "analytic"
    assert (table["cpk"][analytic] >= 1.33).all()


def test_a_cpk_in_any_numbers_is_reached_exactly() -> None:
    result = ask(SUM, "reliability.allocate={cpk: 1.33}", "reliability.limits={B.x: [-0.1, 0.3]}")
    confirmation = result.tables["confirmation"]
    assert confirmation["analytic"] == pytest.approx([1.33], rel=1e-5)
    assert confirmation["analytic"] >= 1.33
    assert confirmation["low"] < 1.33 < confirmation["high"]
    assert confirmation["asked"] == 1.33
    # Alike in cost and influence: alike, beside the motor that costs the same.
    assert result.tables["allocation"]["allocated"] == pytest.approx([3 * 0.1 / (3 * 1.33) / 2] * 4, rel=1e-4)


@pytest.mark.slow
def test_every_output_at_every_pose_has_the_cpk() -> None:
    result = ask(PLANE, "reliability.allocate={cpk: 1.33}", "reliability.limits={P.x: 0.08, T.y: 0.1}")
    again = mechdesign.load(text=result.files["allocated.yaml"])
    cpk = mechdesign.reliability(again).tables["capability"]["cpk"]
    assert cpk.min() == pytest.approx(1.33, rel=1e-5)
    assert cpk.min() >= 1.33


@pytest.mark.slow
def test_simulation_corrects_grades_too() -> None:
    """A uniform deviation has no tails: it may reach to the limit, and by the normal model to half of it."""
    uniform = SUM.replace("a: 0.05, b: 0.05, c: 0.05, travel: 0.02", "a: {tolerance: 0.05, distribution: uniform}")
    result = ask(uniform, "reliability.allocate={reliability: 0.999, grades: true}", "reliability.limits={B.x: 0.055}")
    assert chosen(result) == {"a": "IT10"}
    assert result.tables["confirmation"]["met"].all()


def test_what_the_finest_grades_do_not_reach_is_told() -> None:
    result = ask(SUM, "reliability.allocate={cpk: 1.33, grades: [IT10, IT11]}", "reliability.limits={B.x: 0.05}")
    assert "a Cpk of 1.33 cannot be reached" in result.failed
    assert "with all tolerances in their finest grades" in result.failed
    assert "allocation" not in result.tables


@pytest.mark.slow
@pytest.mark.parametrize(("overrides", "message"), [
    (["reliability.allocate={cpk: 1.33, reliability: 0.9}"], "either a 'reliability' or a 'cpk'; reliability and cpk"),
    (["reliability.allocate={grades: true}"], "either a 'reliability' or a 'cpk'"),
    (["reliability.allocate={cpk: 0}"], "must be positive, not 0"),
    (["reliability.allocate={cpk: 1, grades: [IT19]}"], "expected true, or grades from IT1 to IT18"),
    (["reliability.allocate={cpk: 1, grades: [h7]}"], "not 'h7'"),
    (["reliability.allocate={cpk: 1, grades: true}", "units.length=dimensionless"], "lengths are dimensionless"),
    (["reliability.allocate={cpk: 1, grades: true, cost: {wrist.angle: 1}}"],
     "has no grade: it is no length, and grades are of lengths; leave it out, and it is held"),
    (["reliability.allocate={cpk: 1, grades: true, cost: {one: 1}}", "mechanism.parameters.one=4000",
      "mechanism.sketch={E: [3200, 2400], P: [3240, 2350]}"], "up to 3150 mm, not of 4000 mm"),
    (["reliability.allocate={cpk: 1, grades: true}", "reliability.dimensions={theta1: 0.1}"],
     "nothing to allocate: no dimension is a length with a tolerance"),
    (["reliability.allocate={cpk: 1}", "reliability.limits={T: {radius: 0.1}}"],
     "a circle has no Cpk; limit T.x and T.y"),
])  # fmt: skip
def test_what_cannot_be_asked(overrides: list[str], message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(PLANE, "reliability.limits={P.x: 0.08}", *overrides)
