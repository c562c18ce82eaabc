"""Changes of sign of functions along an interval, however near to each other."""

from __future__ import annotations

import numpy as np
import pytest

from mechdesign.expressions import Expression
from mechdesign.numerics.sign_changes import Resolved


def resolved(*functions: str, ends: tuple[float, ...] = (0.0, 1.0)) -> Resolved:
    parsed = [Expression.parse(function) for function in functions]

    def look(places: np.ndarray) -> np.ndarray:
        return np.array([np.broadcast_to(one.evaluate({"x": places}), places.shape) for one in parsed])

    return Resolved.of(look, np.array(ends), np.zeros(len(parsed)))


@pytest.mark.parametrize(("function", "expected"), [
    ("x - 0.3", [0.3]), ("(x - 0.3)**2 - 1e-8", [0.2999, 0.3001]), ("(x - 0.3)**2", []), ("(x - 0.3)**2 + 1e-9", []),
    ("abs(x - 0.7) - 1e-6", [0.699999, 0.700001]), ("sin(1000*x)", np.pi * np.arange(1, 319) / 1000),
    ("sqrt(x - 0.5) - 0.1", [0.51]), ("1 + 0*x", []),
])  # fmt: skip
def test_signs_change_at_the_zeros_that_are_no_touching(function: str, expected: list[float]) -> None:
    whole = resolved(function)
    start = whole.look(np.array([1e-9]))[0]
    side = 1.0 if np.isnan(start[0]) else float(np.sign(start[0]))
    places = [change.place for change in whole.changes(np.array([side]))]
    if "sqrt" in function:
        # Without a value it counts as positive.
        places = places[1:]
    assert places == pytest.approx(expected, abs=1e-10)


def test_changes_of_several_functions_come_in_order_with_their_signs() -> None:
    changes = resolved("x - 0.6", "0.2 - x").changes(np.array([-1.0, 1.0]))
    assert [(change.function, change.sign) for change in changes] == [(1, -1.0), (0, 1.0)]


def test_places_where_a_function_touches_zero_and_turns_back() -> None:
    assert resolved("(x - 0.4)**2").touched() == pytest.approx([0.4], abs=1e-7)
    assert resolved("(x - 0.4)**2 + 3").turning() == pytest.approx([0.4], abs=1e-7)
    assert not len(resolved("(x - 0.4)**2 + 3").touched())


def test_an_expression_is_kept_on_a_side_of_its_corners() -> None:
    expression = Expression.parse("max(0, abs(x - 3) - 1)*min(y, 2)")
    corners = [corner.argument for corner in expression.corners()]
    assert [corner.evaluate({"x": 10.0, "y": 5.0}) for corner in corners] == [7, -6, 3]
    sides = dict(zip([corner.program for corner in corners], (1.0, -1.0, 1.0), strict=True))
    for x, y in ((10.0, 5.0), (1.0, 0.5)):
        assert expression.held(sides).evaluate({"x": x, "y": y}) == (x - 3 - 1) * 2
    assert expression.held({}) == expression
