"""Conditions of tasks of bodies and functions, as a user sees them, by formulas of their own."""

from typing import Any

import numpy as np
import pytest
import yaml
from helpers.guided import generates

import mechdesign

THREE = [{"x": 0, "y": 0, "angle": 0}, {"x": 2, "y": 1, "angle": 30}, {"x": 3, "y": 3, "angle": 75}]
# Of the places: half their extent along x and y, and their greatest extent.
MIDDLE, SIZE = (5 + 4j) / 3, 3.0


def solved(**task: Any) -> Any:
    return mechdesign.synthesize(mechdesign.load(text=yaml.safe_dump({"synthesis": task})), seed=1)


def links(table: Any) -> Any:
    """Crank, coupler, rocker and frame of four-bars, shape (4, count)."""
    pins = [table[f"coupler.{pin}.x"] + 1j * table[f"coupler.{pin}.y"] for pin in "AB"]
    return np.array([table["crank.length"], np.abs(pins[1] - pins[0]), table["rocker.length"],
                     np.abs(pivots(table, "O") - pivots(table, "D"))])  # fmt: skip


def pivots(table: Any, name: str) -> Any:
    return table[f"ground.{name}.x"] + 1j * table[f"ground.{name}.y"]


def four_bars(**task: Any) -> Any:
    return solved(body=THREE, kinds="four_bar", **{"evaluations": 100, **task}).tables["solutions"]


@pytest.mark.slow
def test_links_of_grashof_have_a_shortest_that_turns() -> None:
    lengths = np.sort(links(four_bars(grashof=True)), axis=0)
    assert (lengths[0] + lengths[3] <= lengths[1] + lengths[2] + 1e-9).all()


@pytest.mark.slow
def test_a_drive_that_must_turn_fully_is_never_too_far_from_the_rocker() -> None:
    crank, coupler, rocker, frame = links(four_bars(full_turn=True))
    assert (np.maximum(np.abs(frame - crank), np.abs(coupler - rocker)) == np.abs(frame - crank)).all()
    assert (frame + crank <= coupler + rocker + 1e-9).all()


@pytest.mark.slow
def test_lengths_and_their_ratio_are_kept() -> None:
    crank, coupler, rocker, frame = links(four_bars(lengths={"crank": [2, 3], "ground": [3, 6]}, limits={"ratio": 3}))
    assert ((crank >= 2) & (crank <= 3) & (frame >= 3) & (frame <= 6)).all()
    every = np.array([crank, coupler, rocker, frame])
    assert (every.max(axis=0) / every.min(axis=0) <= 3 + 1e-9).all()


@pytest.mark.parametrize(
    "reach", [pytest.param(1.0, marks=pytest.mark.slow), pytest.param(8.0, marks=pytest.mark.nightly)]
)
def test_pivots_are_sampled_as_far_as_they_may_reach(reach: float) -> None:
    table = four_bars(limits={"reach": reach}, solutions=200)
    away = np.abs(np.concatenate([pivots(table, "O"), pivots(table, "D")]) - MIDDLE)
    assert 0.6 * reach * SIZE < away.max() <= reach * SIZE + 1e-9


@pytest.mark.slow
def test_no_pivot_lies_where_none_may() -> None:
    table = four_bars(keep_out={"x": [-1, 2], "y": [-1, 4]})
    for place in (pivots(table, "O"), pivots(table, "D")):
        assert not ((place.real > -1) & (place.real < 2) & (place.imag > -1) & (place.imag < 4)).any()


@pytest.mark.slow
def test_the_smallest_transmission_angle_is_between_coupler_and_rocker() -> None:
    table = four_bars(transmission={"at_least": 40})
    crank, coupler, rocker, _ = links(table)
    turns = np.exp(1j * np.radians([0, 30, 75]))
    places = np.array([0, 2 + 1j, 3 + 3j])
    for row in range(len(table)):
        pin = places + turns * (table["coupler.A.x"][row] + 1j * table["coupler.A.y"][row])
        reach = np.abs(pin - pivots(table, "D")[row])
        angle = np.degrees(np.arccos((coupler[row] ** 2 + rocker[row] ** 2 - reach**2) / (2 * coupler * rocker)[row]))
        assert np.minimum(angle, 180 - angle).min() >= 40 - 1e-6
        assert np.minimum(angle, 180 - angle).min() >= table["transmission_angle"][row] - 1e-6
    assert crank.min() > 0


@pytest.mark.slow
def test_linkages_with_a_defect_are_counted_and_left_out() -> None:
    result = solved(body=THREE, kinds="slider_crank", defects="dropped", evaluations=100)
    assert set(result.tables["solutions"]["defects"]) == {""}
    assert any("as it has a defect" in note for note in result.notes)


@pytest.mark.slow
def test_zeros_that_are_free_let_angles_count_from_any_line() -> None:
    """Four pairs of a four-bar whose angles count from 33 and -71 deg."""
    crank = np.array([40.0, 70.0, 100.0, 130.0])
    pin = 0.4 * np.exp(1j * np.radians(crank)) - 1
    reach = np.abs(pin)
    rocker = np.degrees(np.angle(pin) - np.arccos((reach**2 + 0.8**2 - 0.9**2) / (2 * reach * 0.8)))
    task = {"input": (crank - 33).tolist(), "output": (rocker + 71).tolist()}
    table = solved(function=task, zeros="free", solutions=300, limits={"ratio": 50}).tables["solutions"]
    assert table["max_error"].max() < 1e-9
    near = np.abs([table["crank.length"] - 0.4, table["coupler.length"] - 0.9, table["rocker.length"] - 0.8])
    assert near.max(axis=0).min() < 0.1


