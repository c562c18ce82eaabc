"""The example for contributors goes its way."""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_one_study_goes_through_the_house():
    names = runpy.run_path(str(ROOT / "docs/contributing/one_study.py"))
    assert names["verdict"].met
