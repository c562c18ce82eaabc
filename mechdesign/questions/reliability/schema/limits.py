"""Limits of errors, and of values, as the study file gives them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Tag, ValidationInfo, model_validator

from mechdesign.study.text import fields
from mechdesign.study.text.reading import Context, failure, read_number, shown
from mechdesign.study.text.units import Amount

# Endings of the names of positions, velocities and accelerations.
SUFFIXES = ("", "_velocity", "_acceleration")


_TIMINGS = {
    "given": "the drive stands where the pose has it",
    "free": "the drive stands where the point comes nearest to its target, earlier or later",
}
_Place = Annotated[tuple[fields.Number, fields.Number], fields.pair_of("[x, y]")]
_Target = Annotated[
    Annotated[None, Tag("none")] | Annotated[fields.Number, Tag("value")] | Annotated[_Place, Tag("place")],
    Discriminator(lambda raw: "none" if raw is None else "place" if isinstance(raw, list | tuple) else "value"),
]


def split_order(name: str, is_name: Callable[[str], bool]) -> tuple[str, int]:
    """The coordinate (or point) that a name is about, and whether it means the position, velocity or acceleration."""
    for order, suffix in enumerate(SUFFIXES):
        if not is_name(name) and name.endswith(suffix) and is_name(name.removesuffix(suffix)):
            return name.removesuffix(suffix), order
    return name, 0


class ErrorLimit(fields.Model):
    """Bounds of an error (``min``, ``max``), of the value itself (``lsl``, ``usl``), or of a point's distance from its
    place (``radius``). A number alone is +- about 0, two are lowest and highest error.
    """

    short = (fields.NUMBER_FORM, fields.PAIR_FORM)
    min: fields.Number | None = None
    """Lowest error. Left out: none. Example: -0.05"""
    max: fields.Number | None = None
    """Highest error. Left out: none. Example: 0.05"""
    lsl: fields.Number | None = None
    """Lower specification limit: lowest value of the output itself, at every pose. Example: 99.9"""
    usl: fields.Number | None = None
    """Upper specification limit: highest value of the output itself. An angle between both is counted at the turn
    nearest to them. Example: 100.1
    """
    radius: fields.NonNegative | None = None
    """Of a point: distance from its nominal place, or its target, that is allowed. Example: 0.05"""
    target: Annotated[tuple[_Target, ...], BeforeValidator(fields.as_list), fields.OrShort()] | None = None
    """Value, or place [x, y] of a point, from which ``min``, ``max`` and ``radius`` count, in place of the nominal one:
    one, or one for each pose, null where there is no limit. Example: [[0, 0], [20, 5], null, [40, 0]]
    """
    timing: Annotated[str, fields.choice(_TIMINGS, "timing")] = "given"
    """Of a point with a ``target`` and a radius: whether its distance at a pose counts, or that of its path. Example:
    free
    """

    @model_validator(mode="before")
    @classmethod
    def _long_form(cls, raw: Any, info: ValidationInfo) -> Any:
        if isinstance(raw, list):
            if len(raw) != 2:
                raise failure(f"expected a number, or the lowest and highest error such as [-1, 0.8], not {shown(raw)}")
            return {"min": raw[0], "max": raw[1]}
        if not isinstance(raw, int | float | str) or isinstance(raw, bool):
            return raw
        size = read_number(raw, info.context or Context())
        if size < 0:
            raise failure(f"must be at least 0, not {size:g}")
        return {"min": Amount.by("-size", size=size), "max": size}

    def faults(self) -> Iterator[str]:
        kinds = [present for keys in (("min", "max"), ("lsl", "usl"), ("radius",)) if (present := self.given(*keys))]
        if not kinds:
            yield "a limit needs a number, 'min', 'max', 'lsl', 'usl' or 'radius'"
        if len(kinds) > 1:
            yield (
                f"{kinds[0][0]!r} and {kinds[1][0]!r} exclude each other: 'min' and 'max' limit the error, 'lsl' and "
                "'usl' the value itself, 'radius' the place of a point"
            )
        if self.target is None and self.timing != "given":
            yield "'timing: free' is of a 'target'"
        if self.target is not None and self.absolute:
            yield "'lsl' and 'usl' have no target; limit the distance from it by 'min' and 'max'"
        places = [part for part in self.targets or () if isinstance(part, tuple)]
        numbers = [part for part in self.targets or () if part is not None and not isinstance(part, tuple)]
        if numbers if self.radius is not None else places:
            yield "the target of a point's radius is a place [x, y], and that of another limit a number"
        if self.radius is None and self.timing != "given":
            yield "'timing: free' is of the radius of a point"

    def misfits(self) -> Iterator[fields.Misfit]:
        low, high = self.ends
        if low is not None and high is not None:
            yield fields.Misfit(high < low, "the maximum {} is below the minimum {}", (high, low))

    @property
    def targets(self) -> tuple[Any, ...] | None:
        """The targets, one for all poses or one for each: numbers, pairs, or None; None where there are none."""
        pair = self.radius is not None and self.target is not None and len(self.target) == 2
        if pair and not any(part is None or isinstance(part, tuple) for part in self.target or ()):
            return (self.target,)
        return self.target

    @property
    def absolute(self) -> bool:
        """Whether it is a limit of the value itself."""
        return self.lsl is not None or self.usl is not None

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Lowest and highest error, or value where it is absolute."""
        return (self.lsl, self.usl) if self.absolute else (self.min, self.max)
