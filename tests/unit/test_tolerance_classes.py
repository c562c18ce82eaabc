"""Tolerance classes of ISO 286-1 and ISO 2768-1, and fits, as tolerances and clearances of a study."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest

import mechdesign
from mechdesign.questions.reliability.fit_laws import fit_law
from mechdesign.questions.reliability.schema.iso_tolerances import (
    ToleranceClassError,
    angle_deviations,
    deviations,
    fit_deviations,
)
from mechdesign.questions.reliability.schema.section import in_words
from mechdesign.questions.reliability.study_sources import find_sources
from mechdesign.study.designs import variant

# Limit deviations in micrometres as handbooks print them [ISO 286-2:2010].
PUBLISHED = {
    (20, "H7"): (0, 21), (20, "g6"): (-20, -7), (20, "h6"): (-13, 0), (20, "f7"): (-41, -20), (20, "p6"): (22, 35),
    (20, "k6"): (2, 15), (20, "N9"): (-52, 0), (20, "P7"): (-35, -14), (20, "K7"): (-15, 6), (20, "M7"): (-21, 0),
    (20, "js9"): (-26, 26), (20, "S7"): (-48, -27), (20, "M8"): (-29, 4), (20, "K5"): (-8, 1), (20, "h9"): (-52, 0),
    (20, "J7"): (-9, 12), (20, "j6"): (-4, 9), (2, "N9"): (-29, -4), (3, "H7"): (0, 10), (3.001, "H7"): (0, 12),
    (50, "H8"): (0, 39), (50, "f7"): (-50, -25), (50, "h9"): (-62, 0), (50, "r6"): (34, 50), (50, "t6"): (54, 70),
    (80, "s6"): (59, 78), (65, "s6"): (53, 72), (100, "d9"): (-207, -120), (100, "H11"): (0, 220),
    (100, "c11"): (-390, -170), (120, "e8"): (-126, -72), (150, "u6"): (190, 215), (200, "n6"): (31, 60),
    (260, "M6"): (-41, -9), (300, "D10"): (190, 400), (400, "m6"): (21, 57), (500, "H7"): (0, 63),
    (500, "g6"): (-60, -20), (500, "k6"): (5, 45), (500, "p6"): (68, 108), (500, "x6"): (820, 860),
    (1000, "h7"): (-90, 0), (3000, "JS8"): (-165, 165),
}  # fmt: skip
# Formulas of shafts from 10 mm on by the geometric mean of the range [ISO 286-1:1988, table 4].
FORMULAS = {
    "d": lambda d: -16 * d**0.44, "e": lambda d: -11 * d**0.41, "f": lambda d: -5.5 * d**0.41,
    "g": lambda d: -2.5 * d**0.34, "n": lambda d: 5 * d**0.34,
}  # fmt: skip
BY_GRADE = {
    "t": (7, 0.63), "u": (7, 1), "v": (7, 1.25), "x": (7, 1.6), "y": (7, 2), "z": (7, 2.5), "za": (8, 3.15),
    "zb": (9, 4), "zc": (10, 5),
}  # fmt: skip
RANGES = (10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
FINE = (24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)

ARM = """
mechanism:
  links: {ground: {O: [0, 0], C: [100, 0]}, arm: [O, P, 90], rod: [P, Q, 60], rocker: [C, Q, 80]}
  drives: [arm]
  sketch: {P: [30, 85], Q: [85, 78]}
