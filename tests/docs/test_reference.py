"""The reference is whole: every table, column, message, word and study stands in it, and every example is run."""

from __future__ import annotations

import ast
import json
import re
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import examples
import gallery
import lists
import pytest
import yaml
from helpers.studies import study_of
from helpers.tables import named, unsaid

import mechdesign
from mechdesign.door.reference import entries, tables
from mechdesign.ground.cautions import KINDS
from mechdesign.ground.errors import AssemblyError
from mechdesign.ground.results import Result

ROOT = Path(__file__).parents[2]
FIVE_BAR = """
units: {length: dimensionless}
mechanism:
  parameters: {a: 0.25, b: 0.4, h: 0.15, low: 30, high: 200, both: a + b}
  links:
    ground: {A: [-h, 0], B: [h, 0]}
    left: [A, C, a]
    right: [B, D, a]
    fore_left: [C, P, b]
    fore_right: [D, P, b]
  drives: {t1: {angle: left}, t2: {angle: right}}
  limits: [{drive: t1, min: low, max: high}, {drive: t2, min: 180 - high, max: 180 - low}]
  targets: {P: [[0, 0.5]]}
  sketch: {C: [-0.3, 0.2], D: [0.3, 0.2], P: [0, 0.48]}
kinematics: {poses: [{P.x: 0, P.y: 0.5}], outputs: [C], jacobian: [P.x, P.y]}
workspace: {point: P, scan: {about: [0.05, 0.45]}, indices: [], integrate: {rule: midpoint}}
optimize:
  variables: {a: {from: 0.25, to: 0.27, step: 0.01}}
  minimize: [both, kinematics.P_error]
"""
FOUR_BAR = """
mechanism:
  links: {ground: {O: [0, 0], D: [100, 0]}, crank: [O, A, 30], rod: [A, B, 90], rocker: [D, B, 60]}
  drives: [crank]
  limits: [{drive: crank, min: 0, max: 90}]
  sketch: {A: [0, 30], B: [75, 55]}
kinematics: {instant_centres: [[ground, rod]], mechanical_advantage: {rocker.angle: crank}}
workspace: {point: B}
"""
PLATFORM = ROOT / "configs" / "planar_3rpr.yaml"


