"""Keys of the study format, from its models."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from typing import Any, NamedTuple, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from mechdesign.commands import SECTIONS
from mechdesign.door.reference.entries import Entry
from mechdesign.ground.indices import INDEX_NAMES
from mechdesign.study import Units
from mechdesign.study.schema.study_file import model_of, schema
from mechdesign.study.text import fields
from mechdesign.study.text.document import value_at
from mechdesign.study.text.fields import Model, Read, meaning
from mechdesign.study.text.forms import properties

KIND = "key"


class Key(NamedTuple):
    """A key at its path."""

    path: str
    model: type[Model]
    name: str
    field: FieldInfo


@cache
def keys() -> tuple[Key, ...]:
    """Every key of the study format, a section's keys after it."""
    return tuple(_walk(model_of(SECTIONS), ""))


def _walk(model: type[Model], prefix: str) -> Iterator[Key]:
    for name, field in model.fields_by_key().items():
        yield Key(prefix + name, model, name, field)
        for inner, stars in _models(field.annotation):
            yield from _walk(inner, f"{prefix}{name}{stars}.")


def _models(annotation: Any) -> Iterator[tuple[type[Model], str]]:
    """Models in an annotation, each with a ``.*`` for every mapping of names or list around it."""
    if isinstance(annotation, type) and issubclass(annotation, Model):
        yield annotation, ""
    star = ".*" if get_origin(annotation) in (dict, tuple) else ""
    for part in get_args(annotation):
        for model, stars in _models(part):
            yield model, star + stars


def continued(start: str, data: Any) -> list[str]:
    """The paths by which the start of one may go on, to its next key: those of the format, and of a study's data."""
    *above, last = start.split(".")
    paths = [key.path.split(".") for key in keys()]

    def below(above: Sequence[str]) -> list[str]:
        own = value_at(data, tuple(int(name) if name.isdecimal() else name for name in above))
        inner = [path[len(above)] for path in paths
                 if len(path) > len(above) and all(map(fnmatchcase, above, path))]  # fmt: skip
        names = [*own] if isinstance(own, Mapping) else range(len(own)) if isinstance(own, list) else ()
        return [*dict.fromkeys(map(str, (*names, *(name for name in inner if name != "*"))))]

    names = [name for name in below(above) if name.startswith(last)]
    found = [".".join((*above, name)) for name in names]
    # A shell goes on behind a word that others begin with.
    return found if len(names) != 1 else found + [f"{found[0]}.{name}" for name in below((*above, *names))]


def entries() -> Iterator[Entry]:
    """An entry for each key, and one for each word of a key's list of choices."""
    forms = schema()
    chosen: dict[tuple[str, str], Entry] = {}
    for key in keys():
        said = key.model.said(key.name)
        inner = list(_models(key.field.annotation))
        model = forms if key.model is model_of(SECTIONS) else forms["$defs"][key.model.__name__]
        reads = list(fields.reads(key.field.annotation, key.field.metadata))
        words = _words(reads)
        about = " Or: ".join(dict.fromkeys(model.said_of_all() for model, _ in inner))
        # Local indices have entries of their own: `mechdesign.door.reference.sources.indices`.
        for read in reads:
            for word, declared in (read.words or {}).items() if read.words is not INDEX_NAMES else ():
                before = chosen[read.title, word].where if (read.title, word) in chosen else ()
                text = getattr(declared, "detail", "") or meaning(declared)
                chosen[read.title, word] = Entry(word, read.title, text, where=(*before, key.path.replace(".*", "")))
        yield Entry(
            word=key.path,
            kind=KIND,
            text=said.text or about,
            takes=properties(model)[key.name]["title"],
            mapping=about if said.text else "",
            unit=_unit(reads),
            default=_default(key.field),
            examples=said.examples,
            words=tuple(dict.fromkeys((word, text) for _, word, text in (*words, *_within(inner)))),
        )
    yield from chosen.values()


def _words(reads: Iterable[Read]) -> list[tuple[str, str, str]]:
    """The choices of values: what they are, the word and its meaning."""
    return [(read.title, word, meaning(declared)) for read in reads for word, declared in (read.words or {}).items()]


def _within(models: Iterable[tuple[type[Model], str]]) -> Iterator[tuple[str, str, str]]:
    """Words that may stand in place of a section's mapping."""
    for model, stars in models:
        for field in model.model_fields.values() if model.short and not stars else ():
            yield from _words(fields.reads(field.annotation, field.metadata))


def _unit(reads: Sequence[Read]) -> str:
    kinds = {read.kind for read in reads if read.kind}
    if len(kinds) != 1 or kinds == {"none"}:
        return ""
    kind = kinds.pop()
    return f"{kind.replace('_', ' ')} ({Units().label(kind)} where the study says no units)"


def _default(field: FieldInfo) -> str:
    """The default of a key, as a study writes it."""
    value = field.get_default(call_default_factory=True, validated_data={})
    if value is PydanticUndefined:
        return "never; it is required"
    if value is None or value in ((), {}) or isinstance(value, Model):
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)


def place(path: str) -> str:
    """The key of the format at a path of a study, without ``*``; else the nearest key above it."""
    patterns = {key.path: key.path.replace(".*", "") for key in keys()}
    while path:
        for pattern, plain in patterns.items():
            if fnmatchcase(path, pattern):
                return plain
        path = path.rpartition(".")[0]
    return ""
