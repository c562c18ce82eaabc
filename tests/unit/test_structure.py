"""Groups of equations that are solved one after another, against SciPy's strongly connected components."""

import time

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mechdesign.numerics.graphs import components


@pytest.mark.parametrize("seed", range(30))
def test_components_of_random_graphs(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 30))
    arcs = rng.integers(0, count, (int(rng.integers(0, 3 * count)), 2))
    found = components([(int(a), int(b)) for a, b in arcs], count)
    graph = coo_array((np.ones(len(arcs)), (arcs[:, 0], arcs[:, 1])), shape=(count, count))
    _, labels = connected_components(graph, connection="strong")
    assert {frozenset(members) for members in found} == {
        frozenset(np.flatnonzero(labels == label).tolist()) for label in labels
    }
    place = {row: k for k, members in enumerate(found) for row in members}
    assert all(place[int(b)] <= place[int(a)] for a, b in arcs)
    assert found == components([(int(a), int(b)) for a, b in arcs[::-1]], count)


def test_thousands_of_rows_take_no_time():
    count = 3000
    arcs = [(k, (7 * k) % max(k, 1)) for k in range(count)] + [(k, k // 2) for k in range(count)]
    begun = time.process_time()
    assert len(components(arcs, count)) == count
    # A matrix of reach took 20 s.
    assert time.process_time() - begun < 5
