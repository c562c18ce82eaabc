"""How long pictures take: a command with and without them, and each picture once Matplotlib is imported."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from helpers.studies import of_readme

import mechdesign
from mechdesign.drawing import style
from mechdesign.drawing.pictures import pictures

ROOT = Path(__file__).parents[2]
# A study and a question of each kind of picture: curves, maps, samples, fronts, sweeps.
DRAWN = {
    "gallery/four_bar": ("kinematics", ("paths", "motion", "poses", "transmission")),
    "gallery/shaper": ("kinematics", ("centrodes",)),
    "gallery/rrr_orientations": ("workspace", ("workspace", "inverse_condition")),
    "five_bar": ("reliability", ("bands", "histogram", "contributions")),
    "gallery/sine_generator": ("optimize", ("CPI", "optimum")),
    "gallery/offset_slider_crank": ("sweep", ("response",)),
}


@pytest.mark.parametrize("plots", [True, False], ids=["pictures", "tables"])
def test_kinematics_of_the_study_in_the_readme(benchmark, tmp_path: Path, *, plots: bool) -> None:
    (tmp_path / "study.yaml").write_text(of_readme())
    command = [sys.executable, "-m", "mechdesign", "kinematics", "study.yaml", *(() if plots else ("--no-plots",))]
    run = benchmark.pedantic(
        subprocess.run, (command,), {"capture_output": True, "cwd": tmp_path}, rounds=5, warmup_rounds=1
    )
    assert run.returncode == 0


@pytest.mark.parametrize("name", DRAWN)
def test_pictures(benchmark, name: str) -> None:
    question, names = DRAWN[name]
    study = mechdesign.load(ROOT / "configs" / f"{name}.yaml")
    result = getattr(mechdesign, question)(study)
    shown = [picture for picture in pictures(question) if picture.names[0] in names]
    assert shown

    def draw() -> int:
        drawn = 0
        for picture in shown:
            made = picture(picture.view(study, result))
            for figure in made.values() if isinstance(made, dict) else filter(None, [made]):
                drawn += len(style.encoded(figure))
        return drawn

    with style.context():
        assert benchmark.pedantic(draw, rounds=3, warmup_rounds=1)
