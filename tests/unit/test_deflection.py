"""Elastic deflections among the errors: compliance times load, fixed and random, by every method."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.stiffness import ARM, FIVE_BAR, MEETING_STRUTS, METRES, ask_stiffness, matrix
from helpers.studies import study_of
from scipy.special import ndtr

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
# S4's type I at the reference pose, by the corrected theory.
COMPLIANCE = np.array([
    [3.0835033763e-7, -3.2704265711e-8, 4.0775675544e-7],
    [-3.2704265711e-8, 1.5504244485e-8, -6.5408531422e-8],
    [4.0775675544e-7, -6.5408531422e-8, 7.8523178337e-7],
])  # fmt: skip
LOADED = """
reliability:
  dimensions: {upper.length: 1e-5, load.fx: {sigma: 20}, load.mz: 3}
  poses: [{shoulder: 30, elbow: 50}]
  outputs: [P, lower.angle]
  load: [100, -50, 10]
  samples: 100000
  sobol: 0
"""


def ask(text: str, *overrides: str) -> mechdesign.Answer:
    return mechdesign.reliability(study_of(text, *overrides))


def pick(result: mechdesign.Answer, table: str, column: str, **chosen: object) -> np.ndarray:
    found = result.tables[table]
    rows = np.ones(len(found), dtype=bool)
    for name, value in chosen.items():
        rows &= found[name] == value
    return found[column][rows]


def lower_line(text: str, load: np.ndarray) -> float:
    """How far a load turns the line of the arm's lower link, by the displacements of its ends."""
    table = mechdesign.stiffness(study_of(text, f"stiffness.loads={[load.tolist()]}")).tables["displacements"]
    own = table["link"] == "lower"
    x, y, dx, dy = (np.diff(table[name][own])[0] for name in ("x", "y", "dx", "dy"))
    return float((complex(dx, dy) / complex(x, y)).imag)


def test_an_output_errs_by_compliance_times_load() -> None:
    """Mean C F of the fixed load, and sigma C sigma_F of one that varies alone."""
    study = mechdesign.load(
        CONFIGS / "planar_3rpr.yaml",
        ["reliability={dimensions: {load.fy: {sigma: 30}}, load: [1000, -200, 50], outputs: [P, platform.angle], "
         "poses: [{P.x: 0, P.y: 1, platform.angle: 0}], methods: [analytic, second_order, monte_carlo]}"],
    )  # fmt: skip
    result = mechdesign.reliability(study)
    mean, sigma = COMPLIANCE @ [1000.0, -200.0, 50.0], np.abs(COMPLIANCE[:, 1]) * 30.0
    degrees = np.array([1.0, 1.0, 180.0 / np.pi])
    for method, rel in (("analytic", 1e-8), ("second_order", 1e-6), ("monte_carlo", 4 / np.sqrt(80_000))):
        shift = pick(result, "moments", "mean", method=method) - pick(result, "moments", "nominal", method=method)
        # The mean of the samples is as far off as their number lets it be; the rest is rounding of the nominal value.
        slack = 4 * sigma / np.sqrt(40_000) if method == "monte_carlo" else 1e-8 * mean.max()
        assert (np.abs(shift / degrees - mean) < slack).all()
        assert pick(result, "moments", "sigma", method=method) / degrees == pytest.approx(sigma, rel=rel)
    assert pick(result, "contributions", "sensitivity") == pytest.approx(COMPLIANCE[:, 1], rel=1e-8)
    assert pick(result, "contributions", "share") == pytest.approx(np.ones(3))


@pytest.mark.slow
def test_a_random_load_is_a_source_beside_the_dimensions() -> None:
    text = ARM + LOADED
    result = ask(text, "reliability.methods=[analytic, second_order, monte_carlo]")
    soft = matrix(mechdesign.stiffness(study_of(text)), "C")
    # The angle of a link that bends is that of the line between its ends.
    soft[2] = [lower_line(text, load) for load in np.eye(3)]
    turn = np.radians(30)
    length = np.array([np.cos(turn), np.sin(turn), 0.0]) * 1e-5 / 3
    parts = np.stack([length, soft[:, 0] * 20, soft[:, 2] * 1.0])
    sigma = np.sqrt((parts**2).sum(axis=0))
    scale = np.array([1.0, 1.0, 180 / np.pi])
    for method, rel in (("analytic", 1e-9), ("second_order", 1e-5), ("monte_carlo", 0.01)):
        assert pick(result, "moments", "sigma", method=method) / scale == pytest.approx(sigma, rel=rel)
    shares = pick(result, "contributions", "share").reshape(3, 3)
    assert shares == pytest.approx((parts**2 / sigma**2).T, rel=1e-9)
    shift = pick(result, "moments", "mean", method="analytic") - pick(result, "moments", "nominal", method="analytic")
    assert shift / scale == pytest.approx(soft @ [100, -50, 10], rel=1e-9)


