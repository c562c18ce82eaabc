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
        z, n, rows = self.start, len(self.start), []
        for given, lengths in poses:
            fixed = {self.names.index(name): place for name, place in given.items()}
            flat = np.concatenate((z.real, z.imag))
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


def test_a_scale_is_that_of_pulleys_and_moments_of_inertia_too():
    scaled = {}
    for scale in (1.0, 2.0):
        text = mechdesign.convert(DATA / "orbit_gears.linkage2", scale=scale)
        scaled[scale] = float(re.search(r"wheels: belt, radius: ([\d.]+)", text)[1])
    assert scaled[2.0] == pytest.approx(2 * scaled[1.0])
    heavy = OLD_FILE.replace("crank,R,1,1,", "crank,R,3,5,")
    inertia = re.search(r"mass: 3, center: \[1, 0\], inertia: (\d+)", mechdesign.convert(text=heavy, scale=2.0))
    assert float(inertia[1]) == 4 * 5


def test_a_mass_without_a_centre_is_in_the_middle_of_its_points():
    heavy = OLD_FILE.replace("crank,R,1,1,0.5,0,", "crank,R,3,1,Null,Null,")
    assert "mass: 3, center: [0.5, 0]" in mechdesign.convert(text=heavy)


def test_an_actuator_of_linkage_that_pulls_lifts_the_scissors():
    study = study_of(DATA / "scissors.linkage2")
    sweep = study.resolved["kinematics"]["sweep"]["link_11"]
    length = 160 * 24.5 / 96
    assert (sweep["from"], sweep["to"]) == pytest.approx((length - 74.342601 * 24.5 / 96, length))
    lengths = np.linspace(sweep["from"], sweep["to"], 9)
    solved = study.mechanism.solve({"link_11": lengths})
    # Arms of sqrt(160^2 + 40^2) cross five times.
    arm = math.hypot(160, 40) * 24.5 / 96
    moved(study)
    assert solved["P32.y"] + 1180 * 24.5 / 96 == pytest.approx(5 * np.sqrt(arm**2 - lengths**2), abs=DIGITS)


# Addresses as PMKS+ writes them.


def decimal(text):
    """A number of an address of the second generation: thousandths to the base 64, negative after a 0."""
    order = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
    value = 0
    for digit in text:
        value = 64 * value + order.index(digit)
    return (-value if text.startswith("0") else value) / 1000


def decoded(query):
    """Joints and links of an address of the second generation, read without mechdesign."""
    joints, links = query.split("..")[0].split(".")[4:], query.split("..")[1].split(".")
    points, kinds = {}, {}
    for text in joints:
        name, _, x, y, *rest = text[1:].split(",")
        points[name], kinds[name] = complex(decimal(x), decimal(y)), (int(1000 * decimal("1" + text[0])) - 64, rest)
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
                points[f"{slide}_far"] = points[slide] + cmath.exp(1j * decimal(angle))
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


def test_a_slide_of_pmks_that_holds_its_link_does_not_turn():
    study = study_of(ADDRESSES["scotch_yoke"])
    angles = np.arange(0, 360, 15)
    solved = study.mechanism.solve({"AB": angles})
    assert solved["C.x"] == pytest.approx(np.cos(np.radians(angles)))
    assert solved["CD.angle"] == pytest.approx(90)


def test_a_cylinder_of_pmks_is_a_driven_slide_of_a_rod_in_a_barrel():
    study = study_of(ADDRESSES["cylinder_boom"])
    assert study.resolved["kinematics"]["rates"] == {"P_slide": "1 cm/s"}
    solved = study.mechanism.solve({"P_slide": [0.5, 1.5, 2.5]})
    # C is on a circle of 4 about O, at the slide and the rod's length from G = (3, 0).
    rod, away = abs(complex(1.728, 1.697) - 4j), abs(complex(solved["C.x"][1], solved["C.y"][1]) - 3)
    assert away == pytest.approx(1.5 + rod)
    assert np.hypot(solved["C.x"], solved["C.y"]) == pytest.approx(4)


