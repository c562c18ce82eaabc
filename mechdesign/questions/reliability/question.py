"""The channels and limits of a reliability section: outputs by order, and the limits on their errors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.ground.cautions import Caution
from mechdesign.ground.errors import MechanismError
from mechdesign.ground.expressions import Expression
from mechdesign.ground.numerics.arrays import Flags, Floats, Ints
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.motion.rows import Poses
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.reliability.corners import Bend, bends, vector_of
from mechdesign.questions.reliability.forces import argument_name, kinds_of_forces, load_bends
from mechdesign.questions.reliability.limits import ErrorBound, targets_of
from mechdesign.questions.reliability.schema.limits import SUFFIXES, split_order
from mechdesign.questions.reliability.schema.section import ReliabilitySection, links_meant, others
from mechdesign.study import Study
from mechdesign.study.schema.checker import ORDERS as QUANTITIES
from mechdesign.study.text import fields

# Orders of channels, as tables name them.
OF_DYNAMICS = "dynamics"
ORDERS = ("position", "velocity", "acceleration", OF_DYNAMICS)


@dataclass(frozen=True)
class Channel:
    """A quantity whose error is computed: a coordinate, its velocity or acceleration, or a column of dynamics.

    Parameters
    ----------
    order : int
        Place in `ORDERS`.
    kind : str
        Kind of quantity of its unit in tables.
    coordinate : Coordinate, optional
        None of a column of dynamics, which is in the study's units.
    vector : tuple of Channel
        Components, one or two, of the vector whose length it is.
    bends : tuple of Bend
        Where it is not smooth, its arguments as channels; a length's are those of its vector.
    """

    output: str
    order: int
    kind: str
    coordinate: Coordinate | None = None
    vector: tuple[Channel, ...] = ()
    bends: tuple[Bend, ...] = ()

    @classmethod
    def of(cls, argument: Coordinate | Expression, order: int = 0, *, alone: bool = False) -> Channel:
        """That of a coordinate, or of an expression that loads follow; `alone` without its vector and bends."""
        if isinstance(argument, Expression):
            return cls(argument_name(argument), ORDERS.index(OF_DYNAMICS), "none")
        kind = QUANTITIES.get(argument.quantity, ("none",) * 3)[order]
        if alone:
            return cls(argument.name, order, kind, argument)
        vector = vector_of(argument) if order == 0 else ()
        own = _judged(dict.fromkeys(bend for part in vector or [argument] for bend in bends(part)))
        return cls(argument.name, order, kind, argument, tuple(Channel.of(part, alone=True) for part in vector), own)

    @property
    def name(self) -> str:
        """As a study's limits name it: ``P.x``, ``P.x_velocity``."""
        return self.output + (*SUFFIXES, "")[self.order]

    @property
    def turns(self) -> bool:
        """Whether it is computed in radians."""
        return self.coordinate is not None and self.coordinate.quantity == "angle"


def _judged(found: Iterable[Bend]) -> tuple[Bend, ...]:
    """Bends with channels as their arguments."""
    return tuple(
        replace(bend, arguments=tuple(Channel.of(argument, alone=True) for argument in bend.arguments))
        for bend in found
    )