@pytest.mark.slow
def test_every_method_counts_the_deflection() -> None:
    """The error of P.x is normal: C F on the average, its deviation C11 sigma; the limit is three of it off."""
    text = ARM + LOADED
    soft = matrix(mechdesign.stiffness(study_of(text)), "C")
    mean, sigma = soft[0] @ [100, -50, 10], abs(soft[0, 0]) * 20
    limit = float(mean + 3 * sigma)
    result = ask(
        text, "reliability.dimensions={load.fx: {sigma: 20}}", f"reliability.limits={{P.x: {limit!r}}}",
        "reliability.methods=[analytic, second_order, monte_carlo, form, importance_sampling, auto]",
    )  # fmt: skip
    exact = ndtr(-3.0) + ndtr(-(limit + mean) / sigma)
    table = result.tables["reliability"]
    for method, rel in (("analytic", 1e-7), ("second_order", 1e-4), ("form", 1e-4)):
        assert table["failure"][table["method"] == method] == pytest.approx([exact], rel=rel)
    sampled = np.isin(table["method"], ["monte_carlo", "importance_sampling", "auto"])
    assert (table["failure_low"][sampled] <= exact).all()
    assert (exact <= table["failure_high"][sampled]).all()


def test_other_points_move_as_the_stiffness_model_says() -> None:
    """The elbow's displacement is that of displacements.csv."""
    text = ARM + LOADED
    result = ask(text, "reliability.outputs=[E, P]", "reliability.methods=analytic")
    table = mechdesign.stiffness(study_of(text, "stiffness.loads=[[100, -50, 10]]")).tables["displacements"]
    shift = pick(result, "moments", "mean") - pick(result, "moments", "nominal")
    for k, point in enumerate("EP"):
        row = np.flatnonzero(table["point"] == point)[0]
        assert shift[2 * k : 2 * k + 2] == pytest.approx([table["dx"][row], table["dy"][row]], rel=1e-8)
    assert not [warning for warning in map(str, result.warnings) if "deflection" in warning]


def test_points_of_a_rigid_platform_move_about_the_loaded_one() -> None:
    study = mechdesign.load(
        CONFIGS / "planar_3rpr.yaml",
        ["reliability={dimensions: {load.fy: 30}, load: [1000, -200, 50], outputs: [P, B3], methods: analytic, "
         "poses: [{P.x: 0, P.y: 1, platform.angle: 0}]}"],
    )  # fmt: skip
    result = mechdesign.reliability(study)
    shift = pick(result, "moments", "mean") - pick(result, "moments", "nominal")
    moved = COMPLIANCE @ [1000.0, -200.0, 50.0]
    arm = np.array([0.25, 0.15])
    assert shift[2:] == pytest.approx(moved[:2] + moved[2] * np.array([-arm[1], arm[0]]), rel=1e-7)


def test_outputs_without_a_known_deflection_are_named() -> None:
    """A link of three points has no line of its own where it bends; a velocity is that of the unloaded mechanism."""
    text = ARM.replace("[O, E, 0.5]", "{O: [0, 0], F: [0.2, 0.1], E: [0.5, 0]}").replace(
        "E: [0", "F: [0.2, 0.2], E: [0"
    )
    text = text.replace("{O: [0, 0], F: [0.2, 0.1], F: [0.2, 0.2], E", "{O: [0, 0], F: [0.2, 0.1], E") + LOADED
    changes = ["reliability.outputs=[P, upper.angle]", "reliability.dimensions={shoulder: 0.1, load.fx: 1}"]
    result = ask(text, *changes, "reliability.rates={shoulder: 10}", "reliability.methods=analytic")
    (told,) = [warning for warning in map(str, result.warnings) if "deflection" in warning]
    for name in ("upper.angle", "upper.angle_velocity", "P.x_velocity", "P.y_acceleration"):
        assert f" {name}," in told or f" {name}:" in told
    assert " P.x," not in told
    unloaded = ask(
        text, "reliability.outputs=[upper.angle]", "reliability.load=[0, 0, 0]",
        "reliability.dimensions={upper.E.x: 1e-5, shoulder: 0.1}", "reliability.methods=analytic",
    )  # fmt: skip
    loaded = ask(
        text, "reliability.outputs=[upper.angle]", "reliability.dimensions={upper.E.x: 1e-5, shoulder: 0.1}",
        "reliability.methods=analytic",
    )  # fmt: skip
    for column in ("mean", "sigma"):
        assert pick(loaded, "moments", column) == pytest.approx(pick(unloaded, "moments", column), rel=1e-12)


