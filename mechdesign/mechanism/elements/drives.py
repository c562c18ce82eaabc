"""Drives: coordinates of a mechanism that actuators set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from mechdesign.mechanism.elements import declared
from mechdesign.mechanism.elements.declared import Element


@dataclass(frozen=True)
class Drive(Element):
    """A driven coordinate: exactly one of ``angle``, ``length`` and ``slide``."""

    one_of = ("a drive is one of angle: link, length: leg, slide: joint", "angle", "length", "slide")

    angle: declared.LinkName | None = None
    """Link whose angle is driven, from the world's x axis or from the link ``from``. Example: crank"""
    from_: declared.LinkName | None = None
    """Link from whose x axis the angle counts. Left out: the ground, and so the world. Example: upper_arm"""
    length: declared.LinkName | None = None
    """Telescopic link whose length is driven. Example: leg_1"""
    slide: declared.JointName | None = None
    """Joint (slide or slot) whose displacement is driven: from ``through`` along the line. Example: guide"""

    @classmethod
    def faults(cls, given: Any) -> Iterator[str]:
        """Sentences about keys that do not go together."""
        if given.from_ is not None and given.angle is None:
            yield "'from' belongs to an angle"

    @property
    def target(self) -> str:
        """The link, leg or joint whose coordinate is driven."""
        return self.items[0]

    @property
    def reference(self) -> str:
        """The link from which an angle counts."""
        return self.from_ or "ground"
