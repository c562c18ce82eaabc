"""The same mechanism with other dimensions: nothing of its topology is compiled again, and its assembly stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechdesign.errors import AssemblyError
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.plan import Plan

# Poses among which one is sought that can be assembled, where the drawn one cannot.
TRIES = 512


class Variant(Mechanism):
    """A mechanism that differs from another in its numbers alone.

    The assembly modes are those of the original, which its sketch has chosen; groups without a closed form start from
    the original's sketch, brought to the new dimensions by continuation at the same values of the drives.

    Parameters
    ----------
    original : Mechanism
    description : Description
        The original's but for the values of its places.

    Raises
    ------
    MechanismError
        If the angles of slides and clamps in a closed chain contradict each other.
    AssemblyError
        If a group without a closed form has no assembly to start from.
    """

    def __init__(self, original: Mechanism, description: Description) -> None:
        self.original = original
        self.description = description
        self.graph = original.graph
        self.geometry = Geometry(self.graph, description.places)
        self.nominal = {name: place.nominal for name, place in description.places.items()}
        self._plans = {}
        self._check_ties()
        self.sketch = original.sketch
        self.drives = original.drives
        self.bounds = original.bounds
        self.forward = self.plan(self.drives)
        self.sketch_configuration = self._assemble_sketch()

    def plan(self, given: Sequence[str]) -> Plan:
        """Plan for given coordinates, in the assembly of the original's; see `Mechanism.plan`."""
        key = tuple(given)
        if key not in self._plans:
            drawn = self.original.plan(key)
            self._plans[key] = Plan(self, drawn.structure, drawn.modes)
        return self._plans[key]

    def _assemble_sketch(self) -> Configuration:
        before = self.original.nominal
        changed = {name: value for name, value in self.nominal.items() if value != before[name]}
        found = drawn(self.original, changed)
        if not found.valid:
            if self.forward.iterative:
                raise AssemblyError("the sketch cannot be assembled with these dimensions")
            found = elsewhere(self.original, changed)
        return replace(found, places={})


def elsewhere(mechanism: Mechanism, changed: Mapping[str, Value]) -> Configuration:
    """A pose with other dimensions and the drives near to where they were drawn; the drawing where there is none."""
    sketch, random = mechanism.sketch_configuration, np.random.default_rng(0)
    given = []
    away = np.zeros(TRIES)
    for coordinate in mechanism.forward.structure.given:
        part = random.uniform(-1, 1, TRIES)
        away += part**2
        given.append(sketch.value(coordinate) + part * (np.pi if coordinate.quantity == "angle" else mechanism.size))
    poses = mechanism.forward.solve(given, changed, limits=False)
    if not poses.valid.any():
        return sketch
    return poses.take(int(np.argmin(np.where(poses.valid, away, np.inf))))


def drawn(mechanism: Mechanism, places: Mapping[str, Value]) -> Configuration:
    """The assembled sketch with other dimensions, the drives where they were drawn."""
    sketch = mechanism.sketch_configuration
    given = [sketch.value(coordinate) for coordinate in mechanism.forward.structure.given]
    return mechanism.forward.solve(given, places, limits=False)