@dataclass(frozen=True, eq=False)
class ReliabilityQuestion:
    """Channels (outputs order by order, all positions first, forces last), and the limits on their errors.

    Circles are the last of these. `pair` are the two limited channels, or without limits the two outputs, where there
    are exactly two.
    """

    channels: tuple[Channel, ...]
    limits: tuple[ErrorBound, ...] = ()
    pair: tuple[int, int] | None = None

    @property
    def coordinates(self) -> list[Coordinate]:
        """Coordinates of its channels."""
        return [channel.coordinate for channel in self.channels if channel.coordinate is not None]

    @property
    def columns(self) -> list[str]:
        """Columns of dynamics among its channels, which are the last of them."""
        return columns_among(self.channels)

    @property
    def moving(self) -> bool:
        """Whether velocities count."""
        return any(channel.order > 0 for channel in self.channels)

    @cached_property
    def vectors(self) -> tuple[Channel, ...]:
        """The channels, and the components of those that are lengths."""
        return (*self.channels, *(part for channel in self.channels for part in channel.vector))

    @cached_property
    def whole(self) -> tuple[Channel, ...]:
        """The channels, the components of lengths, and the arguments by which corners are judged."""
        return (*self.vectors, *(part for c in self.channels for bend in c.bends for part in bend.arguments))

    @cached_property
    def lengths(self) -> list[tuple[int, tuple[int, int]]]:
        """Channels that are lengths, with the places in `whole` of the components x and y; -1: always zero."""
        places = iter(range(len(self.channels), len(self.vectors)))
        return [(k, (next(places), next(places) if len(channel.vector) > 1 else -1))
                for k, channel in enumerate(self.channels) if channel.vector]  # fmt: skip

    @property
    def rows(self) -> list[int]:
        """Places in `whole` of the channels, and of the components of their lengths."""
        return [*range(len(self.channels)), *(place for _, pair in self.lengths for place in pair)]

    @cached_property
    def bends(self) -> list[tuple[int, list[int], Bend]]:
        """Channels that are not smooth somewhere, the places in `whole` of the arguments, and where that is."""
        places = iter(range(len(self.vectors), len(self.whole)))
        return [(k, [next(places) for _ in bend.arguments], bend)
                for k, channel in enumerate(self.channels) for bend in channel.bends]  # fmt: skip

    def take(self, poses: int | Sequence[int] | Ints) -> ReliabilityQuestion:
        """The question at these poses, where limits are arrays of poses."""
        return replace(self, limits=tuple(limit.at(poses) for limit in self.limits))

    @property
    def free(self) -> ErrorBound | None:
        """The limit of a point for whose target the drive is free."""
        return next((limit for limit in self.limits if limit.free), None)

    @property
    def single(self) -> list[ReliabilityQuestion]:
        """One question for each limit."""
        return [replace(self, limits=(limit,)) for limit in self.limits]

    def at(self, nominal: Sequence[Any] | Floats) -> ReliabilityQuestion:
        """The question with limits of errors only, at poses where the channels have these nominal values.

        An angle is taken at the turn nearest to the middle of its two absolute limits.
        """
        return replace(self, limits=tuple(
            self._about(limit, nominal) if limit.absolute else limit for limit in self.limits
        ))  # fmt: skip

    def _about(self, limit: ErrorBound, nominal: Sequence[Any] | Floats) -> ErrorBound:
        if limit.round:
            x, y = (part - nominal[k] for k, part in zip(limit.channels, limit.middle, strict=True))
            return replace(limit, middle=(x, y), absolute=False)
        value = nominal[limit.output]
        channel, middle = self.channels[limit.output], 0.5 * (limit.low + limit.high)
        if channel.order == 0 and channel.turns:
            value = value - TURN * np.where(np.isfinite(middle), np.round((value - middle) / TURN), 0.0)
        return ErrorBound(limit.channels, limit.low - value, limit.high - value)

    @cached_property
    def limited_channels(self) -> list[int]:
        """Indices of the channels that have limits."""
        return sorted({channel for limit in self.limits for channel in limit.channels})

    @cached_property
    def narrowed(self) -> ReliabilityQuestion:
        """The question with the limited channels only."""
        place = {channel: k for k, channel in enumerate(self.limited_channels)}
        limits = (replace(limit, channels=tuple(place[k] for k in limit.channels)) for limit in self.limits)
        return ReliabilityQuestion(tuple(self.channels[k] for k in self.limited_channels), tuple(limits))

    def kept(self, errors: Floats) -> Flags:
        """Whether errors of shape (channels, n) keep each limit, shape (limits, n).

        Errors of a mechanism that is not assembled are nan and keep no limit.
        """
        kept = np.ones((len(self.limits), errors.shape[1]), dtype=bool)
        for row, limit in zip(kept, self.limits, strict=True):
            error = errors[limit.output]
            if limit.round:
                x, y = limit.away(errors)
                row[:] = x * x + y * y <= limit.high * limit.high
            else:
                row[:] = (error >= limit.low) & (error <= limit.high)
        return kept

    @property
    def _ends(self) -> list[tuple[ErrorBound, float, float]]:
        """Finite ends of the limits, or an infinite one, and 1 for an upper or -1 for a lower one."""
        every = [(limit, end, sign) for limit in self.limits for end, sign in ((limit.high, 1.0), (limit.low, -1.0))]
        return [one for one in every if np.isfinite(one[1])] or every[:1]

    def margins(self, errors: Floats) -> Floats:
        """Distances of errors, shape (channels, n), from the finite ends and circles, negative beyond, (margins, n)."""
        return np.stack([
            sign * (end - (limit.distance(errors) if limit.round else errors[limit.output]))
            for limit, end, sign in self._ends
        ])  # fmt: skip

    def margin_slopes(self, errors: Floats, slopes: Floats) -> Floats:
        """Derivatives of the margins from those of the errors, shape (channels, dimension, n)."""
        gradients = []
        for limit, _, sign in self._ends:
            slope = slopes[limit.output]
            if limit.round:
                x, y = limit.away(errors)
                slope = (x * slope + y * slopes[limit.channels[1]]) / np.hypot(x, y)
            gradients.append(-sign * slope)
        return np.stack(gradients)


def columns_among(channels: Sequence[Channel]) -> list[str]:
    """The columns of dynamics among channels."""
    return [channel.name for channel in channels if channel.coordinate is None]


