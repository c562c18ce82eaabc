"""Drawings of the mechanism: links, named joints, slides, ground and drives."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechdesign.errors import MechdesignError
from mechdesign.report.figures import style
from mechdesign.report.figures.annotations import Turn, drive_arrows, name_labels, obstacles
from mechdesign.report.figures.labels import place_labels
from mechdesign.report.figures.scene import GROUND, Scene, hull, pose, travels
from mechdesign.report.figures.shapes import Pen

if TYPE_CHECKING:
    from mechdesign.mechanism import Mechanism
    from mechdesign.mechanism.configuration import Configuration
    from mechdesign.study import Study

DRIVE = style.VERMILION
Panel = tuple[str, "Configuration", int]
LINKS = (style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, "#8A6A2A", "#5B4FA2", "#6E6E6E")
_TRAVEL_POSES = 100  # poses from which the travel of the slides is taken
# Inches around a panel's drawing (for symbols and names), left of it, below and above it (for axis labels and title).
_PAD, _LEFT, _BELOW, _ABOVE = 0.5, 0.68, 0.55, 0.42
_LINE, _LETTERS = 0.18, 11.5  # height of a further line of a title, and letters in an inch of it


def link_colors(mechanism: Mechanism) -> dict[str, str]:
    """The colour of each link, the same in every picture."""
    moving = [name for name in mechanism.description.links if name != GROUND]
    return {name: LINKS[k % len(LINKS)] for k, name in enumerate(moving)} | {GROUND: style.INK}


def draw_mechanism(
    axes: Axes,
    mechanism: Mechanism,
    configuration: Configuration,
    index: int = 0,
    *,
    faint: bool = False,
    labels: bool = True,
    drives: bool = True,
    travel: Mapping[str, tuple[float, float]] | None = None,
) -> None:
    """Draw a mechanism in one pose of a batch; a pose that cannot be assembled draws nothing.

    Sizes of symbols are in points on paper, so that limits may change after drawing; only labels need final limits.

    Parameters
    ----------
    index : int
        Pose in the flattened batch.
    faint : bool
        Pale and below what is drawn otherwise, without labels and drives: for further poses.
    travel : mapping, optional
        Range of each slide (lengths from the line's origin), which its guide should cover.
    """
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=0.22, order=2.0) if faint else Pen(axes)
    for point in scene.pivots():
        pen.pivot(scene.points[point])
    _draw_guides(pen, scene, colors, travel or {})
    for name, link in scene.description.links.items():
        if name == GROUND:
            continue
        places = [scene.points[point] for point in scene.link_points(name)]
        if link.telescopic and link.ends:
            pen.leg(scene.points[link.ends[0]], scene.points[link.ends[1]], colors[name])
            body = hull([scene.points[point] for point in link.points])
        else:
            body = hull(places)
        if len(body) > 2:
            pen.plate(body, colors[name])
        elif len(body) == 2:
            pen.bar(body, colors[name])
    for point, kind in scene.kinds().items():
        if kind == "pin":
            pen.pin(scene.points[point])
        elif kind == "clamp":
            pen.clamp(scene.points[point])
        elif kind == "tracer":
            owner = next(name for name in scene.description.links if point in scene.link_points(name))
            pen.tracer(scene.points[point], colors[owner])
    if faint:
        return
    arrows = drive_arrows(scene) if drives else ()
    for arrow in arrows:
        if isinstance(arrow, Turn):
            pen.turn(arrow.place, arrow.start, arrow.sweep, arrow.radius, DRIVE)
        else:
            pen.push(arrow.place, arrow.along, arrow.length, arrow.away, DRIVE)
    if labels:
        named = name_labels(scene, colors, arrows, DRIVE)
        place_labels(axes, named, obstacles(axes, scene, arrows, travel or {}), order=pen.order + 2)


def _draw_guides(
    pen: Pen, scene: Scene, colors: Mapping[str, str], travel: Mapping[str, tuple[float, float]]
) -> None:  # fmt: skip
    for guide in scene.guides:
        start, end = guide.ends(travel, scene.span)
        if guide.owner == GROUND:
            pen.rail(start, end)
        else:
            # The link reaches from where its line begins to beyond the slider.
            places = [scene.points[point] for point in scene.link_points(guide.owner)]
            along = [((place - guide.origin) * guide.along.conjugate()).real for place in places]
            along += [((place - guide.origin) * guide.along.conjugate()).real for place in (start, end)]
            pen.bar([guide.origin + s * guide.along for s in (min(along), max(along))], colors[guide.owner])
            if guide.slider is None:
                pen.slot((start, end))
        if guide.slider is not None:
            pen.block(guide.pin, guide.along, colors[guide.slider])


def mechanism_figure(study: Study) -> Figure:
    """The sketch pose and the first pose of the study's kinematics, on one scale; use inside `style.context`."""
    mechanism = study.mechanism
    sketch = mechanism.sketch_configuration
    panels: list[Panel] = [("sketch pose", sketch, 0)]
    scenes = [pose(mechanism, sketch)]
    solved = _poses(study)
    if solved is not None:
        configuration, titles = solved
        poses = [pose(mechanism, configuration, k) for k in range(len(titles))]
        first = next((k for k, scene in enumerate(poses) if scene is not None), None)
        if first is not None:
            note = "first pose" if first == 0 else "first pose that can be assembled"
            if _same(scenes[0], poses[first]):
                panels = []
                note = f"sketch and {note}"
            panels.append((f"{note}: {titles[first]}", configuration, first))
            scenes += poses
    return _compose(mechanism, panels, travels([scene for scene in scenes if scene is not None]), study.units.length)


def _poses(study: Study) -> tuple[Configuration, list[str]] | None:
    """Poses over the whole range of the study's kinematics, the first one first, and their coordinates in words."""
    try:
        group = study.poses("kinematics").groups[0]
        rows = np.unique(np.linspace(0, len(group.rows) - 1, _TRAVEL_POSES).astype(int))
        quantities = [study.mechanism.quantity(name) for name in group.names]
        factors = [study.units.angle_factor if quantity == "angle" else 1.0 for quantity in quantities]
        values = [group.values[name][rows] for name in group.names]
        given = [column * factor for column, factor in zip(values, factors, strict=True)]
        configuration = study.mechanism.plan(group.names).solve(given)
    except MechdesignError:
        return None
    labels = [study.units.label(quantity) for quantity in quantities]
    # A title may be broken between coordinates only.
    words = [
        ", ".join(
            f"{name} = {value:.4g} {label}".rstrip().replace(" ", "\N{NO-BREAK SPACE}")
            for name, value, label in zip(group.names, row, labels, strict=True)
        )
        for row in zip(*values, strict=True)
    ]
    return configuration, words


def _same(one: Scene | None, other: Scene | None) -> bool:
    if one is None or other is None:
        return False
    near = 0.02 * one.span
    return all(abs(one.points[name] - other.points[name]) <= near for name in one.points)


def _compose(
    mechanism: Mechanism, panels: list[Panel], travel: Mapping[str, tuple[float, float]], unit: str
) -> Figure:  # fmt: skip
    """Panels beside or above each other, whichever shows the mechanism larger."""
    places: list[complex] = []
    for _, configuration, index in panels:
        scene = pose(mechanism, configuration, index)
        assert scene is not None
        places += scene.points.values()
        for guide in scene.guides:
            places += guide.ends(travel, scene.span)
    found = np.array(places)
    wide, tall = max(float(np.ptp(found.real)), 1e-9), max(float(np.ptp(found.imag)), 1e-9)
    count = len(panels)

    def scale(columns: int) -> float:
        width, height = _room(columns, count // columns)
        return min((width - 2 * _PAD) / wide, (height - 2 * _PAD) / tall)

    columns = count if count == 1 or scale(count) >= 0.55 * scale(1) else 1
    rows = count // columns
    inches = scale(columns)
    width, _ = _room(columns, rows)
    height = max(inches * tall + 2 * _PAD, 1.5)
    titles = [textwrap.fill(title, int(width * _LETTERS)) for title, _, _ in panels]
    above = _ABOVE + _LINE * max(title.count("\n") for title in titles)
    outer = rows * (height + above) + _BELOW
    figure = style.new_figure(style.WIDTH, outer, layout=None)
    middle = complex(np.ptp(found.real) / 2 + found.real.min(), np.ptp(found.imag) / 2 + found.imag.min())
    for k, (_, configuration, index) in enumerate(panels):
        column, row = k % columns, k // columns
        left = _LEFT + column * (width + _LEFT)
        low = _BELOW + (rows - 1 - row) * (height + above)
        axes = figure.add_axes((left / style.WIDTH, low / outer, width / style.WIDTH, height / outer))
        axes.set_xlim(middle.real - width / 2 / inches, middle.real + width / 2 / inches)
        axes.set_ylim(middle.imag - height / 2 / inches, middle.imag + height / 2 / inches)
        axes.set_aspect("equal")
        axes.set_title(titles[k], loc="left")
        axes.set_ylabel(style.axis_label("y", unit))
        if row == rows - 1:
            axes.set_xlabel(style.axis_label("x", unit))
        else:
            axes.tick_params(labelbottom=False)
        draw_mechanism(axes, mechanism, configuration, index, travel=travel)
    return figure


def _room(columns: int, rows: int) -> tuple[float, float]:
    """Largest width and height of a panel, inches."""
    return (style.WIDTH - 0.15 - _LEFT * columns) / columns, 3.0 if rows > 1 else 4.2
