"""Stiffness of many designs at once: each as if it were asked alone, whatever number of the section they differ in."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from helpers.beam_model import Frame
from helpers.designs import assert_as_alone
from helpers.stiffness import METRES, matrix
from helpers.studies import study_of

import mechdesign
from mechdesign.family.evaluator import Evaluator
from mechdesign.family.goals import goal
from mechdesign.questions.optimize.question import designs_question
from mechdesign.study.designs import Designs

COUNT = 7
# A body on a serial leg: every kind of number, each of its own parameter.
ARM = (
    METRES
    + """
mechanism:
  parameters: {l: 0.5, e: 2e11, g: 8e10, w: 0.02, h: 0.04, k: 1e4, gear: 3e4, kappa: 0.8, pin: 1e7, pull: 100, turn: 30,
    radian: 0.1, d: 0.05, d_in: 0.03, s: 30}
  links:
    ground: {O: [0, 0]}
    upper: [O, E, l]
    lower: [E, P, 0.4]
  drives: {shoulder: {angle: upper}, elbow: {angle: lower, from: upper}}
  sketch: {E: [0.4, 0.3], P: [0.8, 0.2]}
stiffness:
  link: lower
  at: P
  sections:
    beam: {E: e, G: g, width: w, height: h, shear: true, shear_factor: kappa}
    tube: {E: 2e11, G: g, diameter: d, inner_diameter: d_in, shear: true}
  elastic: {upper: beam, lower: tube}
  actuators: {shoulder: [k, gear], elbow: 2*k}
  bearings: {E: pin}
  poses: [{shoulder: s, elbow: 50}, {shoulder: 60, elbow: 20}]
  loads: [[pull, -2*pull, 0], [0, 0, 5]]
  direction: turn
  characteristic_length: radian
"""
)
# By the force method: two loops, a guide that gives, sections of a given area, and a pin of three links.
PRESS = (
    METRES
    + """
mechanism:
  parameters: {a: 8e-4, i: 1.0e-7, across: 1e8, tilt: 1e5, pin: 2e8, k: 2000, load: 1000, r: 0.14, sweep: 40}
  links:
    ground: {O2: [0.136, 0.27], O4: [0, 0]}
    crank: [O2, A, 0.05]
    rod: [A, B, r]
    lower: [O4, B, 0.27]
    upper: [B, S, 0.44]
    ram: {S: [0, 0]}
  joints: {guide: {prismatic: [ground, ram], through: O4, direction: 90, point: S}}
  drives: [crank]
  sketch: {A: [0.186, 0.27], B: [0.048, 0.266], S: [0, 0.704]}
stiffness:
  link: ram
  at: S
  sections: {beam: {E: 2e11, area: a, inertia: i}}
  elastic: {crank: beam, rod: beam, lower: beam, upper: beam}
  actuators: {crank: k}
  bearings: {guide: {radial: across, moment: tilt}, B: pin}
  sweep: {crank: {from: sweep, to: sweep + 90, number: 3}}
  loads: [[0, -load, 0]]
"""
)
# A pin on two legs.
FIVE_BAR = (
    METRES
    + """
mechanism:
  parameters: {k: 1000, x: 0.05, span: 0.15, bore: 1e6, b: 0.4}
  links:
    ground: {O1: [-0.15, 0], O2: [span, 0]}
    a1: [O1, E1, 0.25]
    b1: [E1, P, b]
    a2: [O2, E2, 0.25]
    b2: [E2, P, 0.40]
  drives: [a1, a2]
  sketch: {E1: [-0.3, 0.2], E2: [0.3, 0.2], P: [0.05, 0.45]}
stiffness:
  at: P
  actuators: {a1: k, a2: 500}
  bearings: {P: bore, E1: 2*bore}
  poses: [{P.x: x, P.y: 0.45}, {P.x: x, P.y: 0.6}]
  loads: [[1, k/1000]]
"""
)
# Three legs of which the third may become parallel to the others.
PLATFORM = (
    METRES
    + """
