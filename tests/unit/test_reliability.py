"""The reliability question: sources, limits, poses, counts, and independence of the number of threads."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy
from helpers.studies import PLATFORM
from scipy.special import ndtr

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
SLIDER_CRANK = """
mechanism:
  parameters: {a: 100, b: 200}
  links:
    ground: {O: [0, 0], G: [0, -20]}
    crank: [O, A, a]
    rod: [A, B, b]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {theta: {angle: crank}}
  sketch: {A: [87, 50], B: [285, -20]}
reliability:
  poses: [{theta: 60}]
  outputs: [B.x]
  samples: 50000
"""
LEVER = """
mechanism:
  links: {ground: {O: [0, 0]}, lever: [O, P, 100]}
  drives: {theta: {angle: lever}}
  sketch: {P: [100, 0]}
reliability:
  poses: [{theta: 30}]
"""


def ask(tmp_path: Path, text: str, *lines: str, jobs: int = 1, seed: int | None = None) -> mechdesign.Answer:
    file = tmp_path / "study.yaml"
    file.write_text(text + "".join(f"  {line}\n" for line in lines))
    return mechdesign.reliability(mechdesign.load(file), jobs=jobs, seed=seed)


def pick(result: mechdesign.Answer, table: str, column: str, **chosen: object) -> np.ndarray:
    found = result.tables[table]
    rows = np.ones(len(found), dtype=bool)
    for name, value in chosen.items():
        rows &= found[name] == value
    return found[column][rows]


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["two_link_arm", "toggle"])
def test_the_number_of_threads_changes_no_bit(name: str) -> None:
    study = mechdesign.load(CONFIGS / f"{name}.yaml", overrides=["reliability.samples=20000"])
    one, two = (mechdesign.reliability(study, jobs=jobs) for jobs in (1, 2))
    assert one.tables.keys() == two.tables.keys()
    for key, table in one.tables.items():
        for column in table.columns:
            assert column.values.tobytes() == two.tables[key][column.name].tobytes()


@pytest.mark.slow
def test_seed_zero_is_a_seed(tmp_path: Path) -> None:
    lines = ["dimensions: {a: 0.3}", "samples: 1000"]
    text = SLIDER_CRANK.replace("  samples: 50000\n", "")
    sigmas = [pick(ask(tmp_path, "seed: 5" + text, *lines, seed=s), "moments", "sigma", method="monte_carlo")[0]
              for s in (None, 0, 5)]  # fmt: skip
    assert sigmas[0] == sigmas[2]
    assert sigmas[1] != sigmas[0]


def test_slider_crank_error_of_every_kind_of_source(tmp_path: Path) -> None:
    """First order against the closed form of the offset slider-crank, and simulation against both."""
    result = ask(
        tmp_path,
        SLIDER_CRANK,
        "dimensions: {a: 0.3, rod.length: 0.6, ground.G.y: 0.3, theta: 0.1}",
        "limits: {B.x: 0.5}",
    )
    theta, a, b, e = np.radians(60.0), 100.0, 200.0, -20.0
    sine = (a * np.sin(theta) - e) / b
    lean = sine / np.sqrt(1 - sine**2)
    slopes = {
        "a": np.cos(theta) - lean * np.sin(theta),
        "rod.length": 1 / np.sqrt(1 - sine**2),
        "ground.G.y": lean,
        "theta": -a * np.sin(theta) - lean * a * np.cos(theta),
    }
    sensitivity = result.tables["contributions"]
    assert dict(zip(sensitivity["source"], sensitivity["sensitivity"], strict=True)) == pytest.approx(slopes, rel=1e-12)
    sigmas = {"a": 0.1, "rod.length": 0.2, "ground.G.y": 0.1, "theta": np.radians(0.1) / 3}
    expected = np.sqrt(sum((slopes[name] * sigmas[name]) ** 2 for name in slopes))
    worst = sum(abs(slopes[name]) * 3 * sigmas[name] for name in slopes)
    assert pick(result, "moments", "sigma", method="analytic") == pytest.approx([expected], rel=1e-12)
    assert pick(result, "moments", "worst_case", method="analytic") == pytest.approx([worst], rel=1e-12)
    assert pick(result, "moments", "sigma", method="monte_carlo") == pytest.approx([expected], rel=4 / np.sqrt(1e5))
    failure = pick(result, "reliability", "failure", method="analytic")[0]
    assert failure == pytest.approx(2 * ndtr(-0.5 / expected), rel=1e-12)
    low, high = (pick(result, "reliability", name, method="monte_carlo")[0] for name in ("failure_low", "failure_high"))
    assert low < failure < high


def test_slider_crank_failure_against_its_exact_probability(tmp_path: Path) -> None:
    """P(|ds| > 0.5) with sigma 0.1, 0.2, 0.1 of a, b and the offset: 2.7717025e-2 at 30 deg, 4.0996265e-2 at 60 deg."""
    text = SLIDER_CRANK.replace("{theta: 60}", "{theta: 30}, {theta: 60}")
    result = ask(tmp_path, text, "dimensions: {a: 0.3, b: 0.6, ground.G.y: 0.3}", "limits: {B.x: 0.5}")
    exact = np.array([2.7717025e-2, 4.0996265e-2])
    failure = pick(result, "reliability", "failure", method="monte_carlo")
    assert (np.abs(failure - exact) < 4 * np.sqrt(exact / 50_000)).all()
    assert pick(result, "reliability", "failure", method="analytic") == pytest.approx(exact, rel=1e-3)


def test_a_parameter_that_sets_two_places_varies_both_and_says_so(tmp_path: Path) -> None:
    text = SLIDER_CRANK.replace("b: 200", "b: 2*a")
    together = ask(tmp_path, text, "dimensions: {a: 0.3}", "methods: [analytic]")
    alone = ask(tmp_path, SLIDER_CRANK, "dimensions: {a: 0.3, b: 0.6}", "methods: [analytic]")
    slopes = alone.tables["contributions"]["sensitivity"]
    assert together.tables["contributions"]["sensitivity"] == pytest.approx([slopes[0] + 2 * slopes[1]], rel=1e-12)
    (told,) = together.warnings
    assert str(told) == "parameter that moves several dimensions together: 'a' crank.length, rod.length"


def test_a_place_varies_alone_beside_its_parameter(tmp_path: Path) -> None:
    both = ask(tmp_path, SLIDER_CRANK, "dimensions: {a: 0.3, crank.length: 0.4}")
    one = ask(tmp_path, SLIDER_CRANK, "dimensions: {a: 0.5}")
    for method, rel in (("analytic", 1e-12), ("monte_carlo", 0.03)):
        sigma = pick(both, "moments", "sigma", method=method)
        assert sigma == pytest.approx(pick(one, "moments", "sigma", method=method), rel=rel)


def test_clearance_moves_the_pin_or_only_changes_the_length(tmp_path: Path) -> None:
    reach, spread = 0.05 + 0.03, (0.05**2 + 0.01**2) / 4
    for effect, expected in (("offset", (1.0, 1.0)), ("length", (np.cos(np.pi / 6), np.sin(np.pi / 6)))):
        # The lever turns about its pin at O: with `offset` that pin moves, with `length` the lever is longer.
        clearance = f"clearances: {{O: {{radial: 0.05, tolerance: 0.03, pin: uniform, link: lever, effect: {effect}}}}}"
        result = ask(tmp_path, LEVER, clearance, "samples: 50000", "outputs: [P]")
        assert pick(result, "contributions", "sensitivity") == pytest.approx(expected, rel=1e-12)
        sigma = np.array(expected) * np.sqrt(spread)
        assert pick(result, "moments", "sigma", method="analytic") == pytest.approx(sigma, rel=1e-12)
        assert pick(result, "moments", "sigma", method="monte_carlo") == pytest.approx(sigma, rel=0.015)
        worst = np.array(expected) * reach
        assert pick(result, "moments", "worst_case", method="analytic") == pytest.approx(worst, rel=1e-12)


def test_diametral_clearance_is_twice_the_radial_one(tmp_path: Path) -> None:
    clearance = "clearances: {{O: {{{}, pin: uniform, link: lever}}}}"
    sigmas = [
        ask(tmp_path, LEVER, clearance.format(text), "outputs: [P]", "methods: [analytic]").tables["moments"]["sigma"]
        for text in ("radial: 0.05, tolerance: 0.03", "diametral: 0.1, tolerance: 0.06")
    ]
    assert sigmas[0] == pytest.approx(sigmas[1], rel=1e-12)


def test_error_of_an_angle_is_in_the_study_unit_and_wrapped(tmp_path: Path) -> None:
    text = LEVER.replace("theta: 30", "theta: 180")
    result = ask(tmp_path, text, "dimensions: {theta: 0.6}", "outputs: [lever.angle]", "limits: {lever.angle: 0.4}")
    for method, rel in (("analytic", 1e-12), ("monte_carlo", 0.02)):
        assert pick(result, "moments", "nominal", method=method) == pytest.approx([180.0])
        assert pick(result, "moments", "mean", method=method) == pytest.approx([180.0], abs=0.005)
        assert pick(result, "moments", "sigma", method=method) == pytest.approx([0.2], rel=rel)
        assert pick(result, "reliability", "failure", method=method) == pytest.approx([2 * ndtr(-2.0)], rel=0.15)
    assert pick(result, "contributions", "sensitivity") == pytest.approx([1.0])


def test_limit_of_a_point_by_a_radius_and_of_one_side(tmp_path: Path) -> None:
    clearance = "clearances: {O: {radial: 0.3, pin: normal, link: lever}}"
    disc = ask(tmp_path, LEVER, clearance, "limits: {P: {radius: 0.2}}", "samples: 50000")
    # Rayleigh: both coordinates have sigma 0.1.
    exact = np.exp(-2.0)
    assert pick(disc, "reliability", "failure", method="analytic") == pytest.approx([exact], rel=1e-12)
    assert pick(disc, "reliability", "failure", method="monte_carlo") == pytest.approx(
        [exact], abs=4 * np.sqrt(exact / 5e4)
    )
    assert pick(disc, "reliability", "rho", method="analytic") == pytest.approx([0.0], abs=1e-12)
    side = ask(tmp_path, LEVER, clearance, "limits: {P.x: {max: 0.2}}", "samples: 50000")
    assert pick(side, "reliability", "failure", method="analytic") == pytest.approx([ndtr(-2.0)], rel=1e-12)
    assert pick(side, "reliability", "failure", method="monte_carlo") == pytest.approx([ndtr(-2.0)], rel=0.15)


@pytest.mark.slow
def test_a_pose_given_by_outputs_is_held_by_its_drives() -> None:
    """The same poses given by the tip: the drives are solved once and then held, so the errors are the same."""
    base = mechdesign.load(CONFIGS / "two_link_arm.yaml")
    pose = mechdesign.load(
        CONFIGS / "two_link_arm.yaml",
        overrides=["reliability.poses=[{P.x: 12.660254037844386, P.y: 11.92820323027551}]"],
    )
    by_drives, by_tip = mechdesign.reliability(base), mechdesign.reliability(pose)
    for name in ("mean", "sigma"):
        assert by_tip.tables["moments"][name] == pytest.approx(by_drives.tables["moments"][name][:4], rel=1e-9)


def test_a_pose_of_another_assembly_than_the_sketch_is_sampled_in_its_own(tmp_path: Path) -> None:
    """A slider-crank whose crank angle is found from a point of the rod: the mode of the forward dyad may differ."""
    text = """
