"""Pictures of a stiffness: equivalent springs on the mechanism [S4, Fig. 6], directions, curves or a map over poses."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from mechdesign.analyses.poses import pose_in_words
from mechdesign.analyses.stiffness.analysis import Drawn
from mechdesign.report.figures import style
from mechdesign.report.figures.annotations import name_labels
from mechdesign.report.figures.drawing import link_colors
from mechdesign.report.figures.labels import covered, place_labels
from mechdesign.report.figures.panels import along
from mechdesign.report.figures.planes import Plane, map_sheet, plane
from mechdesign.report.figures.rendering import Gallery
from mechdesign.report.figures.scene import Scene, pose
from mechdesign.report.figures.stiffness.deflected import deflections, free_motion, posed
from mechdesign.report.figures.stiffness.springs import Coil, coil_labels, draw_coils, quantity
from mechdesign.results import Result
from mechdesign.study import Poses, Study

MOST_DIRECTIONS = 4
_COIL = 0.17  # length of a coil over the size of the mechanism


def figures(study: Study, result: Result) -> Gallery:
    """``springs`` (first pose), ``directions`` (a few poses), and over many poses ``stiffness``, curves or a map."""
    found = Gallery()
    drawn, poses = result.drawn, result.drawn["poses"]
    if "first" in drawn:
        found.add("springs", _springs, study, poses, drawn["first"])
        found.add("deflections", deflections, study, poses, drawn["first"])
    if "loose" in drawn:
        found.add("free", free_motion, study, result, drawn["loose"])
    found.add("directions", _directions, study, result)
    if not poses.listed and poses.count > 2:
        over = plane(study, poses, study.stiffness)
        if over is not None:
            found.add("stiffness", _map, study, result, over)
        if len(poses.grid) == 1:
            found.add("stiffness", _curves, study, result)
    return found


def _springs(study: Study, poses: Poses, drawn: Drawn) -> Figure | None:
    scene = pose(study.mechanism, drawn.configuration)
    coils = _coils(study, drawn, scene) if scene is not None else []
    if scene is None or not coils:
        return None
    places = np.concatenate([[*scene.points.values()], *([coil.place, coil.anchor] for coil in coils)])
    figure, axes = posed(study, poses, drawn, places, "equivalent springs", labels=False, drives=False)
    draw_coils(axes, coils)
    points = [label for label in name_labels(scene, link_colors(study.mechanism), (), style.INK) if not label.italic]
    place_labels(axes, coil_labels(coils) + points, covered(axes), order=8)
    return figure


def _coils(study: Study, drawn: Drawn, scene: Scene) -> list[Coil]:
    legs, length = drawn.body.legs or (), _COIL * scene.span
    coils = []
    own = drawn.springs
    for k, place, angle, stiffness in zip(
        own.leg.tolist(), own.place.tolist(), own.angle.tolist(), own.stiffness.tolist(), strict=True
    ):
        if np.isnan(angle):
            continue
        leg, along = legs[k], complex(np.exp(1j * angle))
        base, tip = scene.points[leg.base], scene.points[leg.tip]
        inward = ((base - place) * along.conjugate()).real
        grounded = abs(inward) > length and abs(base - place - inward * along) < 1e-6 * scene.span
        if grounded:
            anchor = base
        else:
            # Its line passes the leg's base: away from the body.
            body = scene.points[drawn.body.section.at]
            anchor = place + 1.4 * length * (along if ((place - body) * along.conjugate()).real > 0 else -along)
        text = quantity(stiffness, study.units.label("stiffness"))
        coils.append(Coil(text, place, anchor, tip, length, grounded))
    return coils


def _directions(study: Study, result: Result) -> Figure | None:
    """Stiffness to a force, over the direction of the force, with its principal values marked."""
    table, soft = result.tables["stiffness"], result.tables["compliance"]
    known = np.flatnonzero(np.isfinite(soft["C11"]) & np.isfinite(table["k_max"]))
    if not len(known):
        return None
    rows = known[np.unique(np.linspace(0, len(known) - 1, MOST_DIRECTIONS).astype(int))]
    unit, poses, factor = study.units.label("stiffness"), result.drawn["poses"], study.units.angle_factor
    figure = style.new_figure(4.2)
    axes = figure.add_subplot()
    for k, row in enumerate(rows):
        color, angle = style.PALETTE[k], float(table["k_angle"][row])
        # A sharp peak lies between the points of an even grid: the principal directions are among them.
        turns = np.sort(
            np.append(np.linspace(0, np.pi, 721), np.mod([angle * factor, angle * factor + np.pi / 2], np.pi))
        )
        xx, xy, yy = (float(soft[name][row]) for name in ("C11", "C12", "C22"))
        moved = xx * np.cos(turns) ** 2 + 2 * xy * np.cos(turns) * np.sin(turns) + yy * np.sin(turns) ** 2
        axes.plot(turns / factor, 1 / moved, color=color, label=pose_in_words(study, poses, int(row)))
        softest = np.mod(angle + np.pi / 2 / factor, np.pi / factor)
        axes.plot([angle, softest], [table["k_max"][row], table["k_min"][row]], "o", color=color, markersize=5)
    if table["k_max"][rows].max() > 4 * table["k_min"][rows].min():
        axes.set_yscale("log")
    axes.set_xlim(0, np.pi / factor)
    axes.set_xticks(np.linspace(0, np.pi, 7) / factor)
    axes.set_xlabel(style.axis_label("direction of the force", study.units.label("angle")))
    axes.set_ylabel(style.axis_label("stiffness (dots: k_min, k_max)", unit))
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return figure


def _curves(study: Study, result: Result) -> Figure | None:
    """Stiffnesses to a force and to a moment along a path; what is rigid or free everywhere has no curve."""
    table, poses, units = result.tables["stiffness"], result.drawn["poses"], study.units
    over = along(study, poses)
    assert over is not None
    forces = {"k_x": ("-", None), "k_y": ("-", None), "k_min": ("--", style.INK), "k_max": (":", style.INK)}
    panels = [
        (about, kind, looks)
        for about, kind, looks in (
            ("stiffness to a force", "stiffness", forces),
            ("to a moment", "rotational_stiffness", {"k_phi": ("-", style.GREEN)}),
        )
        if any(name in table and np.isfinite(table[name]).any() for name in looks)
    ]
    if not panels:
        return None
    figure = style.new_figure(5.2 if len(panels) > 1 else 3.4)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (about, kind, looks) in zip(axes, panels, strict=True):
        for name, (look, color) in looks.items():
            values = np.where(np.isfinite(table[name]), table[name], np.nan)
            axis.plot(over.values, values, look, label=name, color=color)
        axis.set_ylabel(style.axis_label(about, units.label(kind)))
        axis.set_yscale("log")
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes[-1].set_xlabel(over.label)
    figure.align_ylabels(axes)
    return figure


def _map(study: Study, result: Result, over: Plane) -> Figure:
    """k_min over the poses, and k_max beside it."""
    table, unit = result.tables["stiffness"], study.units.label("stiffness")
    parts = []
    for name in ("k_min", "k_max"):
        values = np.where(np.isfinite(table[name]) & (table[name] > 0), table[name], np.nan)
        parts.append((style.axis_label(name, unit), values.reshape(over.x.shape)))
    about = f"at point {study.stiffness.at}" if study.stiffness is not None else ""
    return map_sheet(study, over, parts, "Stiffness to a force in the softest and the stiffest direction", about,
                     logarithmic=True)  # fmt: skip
