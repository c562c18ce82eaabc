"""The Python door as a notebook uses it: studies that are no file, tables that convert, short representations."""

from __future__ import annotations

import re

import numpy as np
import pytest

import mechdesign
from mechdesign.study import template, template_path

DATA = {
    "mechanism": {
        "parameters": {"a": np.float64(30.0)},
        "links": {
            "ground": {"O": (0, 0), "D": np.array([100, 0])},
            "crank": ["O", "A", "a"],
            "rod": ["A", "B", 90],
            "rocker": ["D", "B", 60],
        },
        "drives": ["crank"],
        "sketch": {"A": [0, 30], "B": [75, 55]},
    },
    "kinematics": {"sweep": {"crank": {"from": 0, "to": 360, "step": 90}}},
}


def test_a_study_as_a_mapping_a_text_and_a_file_is_the_same() -> None:
    file = template_path("four_bar")
    tables = [
        mechdesign.kinematics(study).main
        for study in (mechdesign.load(file), mechdesign.load(text=template("four_bar")), mechdesign.load(str(file)))
    ]
    assert all(list(table) == list(tables[0]) for table in tables)
    motion = mechdesign.kinematics(mechdesign.load(DATA)).main
    assert motion["A.x"] == pytest.approx([30, 0, -30, 0, 30])


def test_overrides_as_a_mapping() -> None:
    changes = {
        "mechanism.parameters.a": np.float32(20),
        "kinematics.sweep": {"crank": {"from": 0, "to": 90, "number": 2}},
    }
    study = mechdesign.load(DATA, changes)
    assert mechdesign.kinematics(study).main["A.x"] == pytest.approx([20, 0])
    assert study.overrides[0] == "mechanism.parameters.a=20.0"
    assert "a" in DATA["mechanism"]["parameters"]


def test_mistakes_of_a_mapping_name_their_keys() -> None:
    with pytest.raises(mechdesign.StudyError, match=re.escape("mechanism.links.crank.2: ")):
        mechdesign.load(DATA, {"mechanism.links.crank": ["O", "A", "q"]})
    with pytest.raises(mechdesign.StudyError, match=r"the study is not plain data .*: it holds 'object'"):
        mechdesign.load({"mechanism": object()})
    for source in (DATA, None, "mechanism:\n  links: {}", ["study.yaml"]):
        with pytest.raises(mechdesign.StudyError, match="give a study as one of"):
            mechdesign.load(source, text="mechanism: {}" if source is DATA else None)
    with pytest.raises(mechdesign.StudyError, match=r"^<study>:1:12: "):
        mechdesign.load(text="mechanism: 3")


def test_tables_iterate_and_convert() -> None:
    motion = mechdesign.kinematics(mechdesign.load(DATA)).main
    rows = list(motion)
    assert [row["crank"] for row in rows] == [0, 90, 180, 270, 360]
    assert list(motion.to_dict()) == list(motion.names)
    assert motion.to_dict()["valid"].all()


def test_what_a_cell_shows_is_short() -> None:
    study = mechdesign.load(template_path("five_bar"))
    result = mechdesign.kinematics(study)
    shown = [study, result, result.main, result.main.columns[0], study.mechanism.sketch_configuration]
    assert all(20 < len(repr(each)) < 500 for each in shown)
    assert "motion" in repr(result)


def test_an_optimum_of_a_mapping_is_written_as_a_study() -> None:
    changes = {"optimize": {"variables": {"a": {"from": 20, "to": 30, "number": 2}}, "minimize": "kinematics.B.x"}}
    files = mechdesign.optimize(mechdesign.load(DATA, changes)).files
    assert all(mechdesign.load(text=text).parameters.nominal["a"] in (20, 30) for text in files.values())
    assert files
