"""The curves of centre points and circle points of four positions, by poles and distances."""

import itertools
from typing import Any

import numpy as np
import pytest
import yaml

import mechdesign

FOUR = [(0, 0, 0), (2, 1, 30), (3, 3, 75), (2.5, 5, 100)]
PLACES, TURNS = np.array([x + 1j * y for x, y, _ in FOUR]), np.exp(1j * np.radians([a for *_, a in FOUR]))


def result_of(more: Any) -> Any:
    body = [dict(zip(("x", "y", "angle"), position, strict=True)) for position in FOUR]
    task = {"body": body, "kinds": "four_bar", **more}
    return mechdesign.synthesize(mechdesign.load(text=yaml.safe_dump({"synthesis": task})), seed=1)


@pytest.fixture(scope="module")
def table() -> Any:
    return result_of({"evaluations": 100}).tables["centre_points"]


def test_each_link_of_the_curve_passes_the_four_positions(table: Any) -> None:
    pivot, pin = table["centre.x"] + 1j * table["centre.y"], table["circle.x"] + 1j * table["circle.y"]
    ways = np.abs(PLACES + TURNS * pin[:, None] - pivot[:, None])
    some = table["length"] < 1000
    np.testing.assert_allclose(ways[some], np.tile(table["length"][some, None], 4), rtol=1e-9)


@pytest.mark.parametrize(("name", "in_body"), [("centre", False), ("circle", True)])
def test_the_six_poles_lie_on_the_curve(table: Any, name: str, in_body: bool) -> None:
    """Burmester: the points about which the body can turn from one position to another."""
    points = table[f"{name}.x"] + 1j * table[f"{name}.y"]
    begin, end = points[:-1], points[1:]
    same = np.diff(table["curve"]) == 0
    begin, way = begin[same], (end - begin)[same]
    for i, j in itertools.combinations(range(4), 2):
        turn = TURNS[j] / TURNS[i]
        pole = (PLACES[j] - turn * PLACES[i]) / (1 - turn)
        pole = (pole - PLACES[i]) / TURNS[i] if in_body else pole
        part = np.clip(((pole - begin) * np.conj(way)).real / np.abs(way) ** 2, 0, 1)
        assert np.abs(pole - begin - part * way).min() < 2e-3


def test_where_no_linkage_keeps_the_conditions_the_curve_is_there() -> None:
    with pytest.raises(mechdesign.AssemblyError) as raised:
        result_of({"keep_out": {"x": [-50, 50], "y": [-50, 50]}})
    assert len(raised.value.result.tables["centre_points"]) > 100
