"""Where joints of a mechanism bear on its links, and in which order their forces follow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

from mechdesign.mechanism.algebra import Vector
from mechdesign.mechanism.cams import Engagement
from mechdesign.mechanism.configuration import Configuration
from mechdesign.mechanism.coordinates import coupled
from mechdesign.mechanism.graph import GROUND, Graph
from mechdesign.mechanism.model import Description

# Prefix of the pin of several links; its point follows.
PIN = "pin:"


class Contact(NamedTuple):
    """A joint between two bodies, or between a body and a pin that several share.

    The force on `on` by `by` acts at `node`: a signed sum of the forces of edges, less those on `bodies` whose base is
    the node. It also transmits a moment unless it `turns`. Of a slide it `slides` along the line of its one edge. Links
    that are `engaged` press each other where they touch.
    """

    joint: str
    on: str
    by: str
    node: int
    edges: tuple[tuple[int, int], ...]
    bodies: tuple[str, ...] = ()
    turns: bool = True
    slides: bool = False
    engaged: Engagement | None = None

    def place(self, configuration: Configuration) -> Vector:
        """Where it is."""
        place: Vector = configuration.nodes[self.node]
        return place if self.engaged is None else self.engaged.place(configuration)


class _Member(NamedTuple):
    """What meets at a pin: a body, or the guide of a slot; its force on the pin by edges, and by the load on a body."""

    name: str
    edges: tuple[tuple[int, int], ...]
    bodies: tuple[str, ...] = ()
    slot: str = ""


class Joints:
    """The joints of a mechanism, compiled once: between which bodies each acts, and how its force follows from edges.

    At `loaded` nodes a force acts on the pin itself: what the bodies there bear are no opposite forces.
    """

    def __init__(
        self, description: Description, graph: Graph, loaded: frozenset[int] = frozenset(),
        engaged: Sequence[Engagement] = (),
    ) -> None:  # fmt: skip
        self.description, self.graph, self.bases = description, graph, graph.bases
        self.couplings = [coupled(coupling, description, graph) for coupling in description.couplings.values()]
        self.loaded = loaded | {node for coupling in self.couplings for _, node in coupling.gap.ends}
        #: By node at which one body alone has a point, this body: it bears what acts on the pin.
        self.sole: dict[int, str] = {}
        #: By leg, prismatic or fixed joint, the two bodies that it keeps from turning against each other.
        self.ties = {name: pair for name, pair in zip(graph.slides, graph.guides, strict=True) if pair[1]}
        self.ties |= {name: (one, other) for name, (one, other, _) in graph.clamps.items()}
        touching = [Contact(pair.coupling, *pair.links, pair.nodes[0], (), engaged=pair) for pair in engaged]
        self.contacts = (*self._slides(), *self._pins(), *touching)
        self.order, self.open = self._tie_order()

    @cached_property
    def names(self) -> list[str]:
        """Names of the contacts' forces: of their joint, and what it acts on where it has several."""
        counts = Counter(contact.joint for contact in self.contacts)
        return [f"{c.joint}_force" + f"_on_{c.on}" * (counts[c.joint] > 1) for c in self.contacts]

    def _slides(self) -> Iterator[Contact]:
        for k, edge in enumerate(self.graph.edges):
            if edge.slide is not None and (pair := self.graph.guides[edge.slide])[1]:
                name, (guide, slider) = self.graph.slides[edge.slide], pair
                yield Contact(name, slider, guide, edge.head, ((k, -1),), turns=False, slides=True)

    def _members(self) -> dict[int, list[_Member]]:
        """By node, what meets there."""
        forces: dict[tuple[int, str], list[tuple[int, int]]] = {
            (self.graph.nodes.index(point), body): [] for body, point in self.graph.points
        }
        slots: dict[int, list[_Member]] = {}
        for k, edge in enumerate(self.graph.edges):
            if edge.slide is None:
                tail = head = edge.locals[0][1]
            else:
                tail, head = self.graph.guides[edge.slide]
                if not head:
                    name = self.graph.slides[edge.slide]
                    slots.setdefault(edge.head, []).append(_Member(tail, ((k, -1),), (), name))
            forces[edge.tail, tail].append((k, 1))
            if head:
                forces[edge.head, head].append((k, -1))
        members: dict[int, list[_Member]] = {}
        for (node, body), edges in forces.items():
            own = (body,) if self.bases[body] == node else ()
            members.setdefault(node, []).append(_Member(body, tuple(edges), own))
        for node, listed in slots.items():
            members[node] += listed
        return members

    def _pins(self) -> Iterator[Contact]:
        for node, members in self._members().items():
            point = self.graph.nodes[node]
            clamped, free = self._clamped(node, members)
            yield from clamped
            if len(free) == 1:
                self.sole[node] = free[0].name
            # The pin that a ground's origin would be bears nothing.
            if len(free) < 2 or ":" in point:
                continue
            ground = next((member for member in free if member.name == GROUND and not member.slot), None)
            if ground is not None:
                # The pin is fixed in the ground, and so is what acts on it.
                for member in (other for other in free if other is not ground):
                    slotted = member.slot and Contact(member.slot, GROUND, member.name, node, member.edges)
                    yield slotted or _borne(point, member, GROUND, node)
            elif len(free) == 2 and node not in self.loaded:
                by, on = sorted(free, key=lambda member: not member.slot)
                yield _borne(by.slot or point, on, by.name, node)
            else:
                pin = f"{PIN}{point}"
                yield from (_borne(point, member, pin, node) for member in free if not member.slot)
                yield from (
                    Contact(member.slot, pin, member.name, node, member.edges) for member in free if member.slot
                )

    def _clamped(self, node: int, members: Sequence[_Member]) -> tuple[list[Contact], list[_Member]]:
        """The clamps at a node, and its members: of links clamped together one, the ground or a first, with all edges.

        Each clamp holds what hangs on it, seen from this one.
        """
        apart = {member.name: member for member in members if not member.slot}
        clamps = {name: self.ties[name] for name, (*_, at) in self.graph.clamps.items() if at == self.graph.nodes[node]}
        contacts = []

        def hold(member: _Member) -> _Member:
            for name, pair in clamps.items():
                other = pair[1 - pair.index(member.name)] if member.name in pair else ""
                if other in apart:
                    hanging = hold(apart.pop(other))
                    contacts.append(_borne(name, hanging, member.name, node, turns=False))
                    edges, bodies = member.edges + hanging.edges, member.bodies + hanging.bodies
                    member = _Member(member.name, edges, bodies)
            return member

        second = {pair[1] for pair in clamps.values()}
        order = sorted(apart, key=lambda name: (name != GROUND, name in second))
        held = [hold(apart.pop(name)) for name in order if name in apart]
        return contacts, held + [member for member in members if member.slot]

    def _tie_order(self) -> tuple[list[tuple[str, str]], frozenset[str]]:
        """Joints of `ties` from the outside in, each with the body that it holds; and those of closed chains."""
        left = dict(self.ties)
        order: list[tuple[str, str]] = []
        while True:
            held: dict[str, list[str]] = {}
            for name, pair in left.items():
                for body in pair:
                    held.setdefault(body, []).append(name)
            ends = [(names[0], body) for body, names in held.items() if len(names) == 1 and body != GROUND]
            if not ends:
                return order, frozenset(left)
            order.append(ends[0])
            del left[ends[0][0]]


def _borne(joint: str, member: _Member, by: str, node: int, *, turns: bool = True) -> Contact:
    """The contact through which a pin bears a member: the force on it is against that on the pin."""
    edges = tuple((k, -sign) for k, sign in member.edges)
    return Contact(joint, member.name, by, node, edges, member.bodies, turns)
