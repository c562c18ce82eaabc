"""A study with other numbers, as if its file had been changed, and the text of that file.

It is not read again: numbers that follow parameters are evaluated anew. Only dimensions measured from the sketch, and
tolerances that go by the size of a dimension, are found anew from the data.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import yaml
from pydantic import ValidationError

from mechdesign.ground.errors import StudyError, printable
from mechdesign.ground.files import portable
from mechdesign.mechanism.elements.joints import Fixed
from mechdesign.mechanism.graph import GROUND
from mechdesign.study.building.notations import LINK_KEYS
from mechdesign.study.loaded import Study
from mechdesign.study.loading import adapter, context_of, load_document, same_sketch
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.schema.entries import number_at
from mechdesign.study.schema.study_file import entry, kinds_of, override
from mechdesign.study.text.document import Document, KeyPath, decoded, dotted, in_yaml, leaves, plain, read
from mechdesign.study.text.reporter import Reporter

Changes = Sequence[tuple[str, Any]]
"""Entries of a study, by the names that ``--set`` takes, and their values."""
# Sections that ask for variants of the study.
_OF_OTHERS = ("matrix", "sensitivities")
# Keys of a study by which answers are judged, and nothing is computed.
JUDGED = ("requirements", "fail_on")
# Largest text that is edited, in bytes; a longer one is written anew, without comments.
_MOST_BYTES = 1_000_000
_INPUT = "input_"


class Judging(NamedTuple):
    """What is required of a case, and the kinds of warnings that it may not have."""

    requirements: tuple[Requirement, ...]
    fail_on: tuple[str, ...]

    @classmethod
    def of(cls, study: Study) -> Judging:
        """What a study requires."""
        return cls(study.requirements, study.fail_on)


def overrides(changes: Changes) -> tuple[str, ...]:
    """Changes as ``a.b.c=value``."""
    return tuple(f"{name}={in_yaml(value)}" for name, value in changes)


def with_entries(
    study: Study,
    changes: Changes,
    parameters: Mapping[str, Any] | None = None,
    *,
    without: Collection[str] = _OF_OTHERS,
) -> Study:
    """The study with changed entries, and perhaps more parameters, `without` sections that make other studies of it.

    Where only numbers of the mechanism are otherwise its assembly is that of the study's sketch, unless the sketch is
    changed itself.

    Raises
    ------
    StudyError
        If the entries make no study; every mistake in one go.
    """
    data = plain({key: value for key, value in study.resolved.items() if key not in without})
    texts = overrides(changes)
    document = Document.of(data)
    override(document, texts)
    if parameters:
        data.setdefault("mechanism", {}).setdefault("parameters", {}).update(parameters)
    original = study.mechanism if same_sketch(data, study.resolved) else None
    return load_document(document, study.source, (*study.overrides, *texts), original=original)


def is_judged(name: str) -> bool:
    """Whether an entry is one by which answers are judged."""
    return name.partition(".")[0] in JUDGED


def split(changes: Changes) -> tuple[list[tuple[str, Any]], list[tuple[str, Any]]]:
    """Changes of what is computed, and of what is judged alone."""
    sides: tuple[list[tuple[str, Any]], list[tuple[str, Any]]] = ([], [])
    for change in changes:
        sides[is_judged(change[0])].append(change)
    return sides


def judging(study: Study, changes: Changes) -> Judging | None:
    """What a study requires with changes of that alone; None where they are wrong, as loading the whole study says."""
    if not changes:
        return Judging.of(study)
    document = Document.of(plain({key: study.resolved[key] for key in JUDGED if key in study.resolved}))
    context = context_of(study.resolved, Reporter(document))[0]
    try:
        override(document, overrides(changes))
        parts = [adapter(key).validate_python(document.data.get(key) or [], context=context) for key in JUDGED]
    except (StudyError, ValidationError):
        return None
    return Judging(*parts)


def faults(study: Study, changes: Changes, name: str) -> Iterator[str]:
    """Mistakes in an entry of the study with some changes.

    Mistakes elsewhere in the study are left out: other changes may correct them.
    """
    place = dotted(entry(study.resolved, name))
    try:
        with_entries(study, changes)
    except StudyError as error:
        yield from (problem.message for problem in error.problems if f"{problem.key}.".startswith(f"{place}."))


def entry_unit(study: Study, name: str) -> str:
    """Unit of an entry; empty if neither the study nor its format determines it."""
    keys = entry(study.resolved, name)
    for k in range(len(keys), 0, -1):
        if keys[:k] in study.kinds:
            return study.units.label(study.kinds[keys[:k]])
    # The keys of a short form lie below it.
    kinds = kinds_of(keys) | {kind for path, kind in study.kinds.items() if path[:-1] == keys}
    if len(kinds) == 1:
        return study.units.label(*kinds)
    if keys[:2] == ("reliability", "dimensions"):
        return study.unit_of(str(keys[2])) or ""
    return study.unit_of(number_at(keys, study.parameters.nominal, study.mechanism.description.places)) or ""


def remeasured(study: Study, names: Collection[str]) -> bool:
    """Whether dimensions measured in the sketch depend on these parameters or places."""
    parameters = study.parameters
    if not parameters.measured:
        return False
    drawn_anew = not parameters.sketched.isdisjoint(parameters.moved(names))
    return drawn_anew or not _drawing(study).isdisjoint(parameters.moved_places(names))


def _drawing(study: Study) -> set[str]:
    """Places on which measured dimensions depend: of links measured in the sketch, and of a phase ratio and guides."""
    links, joints = study.mechanism.description.links, study.mechanism.description.joints
    couplings = {coupling.name: coupling.gap for coupling in study.mechanism.couplings}
    owners: set[str] = set()
    numbers: set[str] = set()
    for place in study.parameters.measured:
        owner, _, _ = place.rpartition(".")
        joint = joints.get(owner)
        if owner in couplings:
            numbers.add(f"{owner}.ratio")
            for part in couplings[owner].parts:
                name = study.mechanism.graph.slides[part.slide] if part.slide >= 0 else part.body
                numbers.add(f"{name}.direction")
                owners.update(joints[name].links if name in joints else {name} & links.keys())
        else:
            owners.update(joint.links if isinstance(joint, Fixed) else (place.partition(".")[0],))
    points = {point for name in owners for point in (*links[name].points, *(links[name].ends or ()))}
    lengths = {f"{name}.length" for name in owners if len(links[name].points) > 2}
    # The numbers of the ground place its points in the sketch.
    placed = [(name, point) for name in owners for point in links[name].points]
    placed += [(GROUND, point) for point in links[GROUND].points if point in points]
    return lengths | numbers | {f"{name}.{point}.{axis}" for name, point in placed for axis in "xy"}


def changed_data(study: Study, changed: Mapping[str, float]) -> dict[str, Any]:
    """The study as plain data with other values."""
    data: dict[str, Any] = plain(study.resolved)
    mechanism = data["mechanism"]
    for name, value in changed.items():
        if name in study.parameters.nominal:
            mechanism["parameters"][name] = float(value)
            continue
        kind, *path = study.mechanism.description.places[name].path
        holder: Any = mechanism[kind]
        if path[1:2] == ["points"]:
            holder, path = _points(study, holder, str(path[0])), path[2:]
        elif isinstance(holder[path[0]], list):
            holder[path[0]][2:] = [float(value)]
            continue
        for part in path[:-1]:
            holder = holder[part]
        holder[path[-1]] = float(value)
    return data


def _points(study: Study, links: dict[str, Any], name: str) -> dict[str, list[Any]]:
    """The points of a link in its data, brought to the form ``{P: [x, y]}``; those measured become numbers."""
    described, numbers = study.mechanism.description.links[name], study.mechanism.nominal
    raw = dict(zip(LINK_KEYS, links[name], strict=False)) if isinstance(links[name], list) else dict(links[name])
    given = raw.get("points") if any(key in raw for key in LINK_KEYS) else raw
    written = given if isinstance(given, dict) else {}
    points = {
        point: written.get(point) or [numbers[term] if isinstance(term, str) else term for term in terms]
        for point, terms in described.points.items()
        if point not in (described.ends or ())
    }
    # The ends of the ground may be among its points.
    other = {key: raw[key] for key in raw if key in LINK_KEYS and given is not raw}
    if described.ends is None:
        other = {key: value for key, value in other.items() if key not in ("from", "to")}
    links[name] = {**other, "points": points} if other.keys() - {"points"} else points
    return points


def rewritten(study: Study, data: dict[str, Any], heading: str) -> tuple[str, dict[str, str]]:
    """The text of a study with other values under a heading comment, and the texts of the files that it reads.

    Overrides are part of the new text, as is the seed. Comments are kept where no more than single values change. The
    names of files in `data`, which is `Study.resolved` with other values, are brought up to date.
    """
    files: dict[str, str] = {}
    for keys, file, content in study.inputs():
        beside = portable(_INPUT + file.name)
        while files.get(beside, content) != content:
            beside = "_" + beside
        files[beside] = content
        holder: Any = data
        for key in keys[:-1]:
            holder = holder[key]
        holder[keys[-1]] = beside
    return f"# {printable(heading)}\n{in_text(study, data)}", files


def in_text(study: Study, data: Mapping[str, Any]) -> str:
    """The text of a study with the values of `data`; comments are kept where no more than single values change."""
    text = edited(study, data)
    if text is None:
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)
    return text


def edited(study: Study, data: Mapping[str, Any]) -> str | None:
    """The study's own text with single values changed or left out; None where it would not say the same as `data`."""
    if not study.text or len(study.text) > _MOST_BYTES:
        return None
    if any(override.startswith("units") for override in study.overrides):
        return None
    text, document = decoded(study.text), read(study.text, "")
    ending = "\r\n" if "\r\n" in text else "\n"
    written = document.data
    target = {key: value for key, value in data.items() if key in written or key not in study.resolved}
    # The loader fills in all units; the text may name only some.
    if "units" in written:
        target["units"] = written["units"]
    edits = []
    for keys, entries in _replaced(written, target, ()):
        if not entries:
            edits.append(_removal(text, document, keys))
            continue
        name, value = document.keys[keys], document.values[keys]
        inside_flow = text[document.values[keys[:-1]].start] == "{"
        if "\n" in text[value.start : value.end].rstrip():
            return None
        between = ", " if inside_flow else "\n" + " " * (name.column - 1)
        edits.append((name.start, value.end, between.join(in_one_line(*entry) for entry in entries.items())))
    edits += _additions(text, document, written, target)
    now = dict(leaves(written))
    for keys, new in leaves(target):
        if keys in now and new != now[keys]:
            edits.append((document.values[keys].start, document.values[keys].end, in_yaml(new)))
    for start, end, replacement in sorted(edits, reverse=True):
        text = text[:start] + replacement + text[end:]
    if "seed" not in written and data["seed"]:
        target["seed"] = data["seed"]
        text = f"seed: {data['seed']}\n{text}"
    text = text.replace("\r\n", "\n").replace("\n", ending)
    try:
        return text if read(text.encode(), "").data == target else None
    except StudyError:
        return None


