"""Workspaces that must contain a circle or a rectangle, and the worst of several held values, in an optimisation.

Against formulas of a two-link arm, whose region is the ring between |l1 - l2| and l1 + l2, against places sampled along
the outline, and against studies of single values.
"""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of
from scipy.optimize import brentq

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.ground.errors import StudyError
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.questions.optimize.question import designs_question
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.inscribed import crossed
from mechdesign.questions.workspace.question import questions
from mechdesign.region.growth import fitted
from mechdesign.region.rays import BATCH
from mechdesign.region.shapes import Shape

ARM = """
mechanism:
  parameters: {l1: 100, l2: 60}
  links: {ground: {O: [0, 0]}, upper: [O, A, l1], fore: [A, P, l2]}
  drives: {q1: {angle: upper}, q2: {angle: fore, from: upper}}
  sketch: {A: [80, 60], P: [80, 120]}
workspace: {point: P}
optimize:
  variables: {l1: {from: 60, to: 100, step: 10}, l2: {from: 50, to: 80, step: 15}}
  minimize: area
"""
RRR = """
mechanism:
  parameters: {base: 250, crank: 160, rod: 120, side: 60}
  links:
    ground: {O1: [-base*cos(30), -base/2], O2: [base*cos(30), -base/2], O3: [0, base]}
    crank_1: [O1, A1, crank]
    crank_2: [O2, A2, crank]
    crank_3: [O3, A3, crank]
    rod_1: [A1, C1, rod]
    rod_2: [A2, C2, rod]
    rod_3: [A3, C3, rod]
    platform: {C1: [-side*cos(30), -side/2], C2: [side*cos(30), -side/2], C3: [0, side], P: [0, 0]}
  drives: {q1: {angle: crank_1}, q2: {angle: crank_2}, q3: {angle: crank_3}}
  sketch: {A1: [-140, 8], A2: [63, -126], A3: [77, 118], C1: [-52, -30], C2: [52, -30], C3: [0, 60]}
workspace: {point: P, at: {platform.angle: 0}, scan: {about: [0, 0]}, assembly: any, characteristic_length: 60}
optimize:
  variables: {crank: {from: 150, to: 170, step: 10}}
  maximize: [area]
  subject_to: [{contains: {circle: 60, center: [0, 0]}}]
"""
CIRCLE = Shape(80, 80, round=True)
RECTANGLE = Shape(180, 90, round=False)


def scales(text: str, shape: Shape, *changes: str, places: dict[str, Floats] | None = None) -> Floats:
    """Scales that fit, of the study's own design or of several with other places."""
    (question,) = questions(study_of(text, *changes), columns=("area",))
    count = len(next(iter(places.values()))) if places else 1
    return fitted(shape, answer(question, places or {}, count, BATCH).panels)[0]


def ring_of_rectangle(width: float, height: float, inner: float, outer: float) -> float:
    """Scale of a rectangle with a side that touches the inner circle, and the far corners on the outer one."""
    return float(brentq(lambda s: np.hypot(s * width / 2, inner + s * height) - outer, 0, 100))


