"""Results over the poses: the axis of a sweep, maps over a plane, and numbers in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.contours import colour_steps, constant, round_levels
from mechdesign.drawing.marks import Axis, Contours, Panel, PanelMark, Picture
from mechdesign.ground.numerals import in_powers, numeral, printed, raised, reading
from mechdesign.ground.numerics.arrays import Complexes, Floats, evenly
from mechdesign.motion.rows import Poses
from mechdesign.motion.rules import TIME, PathRows, Sector, Sectors
from mechdesign.study import Study

# More of them in one picture cannot be told apart.
MAX_PANELS = 6
_FLAT = 0.8  # height over width below which two maps stand one below the other
_EDGE_OF_MAP = 0.02  # of its size, beyond the region
_NARROW = 10.0  # ratio of values up to which levels are at even steps


class Along(NamedTuple):
    """What a sweep or a path runs over."""

    values: Floats
    label: str
    name: str = ""
    unit: str = ""

    @property
    def axis(self) -> Axis:
        """The axis of panels over it, from its first to its last value."""
        return Axis(self.label, ends=(float(np.nanmin(self.values)), float(np.nanmax(self.values))), over=True)

    @property
    def wider(self) -> Axis:
        """The axis with room for dots at its first and last value."""
        return Axis(self.label, over=True, margin=0.02)

    def spread(self, count: int, shift: float) -> list[int]:
        """Rows of as many of its values, evenly spread, which begin at a part of the step: for markers."""
        low, high = float(np.nanmin(self.values)), float(np.nanmax(self.values))
        places = low + (high - low) * (np.arange(count) + shift) / count
        rows: list[int] = np.unique(np.abs(self.values[:, None] - places).argmin(axis=0)).tolist()
        return rows

    def value(self, at: float) -> str:
        """One of its values with four digits and its unit."""
        return f"{numeral(at, 4)} {printed(self.unit)}".rstrip()


def along(study: Study, poses: Poses) -> Along | None:
    """The abscissa of a sweep or path; None for listed poses, grids and what is too short to be a curve."""
    return None if poses.listed or len(poses.grid) != 1 or poses.count < 3 else abscissa(study, poses)


def abscissa(study: Study, poses: Poses, speed: float | None = None) -> Along:
    """Time, of a motion over time or at a given speed; the coordinate that moves, always the same way; or the pose."""
    label = style.axis_label(TIME, study.units.label("time"))
    if poses.times is not None:
        return Along(poses.times, label, TIME)
    if speed is not None:
        return Along(times(poses, poses.numbers.astype(float), speed), label)
    moving = moving_names(poses)
    if len(moving) != 1 or np.ptp(np.sign(np.diff(poses.values[moving[0]]))):
        return Along(poses.numbers + 1, "pose along the path")
    unit = study.units.label(study.mechanism.quantity(moving[0]))
    return Along(poses.values[moving[0]], coordinate_label(study, moving[0]), moving[0], unit)


def times(poses: Poses, rows: Floats, speed: float) -> Floats:
    """When a point that passes its path at a speed is at places of it, in rows; in the study's units."""
    assert isinstance(poses.rule, PathRows)
    return poses.rule.way(np.zeros(len(rows), dtype=np.intp), rows) / speed


def drawn_plane(
    marks: Sequence[PanelMark], shows: Complexes, study: Study, title: str = "", *, stretch: float = 1.0,
    followed: bool = False,
) -> Panel:  # fmt: skip
    """A panel of the plane in which a mechanism is drawn, which shows some places; a page may follow it."""
    unit = study.units.label("length")
    return Panel(marks, Axis("x", unit), Axis("y", unit), title, equal=stretch, shows=shows, plane=followed)


def moving_names(poses: Poses) -> list[str]:
    """Coordinates that are not the same at all poses."""
    return [name for name, values in poses.values.items() if np.ptp(values) > 0]


def coordinate_label(study: Study, name: str) -> str:
    """A coordinate's name and unit."""
    return style.axis_label(name, study.units.label(study.mechanism.quantity(name)))


def number(value: float) -> str:
    """A probability in three digits."""
    return f"{value:.3g}" if value == 0 or value >= 1e-3 else in_powers(value)


def quantity(value: float, unit: str, beside: float = 0.0) -> str:
    """A value with three digits and a unit of its size, 3.74e7 N/m as 37.4 MN/m; an infinite stiffness in a word.

    The unit is that of numbers up to `beside`, where it stands beside such.
    """
    if np.isinf(value):
        return "rigid"
    exponent, scaled_unit = reading(max(abs(value), beside), unit)
    if scaled_unit.startswith("10"):
        if value and not 1e-2 <= abs(value) < 1e5:
            return f"{in_powers(value)} {printed(unit)}"
        exponent, scaled_unit = 0, printed(unit)
    scaled = value / 10.0**exponent
    return f"{f'{scaled:.0f}' if abs(scaled) >= 1e3 else numeral(scaled, 3)} {scaled_unit}"


def round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-12)))


@dataclass(frozen=True, eq=False)
class Plane:
    """Poses in the plane of two coordinates, shape (lines, nodes), a map a value of what is held besides.

    Parameters
    ----------
    maps : tuple of (str, Sectors)
        The held values in words, where there are several; the patches of each map, and the workspace's boundary.
    """

    names: tuple[str, str]
    x: Floats
    y: Floats
    equal: bool
    maps: tuple[tuple[str, Sectors], ...]


def plane(study: Study, poses: Poses) -> Plane | None:
    """The plane of a grid over two coordinates, or of a workspace; None for every other choice of poses."""
    names = poses.names[:2] if poses.rule.regions else tuple(moving_names(poses))
    if poses.listed or len(poses.grid) != 2 or len(names) != 2 or min(poses.grid) < 3:
        return None
    values = poses.values
    x, y = (values[name].reshape(poses.grid) for name in names)
    maps = [("", region) for region in poses.rule.regions]
    if len(maps) > 1:
        rows = [region.patches[0].rays.start * poses.grid[1] for region in poses.rule.regions]
        units = {name: study.units.label(study.mechanism.quantity(name)) for name in poses.names[2:]}
        words = [", ".join(f"{name} = {numeral(values[name][row])} {unit}".rstrip() for name, unit in units.items())
                 for row in rows]  # fmt: skip
        maps = list(zip(words, poses.rule.regions, strict=True))
    whole = Sectors((Sector(slice(0, len(x)), 0j, x + 1j * y),), ())
    quantities = {study.mechanism.quantity(name) for name in names}
    return Plane((names[0], names[1]), x, y, quantities == {"length"}, tuple(maps) or (("", whole),))


