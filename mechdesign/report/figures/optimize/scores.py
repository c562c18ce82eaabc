"""The score over one or two design variables, and each goal beside it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from matplotlib.tri import Triangulation

from mechdesign.numerics.arrays import Floats, Ints
from mechdesign.report.figures import style
from mechdesign.report.figures.optimize.designs import Designs

LEVELS = 14
MARKERS = "osD^vP*X<>"


def score_curves(designs: Designs) -> Figure:
    """The best score for each value of each variable, with the goals of that design [S1, Fig. 3(a)].

    Of scattered designs each is a dot.
    """
    names, many = designs.names, len(designs.goals) > 1
    across = min(len(names), 3) if len(names) > 2 else 1
    down = -(-len(names) // across)
    figure = style.new_figure(style.WIDTH, 0.9 + (2.9 if across == 1 else 2.5) * down)
    winner = designs.chosen()
    score = designs.total() if many else designs[next(iter(designs.goals))]
    column = "CPI" if many else next(iter(designs.goals))
    for number, name in enumerate(names):
        axes = figure.add_subplot(down, across, number + 1)
        where = float(designs.optimum[name][winner])
        values = np.unique(designs[name][designs.feasible])
        if len(names) > 1 and 2 * len(values) > designs.feasible.sum():
            axes.plot(designs[name][designs.feasible], score[designs.feasible], ".", color=style.FAINT, markersize=4,
                      markeredgewidth=0, label="designs")  # fmt: skip
        else:
            best = _best_each(designs, name, values)
            axes.plot(values, score[best], color=style.INK, linewidth=2.0, label=column)
            for goal, color in zip(designs.goals if many else (), style.PALETTE, strict=False):
                axes.plot(values, designs.share(goal)[best], color=color, label=f"{goal}, normalised")
        height = float(designs.optimum[column][winner])
        axes.plot(where, height, "o", color=style.VERMILION, markersize=6.5, label="best", zorder=4)
        axes.set_title(f"best: {name} = {where:.4g}", loc="right", fontsize=9, color=style.VERMILION)
        axes.set_xlabel(designs.label(name))
        axes.set_ylabel("" if number % across else "index" if many else designs.label(column))
        axes.margins(x=0.02)
        if not many and _steep(score[designs.feasible]):
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.yaxis.set_minor_formatter(NullFormatter())
    what = "Composite performance index" if many else column
    among = "" if len(names) == 1 else ": the best design for each value of a variable"
    figure.suptitle(what + among, x=0.01, ha="left", fontsize=11)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=5)
    return figure


def _best_each(designs: Designs, name: str, values: Floats) -> Ints:
    """The best design for each value of a variable."""
    total = np.where(designs.feasible, designs.total(), -np.inf)
    rows = [np.flatnonzero(designs.feasible & (designs[name] == value)) for value in values]
    return np.array([found[np.argmax(total[found])] for found in rows], dtype=np.intp)


def _steep(values: Floats) -> bool:
    """Whether values are told apart on a logarithmic scale only."""
    finite = values[np.isfinite(values)]
    return bool((finite > 0).all() and finite.max() > 30 * finite.min())


def score_surface(designs: Designs) -> Figure:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    names, optimum = designs.names, designs.optimum
    many = len(designs.goals) > 1
    figure = style.new_figure(style.WIDTH, 5.2)
    axes = figure.add_subplot()
    filled = _fill(axes, designs, designs.total() if many else designs[next(iter(designs.goals))])
    bar = figure.colorbar(filled, ax=axes, pad=0.02, format=FuncFormatter(lambda value, _: f"{value:.3g}"))
    bar.minorticks_off()
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


def _fill(axes: Axes, designs: Designs, values: Floats) -> ScalarMappable:
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
    norm = None
    if np.ptp(z) == 0:
        levels = np.array([z[0] - 0.5, z[0] + 0.5])
    elif _steep(z) and len(designs.goals) == 1:
        levels, norm = np.geomspace(z.min(), z.max(), LEVELS + 1), LogNorm(z.min(), z.max())
    else:
        levels = np.asarray(MaxNLocator(nbins=LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(z.min(), z.max()))
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP, norm=norm)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled
