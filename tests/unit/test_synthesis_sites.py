"""Where pivots and pins are wished: boxes, lines and given points, for links and for slides, against closed forms."""

from typing import Any

import numpy as np
import pytest
import yaml

import mechdesign

THREE = [{"x": 0, "y": 0, "angle": 0}, {"x": 2, "y": 1, "angle": 30}, {"x": 3, "y": 3, "angle": 75}]
FOUR = [*THREE, {"x": 2.5, "y": 5, "angle": 100}]
PLACES, TURNS = np.array([0, 2 + 1j, 3 + 3j]), np.exp(1j * np.radians([0, 30, 75]))


def table_of(task: Any) -> Any:
    return mechdesign.synthesize(mechdesign.load(text=yaml.safe_dump({"synthesis": task})), seed=1).tables["solutions"]


def points(table: Any, name: str) -> Any:
    return table[f"{name}.x"] + 1j * table[f"{name}.y"]


def centre(a: complex, b: complex, c: complex) -> complex:
    """Of the circle through three points."""
    matrix = [[(b - a).real, (b - a).imag], [(c - a).real, (c - a).imag]]
    x, y = np.linalg.solve(matrix, [abs(b - a) ** 2 / 2, abs(c - a) ** 2 / 2])
    return complex(a + x + 1j * y)


def test_between_two_given_pivots_the_link_has_its_pin_where_three_places_of_the_pivot_say() -> None:
    table = table_of({"body": THREE, "pivots": [[0, -2], [3, -1]], "kinds": "four_bar", "limits": {"ratio": 100}})
    pins = {pivot: centre(*((pivot - PLACES) / TURNS).tolist()) for pivot in (-2j, 3 - 1j)}
    assert len(table["solution"]) == 2
    for pivot, pin in (("O", "A"), ("D", "B")):
        for place, there in zip(points(table, f"ground.{pivot}"), points(table, f"coupler.{pin}"), strict=True):
            assert abs(there - pins[complex(np.round(place, 9))]) < 1e-9


def test_two_given_points_of_the_frame_have_links_and_slides() -> None:
    table = table_of({"body": THREE, "pivots": [[0, -2], [3, -1]], "limits": {"ratio": 100}})
    assert {*table["kind"]} >= {"four_bar", "slider_crank", "trammel"}
    given = {*np.round(points(table, "ground.O"), 9).tolist(), *np.round(points(table, "ground.D"), 9).tolist()}
    assert given == {-2j, 3 - 1j}


@pytest.mark.parametrize(
    "kind",
    [
        "four_bar",
        "slider_crank",
        *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("inverted_slider_crank", "inverted_trammel")),
    ],
)
def test_a_single_given_pivot_is_one_of_each_linkage(kind: str) -> None:
    body = THREE[:2] if kind == "inverted_trammel" else THREE
    table = table_of({"body": body, "pivots": [[0, -2]], "kinds": kind})
    gaps = [np.abs(points(table, f"ground.{name}") + 2j) for name in "OD"]
    assert (np.minimum(*gaps) < 1e-9).all()
    if kind == "slider_crank":
        assert (gaps[0] < 1e-9).all()
    assert table["max_error"].max() < 1e-9


def test_of_four_positions_the_curve_of_centre_points_is_cut_by_a_line() -> None:
    """At most three of its points lie on a line."""
    table = table_of({"body": FOUR, "pivots": {"x": [-5, 5], "y": 4}, "kinds": "four_bar", "limits": {"ratio": 1000}})
    both = np.round(np.concatenate([points(table, "ground.O"), points(table, "ground.D")]), 6)
    assert np.abs(both.imag - 4).max() < 1e-6
    assert 2 <= len({*both.tolist()}) <= 3
    assert table["max_error"].max() < 1e-9


@pytest.mark.slow
def test_pins_lie_in_their_box() -> None:
    table = table_of({"body": THREE, "pins": {"x": [-1, 1], "y": [-0.5, 0.5]}})
    for name in "AB":
        pin = points(table, f"coupler.{name}")
        assert np.abs(pin.real).max() <= 1 + 1e-6
        assert np.abs(pin.imag).max() <= 0.5 + 1e-6
    assert len({*table["kind"]}) > 1


def test_given_pins_have_the_pivots_that_their_three_places_say() -> None:
    table = table_of({"body": THREE, "pins": [[1, 0], [0, -1]], "kinds": "four_bar", "limits": {"ratio": 100}})
    pivots = {pin: centre(*(PLACES + TURNS * pin).tolist()) for pin in (1 + 0j, -1j)}
    assert len(table["solution"])
    for pivot, pin in (("O", "A"), ("D", "B")):
        for place, there in zip(points(table, f"coupler.{pin}"), points(table, f"ground.{pivot}"), strict=True):
            assert abs(there - pivots[complex(np.round(place, 9))]) < 1e-9