def _replaced(old: Any, new: Any, keys: KeyPath) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Keys that are missing in the new data, each with the entries that replace it."""
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return
    gone = [key for key in old if key not in new]
    if len(gone) == 1:
        yield (*keys, gone[0]), {key: value for key, value in new.items() if key not in old}
    for key in old:
        if key in new:
            yield from _replaced(old[key], new[key], (*keys, key))


def _additions(text: str, document: Document, old: Any, new: Any, keys: KeyPath = ()) -> Iterator[tuple[int, int, str]]:
    """The edits that add keys, where none is missing, and entries at the end of lists, each in lines of its own."""
    entries: list[Any] = []
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        more = {key: value for key, value in new.items() if key not in old} if old.keys() <= new.keys() else {}
        entries = [{key: value} for key, value in more.items()]
        for key in old.keys() & new.keys():
            yield from _additions(text, document, old[key], new[key], (*keys, key))
    elif isinstance(old, list) and isinstance(new, list):
        entries = [[value] for value in new[len(old) :]]
        for k, (one, other) in enumerate(zip(old, new, strict=False)):
            yield from _additions(text, document, one, other, (*keys, k))
    else:
        return
    if not entries or not old:
        return
    first = (*keys, next(iter(old)) if isinstance(old, Mapping) else 0)
    if keys and text[document.values[keys].start] in "{[":
        end = document.values[keys].start + len(text[document.values[keys].start : document.values[keys].end].rstrip())
        words = [yaml.safe_dump(one, default_flow_style=True, width=10**6).strip()[1:-1] for one in entries]
        yield end - 1, end - 1, "".join(f", {word}" for word in words)
        return
    begin = document.values[first].start if isinstance(old, list) else document.keys[first].start
    indent = begin - (text.rfind("\n", 0, begin) + 1) - 2 * isinstance(old, list)
    at = text.find("\n", _last(text, document, keys))
    lines = "".join(yaml.safe_dump(one, sort_keys=False, default_flow_style=None, width=100) for one in entries)
    at = len(text.rstrip("\n")) if at < 0 or not keys else at
    yield at, at, "".join(f"\n{' ' * indent}{line}" for line in lines.splitlines())


def _last(text: str, document: Document, keys: KeyPath) -> int:
    """Where the last value below a key ends."""
    # A mapping in lines of its own ends where the next key begins; its last value ends before.
    inside = (mark for path, mark in document.values.items() if path[: len(keys)] == keys)
    return max(mark.start + len(text[mark.start : mark.end].rstrip()) for mark in inside
               if "\n" not in text[mark.start : mark.end].rstrip() or text[mark.start] in "{[")  # fmt: skip


def _removal(text: str, document: Document, keys: KeyPath) -> tuple[int, int, str]:
    """The edit that removes a key, with its lines or with the comma beside it."""
    start, end = document.keys[keys].start, _last(text, document, keys)
    if text[document.values[keys[:-1]].start] != "{":
        return text.rfind("\n", 0, start) + 1, (text.find("\n", end) + 1) or len(text), ""
    before = text[:start].rstrip()
    if before.endswith(","):
        return len(before) - 1, end, ""
    return start, end + len(text[end:]) - len(text[end:].lstrip(", ")), ""


def in_one_line(key: str, value: Any) -> str:
    """An entry of a mapping as YAML in one line."""
    entry = {key: value}
    # The quicker of the two, where there is one, escapes what lies beyond the first 65,536 letters.
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper) if str(entry).isascii() else yaml.SafeDumper
    written: str = yaml.dump(
        entry, Dumper=dumper, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**6
    )
    return written.strip()[1:-1]
