"""Four-bars and slider-cranks inside a mechanism: closed chains of four bodies, found by their joints alone.

A body is a link with all that is clamped to it; a telescopic leg is two bodies, and a pin in a slot is a block that
slides along the slot and turns about the pin. Four revolute joints make a four-bar, three and a slide a slider-crank;
which of its bodies is fixed makes it one of its inversions.

Sources: Grashof (1883); Barker, "A complete classification of planar four-bar linkages", Mechanism and Machine Theory
20 (1985) 535-554, whose classes are named here as textbooks do: GCCC double-crank, GCRR crank-rocker, GRCR Grashof
double-rocker, GRRC rocker-crank, RRR1-RRR4 triple-rocker, SCCC and the like change point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from mechdesign.mechanism.algebra import Value, Vector, cross, norm2
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.graph import GROUND
from mechdesign.mechanism.mechanism import Mechanism
from mechdesign.mechanism.outputs import Rates

Kind = Literal["four-bar", "slider-crank", "inverted slider-crank"]

# Sums of lengths within this part of each other are equal.
EQUAL_LENGTHS = 1e-9


@dataclass(frozen=True)
class LoopJoint:
    """A revolute joint at a node (`edge` -1), or a slide along an edge of the graph (`node` -1)."""

    name: str
    node: int = -1
    edge: int = -1


@dataclass(frozen=True)
class FourBar:
    """A closed chain of four bodies."""

    links: tuple[str, ...]  # frame, input, coupler and output
    joints: tuple[LoopJoint, ...]  # between frame and input, input and coupler, coupler and output, output and frame
    lengths: tuple[float, ...]  # of the links, between their two revolute joints; nan for a link with the slide
    # Of a slider-crank: distance of the slide's line from the pin of the body that carries the line, measured at the
    # pin of the body that slides; nan for a four-bar.
    offset: float
    driven: bool = False  # whether the slide is driven, as that of a cylinder

    @cached_property
    def slide(self) -> int:
        """Which joint is the slide; -1 in a four-bar."""
        return next((k for k, joint in enumerate(self.joints) if joint.edge >= 0), -1)

    @property
    def kind(self) -> Kind:
        """Four-bar, slider-crank (one of the two bodies of the slide is the frame), or an inversion of that."""
        if self.slide < 0:
            return "four-bar"
        return "slider-crank" if self.slide in (0, 3) else "inverted slider-crank"

    @cached_property
    def excess(self) -> float:
        """Length by which the condition for a link to turn fully is met: zero at a change point, negative if none does.

        Four-bar: p + q - (s + l), with s and l the shortest and the longest link. Slider-crank: rod - (crank + offset).
        Inverted: difference of crank and frame, less the offset.
        """
        (_, left), (_, right) = self._compared()
        size = sum(length for length in (*self.lengths, self.offset) if not math.isnan(length))
        return right - left if abs(right - left) > EQUAL_LENGTHS * size else 0.0

    def _compared(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """The two sums of lengths, by name, that are compared: a link turns fully if the first is the smaller."""
        if self.kind == "four-bar":
            shortest, *others, longest = sorted(self.lengths)
            return ("s + l", shortest + longest), ("p + q", sum(others))
        one, two = self._pair()
        if self.kind == "slider-crank":
            return ("crank + offset", one + self.offset), ("rod", two)
        return ("offset", self.offset), ("difference of crank and frame", abs(one - two))

    def _pair(self) -> tuple[float, float]:
        """Crank and rod of a slider-crank; crank and frame of an inverted one."""
        if self.kind == "slider-crank":
            return self.lengths[1 if self.slide == 3 else 3], self.lengths[2]
        return self.lengths[3 if self.slide == 1 else 1], self.lengths[0]

    @property
    def type(self) -> str:
        """Class of the chain by which of its links turn fully against the frame."""
        if self.excess == 0:
            return "change point"
        if self.kind == "four-bar":
            if self.excess < 0:
                return "triple-rocker"
            return ("double-crank", "crank-rocker", "double-rocker", "rocker-crank")[int(np.argmin(self.lengths))]
        if self.kind == "slider-crank":
            return "crank-slider" if self.excess > 0 else "rocker-slider"
        if self.excess < 0:
            return "rocking block"
        crank, frame = self._pair()
        return "turning block" if crank > frame else "oscillating block"

    def condition(self) -> str:
        """The comparison of lengths behind the type, in words."""
        left, right = self._compared()
        sign = "=" if self.type == "change point" else "<" if self.excess > 0 else ">"
        return f"{left[0]} {left[1]:.6g} {sign} {right[0]} {left[1] if sign == '=' else right[1]:.6g}"

    @property
    def name(self) -> str:
        """``ground-crank-rod-rocker (O A B D)``."""
        return f"{'-'.join(self.links)} ({' '.join(joint.name for joint in self.joints)})"

    def whole(self, size: float) -> bool:
        """Whether all its links have a length, in a mechanism of this size."""
        return not any(length <= EQUAL_LENGTHS * size for length in self.lengths)

    def measured(self, poses: Configuration, size: float) -> list[FourBar]:
        """The chain with its lengths in each pose of a flat batch, for a mechanism of this size."""
        joints, nothing = self.joints, np.full(poses.shape, math.nan)
        lengths = [
            nothing if min(a.node, b.node) < 0 else np.abs(poses.nodes[b.node] - poses.nodes[a.node])
            for a, b in zip([joints[3], *joints[:3]], joints, strict=True)
        ]
        offset = nothing
        if self.slide >= 0:
            span = poses.nodes[joints[(self.slide + 1) % 4].node] - poses.nodes[joints[self.slide - 1].node]
            offset = np.abs(cross(np.asarray(poses.direction(joints[self.slide].edge)), np.asarray(span)))
            offset = np.where(offset > EQUAL_LENGTHS * size, offset, 0.0)
        table = np.stack([np.broadcast_to(part, poses.shape) for part in (*lengths, offset)], axis=1)
        return [replace(self, lengths=(*row[:4],), offset=row[4]) for row in table.tolist()]

    def _line(self, end: int | None) -> tuple[int, int]:
        """Ends of the coupler's line of action (`end` None), or of the arm of the input (`end` 0) or the output (3).

        The coupler passes a force on from pin to pin, and an arm leads from the frame to where the coupler pushes. The
        same joint twice is a slide: the line is across it. A cylinder that drives pushes from its pin to that of its
        rod, and no arm turns it.
        """
        if self.driven and end != 3:
            return (0, 2) if end is None else (1, 1)
        if end is None:
            return (self.slide, self.slide) if self.slide in (1, 2) else (1, 2)
        # The coupler pushes at the nearer of its joints, or at the farther where that is a slide.
        near, far = (1, 2) if end == 0 else (2, 1)
        return (end, end) if self.slide == end else (end, far if self.slide == near else near)

    def _vector(self, configuration: Configuration, end: int | None) -> Vector:
        tail, head = (self.joints[k] for k in self._line(end))
        if tail is head:
            return 1j * configuration.direction(tail.edge)
        return configuration.nodes[head.node] - configuration.nodes[tail.node]

    def squareness(self, configuration: Configuration, end: int) -> tuple[Value, Value]:
        """Sine and cosine of the angle from the arm of the input (`end` 0) or output (3) to the coupler's action."""
        product = self._vector(configuration, None) * np.conj(self._vector(configuration, end))
        size = np.abs(product)
        return product.imag / size, product.real / size

    def turning(self, configuration: Configuration, rates: Rates, end: int) -> Value:
        """Derivative along `rates` of the angle of `squareness` (radians)."""
        return self._turn(configuration, rates, None) - self._turn(configuration, rates, end)

    def _turn(self, configuration: Configuration, rates: Rates, end: int | None) -> Value:
        tail, head = (self.joints[k] for k in self._line(end))
        if tail is head:
            return rates.angles[configuration.graph.edges[tail.edge].frame]
        span = self._vector(configuration, end)
        return cross(span, rates.nodes[head.node] - rates.nodes[tail.node]) / norm2(span)

    def transmission(self, configuration: Configuration) -> Value:
        """Transmission angle, the acute angle between coupler and output (radians, 0 to pi/2).

        Between the coupler's line of action and the output's arm; where the output slides, between the rod and the
        normal of the guide; of a cylinder that drives, between the line of its pins and the arm.
        """
        sine, cosine = self.squareness(configuration, 3)
        return np.arctan2(np.abs(sine), np.abs(cosine))


