"""The assemblies of a study in the hand: the next one, by places in its sketch."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechdesign.door.live.altered import SKETCH, altered
from mechdesign.ground.errors import MechdesignError, StudyError
from mechdesign.mechanism.assemblies import assemblies
from mechdesign.mechanism.configuration import Configuration
from mechdesign.study import Study

_DIGITS = 5  # of places in a sketch from which nothing is measured
_ALIKE = 1e-9  # part of the mechanism's size within which a point stays where it is drawn


def next_assembly(study: Study, changes: Mapping[str, float]) -> tuple[dict[str, float], str]:
    """Changes by which the sketch shows the next of the study's assemblies, and which one that is, in words.

    Raises
    ------
    StudyError
        If there is no other that can be assembled where the study is drawn.
    MechanismError
        If there are too many.
    """
    now = altered(study, changes)
    mechanism, measured = now.mechanism, bool(study.parameters.measured)
    every = sorted(assemblies(mechanism, mechanism.drives), key=lambda one: one.label)
    begin = next(k for k, one in enumerate(every) if one.drawn)
    given = [np.ravel(mechanism.sketch_configuration.value(mechanism.coordinate(name))) for name in mechanism.drives]
    rest = {name: value for name, value in changes.items() if not name.startswith(SKETCH)}
    for one in (every[(begin + k) % len(every)] for k in range(1, len(every))):
        there = one.mechanism.forward.solve(given, {})
        if not there.valid.all():
            continue
        new = {**rest, **_drawn(study, there, mechanism.size, exact=measured)}
        if not measured and study.mechanism.forward.modes == one.mechanism.forward.modes and one.label.find("#") < 0:
            # As it is drawn in the file.
            new = rest
        try:
            altered(study, new)
        except MechdesignError:
            continue
        return new, f"assembly {every.index(one) + 1} of {len(every)}, {one.label}"
    raise StudyError("there is no other assembly where the study is drawn")


def _drawn(study: Study, there: Configuration, size: float, *, exact: bool) -> dict[str, float]:
    """Entries of the sketch that differ in a pose; where nothing is measured they are rounded."""
    digits = _DIGITS - 1 - int(np.floor(np.log10(size)))
    entries = dict[str, float]()
    for point, drawn in study.mechanism.description.sketch.items():
        place = complex(np.ravel(there.point(point))[0])
        if point not in study.resolved["mechanism"]["sketch"] or abs(place - drawn) < _ALIKE * size:
            continue
        for axis, value in enumerate((place.real, place.imag)):
            entries[f"{SKETCH}.{point}.{axis}"] = value if exact else round(value, digits) + 0.0
    return entries
