"""The mechanism as an engineering drawing: dimension lines beside its links, and below it a table of the links."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from mechdesign.drawing import style
from mechdesign.drawing.callouts import link_labels, point_labels
from mechdesign.drawing.drawing import Posed
from mechdesign.drawing.labels import covered, paper, place_labels
from mechdesign.drawing.marks import Late, LateMark, Panel, Picture
from mechdesign.drawing.panels import drawn_plane
from mechdesign.drawing.scene import Still, hull, sketched
from mechdesign.ground.numerals import printed
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.reliability.schema.variation import LOADS, Dimension
from mechdesign.questions.stiffness.schema import CrossSection
from mechdesign.study import Study

_SIZE = 8.5  # points, of numbers
_LETTERS = (60, 36, 24, 18, 14, 11, 9)  # of names in the table, the most that it has room for
# Points between a link and its dimension line: beside it, farther out, or along the link itself.
_AWAY = (16.0, -16.0, 26.0, -26.0, 38.0, -38.0, 52.0, -52.0, 70.0, -70.0, 0.0)
_SHARES = (0.5, 0.38, 0.62, 0.25, 0.75)  # of a dimension line, where its number may stand
_FAR = 0.03  # what a point of distance costs
_WRITTEN_OVER = 1.0  # a point of the drawing under a number
_CROSSED = 0.12  # under a dimension line
_ON_LINK = 1.5  # a number along its link
_MOST = 2.5  # a dimension that costs more stands in the table alone
_OVERSHOOT = 3.0  # points of an extension line beyond the dimension line
_GAP = 5.0  # and from the point that it begins at
_NET = 4.0  # points between two places of a line that others keep off
_ORDER = 6.0
_NONE = 1e-9  # part of the size of the mechanism that is no distance
_HALO, _FROM_AXIS = 1.5, 1.5  # points about a number, and between these and the axes
_COLUMN_GAP, _BOLD = 9.0, 1.15  # points, between columns of the table; width of bold letters over others
_AROUND = 0.12  # of the mechanism's size, for dimension lines beside it


def dimensions_picture(study: Study) -> Picture:
    """The sketch, assembled, with the lengths of its links, and a table of them; use inside `style.context`."""
    scene, unit = sketched(study.mechanism), study.units.label("length")
    title = f"Dimensions{f' in {unit}' if unit else ''}, in the sketch pose"
    title += "; lengths of guides are not to scale" * bool(scene.guides)
    drawing = Late(partial(draw_dimensions, scene))
    around = scene.places + _AROUND * scene.span * np.array([[1], [-1], [1j], [-1j]])
    panels, rows = [drawn_plane([drawing], around.ravel(), study)], table_rows(study, scene)
    return Picture(title, [*panels, *([Panel([WrittenRows(rows)], bare=True)] if rows else [])])


def draw_dimensions(scene: Still, axes: Axes) -> None:
    """Draw a mechanism in a pose, with dimension lines and the names of points and links."""
    Posed(scene, names=False, drives=False).draw(axes)
    draw_lines(scene, axes, lengths(scene))


class Length(NamedTuple):
    """A distance of two points of a link, and the angle of their line where it counts (degrees).

    With `along` it is that in the direction of a unit vector; `tolerance` is written behind it.
    """

    link: str
    one: str
    other: str
    value: float
    angle: float = 0.0
    along: complex = 0j
    tolerance: str = ""

    @property
    def words(self) -> str:
        """The number, its angle and its tolerance."""
        return f"{_number(self.value, self.angle)} {self.tolerance}".rstrip()


def workshop_lengths(study: Study, scene: Still) -> list[Length]:
    """The lengths as a workshop takes them: pivots apart in x and y, and tolerances at their dimensions."""
    measured = list[Length]()
    for length in lengths(scene):
        if length.link != GROUND:
            tolerance = tolerance_of(study, _place_of(scene, length))
            measured.append(length._replace(tolerance=tolerance))
            continue
        run = scene.points[length.other] - scene.points[length.one]
        for along, part in ((1 + 0j, abs(run.real)), (1j, abs(run.imag))):
            if part > _NONE * scene.span:
                measured.append(Length(GROUND, length.one, length.other, part, along=along))
    return measured


def tolerance_of(study: Study, place: str) -> str:
    """The tolerance of a number of the geometry in words; empty where it has none."""
    tolerances = study.reliability.dimensions if study.reliability is not None else {}
    return _tolerance(tolerances[place], study.sizes[place]) if place in tolerances else ""


def _place_of(scene: Still, length: Length) -> str:
    """The name of a length that is one of the study's numbers."""
    ends = scene.description.links[length.link].ends
    return f"{length.link}.length" if ends in ((length.one, length.other), (length.other, length.one)) else ""


