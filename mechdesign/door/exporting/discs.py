"""Cams and wheels as they are cut: cams along their profiles, as exactly as a cutter can follow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.door.exporting.drawing import DrawnCircle, Path, Shape, around
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.door.exporting.wheels import link_wheels, uncut
from mechdesign.ground.cautions import Caution
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.mechanism.algebra import cross
from mechdesign.mechanism.cams import CamFollower
from mechdesign.mechanism.plates import hull, joined

# By how much the lines between the corners of a profile may lie beside it (mm).
DEVIATION = 0.01
# Sides by which the circle around a pin is cut where the profile of a cam does not go all around it.
SIDES = 360


@dataclass(frozen=True)
class LinkDisc:
    """A cam or a wheel in the frame of its link, in millimetres: the closed curves that bound it, the outermost first.

    Between the first and the second there is material, between the second and the third a groove. `remark` says in
    words what it is, and `carried` are places of the link that it has to hold where it is all of it, beside the holes.
    """

    coupling: str
    curves: Sequence[Path | DrawnCircle]
    remark: str
    engraved: Sequence[Shape] = ()
    carried: Sequence[complex] = ()

    @property
    def outline(self) -> tuple[complex, ...]:
        """Places of the innermost curve."""
        curve = self.curves[-1]
        return tuple(curve.ends) if isinstance(curve, DrawnCircle) else curve.corners

    def holds(self, place: complex, radius: float) -> bool:
        """Whether there is material all around a hole."""
        around_it = 0
        for curve in self.curves:
            if isinstance(curve, DrawnCircle):
                away = abs(place - curve.place)
                if abs(away - curve.radius) < radius:
                    return False
                around_it += away < curve.radius
                continue
            ways = np.array(curve.corners) - place
            if np.abs(ways).min() < radius:
                return False
            around_it += bool(round(float(np.angle(np.roll(ways, -1) / ways).sum() / (2 * np.pi))))
        return around_it % 2 == 1


def discs_of(view: PosedStudy, link: str, kerf: float) -> list[LinkDisc]:
    """The cams and wheels of a link, with half of a kerf (mm) around the material; see `_disc`."""
    rim, points = 2 * view.millimetres * float(view.sizes.radius(link)), view.points(link).values()
    wheels = [
        LinkDisc(
            wheel.coupling, wheel.circles(rim, kerf), str(wheel), [DrawnCircle("engrave", wheel.centre, wheel.pitch)],
            [view.millimetres * point for point in points],
        )
        for wheel in link_wheels(view, link)
    ]  # fmt: skip
    cams = (_disc(view, cam, kerf) for cam in _cams(view, link))
    return [*(cam for cam in cams if cam is not None), *wheels]


def replace_plate(discs: Sequence[LinkDisc], holes: Iterable[tuple[complex, float]]) -> bool:
    """Whether cams and wheels are all of their link: every hole, by centre and radius, lies in each of them."""
    return bool(discs) and all(
        disc.holds(*place) for disc in discs for place in (*holes, *((place, 0.0) for place in disc.carried))
    )


def open_profiles(view: PosedStudy, link: str) -> list[Path]:
    """The profiles of a link that bound no part, as lines to engrave."""
    cams = [cam for cam in _cams(view, link) if _disc(view, cam, 0.0) is None]
    profiles = [_profile(view, cam, side, 0.0) for cam in cams for side in cam.sides]
    return [Path.line("engrave", profile[np.isfinite(profile)].tolist()) for profile in profiles]


def followers(view: PosedStudy) -> dict[str, list[Shape]]:
    """The rollers and flat faces on the cams of a mechanism in the pose that is shown, in millimetres."""
    shapes: dict[str, list[Shape]] = {}
    for cam in view.mechanism.cams:
        center, scale = complex(view.pose.nodes[cam.node]), view.millimetres
        shape: Shape = DrawnCircle("links", scale * center, scale * float(cam.roller(view.pose)))
        if cam.flat:
            shape = Path.line(
                "links", [scale * (center + end * complex(cam.along_face(view.pose))) for end in cam.face]
            )
        shapes[f"follower of {cam.coupling}"] = [shape]
    return shapes


def cautions(view: PosedStudy) -> Iterator[Caution]:
    """Warnings of cams and wheels that cannot be cut as they should."""
    yield from uncut(view)
    for cam in view.mechanism.cams:
        if _disc(view, cam, 0.0) is None:
            message = f"cam {cam.coupling}: its profile bounds no part: it is engraved on '{cam.links[1]}', and not cut"
            yield Caution("cam", message)
        elif cam.undercut:
            yield Caution("cam", f"cam {cam.coupling}: its profile is undercut, and the line of the cut crosses itself")


def _cams(view: PosedStudy, link: str) -> list[CamFollower]:
    return [cam for cam in view.mechanism.cams if cam.links[1] == link]


def _disc(view: PosedStudy, cam: CamFollower, kerf: float) -> LinkDisc | None:
    """A cam to cut; None where its profile bounds no part.

    A ring and a cam with a groove have a rim as wide as the link. The ends of a profile of a part of a turn are joined
    to the plate around the pins of the link.
    """
    link, scale = cam.links[1], view.millimetres
    remark = f"profile of cam {cam.coupling}, within {DEVIATION:g} mm"
    layer, radius = "pocket" if len(cam.sides) > 1 else "cut", scale * float(view.sizes.radius(link))
    outer, *inner = [_profile(view, cam, side, kerf).tolist() for side in cam.sides[::-1]]
    if not np.isfinite([outer, *inner]).all():
        return None
    if cam.closed:
        curves = [Path.line(layer, profile[:-1]).close() for profile in (outer, *inner)]
        rim = around("cut", outer, 2 * radius + kerf)
        ringed = cam.sides != ("outer",) and isinstance(rim, Path)
        return LinkDisc(cam.coupling, [rim, *curves] if ringed else curves, remark)
    points, pins = view.points(link), joined(view.mechanism.description)
    holes = [(scale * points[point], scale * float(view.sizes.pin(point))) for point in points if point in pins]
    for places in ([scale * place for place in points.values()], [place for place, _ in holes]):
        for outline in _joined_to_plate(outer, places, radius + kerf / 2):
            disc = LinkDisc(cam.coupling, [Path.line("cut", outline).close()], remark)
            if layer == "cut" and holes and replace_plate([disc], holes):
                return disc
    return None


def _joined_to_plate(profile: list[complex], places: Sequence[complex], radius: float) -> Iterator[list[complex]]:
    """A profile with the hull of its ends and a plate around some places behind it, where it meets no other part of it.

    In the one sense in which it bounds the plate, and in the other.
    """
    circle = radius * np.exp(2j * np.pi * np.arange(SIDES) / SIDES)
    corners = hull([profile[0], profile[-1], *(place + way for place in places for way in circle.tolist())])
    if profile[0] in corners and profile[-1] in corners:
        for along in (profile, profile[::-1]):
            last = corners.index(along[-1])
            behind = [*corners[last:], *corners[:last]]
            behind = behind[: behind.index(along[0]) + 1]
            if not _crosses(np.array(along), np.array(behind)):
                yield along + behind[1:-1]


def _crosses(one: Complexes, other: Complexes) -> bool:
    """Whether two lines through some places cross each other anywhere but at their ends."""
    a, b, c, d = one[:-1, None], one[1:, None], other[None, :-1], other[None, 1:]
    apart = cross(b - a, c - a) * cross(b - a, d - a) < 0
    return bool(np.any(apart & (cross(d - c, a - c) * cross(d - c, b - c) < 0)))


def _profile(view: PosedStudy, cam: CamFollower, side: str, kerf: float) -> Complexes:
    scale = view.millimetres
    return scale * cam.cut(side, kerf / 2 / scale, DEVIATION / scale)
