"""Files of other tools become studies that run, and move as an independent solver says they do."""

import cmath
import csv
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import mechdesign

DATA = Path(__file__).parents[1] / "data" / "imports"
# The coordinates of Linkage's files have six digits after the point, those of PMKS+'s addresses three.
DIGITS = 1e-7


class Solver:
    """Places of points from rigid bodies, lines and given places alone, followed step by step from the sketch.

    Independent of mechdesign: coordinates are the unknowns, not angles, and all conditions are solved at once.
    """

    def __init__(self, points, bodies, lines=(), distances=()):
        self.names, self.start = list(points), np.array(list(points.values()), dtype=complex)
        self.bodies = [[self.names.index(n) for n in body] for body in bodies if len(body) > 1]
        self.lines = [[self.names.index(n) for n in line] for line in lines]
        self.distances = [tuple(self.names.index(n) for n in pair) for pair in distances]

    def gaps(self, z, given, lengths):
        gaps = [z[k] - place for k, place in given.items()]
        for a, b, *rest in self.bodies:
            shape = self.start[b] - self.start[a]
            gaps.append((abs(z[b] - z[a]) - abs(shape)) + 0j)
            gaps += [z[c] - z[a] - (self.start[c] - self.start[a]) / shape * (z[b] - z[a]) for c in rest]
        for p, a, b in self.lines:
            gaps.append(((z[p] - z[a]) * (z[b] - z[a]).conjugate()).imag / abs(z[b] - z[a]) + 0j)
        gaps += [abs(z[b] - z[a]) - length + 0j for (a, b), length in zip(self.distances, lengths, strict=True)]
        gaps = np.array(gaps)
        return np.concatenate((gaps.real, gaps.imag))

    def follow(self, poses):
        """The places, a row a pose, of poses that give places by name, and the lengths of `distances`."""
        z, rows = self.start, []
        for given, lengths in poses:
            fixed = {self.names.index(name): place for name, place in given.items()}
            flat = np.concatenate((z.real, z.imag))
            n = len(z)
            solved = least_squares(
                lambda x, f=fixed, d=lengths: self.gaps(x[:n] + 1j * x[n:], f, d),
                flat, xtol=1e-15, ftol=1e-15, gtol=1e-15,
            )  # fmt: skip
            assert np.abs(solved.fun).max() < 1e-8, "the solver did not converge"
            z = solved.x[:n] + 1j * solved.x[n:]
            rows.append(z)
        return np.array(rows)


def linkage(name):
    """Points, bodies, lines, actuators, anchors and the inputs of a file of Linkage, read without mechdesign."""
    root = ET.parse(DATA / name).getroot()
    scale = 24.5 / 96
    points, anchors, inputs, lines = {}, [], {}, []
    for c in root.findall("connector"):
        key = f"P{c.get('id')}"
        points[key] = scale * complex(float(c.get("x")), float(c.get("y")))
        if c.get("anchor") == "true":
            anchors.append(key)
        if c.get("input") == "true":
            inputs[key] = -float(c.get("rpm"))
        if c.get("slider") == "true":
            lines.append([key, *(f"P{s.get('id')}" for s in c.findall("slidelimit"))])
    bodies, actuators = [], []
    for link in root.findall("Link"):
        ends = [f"P{c.get('id')}" for c in link.findall("connector")]
        (actuators if link.get("actuator") == "true" else bodies).append(ends)
    return points, bodies, lines, actuators, anchors, inputs


def study_of(source, **more):
    return mechdesign.load(text=mechdesign.convert(source, **more))


def moved(study):
    """The table of kinematics, of all moving points."""
    table = mechdesign.kinematics(study).tables["motion"]
    assert table["valid"].all()
    return table


