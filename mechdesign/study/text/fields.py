"""Values of the study file as its models read them: numbers, names, words, lists; and the base of the models.

Each type is a pydantic annotation: what reads it (see `reading`) raises with a message for a designer; its JSON Schema
says what an editor should accept.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, get_args

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from mechdesign.ground.docstrings import KeyText, key_texts, quoted
from mechdesign.ground.errors import suggestion
from mechdesign.ground.expressions import Expression
from mechdesign.study.text.document import read
from mechdesign.study.text.reading import MIN_LENGTH, MIN_NUMBER, Context, failure, read_expression, read_number, shown
from mechdesign.study.text.units import Amount, QuantityError, measure, written

Form = dict[str, Any]
"""JSON Schema of a part of the study; a title says in words what is accepted."""
NAME_FORM: Form = {"type": "string", "title": "name"}
NAMES_FORM: Form = {"type": "array", "items": NAME_FORM}
NUMBER_FORM: Form = {"type": ["number", "string"], "title": "number"}
PAIR_FORM: Form = {"type": "array", "items": NUMBER_FORM, "minItems": 2, "maxItems": 2}

NAME = re.compile(r"[^\W\d]\w*")
COORDINATE = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
_END = re.compile(r"[^\W\d]\w*(?:\.[^\W\d]\w*)?")


def as_list(raw: Any) -> list[Any]:
    """A list as it is, a single entry as a list of one, None as an empty list."""
    return raw if isinstance(raw, list) else [] if raw is None else [raw]


def pair_of(description: str) -> BeforeValidator:
    """Annotation of a list of two, which are described for the message."""

    def check(raw: Any) -> Any:
        if not isinstance(raw, list) or len(raw) != 2:
            raise failure(f"expected {description}, not {shown(raw)}")
        return raw

    return BeforeValidator(check)


@dataclass(frozen=True, eq=False)
class Read:
    """Annotation of a value that a function reads, and the JSON Schema of what it accepts.

    Of a number `kind` is that of `units.KINDS`, if it is the same everywhere; of a word out of a list `words` are its
    meanings, and `title` names them all.
    """

    function: Callable[[Any, Context], Any]
    accepted: Form | Callable[[], Form]
    kind: str = ""
    words: Mapping[str, Any] | None = None
    title: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            lambda raw, info: self.function(raw, info.context or Context())
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return self.accepted() if callable(self.accepted) else dict(self.accepted)


def reads(annotation: Any, metadata: Sequence[Any] = ()) -> Iterator[Read]:
    """The `Read` annotations in an annotation, except those inside models."""
    for part in (*metadata, *get_args(annotation)):
        if isinstance(part, Read):
            yield part
        elif get_args(part):
            yield from reads(part)


def number(
    kind: str | None = None, minimum: float | None = None, *, exclusive: bool = False, place: bool = False,
    fixed: bool = False,
) -> Read:  # fmt: skip
    """Annotation of a number: its kind in `units.KINDS`, if that is the same everywhere, and its least value.

    It becomes an `Amount`. What is a `place` of the geometry judges the parameters in it by itself. One that is `fixed`
    is the same for all designs that are answered together.
    """
    smallest = MIN_LENGTH if kind == "length" else MIN_NUMBER

    def read(raw: Any, context: Context) -> Amount:
        size = read_number(raw, context, kind)
        if fixed and size.expression:
            context.fixed.update(size.expression.names)
        if kind and not place and size.expression and size.text:
            # Parameters in a place are checked by the geometry.
            _check_kind(size.text, kind)
        if minimum is not None and 0 < size < smallest:
            raise failure(f"{size:g} is too small a number: none but 0 is below {smallest:g}; choose a smaller unit")
        if minimum is not None and (size < minimum or (exclusive and size == minimum)):
            bound = positive(minimum, exclusive=exclusive)
            raise failure(f"must be {bound}, not {size:g}")
        size.least, size.exclusive = minimum, exclusive
        return size

    return Read(read, NUMBER_FORM, kind or "")


def or_word(size: Read, word: str) -> Read:
    """Annotation of a number, or of a word in its place; a parameter of that name goes before it."""

    def read(raw: Any, context: Context) -> Amount | str:
        return word if raw == word and word not in context.parameters else size.function(raw, context)

    return Read(read, {"anyOf": [NUMBER_FORM, {"const": word}]}, size.kind)


def positive(minimum: float, *, exclusive: bool) -> str:
    """Words for a minimum: ``positive`` or ``at least 2``."""
    return "positive" if minimum == 0 and exclusive else f"at least {minimum:g}"


def _check_kind(text: str, kind: str) -> None:
    try:
        measure(text, kind)
    except QuantityError as error:
        raise failure(str(error)) from None


def whole(minimum: int = 0, maximum: int | None = None) -> Read:
    """Annotation of a whole number not below a minimum (and not above a maximum)."""

    def read(raw: Any, context: Context) -> int:
        if isinstance(raw, int) and not isinstance(raw, bool):
            value = raw
        else:
            size = read_number(raw, context, "none")
            context.fixed.update(size.expression.names if size.expression else ())
            if math.isnan(size):
                return minimum
            if not size.is_integer():
                raise failure(f"expected a whole number, not {size:g}")
            value = int(size)
        if value < minimum:
            raise failure(f"must be at least {minimum}, not {value}")
        if maximum is not None and value > maximum:
            raise failure(f"must be at most {maximum}, not {shown(value)}")
        return value

    form = {"type": ["integer", "number", "string"], "minimum": minimum, "title": "whole number"}
    return Read(read, form, "none")


def name_of(noun: str, pattern: re.Pattern[str] = NAME) -> Read:
    """Annotation of a name; the message calls it by `noun`: "a point"."""

    def read(raw: Any, context: Context) -> str:
        if isinstance(raw, str) and pattern.fullmatch(raw):
            return raw
        rule = "; a name is letters, digits and underscores, with a letter first" if isinstance(raw, str) else ""
        raise failure(f"expected the name of {noun}, not {shown(raw)}{rule}")

    return Read(read, {**NAME_FORM, "title": noun.partition(" ")[2].partition(" (")[0]})


def choice(words: Mapping[str, Any], title: str) -> Read:
    """Annotation of a word out of a list, each with its meaning (or what has one); `title` names them all."""

    def read(raw: Any, context: Context) -> str:
        if isinstance(raw, str) and raw in words:
            return raw
        hint = suggestion(raw, words) if isinstance(raw, str) else ""
        raise failure(f"expected one of {', '.join(words)}, not {shown(raw)}{hint}")

    def form() -> Form:
        return {"title": title, "enum": list(words), "enumDescriptions": [meaning(words[word]) for word in words]}

    return Read(read, form, words=words, title=title)


def meaning(declared: Any) -> str:
    """The meaning of a word that is declared with one."""
    return declared if isinstance(declared, str) else str(declared.meaning)


class OrShort:
    """Annotation that adds to the JSON Schema the short forms that a validator brings to the long one.

    Without any it is one entry instead of a list of one.
    """

    def __init__(self, *forms: Form) -> None:
        self.forms = forms

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        form = handler(schema)
        return {"anyOf": [form, *(self.forms or [form["items"]])]}


class Misfit(NamedTuple):
    """Numbers of a section that contradict each other.

    Parameters
    ----------
    wrong : bool, or bool array, shape (designs,)
        Where they do not.
    text : str
        Why, with ``{}`` for each of the numbers.
    numbers : sequence of float, or of float array, shape (designs,)
    """

    wrong: Any
    text: str
    numbers: Sequence[Any] = ()

    def message(self, design: int = 0) -> str:
        """The text with the numbers of one design."""
        return self.text.format(*(written(number[design] if np.ndim(number) else number) for number in self.numbers))


def parts_of(part: Any, key: str) -> Iterator[tuple[str, Any]]:
    """The sections and numbers in a part of a study, itself among them, with their keys."""
    if isinstance(part, Model | Amount):
        yield key, part
    for name, inner in _inside(part):
        yield from parts_of(inner, f"{key}.{name}")


def own_numbers(part: Any) -> Iterator[Amount]:
    """The numbers of a part of a study that follow parameters, without those of sections inside it."""
    if isinstance(part, Amount) and part.expression is not None:
        yield part
    for _, inner in _inside(part):
        if not isinstance(inner, Model):
            yield from own_numbers(inner)


def _inside(part: Any) -> Iterator[tuple[Any, Any]]:
    """What a part of a study holds, by keys."""
    if isinstance(part, Model):
        for name, field in type(part).model_fields.items():
            yield field.alias or name, getattr(part, name)
    elif isinstance(part, Mapping):
        yield from part.items()
    elif isinstance(part, tuple):
        yield from enumerate(part)


def _with_numbers(part: Any, value: Callable[[Amount], Any]) -> Any:
    """A part of a study with other numbers where they follow parameters; the part itself where none does."""
    if isinstance(part, Amount):
        return part if part.expression is None else value(part)
    if isinstance(part, Model):
        return part.with_numbers(value)
    if isinstance(part, dict):
        changed = {name: new for name, old in part.items() if (new := _with_numbers(old, value)) is not old}
        return {**part, **changed} if changed else part
    if isinstance(part, tuple):
        new = [_with_numbers(old, value) for old in part]
        if all(one is other for one, other in zip(new, part, strict=True)):
            return part
        return type(part)(*new) if hasattr(part, "_fields") else tuple(new)
    return part


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys are errors, values come in study units.

    The docstring under an attribute is the description of its key; after it ``Example:`` may stand, also repeatedly.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, defer_build=True)
    bare: ClassVar[str] = ""  # key of a value that may stand alone, in place of the mapping
    short: ClassVar[tuple[Form, ...]] = ()  # JSON Schema of the short forms
    one_of: ClassVar[tuple[str, ...]] = ()  # a message, and keys of which exactly one is given

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return raw if not cls.bare or raw is None or isinstance(raw, dict | Model) else {cls.bare: raw}

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        given = self.given(*self.one_of[1:])
        if self.one_of and len(given) != 1:
            raise failure(self.one_of[0] + (f"; {' and '.join(given)} are given" if given else ""))
        wrong = (misfit.message() for misfit in self.misfits() if misfit.wrong)
        for sentence in chain(wrong, self.faults()):
            raise failure(sentence)
        return self

    def given(self, *keys: str) -> list[str]:
        """Those of the keys that are not None."""
        return [key for key in keys if getattr(self, key) is not None]

    @property
    def kind(self) -> Any:
        """Which of the keys of `one_of` is given."""
        return self.given(*self.one_of[1:])[0]

    def faults(self) -> Iterator[str]:
        """Sentences about keys that do not go together, or are missing."""
        return iter(())

    def misfits(self) -> Iterator[Misfit]:
        """Contradictions between the section's numbers, which are arrays for many designs."""
        return iter(())

    def with_numbers(self, value: Callable[[Amount], Any]) -> Self:
        """The section where the numbers that follow parameters are what `value` makes of them, perhaps arrays."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        changed = {name: new for name, old in given.items() if (new := _with_numbers(old, value)) is not old}
        return self.model_copy(update=changed) if changed else self

    @classmethod
    def said_of_all(cls) -> str:
        """The docstring of the section in one line."""
        return quoted(" ".join((cls.__doc__ or "").split()))

    @classmethod
    def fields_by_key(cls) -> dict[str, FieldInfo]:
        """Fields by their keys in the text."""
        return {field.alias or name: field for name, field in cls.model_fields.items()}

    @classmethod
    def said(cls, key: str) -> KeyText:
        """The docstring of a key; empty if it has none."""
        name = next((name for name, field in cls.model_fields.items() if (field.alias or name) == key), key)
        texts = (key_texts(holder.__module__).get((holder.__name__, name)) for holder in cls.__mro__[:-1])
        return next(filter(None, texts), KeyText(""))

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(schema)
        form = handler.resolve_ref_schema(reference)
        form["description"] = cls.said_of_all()
        for key in cls.fields_by_key():
            text, examples = cls.said(key)
            entries = {"description": text, "examples": [read(example.encode(), key).data for example in examples]}
            form["properties"][key].update({name: value for name, value in entries.items() if value})
        return {"anyOf": [dict(form), *cls.short]} if cls.short else reference


Number = Annotated[float, number()]
Pure = Annotated[float, number("none")]
Positive = Annotated[float, number("none", 0.0, exclusive=True)]
Length = Annotated[float, number("length")]
PositiveLength = Annotated[float, number("length", 0.0, exclusive=True)]
NonNegativeLength = Annotated[float, number("length", 0.0)]
NonNegative = Annotated[float, number(None, 0.0)]
PositiveNumber = Annotated[float, number(None, 0.0, exclusive=True)]
Angle = Annotated[float, number("angle")]
NonNegativeAngle = Annotated[float, number("angle", 0.0)]
Acceleration = Annotated[float, number("acceleration")]
PositiveStress = Annotated[float, number("stress", 0.0, exclusive=True)]
PositiveDensity = Annotated[float, number("density", 0.0, exclusive=True)]
PositiveArea = Annotated[float, number("area", 0.0, exclusive=True)]
PositiveInertia = Annotated[float, number("inertia", 0.0, exclusive=True)]

# Numbers of the geometry.
LengthPlace = Annotated[Amount, number("length", place=True)]
PositiveLengthPlace = Annotated[Amount, number("length", 0.0, exclusive=True, place=True)]
BarInertiaPlace = Annotated[Amount | Literal["rod"], or_word(number("moment_of_inertia", 0.0, place=True), "rod")]
AnyPlace = Annotated[Amount, number(place=True)]
Bound = Annotated[Expression, Read(read_expression, NUMBER_FORM)]

LinkName = Annotated[str, name_of("a link")]
PointName = Annotated[str, name_of("a point")]
EndName = Annotated[str, name_of("a point (such as B, or rod.B of link rod)", _END)]
JointName = Annotated[str, name_of("a joint")]
SpringName = Annotated[str, name_of("a spring")]
CouplingName = Annotated[str, name_of("a coupling")]
DriveName = Annotated[str, name_of("a drive")]
MeasureName = Annotated[str, name_of("a measure")]
BearingName = Annotated[str, name_of("a point, joint or leg")]
CoordinateName = Annotated[str, name_of("a coordinate (such as C.x or rod.angle)", COORDINATE)]
CoordinateNames = Annotated[tuple[CoordinateName, ...], BeforeValidator(as_list), OrShort()]
Numbers = Annotated[tuple[Number, ...], BeforeValidator(as_list), OrShort()]
