"""Types of the study's schema that are not plain: numbers, names, choices.

Each is a pydantic annotation. Its validator gets a `Context` and raises with a message for a designer; its JSON Schema
says what an editor should accept.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from mechdesign.expressions import RESERVED, Expression, ExpressionError
from mechdesign.study.text.units import QUANTITY, Powers, QuantityError, Units, measure

NAME = re.compile(r"[^\W\d]\w*")
LARGEST, SMALLEST = 1e60, 1e-60
"""Magnitudes beyond which a number is a slip of writing: its square or reciprocal would soon overflow."""
LONGEST, SHORTEST = 1e15, 1e-15
"""The same for lengths, which are multiplied with one another more often."""
COORDINATE = re.compile(r"[^\W\d]\w*(?:\.\w+)*")


@dataclass(frozen=True)
class Context:
    """What numbers are read with.

    Parameters
    ----------
    units : Units
        What bare numbers mean.
    parameters : mapping of str to float
        Nominal values, nan where one is wrong.
    below : collection of str
        Parameters that are not known yet.
    used : set of str
        Gathers the names in expressions that were read.
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
class Value:
    """A number that keeps where it came from.

    Parameters
    ----------
    nominal : float
        In the study's units.
    expression : Expression or None
        Where it depends on parameters.
    powers : powers or None
        Kind of quantity, where it was given with a unit.
    """

    nominal: float
    expression: Expression | None = None
    powers: Powers | None = None


LOST = Value(math.nan)
"""Stands for a number whose own mistake has been told, so that the rest can be checked."""


