"""Values of the study file as its models read them: numbers, names, words, lists; and the base of the models.

A number is plain, with a unit, or an expression over the study's parameters. Each type is a pydantic annotation: its
reader gets a `Context` and raises with a message for a designer; its JSON Schema says what an editor should accept.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from mechdesign.errors import suggestion
from mechdesign.expressions import Expression, ExpressionError
from mechdesign.study.text.units import QUANTITY, QuantityError, Units

Form = dict[str, Any]
"""JSON Schema of a part of the study."""
NAME_FORM: Form = {"type": "string"}
NAMES_FORM: Form = {"type": "array", "items": NAME_FORM}
NUMBER_FORM: Form = {"type": ["number", "string"]}
PAIR_FORM: Form = {"type": "array", "items": NUMBER_FORM, "minItems": 2, "maxItems": 2}

NAME = re.compile(r"[^\W\d]\w*")
COORDINATE = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
# Magnitudes beyond which a number is a slip of writing: its square or reciprocal would soon overflow.
LARGEST, SMALLEST = 1e60, 1e-60
# The same for lengths, which are multiplied with one another more often.
LONGEST, SHORTEST = 1e15, 1e-15
# Endings of the names of files with a table.
FILES = (".csv", ".txt", ".dat")


@dataclass(frozen=True)
class Context:
    """What numbers are read with: units, values of the parameters (nan where one is wrong) and those not known yet.

    `used` gathers the names in expressions that were read.
    """

    units: Units = field(default_factory=Units)
    parameters: Mapping[str, float] = field(default_factory=dict)
    below: Collection[str] = ()
    used: set[str] = field(default_factory=set)

    def expression(self, text: str) -> Expression:
        """Parse an expression in the study's units and note the names in it."""
        found = Expression.parse(text, self.units.angle_factor)
        self.used.update(found.names)
        return found


@dataclass(frozen=True)
class StudyNumber:
    """A number in the study's units, with its expression where it depends on parameters."""

    nominal: float
    expression: Expression | None = None


LOST = StudyNumber(math.nan)
"""Stands for a number whose own mistake has been told, so that the rest can be checked."""


def failure(message: str) -> PydanticCustomError:
    """Build the error that a validator raises; the message reaches the user as it is."""
    return PydanticCustomError("study", "{message}", {"message": message})


def shown(value: object) -> str:
    """Write a raw value as the user wrote it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    text = repr(value) if isinstance(value, str) else f"the number {value}"
    return text if len(text) <= 60 else text[:57] + "..."


def read_number(raw: object, context: Context, kind: str | None = None) -> StudyNumber:
    """Read a number, a quantity or an expression over parameters.

    Raises
    ------
    PydanticCustomError
        Where it is none of them, not finite, too large, or a quantity of another kind than `kind`.
    """
    if isinstance(raw, StudyNumber):
        return raw
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise failure(f"expected a number, not {shown(raw)}")
    try:
        value = _read_text(raw, context, kind) if isinstance(raw, str) else StudyNumber(float(raw))
    except (QuantityError, ExpressionError) as error:
        raise failure(str(error)) from None
    except OverflowError:
        raise failure("too large a number") from None
    if not isinstance(raw, str) and not math.isfinite(value.nominal):
        raise failure(f"expected a finite number, not {value.nominal:g}")
    largest, what = (LONGEST, "length") if kind == "length" else (LARGEST, "number")
    if abs(value.nominal) > largest:
        raise failure(f"{shown(raw)} is too large a {what}: none is beyond {largest:g}; choose a larger unit")
    return value


def _read_text(text: str, context: Context, kind: str | None) -> StudyNumber:
    if QUANTITY.fullmatch(text):
        number = context.units.convert(text, kind)
        if not math.isfinite(number):
            raise failure(f"{text!r} is too large a number")
        return StudyNumber(number)
    expression = context.expression(text)
    for name in sorted(expression.names - set(context.parameters)):
        raise failure(f"unknown name {name!r} in {shown(text)}{_known_names(name, context)}")
    return StudyNumber(float(expression.evaluate(context.parameters)), expression if expression.names else None)


def read_expression(raw: object, context: Context) -> Expression:
    """Read an expression whose names are looked up later; a number is one without names."""
    if not isinstance(raw, str) or QUANTITY.fullmatch(raw):
        number = read_number(raw, context).nominal
        # A number that is lost has been told already.
        return Expression.parse(repr(0.0 if math.isnan(number) else number))
    try:
        expression = context.expression(raw)
        if not expression.names:
            expression.evaluate({})
    except ExpressionError as error:
        raise failure(str(error)) from None
    return expression


def read_rows(raw: list[Any], context: Context, most: int, rule: str, empty: str) -> tuple[tuple[float, ...], ...]:
    """Read a list of rows of equal length, from one number, which may stand alone, to `most`."""
    rows: list[tuple[float, ...]] = []
    for index, item in enumerate(raw):
        try:
            row = tuple(read_number(part, context).nominal for part in (item if isinstance(item, list) else [item]))
        except PydanticCustomError as error:
            raise failure(f"entry {index}: {error.message()}") from None
        if not 1 <= len(row) <= most or (rows and len(row) != len(rows[0])):
            raise failure(f"entry {index}: {rule}, not {shown(item)}")
        rows.append(row)
    if not rows:
        raise failure(empty)
    return tuple(rows)


def _known_names(name: str, context: Context) -> str:
    if name in context.below:
        return f"; a parameter may use those above it, and {name!r} is below"
    known = ", ".join(context.parameters)
    return suggestion(name, context.parameters) or (f"; the parameters are {known}" if known else "")


def as_list(raw: Any) -> list[Any]:
    """One thing instead of a list of one; nothing is an empty list."""
    return raw if isinstance(raw, list) else [] if raw is None else [raw]


def pair_of(what: str) -> BeforeValidator:
    """Annotation of a list of two, which are described for the message."""

    def check(raw: Any) -> Any:
        if not isinstance(raw, list) or len(raw) != 2:
            raise failure(f"expected {what}, not {shown(raw)}")
        return raw

    return BeforeValidator(check)


class Annotation:
    """Base of the annotations: how a raw value is read, and what an editor should accept."""

    def read(self, raw: Any, context: Context) -> Any:
        """The value, or a `failure`."""
        raise NotImplementedError

    def form(self) -> Form:
        """JSON Schema of the raw value."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(
            lambda raw, info: self.read(raw, info.context or Context())
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return self.form()