mechanism:
  links: {ground: {A: [0, 0], D: [100, 0]}, crank: [A, B, 40], rod: [B, C, 90], rocker: [D, C, 70]}
  drives: {theta: {angle: crank}}
  sketch: {B: [20, 35], C: [95, 70]}
reliability:
  poses: [{rocker.angle: -100}]
  outputs: [C]
  dimensions: {rod.length: 0.3}
  samples: 20000
"""
    result = ask(tmp_path, text)
    simulated = pick(result, "moments", "sigma", method="monte_carlo")
    assert simulated == pytest.approx(pick(result, "moments", "sigma", method="analytic"), rel=0.03)
    assert pick(result, "moments", "mean", method="monte_carlo") == pytest.approx(
        pick(result, "moments", "nominal", method="monte_carlo"), abs=0.02
    )


def test_samples_that_cannot_be_assembled_are_failures(tmp_path: Path) -> None:
    """A crank of 100 against a rod of 100 +- 3 at 90 deg, the guide through O: half of the rods are too short."""
    text = """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 100]
    rod: [A, B, 101]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: O}}
  drives: {theta: {angle: crank}}
  sketch: {A: [70, 70], B: [142, 0]}
reliability:
  poses: [{theta: 90}]
  outputs: [B.x]
  dimensions: {rod.length: 3}
  limits: {B.x: 1000}
  samples: 20000
