"""Local indices and their statistics: exact values, infinite ones, orders of convergence, other questions all over."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers.stiffness import FIVE_BAR as ELASTIC_FIVE_BAR
from helpers.studies import FIVE_BAR, study_of

import mechdesign
from mechdesign.ground import indices
from mechdesign.ground.indices import USUAL
from mechdesign.ground.rows import choose
from mechdesign.questions.poses import study_poses
from mechdesign.questions.workspace.answer import answer
from mechdesign.questions.workspace.index import prepare
from mechdesign.questions.workspace.local import Local
from mechdesign.questions.workspace.question import questions
from mechdesign.region.rays import BATCH

CONFIGS = Path(__file__).parents[2] / "configs"
L1, L2 = np.sqrt(2.0), 1.0
ARM = """
units: {length: dimensionless}
mechanism:
  parameters: {a: sqrt(2), b: 1.0}
  links:
    ground: {O: [0, 0]}
    upper: [O, E, a]
    lower: [E, P, b]
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [1, 1], P: [2, 1]}
workspace: {point: P, scan: {about: [0, 0]}, integrate: {tolerance: 1e-7}}
"""
ERRORS = (
    "reliability={dimensions: {'*.length': 0.001}, outputs: [P], methods: [analytic], limits: {P.x: 0.002, P.y: 0.002},"
    " poses: workspace}"
)
ELASTIC = (
    "stiffness={at: P, sections: {bar: {E: 200e9, width: 0.01, height: 0.01}}, actuators: {q1: 1e4, q2: 1e4},"
    " elastic: {left: bar, left_rod: bar, right: bar, right_rod: bar}, poses: workspace}"
)


def local(study: mechdesign.Study, *places: complex) -> dict[str, np.ndarray]:
    """The Jacobian's indices and its determinant at points."""
    found = Local.at(questions(study)[0].field, np.array(places), {})
    values = {index.name: np.asarray(index.values(found)) for index in prepare(study, USUAL)}
    return values | {"det_J": np.asarray(found.determinant)}


def arm_statistics() -> dict[str, float]:
    """Over the ring of a two-link arm, for indices of q2 alone: the area element is l1 l2 |sin q2| dq1 dq2."""
    nodes, weights = np.polynomial.legendre.leggauss(300)
    # Split at isotropy, where the singular values meet; largest and smallest values lie there or at the ends.
    edges = [0.0, 0.75 * np.pi, np.pi]
    q = np.concatenate([edges, *(0.5 * (b + a) + 0.5 * (b - a) * nodes for a, b in pairwise(edges))])
    w = np.concatenate([np.zeros(3), *(0.5 * (b - a) * weights for a, b in pairwise(edges))])
    jacobian = np.empty((len(q), 2, 2))
    jacobian[:, 0, 1] = jacobian[:, 1, 1] = 0.0
    jacobian[:, 0] = np.stack([-L2 * np.sin(q), -L2 * np.sin(q)], axis=-1)
    jacobian[:, 1] = np.stack([L1 + L2 * np.cos(q), L2 * np.cos(q)], axis=-1)
    largest, least = np.linalg.svd(jacobian, compute_uv=False).T
    share = w * np.sin(q)
    share /= share.sum()
    found = {}
    values = {
        "inverse_condition": least / largest, "manipulability": L1 * L2 * np.sin(q), "sigma_min": least,
        "sigma_max": largest,
    }  # fmt: skip
    for name, value in values.items():
        mean = share @ value
        found |= {f"{name}_mean": mean, f"{name}_std": np.sqrt(share @ (value - mean) ** 2),
                  f"{name}_min": value.min(), f"{name}_max": value.max()}  # fmt: skip
    return found