CANTILEVER = (
    METRES
    + """
mechanism:
  links: {ground: {O: [0, 0]}, arm: ARM}
  drives: {q: {angle: arm}}
  sketch: {P: [0.7, 0.3]}
  measures: {tilt: {angle: [ground, arm]}}
stiffness: {link: arm, at: P, sections: {rod: {E: 200 GPa, diameter: 0.02}}, elastic: {arm: rod}, poses: [{q: 25}]}
reliability: {poses: [{q: 25}], dimensions: {load.fy: 1}, outputs: [arm.angle, tilt], methods: analytic}
"""
)


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "at", "a"), [
    ("{from: O, to: P, length: 0.8, points: {M: [0.3, 0]}}", "P", 0.8),
    ("{from: O, to: P, length: 0.8, points: {M: [0.3, 0]}}", "M", 0.3),
    ("{O: [0, 0], P: [0.8, 0]}", "P", 0.8),
])  # fmt: skip
def test_the_angle_of_a_link_that_bends_is_that_of_the_line_between_its_ends(arm: str, at: str, a: float) -> None:
    """A force across at a moves the tip of a cantilever by F a^2 (3 L - a) / 6 E I, a moment by M a (2 L - a) / 2 E I.

    Wherever it is asked; the section there turns by another angle, of which the stiffness speaks.
    """
    length, bending, across, moment = 0.8, 200e9 * np.pi / 64 * 0.02**4, -40.0, 6.0
    load = [across * -float(np.sin(np.radians(25))), across * float(np.cos(np.radians(25))), moment]
    text = CANTILEVER.replace("ARM", arm)
    result = ask(text, f"stiffness.at={at}", f"reliability.load={load}")
    tip = across * a**2 * (3 * length - a) / (6 * bending) + moment * a * (2 * length - a) / (2 * bending)
    shift = np.radians(pick(result, "moments", "mean") - pick(result, "moments", "nominal"))
    assert shift == pytest.approx([tip / length] * 2, rel=1e-8)
    section = ask_stiffness(text, f"stiffness.at={at}", f"stiffness.loads={[load]}").tables["deflections"]
    assert section["dphi"][0] == pytest.approx(across * a**2 / (2 * bending) + moment * a / bending, rel=1e-8)
    assert [text for text in map(str, result.warnings) if "bends" in text] == [
        "arm.angle, tilt: arm bends, and its angle is that of the line from O to P"
    ]


def test_the_angle_of_a_leg_whose_rod_bends_is_that_of_the_line_between_its_ends() -> None:
    """A boom on a telescopic leg: by the displacements of the leg's own ends, and by the leg's rod in line with it."""
    text = (
        METRES
        + """
mechanism:
  links:
    ground: {O: [0, 0], D: [-0.1, -0.3]}
    boom: {O: [0, 0], M: [0.25, 0.02], T: [0.6, 0]}
    leg: {from: D, to: M, telescopic: true}
  drives: [leg]
  sketch: {T: [0.6, 0], M: [0.25, 0]}
stiffness:
  link: boom
  at: T
  sections: {rod: {E: 200 GPa, diameter: 0.02}}
  elastic: {leg: rod}
  actuators: {leg: 2e6}
  bearings: {M: 1e6, leg: {radial: 1e6, moment: 1e3}}
  poses: [{boom.angle: 10}]
reliability:
  {poses: [{boom.angle: 10}], dimensions: {load.fy: 1}, load: [5, -40, 2], outputs: [leg.angle, boom.angle, leg.M],
   methods: analytic}
"""
    )
    result = ask(text)
    turn, boom, x, y = pick(result, "moments", "mean") - pick(result, "moments", "nominal")
    solved = study_of(text).mechanism.solve({"boom.angle": 10})
    span = complex(solved["M.x"] + 0.1, solved["M.y"] + 0.3)
    assert np.radians(turn) == pytest.approx((complex(x, y) / span).imag, rel=1e-8)
    deflections = ask_stiffness(text, "stiffness.loads=[[5, -40, 2]]").tables["deflections"]
    assert np.radians(boom) == pytest.approx(deflections["dphi"][0], rel=1e-8)
    assert abs(turn) > 1e-4


