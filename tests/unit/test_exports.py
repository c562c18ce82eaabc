"""Files for other tools, read back by a small reader of the tests' own."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers.command_line import ask, exported
from helpers.drawings import area, at, distance, entities, parts

import mechdesign

FOUR_BAR = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: {from: O, to: A, length: 30}
    coupler: {from: A, to: B, length: 90, points: {P: [45, 25]}, width: 12}
    rocker: {from: D, to: B, length: 60}
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
  plates: {width: 16, pin: 6, pins: {A: 8}, kerf: 0.2}
kinematics:
  sweep: {theta: {from: 0, to: 360, step: 15}}
  rates: {theta: 60 rpm}
  outputs: [P]
reliability:
  dimensions: {crank.length: 0.05, rocker.length: js9}
  clearances: {A: {fit: 8 H7/g6}}
"""
# The crank turns between an arm with a slot and the frame, and a ram slides in the frame.
QUICK_RETURN = """
mechanism:
  links:
    ground: {O: [0, 0], E: [0, -60], G: [0, 60]}
    crank: [O, A, 25]
    arm: [E, B, 120]
    rod: [B, C, 60]
    ram: {C: [0, 0], T: [40, 0]}
  joints: {slot: {slot: arm, point: A}, guide: {prismatic: [ground, ram], through: G, point: C}}
  drives: {theta: {angle: crank}}
  sketch: {A: [25, 0], B: [45, 45], C: [100, 60]}
  plates: {width: 14, pin: 5}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 5}}, outputs: [T]}
"""


FILES = (
    "curve.csv", "layers.csv", "mechanism.dxf", "mechanism.svg", "model.xml", "motion.csv", "parts.dxf",
    "parts.svg", "sheet.pdf", "study.json",
)  # fmt: skip


def text_of(study, name, **said):
    """What a file of a study holds."""
    return exported(name, study, **said)[0].decode()


def layers_of(study, overrides=None):
    """The layer of each plate, and the warnings."""
    data, warnings = exported("layers.csv", study, overrides)
    rows = csv.DictReader(io.StringIO(data.decode()))
    return {row["item"]: int(row["first_layer"]) for row in rows if row["kind"] == "plate"}, warnings


@pytest.mark.parametrize("name", FILES)
def test_everything_that_is_declared_is_made(name):
    data, warnings = exported(name, FOUR_BAR)
    assert data
    assert warnings == []


def test_every_file_is_told_of_on_its_page():
    howto = Path(__file__).parents[2] / "docs" / "howto"
    pages = [(howto / f"{page}.md").read_text(encoding="utf-8") for page in ("export", "simulate_elsewhere")]
    assert [name for name in FILES if not any(f"`{name}`" in page for page in pages)] == []


def test_a_wrong_name_lists_those_there_are():
    done = ask("export", "-", "--to", "gcode", study=FOUR_BAR)
    assert done.exit_code == 2
    assert "there is no 'gcode' to export; what there is: " in done.stderr
    assert tuple(sorted(re.findall(r"([\w.]+) \([^()]*(?:\([^()]*\)[^()]*)*\)", done.stderr))) == FILES


def test_distances_of_holes_are_lengths_of_links_in_millimetres():
    inches = "units: {length: in}" + re.sub(
        r"(?<=[ \[])(\d+(?:\.\d+)?)(?=[],}])", r"\1 mm", FOUR_BAR.split("kinematics")[0]
    )
    for text in (FOUR_BAR, inches):
        found = parts(text_of(text, "parts.dxf"))
        assert set(found) == {"ground", "crank", "coupler", "rocker"}
        for name, length, diameters in (
            ("ground", 100, [5.8, 5.8]), ("crank", 30, [5.8, 7.8]), ("coupler", 90, [5.8, 7.8]),
            ("rocker", 60, [5.8, 5.8]),
        ):  # fmt: skip
            _, holes, slots = found[name]
            assert abs(holes[1][0] - holes[0][0]) == pytest.approx(length, abs=1e-6)
            assert sorted(diameter for _, diameter in holes) == pytest.approx(diameters, abs=1e-6)
            assert not slots


