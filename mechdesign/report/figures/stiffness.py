"""Pictures of a stiffness: equivalent springs [S4, Fig. 6], directions, curves or maps, deflections, free motion."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.stiffness.analysis import Drawn
from mechdesign.analyses.stiffness.elements import corners_of, course_of
from mechdesign.analyses.stiffness.network import NetworkEdge
from mechdesign.mechanism import Configuration
from mechdesign.numerics.arrays import Complexes, Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import ARC, Pen, draw_mechanism, point_labels
from mechdesign.report.figures.framing import ABOVE, BELOW, LEFT, MAX_HEIGHT, RIGHT, TITLE, fit, framed, windows
from mechdesign.report.figures.joint_forces import joint_force_figures, load_in_words
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.panels import (
    Plane,
    along,
    fitting,
    legend_room,
    map_sheet,
    plane,
    quantity,
    round_down,
    tick_abscissa,
)
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.scene import Scene, hull, pose
from mechdesign.results import Result
from mechdesign.study import Poses, Study

MAX_DIRECTIONS = 4
MAX_LOADS = 4
_COIL_LENGTH = 0.17  # over the size of the mechanism
_COIL_SWING = 0.12  # half the width of a coil over its length
_COIL_TURNS = 7
_COIL_ORDER = 5.0
_LARGEST_MOVE = 0.12  # largest drawn displacement over the size of the mechanism
_LARGEST_ELLIPSE = 0.3  # longest drawn half axis over the size of the mechanism
_ONE_SCALE = 8.0  # ratio of the longest half axes above which each ellipse is drawn at its own scale
# Points of type times letters that fill a line above the curves.
_LONGEST_NOTE = 900.0
_NOTE_SHARE = 0.65  # of the width of a narrow page
_FLAT = 0.02  # part of its value by which a stiffness changes that is written, not drawn
_TAIL = 0.04  # share of stiffnesses at either end of which ...
_BEYOND = 10.0  # ... no more is drawn than this ratio beyond the others
_LOGARITHMIC = 5.0  # ratio of values above which their axis is logarithmic
_PALE = "#D5DCE4"  # of the mechanism without load, in the legend
# Main axes of the ellipse: column, words, angle from that of k_max, colour and dashes.
_MAIN_AXES: tuple[tuple[str, str, float, str, Any], ...] = (
    ("k_min", "softest", np.pi / 2, style.VERMILION, "-"),
    ("k_max", "stiffest", 0.0, style.BLUE, (0, (2, 1))),
)
_LETTERS_AN_INCH = 14.5  # of a panel's title
# Inches.
_PANEL_TITLE = 0.17  # a line
_HEADING = 0.32
_LEGEND = 0.3
# Shape functions of a deflected beam, cubic between its ends as bending makes it, at these parts of its length.
_ALONG = np.linspace(0.0, 1.0, 25)
_CUBIC = np.array([1 - 3 * _ALONG**2 + 2 * _ALONG**3, _ALONG - 2 * _ALONG**2 + _ALONG**3,
                   3 * _ALONG**2 - 2 * _ALONG**3, _ALONG**3 - _ALONG**2])  # fmt: skip


def figures(study: Study, result: Result) -> Gallery:
    """``springs`` (first pose), ``directions`` (a few poses), and over many poses ``stiffness``, curves or a map.

    Under loads ``deflections`` (first pose), and along a sweep or path what the joints bear.
    """
    found = Gallery()
    drawn, poses = result.drawn, result.drawn["poses"]
    if "first" in drawn:
        found.add("springs", _springs, study, poses, drawn["first"])
        found.add("deflections", deflections, study, poses, drawn["first"])
    if "loose" in drawn:
        found.add("free", free_motion, study, result, drawn["loose"])
    found.add("directions", _directions, study, result)
    if not poses.listed and poses.count > 2:
        over = plane(study, poses)
        if over is not None:
            found.add("stiffness", _map, study, result, over)
        if len(poses.grid) == 1:
            found.add("stiffness", _curves, study, result)
    if "forces" in result.tables:
        found.add("joint_forces", joint_force_figures, study, result)
    return found


def _springs(study: Study, poses: Poses, drawn: Drawn) -> Figure | None:
    scene = pose(study.mechanism, drawn.configuration)
    coils = _coils(study, drawn, scene) if scene is not None else []
    if scene is None or not coils:
        return None
    places = np.concatenate([[*scene.points.values()], *([coil.place, coil.anchor] for coil in coils)])
    figure, axes = posed(study, poses, drawn, places, "equivalent springs", labels=False, drives=False)
    draw_coils(axes, coils)
    place_labels(axes, [coil.label for coil in coils] + point_labels(scene), covered(axes), order=8)
    return figure


def _coils(study: Study, drawn: Drawn, scene: Scene) -> list[Coil]:
    legs, length = drawn.body.legs or (), _COIL_LENGTH * scene.span
    coils, own = [], drawn.springs
    columns = (own.leg, own.place, own.angle, own.stiffness)
    for k, place, angle, stiffness in zip(*(column.tolist() for column in columns), strict=True):
        if np.isnan(angle):
            continue
        leg, along = legs[k], complex(np.exp(1j * angle))
        base, tip = scene.points[leg.base], scene.points[leg.tip]
        inward = ((base - place) * along.conjugate()).real
        grounded = abs(inward) > length and abs(base - place - inward * along) < 1e-6 * scene.span
        if grounded:
            anchor = base
        else:
            # Its line passes the leg's base: away from the body.
            body = scene.points[drawn.body.section.at]
            anchor = place + 1.4 * length * (along if ((place - body) * along.conjugate()).real > 0 else -along)
        text = quantity(stiffness, study.units.label("stiffness"))
        coils.append(Coil(text, place, anchor, tip, length, grounded))
    return coils


def _directions(study: Study, result: Result) -> Figure | None:
    """Where a force of every direction moves the asked point: an ellipse at it, in a few poses, with its main axes."""
    table, soft, poses = result.tables["stiffness"], result.tables["compliance"], result.drawn["poses"]
    shown, section = result.drawn["shown"], study.stiffness
    assert section is not None
    index = np.flatnonzero(np.isfinite(soft["C11"][shown.rows]) & (table["k_max"][shown.rows] > 0))
    posed = {int(k): pose(study.mechanism, shown.configuration, int(k)) for k in spread(index, MAX_DIRECTIONS)}
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
    places = [[*scene.points.values(), *(scene.points[section.at] + ellipse)]
              for scene, ellipse in zip(scenes.values(), ellipses, strict=True)]  # fmt: skip
    words = f"{force:g} {style.printed(study.units.label('force'))}"
    heading = f"ellipse: where a force of {words} in any direction moves {section.at}"
    wide = (style.width() - RIGHT) / min(len(scenes), 2) - LEFT
    # Broken between coordinates only.
    named = [re.sub("(?<!,) ", "\N{NO-BREAK SPACE}", pose_in_words(study, poses, int(row), 4)) for row in rows]
    where = [textwrap.fill(words, int(wide * _LETTERS_AN_INCH)) for words in named]
    lines = 4 + max(words.count("\n") for words in where)
    figure, panels = _panels(study, np.concatenate(places), len(scenes), heading, lines=lines)
    units = study.units.label("stiffness"), study.units.label("angle")
    shapes = zip(panels, scenes.items(), rows, scales, ellipses, where, strict=True)
    for axes, (k, scene), row, scale, ellipse, words in shapes:
        at = scene.points[section.at]
        draw_mechanism(axes, study.mechanism, shown.configuration, k, faint=True, size=_small(len(panels)))
        axes.fill((at + ellipse).real, (at + ellipse).imag, color=style.SKY, alpha=0.35, linewidth=0, zorder=4)
        axes.plot((at + ellipse).real, (at + ellipse).imag, color=style.INK, linewidth=1.2, zorder=5)
        angle, said = float(table["k_angle"][row]) * study.units.angle_factor, []
        for name, what, turn, color, dashes in _MAIN_AXES:
            stiff, way = float(table[name][row]), np.exp(1j * (angle + turn))
            line = at + scale / stiff * way * np.array([-1, 1])
            axes.plot(line.real, line.imag, color=color, linestyle=dashes, linewidth=1.8, zorder=5.2)
            toward = np.mod(np.angle(way), np.pi) / study.units.angle_factor
            said.append(f"{what} {quantity(stiff, units[0])} at {toward:.3g} {units[1]}")
        axes.plot(at.real, at.imag, "o", color=style.INK, markersize=4, zorder=5.4)
        said = [words, *said, f"drawn {scale / force:g} times as large"]
        axes.set_title("\n".join(said), loc="left", fontsize=8.5)
    handles = [Line2D([], [], color=color, linestyle=dashes, linewidth=1.8, label=f"{what} direction, {name}")
               for name, what, _, color, dashes in _MAIN_AXES]  # fmt: skip
    _legend(figure, handles)
    return figure


def _force(study: Study) -> float:
    """The force of an ellipse: about the largest of the study's loads, or else one unit."""
    assert study.stiffness is not None
    loads = [abs(complex(*load[:2])) for load in study.stiffness.loads]
    return round_down(max(loads)) if any(loads) else 1.0


