"""Pictures of what joints bear under static loads along a motion: forces and moments as curves, and hodographs."""

from __future__ import annotations

from collections.abc import Iterator

from mechdesign.drawing.joints import (
    MAX_JOINTS,
    NOTHING,
    JointLoad,
    joint_curves,
    joint_hodographs,
    loaded,
    peak,
)
from mechdesign.drawing.marks import Picture
from mechdesign.drawing.pictures import picture
from mechdesign.ground.expressions import Expression
from mechdesign.ground.numerals import printed
from mechdesign.ground.results import Table
from mechdesign.questions.stiffness.figures.view import StiffnessView
from mechdesign.questions.stiffness.schema import StiffnessSection
from mechdesign.study import Study
from mechdesign.study.schema.loads import Load, Quantity

MAX_LOADS = 3  # each with a panel of forces and one of moments
HEADING = "Static forces in the joints: the load alone, no inertia"


def borne(table: Table, poses: int, reach: float) -> tuple[list[JointLoad], list[JointLoad]]:
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
        forces.append(JointLoad(called, words, x[..., k] + 1j * y[..., k]))
        moments.append(JointLoad(called, words, turning[..., k]))
    largest = max((force.peak for force in forces), default=0.0)
    return loaded(forces, NOTHING * largest), loaded(moments, NOTHING * max(largest * reach, peak(moments)))


@picture(StiffnessView, "joint_forces", "force_hodographs", order=60)
def joint_force_pictures(view: StiffnessView) -> dict[str, Picture] | None:
    """``joint_forces`` over the poses of a motion, and ``force_hodographs``; none where no joint bears anything."""
    study, over = view.study, view.swept
    section = StiffnessSection.of(study)
    if over is None or "forces" not in view.result.tables:
        return None
    forces, moments = borne(view.table("forces"), view.poses.count, study.mechanism.size)
    if not forces:
        return None
    loads = cases_in_words(study)[:MAX_LOADS]
    kinds = {"force": forces[:MAX_JOINTS], "moment": moments[:MAX_JOINTS]}
    heading, noun = ("Forces in the joints", "force") if section.dynamics else (HEADING, "static force")
    return {
        "joint_forces": joint_curves(study, heading, kinds, loads, over),
        "force_hodographs": joint_hodographs(study, kinds["force"], loads, over, noun=noun),
    }


def cases_in_words(study: Study) -> list[str]:
    """``fx = 3 N, mz = 2 N·m at P`` of each load, without what is zero."""
    section = study.stiffness
    assert section is not None
    words = []
    for load in section.loads:
        parts = [
            f"{'f' if load.between else ('fx', 'fy', 'mz')[place]} = {_in_words(study, quantity, kind)}"
            for place, quantity, kind in _numbered(load)
            if isinstance(quantity, Expression) or quantity
        ]
        places = [load.at, *(load.between or ()), load.link if load.at is None else None]
        where = " and ".join(filter(None, places))
        words.append(f"{', '.join(parts) or 'no load'} {'between' if load.between else 'at'} {where}")
    return words + ["what acts in dynamics"] * section.dynamics


def _numbered(load: Load) -> Iterator[tuple[int, Quantity, str]]:
    for keys, quantity, kind in load.numbers:
        yield 2 if kind == "moment" else int(keys[-1]) if load.between is None else 0, quantity, kind


def _in_words(study: Study, quantity: Quantity, kind: str) -> str:
    if isinstance(quantity, Expression):
        return quantity.text
    return f"{quantity:g} {printed(study.units.label(kind))}"
