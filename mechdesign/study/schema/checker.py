"""Checks of names, kinds of quantities and units that the questions share."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.elements.declared import Quantity
from mechdesign.study.building.builder import Builder
from mechdesign.study.building.parameters import Parameters
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.inputs import Folder

# Kinds of a coordinate, its rate and its acceleration.
ORDERS: dict[Quantity | None, tuple[str, str, str]] = {
    "length": ("length", "velocity", "acceleration"),
    "angle": ("angle", "angular_velocity", "angular_acceleration"),
}
NO_MOMENT = "a pin carries no moment; name the 'link' of the stiffness section that is loaded"


class Checker:
    """Checks names and units, and reports mistakes in them."""

    def __init__(
        self, builder: Builder, parameters: Parameters, parts: dict[str, Any], folder: Folder,
        compiled: Mechanism | None,
    ) -> None:  # fmt: skip
        #: None where the mechanism itself has mistakes.
        self.compiled = compiled
        self.mechanism, self.places, self.reporter = builder.section, builder.places, builder.reporter
        self.parameters = parameters
        self.parts, self.folder = parts, folder
        self.check_name, self.kind = builder.reporter.check_name, builder.reporter.kind
        self.report, self.doubt, self.units = builder.reporter.report, builder.reporter.doubt, builder.units

    def coordinate(
        self, name: str, path: KeyPath, *, at_key: bool = False, others: Iterable[str] = (), also: str = "parameter",
        order: int | None = None,
    ) -> Quantity | None:  # fmt: skip
        """Kind of a coordinate; an unknown name is reported, and None returned.

        `others` are names that might have stood there as well, each of `also`. With an `order` the unit of its value
        (0), rate (1) or acceleration (2) is checked.
        """
        quantity = self.mechanism.coordinates.get(name)
        if order is not None and quantity in ORDERS:
            self.kind(path, ORDERS[quantity][order])
        if quantity is None:
            if name in self.mechanism.owners:
                self.report(path, f"{name!r} is a point; its coordinates are {name}.x and {name}.y", at_key=at_key)
            elif name in self.mechanism.moving:
                drives = [drive for drive, entry in self.mechanism.drives.items() if entry and entry.angle == name]
                also = f", and its drive is {drives[0]}" if drives else ""
                self.report(path, f"{name!r} is a link; its coordinate is {name}.angle{also}", at_key=at_key)
            else:
                noun = f"coordinate or {also}" if others else "coordinate"
                self.check_name(name, [*self.mechanism.coordinates, *others], noun, path, at_key=at_key)
        return quantity

    def quantity(self, name: str) -> str | None:
        """Kind of a parameter, a dimension or a drive; None if it is not known."""
        if name in self.parameters.nominal:
            return self.parameters.kind(name, self.places)
        return self.places[name].quantity if name in self.places else self.mechanism.driven_kinds.get(name)

    def size(self, name: str) -> float:
        """Nominal value of a parameter or a place of the geometry; 0 of drives and loads, whose errors are about 0."""
        return self.parameters.nominal.get(name, self.places[name].nominal if name in self.places else 0.0)

    def coordinates(self, names: Iterable[str], path: KeyPath, order: int = 0) -> None:
        """Check the coordinates that are keys of a mapping, and the units of their values, rates or accelerations."""
        for name in names:
            self.coordinate(name, (*path, name), at_key=True, order=order)

    def outputs(self, outputs: Iterable[str] | None, path: KeyPath, columns: Collection[str] = ()) -> None:
        """Check the names in a list of outputs: coordinates, points, and `columns` of dynamics where they may stand."""
        listed: set[str] = set()
        for index, name in enumerate(outputs or ()):
            parts = self.mechanism.coordinates_of(name)
            if parts == (name,) and name not in columns:
                self.coordinate(name, (*path, index), others=columns, also="column of dynamics")
            if listed.intersection(parts):
                self.report((*path, index), f"{name!r} is listed twice")
            listed.update(parts)

    def load(self, load: tuple[float, ...], path: KeyPath, *, on_pin: bool) -> tuple[float, ...]:
        """A load of the stiffness section's point or link as fx, fy, mz."""
        if len(load) not in ((2, 3) if on_pin else (3,)):
            self.report(path, f"a load is [fx, fy, mz], not {len(load)} numbers")
            return 0.0, 0.0, 0.0
        for place, kind in enumerate(("force", "force", "moment")[: len(load)]):
            self.kind((*path, place), kind)
        if on_pin and any(load[2:]):
            self.report((*path, 2), NO_MOMENT)
        return (*load, 0.0)[:3]

    def range(self, low: float | None, high: float | None, path: KeyPath) -> None:
        """Check that the end of a range is beyond its beginning."""
        if low is not None and high is not None and high <= low:
            self.report((*path, "to"), f"{high:g} is not beyond 'from', {low:g}")

    def choices(self) -> list[Any]:
        """Values that entries of the study have in cases of its matrix, or in designs."""
        matrix, optimize = self.parts.get("matrix"), self.parts.get("optimize")
        varied = [] if matrix is None else [variation.values for variation in (matrix.vary or {}).values()]
        varied += [] if optimize is None else [variable.choices for variable in optimize.variables.values()]
        return [value for values in varied for value in values or ()]

    def needs(self, section: str | None, subject: str, path: KeyPath) -> None:
        """Check that the study has a section that `subject` needs."""
        if section is not None and self.reporter.document.raw((section,)) is None:
            self.report(path, f"{subject} needs the {section} section, and the study has none")
