"""The cams of a mechanism's couplings, each with the one motion of its follower."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.mechanism.algebra import dot
from mechdesign.mechanism.cams import UNMOVED, CamFollower
from mechdesign.mechanism.coordinates import Coordinate, Coupled
from mechdesign.mechanism.derivatives import Linearization
from mechdesign.mechanism.graph import turns_of
from mechdesign.mechanism.outputs import first
from mechdesign.mechanism.plan import Plan


def cams(
    couplings: Sequence[Coupled], forward: Plan, plan: Callable[[Sequence[str]], Plan]
) -> list[CamFollower]:  # fmt: skip
    """The cams of couplings.

    Raises
    ------
    MechanismError
        If the coordinate that a cam follows cannot take the place of a drive, or the follower has no one motion against
        the cam.
    """
    core, listed = forward.core, []
    graph = core.graph
    for index, coupling in enumerate(couplings):
        given = core.description.couplings[coupling.name].cam
        if given is None:
            continue
        followed = next(part for part in coupling.function.parts if part.kind != "parameter")
        point = given.face.through or ""
        follower = graph.holder(given.face.link, point)
        whole = _plan_with(followed, [c.name for c in forward.structure.given], plan, coupling.name)
        cam = CamFollower(
            coupling.name, index, given, followed, coupling.follower, (follower, given.link), graph.nodes.index(point),
            graph.bases[given.link], turns_of(given.face), forward, whole,
        )  # fmt: skip
        _check_follower(cam)
        listed.append(cam)
    return listed


def _plan_with(followed: Coordinate, drives: Sequence[str], plan: Callable[[Sequence[str]], Plan], name: str) -> Plan:
    """The plan of the drives, the coordinate that is followed in place of one of them."""
    if followed.name in drives:
        return plan(drives)
    for others in list(combinations(drives, len(drives) - 1))[::-1]:
        try:
            return plan((followed.name, *others))
        except MechanismError:
            continue
    message = f"no drive moves '{followed.name}', which the cam of coupling '{name}' follows"
    raise MechanismError(message, f"mechanism.couplings.{name}.cam")


def _check_follower(cam: CamFollower) -> None:
    """The follower moves against the cam by the one coordinate alone, and the cam can push it."""
    core = cam.forward.core
    drawn, size = core.sketch_configuration, core.size
    linear = Linearization(cam.forward.structure, core.geometry, drawn)
    slopes = [float(first(drawn, cam.followed, rates)) for rates in linear.by_drives]
    largest = max(range(len(slopes)), key=lambda k: abs(slopes[k]))
    if slopes[largest] == 0:
        return
    place, where = drawn.nodes[cam.node], f"mechanism.couplings.{cam.coupling}.cam"
    for k, slope in enumerate(slopes):
        if k == largest:
            continue
        rates = [0.0] * len(slopes)
        rates[k], rates[largest] = 1.0, -slope / slopes[largest]
        velocity = linear.velocity(rates)
        turned = [velocity.angles[core.graph.bodies[body][0]] for body in cam.links]
        moved = np.abs(cam.against(velocity, place, drawn)) / size
        if max(float(moved), abs(float(turned[0] - turned[1]))) > UNMOVED:
            drive = cam.forward.structure.given[k].name
            raise MechanismError(
                f"drive '{drive}' moves the follower against the cam too, not '{cam.followed.name}' alone: the cam has "
                "no one profile",
                where,
            )
    velocity = cam.driven(linear)
    point = core.graph.nodes[cam.node]
    if cam.flat:
        along = cam.along_face(drawn)
        pushed = max(float(np.abs(dot(1j * along, cam.own(linear, velocity, place + s * along)))) for s in (0.0, size))
        mistake = (
            f"moves the flat face at '{point}' along itself or not at all, so that the cam cannot push it: give "
            "another direction, or a point of the link that moves"
        )
    else:
        pushed = float(np.abs(cam.own(linear, velocity, place)))
        mistake = f"does not move the roller at '{point}' against the cam: give a point of the link that it moves"
    if pushed <= UNMOVED * (size if cam.follower.quantity == "angle" else 1.0):
        raise MechanismError(f"'{cam.follower.name}' {mistake}", where)