def test_one_load_of_the_stiffness_section_counts_and_of_several_one_has_to_be_named() -> None:
    text = ARM + LOADED.replace("  load: [100, -50, 10]\n", "")
    overrides = ["reliability.methods=analytic", "reliability.dimensions={upper.length: 1e-5}"]

    def shift(*more: str) -> tuple[np.ndarray, list[str]]:
        result = ask(text, *overrides, *more)
        moved = pick(result, "moments", "mean") - pick(result, "moments", "nominal")
        return moved, [warning for warning in map(str, result.warnings) if "loads" in warning]

    still, told = shift()
    assert np.abs(still).max() == 0
    assert not told
    one, told = shift("stiffness.loads=[[100, -50, 10]]")
    assert np.abs(one).min() > 1e-6
    assert not told
    both, told = shift("stiffness.loads=[[1, 0, 0], [100, -50, 10]]")
    assert np.abs(both).max() == 0
    assert len(told) == 1
    chosen, told = shift("stiffness.loads=[[1, 0, 0], [100, -50, 10]]", "reliability.load=[100, -50, 10]")
    assert chosen == pytest.approx(one)
    assert not told


def test_a_pin_bears_forces_only() -> None:
    text = (
        FIVE_BAR
        + """
reliability:
  dimensions: {load.fy: {sigma: 5}}
  poses: [{P.x: 0.05, P.y: 0.45}]
  outputs: [P]
  load: [0, -20]
  samples: 20000
"""
    )
    soft = matrix(mechdesign.stiffness(study_of(text)), "C")
    result = ask(text)
    assert pick(result, "moments", "sigma", method="analytic") == pytest.approx(np.abs(soft[:, 1]) * 5, rel=1e-9)
    assert pick(result, "moments", "sigma", method="monte_carlo") == pytest.approx(np.abs(soft[:, 1]) * 5, rel=0.03)


@pytest.mark.slow
def test_a_pose_that_does_not_hold_the_load_is_not_valid() -> None:
    """A platform whose three struts meet turns about their common point: it bears no moment."""
    text = (
        MEETING_STRUTS
        + """\
reliability:
  dimensions: {platform.B1.x: 1e-4}
  poses: [{P.x: 0, P.y: 1, platform.angle: 0}, {P.x: 0.1, P.y: 1, platform.angle: 0}]
  outputs: [P]
  limits: {P: {radius: 0.01}}
  load: [0, -20, 1]
  samples: 1000
"""
    )
    result = ask(text)
    moments, told = result.tables["moments"], result.tables["reliability"]
    lost = moments["P.x"] == 0
    assert np.isnan(moments["sigma"][lost]).all()
    assert np.isfinite(moments["sigma"][~lost]).all()
    assert (moments["valid"] == ~lost).all()
    assert (np.isnan(told["failure"]) == (told["P.x"] == 0)).all()
    assert result.failed == "pose P.x = 0 m, P.y = 1 m, platform.angle = 0 deg: does not hold its load"
    with pytest.raises(mechdesign.AssemblyError, match="does not hold its load"):
        ask(text, "reliability.poses=[{P.x: 0, P.y: 1, platform.angle: 0}]")


def test_a_cycle_keeps_its_deflections() -> None:
    text = ARM + LOADED
    sweep = ["reliability.poses=", "reliability.sweep={shoulder: {from: 20, to: 40, step: 10}, elbow: 50}"]
    result = ask(
        text, *sweep, "reliability.outputs=", "reliability.limits={P.y: {max: 1}, P.x: {min: -1}}",
        "reliability.load=[0, 0, 1e12]", "reliability.samples=500",
    )  # fmt: skip
    table = result.tables["reliability"]
    assert set(table["scope"]) == {"pose", "cycle"}
    assert (table["failure"] == 1).all()


