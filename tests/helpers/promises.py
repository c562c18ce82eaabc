"""What version 1 promises to who uses it, as the program has it now, and what it was when that was frozen.

`PYTHONPATH=tests python -m helpers.promises` freezes it anew, for a release that adds something. Before that
`tests/unit/test_stability.py` must pass, or what was promised is lost.
"""

from __future__ import annotations

import inspect
import io
import json
import re
import tarfile
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import typer.main

import mechdesign
from mechdesign.door.cli.app import app
from mechdesign.door.cli.docs import commands
from mechdesign.door.reference import Entry, entries, tables
from mechdesign.ground.errors import OUTCOMES

ROOT = Path(__file__).parents[2]
FROZEN = ROOT / "tests" / "data" / "stable.json"
STUDIES = ROOT / "tests" / "data" / "stable_studies.tar.xz"
FACTS = "facts.json"  # in the archive: what its studies ask, and how their mechanisms stand
# Kinds of the reference's entries that have a promise of their own, or none.
OTHERS = {"table", "column", "exit code", "command", "option", "picture", "other word", "out of scope"}
DIRECTIVE = re.compile(r"\.\. auto(?:class|exception|function):: ([\w.]+)\n((?:   :.*\n)*)")


def promises() -> dict[str, Any]:
    """Words of studies by their kinds, columns of tables, exit codes, options and names of Python."""
    group = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    index = [*entries(commands(group))]
    return {
        "made by": {"mechdesign": mechdesign.__version__},
        "words": _words(index),
        "defaults": {entry.word: entry.default for entry in index if entry.kind == "key" and entry.default},
        "columns": _columns(),
        "exit codes": {str(code): word for code, word in OUTCOMES.items()},
        "options": {name: sorted(flag for item in command.params for flag in item.opts if flag[0] == "-")
                    for name, command in group.items()},
        "python": dict(_python()),
    }  # fmt: skip


def _words(index: list[Entry]) -> dict[str, list[str]]:
    """Keys, and words that stand in a study or in a cell of a table, by what they are."""
    words: dict[str, set[str]] = {}
    for entry in index:
        if entry.kind not in OTHERS:
            words.setdefault(entry.kind, set()).add(entry.word)
        if entry.kind == "key" and entry.words:
            words.setdefault(f"word at {entry.word}", set()).update(word for word, _ in entry.words)
    return {kind: sorted(words[kind]) for kind in sorted(words)}


def _columns() -> dict[str, dict[str, str]]:
    """Units of columns by their names, by command and table."""
    found: dict[str, dict[str, str]] = {}
    for command, table in tables():
        columns = found.setdefault(f"{command}: {table.name}.csv", {})
        columns |= {name: kind.unit for kind in table.kinds for name in kind.names}
    return found


def _python() -> Iterator[tuple[str, Any]]:
    """Parameters of functions, and members of classes, that the page `docs/api.md` documents."""
    documented = DIRECTIVE.findall((ROOT / "docs" / "api.md").read_text(encoding="utf-8"))
    assert {name.removeprefix("mechdesign.") for name, _ in documented} >= {*mechdesign.__all__} - {"__version__"}
    for name, options in sorted(documented):
        thing = _named(name)
        if not inspect.isclass(thing):
            yield name, _parameters(thing)
            continue
        listed = re.search(r":members: (.+)", options)
        members = listed[1].split(", ") if listed else [*_public(thing)] if ":members:" in options else []
        members += ["exit_code"] * issubclass(thing, mechdesign.MechdesignError)
        yield name, {member: _parameters(getattr(thing, member, None)) for member in sorted(members)}


def _named(name: str) -> Any:
    """What stands at a dotted name: attributes of the last of its modules that can be imported."""
    module, *rest = name.split(".")
    place: Any = import_module(module)
    for part in rest:
        if not hasattr(place, part):
            import_module(f"{place.__name__}.{part}")
        place = getattr(place, part)
    return place


def _public(thing: type) -> Iterator[str]:
    names = {*dir(thing), *(name for base in thing.__mro__ for name in getattr(base, "__annotations__", {}))}
    yield from (name for name in names if not name.startswith("_") and name not in {"of", "drawn", "whose"})


def _parameters(thing: Any) -> list[list[str]] | None:
    """Name, kind and default of each parameter; None of what is not called."""
    if not inspect.isfunction(thing):
        return None
    found = [item for item in inspect.signature(thing).parameters.values() if item.name != "self"]
    return [[item.name, item.kind.name, "" if item.default is item.empty else _plain(item.default)] for item in found]


def _plain(default: object) -> str:
    return repr(default) if isinstance(default, str | int | float | tuple | None) else type(default).__name__


def facts(study: mechdesign.Study) -> dict[str, Any]:
    """What a study asks, and how its mechanism stands: names and sizes of its dimensions, places of its points."""
    asked = {"questions": [*study.questions], "sections": sorted(study.sections),
             "requirements": [str(requirement.result) for requirement in study.requirements]}  # fmt: skip
    if study.is_task:
        return asked
    mechanism, sketch = study.mechanism, study.mechanism.sketch_configuration
    places = dict(zip(mechanism.graph.nodes, sketch.nodes, strict=True))
    return asked | {
        "drives": [*mechanism.drives],
        "coordinates": [*mechanism.coordinates],
        "dimensions": {name: float(f"{place.nominal:.9g}") for name, place in mechanism.description.places.items()},
        "points": {name: [float(f"{part:.9g}") for part in (places[name].real, places[name].imag)]
                   for name in mechanism.points},
    }  # fmt: skip


@cache
def frozen_studies() -> dict[str, bytes]:
    """The frozen texts of studies by their names, and what they were."""
    with tarfile.open(STUDIES) as archive:
        files = {member.name: archive.extractfile(member) for member in archive.getmembers()}
        return {name: file.read() for name, file in files.items() if file is not None}


def _freeze() -> None:
    lines = []
    for part, content in promises().items():
        entries_of = ",\n".join(f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items())
        lines.append(f"{json.dumps(part)}: {{\n{entries_of}\n}}")
    FROZEN.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    texts = {path.name: path.read_bytes() for path in sorted((ROOT / "configs").rglob("*.yaml"))}
    found = {name: facts(mechdesign.load(text=text.decode())) for name, text in texts.items()}
    with tarfile.open(STUDIES, "w:xz", preset=9) as archive:
        for name, content in (*texts.items(), (FACTS, json.dumps(found, sort_keys=True).encode())):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))


if __name__ == "__main__":
    _freeze()
