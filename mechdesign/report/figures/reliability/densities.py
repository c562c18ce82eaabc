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
from mechdesign.report.figures.reliability.looks import SUFFIXES, Sampled, apart, channels, error_limits, look
from mechdesign.results import Table

Bands = tuple[tuple[float, float], tuple[float, float]]
_LEFT = 0.88  # inches
# Limits farther out than this, in widths of the density, are told and not shown.
_FAR = 0.8
_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


def density_figures(given: Sampled) -> dict[str, Figure]:
    """Contours and surfaces of the first pose of a density table; the axes are the errors, in their units."""
    study, table = given.study, given.tables["density"]
    known = {
        f"{output}{SUFFIXES[order]}_error": (output, order) for output, order, _ in channels(given.tables["moments"])
    }
    columns = [column for column in table.columns if column.name in known]
    shown = [known[column.name] for column in columns]
    table = table.take(_first_pose(table))
    cells = int(np.sqrt(len(table)))
    x, y = (table[column.name].reshape(cells, cells) for column in columns)
    labels = [
        style.axis_label(f"{output} {order} error".replace("position ", ""), column.unit)
        for (output, order), column in zip(shown, columns, strict=True)
    ]
    densities = {
        "bivariate normal, first order": table["normal"].reshape(cells, cells),
        f"simulation ({look(given.method).words})": table["simulated"].reshape(cells, cells),
    }
    (output, order), section = shown[0], study.reliability
    assert section is not None
    circle = section.limits.get(f"{output.rpartition('.')[0]}{SUFFIXES[order]}")
    bands = error_limits(study, *shown[0]), error_limits(study, *shown[1])
    return {
        "density_contours": _contours(x, y, densities, labels, given.where, bands, circle.radius if circle else None),
        "density": _surfaces(x, y, densities, labels, given.where),
    }


def _first_pose(table: Table) -> Flags:
    """Rows of the first pose: those before the first cell comes again."""
    again = np.flatnonzero((table["x"] == table["x"][0]) & (table["y"] == table["y"][0]))
    end = again[1] if len(again) > 1 else len(table)
    return np.arange(len(table)) < end


def _contours(
    x: Floats, y: Floats, densities: dict[str, Floats], labels: list[str], pose: str, bands: Bands,
    radius: float | None,
) -> Figure:  # fmt: skip
    """Lines of equal density, with the limits: the radius of a circle, or a band for each error."""
    figure = style.new_figure(4.7, layout=None)
    figure.subplots_adjust(left=_LEFT / style.WIDTH, right=0.98, bottom=0.11, top=0.82, wspace=0.1)
    peak = next(iter(densities.values())).max()
    levels = [level * peak for level in _LEVELS]
    # The same unit and about the same spread: a picture true to scale.
    alike = labels[0].rpartition("[")[2] == labels[1].rpartition("[")[2] and 0.4 < np.ptp(x) / np.ptp(y) < 2.5
    view = (_view(x, bands[0]), _view(y, bands[1]))
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, (name, density) in zip(panels, densities.items(), strict=True):
        axes.contourf(x, y, density, levels=[*levels, peak * 1.5], cmap=style.COLORMAP, alpha=0.35)
        axes.contour(x, y, density, levels=levels, cmap=style.COLORMAP, linewidths=1.2)
        _draw_limits(axes, bands, radius, view)
        axes.set(title=name, xlabel=labels[0], xlim=view[0], ylim=view[1])
        axes.locator_params(nbins=6)
        if alike:
            axes.set_aspect("equal")
    panels[0].set_ylabel(labels[1])
    note = f"lines at {', '.join(f'{level:g}' for level in _LEVELS)} of the normal density's peak"
    title(figure, f"Density of two errors at {pose}", note + _limits_in_words(bands, radius, view), left=_LEFT)
    return figure


def _view(values: Floats, band: tuple[float, float]) -> tuple[float, float]:
    """What is shown of an axis: all that has a density, and limits that are not too far."""
    low, high = float(values.min()), float(values.max())
    span = high - low
    ends = [low, high, *apart(band, low - _FAR * span, high + _FAR * span)[0]]
    return min(ends) - 0.05 * span, max(ends) + 0.05 * span


def _limits_in_words(bands: Bands, radius: float | None, view: Bands) -> str:
    """Whether limits are seen: all of them, some, or none."""
    if radius is not None:
        corners = np.abs(np.add.outer(np.array(view[0]), 1j * np.array(view[1])))
        nearest = abs(complex(*(max(low, -high, 0.0) for low, high in view)))
        seen = [bool(nearest < radius < corners.max())]
    else:
        seen = [low < end < high for band, (low, high) in zip(bands, view, strict=True)
                for end in band if np.isfinite(end)]  # fmt: skip
    if not seen:
        return ""
    return "; dashed: limits" + ", others lie outside" * (not all(seen)) if any(seen) else "; limits lie outside"


def _draw_limits(axes: Axes, bands: Bands, radius: float | None, view: Bands) -> None:
    look: dict[str, Any] = {"color": style.VERMILION, "linestyle": "--", "linewidth": 1.6}
    if radius is not None:
        axes.add_patch(Circle((0.0, 0.0), radius, fill=False, **look))
        return
    across, up = bands
    # An open side has no line, and the others run on to the edge.
    for end in across:
        if np.isfinite(end):
            axes.plot([end, end], np.clip(up, *view[1]), **look)
    for end in up:
        if np.isfinite(end):
            axes.plot(np.clip(across, *view[0]), [end, end], **look)


def _surfaces(x: Floats, y: Floats, densities: dict[str, Floats], labels: list[str], pose: str) -> Figure:
    figure = style.new_figure(4.2, layout=None)
    figure.subplots_adjust(left=0.0, right=0.93, bottom=0.08, top=0.86, wspace=0.12)
    top = max(density.max() for density in densities.values())
    panels = figure.subplots(1, 2, subplot_kw={"projection": "3d"})
    for axes, (name, density) in zip(panels, densities.items(), strict=True):
        axes.plot_surface(
            x, y, density, rstride=1, cstride=1, cmap=style.COLORMAP, edgecolor=style.INK, linewidth=0.25, vmax=top
        )
        axes.set(title=name, zlim=(0, top))
        axes.set_xlabel(labels[0], labelpad=6)
        axes.set_ylabel(labels[1], labelpad=6)
        axes.set_zlabel("density (standardised)", labelpad=4)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=5)
        axes.view_init(elev=28, azim=-60)
    title(figure, f"Density of two errors at {pose}", left=_LEFT)
    return figure
