"""Wrong studies: each mistake is told where it stands, with what would mend it, and all in one go."""

import time

import pytest

import mechdesign

STUDY = """\
mechanism:
  parameters: {r: 30}
  links:
    ground: {O: [0, 0], D: [100, 0]}
    crank: [O, A, r]
    rod: {from: A, to: B, length: 90, points: {P: [40, 10]}}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 30], B: [75, 55]}
"""


def problems(tmp_path, monkeypatch, text, *overrides):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(mechdesign.StudyError) as caught:
        mechdesign.load("study.yaml", overrides)
    return str(caught.value).splitlines()


MECHANISM = [
    ("length: 90", "lenght: 90", "6:27: mechanism.links.rod.lenght: unknown key; did you mean 'length'?"),
    ("mechanism:", "mechanisms:", "1:1: mechanisms: unknown key; did you mean 'mechanism'?"),
    ("crank: [O, A, r]", "crank: 5", "5:12: mechanism.links.crank: expected a link"),
    ("crank: [O, A, r]", "crank: [O, 7, r]", "5:16: mechanism.links.crank.1: expected the name of a point"),
    ("crank: [O, A, r]", "crank: [O, A, -3]", "5:19: mechanism.links.crank.2: must be positive, not -3"),
    ("crank: [O, A, r]", "crank: [O, A, 0]", "5:19: mechanism.links.crank.2: must be positive, not 0"),
    ("crank: [O, A, r]", "crank: [O, A, .nan]", "mechanism.links.crank.2: expected a finite number, not nan"),
    ("crank: [O, A, r]", "crank: [O, A, -.inf]", "mechanism.links.crank.2: expected a finite number, not -inf"),
    ("crank: [O, A, r]", "crank: [O, A, 1e999]", "mechanism.links.crank.2: expected a finite number"),
    ("crank: [O, A, r]", "crank: [O, A, true]", "mechanism.links.crank.2: expected a number, not true"),
    ("crank: [O, A, r]", "crank: [O, A, 3 deg]", "'3 deg' is an angle, where a length is expected"),
    ("crank: [O, A, r]", "crank: [O, A, 3 mn]", "unknown unit 'mn'"),
    ("crank: [O, A, r]", "crank: [O, A, R]", "unknown name 'R' in 'R'; did you mean 'r'?"),
    ("crank: [O, A, r]", "crank: [O, A, r/0]", "5:19: mechanism.links.crank.2: division by zero in 'r/0'"),
    ("crank: [O, A, r]", "crank: [O, A, 30 - r]", "must be positive, not 0"),
    ("crank: [O, A, r]", "crank: [O, A, __import__('os')]", "has no meaning in the expression"),
    ("crank: [O, A, r]", "crank: [O, O, r]", "a link from 'O' to itself"),
    ("crank: [O, A, r]", "crank: {from: O, length: r}", "needs both 'from' and 'to'"),
    ("crank: [O, A, r]", "crank: {from: O, to: A, length: r, telescopic: true}", "has no fixed length"),
    ("crank: [O, A, r]", "crank: {from: O, to: A, length: r, Q: [1, 2]}", "stands under 'points': {Q: [x, y]}"),
    (
        "crank: [O, A, r]",
        "crank: {frm: O, too: A}",
        "'frm' is neither a key of a link nor a point [x, y]; did you mean",
    ),
    ("crank: [O, A, r]", "crank: [O, AA, r]", "mechanism.drives: the mobility is"),
    ("crank: [O, A, r]", "crank: [X, Y, r]", "5:5: mechanism.links.crank: no other link shares a point of it (X, Y)"),
    ("P: [40, 10]", "P: [40]", "6:51: mechanism.links.rod.points.P: expected [x, y], not a list of 1"),
    ("P: [40, 10]", "A: [40, 10]", "point 'A' is an end of the link"),
    ("P: [40, 10]", "r: [40, 10]", "6:48: mechanism.links.rod.points.r: 'r' is the name of a parameter already"),
    ("    ground: {O: [0, 0], D: [100, 0]}\n", "", "there is no 'ground'"),
    ("angle: crank", "angle: crnk", "8:27: mechanism.drives.theta.angle: there is no moving link 'crnk'; did you mean"),
    ("angle: crank", "angle: ground", "there is no moving link 'ground'"),
    ("angle: crank", "angle: crank, length: rod", "a drive is one of"),
    ("angle: crank", "length: crank", "link 'crank' is not telescopic"),
    ("theta: {angle: crank}", "rod: {angle: crank}", "a drive may only bear that of what it drives"),
    ("{theta: {angle: crank}}", "[crank, crank]", "'crank' is listed twice"),
    ("{theta: {angle: crank}}", "[]", "the mobility is 1 but 0 drives are given: add 1 drive"),
    ("{theta: {angle: crank}}", "[crank, rod]", "8:11: mechanism.drives: the mobility is 1 but 2 drives are given"),
    ("length: 90", "length: 10", "9:11: mechanism.sketch: the sketch cannot be assembled"),
    ("A: [0, 30]", "A: [0, 30], Q: [1, 1]", "9:24: mechanism.sketch.Q: no link has a point 'Q'"),
    ("A: [0, 30]", "A: 30", "9:15: mechanism.sketch.A: expected [x, y], not the number 30"),
    ("sketch:", "branch: folow\n  sketch:", "9:11: mechanism.branch: expected one of side, follow, not 'folow'"),
    ("sketch:", "measures: {mu: {angle: [rod, rokcer]}}\n  sketch:", "no link 'rokcer'; did you mean 'rocker'?"),
    ("sketch:", "measures: {mu: B.x - Q.x}\n  sketch:", "no coordinate or parameter 'Q.x'"),
    (
        "sketch:",
        "measures: {mu: B.x -}\n  sketch:",
        "9:18: mechanism.measures.mu: the expression 'B.x -' ends too early",
    ),
    ("sketch:", "limits: [{distance: [O, B]}]\n  sketch:", "a limit needs 'min', 'max' or both"),
    ("sketch:", "limits: [{distance: [O, Q], min: 1}]\n  sketch:", "there is no point 'Q'"),
    ("sketch:", "limits: [{distance: [O, B], min: 3, max: 1}]\n  sketch:", "the maximum 1 is below the minimum 3"),
    ("sketch:", "limits: [{drive: theta, min: 3}]\n  sketch:", "an angle needs both 'min' and 'max'"),
    ("sketch:", "limits: [{drive: theta, min: 3 mm, max: 7}]\n  sketch:", "where an angle is expected"),
    (
        "sketch:",
        "joints: {j: {prismatic: [ground, rodd], through: O}}\n  sketch:",
        "no link 'rodd'; did you mean 'rod'?",
    ),
    ("sketch:", "joints: {j: {prismatic: [ground, rod], point: Q}}\n  sketch:", "link 'rod' has no point 'Q'"),
    ("sketch:", "joints: {j: {prismatic: [ground, rod]}}\n  sketch:", "say which one slides, as 'point'"),
    ("sketch:", "joints: {j: {slot: rod, angle: 3}}\n  sketch:", "a slot joint has no 'angle'"),
    ("sketch:", "joints: {j: {through: O}}\n  sketch:", "a joint is one of prismatic"),
    ("{r: 30}", "{r: 1/0}", "2:19: mechanism.parameters.r: division by zero"),
    ("{r: 30}", "{r: s + 1, s: 2}", "a parameter may use those above it, and 's' is below"),
    ("{r: 30}", "{r: r}", "unknown name 'r' in 'r'"),
    ("{r: 30}", "{r: 30, sin: 2}", "'sin' is a word of the expression language"),
    (
        "drives:",
        "limits: {mu: [30, 150]}\n  drives:",
        "8:11: mechanism.limits: a limit says what it is of, a measure, "
        "drive, distance or angle: [{measure: mu, min: 30, max: 150}]",
    ),
    ("drives:", "limits: [{mu: [30, 150]}]\n  drives:", "[{measure: mu, min: 30, max: 150}]"),
    ("{r: 30}", "[30]", "2:15: mechanism.parameters: expected a mapping of names, not a list of 1"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("old", "new", "message"), MECHANISM)
def test_wrong_mechanisms(tmp_path, monkeypatch, old, new, message):
    assert old in STUDY
    found = problems(tmp_path, monkeypatch, STUDY.replace(old, new))
    assert any(message in line for line in found), found
    assert all(line.startswith("study.yaml") for line in found)


# What was typed (in place of what), and the only message, which says what to write instead.
CURES = {
    "a decimal comma": ("length: 90", "length: 90,5", "mechanism.links.rod: a decimal is written with a point: 90.5"),
    "a decimal comma in a list": (
        "B, 60]",
        "B, 60,5]",
        "7:13: mechanism.links.rocker: expected [from, to, length], {from, to, length} or the link's points "
        "{A: [x, y], ...}; a decimal is written with a point: 60.5",
    ),
    "a decimal comma with a unit": (
        "{r: 30}",
        "{r: 30,5 mm}",
        "mechanism.parameters: a decimal is written with a point: 30.5 mm",
    ),
    "a decimal comma on its own": (
        "{r: 30}",
        "\n    r: 30,5",
        "'30,5' has a decimal comma; a decimal is written with a point: 30.5",
    ),
    "no space after a colon": (
        "length: 90",
        "length:90",
        "6:27: mechanism.links.rod: a ':' needs a space after it: 'length: 90'",
    ),
    "no space before a list": (
        "sketch: {A: ",
        "sketch: {A:",
        "9:12: is not YAML: a ':' needs a space after it, as in 'length: 90'",
    ),
    "no space on its own": (
        "{theta: {angle: crank}}",
        "\n    theta: angle:crank",
        "9:12: mechanism.drives.theta: expected a mapping, not 'angle:crank'; a ':' needs a space after it",
    ),
    "no brace": (
        "{r: 30}",
        "{r: 30",
        "2:15: is not YAML: this '{' is not closed where line 3 goes on; '}' or a comma is missing",
    ),
    "no ground": (
        "ground: {O",
        "base: {O",
        "4:5: mechanism.links: there is no 'ground', the fixed link whose frame is the world; rename the link that "
        "does not move (is it 'base'?)",
    ),
    "no sketch": (
        "  sketch: {A: [0, 30], B: [75, 55]}\n",
        "",
        "1:1: mechanism.sketch: points 'A', 'B' are needed to choose the assembly; add them to the sketch",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("slip", CURES)
def test_a_slip_of_writing_is_answered_with_what_to_write(tmp_path, monkeypatch, slip):
    old, new, message = CURES[slip]
    (found,) = problems(tmp_path, monkeypatch, STUDY.replace(old, new))
    assert found.endswith(message)


VARIABLE = "variables: {r: {from: 20, to: 30, step: 5}}"
QUESTIONS = [
    ("kinematic: {}", "10:1: kinematic: unknown key; did you mean 'kinematics'?"),
    ("seed: -1", "10:7: seed: must be at least 0, not -1"),
    ("seed: 1.5", "expected a whole number, not 1.5"),
    ("units: {length: furlong}", "10:17: units.length: 'furlong' is not a unit of length"),
    ("units: {lenght: mm}", "10:9: units.lenght: unknown key; did you mean 'length'?"),
    ("kinematics: [1]", "10:13: kinematics: expected a mapping, not a list of 1"),
    ("kinematics: {rates: {theta: 5 mm/s}}", "is a velocity, where an angular velocity is expected"),
    ("kinematics: {rates: {thet: 5}}", "there is no coordinate 'thet'; did you mean 'theta'?"),
    ("kinematics: {outputs: [rod]}", "'rod' is a link; its coordinate is rod.angle"),
    ("kinematics: {sweep: {crank: 3}}", "'crank' is a link; its coordinate is crank.angle, and its drive is theta"),
    ("kinematics: {sweep: {theta: [0, 360, 5]}}", "a sweep is written {from: 0, to: 360, step: 5}, not [0, 360, 5]"),
    ("kinematics: {sweep: {theta: 0..360}}", "a sweep is written {from: 0, to: 360, number: 73}, not 0..360"),
    ("kinematics: {sweep: {theta: 0:5:360}}", "a sweep is written {from: 0, to: 360, step: 5}, not 0:5:360"),
    ("kinematics: {rates: {theta: 60 RPM}}", "unknown unit 'RPM'; did you mean 'rpm'?"),
    ("kinematics: {poses: [0, 90]}", "a pose names its coordinates, as in [{theta: 0}]"),
    ("kinematics: {rates: {theta: 1 Hz}}", "unknown unit 'Hz'; did you mean 'rev/s'?"),
    ("kinematics: {rates: {theta: 60 U/min}}", "unknown unit 'U/min'; did you mean 'rpm'?"),
    ("kinematics: {outputs: [Q]}", "10:24: kinematics.outputs.0: there is no coordinate 'Q'"),
    ("kinematics: {sweep: {P: 3}}", "'P' is a point; its coordinates are P.x and P.y"),
    ("kinematics: {sweep: {theta: {from: 0, to: 9 mm, step: 1}}}", "'9 mm' is a length, where an angle is expected"),
    ("kinematics: {loads: [{at: Q, force: [0, 1]}]}", "there is no point 'Q'"),
    ("kinematics: {loads: [{at: P}]}", "a load is {at: point, force: [fx, fy]}"),
    ("kinematics: {loads: [{at: P, force: [1 mm, 1]}]}", "'1 mm' is a length, where a force is expected"),
    ("workspace: {}", "10:1: workspace.point: is missing"),
    ("workspace: {point: Q}", "there is no point 'Q'"),
    ("workspace: {point: P, integrate: {rule: gaus}}", "did you mean 'gauss'?"),
    ("workspace: {point: P, scan: {from: 5, to: 1}}", "1 is not beyond 'from', 5"),
    ("optimize: {maximize: [GII]}", "optimize.variables: is missing"),
    ("optimize: {variables: {r: {from: 1, to: 2, step: 1}}}", "say what to 'maximize' or 'minimize'"),
    ("optimize: {variables: {r: {min: 1, max: 2}}}", "variables.r.min: unknown key; did you mean 'from'?"),
    ("optimize: {variables: {q: {from: 1, to: 2, step: 1}}, maximize: GII}", "no parameter or dimension 'q'"),
    ("optimize: {variables: {r: {from: 1, to: s, step: 1}}, maximize: GII}", "no parameter or variable 's'"),
    ("optimize: {variables: {r: {from: 1, to: r, step: 1}}, maximize: GII}", "variable 'r' above it"),
    ("optimize: {variables: {r: {from: 1, to: 2}}, maximize: GII}", "needs either 'step' or 'number'"),
    ("optimize: {variables: {r: {from: 1, to: 2, step: 1}}, maximize: GIIX}", "no result 'GIIX'; did you mean 'GII'?"),
    (
        "optimize: {variables: {r: {from: 1, to: 2, step: 1}}, maximize: GII, weights: [[1, 2]]}",
        "2 weights for 1 goals",
    ),
    (
        "reliability: {dimensions: {r: 1}, limits: {kinematics.extremes.rocker.angle.range: 1}}",
        "of a swing or a stroke draw the linkage twice, at both ends, and limit a measure between",
    ),
    ("reliability: {dimensions: {r: -1}}", "10:31: reliability.dimensions.r: must be at least 0, not -1"),
    ("reliability: {dimensions: {rod.lenght: 1}}", "did you mean 'rod.length'?"),
    ("reliability: {dimensions: {'*.lenght': 1}}", "no dimension matches '*.lenght'"),
    ("reliability: {dimensions: {r: {tolerance: [2, 1]}}}", "the lowest deviation 2 is above the highest 1"),
    ("reliability: {dimensions: {r: {tolerance: [1, 2, 3]}}}", "expected a half-width or two bounds"),
    ("reliability: {dimensions: {rod.length: {tolerance: [0, 1 deg]}}}", "where a length is expected"),
    (
        "kinematics: {sweep: {drive: theta, number: 24}}",
        "kinematics.sweep: a range stands below the name of its coordinate, and 'from' and 'to' are missing: write "
        "{theta: {from: 0, to: 360, number: 24}}",
    ),
    (
        "kinematics: {sweep: {from: 10, to: 50}}",
        "kinematics.sweep: a range stands below the name of its coordinate, and 'step' is missing: write "
        "{theta: {from: 10, to: 50, step: 5}}",
    ),
    ("reliability: {dimensions: {theta: {tolerance: 1, distribution: lognormal}}}", "what is lognormal is positive"),
    ("reliability: {dimensions: {load.fx: 3 mm}}", "where a force is expected"),
    ("reliability: {limits: {P.x: {min: 0.1, max: -0.1}}}", "the maximum -0.1 is below the minimum 0.1"),
    ("reliability: {dimensions: {theta: 1 mm}}", "where an angle is expected"),
    ("reliability: {dimensions: {r: {tolerance: 1, distribution: gauss}}}", "expected one of normal, truncated_normal"),
    ("reliability: {clearances: {P: {radial: 1}}}", "only link 'rod' has point 'P'"),
    ("reliability: {clearances: {A: {radial: -1}}}", "must be at least 0"),
    ("reliability: {clearances: {A: {tolerance: 1}}}", "either 'radial' or 'diametral'"),
    ("reliability: {clearances: {A: {radial: 1, link: rocker}}}", "no link at point 'A' named 'rocker'"),
    ("reliability: {limits: {P: 1}}", "'P' is a point: limit P.x and P.y, or {radius: r}"),
    ("reliability: {limits: {P.x: -1}}", "must be at least 0"),
    ("reliability: {limits: {P.x_velocity: 1}}", "a limit of a velocity or an acceleration needs 'rates'"),
    ("reliability: {rates: {theta: 1}, limits: {P.x_velocity: 1 mm}}", "where a velocity is expected"),
    ("reliability: {methods: [forms]}", "did you mean 'form'?"),
    ("reliability: {precision: {relative: 0}}", "must be positive"),
    ("reliability: {precision: {relative: 0.1, half_width: 1}}", "give either 'relative'"),
    ("reliability: {samples: 0}", "must be at least 2, not 0"),
    ("reliability: {samples: many}", "unknown name 'many'"),
    ("reliability: {correlation: [[r, theta, 1]]}", "a correlation lies between -1 and 1, not 1"),
    ("reliability: {correlation: [[r, r, 0.1]]}", "'r' is correlated with itself; name two different ones"),
    ("reliability: {correlation: [[r, 0.1]]}", "a correlation is [name, name, coefficient]"),
    ("reliability: {dimensions: {r: 1}, correlation: [[r, theta, 0.1]]}", "no varying dimension 'theta'"),
    ("reliability: {allocate: {reliability: 1}}", "a reliability lies between 0 and 1, not 1"),
    ("reliability: {allocate: {reliability: 0.9}}", "tolerances are allocated to keep 'limits'"),
    ("kinematics: {outputs: [P, P.x]}", "kinematics.outputs.1: 'P.x' is listed twice"),
    ("matrix: {r: [1, 2]}", "matrix.r: unknown key"),
    ("stiffness: {at: P, sections: {b: {matrix: [[1]]}}}", "stiffness.sections.b.matrix: unknown key"),
    (
        f"optimize: {{{VARIABLE}, maximize: [stiffness.k_min]}}",
        "maximize.0: 'stiffness.k_min' needs the stiffness section",
    ),
    (f"optimize: {{{VARIABLE}, minimize: [k_min_mean]}}", "minimize.0: 'k_min_mean' needs the stiffness section"),
    (f"optimize: {{{VARIABLE}, maximize: [reliability.reliability]}}", "needs the reliability section, and the study"),
    ("stiffness: {}", "stiffness.at: is missing: the point whose stiffness is asked"),
    ("stiffness:", "10:1: stiffness.at: is missing: the point whose stiffness is asked"),
    ("stiffness: {at: O}", "10:17: stiffness.at: point 'O' belongs to the ground and does not move"),
    ("stiffness: {at: P, bearings: {A: 5 N*mm}}", "'5 N*mm' is a moment, where a stiffness is expected"),
    ("stiffness: {at: P, link: crank}", "link 'crank' has no point 'P'; it has O, A"),
    ("stiffness: {at: P, elastic: {rod: beam}}", "there is no section 'beam'"),
    ("stiffness: {at: P, sections: {b: {E: 1, diameter: 2, inner_diameter: 3}}}", "3 is not below the outer one 2"),
    ("stiffness: {at: P, sections: {b: {E: 1, diameter: 2, shear_factor: 0.5}}}", "counts with 'shear: true' only"),
    ("stiffness: {at: P, bearings: {A: {radial: 1, moment: 1}}}", "pin 'A' turns freely: it bears no moment"),
    ("stiffness: {at: P, actuators: {theta: [1, -2]}}", "must be positive, not -2"),
    ("stiffness: {at: P, actuators: {theta: 1e-308}}", "1e-308 is too small a number: none but 0 is below 1e-60"),
    ("stiffness: {at: P, actuators: {theta: [1, 2 N/mm]}}", "stiffness.actuators.theta.1: '2 N/mm' is"),
    ("stiffness: {at: P, actuators: {theta: []}}", "a list of those in series"),
    ("stiffness: {at: P, bearings: {P: 1}}", "no pin or slide 'P'"),
    ("stiffness: {at: P, bearings: {A: {}}}", "a bearing has a 'radial' stiffness"),
    ("stiffness: {at: P, sections: {b: {E: 1, width: 2}}}", "{E, width, height}, {E, diameter}"),
    ("stiffness: {at: P, sections: {b: {E: -1, width: 2, height: 1}}}", "must be positive"),
    ("stiffness: {at: P, actuators: {theta: 5 N/m}}", "where a rotational stiffness is expected"),
    ("stiffness: {at: P, actuators: {rod: 5}}", "there is no drive 'rod'"),
    ("stiffness: {at: P, link: rod, loads: [[1, 2]]}", "a load is [fx, fy, mz], not 2 numbers"),
    (
        "requirements: [{result: kinematic.x, at_least: 3}]",
        "there is no command 'kinematic'; did you mean 'kinematics'?",
    ),
    ("requirements: [{result: kinematics.x}]", "needs 'at_least', 'at_most' or both"),
    ("requirements: [{result: kinematics.P.x, at_least: 3, at_most: 2}]", "nothing is at least 3 and at most 2"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("section", "message"), QUESTIONS)
def test_wrong_questions(tmp_path, monkeypatch, section, message):
    found = problems(tmp_path, monkeypatch, STUDY + section + "\n")
    assert any(message in line for line in found), found
    assert all(line.startswith("study.yaml:10:") for line in found)


def test_every_mistake_in_one_go_and_in_the_order_of_the_text(tmp_path, monkeypatch):
    text = STUDY.replace("length: 90", "lenght: 90").replace("[O, A, r]", "[O, A, -1]").replace("{r: 30}", "{r: 1/0}")
    text = text.replace("angle: crank", "angle: crnk") + "kinematics: {outputs: [rod.angl]}\nworkspace: {pont: P}\n"
    found = problems(tmp_path, monkeypatch, text)
    assert [line.split(": ")[:2] for line in found] == [
        ["study.yaml:2:19", "mechanism.parameters.r"],
        ["study.yaml:5:19", "mechanism.links.crank.2"],
        ["study.yaml:6:27", "mechanism.links.rod.lenght"],
        ["study.yaml:8:27", "mechanism.drives.theta.angle"],
        ["study.yaml:10:24", "kinematics.outputs.0"],
        ["study.yaml:11:1", "workspace.point"],
        ["study.yaml:11:13", "workspace.pont"],
    ]


def test_the_mobility_is_told_beside_names_that_miss_the_drive(tmp_path, monkeypatch):
    text = STUDY.replace("drives: {theta: {angle: crank}}", "drives: {}") + "kinematics: {rates: {theta: 1}}\n"
    found = problems(tmp_path, monkeypatch, text)
    assert any("the mobility is 1 but 0 drives are given" in line for line in found), found
    assert any("there is no coordinate 'theta'" in line for line in found)


def test_a_mistake_in_a_parameter_is_told_once(tmp_path, monkeypatch):
    text = STUDY.replace("{r: 30}", "{q: 1/0, s: 2*q, r: q + s}") + "reliability: {dimensions: {rod.length: q}}\n"
    assert len(problems(tmp_path, monkeypatch, text)) == 1


def test_a_split_expression_is_told_once(tmp_path, monkeypatch):
    found = problems(tmp_path, monkeypatch, STUDY.replace("length: 90", "length: min(90, r)"))
    assert len(found) == 1
    assert "put the expression in quotes" in found[0]


@pytest.mark.parametrize("text", ["just words", "[1, 2]", "3"])
def test_what_is_no_mapping_is_no_study(tmp_path, monkeypatch, text):
    assert "is not a study: a mapping with 'mechanism' is expected" in problems(tmp_path, monkeypatch, text)[0]


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(mechdesign.StudyError, match=r"missing.yaml: cannot be read: No such file"):
        mechdesign.load(tmp_path / "missing.yaml")
    with pytest.raises(mechdesign.StudyError, match="cannot be read: Is a directory"):
        mechdesign.load(tmp_path)


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ("stiffness", "stiffness: is missing: say which point's stiffness is asked"),
        ("reliability", "reliability: asks what varies: give 'dimensions' or 'clearances'"),
        ("workspace", "workspace.point: the point whose workspace is asked for is needed"),
        ("optimize", "optimize.variables: are missing: say what may change, for example {crank.length:"),
        ("synthesize", "synthesis: is missing: say what linkages shall do, for example {path: {points:"),
    ],
)
def test_a_missing_section_is_told_with_its_file_and_line(tmp_path, question, said):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    with pytest.raises(mechdesign.StudyError) as caught:
        getattr(mechdesign, question)(mechdesign.load(path))
    assert str(caught.value).startswith(f"{path}:1:1: {said}")


@pytest.mark.slow
@pytest.mark.parametrize("part", ["{}", "kinematics:\n  {}"])
def test_thousands_of_mistakes_are_reported_in_proportion(part: str) -> None:
    def seconds(number: int) -> float:
        keys = f"\n{'  ' * ('kin' in part)}".join(f"kinematisc{index}: 1" for index in range(number))
        begun = time.process_time()
        with pytest.raises(mechdesign.StudyError) as caught:
            mechdesign.load(text=part.format(keys))
        told = str(caught.value).splitlines()
        assert len(caught.value.problems) >= number
        assert len(told) == 101
        assert told[-1] == f"and {len(caught.value.problems) - 100} more"
        return time.process_time() - begun

    seconds(200)
    assert seconds(10_000) < 5


def test_names_are_suggested_for_the_first_twenty() -> None:
    keys = "\n".join(f"kinematic{index}: 1" for index in range(50))
    with pytest.raises(mechdesign.StudyError) as caught:
        mechdesign.load(text=keys)
    assert str(caught.value).count("did you mean 'kinematics'?") == 20


def test_what_is_echoed_is_short_and_printable() -> None:
    odd = r'"\x1b[2J\u202e\n\0' + "x" * 900 + '"'
    text = f"{odd}: 1\nmechanism: {{links: {{{odd}: 1}}, drives: [{odd}]}}"
    with pytest.raises(mechdesign.StudyError) as caught:
        mechdesign.load(text=text, overrides=[f"seed={'9' * 500}x"])
    told = str(caught.value).splitlines()
    assert len(told) == len(caught.value.problems) >= 4
    assert all(line.isprintable() and len(line) < 400 for line in told)
    assert r"\x1b[2J\u202e\n\x00x" in told[0]


@pytest.mark.nightly
def test_a_mechanism_has_a_bounded_number_of_links() -> None:
    links = "".join(f"    a{index}: [O, P{index}, 1]\n" for index in range(20_000))
    with pytest.raises(mechdesign.StudyError, match=r"mechanism\.links: 20001 links are too many"):
        mechdesign.load(text=f"mechanism:\n  links:\n    ground: {{O: [0, 0]}}\n{links}  drives: [a1]\n")


def test_a_sketch_in_a_singular_pose_is_told_as_such() -> None:
    # All legs point at P: with drawn places that are rounded, the platform cannot turn into the lengths measured.
    with pytest.raises(
        mechdesign.StudyError, match=r"the sketch may be drawn in a singular pose.*the platform turned a little"
    ):
        mechdesign.load(
            text="""\
mechanism:
  links:
    ground: {A1: [-216.506, -125], A2: [216.506, -125], A3: [0, 250]}
    leg_1: {from: A1, to: B1, telescopic: true}
    leg_2: {from: A2, to: B2, telescopic: true}
    leg_3: {from: A3, to: B3, telescopic: true}
    platform: {P: [0, 0], B1: [-51.96, -30], B2: [51.96, -30], B3: [0, 60]}
  drives: {l1: {length: leg_1}, l2: {length: leg_2}, l3: {length: leg_3}}
  sketch: {P: [0, 0], B1: [-52, -30], B2: [52, -30], B3: [0, 60]}
"""
        )
