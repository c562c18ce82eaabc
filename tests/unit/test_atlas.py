"""Workspaces whose inverse problem has no closed form, beside the same ones that have one."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.stiffness import FIVE_BAR
from helpers.studies import study_of

import mechdesign
from mechdesign.questions.poses import study_poses
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.index import prepare
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH
from mechdesign.study.designs import variant

# A platform on three legs, each a crank and a rod; its angle is asked for as it is, or by a measure.
PLATFORM = """
units: {{length: m, angle: rad}}
mechanism:
  parameters: {{crank: 0.4, rod: 0.3}}
  links:
    ground: {{A1: [0, 0], A2: [1, 0], A3: [0.5, 0.9]}}
    crank_1: [A1, D1, crank]
    crank_2: [A2, D2, crank]
    crank_3: [A3, D3, crank]
    rod_1: [D1, B1, rod]
    rod_2: [D2, B2, rod]
    rod_3: [D3, B3, rod]
    platform: {{P: [0, 0], B1: [-0.15, -0.1], B2: [0.15, -0.1], B3: [0, 0.2]}}
  drives: {{q1: {{angle: crank_1}}, q2: {{angle: crank_2}}, q3: {{angle: crank_3}}}}
  measures: {{arc: "0.2*platform.angle", lead: "B3.x"}}
  sketch:
    {{P: [0.5, 0.34], B1: [0.35, 0.24], B2: [0.65, 0.24], B3: [0.5, 0.54], D1: [0.36, -0.05], D2: [0.9, 0.38],
     D3: [0.3, 0.7]}}
workspace: {{point: P, at: {{{held}}}, assembly: {assembly}, characteristic_length: 0.2}}
"""
BASES = (0, 1, 0.5 + 0.9j)
CORNERS = (-0.15 - 0.1j, 0.15 - 0.1j, 0.2j)
ANGLE = 0.35
BY_ANGLE, BY_MEASURE = f"platform.angle: [{ANGLE}]", f"arc: [{0.2 * ANGLE!r}]"


def reached(lead: float, crank: float = 0.4, rod: float = 0.3) -> float:
    """Area in which all legs close with B3 at x = lead: the platform's angle depends on the point's x alone."""
    x = np.linspace(lead - 0.2, lead + 0.2, 400_001)
    turn = np.sqrt(1 - ((x - lead) / 0.2) ** 2) + 1j * (x - lead) / 0.2
    low, high, met = np.full(x.shape, -np.inf), np.full(x.shape, np.inf), np.ones(x.shape, dtype=bool)
    holes = []
    for base, corner in zip(BASES, CORNERS, strict=True):
        centre = base - turn * corner
        far, near = ((crank + sign * rod) ** 2 - (x - centre.real) ** 2 for sign in (1, -1))
        met &= far > 0
        half, hole = (np.sqrt(np.maximum(square, 0.0)) for square in (far, near))
        low, high = np.maximum(low, centre.imag - half), np.minimum(high, centre.imag + half)
        holes.append((centre.imag - hole, centre.imag + hole))
    met &= high > low
    # Where holes overlap, as much as both cover counts once.
    ends = np.clip(np.stack([np.stack(hole) for hole in holes]), low, high)
    order = np.argsort(ends[:, 0], axis=0)
    begin, end = (np.take_along_axis(ends[:, side], order, axis=0) for side in (0, 1))
    taken, done = np.zeros(x.shape), low
    for first, last in zip(begin, end, strict=True):
        taken += np.maximum(last - np.maximum(first, done), 0.0)
        done = np.maximum(done, last)
    height = np.where(met, high - low - taken, 0.0)
    return float(np.sum(0.5 * (height[1:] + height[:-1]) * np.diff(x)))


@pytest.mark.nightly
@pytest.mark.parametrize("assembly", ["any", "same"])
def test_a_measure_equal_to_the_angle_gives_the_same_workspace(assembly: str) -> None:
    exact, found = (
        mechdesign.workspace(study_of(PLATFORM.format(held=held, assembly=assembly))) for held in (BY_ANGLE, BY_MEASURE)
    )
    for name in ("GII", "area", "box_area", "SUI"):
        assert found.main[name][0] == pytest.approx(exact.main[name][0], rel=1e-6), name
    ends = [
        {name: np.stack([table["x"], table["y"]], axis=-1)[table["at"] == name] for name in set(table["at"].tolist())}
        for table in (exact.tables["boundary"], found.tables["boundary"])
    ]
    assert ends[0].keys() == ends[1].keys()
    for name, places in ends[0].items():
        for end in (np.min, np.max):
            assert end(ends[1][name], axis=0) == pytest.approx(end(places, axis=0), abs=1e-6)


@pytest.mark.nightly
def test_designs_of_other_sizes_have_their_own_poses() -> None:
    """Together as alone, and as their closed form has it: also regions much larger than that of the sketch."""
    text = PLATFORM.format(held=BY_MEASURE, assembly="any")
    rods = np.array([0.25, 0.3, 0.45])
    (question,) = questions(study_of(text), columns=("area", "GII"))
    places = {f"rod_{k}.length": rods for k in (1, 2, 3)}
    together = answer(question, places, 3, BATCH)
    (closed,) = questions(study_of(PLATFORM.format(held=BY_ANGLE, assembly="any")), columns=("area", "GII"))
    exact = answer(closed, places, 3, BATCH)
    for k, rod in enumerate(rods.tolist()):
        (own,) = questions(study_of(text, f"mechanism.parameters.rod={rod}"), columns=("area", "GII"))
        alone = answer(own, {}, 1, BATCH)
        for name in ("area", "GII"):
            assert together.values[name][k] == pytest.approx(alone.values[name][0], rel=1e-6)
            assert together.values[name][k] == pytest.approx(exact.values[name][k], rel=1e-6)


def test_fold_distance_is_linear_through_a_fold() -> None:
    """With B3.x held the angle has a fold where P.x is 0.2 beside it: squared determinant 0.2^2 - (x - lead)^2."""
    lead = 0.45
    (question,) = questions(study_of(PLATFORM.format(held=f"lead: [{lead}]", assembly="any")), columns=("area",))
    x = lead - 0.2 + np.array([-1e-4, -1e-5, -1e-8, 1e-8, 1e-5, 1e-3, 0.05, 0.2])
    margins = question.field.margins(x + 0.34j, {})
    fold_distance = margins[[label for _, label in question.field.labels].index("continuation")]
    assert fold_distance[3:] == pytest.approx(0.04 - (x[3:] - lead) ** 2, rel=1e-7)
    assert fold_distance[:3] == pytest.approx(0.4 * (x[:3] - lead + 0.2), rel=2e-3)
    # Before it the pose is exact; all margins are known on both sides.
    turn = question.field.configuration(x + 0.34j, {}).rotation("platform")
    assert turn[3:].imag == pytest.approx((x[3:] - lead) / 0.2, abs=1e-9)
    assert np.isnan(turn[:3]).all()
    assert np.isfinite(margins).all()


@pytest.mark.nightly
def test_a_region_between_folds_has_its_area() -> None:
    (question,) = questions(study_of(PLATFORM.format(held="lead: [0.45]", assembly="any")), columns=("area",))
    found = answer(question, {}, 1, BATCH)
    assert found.values["area"][0] == pytest.approx(reached(0.45), rel=1e-6)


@pytest.mark.slow
def test_region_of_a_design_that_does_not_close_where_the_sketch_is_drawn() -> None:
    """With so short cranks the point cannot be where it is drawn; by the platform's angle there is a closed form."""
    far = (
        "mechanism.sketch={P: [0.8, 0.16], B1: [0.69338, 0.01463], B2: [0.9752, 0.1175], B3: [0.73142, 0.34787], "
        "D1: [0.39814, -0.03856], D2: [1.1142, 0.38335], D3: [0.47338, 0.50089]}"
    )
    areas = []
    for held in (BY_ANGLE, BY_MEASURE):
        study = variant(study_of(PLATFORM.format(held=held, assembly="any"), far), {"crank": 0.16})
        (question,) = questions(study, columns=("area",))
        areas.append(answer(question, {}, 1, BATCH).values["area"][0])
    assert areas[0] > 0.008
    assert areas[1] == pytest.approx(areas[0], rel=1e-4)


@pytest.mark.nightly
def test_a_map_over_the_workspace_counts_the_deflection() -> None:
    """The indices of the workspace say what the question itself says at its nodes."""
    text = (
        FIVE_BAR.replace("  poses: [{P.x: 0.05, P.y: 0.45}]\n", "")
        + """
workspace: {point: P, scan: {about: [0, 0.45], rays: 12}}
reliability:
  dimensions: {load.fy: {sigma: 5}, b1.length: 1e-4}
  poses: workspace
  outputs: [P]
  limits: {P.y: 2e-3}
  load: [0, -20]
  methods: analytic
"""
    )
    study = study_of(text)
    poses = study_poses(study, "reliability")
    place = poses.values["P.x"] + 1j * poses.values["P.y"]
    found = Local.at(questions(study)[0].field, place, {})
    sigma, chance = (np.asarray(index.values(found)) for index in prepare(study, ["sigma_position", "reliability"]))
    result = mechdesign.reliability(study)
    moments = result.tables["moments"]
    x, y = (moments["sigma"][moments.where(output=f"P.{axis}")] for axis in "xy")
    assert sigma == pytest.approx(np.hypot(x, y), rel=1e-6)
    told = result.tables["reliability"]
    expected = told["reliability"][told["scope"] == "pose"]
    assert chance == pytest.approx(expected, abs=1e-8)
    assert expected.min() < 0.99
