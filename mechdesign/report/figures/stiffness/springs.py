"""Equivalent springs drawn on a mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mechdesign.numerics.arrays import Complexes
from mechdesign.report.figures import style
from mechdesign.report.figures.labels import Label

_TURNS = 7
_SWING = 0.12  # half the width of a coil over its length
_ORDER = 5.0


@dataclass(frozen=True)
class Coil:
    """A spring from the point where it holds to its anchor.

    Parameters
    ----------
    tip : complex
        End of its leg.
    length : float
        Length of what is coiled, at the middle.
    grounded : bool
        The anchor is a joint of the ground, which the mechanism's drawing shows already.
    """

    text: str
    place: complex
    anchor: complex
    tip: complex
    length: float
    grounded: bool

    @property
    def path(self) -> Complexes:
        """The drawn line."""
        span = self.anchor - self.place
        share = np.linspace(0, 1, 600)
        part = min(0.7, self.length / abs(span))
        inside = np.clip((share - 0.5) / part + 0.5, 0, 1)
        wave = _SWING * self.length * np.sin(2 * np.pi * _TURNS * inside)
        return self.place + span * (share + 1j * wave / abs(span))


def quantity(value: float, unit: str) -> str:
    """A stiffness with three digits: ``3.74e+07 N/m`` as 3.74·10⁷ N/m."""
    if np.isinf(value):
        return "rigid"
    if 1e-2 <= value < 1e5:
        return f"{value:.3g} {unit}" if value < 1e3 else f"{value:.0f} {unit}"
    return f"{style.in_powers(value)} {unit}"


def draw_coils(axes: Axes, coils: Sequence[Coil]) -> None:
    """Coil springs along their lines, each with a hatched anchor, and a dashed line to where the leg ends."""
    for coil in coils:
        if abs(coil.place - coil.tip) > 1e-3 * abs(coil.anchor - coil.place):
            _line(axes, np.array([coil.tip, coil.place]), 1.1, 0.0, linestyle=(0, (4, 3)))
        _line(axes, coil.path, 3.6, 0.05, color="white")
        _line(axes, coil.path, 1.5, 0.1)
        axes.plot(
            [coil.place.real], [coil.place.imag], "o", markersize=5, color=style.VERMILION, markeredgecolor="white",
            zorder=_ORDER + 0.3,
        )  # fmt: skip
        if coil.grounded:
            continue
        along = coil.length * (coil.anchor - coil.place) / abs(coil.anchor - coil.place)
        bar = 0.2j * along
        _line(axes, np.array([coil.anchor - bar, coil.anchor + bar]), 1.6, 0.1)
        for foot in coil.anchor + np.linspace(-1, 1, 6) * bar:
            _line(axes, np.array([foot, foot + (0.1 + 0.07j) * along]), 1.0, 0.1)


def coil_labels(coils: Sequence[Coil]) -> list[Label]:
    """The stiffness of each spring, beside its middle."""
    labels = []
    for coil in coils:
        span = coil.anchor - coil.place
        anchors = tuple(coil.place + share * span for share in (0.5, 0.56, 0.44, 0.62, 0.38))
        heading = float(np.angle(1j * span if (1j * span).real > 0 else -1j * span))
        labels.append(Label(coil.text, anchors, style.VERMILION, 11, heading, 9.5))
    return labels


def _line(axes: Axes, places: Complexes, width: float, lift: float, **look: object) -> None:
    options: dict[str, object] = {
        "color": style.VERMILION,
        "solid_capstyle": "round",
        "solid_joinstyle": "round",
    } | look
    axes.add_line(Line2D(places.real, places.imag, lw=width, zorder=_ORDER + lift, **options))  # type: ignore[arg-type]
