"""Examples of pages: what counts as the output that a page shows."""

from __future__ import annotations

import examples
import pytest


@pytest.mark.parametrize(
    ("told", "shown", "same"),
    [
        ("a 1.0\n...\nz\n", "a 1.0000001\nb\nc\nz\n", True),
        ("...\nb 2\n...\nd\n", "a\nb 2\nc\nd\n", True),
        ("a\n...\n", "a\n", True),
        ("", "", True),
        ("error  -1.3e-12\n", "error 2e-13\n", True),
        ("a 1.001\n", "a 1.0\n", False),
        ("a 1\n", "b 1\n", False),
        ("a\n", "a\nb\n", False),
        ("a\n...\nz\n", "a\nb\nc\n", False),
        ("a\n...\na\n", "a\n", False),
        ("", "x\n", False),
    ],
)
def test_lines_stand_for_any_and_numbers_agree_to_six_digits(told: str, shown: str, same: bool) -> None:
    assert examples.agree(told, shown) is same
