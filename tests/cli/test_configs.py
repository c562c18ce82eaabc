"""Every shipped study runs, meets its requirements, and is what results/ was made from."""

from __future__ import annotations

import csv
import hashlib
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.pages import faults, lost_curves
from helpers.tables import unsaid
from matplotlib.figure import Figure

from mechdesign import load
from mechdesign.commands import COMMANDS
from mechdesign.door.cli.batch import questions
from mechdesign.drawing import style
from mechdesign.ground.errors import MechdesignError
from mechdesign.study import template_path
from mechdesign.study.templates import templates

ROOT = Path(__file__).parents[2]
CONFIGS = sorted((ROOT / "configs").rglob("*.yaml"))
RESULTS = ROOT / "results"
PNG = b"\x89PNG\r\n\x1a\n"
GIF = b"GIF89a"


def named(path: Path) -> str:
    return path.stem


def pictures_of(config: Path) -> set[tuple[str, str]]:
    """Commands and names of the pictures that results/ has of a study."""
    folder = RESULTS / config.relative_to(ROOT / "configs").with_suffix("")
    manifests = {path.parent.name: json.loads(path.read_text()) for path in folder.rglob("manifest.json")}
    return {(command, name) for command, manifest in manifests.items() for name in manifest["files"]
            if name.endswith((".png", ".gif"))}  # fmt: skip


def studies_of_every_picture() -> Iterator[Path]:
    """Few studies that have every picture of the tool among them; the others' are drawn every night."""
    pictures = {config: pictures_of(config) for config in CONFIGS}
    missing = set().union(*pictures.values())
    while missing:
        config = max(CONFIGS, key=lambda config: len(pictures[config] & missing))
        missing -= pictures[config]
        yield config


DRAWN = [*studies_of_every_picture()]


def fewer_designs(config: Path) -> Iterator[str]:
    """Overrides by which a search looks at few designs: tests/reference compares those of the whole study."""
    study = load(config)
    section, task = study.optimize, study.synthesis
    if task is not None and task.path is not None:
        yield from ("synthesis.evaluations=1000", "synthesis.judge.best=3", "synthesis.judge.samples=100")
    if section is None:
        return
    if section.method != "grid":
        yield "optimize.evaluations=200"
    for name, variable in section.variables.items():
        if variable.step is not None:
            yield f"optimize.variables.{name}.step={5 * variable.step}"


@pytest.fixture
def judged_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """A picture fails as it is drawn if text lies over text or off the page, axes of places differ, curves are lost."""
    encoded = style.encoded

    def judged(figure: Figure, kind: str = "png") -> bytes:
        data = encoded(figure, kind)
        wrong = [*faults(figure), *lost_curves(figure)]
        assert not wrong, "; ".join(wrong)
        return data

    monkeypatch.setattr(style, "encoded", judged)


@pytest.mark.parametrize("config", [config for config in CONFIGS if config not in DRAWN], ids=named)
def test_study_runs_with_every_question_it_asks(config: Path, tmp_path: Path, invoke) -> None:
    check_run(config, tmp_path, invoke, "--no-plots")


@pytest.mark.usefixtures("judged_pages")
@pytest.mark.parametrize(
    "config", [pytest.param(config, marks=[] if config in DRAWN else pytest.mark.nightly) for config in CONFIGS],
    ids=named,
)  # fmt: skip
def test_study_runs_with_its_pictures(config: Path, tmp_path: Path, invoke) -> None:
    check_run(config, tmp_path, invoke)


def check_run(config: Path, folder: Path, invoke, *options: str) -> None:
    """Run every question of a study, of a search with few designs; check its files against the manifests."""
    fewer = [word for override in fewer_designs(config) for word in ("--set", override)]
    done = invoke("run", config, "--out", folder, "--jobs", 1, *options, *fewer)
    assert done.exit_code == 0, done.output
    study = load(config)
    for command in questions(study):
        manifest = json.loads((folder / command / "manifest.json").read_text())
        assert not manifest["failed"]
        assert unsaid(manifest) == []
        assert not [warning for warning in manifest["warnings"] if warning["kind"] == "undrawn"]
        files = {path.name for path in (folder / command).iterdir()}
        assert files == {*manifest["files"], "manifest.json"}
        assert ("mechanism.png" in files) == ("--no-plots" not in options)
        for name, digest in manifest["files"].items():
            content = (folder / command / name).read_bytes()
            assert hashlib.sha256(content).hexdigest() == digest
            # What is neither a picture nor a table is a study that loads.
            assert content.startswith(PNG) or name.endswith(".csv") or load(folder / command / name)


