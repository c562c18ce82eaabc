"""Linkages drawn with circles that meet, written without the package: places for the crank's angle in radians."""

from __future__ import annotations

import numpy as np

from helpers.gallery import meet, rates

STEPHENSON_PINS = {"A": 7 + 4j, "B": 5 + 16j, "C": 25 + 25j, "D": 23 + 10j, "E": 18 + 35j, "F": 43 + 32j, "G": 45 + 17j}


def stephenson(crank):
    """Points C, E, F of the Stephenson III six-bar."""
    p = STEPHENSON_PINS
    b = p["A"] + abs(p["B"] - p["A"]) * np.exp(1j * crank)
    c = meet(b, abs(p["C"] - p["B"]), p["D"], abs(p["C"] - p["D"]), 1)
    e = b + (p["E"] - p["B"]) / (p["C"] - p["B"]) * (c - b)
    return c, e, meet(e, abs(p["F"] - p["E"]), p["G"], abs(p["F"] - p["G"]), 1)


def stephenson_output(crank):
    """Point F of the Stephenson III six-bar."""
    return stephenson(crank)[2]


def stephenson_inverted(crank):
    """Points C, E, A, D of the Stephenson II six-bar, the same links seen from the output: G stays, F goes back."""
    p = STEPHENSON_PINS
    c, e, f = stephenson(crank)
    turn = (p["F"] - p["G"]) / (f - p["G"])
    return [p["G"] + (place - p["G"]) * turn for place in (c, e, p["A"], p["D"])]


def watt(crank):
    """Point P of the Watt six-bar of the gallery."""
    a, pivot = 25 * np.exp(1j * crank), 80 - 10j
    b = meet(a, 75, pivot, 60, 1)
    e, f = a + (60 + 45j) * (b - a) / 75, pivot + (60 - 50j) * (b - pivot) / 60
    h = meet(e, 70, f, 50, 1)
    return e + (110 + 25j) * (h - e) / 70


def jansen(crank):
    """Foot of Jansen's leg."""
    a, b, c, d, e, f, g, h, i, j, k, low, m = 38, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49, 50, 61.9, 7.8, 15
    pin, frame = m * np.exp(1j * crank), -a - 1j * low
    top = meet(frame, b, pin, j, 1)
    hip = meet(frame, d, top, e, 1)
    knee = meet(frame, c, pin, k, -1)
    ankle = meet(hip, f, knee, g, -1)
    return meet(knee, i, ankle, h, 1)


def klann(crank):
    """Foot of Klann's leg."""
    a = 1.599 + 0.75j + 0.268 * np.exp(1j * crank)
    e = meet(a, 0.59, 1.009 + 0.574j, abs(0.741 - 1.009 + 0.176j), -1)
    k = a + (e - a) * (0.232 + 0.866j - 1.331 - 0.75j) / (0.741 - 1.331)
    h = meet(k, abs(0.634 + 0.634j), 1.366 + 1.366j, abs(0.5 - 0.134j), 1)
    return k + (h - k) * (0 - 0.232 - 0.866j) / (0.634 + 0.634j)


def pumpjack(crank):
    """Travel of the horsehead of the pumping unit of the gallery."""
    saddle = 64 + 75j
    return 72 * np.unwrap(np.angle(saddle - meet(24 * np.exp(1j * crank), 74.5, saddle, 64, 1)))


def geared_five_bar(one):
    """Coupler point of the four-bar that the gallery's geared five-bar repeats, for the coupler's angle (degrees)."""
    turned = np.exp(1j * (np.radians(one) - np.arctan2(50, 35)))
    # Inverted: with the coupler's direction given, A is where |OA| = 100 meets |BC| = 80 moved back by the coupler.
    return meet(0, 100, 40 - 90 * turned, 80, -1) + turned * (35 + 50j)


def toggle(crank, r2=5.0, r3=14.0, r4=27.0, r5=44.0):
    """Height of the slider of S3's toggle mechanism."""
    knee = meet(0, r4, 13.6 + 27j + r2 * np.exp(1j * crank), r3, 1)
    return knee.imag + np.sqrt(r5**2 - knee.real**2)


def toggle_sigma(degrees, speed=5.0, step=1e-3):
    """Standard deviations of its place, velocity and acceleration, of the first order.

    Each link's tolerance is three standard deviations, and its pin adds a ninth of the square of its clearance of 0.1,
    and of a third of its tolerance of 0.1.
    """
    crank, pin = np.radians(degrees), (0.1**2 + (0.1 / 3) ** 2) / 9
    total = np.zeros((3, len(crank)))
    for link, tolerance in enumerate((0.2, 0.2, 0.5, 0.5)):
        slopes = []
        for by in (-2, -1, 1, 2):
            lengths = np.array([5.0, 14.0, 27.0, 44.0])
            lengths[link] += by * step
            first, second = rates(lambda at, links=lengths: toggle(at, *links), crank)
            slopes.append(np.array([toggle(crank, *lengths), speed * first, speed**2 * second]))
        slope = (8 * (slopes[2] - slopes[1]) - (slopes[3] - slopes[0])) / (12 * step)
        total += slope**2 * ((tolerance / 3) ** 2 + pin)
    return np.sqrt(total)
