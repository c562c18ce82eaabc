"""Every link as a part to cut at full size: outline, holes, slots, names, in rows on a sheet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from textwrap import wrap

import numpy as np

from mechdesign.door.exporting.discs import LinkDisc, cautions, discs_of, open_profiles, replace_plate
from mechdesign.door.exporting.drawing import CentreMark, Drawing, Path, Shape, Text, around, box, roomiest
from mechdesign.door.exporting.exports import drawings
from mechdesign.door.exporting.view import PosedStudy, several
from mechdesign.ground.cautions import Caution
from mechdesign.mechanism.graph import rod_of
from mechdesign.mechanism.plates import gap, hull, joined
from mechdesign.questions.reliability.schema.section import in_words

SHEET = 600.0  # width of the sheet where the study gives none
SPACING, HEIGHT = 6.0, 4.0  # between parts, and of the names under them
NOTES = 64  # letters of a line of notes
ENGRAVED = (0.35, 2.0, 10.0)  # height of an engraved name: as a part of the width, least and greatest


@dataclass(frozen=True)
class Hole:
    """A hole, or with two ends a slot, by the radius of its pin (mm)."""

    point: str
    ends: tuple[complex, ...]
    radius: float

    def __str__(self) -> str:
        return f"{'hole' if len(self.ends) == 1 else 'slot'} {self.point}"


@dataclass(frozen=True)
class FlatPart:
    """A part in a frame of its own, in millimetres: places that its outline goes around, and its holes.

    `marks` are places without a hole, and `engraved` pitch circles and profiles. A cam or a wheel has the outline of
    its `disc` instead, with the kerf in it.
    """

    name: str
    places: Sequence[complex]
    radius: float
    holes: Sequence[Hole]
    marks: dict[str, complex]
    engraved: Sequence[Shape] = ()
    disc: LinkDisc | None = None

    def faults(self) -> Iterator[str]:
        """What cannot be cut, in words: holes of different points that overlap, and one that leaves no rim."""
        for one, other in combinations(self.holes, 2):
            apart = float(gap(one.ends, other.ends)) - one.radius - other.radius
            if apart <= 0 and one.ends != other.ends:
                yield f"{one} and {other} of {self.name!r} overlap"
        for hole in self.holes:
            if hole.radius >= self.radius:
                yield f"{hole} of {self.name!r} leaves no material beside it"

    @property
    def turn(self) -> complex:
        """The turn by which the part is least tall: one of its sides lies level."""
        corners = hull(self.places)
        sides = [b - a for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True) if a != b]
        turns = [abs(side) / side for side in sides] or [1.0 + 0j]
        return min(turns, key=lambda turn: round(float(np.ptp([(turn * corner).imag for corner in corners])), 9))

    def shapes(self, kerf: float) -> list[Shape]:
        """What is cut, drilled and engraved; the outline is larger and the holes are smaller by half of the kerf."""
        turn = self.turn
        outline = [around("cut", self.places, self.radius + kerf / 2)]
        cut: list[Shape] = [*outline] if self.disc is None else [*self.disc.curves]
        cut += [around("cut", hole.ends, max(hole.radius - kerf / 2, 0.0)) for hole in self.holes]
        drilled = [CentreMark("drill", hole.ends[0]) for hole in self.holes if len(hole.ends) == 1]
        marked = [CentreMark("engrave", place) for place in self.marks.values()]
        turned = [shape.moved(0j, turn) for shape in (*cut, *drilled, *marked, *self.engraved)]
        return [*turned, *self._name(turn)]

    def _name(self, turn: complex) -> list[Text]:
        """Its name, where most room is between the holes."""
        holes = [(turn * end, hole.radius) for hole in self.holes for end in _along(hole.ends)]
        if self.disc is not None:
            lines = [curve for curve in self.disc.curves if isinstance(curve, Path)]
            sides = [(a, b) for curve in lines for a, b, _ in curve.pieces()]
            ends = [end for a, b in sides for end in (_along((a, b)) if abs(b - a) > self.radius / 2 else [a])]
            holes += [(turn * end, 0.0) for end in ends]
        place, room = roomiest([turn * place for place in self.places], holes, self.radius)
        share, least, most = ENGRAVED
        if self.disc is not None and not self.disc.holds(place / turn, 0.0):
            return []
        height = min(2 * share * self.radius, most, 1.6 * room / (0.65 * max(len(self.name), 1)))
        return [Text("engrave", place, height, self.name, centred=True)] if height >= least else []


def _along(ends: tuple[complex, ...]) -> list[complex]:
    """Places along a slot, or the centre of a hole."""
    return [ends[0] + (ends[-1] - ends[0]) * k / 8 for k in range(9 if len(ends) > 1 else 1)]


def parts_of(view: PosedStudy) -> list[FlatPart]:
    """Every link as a part, the ground too; of a telescopic link its body, and its rod.

    A cam or a wheel in which all holes of its link lie is the link, others are parts of their own.
    """
    scale, sizes, pins = view.millimetres, view.sizes, joined(view.mechanism.description)
    parts = []
    for name, link in view.mechanism.description.links.items():
        radius = scale * float(sizes.radius(name))
        points = {point: scale * place for point, place in view.points(name).items()}
        holes = [
            Hole(point, (place,), scale * float(sizes.pin(point))) for point, place in points.items() if point in pins
        ]
        for slot in view.slots:
            if slot.link == name:
                ends = tuple(scale * end for end in slot.ends)
                holes.append(Hole(slot.point, ends, scale * float(sizes.pin(slot.point))))
        marks = {point: place for point, place in points.items() if point not in pins}
        places = [scale * place for place in view.outline(name)]
        plate = FlatPart(name, places, radius, holes, marks, open_profiles(view, name))
        discs = discs_of(view, name, scale * float(sizes.kerf))
        whole = replace_plate(discs, [(end, hole.radius) for hole in holes for end in hole.ends])
        parts += [] if whole else [plate]
        for disc in discs:
            title = name if whole and len(discs) == 1 else f"{name} {disc.coupling}"
            parts.append(_disc_part(title, plate, disc))
        if link.tip is not None:
            tip = Hole(link.tip, (0j,), scale * float(sizes.pin(link.tip)))
            parts.append(FlatPart(rod_of(name).replace(":", " "), [0j], radius, [tip], {}))
    return parts


def _disc_part(name: str, plate: FlatPart, disc: LinkDisc) -> FlatPart:
    """A cam or a wheel of a link, with those of its holes and marks that lie in it."""
    holes = [hole for hole in plate.holes if all(disc.holds(end, hole.radius) for end in hole.ends)]
    marks = {point: place for point, place in plate.marks.items() if disc.holds(place, 0.0)}
    profile = disc.outline
    places = [*(end for hole in holes for end in hole.ends), *profile[:: max(len(profile) // 12, 1)]]
    return FlatPart(name, places, plate.radius, holes, marks, disc.engraved, disc)


def parts_drawing(view: PosedStudy) -> Drawing:
    """All parts on a sheet, each with its name under it."""
    scale, sizes = view.millimetres, view.sizes
    parts, kerf = parts_of(view), scale * float(sizes.kerf)
    width = SHEET if sizes.sheet is None else scale * float(sizes.sheet)
    groups = nested([(part.name, part.shapes(kerf)) for part in parts], width)
    low, _ = box(shape for group in groups.values() for shape in group)
    said = f"one unit is 1 mm; thickness {scale * float(sizes.thickness):.6g} mm; {_kerf(kerf)}"
    words = wrap(said, NOTES)
    under = [low - 1.5j * (k + 1) * HEIGHT for k in range(len(words))]
    groups["notes"] = [Text("notes", place, HEIGHT, line) for place, line in zip(under, words, strict=True)]
    return Drawing(f"{view.study.name}: parts", groups, remarks(view, parts))


def _kerf(kerf: float) -> str:
    """What the drawing has of the kerf, in words."""
    if not kerf:
        return "no kerf is counted: parts are drawn as finished"
    return (
        f"kerf {kerf:.6g} mm is counted: cut along the lines, which lie {kerf / 2:.6g} mm outside of the finished "
        f"parts, and holes are drawn {kerf:.6g} mm smaller in diameter"
    )


def nested(parts: Iterable[tuple[str, Sequence[Shape]]], width: float) -> dict[str, list[Shape]]:
    """Parts in rows from the top of a sheet of some width, the tallest first; a part that is wider has its own row."""
    boxes = [(name, shapes, *box(shapes)) for name, shapes in parts]
    boxes.sort(key=lambda part: -round((part[3] - part[2]).imag, 6))
    groups: dict[str, list[Shape]] = {}
    x = top = tallest = 0.0
    for name, shapes, low, high in boxes:
        label = Text("notes", 0j, HEIGHT, name)
        size = complex(max((high - low).real, label.width), (high - low).imag)
        if x > 0 and x + size.real > width:
            x, top = 0.0, top - tallest - SPACING
            tallest = 0.0
        by = complex(x - low.real, top - high.imag)
        under = complex(x, top - size.imag - 1.5 * HEIGHT)
        groups[name] = [*(shape.moved(by) for shape in shapes), label.moved(under)]
        x += size.real + SPACING
        tallest = max(tallest, size.imag + 1.5 * HEIGHT)
    return groups


def remarks(view: PosedStudy, parts: Sequence[FlatPart]) -> list[str]:
    """What stands in the file in words: each part with its points, and the tolerances and fits of the study."""
    study, sizes, scale = view.study, view.sizes, view.millimetres
    kerf = scale * float(sizes.kerf)
    lines = [f"thickness {scale * float(sizes.thickness):.6g} mm, kerf {kerf:.6g} mm", _kerf(kerf)]
    for part in parts:
        ends = [(hole.point, hole.ends[0]) for hole in part.holes if len(hole.ends) == 1] + [*part.marks.items()]
        apart = [f"{one} {other} {abs(b - a):.9g} mm" for (one, a), (other, b) in combinations(ends, 2)]
        slots = [f"slot of {hole.point} {abs(hole.ends[1] - hole.ends[0]):.6g} mm long between centres"
                 for hole in part.holes if len(hole.ends) > 1]  # fmt: skip
        drawn = "" if not kerf else ", drawn {:.6g} mm"
        holes = [
            f"hole {hole.point} {2 * hole.radius:.6g} mm{drawn.format(2 * hole.radius - kerf)}"
            for hole in part.holes
            if len(hole.ends) == 1
        ]
        shaped = [] if part.disc is None else [part.disc.remark]
        lines.append(f"{part.name}: {', '.join([*apart, *holes, *slots, *shaped])}")
    if study.reliability is not None:
        for name, dimension in study.reliability.dimensions.items():
            low, high = dimension.ends(study.sizes.get(name, 0.0))
            unit = study.unit_of(name) or ""
            if dimension.varies(study.sizes.get(name, 0.0)) and name not in study.mechanism.drives:
                lines.append(f"tolerance: {name} {float(low):+.6g} to {float(high):+.6g} {unit}".rstrip())
        lines += in_words(study.reliability, study.mechanism.graph, study.sizes)
    return lines


def parts_cautions(view: PosedStudy) -> tuple[Caution, ...]:
    """Warnings of parts that cannot be cut as they are, or do not fit on the sheet, and of cams."""
    parts, sheet, kerf = parts_of(view), view.sizes.sheet, view.millimetres * float(view.sizes.kerf)
    faults = [fault for part in parts for fault in part.faults()]
    warnings = [Caution("infeasible", several(faults))] if faults else []
    if sheet is not None:
        width = view.millimetres * float(sheet)
        lengths = {part.name: (high - low).real for part in parts for low, high in [box(part.shapes(kerf))]}
        wide = [f"{name!r} is {length:.6g} mm long" for name, length in lengths.items() if length > width]
        if wide:
            warnings.append(Caution("infeasible", f"the sheet is {width:.6g} mm wide: {several(wide)}"))
    return (*warnings, *cautions(view))


parts_dxf, parts_svg = drawings("parts", "every link as a part to cut at 1:1", 10, parts_drawing, parts_cautions)
