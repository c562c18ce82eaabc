"""Pictures of errors: curves over a sweep, densities, convergence, contributions and the reliability itself."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mechdesign.analyses.poses import pose_in_words
from mechdesign.report.figures import style
from mechdesign.report.figures.densities import density_figures
from mechdesign.results import Result, Table
from mechdesign.study import Study
from mechdesign.study.poses import Poses

Floats = NDArray[np.float64]

# More of them in one picture cannot be told apart.
MOST_OUTPUTS = 7
MOST_PANELS = 6
MOST_SOURCES = 16
MOST_POSES = 4
_METHODS = {"analytic": "first order", "monte_carlo": "Monte Carlo"}
_ORDERS = ("position", "velocity", "acceleration")
Key = tuple[str, str]


def figures(study: Study, result: Result) -> dict[str, Figure]:
    """Whatever the result holds enough of to draw."""
    poses = study.poses("reliability")
    moments = result.tables["moments"]
    found: dict[str, Figure] = {}
    swept = _swept(poses)
    if swept is not None:
        found |= _sweep_figures(study, moments, swept)
    if "reliability" in result.tables and poses.count > 1:
        chart = _reliability(study, result.tables["reliability"], poses, swept)
        found |= {} if chart is None else {"reliability": chart}
    if "density" in result.tables:
        table = result.tables["density"]
        drawn = [table[name][0] for name in poses.names]
        rows = [np.array_equal(row, drawn, equal_nan=True) for row in zip(*poses.values.values(), strict=True)]
        pose = pose_in_words(study, poses, rows.index(True))
        assert study.reliability is not None
        found |= density_figures(study, table, study.reliability.samples, pose)
    if "convergence" in result.tables:
        found["convergence"] = _convergence(result)
    if "contributions" in result.tables:
        found["contributions"] = _contributions(study, result.tables["contributions"], poses)
    return found


def _swept(poses: Poses) -> str | None:
    """The coordinate that a sweep or path runs over; None for listed poses and grids."""
    if poses.listed or len(poses.grid) != 1 or poses.count < 3:
        return None
    return next((name for name in poses.names if np.ptp(poses.values[name]) > 0), None)


def _panels(table: Table) -> Iterator[tuple[Key, list[str]]]:
    """Outputs that share an order and a unit, in the order of the table."""
    panels: dict[Key, list[str]] = {}
    for order, unit, output in zip(table["order"], table["unit"], table["output"], strict=True):
        outputs = panels.setdefault((str(order), str(unit)), [])
        if output not in outputs:
            outputs.append(str(output))
    keys = sorted(panels, key=lambda key: _ORDERS.index(key[0]))[:MOST_PANELS]
    return ((key, panels[key][:MOST_OUTPUTS]) for key in keys)


def _rows(table: Table, key: Key, **chosen: str) -> NDArray[np.bool_]:
    rows = (table["order"] == key[0]) & (table["unit"] == key[1]) if "unit" in table else table["order"] == key[0]
    for name, value in chosen.items():
        rows = rows & (table[name] == value)
    return np.asarray(rows)


def _stack(panels: int) -> tuple[Figure, list[Axes]]:
    """Panels over a common axis, with room for a title above and a legend below."""
    figure = _framed(1.35 + 1.8 * panels, left=1.05, right=0.15, top=0.55, bottom=0.85, apart=(0.22, 0.0))
    axes = list(figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0])
    for axis in axes:
        # Given places: to find them from the tick labels would take as long as the rest of the picture.
        axis.set_title("", y=1.02)
        axis.locator_params(axis="y", nbins=5)
        axis.yaxis.set_label_coords(-0.98 / (style.WIDTH - 1.2), 0.5, transform=axis.transAxes)
        axis.yaxis.label.set_verticalalignment("top")
    axes[-1].locator_params(axis="x", nbins=6)
    axes[-1].xaxis.set_label_coords(0.5, -0.2, transform=axes[-1].transAxes)
    return figure, axes


def _framed(
    height: float, *, left: float, right: float, top: float, bottom: float, apart: tuple[float, float]
) -> Figure:
    """A figure with fixed margins (inches) and gaps (panels): a layout engine would take twice as long as drawing."""
    figure = style.new_figure(style.WIDTH, height, layout=None)
    figure.subplots_adjust(
        left / style.WIDTH, bottom / height, 1 - right / style.WIDTH, 1 - top / height, apart[1], apart[0]
    )
    return figure


def _sweep_figures(study: Study, moments: Table, swept: str) -> dict[str, Figure]:
    """Means, standard deviations and the methods' difference over the sweep [S3, Figs. 5 to 7]."""
    methods = [method for method in _METHODS if (moments["method"] == method).any()]
    panels = list(_panels(moments))
    label = style.axis_label(swept, study.units.label(study.mechanism.quantity(swept)))
    found = {}
    for name, column, what in (("means", "mean", "mean"), ("deviations", "sigma", "standard deviation")):
        figure, axes = _stack(len(panels))
        for axis, (key, outputs) in zip(axes, panels, strict=True):
            for k, output in enumerate(outputs):
                for method in methods:
                    rows = _rows(moments, key, output=output, method=method)
                    dots = method == "monte_carlo"
                    axis.plot(
                        moments[swept][rows], moments[column][rows], "." if dots else "-", markersize=5,
                        color=style.INK if dots and len(outputs) == 1 else style.PALETTE[k % len(style.PALETTE)],
                        label=f"{output}, {_METHODS[method]}",
                    )  # fmt: skip
            axis.set_ylabel(style.axis_label(key[0], key[1]))
            if name == "deviations":
                axis.set_ylim(0.0, 1.1 * axis.get_ylim()[1])
        axes[0].set_title(f"{what} of made mechanisms", y=1.02)
        _finish(figure, axes, label)
        found[name] = figure
    if len(methods) == 2:
        found["difference"] = _difference(moments, swept, label, panels)
    return found