mechanism:
  parameters: {t: 0.1, k: 5e7, h: 0.04}
  links:
    ground: {A1: [-0.2, 0], A2: [0.2, 0], A3: [t, 0]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.2, 0], B2: [0.2, 0], B3: [0.25, 0.15]}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  sketch: {P: [0, 1], B1: [-0.2, 1], B2: [0.2, 1], B3: [0.25, 1.15]}
stiffness:
  link: platform
  at: P
  sections: {beam: {E: 200 GPa, width: 0.02, height: h}}
  elastic: {leg_1: beam, leg_2: beam, leg_3: beam}
  actuators: {l1: k, l2: k, l3: 5e7}
  poses: [{P.x: 0, P.y: 1, platform.angle: 0}, {P.x: 0.1, P.y: 1.2, platform.angle: 5}]
  loads: [[100, 0, 0]]
"""
)

# A geared five-bar, whose cranks bend under their teeth and its own motion.
GEARED = """
mechanism:
  parameters: {ratio: -2, c: 5e3, k: 2e3, h: 15, pull: 50}
  links:
    ground: {O: [0, 0], C: [100, 0]}
    one: [O, A, 30]
    two: [C, D, 35]
    left: [A, B, 80]
    right: [D, B, 85]
  drives: [one]
  couplings: {gears: {set: two, of: one, ratio: ratio, phase: 80}}
  sketch: {A: [30, 5], D: [117, 30], B: [50, 90]}
stiffness:
  at: B
  sections: {bar: {E: 2e5, width: 10, height: h, density: 7850 kg/m^3}}
  elastic: {one: bar, two: bar, right: bar}
  actuators: {one: k}
  couplings: {gears: {force: c, moment: 1e6}}
  loads: [[0, pull], {at: D, force: [pull, 10]}]
  dynamics: true
dynamics: {poses: [{one: 15}, {one: 35}], rates: {one: 600 rpm}}
"""


def designs_of(text: str, *names: str, count: int = COUNT, width: float = 0.05) -> Designs:
    """Designs of a study about its own, in parameters or places."""
    study, rng = study_of(text), np.random.default_rng(1)
    nominal = {name: study.parameters.nominal.get(name, study.mechanism.nominal.get(name)) for name in names}
    return Designs(study, {name: value * (1 + width * rng.uniform(-1, 1, count)) for name, value in nominal.items()})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "names"),
    [
        (ARM, names.split())
        for names in ("e", "g", "w", "h", "k", "gear", "kappa", "pin", "pull", "turn", "radian", "d", "d_in", "s", "l",
                      "e g w h k gear kappa pin pull turn radian d d_in s l", "lower.length k")
    ]
    + [(PRESS, names.split()) for names in ("a", "i", "across", "tilt", "pin", "k", "load", "r", "sweep",
                                            "a i across tilt pin k load r sweep")]
    + [(FIVE_BAR, names.split()) for names in ("k", "x", "bore", "span", "k x bore span b")]
    + [(PLATFORM, names.split()) for names in ("t", "k h", "t k h platform.B3.x")]
    + [(GEARED, names.split()) for names in ("ratio", "c", "ratio c k h pull one.length")],
    ids=lambda given: None if isinstance(given, str) else "-".join(given),
)  # fmt: skip
def test_every_design_is_answered_as_if_it_were_asked_alone(text: str, names: Sequence[str]) -> None:
    designs = designs_of(text, *names)
    found = assert_as_alone(designs, mechdesign.stiffness)
    # Something of each differs.
    assert all(not isinstance(answer, Exception) for answer in found)
    columns = [np.concatenate([c.values for table in answer.tables.values() for c in table.columns if c.numeric])
               for answer in found]  # fmt: skip
    assert len(np.unique([np.nansum(np.where(np.isfinite(values), values, 0.0)) for values in columns])) == COUNT


@pytest.mark.slow
def test_designs_that_fail_are_loose_or_nearly_so_say_it_in_their_own_words() -> None:
    """Legs that become parallel, or nearly; a five-bar that does not reach some of its poses, or any."""
    t = np.array([0.1, 0.25, 0.25 - 2e-5, 0.25, 0.2])
    designs = Designs(study_of(PLATFORM), {"t": t, "k": np.linspace(4e7, 6e7, 5), "h": np.linspace(0.03, 0.05, 5)})
    found = assert_as_alone(designs, mechdesign.stiffness)
    said = ["; ".join(map(str, answer.warnings)) for answer in found if not isinstance(answer, Exception)]
    assert ["nearly" in text for text in said] == [False, False, True, False, False]
    assert ["1 of 2 poses are under-constrained" in text for text in said] == [False, True, False, True, False]
    designs = Designs(study_of(FIVE_BAR), {"b": np.array([0.4, 0.35, 0.1, 0.4]), "k": np.linspace(900, 1200, 4)})
    found = assert_as_alone(designs, mechdesign.stiffness)
    kinds = ["none" if isinstance(answer, mechdesign.AssemblyError) else bool(answer.failed) for answer in found]
    assert {"none", True, False} == set(kinds)


# A girder whose points lie before or behind the trolley that rides on it.
GIRDER = """
mechanism:
  parameters: {p: 210, e: 2e5, h: 40}
  links:
    ground: {A: [0, 0], B: [400, 0]}
    girder: {from: A, to: S, length: 400, points: {T: [p, 80], U: [250, -40]}}
    trolley: {W: [0, 0], H: [0, -50]}
  joints:
    roller: {slot: ground, through: B, point: S}
    track: {prismatic: [girder, trolley], through: A, point: W}
  drives: {t: {slide: track}}
  sketch: {S: [400, 0], W: [200, 0], H: [200, -50]}
