"""Other numbers by `--set`, as by `--vary`: in the assembly of the file's own sketch, followed to the new numbers."""

import json
import math

import numpy as np
import pytest
from helpers import command_line

import mechdesign

FIVE_BAR = """
mechanism:
  parameters: {b: 100}
  links:
    ground: {A: [0, 0], E: [b, 0]}
    l1: [A, B, 80]
    l2: [B, C, 100]
    l3: [C, D, 100]
    l4: [E, D, 80]
  drives: [l1, l4]
  sketch: {B: [-30, 74], D: [130, 74], C: [50, 134]}
kinematics: {poses: [{l1: 20, l4: 160}], outputs: [C]}
"""
WIDE = "mechanism.parameters.b=300"


def test_dimensions_with_which_the_sketch_does_not_close():
    """The motors' arms point at each other: C lies above the middle, where two circles of 100 meet."""
    study = mechdesign.load(text=FIVE_BAR, overrides=[WIDE])
    motion = mechdesign.kinematics(study).main
    half = 150 - 80 * math.cos(math.radians(20))
    height = 80 * math.sin(math.radians(20)) + math.sqrt(100**2 - half**2)
    assert (motion["C.x"][0], motion["C.y"][0]) == (pytest.approx(150), pytest.approx(height))
    (warning,) = study.warnings
    assert "cannot be assembled at its own drive values" in warning.message
    assert mechdesign.load(text=FIVE_BAR, overrides=["mechanism.parameters.b=110"]).warnings == ()


@pytest.mark.nightly
def test_a_workspace_is_the_same_by_set_and_by_vary():
    text = FIVE_BAR + "workspace: {point: C}\n" + "matrix: {vary: {mechanism.parameters.b: [300]}, results: [area]}\n"
    (varied,) = mechdesign.sweep(mechdesign.load(text=text)).main["area"]
    (alone,) = mechdesign.workspace(mechdesign.load(text=text, overrides=[WIDE])).main["area"]
    assert alone == pytest.approx(varied, rel=1e-9)
    assert alone > 0


# A rocker so long that the sketch, which shows B above the crank, would choose the other side with it.
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  sketch: {A: [30, 0], B: [75, 55]}
kinematics: {poses: [{crank: 40}], outputs: [B]}
"""


def test_the_assembly_is_that_of_the_file():
    """B is on the left of A-D before the change and after it, wherever rounding or the drawing would have it."""
    study = mechdesign.load(text=FOUR_BAR, overrides=["mechanism.links.rod.2=40", "mechanism.links.rocker.2=45"])
    motion = mechdesign.kinematics(study).main
    a, b = 30 * np.exp(1j * math.radians(40)), complex(motion["B.x"][0], motion["B.y"][0])
    assert ((b - a) / (100 - a)).imag > 0
    assert (abs(b - a), abs(b - 100)) == (pytest.approx(40), pytest.approx(45))


def test_a_sketch_that_is_changed_itself_chooses():
    lower = ["mechanism.links.rocker.2=65", "mechanism.sketch.B=[75, -55]"]
    study = mechdesign.load(text=FOUR_BAR, overrides=lower)
    assert mechdesign.kinematics(study).main["B.y"][0] < 0
    with pytest.raises(mechdesign.StudyError, match="the sketch cannot be assembled"):
        mechdesign.load(text=FOUR_BAR, overrides=["mechanism.links.rocker.2=5", "mechanism.sketch.B=[75, -55]"])


def test_a_file_that_needs_its_override_is_read_with_it():
    text = FOUR_BAR.replace("rod: [A, B, 90]", "rod: [A, B, 9]")
    with pytest.raises(mechdesign.StudyError, match="the sketch cannot be assembled"):
        mechdesign.load(text=text)
    study = mechdesign.load(text=text, overrides=["mechanism.links.rod.2=90"])
    assert mechdesign.kinematics(study).main["valid"].all()


@pytest.mark.slow
def test_a_manifest_repeats_what_was_set(tmp_path):

    mechdesign.kinematics(mechdesign.load(text=FIVE_BAR, overrides=[WIDE])).save(tmp_path, plots=False)
    repeated = command_line.ask("run", "--verify", tmp_path, study="")
    assert repeated.exit_code == 0, repeated.output
    manifest = tmp_path / "manifest.json"
    content = json.loads(manifest.read_text())
    # Without the sketch as it was drawn the same numbers make another assembly, or none.
    del content["study"]["drawn"]
    manifest.write_text(json.dumps(content))
    assert command_line.ask("run", "--verify", tmp_path, study="").exit_code != 0
    mechdesign.kinematics(mechdesign.load(text=FIVE_BAR)).save(tmp_path, plots=False)
    assert "drawn" not in json.loads(manifest.read_text())["study"]