@pytest.mark.slow
def test_where_a_slide_is_wished_each_linkage_has_one() -> None:
    table = table_of({"body": THREE, "slide": True})
    assert len({*table["kind"]}) > 2
    assert "four_bar" not in table["kind"]


def test_pivots_and_pins_on_lines_leave_three_positions_few_links() -> None:
    task = {"body": THREE, "pivots": {"x": [-9, 9], "y": 4}, "pins": {"through": [0, 0], "direction": 90}}
    table = table_of({**task, "kinds": "four_bar", "limits": {"ratio": 1000}})
    for name, pin in (("O", "A"), ("D", "B")):
        assert np.abs(points(table, f"ground.{name}").imag - 4).max() < 1e-6
        assert np.abs(points(table, f"coupler.{pin}").real).max() < 1e-6


def test_of_more_than_five_positions_the_given_pivots_stay() -> None:
    six = [*FOUR, {"x": 1.5, "y": 6, "angle": 120}, {"x": 1, "y": 6.5, "angle": 130}]
    table = table_of({"body": six, "pivots": [[0, 3], [-1, 4]], "kinds": "four_bar", "limits": {"ratio": 100}})
    assert {*np.round(points(table, "ground.O"), 9).tolist()} <= {3j, -1 + 4j}
    assert table["error"].min() > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "name", "kind"),
    [
        ({"pivots": {"y": 4}}, "ground", "inverted_trammel"),
        ({"pivots": {"through": [0, 4], "direction": 20}}, "ground", "inverted_slider_crank"),
        ({"pivots": {"y": 4}}, "ground", "conchoid"),
        ({"pins": {"x": -0.5}}, "coupler", "trammel"),
        ({"pins": {"x": -0.5}}, "coupler", "slider_crank"),
    ],
)
def test_of_three_positions_slides_have_their_points_where_a_line_meets_a_circle(
    task: Any, name: str, kind: str
) -> None:
    """A slide of the body runs through a pivot whose three places in the body are in line, and the other way round."""
    ((key, region),) = task.items()
    through = complex(*region.get("through", (region.get("x", 0), region.get("y", 0))))
    along = np.exp(1j * np.radians(region.get("direction", 90 if "x" in region else 0)))

    def bend(way: float) -> float:
        place = through + way * along
        seen = (place - PLACES) / TURNS if key == "pivots" else PLACES + TURNS * place
        return float(((seen[1] - seen[0]) * np.conj(seen[2] - seen[0])).imag)

    ways = np.roots(np.polyfit([-1, 0, 1], [bend(way) for way in (-1, 0, 1)], 2)).real
    points_of_slides = through + ways * along
    table = table_of({"body": THREE, **task, "kinds": kind, "limits": {"reach": 10, "ratio": 1000}})
    ends = {"ground": "OD", "coupler": "AB"}[name]
    sliding = ends if kind.endswith("trammel") else ends[1]
    places = np.concatenate([points(table, f"{name}.{end}") for end in sliding])
    assert np.abs(places[:, None] - points_of_slides).min(axis=1).max() < 1e-9
    assert table["max_error"].max() < 1e-9


PATH = {"points": [[55, 60], [45, 75], [25, 75], [10, 55], [15, 35], [40, 40]], "closed": True}
SLOPE = np.exp(1j * np.radians(30))


@pytest.mark.slow
def test_both_pivots_of_a_path_lie_on_a_line() -> None:
    table = table_of(
        {"path": PATH, "pivots": {"through": [0, -20], "direction": 30}, "evaluations": 300, "solutions": 5}
    )
    for name in "OD":
        assert np.abs(((points(table, f"ground.{name}") + 20j) / SLOPE).imag).max() < 1e-4
    assert table["error"].min() < 1e-9


@pytest.mark.nightly
def test_a_single_given_point_has_a_pivot_of_each_linkage_of_a_path() -> None:
    table = table_of({"path": PATH, "pivots": [[0, 0]], "evaluations": 1500})
    assert (np.minimum(*(np.abs(points(table, f"ground.{name}")) for name in "OD")) < 1e-4).all()
    assert table["error"].min() < 1e-9
    # That of a slider-crank is where its crank turns, not on its rail.
    table = table_of({"path": PATH, "kinds": "slider_crank", "pivots": [[0, 0]], "evaluations": 1500})
    assert np.abs(points(table, "ground.O")).max() < 1e-4
