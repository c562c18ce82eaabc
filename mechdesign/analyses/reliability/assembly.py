"""The forward plan in the assembly of a given configuration, however that was found."""

from __future__ import annotations

import numpy as np

from mechdesign.mechanism import Configuration, Mechanism
from mechdesign.mechanism.algebra import Value
from mechdesign.mechanism.plan import Plan


def forward_plan(mechanism: Mechanism, configuration: Configuration) -> Plan:
    """The drives' plan with the assembly modes of a single solved pose.

    A pose given by outputs is solved with the inverse problem's modes, and may lie in another assembly of the drives
    than the sketch. Groups are tried in order, each in both modes, since a group depends on those before it only.
    """
    forward = mechanism.forward
    drives = [configuration.value(mechanism.coordinate(name)) for name in mechanism.drives]
    modes = list(forward.modes)
    for index, group in enumerate(forward.structure.groups):
        if not modes[index]:
            continue
        errors = []
        for mode in (forward.modes[index], -forward.modes[index]):
            modes[index] = mode
            plan = Plan(mechanism, forward.structure, modes)
            found = plan.solve(drives, start=configuration, limits=False)
            errors.append(_mismatch(found, configuration, group.angles, group.slides))
        modes[index] = forward.modes[index] * (-1 if errors[1] < errors[0] else 1)
    if tuple(modes) == forward.modes:
        return forward
    return Plan(mechanism, forward.structure, modes)


def _mismatch(a: Configuration, b: Configuration, angles: tuple[int, ...], slides: tuple[int, ...]) -> float:
    pairs: list[tuple[Value, Value]] = [(a.rotations[k], b.rotations[k]) for k in angles]
    pairs += [(a.slides[k], b.slides[k]) for k in slides]
    size = float(sum(abs(x - y) for x, y in pairs))
    return size if np.isfinite(size) else np.inf
