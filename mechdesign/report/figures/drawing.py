"""A mechanism drawn into axes: links, named joints, slides, ground and drives; and as a ghost of lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from matplotlib.axes import Axes

from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.configuration import Configuration
from mechdesign.report.figures import style
from mechdesign.report.figures.annotations import Turn, drive_arrows, name_labels
from mechdesign.report.figures.labels import covered, place_labels
from mechdesign.report.figures.scene import GROUND, Guide, Scene, hull, pose
from mechdesign.report.figures.shapes import Pen

DRIVE = style.VERMILION
LINKS = (style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY, "#8A6A2A", "#5B4FA2", "#6E6E6E")
Travel = Mapping[str, tuple[float, float]]


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
    travel: Travel | None = None,
    size: float = 1.0,
) -> None:
    """Draw a mechanism in one pose of a batch; a pose that cannot be assembled draws nothing.

    Sizes of symbols are in points on paper, so that limits may change after drawing; only labels need final limits.
    They keep off what is drawn before.

    Parameters
    ----------
    index : int
        Pose in the flattened batch.
    faint : bool
        Pale and below what is drawn otherwise, without labels and drives: for further poses.
    travel : mapping, optional
        Range of each slide (lengths from the line's origin), which its guide should cover.
    size : float
        Size of the symbols; 1 for a drawing as wide as the page.
    """
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=0.22, order=2.0) if faint else Pen(axes, size=size)
    for point in scene.pivots():
        pen.pivot(scene.points[point])
    _draw_guides(pen, scene, colors, travel or {})
    for rank, (name, body) in enumerate(_bodies(scene)):
        if len(body) > 2:
            pen.plate(body, colors[name], rank)
        elif len(body) == 2:
            pen.bar(body, colors[name])
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            pen.leg(scene.points[link.ends[0]], scene.points[link.ends[1]], colors[name])
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
        place_labels(axes, named, covered(axes), order=pen.order + 2)


def draw_ghost(axes: Axes, mechanism: Mechanism, configuration: Configuration, index: int, *, share: float) -> None:
    """Draw a further pose as pale lines, which many of can lie over one another; `share` of it is colour."""
    scene = pose(mechanism, configuration, index)
    if scene is None:
        return
    colors = link_colors(mechanism)
    pen = Pen(axes, alpha=share, order=2.0)
    for name, body in _bodies(scene):
        if len(body) > 1:
            pen.line([*body, *(body[:1] if len(body) > 2 else [])], colors[name])
    for name, link in scene.description.links.items():
        if link.telescopic and link.ends:
            pen.line([scene.points[end] for end in link.ends], colors[name])
    for guide in scene.guides:
        if guide.owner != GROUND:
            pen.line(_reach(scene, guide, (guide.pin,)), colors[guide.owner])


def _bodies(scene: Scene) -> list[tuple[str, list[complex]]]:
    """Outline of each moving rigid link, the largest first so that none hides another."""
    found = []
    for name, link in scene.description.links.items():
        if name != GROUND:
            points = link.points if link.telescopic else scene.link_points(name)
            found.append((name, hull([scene.points[point] for point in points])))
    return sorted(found, key=lambda item: -_area(item[1]))


def _area(corners: list[complex]) -> float:
    turned = zip(corners, corners[1:] + corners[:1], strict=True)
    return abs(sum((a.conjugate() * b).imag for a, b in turned)) / 2 if len(corners) > 2 else 0.0


def _draw_guides(pen: Pen, scene: Scene, colors: Mapping[str, str], travel: Travel) -> None:
    for guide in scene.guides:
        start, end = guide.ends(travel, scene.span)
        if guide.owner == GROUND:
            pen.rail(start, end)
        else:
            pen.bar(_reach(scene, guide, (start, end)), colors[guide.owner])
            if guide.slider is None:
                pen.slot((start, end))
        if guide.slider is not None:
            pen.block(guide.pin, guide.along, colors[guide.slider])


def _reach(scene: Scene, guide: Guide, places: Iterable[complex]) -> list[complex]:
    """Ends of the line that a link carries: from its own points to where something slides."""
    own = [scene.points[point] for point in scene.link_points(guide.owner)]
    along = [((place - guide.origin) * guide.along.conjugate()).real for place in (*own, *places)]
    return [guide.origin + s * guide.along for s in (min(along), max(along))]
