"""A new local index is one file: schema, checks, tables and pictures follow from it."""

from pathlib import Path

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign
from mechdesign.door.reference.sources import indices as reference_of_indices
from mechdesign.door.report.tables import to_csv
from mechdesign.drawing.pictures import figures
from mechdesign.questions.workspace import indices
from mechdesign.study.schema.study_file import schema

FILE = '''
"""Reach: distance of the workspace's point from the origin."""

import numpy as np

from mechdesign.questions.workspace.index import Evaluate, Index, length
from mechdesign.questions.workspace.schema import WorkspaceSection
from mechdesign.study import Study


def prepare(study: Study) -> Evaluate:
    """The distance at each place, from the pose that is assembled there."""
    point = WorkspaceSection.of(study).point
    return lambda local: np.abs(local.configuration.point(point))


INDEX = Index("distance from the origin", prepare, length)
'''
ARM = """
mechanism:
  links: {ground: {O: [0, 0]}, upper: [O, E, 50], lower: [E, P, 30]}
  drives: {q1: {angle: upper}, q2: {angle: lower, from: upper}}
  sketch: {E: [30, 40], P: [60, 40]}
workspace: {point: P, indices: [reach], scan: {about: [0, 0]}}
"""


@pytest.fixture
def reach(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    file = tmp_path / "reach.py"
    file.write_text(FILE)
    monkeypatch.setattr(indices, "__path__", [*indices.__path__, str(tmp_path)])
    return file


@pytest.mark.slow
@pytest.mark.usefixtures("reach")
def test_a_new_index_is_found_in_schema_csv_and_picture() -> None:
    assert "'reach'" in str(schema())
    study = study_of(ARM)
    result = mechdesign.workspace(study)
    (row,) = result.main
    assert (row["reach_min"], row["reach_max"]) == pytest.approx((20, 80), rel=1e-4)
    # The mean of r over a ring.
    assert row["reach_mean"] == pytest.approx(2 / 3 * (80**3 - 20**3) / (80**2 - 20**2), rel=1e-4)
    told = {column.name: (column.unit, column.meaning) for column in result.main.columns}
    assert told["reach_mean"] == ("mm", "mean over the region: distance from the origin")
    table = result.tables["local"]
    assert table["reach"] == pytest.approx(np.hypot(table["x"], table["y"]))
    assert "reach" in to_csv(table).splitlines()[0]
    page = figures(study, result)["reach"]
    assert any("Reach at point P: distance from the origin" in text.get_text() for text in page.texts)
    best = "optimize={variables: {lower.length: {from: 20, to: 40, number: 3}}, maximize: reach_mean}"
    optimum = mechdesign.optimize(study_of(ARM, best)).main
    assert optimum["lower.length"][0] == 40


def test_the_reference_has_the_whole_sentence_of_a_new_index(reach: Path) -> None:
    reach.with_name("remote.py").write_text(FILE.replace("from the origin.", "\nfrom the origin.", 1))
    (text,) = (entry.text for entry in reference_of_indices() if entry.word == "remote")
    assert text == "Reach: distance of the workspace's point from the origin."


def test_what_a_new_index_needs_is_checked(reach: Path) -> None:
    with pytest.raises(mechdesign.StudyError, match="did you mean 'reach'"):
        study_of(ARM, "workspace.indices=[reahc]")
    reach.with_name("firm.py").write_text(FILE.replace(", length)", ', length, section="stiffness")'))
    with pytest.raises(mechdesign.StudyError, match="the index 'firm' needs the stiffness section"):
        study_of(ARM, "workspace.indices=[firm]")


def test_without_its_file_there_is_none() -> None:
    with pytest.raises(mechdesign.StudyError, match="expected one of inverse_condition, "):
        study_of(ARM)