@pytest.mark.nightly
def test_largest_scale_of_a_free_circle_and_rectangle_in_a_ring() -> None:
    rng = np.random.default_rng(2)
    upper, fore = rng.uniform(60, 140, 12), rng.uniform(40, 100, 12)
    # A hole much smaller than any distance of rays.
    fore[0] = upper[0] - 0.3
    places = {"upper.length": upper, "fore.length": fore}
    assert scales(ARM, CIRCLE, places=places) == pytest.approx(np.minimum(upper, fore) / 40, rel=1e-6)
    ends = np.stack([np.abs(upper - fore), upper + fore], axis=1)
    wanted = [max(ring_of_rectangle(180, 90, *end), ring_of_rectangle(90, 180, *end)) for end in ends]
    assert scales(ARM, RECTANGLE, places=places) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "wanted"),
    [
        (Shape(60, 60, True, 100j), 2.0),
        (Shape(60, 60, True, 200j), -40 / 30),  # beyond the ring
        (Shape(60, 60, True, 10j), -1.0),  # in its hole
        (Shape(300, 1, False, 50j), brentq(lambda s: np.hypot(150 * s, 50 + 0.5 * s) - 160, 0, 9)),  # long and thin
        (Shape(40, 20, False, 100j), brentq(lambda s: np.hypot(20 * s, 100 + 10 * s) - 160, 0, 9)),
        (Shape(20, 40, False, 100 + 0j), brentq(lambda s: np.hypot(20 * s, 100 + 10 * s) - 160, 0, 9)),
    ],
)
def test_scale_about_a_given_centre(shape: Shape, wanted: float) -> None:
    assert scales(ARM, shape) == pytest.approx([wanted], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("apart", [0.3, 1.1, 2.57, 6.0])
def test_a_side_that_just_touches_a_small_hole(apart: float) -> None:
    """Between two rays the side was 1e-4 of its distance beyond the hole, and places looked at fell beside it."""
    places = {"upper.length": np.array([74.0]), "fore.length": np.array([74 + apart])}
    shape = Shape(135.4, 189.04, False, -10.77 + 54.86j)
    (found,) = scales(ARM, shape, "workspace.scan={about: [88.6, 2.27]}", places=places)
    assert found == pytest.approx((54.86 - apart) / 94.52, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("to", "centre", "wanted"),
    [(180, 100 + 20j, 2 / 3), (180, -100j, -1.0), (270, 100 + 20j, 2 / 3), (270, 100 - 20j, -2 / 3), (270, 100j, 2.0)],
)
def test_sides_of_a_scan_end_what_is_contained(to: float, centre: complex, wanted: float) -> None:
    (found,) = scales(ARM, Shape(60, 60, True, centre), f"workspace.scan={{about: [0, 0], from: 0, to: {to}}}")
    assert found == pytest.approx(wanted) if wanted > -1 else found < wanted


@pytest.mark.nightly
def test_outline_lies_inside_and_a_larger_one_does_not() -> None:
    study = study_of(RRR, "workspace.assembly=same")
    rng = np.random.default_rng(3)
    places = {name: rng.uniform(110, 150, 3) for name in ("rod_1.length", "rod_2.length", "rod_3.length")}
    (question,) = questions(study, columns=("area",))
    given = answer(question, places, 3, BATCH)
    theta = np.linspace(0, 2 * np.pi, 721)[:, None]
    for shape in (RECTANGLE, Shape(50, 90, False, 10 + 5j)):
        scale, placed = fitted(shape, given.panels)
        centre, outline = placed.centre, scale * shape.radius(theta) * np.exp(1j * theta)
        inside, *_ = given.panels.designs.look(centre + (1 - 1e-6) * outline, np.arange(3))
        assert inside.all()
        assert not given.panels.designs.look(centre + (1 + 1e-2) * outline, np.arange(3))[0].all(axis=0).any()


@pytest.mark.slow
def test_other_pieces_of_the_region_contain_nothing() -> None:
    """Two bands beside x from 0 to 0.5, the left one the sketch's."""
    text = """
    units: {length: dimensionless}
    mechanism:
      measures: {across: (C.x - 0.5)*C.x}
      links:
        ground: {B1: [1, 0], B2: [-1, 0]}
        leg_1: {from: B1, to: C, telescopic: true}
        leg_2: {from: B2, to: C, telescopic: true}
      drives: {l1: {length: leg_1}, l2: {length: leg_2}}
      limits: [{drive: l1, min: 0.2, max: 3}, {drive: l2, min: 0.2, max: 3}, {measure: across, min: 0}]
      sketch: {C: [-0.5, 1]}
    workspace: {point: C, scan: {about: [0, 0]}}
    """
    assert scales(text, Shape(0.4, 0.4, True, -0.5 + 1j)) == pytest.approx([2.5])
    assert scales(text, Shape(0.4, 0.4, True, 1 + 1j))[0] < 0
    assert scales(text, Shape(0.4, 0.4, True, 1 + 1j), "workspace.assembly=any") == pytest.approx([2.5])
    assert scales(text, Shape(0.4, 0.4, True, 0.25 + 1j)) == pytest.approx([-1.25])


@pytest.mark.nightly
def test_designs_are_feasible_where_the_workspace_contains_the_shape() -> None:
    shapes = "[{contains: {rectangle: [180, 90], center: free}}, {contains: {circle: 20, center: [0, 80]}}]"
    study = study_of(ARM, f"optimize.subject_to={shapes}")
    result = mechdesign.optimize(study)
    designs, best = result.tables["designs"], result.tables["optimum"]
    x, y = (best[f"{axis} of rectangle 180 x 90"][0] for axis in "xy")
    width, height = best["scale of rectangle 180 x 90"][0] * np.array([90, 45])
    nearest = np.hypot(max(abs(x) - width, 0), max(abs(y) - height, 0))
    assert nearest >= abs(best["l1"][0] - best["l2"][0]) - 1e-6
    assert np.hypot(abs(x) + width, abs(y) + height) <= best["l1"][0] + best["l2"][0] + 1e-6
    inner, outer = np.abs(designs["l1"] - designs["l2"]), designs["l1"] + designs["l2"]
    free = [
        max(ring_of_rectangle(180, 90, a, b), ring_of_rectangle(90, 180, a, b))
        for a, b in zip(inner, outer, strict=True)
    ]
    fixed = np.minimum(outer - 80, 80 - inner) / 20
    # Around a point no place but itself is lost.
    free = np.where(inner == 0, np.hypot(180, 90) ** -1 * 2 * outer, free)
    assert designs["scale of rectangle 180 x 90"] == pytest.approx(free, rel=1e-6)
    assert designs["scale of circle 20 at (0, 80)"] == pytest.approx(fixed)
    wanted = (np.array(free) >= 1) & (fixed >= 1 - 1e-9)
    assert designs["feasible"].tolist() == wanted.tolist()
    assert 0 < wanted.sum() < len(wanted)
    assert "not rectangle 180 x 90 contained" in designs["reason"].tolist()


@pytest.mark.nightly
def test_search_ends_where_the_shape_just_fits() -> None:
    study = study_of(
        ARM, "optimize.variables={l1: {from: 60, to: 140}, l2: {from: 60, to: 61}}", "optimize.method=search",
        "optimize.evaluations=60", "optimize.subject_to=[{contains: {rectangle: [40, 20], center: [0, 120]}}]",
    )  # fmt: skip
    best = mechdesign.optimize(study).tables["optimum"]
    # The smallest ring whose outer circle holds the far corners.
    assert best["l1"] + best["l2"] == pytest.approx([np.hypot(20, 130)], rel=1e-4)
    assert best["scale of rectangle 40 x 20 at (0, 120)"] == pytest.approx([1], abs=1e-4)


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("{contains: {center: free}}", "a shape is one of rectangle: [width, height], circle: radius"),
        ("{contains: {circle: 5, center: middle}}", "expected [x, y] or free, not 'middle'"),
        ("{contains: {rectangle: 5}}", "expected [width, height], not the number 5"),
        ("{contains: {rectangle: [5, 0]}}", "must be positive, not 0"),
        ("{contains: {circle: 5, centre: free}}", "subject_to.0.contains.centre: unknown key; did you mean 'center'?"),
        ("{result: area}", "subject_to.0: a condition needs 'at_least', 'at_most' or both"),
        ("{result: area, at_lest: 5}", "did you mean 'at_least'?"),
    ],
)
def test_wrong_shapes_are_reported(condition: str, message: str) -> None:
    with pytest.raises(StudyError) as caught:
        study_of(ARM, f"optimize.subject_to=[{condition}]")
    assert message in str(caught.value)


