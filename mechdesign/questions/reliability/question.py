"""The channels and limits of a reliability section: outputs by order, and the limits on their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mechdesign.cautions import Caution
from mechdesign.errors import MechanismError
from mechdesign.mechanism import Mechanism
from mechdesign.mechanism.algebra import TURN
from mechdesign.mechanism.coordinates import Coordinate
from mechdesign.numerics.arrays import Flags, Floats, Ints
from mechdesign.questions.outputs import default_outputs, expand_outputs
from mechdesign.questions.reliability.corners import Bend, bends, vector_of
from mechdesign.questions.reliability.forces import argument_name, kinds_of_forces, load_bends
from mechdesign.questions.reliability.laws import at_rows
from mechdesign.questions.reliability.schema.limits import SUFFIXES, split_order
from mechdesign.questions.reliability.schema.section import ReliabilitySection, links_meant, others
from mechdesign.study import Study
from mechdesign.study.schema.checker import ORDERS as QUANTITIES
from mechdesign.study.text import fields
from mechdesign.study.text.units import Units

# Orders of channels, as tables name them.
OF_DYNAMICS = "dynamics"
ORDERS = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class CoordinateChannel:
    """One quantity whose error is computed: a coordinate, or its velocity or acceleration (`order` 0, 1, 2)."""

    coordinate: Coordinate
    order: int

    @property
    def name(self) -> str:
        """As a study's limits name it: ``P.x``, ``P.x_velocity``."""
        return self.coordinate.name + SUFFIXES[self.order]

    @property
    def words(self) -> tuple[str, str]:
        """Output and order, as tables name them."""
        return self.coordinate.name, ORDERS[self.order]

    @property
    def turns(self) -> bool:
        """Whether it is computed in radians."""
        return self.coordinate.quantity == "angle"

    def unit(self, units: Units) -> str:
        """Its unit in tables."""
        return units.label(QUANTITIES.get(self.coordinate.quantity, ("none",) * 3)[self.order])


@dataclass(frozen=True)
class ForceChannel:
    """A column of dynamics whose error is computed: an effort, a joint's force, an energy ..., in the study's units."""

    name: str
    kind: str
    vector: tuple[str, ...] = ()  # columns of the components of a force whose size it is
    bends: tuple[Bend, ...] = ()  # where the loads that it follows are not smooth

    @property
    def words(self) -> tuple[str, str]:
        """Output and order, as tables name them."""
        return self.name, OF_DYNAMICS

    @property
    def turns(self) -> bool:
        """Whether it is computed in radians."""
        return False

    def unit(self, units: Units) -> str:
        """Its unit in tables."""
        return units.label(self.kind)


Channel = CoordinateChannel | ForceChannel


@dataclass(frozen=True)
class Band:
    """Limits low <= error <= high of the channel with the index `output`; either may be infinite, or an array of poses.

    If `absolute`, they limit the value of the channel instead of its error.
    """

    output: int
    low: Any
    high: Any
    absolute: bool = False


@dataclass(frozen=True)
class Disc:
    """A circle about zero that limits the errors of the channels `x` and `y`; its radius may be an array of poses.

    Errors within the circle of radius `least` about zero are beyond the limit, too.
    """

    x: int
    y: int
    radius: Any
    least: Any = 0.0


@dataclass(frozen=True, eq=False)
class ReliabilityQuestion:
    """Channels (outputs order by order, all positions first, forces last), and the limits on their errors.

    `pair` are the two limited channels, or without limits the two outputs, where there are exactly two.
    """

    channels: tuple[Channel, ...]
    bands: tuple[Band, ...]
    discs: tuple[Disc, ...]
    pair: tuple[int, int] | None

    @property
    def coordinates(self) -> list[Coordinate]:
        """Coordinates of its channels."""
        return [channel.coordinate for channel in self.channels if isinstance(channel, CoordinateChannel)]

    @property
    def columns(self) -> list[str]:
        """Columns of dynamics among its channels, which are the last of them."""
        return [channel.name for channel in self.channels if isinstance(channel, ForceChannel)]

    @property
    def moving(self) -> bool:
        """Whether velocities count."""
        return any(isinstance(channel, ForceChannel) or channel.order > 0 for channel in self.channels)

    @cached_property
    def _vectors(self) -> list[tuple[int, tuple[Channel, ...]]]:
        """Channels that are the length of a vector, and its components."""
        vectors: list[tuple[int, tuple[Channel, ...]]] = []
        for k, channel in enumerate(self.channels):
            if isinstance(channel, ForceChannel):
                vectors.append((k, tuple(ForceChannel(name, channel.kind) for name in channel.vector)))
            elif channel.order == 0:
                vectors.append((k, tuple(CoordinateChannel(part, 0) for part in vector_of(channel.coordinate))))
        return [(k, vector) for k, vector in vectors if vector]

    @cached_property
    def _bends(self) -> list[tuple[int, Bend]]:
        """Channels with the places at which they are not smooth; a length's are those of its vector."""
        vectors, places = dict(self._vectors), list[tuple[int, Bend]]()
        for k, channel in enumerate(self.channels):
            for part in vectors.get(k, (channel,)) if isinstance(channel, CoordinateChannel) else (channel,):
                own = part.bends if isinstance(part, ForceChannel) else bends(part.coordinate)
                places += [(k, bend) for bend in dict.fromkeys(own)]
        return places

    @cached_property
    def vectors(self) -> tuple[Channel, ...]:
        """The channels, and the components of those that are lengths."""
        return (*self.channels, *(part for _, vector in self._vectors for part in vector))

    @cached_property
    def whole(self) -> tuple[Channel, ...]:
        """The channels, the components of lengths, and the arguments by which corners are judged."""
        arguments = (argument for _, bend in self._bends for argument in bend.arguments)
        return (*self.vectors, *(
            CoordinateChannel(argument, 0) if isinstance(argument, Coordinate)
            else ForceChannel(argument_name(argument), "none") for argument in arguments
        ))  # fmt: skip

    @cached_property
    def lengths(self) -> list[tuple[int, tuple[int, int]]]:
        """Channels that are lengths, with the places in `whole` of the components x and y; -1: always zero."""
        place, lengths = len(self.channels), []
        for k, vector in self._vectors:
            lengths.append((k, (place, place + 1 if len(vector) > 1 else -1)))
            place += len(vector)
        return lengths

    @property
    def rows(self) -> list[int]:
        """Places in `whole` of the channels, and of the components of their lengths."""
        return [*range(len(self.channels)), *(place for _, pair in self.lengths for place in pair)]

    @cached_property
    def bends(self) -> list[tuple[int, range, Bend]]:
        """Channels that are not smooth somewhere, the places in `whole` of the arguments, and where that is."""
        place, judged = len(self.channels) + sum(len(vector) for _, vector in self._vectors), []
        for k, bend in self._bends:
            judged.append((k, range(place, place + len(bend.arguments)), bend))
            place += len(bend.arguments)
        return judged

    @property
    def limited(self) -> bool:
        """Whether there are limits, and so a reliability."""
        return bool(self.bands or self.discs)

    def take(self, poses: Sequence[int] | Ints) -> ReliabilityQuestion:
        """The question at these poses, where limits are arrays of poses."""
        bands, discs = limits_at(self.bands, self.discs, poses)
        return replace(self, bands=bands, discs=discs)

    @property
    def single(self) -> list[ReliabilityQuestion]:
        """One question for each limit, in the order of `kept`."""
        alone = [replace(self, bands=(band,), discs=()) for band in self.bands]
        return alone + [replace(self, bands=(), discs=(disc,)) for disc in self.discs]

    def at(self, nominal: Sequence[Any] | Floats) -> ReliabilityQuestion:
        """The question with limits of errors only, at poses where the channels have these nominal values.

        An angle is taken at the turn nearest to the middle of its two absolute limits.
        """
        bands = tuple(self._about(band, nominal[band.output]) if band.absolute else band for band in self.bands)
        return replace(self, bands=bands)

    def _about(self, band: Band, value: Any) -> Band:
        channel, middle = self.channels[band.output], 0.5 * (band.low + band.high)
        if (
            isinstance(channel, CoordinateChannel)
            and channel.order == 0
            and channel.turns
            and np.isfinite(middle).all()
        ):
            value = value - TURN * np.round((value - middle) / TURN)
        return Band(band.output, band.low - value, band.high - value)

    @cached_property
    def limited_channels(self) -> list[int]:
        """Indices of the channels that have limits."""
        return sorted({b.output for b in self.bands} | {k for d in self.discs for k in (d.x, d.y)})

    @cached_property
    def narrowed(self) -> ReliabilityQuestion:
        """The question with the limited channels only."""
        place = {channel: k for k, channel in enumerate(self.limited_channels)}
        return ReliabilityQuestion(
            tuple(self.channels[k] for k in self.limited_channels),
            tuple(replace(band, output=place[band.output]) for band in self.bands),
            tuple(replace(disc, x=place[disc.x], y=place[disc.y]) for disc in self.discs),
            None,
        )

    def kept(self, errors: Floats) -> Flags:
        """Whether errors of shape (channels, n) keep each limit (bands, then discs), shape (limits, n).

        Errors of a mechanism that is not assembled are nan and keep no limit.
        """
        kept = np.ones((len(self.bands) + len(self.discs), errors.shape[1]), dtype=bool)
        for row, band in zip(kept, self.bands, strict=False):
            error = errors[band.output]
            row[:] = (error >= band.low) & (error <= band.high)
        for row, disc in zip(kept[len(self.bands) :], self.discs, strict=True):
            x, y = errors[disc.x], errors[disc.y]
            row[:] = x * x + y * y <= disc.radius * disc.radius
        return kept

    @property
    def _ends(self) -> list[tuple[int, float, float]]:
        """Finite ends of the bands: channel, end, and 1 for an upper or -1 for a lower end."""
        return [(b.output, end, sign) for b in self.bands for end, sign in ((b.high, 1.0), (b.low, -1.0))
                if np.isfinite(end)]  # fmt: skip

    def margins(self, errors: Floats) -> Floats:
        """Distances of errors, shape (channels, n), from the finite ends and circles, negative beyond, (margins, n)."""
        bands = [sign * (end - errors[output]) for output, end, sign in self._ends]
        return np.stack([*bands, *(disc.radius - np.hypot(errors[disc.x], errors[disc.y]) for disc in self.discs)])

    def margin_slopes(self, errors: Floats, slopes: Floats) -> Floats:
        """Derivatives of the margins from those of the errors, shape (channels, dimension, n)."""
        gradients = [-sign * slopes[output] for output, _, sign in self._ends]
        for disc in self.discs:
            x, y = errors[disc.x], errors[disc.y]
            gradients.append((-x * slopes[disc.x] - y * slopes[disc.y]) / np.hypot(x, y))
        return np.stack(gradients)