def test_areas_of_outlines_are_those_of_widened_hulls():
    # By Steiner: area of the hull, its perimeter times the distance, and a whole circle.
    found = parts(text_of(FOUR_BAR, "parts.dxf"))
    perimeter = 90 + 2 * math.hypot(45, 25)
    for name, inner, round_about, radius in (
        ("crank", 0, 60, 8.1), ("rocker", 0, 120, 8.1), ("coupler", 90 * 25 / 2, perimeter, 6.1)
    ):  # fmt: skip
        assert area(found[name][0]) == pytest.approx(inner + round_about * radius + math.pi * radius**2, abs=1e-6)


def test_slots_are_as_long_as_the_travel_of_their_pins():
    found = parts(text_of(QUICK_RETURN, "parts.dxf"))
    # The crank's pin is between 35 and 85 from the arm's pivot.
    (slot,) = found["arm"][2]
    assert area(slot) == pytest.approx(50 * 5 + math.pi * 2.5**2, abs=1e-3)
    (guide,) = found["ground"][2]
    stroke = mechdesign.kinematics(mechdesign.load(text=QUICK_RETURN)).tables["extremes"]["range"][0]
    assert area(guide) == pytest.approx(stroke * 5 + math.pi * 2.5**2, rel=1e-4)


def test_svg_has_the_same_places_and_sizes_in_millimetres():
    text = text_of(FOUR_BAR, "parts.svg")
    root = ElementTree.parse(io.StringIO(text.partition("?>")[2])).getroot()
    box = [float(number) for number in root.get("viewBox").split()]
    assert [root.get("width"), root.get("height")] == [f"{box[2]:.10g}mm", f"{box[3]:.10g}mm"]
    cut = next(group for group in root if group.get("id") == "cut")
    circles = [e for e in entities(text_of(FOUR_BAR, "parts.dxf")) if e["kind"] == "CIRCLE"]
    drawn = [complex(float(e.get("cx")), -float(e.get("cy"))) for e in cut.iter() if e.tag.endswith("circle")]
    assert drawn == pytest.approx([at(circle) for circle in circles], abs=2e-6)


def test_tolerances_and_fits_stand_in_the_text():
    text = text_of(FOUR_BAR, "parts.dxf")
    assert "999\ntolerance: crank.length -0.05 to +0.05 mm\n" in text
    assert "999\ntolerance: js9 of rocker.length: -0.037 to +0.037\n" in text
    assert "999\nfit: A, 8 H7/g6: radial clearance 0.0025 to 0.0145\n" in text


def test_the_mechanism_is_drawn_at_a_pose_with_the_paths_of_its_points():
    found = entities(text_of(FOUR_BAR, "mechanism.dxf", at="theta=60"))
    names = {e[1]: at(e) for e in found if e["kind"] == "TEXT"}
    pins = [at(e) for e in found if e["kind"] == "CIRCLE"]
    pose = mechdesign.load(text=FOUR_BAR).mechanism.solve({"theta": 60})
    assert {"O", "A", "B", "D", "crank", "coupler"} <= set(names)
    for point in "OABD":
        assert min(abs(pin - complex(pose[f"{point}.x"], pose[f"{point}.y"])) for pin in pins) < 1e-8
    path = [[at(vertex) for vertex in e["vertices"]] for e in found if e[8] == "curves"]
    assert min(abs(place - complex(pose["P.x"], pose["P.y"])) for curve in path for place in curve) < 0.2


CAM = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 90]}
    disc: [O, N, 20]
    stem: {F: [0, 0], T: [60, 0]}
  joints: {valve: {prismatic: [ground, stem], through: G, direction: 90, point: F}}
  drives: {cam: {angle: disc}}
  couplings: {lift: {set: valve, to: -50 - 10*cos(cam), cam: {link: disc, %s}}}
  sketch: {N: [20, 0], F: [0, 30], T: [0, 90]}
  plates: {width: 14, pin: 6, kerf: 0.2}
