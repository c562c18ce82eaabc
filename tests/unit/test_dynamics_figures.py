"""Pictures of dynamics: what is drawn of a motion's forces, and what acts on each link."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.gallery import study_named
from helpers.pages import faults
from helpers.pictures import figure_of
from helpers.studies import study_of

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.pictures import figures
from mechdesign.questions.dynamics.analysis import DrawnForces
from mechdesign.questions.dynamics.figures.free_bodies import FreeBody, free_bodies_picture
from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.questions.dynamics.free_bodies import Action, actions_on

# NumPy is silent, as inside a question.
pytestmark = pytest.mark.usefixtures("silent")

SPRUNG = """
units: {length: mm}
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0], S: [60, 90], T: [-30, 60], U: [150, 60]}
    crank: {from: O, to: A, length: 40, mass: 1, inertia: 10}
    rod: {from: A, to: B, length: 90, points: {P: [45, 30]}, mass: 1.5, inertia: 100}
    rocker: [D, B, 60]
  drives: {theta: {angle: crank}}
  sketch: {A: [0, 40], B: [85, 55]}
  springs:
    coil: {between: [S, B], stiffness: 2, free_length: 60}
    gas: {between: [T, A], force: 40}
    strut: {between: [U, rod.P], damping: 0.1, stiffness: 1, free_length: 50}
    spiral: {between: [ground, rocker], stiffness: 3 N*m/rad, free_angle: 20 deg}
dynamics:
  sweep: {theta: {from: 0, to: 360, step: 10}}
  rates: {theta: 60 rpm}
  gravity: [0, -9.81 m/s^2]
  loads: [{at: P, force: [0, -100]}, {link: rocker, moment: 500}, {between: [A, D], force: 7}]
"""

# A belt along the arm drives the fore; a controller turns the hand against the arm.
HELD = """
mechanism:
  links:
    ground: {O: [0, 0]}
    arm: {from: O, to: A, length: 210, mass: 2}
    fore: [A, P, 130]
    hand: [P, T, 40]
    motor: [O, M, 20]
  drives: {one: {angle: arm}, two: {angle: motor}}
  couplings:
    belt: {set: fore, of: motor, ratio: 1, phase: 60, wheels: belt, radius: 18}
    hold: {set: hand, to: 0.5*arm.angle - fore.angle}
  sketch: {A: [200, 60], P: [180, 190], T: [220, 190], M: [10, 15]}
dynamics:
  sweep: {one: {from: 0, to: 100, step: 10}, two: {from: 120, to: 140, step: 10}}
  loads: [{at: T, force: [5, -20]}]
"""


@cache
def answered(text: str) -> tuple[mechdesign.Study, mechdesign.Answer]:
    """A study, of the gallery by its name, and its dynamics."""
    study = mechdesign.load(text=text) if ":" in text else study_named(text)
    return study, mechdesign.dynamics(study)


def drawn(study: mechdesign.Study) -> dict[str, object]:
    """Pictures of a study's dynamics by their names."""
    with style.context():
        gallery = figures(study, mechdesign.dynamics(study))
        assert not gallery.failed
        for figure in gallery.values():
            style.encoded(figure)
            assert not list(faults(figure))
    return dict(gallery)


# A force on a pin of three links and on one of the ground; a cylinder; a controller that moves a slide; a driven slot.
PINNED = """
mechanism:
  links:
    ground: {O: [0, 0], D: [100, 0], G: [0, 90]}
    crank: [O, A, 40]
    rod: [A, B, 90]
    rocker: [D, B, 60]
    strut: {from: B, to: C, length: 50}
    table: {C: [0, 0], E: [30, 0]}
  joints: {guide: {prismatic: [ground, table], point: C, through: G}}
  drives: [crank]
  sketch: {A: [0, 40], B: [85, 55], C: [60, 90]}
dynamics:
  poses: [{crank: 80}]
  loads: [{at: B, force: [10, -30]}, {at: D, force: [0, 5]}, {at: C, force: [-4, 0]}]
"""
CONTROLLED = """
mechanism:
  links:
    ground: {O: [0, 0], G: [0, 50]}
    arm: [O, P, 60]
    cart: {C: [0, 0], E: [30, 0]}
    lid: {from: E, to: F, length: 40}
  joints: {rail: {prismatic: [ground, cart], point: C, through: G}}
  drives: {arm: {angle: arm}, lid: {angle: lid}}
  couplings: {follow: {set: rail.slide, to: "2*arm.angle + 10"}}
  sketch: {P: [50, 30], C: [80, 50], F: [120, 80]}
dynamics:
  poses: [{arm: 30, lid: 40}]
  loads: [{at: E, force: [-12, -5]}, {at: P, force: [0, -3]}]
"""
SHIPPED = ("balanced_arm", "cam_arm", "excavator_lift", "flywheel_press", "one_tooth_difference",
           "planetary", "rise_dwell_return", "twin_cylinder", "wedge_press", "wiper_motor")  # fmt: skip