@pytest.mark.parametrize("name", ["hoeken", "jansen", "klann", "sliding_bar"])
def test_a_crank_of_linkage_moves_everything_as_the_file_says(name):
    points, bodies, lines, _, anchors, inputs = linkage(f"{name}.linkage2")
    ((pin, rpm),) = inputs.items()
    tip = next(end for body in bodies if pin in body for end in body if end not in anchors)
    study = study_of(DATA / f"{name}.linkage2")
    drive = study.mechanism.drives[0]
    turns = np.linspace(0, 2 * math.pi, 73)[:-1]
    poses = []
    for turn in turns:
        given = {a: points[a] for a in anchors} | {
            tip: points[pin] + (points[tip] - points[pin]) * cmath.exp(1j * turn)
        }
        poses.append((given, []))
    expected = Solver(points, bodies, lines).follow(poses)
    start = math.degrees(cmath.phase(points[tip] - points[pin]))
    solved = study.mechanism.solve({drive: start + np.degrees(turns)})
    for k, point in enumerate(points):
        if point not in anchors:
            assert np.abs(solved[f"{point}.x"] + 1j * solved[f"{point}.y"] - expected[:, k]).max() < DIGITS, point
    table = moved(study)
    assert table[f"{drive}"][-1] - table[f"{drive}"][0] == pytest.approx(360)
    assert study.resolved["kinematics"]["rates"] == {drive: f"{rpm:g} rpm"}


def test_actuators_of_linkage_grow_and_shrink_at_their_own_pace():
    points, bodies, lines, actuators, anchors, _ = linkage("two_actuators.linkage2")
    table = moved(study_of(DATA / "two_actuators.linkage2"))
    throw = 21.213203 * 24.5 / 96
    rows = range(0, len(table), 12)
    poses = []
    for row in rows:
        lengths = []
        for (a, b), cycles in zip(actuators, (9, 15), strict=True):
            part = table["time"][row] * cycles / 60 % 1
            lengths.append(abs(points[b] - points[a]) + throw * (2 * part if part < 0.5 else 2 - 2 * part))
        poses.append(({a: points[a] for a in anchors}, lengths))
    expected = Solver(points, bodies, lines, actuators).follow(poses)
    for k, point in enumerate(points):
        if point not in anchors:
            got = table[f"{point}.x"][rows] + 1j * table[f"{point}.y"][rows]
            assert np.abs(got - expected[:, k]).max() < DIGITS, point


def test_gears_of_linkage_turn_by_their_sizes():
    study = study_of(DATA / "four_gears.linkage2")
    start = study.mechanism.solve({"link_0": 0})
    turned = study.mechanism.solve({"link_0": 80})
    # Each drives the next at half its speed, the other way round.
    for link, turn in (("link_10", -40), ("link_8", 20), ("link_4", -10)):
        assert turned[f"{link}.angle"] - start[f"{link}.angle"] == pytest.approx(turn)


def test_a_planetary_gear_of_linkage_with_a_chain_turns_nine_times_as_fast_as_its_arm():
    # The chain of equal wheels about a held one keeps wheel 0 from turning: (w1 - arm)/(0 - arm) = -8/1.
    study = study_of(DATA / "orbit_gears.linkage2")
    one, other = (study.mechanism.solve({"link_5": angle}) for angle in (0, 10))
    assert other["link_1.angle"] - one["link_1.angle"] == pytest.approx(90)
    assert other["link_0.angle"] - one["link_0.angle"] == pytest.approx(0, abs=1e-9)


def test_an_actuator_of_linkage_that_pulls_lifts_the_scissors():
    study = study_of(DATA / "scissors.linkage2")
    sweep = study.resolved["kinematics"]["sweep"]["link_11"]
    length = 160 * 24.5 / 96
    assert (sweep["from"], sweep["to"]) == pytest.approx((length - 74.342601 * 24.5 / 96, length))
    table = moved(study)
    width, height = table["P18.x"] - table["P18.x"][-1] + length, table["P32.y"] + 1180 * 24.5 / 96
    # Arms of sqrt(160^2 + 40^2) cross five times.
    arm = math.hypot(160, 40) * 24.5 / 96
    assert height == pytest.approx(5 * np.sqrt(arm**2 - width**2), abs=DIGITS)