stiffness:
  link: trolley
  at: W
  sections: {beam: {E: e, width: 20, height: h}}
  elastic: {girder: beam}
  poses: [{t: 100}, {t: 200}, {t: 350}]
  loads: [[0, -1000, 0]]
"""


@pytest.mark.slow
def test_points_of_an_elastic_link_lie_in_another_order_in_each_design() -> None:
    """F b x (L^2 - b^2 - x^2) / 6EIL on the way to the force [Roark, Table 8.1]; a bracket's foot lies below it."""
    place, modulus, height = np.array([30, 120, 210, 249, 251, 380.0]), np.linspace(1e5, 3e5, 6), np.linspace(30, 60, 6)
    study = study_of(GIRDER)
    assert_as_alone(Designs(study, {"girder.T.x": place, "e": modulus, "h": height}), mechdesign.stiffness)
    designs = Designs(study, {"p": place, "e": modulus, "h": height})
    for answer, x, e, h in zip(assert_as_alone(designs, mechdesign.stiffness), place, modulus, height, strict=True):
        assert not isinstance(answer, Exception)
        table = answer.tables["displacements"]
        moved = table["dy"][(table["link"] == "girder") & (table["point"] == "T")]
        for a, dy in zip((100.0, 200.0, 350.0), moved, strict=True):
            near, far = (x, 400 - a) if x <= a else (400 - x, a)
            bent = -1000 * far * near * (400**2 - far**2 - near**2) / (6 * e * 20 * h**3 / 12 * 400)
            assert dy == pytest.approx(bent, rel=1e-9)


# A lever of three points on its line, of which a prop holds one and another is asked.
LEVER = (
    METRES
    + """
mechanism:
  parameters: {m: 0.3, x: 0.6, e: 2e11, a: 8e-4, i: 1e-7, k: 1e4, pin: 1e8}
  links:
    ground: {Q: [0, 0], R: [0.4, -0.5]}
    lever: {from: Q, to: T, length: 1, points: {M: [m, 0], X: [x, 0]}}
    prop: {from: R, to: M, telescopic: true}
  drives: {lift: {length: prop}}
  sketch: {T: [1, 0.05], M: [0.3, 0.015]}
stiffness:
  link: lever
  at: X
  sections: {beam: {E: e, area: a, inertia: i}}
  elastic: {lever: beam}
  actuators: {lift: k}
  bearings: {M: pin}
  poses: [{lever.angle: 0}]
"""
)