@dataclass(frozen=True, eq=False)
class Read(Annotation):
    """Annotation of a value that a function reads."""

    function: Callable[[Any, Context], Any]
    accepted: Form

    def read(self, raw: Any, context: Context) -> Any:
        return self.function(raw, context)

    def form(self) -> Form:
        return dict(self.accepted)


@dataclass(frozen=True)
class Reader(Annotation):
    """Annotation of a number: its kind in `units.KINDS`, if that is the same everywhere, and its least value.

    It becomes a float, a `StudyNumber`, or an `Expression` whose names are looked up later.
    """

    kind: str | None = None
    minimum: float | None = None
    exclusive: bool = False
    keep: Literal["", "value", "expression"] = ""

    def form(self) -> Form:
        return {**NUMBER_FORM, "description": "a number, a quantity or an expression"}

    def read(self, raw: Any, context: Context) -> float | StudyNumber | Expression:
        if self.keep == "expression":
            return read_expression(raw, context)
        value = read_number(raw, context, self.kind)
        self._check_minimum(value.nominal)
        return value if self.keep else value.nominal

    def _check_minimum(self, number: float) -> None:
        if self.minimum is None or math.isnan(number):
            return
        smallest = SHORTEST if self.kind == "length" else SMALLEST
        if 0 < number < smallest:
            raise failure(f"{number:g} is too small a number: none but 0 is below {smallest:g}; choose a smaller unit")
        if number < self.minimum or (self.exclusive and number == self.minimum):
            what = "positive" if self.minimum == 0 and self.exclusive else f"at least {self.minimum:g}"
            raise failure(f"must be {what}, not {number:g}")


@dataclass(frozen=True)
class Whole(Annotation):
    """Annotation of a whole number not below a minimum (and not above a maximum)."""

    minimum: int = 0
    maximum: int | None = None

    def form(self) -> Form:
        return {"type": ["integer", "number", "string"], "minimum": self.minimum}

    def read(self, raw: Any, context: Context) -> int:
        if isinstance(raw, int) and not isinstance(raw, bool):
            whole = raw
        else:
            number = read_number(raw, context, "none").nominal
            if math.isnan(number):
                return self.minimum
            if number != int(number):
                raise failure(f"expected a whole number, not {number:g}")
            whole = int(number)
        if whole < self.minimum:
            raise failure(f"must be at least {self.minimum}, not {whole}")
        if self.maximum is not None and whole > self.maximum:
            raise failure(f"must be at most {self.maximum}, not {shown(whole)}")
        return whole


