"""Tolerances in standard grades, by looking at every choice, written without the package."""

from __future__ import annotations

import itertools

import numpy as np

# Half a standard tolerance of IT5 to IT12, mm, of sizes above 30 to 50 mm, 50 to 80 mm and 80 to 120 mm [ISO 286-1].
HALVES = {
    40: [5.5e-3, 8e-3, 12.5e-3, 19.5e-3, 31e-3, 50e-3, 80e-3, 125e-3],
    60: [6.5e-3, 9.5e-3, 15e-3, 23e-3, 37e-3, 60e-3, 95e-3, 150e-3],
    100: [7.5e-3, 11e-3, 17.5e-3, 27e-3, 43.5e-3, 70e-3, 110e-3, 175e-3],
}


def cheapest_grades(limit: float, level: float = 3.2905267314919255):
    """Half tolerances of 40, 60 and 100 mm whose sum with 0.02 mm keeps a limit of so many deviations, cheapest."""
    every = np.array(list(itertools.product(*HALVES.values())))
    kept = every[np.sqrt((every**2).sum(axis=1) + 0.02**2) / 3 * level <= limit]
    return kept[np.argmin((np.array([1, 0.7, 2]) / kept).sum(axis=1))]
