"""Pictures of samples at the first pose: histograms, densities of two errors [S2], mean and failure as they settle."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from mechdesign.analyses.reliability.simulation import CELLS
from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style
from mechdesign.report.figures.panels import MAX_PANELS, legend_below, number, stack, title
from mechdesign.report.figures.reliability.looks import (
    SUFFIXES,
    Sampled,
    apart,
    channels,
    error_limits,
    heading,
    look,
    methods,
)
from mechdesign.results import Table

# A limit farther out than this, in widths of the histogram or of the density, is named and not drawn.
_FAR_FROM_HISTOGRAM = 0.6
_FAR_FROM_DENSITY = 0.8
# More samples than these have a logarithmic axis, as have probabilities whose ratio is larger than this.
_MAX_LINEAR_SAMPLES = 400_000
_MAX_LINEAR_RATIO = 50.0
_DASHED = (0, (5, 2))
_LEFT = 0.88  # inches
_LEVELS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)  # of the peak of a density
Bands = tuple[tuple[float, float], tuple[float, float]]


def histogram_figure(given: Sampled) -> Figure:
    """Each output's error, the normal density with its mean and deviation, and the limits."""
    table = given.tables["histogram"]
    shown = channels(table)[:MAX_PANELS]
    columns = 1 if len(shown) == 1 else 2
    lines = -(-len(shown) // columns)
    figure, grid = style.page(
        len(shown), columns, 2.6 if lines == 1 else 1.9, left=0.75, right=0.15, top=0.95, bottom=0.95, across=0.75,
        down=0.85,
    )  # fmt: skip
    entries: dict[str, Any] = {}
    samples = 0
    for axis, (output, order, unit) in zip(grid, shown, strict=True):
        rows = table.where(output=output, order=order, unit=unit)
        samples = max(samples, int(table["count"][rows].sum()))
        _histogram(axis, table, rows, entries)
        _limits(given, axis, output, order, unit, entries)
        axis.set_title(heading(output, order), loc="left", fontsize=9.5)
        axis.set_xlabel(style.axis_label("error", unit))
        axis.set_ylabel(style.axis_label("density", f"1/({unit})" if "/" in unit else f"1/{unit}"))
        axis.locator_params(axis="x", nbins=6)
        axis.locator_params(axis="y", nbins=5)
    note = f"at {given.where}; {look(given.method).words}, {samples:,} samples"
    title(figure, "Errors of made mechanisms", note, left=0.75)
    legend_below(figure, list(entries.values()), list(entries))
    return figure


def _histogram(axis: Axes, table: Table, rows: np.ndarray, entries: dict[str, Any]) -> None:
    low, high, density, normal = (table[name][rows] for name in ("low", "high", "density", "normal"))
    bars = axis.bar(low, density, high - low, align="edge", color=style.SKY, edgecolor="white", linewidth=0.3)
    (fit,) = axis.plot((low + high) / 2, normal, color=style.BLUE, linewidth=1.8)
    axis.set_xlim(low[0], high[-1])
    axis.set_ylim(0.0, 1.08 * max(density.max(), normal.max()))
    entries |= {"made mechanisms": bars, "normal, same mean and deviation": fit}


def _limits(given: Sampled, axis: Axes, output: str, order: str, unit: str, entries: dict[str, Any]) -> None:
    low, high = axis.get_xlim()
    span = high - low
    reach = _FAR_FROM_HISTOGRAM * span
    near, far = apart(_at_pose(given, output, order), low - reach, high + reach)
    for limit in near:
        entries["limit of the error"] = axis.axvline(limit, color=style.VERMILION, linestyle=_DASHED)
    ends = [low, high, *(limit + side for limit in near for side in (-0.03 * span, 0.03 * span))]
    axis.set_xlim(min(ends), max(ends))
    if far:
        axis.set_ylim(0.0, 1.15 * axis.get_ylim()[1])
        told = ", ".join(f"{limit:+g}" for limit in far)
        axis.text(0.99, 0.98, f"limit {told} {unit}, outside", transform=axis.transAxes, ha="right", va="top",
                  fontsize=8, color=style.VERMILION)  # fmt: skip


def _at_pose(given: Sampled, output: str, order: str) -> tuple[float, float]:
    """Lowest and highest error allowed at the pose."""
    ends = error_limits(given.study, given.tables, output, order)
    low, high = ends[:, given.pose if ends.shape[1] > 1 else 0].tolist()
    return low, high


def convergence_figure(given: Sampled) -> Figure:
    """Mean of the simulation against the number of samples, within three standard errors of its end [S3, Fig. 4]."""
    table, moments = given.tables["convergence"], given.tables["moments"]
    shown = channels(table)[:MAX_PANELS]
    figure, axes = stack(len(shown), "Mean of made mechanisms as samples are added", "samples",
                         note=f"at {given.where}; {look(given.method).words}")  # fmt: skip
    for axis, (output, order, unit) in zip(axes, shown, strict=True):
        rows = table.where(output=output, order=order, unit=unit)
        samples, mean = table["samples"][rows], table["mean"][rows]
        row = np.flatnonzero(moments.where(output=output, order=order, unit=unit, method=given.method))[given.pose]
        band = 3.0 * moments["sigma"][row] / np.sqrt(samples)
        final = moments["mean"][row]
        axis.fill_between(samples, final - band, final + band, color=style.SKY, alpha=0.3, linewidth=0,
                          label="three standard errors")  # fmt: skip
        axis.plot(samples, mean, color=style.BLUE, marker="." if len(samples) == 1 else "", label="mean")
        axis.axhline(moments["nominal"][row], color=style.INK, linestyle="--", linewidth=1.0, label="nominal")
        axis.set_ylabel(style.axis_label(output if order == "position" else f"{output}\n{order}", unit))
        axis.ticklabel_format(axis="y", useOffset=False)
    _sample_axis(axes[-1], table["samples"])
    legend_below(figure, *axes[0].get_legend_handles_labels())
    return figure


def trend_figure(given: Sampled) -> Figure:
    """Failure probability against the number of samples with its interval, beside what other methods say."""
    table, reliability = given.tables["estimate"], given.tables["reliability"]
    known = [method for method in methods(reliability) if method != "monte_carlo"]
    figure, (axis,) = stack(1, "Failure probability as samples are added", "samples", note=f"at {given.where}",
                            tall=2.8, bottom=0.65 + 0.1 * (len(known) + 3))  # fmt: skip
    samples, value, low, high = (table[name] for name in ("samples", "failure", "failure_low", "failure_high"))
    late = len(samples) // 20
    ends = [low[late:].min(), value[-1], high[late:].max()]
    lines: list[tuple[float, dict[str, Any]]] = []
    for method in known:
        row = np.flatnonzero(reliability.where(method=method, scope="pose"))[given.pose]
        failure = float(reliability["failure"][row])
        if np.isfinite(failure):
            drawn, used = look(method), str(reliability["used"][row])
            words = drawn.words + f" by {look(used).words}" * (used != method)
            dashes = (0, (1, 1)) if drawn.sampled else drawn.dashes
            lines.append((failure, {"color": drawn.color, "ls": dashes, "label": f"{words}: {number(failure)}"}))
            ends.append(failure)
    positive = [end for end in ends if end > 0]
    floor = 0.0
    if positive and max(positive) > _MAX_LINEAR_RATIO * min(positive):
        axis.set_yscale("log")
        floor = 0.3 * min(positive)
        axis.set_ylim(floor, 2.0 * max(ends))
    else:
        margin = 0.06 * (max(ends) - min(ends))
        axis.set_ylim(max(min(ends) - margin, 0.0), max(ends) + margin or 1.0)
    axis.fill_between(samples, np.maximum(low, floor), high, color=style.INK, alpha=0.15, linewidth=0,
                      label="plain samples, 99.7 % interval")  # fmt: skip
    axis.plot(samples, value, color=style.INK, marker="." if len(samples) == 1 else "",
              label=f"plain samples: {number(float(value[-1]))}")  # fmt: skip
    for failure, options in lines:
        axis.axhline(failure, linewidth=1.4, **options)
    axis.set_ylabel("failure probability")
    _sample_axis(axis, samples)
    legend_below(figure, *axis.get_legend_handles_labels())
    return figure


def _sample_axis(axis: Axes, samples: np.ndarray) -> None:
    if samples.max() > _MAX_LINEAR_SAMPLES:
        axis.set_xscale("log")
    else:
        axis.xaxis.set_major_formatter("{x:,.0f}")
        axis.set_xlim(0, 1.01 * samples.max())


def density_figures(given: Sampled) -> dict[str, Figure]:
    """Contours and surfaces of the first pose of a density table; the axes are the errors, in their units."""
    study, table = given.study, given.tables["density"]
    known = {
        f"{output}{SUFFIXES[order]}_error": (output, order) for output, order, _ in channels(given.tables["moments"])
    }
    columns = [column for column in table.columns if column.name in known]
    shown = [known[column.name] for column in columns]
    table = table.take(np.arange(CELLS**2))
    x, y = (table[column.name].reshape(CELLS, CELLS) for column in columns)
    labels = [
        style.axis_label(f"{output} {order} error".replace("position ", ""), column.unit)
        for (output, order), column in zip(shown, columns, strict=True)
    ]
    densities = {
        "bivariate normal, first order": table["normal"].reshape(CELLS, CELLS),
        f"simulation ({look(given.method).words})": table["simulated"].reshape(CELLS, CELLS),
    }
    (output, order), section = shown[0], study.reliability
    assert section is not None
    circle = section.limits.get(f"{output.rpartition('.')[0]}{SUFFIXES[order]}")
    bands = _at_pose(given, *shown[0]), _at_pose(given, *shown[1])
    return {
        "density_contours": _contours(x, y, densities, labels, given.where, bands, circle.radius if circle else None),
        "density": _surfaces(x, y, densities, labels, given.where),
    }


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
    ends = [low, high, *apart(band, low - _FAR_FROM_DENSITY * span, high + _FAR_FROM_DENSITY * span)[0]]
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
