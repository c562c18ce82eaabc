"""Pictures of two errors at once: equal-density contours and the 3-D density, normal beside simulation [S2]."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from mechdesign.report.figures import style
from mechdesign.results import Table
from mechdesign.study import Study

Floats = NDArray[np.float64]

_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)
_TITLES = ("bivariate normal, first order", "Monte Carlo simulation")


def density_figures(study: Study, table: Table, samples: int, pose: str) -> dict[str, Figure]:
    """Contours and surfaces of the first pose of a density table; the axes are the errors, in their units."""
    names = [column.name for column in table.columns if column.name.endswith("_error")]
    units = [column.unit for column in table.columns if column.name.endswith("_error")]
    cells = int(np.sqrt(np.count_nonzero(_first_pose(table))))
    kept = np.flatnonzero(_first_pose(table))
    x, y = (table[name][kept].reshape(cells, cells) for name in names)
    densities = [table[name][kept].reshape(cells, cells) for name in ("normal", "simulated")]
    labels = [style.axis_label(name.replace("_", " "), unit) for name, unit in zip(names, units, strict=True)]
    titles = (_TITLES[0], f"{_TITLES[1]}, {samples:,} samples")
    limits = _limits(study, [name.removesuffix("_error") for name in names])
    return {
        "density_contours": _contours(x, y, densities, labels, titles, pose, limits),
        "density": _surfaces(x, y, densities, labels, titles, pose),
    }


def _first_pose(table: Table) -> NDArray[np.bool_]:
    """Rows of the first pose: those before the first cell comes again."""
    again = np.flatnonzero((table["x"] == table["x"][0]) & (table["y"] == table["y"][0]))
    end = again[1] if len(again) > 1 else len(table)
    return np.arange(len(table)) < end


def _limits(study: Study, outputs: list[str]) -> tuple[tuple[float, float], tuple[float, float]] | float | None:
    """The two bands, or the radius, that limit the errors."""
    section = study.reliability
    assert section is not None
    bands = [section.limits.get(name) for name in outputs]
    if all(band is not None for band in bands):
        low, high = (
            [getattr(band, key) if getattr(band, key) is not None else bound for band in bands]
            for key, bound in (("min", -np.inf), ("max", np.inf))
        )
        return (low[0], high[0]), (low[1], high[1])
    point = section.limits.get(outputs[0].rpartition(".")[0])
    return point.radius if point is not None else None


def _contours(
    x: Floats,
    y: Floats,
    densities: list[Floats],
    labels: list[str],
    titles: tuple[str, str],
    pose: str,
    limits: tuple[tuple[float, float], tuple[float, float]] | float | None,
) -> Figure:
    figure = style.new_figure(style.WIDTH, 4.5, layout=None)
    figure.subplots_adjust(left=0.11, right=0.98, bottom=0.12, top=0.86, wspace=0.06)
    peak = densities[0].max()
    # The same unit and about the same spread: a picture true to scale.
    alike = labels[0].rpartition("[")[2] == labels[1].rpartition("[")[2] and 0.4 < x.max() / y.max() < 2.5
    step = (x[1, 0] - x[0, 0], y[0, 1] - y[0, 0])
    reach = (x.max() + step[0] / 2, y.max() + step[1] / 2)
    for axes, density, title in zip(figure.subplots(1, 2, sharex=True, sharey=True), densities, titles, strict=True):
        levels = [level * peak for level in _LEVELS]
        axes.contourf(x, y, density, levels=[*levels, peak * 1.5], cmap=style.COLORMAP, alpha=0.35)
        axes.contour(x, y, density, levels=levels, cmap=style.COLORMAP, linewidths=1.2)
        _draw_limits(axes, limits, reach)
        axes.set(title=title, xlabel=labels[0])
        axes.update_datalim([(-reach[0], -reach[1]), reach])
        axes.locator_params(nbins=6)
        if alike:
            axes.set_aspect("equal")
    figure.axes[0].set_ylabel(labels[1])
    levels_text = ", ".join(f"{level:g}" for level in _LEVELS)
    drawn = "; dashed: limits" if limits is not None else ""
    figure.suptitle(f"{pose}. Density over the normal one's peak: {levels_text}{drawn}", fontsize=9)
    return figure


def _draw_limits(
    axes: Axes, limits: tuple[tuple[float, float], tuple[float, float]] | float | None, reach: tuple[float, float]
) -> None:
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
    for k, (density, title) in enumerate(zip(densities, titles, strict=True)):
        axes = figure.add_subplot(1, 2, k + 1, projection="3d")
        axes.plot_surface(
            x, y, density, rstride=1, cstride=1, cmap=style.COLORMAP, edgecolor=style.INK, linewidth=0.25, vmax=top
        )
        axes.set_zlim(0, top)
        axes.set_title(title)
        axes.set_xlabel(labels[0], labelpad=6)
        axes.set_ylabel(labels[1], labelpad=6)
        axes.set_zlabel("density (standardised)", labelpad=4)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=5)
        axes.view_init(elev=28, azim=-60)
    figure.suptitle(pose, fontsize=9, y=0.98)
    return figure