def draw_lines(scene: Still, axes: Axes, measured: Iterable[Length], *, bars: bool = True) -> None:
    """Draw dimension lines, and the names of points and links, beside a mechanism that is drawn already.

    A number may stand on its link, if links are `bars`.
    """
    axes.grid(visible=False)
    net = covered(axes)
    boxes: list[Floats] = []
    # The shortest nearest to their links.
    for length in sorted(measured, key=lambda entry: entry.value):
        ends = scene.points[length.one], scene.points[length.other]
        net = _dimension(
            axes, ends, length.words, net, boxes, along=length.along, on_link=bars and length.link != GROUND
        )
    for box in boxes:
        net = np.concatenate([net, _inside(box)])
    place_labels(axes, [*point_labels(scene), *link_labels(scene)], net, order=_ORDER + 1)


def _number(value: float, angle: float) -> str:
    inclined = abs(math.remainder(angle, 90.0)) > 0.05
    return f"{value:.5g}" + f" \N{ANGLE} {angle:.3g}\N{DEGREE SIGN}" * inclined


def lengths(scene: Still) -> Iterator[Length]:
    """The lengths of links, from point to point; those between pivots of the ground with their angle."""
    for name, link in scene.description.links.items():
        if link.telescopic:
            continue
        points = list(scene.pivots() if name == GROUND else scene.link_points(name))
        corners = hull([scene.points[point] for point in points])
        if name == GROUND or len(corners) < 3:
            first = scene.points[points[0]] if points else 0j
            along = (corners[-1] - corners[0]) if len(corners) > 1 and name != GROUND else 1 + 0j
            ordered = sorted(points, key=lambda point: ((scene.points[point] - first) * along.conjugate()).real)
            pairs = list(pairwise(ordered))
        else:
            around = [next(point for point in points if scene.points[point] == corner) for corner in corners]
            pairs = list(zip(around, [*around[1:], around[0]], strict=True))
        for one, other in pairs:
            run = scene.points[other] - scene.points[one]
            if run:
                angle = math.degrees(math.atan2(run.imag, run.real)) if name == GROUND else 0.0
                yield Length(name, one, other, abs(run), angle)


def _dimension(
    axes: Axes, places: tuple[complex, complex], text: str, net: Floats, boxes: list[Floats], *, along: complex = 0j,
    on_link: bool,
) -> Floats:  # fmt: skip
    """Draw a dimension where it covers least, or none; returns the net with what it covers.

    It runs from place to place, or in the direction of a unit vector. `boxes` are those of the numbers before it (left,
    low, right, high; points), to which its own is added.
    """
    ends = paper(axes, np.array(places)) @ np.array([1, 1j])
    along = along or (ends[1] - ends[0]) / abs(ends[1] - ends[0])
    ways = ends * np.conj(along)
    length = abs(float(np.ptp(ways.real)))

    def level(away: float) -> Complexes:
        """The dimension line at a distance beside both places."""
        beside = (ways.imag.max() if away > 0 else ways.imag.min()) + away
        return np.asarray(along * (ways.real + 1j * beside))

    half = _half(text)
    window = paper(axes, np.array([complex(axes.get_xlim()[k], axes.get_ylim()[k]) for k in (0, 1)]))
    best: tuple[float, float, complex, Floats] | None = None
    for away in _AWAY:
        line = level(away)
        # A number must leave room for arrows at both sides.
        across = min(half[0] / max(abs(along.real), 1e-9), half[1] / max(abs(along.imag), 1e-9))
        if away == 0.0 and (length < 2 * across + 16 or not on_link):
            continue
        crossed = _near(net, _net(line), 3.0) if away else 0
        for share in _SHARES if length > 2 * across + 16 else (0.5,):
            middle = complex(line[0] + share * (line[1] - line[0]))
            box = np.array([middle.real - half[0], middle.imag - half[1], middle.real + half[0], middle.imag + half[1]])
            if _outside(box, window) or any(_over(box, taken) for taken in boxes):
                continue
            under = int(((net > box[:2]) & (net < box[2:])).all(axis=1).sum()) if away else 0
            cost = _FAR * abs(away) + _CROSSED * crossed + _WRITTEN_OVER * under + abs(share - 0.5)
            cost += _ON_LINK * (away == 0.0)
            if best is None or cost < best[0]:
                best = cost, away, middle, box
    if best is None or best[0] > _MOST:
        return net
    _, away, middle, box = best
    boxes.append(box)
    back = _back(axes)
    drawn = [_inside(box)]
    if away:
        line, side = level(away), math.copysign(1.0, away) * 1j * along
        for end, foot in zip(line, ends, strict=True):
            z = back(np.array([foot + _GAP * side, end + _OVERSHOOT * side]))
            axes.plot(z.real, z.imag, color=style.INK, linewidth=0.5, zorder=_ORDER - 1)
            drawn.append(_net(np.array([foot, end])))
        tips = back(line)
        axes.annotate("", (tips[1].real, tips[1].imag), (tips[0].real, tips[0].imag), zorder=_ORDER - 1, arrowprops={
            "arrowstyle": "<|-|>,head_width=0.13,head_length=0.35", "color": style.INK, "linewidth": 0.7, "shrinkA": 0,
            "shrinkB": 0, "mutation_scale": 14,
        })  # fmt: skip
        drawn.append(_net(line))
    at = complex(back(np.array([middle]))[0])
    white = {"facecolor": "white", "edgecolor": "none", "pad": _HALO, "alpha": 1.0 if away else 0.8}
    axes.text(at.real, at.imag, text, fontsize=_SIZE, ha="center", va="center", zorder=_ORDER, bbox=white)
    return np.concatenate([net, *drawn])


