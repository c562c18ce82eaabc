"""How precise a probability is wanted."""

from __future__ import annotations

from dataclasses import dataclass

# Of all intervals.
CONFIDENCE = 0.997
# Half the width of such an interval in standard errors.
WIDTH = 2.97


@dataclass(frozen=True)
class Precision:
    """How wide the 99.7 % interval may be.

    Parameters
    ----------
    relative : float or None
        Coefficient of variation: the standard error as a fraction of the probability of failure. Half the interval is
        about three times that.
    half_width : float or None
        Half the interval itself.
    """

    relative: float | None
    half_width: float | None

    def _half(self, value: float) -> float:
        return self.half_width if self.half_width is not None else WIDTH * (self.relative or 0.0) * value

    def reached(self, value: float, low: float, high: float) -> bool:
        """Whether an interval is narrow enough."""
        return 0.5 * (high - low) <= self._half(value)

    def needed(self, value: float, variance: float) -> float:
        """Samples that reach it, from the value and the variance of one sample."""
        half = self._half(value)
        return WIDTH**2 * variance / half**2 if half > 0 else float("inf")
