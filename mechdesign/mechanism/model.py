"""A planar mechanism as data: links, joints, drives, measures, limits, and the numbers they depend on.

Every number of the geometry is a *place* with a name (``rod.length``, ``ground.G.y``, ``guide.direction``,
``limits.0.min``). A `Term` is either the name of a place or a plain number. Lengths are in the study's unit,
angles in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mechdesign.mechanism.elements.couplings import Coupling
from mechdesign.mechanism.elements.declared import Physical, Quantity
from mechdesign.mechanism.elements.drives import Drive
from mechdesign.mechanism.elements.joints import AnyJoint, Friction
from mechdesign.mechanism.elements.links import Link, Mass
from mechdesign.mechanism.elements.measures import Limit, Measure
from mechdesign.mechanism.elements.plates import Plates
from mechdesign.mechanism.elements.springs import Spring

# Prefix of the angles of torsion springs.
WOUND = "wound:"


@dataclass(frozen=True)
class Place:
    """One number of the mechanism: its name, nominal value (angles in radians, else the study's unit) and kind.

    `path` is where a study's mechanism says it; empty of what is no dimension of a part. `least` is its least value,
    which is excluded with `exclusive`.
    """

    name: str
    nominal: float
    quantity: Quantity | Physical = "length"
    path: tuple[str | int, ...] = ()
    least: float | None = None
    exclusive: bool = False
    in_coupling: bool = False  # whether the function of a coupling names it


@dataclass(frozen=True)
class Description:
    """All that the study says about the mechanism, resolved to names and numbers.

    `sketch` has rough positions of points in the world. Where two assemblies meet, `branch` ``side`` keeps each joint
    on its side and ``follow`` goes on smoothly. `angle_unit` is the study's unit of angle in radians, for measure
    expressions, messages and `Mechanism.solve`. `masses` are by body: of a telescopic leg two.
    """

    places: Mapping[str, Place]
    links: Mapping[str, Link]
    joints: Mapping[str, AnyJoint] = field(default_factory=dict)
    drives: Mapping[str, Drive] = field(default_factory=dict)
    measures: Mapping[str, Measure] = field(default_factory=dict)
    limits: tuple[Limit, ...] = ()
    sketch: Mapping[str, complex] = field(default_factory=dict)
    branch: Literal["side", "follow"] = "side"
    angle_unit: float = 1.0
    masses: Mapping[str, Mass] = field(default_factory=dict)
    springs: Mapping[str, Spring] = field(default_factory=dict)
    couplings: Mapping[str, Coupling] = field(default_factory=dict)
    friction: Mapping[str, Friction] = field(default_factory=dict)
    plates: Plates | None = None
