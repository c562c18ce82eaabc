"""The mechanism at its limits, dead points or some other poses, with velocities, accelerations and instant centres."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.path import Path

from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.questions.kinematics.instant_centres import Centre
from mechdesign.questions.kinematics.special_poses import LIMIT, SINGULAR, SpecialPose, SpecialPoses
from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.report.figures.framing import BELOW, LEFT, RIGHT, extent, tiled, windows
from mechdesign.report.figures.labels import HALO
from mechdesign.report.figures.panels import quantity, round_down
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import Sweep, pose, ranks
from mechdesign.study import Study

_MAX_COLUMNS = 3
_PAGE = 7.5  # inches, of all panels together, about
_MIN_HEIGHT = 1.8  # inches, of a panel
_LOWEST = 0.9  # and on a page that holds no more
_TRIES = 4  # to find panels that a page holds
_GAP = 0.15  # inches between panels
_PAD = 0.42  # inches around what is drawn
_SYMBOLS = 0.75  # size of symbols
_TITLE = 0.16  # inches, a line above a panel, and what is left free around its lines
_TITLE_ROOM = 0.14
_LETTERS_AN_INCH = 14.5  # in a panel's title
_TITLE_SIZE = 9.0
_HEADING = 0.34  # inches, the heading
_HEADING_LINE = 0.19  # inches, a further line of it
_KEY = 0.26  # inches, a row of the key
_KEY_LETTER = 0.074  # inches, a letter of the key
_SYMBOL = 0.3  # inches, a symbol of the key and its gap
_BETWEEN = 0.35  # inches between two parts of the key
_LONGEST = 0.36  # of the larger side of the mechanism, the longest arrow
_SHORTEST = 0.01  # of the longest arrow: shorter ones are not drawn
_STILL = 1e-9  # of the fastest point's rate: slower points stand still
_KEY_ARROW = 0.9  # inches, an arrow of the key at most
_HEAD = 8.5  # points, a head's length, and of its arrow at most
_HEAD_SHARE = 0.6
_NEAR = 1.1  # larger sides of the mechanism from its middle up to which instant centres are drawn
_TICK_EDGE = 0.07  # of a panel's width, at both ends, without the number of a tick
_ORDER = 4.8  # above links and pins, below names
_SHAPES = ("o", "s", "D", "^", "v", "p")
_FILLED_HEAD = Path([(-1, 0.36), (0, 0), (-1, -0.36), (-1, 0.36)], closed=True)
_OPEN_HEAD = Path([(-1, 0.42), (0, 0), (-1, -0.42)])


_Row = list[tuple[str, str]]


class RateArrow(NamedTuple):
    """An order of rates, and how its arrows look."""

    name: str
    color: str
    look: dict[str, Any]
    head: Path
    filled: bool


KINDS = (
    RateArrow("velocity", style.INK, {"linestyle": "-", "linewidth": 1.7}, _FILLED_HEAD, True),
    RateArrow("acceleration", style.VERMILION, {"linestyle": (0, (3, 1.4)), "linewidth": 1.5}, _OPEN_HEAD, False),
)


@picture(MotionView, "poses", order=30)
def poses_figure(view: MotionView) -> Figure | None:
    """A panel a pose, all on one scale, with a key of the arrows; None where nothing but its motion is to be seen."""
    study, sweep, chosen = view.study, view.sweep, view.drawn.special
    centres = list(chosen.shown[0].centres) if chosen.shown else []
    if not chosen.shown or not (chosen.special or chosen.rates or centres or sweep.poses.listed):
        return None
    mechanism, points = study.mechanism, pointing(study)
    places = [mechanism_places(sweep, special) for special in chosen.shown]
    middle, wide, tall = extent(np.concatenate(places))
    side = max(wide, tall)
    # Lengths of arrows by their rates.
    scales = [_scale(chosen.shown, points, order, side) for order in range(len(KINDS))]
    for special in chosen.shown:
        for order, scale in enumerate(scales):
            tips = [place_of(special, point) + scale * rates_of(special, order)[point] for point in points]
            places.append(np.array(tips, dtype=complex))
        places.append(np.array([z for z in special.centres.values() if abs(z - middle) <= _NEAR * side], dtype=complex))
    everything, count = np.concatenate(places), len(chosen.shown)
    rows = _key_rows(centres)
    arrows = sum(map(bool, scales)) if style.narrow() else int(any(scales))  # rows of the key
    heading = style.folded(_heading(chosen, listed=sweep.poses.listed), 11, style.width() - LEFT - RIGHT)
    top = _HEADING + _HEADING_LINE * heading.count("\n") + _KEY * (arrows + len(rows))
    page, least = _PAGE, _MIN_HEIGHT
    # Lower panels may stand in more columns, and narrower ones have more lines above them.
    for _ in range(_TRIES):
        columns, window = tiled(everything, count, _MAX_COLUMNS, gap=_GAP, pads=(_PAD, _PAD), page=page, least=least)
        titles = [_title(special, chosen.rates, int(window.width * _LETTERS_AN_INCH)) for special in chosen.shown]
        above = _TITLE_ROOM + _TITLE * max(title.count("\n") + 1 for title in titles)
        lines = -(-count // columns)
        room = style.tallest() - top - BELOW - lines * above
        if lines * window.height <= room:
            break
        page, least = room, _LOWEST
    figure, grid = windows(window, study.units.label("length"), count, columns, gap=_GAP, above=above, top=top)
    for axes, title, special in zip(grid, titles, chosen.shown, strict=True):
        axes.set_title(title, loc="left", fontsize=_TITLE_SIZE)
        axes.locator_params(nbins=5)
        # The last number of a panel would lie over the first of the next.
        low, high = axes.get_xlim()
        edge = _TICK_EDGE * (high - low)
        axes.set_xticks([tick for tick in axes.get_xticks().tolist() if low + edge <= tick <= high - edge])
        for order, scale in enumerate(scales):
            _draw_arrows(axes, special, points, order, scale, side, window.scale)
        _draw_centres(axes, special, centres, int(window.width * _LETTERS_AN_INCH))
        draw_mechanism(axes, mechanism, special.configuration, special.index, drives=False, travel=sweep.travel,
                       size=_SYMBOLS)  # fmt: skip
    _draw_key(figure, study, heading, scales, window.scale, side, rows)
    return figure


def mechanism_places(sweep: Sweep, special: SpecialPose) -> np.ndarray:
    """Points and guides of a pose."""
    scene = pose(sweep.mechanism, special.configuration, special.index)
    return np.array([] if scene is None else scene.places(sweep.travel), dtype=complex)


def pointing(study: Study) -> list[str]:
    """Points whose rates are drawn: those asked for, else those that tell most."""
    section, ranked = study.kinematics, ranks(study)
    points = dict.fromkeys(name.split(".")[0] for name in (section and section.outputs) or ())
    return [name for name in points if name in ranked] or [
        name for name, rank in ranked.items() if rank == max(ranked.values())
    ]


def rates_of(special: SpecialPose, order: int) -> Any:
    return special.accelerations if order else special.velocities


def place_of(special: SpecialPose, point: str) -> complex:
    return complex(special.configuration.point(point)[special.index])


def _scale(shown: Sequence[SpecialPose], points: Sequence[str], order: int, side: float) -> float:
    """Length of an arrow over its rate, 0 where nothing moves."""
    sizes = np.array([abs(rates_of(special, order)[point]) for special in shown for point in points])
    fastest = np.array([abs(rate) for special in shown for rate in rates_of(special, order).values()])
    largest = float(np.nanmax(sizes, initial=0.0))
    usual = float(np.nanmax(fastest, initial=0.0))
    if order:
        # At velocities v over the size of the mechanism accelerations are about v^2 / size, however small by chance.
        speeds = np.array([abs(rate) for special in shown for rate in special.velocities.values()])
        usual = max(usual, float(np.nanmax(speeds, initial=0.0)) ** 2 / side)
    moves = largest > _STILL * usual
    return _LONGEST * side / largest if moves else 0.0


def _title(special: SpecialPose, rates: bool, letters: int) -> str:
    lost = rates and not np.isfinite(list(special.velocities.values())).all()
    remark = "; ".join([part for part in (special.event, "singular, no rates" if lost else "") if part])
    return "\n".join(textwrap.fill(line, letters) for line in (special.where, remark) if line)


def _heading(chosen: SpecialPoses, *, listed: bool) -> str:
    heading = "Poses asked for" if listed else "Poses spread evenly over the motion"
    if chosen.special:
        ends = [special.event.startswith(LIMIT) for special in chosen.shown if special.event]
        singular = [special.event.startswith(SINGULAR) for special in chosen.shown if special.event]
        parts = ["limits of the motion"] * any(ends) + ["singular poses"] * any(singular)
        parts += ["links that come into line"] * (sum(ends) + sum(singular) < len(ends))
        parts += ["poses between"] * any(not special.event for special in chosen.shown)
        heading = ", ".join(parts)
        heading = heading[0].upper() + heading[1:]
    return heading + (f"; the first {len(chosen.shown)}, and {chosen.left_out} more" if chosen.left_out else "")


def arrow(base: complex, along: complex, kind: RateArrow, inches: float, **more: Any) -> Line2D:
    """A line from a place along a vector, with the head of its kind at the tip; `inches` a length of one is drawn."""
    tip, head_length = base + along, min(_HEAD, _HEAD_SHARE * 72 * inches * abs(along))
    head = MarkerStyle(kind.head, fillstyle="full" if kind.filled else "none").rotated(rad=float(np.angle(along)))
    return Line2D(
        [base.real, tip.real], [base.imag, tip.imag], color=kind.color, marker=head, markevery=[1],
        markersize=2 * head_length, markeredgecolor=kind.color, markerfacecolor=kind.color if kind.filled else "none",
        markeredgewidth=0.2 if kind.filled else 1.5, solid_capstyle="butt", dash_capstyle="butt", zorder=_ORDER,
        **kind.look, **more,
    )  # fmt: skip


def _draw_arrows(
    axes: Axes, special: SpecialPose, points: Sequence[str], order: int, scale: float, side: float, inches: float
) -> None:  # fmt: skip
    kind = KINDS[order]
    for point in points:
        along = scale * rates_of(special, order)[point]
        if np.isfinite(along) and abs(along) > _SHORTEST * _LONGEST * side:
            axes.add_line(arrow(place_of(special, point), along, kind, inches, label=f"{kind.name} of {point}"))


def _draw_centres(axes: Axes, special: SpecialPose, centres: Sequence[Centre], letters: int) -> None:
    away, (left, right), (low, high) = list[str](), axes.get_xlim(), axes.get_ylim()
    for centre, shape in zip(centres, _SHAPES * len(centres), strict=False):
        z = special.centres[centre]
        if left < z.real < right and low < z.imag < high:
            axes.plot([z.real], [z.imag], **centre_look(shape), label=f"instant centre {centre.name}")
        else:
            x, y = (part if abs(part) > _STILL * abs(z) else 0.0 for part in (z.real, z.imag))
            where = f"at ({x:.4g}, {y:.4g})" if np.isfinite(z) else "at infinity" if np.isinf(z) else "none"
            away.append(textwrap.fill(f"centre of {centre.one}, {centre.other}: {where}", letters))
    if away:
        axes.text(0.02, 0.02, "\n".join(away), transform=axes.transAxes, fontsize=8, va="bottom", zorder=5.2,
                  path_effects=HALO)  # fmt: skip


def centre_look(shape: str = "o") -> dict[str, Any]:
    """How an instant centre is marked."""
    return {"marker": shape, "linestyle": "none", "markersize": 8.5, "markerfacecolor": (1, 1, 1, 0.35),
            "markeredgecolor": style.PURPLE, "markeredgewidth": 2.2, "zorder": _ORDER}  # fmt: skip


def _key_rows(centres: Sequence[Centre]) -> list[_Row]:
    """Words and shapes of the marks of instant centres, as many in a row as the page is wide."""
    rows: list[_Row] = []
    x = style.width()
    for centre, shape in zip(centres, _SHAPES * len(centres), strict=False):
        words = f"instant centre of {centre.one} and {centre.other}"
        wide = _SYMBOL + _KEY_LETTER * len(words) + _BETWEEN
        if x + wide - _BETWEEN > style.width():
            rows.append([])
            x = LEFT
        rows[-1].append((words, shape))
        x += wide
    return rows


def _draw_key(
    figure: Figure, study: Study, heading: str, scales: Sequence[float], inches: float, side: float, rows: list[_Row]
) -> None:  # fmt: skip
    """The heading, below it arrows of round rates, and the marks of instant centres; `inches` a length of one."""
    height = figure.get_figheight()
    figure.text(LEFT / style.width(), 1 - 0.12 / height, heading, va="top", fontsize=11)
    line = height - 0.22 - _HEADING_LINE * heading.count("\n")

    def write(x: float, words: str) -> float:
        figure.text(x / style.width(), line / height, words, va="center", fontsize=9)
        return x + _KEY_LETTER * len(words) + _BETWEEN

    x = LEFT
    line -= _KEY if any(scales) else 0.0
    for kind, scale in zip(KINDS, scales, strict=True):
        if scale:
            if style.narrow() and x > LEFT:
                line, x = line - _KEY, LEFT
            most = min(_LONGEST * side, _KEY_ARROW / inches)
            value = round_down(most / scale)
            length = value * scale * inches
            key = arrow(complex(x, line), length, kind, 1.0, transform=figure.dpi_scale_trans, label=kind.name)
            figure.add_artist(key)
            x = write(x + length + 0.1, f"{kind.name} {quantity(value, study.units.label(kind.name))}")
    for row in rows:
        line, x = line - _KEY, LEFT
        for words, shape in row:
            mark = Line2D([x + 0.08], [line], **centre_look(shape), transform=figure.dpi_scale_trans)
            figure.add_artist(mark)
            x = write(x + _SYMBOL, words)
