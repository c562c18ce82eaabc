"""Wheels of couplings as a workshop makes them: pitch circles, teeth, and discs to cut."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mechdesign.door.exporting.drawing import DrawnCircle
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.ground.cautions import Caution
from mechdesign.mechanism.wheels import Mesh

# Depth of a tooth below the pitch circle in modules [ISO 53].
DEDENDUM = 1.25
# Numbers of teeth so near a whole one are whole: sizes are written with few digits.
WHOLE = 1e-2


@dataclass(frozen=True)
class PitchWheel:
    """A wheel, or a pulley, in the frame of its link: centre and radius of its pitch circle (mm).

    The `module` of its teeth is 0 where the study gives none, and `ring` says that they are inside.
    """

    coupling: str
    link: str
    point: str
    centre: complex
    pitch: float
    module: float
    ring: bool

    @property
    def teeth(self) -> str:
        """Their number; empty where it is not known."""
        if not self.module:
            return ""
        number = 2 * self.pitch / self.module
        return f"{round(number)}" if abs(number - round(number)) < WHOLE else f"{number:.6g}"

    def circles(self, rim: float, kerf: float) -> list[DrawnCircle]:
        """The circles that are cut, the outermost first, with half of a kerf around the material; a ring has a rim."""
        tip = self.pitch + (-self.module if self.ring else self.module)
        if not self.ring:
            return [DrawnCircle("cut", self.centre, tip + kerf / 2)]
        root = self.pitch + DEDENDUM * self.module
        return [DrawnCircle("cut", self.centre, root + rim + kerf / 2), DrawnCircle("cut", self.centre, tip - kerf / 2)]

    def __str__(self) -> str:
        teeth = f", {self.teeth} teeth of module {self.module:.6g} mm, tip circle" if self.module else ", cut"
        tip = 2 * (self.pitch - self.module if self.ring else self.pitch + self.module)
        return f"wheel {self.point}: pitch circle {2 * self.pitch:.6g} mm{teeth} {tip:.6g} mm, without its teeth"


def wheels_of(view: PosedStudy, mesh: Mesh) -> list[PitchWheel]:
    """The wheels of a mesh, the one that follows first; none of a belt whose pulleys have no radius."""
    mechanism, scale = view.mechanism, view.millimetres
    if not mesh.presses:
        return []
    given = mechanism.description.couplings[mesh.coupling].module
    module = 0.0 if given is None else scale * float(mechanism.geometry.term(given, {}))
    radii = [round(scale * float(radius), 9) for radius in mesh.radii(view.pose)]
    inside = not mesh.belt and mesh.slide < 0 and float(mesh.ratio(view.pose)) > 0
    wheels = []
    for link, axis, radius in zip(mesh.links, mesh.axes, radii, strict=True):
        point = mechanism.graph.nodes[axis]
        if radius > 0 and point in view.points(link):
            ring = inside and radius == max(radii)
            centre = scale * view.points(link)[point]
            wheels.append(PitchWheel(mesh.coupling, link, point, centre, radius, module, ring))
    return wheels


def link_wheels(view: PosedStudy, link: str) -> list[PitchWheel]:
    """The wheels of a link; those that several meshes share once."""
    own = [wheel for mesh in view.mechanism.meshes for wheel in wheels_of(view, mesh) if wheel.link == link]
    own.sort(key=lambda wheel: -wheel.module)
    return [*{(wheel.point, wheel.pitch, wheel.ring): wheel for wheel in own[::-1]}.values()][::-1]


def uncut(view: PosedStudy) -> Iterator[Caution]:
    """What of wheels is not cut."""
    meshes = view.mechanism.meshes
    unknown = [mesh.coupling for mesh in meshes if not mesh.presses]
    if unknown:
        message = f"{', '.join(unknown)}: pulleys are not cut, as the study gives no 'radius'"
        yield Caution("incomplete", message)
    racks = [mesh.links[0] for mesh in meshes if mesh.slide >= 0]
    if racks:
        yield Caution("incomplete", f"the racks of {', '.join(dict.fromkeys(racks))} are not cut, only their plates")
    if any(wheels_of(view, mesh) for mesh in meshes if not mesh.belt):
        yield Caution("incomplete", "wheels are cut as discs with their pitch circles engraved: teeth are not drawn")
