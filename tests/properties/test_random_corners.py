"""Random motions whose loads, couplings and measures have corners, however narrow, against many poses of closed forms.

Extremes and their places, means and roots of mean squares, one-sided velocities at jumps, and gates a millionth beside
the worst value. The models of `helpers.corner_motions` share nothing with the package.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from helpers.corner_motions import Case, coupled_by_table, dynamic, kinematic, path
from helpers.corners import STATISTICS, Found
from helpers.evidence import rows_beyond
from helpers.studies import study_of

import mechdesign

# Of the largest magnitude of a column.
WITHIN = 1e-6
# Of the length of a motion: looks at both sides of a place at which a column may jump.
BESIDE = np.array([-1e-8, -1e-9, -1e-10, -1e-11, -1e-12, 0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8])
Gate = tuple[str, float, bool]


def gates_of(case: Case, found: dict[str, Found], rng: np.random.Generator) -> list[Gate]:
    """Random bounds a little beside what each column comes to: the line of a study, the value, whether it is met."""
    gates = []
    for column, course in found.items():
        if column in case.loose:
            continue
        # The magnitude of the shaking force has no column of its own.
        form = "table" if column == "shaking" else str(rng.choice(["plain", "table", *STATISTICS]))
        upper, inside = bool(rng.random() < 0.5), bool(rng.random() < 0.5)
        value = STATISTICS[form](course) if form in STATISTICS else course.high if upper else course.low
        little = 2 * WITHIN * size_of(course)
        bound = value + little * (1 if upper == inside else -1)
        name = {"plain": column, "table": f"extremes.{column}.{'max' if upper else 'min'}"}.get(
            form, f"{column}.{form}"
        )
        where = ""
        if form == "plain" and column.endswith("_force"):
            # Of the table with a row for every joint and pose.
            name, where = "magnitude", f", where: {{joint: {column.removesuffix('_force')}}}"
        line = f"  - {{result: {case.command}.{name}{where}, {'at_most' if upper else 'at_least'}: {bound!r}}}\n"
        gates.append((line, value, inside))
    return gates


def size_of(found: Found) -> float:
    """The largest magnitude of a column; what is nowhere more than rounding counts as a thousandth."""
    return max(found.peak, -found.low, 1e-3)


def check(case: Case, seed: int, poses: int) -> None:
    wrong = faults(case, seed, poses)
    assert not wrong, "\n".join([f"seed {seed}:", *wrong, case.text])


def faults(case: Case, seed: int, poses: int) -> list[str]:
    """What a study says of its motion, and closed forms at many poses do not."""
    found = case.scanned(poses)
    gates = gates_of(case, found, np.random.default_rng(seed))
    study = study_of(case.text + "requirements:\n" + "".join(line for line, *_ in gates))
    result = getattr(mechdesign, case.command)(study)
    table = result.tables["extremes"]
    wrong = [f"row beyond extremes: {fault}" for fault in rows_beyond(result)]
    names = [str(name) for name in table["output"]]
    assert {*found} <= {*names}, case.text
    for row, name in enumerate(names):
        if name in case.loose:
            continue
        course, size = found[name], size_of(found[name])
        for end, value, sign in (("min", course.low, -1), ("max", course.high, 1)):
            told, place = float(table[end][row]), float(table[f"{end}_at"][row])
            # As far as the poses saw, and no farther than the column goes at that very place, on one of its sides.
            if not sign * told >= sign * value - WITHIN * size:
                wrong.append(f"{name} {end}: {told!r} is not {value!r}")
                continue
            if np.isnan(place):
                # What is the same all along the motion has no place of its extremes; what is rounding is 0.
                same = 0.0 if max(abs(course.low), abs(course.high)) <= WITHIN * size else value
                if course.range > WITHIN * size or abs(told - same) > WITHIN * abs(same):
                    wrong.append(f"{name} {end}: {told!r} has no place")
                continue
            sides = case.place(place) + (case.high - case.low) * BESIDE
            there = np.broadcast_to(case.course(np.clip(sides, case.low, case.high))[name], sides.shape)
            if not sign * told <= np.max(sign * there) + WITHIN * size:
                wrong.append(f"{name} {end}: {told!r} is not reached at {place!r}: {there.tolist()}")
        for statistic in {"mean", "rms"} & {*table.names}:
            told, value = float(table[statistic][row]), getattr(course, statistic)
            if not abs(told - value) <= WITHIN * size:
                wrong.append(f"{name} {statistic}: {told!r} is not {value!r}")
    for (line, value, met), verdict in zip(gates, mechdesign.requirements(study, result), strict=True):
        if verdict.met != met:
            wrong.append(f"gate: {verdict}, but it is {value!r}:{line.rstrip()}")
    return wrong


MAKERS = (kinematic, path, dynamic, coupled_by_table)


@pytest.mark.parametrize("make", MAKERS)
def test_narrow_loads_measures_and_couplings_of_a_motion_are_seen(make: Callable[[int], Case]) -> None:
    check(make(0), 0, 20_001)


@pytest.mark.nightly
@pytest.mark.parametrize("make", MAKERS)
def test_narrow_loads_measures_and_couplings_of_three_hundred_motions_are_seen(make: Callable[[int], Case]) -> None:
    for seed in range(100, 175):
        check(make(seed), seed, 200_001)
