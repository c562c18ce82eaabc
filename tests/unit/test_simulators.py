"""A model for a simulator: loaded where the package is, and read back by geometry of the tests' own everywhere."""

from __future__ import annotations

import cmath
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import command_line

import mechdesign

CONFIGS = Path(__file__).parents[2] / "configs"
FOUR_BAR = """
units: {length: cm}
mechanism:
  links:
    ground: {O: [0, 0], D: [40, 0], S: [20, -10]}
    crank: {from: O, to: A, length: 15, mass: 1.2, inertia: 30}
    coupler: {from: A, to: B, length: 35, points: {C: [17.5, 10]}, mass: 2.5, center: [17, 3], inertia: 300}
    rocker: {from: D, to: B, length: 30, mass: 1.5, inertia: 120}
  drives: {theta: {angle: crank}}
  springs:
    pull: {between: [S, C], stiffness: 3, free_length: 5, preload: 5, damping: 0.04}
    turn: {between: [ground, rocker], stiffness: 80, free_angle: 100, damping: 2}
  sketch: {A: [10, 11], B: [33, 29]}
dynamics:
  gravity: [0, -9.81 m/s^2]
  outputs: [C]
  forward: {duration: 1, start: {theta: 50}, rows: 11}
"""
# Two slots, a clamp, a telescopic leg and a compound pin.
JOINTS = """
units: {length: mm}
mechanism:
  links:
    ground: {O: [0, 0], G: [120, 0]}
    crank: [O, A, 30]
    arm: {from: G, to: T, length: 150}
    hook: {T: [0, 0], E: [20, 0]}
    rod: [A, P, 90]
    guided: [P, Q, 40]
    leg: {from: Q, to: E, telescopic: true}
  joints:
    slot: {slot: arm, point: A, through: [G, T]}
    welded: {fixed: [arm, hook], angle: 90}
    rail: {slot: ground, point: P, direction: 0}
  drives: {theta: {angle: crank}, out: {length: leg}}
  sketch: {A: [0, 30], T: [-26, 36], E: [-31, 17], P: [85, 0], Q: [85, 40]}
"""


def made(text, **options):
    """A study as a model for MuJoCo, and what is said of it."""
    model, told = command_line.exported("model.xml", text, **options)
    return model.decode(), told


@pytest.mark.slow
def test_the_tree_of_mjcf_puts_every_site_where_its_point_is():
    for text, closures in ((FOUR_BAR, 1), (JOINTS, 3)):
        study = mechdesign.load(text=text)
        model = ElementTree.fromstring(made(text)[0])
        places = dict(sites(model.find("worldbody"), 0j, 1 + 0j))
        unit = 0.01 if text == FOUR_BAR else 0.001
        assert places.keys() == set(study.mechanism.points)
        for point, place in places.items():
            assert place == pytest.approx(unit * complex(study.mechanism.sketch_configuration.point(point)), abs=1e-9)
        assert len(model.find("equality")) == closures
        joints = [joint.get("name") for joint in model.iter("joint")]
        assert len(joints) == len(set(joints)) >= len(study.mechanism.drives)


def sites(element, origin, turn):
    for site in element.findall("site"):
        yield site.get("name"), origin + turn * place(site)
    for body in element.findall("body"):
        angle = float(body.get("euler").split()[2])
        yield from sites(body, origin + turn * place(body), turn * cmath.exp(1j * angle))


def place(element):
    x, y, z = map(float, element.get("pos").split())
    assert z == 0
    return complex(x, y)


def test_masses_and_springs_are_in_si():
    model = ElementTree.fromstring(made(FOUR_BAR)[0])
    inertial = next(body for body in model.iter("body") if body.get("name") == "coupler").find("inertial")
    assert (float(inertial.get("mass")), place(inertial)) == (2.5, pytest.approx(0.17 + 0.03j))
    assert inertial.get("diaginertia").split() == ["0.03"] * 3
    assert model.find("option").get("gravity") == "0 -9.81 0"
    pull, turn = model.find("tendon")
    assert float(pull.get("stiffness")) == pytest.approx(300)
    assert float(pull.get("springlength").split()[0]) == pytest.approx(0.05 - 5 / 300)
    assert float(turn.get("stiffness")) == pytest.approx(0.8)
    assert [motor.tag for motor in model.find("actuator")] == ["motor"]