@pytest.mark.nightly
def test_shapes_follow_the_variables() -> None:
    """As formulas say, and as for studies of single designs: sizes and centres that are other for each design."""
    shapes = "[{contains: {circle: l2/3}}, {contains: {rectangle: [l1, l2/4], center: [0, 1.2*l1 - 10]}}]"
    study = study_of(ARM, f"optimize.subject_to={shapes}")
    table = mechdesign.optimize(study, jobs=1).tables["designs"]
    l1, l2 = table["l1"], table["l2"]
    assert table["scale of circle l2/3"] == pytest.approx(
        # Without a hole the largest circle is the outer one.
        np.where(l1 == l2, l1 + l2, np.minimum(l1, l2)) / (l2 / 3), rel=1e-4,
    )  # fmt: skip
    for k, (one, two) in enumerate(zip(l1, l2, strict=True)):
        shape = Shape(float(one), float(two / 4), False, 1j * float(1.2 * one - 10))
        (alone,) = scales(ARM, shape, f"mechanism.parameters={{l1: {one}, l2: {two}}}")
        assert table["scale of rectangle l1 x l2/4 at (0, 1.2*l1 - 10)"][k] == pytest.approx(alone, rel=1e-9)


@pytest.mark.slow
def test_held_values_and_the_characteristic_length_follow_the_variables() -> None:
    """All designs at once, to the numbers of their own studies."""
    goals = "optimize={variables: {crank: {from: 150, to: 170, step: 10}}, maximize: [GII, SUI], minimize: [area]}"
    changes = (goals, "workspace.at.platform.angle=crank/5 - 40", "workspace.characteristic_length=crank - 90")
    study = study_of(RRR, *changes)
    assert Evaluator(designs_question(study)).question.regions_together
    table = mechdesign.optimize(study, jobs=1).tables["designs"]
    for k, crank in enumerate(table["crank"]):
        alone = study_of(RRR, *changes, f"mechanism.parameters.crank={crank}")
        found = answer(questions(alone, 1e-4, ("GII", "SUI", "area"))[0], {}, 1, BATCH).values
        for name in ("GII", "SUI", "area"):
            assert table[name][k] == pytest.approx(found[name][0], rel=1e-12)


