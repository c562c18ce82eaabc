"""The mechanism in a pose, with the paths of its points over the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.door.exporting.discs import discs_of, followers, open_profiles, replace_plate
from mechdesign.door.exporting.drawing import Drawing, DrawnCircle, Path, Shape, Text, around, roomiest
from mechdesign.door.exporting.exports import drawings
from mechdesign.door.exporting.view import PosedStudy
from mechdesign.drawing.sweep import ranks
from mechdesign.mechanism.plates import joined

# Height of letters as a part of the mechanism's size, and the least one (mm).
LETTERS, SMALLEST = 0.04, 1.0
LONGEST = 420.0  # mm, of a sheet A3, about as much as a screen shows


def mechanism_drawing(view: PosedStudy) -> Drawing:
    """Plates of all links in the pose, their pins, and the paths of moving points over the motion."""
    mechanism, scale = view.mechanism, view.millimetres
    description, sizes = mechanism.description, view.sizes
    pinned = joined(description)
    groups: dict[str, list[Shape]] = {}
    letters = max(SMALLEST, LETTERS * scale * mechanism.size)
    for link in description.links:
        outline = [scale * place for place in view.in_world(link, view.outline(link))]
        radius = scale * float(sizes.radius(link))
        discs, place = discs_of(view, link, 0.0), scale * view.in_world(link, [0j])[0]
        profiles = [curve for disc in discs for curve in disc.curves] + open_profiles(view, link)
        holes = [(scale * view.points(link)[p], scale * float(sizes.pin(p))) for p in pinned if p in view.points(link)]
        turn = complex(view.pose.rotation(link))
        shapes: list[Shape] = [] if replace_plate(discs, holes) else [around("links", outline, radius)]
        shapes += [replace(curve, layer="links").moved(place, turn) for curve in profiles]
        shapes += [shape.moved(place, turn) for disc in discs for shape in disc.engraved]
        for slot in view.slots:
            if slot.link == link:
                ends = [scale * place for place in view.in_world(link, slot.ends)]
                shapes.append(around("links", ends, scale * float(sizes.pin(slot.point))))
        pins = [(scale * complex(view.pose.point(point)), scale * float(sizes.pin(point))) for point in pinned]
        middle, _ = roomiest(outline, pins, radius)
        shapes.append(Text("notes", middle, min(0.6 * radius, letters), link, centred=True))
        groups[link] = shapes
    groups |= followers(view)
    for point in pinned:
        place = scale * complex(view.pose.point(point))
        groups[f"pin {point}"] = [
            DrawnCircle("links", place, scale * float(sizes.pin(point))),
            Text("notes", place + 1.4 * scale * float(sizes.pin(point)) * (1 + 1j), letters, point),
        ]
    for point, rank in ranks(view.study).items():
        if rank:
            places = scale * np.asarray(view.track.configuration.point(point))
            last = np.flatnonzero(~view.track.follows)
            curves = [part for part in np.split(places, last + 1) if len(part) > 1]
            groups[f"path of {point}"] = [Path.line("curves", curve.tolist()) for curve in curves]
    return Drawing(f"{view.study.name}: the mechanism at {view.posed}", groups, longest=LONGEST)


mechanism_dxf, mechanism_svg = drawings(
    "mechanism", "the mechanism in a pose and the paths of its points", 30, mechanism_drawing, options=("at",)
)
