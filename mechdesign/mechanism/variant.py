"""The same mechanism with other dimensions: nothing of its topology is compiled again, and its assembly stays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mechdesign.errors import AssemblyError
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.model import Description
from mechdesign.mechanism.plan import Plan


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
        if found.valid:
            return replace(found, places={})
        if self.forward.iterative:
            raise AssemblyError("the sketch cannot be assembled with these dimensions")
        # Closed forms need no start: the original's drawing stays for what is measured from it.
        return self.original.sketch_configuration


def drawn(mechanism: Mechanism, places: Mapping[str, Value]) -> Configuration:
    """The assembled sketch with other dimensions, the drives where they were drawn."""
    sketch = mechanism.sketch_configuration
    given = [sketch.value(coordinate) for coordinate in mechanism.forward.structure.given]
    return mechanism.forward.solve(given, places, limits=False)