def ask(study: Study, section: ReliabilitySection, poses: Poses) -> ReliabilityQuestion:
    """Channels and limits of a section at poses; limited coordinates are outputs, too."""
    mechanism, kinds, last = study.mechanism, kinds_of_forces(study), ORDERS.index(OF_DYNAMICS)
    limits = [(name, last, limit) if name in kinds else (*_limited(mechanism, name), limit)
              for name, limit in section.limits.items()]  # fmt: skip
    limited = [
        part
        for base, _, limit in limits
        for part in ((f"{base}.x", f"{base}.y") if limit.radius is not None else (base,))
    ]
    names = section.outputs or (() if limited else default_outputs(mechanism))
    outputs = expand_outputs(study, tuple(name for name in names if name not in kinds))
    listed = [output.name for output in outputs]
    also = dict.fromkeys(name for name in limited if name not in listed and name not in kinds)
    outputs += expand_outputs(study, tuple(also))
    channels = [Channel.of(output, order) for order in range(3 if section.rated else 1) for output in outputs]
    forces = [name for name in dict.fromkeys([*names, *limited]) if name in kinds]
    joints = study.dynamics.joints(mechanism).names if forces and study.dynamics is not None else ()
    axes = {"shaking": ("shaking.x", "shaking.y")} | {name: (f"{name}.fx", f"{name}.fy") for name in joints}
    bent = _judged(load_bends(study)) if forces else ()
    for name in forces:
        vector = tuple(Channel(part, last, kinds[name]) for part in axes.get(name, ()))
        channels.append(Channel(name, last, kinds[name], None, vector, () if name.endswith("_energy") else bent))
    places = {(channel.output, channel.order): k for k, channel in enumerate(channels)}
    asked = []
    for base, order, limit in limits:
        targets = None if limit.targets is None else targets_of(study, base, limit, poses)
        if limit.radius is not None:
            circle = ErrorBound((places[f"{base}.x", order], places[f"{base}.y", order]), -np.inf, limit.radius)
            if targets is not None:
                radius, (x, y) = np.where(np.isnan(targets[0]), np.inf, limit.radius), np.nan_to_num(targets)
                circle = replace(circle, high=radius, absolute=True, middle=(x, y), free=limit.timing == "free")
            asked.append(circle)
            continue
        output = places[base, order]
        factor = study.units.angle_factor if channels[output].turns else 1.0
        ends: list[Any] = []
        for value, bound in zip(limit.ends, (-np.inf, np.inf), strict=True):
            end = bound if value is None else value * factor
            ends.append(end if targets is None else np.where(np.isnan(targets[0]), bound, factor * targets[0] + end))
        asked.append(ErrorBound((output,), ends[0], ends[1], limit.absolute or targets is not None))
    asked.sort(key=lambda limit: limit.round)
    alone = len({limit.round for limit in asked}) < 2
    pair = [k for limit in asked for k in limit.channels] if alone else []
    if not limited:
        pair = [k for k, channel in enumerate(channels) if channel.order in (0, last)]
    return ReliabilityQuestion(tuple(channels), tuple(asked), (pair[0], pair[1]) if len(pair) == 2 else None)


def _limited(mechanism: Mechanism, name: str) -> tuple[str, int]:
    """Name of the limited coordinate or point, and the order (0 position, 1 velocity, 2 acceleration)."""

    def exists(name: str) -> bool:
        try:
            return mechanism.graph.is_point(name) or bool(mechanism.coordinate(name))
        except MechanismError:
            return False

    return split_order(name, exists)


def ambiguous_points(study: Study, question: ReliabilityQuestion) -> Iterator[Caution]:
    """A warning for each output whose pin has a clearance, where the study does not say which link's point it is."""
    section: dict[str, Any] = study.resolved["reliability"]
    names = [*fields.as_list(section.get("outputs")), *(section.get("limits") or {})]
    for point, (link, rest) in others(study.reliability, study.mechanism.graph).items():
        plain = ("", study.mechanism.graph.node(point))
        about = [c.name for c in question.channels if c.order == 0 and c.coordinate and plain in c.coordinate.ends]
        named = section["clearances"][point].get("link") or any(_named(str(name), point) for name in names)
        if about and rest and not named:
            yield Caution(
                "assumed",
                f"{', '.join(about)}: {point} has a clearance and is that of {' and '.join(rest)}, not of {link}, "
                f"in which the pin moves; say so by {rest[0]}.{point}, or give reliability.clearances.{point} a 'link'",
            )  # fmt: skip


def _named(name: str, point: str) -> bool:
    rest = name.partition(".")[2]
    return rest == point or rest.startswith((f"{point}.", f"{point}_"))


def holders(study: Study, channel: Channel) -> str:
    """Names of the links whose points a channel uses, for points with a clearance or an elastic bearing."""
    graph = study.mechanism.graph
    names = [
        link or " ".join(links)
        for point, links in links_meant(study.reliability, study.stiffness, graph).items()
        for link, node in (channel.coordinate.ends if channel.coordinate is not None else ())
        if node == graph.node(point)
    ]
    return " ".join(dict.fromkeys(names))