def test_what_a_simulator_does_not_have_is_told():
    cam = """
mechanism:
  links: {ground: {O: [0, 0], Q: [90, 0]}, cam: [O, C, 30], lever: [Q, P, 50]}
  drives: [cam]
  couplings: {lift: {set: lever, to: 20*sin(cam)}}
"""
    model, told = made(cam)
    assert "coupling lift is left out" in "".join(told)
    assert "Coupling lift is left out" in model


@pytest.mark.parametrize("name", ["four_bar", "jansen", "slider_crank", "planetary", "belt_scara", "rrr_platform"])
def test_mujoco_has_every_point_where_it_is_over_the_motion(name):
    mujoco = pytest.importorskip("mujoco")
    path = CONFIGS / "gallery" / f"{name}.yaml"
    study = mechdesign.load(path)
    mechanism, motion = study.mechanism, mechdesign.kinematics(study).main
    motion = motion.take(motion["valid"])
    track = mechanism.solve({drive: motion[drive] for drive in mechanism.drives})
    model = mujoco.MjModel.from_xml_string(made(path.read_text())[0])
    data = mujoco.MjData(model)
    unit = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}[study.units.length]
    lengths = [1.0 if mechanism.quantity(drive) == "angle" else unit for drive in mechanism.drives]
    radians = [np.radians(1.0) if mechanism.quantity(drive) == "angle" else 1.0 for drive in mechanism.drives]
    values = np.array([length * scale * motion[drive]
                       for drive, length, scale in zip(mechanism.drives, lengths, radians, strict=True)])  # fmt: skip
    mujoco.mj_forward(model, data)
    begin = np.array([data.sensor(f"drive.{drive}").data[0] for drive in mechanism.drives])
    first = int(np.argmin(np.abs(values - begin[:, None]).sum(axis=0)))
    here = begin
    for row in range(first, min(first + 361, values.shape[1]), 6):
        # In small steps, so that the assembly stays the same.
        count = 1 + int(np.abs(values[:, row] - here).max() / 0.05)
        for k in range(count):
            close(mujoco, model, data, mechanism.drives, here + (values[:, row] - here) * (k + 1) / count)
        here = values[:, row]
        for point in mechanism.points:
            x, y, z = data.site(point).xpos
            assert complex(x, y) == pytest.approx(
                unit * complex(track[f"{point}.x"][row], track[f"{point}.y"][row]), abs=1e-6 * unit * mechanism.size
            )
            assert z == 0


def close(mujoco, model, data, drives, targets):
    """Newton's method on the constraints and the drives."""
    for _ in range(30):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_sensorPos(model, data)
        count = data.nefc
        equal = data.efc_type[:count] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        jacobian = np.zeros((count, model.nv))
        if mujoco.mj_isSparse(model):
            mujoco.mju_sparse2dense(jacobian, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        elif count:
            jacobian = data.efc_J.reshape(count, model.nv).copy()
        rows, gaps = [jacobian[equal]], [data.efc_pos[:count][equal]]
        for drive, target in zip(drives, targets, strict=True):
            row = np.zeros(model.nv)
            actuator = model.actuator(drive)
            which = actuator.trnid[0]
            if actuator.trntype[0] == mujoco.mjtTrn.mjTRN_JOINT:
                row[model.jnt_dofadr[which]] = 1
            else:
                for k in range(model.tendon_adr[which], model.tendon_adr[which] + model.tendon_num[which]):
                    row[model.jnt_dofadr[model.wrap_objid[k]]] = model.wrap_prm[k]
            rows.append(row[None])
            gaps.append(data.sensor(f"drive.{drive}").data - target)
        gap = np.concatenate(gaps)
        if np.abs(gap).max() < 1e-11:
            return
        mujoco.mj_integratePos(model, data.qpos, -np.linalg.lstsq(np.concatenate(rows), gap, rcond=1e-10)[0], 1.0)
    raise AssertionError("the constraints do not close")


@pytest.mark.nightly
def test_mujoco_moves_freely_as_dynamics_does():
    mujoco = pytest.importorskip("mujoco")
    table = mechdesign.dynamics(mechdesign.load(text=FOUR_BAR)).tables["forward"]
    model = mujoco.MjModel.from_xml_string(made(FOUR_BAR, at="theta=50")[0])
    data = mujoco.MjData(model)
    for time, x, y in zip(table["time"], table["C.x"], table["C.y"], strict=True):
        while data.time < time - 1e-9:
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        assert data.site("C").xpos[:2] == pytest.approx([0.01 * x, 0.01 * y], abs=1e-5)
