"""Pictures of what joints bear under static loads along a motion: forces and moments as curves, and hodographs."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.report.figures import style
from mechdesign.report.figures.joints import (
    MAX_JOINTS,
    NOTHING,
    Joint,
    joint_curves,
    joint_hodographs,
    loaded,
    peak,
)
from mechdesign.report.figures.pictures import picture
from mechdesign.results import Table
from mechdesign.study import Study

MAX_LOADS = 3  # each with a panel of forces and one of moments
HEADING = "Static forces in the joints: the load alone, no inertia"


def borne(table: Table, poses: int, reach: float) -> tuple[list[Joint], list[Joint]]:
    """Joints that bear a force, and joints that bear a moment, the most loaded first.

    Parameters
    ----------
    table : Table
        ``forces.csv``.
    reach : float
        Size of the mechanism: what is no more than rounding of the largest force at this arm is no moment.
    """
    loads = int(table["load"].max())
    joints = len(table) // (poses * loads)
    x, y, turning = (table[name].reshape(poses, loads, joints) for name in ("fx", "fy", "mz"))
    names, on, by = (table[name][:joints].tolist() for name in ("joint", "on", "by"))
    forces, moments = [], []
    for k, name in enumerate(names):
        # This is the load itself, at a point of one link.
        if on[k] == "asked" and on.count("asked") == 1:
            continue
        massless = on[k] == "asked" or on[k].startswith(("pin:", "slot:"))
        words = f"on {'the pin' if massless else on[k]} by {by[k]}"
        called = f"{name} ({by[k]})" if names.count(name) > 1 else name
        forces.append(Joint(called, words, x[..., k] + 1j * y[..., k]))
        moments.append(Joint(called, words, turning[..., k]))
    largest = max((force.peak for force in forces), default=0.0)
    return loaded(forces, NOTHING * largest), loaded(moments, NOTHING * max(largest * reach, peak(moments)))


@picture(StiffnessView, "joint_forces", "force_hodographs", order=60)
def joint_force_figures(view: StiffnessView) -> dict[str, Figure] | None:
    """``joint_forces`` over the poses of a motion, and ``force_hodographs``; none where no joint bears anything."""
    study, over = view.study, view.swept
    section = StiffnessSection.of(study)
    if over is None or "forces" not in view.result.tables:
        return None
    forces, moments = borne(view.result.tables["forces"], view.poses.count, study.mechanism.size)
    if not forces:
        return None
    loads = [f"{load_in_words(study, load)} at {section.at}" for load in section.loads[:MAX_LOADS]]
    kinds = {"force": forces[:MAX_JOINTS], "moment": moments[:MAX_JOINTS]}
    return {
        "joint_forces": joint_curves(study, HEADING, kinds, loads, over),
        "force_hodographs": joint_hodographs(study, kinds["force"], loads, over, noun="static force"),
    }


def load_in_words(study: Study, load: Sequence[float]) -> str:
    """``fx = 3 N, mz = 2 N·m``, without what is zero."""
    units = [study.units.label(kind) for kind in ("force", "force", "moment")]
    parts = [
        f"{name} = {value:g} {style.printed(unit)}"
        for name, value, unit in zip(("fx", "fy", "mz"), load, units, strict=False)
        if value
    ]
    return ", ".join(parts) or "no load"
