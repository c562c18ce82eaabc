"""Random searches for wrong answers, against solvers that share nothing with the package.

A test takes `seeds` and asks it for as many cases as continuous integration can afford. With `pytest tests/hunt
--budget 30m` the cases go on, each test for its equal share of that time; with `--cases 100000` each has so many, and
`--first 5000` begins at another seed than 0. How many there were, and which took longest, is told at the end. A case is
known by its seed, so that a find is repeated by it; each find is kept as a test of its own.

    def test_areas_against_rasters(seeds):
        for seed in seeds(20):
            compare(np.random.default_rng(seed))
"""

from __future__ import annotations

import itertools
import math
import resource
import time
from collections.abc import Callable, Iterator

import pytest


@pytest.fixture
def seeds(request: pytest.FixtureRequest) -> Callable[[int], Iterator[int]]:
    """Seeds 0, 1, 2 ...: the asked number of them, or as the options say."""
    budget, cases, first = (request.config.getoption(name) for name in ("--budget", "--cases", "--first"))
    sharing = [item for item in request.session.items if "seeds" in getattr(item, "fixturenames", ())]
    spent: dict[int, float] = {}

    def go(number: int) -> Iterator[int]:
        end = time.monotonic() + (budget / len(sharing) if budget is not None else math.inf)
        last = first + (number if cases is None else cases)
        for seed in itertools.count(first) if budget is not None and cases is None else range(first, last):
            if time.monotonic() > end:
                return
            begun = time.process_time()
            yield seed
            spent[seed] = time.process_time() - begun

    yield go
    if (budget or cases) and spent:
        slowest = max(spent, key=lambda seed: spent[seed])
        request.config.get_terminal_writer().line(
            f" {request.node.name}: {len(spent)} cases in {sum(spent.values()):.0f} s of the processor; the slowest, "
            f"seed {slowest}, {spent[slowest]:.1f} s; at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss} KB"
        )