def test_masses_and_forces_of_pmks_are_asked_about():
    text = mechdesign.convert(ADDRESSES["punch_press"])
    for part in ("{at: C, force: [0, 400]}", "mass: 3", "inertia: 0.4 kg*cm^2"):
        assert part in text
    table = mechdesign.dynamics(mechdesign.load(text=text)).tables["dynamics"]
    # Without the masses the crank's torque is the load's times the ram's motion.
    light = re.sub(r", mass: [^}]*", "", text).replace("  gravity: [0, -9.81 m/s^2]\n", "")
    light = mechdesign.load(text=light)
    efforts = mechdesign.dynamics(light).tables["dynamics"]["Crank_effort"]
    crank = np.radians(np.linspace(90, 450, len(efforts)))
    step = 1e-6
    ram = [light.mechanism.solve({"Crank": np.degrees(crank + h)})["C.y"] for h in (-step, step)]
    assert efforts == pytest.approx(-400 * (ram[1] - ram[0]) / (2 * step), abs=1e-3)
    assert np.abs(table["Crank_effort"] - efforts).max() > 0.01


OLD = (
    "https://pmks.example/?j=O,0,0,crank,R,t,Null,t%0AA,1,0,crank|rod,R,f,Null,f%0AB,4,0,rod|block,R,f,Null,f%0A"
    "C,4,0,block,P,t,0,f%0A&l=crank,R,1,1,0.5,0,O|A,,%0Arod,R,1,1,2.5,0,A|B,F1,%0Ablock,P,1,Null,Null,Null,B|C,,%0A"
    "&f=F1,rod,2,0,2,-1,t,true,20%0A&s=10,true,false,cm"
)
OLD_FILE = """joints
id,x,y,links,type,ground,angle,input
O,0,0,crank,R,true,Null,true
A,1,0,crank|rod,R,false,Null,false
B,4,0,rod|block,R,false,Null,false
C,4,0,block,P,true,0,false
links
id,type,mass,mass_moi,center_of_mass_x,center_of_mass_y,joints,forces,shape,b1x,b1y,b2x,b2y,b3x,b3y,b4x,b4y
crank,R,1,1,0.5,0,"O,A","",
rod,R,1,1,2.5,0,"A,B","",
block,P,1,Null,Null,Null,"B,C","",Null,Null,Null,Null,Null,Null,Null,Null,Null
forces
id,link,startx,starty,endx,endy,fixed,direction,mag
"""


@pytest.mark.parametrize("text", [OLD, OLD.partition("?")[2], OLD_FILE])
def test_the_first_generation_of_pmks_is_a_slider_crank(text):
    study = study_of(None, text=text)
    angles = np.arange(0, 360, 30)
    solved = study.mechanism.solve({"crank": angles})
    turn = np.radians(angles)
    assert solved["B.x"] == pytest.approx(np.cos(turn) + np.sqrt(9 - np.sin(turn) ** 2))
    if "&s=" in text:
        assert study.resolved["kinematics"]["rates"] == {"crank": "-10 rpm"}
        assert study.resolved["dynamics"]["loads"] == [{"at": "F1", "force": [0, -20]}]


@pytest.mark.parametrize(
    ("name", "point", "step"),
    [("pylinkage_hoecken", "P", 10), ("pylinkage_slider_crank", "rod_1", 10), ("pylinkage_0_8_leg", "F", -10)],
)
def test_a_mechanism_of_pylinkage_traces_the_curve_that_pylinkage_printed(name, point, step):
    study = study_of(DATA / f"{name}.json")
    rows = list(csv.DictReader((DATA / f"{name}_curve.csv").read_text().splitlines()))
    (drive,) = study.mechanism.drives
    sweep = study.resolved["kinematics"]["sweep"][drive]
    # The first row is one step on from the file's pose.
    solved = study.mechanism.solve({drive: sweep["from"] + step * np.arange(1, len(rows) + 1)})
    assert solved[f"{point}.x"] == pytest.approx([float(row["x"]) for row in rows], abs=1e-10)
    assert solved[f"{point}.y"] == pytest.approx([float(row["y"]) for row in rows], abs=1e-10)
    moved(study)


# Tables, drawings, and what a file leaves open.

FOUR_BAR = {
    "joints.csv": "name,x,y,ground,drive,trace\nO,0,0,yes,60 rpm,\nA,0,30,,,\nB,75,55,,,\n"
    "D,100,0,yes,,\nP,40,80,,,yes\n",
    "links.csv": "name;joints\ncrank;O A\nrod;A, B, P\nrocker;D B\n",
}


def folder(path, files):
    for name, text in files.items():
        (path / name).write_text(text)
    return path


@pytest.mark.parametrize("name", ["", "joints.csv", "links.csv"])
def test_two_tables_are_a_four_bar(tmp_path, name):
    study = study_of(folder(tmp_path, FOUR_BAR) / name)
    assert study.resolved["kinematics"] == {
        "sweep": {"crank": {"from": 90, "to": 450, "number": 73}}, "rates": {"crank": "60 rpm"}, "outputs": ["P"],
    }  # fmt: skip
    assert study.mechanism.solve({"crank": 90})["P.y"] == pytest.approx(80)


