"""The whole study file: its sections, its JSON Schema, and overrides of its entries (``--set a.b.c=value``)."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Annotated, Any

from pydantic import BeforeValidator, create_model
from pydantic.fields import FieldInfo

from mechdesign.commands import SECTIONS
from mechdesign.ground.cautions import ALL, KINDS
from mechdesign.ground.errors import StudyError, cut, suggestion
from mechdesign.study.building.section import MechanismSection, UnitsSection
from mechdesign.study.schema.conditions import Requirement
from mechdesign.study.text import fields
from mechdesign.study.text.document import LIST_FORM, Document, KeyPath, TextPlace, dotted, has, read, value_at
from mechdesign.study.text.forms import Generator, name_forms
from mechdesign.study.text.reporter import schema_fields

_Warning = Annotated[str, fields.choice({**KINDS, ALL: "every kind"}, "kind of warning")]


class StudyFile(fields.Model):
    """A design study: a mechanism, and the questions asked of it."""

    name: str | None = None
    """Name in titles and of the folder of results. Left out: the file's name. Example: Offset slider-crank"""
    units: UnitsSection = UnitsSection()
    seed: Annotated[int, fields.whole(0)] = 0
    """Seed of the random numbers; ``--seed`` goes before. Example: 1"""
    mechanism: MechanismSection


class _Gate(StudyFile):
    requirements: tuple[Requirement, ...] = ()
    """The gate: results that must keep bounds, or the exit code is 1. The worst row of each counts, along a motion the
    worst place between the rows, too. Example: [{result: kinematics.mu, abs: true, at_least: 40}, {result:
    reliability.reliability, where: {method: monte_carlo}, at_least: 0.99}]
    """
    fail_on: Annotated[tuple[_Warning, ...], BeforeValidator(fields.as_list), fields.OrShort()] = ()
    """Kinds of warnings that a result may not have, or the exit code is 1; one alone needs no list. ``--strict`` is
    all. Example: [unassembled, disagree]
    """


def model_of(keys: Collection[object]) -> type[StudyFile]:
    """The model of a study with the sections among some keys; others are not imported."""
    return _model_of(tuple(key for key in SECTIONS if key in keys))


@cache
def _model_of(sections: tuple[str, ...]) -> type[StudyFile]:
    keys: dict[str, Any] = {key: (annotation_of(key), None) for key in sections}
    questions = create_model(StudyFile.__name__, __base__=StudyFile, **keys)
    return create_model(StudyFile.__name__, __base__=(_Gate, questions), __doc__=StudyFile.__doc__)


def annotation_of(key: str) -> Any:
    """What a top-level key of a study takes."""
    return SECTIONS[key].model | None if key in SECTIONS else _Gate.model_fields[key].rebuild_annotation()


def keys_at(path: Sequence[str | int]) -> Mapping[str, FieldInfo | None]:
    """The keys that the format has at a path of a study, with their fields below the top level."""
    if not path:
        return dict.fromkeys((*StudyFile.model_fields, *SECTIONS, *_Gate.model_fields))
    return schema_fields(model_of(path[:1]), path)


