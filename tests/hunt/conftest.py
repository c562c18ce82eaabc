"""Random searches for wrong answers, against solvers that share nothing with the package.

A test takes `seeds` and asks it for as many cases as continuous integration can afford. With `pytest tests/hunt
--budget 30m` the cases go on, each test for its equal share of that time. A case is known by its seed, so that a find
is repeated by it; each find is kept as a test of its own.

    def test_areas_against_rasters(seeds):
        for seed in seeds(20):
            compare(np.random.default_rng(seed))
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator

import pytest


@pytest.fixture
def seeds(request: pytest.FixtureRequest) -> Callable[[int], Iterator[int]]:
    """Seeds 0, 1, 2 ...: the asked number of them, or with `--budget` as many as the test's share of it allows."""

    def go(number: int) -> Iterator[int]:
        budget = request.config.getoption("--budget")
        if budget is None:
            yield from range(number)
            return
        sharing = [item for item in request.session.items if "seeds" in getattr(item, "fixturenames", ())]
        end = time.monotonic() + budget / len(sharing)
        for seed in itertools.count():
            if time.monotonic() > end:
                return
            yield seed

    return go
