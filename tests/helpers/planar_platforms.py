"""S4's three types of platforms as finite elements, at the poses of their studies."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

import mechdesign
from helpers.beam_model import Frame
from mechdesign.questions.poses import study_poses

CONFIGS = Path(__file__).parents[2] / "configs"
TYPES = {"I": "planar_3rpr.yaml", "II": "planar_2rpr_rp.yaml", "III": "planar_rp_rr.yaml"}
AXIAL, BENDING = 200e9 * 0.02 * 0.04, 200e9 * 0.02 * 0.04**3 / 12
K_PRISMATIC, K_REVOLUTE = 5e7, 1e5


def _built(kind: str, points: dict[str, complex]) -> np.ndarray:
    """Compliance at P of the finite-element model of a type, its joints at given places."""
    frame = Frame()
    centre = frame.node(points["P"])

    def corner(name: str) -> int:
        node = frame.node(points[name])
        frame.rigid(centre, node)
        return node

    def telescope(k: int, *, motor: float | None, turned: float | None, clamped: bool) -> None:
        base, tip = points[f"A{k}"], points[f"B{k}"]
        foot, root, end = frame.node(base), frame.node(base), frame.node(tip)
        frame.ground(foot, 0, 1)
        if turned is not None:
            wall = frame.node(base)
            frame.ground(wall, 0, 1, 2)
            frame.turning_spring(foot, wall, turned)
        frame.slide(foot, root, tip - base)
        if motor is not None:
            frame.sliding_spring(foot, root, tip - base, motor)
        frame.beam(root, end, AXIAL, BENDING)
        (frame.clamp if clamped else frame.hinge)(end, corner(f"B{k}"))

    if kind == "III":
        telescope(1, motor=None, turned=K_REVOLUTE, clamped=True)
        start, end = frame.node(points["A2"]), frame.node(points["B2"])
        frame.ground(start, 0, 1)
        frame.beam(start, end, AXIAL, BENDING)
        frame.hinge(end, corner("B2"))
    else:
        telescope(1, motor=K_PRISMATIC, turned=None, clamped=False)
        telescope(2, motor=K_PRISMATIC, turned=None, clamped=False)
        telescope(3, motor=K_PRISMATIC if kind == "I" else None, turned=None, clamped=kind == "II")
    return frame.compliance(centre)


@cache
def compliance(kind: str) -> np.ndarray:
    """Compliances at P over the poses of a type's study, whose places of joints are all that is taken from it."""
    study = mechdesign.load(CONFIGS / TYPES[kind])
    pose = study.mechanism.solve(study_poses(study, "stiffness").values)
    places = {name: pose[f"{name}.x"] + 1j * pose[f"{name}.y"] for name in study.mechanism.points}
    every = [{name: complex(place[row]) for name, place in places.items()} for row in range(len(places["P"]))]
    return np.array([_built(kind, points) for points in every])


def springs(tables) -> np.ndarray:
    """Stiffness of parallel springs along the lines of the table, at P in the first pose."""
    table, total = tables["springs"], np.zeros((3, 3))
    for row in range(len(table["x"]) // 3):
        angle = np.radians(table["angle"][row])
        force = np.array([np.cos(angle), np.sin(angle)])
        moment = table["x"][row] * force[1] - (table["y"][row] - 1.0) * force[0]
        total += table["stiffness"][row] * np.outer([*force, moment], [*force, moment])
    return total