@pytest.mark.usefixtures("judged_pages")
@pytest.mark.parametrize(
    "name", ["wiper", *(pytest.param(n, marks=pytest.mark.nightly) for n in ("press_stiffness", "cheapest_tolerances"))]
)
def test_pages_as_narrow_as_a_column_are_laid_out(name: str, tmp_path: Path, invoke) -> None:
    done = invoke("run", ROOT / "configs" / "gallery" / f"{name}.yaml", "--out", tmp_path, "--style", "paper")
    assert done.exit_code == 0, done.output
    manifests = [json.loads(path.read_text()) for path in tmp_path.glob("*/manifest.json")]
    assert manifests
    for manifest in manifests:
        assert not [warning for warning in manifest["warnings"] if warning["kind"] == "undrawn"]


@pytest.mark.parametrize("config", CONFIGS, ids=named)
def test_results_are_those_of_the_study_as_it_is(config: Path) -> None:
    for command in load(config).questions:
        folder = RESULTS / config.relative_to(ROOT / "configs").parent / config.stem / command
        manifest = json.loads((folder / "manifest.json").read_text())
        assert manifest["study"]["sha256"] == hashlib.sha256(config.read_bytes()).hexdigest()
        assert manifest["overrides"] == []


@pytest.mark.parametrize("name", templates())
def test_templates_are_studies(name: str) -> None:
    try:
        assert load(template_path(name)).questions
    except MechdesignError as error:
        pytest.fail(str(error))


@pytest.mark.skipif(not any((ROOT / "results").rglob("*.png")), reason="a source distribution has no pictures")
def test_pages_show_pictures_that_exist() -> None:
    for page in (ROOT / "README.md", ROOT / "results" / "README.md"):
        pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", page.read_text())
        assert pictures
        for picture in pictures:
            assert (page.parent / picture).read_bytes().startswith((PNG, GIF)), picture


def test_readme_shows_the_test_command_that_ci_runs_and_every_command() -> None:
    text = (ROOT / "README.md").read_text()
    assert "bash .ci/run" in text
    for command in (*COMMANDS, "run", "check", "new", "docs", "schema"):
        assert f"mechdesign {command}" in text


@pytest.mark.parametrize("page", ["README.md", "docs/questions.md"])
def test_numbers_told_of_the_five_bar_are_those_of_its_results(page: str) -> None:
    def row(table: str, **where: str) -> dict[str, float]:
        with (ROOT / "results" / "five_bar" / f"{table}.csv").open() as file:
            rows = [each for each in csv.DictReader(file) if all(each[name] == value for name, value in where.items())]
        return {name: float(value) for name, value in rows[0].items() if re.fullmatch(r"[-+.\de]+", value)}

    indices, stiff = row("workspace/indices"), row("stiffness/stiffness", **{"C.x": "0", "C.y": "220"})
    near, far = (
        100 * row("reliability/reliability", **{"C.x": "0", "C.y": y, "method": "monte_carlo"})["reliability"]
        for y in ("220", "280")
    )
    told = {
        "README.md": (
            f"{indices['area']:,.0f} mm²", f"{100 * indices['SUI']:.1f} %", f"{indices['GII']:.3f}", f"{near:.1f} %",
            f"{far:.1f} %",
        ),
        "docs/questions.md": (f"{stiff['k_x']:.0f} N/mm across", f"{stiff['k_y']:.0f} N/mm upwards"),
    }  # fmt: skip
    text = (ROOT / page).read_text(encoding="utf-8")
    for number in told[page]:
        assert number in text
