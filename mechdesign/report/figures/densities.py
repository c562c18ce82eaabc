"""Pictures of two errors at once: equal-density contours and the 3-D density, normal beside simulation [S2]."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from mechdesign.report.figures import style
from mechdesign.report.figures.errors.panels import SUFFIXES, channels, error_limits, title
from mechdesign.results import Table
from mechdesign.study import Study

Floats = NDArray[np.float64]
# Two bands, or the radius of a circle.
Limits = tuple[tuple[float, float], tuple[float, float]] | float | None

_LEFT = 0.88  # inches
_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


def density_figures(study: Study, table: Table, moments: Table, where: str, method: str) -> dict[str, Figure]:
    """Contours and surfaces of the first pose of a density table; the axes are the errors, in their units."""
    columns = [column for column in table.columns if column.name.endswith("_error")]
    outputs = [column.name.removesuffix("_error") for column in columns]
    units = [column.unit for column in columns]
    # Outputs and units name the order: it may be velocities that are limited.
    orders = [
        next(order for output, order, unit in channels(moments) if (output, unit) == pair)
        for pair in zip(outputs, units, strict=True)
    ]
    kept = np.flatnonzero(_first_pose(table))
    cells = int(np.sqrt(len(kept)))
    x, y = (table[column.name][kept].reshape(cells, cells) for column in columns)
    densities = [table[name][kept].reshape(cells, cells) for name in ("normal", "simulated")]
    labels = [
        style.axis_label(f"{output} {order} error".replace("position ", ""), unit)
        for output, order, unit in zip(outputs, orders, units, strict=True)
    ]
    titles = ("bivariate normal, first order", f"simulation ({method})")
    limits = _limits(study, outputs, orders)
    return {
        "density_contours": _contours(x, y, densities, labels, titles, where, limits),
        "density": _surfaces(x, y, densities, labels, titles, where),
    }


def _first_pose(table: Table) -> NDArray[np.bool_]:
    """Rows of the first pose: those before the first cell comes again."""
    again = np.flatnonzero((table["x"] == table["x"][0]) & (table["y"] == table["y"][0]))
    end = again[1] if len(again) > 1 else len(table)
    return np.arange(len(table)) < end


def _limits(study: Study, outputs: list[str], orders: list[str]) -> Limits:
    """The two bands, or the radius, that limit the errors."""
    section = study.reliability
    assert section is not None
    circle = section.limits.get(f"{outputs[0].rpartition('.')[0]}{SUFFIXES[orders[0]]}")
    if circle is not None:
        return circle.radius
    bands = [error_limits(study, output, order) for output, order in zip(outputs, orders, strict=True)]
    return None if bands[0] is None or bands[1] is None else (bands[0], bands[1])


def _contours(
    x: Floats,
    y: Floats,
    densities: list[Floats],
    labels: list[str],
    titles: tuple[str, str],
    pose: str,
    limits: Limits,
) -> Figure:
    figure = style.new_figure(style.WIDTH, 4.7, layout=None)
    figure.subplots_adjust(left=_LEFT / style.WIDTH, right=0.98, bottom=0.11, top=0.82, wspace=0.06)
    peak = densities[0].max()
    # The same unit and about the same spread: a picture true to scale.
    alike = labels[0].rpartition("[")[2] == labels[1].rpartition("[")[2] and 0.4 < x.max() / y.max() < 2.5
    step = (x[1, 0] - x[0, 0], y[0, 1] - y[0, 0])
    reach = (x.max() + step[0] / 2, y.max() + step[1] / 2)
    for axes, density, name in zip(figure.subplots(1, 2, sharex=True, sharey=True), densities, titles, strict=True):
        levels = [level * peak for level in _LEVELS]
        axes.contourf(x, y, density, levels=[*levels, peak * 1.5], cmap=style.COLORMAP, alpha=0.35)
        axes.contour(x, y, density, levels=levels, cmap=style.COLORMAP, linewidths=1.2)
        _draw_limits(axes, limits, reach)
        axes.set(title=name, xlabel=labels[0])
        axes.update_datalim([(-reach[0], -reach[1]), reach])
        axes.locator_params(nbins=6)
        if alike:
            axes.set_aspect("equal")
    figure.axes[0].set_ylabel(labels[1])
    levels_text = ", ".join(f"{level:g}" for level in _LEVELS)
    drawn = "; dashed: limits" if limits is not None else ""
    note = f"lines at {levels_text} of the normal density's peak{drawn}"
    title(figure, f"Density of two errors at {pose}", note, left=_LEFT)
    return figure


def _draw_limits(axes: Axes, limits: Limits, reach: tuple[float, float]) -> None:
    look: dict[str, Any] = {"fill": False, "edgecolor": style.VERMILION, "linestyle": "--", "linewidth": 1.6}
    if isinstance(limits, float):
        axes.add_patch(Circle((0.0, 0.0), limits, **look))
    elif limits is not None:
        (left, right), (low, high) = (
            (max(band[0], -2 * size), min(band[1], 2 * size)) for band, size in zip(limits, reach, strict=True)
        )
        axes.add_patch(Rectangle((left, low), right - left, high - low, **look))


def _surfaces(
    x: Floats, y: Floats, densities: list[Floats], labels: list[str], titles: tuple[str, str], pose: str
) -> Figure:
    figure = style.new_figure(style.WIDTH, 4.2, layout=None)
    figure.subplots_adjust(left=0.0, right=0.93, bottom=0.08, top=0.86, wspace=0.12)
    top = max(density.max() for density in densities)
    for k, (density, name) in enumerate(zip(densities, titles, strict=True)):
        axes = figure.add_subplot(1, 2, k + 1, projection="3d")
        axes.plot_surface(
            x, y, density, rstride=1, cstride=1, cmap=style.COLORMAP, edgecolor=style.INK, linewidth=0.25, vmax=top
        )
        axes.set_zlim(0, top)
        axes.set_title(name)
        axes.set_xlabel(labels[0], labelpad=6)
        axes.set_ylabel(labels[1], labelpad=6)
        axes.set_zlabel("density (standardised)", labelpad=4)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=5)
        axes.view_init(elev=28, azim=-60)
    title(figure, f"Density of two errors at {pose}", left=_LEFT)
    return figure