SWINGING = ("braked_pendulum", "pendulum")  # motions in time, which take seconds


def bodies(text: str) -> dict[str, list[Action]]:
    """What is drawn on each body, by the title of its panel, with the sizes as they are written."""
    study, result = answered(text)
    picture = free_bodies_picture(DynamicsView(study, result))
    assert picture is not None
    shown = {}
    for panel in picture.panels:
        (free,) = (mark for mark in panel.marks if isinstance(mark, FreeBody))
        shown[panel.title] = [
            replace(own, force=own.force and float(free.words(own).split()[-1]) * own.force / own.size)
            for own in free.acting
        ]
    return shown


@pytest.mark.parametrize(
    "text", [SPRUNG, HELD, PINNED, CONTROLLED, *(pytest.param(name, marks=pytest.mark.slow) for name in SHIPPED),
             *(pytest.param(name, marks=pytest.mark.nightly) for name in SWINGING)],
)  # fmt: skip
def test_the_forces_that_are_drawn_on_each_body_balance(text: str) -> None:
    for title, acting in bodies(text).items():
        # A number is written with three digits; what is below half a percent of the largest on a body is left out.
        largest = max((action.size for action in acting), default=0.0)
        assert abs(sum(action.force for action in acting)) <= 1.2e-2 * largest, title
        if not any(action.undetermined for action in acting):
            about = acting[0].place
            arms = [((action.place - about).conjugate() * action.force).imag for action in acting]
            size = max([*map(abs, arms), *(abs(action.moment) for action in acting)])
            reach = max(abs(action.place - about) for action in acting)
            assert abs(sum(arms) + sum(action.moment for action in acting)) <= 1.2e-2 * max(size, largest * reach), (
                title
            )


def test_a_driven_slide_shows_the_push_of_its_drive_beside_what_it_bears() -> None:
    # W tan(alpha + 2 phi), and on the floor the weight with the friction of its pressure.
    shown = {own.name: own for own in bodies("wedge_press")["wedge; open: moments of floor, face"]}
    push = 1000 * np.tan(np.radians(8) + 2 * np.arctan(0.1))
    assert shown["push"].force == pytest.approx(-push, rel=2e-3)
    assert shown["floor"].force.real == pytest.approx(0.1 * shown["floor"].force.imag, rel=5e-3)


def test_a_load_on_the_pin_of_several_links_is_drawn_on_the_pin_and_one_on_the_ground_there() -> None:
    shown = bodies(PINNED)
    assert [own.kind for own in shown["pin B"]] == ["joint", "joint", "joint", "load"]
    assert 5j in [own.force for own in shown["ground"] if own.kind == "load"]


@pytest.mark.slow
def test_what_acts_between_moving_links_alone_is_not_drawn_on_the_whole() -> None:
    # A coupling turns the wheel against the output.
    shown = bodies("one_tooth_difference")
    assert "coupling" in {own.kind for own in shown["wheel"]}
    assert "coupling" not in {own.kind for own in shown["Mechanism"]}


def test_a_cylinder_says_how_hard_it_pushes_or_pulls() -> None:
    titles = [*bodies("excavator_lift")]
    assert any(title.startswith("boom_cylinder, pushes 607") for title in titles)
    assert any(title.startswith("stick_cylinder, pulls 56.5") for title in titles)


