"""Gates along random motions: none is met by a mechanism that violates it between the poses.

Every motion is scanned at 20,000 poses by circles that are cut in `helpers.linkages`, or, where loads, couplings and
measures have corners, by the closed forms of `helpers.corner_motions`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from helpers.corner_motions import Case, coupled_by_table, dynamic, kinematic, path
from helpers.corners import STATISTICS, scanned
from helpers.linkages import FiveBar, FourBar, Path, cut, swept
from helpers.studies import study_of

import mechdesign

Seeds = Callable[[int], Iterator[int]]
# Columns that may run to infinity, where a scan sees large numbers only.
ENDLESS = ("q1_effort", "q2_effort", "crank_effort")


def check(rng: np.random.Generator, text: str, scan: dict[str, np.ndarray]) -> None:
    """Random gates on every column, on the extremes' table and on the column itself."""
    lost = np.isnan(next(iter(scan.values())))
    if lost.all():
        return
    wanted = []
    for name, values in scan.items():
        low, high = np.nanmin(values), np.nanmax(values)
        for upper in (True, False):
            part = float(rng.uniform(-0.1, 0.3))
            bound = high - part * (high - low) if upper else low + part * (high - low)
            if rng.random() < 0.5:
                result = f"kinematics.{name}"
            else:
                result = f"kinematics.extremes.{name}.{'max' if upper else 'min'}"
            wanted.append((name, upper, bound, result))
    lines = [f"  - {{result: {r}, {'at_most' if upper else 'at_least'}: {float(b)!r}}}" for _, upper, b, r in wanted]
    study = study_of(text + "requirements:\n" + "\n".join(lines) + "\n")
    try:
        result = mechdesign.kinematics(study)
    except mechdesign.ground.errors.AssemblyError:
        assert lost.any()
        return
    for (name, upper, bound, _), verdict in zip(wanted, mechdesign.requirements(study, result), strict=True):
        values = scan[name]
        beyond = np.nanmax(values) - bound if upper else bound - np.nanmin(values)
        size = max(1.0, float(np.nanmax(np.abs(values))))
        if beyond > 1e-9 * size or (~lost & (np.abs(values) > 1e15)).any():
            assert not verdict.met, (str(verdict), beyond, text)
        gap = np.count_nonzero(lost) > 2
        if gap:
            assert not verdict.met, (str(verdict), text)
        elif not lost.any() and beyond < -1e-3 * size and name not in ENDLESS:
            assert verdict.met, (str(verdict), beyond, text)


def test_gates_along_paths_of_five_bars(seeds: Seeds) -> None:
    for seed in seeds(20):
        rng = np.random.default_rng([seed, 1])
        robot = FiveBar(rng)
        path = Path(rng, robot.drawn)
        check(rng, robot.text() + f"  path: {{C: {path.text}}}\n", robot.along(path.places))


def test_gates_along_sweeps_of_four_bars(seeds: Seeds) -> None:
    for seed in seeds(25):
        rng = np.random.default_rng([seed, 2])
        bar = FourBar(rng, six=bool(rng.random() < 0.4))
        low, high, step = swept(rng, bar.drawn)
        count = round((high - low) / step) + 1
        scan = bar.measured(np.linspace(low, low + step * (count - 1), 20_001))
        scan.pop("transmission")
        scan.pop("P.y_error")
        sweep = f"{{crank: {{from: {low!r}, to: {high!r}, step: {step!r}}}}}"
        outputs = "[P, gap, F]" if bar.six else "[P, gap]"
        check(rng, f"{bar.text()}kinematics:\n  sweep: {sweep}\n  outputs: {outputs}\n", scan)


def parts_of(case: Case, rng: np.random.Generator) -> list[tuple[str, float, float]]:
    """The whole motion, and a part of one that is swept or over time: a condition of a requirement, and its ends."""
    found = [("", case.low, case.high)]
    name = "time" if "motion: {crank" in case.text else "crank" if "sweep:" in case.text else ""
    if name:
        low, high = np.sort(rng.uniform(case.low, case.high, 2)).tolist()
        if high - low > 0.05 * (case.high - case.low):
            found.append((f", where: {{{name}: {{from: {low!r}, to: {high!r}}}}}", low, high))
    return found


def check_beside(case: Case, rng: np.random.Generator) -> None:
    """Random statistics of columns, and bounds that these miss or keep by a millionth of the column."""
    lines, wanted = [], []
    for where, low, high in parts_of(case, rng):
        breaks = tuple(place for place in case.breaks if low < place < high)
        for column, found in scanned(case.course, low, high, 20_001, breaks).items():
            if column in case.loose or column == "shaking":
                continue
            word, upper, met = str(rng.choice([*STATISTICS])), bool(rng.random() < 0.5), bool(rng.random() < 0.5)
            value = STATISTICS[word](found)
            bound = value + 2e-6 * max(found.peak, -found.low, 1e-3) * (1 if upper == met else -1)
            result = f"result: {case.command}.{column}.{word}{where}"
            lines.append(f"  - {{{result}, {'at_most' if upper else 'at_least'}: {bound!r}}}\n")
            wanted.append((value, met))
    study = study_of(case.text + "requirements:\n" + "".join(lines))
    verdicts = mechdesign.requirements(study, getattr(mechdesign, case.command)(study))
    for (value, met), verdict in zip(wanted, verdicts, strict=True):
        assert verdict.met == met, (str(verdict), value, case.text)


@pytest.mark.parametrize("make", [kinematic, path, dynamic, coupled_by_table])
def test_gates_a_millionth_beside_what_motions_with_corners_come_to(make: Callable[[int], Case], seeds: Seeds) -> None:
    for seed in seeds(30):
        check_beside(make(10_000 + seed), np.random.default_rng([seed, 3]))


@pytest.mark.parametrize("lean", [0.0, 1.0, -1.0])
def test_a_line_through_a_forward_singularity_is_never_green(lean: float) -> None:
    """Where A, C and B lie in line, at about y = 33, the motors hold nothing: their moments are infinite."""
    a = complex(cut(-50 + 0j, 60, np.array(80j), 100, 1))
    text = f"""
mechanism:
  links:
    ground: {{O1: [-50, 0], O2: [50, 0]}}
    l: [O1, A, 60]
    lr: [A, C, 100]
    r: [O2, B, 60]
    rr: [B, C, 100]
  drives: {{q1: {{angle: l}}, q2: {{angle: r}}}}
  sketch: {{A: [{a.real}, {a.imag}], B: [{-a.real}, {a.imag}], C: [0, 80]}}
kinematics:
  path: {{C: {{line: [[0, 80], [{lean}, 15]], points: 72}}}}
  loads: [{{at: C, force: [0, -10]}}]
requirements:
"""
    for name in ("kinematics.extremes.q1_effort.max", "kinematics.q1_effort"):
        text += f"  - {{result: {name}, at_most: 1e9}}\n"
        text += f"  - {{result: {name.replace('max', 'min')}, at_least: -1e9}}\n"
    study = study_of(text)
    result = mechdesign.kinematics(study)
    verdicts = mechdesign.requirements(study, result)
    assert [verdict.met for verdict in verdicts] == [False] * 4
    limits = result.tables["limits"]
    assert limits["kind"].tolist() == ["singularity"]
    assert sorted(limits["joint"][0].split()) == ["A", "B", "C"]
    assert np.isinf(result.tables["extremes"]["max"]).any()
    assert any(words.startswith("the motion passes a singularity at ") for words in map(str, result.warnings))
