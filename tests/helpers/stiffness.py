"""Studies that ask for a stiffness, and access to the answer's matrices."""

from __future__ import annotations

import numpy as np

import mechdesign
from helpers.studies import study_of

METRES = "units: {length: m, angle: deg, time: s, force: N}\n"
FIVE_BAR = (
    METRES
    + """
mechanism:
  links:
    ground: {O1: [-0.15, 0], O2: [0.15, 0]}
    a1: [O1, E1, 0.25]
    b1: [E1, P, 0.40]
    a2: [O2, E2, 0.25]
    b2: [E2, P, 0.40]
  drives: [a1, a2]
  sketch: {E1: [-0.3, 0.2], E2: [0.3, 0.2], P: [0.05, 0.45]}
stiffness:
  at: P
  actuators: {a1: 1000, a2: 1000}
  poses: [{P.x: 0.05, P.y: 0.45}]
"""
)
ARM = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0]}
    upper: [O, E, 0.5]
    lower: [E, P, 0.4]
  drives: {shoulder: {angle: upper}, elbow: {angle: lower, from: upper}}
  sketch: {E: [0.4, 0.3], P: [0.8, 0.2]}
stiffness:
  link: lower
  at: P
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {upper: beam, lower: beam}
  actuators: {shoulder: 1e4, elbow: 5e3}
  poses: [{shoulder: 30, elbow: 50}]
"""
)
SLIDER = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0]}
    crank: [O, A, 0.3]
    rod: [A, B, 0.8]
    slider: {B: [0, 0], T: [0.1, 0.05]}
  joints: {guide: {prismatic: [ground, slider], point: B}}
  drives: [crank]
  sketch: {A: [0.2, 0.25], B: [0.95, 0]}
stiffness:
  link: slider
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {crank: beam, rod: beam}
  actuators: {crank: 1000}
  poses: [{crank: 60}]
"""
)
AXIAL, BENDING = 200e9 * 8e-4, 200e9 * 0.02 * 0.04**3 / 12
# A platform that turns about a point in a pose where its three struts meet there.
MEETING_STRUTS = (
    METRES
    + """
mechanism:
  links:
    ground: {A1: [-1, 0], A2: [1, 0], A3: [0, -1]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-0.5, -0.5], B2: [0.5, -0.5], B3: [0, -0.7]}
  drives: [leg_1, leg_2, leg_3]
  sketch: {P: [0.1, 1], B1: [-0.4, 0.5], B2: [0.6, 0.5], B3: [0.1, 0.3]}
stiffness:
  link: platform
  at: P
  actuators: {leg_1: 1e4, leg_2: 1e4, leg_3: 1e4}
"""
)


def ask_stiffness(text: str, *overrides: str) -> mechdesign.Answer:
    return mechdesign.stiffness(study_of(text, *overrides))


def matrix(result: mechdesign.Answer, letter: str, row: int = 0) -> np.ndarray:
    table = result.tables["stiffness" if letter == "K" else "compliance"]
    size = 3 if f"{letter}33" in table else 2
    return np.array([[table[f"{letter}{min(i, j)}{max(i, j)}"][row] for j in range(1, size + 1)]
                     for i in range(1, size + 1)])  # fmt: skip


BENT = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], Q: [1, 0]}
    bracket: {O: [0, 0], M: [0.1, 0.4], A: [0.5, 0.5], X: [0.7, 0.9]}
    plate: {A: [0, 0], B: [0.4, 0], T: [0.2, 0.2]}
    prop: [Q, B, 0.45]
  drives: [bracket]
  sketch: {O: [0, 0], A: [0.5, 0.5], M: [0.1, 0.4], B: [0.9, 0.45]}
stiffness:
  link: plate
  at: T
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {bracket: beam, prop: beam}
  actuators: {bracket: 1e4}
  poses: [{bracket: 2}]
"""
)


SLOTTED = (
    METRES
    + """
mechanism:
  links:
    ground: {O: [0, 0], Q: [0.2, -0.5]}
    crank: [O, A, 0.2]
    lever: {from: Q, to: T, length: 1}
  joints: {slit: {slot: lever, through: Q, point: A}}
  drives: [crank]
  sketch: {A: [0.1, 0.17], T: [0.1, 0.5]}
stiffness:
  link: crank
  at: A
  sections: {beam: {E: 200 GPa, width: 0.02, height: 0.04}}
  elastic: {lever: beam}
  actuators: {crank: 500}
  poses: [{crank: 70}]
"""
)