def _difference(moments: Table, swept: str, label: str, panels: list[tuple[Key, list[str]]]) -> Figure:
    figure, axes = _stack(len(panels))
    for axis, (key, outputs) in zip(axes, panels, strict=True):
        averages = []
        for output in outputs:
            one, other = (_rows(moments, key, output=output, method=method) for method in _METHODS)
            with np.errstate(invalid="ignore", divide="ignore"):
                percent = 100.0 * (moments["sigma"][one] / moments["sigma"][other] - 1.0)
            mean = np.nanmean(np.abs(percent)) if np.isfinite(percent).any() else np.nan
            axis.plot(moments[swept][one], percent, ".-", label=output)
            averages.append(f"{output} {mean:.2f} %")
        apart = f"on average {', '.join(averages)} apart"
        axis.text(1.0, 1.01, apart, transform=axis.transAxes, ha="right", va="bottom", fontsize=8)
        axis.axhline(0.0, color=style.FAINT, linewidth=0.8)
        axis.set_ylabel(f"{key[0]} [%]")
    axes[0].set_title("standard deviation: first order less simulation, in per cent of simulation", y=1.12)
    _finish(figure, axes, label)
    return figure


def _finish(figure: Figure, axes: list[Axes], label: str) -> None:
    """Name the common axis, and put one legend below where all panels have the same curves."""
    axes[-1].set_xlabel(label)
    entries = [axis.get_legend_handles_labels() for axis in axes]
    if all(labels == entries[0][1] for _, labels in entries):
        if len(entries[0][1]) > 1:
            figure.legend(*entries[0], loc="lower center", ncols=_fitting(entries[0][1]))
    else:
        for axis in axes:
            axis.legend(loc="center left")