TABLES = """{"units": "in", "joints": [
  {"name": "O", "x": 0, "y": 0, "ground": true, "drive": true},
  {"name": "A", "x": 3, "y": 4}, {"name": "B", "x": 15, "y": 1, "slide": 0}],
 "links": [{"name": "crank", "joints": ["O", "A"]}, {"name": "rod", "joints": ["A", "B"]}]}"""


def test_json_of_joints_and_links_with_a_slide():
    study = study_of(None, text=TABLES)
    assert study.resolved["units"]["length"] == "in"
    angles = np.arange(0, 360, 40)
    x, y = 5 * np.cos(np.radians(angles)), 5 * np.sin(np.radians(angles))
    expected = x + np.sqrt(12**2 + 3**2 - (1 - y) ** 2)
    assert study.mechanism.solve({"crank": angles})["B.x"] == pytest.approx(expected)
    assert study_of(None, text=TABLES, unit="mm", scale=2.0).mechanism.nominal["crank.length"] == pytest.approx(10)


def drawing(*shapes, version="AC1009", header=""):
    """A drawing in ASCII: shapes as kind, layer and coordinates."""
    lines = ["0", "SECTION", "2", "HEADER", "9", "$ACADVER", "1", version, *header.split(), "0", "ENDSEC"]
    lines += ["0", "SECTION", "2", "ENTITIES"]
    for kind, layer, *places in shapes:
        lines += ["0", kind, "8", layer]
        if kind == "LWPOLYLINE closed":
            lines[-3] = "LWPOLYLINE"
            lines += ["90", str(len(places)), "70", "1"]
        if kind == "POLYLINE":
            lines += ["66", "1", "10", "0", "20", "0"]
            for x, y in places:
                lines += ["0", "VERTEX", "8", layer, "10", str(x), "20", str(y)]
            lines += ["0", "SEQEND"]
            continue
        for k, (x, y) in enumerate(places):
            code = k if kind == "LINE" else 0
            lines += [str(10 + code), str(x), str(20 + code), str(y)]
        lines += ["40", "3"] if kind == "CIRCLE" else []
    return "\n".join([*lines, "0", "ENDSEC", "0", "EOF", ""])


BARS = (("LINE", "0", (0, 0), (0, 30)), ("LINE", "0", (100, 0), (75, 55)))
PLATE = ((0, 30), (75, 55), (40, 80))
PINS = (
    ("CIRCLE", "Drive", (0, 0)),
    ("CIRCLE", "ground", (100, 0)),
    ("CIRCLE", "0", (0, 30)),
    ("CIRCLE", "0", (75, 55)),
)
TRACE = ("POINT", "trace", (40, 80))
PLATES = {
    "R12": [("POLYLINE", "0", *PLATE)],
    "2018": [("LWPOLYLINE", "0", *PLATE)],
    "outline": [("LWPOLYLINE closed", "0", (-9, 20), (80, 40), (90, 60), (30, 99))],
    "lines": [("LINE", "0", PLATE[1], PLATE[2]), ("LINE", "0", PLATE[2], PLATE[0])],
}


@pytest.mark.parametrize("plate", PLATES)
def test_a_drawing_of_lines_and_circles_is_a_four_bar(tmp_path, plate):
    version = "AC1009" if plate == "R12" else "AC1032"
    text = drawing(*BARS, *PLATES[plate], *PINS, TRACE, ("TEXT", "0"), version=version, header="9 $INSUNITS 70 4")
    (tmp_path / "four_bar.dxf").write_text(text)
    study = study_of(tmp_path / "four_bar.dxf")
    tables = study_of(folder(tmp_path, FOUR_BAR))
    (drive,), (output,) = study.mechanism.drives, study.resolved["kinematics"]["outputs"]
    angles = np.arange(90, 450, 30)
    got, expected = study.mechanism.solve({drive: angles}), tables.mechanism.solve({"crank": angles})
    assert got[f"{output}.x"] == pytest.approx(expected["P.x"])
    assert "1 of the kind TEXT" in study.text.decode()


