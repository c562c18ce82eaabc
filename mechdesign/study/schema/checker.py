"""Names, kinds of quantities and units that the checks of the questions look up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mechdesign.mechanism.model import Quantity
from mechdesign.study.build.names import Names
from mechdesign.study.build.parameters import Parameters
from mechdesign.study.text.document import Path
from mechdesign.study.text.reporter import Reporter
from mechdesign.study.text.units import KINDS, QUANTITY, QuantityError, describe, measure


class Checker:
    """Looks names and units up, and notes what is wrong with them."""

    def __init__(self, names: Names, parameters: Parameters, reporter: Reporter, parts: Mapping[str, Any]) -> None:
        self.names = names
        self.parts = parts
        self.parameters = parameters
        self.reporter = reporter

    def known(self, name: str, known: Iterable[str], what: str, path: Path, *, at_key: bool = False) -> bool:
        """Whether a name is known; if not, it is noted."""
        return self.reporter.known(name, known, what, path, at_key=at_key)

    def kind(self, path: Path, kind: str) -> None:
        """Note a quantity whose unit does not fit what its key needs."""
        raw = self.reporter.raw(path)
        if not isinstance(raw, str) or not QUANTITY.fullmatch(raw):
            return
        try:
            powers = measure(raw)[1]
        except QuantityError:
            return
        if powers != KINDS[kind] and not (kind == "rotational_stiffness" and powers == KINDS["moment"]):
            self.reporter.report(path, f"{raw!r} is {describe(powers)}, where {describe(KINDS[kind])} is expected")

    def coordinate(self, name: str, path: Path, *, at_key: bool = False, others: Iterable[str] = ()) -> Quantity | None:
        """Kind of a coordinate; None, and noted, where there is none of that name.

        `others` are names that might have stood there as well.
        """
        quantity = self.names.coordinates.get(name)
        if quantity is None:
            if name in self.names.owners:
                self.reporter.report(
                    path, f"{name!r} is a point; its coordinates are {name}.x and {name}.y", at_key=at_key
                )
            elif name in self.names.moving:
                self.reporter.report(path, f"{name!r} is a link; its coordinate is {name}.angle", at_key=at_key)
            else:
                what = "coordinate or parameter" if others else "coordinate"
                self.known(name, [*self.names.coordinates, *others], what, path, at_key=at_key)
        return quantity

    def is_angle(self, place: str) -> bool:
        owner, _, last = place.rpartition(".")
        if owner.startswith("limits."):
            index = int(owner.split(".")[1])
            limit = self.names.section.limits[index]
            if limit.drive is not None:
                return self.names.drives.get(limit.drive) == "angle"
            return limit.angle is not None or self.names.measures.get(limit.measure or "") == "angle"
        return last in ("direction", "angle")