kinematics: {sweep: {cam: {from: 0, to: 360, step: 10}}, outputs: [T]}
"""


def test_a_cam_is_cut_along_its_profile_and_half_of_the_kerf():
    """Under a flat face in harmonic motion it is a circle of 40 mm, 10 mm beside its shaft."""
    found = entities(text_of(CAM % "flat: F, direction: 90", "parts.dxf"))
    (outline,) = (e for e in found if e[8] == "cut" and len(e.get("vertices", ())) > 100)
    corners = [at(vertex) for vertex in outline["vertices"]]
    middle = sum(corners) / len(corners)
    sizes = [abs(a - b) / 2 for a, b in zip(corners, corners[len(corners) // 2 :], strict=False)]
    assert sizes == pytest.approx([40.1] * len(sizes), abs=1e-9)
    assert abs(area(outline)) == pytest.approx(math.pi * 40.1**2, abs=0.01 * 2 * math.pi * 40)
    (shaft,) = (at(e) for e in found if e["kind"] == "CIRCLE" and abs(at(e) - middle) < 11)
    assert abs(shaft - middle) == pytest.approx(10, abs=1e-6)


@pytest.mark.parametrize(
    ("roller", "names", "layer", "number"),
    [
        ("side: groove", {"ground", "disc", "stem"}, "pocket", 2),
        ("side: inner", {"ground", "disc", "disc lift", "stem"}, "cut", 1),
        ("range: [0, 90]", {"ground", "disc", "stem"}, "cut", 1),
    ],
)
def test_a_roller_runs_along_what_is_cut_or_milled(roller, names, layer, number):
    """In the drawing of the mechanism the profile touches the roller; a ring is a part beside the plate of its link."""
    study = CAM % f"roller: F, radius: 8, {roller}"
    labels = {e[1] for e in entities(text_of(study, "parts.dxf")) if e["kind"] == "TEXT" and e[8] == "notes"}
    assert labels >= names
    assert ("disc lift" in labels) == ("disc lift" in names)
    milled = [e for e in entities(text_of(study, "parts.dxf")) if len(e.get("vertices", ())) > 200 and e[8] == layer]
    assert len(milled) >= number
    found = entities(text_of(study, "mechanism.dxf", at="cam=70"))
    (center,) = {at(e) for e in found if e["kind"] == "CIRCLE" and e[40] == 8}
    profiles = [e["vertices"] for e in found if len(e.get("vertices", ())) > 200]
    apart = [min(abs(at(vertex) - center) for vertex in profile) for profile in profiles]
    assert sum(distance == pytest.approx(8, abs=0.02) for distance in apart) == number


def test_a_profile_that_bounds_no_part_is_engraved():
    _, warnings = exported("parts.dxf", CAM % "roller: F, radius: 8, side: groove, range: [0, 90]")
    assert "its profile bounds no part: it is engraved on 'disc', and not cut" in " ".join(warnings)
    text = (CAM % "roller: F, radius: 20").replace("10*cos(cam)", "4*cos(4*cam)")
    assert "its profile is undercut" in " ".join(exported("parts.dxf", text)[1])


def test_dxf_passes_the_audit_of_ezdxf():
    ezdxf = pytest.importorskip("ezdxf")
    for name, text in itertools.product(("parts.dxf", "mechanism.dxf"), (FOUR_BAR, QUICK_RETURN)):
        document = ezdxf.read(io.StringIO(text_of(text, name)))
        report = document.audit()
        assert (document.dxfversion, document.units, report.errors, report.fixes) == ("AC1015", 4, [], [])


def header(text):
    """Variables of a DXF's header: the first value of each."""
    lines = text.split("\n")
    return {name: lines[k + 2] for k, name in enumerate(lines) if name.startswith("$")}


@pytest.mark.parametrize("name", ["parts.dxf", "mechanism.dxf"])
def test_a_dxf_says_that_its_unit_is_the_millimetre_and_all_in_it_has_a_handle_of_its_own(name):
    text = text_of(FOUR_BAR, name)
    said = header(text)
    assert (said["$ACADVER"], said["$INSUNITS"]) == ("AC1015", "4")
    lines = text.split("\n")
    pairs = [*zip(lines[0:-1:2], lines[1::2], strict=True)]
    handles = [int(value, 16) for code, value in pairs if code in ("5", "105")][1:]
    assert len({*handles}) == len(handles)
    assert int(said["$HANDSEED"], 16) > max(handles)
    # Owners are among them; those of tables and of the root dictionary are none.
    owners = {int(value, 16) for code, value in pairs if code == "330"}
    assert owners <= {0, *handles}
    kinds = [value for code, value in pairs if code == "0"]
    for kind in ("SECTION", "TABLE", "BLOCK"):
        assert kinds.count(kind) == kinds.count({"SECTION": "ENDSEC", "TABLE": "ENDTAB", "BLOCK": "ENDBLK"}[kind])
    if name == "parts.dxf":
        words = " ".join(e[1] for e in entities(text) if e["kind"] == "TEXT" and e[8] == "notes")
        assert "one unit is 1 mm; thickness 4 mm; kerf 0.2 mm is counted" in words