def failure(message: str) -> PydanticCustomError:
    """Build the error that a validator raises; the message reaches the user as it is."""
    return PydanticCustomError("study", "{message}", {"message": message})


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that resembles this one most, None where none does."""
    folded = {candidate.casefold(): candidate for candidate in known}
    close = difflib.get_close_matches(name.casefold(), list(folded), n=1, cutoff=0.6)
    return folded[close[0]] if close else None


def suggestion(name: str, known: Iterable[str]) -> str:
    """Give ``; did you mean 'x'?`` where a known name resembles this one, or else nothing."""
    near = nearest(name, known)
    return f"; did you mean {near!r}?" if near is not None else ""


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


def read_number(raw: object, context: Context, kind: str | None = None) -> Value:
    """Read a number, a quantity or an expression over parameters.

    Raises
    ------
    PydanticCustomError
        Where it is none of them, not finite, too large, or a quantity of another kind than `kind`.
    """
    if isinstance(raw, Value):
        return raw
    value = _read(raw, context, kind)
    largest = LONGEST if kind == "length" else LARGEST
    if abs(value.nominal) > largest:
        what = "length" if kind == "length" else "number"
        raise failure(f"{shown(raw)} is too large a {what}: none is beyond {largest:g}; choose a larger unit")
    return value


def _read(raw: object, context: Context, kind: str | None) -> Value:
    if isinstance(raw, bool) or not isinstance(raw, int | float | str):
        raise failure(f"expected a number, not {shown(raw)}")
    if isinstance(raw, str):
        return _read_text(raw, context, kind)
    try:
        number = float(raw)
    except OverflowError:
        raise failure("too large a number") from None
    if not math.isfinite(number):
        raise failure(f"expected a finite number, not {number:g}")
    return Value(number)


def _read_text(text: str, context: Context, kind: str | None) -> Value:
    try:
        if QUANTITY.fullmatch(text):
            number = context.units.convert(text, kind)
            if not math.isfinite(number):
                raise failure(f"{text!r} is too large a number")
            return Value(number, None, measure(text)[1])
        expression = context.expression(text)
        for name in sorted(expression.names - set(context.parameters)):
            raise failure(f"unknown name {name!r} in {shown(text)}{_known_names(name, context)}")
        result = expression.evaluate(context.parameters)
        return Value(float(result), expression if expression.names else None)
    except (QuantityError, ExpressionError) as error:
        raise failure(str(error)) from None


def _known_names(name: str, context: Context) -> str:
    if name in context.below:
        return f"; a parameter may use those above it, and {name!r} is below"
    known = ", ".join(context.parameters)
    return suggestion(name, context.parameters) or (f"; the parameters are {known}" if known else "")


@dataclass(frozen=True)
class Reader:
    """Annotation of a number of the study.

    Parameters
    ----------
    kind : str or None
        Kind of quantity expected, a name of `units.KINDS`; None where it depends on the key.
    minimum, exclusive : float or None, bool
        Least value, itself excluded or not.
    keep : {'', 'value', 'expression'}
        What becomes of it: a float, a `Value`, or an `Expression` whose names are looked up later.
    """

    kind: str | None = None
    minimum: float | None = None
    exclusive: bool = False
    keep: Literal["", "value", "expression"] = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": ["number", "string"], "description": "a number, a quantity or an expression"}

    def _validate(self, raw: Any, info: ValidationInfo) -> float | Value | Expression:
        context: Context = info.context or Context()
        if self.keep == "expression":
            return self._deferred(raw, context)
        value = read_number(raw, context, self.kind)
        self._check_minimum(value.nominal)
        return value if self.keep else value.nominal

    def _deferred(self, raw: Any, context: Context) -> Expression:
        try:
            if isinstance(raw, str) and not QUANTITY.fullmatch(raw):
                return context.expression(raw)
        except ExpressionError as error:
            raise failure(str(error)) from None
        return Expression.parse(repr(read_number(raw, context, self.kind).nominal))

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
class Whole:
    """Annotation of a whole number not below a minimum (and not above a maximum)."""

    minimum: int = 0
    maximum: int | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": ["integer", "number", "string"], "minimum": self.minimum}

    def _validate(self, raw: Any, info: ValidationInfo) -> int:
        if isinstance(raw, int) and not isinstance(raw, bool):
            whole = raw
        else:
            number = read_number(raw, info.context or Context(), "none").nominal
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
class NameOf:
    """Annotation of a name, or (dotted) of a coordinate; `what` is for the message: "a point"."""

    what: str
    dotted: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"type": "string", "description": f"the name of {self.what}"}

    def _validate(self, raw: Any) -> str:
        if not isinstance(raw, str):
            raise failure(f"expected the name of {self.what}, not {shown(raw)}")
        if not (COORDINATE if self.dotted else NAME).fullmatch(raw):
            rule = "letters, digits and underscores, with a letter first"
            raise failure(f"expected the name of {self.what}, not {shown(raw)}; a name is {rule}")
        return raw


@dataclass(frozen=True, eq=False)
class OrShort:
    """Annotation that adds short forms, which a validator brings to the long one, to the JSON Schema."""

    forms: tuple[dict[str, Any], ...]

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"anyOf": [handler(schema), *self.forms]}


def or_short(schema: CoreSchema, handler: GetJsonSchemaHandler, *forms: dict[str, Any]) -> JsonSchemaValue:
    """JSON Schema of a model that may also be written in short forms."""
    return {"anyOf": [dict(handler.resolve_ref_schema(handler(schema))), *forms]}


@dataclass(frozen=True)
class Choice:
    """Annotation of a word out of a list, or of what a function lists when it is asked."""

    words: tuple[str, ...] | Callable[[], tuple[str, ...]]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self._validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"enum": list(self._listed())}

    def _listed(self) -> tuple[str, ...]:
        return self.words() if callable(self.words) else self.words

    def _validate(self, raw: Any) -> str:
        words = self._listed()
        if isinstance(raw, str) and raw in words:
            return raw
        known = ", ".join(words)
        hint = suggestion(raw, words) if isinstance(raw, str) else ""
        raise failure(f"expected one of {known}, not {shown(raw)}{hint}")


def check_parameter_name(name: str) -> str | None:
    """Say what is wrong with a parameter's name, or None."""
    if not NAME.fullmatch(name):
        return "a parameter's name is letters, digits and underscores, with a letter first"
    return f"{name!r} is a word of the expression language; choose another name" if name in RESERVED else None


NAME_FORM: dict[str, Any] = {"type": "string"}
NAMES_FORM: dict[str, Any] = {"type": "array", "items": NAME_FORM}
NUMBER_FORM: dict[str, Any] = {"type": ["number", "string"]}

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

LengthValue = Annotated[Value, Reader("length", keep="value")]
PositiveLengthValue = Annotated[Value, Reader("length", 0.0, True, keep="value")]
AngleValue = Annotated[Value, Reader("angle", keep="value")]
AnyValue = Annotated[Value, Reader(keep="value")]
Bound = Annotated[Expression, Reader(keep="expression")]

LinkName = Annotated[str, NameOf("a link")]
PointName = Annotated[str, NameOf("a point")]
JointName = Annotated[str, NameOf("a joint")]
DriveName = Annotated[str, NameOf("a drive")]
MeasureName = Annotated[str, NameOf("a measure")]
AnyName = Annotated[str, NameOf("a link, leg or joint")]
CoordinateName = Annotated[str, NameOf("a coordinate, such as C.x or rod.angle,", dotted=True)]
