"""All assembly modes of a mechanism: every way in which its groups can be put together from given coordinates."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from mechdesign.ground.errors import MechanismError
from mechdesign.mechanism.algebra import Value, largest, wrap
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.plan import Plan
from mechdesign.mechanism.sketch import SKETCH, deciding_joints

# Largest number of assemblies.
MAX_ASSEMBLIES = 256
_TOO_MANY = f"more than {MAX_ASSEMBLIES} assembly modes; leave --all-modes out, or write assembly: same"
# Newton's method finds the assemblies of a group without a closed form from this many starts, in this many steps.
SEARCH_STARTS = 512
SEARCH_STEPS = 40
# Solutions nearer than this (radians, or parts of the mechanism's size) are the same.
SAME_ASSEMBLY = 1e-6


@dataclass(frozen=True, eq=False)
class Assembly:
    """One assembly mode: a mechanism whose plan keeps it, and whether it is the sketch's.

    The label names the deciding joint of each group and its side (``B+ F-``); others are numbered.
    """

    label: str
    mechanism: Mechanism
    drawn: bool


def assemblies(
    mechanism: Mechanism, given: tuple[str, ...], choosing: Sequence[int] | None = None
) -> tuple[Assembly, ...]:  # fmt: skip
    """Every assembly mode of the plan of given coordinates, the sketch's first.

    Groups with a closed form, of which only those `choosing` may differ from the sketch's if these are given, have two
    modes each, whether or not they close at the sketch. For a group without one, Newton's method searches from many
    starts at the sketch's values of the given coordinates; it may miss some.

    Raises
    ------
    MechanismError
        If there are more than 256, or the coordinates do not determine the mechanism.
    """
    plan = mechanism.plan(given)
    choosing = [index for index, mode in enumerate(plan.modes) if mode] if choosing is None else choosing
    if 2 ** len(choosing) > MAX_ASSEMBLIES:
        raise MechanismError(f"{len(choosing)} joints choose the assembly: {_TOO_MANY}", SKETCH)
    listed: list[Assembly] = []
    for signs in product((1, -1), repeat=len(choosing)):
        modes = list(plan.modes)
        for index, sign in zip(choosing, signs, strict=True):
            modes[index] *= sign
        names = [
            f"{deciding_joints(mechanism.graph, plan.structure.groups[index])[0]}{modes[index]:+d}"[:-1]
            for index in choosing
        ]
        drawn = modes == list(plan.modes)
        if not plan.iterative:
            listed.append(Assembly(" ".join(names) or "only", _variant(mechanism, plan, modes, None), drawn))
            continue
        for number, configuration in enumerate(_solutions(plan, modes, drawn), 1):
            label = " ".join([*names, f"#{number}"])
            listed.append(Assembly(label, _variant(mechanism, plan, modes, configuration), drawn and number == 1))
            if len(listed) > MAX_ASSEMBLIES:
                raise MechanismError(_TOO_MANY, SKETCH)
    return tuple(listed)


def _variant(
    mechanism: Mechanism, plan: Plan, modes: Sequence[int], configuration: Configuration | None
) -> Mechanism:  # fmt: skip
    other = copy.copy(mechanism)
    mine = Plan(other, plan.structure, modes)
    key = tuple(coordinate.name for coordinate in plan.structure.given)
    other.adopt(key, mine)
    if configuration is not None:
        other.sketch_configuration = configuration
    elif modes != list(plan.modes):
        given = [mechanism.sketch_configuration.value(coordinate) for coordinate in plan.structure.given]
        there = mine.solve(given, limits=False)
        if there.valid:
            other.sketch_configuration = there
    return other


def _solutions(plan: Plan, modes: Sequence[int], drawn: bool) -> list[Configuration]:
    """Assembled poses at the sketch's values for given modes of the closed forms; the sketch first if `drawn`."""
    sketch = plan.core.sketch_configuration
    given = [np.asarray(sketch.value(coordinate), dtype=float) for coordinate in plan.structure.given]
    random = np.random.default_rng(0)
    size = plan.core.size
    guess: list[Value] = []
    for group in (plan.structure.groups[index] for index in plan.structure.unknowns):
        guess += [random.uniform(-np.pi, np.pi, SEARCH_STARTS) for _ in group.angles]
        guess += [
            random.uniform(-2 * size, 2 * size, SEARCH_STARTS) for _ in (*group.slides, *group.bases, *group.bases)
        ]
    state = plan.run(given, plan.core.geometry.nominal, guess, modes, SEARCH_STEPS)
    every = plan.configuration(state, (SEARCH_STARTS,), {}, state.solved((SEARCH_STARTS,)))
    good = every.valid
    for slide in plan.core.graph.telescopic:
        # A leg of length zero closes at any angle, and is no assembly.
        good = good & (np.asarray(every.slides[slide]) > SAME_ASSEMBLY * size)
    solutions = [sketch] if drawn else []
    for lane in np.flatnonzero(good):
        one = every.take(int(lane))
        if not any(_same(one, other, size) for other in solutions):
            solutions.append(one)
    return solutions


def _same(one: Configuration, other: Configuration, size: float) -> bool:
    turns = [wrap(np.angle(a) - np.angle(b)) for a, b in zip(one.rotations, other.rotations, strict=True)]
    shifts = [(a - b) / size for a, b in zip(one.slides, other.slides, strict=True)]
    return bool(np.all(largest([*turns, *shifts]) < SAME_ASSEMBLY))
