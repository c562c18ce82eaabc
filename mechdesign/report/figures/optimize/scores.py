"""The score over one or two design variables, and each goal beside it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib.tri import Triangulation

from mechdesign.analyses.optimize.tables import Comparison
from mechdesign.numerics.arrays import Floats
from mechdesign.report.figures import style

LEVELS = 14
MARKERS = "osD^vP*X<>"


def label(compared: Comparison, name: str) -> str:
    """Name and unit of a variable or a goal, for an axis."""
    return style.axis_label(name, compared.unit_of(name))


def in_words(compared: Comparison, row: int) -> str:
    """``l_a = 1, l_b = 2.15`` of a design."""
    return ", ".join(f"{name} = {values[row]:.4g}" for name, values in compared.designs.variables.items())


def score_curves(compared: Comparison) -> Figure:
    """The best score for each value of each variable, with the goals of that design [S1, Fig. 3(a)].

    Of scattered designs each is a dot.
    """
    designs, winner = compared.designs, compared.best
    many, count, one = len(designs.goals) > 1, len(designs.variables), designs.goals[0]
    across = min(count, 3) if count > 2 else 1
    down = -(-count // across)
    figure = style.new_figure(0.9 + (2.9 if across == 1 else 2.5) * down)
    score, told = (compared.cpi, "CPI") if many else (compared.values[:, 0], one.name)
    for number, (name, column) in enumerate(designs.variables.items()):
        axes = figure.add_subplot(down, across, number + 1)
        inside = column[designs.feasible]
        values = np.unique(inside)
        if count > 1 and 2 * len(values) > len(inside):
            axes.plot(inside, score[designs.feasible], ".", color=style.FAINT, markersize=4, markeredgewidth=0,
                      label="designs")  # fmt: skip
        else:
            order = np.lexsort([-np.where(designs.feasible, compared.cpi, -np.inf), column])
            best = order[np.searchsorted(column[order], values)]
            axes.plot(values, score[best], color=style.INK, linewidth=2.0, label=told)
            for k, color in zip(range(len(designs.goals)) if many else (), style.PALETTE, strict=False):
                shown = f"{designs.goals[k].name}, normalised"
                axes.plot(values, compared.share(k)[best], color=color, label=shown)
        axes.plot(column[winner], score[winner], "o", color=style.VERMILION, markersize=6.5, label="best", zorder=4)
        axes.set_title(f"best: {name} = {column[winner]:.4g}", loc="right", fontsize=9, color=style.VERMILION)
        axes.set_xlabel(label(compared, name))
        axes.set_ylabel("" if number % across else "index" if many else label(compared, told))
        axes.margins(x=0.02)
        if not many and _steep(score[designs.feasible]):
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.yaxis.set_minor_formatter(NullFormatter())
    among = "" if count == 1 else ": the best design for each value of a variable"
    figure.suptitle(("Composite performance index" if many else told) + among, x=0.01, ha="left", fontsize=11)
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=5)
    return figure


def _steep(values: Floats) -> bool:
    """Whether values are told apart on a logarithmic scale only."""
    finite = values[np.isfinite(values)]
    return bool((finite > 0).all() and finite.max() > 30 * finite.min())


def score_surface(compared: Comparison) -> Figure:
    """The score over two variables as a map, with the best design for each row of weights [S1, Fig. 3(b)]."""
    goals, (x, y) = [each.name for each in compared.designs.goals], compared.designs.variables.values()
    many = len(goals) > 1
    figure = style.new_figure(5.2)
    axes = figure.add_subplot()
    filled = _fill(axes, compared, compared.cpi if many else compared.values[:, 0])
    what = "composite performance index CPI" if many else label(compared, goals[0])
    digits = FuncFormatter(lambda value, _: f"{value:.3g}")
    style.color_bar(figure, filled, what, ax=axes, pad=0.02, format=digits).minorticks_off()
    shown: dict[tuple[float, float], list[str]] = {}
    for row, weights in zip(compared.winners, compared.weights, strict=True):
        shown.setdefault((x[row], y[row]), []).append(f"({', '.join(f'{weight:g}' for weight in weights)})")
    for k, (place, rows) in enumerate(shown.items()):
        words = f"{place[0]:.4g}, {place[1]:.4g}: " + (f"best for {' '.join(rows)}" if many else "best")
        axes.plot(*place, MARKERS[k % len(MARKERS)], color=style.VERMILION, markeredgecolor="white", markersize=8,
                  linestyle="none", label=words, clip_on=False, zorder=5)  # fmt: skip
    title = f"CPI over the design variables, and the best designs for weights of ({', '.join(goals)})"
    axes.set_title(title if many else f"{goals[0]} over the design variables", loc="left")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower left", ncols=2 if len(shown) > 3 else 1)
    return figure


def goal_maps(compared: Comparison) -> Figure:
    """Each goal over two variables, side by side."""
    goals = compared.designs.goals
    columns = min(len(goals), 3)
    rows = -(-len(goals) // columns)
    figure = style.new_figure(0.3 + 2.7 * rows)
    for number, goal in enumerate(goals):
        axes = figure.add_subplot(rows, columns, number + 1)
        filled = _fill(axes, compared, compared.values[:, number])
        style.color_bar(figure, filled, ax=axes, location="bottom", pad=0.02).ax.locator_params(nbins=4)
        axes.set_title(label(compared, goal.name), loc="left")
        if number % columns:
            axes.set_ylabel("")
    return figure


def _fill(axes: Axes, compared: Comparison, values: Floats) -> ScalarMappable:
    """Filled contours over two variables whose bounds may depend on each other; dots where designs are scattered."""
    designs = compared.designs
    across, up = designs.variables
    axes.set_xlabel(label(compared, across))
    axes.set_ylabel(label(compared, up))
    axes.grid(visible=False)
    inside = designs.feasible & np.isfinite(values)
    x, y, z = (column[inside] for column in (*designs.variables.values(), values))
    steps = [np.unique(np.round(v, 9)) for v in (x, y)]
    on_a_grid = len(steps[0]) * len(steps[1]) <= 4 * len(z)
    if not on_a_grid or len(steps[0]) < 2 or len(steps[1]) < 2 or len(z) < 4:
        order = np.argsort(compared.cpi[inside] if any(each.smallest for each in designs.goals) else z)
        axes.margins(0.03)
        return axes.scatter(x[order], y[order], c=z[order], s=14, cmap=style.COLORMAP, linewidths=0)
    # In steps of the grid triangles are well shaped; those that span missing designs are left out.
    scaled = [(v - v.min()) / np.median(np.diff(step)) for v, step in zip((x, y), steps, strict=True)]
    mesh = Triangulation(*scaled)
    corners = np.stack([mesh.x[mesh.triangles], mesh.y[mesh.triangles]])
    mesh = Triangulation(x, y, mesh.triangles, mask=(np.ptp(corners, axis=2) > 2.01).any(axis=0))
    levels, norm = style.levels(z.min(), z.max(), LEVELS), None
    if _steep(z) and len(designs.goals) == 1:
        levels, norm = np.geomspace(z.min(), z.max(), LEVELS + 1), LogNorm(z.min(), z.max())
    filled = axes.tricontourf(mesh, z, levels=levels, cmap=style.COLORMAP, norm=norm)
    axes.tricontour(mesh, z, levels=levels, colors="white", linewidths=0.4, alpha=0.6)
    axes.margins(0.02)
    return filled