def _half(text: str) -> Floats:
    wide, tall, _ = text_to_path.get_text_width_height_descent(text, FontProperties(size=_SIZE), False)
    return np.array([wide / 2 + _HALO, tall / 2 + _HALO])


def _back(axes: Axes) -> Callable[[Complexes], Complexes]:
    """From points on paper to places of the drawing."""
    scale = paper(axes, np.array([0, 1 + 1j], dtype=complex))
    origin, unit = scale[0] @ np.array([1, 1j]), scale[1] - scale[0]

    def back(z: Complexes) -> Complexes:
        moved = z - origin
        return np.asarray(moved.real / unit[0] + 1j * moved.imag / unit[1])

    return back


def _net(line: Complexes) -> Floats:
    """Points of a line."""
    count = 2 + int(abs(line[1] - line[0]) / _NET)
    z = np.linspace(line[0], line[1], count)
    return np.column_stack([z.real, z.imag])


def _inside(box: Floats) -> Floats:
    """Points of a box (left, low, right, high)."""
    x, y = (np.linspace(box[k], box[k + 2], 2 + int((box[k + 2] - box[k]) / _NET)) for k in (0, 1))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _near(net: Floats, points: Floats, distance: float) -> int:
    """How many of some points lie near one of the net."""
    if not len(net):
        return 0
    gaps = np.abs((points @ [1, 1j])[:, None] - (net @ [1, 1j])[None])
    return int((gaps.min(axis=1) < distance).sum())


def _outside(box: Floats, window: Floats) -> bool:
    return bool((box[:2] < window[0] + _FROM_AXIS).any() or (box[2:] > window[1] - _FROM_AXIS).any())


def _over(box: Floats, other: Floats) -> bool:
    return bool((box[:2] < other[2:]).all() and (other[:2] < box[2:]).all())


def table_rows(study: Study, scene: Still, *, pivots: bool = True) -> list[tuple[str, ...]]:
    """Link, its points, length, tolerance and section; then what else varies. Without columns that hold nothing.

    Distances of `pivots` are among them. Points without a length have a row with their place in the frame of the link,
    unless they are its origin.

    No rows at all of a mechanism without dimensions.
    """
    tolerances = dict(study.reliability.dimensions) if study.reliability is not None else {}
    for place in () if pivots else [f"{GROUND}.{point}.{axis}" for point in scene.pivots() for axis in "xy"]:
        tolerances.pop(place, None)
    rows: list[tuple[str, ...]] = [("link", "between", "length", "tolerance", "section")]
    described: set[str] = set()
    measured = [length for length in lengths(scene) if pivots or length.link != GROUND]
    for name, link in study.mechanism.description.links.items():
        own = [length for length in measured if length.link == name]
        if link.telescopic and link.ends:
            rows.append((name, " to ".join(link.ends), "variable", "", _section(study, name)))
            described.add(name)
        for length in own:
            text = tolerance_of(study, place := _place_of(scene, length))
            tolerances.pop(place, None)
            section, first = ("", "") if name in described else (_section(study, name), name)
            rows.append((first, f"{length.one} to {length.other}", length.words, text, section))
            described.add(name)
        dimensioned = {*(link.ends or ()), *(point for length in own for point in (length.one, length.other))}
        dimensioned |= {*scene.pivots()} if name == GROUND and not pivots else set()
        # The rod's end of a telescopic link has no place in its frame.
        for point in link.points:
            local = complex(study.mechanism.geometry.local(name, point, {}))
            if point not in dimensioned and abs(local) > _NONE * scene.span:
                rows.append(("" if name in described else name, f"{point} in its frame", _place(local, scene), "", ""))
                described.add(name)
    rows += _guides(scene)
    rows += [(name, "", _nominal(study, name), _tolerance(size, study.sizes.get(name, 0.0), _unit(study, name)), "")
             for name, size in tolerances.items()]  # fmt: skip
    kept = [k for k in range(5) if any(row[k] for row in rows[1:])]
    return [tuple(row[k] for k in kept) for row in rows] if kept else []


