"""A motion in time that fails meets nothing; one that ends by itself says until when."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.questions.dynamics import motion_in_time

DOOR = """
units: {length: m, angle: rad, force: N}
mechanism:
  links: {ground: {O: [0, 0], G: [2, 0]}, leaf: {from: O, to: P, length: 1, mass: 3, center: [0, 0], inertia: 5}%s}
  drives: {door: {angle: leaf}}
  sketch: {P: [1, 0]%s}
dynamics:
  forward: {duration: 1, rows: 11, start: {door: 0, door_velocity: 1}%s}
requirements: [{result: dynamics.forward.door_velocity, at_most: 100%s}]
"""


def judged(
    forward: str = "", mechanism: str = "", sketch: str = "", unassembled: str = ""
) -> tuple[mechdesign.Answer, mechdesign.Verdict]:
    """The answer, and the verdict on the door's velocity."""
    study = study_of(DOOR % (mechanism, sketch, forward, unassembled))
    result = mechdesign.dynamics(study)
    (verdict,) = mechdesign.requirements(study, result)
    return result, verdict


TABLE = [[0, 0], [0.2, 0.01], [0.3, 0.02], [0.4, 0.02]]
FOLLOWER = """, follower: {points: {F: [0, 0]}, mass: 3}}
  joints: {guide: {prismatic: [ground, follower], through: G}}
  couplings: {cam: {set: guide.slide, %s}"""


@pytest.mark.slow
@pytest.mark.parametrize(("forward", "mechanism", "reason", "time"), [
    ("efforts: {door: 'sqrt(0.5 - time)'}", "", "the effort of door has no value from 0.5 s on", 0.5),
    pytest.param("efforts: {door: '1/(time - 0.5)'}", "", "the effort of door is not finite at 0.5 s", 0.5,
                 marks=pytest.mark.nightly),
    pytest.param("efforts: {door: 'sqrt(0.3 - door)'}", "", "the effort of door has no value from 0.29", None,
                 marks=pytest.mark.nightly),
    pytest.param("efforts: {door: '-9*door_velocity/abs(door_velocity)'}", "",
                 "the effort of door turns the motion back", 5 / 9, marks=pytest.mark.nightly),
    pytest.param("", f"of: door, table: {TABLE}", "coupling cam has no value from 0.39", None,
                 marks=pytest.mark.nightly),
])  # fmt: skip
def test_what_has_no_value_further_on_is_named_and_nothing_is_met(
    forward: str, mechanism: str, reason: str, time: float | None
) -> None:
    forward, mechanism = f", {forward}" * bool(forward), FOLLOWER % mechanism if mechanism else ""
    given = (forward, mechanism, ", F: [2, 0]" * bool(mechanism))
    result, verdict = judged(*given)
    assert reason in str(result.warnings[0])
    assert result.warnings[0].kind == "unconverged"
    end = result.main["time"][-1]
    assert 0 < end < 1
    if time is not None:
        assert end == pytest.approx(time, abs=1e-6)
    assert not verdict.met
    assert "no motion from 0." in verdict.note
    assert f" s to 1 s: {reason}" in verdict.note
    assert judged(*given, ", unassembled: allowed")[1].met


@pytest.mark.parametrize(("forward", "limit", "until"), [
    ("", "{drive: door, min: -1, max: 0.3}", "until the limit of door at 0.3 s"),
    (", restitution: 0", "{drive: door, min: -1, max: 0.2}", "until its rest at the limit of door at 0.2 s"),
])  # fmt: skip
def test_a_motion_that_its_own_limit_ends_is_whole(forward: str, limit: str, until: str) -> None:
    result, verdict = judged(forward, f"}}\n  limits: [{limit}]\n  measures: {{")
    assert verdict.met
    assert until in str(verdict)
    assert result.warnings[0].kind == "incomplete"


@pytest.mark.parametrize(("name", "value", "said", "rows"), [
    ("MAX_STEPS", 3, "3 steps are not enough", 11), ("MAX_SECONDS", 0.0, "0 s of the processor are not enough", 1),
])  # fmt: skip
def test_a_motion_that_takes_too_long_is_not_met(
    monkeypatch: pytest.MonkeyPatch, name: str, value: float, said: str, rows: int
) -> None:
    monkeypatch.setattr(motion_in_time, name, value)
    result, verdict = judged(", efforts: {door: '20*sin(9*time)'}")
    assert said in str(result.warnings[0])
    assert not verdict.met
    assert said in verdict.note
    times = result.main["time"]
    np.testing.assert_allclose(times, np.linspace(0.0, times[-1], rows))
    assert times[-1] < 1


@pytest.mark.slow
def test_energies_that_do_not_follow_from_the_work_are_unconverged(monkeypatch: pytest.MonkeyPatch) -> None:
    # As if a pulse of work was taken from the motion's account alone.
    monkeypatch.setattr(motion_in_time.Integration, "at", _robbed(motion_in_time.Integration.at))
    result, _ = judged(", efforts: {door: '20*sin(9*time)'}")
    (warning,) = result.warnings
    assert (warning.kind, warning.table, warning.row) == ("unconverged", "forward", 5)
    assert "energies do not change by the work of what acts: from 0.5 s on" in str(warning)


def _robbed(at):  # type: ignore[no-untyped-def]
    def robbed(self, times):  # type: ignore[no-untyped-def]
        whole = at(self, times)
        whole.work[0] += np.where(whole.times >= 0.5 - 1e-9, 0.01, 0.0)
        return whole

    return robbed