def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a study file, with which editors complete and check."""
    form = model_of(SECTIONS).model_json_schema(by_alias=True, schema_generator=Generator, mode="validation")
    name_forms(form)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "mechdesign study"}
    return head | {key: value for key, value in form.items() if key not in head}


# Longest dotted name of an override, in characters.
MAX_NAME = 1000
_INDEX = re.compile(r"[0-9]{1,9}")


def override(document: Document, overrides: Sequence[str]) -> None:
    """Apply overrides ``a.b.c=value`` to a document in their order.

    Raises
    ------
    StudyError
        Where one cannot be read or has no place to go.
    """
    for text in overrides:
        label = f"--set {cut(text)}"
        try:
            _apply(document, text, label)
        except StudyError as error:
            raise StudyError([replace(problem, file=label) for problem in error.problems]) from None


def _apply(document: Document, text: str, label: str) -> None:
    name, separator, value = text.partition("=")
    segments = name.strip().split(".")
    if not separator or not all(segments):
        raise StudyError("an override is <dotted name>=<value>, in quotes where it has spaces or brackets")
    if len(name) > MAX_NAME:
        raise StudyError(f"a name longer than {MAX_NAME} characters; a whole section can be one value")
    # Bytes that the terminal could not decode are reported as not UTF-8, as they would be in a file.
    parsed = read(value.encode(errors="surrogateescape"), label) if value.strip() else Document(label, None)
    if parsed.problems:
        raise StudyError(parsed.problems)
    if not isinstance(document.data, dict):
        return
    holder, path = _descend(document, segments, label, making=parsed.data is not None)
    key: Any = path[-1]
    there = has(holder, key)
    if isinstance(holder, dict) and parsed.data is None:
        # An empty value removes the entry: `--set kinematics.sweep=` makes room for other poses.
        if not there and key not in keys_at(path[:-1]):
            raise StudyError(f"there is no {dotted(path)} to take away{suggestion(key, holder)}")
        holder.pop(key, None)
    elif isinstance(holder, list) and not there:
        holder.append(parsed.data)
    else:
        holder[key] = parsed.data
    mark = TextPlace(label)
    for marks in (document.keys, document.values):
        for old in [place for place in marks if place[: len(path)] == path]:
            del marks[old]
    document.keys[path] = document.values[path] = mark
    document.spoiled = {place for place in document.spoiled if place[: len(path)] != path}
    if not there:
        document.added.add(path)


def _descend(document: Document, segments: list[str], label: str, *, making: bool) -> tuple[Any, KeyPath]:
    """The mapping or list that holds an entry, and the entry's path; `making` adds missing mappings on the way."""
    data: Any = document.data
    path: list[str | int] = []
    rest = list(segments)
    while True:
        segment, rest = _next_key(data, path, rest)
        path.append(segment)
        key: Any = segment
        if not rest:
            return data, tuple(path)
        inner = data[key] if has(data, key) else None
        if inner is None:
            inner = {}
            if making:
                data[key] = inner
                document.keys.setdefault(tuple(path), TextPlace(label))
                document.values[tuple(path)] = TextPlace(label)
                document.added.add(tuple(path))
        if not isinstance(inner, dict | list):
            raise StudyError(f"{dotted(path)} is neither a mapping nor a list")
        data = inner


def _next_key(data: Any, path: list[str | int], rest: list[str]) -> tuple[str | int, list[str]]:
    if isinstance(data, list):
        index = LIST_FORM.get(rest[0], int(rest[0]) if _INDEX.fullmatch(rest[0]) else -1)
        if not 0 <= index <= len(data) or (index == len(data) and len(rest) > 1):
            raise StudyError(f"{dotted(path)} is a list of {len(data)}; it has no {rest[0]!r}, and the first is 0")
        return index, rest[1:]
    # The longest existing key wins.
    for length in range(len(rest), 0, -1):
        key = ".".join(rest[:length])
        if key in data:
            return key, rest[length:]
    # A new key that contains dots ends where the schema knows what follows.
    for length in range(1, len(rest)):
        key = ".".join(rest[:length])
        if rest[length] in keys_at([*path, key]):
            return key, rest[length:]
    if keys_at(path):
        return rest[0], rest[1:]
    if len(rest) > 1 and _INDEX.fullmatch(rest[-1]):
        place, hint = dotted([*path, *rest[:-1]]), suggestion(rest[0], data)
        raise StudyError(f"there is no {place} to have a {rest[-1]!r}{hint}")
    return ".".join(rest), []


def entry(data: Any, name: str) -> KeyPath:
    """The path of an entry that a study has, or leaves to its default, by the dotted name that ``--set`` takes.

    Raises
    ------
    StudyError
        If it has none: a name there would be a new one.
    """
    segments = name.split(".")
    if not all(segments) or len(name) > MAX_NAME:
        raise StudyError("is no dotted name of an entry, such as mechanism.parameters.r")
    _, path = _descend(Document("", data), segments, "", making=False)
    here = data
    for k, key in enumerate(path):
        keys = keys_at(path[:k])
        if not has(here, key) and key not in keys:
            names = [*keys, *(here if isinstance(here, dict) else ())]
            hint = suggestion(str(key), names) or "; give it a value there first"
            parameter: KeyPath = ("mechanism", "parameters", name)
            if value_at(data, parameter) is not None:
                hint = f"; did you mean {dotted(parameter)!r}?"
            raise StudyError(f"the study has no {dotted(path[: k + 1])}{hint}")
        here = (here[key] if has(here, key) else None) or {}
    return path


def kinds_of(keys: KeyPath) -> set[str]:
    """Kinds (of `units.KINDS`) of the number at a path, if the format determines them."""
    field = keys_at(keys[:-1]).get(str(keys[-1]))
    return {read.kind for read in fields.reads(field.annotation, field.metadata) if read.kind} if field else set()