def test_two_link_arm_is_isotropic_at_135_degrees() -> None:
    """l1 : l2 = sqrt 2 : 1 [Salisbury & Craig 1982]; manipulability l1 l2 |sin q2| [Yoshikawa 1985]."""
    study = study_of(ARM)
    q2 = np.radians([135.0, 60.0, 100.0])
    found = local(study, *(L1 + L2 * np.exp(1j * q2)))
    assert found["inverse_condition"][0] == pytest.approx(1, abs=1e-7)
    assert found["manipulability"] == pytest.approx(L1 * L2 * np.sin(q2), rel=1e-13)
    assert found["sigma_min"] * found["sigma_max"] == pytest.approx(found["manipulability"], rel=1e-13)
    assert found["sigma_min"][0] == pytest.approx(1, abs=1e-7)
    assert found["resistivity"] == pytest.approx(1 / found["manipulability"], rel=1e-14)


@pytest.mark.slow
def test_statistics_over_the_ring_of_an_arm() -> None:
    """Against one integral over q2; largest and smallest value within the rest of the search's last grid."""
    row = mechdesign.workspace(study_of(ARM)).main
    assert row["area"][0] == pytest.approx(np.pi * ((L1 + L2) ** 2 - (L1 - L2) ** 2), rel=1e-12)
    for name, value in arm_statistics().items():
        near = 3e-5 if name.endswith(("_min", "_max")) else 1e-6
        assert row[name][0] == pytest.approx(value, rel=near, abs=1e-4 if name.endswith("_min") else 0), name
        assert abs(row[name][0] - value) <= max(row[f"{name}_error"][0], 2e-6), name
    assert row["inverse_condition_mean"][0] == row["GII"][0]
    assert row["resistivity_mean"][0] == row["GRI"][0]


@pytest.mark.nightly
def test_infinite_statistics_are_said_to_be() -> None:
    """1/|sin q2| has a mean over the ring, but no largest value, and its square no integral."""
    row = mechdesign.workspace(study_of(ARM)).main
    assert row["resistivity_max"][0] == row["resistivity_std"][0] == np.inf
    assert row["resistivity_min"][0] == pytest.approx(1 / (L1 * L2), rel=1e-6)
    assert row["manipulability_min"][0] == row["sigma_min_min"][0] == row["inverse_condition_min"][0] == 0
    # Of a five-bar |det J| grows as 1/distance towards its forward singularity, whether that ends the region or not.
    for assembly in ("any", "same"):
        row = mechdesign.workspace(study_of(FIVE_BAR, f"workspace.assembly={assembly}")).main
        infinite = {name for name in row.names if np.isinf(row[name][0])}
        assert infinite == {
            *(f"{name}_{kind}" for name in ("manipulability", "sigma_max") for kind in ("mean", "max", "std")),
            "resistivity_max", "resistivity_std",
        }  # fmt: skip
        # Where both legs are stretched, at (0, 0.632), the drives move nothing: even the largest singular value is 0.
        assert row["sigma_max_min"][0] == 0


@pytest.mark.nightly
def test_five_bar() -> None:
    """Links 0.25 and 0.40, motors at (+-0.15, 0): the part that two rings share, and J at a point, elbows out."""
    row = mechdesign.workspace(study_of(FIVE_BAR)).main
    assert row["area"][0] == pytest.approx(0.799441, abs=5e-7)
    assert 0 < row["area_error"][0] < 1e-6 * row["area"][0]
    at = local(study_of(FIVE_BAR), 0.05 + 0.45j)
    assert 1 / at["inverse_condition"][0] == pytest.approx(1.183957, abs=5e-7)
    assert abs(at["det_J"][0]) == pytest.approx(0.062996, abs=5e-7)


@pytest.mark.nightly
def test_the_same_assembly_is_never_averaged_across_a_singularity() -> None:
    """det J has one sign where the assembly is the sketch's; `any` goes over both."""
    signs = {}
    for assembly in ("same", "any"):
        table = mechdesign.workspace(study_of(FIVE_BAR, f"workspace.assembly={assembly}")).tables["local"]
        signs[assembly] = set(np.sign(table["det_J"]).tolist())
    assert len(signs["same"]) == 1
    assert signs["any"] == {-1.0, 1.0}


