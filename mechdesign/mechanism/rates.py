"""Derivatives of a configuration, of any kind: in time, by a drive, by a dimension, by an unknown of a group."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mechdesign.mechanism.algebra import Value


@dataclass(frozen=True, eq=False)
class Rates:
    """One derivative of everything: node positions (complex), angles of classes, slides, offsets of bodies.

    Arrays broadcast to the batch, with further leading axes where several derivatives are taken at once.
    """

    nodes: Sequence[Value]
    angles: Sequence[Value]
    slides: Sequence[Value]
    offsets: Mapping[str, Value]