"""


@pytest.mark.parametrize(("size", "name"), PUBLISHED)
def test_published_limit_deviations(size, name):
    assert np.array(deviations(name, size)) * 1e3 == pytest.approx(PUBLISHED[size, name], abs=1e-9)


def test_standard_tolerances_follow_their_formula():
    for low, high in pairwise(RANGES):
        d = math.sqrt(low * high)
        i = 0.45 * d ** (1 / 3) + 0.001 * d
        for grade, factor in zip(
            range(6, 19), (10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500), strict=True
        ):
            assert deviations(f"H{grade}", high)[1] * 1e3 == pytest.approx(factor * i, rel=0.05)


def test_fundamental_deviations_follow_their_formulas():
    for low, high in pairwise(RANGES):
        for letter, formula in FORMULAS.items():
            nearest = deviations(f"{letter}5", high)[letter < "h"] * 1e3
            assert nearest == pytest.approx(formula(math.sqrt(low * high)), rel=0.045, abs=0.5)
    for low, high in pairwise(FINE):
        for letter, (grade, factor) in BY_GRADE.items():
            formula = deviations(f"H{grade}", high)[1] * 1e3 + factor * math.sqrt(low * high)
            assert deviations(f"{letter}5", high)[0] * 1e3 == pytest.approx(formula, rel=0.035, abs=3.5)


@pytest.mark.parametrize("name", ["h7", "H11", "js5", "K7", "M6", "n6", "N9", "P7", "zc8", "ISO 2768-c"])
def test_sizes_at_once_are_those_one_by_one(name):
    sizes = np.array([3.5, 6.0, 14.5, 30.0, 30.001, 79.0, 260.0, 400.0])
    low, high = deviations(name, sizes)
    assert np.stack([low, high], axis=1).tolist() == [list(deviations(name, size)) for size in sizes]
    with pytest.raises(ToleranceClassError, match="not of 4500 mm"):
        deviations(name, np.append(sizes, [4500.0, 5000.0]))


def test_holes_mirror_shafts():
    for size in (2, 5, 30, 77, 480):
        for letter in ("a", "c", "d", "e", "f", "g", "h"):
            low, high = deviations(f"{letter}8", size)
            assert deviations(f"{letter.upper()}8", size) == pytest.approx((-high, -low))
        for letter, fine, coarse in (
            ("k", 8, None),
            ("m", 8, 9),
            ("n", 8, None),
            ("p", 7, 8),
            ("s", 7, 9),
            ("zc", 7, 8),
        ):
            ei = deviations(f"{letter}6", size)[0]
            delta = deviations(f"H{fine}", size)[1] - deviations(f"H{fine - 1}", size)[1] if size > 3 else 0.0
            assert deviations(f"{letter.upper()}{fine}", size)[1] == pytest.approx(delta - ei)
            if coarse:
                assert deviations(f"{letter.upper()}{coarse}", size)[1] == pytest.approx(-ei)


@pytest.mark.parametrize(
    ("size", "name", "message"),
    [
        (20, "t6", "above 24 up to 500 mm"),
        (600, "g6", "above 0 up to 500 mm"),
        (4000, "h7", "up to 3150 mm, not of 4000 mm"),
        (0, "h7", "above 0"),
        (20, "l7", "a, b, c, cd, d, e, ef, f, fg, g, h, js, j, k"),
        (20, "h19", "from 1 to 18"),
        (20, "j9", "j5, j6, j7 and (up to 3 mm) j8"),
        (20, "K9", "up to 3 mm"),
        (0.2, "ISO 2768-m", "from 0.5 to 4000 mm"),
        (2, "ISO 2768-v", "from 3 to 4000 mm"),
        (20, "ISO 2768-k", "ISO 2768-f, -m, -c and -v"),
    ],
)
def test_what_is_not_given_names_what_there_is(size, name, message):
    with pytest.raises(ToleranceClassError, match=re.escape(message)):
        deviations(name, size)


def test_general_tolerances_of_lengths_and_angles():
    assert [deviations("ISO 2768-m", size)[1] for size in (0.5, 3, 6, 30, 31, 400, 401, 4000)] == [
        0.1, 0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 2.0,
    ]  # fmt: skip
    assert [deviations(f"ISO 2768-{each}", 100)[1] for each in "fmcv"] == [0.15, 0.3, 0.8, 1.5]
    assert [angle_deviations("ISO 2768-m", leg)[1] * 60 for leg in (10, 50, 120, 400, 401)] == [60, 30, 20, 10, 5]
    assert [angle_deviations(f"ISO 2768-{each}", 60)[1] * 60 for each in "fmcv"] == [20, 20, 30, 60]


def study(section, units="{}", arm="90"):
    text = f"{ARM.replace('90', arm)}units: {units}\nreliability: {{poses: [{{arm: 70}}], outputs: [Q], {section}}}"
    return mechdesign.load(text=text)


def ends(given, name):
    """Lowest and highest deviation of a dimension at its nominal value."""
    return given.reliability.dimensions[name].ends(given.sizes[name])


def test_tolerances_of_dimensions_by_class():
    found = study(
        'dimensions: {"*.length": ISO 2768-m, arm.length: js9, rod.length: {tolerance: h7, distribution: uniform}}'
    )
    assert ends(found, "arm.length") == pytest.approx((-0.0435, 0.0435))
    assert ends(found, "rod.length") == pytest.approx((-0.03, 0.0))
    assert ends(found, "rocker.length") == pytest.approx((-0.3, 0.3))


def test_a_parameter_has_the_class_of_the_length_that_it_sets():
    text = ARM.replace("arm: [O, P, 90]", "arm: [O, P, r]").replace(
        "mechanism:", "mechanism:\n  parameters: {r: 90, k: 2}\n  measures: {reach: Q.x - k*r}\n"
        "  limits: [{measure: reach, max: 10*r}]"
    )  # fmt: skip
    found = mechdesign.load(text=text + "reliability: {dimensions: {r: js9}}")
    assert ends(found, "r")[1] == pytest.approx(0.0435)
    with pytest.raises(mechdesign.StudyError, match="js9 is of a length or an angle of the drawing"):
        mechdesign.load(text=text + "reliability: {dimensions: {k: js9}}")


def test_classes_go_by_millimetres_in_any_unit():
    inches = ARM.replace("100", "4").replace("90", "2").replace("60", "3").replace("80", "3").replace("30, 85", "1, 2")
    text = inches.replace("85, 78", "3.4, 2.9") + "units: {length: in}\n"
    section = "reliability: {dimensions: {arm.length: js9}, clearances: {P: {fit: 20 H7/g6}}}"
    found = mechdesign.load(text=text + section)
    assert ends(found, "arm.length")[1] == pytest.approx(0.037 / 25.4)
    assert found.reliability.clearances["P"].radius == pytest.approx(0.5 * 0.024 / 25.4)
    with pytest.raises(mechdesign.StudyError, match="this study's lengths are dimensionless"):
        mechdesign.load(text=text.replace("length: in", "length: dimensionless") + section)


def test_an_angle_goes_by_its_shorter_leg():
    section = "dimensions: {plate.angle: {tolerance: ISO 2768-c, leg: 60}}"
    text = """
    mechanism:
      links: {ground: {O: [0, 0]}, arm: [O, P, 90], bracket: {P: [0, 0], T: [60, 0]}}
      joints: {plate: {fixed: [arm, bracket], angle: 30}}
      drives: [arm]
      sketch: {P: [90, 0]}
    """
    found = mechdesign.load(text=text + f"reliability: {{poses: [{{arm: 70}}], outputs: [T], {section}}}")
    assert ends(found, "plate.angle") == pytest.approx((-0.5, 0.5))
    with pytest.raises(mechdesign.StudyError, match="shorter leg; say which"):
        mechdesign.load(text=text + "reliability: {dimensions: {plate.angle: ISO 2768-c}}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("dimensions: {arm: js9}", "js9 is of a length or an angle of the drawing"),
        ("dimensions: {arm.length: js19}", "'js19' is no tolerance class"),
        ('dimensions: {"*.[xy]": ISO 2768-m}', "ground.O.x has no such tolerance and needs one of its own"),
        ("dimensions: {arm.length: {tolerance: js9, leg: 4}}", "a length has its own size"),
        ("dimensions: {arm.length: {tolerance: 0.1, leg: 4}}", "the leg is that of an angle"),
        ("clearances: {P: {fit: 20 H7/k6}}", "a transition fit, from -0.015 to +0.019 mm"),
        ("clearances: {P: {fit: 20 H7/p6}}", "an interference fit, from -0.035 to -0.001 mm"),
        ("clearances: {P: {fit: 20 g6/H7}}", "such as 20 H7/g6"),
        ("clearances: {P: {fit: 20 H7/g6, tolerance: 0.01}}", "a fit has the tolerances of its hole and shaft"),
        ("clearances: {P: {fit: 20 H7/g6, distribution: triangular}}", "normal or uniform"),
        ("clearances: {P: {fit: 20 H7/g6}}, limits: {Q.x: 1}, allocate: {reliability: 0.9, cost: {P: 1}}",
         "a fit is not allocated"),
    ],
)  # fmt: skip
def test_wrong_classes_and_fits_say_what_to_write(section, message):
    with pytest.raises(mechdesign.StudyError, match=re.escape(message)):
        study(section)


def test_a_fit_is_the_difference_of_its_hole_and_shaft():
    size, hole, shaft = fit_deviations("20 H7/g6")
    assert (size, *hole, *shaft) == pytest.approx((20, 0, 0.021, -0.020, -0.007))
    for distribution, third in (("normal", 3.0), ("uniform", math.sqrt(3.0))):
        (pin,) = find_sources(study(f"clearances: {{P: {{fit: 20 H7/g6, distribution: {distribution}}}}}"))[0].pins
        mean, variance = pin.moments[:2]
        assert mean == pytest.approx(0.012)
        assert variance == pytest.approx((0.0105**2 + 0.0065**2) / third**2 / 4)
        assert pin.ends[1] == pytest.approx(0.0205)


@pytest.mark.slow
def test_a_fit_of_uniform_sizes_is_a_trapezoid():
    from scipy.special import ndtri

    hole, shaft = 3.0, 1.0
    law = fit_law("uniform", hole, shaft, 0.0)
    p = np.linspace(0.0005, 0.9995, 4001)
    one, other = np.meshgrid(np.linspace(-hole, hole, 1501), np.linspace(-shaft, shaft, 501))
    assert law.at(ndtri(p)) == pytest.approx(np.quantile(0.5 * (one - other), p), abs=4e-3)
    x = law.at(ndtri((np.arange(200_000) + 0.5) / 200_000))
    assert law.moments == pytest.approx([np.mean(x**k) for k in (1, 2, 3, 4)], rel=1e-4, abs=1e-9)


def test_a_class_follows_the_size_that_is_changed():
    given = study("dimensions: {arm.length: js9}")
    assert ends(variant(given, {"arm.length": 50.0}), "arm.length")[1] == 0.031


def test_an_allocated_class_keeps_its_middle():
    given = study("dimensions: {arm.length: h9, rod.length: js9}, limits: {Q.y: 0.1}, allocate: {reliability: 0.99}, "
                  "samples: 2000, sobol: 0")  # fmt: skip
    text = mechdesign.reliability(given).files["allocated.yaml"]
    found = mechdesign.load(text=text)
    assert sum(ends(found, "arm.length")) == pytest.approx(-0.087)
    assert sum(ends(found, "rod.length")) == 0.0


def test_check_shows_what_classes_and_fits_come_to():
    given = study('dimensions: {"*.length": ISO 2768-m, arm.length: h9}, clearances: {P: {fit: 20 H7/g6}}')
    lines = in_words(given.reliability, given.mechanism.graph, given.sizes)
    assert lines[1:] == [
        "fit: P, 20 H7/g6: radial clearance 0.0035 to 0.0205",
        "tolerance: ISO 2768-m of rod.length, rocker.length: -0.3 to +0.3",
        "tolerance: h9 of arm.length: -0.087 to +0",
    ]
