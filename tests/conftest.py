"""Hypothesis: no deadlines, for machines are noisy; in CI the same examples at every run, to repeat it by."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")