# Addresses as PMKS+ writes them.


def decoded(query):
    """Joints and links of an address of the second generation, read without mechdesign."""
    order = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"

    def decimal(text):
        value = 0
        for digit in text.lstrip("0") if text.startswith("0") else text:
            value = 64 * value + order.index(digit)
        return (-value if text.startswith("0") else value) / 1000

    joints, links = query.split("..")[0].split(".")[4:], query.split("..")[1].split(".")
    points, kinds = {}, {}
    for text in joints:
        name, _, x, y, *rest = text[1:].split(",")
        points[name], kinds[name] = complex(decimal(x), decimal(y)), (order.index(text[0]), rest)
    bodies = {text[2:].split(",")[0]: (text[1], text.split(",")[7:].copy()) for text in links if text}
    return points, kinds, {name: (kind, [e for e in ends if e]) for name, (kind, ends) in bodies.items()}


ADDRESSES = dict(line.split(" ", 1) for line in (DATA / "pmks.txt").read_text().splitlines() if line)


@pytest.mark.parametrize(
    ("name", "speed"),
    [("jansen_leg", "-5 rpm"), ("watt_i", "-20 rpm"), ("radial_engine", "-5 rpm"), ("shaper", "-5 rpm")],
)
def test_an_address_of_pmks_moves_as_its_joints_and_slides_say(name, speed):
    address = ADDRESSES[name]
    points, kinds, bodies = decoded(address.partition("?")[2])
    fixed = [n for n, (flags, _) in kinds.items() if flags & 4 and not flags & 1]
    pin = next(n for n, (flags, _) in kinds.items() if flags & 2)
    lines = []
    for kind, ends in bodies.values():
        if kind == "P":
            rider, slide = ends
            angle, *guide = kinds[slide][1]
            if not guide:
                # A fixed line: a second point on it, in the direction of the joint's angle.
                turn = {"0": 0.0, "OZ": 1.571}.get(angle)
                turn = turn if turn is not None else RADIAL[slide]
                points[f"{slide}_far"] = points[slide] + cmath.exp(1j * turn)
                fixed += [slide, f"{slide}_far"]
                lines.append([rider, slide, f"{slide}_far"])
            else:
                lines.append([rider, *guide[1:]])
    rigid = [ends for kind, ends in bodies.values() if kind == "R"]
    floating = {n for n, (flags, _) in kinds.items() if flags & 1} - set(fixed)
    points = {n: p for n, p in points.items() if n not in floating}
    tip = next(e for ends in rigid if pin in ends for e in ends if e != pin)
    turns = np.linspace(0, 2 * math.pi, 37)[:-1]
    poses = [
        ({f: points[f] for f in fixed} | {tip: points[pin] + (points[tip] - points[pin]) * cmath.exp(1j * t)}, [])
        for t in turns
    ]  # fmt: skip
    expected = Solver(points, rigid, lines).follow(poses)
    study = study_of(address)
    (drive,) = study.mechanism.drives
    start = math.degrees(cmath.phase(points[tip] - points[pin]))
    solved = study.mechanism.solve({drive: start + np.degrees(turns)})
    for k, point in enumerate(points):
        if point not in fixed:
            assert np.abs(solved[f"{point}.x"] + 1j * solved[f"{point}.y"] - expected[:, k]).max() < DIGITS, point
    assert study.resolved["kinematics"]["rates"] == {drive: speed}
    assert study.resolved["units"]["length"] == "cm"
    moved(study)


# Angles of the five cylinders in thousandths of a radian, 2 pi/5 apart.
RADIAL = {"P": 1.571, "Q": 2.827, "R": -2.813, "S": 5.341, "T": 6.597}
