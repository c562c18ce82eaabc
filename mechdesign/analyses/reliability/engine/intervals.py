"""Intervals of estimated probabilities at 99.7 %: three standard deviations of a normal estimate [S2, eq. 15]."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtri, stdtrit

Floats = NDArray[np.float64]

CONFIDENCE = 0.997


def binomial(events: int, samples: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Clopper-Pearson interval of the probability of an event that was seen `events` times in `samples`."""
    if samples == 0:
        return float("nan"), float("nan")
    tail = 0.5 * (1.0 - confidence)
    low = betaincinv(events, samples - events + 1, tail) if events else 0.0
    high = betaincinv(events + 1, samples - events, 1.0 - tail) if events < samples else 1.0
    return float(low), float(high)


def weighted(total: float, squares: float, samples: int) -> tuple[float, float]:
    """Interval of the mean of positive weights, many of them zero, from their sum and sum of squares.

    Of the logarithm, since such means are skewed: it reaches farther up than down.
    """
    mean = total / samples
    if mean <= 0:
        return 0.0, 1.0
    variance = max(squares / samples - mean * mean, 0.0) / max(samples - 1, 1)
    spread = float(-ndtri(0.5 * (1.0 - CONFIDENCE))) * np.sqrt(variance) / mean
    return float(mean * np.exp(-spread)), float(min(mean * np.exp(spread), 1.0))


def replicated(means: Floats) -> tuple[float, float]:
    """Student's interval of the mean of independent estimates."""
    count = len(means)
    half = -stdtrit(count - 1, 0.5 * (1.0 - CONFIDENCE)) * float(np.std(means, ddof=1)) / np.sqrt(count)
    mean = float(np.mean(means))
    return max(mean - float(half), 0.0), min(mean + float(half), 1.0)


def simulation_error(failure: float, samples: int) -> float:
    """Error of a simulated reliability at 99.7 %, three standard errors [S2, eq. 16]."""
    return 3.0 * float(np.sqrt(failure * (1.0 - failure) / samples))
