"""The score over one or two design variables, and each goal beside it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from mechdesign.report.figures import style
from mechdesign.report.figures.designs import Designs

LEVELS = 14
MARKERS = "osD^vP*X<>"


def score_curves(designs: Designs) -> Figure:
    """The best score for each value of each variable, with the goals of that design [S1, Fig. 3(a)]."""
    names, many = designs.names, len(designs.goals) > 1
    figure = style.new_figure(style.WIDTH, 0.4 + 2.9 * len(names))
    total, winner = designs.total(), designs.chosen()
    for row, name in enumerate(names):
        axes = figure.add_subplot(len(names), 1, row + 1)
        values, best = _best_each(designs, name)
        where = float(designs.optimum[name][winner])
        if many:
            axes.plot(values, total[best], color=style.INK, linewidth=2.2, label="CPI")
            for goal, color in zip(designs.goals, style.PALETTE, strict=False):
                axes.plot(values, designs.share(goal)[best], color=color, label=f"{goal}, normalised")
            height = float(designs.optimum["CPI"][winner])
            axes.set_ylabel("index")
        else:
            (goal,) = designs.goals
            axes.plot(values, designs[goal][best], color=style.INK, linewidth=2.0, label=goal)
            height = float(designs.optimum[goal][winner])
            axes.set_ylabel(designs.label(goal))
        axes.plot(
            where, height, "o", color=style.VERMILION, markersize=7, label=f"best: {name} = {where:.4g}", zorder=4
        )
        axes.set_xlabel(designs.label(name))
        axes.margins(x=0.01)
        if row == 0:
            what = "Composite performance index" if many else next(iter(designs.goals))
            among = "" if len(names) == 1 else ": the best design for each value of a variable"
            axes.set_title(what + among, loc="left")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return figure


def _best_each(designs: Designs, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Values of a variable, and the best design of each; of scattered values, those of about sixty classes."""
    column, total = designs[name], np.where(designs.feasible, designs.total(), -np.inf)
    values = np.unique(column[designs.feasible])
    if len(values) > 400:
        edges = np.linspace(values[0], values[-1], 61)
        kind = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, 59)
    else:
        kind = np.searchsorted(values, column)
    groups = [np.flatnonzero(designs.feasible & (kind == k)) for k in np.unique(kind[designs.feasible])]
    best = np.array([rows[np.argmax(total[rows])] for rows in groups])
    return column[best], best


def score_surface(designs: Designs) -> Figure:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    names, optimum = designs.names, designs.optimum
    many = len(designs.goals) > 1
    figure = style.new_figure(style.WIDTH, 5.2)
    axes = figure.add_subplot()
    filled = _fill(axes, designs, designs.total() if many else designs[next(iter(designs.goals))])
    bar = figure.colorbar(filled, ax=axes, pad=0.02)
    bar.set_label("composite performance index CPI" if many else designs.label(next(iter(designs.goals))))
    bar.outline.set_visible(False)
    shown: dict[tuple[float, float], list[str]] = {}
    for row in range(len(optimum)):
        place = (float(optimum[names[0]][row]), float(optimum[names[1]][row]))
        shown.setdefault(place, []).append(
            "(" + ", ".join(f"{optimum[f'w_{goal}'][row]:g}" for goal in designs.goals) + ")"
        )
    for k, (place, rows) in enumerate(shown.items()):
        words = f"{place[0]:.4g}, {place[1]:.4g}: " + (f"best for {' '.join(rows)}" if many else "best")
        axes.plot(*place, MARKERS[k % len(MARKERS)], color=style.VERMILION, markeredgecolor="white", markersize=8,
                  linestyle="none", label=words, clip_on=False, zorder=5)  # fmt: skip
    title = f"CPI over the design variables, and the best designs for weights of ({', '.join(designs.goals)})"
    axes.set_title(title if many else f"{next(iter(designs.goals))} over the design variables", loc="left")
    axes.set_xlabel(designs.label(names[0]))
    axes.set_ylabel(designs.label(names[1]))
    axes.grid(visible=False)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2 if len(shown) > 3 else 1)
    return figure


def goal_maps(designs: Designs) -> Figure:
    """Each goal over two variables, side by side."""
    columns = min(len(designs.goals), 3)
    rows = -(-len(designs.goals) // columns)
    figure = style.new_figure(style.WIDTH, 0.3 + 2.7 * rows)
    for number, goal in enumerate(designs.goals):
        axes = figure.add_subplot(rows, columns, number + 1)
        filled = _fill(axes, designs, designs[goal])
        bar = figure.colorbar(filled, ax=axes, location="bottom", pad=0.02)
        bar.outline.set_visible(False)
        bar.ax.locator_params(nbins=4)
        axes.set_title(designs.label(goal), loc="left")
        axes.set_xlabel(designs.label(designs.names[0]))
        if number % columns == 0:
            axes.set_ylabel(designs.label(designs.names[1]))
        axes.grid(visible=False)
    return figure


def _fill(axes: Axes, designs: Designs, values: np.ndarray) -> ScalarMappable:
    """Filled contours over two variables whose bounds may depend on each other; dots where designs are scattered."""
    inside = designs.feasible & np.isfinite(values)
    x, y, z = (column[inside] for column in (*(designs[name] for name in designs.names), values))
    steps = [np.unique(np.round(v, 9)) for v in (x, y)]
    on_a_grid = len(steps[0]) * len(steps[1]) <= 4 * len(z)
    if not on_a_grid or len(steps[0]) < 2 or len(steps[1]) < 2 or len(z) < 4:
        order = np.argsort(values[inside] if not any(designs.goals.values()) else designs.total()[inside])
        axes.margins(0.03)
        return axes.scatter(x[order], y[order], c=z[order], s=14, cmap=style.COLORMAP, linewidths=0)
    # In steps of the grid triangles are well shaped; those that span missing designs are left out.
    scaled = [(v - v.min()) / np.median(np.diff(step)) for v, step in zip((x, y), steps, strict=True)]
    mesh = Triangulation(*scaled)
    corners = np.stack([mesh.x[mesh.triangles], mesh.y[mesh.triangles]])
    mesh = Triangulation(x, y, mesh.triangles, mask=(np.ptp(corners, axis=2) > 2.01).any(axis=0))
    levels = np.linspace(z.min(), z.max(), LEVELS + 1) if np.ptp(z) > 0 else np.array([z[0] - 0.5, z[0] + 0.5])
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled
