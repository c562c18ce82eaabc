"""Hypothesis: no deadlines, for machines are noisy; in CI the same examples at every run, to repeat it by.

Linear algebra keeps to one thread: the matrices are small, and several workers share the processors.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings

settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")
