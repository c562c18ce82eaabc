"""Random platforms on serial legs: RRR, RPR, PRR, levers with slots, passive struts, rods clamped to the platform."""

from __future__ import annotations

import cmath
import math
from random import Random

import yaml

from helpers.random_stiffness import SECTIONS


def platform(rng: Random) -> str:
    """A study of the stiffness at P of a platform that stands on three or four legs, in the pose drawn."""
    holding = rng.choice([0, 0, 1, 1, 2])  # legs without a drive that hold the platform in one way
    kinds = [rng.choice(["RR", "RP"]) for _ in range(holding)]
    kinds += [rng.choice(["RRR", "RPR", "PRR", "lever"]) for _ in range(3 - holding)]
    driven = [False] * holding + [True] * (3 - holding)
    if rng.random() < 0.3:
        kinds, driven = [*kinds, rng.choice(["RRR", "RPR", "PRR"])], [*driven, False]
    spin = rng.uniform(-math.pi, math.pi)
    # The platform is near the origin, the bases around it at random angles, nowhere all in line.
    angles = [spin + 2 * math.pi * (k + rng.uniform(-0.3, 0.3)) / len(kinds) for k in range(len(kinds))]
    ground, links, joints, drives, actuators = {}, {}, {}, {}, {}
    sketch = {"P": cmath.rect(rng.uniform(0, 0.3), rng.uniform(-math.pi, math.pi))}
    body = {"P": [0, 0]}
    for k, (kind, moves, angle) in enumerate(zip(kinds, driven, angles, strict=True), 1):
        tip = sketch[f"B{k}"] = cmath.rect(rng.uniform(0.3, 0.6), angle)
        arm = tip - sketch["P"]
        body[f"B{k}"] = [arm.real, arm.imag]
        base = tip + cmath.rect(rng.uniform(0.7, 1.4), angle + rng.choice([-1, 1]) * rng.uniform(0.3, 1.2))
        if kind != "PRR":
            ground[f"A{k}"] = [base.real, base.imag]
        if kind in ("RRR", "PRR"):
            elbow = (base + tip) / 2 + rng.choice([-1, 1]) * rng.uniform(0.3, 0.6) * 1j * (tip - base)
            sketch[f"E{k}"] = elbow
            links[f"rod_{k}"] = [f"E{k}", f"B{k}"]
        if kind == "RRR":
            links[f"crank_{k}"] = [f"A{k}", f"E{k}"]
            drive = rng.choice(
                [
                    {"angle": f"crank_{k}"},
                    {"angle": f"rod_{k}", "from": f"crank_{k}"},
                    {"angle": "platform", "from": f"rod_{k}"},
                ]
            )
        elif kind == "PRR":
            # Well away from the perpendicular to the rod, where two assemblies meet.
            slant = cmath.phase(tip - elbow) + rng.uniform(-1.2, 1.2) + rng.choice([0, math.pi])
            foot = elbow + cmath.rect(rng.uniform(0.3, 0.8), slant)
            ground[f"A{k}"] = [foot.real, foot.imag]
            links[f"block_{k}"] = {f"E{k}": [0, 0]}
            direction = math.degrees(cmath.phase(elbow - foot))
            joints[f"guide_{k}"] = {"prismatic": ["ground", f"block_{k}"], "through": f"A{k}", "direction": direction}
            drive = rng.choice([{"slide": f"guide_{k}"}, {"angle": f"rod_{k}", "from": f"block_{k}"}])
        elif kind == "lever":
            # Its slot runs beside its line, from a bracket to the platform's pin, before its end or beyond it.
            axis = cmath.rect(1, cmath.phase(tip - base) + rng.uniform(-0.3, 0.3))
            root = base + axis * complex(rng.uniform(0, 0.2), rng.uniform(-0.1, 0.1))
            sketch |= {f"K{k}": root, f"E{k}": base + rng.uniform(0.5, 1.5) * axis}
            local = (root - base) / axis
            links[f"lever_{k}"] = {"from": f"A{k}", "to": f"E{k}", "points": {f"K{k}": [local.real, local.imag]}}
            direction = math.degrees(cmath.phase((tip - root) / axis))
            joints[f"slot_{k}"] = {"slot": f"lever_{k}", "through": f"K{k}", "direction": direction, "point": f"B{k}"}
            drive = {"angle": f"lever_{k}"}
        elif kind == "RR":
            links[f"strut_{k}"] = [f"A{k}", f"B{k}"]
        else:
            links[f"leg_{k}"] = {"from": f"A{k}", "to": f"B{k}", "telescopic": True}
            drive = rng.choice([{"length": f"leg_{k}"}, {"angle": f"leg_{k}"}])
            if kind == "RP":
                joints[f"clamp_{k}"] = {"fixed": [f"leg_{k}", "platform"], "point": f"B{k}"}
        if moves:
            drives[f"d{k}"] = drive
            if rng.random() < 0.7:
                actuators[f"d{k}"] = 10 ** rng.uniform(2, 4)
    bodies = {name: {"points": [*link[:2]]} if isinstance(link, list) else link for name, link in links.items()}
    place = sketch["P"]
    pose = {"P.x": place.real, "P.y": place.imag, "platform.angle": 0.0}
    mechanism = {
        "links": {"ground": ground, **bodies, "platform": body},
        "joints": joints,
        "drives": drives,
        "sketch": {name: [z.real, z.imag] for name, z in sketch.items()},
    }
    section = {
        "link": "platform",
        "at": "P",
        "sections": SECTIONS,
        "elastic": {name: rng.choice(sorted(SECTIONS)) for name in links
                    if not name.startswith("block") and rng.random() < 0.8},
        "actuators": actuators,
        "poses": [dict(list(pose.items())[: len(drives)])],
    }  # fmt: skip
    return yaml.safe_dump({"mechanism": mechanism, "stiffness": section}, sort_keys=False)
