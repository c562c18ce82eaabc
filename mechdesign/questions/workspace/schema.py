"""The workspace section of the study file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from mechdesign.ground.indices import INDEX_NAMES, needed_section
from mechdesign.study.schema.checker import Checker
from mechdesign.study.schema.section import Section
from mechdesign.study.text import fields
from mechdesign.study.text.document import KeyPath
from mechdesign.study.text.reading import failure

# A turn written with few digits (6.2832 rad) is one, as far as so small a part of it.
WHOLE = 3e-6
_RULES = {
    "gauss": "adaptive, to a tolerance, with an error estimate",
    "midpoint": "so many rays and nodes, at the middles of equal steps, weighted by area; for comparison",
    "sector_mean": "plain mean of equally spaced nodes along each ray, rays weighted by their sectors' area [S1]",
}
_ASSEMBLIES = {
    "same": "at singularities, where another assembly begins; of several pieces that of the sketch counts",
    "any": "nowhere else: places reached in any other assembly count as well, and with any elbows",
}


class Scan(fields.Model):
    """Rays that the region is looked at along; left out, all round the point's place in the sketch."""

    about: tuple[fields.Length, fields.Length] | None = None
    """Centre of the rays, [x, y]. Left out: the point's place in the sketch. Example: [0, 0]"""
    from_: fields.Angle | None = Field(None, alias="from")
    """Angle of the first ray, from the x axis, together with ``to``. Left out: all round. Example: 0"""
    to: fields.Angle | None = None
    """Angle of the last ray, at most a turn beyond ``from``. Example: 180"""
    rays: Annotated[int, fields.whole(2, 1_000_000)] | None = None
    """How many rays the tables have, and the rules midpoint and sector_mean. Left out: 181 in the tables, 300 of
    midpoint, 101 of sector_mean. Example: 241
    """

    @field_validator("to")
    @classmethod
    def _within_a_turn(cls, to: float | None, info: ValidationInfo) -> float | None:
        start, context = info.data.get("from_"), info.context
        if to is not None and start is not None and context is not None:
            turn = 2 * math.pi / context.units.angle_factor
            if to - start > turn * (1 + WHOLE):
                raise failure(
                    f"{to:g} is more than a turn beyond 'from', {start:g}: rays would meet the region more than once; "
                    f"at most {start + turn:g}"
                )
        return to


class Integrate(fields.Model):
    """The rule by which means over the workspace are integrated."""

    rule: Annotated[str, fields.choice(_RULES, "rule of integration")] = "gauss"
    """How means over the region are integrated."""
    tolerance: fields.Positive = 1e-5
    """Relative error of gauss. Left out, each design of optimize has 1e-4. Example: 1e-6"""
    nodes: Annotated[int, fields.whole(1, 100_000)] | None = None
    """Nodes along each ray, of midpoint and sector_mean. Left out: 200 and 49. Example: 49"""

    def faults(self) -> Iterator[str]:
        if self.rule == "gauss" and self.nodes is not None:
            yield "rule 'gauss' chooses its nodes by 'tolerance'; 'nodes' belongs to midpoint and sector_mean"


_Index = Annotated[str, fields.choice(INDEX_NAMES, "local index")]


class WorkspaceSection(Section):
    """The region that a point can reach, and indices of how well the mechanism works there."""

    command: ClassVar[str] = "workspace"
    point: fields.EndName
    """Point whose region is asked for; the mechanism has two degrees of freedom or more. Example: C"""
    at: dict[fields.CoordinateName, fields.Numbers] = Field(default_factory=dict)
    """Coordinates that are held where the mobility is beyond two, as many as it is beyond: one value, or a list (a
    region each). Example: {platform.angle: [0, 15]}
    """
    scan: Scan = Field(default_factory=lambda: Scan.model_validate({}))
    integrate: Integrate = Integrate()
    margin: fields.NonNegativeAngle = 0.0
    """Angle at both ends of the scan that the means leave out. Example: 0.5"""
    assembly: Annotated[str, fields.choice(_ASSEMBLIES, "assembly")] = "same"
    """Where the region ends besides the reach and the limits."""
    characteristic_length: fields.PositiveLength | None = None
    """Length as which a radian counts. Needed where the Jacobian mixes lengths and angles. Example: 0.1"""
    indices: Annotated[tuple[_Index, ...], BeforeValidator(fields.as_list), fields.OrShort()] | None = None
    """Local indices that are evaluated; one alone needs no list. Left out: the usual ones, of the Jacobian. Example:
    [inverse_condition, k_min]
    """

    def checked(self, checker: Checker) -> Self:
        """Check names, units and ranges against the mechanism."""
        root: KeyPath = ("workspace",)
        checker.check_name(self.point, [*checker.mechanism.owners, *checker.mechanism.ends], "point", (*root, "point"))
        checker.coordinates(self.at, (*root, "at"))
        for name, values in self.at.items():
            if not values:
                checker.report((*root, "at", name), "an empty list of values; give one or more, such as [0, 15]")
        for index, name in enumerate(self.indices or ()):
            checker.needs(needed_section(name), f"the index {name!r}", (*root, "indices", index))
        if (self.scan.from_ is None) != (self.scan.to is None):
            checker.report((*root, "scan"), "'from' and 'to' belong together")
        checker.range(self.scan.from_, self.scan.to, (*root, "scan"))
        return self