def test_a_lever_on_a_prop_before_or_behind_the_asked_point_is_that_of_finite_elements() -> None:
    """It turns about Q; the prop gives along its line, and at its pin."""
    study, rng = study_of(LEVER), np.random.default_rng(2)
    values = {"m": np.array([0.2, 0.35, 0.5, 0.7, 0.9]), "x": np.array([0.6, 0.3, 0.55, 0.4, 0.95])}
    nominal = {name: study.parameters.nominal[name] for name in ("e", "a", "i", "k", "pin")}
    values |= {name: value * rng.uniform(0.5, 2, 5) for name, value in nominal.items()}
    designs = Designs(study, values)
    for k, answer in enumerate(assert_as_alone(designs, mechdesign.stiffness)):
        assert not isinstance(answer, Exception)
        m, x, e, a, i, motor, pin = (float(values[name][k]) for name in ("m", "x", "e", "a", "i", "k", "pin"))
        frame = Frame()
        feet = {name: frame.node(complex(place, 0)) for name, place in (("Q", 0), ("M", m), ("X", x), ("T", 1))}
        order = sorted(feet.values(), key=lambda node: frame.places[node].real)
        for one, other in pairwise(order):
            frame.beam(one, other, e * a, e * i)
        frame.ground(feet["Q"], 0, 1)
        top, held = frame.node(complex(m, 0)), frame.node(complex(m, 0))
        frame.ground(held, 0, 1)
        frame.sliding_spring(held, top, complex(m - 0.4, 0.5), motor)
        for direction in (1 + 0j, 1j):
            frame.sliding_spring(feet["M"], top, direction, pin)
        expected = frame.compliance(feet["X"])
        found = matrix(answer, "C")
        assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()


def test_a_cantilever_on_a_motor_is_that_of_the_hand_formula() -> None:
    """L^3/3EI + L/(kappa G A) + L^2 (1/k + 1/gear) + 1/pin, all numbers of which differ."""
    text = (
        METRES
        + """
mechanism:
  parameters: {l: 0.5, e: 2e11, g: 8e10, w: 0.02, h: 0.04, k: 1e4, gear: 3e4, kappa: 0.8, pin: 1e7}
  links: {ground: {O: [0, 0]}, arm: [O, P, l]}
  drives: [arm]
stiffness:
  link: arm
  at: P
  sections: {beam: {E: e, G: g, width: w, height: h, shear: true, shear_factor: kappa}}
  elastic: {arm: beam}
  actuators: {arm: [k, gear]}
  bearings: {O: pin}
  poses: [{arm: 0}]
"""
    )
    designs = designs_of(text, "l", "e", "g", "w", "h", "k", "gear", "kappa", "pin", width=0.5)
    number = designs.changed
    area, arm = number["w"] * number["h"], number["l"]
    bent = arm**3 / (3 * number["e"] * area * number["h"] ** 2 / 12) + arm / (number["kappa"] * number["g"] * area)
    expected = bent + arm**2 * (1 / number["k"] + 1 / number["gear"]) + 1 / number["pin"]
    for answer, soft in zip(assert_as_alone(designs, mechdesign.stiffness), expected, strict=True):
        assert not isinstance(answer, Exception)
        assert matrix(answer, "C")[1, 1] == pytest.approx(soft, rel=1e-12)