def test_a_hole_that_is_cut_along_its_line_has_the_diameter_of_the_study():
    study = FOUR_BAR.replace("width: 16, pin: 6, pins: {A: 8}, kerf: 0.2", "width: 16, pin: 3, kerf: 0.15")
    text = text_of(study, "parts.dxf")
    for name, width in (("crank", 16), ("coupler", 12)):
        outline, holes, _ = parts(text)[name]
        # The cut takes half of the kerf on both sides of its line.
        assert [diameter + 0.15 for _, diameter in holes] == pytest.approx([3, 3], abs=1e-9)
        low = min(at(vertex).imag for vertex in outline["vertices"])
        assert min(centre.imag for centre, _ in holes) - low - 0.075 == pytest.approx(width / 2, abs=1e-9)
    assert "crank: O A 30 mm, hole O 3 mm, drawn 2.85 mm, hole A 3 mm, drawn 2.85 mm\n" in text


GEARS = """
mechanism:
  links:
    ground: {O: [0, 0], C: [60, 0]}
    one: {points: {O: [0, 0], S: [10, 0]}}
    two: {points: {C: [0, 0], P: [%s, 0]}}
  drives: [one]
  couplings: {gears: {set: two, of: one, %s}}
  sketch: {S: [10, 0], P: [85, 0]}
  plates: {width: 12, pin: 3, kerf: 0.15}
kinematics: {sweep: {one: {from: 0, to: 360, step: 10}}, outputs: [P]}
"""


def circles(text, layer):
    """Centres and radii of circles."""
    return [(at(e), e[40]) for e in entities(text) if e["kind"] == "CIRCLE" and e[8] == layer]


def test_wheels_are_cut_as_discs_to_the_tips_of_their_teeth_with_the_pitch_circle_engraved():
    data, warnings = exported("parts.dxf", GEARS % (25, "ratio: -0.5, module: 2 mm"))
    text = data.decode()
    assert [("teeth are not drawn" in warning) for warning in warnings] == [True]
    cut, engraved = circles(text, "cut"), circles(text, "engrave")
    for pitch in (20, 40):
        (middle,) = [place for place, radius in engraved if radius == pytest.approx(pitch, abs=1e-9)]
        around = sorted(radius for place, radius in cut if abs(place - middle) < 1e-9)
        assert around == pytest.approx([1.5 - 0.075, pitch + 2 + 0.075], abs=1e-9)
    assert "wheel C: pitch circle 80 mm, 40 teeth of module 2 mm, tip circle 84 mm, without its teeth" in text
    names = {e[1] for e in entities(text) if e["kind"] == "TEXT" and e[8] == "notes"}
    assert {"one", "two", "ground"} <= names
    # Without a module they end at their pitch circles.
    plain = circles(text_of(GEARS % (25, "ratio: -0.5"), "parts.dxf"), "cut")
    assert sorted(radius for _, radius in plain if radius > 10) == pytest.approx([20.075, 40.075], abs=1e-9)


def test_a_wheel_with_a_crank_beyond_its_rim_is_a_disc_beside_a_plate():
    text = text_of(GEARS % (70, "ratio: -0.5, module: 2 mm"), "parts.dxf")
    names = {e[1] for e in entities(text) if e["kind"] == "TEXT" and e[8] == "notes"}
    assert {"one", "two", "two gears"} <= names
    # The plate of the crank goes to P.
    sides = [e["vertices"] for e in entities(text) if e["kind"] == "LWPOLYLINE" and e[8] == "cut"]
    assert max(abs(at(b) - at(a)) for side in sides for a, b in itertools.pairwise(side)) == pytest.approx(70, abs=1e-9)


def test_a_ring_is_cut_with_its_rim_and_pulleys_without_a_radius_are_named():
    cut = circles(text_of(GEARS % (25, "ratio: 0.25, module: 2 mm"), "parts.dxf"), "cut")
    # 60 apart: 80 and 20 radius; the ring's tips are inside, its rim as wide as its link beyond the feet of the teeth.
    assert sorted(radius for _, radius in cut if radius > 10) == pytest.approx([22.075, 78 - 0.075, 80 + 2.5 + 12.075])
    _, warnings = exported("parts.dxf", GEARS % (25, "ratio: 0.5, wheels: belt"))
    assert "gears: pulleys are not cut, as the study gives no 'radius'" in " ".join(warnings)
    data, warnings = exported("parts.dxf", GEARS % (25, "ratio: 0.5, wheels: belt, radius: 30"))
    assert not warnings
    assert sorted(radius for _, radius in circles(data.decode(), "cut") if radius > 10) == pytest.approx(
        [15.075, 30.075]
    )


