"""What a reliability section asks: outputs by order, and the limits on their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.analyses.kinematics.motion import default_outputs
from mechdesign.analyses.poses import expand_outputs, radians
from mechdesign.analyses.reliability.laws import taken
from mechdesign.cautions import Caution
from mechdesign.errors import MechanismError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.study import Study
from mechdesign.study.schema.limits import SUFFIXES, split_order
from mechdesign.study.schema.reliability import ReliabilitySection, links_meant, others
from mechdesign.study.text import fields


@dataclass(frozen=True)
class Channel:
    """One quantity whose error is asked: a coordinate, or its velocity or acceleration (`order` 0, 1, 2)."""

    coordinate: Coordinate
    order: int

    @property
    def name(self) -> str:
        """As a study's limits name it: ``P.x``, ``P.x_velocity``."""
        return self.coordinate.name + SUFFIXES[self.order]


@dataclass(frozen=True)
class Band:
    """Error number `output` within [low, high]; either may be infinite, and both may be of many poses.

    Where it is `absolute` they limit the value itself.
    """

    output: int
    low: Any
    high: Any
    absolute: bool = False


@dataclass(frozen=True)
class Disc:
    """Errors number `x` and `y` within a circle about zero; its radius may be of many poses."""

    x: int
    y: int
    radius: Any


@dataclass(frozen=True, eq=False)
class ReliabilityQuestion:
    """Channels (outputs order by order, all positions first), and the limits on their errors.

    `pair` are the two limited channels, where there are just two; without limits, the two outputs.
    """

    channels: tuple[Channel, ...]
    bands: tuple[Band, ...]
    discs: tuple[Disc, ...]
    pair: tuple[int, int] | None

    @property
    def limited(self) -> bool:
        """Whether a reliability is asked."""
        return bool(self.bands or self.discs)

    def take(self, poses: Sequence[int] | Ints) -> ReliabilityQuestion:
        """The question at some poses, where limits are those of many."""
        bands = tuple(replace(band, low=taken(band.low, poses), high=taken(band.high, poses)) for band in self.bands)
        discs = tuple(replace(disc, radius=taken(disc.radius, poses)) for disc in self.discs)
        return replace(self, bands=bands, discs=discs)

    @property
    def single(self) -> list[ReliabilityQuestion]:
        """The same with one limit at a time, in the order of `kept`."""
        alone = [replace(self, bands=(band,), discs=()) for band in self.bands]
        return alone + [replace(self, bands=(), discs=(disc,)) for disc in self.discs]

    def at(self, nominal: Sequence[Any] | Floats) -> ReliabilityQuestion:
        """The question at poses where the channels have these values: all limits are those of errors.

        Two limits of an angle are those at the turn nearest to its value.
        """
        bands = tuple(self._about(band, nominal[band.output]) if band.absolute else band for band in self.bands)
        return replace(self, bands=bands)

    def _about(self, band: Band, value: Any) -> Band:
        channel, middle = self.channels[band.output], 0.5 * (band.low + band.high)
        if channel.order == 0 and channel.coordinate.quantity == "angle" and np.isfinite(middle).all():
            value = value - TURN * np.round((value - middle) / TURN)
        return Band(band.output, band.low - value, band.high - value)

    @cached_property
    def limited_channels(self) -> list[int]:
        """Channels that have limits."""
        return sorted({b.output for b in self.bands} | {k for d in self.discs for k in (d.x, d.y)})

    @cached_property
    def narrowed(self) -> ReliabilityQuestion:
        """The same with the limited channels alone."""
        place = {channel: k for k, channel in enumerate(self.limited_channels)}
        return ReliabilityQuestion(
            tuple(self.channels[k] for k in self.limited_channels),
            tuple(replace(band, output=place[band.output]) for band in self.bands),
            tuple(replace(disc, x=place[disc.x], y=place[disc.y]) for disc in self.discs),
            None,
        )

    def kept(self, errors: Floats) -> Flags:
        """Which limits (bands, then discs) errors of shape (channels, n) keep, shape (limits, n).

        What is not assembled is nan and keeps none.
        """
        kept = np.ones((len(self.bands) + len(self.discs), errors.shape[1]), dtype=bool)
        with np.errstate(invalid="ignore"):
            for row, band in zip(kept, self.bands, strict=False):
                error = errors[band.output]
                row[:] = (error >= band.low) & (error <= band.high)
            for row, disc in zip(kept[len(self.bands) :], self.discs, strict=True):
                x, y = errors[disc.x], errors[disc.y]
                row[:] = x * x + y * y <= disc.radius * disc.radius
        return kept

    @property
    def _ends(self) -> list[tuple[int, float, float]]:
        """Finite ends of the bands: error, end, and 1 of an upper one, -1 of a lower one."""
        return [(b.output, end, way) for b in self.bands for end, way in ((b.high, 1.0), (b.low, -1.0))
                if np.isfinite(end)]  # fmt: skip

    def margins(self, errors: Floats) -> Floats:
        """How far errors, of shape (channels, n), are from each limit, negative beyond it, shape (limits, n)."""
        found = [way * (end - errors[output]) for output, end, way in self._ends]
        return np.stack([*found, *(disc.radius - np.hypot(errors[disc.x], errors[disc.y]) for disc in self.discs)])

    def margin_slopes(self, errors: Floats, slopes: Floats) -> Floats:
        """Derivatives of the margins, from those of the errors of shape (channels, dimension, n)."""
        found = [-way * slopes[output] for output, _, way in self._ends]
        for disc in self.discs:
            x, y = errors[disc.x], errors[disc.y]
            with np.errstate(invalid="ignore", divide="ignore"):
                found.append((-x * slopes[disc.x] - y * slopes[disc.y]) / np.hypot(x, y))
        return np.stack(found)


