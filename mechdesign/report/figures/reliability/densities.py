"""Pictures of two errors at once: equal-density contours and the 3-D density, normal beside simulation [S2]."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mechdesign.numerics.arrays import Flags, Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import title
from mechdesign.report.figures.reliability.looks import SUFFIXES, channels, error_limits
from mechdesign.results import Table
from mechdesign.study import Study

Bands = tuple[tuple[float, float], tuple[float, float]]
# Two bands, or the radius of a circle.
Limits = Bands | float | None

_LEFT = 0.88  # inches
# Limits farther out than this, in widths of the density, are told and not shown.
_FAR = 0.8
_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


def density_figures(study: Study, table: Table, moments: Table, where: str, method: str) -> dict[str, Figure]:
    """Contours and surfaces of the first pose of a density table; the axes are the errors, in their units."""
    known = {f"{output}{SUFFIXES[order]}_error": (output, order) for output, order, _ in channels(moments)}
    columns = [column for column in table.columns if column.name in known]
    outputs, orders = ([known[column.name][k] for column in columns] for k in range(2))
    kept = np.flatnonzero(_first_pose(table))
    cells = int(np.sqrt(len(kept)))
    x, y = (table[column.name][kept].reshape(cells, cells) for column in columns)
    densities = [table[name][kept].reshape(cells, cells) for name in ("normal", "simulated")]
    labels = [
        style.axis_label(f"{output} {order} error".replace("position ", ""), unit)
        for output, order, unit in zip(outputs, orders, [column.unit for column in columns], strict=True)
    ]
    titles = ("bivariate normal, first order", f"simulation ({method})")
    limits = _limits(study, outputs, orders)
    return {
        "density_contours": _contours(x, y, densities, labels, titles, where, limits),
        "density": _surfaces(x, y, densities, labels, titles, where),
    }


def _first_pose(table: Table) -> Flags:
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
    figure.subplots_adjust(left=_LEFT / style.WIDTH, right=0.98, bottom=0.11, top=0.82, wspace=0.1)
    peak = densities[0].max()
    # The same unit and about the same spread: a picture true to scale.
    alike = labels[0].rpartition("[")[2] == labels[1].rpartition("[")[2] and 0.4 < np.ptp(x) / np.ptp(y) < 2.5
    bands = _bands(limits)
    view = (_view(x, bands[0]), _view(y, bands[1]))
    for axes, density, name in zip(figure.subplots(1, 2, sharex=True, sharey=True), densities, titles, strict=True):
        levels = [level * peak for level in _LEVELS]
        axes.contourf(x, y, density, levels=[*levels, peak * 1.5], cmap=style.COLORMAP, alpha=0.35)
        axes.contour(x, y, density, levels=levels, cmap=style.COLORMAP, linewidths=1.2)
        _draw_limits(axes, limits, view)
        axes.set(title=name, xlabel=labels[0], xlim=view[0], ylim=view[1])
        axes.locator_params(nbins=6)
        if alike:
            axes.set_aspect("equal")
    figure.axes[0].set_ylabel(labels[1])
    levels_text = ", ".join(f"{level:g}" for level in _LEVELS)
    drawn = "" if limits is None else f"; {_limits_in_words(limits, view)}"
    note = f"lines at {levels_text} of the normal density's peak{drawn}"
    title(figure, f"Density of two errors at {pose}", note, left=_LEFT)
    return figure


def _bands(limits: Limits) -> Bands:
    if limits is None:
        return (-np.inf, np.inf), (-np.inf, np.inf)
    return ((-limits, limits), (-limits, limits)) if isinstance(limits, float) else limits


def _view(values: Floats, band: tuple[float, float]) -> tuple[float, float]:
    """What is shown of an axis: all that has a density, and limits that are not too far."""
    low, high = float(values.min()), float(values.max())
    span = high - low
    near = [end for end in band if low - _FAR * span < end < high + _FAR * span]
    ends = [low, high, *near]
    return min(ends) - 0.05 * span, max(ends) + 0.05 * span


def _limits_in_words(limits: Limits, view: Bands) -> str:
    """Whether limits are seen: all of them, some, or none."""
    if isinstance(limits, float):
        corners = np.abs(np.add.outer(np.array(view[0]), 1j * np.array(view[1])))
        across, up = (max(low, -high, 0.0) for low, high in view)
        seen = [bool(np.hypot(across, up) < limits < corners.max())]
    else:
        seen = [low < end < high for band, (low, high) in zip(_bands(limits), view, strict=True)
                for end in band if np.isfinite(end)]  # fmt: skip
    return (
        "dashed: limits" if all(seen) else "dashed: limits, others lie outside" if any(seen) else "limits lie outside"
    )


def _draw_limits(axes: Axes, limits: Limits, view: Bands) -> None:
    look: dict[str, Any] = {"color": style.VERMILION, "linestyle": "--", "linewidth": 1.6}
    if isinstance(limits, float):
        axes.add_patch(Circle((0.0, 0.0), limits, fill=False, **look))
        return
    across, up = _bands(limits)
    # An open side has no line, and the others run on to the edge.
    for end in across:
        if np.isfinite(end):
            axes.plot([end, end], np.clip(up, *view[1]), **look)
    for end in up:
        if np.isfinite(end):
            axes.plot(np.clip(across, *view[0]), [end, end], **look)


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