def test_a_number_of_teeth_that_is_no_whole_one_is_doubted():
    words = " ".join(map(str, mechdesign.load(text=GEARS % (25, "ratio: -0.5, module: 3 mm")).warnings))
    assert "a wheel of 40 pitch diameter has 13.3333 teeth of the module 3" in words
    for law, sentence in (("wheels: belt, radius: 30", "a 'module' is that of teeth"), ("wheels: none", "of teeth")):
        with pytest.raises(mechdesign.StudyError, match=sentence):
            mechdesign.load(text=GEARS % (25, f"ratio: -0.5, module: 2, {law}"))


def met(study, layers, poses):
    """Pairs that share a layer and meet at one of some poses: plates, and pins with the plates between their ends."""
    mechanism = study.mechanism
    solved = mechanism.solve({mechanism.drives[0]: poses})
    links = {name: link.all_points for name, link in mechanism.description.links.items()}
    width, found = mechanism.nominal["plates.width"], set()
    radius = {name: mechanism.nominal.get(f"{name}.width", width) / 2 for name in links}
    pins = {}
    for name, points in links.items():
        for point in points:
            pins.setdefault(point, []).append(name)
    for k in range(len(poses)):
        places = {p: complex(solved[f"{p}.x"][k], solved[f"{p}.y"][k]) for p in mechanism.points}
        hulls = {name: [places[point] for point in points] for name, points in links.items()}
        for one, other in itertools.combinations(links, 2):
            if layers[one] == layers[other] and distance(hulls[one], hulls[other]) < radius[one] + radius[other]:
                found.add((one, other))
        for point, joined in pins.items():
            ends = [layers[name] for name in joined]
            diameter = mechanism.nominal.get(f"plates.{point}.pin", mechanism.nominal["plates.pin"])
            for name in links:
                between = min(ends) < layers[name] < max(ends) and name not in joined
                if between and distance([places[point]], hulls[name]) < diameter / 2 + radius[name]:
                    found.add((point, name))
    return found


JANSEN = """
mechanism:
  links:
    ground: {O: [38, 7.8], B: [0, 0]}
    crank: [O, A, 15]
    j: [A, C, 50]
    be: {from: B, to: C, length: 41.5, points: {D: [3.7, 39.9]}}
    k: [A, F, 61.9]
    c: [B, F, 39.3]
    f: [D, E, 39.4]
    gi: {from: F, to: E, length: 36.7, points: {G: [-28.2, -40.2]}}
  drives: {theta: {angle: crank}}
  sketch: {A: [53, 7.8], C: [18, 42], D: [-39, 16], F: [-8, -39], E: [-36, -22]}
  plates: {width: 6, pin: 2}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 5}}, outputs: [G]}
"""
CROSSED = FOUR_BAR.replace("B: [75, 55]}\n", "B: [75, -55]}\n")


@pytest.mark.parametrize("text", [FOUR_BAR, CROSSED, JANSEN], ids=["open", "crossed", "Jansen"])
def test_nothing_meets_in_the_layers_that_are_found(text):
    study = mechdesign.load(text=text)
    layers, warnings = layers_of(text)
    poses = [k * 360 / 181 for k in range(181)]
    assert not warnings
    assert met(study, layers, poses) == set()
    # Not by lying in as many layers as there are links.
    assert max(layers.values()) < len(layers)


def test_layers_of_the_study_are_kept():
    layers, warnings = layers_of(FOUR_BAR, {"mechanism.links.crank.layer": 3})
    assert layers["crank"] == 3
    assert not warnings


def test_what_meets_in_any_layers_is_named_with_the_pose():
    # Rod and rocker are in one layer, although a pin joins them.
    both = {f"mechanism.links.{link}.layer": 2 for link in ("coupler", "rocker")}
    (warning,) = layers_of(FOUR_BAR, both)[1]
    assert "in whatever layers, something meets; here coupler and rocker (joined at B) [infeasible]" in warning


