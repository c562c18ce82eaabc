"""What is wrong with a motion in time, or ends it, is said."""

from __future__ import annotations

import pytest
from helpers.studies import study_of

import mechdesign

ARM = """
mechanism:
  links: {{ground: {{O: [0, 0]}}, arm: {{from: O, to: P, length: 100{mass}}}}}
  drives: [arm]
  {limits}
dynamics: {{{more}forward: {{duration: 0.1, rows: 3, {forward}}}}}
"""


def ask(forward: str = "", more: str = "", mass: str = ", mass: 1", limits: str = "") -> str:
    """The error or the first warning of a run."""
    text = ARM.format(forward=forward, more=more, mass=mass, limits=limits)
    try:
        return str(mechdesign.dynamics(study_of(text)).warnings[0])
    except mechdesign.MechdesignError as error:
        return str(error)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"forward": "start: {am: 0}"}, "there is no drive or velocity of a drive 'am'"),
        ({"forward": "efforts: {leg: 3}"}, "there is no drive 'leg'"),
        ({"forward": "efforts: {arm: '3*P.z'}"}, "P.z"),
        ({"forward": "efforts: {arm: 3 mm}"}, "moment"),
        ({"forward": "start: {arm_velocity: 3 mm}"}, "angular velocity"),
        ({"forward": "restitution: 2"}, "at most 1"),
        ({"forward": "events: {a: {of: Q.x, value: 3}}"}, "Q.x"),
        ({"more": "rates: {arm: 3}, "}, "'forward' and 'rates' are both given"),
        ({"more": "modes: true, "}, "'forward' and 'modes' are both given"),
        ({"mass": ""}, "no inertia"),
        ({"forward": "efforts: {arm: 'log(time)'}"}, "ended early: the effort of arm is not finite at 0 s"),
        ({"limits": "limits: [{drive: arm, min: 10, max: 50}]", "forward": "start: {arm: 0}"},
         "limit of drive arm: 0 deg where 10 to 50 deg is allowed"),
        (
            {"limits": "limits: [{drive: arm, min: -5, max: 50}]", "forward": "start: {arm_velocity: -300}"},
            "ended: limit limits.0 is reached at 0.016",
        ),
    ],
)  # fmt: skip
def test_mistakes_are_named(given: dict[str, str], said: str) -> None:
    assert said in ask(**given)


def test_a_start_at_a_dead_centre_of_the_drive_is_refused() -> None:
    text = """
mechanism:
  links:
    ground: {A: [0, 0]}
    crank: {from: A, to: B, length: 1, mass: 1}
    rod: {from: B, to: C, length: 2, mass: 1}
    slider: {points: {C: [0, 0]}, mass: 1}
  joints: {guide: {prismatic: [ground, slider], through: A}}
  drives: {s: {slide: guide}}
  sketch: {B: [0.7, 0.7], C: [2.5708, 0]}
dynamics: {forward: {duration: 1, start: {s: 3}}}
"""
    with pytest.raises(mechdesign.MechdesignError, match="singular pose"):
        mechdesign.dynamics(study_of(text))