def _fitting(labels: list[str]) -> int:
    """Columns of a legend that the width of a figure holds."""
    return max(1, min(len(labels), 110 // (8 + max(len(label) for label in labels))))


def _reliability(study: Study, table: Table, poses: Poses, swept: str | None) -> Figure | None:
    """Failure probability with its interval, over the sweep or pose by pose."""
    if swept is None and not poses.listed:
        return None
    figure = _framed(3.6, left=0.95, right=0.15, top=0.15, bottom=0.6, apart=(0.0, 0.0))
    axes = figure.subplots()
    place = np.arange(poses.count) if swept is None else poses.values[swept]
    width = 0.12 if swept is None else 0.0
    positive = table["failure_high"][np.isfinite(table["failure_high"]) & (table["failure_high"] > 0)]
    floor = 0.3 * min([*table["failure"][table["failure"] > 0], *positive], default=1e-3)
    scale = "log" if np.max(positive, initial=0.0) > 30.0 * floor else "linear"
    for k, (method, name) in enumerate(_METHODS.items()):
        rows = table["method"] == method
        if not rows.any():
            continue
        value, low, high = (table[c][rows] for c in ("failure", "failure_low", "failure_high"))
        at = place + (2 * k - 1) * width
        if method == "analytic":
            axes.plot(at, value, "D" if swept is None else "-", color=style.BLUE, label=name)
        else:
            shown = np.maximum(value, floor)
            bars = np.abs(np.stack([shown - np.maximum(low, floor), high - shown]))
            axes.errorbar(at, shown, bars, fmt="o", markersize=4, capsize=3, color=style.VERMILION,
                          label=f"{name}, 99.7 % interval")  # fmt: skip
    axes.set_yscale(scale)
    axes.set_ylabel("failure probability")
    if swept is None:
        words = [pose_in_words(study, poses, row).replace(", ", "\n") for row in range(poses.count)]
        axes.set_xticks(place[:12], words[:12], fontsize=8)
        axes.set_xlim(-0.6, min(poses.count, 12) - 0.4)
    else:
        axes.set_xlabel(style.axis_label(swept, study.units.label(study.mechanism.quantity(swept))))
    axes.legend()
    return figure


def _convergence(result: Result) -> Figure:
    """Mean of the simulation against the number of samples, within three standard errors of its end [S3, Fig. 4]."""
    table, moments = result.tables["convergence"], result.tables["moments"]
    pairs = list(dict.fromkeys(zip(table["output"], table["order"], table["unit"], strict=True)))[:MOST_PANELS]
    figure, axes = _stack(len(pairs))
    for axis, (output, order, unit) in zip(axes, pairs, strict=True):
        rows = _rows(table, (order, unit), output=output)
        samples, mean = table["samples"][rows], table["mean"][rows]
        simulated = _rows(moments, (order, unit), output=output, method="monte_carlo")
        final, sigma = moments["mean"][simulated], moments["sigma"][simulated]
        first = np.flatnonzero(np.isfinite(sigma))[0]
        band = 3.0 * sigma[first] / np.sqrt(samples)
        axis.fill_between(samples, final[first] - band, final[first] + band, color=style.SKY, alpha=0.3, linewidth=0,
                          label="three standard errors")  # fmt: skip
        axis.plot(samples, mean, color=style.BLUE, label="mean")
        axis.axhline(moments["nominal"][simulated][first], color=style.VERMILION, linestyle="--", linewidth=1.0,
                     label="nominal")  # fmt: skip
        axis.set_ylabel(style.axis_label(output if order == "position" else f"{output}\n{order}", unit))
        axis.ticklabel_format(axis="y", useOffset=False)
    axes[0].set_title("mean at the first pose as samples are added", y=1.02)
    _finish(figure, axes, "samples")
    return figure


def _contributions(study: Study, table: Table, poses: Poses) -> Figure:
    """Ranked shares of the variance: a bar a pose where a few are listed, the average over all otherwise."""
    pairs = list(dict.fromkeys(zip(table["output"], table["order"], strict=True)))[:MOST_PANELS]
    each = poses.listed and poses.count <= MOST_POSES
    columns = min(len(pairs), 3)
    lines = -(-len(pairs) // columns)
    names = list(dict.fromkeys(table["source"]))
    longest = max(len(name) for name in names)
    line = 0.4 + 0.3 * min(len(names), MOST_SOURCES)
    margin = 0.25 + 0.075 * longest
    figure = _framed(
        lines * (line + 0.7) + 0.8, left=margin, right=0.15, top=0.5, bottom=1.0,
        apart=(0.7 / line, (margin + 0.1) / ((style.WIDTH - margin) / columns - margin)),
    )  # fmt: skip
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    for axis in grid[len(pairs) :]:
        axis.set_visible(False)
    for axis, (output, order) in zip(grid, pairs, strict=False):
        rows = (table["output"] == output) & (table["order"] == order)
        shares = table["share"][rows].reshape(poses.count, len(names))
        known = shares[np.isfinite(shares).all(axis=1)]
        average = known.mean(axis=0) if len(known) else np.zeros(len(names))
        ranked = np.argsort(-average, kind="stable")[:MOST_SOURCES]
        shown = 100.0 * (shares[:, ranked] if each else average[None, ranked])
        height = 0.8 / len(shown)
        for k, values in enumerate(shown):
            label = pose_in_words(study, poses, k) if each else None
            bars = axis.barh(np.arange(len(ranked)) + (k + 0.5) * height - 0.4, values, height,
                             color=style.PALETTE[k % len(style.PALETTE)], label=label)  # fmt: skip
            if len(shown) == 1:
                axis.bar_label(bars, fmt="%.1f", padding=2, fontsize=8)
        axis.set_yticks(np.arange(len(ranked)), [names[k] for k in ranked])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.margins(x=0.15)
        axis.set_title(output if order == "position" else f"{output} {order}")
        axis.set_xlabel("share of the variance [%]")
    if each and poses.count > 1:
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="lower center", ncols=_fitting(labels))
    elif not each and poses.count > 1:
        figure.suptitle(f"average over {poses.count} poses", fontsize=9)
    return figure
