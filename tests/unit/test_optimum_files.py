"""The study file of an optimum: it says the same as the study with other numbers, runs alone and gives the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"

# An arm whose forearm should end on a path that is in a file; sizes stand in every form that a study has.
ARM = """\
# An arm.
units: {angle: deg}
mechanism:
  parameters: {r1: 5, lift: r1/10}    # upper arm
  links:
    ground: {O: [0, 0], Q: [0, 7]}
    upper: {from: O, to: E, length: r1}
    fore: [E, P, 6.0]                 # forearm
  drives: {theta1: {angle: upper}, theta2: {angle: fore}}
  sketch: {E: [4, 3], P: [6, 8]}
kinematics:
  path: {P: line.csv}                 # where it should go
  outputs: [P]
optimize:
  variables:
    r1: {from: 6, to: 8, step: 1}
    fore.length: {from: 5.5, to: 6.5, number: 3}
  maximize: kinematics.inverse_condition
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    folder = tmp_path / "studies"
    folder.mkdir()
    (folder / "line.csv").write_text("P.x,P.y\n6,4\n5,5\n4,6\n")
    (folder / "arm.yaml").write_text(ARM)
    return folder / "arm.yaml"


def written(study: mechdesign.Study, folder: Path) -> mechdesign.Answer:
    result = mechdesign.optimize(study)
    result.save(folder, plots=False)
    return result


def listed(folder: Path) -> set[str]:
    """Files that the manifest lists."""
    return set(json.loads((folder / "manifest.json").read_text())["files"])


@pytest.mark.nightly
@pytest.mark.parametrize("method", ["grid", "search"])
def test_the_optimum_runs_alone_and_has_the_indices_of_the_table(tmp_path, method):
    changes = [
        "optimize.variables.l_min.step=0.4", "optimize.variables.l_a.step=0.4", "workspace.integrate.tolerance=1e-4",
        "optimize.weights=[[1, 1, 1], {SUI: 1}]", f"optimize.method={method}",
        *(["optimize.evaluations=60"] if method == "search" else []),
    ]  # fmt: skip
    result = written(mechdesign.load(CONFIGS / "two_rrr.yaml", changes), tmp_path)
    for row, name in enumerate(("optimum.yaml", "optimum_2.yaml")):
        alone = mechdesign.load(tmp_path / name)
        assert alone.parameters.nominal["l_min"] == result.main["l_min"][row]
        # The grid's integrals are coarser than those of one region, by less than their tolerance.
        indices = mechdesign.workspace(alone).main
        for index in ("GII", "GRI", "SUI"):
            assert indices[index][0] == pytest.approx(result.main[index][row], rel=2e-4)
        again = mechdesign.optimize(
            mechdesign.load(
                tmp_path / name,
                ["optimize.method=grid", "optimize.evaluations=", "optimize.weights=[[1, 1, 1]]",
                 *(f"optimize.variables.{v}={{from: {v}_0, to: {v}_0, number: 1}}" for v in ("l_min", "l_a")),
                 *(f"mechanism.parameters.{v}_0={float(result.main[v][row])!r}" for v in ("l_min", "l_a"))],
            )
        )  # fmt: skip
        for index in ("GII", "GRI", "SUI"):
            assert again.main[index][0] == pytest.approx(result.main[index][row], rel=1e-9)


@pytest.mark.slow
def test_comments_are_kept_and_numbers_changed_in_place(arm, tmp_path):
    result = written(mechdesign.load(arm), tmp_path / "out")
    text = result.files["optimum.yaml"]
    r1, fore = (float(result.main[name][0]) for name in ("r1", "fore.length"))
    assert text.startswith("# Optimum of arm for the weights kinematics.inverse_condition 1: r1 = ")
    body = ARM.replace("r1: 5,", f"r1: {r1!r},").replace("[E, P, 6.0]", f"[E, P, {fore!r}]")
    assert text.partition("\n")[2] == body.replace("line.csv", '"input_line.csv"')


@pytest.mark.slow
def test_files_that_the_study_names_come_along(arm, tmp_path):
    result = written(mechdesign.load(arm), tmp_path / "out")
    (arm.parent / "line.csv").unlink()
    motion = mechdesign.kinematics(mechdesign.load(tmp_path / "out" / "optimum.yaml")).main
    assert motion["P.x"] == pytest.approx([6, 5, 4])
    assert motion["inverse_condition"].min() == pytest.approx(result.main["kinematics.inverse_condition"][0], rel=1e-12)


def test_overrides_and_seed_become_part_of_the_text(arm, tmp_path):
    study = mechdesign.load(arm, ["mechanism.links.ground.Q=[0, 8]"], seed=5)
    text = written(study, tmp_path).files["optimum.yaml"]
    assert "# upper arm" in text
    alone = mechdesign.load(tmp_path / "optimum.yaml")
    assert (alone.seed, alone.mechanism.nominal["ground.Q.y"]) == (5, 8)


def test_overrides_that_change_more_than_numbers(arm, tmp_path):
    study = mechdesign.load(arm, ["kinematics={poses: [{theta1: 30, theta2: 80}], outputs: [P]}"])
    result = written(study, tmp_path)
    alone = mechdesign.load(tmp_path / "optimum.yaml")
    assert alone.kinematics is not None
    assert alone.kinematics.path is None
    assert alone.mechanism.nominal["upper.length"] == result.main["r1"][0]
    assert result.files.keys() == {"optimum.yaml"}