def _guides(scene: Still) -> Iterator[tuple[str, ...]]:
    """Lines of the ground on which something slides: how far they pass a pivot, and their angle."""
    for guide in scene.guides:
        if guide.owner == GROUND and (pivots := scene.pivots()):
            far = abs(((scene.points[pivots[0]] - guide.origin) * guide.along.conjugate()).imag)
            angle = math.degrees(math.atan2(guide.along.imag, guide.along.real))
            offset = _number(0.0 if far < _NONE * scene.span else far, angle)
            yield guide.joint, f"{pivots[0]} to its line", offset, "", ""


def _place(place: complex, scene: Still) -> str:
    x, y = (0.0 if abs(value) < _NONE * scene.span else value for value in (place.real, place.imag))
    return f"({x:.5g}, {y:.5g})"


def _nominal(study: Study, name: str) -> str:
    """The value of a parameter or a coordinate of a link."""
    value = study.parameters.nominal.get(name, study.mechanism.nominal.get(name))
    return f"{value:.5g}" if value is not None and _unit(study, name) == "" else ""


def _unit(study: Study, name: str) -> str:
    """The unit of what varies, where it is not that of the lengths."""
    unit = study.units.label(LOADS[name]) if name in LOADS else study.unit_of(name) or ""
    return "" if unit == study.units.label("length") else printed(unit)


def _tolerance(dimension: Dimension, nominal: float, unit: str = "") -> str:
    if dimension.measured is not None:
        return "measured"
    low, high = dimension.ends(nominal)
    if dimension.sigma is not None:
        words = f"\N{GREEK SMALL LETTER SIGMA} = {dimension.sigma:g}"
    else:
        words = f"\N{PLUS-MINUS SIGN}{high:g}" if low == -high else f"{high:+g} / {low:+g}"
    return f"{words} {unit}".rstrip()


def _section(study: Study, link: str) -> str:
    stiffness = study.stiffness
    name = stiffness.elastic.get(link) if stiffness is not None else None
    return f"{name}{_size(stiffness.sections[name])}" if stiffness is not None and name is not None else ""


def _size(profile: CrossSection) -> str:
    if profile.diameter is not None:
        inner = f" / {profile.inner_diameter:g}" if profile.inner_diameter is not None else ""
        return f" \N{DIAMETER SIGN}{profile.diameter:g}{inner}"
    return f" {profile.width:g} x {profile.height:g}" if profile.width and profile.height else ""


@dataclass(frozen=True, eq=False)
class WrittenRows(LateMark):
    """A table in print, its head first; columns are as wide as what they hold.

    Where there is no room its type is smaller, and then long names are shortened.
    """

    rows: Sequence[Sequence[str]]

    @property
    def height(self) -> float:
        return 1.6 * style.line(_SIZE) * len(self.rows)

    def draw(self, axes: Axes) -> None:
        # From the left edge of the page.
        begin, wide = (72 * side / style.dots() for side in (axes.bbox.x0, axes.bbox.width))
        room, least = wide + begin - _COLUMN_GAP, style.small() / _SIZE
        for most in _LETTERS:
            rows = [[style.shortened(words, most) for words in row] for row in self.rows]
            columns = [[2 * _half(words)[0] for words in column] for column in zip(*rows, strict=True)]
            widths = [max(_BOLD * head, *others) + _COLUMN_GAP for head, *others in columns]
            if least * sum(widths) <= room:
                break
        share = max(least, min(1.0, room / sum(widths)))
        for number, row in enumerate(rows):
            for left, words in zip(np.cumsum([0.0, *widths[:-1]]) * share, row, strict=True):
                axes.text((float(left) + wide - room) / wide, 1 - (number + 0.5) / len(self.rows), words,
                          transform=axes.transAxes, fontsize=_SIZE * share, va="center",
                          fontweight="bold" if number == 0 else "normal")  # fmt: skip