def ask(study: Study, section: ReliabilitySection) -> ReliabilityQuestion:
    """Channels and limits of a section, perhaps with the numbers of many poses; limited coordinates are outputs too."""
    mechanism = study.mechanism
    limits = [(*_limited(mechanism, name), limit) for name, limit in section.limits.items()]
    limited = [
        part
        for base, _, limit in limits
        for part in ((f"{base}.x", f"{base}.y") if limit.radius is not None else (base,))
    ]
    names = section.outputs or (() if limited else default_outputs(mechanism))
    outputs = expand_outputs(study, tuple(names))
    known = [output.name for output in outputs]
    outputs += expand_outputs(study, tuple(dict.fromkeys(name for name in limited if name not in known)))
    known = [output.name for output in outputs]
    orders = 3 if section.rates or section.accelerations or section.speed else 1
    bands, discs = [], []
    for base, order, limit in limits:
        begin = order * len(outputs)
        if limit.radius is not None:
            discs.append(Disc(begin + known.index(f"{base}.x"), begin + known.index(f"{base}.y"), limit.radius))
        else:
            low, high = (
                radians(study, mechanism.coordinate(base), value) if value is not None else bound
                for value, bound in zip(limit.ends, (-np.inf, np.inf), strict=True)
            )
            bands.append(Band(begin + known.index(base), low, high, limit.absolute))
    pair: tuple[int, int] | None = None
    if len(bands) == 2 and not discs:
        pair = (bands[0].output, bands[1].output)
    elif len(discs) == 1 and not bands:
        pair = (discs[0].x, discs[0].y)
    elif not limited and len(outputs) == 2:
        pair = (0, 1)
    channels = tuple(Channel(output, order) for order in range(orders) for output in outputs)
    return ReliabilityQuestion(channels, tuple(bands), tuple(discs), pair)


def _limited(mechanism: Mechanism, name: str) -> tuple[str, int]:
    """The coordinate or point of a limit, and the order that is limited."""

    def known(name: str) -> bool:
        try:
            return mechanism.graph.is_point(name) or bool(mechanism.coordinate(name))
        except MechanismError:
            return False

    return split_order(name, known)


def unsaid(study: Study, question: ReliabilityQuestion) -> list[Caution]:
    """A warning for each output whose pin has a clearance, where the study does not say which link's point it is."""
    section: dict[str, Any] = study.resolved["reliability"]
    names = [*fields.as_list(section.get("outputs")), *(section.get("limits") or {})]
    warnings = []
    for point, (link, rest) in others(study.reliability, study.mechanism.graph).items():
        plain = ("", study.mechanism.graph.node(point))
        about = [c.name for c in question.channels if not c.order and plain in c.coordinate.ends]
        named = section["clearances"][point].get("link") or any(_named(str(name), point) for name in names)
        if about and rest and not named:
            warnings.append(Caution(
                "assumed",
                f"{', '.join(about)}: {point} has a clearance and is that of {' and '.join(rest)}, not of {link}, "
                f"in which the pin moves; say so by {rest[0]}.{point}, or give reliability.clearances.{point} a 'link'",
            ))  # fmt: skip
    return warnings


def _named(name: str, point: str) -> bool:
    rest = name.partition(".")[2]
    return rest == point or rest.startswith((f"{point}.", f"{point}_"))


def holders(study: Study, coordinate: Coordinate) -> str:
    """The links whose points a coordinate is about, as far as their pins have clearances or give."""
    graph = study.mechanism.graph
    names = [
        link or " ".join(links)
        for point, links in links_meant(study.reliability, study.stiffness, graph).items()
        for link, node in coordinate.ends
        if node == graph.node(point)
    ]
    return " ".join(dict.fromkeys(names))
