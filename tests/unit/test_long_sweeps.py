"""Motions of more poses than are held at once: the same tables as of those that are, in memory that hardly grows."""

from __future__ import annotations

import shutil
import sys
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from helpers.memory import peak_of
from helpers.studies import study_of

import mechdesign
from mechdesign.door.report.requirements import requirements
from mechdesign.door.report.tables import csv_blocks
from mechdesign.ground.errors import OutputError
from mechdesign.ground.long_tables import LongTable
from mechdesign.ground.results import Result
from mechdesign.motion import passage, solving
from mechdesign.questions.kinematics import remarks

# Every table with a row a pose, limits between the poses, poses that fail, targets and requirements of their errors.
FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, 30]
    rod: {from: A, to: B, length: 90, points: {P: [40, 30]}}
    rocker: [D, B, 60]
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
  limits: [{angle: [ground, rocker], min: 80, max: 140}]
  targets: {P.x: "50*cos(crank)"}
kinematics:
  sweep: {crank: {from: 0, to: 1080, number: 721}}
  rates: {crank: 10 rad/s}
  outputs: [P, rocker.angle, B]
  jacobian: [rocker.angle]
  instant_centres: [[rod, ground], [crank, rocker]]
  loads: [{at: P, force: [10, 5]}]
requirements:
  - {result: kinematics.P.x_velocity, at_most: 281, abs: true, where: {valid: 1}}
  - {result: kinematics.P.y, at_least: 10, at_most: 71}
  - {result: kinematics.P.x_error, at_least: -10}
  - {result: kinematics.targets.rms, at_most: 1}
"""
# The path goes round the ground's pin: both drives are found, and turn on.
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, one: [O, A, 60], two: [A, P, 50]}
  drives: {a: {angle: one}, b: {angle: two}}
  sketch: {A: [40, 45], P: [80, 20]}
kinematics:
  path: {P: {arc: {center: [5, 5], radius: 80, from: 20, to: 700}, points: 300}}
  outputs: [P, a, b]
  rates: {P.x: 1, P.y: 2}
"""
GRID = """
mechanism:
  links: {ground: {O: [0, 0]}, one: [O, A, 100], two: [A, P, 80]}
  drives: {a: {angle: one}, b: {angle: two, from: one}}
kinematics:
  sweep: {a: {from: 0, to: 180, number: 13}, b: {from: 0, to: 300, number: 17}}
  outputs: [P, two.angle]
"""


def texts(result: Result) -> dict[str, str]:
    return {name: "".join(csv_blocks(table)) for name, table in result.tables.items()}


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (solving, passage, remarks):
        monkeypatch.setattr(module, "POSES_AT_ONCE", 50)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("text", "all_modes"), [(FOUR_BAR, True), (ARM, False), (GRID, False)], ids=["four_bar", "arm", "grid"]
)
def test_what_is_made_piece_by_piece_is_what_is_made_at_once(
    text: str, all_modes: bool, request: pytest.FixtureRequest
) -> None:
    study = study_of(text)
    whole = mechdesign.kinematics(study, all_modes=all_modes)
    request.getfixturevalue("at_once")
    long = mechdesign.kinematics(study, all_modes=all_modes)
    assert whole.seen.main is whole.main
    assert isinstance(long.main, LongTable)
    assert texts(long) == texts(whole)
    assert (long.warnings, long.counts) == (whole.warnings, whole.counts)
    assert requirements(study, long) == requirements(study, whole)


def test_a_long_table_is_read_as_any_other(request: pytest.FixtureRequest) -> None:
    study = study_of(GRID)
    whole = mechdesign.kinematics(study).main
    request.getfixturevalue("at_once")
    long = mechdesign.kinematics(study).main
    assert isinstance(long, LongTable)
    assert len(long) == len(whole) == 13 * 17
    assert list(long) == list(whole)
    assert np.array_equal(long["P.x"], whole["P.x"])
    some = np.array([200, 3, 3, 60])
    assert list(long.take(some)) == list(whole.take(some))
    assert list(long.take(whole.where(valid=True))) == list(whole)
    assert repr(long) == repr(whole)


@pytest.mark.slow
def test_extremes_of_rates_are_in_the_pictures(at_once: None) -> None:
    study = study_of(FOUR_BAR)
    result = mechdesign.kinematics(study)
    whole, seen = result.main, result.seen.main
    valid = whole["valid"]
    for name in ("P.x_velocity", "P.y_acceleration", "B.x", "crank_effort"):
        for extreme in (np.nanmin, np.nanmax):
            assert extreme(seen[name][seen["valid"]]) == extreme(whole[name][valid])


def test_the_room_that_tables_need_is_told_before_they_are_written(
    at_once: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = mechdesign.kinematics(study_of(GRID))
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**9, 10**9 - 1000, 1000))
    with pytest.raises(OutputError, match=r"the tables need about .* GB are free there"):
        result.save(tmp_path / "out", plots=False)
    assert not (tmp_path / "out" / "motion.csv").exists()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(10**9, 0, 10**9))
    result.save(tmp_path / "out", plots=False)
    assert len((tmp_path / "out" / "motion.csv").read_text().splitlines()) == 13 * 17 + 1


@pytest.mark.nightly
def test_a_pose_more_takes_a_few_bytes(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text("""
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [0, 30], B: [75, 55]}
""")

    def peak(number: int) -> int:
        override = f"kinematics.sweep.crank={{from: 0, to: 360, number: {number}}}"
        command = [sys.executable, "-m", "mechdesign", "kinematics", str(study), "--set", override]
        return peak_of([*command, "--no-plots", "--quiet", "--jobs", "1", "--out", str(tmp_path / "out")])

    # Held whole, with what was made of them, the ten columns took 480 bytes.
    assert peak(340_000) - peak(140_000) < 100 * 200_000
