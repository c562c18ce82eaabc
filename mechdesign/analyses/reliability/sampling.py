"""Streams of random numbers.

Every chunk of every pose has a stream of its own, so that the answer depends neither on the number of threads nor on
how many samples follow.
"""

from __future__ import annotations

import numpy as np

CHUNK = 20_000


def generator(seed: int, *stream: int) -> np.random.Generator:
    """The stream of this name, for example one chunk of samples at one pose."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence(entropy=seed, spawn_key=stream)))