@pytest.mark.parametrize(("actuators", "gear", "least"), [("k", 0, -3), ("[k, 6]", 1 / 6, -3), ("k", 0, 1e-100)])
def test_a_motor_without_a_stiffness_above_zero_is_no_design(actuators: str, gear: float, least: float) -> None:
    """The tip of a rigid arm of 100 mm on a motor k and a gear of 6 N*mm/rad moves by 100^2 (1/k + 1/6) mm/N."""
    study = study_of(f"""
mechanism: {{parameters: {{k: 4}}, links: {{ground: {{O: [0, 0]}}, arm: [O, P, 100]}}, drives: [arm]}}
stiffness: {{link: arm, at: P, actuators: {{arm: {actuators}}}, poses: [{{arm: 0}}]}}
optimize: {{variables: {{k: {{from: {least}, to: 6, number: 4}}}}, maximize: stiffness.compliance.C22}}
""")
    designs = mechdesign.optimize(study).tables["designs"]
    good = designs["k"] > 1
    assert (designs["reason"] == "").tolist() == good.tolist()
    expected = np.where(good, 1e4 * (1 / np.where(good, designs["k"], 1) + gear), np.nan)
    np.testing.assert_allclose(designs["stiffness.compliance.C22"], expected, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "names", "column"),
    [
        (ARM, "e k pin", "stiffness.k_direction"), (ARM, "radian d", "stiffness.eigen.stiffness"),
        (ARM, "pull gear", "stiffness.deflections.dy"), (PRESS, "across load", "stiffness.forces.mz"),
        (PRESS, "pin i", "stiffness.displacements.dx"), (PLATFORM, "h t", "stiffness.compliance.C33"),
    ],
)  # fmt: skip
def test_goals_of_designs_are_those_of_their_own_answers(
    text: str, names: str, column: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found for all designs at once: none is made a study of its own."""
    variables = ", ".join(f"{name}: {{from: 1, to: 2, number: 2}}" for name in names.split())
    study = study_of(text, f"optimize={{variables: {{{variables}}}, minimize: [{column}]}}")
    designs = Designs(study, designs_of(text, *names.split()).changed)
    largest = []
    for k in range(designs.count):
        table, _, name = column.removeprefix("stiffness.").rpartition(".")
        values = mechdesign.stiffness(designs.one(k)).tables[table or "stiffness"][name]
        largest.append(values.max())
    evaluator = Evaluator(designs_question(study, [goal(column, smallest=True)]))
    monkeypatch.setattr(Designs, "one", None)
    found = evaluator(designs.changed)
    assert found.reasons == [""] * COUNT
    np.testing.assert_allclose(found.table[:, 0], largest, rtol=1e-12)


@pytest.mark.slow
def test_a_leg_that_has_a_spring_in_one_design_only() -> None:
    """An elbow that is free bears nothing; at full stretch the leg is a strut."""
    legs = PLATFORM.replace("    platform: {P", "    near: [A4, C, q]\n    far: [C, P, 0.6]\n    platform: {P")
    text = legs.replace("A3: [t, 0]", "A3: [t, 0], A4: [0, 0]").replace("{t: 0.1,", "{t: 0.1, q: 0.4,")
    text = text.replace("P: [0, 1], B1: [-0.2, 1]", "P: [0, 1], C: [0.1, 0.4], B1: [-0.2, 1]")
    text = text.replace(", {P.x: 0.1, P.y: 1.2, platform.angle: 5}", "")
    section = "{variables: {q: {from: 0.1, to: 1, number: 2}}, minimize: [stiffness.springs.stiffness]}"
    study = study_of(text.replace("beam}", "beam, near: beam}"), f"optimize={section}")
    designs = Designs(study, {"q": np.array([0.45, 0.4, 0.42]), "k": np.array([4e7, 5e7, 6e7])})
    found = assert_as_alone(designs, mechdesign.stiffness)
    springs = [answer.tables["springs"] for answer in found if not isinstance(answer, Exception)]
    assert [len(table) for table in springs] == [3, 4, 3]
    for text, tables in (("leg_1", springs), ("near+far", springs[1:2])):
        asked = goal("stiffness.springs.stiffness", where={"leg": text})
        least = [table["stiffness"][table["leg"] == text].min() for table in tables]
        values = Evaluator(designs_question(study, [asked]))(designs.changed).table[:, 0]
        np.testing.assert_allclose(values[np.isfinite(values)], least, rtol=1e-12)


def test_a_deflection_is_a_part_of_the_size_of_its_own_design() -> None:
    """F L^2 / 3 E I of a strip."""
    text = """
mechanism:
  parameters: {l: 1000}
  links: {ground: {O: [0, 0]}, arm: [O, P, l]}
  drives: [arm]
stiffness:
  link: arm
  at: P
  sections: {strip: {E: 200 GPa, width: 10, height: 10}}
  elastic: {arm: strip}
  poses: [{arm: 0}]
  loads: [[0, -100, 0]]
"""
    found = assert_as_alone(Designs(study_of(text), {"l": np.array([1000, 1500, 2000.0])}), mechdesign.stiffness)
    for answer, part in zip(found, ("0.2", "0.45", "0.8"), strict=True):
        assert not isinstance(answer, Exception)
        (large,) = (str(warning) for warning in answer.warnings if warning.kind == "suspect")
        assert f"the asked point moves by {part} times the mechanism's size" in large
