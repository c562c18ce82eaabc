"""Every file that can be exported, of every shipped study: it is made, or a message says what the study lacks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from mechdesign.door.exporting.exports import exports

ROOT = Path(__file__).parents[2]
CONFIGS = sorted((ROOT / "configs").rglob("*.yaml"))
NO_NUMBER = re.compile(rb"(?<![\w.])[-+]?nan(?![\w.])", re.IGNORECASE)
# Slides, gears and a motion over time; all others every night.
FEW = {"scotch_yoke", "planetary", "rise_dwell_return"}


@pytest.mark.parametrize(
    "config", [pytest.param(config, marks=[] if config.stem in FEW else pytest.mark.nightly) for config in CONFIGS],
    ids=lambda config: config.stem,
)  # fmt: skip
def test_every_file_of_a_shipped_study_is_made(config: Path, tmp_path: Path, invoke) -> None:
    for name in exports():
        done = invoke("export", config, "--to", name, "--out", tmp_path / name)
        if "this study has only a task" in done.stderr:
            assert done.exit_code == 2, done.output
            assert "\nsynthesis:" in config.read_text(encoding="utf-8")
            assert "\nmechanism:" not in config.read_text(encoding="utf-8")
        elif done.exit_code and name == "motion.csv":
            # A controller needs a time, one way and every pose.
            assert done.exit_code in (2, 3), done.output
            assert any(words in done.stderr for words in ("'rates'", "against its rate", "no motion", "no valid pose"))
        else:
            assert done.exit_code == 0, done.output
            content = (tmp_path / name).read_bytes()
            assert content.startswith(b"%PDF") if name.endswith("pdf") else not NO_NUMBER.search(content), name
