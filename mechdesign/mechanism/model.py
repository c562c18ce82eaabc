"""A planar mechanism as data: links, joints, drives, measures, limits, and the numbers they depend on.

Every number of the geometry is a *place* with a name (``rod.length``, ``ground.G.y``, ``guide.direction``,
``limits.0.min``). A `Term` is either the name of a place or a plain number. Lengths are in the study's unit,
angles in radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from mechdesign.expressions import Expression
from mechdesign.mechanism.algebra import Value

Term = str | float
Quantity = Literal["length", "angle", "none"]
# Kinds of numbers of masses and springs, as `mechdesign.study.text.units.KINDS` has them.
Physical = Literal[
    "mass", "moment_of_inertia", "force", "moment", "stiffness", "rotational_stiffness", "damping", "rotational_damping"
]  # fmt: skip

# Prefix of places that are not dimensions of a part: parameters that measures use, and the play of couplings. No name
# in a study has a colon.
MEASURED = "measures:"
# Prefix of the angles of torsion springs.
WOUND = "wound:"


def play(coupling: str) -> str:
    """Name of the place by which the coordinate that follows deviates from a coupling's function; nominally 0."""
    return f"{MEASURED}{coupling}.play"


@dataclass(frozen=True)
class Place:
    """One number of the mechanism: its name, nominal value (angles in radians, else the study's unit) and kind."""

    name: str
    nominal: float
    quantity: Quantity | Physical = "length"
    in_coupling: bool = False  # whether the function of a coupling names it


@dataclass(frozen=True)
class Link:
    """A rigid link, or a telescopic leg (two bodies and a slide), whose length is a coordinate.

    `points` has the coordinates (x, y) of each point in the link's frame. The x axis of a binary or telescopic link
    runs from its first end, at (0, 0), to its second, at (length, 0); the second end of a telescopic leg is not among
    its points.
    """

    name: str
    points: Mapping[str, tuple[Term, Term]]
    ends: tuple[str, str] | None = None
    telescopic: bool = False

    @property
    def corners(self) -> tuple[str, ...]:
        """The points between which its beams run where it bends; of a telescopic link a single beam."""
        return self.ends or tuple(self.points)

    @property
    def tip(self) -> str | None:
        """The second end of a telescopic leg, which is on its rod; None of a rigid link."""
        return self.ends[1] if self.telescopic and self.ends is not None else None

    @property
    def all_points(self) -> tuple[str, ...]:
        """Names of its points, its ends first, with the tip of a telescopic leg."""
        return tuple(dict.fromkeys((*(self.ends or ()), *self.points)))


@dataclass(frozen=True)
class Mass:
    """Mass of a body, its centre in the body's frame, and its moment of inertia about this centre.

    Without a centre it is the middle of some `points` of the body, its joints. A `slender` one is a bar between these,
    two, whose inertia follows; one that is `left_out` is 0, of a point mass.
    """

    mass: Term | Value
    center: tuple[Term | Value, Term | Value] | None = None
    inertia: Term | Value = 0.0
    points: tuple[str, ...] = ()
    slender: bool = False
    left_out: bool = False


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two points, or with `turning` between two links, the second from the first.

    It pulls its points together, or turns its links back, with ``preload - push + stiffness (x - free) + damping x'``,
    x the distance or the angle.
    """

    name: str
    between: tuple[str, str]
    turning: bool
    stiffness: Term = 0.0
    free: Term = 0.0
    preload: Term = 0.0
    push: Term = 0.0
    damping: Term = 0.0


@dataclass(frozen=True)
class Friction:
    """Coulomb friction of a joint: of a pin with its `radius`, of a slide with the `length` of its guide, if given."""

    joint: str
    coefficient: Term
    radius: Term | None = None
    length: Term | None = None


@dataclass(frozen=True)
class Line:
    """A line fixed in a link: through a point, at an angle to the link's x axis or towards a second point."""

    link: str
    through: str | None
    direction: Term = 0.0
    toward: str | None = None


