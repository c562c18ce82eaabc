"""Where the beams of an elastic link run, and where on them a point of the link or a slide sits.

A link given by its ends is one beam from the first to the second; its other points are brackets, rigid from their foot
on the beam, beyond an end from that end. A link given by its points alone is beams along them in the order listed. What
slides on an elastic link rides on these beams at the foot of its current place, the nearest of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechdesign.mechanism import Configuration
from mechdesign.mechanism.model import Link
from mechdesign.numerics.arrays import Complexes, Floats

# Of beams that come equally near to a slide, but for this share of the link's length, it rides on the first listed.
NEAREST = 1e-9


@dataclass(frozen=True)
class Beams:
    """The points between which the beams of a link run; a telescopic one has a direction however short it is."""

    link: str
    corners: tuple[str, ...]
    telescopic: bool


def beams_of(link: Link) -> Beams:
    """The beams of an elastic link; a telescopic one is a single beam of its current length."""
    return Beams(link.name, link.ends or tuple(link.points), link.telescopic)


@dataclass(frozen=True, eq=False)
class Course:
    """The beams of one link in n poses, one after another; distances are counted along them from the first corner.

    Parameters
    ----------
    names : tuple of str
        Points at the corners.
    corners : complex ndarray, shape (corners, n)
    along : complex ndarray, shape (corners - 1, n)
        Unit vectors of the beams.
    starts : ndarray, shape (corners, n)
        Distances of the corners.
    """

    names: tuple[str, ...]
    corners: Complexes
    along: Complexes
    starts: Floats

    def foot(self, point: str, place: Complexes) -> Floats:
        """Distance, shape (n,), at which a point that is at `place` is borne: a corner by itself."""
        if point in self.names:
            return np.asarray(self.starts[self.names.index(point)])
        lengths = np.diff(self.starts, axis=0)
        if not len(lengths):
            return np.zeros(place.shape)
        ahead = np.clip(np.real((place - self.corners[:-1]) * self.along.conj()), 0.0, lengths)
        away = np.abs(place - self.corners[:-1] - ahead * self.along)
        near = np.argmax(away <= away.min(axis=0) + NEAREST * self.starts[-1], axis=0)[None]
        return np.asarray(np.take_along_axis(self.starts[:-1] + ahead, near, axis=0)[0])

    def place(self, distance: Floats) -> Complexes:
        """The place, shape (n,), at a distance along the beams."""
        if not len(self.along):
            return np.asarray(self.corners[0])
        last = np.minimum(np.sum(self.starts[1:] < distance, axis=0), len(self.along) - 1)[None]
        start, corner, along = (np.take_along_axis(v, last, axis=0)[0] for v in (self.starts, self.corners, self.along))
        return np.asarray(corner + (distance - start) * along)

    def between(self, low: Floats, high: Floats) -> Iterator[tuple[Complexes, Complexes, Floats]]:
        """Middle, direction and length of each straight piece between two distances; none that is empty everywhere."""
        for corner, along, (start, end) in zip(self.corners, self.along, pairwise(self.starts), strict=False):
            first, last = np.clip(low, start, end), np.clip(high, start, end)
            if (first != last).any():
                yield corner + ((first + last) / 2 - start) * along, along, last - first


def course_of(beams: Beams, configuration: Configuration) -> Course:
    """The beams of a link in any batch of poses."""
    corners = np.array([configuration.point(name) for name in beams.corners])
    spans = np.diff(corners, axis=0)
    lengths = np.abs(spans)
    if beams.telescopic:
        along = configuration.rotation(beams.link)[None]
    else:
        along = np.divide(spans, lengths, out=np.ones(spans.shape, dtype=complex), where=lengths > 0)
    starts = np.concatenate([np.zeros((1, *corners.shape[1:])), np.cumsum(lengths, axis=0)])
    return Course(beams.corners, corners, along, starts)