def four_bars(mechanism: Mechanism) -> tuple[FourBar, ...]:
    """Every four-bar and slider-crank of a mechanism that is not rigid in itself, those on the ground first."""
    sketch, size = mechanism.sketch_configuration, mechanism.size
    flat = replace(sketch, shape=(1,), reason=sketch.reason.reshape(1))
    measured = [chain.measured(flat, size)[0] for chain in chains(mechanism)]
    return tuple(chain for chain in measured if chain.whole(size))


def chains(mechanism: Mechanism) -> tuple[FourBar, ...]:
    """Every four-bar and slider-crank by its joints alone, without lengths; links of length zero are not excluded."""
    bodies = _Bodies(mechanism)
    rings: dict[frozenset[tuple[str, int, int]], FourBar] = {}
    for links, joints in _rings(bodies):
        key = frozenset((joint.name, joint.node, joint.edge) for joint in joints)
        if key not in rings:
            rings[key] = bodies.four_bar(links, joints)
    return tuple(sorted(rings.values(), key=lambda chain: bodies.ground not in chain.links))


def describe_loops(mechanism: Mechanism) -> list[str]:
    """A line for each four-bar and slider-crank: its class and the lengths that decide it."""
    return [f"{loop.kind} {loop.name}: {loop.type}, {loop.condition()}" for loop in four_bars(mechanism)]