@cache
def asked() -> tuple[tuple[str, Result, Any], ...]:
    """Answers to what no shipped study asks: pieces, paths of points, modes, eigen-stiffnesses, ..."""
    bar, four = study_of(FIVE_BAR), study_of(FOUR_BAR)
    front = study_of(FIVE_BAR, "optimize.method=pareto", "optimize.evaluations=60",
                     "optimize.variables.a={from: 0.25, to: 0.27}")  # fmt: skip
    held = study_of(FIVE_BAR, "optimize.subject_to=[{contains: {circle: 0.001, center: free}}]")
    cases = study_of(FOUR_BAR, "matrix.vary={mechanism.links.rod.length: [85, 90]}",
                     "matrix.best={maximize: kinematics.B.x.max}",
                     "requirements=[{result: kinematics.extremes.B.x.range, at_least: 1}]")  # fmt: skip
    with TemporaryDirectory() as folder:
        (Path(folder) / "study.yaml").write_text(FOUR_BAR, encoding="utf-8")
        (Path(folder) / "cases.csv").write_text(
            "label,mechanism.links.rod.length\nshort,85\nlong,90\n", encoding="utf-8"
        )
        labelled = mechdesign.load(Path(folder) / "study.yaml", [
            "matrix={cases: cases.csv, results: [kinematics.B.x.max]}"
        ])  # fmt: skip
    slopes = study_of(
        FOUR_BAR,
        "kinematics={poses: [{crank: 30}], outputs: [B]}",
        "sensitivities={results: [kinematics.B.x], parameters: [mechanism.links.rod.length]}",
    )
    graded = study_of(
        FOUR_BAR,
        "reliability={poses: [{crank: 30}], dimensions: {rod.length: 0.1}, limits: {B.x: 0.1}, samples: 100, "
        "allocate: {cpk: 1, grades: true}}",
    )
    hopeless = study_of(FIVE_BAR, "optimize={method: search, evaluations: 20, variables: {a: {from: 0.25, to: 0.27}}, "
                        "minimize: a, subject_to: [{result: a, at_least: 1}]}")  # fmt: skip
    stiff = mechdesign.load(PLATFORM, ["stiffness.characteristic_length=0.2", "stiffness.direction=30"])
    crank = study_of(
        FOUR_BAR,
        "kinematics={motion: {crank: [{from: 20, to: 60, time: 1}]}, instants: 2, instant_centres: [[ground, rod]]}",
        "reliability={dimensions: {rod.length: 0.1}, limits: {B.x: 0.1, B.y: 0.1}, methods: [monte_carlo, auto], "
        "samples: 100, allocate: {cpk: 1, grades: true}}",
    )
    legs = mechdesign.load(PLATFORM, [
        "kinematics={motion: {P.x: [{from: 0, to: 0.1, time: 1}], P.y: 1, platform.angle: 0}, instants: 2}",
        "stiffness.poses=null", "stiffness.characteristic_length=0.2", "stiffness.loads=[{at: B1, force: [1, 0]}]",
    ])  # fmt: skip
    fall = study_of("""
mechanism: {links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 100, mass: 1}}, drives: [arm]}
dynamics:
  gravity: [0, -9.81 m/s^2]
  outputs: [P]
  forward: {duration: 0.1, start: {arm: 0}, events: {passes: {of: arm, value: -10}}, rows: 3}
""")
    turn = study_of("""
mechanism: {links: {ground: {O: [0, 0]}, arm: {from: O, to: P, length: 100, mass: 1}}, drives: [arm]}
dynamics: {gravity: [0, -9.81 m/s^2], rates: {arm: 10}, flywheel: {fluctuation: 0.1}, modes: true}
""")
    rubbed = study_of(
        FOUR_BAR, "mechanism.friction={B: {coefficient: 0.1, radius: 2}}",
        "kinematics={poses: [{crank: 30}], outputs: [B], loads: [{at: B, force: [1, 0]}]}",
    )  # fmt: skip
    guided = study_of("""
units: {length: mm}
synthesis:
  body: [{x: 0, y: 0, angle: 0}, {x: 20, y: 5, angle: 20}, {x: 35, y: 15, angle: 45}, {x: 40, y: 30, angle: 75}]
  solutions: 1
  judge: {loads: [{at: A, force: [0, -10]}]}
""")
    return (
        ("guided", mechdesign.synthesize(guided), guided),
        ("motion in time", mechdesign.dynamics(fall), fall),
        ("flywheel and modes", mechdesign.dynamics(turn), turn),
        ("friction", mechdesign.kinematics(rubbed), rubbed),
        ("pieces", mechdesign.workspace(bar), bar),
        ("time and centres", mechdesign.kinematics(crank), crank),
        ("errors over time", mechdesign.reliability(crank), crank),
        ("stiffness over time", mechdesign.stiffness(legs), legs),
        ("goals", mechdesign.optimize(bar), bar),
        ("held", mechdesign.optimize(held), held),
        ("front", mechdesign.optimize(front), front),
        ("target", mechdesign.kinematics(bar), bar),
        ("path", mechdesign.workspace(four), four),
        ("modes", mechdesign.kinematics(four, all_modes=True), four),
        ("centres", mechdesign.kinematics(four), four),
        ("cases", mechdesign.sweep(cases), cases),
        ("labels", mechdesign.sweep(labelled), labelled),
        ("slopes", mechdesign.sensitivities(slopes), slopes),
        ("graded", mechdesign.reliability(graded), graded),
        ("eigen", mechdesign.stiffness(stiff), stiff),
        ("nearest", without_feasible(hopeless), hopeless),
    )


def without_feasible(study: Any) -> Result:
    """What a search tells that finds no feasible design."""
    with pytest.raises(AssemblyError) as caught:
        mechdesign.optimize(study)
    assert caught.value.result is not None
    return caught.value.result