def limits_at(bands: Sequence[Band], discs: Sequence[Disc], poses: Any) -> tuple[tuple[Band, ...], tuple[Disc, ...]]:
    """The limits at one pose or some, by an index of the arrays of poses."""
    return (
        tuple(replace(band, low=at_rows(band.low, poses), high=at_rows(band.high, poses)) for band in bands),
        tuple(replace(disc, radius=at_rows(disc.radius, poses), least=at_rows(disc.least, poses)) for disc in discs),
    )


def ask(study: Study, section: ReliabilitySection) -> ReliabilityQuestion:
    """Channels and limits of a section, whose numbers may be arrays of poses; limited coordinates are outputs, too."""
    mechanism = study.mechanism
    kinds = kinds_of_forces(study)
    limits = [(name, 0, limit) if name in kinds else (*_limited(mechanism, name), limit)
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
    orders = 3 if section.rated else 1
    forces = [name for name in dict.fromkeys([*names, *limited]) if name in kinds]
    channels: list[Channel] = [CoordinateChannel(output, order) for order in range(orders) for output in outputs]
    joints = study.dynamics.joints(mechanism).names if forces and study.dynamics is not None else ()
    axes = {"shaking": ("shaking.x", "shaking.y")} | {name: (f"{name}.fx", f"{name}.fy") for name in joints}
    bent = tuple(load_bends(study)) if forces else ()
    channels += [
        ForceChannel(name, kinds[name], axes.get(name, ()), () if name.endswith("_energy") else bent) for name in forces
    ]
    places = {channel.words: k for k, channel in enumerate(channels)}

    def place(base: str, order: int) -> int:
        return places[base, OF_DYNAMICS if base in kinds else ORDERS[order]]

    bands, discs = [], []
    for base, order, limit in limits:
        if limit.radius is not None:
            discs.append(Disc(place(f"{base}.x", order), place(f"{base}.y", order), limit.radius))
        else:
            turns = channels[place(base, order)].turns
            low, high = (
                (value * study.units.angle_factor if turns else value) if value is not None else bound
                for value, bound in zip(limit.ends, (-np.inf, np.inf), strict=True)
            )
            bands.append(Band(place(base, order), low, high, limit.absolute))
    pair: tuple[int, int] | None = None
    if len(bands) == 2 and not discs:
        pair = (bands[0].output, bands[1].output)
    elif len(discs) == 1 and not bands:
        pair = (discs[0].x, discs[0].y)
    elif not limited and len(outputs) + len(forces) == 2:
        one, other = (place(name, 0) for name in [output.name for output in outputs] + forces)
        pair = (one, other)
    return ReliabilityQuestion(tuple(channels), tuple(bands), tuple(discs), pair)


def _limited(mechanism: Mechanism, name: str) -> tuple[str, int]:
    """Name of the limited coordinate or point, and the order (0 position, 1 velocity, 2 acceleration)."""

    def exists(name: str) -> bool:
        try:
            return mechanism.graph.is_point(name) or bool(mechanism.coordinate(name))
        except MechanismError:
            return False

    return split_order(name, exists)


def ambiguous_points(study: Study, question: ReliabilityQuestion) -> list[Caution]:
    """A warning for each output whose pin has a clearance, where the study does not say which link's point it is."""
    section: dict[str, Any] = study.resolved["reliability"]
    names = [*fields.as_list(section.get("outputs")), *(section.get("limits") or {})]
    warnings = []
    for point, (link, rest) in others(study.reliability, study.mechanism.graph).items():
        plain = ("", study.mechanism.graph.node(point))
        positions = [c for c in question.channels if isinstance(c, CoordinateChannel) and not c.order]
        about = [c.name for c in positions if plain in c.coordinate.ends]
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


def holders(study: Study, channel: Channel) -> str:
    """Names of the links whose points a channel uses, for points with a clearance or an elastic bearing."""
    graph = study.mechanism.graph
    coordinates = [channel.coordinate] if isinstance(channel, CoordinateChannel) else []
    names = [
        link or " ".join(links)
        for point, links in links_meant(study.reliability, study.stiffness, graph).items()
        for coordinate in coordinates
        for link, node in coordinate.ends
        if node == graph.node(point)
    ]
    return " ".join(dict.fromkeys(names))
