"""Files as people send them: arcs, dead centres, pivots listed last, addresses out of a text, speeds of all sizes."""

import contextlib
import math
import random
import re
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import mechdesign

DATA = Path(__file__).parents[1] / "data" / "imports"
ADDRESS = next(line.split()[-1] for line in (DATA / "pmks.txt").read_text().splitlines() if "://" in line)
INCH = 24.5 / 96  # millimetres of Linkage in a unit of its files


def moved(name):
    return mechdesign.kinematics(mechdesign.load(text=mechdesign.convert(DATA / name))).main


def test_an_arc_of_linkage_is_a_link_about_its_centre():
    main = moved("curvedslider1.linkage2")
    pin, end, pivot = (main[f"{p}.x"] + 1j * main[f"{p}.y"] for p in ("P1", "P5", "P1_center"))
    radius, fixed = 176.326531 * INCH, complex(-59, -71) * INCH
    # Both ends of the slot and the pin stay on the circle, wherever the slot turns to.
    for place in (pin, end, fixed):
        assert np.abs(place - pivot) == pytest.approx(radius, rel=1e-6)
    assert np.abs(end - fixed) == pytest.approx(abs(262 + 45j) * INCH, rel=1e-9)
    # Between its ends, on the side on which it is drawn.
    assert (np.abs(pin - fixed) < abs(262 + 45j) * INCH).all()


def test_a_pin_stops_at_the_end_of_its_arc():
    text, center = (DATA / "curvedslider1.linkage2").read_text(), complex(91.6093, -162.6771)
    end = center + 176.326531 * np.exp(1j * math.radians(95))
    text = text.replace('x="203.000000" y="-26.000000"', f'x="{end.real:.6f}" y="{end.imag:.6f}"')
    main = mechdesign.kinematics(mechdesign.load(text=mechdesign.convert(text=text))).main
    far = np.abs(main["P1.x"] + 1j * main["P1.y"] - complex(-59, -71) * INCH)
    # The crank turns as far as the pin is at the end of the slot, whose other end is the slot's pivot.
    assert far.max() == pytest.approx(abs(end - complex(-59, -71)) * INCH, rel=1e-4)
    assert np.ptp(main["link_0"]) < 350


@pytest.mark.parametrize("turned", [False, True])
def test_the_angle_of_a_crank_counts_from_its_pivot(turned):
    text, listed = (DATA / "u1_four_bar.linkage2").read_text(), '<connector id="12"/>\n\t\t<connector id="7"/>'
    assert listed in text
    text = text.replace(listed, "".join(listed.split("\n\t\t")[::-1])) if turned else text
    main = mechdesign.kinematics(mechdesign.load(text=mechdesign.convert(text=text))).main
    angle = math.atan2(-95.062677 + 188.976378, 85.069606 - 18.897638)
    assert main["link_2"][0] == pytest.approx(math.degrees(angle), abs=1e-6)


def test_a_file_at_a_dead_centre_is_written_with_what_to_move():
    text = mechdesign.convert(DATA / "trammel.linkage2")
    assert "What to move before it runs" in text
    assert "'P6' lies within 1 %" in text
    # The crank a little on: the trammel of Archimedes, whose two sliders hold P5 on an ellipse.
    places = {"P8": [5.85, -77.06], "P4": [0, -21.3], "P6": [3.7, 12.25]}
    study = mechdesign.load(text=text, overrides={f"mechanism.sketch.{name}": xy for name, xy in places.items()})
    main = mechdesign.kinematics(study).main
    valid = main["valid"].astype(bool)
    rod, short = (151.181102 + 84.283465) * INCH, (48 + 84.283465) * INCH
    ellipse = (main["P5.x"] / rod) ** 2 + ((main["P5.y"] - 12.25) / (rod - short)) ** 2
    assert valid.sum() > 10
    assert ellipse[valid] == pytest.approx(1.0, abs=1e-4)


def test_the_text_of_pmks_for_the_desktop_is_a_four_bar():
    main = moved("pmks_desktop.txt")
    pin, tracer = main["P3.x"] + 1j * main["P3.y"], main["P5.x"] + 1j * main["P5.y"]
    crank = 100 + 100j + 250 * np.exp(1j * np.radians(main["input"]))
    assert np.abs(pin - crank) == pytest.approx(abs(50 + 380j), rel=1e-9)
    assert np.abs(pin - (600 + 100j)) == pytest.approx(abs(200 - 380j), rel=1e-9)
    assert np.abs(tracer - crank) == pytest.approx(abs(150 + 25j), rel=1e-9)


def test_slides_of_pmks_for_the_desktop_keep_their_lines():
    lines = (
        "ground,input,R,0,0,tfft|input,coupler,R,30,40,tfff|coupler,block,R,120,10,tfff|block,ground,P,120,10,0,tfff"
    )
    for text in (f"mech={lines}", "https://pmks.example/?mech=" + lines, "mech=\n" + lines.replace("|", "\n")):
        main = mechdesign.kinematics(mechdesign.load(text=mechdesign.convert(text=text))).main
        crank = 50 * np.exp(1j * np.radians(main["input"]))
        way = crank.real + np.sqrt(90**2 + 30**2 - (10 - crank.imag) ** 2)
        assert main["P3.x"] == pytest.approx(way, rel=1e-9)
        assert main["P3.y"] == pytest.approx(10, rel=1e-9)


@pytest.mark.parametrize("form", ["<{}>", "[my linkage]({})", "{}.", "[a](<{}>).", "  <{}>.\n"])
def test_an_address_is_read_as_it_stands_in_a_text(form):
    assert mechdesign.convert(text=form.format(ADDRESS)) == mechdesign.convert(text=ADDRESS)
    assert mechdesign.convert(form.format(ADDRESS).strip()) == mechdesign.convert(ADDRESS)


@pytest.mark.parametrize("number", ["1e9", "1e12", "-1e11", "1e-9", "1e308", "nan"])
@pytest.mark.parametrize("key", ["cpm", "throw", "rpm", "x"])
def test_an_input_of_any_pace_takes_little_time_and_memory(key, number):
    text = (DATA / "two_actuators.linkage2").read_text()
    tracemalloc.start()
    begun = time.process_time()
    with contextlib.suppress(mechdesign.MechdesignError):
        mechdesign.convert(text=re.sub(rf'\b{key}="[^"]*"', f'{key}="{number}"', text, count=1))
    assert tracemalloc.get_traced_memory()[1] < 100e6
    assert time.process_time() - begun < 5
    tracemalloc.stop()


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_file_is_a_study_or_a_message(seed):
    rng, codes = random.Random(seed), set()
    texts = [path.read_text() for path in sorted(DATA.iterdir()) if path.suffix in (".linkage2", ".txt", ".json")]
    for _ in range(60):
        text = rng.choice(texts)
        for _ in range(rng.randint(1, 3)):
            spots = [match.span() for match in re.finditer(r"-?\d+(?:\.\d+)?|true|false|[a-z]\w+", text)]
            begin, end = rng.choice(spots)
            new = rng.choice(["0", "-1", "1e9", "1e300", "nan", "", "true", text[slice(*rng.choice(spots))]])
            text = text[:begin] + new + text[end:]
        begun = time.process_time()
        try:
            mechdesign.load(text=mechdesign.convert(text=text))
        except mechdesign.MechdesignError as error:
            codes.add(error.exit_code)
        assert time.process_time() - begun < 10
    assert codes <= {2, 3}
