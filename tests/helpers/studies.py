"""Studies written in a test, without a file of their own."""

from __future__ import annotations

from pathlib import Path

from mechdesign.study import Study
from mechdesign.study.loading import load_bytes


def study_of(text: str, *overrides: str) -> Study:
    """Load a study from its text."""
    return load_bytes(text.encode(), Path("study.yaml"), overrides)
