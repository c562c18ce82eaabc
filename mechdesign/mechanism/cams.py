"""Cams: profile, pressure angle and contact force of the motion that a coupling prescribes.

Against the cam the centre c of a roller of radius r, or a point c of a flat face along the unit vector u, moves with
the rates c' and c'' of the loop equations, and the face turns with the rates t' and t''. With the unit normal n out of
the cam, the profile is the envelope of the roller or of the face, and rho its radius of curvature, positive where the
cam is convex:

    roller:  c' . n = 0,   p = c - r n,   rho = -|c'|^2/(n . c'') - r
    face:    p = c + q u,  q = -(u x c')/t',  rho = -(n . i u) (2 u . c' - (u x c'')/t' - q t''/t')/t'

The pressure angle is that from the velocity v of the follower where it is touched, the cam held, to n. By virtual work
an effort Q on the coordinate that follows, which moves the follower with v for each unit, is a force Q/(v . n) along n.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mechdesign.ground.numerics.arrays import Complexes, Flags, Floats
from mechdesign.mechanism.algebra import TURN, Value, Vector, cross, dot, norm2, rotation, wrap
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.elements.couplings import Cam, play
from mechdesign.mechanism.geometry import Geometry
from mechdesign.mechanism.graph import Turn
from mechdesign.mechanism.outputs import Rates, first
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.wheels import Mesh, Pressed

# A cam's follower moves by less than this part of the mechanism's size where another drive does not move it.
UNMOVED = 1e-9
# A profile is not divided more finely than into so many parts.
MOST_PARTS = 100_000
# The ends of a profile that closes meet within this part of its size, as do both sides of each place without a corner.
CLOSED = 1e-6
# Poses lie on the profile up to this part of its range beyond its ends.
SLACK = 1e-9
# Halvings by which a step over a smooth profile becomes shorter than half of itself, and those that find a corner.
HALVINGS = (2, 30)


class Touch(NamedTuple):
    """Where a follower touches a cam, in the world.

    Attributes
    ----------
    place, normal : complex
        The place on the profile, and the unit normal out of the cam.
    pressure_angle : float
        From the follower's velocity to the normal, between -pi/2 and pi/2.
    radius : float
        Radius of curvature of the profile, positive where it is convex.
    pitch : float
        Curvature of the pitch curve, 1/(radius + roller); of a flat face 1.
    face : float
        Place along a flat face from its point; nan of a roller.
    lever : float
        How fast the follower moves along the normal for each unit of its coordinate.
    swept : float
        Rate of twice the area that the pitch curve sweeps about the origin of the cam's frame, seen along the normal.
    """

    place: Vector
    normal: Vector
    pressure_angle: Value
    radius: Value
    pitch: Value
    face: Value
    lever: Value
    swept: Value


@dataclass(frozen=True, eq=False)
class CamFollower:
    """The cam of a coupling with its follower.

    Parameters
    ----------
    coupling, index : str, int
        Name and number of the coupling.
    followed, follower : Coordinate
        The coordinates that it couples.
    links : tuple of str
        The follower's body, then the cam.
    node, base : int
        Nodes of the centre of the roller, or of a point of the flat face, and of a point of the cam.
    turns : sequence of Turn
        From the x axis of the follower to its flat face.
    forward, plan : Plan
        Plans of the drives, and with the coordinate that is followed in place of one of them.
    """

    coupling: str
    index: int
    given: Cam
    followed: Coordinate
    follower: Coordinate
    links: tuple[str, str]
    node: int
    base: int
    turns: Sequence[Turn]
    forward: Plan
    plan: Plan

    @property
    def nodes(self) -> tuple[int, int]:
        """Nodes of the roller's centre, or of a point of the flat face, and of a point of the cam."""
        return self.node, self.base

    @property
    def presses(self) -> bool:
        """The contact force is known."""
        return True

    @property
    def flat(self) -> bool:
        """Whether its follower has a flat face."""
        return self.given.radius is None

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides of the profile that it has."""
        return ("outer", "inner") if self.given.side == "groove" else (self.given.side,)

    @property
    def _geometry(self) -> Geometry:
        return self.forward.core.geometry

    def roller(self, configuration: Configuration) -> Value:
        """Radius of the roller; 0 of a flat face."""
        radius = self.given.radius
        return 0.0 if radius is None else self._geometry.term(radius, configuration.places)

    def local(self, configuration: Configuration, place: Vector) -> Vector:
        """A place of the world in the cam's frame."""
        name = configuration.graph.nodes[self.base]
        origin = self._geometry.local(self.links[1], name, configuration.places)
        way = place - configuration.nodes[self.base]
        local: Vector = origin + way * np.conj(configuration.body_rotation(self.links[1]))
        return local

    def along(self, values: Floats, places: dict[str, Floats] | None = None) -> Configuration:
        """Poses in which the coordinate that is followed has these values, other drives as in the sketch."""
        drawn = self.plan.core.sketch_configuration
        given = [values if c.name == self.followed.name else drawn.value(c) for c in self.plan.structure.given]
        return self.plan.solve(given, places, limits=False)

    def outside(self, configuration: Configuration) -> Flags:
        """Poses at which what is followed lies beyond the profile; whole turns aside where the law repeats."""
        first, last = self.given.range
        slack = SLACK * (last - first)
        away = np.asarray(configuration.value(self.followed)) - first + slack
        away = np.mod(away, TURN) if self._repeats else away
        return np.asarray((away < 0) | (away > last - first + 2 * slack))

    @cached_property
    def _repeats(self) -> bool:
        """Whether the law is the same a turn of the cam later."""
        if self.followed.quantity != "angle":
            return False
        one, other = (self.along(self.values + shift) for shift in (0.0, TURN))
        lift, later = (np.broadcast_to(np.asarray(part.value(self.follower)), part.shape) for part in (one, other))
        away = later - lift
        if self.follower.quantity == "angle":
            away = wrap(away)
        return bool(np.abs(away).max() <= CLOSED * np.ptp(lift))

    @property
    def values(self) -> Floats:
        """Values of the coordinate that is followed over the whole profile."""
        return np.linspace(*self.given.range, self.given.steps + 1)

    @cached_property
    def _whole(self) -> Configuration:
        """Poses over the whole profile, at the nominal dimensions."""
        return self.along(self.values)

    @cached_property
    def outlines(self) -> list[Complexes]:
        """The profile in the cam's frame, of each of its sides."""
        return [self._outline(self._whole, side, 0.0) for side in self.sides]

    def _outline(self, configuration: Configuration, side: str, away: float) -> Complexes:
        touch = self.touch(configuration, side)
        return np.asarray(self.local(configuration, touch.place + away * touch.normal))

    def cut(self, side: str, away: float, deviation: float) -> Complexes:
        """The curve at a distance out of the cam along the normals of one of its sides, in the cam's frame.

        Lines from place to place lie beside it by less than `deviation`.
        """
        parts = 2 * self.given.steps
        while True:
            outline = self._outline(self.along(np.linspace(*self.given.range, parts + 1)), side, away)
            chord, arm = outline[2::2] - outline[:-2:2], outline[1::2] - outline[:-2:2]
            beside = np.abs(cross(chord, arm)) / np.abs(chord)
            if not np.any(beside > deviation) or parts > MOST_PARTS:
                return outline
            parts *= 2

    @property
    def closed(self) -> bool:
        """Whether the profile ends where it begins."""
        outline = self.outlines[0]
        return bool(abs(outline[-1] - outline[0]) <= CLOSED * (np.ptp(outline.real) + np.ptp(outline.imag)))

    @cached_property
    def corners(self) -> Floats:
        """Values of the coordinate that is followed at which the law has a corner and the profile jumps.

        There a step of the profile, of its place and its normal, stays as long as it is halved.
        """
        touch = self.touch(self._whole)
        low, high = self.values[:-1], self.values[1:]
        at = self._frame(self._whole, touch)
        size = np.abs(at[0]).max(initial=0.0, where=np.isfinite(at[0]))
        begin, end = at[:, :-1], at[:, 1:]

        def length(one: Complexes, other: Complexes) -> Floats:
            return np.asarray(np.abs(one[0] - other[0]) / size + np.abs(one[1] - other[1]))

        whole = length(begin, end)
        for halvings in range(HALVINGS[1]):
            if halvings == HALVINGS[0]:
                long = length(begin, end) > whole / 2
                low, high, begin, end = low[long], high[long], begin[:, long], end[:, long]
            if not len(low):
                return low
            middle = (low + high) / 2
            configuration = self.along(middle)
            at = self._frame(configuration, self.touch(configuration))
            first_half = length(begin, at) > length(at, end)
            low, high = np.where(first_half, low, middle), np.where(first_half, middle, high)
            begin, end = np.where(first_half, begin, at), np.where(first_half, at, end)
        return low[length(begin, end) > CLOSED]

    def _frame(self, configuration: Configuration, touch: Touch) -> Complexes:
        """Place and normal of the profile in the cam's frame."""
        normal = touch.normal * np.conj(configuration.body_rotation(self.links[1]))
        place = self.local(configuration, touch.place)
        return np.stack(np.broadcast_arrays(place, normal)).astype(complex)

    def undercuts(self, radius: Value, roller: Value) -> Flags:
        """Where a profile of some radius of curvature loses what the roller, or a flat face, has touched before."""
        return np.asarray((np.asarray(radius) <= 0) & (self.flat | np.asarray(radius > -roller)))

    @property
    def undercut(self) -> bool:
        """Whether its profile is undercut anywhere, at the nominal dimensions."""
        radii = (self.touch(self._whole, side).radius for side in self.sides)
        return any(self.undercuts(radius, self.roller(self._whole)).any() for radius in radii)

    @cached_property
    def face(self) -> tuple[float, float]:
        """First and last place along a flat face that the cam touches, from the face's point; 0 of a roller."""
        places = np.asarray(self.touch(self._whole).face)
        return (0.0, 0.0) if np.isnan(places).all() else (float(np.nanmin(places)), float(np.nanmax(places)))

    def along_face(self, configuration: Configuration) -> Vector:
        """Unit vector of a flat face in the world."""
        turned = rotation(self._geometry.angle(self.turns, configuration.places))
        along: Vector = configuration.body_rotation(self.links[0]) * turned
        return along

    @cached_property
    def _out(self) -> float:
        """Sign by which the normal leads out of the cam: the origin of its frame lies inside of the outer profile."""
        return 1.0 if np.nansum(self._touch(self._whole, 1.0).swept) >= 0 else -1.0

    def touch(self, configuration: Configuration, side: str = "") -> Touch:
        """Where the follower touches the cam; of a groove on its outer profile, if not on the other `side`."""
        return self._touch(configuration, -self._out if (side or self.sides[0]) == "inner" else self._out)

    def _touch(self, configuration: Configuration, out: float) -> Touch:
        linear = Linearization(self.forward.structure, self._geometry, configuration)
        velocity = self.driven(linear)
        acceleration = linear.acceleration(velocity, [0.0] * len(linear.structure.given))
        frames = [linear.graph.bodies[body][0] for body in self.links]
        center, radius = configuration.nodes[self.node], self.roller(configuration)
        moved = self.against(velocity, center, configuration)
        turn, bend = velocity.angles[frames[1]], acceleration.angles[frames[1]]
        relative = velocity.nodes[self.node] - velocity.nodes[self.base]
        arm = center - configuration.nodes[self.base]
        fall = acceleration.nodes[self.node] - acceleration.nodes[self.base]
        curved = fall - 1j * bend * arm - 2j * turn * relative - turn * turn * arm
        face: Value = np.nan
        if self.flat:
            along = self.along_face(configuration)
            spin = velocity.angles[frames[0]] - turn
            face = -cross(along, moved) / spin
            place = touched = center + face * along
            normal = -1j * out * along
            speed_up = face * (acceleration.angles[frames[0]] - bend)
            size = out * (2 * dot(along, moved) - (cross(along, curved) + speed_up) / spin) / spin
            pitch, pace = 1.0 + 0.0 * size, np.abs(spin)
        else:
            speed = np.abs(moved)
            normal = -1j * out * moved / speed
            pitch, pace = -dot(normal, curved) / norm2(moved), speed
            place, touched, size = center - radius * normal, center, 1 / pitch - radius
        own = self.own(linear, velocity, touched)
        pressure = np.arctan(cross(own, normal) / dot(own, normal))
        turned = normal * np.conj(configuration.body_rotation(self.links[1]))
        swept = pace * dot(self.local(configuration, center), turned)
        return Touch(place, normal, pressure, size, pitch, face, dot(own, normal), swept)

    def driven(self, linear: Linearization) -> Rates:
        """Velocities for each unit of what is followed, with the least rates of the drives."""
        slopes = [first(linear.configuration, self.followed, rates) for rates in linear.by_drives]
        square = sum(slope * slope for slope in slopes)
        return linear.velocity([slope / square for slope in slopes])

    def own(self, linear: Linearization, velocity: Rates, place: Vector) -> Vector:
        """How a place of the follower moves for each unit of its coordinate while the cam is held.

        That is by play between them, the drives moved back; `velocity` is that of `driven`.
        """
        parted = linear.sensitivity([play(self.coupling)])
        back = first(linear.configuration, self.followed, parted)
        own = self.against(parted, place, linear.configuration)
        moved: Vector = np.atleast_1d(own - back * self.against(velocity, place, linear.configuration))[0]
        return moved

    def against(self, rates: Rates, place: Vector, configuration: Configuration) -> Vector:
        """Rate of a place of the follower against the cam."""
        frames = [configuration.graph.bodies[body][0] for body in self.links]
        follower, cam = (
            rates.nodes[node] + 1j * rates.angles[frame] * (place - configuration.nodes[node])
            for node, frame in zip((self.node, self.base), frames, strict=True)
        )
        way: Vector = follower - cam
        return way

    def place(self, configuration: Configuration) -> Vector:
        """Where the follower touches the cam."""
        return self.touch(configuration).place

    def lever(self, configuration: Configuration) -> Value:
        """How fast the follower moves along the normal for each unit of its coordinate."""
        return self.touch(configuration).lever

    def press(self, configuration: Configuration, effort: Value, pressed: Value | None = None) -> Pressed:
        """The contact force on the follower of an effort on its coordinate."""
        touch = self.touch(configuration)
        normal: Value = effort / touch.lever
        return Pressed(touch.place, normal * touch.normal, normal)


# Two links that touch as a coupling has them move: wheels, or a cam and its follower.
Engagement = Mesh | CamFollower