def _panels(
    study: Study, places: Complexes, count: int, heading: str, lines: int = 3
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Drawings of one scale, two in a row, under a heading, with room for titles of some lines and a legend."""
    columns = 1 if style.narrow() else min(count, 2)
    heading = style.folded(heading[0].upper() + heading[1:], 11.0, style.width() - LEFT - RIGHT)
    window = fit(places, (style.width() - RIGHT - LEFT * columns) / columns, _height(count, columns))
    above = _PANEL_TITLE * lines + ABOVE
    top = _HEADING + style.line(11.0) * heading.count("\n")
    figure, axes = windows(window, study.units.label("length"), count, columns, above=above, top=top,
                           below=BELOW + _LEGEND)  # fmt: skip
    figure.text(LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), heading, va="top", fontsize=11)
    return figure, axes


def _height(count: int, columns: int) -> float:
    """Largest height of one of some panels (inches), all of them on a page of paper."""
    if count == 1:
        return MAX_HEIGHT
    return 3.2 if columns > 1 else min(3.2, 8.0 / count)


def _small(panels: int) -> float:
    """Size of symbols where several drawings stand side by side."""
    return 1.0 if panels == 1 else 0.7


def spread(values: Ints, most: int) -> Ints:
    """Of many values some, evenly."""
    return (
        values[np.unique(np.linspace(0, len(values) - 1, min(most, len(values))).astype(int))]
        if len(values)
        else values
    )


def _curves(study: Study, result: Result) -> Figure | None:
    """Stiffnesses to a force and to a moment along a path; what is the same everywhere is written, not drawn."""
    table, poses, units = result.tables["stiffness"], result.drawn["poses"], study.units
    over = along(study, poses)
    assert over is not None
    forces = {"k_x": ("-", style.BLUE, "o"), "k_y": ("-", style.ORANGE, "s"), "k_min": ("--", style.INK, ""),
              "k_max": (":", style.INK, "")}  # fmt: skip
    moments = {"k_phi": ("-", style.GREEN, "")}
    panels = []
    for about, kind, looks in (("stiffness to a force", "stiffness", forces),
                               ("to a moment", "rotational_stiffness", moments)):  # fmt: skip
        known = [name for name in looks if name in table and np.isfinite(table[name]).any()]
        flat = [name for name in known if _constant(table[name])]
        panels.append((about, units.label(kind), looks, [name for name in known if name not in flat], flat))
    if not any(curves or flat for *_, curves, flat in panels):
        return None
    notes = [f"{name} = {quantity(float(np.nanmean(table[name])), unit)}"
             for _, unit, _, _, flat in panels for name in flat]  # fmt: skip
    notes += [f"{name} rigid" for name in (*forces, *moments) if name in table and np.isinf(table[name]).all()]
    drawn = [panel for panel in panels if panel[3]] or [panel for panel in panels if panel[4]]
    figure = style.new_figure(5.2 if len(drawn) > 1 else 3.6)
    axes = figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (about, unit, looks, curves, flat) in zip(axes, drawn, strict=True):
        for k, name in enumerate(curves or flat):
            values = np.where(np.isfinite(table[name]), table[name], np.nan)
            dashes, color, marker = looks[name]
            each = max(1, len(values) // 12)
            axis.plot(over.values, values, dashes, label=name, color=color, marker=marker, markersize=5,
                      markevery=(k * each // 2, each), linewidth=2.4 if marker else 1.4)  # fmt: skip
        axis.set_ylabel(style.axis_label(about, unit))
        low, high = axis.dataLim.intervaly
        if high > _LOGARITHMIC * low > 0:
            axis.set_yscale("log")
            # Near a singularity a stiffness grows or vanishes without bounds; what it is elsewhere stays legible.
            every = np.concatenate(
                [table[name][np.isfinite(table[name]) & (table[name] > 0)] for name in curves or flat]
            )
            usual = np.quantile(every, (_TAIL, 1 - _TAIL)) * (1 / _BEYOND, _BEYOND)
            axis.set_ylim(max(0.8 * low, usual[0]), min(1.25 * high, usual[1]))
        else:
            axis.set_ylim(0, 1.1 * high)
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    words = f"everywhere the same: {', '.join(notes)}"
    size = 9.0 if style.narrow() else min(9.0, _LONGEST_NOTE / len(words))
    if style.narrow():
        words = style.folded(words, size, _NOTE_SHARE * style.width())
    above = 20 + 72 * style.line(size) * words.count("\n")
    axes[0].set_title("Stiffness along the motion", loc="left", fontsize=10, pad=above if notes else 6)
    if notes:
        axes[0].annotate(words, (0, 1), (0, 6), "axes fraction", "offset points", fontsize=size)
    axes[-1].set_xlabel(over.label)
    tick_abscissa(axes[-1], over)
    figure.align_ylabels(axes)
    return figure


def _constant(values: Floats) -> bool:
    known = values[np.isfinite(values)]
    return len(known) == len(values) and float(np.ptp(known)) <= _FLAT * float(np.abs(known).max())


def _map(study: Study, result: Result, over: Plane) -> Figure:
    """k_min over the poses, and k_max beside it."""
    table, unit = result.tables["stiffness"], study.units.label("stiffness")
    parts = []
    for name in ("k_min", "k_max"):
        values = np.where(np.isfinite(table[name]) & (table[name] > 0), table[name], np.nan)
        parts.append((style.axis_label(name, unit), values.reshape(over.x.shape)))
    about = f"at point {study.stiffness.at}" if study.stiffness is not None else ""
    return map_sheet(study, over, parts, "Stiffness to a force in the softest and the stiffest direction", about,
                     logarithmic=True)  # fmt: skip


@dataclass(frozen=True)
class Coil:
    """A spring from the point where it holds to its anchor; `tip` is the end of its leg, `length` of its coiled middle.

    The anchor of a grounded one is a joint of the ground, which the mechanism's drawing shows already.
    """

    text: str
    place: complex
    anchor: complex
    tip: complex
    length: float
    grounded: bool

    @property
    def path(self) -> Complexes:
        """The drawn line."""
        span = self.anchor - self.place
        share = np.linspace(0, 1, 600)
        part = min(0.7, self.length / abs(span))
        inside = np.clip((share - 0.5) / part + 0.5, 0, 1)
        wave = _COIL_SWING * self.length * np.sin(2 * np.pi * _COIL_TURNS * inside)
        return self.place + span * (share + 1j * wave / abs(span))

    @property
    def label(self) -> Label:
        """Its stiffness, beside its middle."""
        span = self.anchor - self.place
        anchors = tuple(self.place + share * span for share in (0.5, 0.56, 0.44, 0.62, 0.38))
        heading = float(np.angle(1j * span if (1j * span).real > 0 else -1j * span))
        return Label(self.text, anchors, style.VERMILION, 16, heading, 9.5)


def draw_coils(axes: Axes, coils: Sequence[Coil]) -> None:
    """Coil springs along their lines, each with a hatched anchor, and a dashed line to where the leg ends."""
    for coil in coils:
        if abs(coil.place - coil.tip) > 1e-3 * abs(coil.anchor - coil.place):
            _line(axes, np.array([coil.tip, coil.place]), 1.1, 0.0, linestyle=(0, (4, 3)))
        _line(axes, coil.path, 3.6, 0.05, color="white")
        _line(axes, coil.path, 1.5, 0.1)
        axes.plot(
            [coil.place.real], [coil.place.imag], "o", markersize=5, color=style.VERMILION, markeredgecolor="white",
            zorder=_COIL_ORDER + 0.3,
        )  # fmt: skip
        if coil.grounded:
            continue
        along = coil.length * (coil.anchor - coil.place) / abs(coil.anchor - coil.place)
        bar = 0.2j * along
        _line(axes, np.array([coil.anchor - bar, coil.anchor + bar]), 1.6, 0.1)
        for foot in coil.anchor + np.linspace(-1, 1, 6) * bar:
            _line(axes, np.array([foot, foot + (0.1 + 0.07j) * along]), 1.0, 0.1)


def _line(axes: Axes, places: Complexes, width: float, lift: float, **look: object) -> None:
    options: dict[str, Any] = {"color": style.VERMILION, "solid_capstyle": "round", "solid_joinstyle": "round"} | look
    axes.add_line(Line2D(places.real, places.imag, lw=width, zorder=_COIL_ORDER + lift, **options))


def posed(study: Study, poses: Poses, drawn: Drawn, places: Complexes, what: str, **look: Any) -> tuple[Figure, Axes]:
    """The mechanism in a pose, in a window that holds these places, too."""
    title = style.folded(f"{what} at {pose_in_words(study, poses, drawn.row)}", 11.0, style.width() - LEFT)
    above = TITLE + style.line(11.0) * title.count("\n")
    figure, axes = framed(places, study.units.label("length"), height=MAX_HEIGHT, above=above)
    axes.set_title(title, loc="left")
    draw_mechanism(axes, study.mechanism, drawn.configuration, **look)
    return figure, axes


def deflections(study: Study, poses: Poses, drawn: Drawn) -> Figure | None:
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
    figure, panels = _panels(study, places, len(loads), f"deflections, enlarged, at {where}")
    length = study.units.label("length")
    for k, (axes, lines, load, scale) in enumerate(zip(panels, bent, loads.tolist(), scales, strict=True)):
        draw_mechanism(axes, study.mechanism, drawn.configuration, faint=True, size=_small(len(panels)))
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
    _legend(figure, handles)
    return figure


def _legend(figure: Figure, handles: Sequence[Line2D]) -> None:
    """Entries in a row below the panels, in a column of a narrow page."""
    labels = [str(handle.get_label()) for handle in handles]
    style.grow(figure, below=legend_room(labels))
    columns = fitting(labels) if style.narrow() else len(handles)
    figure.legend(handles, labels, loc="lower left", ncols=columns, bbox_to_anchor=(LEFT / style.width() - 0.02, 0.0))


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


def free_motion(study: Study, result: Result, drawn: Drawn) -> Figure | None:
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