def maps(
    study: Study, over: Plane, parts: list[tuple[str, Floats]], title: str, note: str, *, logarithmic: bool = False
) -> Picture:  # fmt: skip
    """Maps side by side, flat ones one below the other; each with its own bar of colours.

    Of several held values a few, spread evenly; the colours of each part mean the same in all of its maps.
    """
    shown = [over.maps[k] for k in evenly(len(over.maps), max(1, MAX_PANELS // len(parts)))]
    patches = [patch.rays for _, sectors in shown for patch in sectors.patches]
    scales = [_levels(over, values, patches, logarithmic) for _, values in parts]
    (left, right), (low, high) = ((float(np.nanmin(ends)), float(np.nanmax(ends))) for ends in (over.x, over.y))
    flat = over.equal and high - low < _FLAT * (right - left) and len(shown) * len(parts) < 3
    # Of several one part of the plane in all of them, the boundary's line with it.
    edge = _EDGE_OF_MAP * max(right - left, high - low)
    one = len(shown) > 1 and over.equal
    x, y = (Axis(coordinate_label(study, name), ends=(a - edge, b + edge) if one else (None, None))
            for name, a, b in zip(over.names, (left, low), (right, high), strict=True))  # fmt: skip
    panels = []
    for held, sectors in shown:
        for (name, values), levels in zip(parts, scales, strict=True):
            ends = float(np.nanmin(values)), float(np.nanmax(values))
            same = constant(*ends)
            words = ", ".join(filter(None, (held, name))) + f": {number(ends[0])} everywhere" * same
            mark = _contours(over, sectors, values, levels, logarithmic=logarithmic, everywhere=same)
            panels.append(Panel([mark], x, y, words, equal=over.equal))
    return Picture(title, panels, (note,), across=1 if flat else 2)


def _levels(over: Plane, values: Floats, patches: Sequence[slice], logarithmic: bool) -> Floats | None:
    """Levels of the colours over some patches, or their powers of ten; None where there is no value."""
    sizes = np.concatenate([node_areas(over.x[patch], over.y[patch]).ravel() for patch in patches])
    shown = np.concatenate([values[patch].ravel() for patch in patches])
    finite = np.isfinite(shown) & ((shown > 0) | (not logarithmic))
    if not finite.any():
        return None
    sizes, shown = sizes[finite], shown[finite]
    if logarithmic:
        return np.asarray(np.log10(_powers(shown, sizes)))
    return round_levels(float(shown.min()), quantile(shown, sizes, 0.97), 9)


def _contours(
    over: Plane, sectors: Sectors, values: Floats, levels: Floats | None, *, logarithmic: bool, everywhere: bool
) -> Contours:  # fmt: skip
    """Values over the patches of a map, between levels."""
    if levels is None:
        return Contours([], None)
    if logarithmic:
        # Between nodes powers are interpolated; below the last level is all that is smaller, even 0.
        values = np.log10(np.maximum(values, 1e-3 * 10.0 ** levels[0]))
    finite = values[np.isfinite(values)]
    shown = [
        (patch.nodes.real, patch.nodes.imag,
         _between(patch, over.x[patch.rays] + 1j * over.y[patch.rays], values[patch.rays]))
        for patch in sectors.patches
    ]  # fmt: skip
    words = [_power(10.0**level) for level in levels] if logarithmic else ()
    return Contours(
        shown, colour_steps(levels, float(finite.min()), float(finite.max())), sectors.outline, words, everywhere
    )


def _between(patch: Sector, places: Complexes, values: Floats) -> np.ma.MaskedArray[Any, Any]:
    """Values at places on the rays of a patch, shape (rays, nodes), at the nodes of its finer map.

    These are on rays between two, and take the values of both at the same distance, or at the end that is nearest.
    """
    if len(places) == len(patch.nodes):
        return np.ma.masked_invalid(values)
    coarse, fine = (np.unwrap(np.angle(z[:, z.shape[1] // 2] - patch.about)) for z in (places, patch.nodes))
    fine += 2 * np.pi * np.round((coarse[0] - fine[0]) / (2 * np.pi))
    below = np.clip(np.searchsorted(coarse, fine, "right") - 1, 0, len(coarse) - 2)
    share = np.clip((fine - coarse[below]) / (coarse[below + 1] - coarse[below]), 0.0, 1.0)
    radius, nodes = np.abs(places - patch.about), np.abs(patch.nodes - patch.about)
    shown = np.array([
        (1 - part) * np.interp(along, radius[k], values[k]) + part * np.interp(along, radius[k + 1], values[k + 1])
        for k, part, along in zip(below.tolist(), share.tolist(), nodes, strict=True)
    ])  # fmt: skip
    return np.ma.masked_invalid(shown)


def node_areas(x: Floats, y: Floats) -> Floats:
    """Area about each node of a grid."""
    z = x + 1j * y
    along, across = np.gradient(z, axis=0), np.gradient(z, axis=1)
    return np.asarray(np.abs(np.imag(np.conj(along) * across)))


def quantile(values: Floats, sizes: Floats, share: float) -> float:
    """The value below which a share of the area lies."""
    order = np.argsort(values)
    below = np.cumsum(sizes[order])
    return float(values[order[min(int(np.searchsorted(below, share * below[-1])), len(order) - 1)]])


def _powers(values: Floats, sizes: Floats) -> Floats:
    """Levels at even steps where values lie close, else 1, 2, 5 times powers of ten, or powers of ten alone.

    What holds on a twentieth of the area (`sizes`), as near a singularity, gets no levels of its own.
    """
    smallest, largest = (max(quantile(values, sizes, share), 1e-16) for share in (0.05, 0.95))
    if largest < _NARROW * smallest:
        even = round_levels(smallest, largest, 9)
        return np.asarray(even[even > 0])
    powers = 10.0 ** np.arange(np.floor(np.log10(smallest)), np.ceil(np.log10(largest)) + 1)
    if len(powers) > 4:
        step = -(-len(powers) // 9)
        return np.asarray(powers[::-1][::step][::-1])
    fine = np.outer(powers, (1, 2, 5)).ravel()
    # From the last level below the smallest to the first above the largest.
    first, last = np.searchsorted(fine, smallest, "right") - 1, np.searchsorted(fine, largest)
    return np.asarray(fine[max(first, 0) : last + 1])


def _power(level: float) -> str:
    if 1e-2 <= level < 1e4:
        return f"{level:g}"
    power = int(np.floor(np.log10(level) + 1e-9))
    digits, ten = f"{level / 10.0**power:.3g}", f"10{raised(power)}"
    return ten if digits == "1" else f"{digits}\N{MIDDLE DOT}{ten}"