@dataclass(frozen=True)
class Prismatic:
    """Point `point` of `slider` slides along `line`; the slider's x axis stays at `angle` to the line."""

    name: str
    line: Line
    slider: str
    point: str
    angle: Term = 0.0

    @property
    def links(self) -> tuple[str, ...]:
        """The link that carries the line, and the slider."""
        return self.line.link, self.slider


@dataclass(frozen=True)
class Slot:
    """A pin, `point` of another link, slides along `line` and is free to turn."""

    name: str
    line: Line
    point: str

    @property
    def links(self) -> tuple[str, ...]:
        """The link that carries the line."""
        return (self.line.link,)


@dataclass(frozen=True)
class Fixed:
    """Links clamped at a shared point, the x axis of the second at `angle` to the first's."""

    name: str
    links: tuple[str, str]
    point: str
    angle: Term = 0.0


Joint = Prismatic | Slot | Fixed


@dataclass(frozen=True)
class Drive:
    """An actuated coordinate: a link's angle (absolute or relative), a leg's length, or a joint's slide."""

    name: str
    kind: Literal["angle", "length", "slide"]
    target: str
    reference: str = "ground"


@dataclass(frozen=True)
class Measure:
    """A named quantity: the angle from link a's x axis to b's, the distance of two points, or an expression.

    A name in an expression is a parameter if there is a place of that name behind `MEASURED`, else a coordinate.
    """

    name: str
    kind: Literal["angle", "distance", "expression"]
    items: tuple[str, str] | None = None
    expression: Expression | None = None


@dataclass(frozen=True)
class Cam:
    """A cam, and the roller or the flat face of its follower.

    `face` is the line of a flat face; of a roller, with its `radius`, only the point counts. The profile is that for
    values of the coordinate that is followed from the first to the last of `span` (radians, or the study's unit), in
    `steps`. The follower runs on one of its sides, ``outer`` or ``inner``, or in a ``groove`` with both.
    """

    link: str
    face: Line
    radius: Term | None
    side: str
    span: tuple[float, float]
    steps: int


@dataclass(frozen=True)
class Coupling:
    """A coordinate that follows others: a gear, a rack, a belt, a cam, or electronic gearing.

    `of` gives the value of coordinate `sets` from coordinates and parameters, both in the study's units. A name in it
    is a parameter as in a `Measure`, or a place of the coupling's own. Its `wheels` are gears, whose teeth have a
    `pressure_angle` (radians), or pulleys of a belt with the `radius` of the one that follows; or it is a `cam`.
    """

    name: str
    sets: str
    of: Expression
    wheels: str = "gears"
    pressure_angle: float = 0.0
    radius: float = 0.0
    cam: Cam | None = None


@dataclass(frozen=True)
class Plates:
    """Links as flat plates with round ends, and the pins of their joints; lengths are places or numbers.

    `width` and `pin` (the diameter of a pin; None: a part of the width) are those of links and points that `widths` and
    `pins` do not name. `layers` are the layers of links that have one, from 1 on. A cut takes `kerf`.
    """

    width: Term
    pin: Term | None = None
    thickness: Term | None = None
    kerf: Term = 0.0
    sheet: Term | None = None
    widths: Mapping[str, Term] = field(default_factory=dict)
    pins: Mapping[str, Term] = field(default_factory=dict)
    layers: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Limit:
    """Bounds of a distance of two points, a drive, the angle between two links, or a measure."""

    kind: Literal["distance", "drive", "angle", "measure"]
    items: tuple[str, ...]
    minimum: Term | None = None
    maximum: Term | None = None
    label: str = ""


@dataclass(frozen=True)
class Description:
    """All that the study says about the mechanism, resolved to names and numbers.

    `sketch` has rough positions of points in the world. Where two assemblies meet, `branch` ``side`` keeps each joint
    on its side and ``follow`` goes on smoothly. `angle_unit` is the study's unit of angle in radians, for measure
    expressions, messages and `Mechanism.solve`. `masses` are by body: of a telescopic leg two.
    """

    places: Mapping[str, Place]
    links: Mapping[str, Link]
    joints: Mapping[str, Joint] = field(default_factory=dict)
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
