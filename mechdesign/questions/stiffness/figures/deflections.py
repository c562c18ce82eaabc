"""How a mechanism deflects: under each of its loads, and where a force of any direction moves the asked point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from mechdesign.drawing import style
from mechdesign.drawing.callouts import ARC, arc, force
from mechdesign.drawing.drawing import Posed, draw
from mechdesign.drawing.marks import Dots, Late, Own, PanelMark, Picture, Trace
from mechdesign.drawing.panels import drawn_plane, quantity, round_down
from mechdesign.drawing.pictures import picture
from mechdesign.drawing.scene import Scene, Still, hull, pose
from mechdesign.drawing.shapes import Shape
from mechdesign.ground.numerals import numeral, printed
from mechdesign.ground.numerics.arrays import Complexes, Floats
from mechdesign.mechanism import Configuration
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.stiffness.analysis import DrawnPose
from mechdesign.questions.stiffness.bodies import NetworkEdge
from mechdesign.questions.stiffness.elements import beam_line
from mechdesign.questions.stiffness.figures.joint_forces import cases_in_words
from mechdesign.questions.stiffness.figures.springs import LARGEST_MOVE
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.study import Study

MAX_LOADS = 4
# Poses, and those that a column of a journal holds.
MAX_DIRECTIONS = 4
MAX_NARROW_DIRECTIONS = 3
_SAME = 1e-6  # of the mechanism's size, between the points of two poses that are one
_LARGEST_ELLIPSE = 0.3  # longest drawn half axis over the size of the mechanism
_ONE_SCALE = 8.0  # ratio of the longest half axes above which each ellipse is drawn at its own scale
# Main axes of the ellipse: column, words, angle from that of k_max, colour and dashes.
_MAIN_AXES: tuple[tuple[str, str, float, str, Any], ...] = (
    ("k_min", "softest", np.pi / 2, style.VERMILION, "-"),
    ("k_max", "stiffest", 0.0, style.BLUE, (0, (2, 1))),
)
_PALE = "#D5DCE4"  # of the mechanism without load, in the legend
# Shape functions of a deflected beam, cubic between its ends as bending makes it, at these parts of its length.
_ALONG = np.linspace(0.0, 1.0, 25)
_CUBIC = np.array([1 - 3 * _ALONG**2 + 2 * _ALONG**3, _ALONG - 2 * _ALONG**2 + _ALONG**3,
                   3 * _ALONG**2 - 2 * _ALONG**3, _ALONG**3 - _ALONG**2])  # fmt: skip


@picture(StiffnessView, "deflections", order=20)
def deflections_picture(view: StiffnessView) -> Picture | None:
    """The whole mechanism where each load moves it, a panel a load, all with one magnification."""
    study, drawn = view.study, view.drawn.first
    if drawn is None:
        return None
    scene, body = pose(study.mechanism, drawn.configuration), drawn.body
    if scene is None or not drawn.twists:
        return None
    shapes, at = _shapes(drawn, scene), scene.points[body.section.point]
    loads = body.loads[0, :MAX_LOADS, : body.size]
    words = cases_in_words(study)
    sizes = [max(float(np.abs(move[:, k]).max()) for _, move in shapes) for k in range(len(loads))]
    if not np.isfinite(sizes).all():
        return None
    scale = round_down(LARGEST_MOVE * scene.span / max(*sizes, 1e-300))
    bent = [[rest + scale * move[:, k] for rest, move in shapes] for k in range(len(loads))]
    name, length = body.section.at, study.units.label("length")
    unloaded = Trace([], [], label="without load", look={"color": _PALE, "linewidth": 6.0})
    loaded = {"color": style.INK, "linewidth": 1.8, "zorder": 5}
    panels = []
    for k, (lines, load) in enumerate(zip(bent, loads.tolist(), strict=True)):
        moved = complex(lines[0][0])
        way = {"color": style.BLUE, "linestyle": ":", "marker": "o", "markevery": [1], "linewidth": 1.4, "zorder": 5.2}
        # The arrows act where the load does; at the asked point, where it has moved.
        pushes = drawn.pushes.get(k, [(moved, complex(*load[:2]), load[2] if load[2:] else 0.0)])
        arrows = list[Shape]()
        for place, push, turn in pushes:
            arrows += force(place, push / abs(push), style.VERMILION) if push else []
            arrows += arc(place, -np.pi / 4, np.copysign(1.5 * np.pi, turn), ARC, style.VERMILION) if turn else []
        marks = [unloaded, Posed(scene, faint=True),
                 *(Trace(line.real, line.imag, label="under the load", look=loaded) for line in lines),
                 Trace([], [], label="load", look={"color": style.VERMILION, "linewidth": 1.8}),
                 Trace([at.real, moved.real], [at.imag, moved.imag], label=f"{name} and its way", look=way),
                 Late(partial(draw, drawn=arrows, order=5.5))]  # fmt: skip
        size = quantity(float(abs(shapes[0][1][0, k])), length)
        shows = np.concatenate([scene.places, *(line for lines in bent for line in lines)])
        panels.append(drawn_plane(marks, shows, study, f"{words[k]}\n{name} moves {size}"))
    title = f"Deflections, drawn {numeral(scale)} times as large, at {pose_in_words(study, view.poses, drawn.row)}"
    return Picture(title, panels, across=2, share="xy")


def _shapes(drawn: DrawnPose, scene: Still) -> list[tuple[Complexes, Complexes]]:
    """Lines of all links at rest, shape (n,), and their displacements by each load, shape (n, loads).

    The first begins at the asked point.
    """
    network, at, moved = drawn.body.network, scene.points[drawn.body.section.point], drawn.twists

    def shift(vertex: str, place: complex) -> Complexes:
        dx, dy, turn = moved[vertex]
        return np.asarray(dx + 1j * dy + 1j * turn * (place - at))

    shapes = [(np.array([at]), shift(network.target, at)[None])]
    bent = set()
    for ways in network.edges_along_beams:
        bent.add(network.edges[ways[0]].name)
        shapes += _bent([network.edges[k] for k in ways], drawn.configuration, moved, shift)
    for link, points in network.points.items():
        borne = [(scene.points[name], vertex) for name, vertex in points if vertex in moved]
        if link in bent or len(borne) < 2:
            continue
        where = dict(borne)
        corners = hull(list(where))
        outline = [*corners, corners[0]] if len(corners) > 2 else corners
        shapes.append((np.array(outline), np.array([shift(where[place], place) for place in outline])))
    return shapes


def _bent(
    ways: Sequence[NetworkEdge], configuration: Configuration, moved: Mapping[str, Floats],
    shift: Callable[[str, complex], Complexes],
) -> list[tuple[Complexes, Complexes]]:  # fmt: skip
    """The beams of an elastic link between the places where something sits, and its brackets."""
    beam = ways[0].beam
    assert beam is not None
    course = beam_line(beam.link, configuration)
    # The rod of a telescopic leg slides in its cylinder, whose pin stays where it is.
    root = beam.link.name if beam.link.telescopic else ways[0].a
    sitting = [(root, beam.link.corners[0]), *((edge.b, edge.point) for edge in ways)]
    feet = [float(course.foot(point, configuration.point(point))[0]) for _, point in sitting]
    bases = [complex(course.place(np.array([foot]))[0]) for foot in feet]
    order = sorted(range(len(feet)), key=feet.__getitem__)
    shapes = []
    for one, other in pairwise(order):
        (first, last), (tail, head) = (sitting[one][0], sitting[other][0]), (bases[one], bases[other])
        shapes.append(_beam(tail, head, shift(first, tail), shift(last, head), moved[first][2], moved[last][2]))
    for (vertex, point), base in zip(sitting, bases, strict=True):
        bracket = np.array([base, complex(configuration.point(point)[0])])
        shapes.append((bracket, np.array([shift(vertex, place) for place in bracket])))
    return shapes


def _beam(
    tail: complex, head: complex, start: Complexes, end: Complexes, turn_start: Floats,
    turn_end: Floats,
) -> tuple[Complexes, Complexes]:  # fmt: skip
    """A beam at rest and its displacements: along itself linear, across itself cubic."""
    span = head - tail
    length = abs(span)
    along = span / length if length > 0 else 1.0 + 0j
    one, other = start * np.conj(along), end * np.conj(along)
    straight = np.outer(1 - _ALONG, one.real) + np.outer(_ALONG, other.real)
    across = (
        np.outer(_CUBIC[0], one.imag) + np.outer(_CUBIC[1], length * turn_start)
        + np.outer(_CUBIC[2], other.imag) + np.outer(_CUBIC[3], length * turn_end)
    )  # fmt: skip
    return np.asarray(tail + _ALONG * span, dtype=np.complex128), np.asarray((straight + 1j * across) * along)


@picture(StiffnessView, "directions", order=40)
def directions_picture(view: StiffnessView) -> Picture | None:
    """Where a force of every direction moves the asked point: an ellipse at it, in a few poses, with its main axes."""
    study, tables, shown = view.study, view.result.tables, view.drawn.shown
    table, soft, section = tables["stiffness"], tables["compliance"], StiffnessSection.of(study)
    index = np.flatnonzero(np.isfinite(soft["C11"][shown.rows]) & (table["k_max"][shown.rows] > 0))
    most = MAX_DIRECTIONS if not style.narrow() else MAX_NARROW_DIRECTIONS
    # A motion that ends where it began shows its first pose once.
    ends = [
        np.ravel(shown.configuration.point(point))[index[[0, -1]]] for point in study.mechanism.points if len(index)
    ]
    closed = len(index) > 2 and all(abs(last - first) <= _SAME * study.mechanism.size for first, last in ends)
    some = np.unique(np.linspace(0, len(index) - 1, min(most, len(index)), endpoint=not closed).astype(int))
    every = Scene(study.mechanism, shown.configuration)
    scenes = {k: scene for k in index[some].tolist() if (scene := every.at(k)) is not None}
    if not scenes:
        return None
    rows = shown.rows[list(scenes)]
    soft_ends = 1 / table["k_min"][rows]
    if not (np.isfinite(soft_ends).all() and (soft_ends > 0).all()):
        return None
    if soft_ends.max() < _ONE_SCALE * soft_ends.min():
        soft_ends[:] = soft_ends.max()
    force = _force(study)
    scales = [force * round_down(_LARGEST_ELLIPSE * every.span / (force * end)) for end in soft_ends.tolist()]
    turns, ellipses = np.exp(1j * np.linspace(0, 2 * np.pi, 361)), []
    for row, scale in zip(rows, scales, strict=True):
        xx, xy, yy = (float(soft[name][row]) for name in ("C11", "C12", "C22"))
        ellipses.append(scale * (xx * turns.real + xy * turns.imag + 1j * (xy * turns.real + yy * turns.imag)))
    units, panels = (study.units.label("stiffness"), study.units.label("angle")), []
    shapes = zip(scenes.values(), rows.tolist(), scales, ellipses, strict=True)
    for scene, row, scale, ellipse in shapes:
        at = scene.points[section.point]
        edge = at + ellipse
        marks: list[PanelMark] = [
            Posed(scene, faint=True),
            Own(partial(_fill, edge)),
            Trace(edge.real, edge.imag, look={"color": style.INK, "linewidth": 1.2, "zorder": 5}),
            Dots([at.real], [at.imag], look={"color": style.INK, "markersize": 4, "zorder": 5.4}),
        ]
        title = pose_in_words(study, shown.poses, row, 4)
        angle = float(table["k_angle"][row]) * study.units.angle_factor
        stiffest = float(table["k_max"][row])
        for name, adjective, turn, color, dashes in _MAIN_AXES:
            stiff, way = float(table[name][row]), np.exp(1j * (angle + turn))
            line = at + scale / stiff * way * np.array([-1, 1])
            look = {"color": color, "linestyle": dashes, "linewidth": 1.8, "zorder": 5.2}
            marks.append(Trace(line.real, line.imag, label=f"{adjective} direction, {name}", look=look))
            toward = np.mod(np.angle(way), np.pi) / study.units.angle_factor
            title += f"\n{adjective} {quantity(stiff, units[0], stiffest)} at {toward:.3g} {units[1]}"
        title += f"\ndrawn {numeral(scale / force)} times as large"
        panels.append(drawn_plane(marks, np.append(scene.places, edge), study, title))
    words = f"{numeral(force)} {printed(study.units.label('force'))}"
    heading = f"Ellipse: where a force of {words} in any direction moves {section.at}"
    return Picture(heading, panels, across=2, share="xy")


def _fill(edge: Complexes, axes: Axes) -> None:
    axes.fill(edge.real, edge.imag, color=style.SKY, alpha=0.35, linewidth=0, zorder=4)


def _force(study: Study) -> float:
    """The force of an ellipse: about the largest of the study's loads, or else one unit."""
    wrenches = StiffnessSection.of(study).wrenches
    loads = [abs(complex(*wrench[:2])) for wrench in wrenches if wrench is not None]
    return round_down(max(loads)) if any(loads) else 1.0
