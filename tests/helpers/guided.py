"""Linkages that guide a body, stepped finely by closed forms: what they do between the positions of a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Floats

# Poses on a way; the sine of an angle that is none.
STEPS, NONE = 20_001, 1e-5


@dataclass(frozen=True)
class Guided:
    """A linkage by its row of solutions.csv, angles in degrees."""

    row: Mapping[str, Any]

    def _at(self, name: str) -> complex:
        return complex(self.row[f"{name}.x"], self.row[f"{name}.y"])

    def _normal(self, slide: str) -> complex:
        return complex(1j * np.exp(1j * np.radians(self.row[f"{slide}.direction"])))

    def drive(self, places: Complexes, turns: Complexes) -> Floats:
        """The crank's angle at positions of the body, or the body's where there is no crank."""
        if "crank" not in self.kind:
            return np.asarray(np.angle(turns))
        return np.asarray(np.angle(places + turns * self._at("coupler.A") - self._at("ground.O")))

    @property
    def kind(self) -> str:
        """Its kind, four-bars told as ones with a crank."""
        return str(self.row["kind"]).replace("four_bar", "four_bar with crank")

    def side(self, drive: Floats, places: Complexes, turns: Complexes) -> Floats:
        """In which of its assemblies the linkage is at positions of the body, 1 or -1."""
        a, b = (places + turns * self._at(f"coupler.{name}") for name in "AB")
        d = self._at("ground.D")
        if self.kind.startswith("four"):
            return np.sign((np.conj(d - a) * (b - a)).imag)
        if self.kind == "slider_crank":
            along = -1j * self._normal("rail")
            return np.sign(((b - a) * np.conj(along)).real)
        if self.kind == "inverted_slider_crank":
            along = turns * -1j * self._normal("guide")
            return np.sign(((d - a) * np.conj(along)).real)
        return np.sign(self.sine(drive))

    def sine(self, drive: Floats) -> Floats:
        """What is zero at a dead centre, and negative or of the other sign beyond; lengths over their longest."""
        d = self._at("ground.D")
        if self.kind == "trammel":
            return np.full(len(drive), (np.conj(self._normal("rail")) * self._normal("second_rail")).imag)
        if self.kind == "inverted_trammel":
            return np.full(len(drive), (np.conj(self._normal("guide")) * self._normal("second_guide")).imag)
        if self.kind == "conchoid":
            return (np.conj(self._normal("second_rail")) * self._normal("guide") * np.exp(1j * drive)).imag
        a = self._at("ground.O") + self.row["crank.length"] * np.exp(1j * drive)
        arm = self._at("coupler.B") - self._at("coupler.A")
        if self.kind.startswith("four"):
            reach, coupler, rocker = np.abs(d - a), abs(arm), self.row["rocker.length"]
            return np.minimum(coupler + rocker - reach, reach - abs(coupler - rocker)) / (coupler + rocker)
        if self.kind == "slider_crank":
            return 1 - np.abs(((d - a) * np.conj(self._normal("rail"))).real) / abs(arm)
        return 1 - np.abs((arm * np.conj(self._normal("guide"))).real) / np.abs(d - a)

    def passes(self, places: Complexes, turns: Complexes) -> bool:
        """Whether it passes all positions in their order, in one assembly and without a dead centre."""
        drive = self.drive(places, turns)
        side = self.side(drive, places, turns)
        if (side != side[0]).any():
            return False
        for direction in (1, -1):
            way = np.append(0.0, np.cumsum(np.mod(direction * np.diff(drive), 2 * np.pi)))
            poses = drive[0] + direction * np.linspace(0, way[-1], STEPS)
            sine = self.sine(poses) * (side[0] if self.kind == "conchoid" else 1)
            if self.kind.endswith("trammel"):
                sine = np.abs(sine)
            if way[-1] <= 2 * np.pi + 1e-9 and sine.min() > NONE**2:
                return True
        return False


def generates(row: Mapping[str, Any], inputs: Floats, outputs: Floats) -> bool:
    """Whether a four-bar between (0, 0) and (1, 0) turns its rocker as its crank says, in order (degrees).

    In one assembly, and between the inputs without a dead centre; a link may stand beyond its pivot from its pointer.
    """
    return any(_generates(row, inputs + one, outputs + other) for one in (0, 180) for other in (0, 180))


def _generates(row: Mapping[str, Any], inputs: Floats, outputs: Floats) -> bool:
    crank, coupler, rocker = (float(row[f"{name}.length"]) for name in ("crank", "coupler", "rocker"))

    def rocker_at(angles: Floats, side: float) -> tuple[Floats, Floats]:
        away = crank * np.exp(1j * angles) - 1
        reach = np.abs(away)
        cosine = (reach**2 + rocker**2 - coupler**2) / (2 * reach * rocker)
        room = np.minimum(coupler + rocker - reach, reach - abs(coupler - rocker)) / (coupler + rocker)
        return np.angle(away) + side * np.arccos(np.clip(cosine, -1, 1)), room

    for side in (1, -1):
        gap = rocker_at(np.radians(inputs), side)[0] - np.radians(outputs)
        # Of pairs that no linkage meets exactly, the error is that of the best.
        if np.abs(np.angle(np.exp(1j * gap))).max() > np.radians(row["max_error"]) + 1e-7:
            continue
        for direction in (1, -1):
            way = np.append(0.0, np.cumsum(np.mod(direction * np.diff(np.radians(inputs)), 2 * np.pi)))
            poses = np.radians(inputs[0]) + direction * np.linspace(0, way[-1], STEPS)
            if way[-1] <= 2 * np.pi + 1e-9 and rocker_at(poses, side)[1].min() > NONE**2:
                return True
    return False