def test_circles_seen_from_behind_are_mirrored_and_those_on_no_link_are_listed(tmp_path):
    pins = [(kind, layer, (-x, y)) for kind, layer, (x, y) in (*PINS, ("CIRCLE", "0", (60, 7)))]
    behind = drawing(*pins).replace("40\n3", "40\n3\n210\n0\n220\n0\n230\n-1").partition("ENTITIES\n")[2]
    text = drawing(*BARS, *PLATES["R12"]).replace("0\nENDSEC\n0\nEOF\n", behind)
    (tmp_path / "behind.dxf").write_text(text, encoding="utf-16")
    study = study_of(tmp_path / "behind.dxf")
    (drive,) = study.mechanism.drives
    assert study.mechanism.nominal[f"{drive}.length"] == pytest.approx(30)
    assert "circles that lie on no link: P5 at (60, 7)" in study.text.decode()


def test_attributes_without_a_space_between_are_read():
    text = (DATA / "four_gears.linkage2").read_text()
    assert mechdesign.convert(text=text.replace('" ', '"')) == mechdesign.convert(text=text)


def test_a_drawing_with_a_guide_is_a_slider_crank():
    bars = [("LINE", "link", (0, 0), (3, 4)), ("LINE", "link", (3, 4), (15, 1)), ("LINE", "notes", (9, 9), (8, 8))]
    pins = [PINS[0], ("CIRCLE", "0", (3, 4)), ("CIRCLE", "0", (15, 1))]
    text = drawing(*bars, *pins, ("LINE", "slide", (10, 1), (25, 1)))
    study = study_of(None, text=text)
    (drive,) = study.mechanism.drives
    angles = np.arange(0, 360, 40)
    x, y = 5 * np.cos(np.radians(angles)), 5 * np.sin(np.radians(angles))
    slid = study.mechanism.solve({drive: angles})["slide_1.slide"]
    assert slid == pytest.approx(x + np.sqrt(12**2 + 3**2 - (1 - y) ** 2) - 10)
    assert "1 lines that are on no layer of links" in study.text.decode()


def test_a_file_without_an_input_asks_for_one_and_takes_it(tmp_path):
    files = FOUR_BAR | {"joints.csv": FOUR_BAR["joints.csv"].replace("60 rpm", "")}
    source = folder(tmp_path, files)
    with pytest.raises(mechdesign.StudyError, match="choose with --drive; pins of the ground: 'O', 'D'"):
        mechdesign.convert(source)
    for name in ("O", "crank"):
        assert study_of(source, drives=[name]).mechanism.drives == ("crank",)
    # The rocker swings as far as the other links let it.
    study = study_of(source, drives=["D"])
    swing = study.resolved["kinematics"]["sweep"]["rocker"]
    assert swing["to"] - swing["from"] < 180
    moved(study)


def test_what_no_drive_moves_is_a_message(tmp_path):
    files = FOUR_BAR | {"links.csv": FOUR_BAR["links.csv"] + "free;B Q\n"}
    files["joints.csv"] += "Q,90,90,,,\n"
    with pytest.raises(mechdesign.StudyError, match=r"no mechanism that its inputs drive: .*mobility"):
        mechdesign.convert(folder(tmp_path, files))


def test_links_on_the_same_two_joints_are_one_and_loose_ones_are_left_out(tmp_path):
    files = FOUR_BAR | {"links.csv": FOUR_BAR["links.csv"] + "brace;A P\nbase;O D\nloose;X Y\n"}
    files["joints.csv"] += "X,1,1,,,\nY,2,2,,,\n"
    text = mechdesign.convert(folder(tmp_path, files))
    assert "'brace' and 'rod' are one rigid link" in text
    assert "part of the ground: 'base'" in text
    assert "link 'loose', which nothing joins to the ground" in text
    moved(mechdesign.load(text=text))


def test_odd_names_are_made_names_of_the_study(tmp_path):
    names = {
        "O": "null",
        "A": "a: b #c",
        "B": "Ö 1",
        "D": "0",
        "P": "sin",
        "crank": "time",
        "rod": "O",
        "rocker": "\u202ex",
    }
    text = TABLES_OF_FOUR.format(**names)
    text = mechdesign.convert(text=text)
    study = mechdesign.load(text=text)
    assert set(study.mechanism.drives) == {"time_2"}
    assert "a_b_c is the file's point 'a: b #c'" in text
    assert "\u202e" not in text
    moved(study)


TABLES_OF_FOUR = """{{"joints": [{{"name": "{O}", "x": 0, "y": 0, "ground": "yes", "drive": "yes"}},
 {{"name": "{A}", "x": 0, "y": 30}}, {{"name": "{B}", "x": 75, "y": 55}},
 {{"name": "{D}", "x": 100, "y": 0, "ground": "x"}}, {{"name": "{P}", "x": 40, "y": 80}}],
 "links": [{{"name": "{crank}", "joints": ["{O}", "{A}"]}},
 {{"name": "{rod}", "joints": ["{A}", "{B}", "{P}"]}}, {{"name": "{rocker}", "joints": ["{D}", "{B}"]}}]}}"""


