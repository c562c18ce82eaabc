"""What the names of a mechanism section mean, whether or not the rest of it is right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from mechdesign.mechanism.model import Quantity
from mechdesign.study.building.section import MechanismSection

GROUND = "ground"


@dataclass(frozen=True, eq=False)
class Names:
    """Names of a mechanism section and their kinds."""

    section: MechanismSection

    def points_of(self, link: str) -> list[str]:
        """Names of a link's points, its ends first."""
        section = self.section.links.get(link)
        if section is None:
            return []
        return [*(end for end in (section.from_, section.to) if end is not None), *section.points]

    @cached_property
    def owners(self) -> Mapping[str, list[str]]:
        """Every point with the links that have it, in the order of the study."""
        found: dict[str, list[str]] = {}
        for link in self.section.links:
            for point in self.points_of(link):
                found.setdefault(point, []).append(link)
        return found

    @cached_property
    def moving(self) -> list[str]:
        """Links other than the ground."""
        return [name for name in self.section.links if name != GROUND]

    @cached_property
    def legs(self) -> list[str]:
        """Telescopic links."""
        return [name for name, link in self.section.links.items() if link.telescopic]

    @cached_property
    def slides(self) -> list[str]:
        """Joints whose displacement is a coordinate."""
        return [name for name, joint in self.section.joints.items() if joint.fixed is None]

    def driven(self, drive: str) -> tuple[Literal["angle", "length", "slide"], str]:
        """What a drive changes, and of which link, leg or joint."""
        section = self.section.drives[drive]
        if section is not None:
            return section.kind, getattr(section, section.kind)
        return "slide" if drive in self.slides else "length" if drive in self.legs else "angle", drive

    @cached_property
    def drives(self) -> Mapping[str, Quantity]:
        """Drives and the kind of each."""
        return {name: "angle" if self.driven(name)[0] == "angle" else "length" for name in self.section.drives}

    @cached_property
    def measures(self) -> Mapping[str, Quantity]:
        """Measures and the kind of each."""
        quantities: dict[str, Quantity] = {"angle": "angle", "distance": "length", "expression": "none"}
        return {name: quantities[measure.kind] for name, measure in self.section.measures.items()}

    @cached_property
    def coordinates(self) -> Mapping[str, Quantity]:
        """Every coordinate and its kind, measures last."""
        found: dict[str, Quantity] = dict(self.drives)
        for point in self.owners:
            found[f"{point}.x"] = found[f"{point}.y"] = "length"
        for link in self.moving:
            found[f"{link}.angle"] = "angle"
        for leg in self.legs:
            found[f"{leg}.length"] = "length"
        for slide in self.slides:
            found[f"{slide}.slide"] = "length"
        return found | dict(self.measures)
