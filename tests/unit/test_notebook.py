"""The Python interface as a notebook uses it: studies that are no file, tables that convert, what a cell shows."""

from __future__ import annotations

import dataclasses
import doctest
import json
import pickle
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from helpers import command_line
from matplotlib.figure import Figure
from PIL import Image

import mechdesign
from mechdesign.ground.columns import ColumnKind

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
ARM = {"mechanism": {"links": {"ground": {"O": [0, 0]}, "arm": ["O", "P", 100]}, "drives": ["arm"]}}
README = Path(__file__).parents[2] / "README.md"
PNG = b"\x89PNG\r\n\x1a\n"
HOSTILE = "<img src=x onerror=alert(1)> & <script>"


class Page(HTMLParser):
    """The elements of a page that is well-formed, with their attributes, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text, self._open = "", []
        self.feed(text)
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in ("img", "br"):
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.found if name == tag]


@pytest.mark.slow
def test_a_study_as_a_mapping_a_text_and_a_file_is_the_same(tmp_path: Path) -> None:
    text = command_line.ask("new", "four_bar", study="").stdout
    file = tmp_path / "four_bar.yaml"
    file.write_text(text)
    tables = [
        mechdesign.kinematics(study).main
        for study in (mechdesign.load(file), mechdesign.load(text=text), mechdesign.load(str(file)))
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
    study = mechdesign.load(text=command_line.ask("new", "five_bar", study="").stdout)
    result = mechdesign.kinematics(study)
    shown = [study, result, result.main, result.main.columns[0], study.mechanism.sketch_configuration]
    assert all(20 < len(repr(each)) < 500 for each in shown)
    assert "motion" in repr(result)


def test_an_optimum_of_a_mapping_is_written_as_a_study() -> None:
    changes = {"optimize": {"variables": {"a": {"from": 20, "to": 30, "number": 2}}, "minimize": "kinematics.B.x"}}
    files = mechdesign.optimize(mechdesign.load(DATA, changes)).files
    assert all(mechdesign.load(text=text).parameters.nominal["a"] in (20, 30) for text in files.values())
    assert files


@pytest.mark.slow
def test_a_study_shows_its_mechanism_and_its_words_stay_text() -> None:
    mechanism = DATA["mechanism"] | {"parameters": {"a": 30, "unused": 1}}
    data = DATA | {"name": HOSTILE, "mechanism": mechanism}
    study = mechdesign.load(data, {"mechanism.parameters.a": 31})
    html = study._repr_html_()
    page = Page(html)
    assert len(html.encode()) < 150_000
    (image,) = page.all("img")
    assert str(image["src"]).startswith("data:image/png;base64,")
    assert HOSTILE in str(image["alt"])
    for words in (
        HOSTILE,
        "crank (O, A; 31 mm)",
        "revolute B (rod, rocker)",
        "crank (angle of crank)",
        "parameters.a=31",
    ):
        assert words in page.text
    assert "mechanism.parameters.unused: " in page.text
    assert study._repr_png_().startswith(PNG)


@pytest.mark.slow
def test_a_result_shows_what_is_met_and_how_its_main_table_begins() -> None:
    asked = [{"result": "kinematics.B.x", "at_least": limit} for limit in (0, 70)]
    study = mechdesign.load(DATA | {"name": HOSTILE, "requirements": asked})
    result = mechdesign.kinematics(study)
    html = result._repr_html_()
    page = Page(html)
    assert len(html.encode()) < 150_000
    assert {"script", "style", "link"}.isdisjoint(tag for tag, _ in page.found)
    assert len(page.all("img")) == 1
    assert [verdict.met for verdict in result.verdicts] == [True, False]
    assert "range of B.x: 54 mm (from 50 to 104)" in page.text
    begins = ("[mm]", "2 more columns", "extremes, 7 rows", "pictures: paths, motion")
    for words in (HOSTILE, "How does it move?", "1 of 2 met", "✗ not met", *begins):
        assert words in page.text
    assert next(head["title"] for head in page.all("th") if "title" in head) == result.main.columns[0].meaning
    assert "e-1" not in page.text  # what is zero but for rounding
    assert "1 of 2 requirements met" in repr(result)


@pytest.mark.nightly
def test_of_many_requirements_those_that_are_not_met_are_shown() -> None:
    asked = [{"result": "kinematics.B.x", "at_least": limit} for limit in [*range(60), 99]]
    page = Page(mechdesign.kinematics(mechdesign.load(DATA | {"requirements": asked}))._repr_html_())
    assert "at least 99" in page.text
    assert "21 more requirements" in page.text


@pytest.mark.slow
def test_a_picture_that_fails_is_told_and_costs_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*given):
        raise ValueError("no ink")

    monkeypatch.setattr("mechdesign.questions.kinematics.figures.curves.motion_curves", fail)
    result = mechdesign.kinematics(mechdesign.load(DATA))
    with pytest.warns(UserWarning, match=r"picture motion could not be drawn: .*no ink"):
        assert result.figures == ("paths", "poses", "transmission", "mechanism")
    with pytest.raises(mechdesign.MechdesignError, match="no ink"):
        result.figure("motion")


@pytest.mark.slow
def test_rows_of_several_quantities_show_their_units() -> None:
    vary = {"dimensions": {"arm.length": 0.3}, "poses": [{"arm": 0}], "methods": ["analytic"]}
    page = Page(mechdesign.reliability(mechdesign.load(ARM | {"reliability": vary}))._repr_html_())
    assert "nominalmeansigmaunit" in page.text
    assert "P.xposition1001000.1mm" in page.text
    assert "4 more columns (worst_case, worst_low, worst_high, valid)" in page.text


@pytest.mark.slow
def test_a_requirement_that_names_nothing_does_not_keep_a_result_from_being_shown() -> None:
    study = mechdesign.load(DATA | {"requirements": [{"result": "kinematics.nothing", "at_least": 0}]})
    result = mechdesign.kinematics(study)
    assert "no column 'nothing'" in Page(result._repr_html_()).text
    assert "no column 'nothing'" in repr(result)
    with pytest.raises(mechdesign.StudyError, match="no column 'nothing'"):
        result.save("nowhere")


@pytest.mark.nightly
def test_one_picture_by_its_name_whatever_the_settings() -> None:
    result = mechdesign.kinematics(mechdesign.load(DATA))
    assert result.figures == ("paths", "motion", "poses", "transmission", "mechanism")
    usual = result.figure("paths")
    with matplotlib.rc_context({"font.size": 30, "axes.grid": False, "savefig.dpi": 20}):
        mine = dict(matplotlib.rcParams)
        figure = result.figure("paths")
        shown = figure._repr_png_()
        assert dict(matplotlib.rcParams) == mine
    assert isinstance(figure, Figure)
    assert figure is not usual
    assert shown == usual._repr_png_()
    assert shown.startswith(PNG)
    assert result._repr_png_() == result.figure("paths")._repr_png_()
    with pytest.raises(mechdesign.StudyError, match=r"'path'; did you mean 'paths'\?; there are paths, motion, poses"):
        result.figure("path")


@pytest.mark.nightly
def test_what_is_saved_is_what_the_command_writes(tmp_path: Path) -> None:
    sweep = {"arm": {"from": 0, "to": 90, "number": 4}}
    vary = {"dimensions": {"arm.length": 0.3}, "poses": [{"arm": 30}], "methods": ["monte_carlo"], "samples": 500}
    file = tmp_path / "study.yaml"
    file.write_text(json.dumps(ARM | {"kinematics": {"sweep": sweep}, "reliability": vary}))
    study = mechdesign.load(file)
    mechdesign.reliability(study, seed=5).save(tmp_path / "here" / "reliability", plots=False)
    moved = mechdesign.kinematics(study, all_modes=True)
    saved = moved.save(tmp_path / "here" / "kinematics", formats="svg", animate=True)
    for command, options in (
        ("reliability", ["--seed", "5", "--no-plots"]),
        ("kinematics", ["--all-modes", "--animate", "--format", "SVG"]),
    ):
        asked = [command, str(file), "--quiet", "--out", str(tmp_path / "there" / command), *options]
        assert command_line.ask(*asked, study="").exit_code == 0
    here, there = (
        {path.relative_to(root): path.read_bytes() for path in root.rglob("*.*")}
        for root in (tmp_path / "here", tmp_path / "there")
    )
    assert here == there
    assert {"motion.csv", "motion.svg", "motion.gif", "manifest.json"} <= {path.name for path in saved.iterdir()}
    for wrong in ({"formats": "jpg"}, {"plots": False, "formats": "svg"}, {"plots": False, "animate": True}):
        with pytest.raises(mechdesign.StudyError, match=r"formats takes png|contradict"):
            moved.save(tmp_path, **wrong)
    with pytest.raises(mechdesign.StudyError, match="takes a result of kinematics, not of reliability"):
        mechdesign.reliability(study).save(tmp_path, animate=True)


def test_answers_know_their_study_and_its_seed() -> None:
    study = mechdesign.load(ARM)
    assert type(dataclasses.replace(study, seed=2)) is type(study)
    result = mechdesign.kinematics(study, seed=7, all_modes=True)
    assert (result.study.seed, result.study.resolved["seed"], study.seed, result.all_modes) == (7, 7, 0, True)
    assert type(dataclasses.replace(result, warnings=("new",))) is mechdesign.Answer
    plain = mechdesign.Study(**{field.name: getattr(study, field.name) for field in dataclasses.fields(study)})
    assert type(mechdesign.kinematics(plain)) is mechdesign.Answer
    assert pickle.loads(pickle.dumps(mechdesign.kinematics)) is mechdesign.kinematics


@pytest.mark.slow
def test_what_an_interrupted_question_found_is_an_answer(tmp_path: Path) -> None:
    class Impatient:
        """Ctrl-C at the first report."""

        def start(self, total: int, stage: str) -> None:
            pass

        def update(self, n: int) -> None:
            raise KeyboardInterrupt

    vary = {"dimensions": {"arm.length": 0.3}, "poses": [{"arm": 30}], "methods": ["monte_carlo"], "samples": 100_000}
    required = [{"result": "reliability.moments.sigma", "at_most": 1}]
    study = mechdesign.load(ARM | {"reliability": vary, "requirements": required})
    with pytest.raises(KeyboardInterrupt) as caught:
        mechdesign.reliability(study, seed=3, progress=Impatient())
    found = caught.value.result
    assert isinstance(found, mechdesign.Answer)
    assert (found.study.seed, found.verdicts) == (3, ())
    assert found.interrupted
    assert found.interrupted in Page(found._repr_html_()).text
    assert found.figures == ()
    assert not list(found.save(tmp_path / "part").glob("*.png"))


def test_a_table_is_a_data_frame_by_one_call(monkeypatch: pytest.MonkeyPatch) -> None:
    table = mechdesign.kinematics(mechdesign.load(DATA)).main
    pandas = SimpleNamespace(DataFrame=lambda columns: SimpleNamespace(columns=columns, attrs={}))
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    frame = table.to_pandas()
    assert list(frame.columns) == list(table.names)
    assert frame.attrs["units"]["A.x"] == "mm"
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        table.to_pandas()


def test_every_question_is_a_function_of_the_package() -> None:
    """Its names stand there once more, as it may import nothing."""
    questions = re.findall(r"^  (\w+) +.*\?$", command_line.ask("--help", study="").stdout, re.MULTILINE)
    assert len(questions) == 9
    assert set(questions) < set(mechdesign.__all__)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", *mechdesign.__all__])
def test_the_example_of_every_public_name_holds(name: str) -> None:
    told = getattr(mechdesign, name) if name else mechdesign
    if name == "__version__":
        return
    hold(told, name or "mechdesign")


def test_the_example_of_what_they_return_holds() -> None:
    mechanism = type(mechdesign.load(ARM).mechanism)
    for told in (mechanism, mechanism.solve, *mechdesign.Answer.__bases__):
        hold(told, "returned")


def hold(told: object, name: str) -> None:
    (test,) = doctest.DocTestFinder(recurse=False).find(told, name, module=False, globs={})
    assert len(test.examples) > 1
    assert not doctest.DocTestRunner().run(test).failed


@pytest.mark.nightly
def test_the_readme_says_what_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = README.read_text(encoding="utf-8")
    (_, study), (python, *_) = (re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("yaml", "python"))
    Path("study.yaml").write_text(study)
    names: dict[str, object] = {}
    exec(python.replace(".to_pandas()", ""), names)
    assert isinstance(names["result"], mechdesign.Answer)
    assert Path("results/study/kinematics/manifest.json").exists()


def test_the_readme_begins_with_three_lines_one_command_its_verdict_and_the_linkage_moving() -> None:
    text = README.read_text(encoding="utf-8")
    study, told, picture = re.findall(
        r"```yaml\n(.*?)```.*?```console\n\$ (.*?)```.*?!\[[^]]*\]\((.*?)\)", text, re.DOTALL
    )[0]
    assert study.count("\n") == 3
    command, verdict = told.splitlines()
    assert command.startswith("mechdesign run leg.yaml ")
    (judged,) = mechdesign.kinematics(mechdesign.load(text=study)).verdicts
    assert f"{judged.requirement}: met, worst {judged.worst:.6g}" in verdict
    assert judged.met
    assert (README.parent / picture).read_bytes().startswith(b"GIF89a")


def test_the_first_picture_of_the_readme_is_the_live_page_moving_and_quickly_loaded() -> None:
    picture = README.parent / re.findall(r"!\[[^]]*\]\((.*?)\)", README.read_text(encoding="utf-8"))[0]
    assert picture.name == "live.gif"
    with Image.open(picture) as film:
        assert film.n_frames > 20
    assert picture.stat().st_size < 600_000


def test_code_of_the_readme_fits_its_box() -> None:
    text = README.read_text(encoding="utf-8")
    lines = [line for block in re.findall(r"```\w+\n(.*?)```", text, re.DOTALL) for line in block.splitlines()]
    assert max(map(len, lines)) <= 95


def test_a_table_shows_its_first_rows_with_units():
    columns = (
        mechdesign.Column("B.x", np.arange(30) / 7, "mm", "place of <B>"),
        mechdesign.Column("valid", np.arange(30) > 0),
        mechdesign.Column("reason", np.array(["<script>"] * 30)),
    )
    html = mechdesign.Table("motion", columns, "one row a pose")._repr_html_()
    text = Page(html).text
    assert all(words in text for words in ("motion: one row a pose", "B.x", "[mm]", "0.142857", "and 6 more rows"))
    assert html.count("<tr>") == 25
    assert "<script>" not in html
    assert "more row" not in mechdesign.Table("motion", columns).take(np.arange(24))._repr_html_()


def test_a_table_shows_no_rounding_error():
    columns = (
        mechdesign.Column("x", np.array([1.0, 6.1e-17, np.nan]), "mm"),
        mechdesign.Column("y", np.array([-3e-16, 2.0, np.inf]), "mm"),
        mechdesign.Column("part", np.array([1.0, 6.1e-17, 0.5])),
        ColumnKind("failure", "of what is rare", tail=True).column(np.array([1.0, 6.1e-17, 0.5])),
    )
    rows = Page(mechdesign.Table("motion", columns)._repr_html_()).all("tr")
    assert len(rows) == 4
    text = Page(mechdesign.Table("motion", columns)._repr_html_()).text
    assert text.endswith("failure10110206.1·10⁻¹⁷\N{EN DASH}\N{INFINITY}0.50.5")
