"""What the joints bear over a motion, and polar diagrams of their forces, by which bearings are laid out."""

from __future__ import annotations

import numpy as np

from mechdesign.drawing.joints import MAX_JOINTS, JointLoad, joint_curves, joint_hodographs
from mechdesign.drawing.marks import Picture
from mechdesign.drawing.pictures import picture
from mechdesign.ground.numerics.arrays import Complexes
from mechdesign.questions.dynamics.figures.view import DynamicsView

HEADING = "Forces in the joints"


@picture(DynamicsView, "joint_forces", order=30)
def joint_forces_picture(view: DynamicsView) -> Picture | None:
    """Sizes of the joints' forces, and their moments, over a motion; None where no joint bears anything."""
    forces, moments = view.joints
    if view.swept is None or not forces:
        return None
    kinds = {"force": forces[:MAX_JOINTS], "moment": moments[:MAX_JOINTS]}
    return joint_curves(view.study, HEADING, kinds, [""], view.swept, cut=view.singular)


@picture(DynamicsView, "bearings", order=40)
def bearings_picture(view: DynamicsView) -> Picture | None:
    """The way of each joint's force in the axes of the frame, and beside it in those of the link that it acts on."""
    forces, _ = view.joints
    if view.swept is None or not forces:
        return None
    shown = view.drawn.shown
    both = [
        JointLoad(joint.name, joint.words, np.stack([frame, frame * np.conj(_turns(view, joint))], axis=1))
        for joint in forces[:MAX_JOINTS]
        for frame in [joint.values[shown.rows, 0]]
    ]
    titles = ["in the axes of the frame", "in the axes of the link that it acts on"]
    return joint_hodographs(view.study, both, titles, view.swept, cut=view.singular)


def _turns(view: DynamicsView, joint: JointLoad) -> Complexes:
    """Unit vector of the x axis of the link on which a force acts; of a pin's that of the link that acts."""
    _, on, _, by = joint.words.split(" ")
    configuration = view.drawn.shown.configuration
    body = on if on in configuration.graph.bodies else by
    return np.broadcast_to(np.asarray(configuration.body_rotation(body), dtype=complex), configuration.shape)
