"""Random mechanisms with friction, and the same for bodies by Newton and Euler with friction found by iteration."""

from __future__ import annotations

from random import Random
from typing import Any

import numpy as np
import yaml
from hypothesis import strategies as st

from helpers.layouts import DUMPER
from helpers.newton_euler import Jet
from helpers.random_dynamics import Loaded
from helpers.random_mechanisms import Made, mechanisms
from mechdesign.ground.numerics.arrays import Floats

ROUNDS = 400
CONVERGED = 1e-13


class Rubbed(Loaded):
    """A random mechanism with friction in slides, legs and the pins of two links on which nothing else acts."""

    def __init__(self, made: Made, rng: Random) -> None:
        super().__init__(made, rng)
        layout = self.layout
        loaded = [end for load in self.loads for end in load.ends]
        loaded += [end for spring in self.springs.values() for end in spring["between"]]
        taken = {guide.point for guide in layout.guides.values()} | {clamp.point for clamp in layout.clamps.values()}
        pins = [point for point in layout.places if len(layout.owners(point)) == 2 and point not in {*taken, *loaded}]
        legs = [name for name, body in layout.bodies.items() if body.to]
        self.friction: dict[str, dict[str, float]] = {}
        for point in pins:
            self.friction[point] = {"coefficient": rng.uniform(0, 0.3), "radius": rng.uniform(0, 0.2)}
        for name in [*layout.guides, *legs]:
            self.friction[name] = {"coefficient": rng.uniform(0, 0.3)}
            if rng.random() < 0.7 and (name in legs or layout.guides[name].kind != "slot"):
                self.friction[name]["length"] = rng.uniform(0.5, 3)

    @property
    def text(self) -> str:
        study: dict[str, Any] = yaml.safe_load(super().text)
        study["mechanism"]["friction"] = self.friction
        return yaml.dump(study, Dumper=DUMPER, sort_keys=False, default_flow_style=None, width=110)

    def _moves(self, name: str) -> Jet:
        """The coordinate that friction in a joint works on."""
        bodies, layout = self.bodies, self.layout
        if name in layout.places:
            first, other = (layout.holder(link, name) for link in layout.owners(name))
            return bodies.angle(other, first)
        return bodies.coordinate(("slide", name))

    def _bearing(self, name: str) -> Floats:
        """Friction in a joint, from what its constraints bear."""
        told, held = self.friction[name], self.bodies.multipliers
        if name in self.layout.places:
            (parts,) = (parts for (kind, *on), parts in held.items() if kind == "pin" and on[0] == name)
            return told["coefficient"] * told["radius"] * np.hypot(*parts.T)
        size = np.abs(held["slide", name][:, 0])
        if "length" in told:
            size = np.maximum(size, 2 / told["length"] * np.abs(held["tie", name][:, 0]))
        return told["coefficient"] * size

    def rub(self) -> dict[str, Floats] | None:
        """The power of friction in each joint, once what the joints bear is in balance with it; None if never."""
        assert self.acting is not None
        bodies = self.bodies
        free, moves = bodies.forces, {name: self._moves(name) for name in self.friction}
        rates = {name: np.real(jet.rate) for name, jet in moves.items()}
        fastest = np.abs(bodies.rates).max(axis=1)
        signs = {name: np.where(np.abs(rate) > 1e-9 * fastest, np.sign(rate), 0.0) for name, rate in rates.items()}
        friction = {name: np.zeros(bodies.poses) for name in moves}
        for _ in range(ROUNDS):
            bodies.forces = free + sum(friction[name][:, None] * np.real(jet.row) for name, jet in moves.items())
            bodies.solve()
            after = {name: -signs[name] * self._bearing(name) for name in moves}
            size = max((np.abs(values).max() for values in after.values()), default=0.0)
            if not size < 1e9:
                return None
            if all(np.abs(after[name] - friction[name]).max() <= CONVERGED * size for name in moves):
                return {name: friction[name] * rates[name] for name in moves}
            friction = after
        return None


@st.composite
def rubbed(draw: st.DrawFn, **kinds: Any) -> Rubbed:
    """Random mechanisms with masses, springs, loads and friction, in motion."""
    made = draw(mechanisms(**kinds))
    return Rubbed(made, Random(draw(st.integers(0, 2**32 - 1))))
