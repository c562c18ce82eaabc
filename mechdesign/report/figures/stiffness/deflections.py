"""How a mechanism deflects under loads, and how its body moves where nothing holds it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.stiffness.analysis import Drawn
from mechdesign.analyses.stiffness.elements import corners_of, course_of
from mechdesign.analyses.stiffness.network import NetworkEdge
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import ARC, Pen, draw_mechanism
from mechdesign.report.figures.panels import legend_at_left, round_down
from mechdesign.report.figures.scene import Scene, hull, pose
from mechdesign.report.figures.stiffness.joint_forces import load_in_words
from mechdesign.report.figures.stiffness.sheets import panels_of_poses, posed, symbol_size
from mechdesign.results import Result
from mechdesign.study import Poses, Study

MAX_LOADS = 4
_LARGEST_MOVE = 0.12  # largest drawn displacement over the size of the mechanism
_PALE = "#D5DCE4"  # of the mechanism without load, in the legend
# Shape functions of a deflected beam, cubic between its ends as bending makes it, at these parts of its length.
_ALONG = np.linspace(0.0, 1.0, 25)
_CUBIC = np.array([1 - 3 * _ALONG**2 + 2 * _ALONG**3, _ALONG - 2 * _ALONG**2 + _ALONG**3,
                   3 * _ALONG**2 - 2 * _ALONG**3, _ALONG**3 - _ALONG**2])  # fmt: skip


def deflections_figure(study: Study, poses: Poses, drawn: Drawn) -> Figure | None:
    """The whole mechanism where each load moves it, a panel a load, each with its own magnification."""
    scene, asked = pose(study.mechanism, drawn.configuration), drawn.body
    if scene is None or not drawn.twists:
        return None
    shapes, at = _shapes(drawn, scene), scene.points[asked.section.at]
    loads = np.array(asked.section.loads[:MAX_LOADS])[:, : asked.size]
    sizes = [max(float(np.abs(move[:, k]).max()) for _, move in shapes) for k in range(len(loads))]
    if not np.isfinite(sizes).all():
        return None
    scales = [round_down(_LARGEST_MOVE * scene.span / max(size, 1e-300)) for size in sizes]
    bent = [[rest + scale * move[:, k] for rest, move in shapes] for k, scale in enumerate(scales)]
    places = np.concatenate([[*scene.points.values()], *(line for lines in bent for line in lines)])
    where = pose_in_words(study, poses, drawn.row)
    figure, panels = panels_of_poses(study, places, len(loads), f"deflections, enlarged, at {where}")
    length = study.units.label("length")
    for k, (axes, lines, load, scale) in enumerate(zip(panels, bent, loads.tolist(), scales, strict=True)):
        draw_mechanism(axes, study.mechanism, drawn.configuration, faint=True, size=symbol_size(len(panels)))
        for line in lines:
            axes.plot(line.real, line.imag, color=style.INK, linewidth=1.8, zorder=5)
        moved, pen = lines[0][0], Pen(axes, order=5.5)
        axes.plot([at.real, moved.real], [at.imag, moved.imag], ":", color=style.BLUE, linewidth=1.4, zorder=5.2)
        axes.plot([moved.real], [moved.imag], "o", color=style.BLUE, zorder=6)
        # The arrows act where the load does: at the asked point, here where it has moved.
        if force := complex(*load[:2]):
            pen.force(moved, force / abs(force), style.VERMILION)
        if load[2:] and load[2]:
            pen.arc(moved, -np.pi / 4, np.copysign(1.5 * np.pi, load[2]), ARC, style.VERMILION)
        size, name = abs(shapes[0][1][0, k]), asked.section.at
        axes.set_title(f"{load_in_words(study, load)} at {name}\n{name} moves {size:.3g} {length}\n"
                       f"drawn {scale:g} times as large", loc="left", fontsize=9)  # fmt: skip
    handles = [Line2D([], [], color=color, linewidth=width, label=words)
               for color, width, words in ((_PALE, 6.0, "without load"), (style.INK, 1.8, "under the load"),
                                           (style.VERMILION, 1.8, "load"))]  # fmt: skip
    legend_at_left(figure, handles, len(handles))
    return figure


def _shapes(drawn: Drawn, scene: Scene) -> list[tuple[Complexes, Complexes]]:
    """Lines of all links at rest, shape (n,), and their displacements by each load, shape (n, loads).

    The first begins at the asked point.
    """
    network, at, moved = drawn.body.network, scene.points[drawn.body.section.at], drawn.twists

    def shift(vertex: str, place: complex) -> Complexes:
        dx, dy, turn = moved[vertex]
        return np.asarray(dx + 1j * dy + 1j * turn * (place - at))

    shapes = [(np.array([at]), shift(network.asked, at)[None])]
    bent = set()
    for ways in network.ways_along_beams:
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
    course = course_of(beam.link, configuration)
    # The rod of a telescopic leg slides in its cylinder, whose pin stays where it is.
    root = beam.link.name if beam.link.telescopic else ways[0].a
    sitting = [(root, corners_of(beam.link)[0]), *((edge.b, edge.point) for edge in ways)]
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


def free_motion_figure(study: Study, result: Result, drawn: Drawn) -> Figure | None:
    """The asked body moved both ways along its free twist, at the first pose that has one."""
    table, section, row = result.tables["stiffness"], drawn.body.section, drawn.row
    scene = pose(study.mechanism, drawn.configuration)
    if scene is None:
        return None
    at = scene.points[section.at]
    body = [at, *hull([scene.points[p] for p in scene.link_points(section.link)])] if section.link else [at]
    turn = float(table["free_phi"][row]) if "free_phi" in table else 0.0
    rest = np.array([*body[1:], *body[1:2]] if len(body) > 1 else body)
    shift = complex(table["free_x"][row], table["free_y"][row])
    move = shift + 1j * turn * (rest - at)
    scale = _LARGEST_MOVE * scene.span / max(float(np.abs(move).max()), 1e-300)
    if turn:
        # Turned about its instantaneous centre, so that it keeps its shape.
        centre = at + 1j * shift / turn
        ways = [centre + (rest - centre) * np.exp(1j * way * scale * turn) for way in (1, -1)]
    else:
        ways = [rest + way * scale * move for way in (1, -1)]
    places = np.concatenate([[*scene.points.values()], *ways])
    figure, axes = posed(study, result.drawn["poses"], drawn, places, "free motion")
    for line, dash in zip(ways, ("-", "--"), strict=True):
        axes.plot(line.real, line.imag, dash, color=style.VERMILION, linewidth=2, zorder=6,
                  marker="o" if len(rest) == 1 else None, label="free to move" if dash == "-" else None)  # fmt: skip
    axes.legend(loc="upper left", frameon=True, framealpha=0.85, edgecolor="none")
    return figure
