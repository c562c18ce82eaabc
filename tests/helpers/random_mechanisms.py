"""Random mechanisms of any topology, each with the pose it was made from, for hypothesis."""

from __future__ import annotations

from functools import cached_property
from random import Random

from hypothesis import assume, event
from hypothesis import strategies as st

from helpers.layouts import Coordinate, Layout
from helpers.maker import DRIVEN, DYADS, TRIADS, Maker
from helpers.studies import study_of
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.mechanism import Configuration, Mechanism


class Made:
    """A random mechanism: its drawing, the mechanism that its study gives, and motions through the pose drawn."""

    def __init__(self, layout: Layout, maker: Maker) -> None:
        self.layout = layout
        self.maker = maker
        # One for each use: what is drawn must not depend on what was looked at before.
        self.rng, self._order, self._speed = (Random(maker.rng.getrandbits(64)) for _ in range(3))

    def __repr__(self) -> str:
        return f"\n{self.text}# drawn at {self.layout.pose(self.layout.drives)}, rates {self.rates}\n"

    @cached_property
    def text(self) -> str:
        return self.layout.text(self._order)

    @cached_property
    def mechanism(self) -> Mechanism:
        return study_of(self.text).mechanism

    @cached_property
    def size(self) -> float:
        """The largest distance from the origin."""
        return max(abs(place) for place in self.layout.places.values())

    @cached_property
    def rates(self) -> dict[str, float]:
        """Rates of the drives, of which none is small."""
        rng = self._speed
        return {drive: rng.choice([-1, 1]) * rng.uniform(0.3, 1.0) for drive in self.layout.drives}

    def drives(self, time: Floats, bend: float = 0.0) -> list[Floats]:
        """Values of the drives, in the mechanism's order, at constant rates from the pose drawn (at time 0).

        With `bend` they are accelerated, each by so many times its rate.
        """
        ahead = time + bend * time * time / 2
        return [
            self.layout.value(self.layout.drives[drive]) + self.rates[drive] * ahead for drive in self.mechanism.drives
        ]

    def at(self, time: Floats, bend: float = 0.0) -> Configuration:
        """The mechanism at such times."""
        return self.mechanism.forward.solve(self.drives(time, bend))

    def known(self) -> dict[str, Coordinate]:
        """Coordinates that both the mechanism and its drawing know by the same name."""
        found: dict[str, Coordinate] = dict(self.layout.measures)
        for point in self.layout.places:
            found[f"{point}.x"], found[f"{point}.y"] = ("x", point), ("y", point)
        for body in self.layout.bodies.values():
            if body.name != "ground":
                found[f"{body.name}.angle"] = ("angle", body.name, "ground")
            if body.to:
                found[f"{body.name}.length"] = ("length", body.name)
        return found | {f"{guide}.slide": ("slide", guide) for guide in self.layout.guides}


@st.composite
def mechanisms(
    draw: st.DrawFn,
    *,
    triads: bool | None = None,
    anyhow: bool | None = None,
    most: int = 4,
    coupled: bool = False,
) -> Made:
    """Random mechanisms: one to three driven links, then dyads; with `triads` also a group that is none.

    With `anyhow` the drives are drawn from all angles, absolute and relative, slides and legs, which seldom leaves
    dyads. With `coupled` one coordinate follows others.
    """
    triads = draw(st.booleans()) if triads is None else triads
    anyhow = draw(st.booleans()) if anyhow is None else anyhow
    groups = draw(st.lists(st.sampled_from(sorted(DRIVEN)), min_size=1, max_size=3))
    groups += draw(st.lists(st.sampled_from(sorted(DYADS)), min_size=0 if triads else 1, max_size=most))
    if triads:
        groups.insert(draw(st.integers(1, len(groups))), draw(st.sampled_from(sorted(TRIADS))))
    maker = Maker(draw(st.integers(0, 2**32 - 1)))
    laid = [group for group in groups if maker.add((DRIVEN | DYADS | TRIADS)[group])]
    if not maker.layout.drives:
        maker.add(DRIVEN["crank"])
    for group in laid:
        event(group)
    if coupled and len(maker.layout.drives) == 1:
        maker.add(DRIVEN["crank"])
    maker.finish(anyhow=anyhow)
    assume(not coupled or maker.couple())
    return Made(maker.layout, maker)