def test_zeros_that_are_fixed_are_those_of_the_links() -> None:
    inputs, outputs = np.array([60.0, 80.0, 110.0]), np.array([70.0, 76.0, 95.0])
    task = {"input": inputs.tolist(), "output": outputs.tolist()}
    table = solved(function=task, limits={"ratio": 50}).tables["solutions"]
    row = {name: table[name][0] for name in table.names}
    assert generates(row, inputs, outputs)


def test_the_output_may_be_a_slide() -> None:
    """The place of a slider on the x axis, or beside it, of a crank about the origin."""
    inputs, outputs = np.array([20.0, 60.0, 100.0]), np.array([150.0, 120.0, 70.0])
    task = {"input": inputs.tolist(), "output": outputs.tolist()}
    table = solved(function=task, kind="slider_crank").tables["solutions"]
    assert len(table)
    for row in range(len(table)):
        crank, coupler, height = (float(table[name][row]) for name in ("crank.length", "coupler.length", "ground.D.y"))
        pins = [crank * np.exp(1j * np.radians(inputs + turned)) for turned in (0, 180)]
        room = [np.maximum(coupler**2 - (height - pin.imag) ** 2, 0) for pin in pins]
        found = [pin.real + side * np.sqrt(own) for pin, own in zip(pins, room, strict=True) for side in (1, -1)]
        assert min(np.abs(places - outputs).max() for places in found) < 1e-9
    # Three lengths for three pairs.
    assert len(table) <= 2


@pytest.mark.slow
def test_more_than_five_positions_of_a_four_bar_give_it_back() -> None:
    angles = np.radians(np.linspace(20, 120, 8))
    pin = 2 * np.exp(1j * angles)
    reach = np.abs(6 - pin)
    at_pin = np.angle(6 - pin) + np.arccos((reach**2 + 5**2 - 4**2) / (2 * reach * 5))
    places = pin + np.exp(1j * at_pin) * (2 + 1j)
    body = [{"x": float(p.real), "y": float(p.imag), "angle": float(np.degrees(t))}
            for p, t in zip(places, at_pin, strict=True)]  # fmt: skip
    wide = {"kinds": "four_bar", "limits": {"reach": 20}}
    table = solved(body=body, **wide).tables["solutions"]
    assert table["max_error"][0] < 1e-8
    assert sorted([*links(table)[:, 0]]) == pytest.approx([2, 4, 5, 6], abs=1e-6)
    # Where the positions are not exact, it is at least as near as the linkage that they came from.
    moved = [{**part, "x": part["x"] + 0.002 * (-1) ** k} for k, part in enumerate(body)]
    assert solved(body=moved, **wide).tables["solutions"]["error"][0] <= 0.002


@pytest.mark.slow
def test_a_body_that_only_shifts_has_parallelograms() -> None:
    """Its four places lie on a circle of radius 5 about the origin."""
    body = [{"x": x, "y": y, "angle": 10} for x, y in ((5, 0), (3, 4), (0, 5), (-3, 4))]
    result = solved(body=body)
    crank, coupler, rocker, frame = links(result.tables["solutions"])
    assert np.abs([crank - 5, rocker - 5, coupler - frame]).max() < 1e-9
    assert any("links that guide it are parallel" in note for note in result.notes)


def test_along_a_line_a_slide_alone_guides_the_body() -> None:
    body = [{"x": x, "y": 2 * x, "angle": 0} for x in (0, 1, 3)]
    with pytest.raises(mechdesign.AssemblyError, match="along a line, on which a slide alone guides it"):
        solved(body=body)


@pytest.mark.parametrize(
    ("task", "words"),
    [
        pytest.param({"body": THREE, "pivots": {"x": [1, 2], "y": [1, 2]}, "transmission": {"at_least": 89.99}},
                     "transmission", marks=pytest.mark.nightly),
        ({"function": {"input": [97, 120, 143], "output": [36, 65, 87]}, "transmission": {"at_least": 85}},
         "transmission"),
        pytest.param({"path": {"points": [[0, 0], [2, 1], [1, 3], [-1, 1]], "closed": True}, "evaluations": 200,
                      "keep_out": {"x": [-99, 99], "y": [-99, 99]}}, "keep_out", marks=pytest.mark.nightly),
    ],
)  # fmt: skip
def test_where_nothing_passes_the_nearest_tells_what_it_misses(task: Any, words: str) -> None:
    with pytest.raises(mechdesign.AssemblyError) as raised:
        solved(**task)
    assert raised.value.exit_code == 3
    assert "the nearest is in nearest.yaml: " in str(raised.value)
    assert f"({words})" in str(raised.value).rpartition("nearest.yaml")[2]
    assert mechdesign.load(text=raised.value.result.files["nearest.yaml"]).kinematics is not None
