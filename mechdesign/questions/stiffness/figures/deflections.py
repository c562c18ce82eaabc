"""How a mechanism deflects: under each of its loads, and where a force of any direction moves the asked point."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.stiffness.analysis import DrawnPose
from mechdesign.questions.stiffness.bodies import NetworkEdge
from mechdesign.questions.stiffness.elements import beam_line
from mechdesign.questions.stiffness.figures.joint_forces import cases_in_words
from mechdesign.questions.stiffness.figures.springs import LARGEST_MOVE
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw, draw_mechanism
from mechdesign.report.figures.framing import ABOVE, BELOW, LEFT, MAX_HEIGHT, PAD, RIGHT, fit, legend_at_left, windows
from mechdesign.report.figures.panels import quantity, round_down
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Scene, hull, pose
from mechdesign.report.figures.shapes import ARC, arc, force
from mechdesign.study import Study

MAX_LOADS = 4
# Poses, and those that a column of a journal holds.
MAX_DIRECTIONS = 4
MAX_NARROW_DIRECTIONS = 3
_MAX_TICKS = 6  # below a panel
_SAME = 1e-6  # of the mechanism's size, between the points of two poses that are one
_LARGEST_ELLIPSE = 0.3  # longest drawn half axis over the size of the mechanism
_ONE_SCALE = 8.0  # ratio of the longest half axes above which each ellipse is drawn at its own scale
_LETTERS_AN_INCH = 14.5  # of a panel's title
# Main axes of the ellipse: column, words, angle from that of k_max, colour and dashes.
_MAIN_AXES: tuple[tuple[str, str, float, str, Any], ...] = (
    ("k_min", "softest", np.pi / 2, style.VERMILION, "-"),
    ("k_max", "stiffest", 0.0, style.BLUE, (0, (2, 1))),
)
# Inches.
_PANEL_TITLE = 0.17  # a line
_HEADING = 0.32
_LEGEND = 0.3
_PALE = "#D5DCE4"  # of the mechanism without load, in the legend
# Shape functions of a deflected beam, cubic between its ends as bending makes it, at these parts of its length.
_ALONG = np.linspace(0.0, 1.0, 25)
_CUBIC = np.array([1 - 3 * _ALONG**2 + 2 * _ALONG**3, _ALONG - 2 * _ALONG**2 + _ALONG**3,
                   3 * _ALONG**2 - 2 * _ALONG**3, _ALONG**3 - _ALONG**2])  # fmt: skip


@picture(StiffnessView, "deflections", order=20)
def deflections_figure(view: StiffnessView) -> Figure | None:
    """The whole mechanism where each load moves it, a panel a load, all with one magnification."""
    study, poses, drawn = view.study, view.poses, view.drawn.first
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
    places = np.concatenate([[*scene.points.values()], *(line for lines in bent for line in lines)])
    where = pose_in_words(study, poses, drawn.row)
    figure, panels = _panels(
        study, places, len(loads), f"deflections, drawn {scale:g} times as large, at {where}", lines=2
    )
    name, length = body.section.at, study.units.label("length")
    for k, (axes, lines, load) in enumerate(zip(panels, bent, loads.tolist(), strict=True)):
        axes.locator_params(axis="x", nbins=_MAX_TICKS)
        draw_mechanism(axes, study.mechanism, drawn.configuration, faint=True, size=_symbol_size(len(panels)))
        for line in lines:
            axes.plot(line.real, line.imag, color=style.INK, linewidth=1.8, zorder=5)
        moved = lines[0][0]
        axes.plot([at.real, moved.real], [at.imag, moved.imag], ":", color=style.BLUE, linewidth=1.4, zorder=5.2)
        axes.plot([moved.real], [moved.imag], "o", color=style.BLUE, zorder=6)
        # The arrows act where the load does; at the asked point, where it has moved.
        own = (complex(moved), complex(*load[:2]), load[2] if load[2:] else 0.0)
        for place, push, turn in drawn.pushes.get(k, [own]):
            if push:
                draw(axes, force(place, push / abs(push), style.VERMILION), order=5.5)
            if turn:
                draw(axes, arc(place, -np.pi / 4, np.copysign(1.5 * np.pi, turn), ARC, style.VERMILION), order=5.5)
        size = abs(shapes[0][1][0, k])
        axes.set_title(f"{words[k]}\n{name} moves {quantity(float(size), length)}",
                       loc="left", fontsize=9)  # fmt: skip
    handles = [Line2D([], [], color=color, linewidth=width, label=words)
               for color, width, words in ((_PALE, 6.0, "without load"), (style.INK, 1.8, "under the load"),
                                           (style.VERMILION, 1.8, "load"))]  # fmt: skip
    handles.append(Line2D([], [], color=style.BLUE, linestyle=":", marker="o", label=f"{name} and its way"))
    legend_at_left(figure, handles, len(handles))
    return figure


def _panels(
    study: Study, places: Complexes, count: int, heading: str, lines: int = 3
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Drawings of one scale, two in a row, under a heading, with room for titles of some lines and a legend."""
    columns = 1 if style.narrow() else min(count, 2)
    heading = style.folded(heading[0].upper() + heading[1:], 11.0, style.width() - LEFT - RIGHT)
    above = _PANEL_TITLE * lines + ABOVE
    top = _HEADING + style.line(11.0) * heading.count("\n")
    # All of them on a page of paper.
    rows = -(-count // columns)
    room = (style.tallest() - top - BELOW - 2 * _LEGEND) / rows - above
    tall = min(MAX_HEIGHT if count == 1 else min(3.2, 8.0 / rows), room)
    window = fit(places, (style.width() - RIGHT - LEFT * columns) / columns, tall, min(PAD, 0.3 * tall))
    figure, axes = windows(window, study.units.label("length"), count, columns, above=above, top=top,
                           below=BELOW + _LEGEND)  # fmt: skip
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), heading, va="top", fontsize=11)
    return figure, axes