@pytest.mark.nightly
def test_worst_of_several_held_values_counts() -> None:
    goals = "optimize={variables: {crank: {from: 150, to: 170, step: 20}}, maximize: [GII], minimize: [area], "
    goals += "subject_to: [{contains: {circle: 60, center: [0, 0]}}, {contains: {rectangle: [120, 90]}}]}"
    every = mechdesign.optimize(study_of(RRR, goals, "workspace.at.platform.angle=[-20, 40]"))
    single = [
        mechdesign.optimize(study_of(RRR, goals, f"workspace.at.platform.angle={angle}")).tables["designs"]
        for angle in (-20, 40)
    ]
    designs = every.tables["designs"]
    for name in ("GII", "scale of circle 60 at (0, 0)", "scale of rectangle 120 x 90"):
        assert designs[name] == pytest.approx(np.min([each[name] for each in single], axis=0), rel=1e-9)
    assert designs["area"] == pytest.approx(np.max([each["area"] for each in single], axis=0), rel=1e-9)
    assert designs.column("GII").meaning.endswith("the worst at platform.angle = -20, 40")


@pytest.mark.slow
def test_held_values_that_leave_nothing_are_named() -> None:
    result = mechdesign.optimize(study_of(RRR, "optimize.variables.crank={from: 90, to: 160, step: 70}",
                                          "workspace.at.platform.angle=[0, 60]", "optimize.subject_to=[]"))  # fmt: skip
    assert result.tables["designs"]["reason"][0] == "nothing of the workspace can be reached at platform.angle = 60"


def test_a_place_on_the_border_crosses_nothing() -> None:
    shapes = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 4.0, 0.5])
    assert crossed(shapes, np.array([0.25j])) == ["circle"]
    assert crossed(shapes, np.array([1j, 2 + 0.25j])) == []
    assert crossed(np.full(7, np.nan), np.array([0j])) == []