@pytest.mark.nightly
@pytest.mark.parametrize("angle", [0.0, 10.0, 30.0])
def test_platform_in_one_assembly(angle: float) -> None:
    """3-RPR: closed-form inverse problem, forward singularities where the legs' lines meet in a point."""
    limits = "mechanism.limits=[" + ", ".join(f"{{drive: l{k}, min: 0.4, max: 1.4}}" for k in (1, 2, 3)) + "]"
    section = f"workspace={{point: P, at: {{platform.angle: {angle}}}, characteristic_length: 0.2}}"
    study = mechdesign.load(CONFIGS / "planar_3rpr.yaml", [limits, section])
    table = mechdesign.workspace(study).tables["local"]
    assert len(set(np.sign(table["det_J"]).tolist())) == 1
    # The determinant is per radian, whatever the characteristic length.
    turn = np.exp(1j * np.radians(angle))
    k = len(table) // 2
    arms = np.array([-0.2, 0.2, 0.25 + 0.15j]) * turn
    legs = table["x"][k] + 1j * table["y"][k] + arms - np.array([-0.6, 0.6, 0.3 - 0.2j])
    units = legs / np.abs(legs)
    rows = np.stack([units.real, units.imag, (np.conj(arms) * units).imag], axis=-1)
    assert abs(table["det_J"][k]) == pytest.approx(1 / abs(np.linalg.det(rows)), rel=1e-9)
    homogeneous = np.linalg.svd(np.linalg.inv(rows) * np.array([1, 1, 0.2])[:, None], compute_uv=False)
    assert table["sigma_max"][k] == pytest.approx(homogeneous[0], rel=1e-9)
    assert table["sigma_min"][k] == pytest.approx(homogeneous[-1], rel=1e-9)


@pytest.mark.nightly
def test_platform_on_three_cranks_at_several_orientations() -> None:
    """3-RRR: the forward problem is Newton's, the inverse closed form; rings of three legs, moved by the platform."""
    section = "workspace={point: P, at: {platform.angle: [0, 15]}, characteristic_length: 60, assembly: any}"
    study = mechdesign.load(CONFIGS / "gallery" / "rrr_platform.yaml", [section, "workspace.indices=[]"])
    row = mechdesign.workspace(study).main
    x, y = np.meshgrid(*(np.linspace(-150, 150, 1501),) * 2)
    base = 250 * np.array([-np.exp(1j * np.pi / 6), np.exp(-1j * np.pi / 6), 1j])
    corner = 60 * np.array([-np.exp(1j * np.pi / 6), np.exp(-1j * np.pi / 6), 1j])
    for k, angle in enumerate(np.radians([0, 15])):
        reach = np.abs((x + 1j * y)[..., None] + corner * np.exp(1j * angle) - base)
        assert row["area"][k] == pytest.approx((reach <= 240).all(axis=-1).sum() * 0.2**2, rel=2e-3)


@pytest.mark.nightly
def test_only_the_indices_asked_for() -> None:
    result = mechdesign.workspace(study_of(FIVE_BAR, "workspace.indices=sigma_min"))
    statistics = [name for name in result.main.names if name.startswith(("sigma", "mani", "inverse", "resis"))]
    assert statistics == [f"sigma_min_{kind}" for kind in ("mean", "min", "max", "std")] + [
        f"sigma_min_{kind}_error" for kind in ("mean", "min", "max", "std")
    ]
    assert "manipulability" not in result.tables["local"]
    assert result.tables["local"].names[:5] == ("x", "y", "inverse_condition", "resistivity", "det_J")


@pytest.mark.nightly
def test_stiffness_and_position_errors_are_indices() -> None:
    """The same numbers as the questions themselves give at the nodes of the workspace."""
    names = ["k_min", "k_direction", "deflection", "sigma_position", "reliability"]
    study = study_of(FIVE_BAR, ERRORS, ELASTIC, f"workspace.indices=[{', '.join(names)}]", "stiffness.direction=30",
                     "stiffness.loads=[[100, 0], [0, 50]]", "workspace.integrate.tolerance=1e-3")  # fmt: skip
    row = mechdesign.workspace(study).main
    poses = study_poses(study, "stiffness")
    place = poses.values["P.x"] + 1j * poses.values["P.y"]
    assert 1000 < poses.count <= 2000
    found = Local.at(questions(study)[0].field, place, {})
    k_min, k_direction, deflection, sigma, chance = (np.asarray(i.values(found)) for i in prepare(study, names))
    stiff = mechdesign.stiffness(study)
    assert k_min == pytest.approx(stiff.main["k_min"], rel=1e-6)
    assert k_direction == pytest.approx(stiff.main["k_direction"], rel=1e-6)
    moved = np.hypot(stiff.tables["deflections"]["dx"], stiff.tables["deflections"]["dy"]).reshape(-1, 2)
    assert deflection == pytest.approx(moved.max(axis=1), rel=1e-6)
    errors = mechdesign.reliability(study)
    moments = errors.tables["moments"]
    x, y = (moments["sigma"][moments["output"] == f"P.{axis}"] for axis in "xy")
    assert sigma == pytest.approx(np.hypot(x, y), rel=1e-6)
    table = errors.tables["reliability"]
    expected = table["reliability"][table["scope"] == "pose"]
    assert chance == pytest.approx(expected, abs=1e-9)
    assert row["sigma_position_min"][0] <= sigma.min() * (1 + 1e-5)
    assert row["k_min_max"][0] >= k_min.max() * (1 - 1e-5)
    assert expected.min() < row["reliability_mean"][0] < row["reliability_max"][0] <= 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("workspace.indices=[k_min]", "workspace.indices.0: the index 'k_min' needs the stiffness section"),
        ("workspace.indices=[sigma_position]", "needs the reliability section"),
        ("workspace.indices=[dexterity]", "workspace.indices.0"),
        ("reliability={poses: workspace, dimensions: {q1: 1}}", None),
    ],
)
def test_what_indices_need(change: str, said: str | None) -> None:
    if said is None:
        assert study_poses(study_of(FIVE_BAR, change), "reliability").grid[1] == 33
        return
    with pytest.raises(mechdesign.StudyError, match=said):
        study_of(FIVE_BAR, change)


def test_a_section_that_is_wrong_is_not_said_to_be_missing() -> None:
    for change in (
        ["stiffness={at: P, stiff: 1}", "workspace.indices=[k_min]"],
        ["stiffness={at: P, poses: workspace}", "workspace.shape=1"],
    ):
        with pytest.raises(mechdesign.StudyError, match="unknown key") as caught:
            study_of(FIVE_BAR, *change)
        assert len(caught.value.problems) == 1


@pytest.mark.parametrize(("name", "said"), [("k_direction", "needs a direction"), ("deflection", "needs loads")])
def test_stiffness_indices_need_what_they_are_about(name: str, said: str) -> None:
    study = study_of(FIVE_BAR, ELASTIC, f"workspace.indices=[{name}]")
    with pytest.raises(mechdesign.StudyError, match=said):
        mechdesign.workspace(study)


def test_stiffness_indices_need_something_that_gives() -> None:
    """Where nothing does, k_min is infinite everywhere: neither integrated nor drawn."""
    study = study_of(FIVE_BAR, "stiffness={at: P}", "workspace.indices=[k_min]")
    with pytest.raises(mechdesign.StudyError, match="stiffness: indices of stiffness need something that gives"):
        mechdesign.workspace(study)


def test_reliability_as_an_index_needs_limits() -> None:
    study = study_of(FIVE_BAR, "reliability={dimensions: {q1: 0.1}}", "workspace.indices=[reliability]")
    with pytest.raises(mechdesign.StudyError, match="needs limits"):
        mechdesign.workspace(study)


def test_limits_of_efforts_and_joint_forces_are_an_index() -> None:
    """Of an arm whose links of 2 and 1 kg weigh with errors: a normal torque at the first joint, in closed form."""
    study = study_of(
        ARM.replace("length: dimensionless", "length: m")
        .replace("[O, E, a]", "{from: O, to: E, length: a, mass: 2}")
        .replace("[E, P, b]", "{from: E, to: P, length: b, mass: 1}"),
        "dynamics={gravity: [0, -9.81], poses: [{q1: 0, q2: 90}]}",
        "reliability={dimensions: {upper.mass: 0.3, lower.mass: 0.6}, limits: {q1_effort: 4, O_force: {usl: 31}}}",
        "workspace.indices=[reliability]",
    )
    places = np.array([2.0 + 0.5j, 0.3 + 1.9j, -1.2 + 1.1j])
    found = Local.at(questions(study)[0].field, places, {})
    (index,) = prepare(study, ["reliability"])
    elbow = L1 * np.exp(1j * np.asarray(found.configuration.value(study.mechanism.coordinate("q1"))))
    arms = 9.81 * np.array([elbow.real / 2, (elbow.real + places.real) / 2])
    deviations = np.array([0.1, 0.2])
    rng = np.random.default_rng(1)
    drawn = deviations[:, None] * rng.standard_normal((2, 400_000))
    kept = (np.abs(arms.T @ drawn) < 4) & (9.81 * (3 + drawn.sum(axis=0)) < 31)
    assert np.asarray(index.values(found)) == pytest.approx(kept.mean(axis=1), abs=0.003)