def _symbol_size(panels: int) -> float:
    """Size of symbols, smaller where several drawings stand side by side."""
    return 1.0 if panels == 1 else 0.7


def _shapes(drawn: DrawnPose, scene: Scene) -> list[tuple[Complexes, Complexes]]:
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
def directions_figure(view: StiffnessView) -> Figure | None:
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
    posed = {int(k): pose(study.mechanism, shown.configuration, int(k)) for k in index[some]}
    scenes = {k: scene for k, scene in posed.items() if scene is not None}
    if not scenes:
        return None
    rows = shown.rows[list(scenes)]
    soft_ends = 1 / table["k_min"][rows]
    if not (np.isfinite(soft_ends).all() and (soft_ends > 0).all()):
        return None
    if soft_ends.max() < _ONE_SCALE * soft_ends.min():
        soft_ends[:] = soft_ends.max()
    force, span = _force(study), max(scene.span for scene in scenes.values())
    scales = [force * round_down(_LARGEST_ELLIPSE * span / (force * end)) for end in soft_ends.tolist()]
    turns, ellipses = np.exp(1j * np.linspace(0, 2 * np.pi, 361)), []
    for row, scale in zip(rows, scales, strict=True):
        xx, xy, yy = (float(soft[name][row]) for name in ("C11", "C12", "C22"))
        ellipses.append(scale * (xx * turns.real + xy * turns.imag + 1j * (xy * turns.real + yy * turns.imag)))
    places = [[*scene.points.values(), *(scene.points[section.point] + ellipse)]
              for scene, ellipse in zip(scenes.values(), ellipses, strict=True)]  # fmt: skip
    words = f"{force:g} {style.printed(study.units.label('force'))}"
    heading = f"ellipse: where a force of {words} in any direction moves {section.at}"
    wide = (style.width() - RIGHT) / (1 if style.narrow() else min(len(scenes), 2)) - LEFT
    # Broken between coordinates only.
    named = [re.sub("(?<!,) ", "\N{NO-BREAK SPACE}", pose_in_words(study, shown.poses, int(row), 4)) for row in rows]
    where = [textwrap.fill(words, int(wide * _LETTERS_AN_INCH)) for words in named]
    lines = 4 + max(words.count("\n") for words in where)
    figure, panels = _panels(study, np.concatenate(places), len(scenes), heading, lines=lines)
    units = study.units.label("stiffness"), study.units.label("angle")
    shapes = zip(panels, scenes.items(), rows, scales, ellipses, where, strict=True)
    for axes, (k, scene), row, scale, ellipse, words in shapes:
        at = scene.points[section.point]
        draw_mechanism(axes, study.mechanism, shown.configuration, k, faint=True, size=_symbol_size(len(panels)))
        axes.fill((at + ellipse).real, (at + ellipse).imag, color=style.SKY, alpha=0.35, linewidth=0, zorder=4)
        axes.plot((at + ellipse).real, (at + ellipse).imag, color=style.INK, linewidth=1.2, zorder=5)
        angle, title_lines = float(table["k_angle"][row]) * study.units.angle_factor, []
        for name, adjective, turn, color, dashes in _MAIN_AXES:
            stiff, way = float(table[name][row]), np.exp(1j * (angle + turn))
            line = at + scale / stiff * way * np.array([-1, 1])
            axes.plot(line.real, line.imag, color=color, linestyle=dashes, linewidth=1.8, zorder=5.2)
            toward = np.mod(np.angle(way), np.pi) / study.units.angle_factor
            title_lines.append(f"{adjective} {quantity(stiff, units[0])} at {toward:.3g} {units[1]}")
        axes.plot(at.real, at.imag, "o", color=style.INK, markersize=4, zorder=5.4)
        title_lines = [words, *title_lines, f"drawn {scale / force:g} times as large"]
        axes.set_title("\n".join(title_lines), loc="left", fontsize=8.5)
    handles = [Line2D([], [], color=color, linestyle=dashes, linewidth=1.8, label=f"{adjective} direction, {name}")
               for name, adjective, _, color, dashes in _MAIN_AXES]  # fmt: skip
    legend_at_left(figure, handles, len(handles))
    return figure


def _force(study: Study) -> float:
    """The force of an ellipse: about the largest of the study's loads, or else one unit."""
    wrenches = StiffnessSection.of(study).wrenches
    loads = [abs(complex(*wrench[:2])) for wrench in wrenches if wrench is not None]
    return round_down(max(loads)) if any(loads) else 1.0