def manifest(result: Result, study: Any) -> dict[str, Any]:
    """What the manifest of a result says of its tables."""
    units = study.units
    return {
        "study": {"resolved": {"units": {each: getattr(units, each) for each in ("length", "angle", "time", "force")}}},
        "tables": {
            f"{table.name}.csv": {
                "meaning": table.meaning,
                "columns": [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in table.columns],
            }
            for table in result.tables.values()
        },
    }


@pytest.mark.nightly
def test_columns_of_answers_that_no_shipped_study_asks_for_are_in_the_reference():
    assert {name: unsaid(manifest(result, study)) for name, result, study in asked()} == {
        name: [] for name, *_ in asked()
    }


def test_no_column_of_the_reference_is_idle():
    found = [json.loads(path.read_text(encoding="utf-8")) for path in (ROOT / "results").rglob("manifest.json")]
    found += [manifest(result, study) for _, result, study in asked()]
    seen: dict[str, set[str]] = {}
    for name, told in ((name, told) for each in found for name, told in each["tables"].items()):
        seen.setdefault(name, set()).update(column["name"] for column in told["columns"])
    idle = [
        (f"{table.name}.csv", kind.name)
        for command, table in tables()
        for kind in table.kinds
        if command != "run" and not any(named(kind, name) for name in seen.get(f"{table.name}.csv", ()))
    ]
    assert idle == []


def test_every_table_and_column_of_answers_is_made_by_its_declaration():
    """What the reference does not declare would have no entry."""
    made = [
        f"{path.name}:{call.lineno}"
        for folder in ("questions", "region", "experiments")
        for path in (*(ROOT / "mechdesign" / folder).rglob("*.py"), ROOT / "mechdesign/door/cli/summary.py")
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in ("Table", "Column")
        and path.name != "together.py"
    ]  # fmt: skip
    assert made == []


def test_every_kind_of_warning_names_a_page_of_the_documentation():
    made = lists.pages()
    pages = [kind.page for kind in KINDS.values()]
    assert [page for page in pages if f"{page}.md" not in made and not (ROOT / "docs" / f"{page}.md").exists()] == []


def test_the_pages_have_every_word():
    pages = lists.pages()
    for entry in entries():
        word = entry.word.partition(".")[2] if entry.kind == "key" and "." in entry.word else entry.word
        written = entry.takes if entry.kind == "column" and entry.takes else word
        assert any(written in text for text in pages.values()), (entry.kind, entry.word)
    for command, table in tables():
        page = pages[f"reference/tables/{command}.md"]
        for kind in table.kinds:
            assert lists.code(kind.name) in page
            assert lists.markdown(kind.meaning) in page


def test_examples_of_keys_stand_at_their_places():
    keys = [entry for entry in entries() if entry.kind == "key" and entry.examples]
    for entry in keys:
        found = yaml.safe_load(lists.in_place(entry))
        for part in entry.word.split("."):
            assert len(found) == 1
            (found,) = found if isinstance(found, list) else found.values() if part == "*" else [found[part]]
        assert found == yaml.safe_load(f"here: {entry.examples[0]}")["here"], entry.word


def test_every_study_is_in_one_group_and_has_a_page():
    names = [name for group in gallery.GROUPS.values() for name in group]
    assert sorted(names) == sorted(gallery.studies())
    assert {f"gallery/{name}.md" for name in (*names, "index")} == set(gallery.pages())


def test_every_yaml_of_a_page_is_run():
    made = {*lists.pages(), *gallery.pages()}
    for page in (each for each in examples.ROOT.rglob("*.md") if "_" not in each.relative_to(examples.ROOT).parts[0]):
        place = page.relative_to(examples.ROOT)
        kinds = re.findall(
            r"(?m)^`{3,}((?!\{literalinclude\}).*ya?ml.*)$", page.read_text(encoding="utf-8"), re.IGNORECASE
        )
        if place.as_posix() in made:
            # Examples of keys, which tests/unit/test_reference.py reads.
            continue
        assert not kinds or place.parts[0] in examples.FOLDERS, place
        assert {kind.strip() for kind in kinds} <= {"yaml", "{code-block} yaml"}, place
