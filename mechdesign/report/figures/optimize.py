"""Pictures of the optimisation: the composite index over the design variables, and each index beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from mechdesign.report.figures import style
from mechdesign.results import Result, Table

if TYPE_CHECKING:
    from mechdesign.study import Study

Floats = NDArray[np.float64]
LEVELS = 14


def figures(study: Study, result: Result) -> dict[str, Figure]:
    """CPI and indices over one or two variables [S1, Fig. 3]; over more, each variable's best designs."""
    assert study.optimize is not None
    names = list(study.optimize.variables)
    goals = [*study.optimize.maximize, *study.optimize.minimize]
    designs, optimum = result.tables["designs"], result.tables["optimum"]
    if len(names) == 2 and len(designs) >= 9:
        return {"CPI": _surface(study, designs, optimum, names), "indices": _maps(study, designs, names, goals)}
    return {"CPI": _curves(study, designs, optimum, names, goals)}


def _unit(table: Table, name: str) -> str:
    return next(column.unit for column in table.columns if column.name == name)


def _label(table: Table, name: str) -> str:
    return style.axis_label(name, _unit(table, name))


def _best_row(optimum: Table) -> int:
    return int(np.argmax(optimum["CPI"]))


def _curves(study: Study, designs: Table, optimum: Table, names: list[str], goals: list[str]) -> Figure:
    """The best CPI for each value of each variable, with the normalised indices of that design."""
    figure = style.new_figure(style.WIDTH, 0.4 + 2.9 * len(names))
    feasible = designs["feasible"].astype(bool)
    for row, name in enumerate(names):
        axes = figure.add_subplot(len(names), 1, row + 1)
        values = np.unique(designs[name][feasible])
        best = [_best_of(designs, feasible & (designs[name] == value)) for value in values]
        axes.plot(values, designs["CPI"][best], color=style.INK, linewidth=2.2, label="CPI")
        for goal, color in zip(goals, style.PALETTE, strict=False):
            axes.plot(
                values, _normalised(study, designs, goal, feasible)[best], color=color, label=f"{goal}, normalised"
            )
        winner = _best_row(optimum)
        axes.plot(optimum[name][winner], optimum["CPI"][winner], "o", color=style.VERMILION, markersize=7,
                  label=f"best: {name} = {optimum[name][winner]:g}")  # fmt: skip
        axes.set_xlabel(_label(designs, name))
        axes.set_ylabel("index")
        axes.margins(x=0.01)
        if row == 0:
            axes.set_title("Composite performance index", loc="left")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure


def _best_of(designs: Table, rows: NDArray[np.bool_]) -> int:
    found = np.flatnonzero(rows)
    return int(found[np.argmax(designs["CPI"][found])])


def _normalised(study: Study, designs: Table, goal: str, feasible: NDArray[np.bool_]) -> Floats:
    assert study.optimize is not None
    values = designs[goal]
    low, high = values[feasible].min(), values[feasible].max()
    share = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return 1 - share if goal in study.optimize.minimize else share


def _surface(study: Study, designs: Table, optimum: Table, names: list[str]) -> Figure:
    figure = style.new_figure(style.WIDTH, 5.2)
    axes = figure.add_subplot()
    filled = _fill(axes, designs, names, "CPI")
    bar = figure.colorbar(filled, ax=axes, pad=0.02)
    bar.set_label("composite performance index CPI")
    bar.outline.set_visible(False)
    shown: dict[tuple[float, float], list[str]] = {}
    weights = [name for name in optimum.names if name.startswith("w_")]
    for row in range(len(optimum)):
        place = (float(optimum[names[0]][row]), float(optimum[names[1]][row]))
        shown.setdefault(place, []).append("(" + ", ".join(f"{optimum[name][row]:g}" for name in weights) + ")")
    markers = "osD^vP*X<>"
    for (place, rows), marker in zip(shown.items(), markers * (1 + len(shown) // len(markers)), strict=False):
        axes.plot(*place, marker, color=style.VERMILION, markeredgecolor="white", markersize=8, linestyle="none",
                  label=f"{place[0]:g}, {place[1]:g}: best for {' '.join(rows)}", clip_on=False, zorder=5)  # fmt: skip
    goals = ", ".join(name.removeprefix("w_") for name in weights)
    axes.set_title(f"CPI over the design variables, and the best designs for weights of ({goals})", loc="left")
    axes.set_xlabel(_label(designs, names[0]))
    axes.set_ylabel(_label(designs, names[1]))
    axes.grid(visible=False)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2 if len(shown) > 3 else 1)
    return figure


def _maps(study: Study, designs: Table, names: list[str], goals: list[str]) -> Figure:
    columns = min(len(goals), 3)
    rows = -(-len(goals) // columns)
    figure = style.new_figure(style.WIDTH, 0.3 + 2.7 * rows)
    for number, goal in enumerate(goals):
        axes = figure.add_subplot(rows, columns, number + 1)
        filled = _fill(axes, designs, names, goal)
        bar = figure.colorbar(filled, ax=axes, location="bottom", pad=0.02)
        bar.outline.set_visible(False)
        bar.ax.locator_params(nbins=4)
        axes.set_title(_label(designs, goal), loc="left")
        axes.set_xlabel(_label(designs, names[0]))
        if number % columns == 0:
            axes.set_ylabel(_label(designs, names[1]))
        axes.grid(visible=False)
    return figure


def _fill(axes: Axes, designs: Table, names: list[str], column: str):  # type: ignore[no-untyped-def]
    """Filled contours over two variables whose bounds may depend on each other."""
    inside = designs["feasible"].astype(bool) & np.isfinite(designs[column])
    x, y, z = designs[names[0]][inside], designs[names[1]][inside], designs[column][inside]
    if np.ptp(x) == 0 or np.ptp(y) == 0 or len(z) < 4:
        return axes.scatter(x, y, c=z, cmap=style.COLORMAP)
    # In steps of the grid triangles are well shaped; those that span missing designs are left out.
    scaled = [(v - v.min()) / np.median(np.diff(np.unique(np.round(v, 9)))) for v in (x, y)]
    mesh = Triangulation(*scaled)
    corners = np.stack([mesh.x[mesh.triangles], mesh.y[mesh.triangles]])
    mesh = Triangulation(x, y, mesh.triangles, mask=(np.ptp(corners, axis=2) > 2.01).any(axis=0))
    levels = np.linspace(z.min(), z.max(), LEVELS + 1) if np.ptp(z) > 0 else np.array([z[0] - 0.5, z[0] + 0.5])
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled
