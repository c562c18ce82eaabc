"""Pictures of a motion: curves over the sweep, and the mechanism in several poses with the paths of its points."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mechdesign.analyses.poses import radians
from mechdesign.mechanism.graph import GROUND
from mechdesign.report.figures import style
from mechdesign.report.figures.mechanism import draw_mechanism, link_colors
from mechdesign.results import Column, Result
from mechdesign.study import Study

# More curves than this in one panel cannot be told apart.
MOST_CURVES = 7
MOST_PANELS = 9
GHOSTS = 9


def figures(study: Study, result: Result) -> dict[str, Figure]:
    """``motion`` (curves of a sweep or path) and ``paths`` (poses and point paths); nothing for a single pose."""
    table = result.tables["motion"]
    poses = study.poses("kinematics")
    if len(table) < 2 or poses.listed or len(poses.grid) != 1:
        return {}
    found = {"paths": _paths(study)}
    curves = _curves(study, result)
    return {"motion": curves, **found} if curves is not None else found


def _curves(study: Study, result: Result) -> Figure | None:
    table = result.tables["motion"]
    poses = study.poses("kinematics")
    swept = next((name for name in poses.names if np.ptp(poses.values[name]) > 0), None)
    if swept is None:
        return None
    is_path = len([name for name in poses.names if np.ptp(poses.values[name]) > 0]) > 1
    x = np.arange(poses.count) if is_path else poses.values[swept]
    panels: dict[tuple[str, str], list[Column]] = {}
    for column in table.columns:
        if column.name == "valid" or (column.name == swept and not is_path) or np.isnan(column.values).all():
            continue
        order = next((o for o in ("acceleration", "velocity", "effort") if column.name.endswith(f"_{o}")), "position")
        if column.name in ("det_J", "inverse_condition"):
            order = column.name
        panels.setdefault((order, column.unit), []).append(column)
    ranks = ("position", "velocity", "acceleration", "effort", "det_J", "inverse_condition")
    keys = sorted(panels, key=lambda key: ranks.index(key[0]))[:MOST_PANELS]
    # Margins by hand: a layout engine would draw everything twice.
    height = 0.7 + 1.75 * len(keys)
    figure = style.new_figure(style.WIDTH, height, layout=None)
    longest = max(len(c.name.removesuffix(f"_{key[0]}")) for key in keys for c in panels[key][:MOST_CURVES])
    right = 1 - (0.6 + 0.08 * longest) / style.WIDTH  # room for the legend, inches
    margins = {"left": 0.11, "right": right, "bottom": 0.5 / height, "top": 1 - 0.15 / height, "hspace": 0.14}
    axes = figure.subplots(len(keys), 1, sharex=True, squeeze=False, gridspec_kw=margins)[:, 0]
    for axis, key in zip(axes, keys, strict=True):
        shown = panels[key][:MOST_CURVES]
        for column in shown:
            label = column.name.removesuffix(f"_{key[0]}")
            axis.plot(x, column.values, label=label)
        title = key[0].replace("_", " ")
        if title == "position" and key[1] == study.units.label("angle"):
            title = "angle"
        axis.set_ylabel(style.axis_label(title, key[1]))
        axis.yaxis.set_label_coords(-0.1, 0.5)
        if len(shown) > 1 or shown[0].name != key[0]:
            left_out = len(panels[key]) - len(shown)
            axis.legend(
                loc="center left", bbox_to_anchor=(1.0, 0.5), title=f"and {left_out} more" if left_out else None
            )
    label = (
        style.axis_label("pose along the path")
        if is_path
        else style.axis_label(swept, study.units.label(study.mechanism.quantity(swept)))
    )
    axes[-1].set_xlabel(label)
    return figure


def _paths(study: Study) -> Figure:
    mechanism = study.mechanism
    group = study.poses("kinematics").groups[0]
    plan = mechanism.plan(group.names)
    given = [radians(study, c, v) for c, v in zip(plan.structure.given, group.columns(), strict=True)]
    configuration = plan.solve(given)
    valid = np.flatnonzero(configuration.valid)
    figure = style.new_figure(style.WIDTH, 5.4, layout=None)
    axes = figure.add_axes((0.09, 0.1, 0.89, 0.88))
    axes.set_aspect("equal", adjustable="datalim")
    if len(valid):
        # A closed turn ends where it begins: its last ghost would hide the first.
        ghosts = valid[np.unique(np.linspace(0, len(valid) - 1, GHOSTS).astype(int))]
        for index in ghosts[1:]:
            draw_mechanism(axes, mechanism, configuration, int(index), faint=True)
        colors = link_colors(mechanism)
        owners = {point: body for body, point in mechanism.graph.points if body != GROUND and ":" not in body}
        still = {point for body, point in mechanism.graph.points if body == GROUND}
        for point in mechanism.points:
            if point in still:
                continue
            places = np.where(configuration.valid, configuration.point(point), np.nan)
            color = colors.get(owners.get(point, ""), style.INK)
            axes.plot(places.real, places.imag, color=color, linewidth=1.4, zorder=2.5)
        draw_mechanism(axes, mechanism, configuration, int(valid[0]))
    unit = study.units.length
    axes.set_xlabel(style.axis_label("x", unit))
    axes.set_ylabel(style.axis_label("y", unit))
    return figure