@pytest.mark.slow
def test_an_index_with_an_upper_bound_is_nowhere_infinite(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that grows as 1/distance towards a singularity, as far as its bound."""
    growing = replace(
        indices.index("resistivity"), bounds=(0.0, 1.0),
        prepare=lambda study: lambda local: np.minimum(1e-12 / np.abs(local.determinant), 1.0),
    )  # fmt: skip
    monkeypatch.setattr(indices, "index", lambda name: growing)
    study = study_of(ARM, "workspace.indices=[resistivity]", "workspace.integrate.tolerance=1e-3")
    row = mechdesign.workspace(study).main
    assert 0 < row["resistivity_mean"][0] < row["resistivity_max"][0] <= 1


@pytest.mark.slow
def test_order_of_the_quadrature() -> None:
    """The true error falls with the tolerance, in proportion over four decades, and stays below the estimate."""
    exact = arm_statistics()
    names = ["inverse_condition_mean", "sigma_min_mean", "sigma_max_mean", "manipulability_mean"]
    tolerances = np.array([1e-2, 1e-4, 1e-6])
    errors = np.empty((len(tolerances), len(names)))
    # Seen from a point of the ring: several intervals a ray, and rays that touch the hole.
    study = study_of(ARM, "workspace.scan.about=[1.3, 0.2]", "workspace.integrate={}")
    for k, tolerance in enumerate(tolerances):
        found = answer(questions(study, tolerance, names)[0], {}, 1, BATCH)
        for j, name in enumerate(names):
            errors[k, j] = abs(found.values[name][0] / exact[name] - 1)
            assert errors[k, j] <= found.errors[name][0] / exact[name] + 1e-12, (name, tolerance)
    assert (errors <= tolerances[:, None]).all()


@pytest.mark.slow
def test_order_of_the_midpoint_rule() -> None:
    """Manipulability has a square root at the boundary, where the midpoint rule is of order 3/2 and no more."""
    exact = arm_statistics()["manipulability_mean"]
    nodes = np.array([50, 100, 200, 400])
    errors = []
    for count in nodes:
        study = study_of(ARM, f"workspace.integrate={{rule: midpoint, nodes: {count}}}", "workspace.scan.rays=8")
        errors.append(abs(answer(questions(study, columns=["manipulability_mean"])[0], {}, 1, BATCH)
                          .values["manipulability_mean"][0] - exact))  # fmt: skip
    order = -np.polyfit(np.log(nodes), np.log(errors), 1)[0]
    assert order == pytest.approx(1.5, abs=0.1)


PLATFORM = """
mechanism:
  links:
    ground: {A1: [-1000, 0], A2: [1000, 0], A3: [0, 1700]}
    l1: {from: A1, to: B1, telescopic: true}
    l2: {from: A2, to: B2, telescopic: true}
    l3: {from: A3, to: B3, telescopic: true}
    plate: {B1: [-200, 0], B2: [200, 0], B3: [0, 300], P: [0, 100]}
  drives: [l1, l2, l3]
  sketch: {B1: [-215, 540], B2: [180, 480], B3: [30, 800]}
  limits: [{drive: l1, min: 600, max: 1300}, {drive: l2, min: 600, max: 1300}, {drive: l3, min: 600, max: 1300}]
workspace: {point: P, at: {plate.angle: [-20, 20, -10]}, characteristic_length: 100, indices: [sigma_min]}
"""


@pytest.mark.nightly
def test_totals_over_all_held_values_and_empty_regions_among_them() -> None:
    result = mechdesign.workspace(study_of(PLATFORM))
    indices, totals = result.tables["indices"], result.tables["totals"]
    assert list(indices["plate.angle"]) == [-20, 20, -10]
    assert indices["area"][1] == 0 < indices["area"][0] < indices["area"][2]
    told = {row["statistic"]: row for row in totals}
    assert {"GII", "area", "box_area", "sigma_min_min", "circle_radius"} <= set(told)
    area = told["area"]
    assert (area["smallest"], area["smallest_at_plate.angle"]) == (0, 20)
    assert (area["largest"], area["largest_at_plate.angle"]) == (indices["area"][2], -10)
    assert area["mean"] == pytest.approx(indices["area"].sum() / 3)
    assert (area["unit"], area["values"], area["empty"]) == ("mm^2", 3, 1)
    # What an empty region has not is not counted.
    assert told["GII"]["mean"] == pytest.approx(np.nanmean(indices["GII"]))
    assert told["GII"]["smallest"] == np.nanmin(indices["GII"])
    chosen = choose(result, "totals.area.smallest", {})
    assert chosen.values[chosen.counts].tolist() == [0.0]
    # The assembly that is not the sketch's has all of it.
    assert any(
        "at plate.angle = 20" in warning and "and 0 mm^2 here" in warning for warning in map(str, result.warnings)
    )


@pytest.mark.nightly
def test_the_point_of_a_workspace_may_be_an_end() -> None:
    """The map says of every node what the question says there."""
    text = (
        ELASTIC_FIVE_BAR.replace("  poses: [{P.x: 0.05, P.y: 0.45}]\n", "  bearings: {P: 5e3}\n")
        + """
workspace: {point: b2.P, scan: {about: [0, 0.45], rays: 12}}
reliability:
  dimensions: {load.fy: {sigma: 5}, b1.length: 1e-4}
  poses: workspace
  outputs: [b1.P, b2.P, P]
  limits: {b2.P.y: 2e-3}
  load: [0, -20]
  methods: analytic
"""
    )
    study = study_of(text, "stiffness.at=b1.P")
    poses = study_poses(study, "reliability")
    place = poses.values["b2.P.x"] + 1j * poses.values["b2.P.y"]
    found = Local.at(questions(study)[0].field, place, {})
    sigma, chance = (np.asarray(index.values(found)) for index in prepare(study, ["sigma_position", "reliability"]))
    result = mechdesign.reliability(study)
    table, told = result.tables["moments"], result.tables["reliability"]
    x, y, other = (table["sigma"][table["output"] == name] for name in ("b2.P.x", "b2.P.y", "b1.P.y"))
    assert sigma == pytest.approx(np.hypot(x, y), rel=1e-6)
    assert np.mean(np.abs(other - y) > 0.1 * y) > 0.9
    assert chance == pytest.approx(told["reliability"][told["scope"] == "pose"], abs=1e-8)
