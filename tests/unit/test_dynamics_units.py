"""The same mechanism in other units has the same forces, whether its numbers name their units or not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from helpers.studies import study_of

import mechdesign

# A unit in SI, by what it measures.
SI = {
    "length": {"m": 1.0, "mm": 1e-3, "in": 0.0254}, "mass": {"kg": 1.0, "g": 1e-3}, "time": {"s": 1.0, "min": 60.0},
    "force": {"N": 1.0, "kN": 1e3}, "angle": {"rad": 1.0, "deg": math.pi / 180},
}  # fmt: skip
SYSTEMS = [
    ("m", "rad", "N", "kg", "s"), ("mm", "deg", "N", "kg", "s"), ("m", "deg", "kN", "g", "min"),
    ("mm", "rad", "kN", "kg", "min"), ("in", "deg", "N", "g", "s"),
]  # fmt: skip


class System:
    """Units of length, angle, force, mass and time, and the text of a study in them."""

    def __init__(self, *names: str) -> None:
        self.names = dict(zip(("length", "angle", "force", "mass", "time"), names, strict=True))
        self.one = {kind: SI[kind][name] for kind, name in self.names.items()}

    def number(self, value: float, **powers: int) -> float:
        """A number in SI in these units."""
        return value / math.prod(self.one[kind] ** power for kind, power in powers.items())

    def text(self, *, plain: bool) -> str:
        """The study with plain numbers, or with quantities in SI."""

        def told(value: float, unit: str, **powers: int) -> str:
            return repr(self.number(value, **powers)) if plain else f"{value!r} {unit}"

        def length(value: float) -> str:
            return told(value, "m", length=1)

        def inertia(value: float) -> str:
            return told(value, "kg*m^2", mass=1, length=2)

        # An expression has no unit but the study's.
        drag = self.number(-30.0, force=1, length=-1, time=1)
        units = ", ".join(f"{kind}: {name}" for kind, name in self.names.items())
        return f"""
units: {{{units}}}
mechanism:
  links:
    ground: {{O: [0, 0], D: [{length(0.3)}, {length(0.02)}], S: [{length(-0.1)}, {length(0.2)}]}}
    crank: {{from: O, to: A, length: {length(0.08)}, mass: {told(0.7, "kg", mass=1)}, inertia: {inertia(2e-3)}}}
    rod:
      {{from: A, to: B, length: {length(0.25)}, mass: {told(0.4, "kg", mass=1)}, inertia: {inertia(3e-3)},
       center: [{length(0.1)}, {length(0.03)}]}}
    rocker: {{from: D, to: B, length: {length(0.2)}, mass: {told(1.1, "kg", mass=1)}}}
    ram:
      {{from: S, to: P, telescopic: true, mass: {told(0.2, "kg", mass=1)}, rod: {{mass: {told(0.3, "kg", mass=1)}}}}}
    plate: {{P: [0, 0], O: [{length(0.15)}, 0]}}
  springs:
    pull:
      {{between: [S, B], stiffness: {told(800.0, "N/m", force=1, length=-1)}, free_length: {length(0.1)},
       preload: {told(4.0, "N", force=1)}, damping: {told(6.0, "N*s/m", force=1, time=1, length=-1)}}}
    gas:
      {{between: [O, rod.B], force: {told(90.0, "N", force=1)}, rise: {told(200.0, "N/m", force=1, length=-1)},
       free_length: {length(0.3)}}}
    twist:
      {{between: [ground, rocker], stiffness: {told(2.0, "N*m/rad", force=1, length=1)},
       free_angle: {told(0.5, "rad", angle=1)}, damping: {told(0.05, "N*m*s/rad", force=1, length=1, time=1)}}}
  drives: {{theta: {{angle: crank}}, stroke: {{length: ram}}}}
  sketch:
    {{A: [{length(0.04)}, {length(0.07)}], B: [{length(0.25)}, {length(0.21)}], P: [{length(-0.05)}, {length(0.14)}]}}
dynamics:
  gravity: [{told(1.0, "m/s^2", length=1, time=-2)}, {told(-9.81, "m/s^2", length=1, time=-2)}]
  poses:
    - {{theta: {told(1.0, "rad", angle=1)}, stroke: {length(0.09)}}}
    - {{theta: {told(1.7, "rad", angle=1)}, stroke: {length(0.11)}}}
  rates: {{theta: {told(12.0, "rad/s", angle=1, time=-1)}, stroke: {told(0.2, "m/s", length=1, time=-1)}}}
  accelerations: {{theta: {told(40.0, "rad/s^2", angle=1, time=-2)}}}
  loads:
    - {{at: B, force: [{told(15.0, "N", force=1)}, "{drag!r} * B.y_velocity"]}}
    - {{link: rocker, moment: {told(-3.0, "N*m", force=1, length=1)}}}
    - {{between: [A, D], force: {told(7.0, "N", force=1)}}}
"""

    def si(self, table: mechdesign.Table) -> dict[str, np.ndarray]:
        """The columns of a table in SI."""
        values = {}
        for column in table.columns:
            if column.values.dtype.kind == "f":
                parts = [part.partition("/") for part in column.unit.split("*")]
                names = [(name, 1) for name, _, _ in parts] + [(under, -1) for _, _, under in parts if under]
                flat = {name: one for kind in SI.values() for name, one in kind.items()}
                values[column.name] = column.values * math.prod(flat.get(name, 1.0) ** power for name, power in names)
        return values


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("names", SYSTEMS[1:], ids="-".join)
def test_units_do_not_change_forces(names: tuple[str, ...], plain: bool) -> None:
    reference, system = System(*SYSTEMS[0]), System(*names)
    expected = mechdesign.dynamics(study_of(reference.text(plain=True)))
    result = mechdesign.dynamics(study_of(system.text(plain=plain)))
    for name in ("dynamics", "joint_forces"):
        one, other = reference.si(expected.tables[name]), system.si(result.tables[name])
        assert one.keys() == other.keys()
        for column, values in one.items():
            assert np.isfinite(other[column]).any(), column
            size = np.nanmax(np.abs(values))
            np.testing.assert_allclose(other[column], values, rtol=1e-11, atol=1e-12 * (1 + size), err_msg=column)
