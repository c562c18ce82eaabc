"""Random mechanisms with random elastic links, motors and bearings, each asked somewhere, for hypothesis."""

from __future__ import annotations

from random import Random
from typing import Any

import yaml
from hypothesis import event
from hypothesis import strategies as st

from helpers.layouts import DUMPER, GROUND, Layout
from helpers.random_mechanisms import Made, mechanisms

# Every kind of section; lengths of the mechanisms are near one, so that slender and stocky beams both occur.
SECTIONS: dict[str, dict[str, Any]] = {
    "flat": {"E": 2e5, "width": 0.05, "height": 0.2},
    "stocky": {"E": 1e5, "G": 4e4, "width": 0.1, "height": 0.4, "shear": True},
    "bar": {"E": 2e5, "diameter": 0.2},
    "tube": {"E": 2e5, "G": 8e4, "diameter": 0.3, "inner_diameter": 0.24, "shear": True},
    "given": {"E": 1e5, "area": 0.02, "inertia": 3e-4},
    "factor": {"E": 1e5, "G": 3e4, "area": 0.03, "inertia": 4e-4, "shear": True, "shear_factor": 0.4},
}


class Sprung:
    """A random mechanism and what its stiffness section says, as names and numbers."""

    def __init__(self, made: Made, rng: Random) -> None:
        self.made, self.layout = made, made.layout
        layout = self.layout
        moving = [body for body in layout.bodies.values() if body.name != GROUND]

        def some(names: list[str], share: float) -> list[str]:
            return [name for name in names if rng.random() < share]

        share = rng.choice([0.0, 0.4, 0.8, 1.0])
        self.elastic = {name: rng.choice(sorted(SECTIONS)) for name in some([b.name for b in moving], share)}
        share = rng.choice([0.0, 0.5, 1.0])
        self.actuators = {
            drive: 10 ** rng.uniform(2, 4) for drive in some(list(layout.drives), share if self.elastic else 1.0)
        }
        clamps = [{clamp.first, clamp.second} for clamp in layout.clamps.values()]
        pins = [p for p in layout.places if len(layout.owners(p)) > 1 and set(layout.owners(p)) not in clamps]
        slides = [*layout.guides, *(body.name for body in moving if body.to)]
        share = rng.choice([0.0, 0.0, 0.4])
        self.bearings: dict[str, dict[str, float]] = {
            pin: {"radial": 10 ** rng.uniform(3, 5)} for pin in some(pins, share)
        }
        for slide in some(slides, share):
            kinds = rng.choice([["radial"], ["moment"], ["radial", "moment"]])
            self.bearings[slide] = {kind: 10 ** rng.uniform(3, 5) for kind in kinds}
        #: Of each coupling what it gives; some are rigid.
        self.couplings = {
            name: {"moment" if coupling.coordinate[0] == "angle" else "force": 10 ** rng.uniform(2, 4)}
            for name, coupling in layout.couplings.items() if rng.random() < 0.6
        }  # fmt: skip
        self.link, self.at = "", ""
        free = [point for point in pins if GROUND not in layout.owners(point)]
        if free and rng.random() < 0.3:
            self.at = rng.choice(free)
        else:
            body = rng.choice(moving)
            self.link, self.at = body.name, rng.choice([*body.points, *[body.to] * bool(body.to)])

    def __repr__(self) -> str:
        return "\n" + self.text()

    def text(
        self, layout: Layout | None = None, rng: Random | None = None, names: dict[str, str] | None = None, **other: Any
    ) -> str:
        """The study: of another drawing of the same mechanism, in a shuffled order, with other names or entries."""
        layout, names = layout or self.layout, names or {}

        def named(items: dict[str, Any]) -> dict[str, Any]:
            pairs = list(items.items())
            if rng is not None:
                rng.shuffle(pairs)
            return {names.get(name, name): value for name, value in pairs}

        section = {
            "at": names.get(self.at, self.at),
            "sections": SECTIONS,
            "elastic": named(self.elastic),
            "actuators": named(self.actuators),
            "bearings": named(self.bearings),
            "couplings": named(self.couplings),
            "poses": [named(layout.pose(layout.drives))],
        }
        if self.link:
            section["link"] = names.get(self.link, self.link)
        study = {"stiffness": section | other}
        return layout.text(rng, names) + yaml.dump(study, Dumper=DUMPER, sort_keys=False, default_flow_style=None)


@st.composite
def sprung(draw: st.DrawFn, **kinds: Any) -> Sprung:
    """Random mechanisms (see `mechanisms`) with something elastic."""
    made = draw(mechanisms(**kinds))
    found = Sprung(made, Random(draw(st.integers(0, 2**32 - 1))))
    asked = "a pin" if not found.link else "an elastic link" if found.link in found.elastic else "a rigid link"
    event(f"asked {asked}")
    return found
