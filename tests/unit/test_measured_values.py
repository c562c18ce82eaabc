"""Dimensions that vary as measured parts do, read from a file beside the study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import mechdesign

VALUES = np.round(100.02 + 0.05 * np.random.default_rng(5).standard_normal(30), 3)
STUDY = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  poses: [{theta: 60}]
  outputs: [P.x]
  limits: {P.x: 0.1}
  methods: [analytic, monte_carlo]
"""


def write(folder: Path, text: str, name: str = "levers.csv") -> None:
    (folder / name).write_text(text)


def column(values: Sequence[object] | np.ndarray, name: str = "length") -> str:
    return f"part;{name};note\n" + "".join(f"L{k};{value};good\n" for k, value in enumerate(values))


def load(folder: Path, *lines: str, more: str = "", overrides: Sequence[str] = ()) -> mechdesign.Study:
    file = folder / "study.yaml"
    file.write_text(STUDY + "".join(f"  {line}\n" for line in lines) + more)
    return mechdesign.load(file, overrides)


def test_measured_lengths_give_mean_and_deviation_of_the_output(tmp_path: Path) -> None:
    write(tmp_path, column(VALUES))
    study = load(tmp_path, "dimensions: {lever.length: {measured: levers.csv, column: length}}")
    moments = mechdesign.reliability(study).tables["moments"]
    analytic = moments.where(method="analytic")
    assert moments["mean"][analytic] == pytest.approx(0.5 * VALUES.mean(), rel=1e-12)
    assert moments["sigma"][analytic] == pytest.approx(0.5 * VALUES.std(ddof=1), rel=1e-9)
    assert moments["sigma"][~analytic] == pytest.approx(0.5 * VALUES.std(ddof=1), rel=0.02)


def test_deviations_say_so_and_angles_are_in_the_studys_unit(tmp_path: Path) -> None:
    write(tmp_path, "# of the drive\n" + "".join(f"{value}\n" for value in VALUES - 100.0))
    study = load(
        tmp_path, "dimensions: {theta: {measured: levers.csv}, lever.length: {measured: levers.csv, nominal: 0}}",
        overrides=["mechanism.measures={far: {distance: [O, P]}}", "reliability.outputs=[lever.angle, far]",
                   "reliability.limits={far: 1}", "reliability.methods=[analytic]"],
    )  # fmt: skip
    moments = mechdesign.reliability(study).tables["moments"]
    assert moments["mean"] - [60, 100] == pytest.approx([VALUES.mean() - 100] * 2)
    assert moments["sigma"] == pytest.approx([VALUES.std(ddof=1)] * 2)


def test_measured_values_are_correlated_with_others(tmp_path: Path) -> None:
    write(tmp_path, column(VALUES))
    study = load(
        tmp_path, "dimensions: {lever.length: {measured: levers.csv, column: length}, theta: 0.1}",
        "correlation: [[lever.length, theta, 0.6]]", "samples: 100000",
    )  # fmt: skip
    # P.x = l cos(theta): with small deviations the variance of a sum.
    along, across = 0.5 * VALUES.std(ddof=1), -100 * np.sin(np.radians(60)) * np.radians(0.1 / 3)
    moments = mechdesign.reliability(study).tables["moments"]
    variance = moments["sigma"][moments.where(method="monte_carlo")] ** 2
    assert (variance - along**2 - across**2) / (2 * along * across) == pytest.approx([0.6], abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "asked", "message"),
    [
        (None, "column: length", "cannot be read: No such file"),
        (column(VALUES), "column: width", "has no column 'width' among the 3 of its first line"),
        (column(VALUES), "", "has 3 columns: say by 'column' which one"),
        (column(VALUES), "column: note", "levers.csv:2: the line has no finite number of column 'note'"),
        ("nan\n" + "100\n" * 12, "", "levers.csv:1: the line has no finite number"),
        ("length\n100,1\n", "", "levers.csv:2: the line has no finite number"),
        (column(["100,1"] * 12), "column: length", "'length'; a decimal is written with a point"),
        (column(VALUES[:9]), "column: length", "9 measured values are too few: give 10 or more"),
        (column([100.1] * 12), "column: length", "all 12 measured values are 100.1: nothing varies"),
        (column(VALUES - 100), "column: length", "where they are deviations, say 'nominal: 0'"),
        (column(VALUES), "column: length, distribution: normal", "leave 'distribution' out"),
    ],
)
def test_what_is_wrong_with_measured_values_is_said_at_once(
    tmp_path: Path, text: str | None, asked: str, message: str
) -> None:
    if text is not None:
        write(tmp_path, text)
    with pytest.raises(mechdesign.StudyError, match=f"study.yaml:11:.*{message}"):
        load(tmp_path, f"dimensions: {{lever.length: {{measured: levers.csv{', ' * bool(asked)}{asked}}}}}")


