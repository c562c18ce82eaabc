"""A study with other numbers: as if its file had been changed, and the text of that file.

It is not read and checked again: only numbers of the geometry are evaluated anew. Where other numbers of the study
depend on what is changed (a sweep's end, a tolerance, a dimension measured from the sketch) the data is validated
again, so that they follow.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
import yaml

from mechdesign.commands import COMMANDS
from mechdesign.errors import Problem, StudyError, printable
from mechdesign.expressions import Expression, ExpressionError, Number
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.mechanism import Variant
from mechdesign.mechanism.model import Fixed
from mechdesign.study.building.section import LINK_KEYS
from mechdesign.study.loading import Study, load_document
from mechdesign.study.schema.iso_tolerances import is_class
from mechdesign.study.text.document import Document, KeyPath, Mark, in_yaml, leaves, plain, read

# Sections whose numbers are read once, when the study is loaded.
SECTIONS = (*(name for name in COMMANDS if name != "optimize"), "requirements")
# Bytes of a text beyond which it is written anew, without its comments.
_MOST_BYTES = 1_000_000
_INPUT = "input_"


def variant(study: Study, changed: Mapping[str, float]) -> Study:
    """The study with other values of parameters or single places, in its units; the assembly stays the sketch's.

    A parameter that depends on changed ones follows. A place that is changed itself becomes a number: parameters no
    longer change it.

    Raises
    ------
    StudyError
        If a name is neither a parameter nor a place, or the values make no mechanism.
    MechanismError, AssemblyError
        See `mechdesign.mechanism.mechanism.Variant`.
    """
    file = str(study.path or "")
    unknown = [name for name in changed if name not in study.parameters.known()]
    if unknown:
        raise StudyError([Problem("is neither a parameter nor a dimension", name, file) for name in unknown])
    values = {name: np.asarray(value, dtype=float) for name, value in changed.items()}
    parameters, places = study.parameters.values(values), study.parameters.places(values)
    (wrong,) = faults(study, parameters, places, 1)
    if wrong:
        raise StudyError([Problem(wrong, "mechanism", file)])
    resolved = changed_data(study, changed)
    if follows(study, changed):
        document = Document(file, resolved, values={(): Mark(file)})
        return load_document(
            document, study.path, study.folder, study.text, study.text_sha256, study.overrides, study.seed,
            study.mechanism,
        )  # fmt: skip
    description = study.mechanism.description
    new = {name: dataclasses.replace(description.places[name], nominal=float(value)) for name, value in places.items()}
    description = dataclasses.replace(description, places={**description.places, **new})
    old = study.parameters
    return dataclasses.replace(
        study,
        resolved=resolved,
        mechanism=Variant(study.mechanism, description),
        parameters=dataclasses.replace(
            old,
            nominal={name: float(value) for name, value in parameters.items()},
            formulas={name: formula for name, formula in old.formulas.items() if name not in changed},
            dependent={place: formula for place, formula in old.dependent.items() if place not in changed},
            measured=old.measured.difference(changed),
        ),
    )


def faults(study: Study, parameters: Mapping[str, Number], places: Mapping[str, Number], count: int) -> list[str]:
    """Why the numbers of each of `count` designs make no mechanism; empty where they do."""
    found = np.full(count, "", dtype=object)

    def note(wrong: Any, message: str) -> None:
        found[np.broadcast_to(wrong, count) & (found == "")] = message

    for name, value in (*parameters.items(), *places.items()):
        note(~np.isfinite(value), f"{name} has no finite value")
    nominal, links = study.mechanism.nominal, study.mechanism.description.links
    for name, value in places.items():
        owner, _, last = name.rpartition(".")
        if owner in links and last == "length":
            note(~(np.asarray(value) > 0), f"{name} is not positive")
    for index, limit in enumerate(study.mechanism.description.limits):
        low, high = (
            places.get(f"limits.{index}.{end}", nominal.get(f"limits.{index}.{end}")) for end in ("min", "max")
        )
        if low is not None and high is not None:
            note(np.asarray(high) < low, f"limits.{index}: the maximum is below the minimum")
        for end in (low, high):
            if limit.kind == "distance" and end is not None:
                note(np.asarray(end) < 0, f"limits.{index}: a distance is never negative")
    return [str(reason) for reason in found]


def follows(study: Study, names: Collection[str], sections: Collection[str] = SECTIONS) -> bool:
    """Whether more than numbers of the geometry depends on parameters or places: numbers of sections, or the sketch's.

    A name in any text of a section counts: that it never misses matters more than that it is sometimes wrong.
    """
    parameters = study.parameters.moved(names)
    mechanism = study.resolved["mechanism"]
    # An expression of a target is evaluated with the parameters at hand; the numbers of a list are not.
    read = [study.resolved.get(name) for name in sections]
    read += [target for target in (mechanism.get("targets") or {}).values() if not isinstance(target, str)]
    if any(_mentions(part, parameters) for part in read):
        return True
    if "reliability" in sections and _has_classes(study):
        return True
    if not study.parameters.measured:
        return False
    return _mentions(mechanism.get("sketch"), parameters) or not _drawing(study).isdisjoint(
        study.parameters.moved_places(names)
    )


def _has_classes(study: Study) -> bool:
    """Whether a tolerance goes by the size of its dimension: that of a class."""
    section = study.resolved.get("reliability") or {}
    return any(
        isinstance(value, str) and is_class(value) and value not in study.parameters.nominal
        for _, value in leaves(section.get("dimensions") or {})
    )


def _drawing(study: Study) -> set[str]:
    """Places that have a part in how links lie on the sketch, of links of which something is measured there."""
    links, joints = study.mechanism.description.links, study.mechanism.description.joints
    owners: set[str] = set()
    for place in study.parameters.measured:
        joint = joints.get(place.rpartition(".")[0])
        owners.update(joint.links if isinstance(joint, Fixed) else (place.partition(".")[0],))
    points = {point for name in owners for point in (*links[name].points, *(links[name].ends or ()))}
    found = {f"{name}.length" for name in owners if len(links[name].points) > 2}
    # The ground's points lie on the sketch where its numbers say.
    placed = [(name, point) for name in owners for point in links[name].points]
    placed += [(GROUND, point) for point in links[GROUND].points if point in points]
    return found | {f"{name}.{point}.{axis}" for name, point in placed for axis in "xy"}


def _mentions(data: Any, names: Collection[str]) -> bool:
    """Whether a text of the data is an expression in which one of the names stands."""
    for _, text in leaves(data) if names else ():
        with contextlib.suppress(ExpressionError):
            if isinstance(text, str) and not Expression.parse(text).names.isdisjoint(names):
                return True
    return False


def changed_data(study: Study, changed: Mapping[str, float]) -> dict[str, Any]:
    """The study as plain data with other values: what its file would be."""
    data: dict[str, Any] = plain(study.resolved)
    mechanism = data["mechanism"]
    for name, value in changed.items():
        owner, _, last = name.rpartition(".")
        holder: Any = mechanism
        key: str | int = last
        if name in study.parameters.nominal:
            holder, key = mechanism["parameters"], name
        elif owner.startswith("limits."):
            holder = mechanism["limits"][int(owner.partition(".")[2])]
        elif last in ("direction", "angle"):
            holder = mechanism["joints"][owner]
        elif last == "length":
            link = mechanism["links"][owner]
            if isinstance(link, list):
                link[2:] = [float(value)]
                continue
            holder = link
        else:
            link, _, point = owner.rpartition(".")
            holder, key = _points(study, mechanism["links"], link)[point], "xy".index(last)
        holder[key] = float(value)
    return data


def _points(study: Study, links: dict[str, Any], name: str) -> dict[str, list[Any]]:
    """The points of a link in its data, brought to the form ``{P: [x, y]}``; those measured become numbers."""
    described, numbers = study.mechanism.description.links[name], study.mechanism.nominal
    raw = dict(zip(LINK_KEYS, links[name], strict=False)) if isinstance(links[name], list) else dict(links[name])
    given = raw.get("points") if any(key in raw for key in LINK_KEYS) else raw
    known = given if isinstance(given, dict) else {}
    points = {
        point: known.get(point) or [numbers[term] if isinstance(term, str) else term for term in terms]
        for point, terms in described.points.items()
        if point not in (described.ends or ())
    }
    links[name] = points if described.ends is None else {**raw, "points": points}
    return points


def rewritten(study: Study, data: dict[str, Any], heading: str) -> tuple[str, dict[str, str]]:
    """The text of a study with other values, headed by a comment, and the files that it reads, by their names.

    Overrides are part of the new text, as is the seed. Comments are kept where no more than single values change. The
    names of files in `data`, which is `Study.resolved` with other values, are brought up to date.
    """
    files: dict[str, str] = {}
    for keys, file, content in study.inputs():
        beside = _INPUT + file.name
        while files.get(beside, content) != content:
            beside = "_" + beside
        files[beside] = content
        holder: Any = data
        for key in keys[:-1]:
            holder = holder[key]
        holder[keys[-1]] = beside
    text = _edited(study, data)
    if text is None:
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    return f"# {printable(heading)}\n{text}", files


def _edited(study: Study, data: Mapping[str, Any]) -> str | None:
    """The study's own text with single values changed or left out; None where it would not say the same as `data`."""
    if not study.text or len(study.text) > _MOST_BYTES:
        return None
    if any(override.startswith("units") for override in study.overrides):
        return None
    text, document = study.text.decode("utf-8-sig"), read(study.text, "")
    written = document.data
    wanted = {key: value for key, value in data.items() if key in written}
    # Names of units in full are what the loader makes of the text.
    if "units" in written:
        wanted["units"] = written["units"]
    edits = []
    for keys, entries in _replaced(written, wanted, ()):
        if not entries:
            edits.append(_removal(text, document, keys))
            continue
        name, value = document.keys[keys], document.values[keys]
        inside_flow = text[document.values[keys[:-1]].start] == "{"
        if "\n" in text[value.start : value.end].rstrip():
            return None
        between = ", " if inside_flow else "\n" + " " * (name.column - 1)
        edits.append((name.start, value.end, between.join(_in_one_line(*entry) for entry in entries.items())))
    now = dict(leaves(written))
    for keys, new in leaves(wanted):
        if keys in now and new != now[keys]:
            edits.append((document.values[keys].start, document.values[keys].end, in_yaml(new)))
    for start, end, replacement in sorted(edits, reverse=True):
        text = text[:start] + replacement + text[end:]
    if "seed" not in written and data["seed"]:
        wanted["seed"] = data["seed"]
        text = f"seed: {data['seed']}\n{text}"
    try:
        return text if read(text.encode(), "").data == wanted else None
    except StudyError:
        return None


