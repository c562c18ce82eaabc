"""What errors come from, and what keeping them small costs: bars a source of the variance, and of the tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mechdesign.drawing import style
from mechdesign.drawing.layout import fitting_names, fitting_panels
from mechdesign.drawing.looks import best_probability, followed_in_words, heading
from mechdesign.drawing.marks import Axis, Bars, Dots, Lines, Panel, PanelMark, Picture, Words
from mechdesign.drawing.panels import MAX_PANELS, number
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Floats
from mechdesign.ground.results import Table
from mechdesign.motion.rows import Poses
from mechdesign.questions.poses import pose_in_words
from mechdesign.questions.reliability.figures.view import ErrorsView
from mechdesign.questions.reliability.schema.section import ReliabilitySection
from mechdesign.study import Study

MAX_SOURCES = 16
MIN_SOURCES = 3
MAX_TOLERANCES = 20
MAX_POSE_BARS = 4
# Sobol' indices that differ from the first-order share by more than this part of the variance are marked.
_SAME_SHARE = 0.01
_SHARE = "share, to the first order"
_SOBOL = (("first", "o", "Sobol index, alone"), ("total", "D", "Sobol index, with all interactions"))


@picture(ErrorsView, "contributions", order=50)
def contributions_picture(view: ErrorsView) -> Picture:
    """The contributions at the pose whose samples are shown, or the average."""
    worst = view.drawn.samples.pose if view.drawn.samples is not None else 0
    return contributions(view.study, view.result.tables["contributions"], view.poses, worst)


def contributions(study: Study, table: Table, poses: Poses, worst: int = 0) -> Picture:
    """A panel an output and order: bars of the first-order shares, and marks where Sobol' indices differ from them.

    A bar a pose where a few are listed; else the worst pose with Sobol' indices, or the average over the poses. The
    sources are in one order, the largest of any panel first.
    """
    errors = list(dict.fromkeys(zip(table["output"].tolist(), table["order"].tolist(), strict=True)))
    names, sobol = list(dict.fromkeys(table["source"].tolist())), _sobol_pose(table, poses, worst)
    per_pose = sobol is None and poses.listed and 1 < poses.count <= MAX_POSE_BARS
    bars = poses.count if per_pose else 1
    across = min(3 if len(names) < 9 else 2, fitting_panels("bars", names))
    # Where a page does not hold all panels with a few bars each, the last are left out.
    rows = -(-min(len(errors), MAX_PANELS) // across)
    while rows > 1 and fitting_names(names, rows, bars) < min(MIN_SOURCES, len(names)):
        rows -= 1
    pairs = errors[: min(rows * across, MAX_PANELS)]
    blocks = [table.take(table.where(output=output, order=order)) for output, order in pairs]
    shares = [100.0 * _shares(block["share"].reshape(poses.count, -1), sobol, per_pose) for block in blocks]
    largest = np.max([np.nan_to_num(share).mean(axis=0) for share in shares], axis=0)
    most = int(max(MIN_SOURCES, min(MAX_SOURCES, fitting_names(names, rows, bars))))
    ranked = np.argsort(-largest, kind="stable")[:most]
    where, notes = "" if per_pose else f"average over {poses.count} poses", []
    if sobol is not None or poses.count == 1:
        pose = sobol or 0
        fails_most = pose == worst and bool(ReliabilitySection.of(study).limits)
        where = f"at {(followed_in_words if fails_most else pose_in_words)(study, poses, pose)}"
    if negative := any((share < -1.0).any() for share in shares):
        notes.append("correlated sources make up for each other: negative shares, and others above 100 %")
    if len(pairs) < min(len(errors), MAX_PANELS):
        notes.append(f"the first {len(pairs)} of {len(errors)} errors")
    if len(ranked) < len(names):
        notes.append(f"the {len(ranked)} largest of {len(names)} sources")
    marks = [[] if sobol is None else list(_sobol_marks(block.take(sobol * len(names) + ranked))) for block in blocks]
    apart = any(marks)
    if not per_pose and not apart:
        agree = f"; Sobol indices agree within {100 * _SAME_SHARE:g} % or their intervals" * (sobol is not None)
        notes.append(f"shares to the first order{agree}")
    for own, share in zip(marks, shares, strict=True):
        own[:0] = [
            Bars(values, place, len(share), () if per_pose else [f"{value:.1f}" for value in values],
                 label=pose_in_words(study, poses, place) if per_pose else _SHARE * apart)
            for place, values in enumerate(share[:, ranked])
        ]  # fmt: skip
    axis = Axis("share of the variance", "%", ends=(None if negative else 0.0, None), margin=0.2 if negative else 0.25)
    sources = Axis(words=[names[k] for k in ranked])
    panels = [Panel(own, axis, sources, heading(*pair)) for own, pair in zip(marks, pairs, strict=True)]
    return Picture("Where the variance of the error comes from", panels, (where, "; ".join(notes)), across, "xy")


def _sobol_pose(table: Table, poses: Poses, worst: int) -> int | None:
    """The worst pose if it has Sobol' indices, else the first pose that has."""
    if "sobol_first" not in table:
        return None
    indexed = np.isfinite(table["sobol_first"]).reshape(poses.count, -1).any(axis=1)
    return (worst if indexed[worst] else int(np.argmax(indexed))) if indexed.any() else None


def _shares(shares: Floats, pose: int | None, per_pose: bool) -> Floats:
    """Shares of one pose, of each pose, or averaged over the poses that have them, shape (bars, sources)."""
    if pose is not None or per_pose:
        return shares if pose is None else shares[[pose]]
    complete = shares[np.isfinite(shares).all(axis=1)]
    return complete.mean(axis=0, keepdims=True) if len(complete) else np.zeros((1, shares.shape[1]))


