"""Pictures of the workspace question: local indices, the boundary with the mechanism in several poses, drive ranges."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from mechdesign.report.figures import style
from mechdesign.report.figures.drawing import draw_mechanism
from mechdesign.results import Result, Table

if TYPE_CHECKING:
    from mechdesign.study import Study

Floats = NDArray[np.float64]
# Contours of an index that grows without bound stop at this multiple of its mean over the region.
CLIP = 3.0
# Poses of the mechanism along each curve of the boundary.
POSES = {"inner": 1, "outer": 2}
SIDES = {"inner": (style.BLUE, "-"), "outer": (style.VERMILION, "-")}
KINDS = {"limit": "-", "singularity": (0, (4, 1.5))}


def figures(study: Study, result: Result) -> dict[str, Figure]:
    """Maps of the inverse condition and of the resistivity, the boundary with poses, the drives along it.

    Where several values of held coordinates are asked for, the first is shown.
    """
    local, boundary = _first(study, result, "local"), _first(study, result, "boundary")
    if not len(local):
        return {}
    mean = float(result.tables["indices"]["GRI"][0])
    found = {
        "inverse_condition": _map(study, local, boundary, "inverse_condition", "inverse condition number", None),
        "resistivity": _map(study, local, boundary, "resistivity", "resistivity 1/|det J|", CLIP * mean),
        "workspace": _workspace(study, result, boundary),
    }
    if len(boundary):
        found["drives"] = _drives(study, boundary)
    return found


def _first(study: Study, result: Result, name: str) -> Table:
    """The rows of a table that belong to the first values of the held coordinates."""
    table = result.tables[name]
    held = list(study.workspace.at) if study.workspace else []
    rows = np.ones(len(table), dtype=bool)
    for coordinate in held:
        rows &= table[coordinate] == table[coordinate][0]
    columns = tuple(type(c)(c.name, np.asarray(c.values)[rows], c.unit, c.meaning) for c in table.columns)
    return Table(table.name, columns, table.meaning)


def _grids(local: Table, column: str) -> Iterator[tuple[Floats, Floats, Floats]]:
    for patch in np.unique(local["patch"]):
        rows = local["patch"] == patch
        shape = (int(local["ray"][rows].max()) + 1, int(local["node"][rows].max()) + 1)
        yield tuple(local[name][rows].reshape(shape) for name in ("x", "y", column))


def _curves(boundary: Table) -> Iterator[NDArray[np.intp]]:
    for curve in np.unique(boundary["curve"]):
        yield np.flatnonzero(boundary["curve"] == curve)


def _outline(axes: Axes, boundary: Table, *, color: Callable[[str], str]) -> None:
    for rows in _curves(boundary):
        axes.plot(
            boundary["x"][rows], boundary["y"][rows], color=color(str(boundary["side"][rows[0]])), linewidth=1.4,
            linestyle=KINDS[str(boundary["kind"][rows[0]])], solid_capstyle="round",
        )  # fmt: skip


def _height(table: Table, width: float, *, extra: float = 0.9) -> float:
    """Height of a figure whose axes of equal scale are about `width` wide (inches)."""
    wide, tall = float(np.ptp(table["x"])), float(np.ptp(table["y"]))
    return float(np.clip(width * tall / max(wide, 1e-12) + extra, 2.8, 8.5))


def _map(study: Study, local: Table, boundary: Table, column: str, name: str, ceiling: float | None) -> Figure:
    values = local[column]
    clipped = ceiling is not None
    top = float(np.nanmax(values)) if ceiling is None else min(ceiling, float(np.nanmax(values)))
    levels = MaxNLocator(nbins=12, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, top)
    figure = style.new_figure(style.WIDTH, _height(local, 5.6))
    axes = figure.add_subplot()
    norm = BoundaryNorm(levels, 256, extend="max" if clipped else "neither")
    for x, y, z in _grids(local, column):
        shown = np.where(np.isfinite(z), z, levels[-1] * 2 if clipped else 0.0)
        axes.contourf(
            x, y, shown, levels=levels, cmap=style.COLORMAP, norm=norm, extend="max" if clipped else "neither"
        )
        axes.contour(x, y, np.minimum(shown, 2 * levels[-1]), levels=levels[1:], colors="white", linewidths=0.5,
                     alpha=0.7)  # fmt: skip
    _outline(axes, boundary, color=lambda side: style.INK)
    unit = next(c.unit for c in local.columns if c.name == column)
    bar = figure.colorbar(ScalarMappable(norm, style.COLORMAP), ax=axes, shrink=0.85, pad=0.02, ticks=levels)
    bar.set_label(style.axis_label(name, unit))
    bar.outline.set_visible(False)
    _frame(axes, study, f"{name} of the Jacobian at point {study.workspace.point if study.workspace else ''}")
    return figure


def _frame(axes: Axes, study: Study, title: str) -> None:
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_title(title[0].upper() + title[1:], loc="left")
    axes.set_xlabel(style.axis_label("x", _length(study)))
    axes.set_ylabel(style.axis_label("y", _length(study)))


def _length(study: Study) -> str:
    return study.units.label("length")


def _workspace(study: Study, result: Result, boundary: Table) -> Figure:
    """The region, its boundary by kind, and the mechanism with its point at places spread along it [S1, Fig. 6]."""
    local = _first(study, result, "local")
    places = _places(boundary) if len(boundary) else np.zeros(0, dtype=complex)
    section = study.workspace
    assert section is not None
    mechanism = study.mechanism
    plan = mechanism.plan((f"{section.point}.x", f"{section.point}.y", *section.at))
    held = [
        float(values[0]) * (study.units.angle_factor if mechanism.quantity(name) == "angle" else 1.0)
        for name, values in section.at.items()
    ]
    configuration = plan.solve([places.real, places.imag, *held], limits=False)
    reached = [configuration.point(point)[np.isfinite(configuration.point(point))] for point in mechanism.points]
    extent = np.concatenate([local["x"] + 1j * local["y"], *reached])
    wide, tall = float(np.ptp(extent.real)), float(np.ptp(extent.imag))
    figure = style.new_figure(style.WIDTH, float(np.clip(7.2 * 1.1 * tall / (1.1 * wide) + 1.1, 3.0, 8.5)))
    axes = figure.add_subplot()
    for x, y, _ in _grids(local, "inverse_condition"):
        edge_x = np.concatenate([x[:, 0], x[::-1, -1]])
        edge_y = np.concatenate([y[:, 0], y[::-1, -1]])
        axes.fill(edge_x, edge_y, color=style.SKY, alpha=0.25, linewidth=0)
    _outline(axes, boundary, color=lambda side: SIDES[side][0])
    for kind, dashes in KINDS.items():
        if (boundary["kind"] == kind).any():
            axes.plot([], [], color=style.INK, linestyle=dashes, label=f"ends at a {kind}")
    axes.legend(loc="upper right")
    pad = 0.05 * max(wide, tall)
    axes.set_xlim(extent.real.min() - pad, extent.real.max() + pad)
    axes.set_ylim(extent.imag.min() - pad, extent.imag.max() + pad)
    _frame(axes, study, f"workspace of point {section.point}, with the mechanism along its boundary")
    for index in range(len(places)):
        draw_mechanism(axes, mechanism, configuration, index, faint=True)
    draw_mechanism(axes, mechanism, mechanism.sketch_configuration, labels=True, drives=False)
    return figure


def _places(boundary: Table) -> NDArray[np.complex128]:
    """Places a little inside the boundary, evenly along each of its curves."""
    found = []
    middle = complex(np.mean(boundary["x"]), np.mean(boundary["y"]))
    for rows in _curves(boundary):
        z = boundary["x"][rows] + 1j * boundary["y"][rows]
        along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(z)))])
        number = POSES[str(boundary["side"][rows[0]])]
        for share in (np.arange(number) + 0.5) / number:
            k = int(np.searchsorted(along, share * along[-1]))
            found.append(z[k] + 1e-3 * (middle - z[k]) * (1 if boundary["side"][rows[0]] == "outer" else -1))
    return np.array(found)


def _drives(study: Study, boundary: Table) -> Figure:
    """Drive values along the boundary over the angle of the scan [S1, Fig. 7]."""
    names = study.mechanism.drives
    figure = style.new_figure(style.WIDTH, 3.4 if len(names) < 4 else 5.0)
    axes = figure.add_subplot()
    dashes = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)), (0, (5, 1.5, 1.5, 1.5)))
    for number, name in enumerate(names):
        for side, (color, _) in SIDES.items():
            rows = np.flatnonzero(boundary["side"] == side)
            if not rows.size:
                continue
            rows = rows[np.argsort(boundary["theta"][rows], kind="stable")]
            label, dash = f"{name}, {side} boundary", dashes[number % len(dashes)]
            axes.plot(boundary["theta"][rows], boundary[name][rows], color=color, linestyle=dash, label=label)
    axes.set_xlim(float(boundary["theta"].min()), float(boundary["theta"].max()))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=9, steps=[1, 2, 3, 4.5, 6, 9, 10]))
    axes.set_title("Drives along the boundary of the workspace", loc="left")
    axes.set_xlabel(style.axis_label("angle of the scan", study.units.label("angle")))
    units = {study.units.label(study.mechanism.quantity(name)) for name in names}
    axes.set_ylabel(style.axis_label(", ".join(names), units.pop() if len(units) == 1 else ""))
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure
