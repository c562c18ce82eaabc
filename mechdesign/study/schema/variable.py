"""Values that an entry of a study takes: lists of them, and design variables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from mechdesign.study.text import fields
from mechdesign.study.text.document import in_yaml
from mechdesign.study.text.reading import Context, failure, read_number, shown
from mechdesign.study.text.units import QUANTITY

LIST_FORM: fields.Form = {"type": "array", "items": {"title": "value"}}


def plainly(value: float) -> float | int:
    """A number rounded to 12 digits; a whole one is an int."""
    value = float(f"{value:.12g}")
    return int(value) if value.is_integer() and abs(value) < 1e15 else value


def read_values(raw: Any, context: Context) -> tuple[Any, ...]:
    """A list of different values; quantities become numbers in the study's units."""
    if not isinstance(raw, list) or not raw:
        raise failure(f"expected a list of values, not {shown(raw)}")
    values: list[Any] = []
    for item in raw:
        quantity = isinstance(item, str) and QUANTITY.fullmatch(item)
        value = plainly(read_number(item, context)) if quantity or isinstance(item, float) else item
        if value in values:
            raise failure(f"{shown(item)} is listed twice")
        values.append(value)
    return tuple(values)


class Variable(fields.Model):
    """A design variable: a range, whose bounds may be expressions over parameters and the variables above it, or
    choices.
    """

    from_: fields.Bound | None = Field(None, alias="from")
    """Lowest value of a range. Example: l_min + 5"""
    to: fields.Bound | None = None
    """Highest value of a range; on a grid it is taken where a step leads to it. Example: (l_min + R)/2"""
    step: fields.PositiveNumber | None = None
    """Step of a grid, and of the sensitivities reported with the optimum. Left out: ``number``; a grid needs one of
    them. Example: 0.03
    """
    number: Annotated[int, fields.whole(1, 10_000_000)] | None = None
    """How many values, both ends included, instead of ``step``. Example: 21"""
    integer: bool = False
    """Whether the values are whole numbers, whatever the method: the first of the range, and others by ``step``, which
    is whole too and 1 where it is left out. Example: true
    """
    choices: Annotated[tuple[Any, ...], fields.Read(read_values, LIST_FORM)] | None = None
    """Values one by one, in place of a range and whatever the method: numbers, quantities, or of an entry of the study
    also words. Example: [8, 10, 12] Example: [h6, h7, h9]
    """

    def faults(self) -> Iterator[str]:
        if self.step is not None and self.number is not None:
            yield "either 'step' or 'number', not both"
        if self.choices is None:
            if self.from_ is None or self.to is None:
                yield "a variable has a range, {from: 10, to: 30}, or choices, {choices: [8, 10, 12]}"
            if self.integer and self.number is not None:
                yield "whole numbers follow from 'step', 1 where it is left out; leave out 'number'"
            if self.integer and self.step is not None and not float(self.step).is_integer():
                yield f"a step of whole numbers is whole, not {self.step:g}"
            return
        beside = [key for key in ("from_", "to", "step", "number", "integer") if key in self.model_fields_set]
        if beside:
            yield f"choices are the values themselves; leave out {beside[0].rstrip('_')!r}"
        if len({*self.words}) < len(self.words):
            yield "two choices read the same in a table: give each a text of its own"

    @property
    def stepped(self) -> bool:
        """Whether only separate values are possible, with every method."""
        return self.integer or self.choices is not None

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers."""
        return all(isinstance(choice, int | float) and not isinstance(choice, bool) for choice in self.choices or ())

    @property
    def words(self) -> tuple[str, ...]:
        """Choices as tables name them; empty if they are numbers."""
        if self.numeric:
            return ()
        return tuple(choice if isinstance(choice, str) else in_yaml(choice) for choice in self.choices or ())