@pytest.mark.slow
def test_designs_need_to_know_what_measured_values_deviate_from(tmp_path: Path) -> None:
    write(tmp_path, column(VALUES))
    optimize = """
optimize:
  variables: {lever.length: {from: 90, to: 110, number: 3}}
  minimize: [reliability.moments.sigma]
"""
    with pytest.raises(mechdesign.StudyError, match=r"optimize changes 'lever.length': say by 'nominal'"):
        load(tmp_path, "dimensions: {lever.length: {measured: levers.csv, column: length}}", more=optimize)
    study = load(
        tmp_path, "dimensions: {lever.length: {measured: levers.csv, column: length, nominal: 100}}",
        more=optimize.replace("moments.sigma", "moments.mean"),
    )  # fmt: skip
    result = mechdesign.optimize(study)
    best = result.tables["optimum"]
    assert best["lever.length"] == 90.0
    assert best["reliability.moments.mean"] == pytest.approx(0.5 * (90.0 + VALUES.mean() - 100.0), rel=1e-3)
    assert result.files["input_levers.csv"] == column(VALUES)


@pytest.mark.slow
def test_allocated_tolerances_leave_measured_values_as_they_are(tmp_path: Path) -> None:
    write(tmp_path, column(VALUES))
    dimensions = "dimensions: {lever.length: {measured: levers.csv, column: length}, theta: 0.03}"
    result = mechdesign.reliability(load(tmp_path, dimensions, "allocate: {reliability: 0.99}", "samples: 2000"))
    table = result.tables["allocation"]
    assert table["kind"].tolist() == ["measured", "tolerance"]
    assert [table["given"][0], table["allocated"][0]] == pytest.approx([VALUES.std(ddof=1)] * 2)
    assert "measured: input_levers.csv" in result.files["allocated.yaml"].replace('"', "")
    assert result.files["input_levers.csv"] == column(VALUES)
    with pytest.raises(mechdesign.StudyError, match="what is measured is held as it is"):
        load(tmp_path, dimensions, "allocate: {reliability: 0.99, cost: {lever.length: 2}}")


def test_a_beta_law_needs_its_shape_and_its_tolerance() -> None:
    for given, message in (
        ("{tolerance: [-0.1, 0.3], distribution: beta}", "'distribution: beta' and its 'shape', such as"),
        ("{tolerance: [-0.1, 0.3], shape: [2, 5]}", "'distribution: beta' and its 'shape', such as"),
        ("{sigma: 0.1, distribution: beta, shape: [2, 5]}", "lies between two ends: give 'tolerance'"),
        ("{tolerance: 0.1, distribution: beta, shape: [2, 0]}", "must be positive, not 0"),
    ):
        with pytest.raises(mechdesign.StudyError, match=message):
            mechdesign.load(text=STUDY + f"  dimensions: {{lever.length: {given}}}\n")


def test_a_beta_law_leans_the_mean_to_its_shape() -> None:
    """Mean a/(a + b) and variance a b/((a + b)^2 (a + b + 1)) of the tolerance's width."""
    given = "  dimensions: {lever.length: {distribution: beta, tolerance: [-0.1, 0.3], shape: [2, 5]}}\n"
    moments = mechdesign.reliability(mechdesign.load(text=STUDY + given)).tables["moments"]
    analytic = moments.where(method="analytic")
    sigma = 0.5 * 0.4 * np.sqrt(10.0 / (49.0 * 8.0))
    assert moments["mean"][analytic] == pytest.approx(50.0 + 0.5 * (-0.1 + 0.4 * 2.0 / 7.0), rel=1e-12)
    assert moments["sigma"] == pytest.approx([sigma, sigma], rel=0.02)
    assert moments["sigma"][analytic] == pytest.approx(sigma, rel=1e-9)
