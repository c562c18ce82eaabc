"""Whatever stands in a study, it is loaded or told as a StudyError: never a traceback."""

import contextlib
import copy
import json
import tempfile
from pathlib import Path

import pytest
import yaml
from helpers import command_line
from hypothesis import given, settings
from hypothesis import strategies as st

import mechdesign

TEMPLATES = {
    name: command_line.ask("new", name, study="").stdout
    for name in ("five_bar", "four_bar", "slider_crank", "two_link_arm")
}
STUDIES = [yaml.safe_load(text) for text in TEMPLATES.values()]
WORDS = [
    "O",
    "A",
    "P",
    "crank",
    "ground",
    "theta",
    "theta1",
    "rod.angle",
    "C.x",
    "r",
    "1/0",
    "3 mm",
    "5 rad/s",
    "min(1",
    "x.y.z",
    "",
]
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 400) | st.sampled_from([0.5, 1e300, -1e-9]) | st.sampled_from(WORDS),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from([*WORDS, "from", "to", "points"]), inner, max_size=3)
    ),
    max_leaves=6,
)


def spots(data):
    """Every (holder, key) of nested data."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield data, key
        yield from spots(value)


@pytest.mark.nightly
@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damaged_studies(data):
    study = copy.deepcopy(data.draw(st.sampled_from(STUDIES)))
    for _ in range(data.draw(st.integers(1, 2))):
        holder, key = data.draw(st.sampled_from(list(spots(study))))
        action = data.draw(st.sampled_from(["replace", "remove", "rename"]))
        if action == "replace" or isinstance(holder, list):
            holder[key] = data.draw(VALUES)
        else:
            value = holder.pop(key)
            if action == "rename":
                holder[key + "x"] = value
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.yaml"
        path.write_text(json.dumps(study))
        with contextlib.suppress(mechdesign.StudyError):
            mechdesign.load(path)


@pytest.mark.nightly
@pytest.mark.parametrize("name", TEMPLATES)
def test_half_written_studies(name, tmp_path):
    lines = TEMPLATES[name].splitlines(keepends=True)
    path = tmp_path / "study.yaml"
    for count in range(len(lines)):
        path.write_text("".join(lines[:count]))
        with contextlib.suppress(mechdesign.StudyError):
            mechdesign.load(path)