def _replaced(old: Any, new: Any, keys: KeyPath) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Keys in whose place several others stand, and those with their values, where mappings differ in just that."""
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return
    gone = [key for key in old if key not in new]
    if len(gone) == 1:
        yield (*keys, gone[0]), {key: value for key, value in new.items() if key not in old}
    for key in old:
        if key in new:
            yield from _replaced(old[key], new[key], (*keys, key))


def _removal(text: str, document: Document, keys: KeyPath) -> tuple[int, int, str]:
    """The edit that takes a key away: with its lines, or with the comma beside it."""
    start, inside = (
        document.keys[keys].start,
        (mark for path, mark in document.values.items() if path[: len(keys)] == keys),
    )
    # A mapping in lines of its own ends where the next key begins; its last value ends before.
    end = max(mark.start + len(text[mark.start : mark.end].rstrip()) for mark in inside
              if "\n" not in text[mark.start : mark.end].rstrip() or text[mark.start] in "{[")  # fmt: skip
    if text[document.values[keys[:-1]].start] != "{":
        return text.rfind("\n", 0, start) + 1, (text.find("\n", end) + 1) or len(text), ""
    before = text[:start].rstrip()
    if before.endswith(","):
        return len(before) - 1, end, ""
    return start, end + len(text[end:]) - len(text[end:].lstrip(", ")), ""


def _in_one_line(key: str, value: Any) -> str:
    written = yaml.safe_dump({key: value}, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6)
    return written.strip()[1:-1]
