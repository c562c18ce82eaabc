"""What a study may say of an element, from what the element declares: the models of its keys."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from functools import cache
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, TypeVar, get_args, get_origin, get_type_hints

from pydantic import Field, create_model, model_validator

from mechdesign.mechanism.elements.declared import Choice, Element, Notation, Size, Two, Whole
from mechdesign.mechanism.elements.links import Link
from mechdesign.study.building import notations
from mechdesign.study.text import fields
from mechdesign.study.text.units import Amount

E = TypeVar("E", bound=Element)


class Keys(fields.Model):
    """Base of the derived models: what a study says of an element; what it leaves out is None."""

    declares: ClassVar[type[Element]]
    sizes: ClassVar[Mapping[str, Size]]
    items = Element.items

    def faults(self) -> Iterator[str]:
        return self.declares.faults(self)

    def numbers(self) -> Iterator[tuple[str, Size, Amount]]:
        """The numbers of the geometry that are given, with their keys."""
        for key, size in self.sizes.items():
            if (value := getattr(self, key)) is not None:
                yield key, size, value


class _LinkKeys(Keys):
    """Base of a link's keys, which have short forms."""

    short = notations.LINK_SHORT

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return notations.long_link(raw)


class Written(Keys, Generic[E]):
    """The keys of an element, as ``Written[Spring]``."""

    if TYPE_CHECKING:

        def __getattr__(self, key: str) -> Any: ...

    else:

        def __class_getitem__(cls, element):
            return _keys_of(element)


@cache
def _keys_of(element: Any) -> type[Keys]:
    """The model of an element's keys, whose description is the docstring of each field."""
    keys: dict[str, Any] = {}
    sizes: dict[str, Size] = {}
    hints = get_type_hints(element, include_extras=True)
    for field in dataclasses.fields(element):
        name, marks = field.name, [*_marks(hints[field.name])]
        if not marks:
            continue
        default: Any = ...
        annotation = _read(hints[name])
        if field.default_factory is not dataclasses.MISSING:
            keys[name] = annotation, Field(default_factory=field.default_factory)
            continue
        if field.default is not dataclasses.MISSING:
            default = field.default if isinstance(field.default, bool | int | str) else None
            annotation = annotation | None if default is None else annotation
        if isinstance(marks[0], Size) and not marks[0].fixed:
            sizes[name] = marks[0]
        alias = name.removesuffix("_")
        keys[name] = annotation, Field(default, alias=None if alias == name else alias)
    base = _LinkKeys if element is Link else Keys
    named: dict[str, Any] = {"__module__": element.__module__, "__doc__": element.__doc__}
    model = create_model(element.__name__, __base__=base, **named, **keys)
    model.declares, model.one_of, model.bare, model.sizes = element, element.one_of, element.bare, sizes
    if element.bare:
        model.short = ({**fields.NAME_FORM, "title": element.bare},)
    return model


def _marks(hint: Any) -> Iterator[Any]:
    """The marks in an annotation, from the outside in."""
    yield from getattr(hint, "__metadata__", ())
    for part in get_args(hint):
        yield from _marks(part)


def _read(hint: Any) -> Any:
    """The annotation with which pydantic reads what is annotated by marks."""
    if NoneType in get_args(hint):
        return _read(get_args(hint)[0])
    if get_origin(hint) is tuple:
        return tuple[tuple(_read(part) for part in get_args(hint))]  # type: ignore[misc]
    mark = next(_marks(hint), None)
    match mark:
        case Notation("part"):
            return _keys_of(get_args(hint)[0])
        case Notation():
            return notations.BY_WORD.get(mark.word) or getattr(fields, mark.word)
        case Size():
            kind = None if mark.between else mark.kind
            number = fields.number(kind, mark.least, exclusive=mark.exclusive, place=not mark.fixed, fixed=mark.fixed)
            return Annotated[float if mark.fixed else Amount, number]
        case Choice():
            return Annotated[str, fields.choice(mark.words, mark.title)]
        case Whole():
            return Annotated[int, fields.whole(mark.least, mark.most)]
        case Two():
            return Annotated[_read(get_args(hint)[0]), fields.pair_of(mark.text)]
    return hint
