"""Cams as they are cut: along their profiles, as exactly as a cutter can follow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mechdesign.door.exporting.drawing import DrawnCircle, Path, Shape, around
from mechdesign.door.exporting.view import PosedStudy
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
class CamDisc:
    """A cam in the frame of its link, in millimetres: the closed curves that bound it, the outermost first.

    Between the first and the second there is material, between the second and the third a groove.
    """

    coupling: str
    curves: Sequence[Path]

    def holds(self, place: complex, radius: float) -> bool:
        """Whether there is material all around a hole."""
        around_it = 0
        for curve in self.curves:
            ways = np.array(curve.corners) - place
            if np.abs(ways).min() < radius:
                return False
            around_it += bool(round(float(np.angle(np.roll(ways, -1) / ways).sum() / (2 * np.pi))))
        return around_it % 2 == 1


def discs_of(view: PosedStudy, link: str, kerf: float) -> list[CamDisc]:
    """The cams of a link, with half of a kerf (mm) around the material; see `_disc`."""
    discs = (_disc(view, cam, kerf) for cam in _cams(view, link))
    return [disc for disc in discs if disc is not None]


def replace_plate(discs: Sequence[CamDisc], holes: Iterable[tuple[complex, float]]) -> bool:
    """Whether the cams of a link are all of it: every hole, by centre and radius, lies in each of them."""
    return bool(discs) and all(disc.holds(*hole) for hole in holes for disc in discs)


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
    """Warnings of cams that cannot be cut as they should."""
    for cam in view.mechanism.cams:
        if _disc(view, cam, 0.0) is None:
            message = f"cam {cam.coupling}: its profile bounds no part: it is engraved on '{cam.links[1]}', and not cut"
            yield Caution("cam", message)
        elif cam.undercut:
            yield Caution("cam", f"cam {cam.coupling}: its profile is undercut, and the line of the cut crosses itself")


def _cams(view: PosedStudy, link: str) -> list[CamFollower]:
    return [cam for cam in view.mechanism.cams if cam.links[1] == link]


def _disc(view: PosedStudy, cam: CamFollower, kerf: float) -> CamDisc | None:
    """A cam to cut; None where its profile bounds no part.

    A ring and a cam with a groove have a rim as wide as the link. The ends of a profile of a part of a turn are joined
    to the plate around the pins of the link.
    """
    link, scale = cam.links[1], view.millimetres
    layer, radius = "pocket" if len(cam.sides) > 1 else "cut", scale * float(view.sizes.radius(link))
    outer, *inner = [_profile(view, cam, side, kerf).tolist() for side in cam.sides[::-1]]
    if not np.isfinite([outer, *inner]).all():
        return None
    if cam.closed:
        curves = [Path.line(layer, profile[:-1]).close() for profile in (outer, *inner)]
        rim = around("cut", outer, 2 * radius + kerf)
        return CamDisc(
            cam.coupling, curves if cam.sides == ("outer",) or isinstance(rim, DrawnCircle) else [rim, *curves]
        )
    points, pins = view.points(link), joined(view.mechanism.description)
    holes = [(scale * points[point], scale * float(view.sizes.pin(point))) for point in points if point in pins]
    for places in ([scale * place for place in points.values()], [place for place, _ in holes]):
        for outline in _joined_to_plate(outer, places, radius + kerf / 2):
            disc = CamDisc(cam.coupling, [Path.line("cut", outline).close()])
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
