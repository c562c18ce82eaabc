"""Free bodies: every force on the mechanism, and on each of its links alone, in the pose of the largest joint force."""

from __future__ import annotations

import cmath
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.mechanism.graph import GROUND
from mechdesign.questions.dynamics.figures.view import DynamicsView
from mechdesign.questions.dynamics.free_bodies import Action, actions_on, mass_centers
from mechdesign.questions.poses import pose_in_words
from mechdesign.report.figures import shapes, style
from mechdesign.report.figures.drawing import draw
from mechdesign.report.figures.framing import extent
from mechdesign.report.figures.joints import NOTHING
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.panels import quantity, round_down
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Scene, pose
from mechdesign.report.figures.shapes import Dashes, Line, Shape, Strut

MAX_LINKS = 11
LEAST = 5e-3  # part of the largest force, and of the largest moment, below which nothing is drawn
# Inches.
_LONGEST = 0.62  # arrow
_PAD = 0.8  # around a link, for arrows and their names
_TALL, _LOW = 2.5, 2.05  # a panel, and one of a page that holds no more
_EDGE, _TOP, _TITLE, _BOTTOM = 0.15, 0.62, 0.26, 0.55
_ARC = 19.0  # radius of a moment's arrow, points


class _Look(NamedTuple):
    """How a kind of action is drawn, and what it is called in the legend."""

    words: str
    color: str
    dashes: Dashes = "-"


LOOKS = {
    "joint": _Look("by a joint", style.BLUE),
    "weight": _Look("weight", style.GREEN, (0, (4, 1))),
    "inertia": _Look("inertia", style.ORANGE, (0, (1.6, 0.8))),
    "load": _Look("load", style.VERMILION),
    "spring": _Look("spring", shapes.SPRING_COLOR, (0, (4, 1, 1, 1))),
    "effort": _Look("drive", style.PURPLE),
    "coupling": _Look("coupling", style.INK),
}


