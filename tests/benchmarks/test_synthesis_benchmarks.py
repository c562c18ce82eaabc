"""Synthesis of the tray of the gallery: all dyads of five positions, and samples where fewer leave a choice."""

from pathlib import Path
from typing import Any

import pytest

import mechdesign

TRAY = Path(__file__).parents[2] / "configs" / "gallery" / "five_positions.yaml"


@pytest.mark.parametrize("positions", [5, 4, 3, 2])
def test_positions_of_a_body(benchmark: Any, positions: int) -> None:
    body = mechdesign.load(TRAY).resolved["synthesis"]["body"][:positions]
    study = mechdesign.load(TRAY, {"synthesis": {"body": body}})
    assert len(benchmark(mechdesign.synthesize, study).tables["solutions"])