@dataclass(frozen=True)
class NameOf(Annotation):
    """Annotation of a name, or (dotted) of a coordinate; `what` is for the message: "a point"."""

    what: str
    dotted: bool = False

    def form(self) -> Form:
        return {**NAME_FORM, "description": f"the name of {self.what}"}

    def read(self, raw: Any, context: Context) -> str:
        if isinstance(raw, str) and (COORDINATE if self.dotted else NAME).fullmatch(raw):
            return raw
        rule = "; a name is letters, digits and underscores, with a letter first" if isinstance(raw, str) else ""
        raise failure(f"expected the name of {self.what}, not {shown(raw)}{rule}")


@dataclass(frozen=True, eq=False)
class Choice(Annotation):
    """Annotation of a word out of a list."""

    words: Collection[str]

    def form(self) -> Form:
        return {"enum": list(self.words)}

    def read(self, raw: Any, context: Context) -> str:
        if isinstance(raw, str) and raw in self.words:
            return raw
        hint = suggestion(raw, self.words) if isinstance(raw, str) else ""
        raise failure(f"expected one of {', '.join(self.words)}, not {shown(raw)}{hint}")


@dataclass(frozen=True, eq=False)
class OrShort:
    """Annotation that adds short forms, which a validator brings to the long one, to the JSON Schema."""

    forms: tuple[Form, ...]

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"anyOf": [handler(schema), *self.forms]}


class OrOne:
    """Annotation that adds one entry, which a validator makes a list of, to a list's JSON Schema."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        many = handler(schema)
        return {"anyOf": [many, many["items"]]}


class Model(BaseModel):
    """Base of all sections: frozen, unknown keys are errors, values come in study units.

    Attributes
    ----------
    bare : str
        Key that a value stands for which is written alone, instead of a mapping.
    short : tuple of dict
        JSON Schema of the short forms.
    one_of : tuple of str
        Keys of which exactly one is given, after the message where they are none or several.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)
    bare: ClassVar[str] = ""
    short: ClassVar[tuple[Form, ...]] = ()
    one_of: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any) -> Any:
        return raw if not cls.bare or raw is None or isinstance(raw, dict | Model) else {cls.bare: raw}

    @model_validator(mode="after")
    def _exactly_one(self) -> Self:
        if self.one_of and len(self.given(*self.one_of[1:])) != 1:
            raise failure(self.one_of[0])
        return self

    def given(self, *keys: str) -> list[str]:
        """Those of the keys that are not None."""
        return [key for key in keys if getattr(self, key) is not None]

    @property
    def kind(self) -> Any:
        """Which of the keys of `one_of` is given."""
        return self.given(*self.one_of[1:])[0]

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        found = handler(schema)
        return {"anyOf": [dict(handler.resolve_ref_schema(found)), *cls.short]} if cls.short else found


Number = Annotated[float, Reader()]
Pure = Annotated[float, Reader("none")]
Positive = Annotated[float, Reader("none", 0.0, True)]
Length = Annotated[float, Reader("length")]
PositiveLength = Annotated[float, Reader("length", 0.0, True)]
NonNegativeLength = Annotated[float, Reader("length", 0.0)]
NonNegative = Annotated[float, Reader(None, 0.0)]
PositiveNumber = Annotated[float, Reader(None, 0.0, True)]
Angle = Annotated[float, Reader("angle")]
NonNegativeAngle = Annotated[float, Reader("angle", 0.0)]
Force = Annotated[float, Reader("force")]
Moment = Annotated[float, Reader("moment")]
PositiveStress = Annotated[float, Reader("stress", 0.0, True)]
PositiveArea = Annotated[float, Reader("area", 0.0, True)]
PositiveInertia = Annotated[float, Reader("inertia", 0.0, True)]

LengthValue = Annotated[StudyNumber, Reader("length", keep="value")]
PositiveLengthValue = Annotated[StudyNumber, Reader("length", 0.0, True, keep="value")]
AngleValue = Annotated[StudyNumber, Reader("angle", keep="value")]
AnyValue = Annotated[StudyNumber, Reader(keep="value")]
Bound = Annotated[Expression, Reader(keep="expression")]

LinkName = Annotated[str, NameOf("a link")]
PointName = Annotated[str, NameOf("a point")]
JointName = Annotated[str, NameOf("a joint")]
DriveName = Annotated[str, NameOf("a drive")]
MeasureName = Annotated[str, NameOf("a measure")]
AnyName = Annotated[str, NameOf("a link, leg or joint")]
CoordinateName = Annotated[str, NameOf("a coordinate (such as C.x or rod.angle)", dotted=True)]
CoordinateNames = Annotated[tuple[CoordinateName, ...], BeforeValidator(as_list), OrOne()]
Numbers = Annotated[tuple[Number, ...], BeforeValidator(as_list), OrOne()]