def test_pins_that_pass_each_other_are_named_where_they_share_a_link():
    """The ram's pin slides in the frame, on the line of the crank's shaft: over it, or past it."""
    over = """
mechanism:
  links: {ground: {O: [0, 0]}, crank: [O, A, 20], ram: {C: [0, 0], T: [40, 0]}}
  joints: {guide: {prismatic: [ground, ram], through: O, point: C}}
  drives: {theta: {angle: crank}}
  couplings: {push: {set: guide, to: 30*sin(theta)}}
  sketch: {A: [20, 0], C: [0, 0], T: [40, 0]}
  plates: {width: 14, pin: 5}
kinematics: {sweep: {theta: {from: 0, to: 360, step: 5}}}
"""
    assert "in whatever layers, something meets; here pin O and pin C (" in layers_of(over)[1][0]
    assert not layers_of(over.replace("30*sin", "40 + 30*sin"))[1]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("links.coupler.width", 8, "the pin at 'A' has a diameter of 8, and link 'coupler' is 8 wide: its hole would"),
        ("plates.kerf", 6, "the pin at 'O' has a diameter of 6, and the kerf is 6: no hole would be left"),
    ],
)
def test_a_hole_as_wide_as_its_link_or_as_the_kerf_is_refused(key, value, words):
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=FOUR_BAR, overrides={f"mechanism.{key}": value})


def test_holes_that_overlap_and_a_narrow_sheet_are_warnings():
    crowded = FOUR_BAR.replace("width: 16, pin: 6, pins: {A: 8}", "width: 40, pin: 32, sheet: 130").replace(
        "P: [", "X: ["
    )
    crowded = crowded.replace(", width: 12", "").replace("outputs: [P]", "outputs: [X]").partition("reliability")[0]
    overlap, wide = exported("parts.dxf", crowded)[1]
    assert "hole O and hole A of 'crank' overlap" in overlap
    assert "the sheet is 130 mm wide: 'ground' is 140.2 mm long; 'coupler' is 130.2 mm long" in wide


def test_the_least_width_of_a_link_is_that_of_links_without_one():
    found = parts(
        text_of(FOUR_BAR.replace("  plates: {width: 16, pin: 6, pins: {A: 8}, kerf: 0.2}\n", ""), "parts.dxf")
    )
    # The coupler is 12 mm wide.
    assert area(found["crank"][0]) == pytest.approx(60 * 6 + math.pi * 6**2, abs=1e-6)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [({"plates": {"pin": 4}}, "plates need a 'width'"), ({"links.crank.layer": 2}, "a 'layer' belongs to plates")],
)
def test_plates_without_any_width_are_refused(overrides, words):
    bare = FOUR_BAR.replace(", width: 12", "").replace("  plates: {width: 16, pin: 6, pins: {A: 8}, kerf: 0.2}\n", "")
    with pytest.raises(mechdesign.StudyError, match=words):
        mechdesign.load(text=bare, overrides={f"mechanism.{key}": value for key, value in overrides.items()})


def test_a_study_without_plates_or_motion_says_what_is_taken():
    bare = "mechanism: {links: {ground: {O: [0, 0]}, one: [O, A, 50], two: [A, B, 40]}, drives: [one, two]}"
    bare = bare.replace("drives", "sketch: {A: [50, 0], B: [50, 40]}, drives")
    assumed, incomplete = exported("parts.dxf", bare)[1]
    assert "links are taken as 5 mm wide; give {width: 5 mm}" in assumed
    assert assumed.endswith("[assumed]")
    assert incomplete.endswith("[incomplete]")


@pytest.mark.slow
def test_a_drawing_of_a_large_mechanism_is_shown_on_a_screen_and_that_of_its_parts_at_full_size():
    """A crank-rocker of 9 m was 33,000 pixels wide in a browser."""
    large = "units: {length: dm}" + FOUR_BAR.split("reliability:")[0]
    shown, parts = text_of(large, "mechanism.svg"), text_of(large, "parts.svg")
    wide, in_units = (float(re.search(pattern, shown)[1]) for pattern in (r'width="([\d.]+)mm"', r"([\d.]+) [\d.]+\">"))
    assert wide <= 420 < in_units
    scale = int(re.search(r"<title>.*, shown at 1:(\d+)</title>", shown)[1])
    assert wide * scale == pytest.approx(in_units, abs=1e-3)
    box = [float(number) for number in re.search(r'viewBox="([^"]+)"', parts)[1].split()]
    assert float(re.search(r'width="([\d.]+)mm"', parts)[1]) == pytest.approx(box[2])