CHAIN = "".join(f'<connector id="{k}" x="{k}" y="{k % 3}" anchor="{str(not k).lower()}"/>' for k in range(203))
CHAIN += "".join(f'<Link id="{k}"><connector id="{k}"/><connector id="{k + 1}"/></Link>' for k in range(202))
CHAIN = f"<linkage2>{CHAIN}</linkage2>".replace('anchor="true"', 'anchor="true" input="true"')
LAUGHS = "<!DOCTYPE linkage2 [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;&a;'>]><linkage2><connector id='&b;'/></linkage2>"
HOSTILE = {
    "entities": (LAUGHS, "document type or entities"),
    "deep XML": ("<linkage2>" + "<a>" * 50, "deeper"),
    "many elements": ("<linkage2>" + "<a/>" * 60_000, "more elements"),
    "broken XML": ("<linkage2><connector id=</linkage2>", "no XML"),
    "huge number": ('<linkage2><connector id="0" x="1e400" y="0"/></linkage2>', "x of connector 0 is '1e400'"),
    "no number": (TABLES.replace("15", "NaN"), "x of joint 'B' is nan"),
    "huge whole number": (TABLES.replace("15", "9" * 5000), "not a number|format of"),
    "deep JSON": ("[" * 100_000, "format of"),
    "a number of links": ('{"joints": [], "links": 5}', "links is 5, not a list"),
    "a text of joints": ('{"joints": "O A", "links": []}', "joints is 'O A', not a list"),
    "a plane askew": (drawing(*BARS, PINS[0]).replace("40\n3", "40\n3\n210\n0.7\n230\n0.7"), "inclined plane"),
    "a long chain": (CHAIN, "202 moving links, more than 200"),
    "wrong kinds": ('{"joints": [3], "links": []}', "a joint is 3"),
    "lists for names": ('{"joints": [{"type": "revolute", "id": [1]}], "links": []}', "the name"),
    "two of a name": (TABLES.replace('"A", "x"', '"O", "x"'), "two joints have the name 'O'"),
    "a joint that is missing": (TABLES.replace('["A", "B"]', '["A", "Z"]'), "has the joint 'Z'"),
    "no links": ('{"joints": [], "links": []}', "no links"),
    "cut address": (ADDRESSES["watt_i"][:-1], "not complete"),
    "wrong digits": ("https://pmks.example/?2P.Ay.K,0.101.6A,A,$$,0,0....N_T", "not complete|a digit"),
    "newer address": ("pmks2:00000000.abc", "development version"),
    "short rows": ("?j=O,0,0&l=a,R", "of 8 fields"),
    "endless cell": (OLD_FILE.replace('"O,A"', '"' + "9" * 200_000 + '"'), "cannot be read as CSV"),
    "binary drawing": ("AutoCAD Binary DXF\r\n\x1a\0", "binary DXF"),
    "broken drawing": ("0\nSECTION\n2\nENTITIES\nx\ny\n", "not the number of a group"),
    "drawing without lines": (drawing(PINS[0]), "no line or polyline"),
    "drawing without a fixed pin": (drawing(*BARS), "no pin of the drawing is fixed"),
    "nothing on the ground": (
        TABLES.replace('"ground": true, "drive": true', '"trace": true').replace(', "slide": 0', ""),
        "is on the ground",
    ),
    "nothing": ("", "a text is empty"),
    "something else": ("hello", "format of"),
    "an unknown unit": (TABLES.replace('"in"', '"furlong"'), "furlong"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_what_is_no_mechanism_is_a_message(case):
    text, message = HOSTILE[case]
    with pytest.raises(mechdesign.StudyError, match=message):
        mechdesign.convert(text=text)


def test_a_file_that_is_not_there_or_too_large_is_a_message(tmp_path):
    with pytest.raises(mechdesign.StudyError, match="cannot be read"):
        mechdesign.convert(tmp_path / "none.linkage2")
    with pytest.raises(mechdesign.StudyError, match=r"the folder .* has no joints.csv and no links.csv"):
        mechdesign.convert(tmp_path)
    with pytest.raises(mechdesign.StudyError, match="larger than 5 million characters"):
        mechdesign.convert(text="0" * 5_000_001)
