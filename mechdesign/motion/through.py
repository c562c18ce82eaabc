"""Functions through change points that a motion follows, where the equations lose digits and the motion does not.

Near such a place they are the polynomials through poses farther off, on both sides of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechdesign.ground.numerics.arrays import Floats, Ints
from mechdesign.motion.curve import Curve
from mechdesign.motion.functions import Functions
from mechdesign.motion.series import Evaluate

# Distance of the poses from the change point and from each other (radians, or sizes of the mechanism). Nearer than the
# first of them accelerations have lost more digits than the polynomial leaves out.
STEP = 2e-2
PLACES = np.array([-5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0])
# Weights of the polynomial through them, by the barycentric formula [Berrut and Trefethen, 2004].
_WEIGHTS = 1.0 / np.prod(PLACES[:, None] - PLACES + np.eye(len(PLACES)), axis=1)
# A determinant below this part of its size is zero; places nearer to each other, as a part of the motion, are one.
ZERO = 1e-8


class Through:
    """What `evaluate` gives, the `smooth` ones so through the zeros of a `determinant` along the motions of a curve."""

    def __init__(self, curve: Curve, evaluate: Evaluate, determinant: Evaluate, smooth: Sequence[bool]) -> None:
        self._evaluate, self._span, self._smooth = evaluate, curve.poses.end + 2.0, np.flatnonzero(smooth)
        name, apart = "determinant", ZERO * curve.poses.end
        zeros = Functions(curve, [name], determinant, [1.0], zeros=[name]).zeros([name], ZERO)
        order = np.lexsort((zeros.place, zeros.line))
        line, place = zeros.line[order], zeros.place[order]
        behind, before = (curve.inputs(line, place + side * apart)[1][0] for side in (1.0, -1.0))
        size = 1.0 if curve.plan.structure.given[0].quantity == "angle" else curve.mechanism.size
        step = STEP * size * 2 * apart / np.abs(behind - before)
        # Where the motion rests at a change point no pose lies beside it.
        some = (step < curve.poses.end) & np.append(True, (np.diff(line) > 0) | (np.diff(place) > apart))[: len(line)]
        line, place, step = line[some], place[some], step[some]
        beside = place[:, None] + step[:, None] * PLACES
        values, conditioning = evaluate(np.repeat(line, len(PLACES)), beside.ravel())
        values = np.moveaxis(values[self._smooth].reshape(len(self._smooth), *beside.shape), 0, 1)
        finite = np.isfinite(values).all(axis=(1, 2))
        self._line, self._place, self._step, self._values = line[finite], place[finite], step[finite], values[finite]
        self._conditioning = conditioning.reshape(beside.shape)[finite].min(axis=1, initial=1.0)

    def __call__(self, line: Ints, s: Floats) -> tuple[Floats, Floats]:
        values, conditioning = self._evaluate(line, s)
        if not len(self._line):
            return values, conditioning
        behind = np.searchsorted(self._line * self._span + self._place, line * self._span + s)
        for k in (np.maximum(behind - 1, 0), np.minimum(behind, len(self._line) - 1)):
            near = np.flatnonzero((self._line[k] == line) & (np.abs(s - self._place[k]) < self._step[k]))
            own = k[near]
            parts = _WEIGHTS / ((s[near] - self._place[own]) / self._step[own] - PLACES[:, None]).T
            through = np.einsum("nfp,np->fn", self._values[own], parts) / parts.sum(axis=1)
            values[np.ix_(self._smooth, near)] = through
            conditioning[near] = self._conditioning[own]
        return values, conditioning