@pytest.mark.parametrize("text", [SPRUNG, HELD, "flywheel_press", "excavator_lift", "twin_cylinder"])
def test_actions_on_every_moving_link_are_in_equilibrium(text: str) -> None:
    study, result = answered(text)
    record = DrawnForces.of(result)
    for index in (0, 7, 19):
        acting = [each.at(0) for each in actions_on(record.motion, record.shown.take(np.array([index])))]
        links = {action.link for action in acting} - {"ground"}
        assert {link for link in links if not link.startswith("pin:")} == set(study.mechanism.description.links) - {
            "ground"
        }
        largest = max(action.size for action in acting)
        for link in links:
            own = [action for action in acting if action.link == link]
            assert abs(sum(action.force for action in own)) < 1e-11 * largest
            moments = [action.moment + (action.place.conjugate() * action.force).imag for action in own]
            assert abs(sum(moments)) < 1e-11 * largest * study.mechanism.size


@pytest.mark.nightly
def test_every_picture_of_a_motion_is_drawn_and_laid_out() -> None:
    names = set(drawn(mechdesign.load(text=SPRUNG)))
    assert names == {"free_bodies", "efforts", "joint_forces", "bearings", "shaking", "energies"}


def test_what_is_nothing_is_not_drawn() -> None:
    assert set(drawn(study_named("balanced_arm"))) == {"free_bodies", "joint_forces", "bearings"}


def test_listed_poses_have_free_bodies_alone() -> None:
    study = mechdesign.load(
        text=SPRUNG.replace("sweep: {theta: {from: 0, to: 360, step: 10}}", "poses: [{theta: 30}, {theta: 80}]")
    )
    assert set(drawn(study)) == {"free_bodies"}


def test_efforts_mark_the_peak_between_the_rows() -> None:
    with style.context():
        effort = figure_of(*answered("flywheel_press"), "efforts").axes[0]
    place, value = np.array(effort.lines[2].get_xydata())[0]
    assert (place, value) == pytest.approx((244.423, 7570.88), rel=1e-5)
    assert "peak 7571" in effort.get_title("left")
    assert "mean 119" in effort.get_title("left")


def test_bearing_forces_in_the_frame_turn_with_the_link() -> None:
    with style.context():
        frame, link = figure_of(*answered("twin_cylinder"), "bearings").axes[:2]
    # The crank's pin: the force turns with the crank in the frame, and hardly in the crank.
    way, own = (np.array(axes.lines[2].get_xydata()) @ [1, 1j] for axes in (frame, link))
    assert np.abs(own) == pytest.approx(np.abs(way))
    crank = np.unwrap(np.angle(way / own))
    assert (np.diff(crank) > 0).all()
    assert crank[-1] - crank[0] == pytest.approx(2 * np.pi)
    assert np.ptp(np.unwrap(np.angle(way))) > 6
    assert np.ptp(np.angle(own)) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("name", "links"), [("excavator_lift", 8), ("flywheel_press", 3)])
def test_free_bodies_on_paper_are_those_that_a_page_holds(name: str, links: int) -> None:
    study = study_named(name)
    result = mechdesign.dynamics(study)
    with style.context("paper"):
        figure = figures(study, result)["free_bodies"]
        style.encoded(figure)
        assert not list(faults(figure))
    words = " ".join(text.get_text().replace("\n", " ") for text in figure.texts)
    assert (f"of {links} links those 3 with the largest forces" in words) == (links > 3)


def test_ring_of_a_peak_lies_on_its_curve_where_the_opposite_is_as_large() -> None:
    """A weight of 1 kg on an arm of 100 mm holds -981 N mm at 180 deg, the first of two equal peaks, +981 at 360."""
    study = study_of("""
    units: {length: mm}
    mechanism:
      links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 100, mass: 1, center: [100, 0]}}
      drives: [arm]
    dynamics: {sweep: {arm: {from: 90, to: 450, step: 15}}, gravity: [0, -9.81 m/s^2]}
    """)
    with style.context():
        axes = figure_of(study, mechdesign.dynamics(study), "efforts").axes[0]
        ring = next(line for line in axes.get_lines() if line.get_label() == "peak")
        unit = {"[N·mm]": 1.0, "[N·m]": 1e3}[axes.get_ylabel().rpartition(" ")[2]]
        assert np.ravel(ring.get_xydata()) * [1, unit] == pytest.approx([180, -981], rel=1e-6)
        assert "peak -981 N" in axes.get_title(loc="left") or "peak -0.981 N" in axes.get_title(loc="left")
