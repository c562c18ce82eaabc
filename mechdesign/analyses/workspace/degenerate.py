"""Mechanisms whose every pose is a forward singularity at the held coordinates: nothing there is to be integrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechdesign.analyses.region.field import Field
from mechdesign.analyses.region.panels import BATCH, Effort, find_panels
from mechdesign.analyses.region.rays import Designs, trace
from mechdesign.analyses.workspace.question import Answer, Question, answer
from mechdesign.mechanism.derivatives import regularity
from mechdesign.numerics.arrays import Complexes

# Poses no more regular than this (0 at a singularity, at most 1) are singular but for rounding.
REGULAR = 1e-10


def singular_everywhere(question: Question) -> bool:
    """Whether every pose is a forward singularity, so that determinants are nothing but rounding."""
    field = replace(question.field, same_assembly=False)
    sketch = field.mechanism.sketch_configuration
    drawn = np.array([complex(*(float(sketch.value(c)) for c in field.outputs[:2]))])
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        at_sketch = np.asarray(regularity(field.mechanism.linearize(field.configuration(drawn, {}))))
    if (at_sketch > REGULAR).all():
        return False
    designs = Designs(field, {}, 1, question.about)
    panels = find_panels(designs, question.scan, BATCH)
    if not panels.closes[0]:
        return False
    theta = 0.5 * (panels.low + panels.high)
    none = np.zeros(len(theta), dtype=np.intp)
    found = trace(designs, none, theta, panels.reach[none], BATCH.samples)
    z = question.about + 0.5 * (found.inner + found.outer) * np.exp(1j * theta[found.ray])
    return singular(field, z)


def singular(field: Field, z: Complexes) -> bool:
    """Whether the mechanism is in a forward singularity with its point at each of the places `z`."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        return bool((np.asarray(regularity(field.mechanism.linearize(field.configuration(z, {})))) <= REGULAR).all())


def without_indices(question: Question, effort: Effort) -> Answer:
    """Area and rectangle of a single design that is singular everywhere, in any assembly; nan for its indices."""
    field, kept = replace(question.field, same_assembly=False), ("SUI", "area", "box_area")
    given = answer(replace(question, field=field, indices=(), wanted=kept), {}, 1, effort)
    nothing = {name: np.full(1, np.nan) for name in question.wanted}
    return replace(given, values={**nothing, **given.values}, errors={**nothing, **given.errors})