@pytest.mark.parametrize(
    ("text", "override", "message"),
    [
        (ARM + LOADED, "stiffness=", "the study has none"),
        (ARM + LOADED, "reliability.load=[1, 2]", r"a load is \[fx, fy, mz\], not 2"),
        (FIVE_BAR + "reliability:\n  dimensions: {a1: 1}\n", "reliability.load=[0, 0, 5]", "a pin carries no moment"),
        (FIVE_BAR + "reliability:\n  dimensions: {a1: 1}\n", "reliability.dimensions.load.mz=5", "a pin carries no"),
        (ARM + LOADED, "reliability.load=[1 m, 0, 0]", "force"),
    ],
)
def test_what_cannot_be_a_load(text: str, override: str, message: str) -> None:
    with pytest.raises(mechdesign.StudyError, match=message):
        study_of(text, override)


def test_sobol_indices_know_the_load() -> None:
    result = ask(ARM + LOADED, "reliability.sobol=500", "reliability.methods=analytic")
    table = result.tables["contributions"]
    assert table["sobol_first"] == pytest.approx(table["share"], abs=1e-6)
    assert table["sobol_total"] == pytest.approx(table["share"], abs=1e-6)


@pytest.mark.slow
def test_designs_that_differ_in_what_the_stiffness_section_says() -> None:
    """Found at once, all of them had the deflections of the study's own beam and load."""
    text = """
units: {length: m}
mechanism:
  parameters: {height: 0.04, pull: 100}
  links: {ground: {O: [0, 0]}, upper: [O, E, 0.5], lower: [E, P, 0.4]}
  drives: {shoulder: {angle: upper}, elbow: {angle: lower}}
  sketch: {E: [0.4, 0.3], P: [0.6, 0.65]}
stiffness:
  {link: lower, at: P, sections: {beam: {E: 200e9, width: 0.02, height: height}}, elastic: {upper: beam, lower: beam},
   actuators: {shoulder: 1e5, elbow: 1e5}, loads: [[pull, -50, 0]]}
reliability:
  dimensions: {upper.length: 1e-5, load.fx: {sigma: 20}}
  poses: [{shoulder: 30, elbow: 50}]
  outputs: [P]
  limits: {P.y: 1e-3}
  methods: analytic
"""
    varied = "height: {from: 0.03, to: 0.05, number: 2}, pull: {from: 80, to: 200, number: 2}"
    section = (
        f"optimize={{variables: {{{varied}}}, minimize: reliability.moments.sigma, maximize: reliability.reliability}}"
    )
    for row in mechdesign.optimize(study_of(text, section)).tables["designs"]:
        alone = ask(text, *(f"mechanism.parameters.{name}={float(row[name])!r}" for name in ("height", "pull")))
        assert row["reliability.moments.sigma"] == pytest.approx(alone.tables["moments"]["sigma"].max(), rel=1e-9)
        assert row["reliability.reliability"] == pytest.approx(
            alone.tables["reliability"]["reliability"].min(), rel=1e-9
        )


@pytest.mark.slow
def test_a_distance_about_zero_is_the_length_of_the_deflection() -> None:
    """Of the tip from where it is without a load, whose components are C F."""
    text = ARM.replace("ground: {O: [0, 0]}", "ground: {O: [0, 0], Q: [X, Y]}") + LOADED
    place = 0.5 * np.exp(1j * np.deg2rad(30)) + 0.4 * np.exp(1j * np.deg2rad(80))
    text = text.replace("X, Y", f"{place.real:.15g}, {place.imag:.15g}").replace(
        "outputs: [P, lower.angle]", "outputs: [gap]"
    )
    text = text.replace("  drives: {shoulder", "  measures: {gap: {distance: [P, Q]}}\n  drives: {shoulder")
    unloaded = text.replace("load: [100, -50, 10]", "load: [0, 0, 0]")
    compliance = matrix(ask_stiffness(ARM), "C")[:2]
    for study, mean_load in ((text, [100, -50, 10]), (unloaded, [0, 0, 0])):
        result = ask(study, "reliability.methods=[analytic, second_order, monte_carlo]")
        rng = np.random.default_rng(2)
        load = np.array(mean_load)[:, None] + np.array([[20.0], [0.0], [1.0]]) * rng.standard_normal((3, 400_000))
        longer = 1e-5 / 3 * rng.standard_normal(400_000)
        moved = compliance @ load + longer * np.array([[np.cos(np.deg2rad(30))], [np.sin(np.deg2rad(30))]])
        length = np.hypot(*moved)
        for method in ("analytic", "second_order", "monte_carlo"):
            mean, sigma = (pick(result, "moments", name, method=method)[0] for name in ("mean", "sigma"))
            assert mean == pytest.approx(length.mean(), rel=0.01), (method, mean_load)
            assert sigma == pytest.approx(length.std(), rel=0.01), (method, mean_load)
