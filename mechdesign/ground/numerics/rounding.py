"""What is zero: rounding of numbers that cancel."""

from __future__ import annotations

import numpy as np

from mechdesign.ground.numerics.arrays import Flags, Floats

# Numbers below this part of the size of what they are made of are rounding.
STILL = 1e-12


def cleared(values: Floats, still: Floats | float) -> Floats:
    """Values, and 0 for those up to `still`, which is `STILL` of a size; the shapes broadcast."""
    return np.where(np.abs(values) <= still, 0.0, values)


def unchanging(low: Floats | float, high: Floats | float, size: Floats | float = 0.0) -> Flags:
    """Whether values between these ends are the same up to `STILL` of theirs, or of a size: they have no extreme."""
    still = STILL * np.maximum(np.maximum(np.abs(low), np.abs(high)), size)
    return np.asarray(np.isfinite(still) & (high - low <= still))


def larger(low: Floats, high: Floats, low_at: Floats, high_at: Floats, still: Floats | float) -> Flags:
    """Whether the largest absolute value is `high` and not `low`; of equal ones the first along the motion."""
    equal = np.abs(high + low) <= still
    return np.where(equal & np.isfinite(low_at) & np.isfinite(high_at), high_at <= low_at, high >= -low)