@picture(DynamicsView, "free_bodies", order=10)
def free_bodies_figure(view: DynamicsView) -> Figure | None:
    """The mechanism with what acts on it from outside, and each link with all that acts on it; None without forces."""
    drawn, mechanism = view.drawn, view.study.mechanism
    index = _worst(view)
    scene = None if index is None else pose(mechanism, drawn.shown.configuration, index)
    if index is None or scene is None:
        return None
    acting = [own.at(0) for own in actions_on(drawn.motion, drawn.shown.take(np.array([index])))]
    largest = max(action.size for action in acting)
    turning = max(abs(action.moment) for action in acting)
    least = max(LEAST * turning, NOTHING * largest * mechanism.size)
    acting = [action for action in acting if action.size > LEAST * largest or abs(action.moment) > least]
    moving = [name for name in mechanism.description.links if name != GROUND]
    sizes = {name: max((a.size for a in acting if a.link == name), default=0.0) for name in moving}
    bearing = sorted(filter(sizes.get, moving), key=lambda name: -sizes[name])
    # A page holds the mechanism and so many links below it.
    held = int((style.tallest() - _TOP - _bottom()) / (_LOW + _TITLE)) - 1 if style.narrow() else MAX_LINKS
    shown = sorted(bearing[:held], key=moving.index)
    count = len(shown) + 1
    columns = 1 if style.narrow() else 2 if count < 5 else 3
    wide = (style.width() - 2 * _EDGE) / columns
    row = int(drawn.shown.rows[index])
    where, unit = pose_in_words(view.study, view.poses, row, 4), view.study.units.label("force")
    words = f"Forces on the links [{style.printed(unit)}] at {where}, where a joint bears most"
    words += f"; of {len(bearing)} links those {len(shown)} with the largest forces" * (len(shown) < len(bearing))
    words = style.folded(words, 11.0, style.width() - 2 * _EDGE)
    top, rows = _TOP + 0.18 * words.count("\n"), -(-count // columns)
    tall = min(_TALL, (style.tallest() - top - _bottom() + _TITLE) / rows - _TITLE)
    figure, panels = style.page(count, columns, tall, left=_EDGE, right=_EDGE, top=top, bottom=_bottom(), down=_TITLE)
    figure.text(_EDGE / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=11)
    colors = shapes.link_colors(mechanism)
    whole = shapes.mechanism_shapes(scene, colors, {})
    centers = mass_centers(view.study, drawn.shown.configuration, index)
    tile = _Tile(view, 72 * _LONGEST / largest, least, (wide, tall))
    outside = [action for action in acting if action.link != GROUND and _outside(action, acting)]
    tile.draw(panels[0], "Mechanism", whole, [*scene.points.values(), *scene.round], outside, [*centers.values()])
    for axes, name in zip(panels[1:], shown, strict=True):
        own = [scene.points[point] for point in scene.link_points(name)]
        mine = [action for action in acting if action.link == name]
        marked = [place for body, place in centers.items() if body.partition(":")[0] == name]
        body = _alone(scene, name, whole)
        outlines = [place for shape in body if isinstance(shape, Line) for place in shape.places]
        tile.draw(axes, name, body, [*own, *outlines, *(action.place for action in mine)], mine, marked)
    _key(figure, acting, largest, unit)
    return figure


def _worst(view: DynamicsView) -> int | None:
    """Which of the shown poses has the largest joint force; None where no joint bears any."""
    rows = view.drawn.shown.rows
    forces = [np.nan_to_num(view.column(name)[rows]) for name in view.question.forces]
    if not forces or not np.any(forces):
        return None
    return int(np.max(forces, axis=0).argmax())


def _outside(action: Action, acting: Sequence[Action]) -> bool:
    """Whether it comes from outside of the moving links: not from a joint or spring between two of them."""
    if action.kind not in ("joint", "spring", "effort", "coupling"):
        return True
    same = [other for other in acting if other.kind == action.kind and other.name == action.name]
    return any(other.link == GROUND and abs(other.force + action.force) <= LEAST * action.size
               and abs(other.moment + action.moment) <= LEAST * abs(action.moment) for other in same)  # fmt: skip


def _alone(scene: Scene, name: str, whole: Sequence[Shape]) -> list[Shape]:
    """The shapes of one link, with its pins and without springs."""
    points, ends = scene.link_points(name), scene.description.links[name].ends
    alone: list[Shape] = []
    for shape in whole:
        if isinstance(shape, Strut):
            own = shape.points == ends and shape.color != shapes.SPRING_COLOR
        elif isinstance(shape, Line):
            own = shape.link == name
        else:
            own = (shape.link == name or shape.point in points) and shape.edge != shapes.SPRING_COLOR
        if own:
            alone.append(shape)
    return alone


class _Tile:
    """Draws a link and its arrows into a panel; forces to one scale, each link to its own."""

    def __init__(self, view: DynamicsView, scale: float, least: float, size: tuple[float, float]) -> None:
        self.unit, self.scale, (self.wide, self.tall) = view.study.units.label("moment"), scale, size
        self.least = least
        self.smallest = 1e-3 * view.study.mechanism.size

    def draw(
        self, axes: Axes, title: str, body: Sequence[Shape], places: Sequence[complex], acting: Sequence[Action],
        centers: Sequence[complex],
    ) -> None:  # fmt: skip
        """One panel."""
        middle, across, tall = extent([*places, *centers])
        across, tall = max(across, self.smallest), max(tall, self.smallest)
        scale = min((self.wide - 2 * _PAD) / across, (self.tall - 2 * _PAD) / tall)
        half = complex(self.wide, self.tall) / 2 / scale
        axes.set_xlim(middle.real - half.real, middle.real + half.real)
        axes.set_ylim(middle.imag - half.imag, middle.imag + half.imag)
        axes.set_aspect("equal")
        _bare(axes)
        largest = max((action.size for action in acting), default=0.0) * self.scale / (72 * _LONGEST)
        longer = round_down(1 / largest) if largest else 1.0
        words = f", arrows \N{MULTIPLICATION SIGN}{longer:g}" if longer > 1 else ""
        axes.set_title(f"{title}{words}", loc="left", fontsize=9.5, color=style.INK)
        draw(axes, body, size=0.8)
        draw(axes, shapes.center_shapes(centers), size=0.8)
        labels = []
        for action in sorted(acting, key=lambda action: -action.size):
            look = LOOKS[action.kind]
            way = longer * self.scale * action.force
            if abs(way) > longer * 72 * _LONGEST * LEAST:
                # A push ends at its place, a pull begins there.
                push = action.kind not in ("weight", "inertia") and ((middle - action.place).conjugate() * way).real > 0
                draw(
                    axes, shapes.arrow(action.place, -way if push else 0j, 0j if push else way, look.color, look.dashes)
                )
                end = action.place + (-way if push else way) / 72 / scale
                heading = cmath.phase(end - action.place)
                name = "" if action.kind in ("weight", "inertia") else f"{action.name} "
                labels.append(
                    Label(
                        f"{name}{quantity(action.size, '').strip()}",
                        (end, (2 * end + action.place) / 3),
                        look.color,
                        3.0,
                        heading,
                        8.5,
                    )
                )
            if abs(action.moment) > self.least:
                sweep = np.copysign(1.4 * np.pi, action.moment)
                draw(axes, shapes.arc(action.place, -0.2 * np.pi, sweep, _ARC, look.color))
                words = quantity(abs(action.moment), self.unit)
                labels.append(Label(words, (action.place,), look.color, _ARC + 3, None, 8.5))
        place_labels(axes, labels, covered(axes), order=6.0)


def _key(figure: Figure, acting: Sequence[Action], largest: float, unit: str) -> None:
    """Legend of the kinds, and an arrow of a round force."""
    kinds = [kind for kind in LOOKS if any(action.kind == kind for action in acting)]
    handles = [Line2D([], [], color=LOOKS[kind].color, linestyle=LOOKS[kind].dashes, linewidth=1.8,
                      label=LOOKS[kind].words) for kind in kinds]  # fmt: skip
    columns = 3 if style.narrow() else len(handles)
    figure.legend(handles=handles, loc="lower left", ncols=columns, borderaxespad=0.2, columnspacing=1.2,
                  handlelength=1.8)  # fmt: skip
    force = round_down(largest)
    right, length, low = style.width() - _EDGE, _LONGEST * force / largest, _bottom() - 0.39
    key = figure.add_axes((0, 0, 1, _bottom() / figure.get_figheight()))
    key.set_xlim(0, style.width())
    key.set_ylim(0, _bottom())
    _bare(key)
    draw(key, shapes.arrow(complex(right - length, low), 0j, complex(72 * length), style.INK))
    key.text(right - length - 0.08, low, quantity(force, unit), ha="right", va="center", fontsize=9)


def _bottom() -> float:
    """Inches for the legend and the arrow, which stands above it on a narrow page."""
    return _BOTTOM + 0.35 * style.narrow()


def _bare(axes: Axes) -> None:
    """Without ticks and edges."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
    axes.patch.set_visible(False)