"""
    result = ask(tmp_path, text)
    chance = ndtr(-1.0)
    invalid = pick(result, "reliability", "invalid", method="monte_carlo")[0]
    assert invalid == pytest.approx(20_000 * chance, abs=4 * np.sqrt(20_000 * chance))
    assert pick(result, "reliability", "failure", method="monte_carlo") == [invalid / 20_000]
    assert result.counts["invalid"] == invalid
    assert np.isfinite(pick(result, "moments", "sigma", method="monte_carlo")).all()
    assert "cannot be assembled" in str(result.warnings[-1])


def test_a_listed_pose_that_fails_is_named_and_the_others_are_computed(tmp_path: Path) -> None:
    text = SLIDER_CRANK.replace("{theta: 60}", "{theta: 60}, {B.x: 500}")
    result = ask(tmp_path, text, "dimensions: {a: 0.3}", "limits: {B.x: 0.5}")
    assert "B.x = 500 mm" in result.failed
    assert np.isfinite(result.tables["moments"]["sigma"]).tolist() == [True, True, False, False]
    assert np.isnan(result.tables["reliability"]["reliability"]).tolist() == [False, False, True, True]
    with pytest.raises(mechdesign.AssemblyError, match=r"B\.x = 500 mm"):
        ask(tmp_path, SLIDER_CRANK.replace("{theta: 60}", "{B.x: 500}"), "dimensions: {a: 0.3}")


@pytest.mark.slow
def test_moments_along_a_sweep_import_no_part_of_scipy_nor_what_starts_processes(tmp_path: Path) -> None:
    """`scipy.special` takes as long to import as a thousand samples at every pose of a cycle take to draw."""
    file = tmp_path / "study.yaml"
    swept = SLIDER_CRANK.replace("poses: [{theta: 60}]", "sweep: {theta: {from: 0, to: 60, step: 30}}")
    file.write_text(swept + "  dimensions: {a: 0.3}\n")
    code = f"import sys, mechdesign; mechdesign.reliability(mechdesign.load({str(file)!r})); print(*sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120).stdout
    assert set(said.split()) & {"multiprocessing", *(f"scipy.{part}" for part in scipy.__all__)} == set()


def test_nothing_varies(tmp_path: Path) -> None:
    with pytest.raises(mechdesign.StudyError, match="what varies"):
        ask(tmp_path, SLIDER_CRANK)


@pytest.mark.slow
def test_velocity_errors_of_a_group_without_a_closed_form(tmp_path: Path) -> None:
    """A 3-RPR platform's forward problem: Newton's method for every sample, three orders."""
    dimensions = "dimensions: {l1: 0.03, ground.A2.x: 0.06, platform.B3.y: 0.06}"
    result = ask(tmp_path, PLATFORM, dimensions, "samples: 20000")
    analytic, simulated = (pick(result, "moments", "sigma", method=m) for m in ("analytic", "monte_carlo"))
    assert len(analytic) == 9
    assert simulated == pytest.approx(analytic, rel=0.03)
    assert result.counts["invalid"] == 0