def _sobol_marks(table: Table) -> Iterator[PanelMark]:
    """Marks with intervals where an index differs from the first-order share by more than its interval explains."""
    for kind, marker, words in _SOBOL:
        value, low, high = (table[f"sobol_{kind}{end}"] for end in ("", "_low", "_high"))
        apart = np.abs(value - table["share"]) > np.maximum(_SAME_SHARE, (high - low) / 2)
        if apart.any():
            reach = 100.0 * np.abs(np.stack([low, high]) - value)[:, apart]
            look = {
                "color": style.INK,
                "marker": marker,
                "markersize": 4.5,
                "markerfacecolor": "white",
                "elinewidth": 1.0,
            }
            yield Dots(100.0 * value[apart], np.flatnonzero(apart), along_x=reach, label=words, look=look)


@picture(ErrorsView, "allocation", order=60)
def allocation_picture(view: ErrorsView) -> Picture | None:
    """The tolerances that were allocated, if any were."""
    return allocation(view.study, view.result.tables) if "allocation" in view.result.tables else None


def allocation(study: Study, tables: Mapping[str, Table]) -> Picture:
    """Bars for each source, its tolerance, given and allocated, and its cost; below, how often either fails."""
    section, table = ReliabilitySection.of(study).allocate, tables["allocation"]
    assert section is not None
    total = [float(np.nansum(table[name])) for name in ("cost_given", "cost_allocated")]
    note = f"cost {total[0]:.4g} as given, {total[1]:.4g} allocated ({100 * (total[1] / total[0] - 1):+.1f} %)"
    table = table.take(np.arange(len(table))[:MAX_TOLERANCES])
    sources = Axis(words=[f"{row['source']}" + f" ({row['kind']})" * (row["kind"] != "tolerance") for row in table])
    units, given, allocated = table["unit"].tolist(), table["given"], table["allocated"]
    # Tolerances of several units do not share an axis: their ratios do.
    alike = len(set(units)) == 1
    scale = np.ones(len(table)) if alike else given
    written = [f"{value:.3g}" if alike else f"{value:.3g} {unit}" for value, unit in zip(allocated, units, strict=True)]
    tolerance = Axis("tolerance", units[0], margin=0.2) if alike else Axis("tolerance over the given one", margin=0.3)
    goal, sides = (section.reliability or 0.0), _failures(tables)
    asks, axis = (
        f"allowed: {number(1.0 - goal)}",
        Axis("probability that an error leaves its limits, at the pose that fails most", scale="log", margin=0.1),
    )
    if section.cpk is not None:
        goal, sides = section.cpk, _capabilities(tables)
        asks, axis = f"asked: {number(goal)}", Axis("least Cpk of any limit at any pose", margin=0.1)
    line = Lines([goal if section.cpk is not None else 1.0 - goal], "x", label=asks,
                 look={"color": style.VERMILION, "linestyle": (0, (5, 2)), "linewidth": 1.6})  # fmt: skip
    panels = [
        Panel(_pair(given / scale, allocated / scale, written), tolerance, sources),
        Panel(_pair(table["cost_given"], table["cost_allocated"]), Axis("cost", margin=0.16), sources),
        Panel([*_sides(sides), line], axis, Axis(words=("as given", "allocated"), ends=(1.6, -0.9)), size=0.45),
    ]
    noun = "reliability" if section.cpk is None else "Cpk"
    return Picture(f"Cheapest tolerances for a {noun} of {goal:.10g}", panels, (note,), across=2)


def _failures(tables: Mapping[str, Table]) -> list[list[float]]:
    """How often made mechanisms fail at the worst pose, and the interval, with the tolerances given and allocated."""
    before, after = tables["reliability"], tables["confirmation"]
    before = before.take(before.where(scope="pose", method=best_probability(before)))
    sides = [
        [before[name] for name in ("failure", "failure_low", "failure_high")],
        [1.0 - after[name] for name in ("simulated", "high", "low")],
    ]
    return [[float(part[int(np.argmax(np.nan_to_num(side[0])))]) for part in side] for side in sides]


def _capabilities(tables: Mapping[str, Table]) -> list[list[float]]:
    """The least Cpk of any limit at any pose, and its interval, with the tolerances given and allocated."""
    before, after = tables["capability"], tables["confirmation"]
    given, worst = float(np.nanmin(before["cpk"])), int(np.argmin(after["simulated"]))
    return [[given] * 3, [float(after[name][worst]) for name in ("simulated", "low", "high")]]


def _sides(sides: list[list[float]]) -> Iterator[PanelMark]:
    """Value with its interval of the tolerances given and of those allocated."""
    for place, ((value, low, high), color) in enumerate(zip(sides, (style.FAINT, style.BLUE), strict=True)):
        yield Dots(
            [value], [place], along_x=np.array([[value - low], [high - value]]), look={"color": color, "capsize": 3}
        )
        yield Words(value, place, number(value), (0, 7), look={"ha": "center"})


def _pair(given: Floats, allocated: Floats, written: list[str] | tuple[()] = ()) -> list[PanelMark]:
    """Bars of what was given, hatched, and of what was allocated."""
    grey: dict[str, Any] = {"color": style.FAINT, "hatch": "////"}
    blue: dict[str, Any] = {"color": style.BLUE, "hatch": ""}
    return [
        Bars(given, 0, 2, label="as given", look=grey),
        Bars(allocated, 1, 2, written, label="allocated", look=blue),
    ]
