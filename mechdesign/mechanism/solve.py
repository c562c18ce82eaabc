"""Run a compiled structure for a batch: closed forms group by group, Newton's method where a group has none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.mechanism import dyads
from mechdesign.mechanism.algebra import Value, plus
from mechdesign.mechanism.newton import CONVERGED, STEPS, solve_newton
from mechdesign.mechanism.state import State, Unknowns, loop_gap
from mechdesign.mechanism.structure import Group

# Dividing by a vector that has shrunk to nothing gives inf, where Python's own zero would raise.
ZERO = np.float64(0.0)


def run(
    state: State,
    modes: Sequence[Value],
    guess: Unknowns | None = None,
    given: Sequence[Value] = (),
    size: float = 1.0,
    steps: int = STEPS,
    enough: float = CONVERGED,
    begin: int = 0,
) -> State:
    """Solve all groups in order.

    Parameters
    ----------
    modes : sequence
        Assembly mode (+1 or -1) of each group, or an array of one for each pose. Groups that it does not reach are left
        unsolved.
    guess : sequence, optional
        Where Newton's method starts, for the groups without a closed form.
    size, steps, enough
        See `mechdesign.mechanism.newton.solve_newton`.
    begin : int
        First group to solve; those before it are known already.
    """
    for index, (group, mode) in enumerate(zip(state.structure.groups, modes, strict=False)):
        if index < begin:
            continue
        if group.form == "newton":
            assert guess is not None
            solve_newton(state, index, guess[state.structure.unknowns[index]], given, size, steps, enough)
        elif group.form != "place":
            _closed_form(state, group, mode)
        state.place(group)
    return state


def loop_vectors(state: State, group: Group) -> tuple[Value, dict[int, Value], dict[int, Value]]:
    """Around a dyad's loop: the known vector k, and by its unknowns the vectors z that turn and the directions d."""
    structure = state.structure
    loop = group.loops[0]
    k: Value = ZERO if loop.start == loop.end else loop_gap(state, loop.start, loop.end)
    z: dict[int, Value] = dict.fromkeys(group.angles, ZERO)
    d: dict[int, Value] = {}
    for index, sign in loop.edges:
        edge = structure.edges[index]
        root = structure.ties[edge.frame].root
        unknown_slide = edge.slide is not None and edge.slide in group.slides
        arm = state.w[index] if unknown_slide else state.arm(index)
        if root in z:
            arm = arm if isinstance(state.ties[edge.frame], float) else arm * state.ties[edge.frame]
            z[root] = plus(z[root], sign, arm)
            if unknown_slide:
                direction = state.vectors.d[index]
                d[edge.slide or 0] = sign * direction * state.ties[edge.frame]
        else:
            k = plus(k, sign, state.turned(arm, edge.frame))
            if unknown_slide:
                d[edge.slide or 0] = sign * state.turned(state.vectors.d[index], edge.frame)
    return k, z, d


def _closed_form(state: State, group: Group, mode: Value) -> None:
    k, z, d = loop_vectors(state, group)
    if group.form == "two angles":
        first, second = group.angles
        u1, u2, closures = dyads.two_angles(k, z[first], z[second], mode, state.beyond)
        state.turn(first, u1)
        state.turn(second, u2)
    elif group.form == "two slides":
        one, two = group.slides
        state.slides[one], state.slides[two], closures = dyads.two_slides(k, d[one], d[two])
    else:
        solve = dyads.angle_and_fixed_slide if "fixed" in group.form else dyads.angle_and_turning_slide
        (root,), (slide,) = group.angles, group.slides
        u, state.slides[slide], closures = solve(k, z[root], d[slide], mode, state.beyond)
        state.turn(root, u)
    state.closures.extend(closures)
