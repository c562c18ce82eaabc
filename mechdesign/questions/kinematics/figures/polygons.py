"""Velocity and acceleration polygons of a pose: the rates of all points from one pole, and of each link's points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mechdesign.mechanism.graph import GROUND
from mechdesign.numerics.arrays import Complexes
from mechdesign.questions.kinematics.figures.poses import KINDS, arrow, place_of, rates_of
from mechdesign.questions.kinematics.figures.view import MotionView
from mechdesign.questions.kinematics.special_poses import SpecialPose
from mechdesign.report.figures import style
from mechdesign.report.figures.framing import LEFT, fit
from mechdesign.report.figures.labels import Label, covered, place_labels
from mechdesign.report.figures.panels import fitting, legend_at_left
from mechdesign.report.figures.pictures import picture
from mechdesign.report.figures.scene import hull
from mechdesign.report.figures.shapes import link_colors

MOST_POSES = 3
POLE = "p"
MOST_TICKS = 6
_TALL, _WIDE = 2.7, 3.0  # inches, a panel and its title
_LEFT, _RIGHT, _TOP, _BELOW, _BETWEEN, _DOWN = 0.85, 0.15, 0.95, 0.95, 0.85, 0.75
_LEGEND_ROW = 0.19
_PAD = 0.32  # inches around a polygon
_SAME = 1e-6  # of the largest rate: tips as near as this are one
_NAME = 9.0  # points


@picture(MotionView, "polygons", order=70)
def polygons_figure(view: MotionView) -> Figure | None:
    """A row for each of a few poses, or of the listed ones, with both polygons; where the study asks for it."""
    regular = [special for special in view.drawn.special.shown if np.isfinite(list(special.velocities.values())).all()]
    if not view.asks_for("polygons") or not regular:
        return None
    # Where links are in line their velocities are, too: other poses tell more.
    shown = ([special for special in regular if not special.event] or regular)[: 1 if style.narrow() else MOST_POSES]
    columns, count = 1 if style.narrow() else 2, len(shown)
    titles = [
        style.folded(f"{kind.name.capitalize()} at {special.where}", 9, _WIDE) for special in shown for kind in KINDS
    ]
    down = _DOWN + style.line(9) * max(words.count("\n") for words in titles)
    figure, panels = style.page(2 * count, columns, _TALL, left=_LEFT, right=_RIGHT, top=_TOP, bottom=_BELOW,
                                across=_BETWEEN, down=down)  # fmt: skip
    words = f"Velocity and acceleration polygons: from the pole {POLE} to the tip of each point's vector"
    words += "\nthin dashes: acceleration of a link's second point towards its first, and across the line between them"
    words = style.folded(words, 9, style.width() - _LEFT)
    style.grow(figure, above=style.line(9) * max(words.count("\n") - 1, 0))
    figure.text(_LEFT / style.width(), 1 - 0.1 / figure.get_figheight(), words, va="top", fontsize=9)
    for k, special in enumerate(shown):
        for order, kind in enumerate(KINDS):
            axes = panels[2 * k + order]
            unit = view.study.units.label(kind.name)
            axes.set_title(titles[2 * k + order], loc="left", fontsize=9)
            axes.set_xlabel(style.axis_label(f"{kind.name} x", unit))
            axes.set_ylabel(style.axis_label(f"{kind.name} y", unit))
            _draw(view, axes, special, order)
    colors = link_colors(view.study.mechanism)
    handles = [Line2D([], [], color=colors[link], linewidth=1.8, label=link) for link in images(view, shown[0], 0)]
    names = [str(handle.get_label()) for handle in handles]
    columns = fitting(names, style.LOOKS["screen"].width - LEFT)
    style.grow(figure, below=_LEGEND_ROW * (-(-len(names) // columns) - 1))
    legend_at_left(figure, handles, columns)
    return figure


def images(view: MotionView, special: SpecialPose, order: int) -> Mapping[str, dict[str, complex]]:
    """The rates of every link's points at a pose by link and point, where it has two or more; the ground's are zero."""
    links, rates = view.study.mechanism.description.links, rates_of(special, order)
    still = dict.fromkeys(links[GROUND].all_points, 0j)
    own = {name: {point: complex((rates | still)[point]) for point in link.all_points}
           for name, link in links.items() if name != GROUND}  # fmt: skip
    return {name: points for name, points in own.items() if len(points) > 1}


def _draw(view: MotionView, axes: Axes, special: SpecialPose, order: int) -> None:
    """The polygon of one order of rates: arrows from the pole, and the image of each link."""
    mechanism, kind = view.study.mechanism, KINDS[order]
    colors, tips = link_colors(mechanism), dict[str, complex]()
    for points in (links := images(view, special, order)).values():
        tips |= points
    parts = _parts(view, special, links) if order else {}
    places = np.array([0j, *tips.values(), *(path[1] for path in parts.values())])
    largest = float(np.abs(places).max())
    box, figure = axes.get_position(), axes.get_figure(root=True)
    assert figure is not None
    window = fit(places if largest else np.array([-1, 1j]), figure.get_figwidth() * box.width,
                 figure.get_figheight() * box.height, _PAD)  # fmt: skip
    half = complex(figure.get_figwidth() * box.width, figure.get_figheight() * box.height) / 2 / window.scale
    axes.set_xlim((window.middle - half).real, (window.middle + half).real)
    axes.set_ylim((window.middle - half).imag, (window.middle + half).imag)
    axes.set_aspect("equal")
    axes.locator_params(nbins=MOST_TICKS)
    named: dict[complex, list[str]] = {0j: [POLE]}
    for point, tip in tips.items():
        same = next((other for other in named if abs(tip - other) <= _SAME * largest), tip)
        named.setdefault(same, []).append(point)
        if same == tip:
            axes.add_line(arrow(0j, tip, kind, window.scale))
    for link, points in links.items():
        outline = hull(list(points.values()))
        outline = [*outline, outline[0]] if len(outline) > 2 else outline
        axes.plot(np.real(outline), np.imag(outline), color=colors[link], linewidth=1.8, zorder=4.9)
    for link, path in parts.items():
        axes.plot(path.real, path.imag, color=colors[link], linewidth=1.0, linestyle=(0, (4, 2)), zorder=4.7)
    axes.plot([0], [0], "+", color=style.INK, markersize=11, markeredgewidth=1.6, zorder=5)
    labels = [Label(", ".join(names), (tip,), style.INK, 6.0, float(np.angle(tip - window.middle)), _NAME)
              for tip, names in named.items()]  # fmt: skip
    place_labels(axes, labels, covered(axes), order=5.2)


def _parts(view: MotionView, special: SpecialPose, links: Mapping[str, dict[str, complex]]) -> dict[str, Complexes]:
    """By link, the acceleration of its second point from that of its first, over -omega^2 r; of links of one length."""
    described, parts = view.study.mechanism.description.links, {}
    for link, points in links.items():
        one, other, *_ = points
        if not described[link].telescopic:
            corner = points[one] + centripetal(special, one, other)
            parts[link] = np.array([points[one], corner, points[other]])
    return parts


def centripetal(special: SpecialPose, one: str, other: str) -> complex:
    """Acceleration of one point of a link towards another that it turns about: -omega^2 times its arm."""
    arm = place_of(special, other) - place_of(special, one)
    slip = complex(special.velocities.get(other, 0j)) - complex(special.velocities.get(one, 0j))
    return -(abs(slip) ** 2) * arm / abs(arm) ** 2
