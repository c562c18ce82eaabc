"""Highest places of the smallest of several functions, of many at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
STEPS = 40
# A summit is met where no more than this (of the functions' size) is to be gained by a model as good as that.
GAIN, MODEL = 2e-15, 1e-8
# A model whose summit is the middle is tried so far beside it (parts of the larger side), nearer each time.
ASIDE = 0.1
GOLDEN = 0.5 * (3 - np.sqrt(5))
# A bracket so narrow (parts of the first) is a place.
NARROW = 1e-14


def summits(
    evaluate: Callable[[Ints, Floats], Floats], places: tuple[Floats, Floats, Floats],
    values: tuple[Floats, Floats, Floats],
) -> tuple[Floats, Floats]:  # fmt: skip
    """Where the smallest of some functions is highest between `a` and `c`, from a place `b` between that is higher.

    Each function is taken for the parabola through its values at the three places, and the smallest of these parabolas
    is climbed: successive parabolas at a smooth summit, and Muller's method where two functions cross.

    Parameters
    ----------
    evaluate : callable
        ``evaluate(lanes, x)``: the functions, shape (functions, lanes); nan where unknown, which is lower than all.
    places : (a, b, c), shape (lanes,)
    values : of shape (functions, lanes)
        The functions there.

    Returns
    -------
    (place, height), shape (lanes,)
    """
    a, b, c = (x.copy() for x in places)
    fa, fb, fc = (f.copy() for f in values)
    left, width = np.arange(len(b)), c - a
    size = np.nanmax(np.abs(fb), axis=0, initial=0.0)
    sound, wide = np.zeros(len(b), dtype=bool), width.copy()
    for step in range(STEPS):
        if not left.size:
            break
        al, bl, cl = a[left], b[left], c[left]
        model = _Model.of(bl, al - bl, cl - bl, fa[:, left], fb[:, left], fc[:, left])
        ahead, top = model.summit()
        here = _lowest(fb[:, left])
        scale = np.maximum(np.abs(model.level).max(axis=0), 1e-3 * size[left])
        met = sound[left] & (top - here <= GAIN * scale) | (cl - al <= NARROW * width[left])
        if met.any():
            left, model = left[~met], model.pick(~met)
            al, bl, cl, ahead, here, scale = (v[~met] for v in (al, bl, cl, ahead, here, scale))
            if not left.size:
                break
        side = np.where(cl - bl > bl - al, cl - bl, al - bl)
        still = np.abs(ahead) <= NARROW * width[left]
        ahead = np.where(still, ASIDE ** (1 + step) * side, ahead)
        lazy = cl - al > 0.5 * wide[left]
        if step % 3 == 2:
            ahead = np.where(lazy & ~still, GOLDEN * side, ahead)
            wide[left] = cl - al
        x = np.clip(bl + ahead, al, cl)
        fx = evaluate(left, x)
        height = _lowest(fx)
        sound[left] = np.abs(height - model.at(x - bl)) <= MODEL * scale
        better, beyond = height > here, x > bl
        old_b, old_fb = bl, fb[:, left]
        low, high = better & beyond, better & ~beyond
        a[left] = np.where(low, old_b, np.where(~better & ~beyond, x, al))
        fa[:, left] = np.where(low, old_fb, np.where(~better & ~beyond, fx, fa[:, left]))
        c[left] = np.where(high, old_b, np.where(~better & beyond, x, cl))
        fc[:, left] = np.where(high, old_fb, np.where(~better & beyond, fx, fc[:, left]))
        b[left], fb[:, left] = np.where(better, x, bl), np.where(better, fx, old_fb)
    return b, _lowest(fb)


def _lowest(f: Floats) -> Floats:
    """The smallest function; far below where one is unknown."""
    return np.asarray(np.where(np.isnan(f), -np.inf, f).min(axis=0))


class _Model:
    """Parabolas level + slope t + bend t^2 on [start, stop] through those functions that are smallest at a place."""

    def __init__(self, level: Floats, slope: Floats, bend: Floats, start: Floats, stop: Floats) -> None:
        self.level, self.slope, self.bend, self.start, self.stop = level, slope, bend, start, stop

    @staticmethod
    def of(b: Floats, da: Floats, dc: Floats, fa: Floats, fb: Floats, fc: Floats) -> _Model:
        lane = np.arange(len(b))
        rows = [np.argmin(np.where(np.isnan(f), np.inf, f), axis=0) for f in (fa, fb, fc)]
        pa, pb, pc = (np.stack([f[row, lane] for row in rows]) for f in (fa, fb, fc))
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            before, after = (pa - pb) / da, (pc - pb) / dc
            bend = (after - before) / (dc - da)
            bend = np.where(np.isfinite(bend), bend, 0.0)
            slope = np.where(np.isfinite(before), before - bend * da, after)
        return _Model(pb, np.where(np.isfinite(slope), slope, 0.0), bend, da, dc)

    def pick(self, use: NDArray[np.bool_]) -> _Model:
        return _Model(self.level[:, use], self.slope[:, use], self.bend[:, use], self.start[use], self.stop[use])

    def at(self, t: Floats) -> Floats:
        """The smallest parabola at `t`, shape (..., lanes)."""
        found = self.level[0] + t * (self.slope[0] + t * self.bend[0])
        for k in range(1, len(self.level)):
            found = np.minimum(found, self.level[k] + t * (self.slope[k] + t * self.bend[k]))
        return np.asarray(found)

    def summit(self) -> tuple[Floats, Floats]:
        """Where the smallest parabola is highest, and how high: at a vertex, a crossing, or the middle."""
        trials = [np.zeros_like(self.start)]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            trials += list(-0.5 * self.slope / self.bend)
            for i, j in ((0, 1), (0, 2), (1, 2)):
                p, q, r = (v[i] - v[j] for v in (self.level, self.slope, self.bend))
                half = -0.5 * (q + np.copysign(np.sqrt(np.maximum(q * q - 4 * p * r, 0.0)), q))
                trials += [half / r, p / half]
        t = np.stack(trials)
        t = np.where((t > self.start) & (t < self.stop), t, 0.0)
        heights = self.at(t)
        best, lane = np.argmax(heights, axis=0), np.arange(len(self.start))
        return t[best, lane], heights[best, lane]