class _Bodies:
    """Bodies and the joints between them; a body is known by the first of its links."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        graph = mechanism.graph
        self.owner: dict[str, str] = {body: body for body in graph.bodies}
        for clamp in graph.clamps.values():
            one, other = sorted((self.owner[body] for body in clamp[:2]), key=list(graph.bodies).index)
            self.owner = {body: one if owner == other else owner for body, owner in self.owner.items()}
        self.ground = self.owner[GROUND]
        self.frames: dict[str, int] = {body: graph.bodies[body][0] for body in self.owner.values()}
        holders: dict[int, list[str]] = {}

        def hold(body: str, node: int) -> None:
            if body not in holders.setdefault(node, []):
                holders[node].append(body)

        for body, point in graph.points:
            hold(self.owner[body], graph.node(point))
        self.joints: list[tuple[str, str, LoopJoint]] = []
        for slide, (name, (guide, slider)) in enumerate(zip(graph.slides, graph.guides, strict=True)):
            carrier, edge = self.owner[guide], graph.edge_of(slide)
            block = self.owner.get(slider, f"{name} block")
            if not slider:
                self.frames[block] = self.frames[carrier]
                hold(block, graph.edges[edge].head)
            self.joints.append((carrier, block, LoopJoint(name, edge=edge)))
        for node, bodies in holders.items():
            for k, one in enumerate(bodies):
                self.joints += [(one, other, LoopJoint(graph.nodes[node], node=node)) for other in bodies[k + 1 :]]

    def four_bar(self, links: Sequence[str], joints: Sequence[LoopJoint]) -> FourBar:
        """Order a ring (joint k between links k and k + 1): frame, input, coupler, output."""
        k = self._frame(links)
        links, joints = [*links[k:], *links[:k]], [*joints[k:], *joints[:k]]
        cylinder = next((k for k in (1, 2) if joints[k].edge >= 0 and self._drives(joints[k])), 0)
        input_is_last = self._placing_group(links[3], joints[3]) < self._placing_group(links[1], joints[0])
        if cylinder == 2 or (cylinder == 0 and input_is_last):
            links, joints = [links[0], *links[:0:-1]], joints[::-1]
        names = tuple(link.replace(":", " ") for link in links)
        return FourBar(names, tuple(joints), (math.nan,) * 4, math.nan, driven=cylinder > 0)

    def _drives(self, joint: LoopJoint) -> bool:
        """Whether a slide is given by the drives."""
        slide = self.mechanism.graph.edges[joint.edge].slide
        return not any(slide in group.slides for group in self.mechanism.forward.structure.groups)

    def _frame(self, links: Sequence[str]) -> int:
        """Which link of a ring is fixed: the ground, else what a drive is measured from, else the first named."""
        if self.ground in links:
            return links.index(self.ground)
        for drive in self.mechanism.description.drives.values():
            reference = self.owner[drive.reference]
            if drive.kind == "angle" and reference in links and self.owner[drive.target] in links:
                return links.index(reference)
        return min(range(4), key=lambda k: list(self.frames).index(links[k]))

    def _placing_group(self, link: str, joint: LoopJoint) -> int:
        """Index of the group that places a link against the frame; -1 if the drives do."""
        structure, edges = self.mechanism.forward.structure, self.mechanism.graph.edges
        root = structure.ties[self.frames[link]].root
        for index, group in enumerate(structure.groups):
            if (edges[joint.edge].slide in group.slides) if joint.edge >= 0 else (root in group.angles):
                return index
        return -1


def _rings(bodies: _Bodies) -> Iterator[tuple[list[str], list[LoopJoint]]]:
    """All rings of four bodies with four different joints, at most one of them a slide; each at least once."""
    # By joint, as a pin may hold many bodies.
    near: dict[str, dict[LoopJoint, list[str]]] = {}
    for pair in bodies.joints:
        for one, other, joint in (pair, (pair[1], pair[0], pair[2])):
            near.setdefault(one, {}).setdefault(joint, []).append(other)
    order = {body: k for k, body in enumerate(near)}

    def onwards(ring: list[str], joints: list[LoopJoint]) -> Iterator[tuple[list[str], list[LoopJoint]]]:
        for joint, others in near[ring[-1]].items():
            if joint in joints or (joint.edge >= 0 and any(before.edge >= 0 for before in joints)):
                continue
            if len(ring) == 4:
                if ring[0] in others:
                    yield ring, [*joints, joint]
                continue
            for other in others:
                # Each ring once from its first body, in both directions.
                if order[other] > order[ring[0]] and other not in ring:
                    yield from onwards([*ring, other], [*joints, joint])

    for first in near:
        yield from onwards([first], [])
