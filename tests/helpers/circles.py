"""Exact areas of regions between circles, by Green's theorem along their arcs; written without the package."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Centre, inner and outer radius.
Annulus = tuple[complex, float, float]


def crossings(p: complex, r: float, q: complex, s: float) -> list[complex]:
    """Where two circles cross: two places or none."""
    span = q - p
    distance = abs(span)
    if distance == 0 or not abs(r - s) < distance < r + s:
        return []
    along = (distance**2 + r**2 - s**2) / (2 * distance)
    across = 1j * np.sqrt(r**2 - along**2)
    return [p + span / distance * (along + across), p + span / distance * (along - across)]


def common_area(annuli: Sequence[Annulus]) -> float:
    """Area of the intersection of annuli.

    The boundary consists of arcs of their circles: each circle is cut where others cross it; an arc counts where its
    middle lies in all the other annuli, positive on an outer circle and negative on an inner one. Green's theorem,
    2 A = sum of Im(conj(z) dz), is elementary on an arc.
    """
    circles = [(c, r, outer) for c, low, high in annuli for r, outer in ((low, False), (high, True)) if r > 0]
    twice = 0.0
    for k, (centre, radius, outer) in enumerate(circles):
        places = [z for j, (q, s, _) in enumerate(circles) if j != k for z in crossings(centre, radius, q, s)]
        turns = np.sort(np.angle([z - centre for z in places])) if places else np.array([-np.pi])
        for start, end in zip(turns, [*turns[1:], turns[0] + 2 * np.pi], strict=True):
            middle = centre + radius * np.exp(0.5j * (start + end))
            others = [annulus for annulus in annuli if annulus[0] != centre or radius not in annulus[1:]]
            if all(low <= abs(middle - q) <= high for q, low, high in others):
                a, b = centre + radius * np.exp(1j * start), centre + radius * np.exp(1j * end)
                green = radius**2 * (end - start) + np.imag(np.conj(centre) * (b - a))
                twice += green if outer else -green
    return twice / 2