@pytest.mark.slow
def test_texts_are_hashed_and_removed_when_a_new_result_has_none(arm, tmp_path):
    study = mechdesign.load(arm, ["optimize.weights=[[1], [2]]"])
    written(study, tmp_path)
    assert {"optimum.yaml", "optimum_2.yaml", "input_line.csv"} < listed(tmp_path)
    written(mechdesign.load(arm), tmp_path)
    assert not (tmp_path / "optimum_2.yaml").exists()
    assert {path.name for path in tmp_path.glob("*.*")} - {"studies"} == {
        *listed(tmp_path), "manifest.json"}  # fmt: skip


def test_a_sketch_that_would_choose_another_assembly_is_drawn_anew(tmp_path):
    """The elbow stays on its side of the line from base to slider, though that line moves across the sketched elbow."""
    path = tmp_path / "slider.yaml"
    path.write_text(
        """\
mechanism:
  parameters: {e: 0}
  links:
    ground: {O: [0, 0], G: [0, e]}
    crank: [O, A, 40]
    rod: [A, B, 120]
    slider: {B: [0, 0]}
  joints: {guide: {prismatic: [ground, slider], through: G}}
  drives: {slide: {slide: guide}}
  sketch: {A: [35, 15], B: [140, 0]}
kinematics: {poses: [{slide: 130}], outputs: [A]}
optimize:
  variables: {e: {from: 60, to: 70, step: 10}}
  maximize: kinematics.A.y
"""
    )
    study = mechdesign.load(path)
    result = written(study, tmp_path / "out")
    alone = mechdesign.load(tmp_path / "out" / "optimum.yaml")
    assert not [warning for warning in map(str, result.warnings) if "optimum.yaml" in warning]
    assert mechdesign.kinematics(alone).main["A.y"][0] == pytest.approx(result.main["kinematics.A.y"][0], rel=1e-9)
    assert np.isfinite(result.main["kinematics.A.y"][0])


@pytest.mark.nightly
@pytest.mark.parametrize("height", [3.0, 5.0])
def test_a_sketch_in_which_poses_of_the_workspace_would_assemble_otherwise_is_drawn_anew(tmp_path, height):
    """The base moves until the sketched elbow lies on the line to the point, or beyond it; the drives show neither."""
    path = tmp_path / "arm.yaml"
    path.write_text(
        f"""\
mechanism:
  parameters: {{h: 0}}
  links: {{ground: {{O: [0, h]}}, upper: [O, A, 10], fore: [A, P, 6]}}
  drives: {{q1: {{angle: upper}}, q2: {{angle: fore, from: upper}}}}
  limits: [{{drive: q1, min: 0, max: 90}}, {{drive: q2, min: -100, max: -20}}]
  sketch: {{A: [8, 3], P: [12, 3]}}
workspace: {{point: P, indices: []}}
optimize:
  variables: {{h: {{from: {height}, to: {height}, number: 1}}}}
  maximize: area
"""
    )
    study = mechdesign.load(path)
    result = written(study, tmp_path / "out")
    alone = mechdesign.load(tmp_path / "out" / "optimum.yaml")
    assert mechdesign.workspace(alone).main["area"] == pytest.approx(result.main["area"], rel=1e-5)
    assert not any("sketch" in warning for warning in map(str, result.warnings))


def test_an_optimum_that_is_stopped_between_its_poses_is_told(tmp_path):
    # With the crank at 180 deg A is 160 from D, which rod and rocker do not reach.
    text = """\
mechanism:
  parameters: {c: 45}
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 60], rod: [A, B, 70], rocker: [D, B, c]}
  drives: {theta: {angle: crank}}
  sketch: {A: [60, 0], B: [94, 50]}
kinematics: {poses: [{theta: 40}, {theta: 60}, {theta: 320}], outputs: [B.x]}
optimize: {variables: {c: {from: 45, to: 46, step: 1}}, maximize: kinematics.B.x}
"""
    (tmp_path / "rocker.yaml").write_text(text)
    told = [*map(str, mechdesign.optimize(mechdesign.load(tmp_path / "rocker.yaml")).warnings)]
    assert len(told) == 1
    assert "between poses 2 and 3 (60 to 320 deg) the mechanism is stopped" in told[0]
    assert "kinematics.conditioning, at_least" in told[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("links", "more", "variable", "place"),
    [
        pytest.param(
            "arm: {points: {O: [0, 0], P: [100, 0]}, mass: 2 kg, center: [30, 5]}", "drives: [arm]", "arm.P.x",
            ("links", "arm", "points", "P", 0), id="a point of a link with a mass",
        ),
        pytest.param(
            "arm: [O, A, 20]\n    follower: {points: {F: [0, 0]}}\n"
            "  joints: {guide: {prismatic: [ground, follower], through: O, direction: 90}}",
            "drives: [arm]\n  couplings: {lift: {set: guide, to: 40 + 5*cos(arm), cam: "
            "{link: arm, roller: F, radius: 8}}}\n  sketch: {A: [20, 0], F: [0, 45]}",
            "lift.radius", ("couplings", "lift", "cam", "radius"), id="the roller of a cam",
        ),
    ],
)  # fmt: skip
def test_a_dimension_stands_in_the_file_of_the_optimum_where_the_study_has_it(tmp_path, links, more, variable, place):
    text = (
        f"mechanism:\n  links:\n    ground: {{O: [0, 0]}}\n    {links}\n  {more}\n"
        "kinematics: {sweep: {arm: {from: 0, to: 90, step: 45}}}\n"
        f"optimize: {{variables: {{{variable}: {{choices: [9, 11]}}}}, method: grid,\n"
        "  minimize: kinematics.arm.angle.max}\n"
    )
    study = mechdesign.load(text=text)
    written(study, tmp_path)
    optimum = mechdesign.load(tmp_path / "optimum.yaml")
    expected, found = study.resolved["mechanism"], optimum.resolved["mechanism"]
    holder = expected
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = 9
    assert found == expected
